//! Words on pictures, in the letters of a font of 8 by 8 pixels.

use font8x8::UnicodeFonts;
use image::{Rgb, RgbImage};

/// Pixels of a letter each way.
const LETTER: u32 = 8;

/// Writes a line with its top left corner at `x`, `y`, as far as it fits into `width` pixels; what has no
/// letter is a question mark.
pub(crate) fn write(
    picture: &mut RgbImage,
    text: &str,
    [x, y]: [u32; 2],
    width: u32,
    color: Rgb<u8>,
) {
    let room = (width / LETTER) as usize;
    let cut: String = match text.chars().count() > room {
        true => text.chars().take(room.saturating_sub(1)).chain(['~']).collect(),
        false => text.to_owned(),
    };
    for (at, sign) in (0..).zip(cut.chars().take(room)) {
        let fonts = font8x8::BASIC_FONTS.get(sign).or_else(|| font8x8::LATIN_FONTS.get(sign));
        let rows = fonts.or_else(|| font8x8::BASIC_FONTS.get('?')).unwrap_or_default();
        for (row, bits) in (0..).zip(rows) {
            for column in (0..LETTER).filter(|column| bits >> column & 1 == 1) {
                let place = (x + at * LETTER + column, y + row);
                if let Some(pixel) = picture.get_pixel_mut_checked(place.0, place.1) {
                    *pixel = color;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_stays_in_its_room_and_says_that_it_was_cut() {
        let draw = |text: &str, width| {
            let mut picture = RgbImage::new(40, 10);
            write(&mut picture, text, [1, 1], width, Rgb([255; 3]));
            picture
        };
        let lit = |picture: &RgbImage, x: u32| (0..10).any(|y| picture.get_pixel(x, y).0[0] > 0);
        let two = draw("HI", 40);
        assert!((1..8).any(|x| lit(&two, x)) && (9..16).any(|x| lit(&two, x)));
        assert!((17..40).all(|x| !lit(&two, x)));
        assert!((17..40).all(|x| !lit(&draw("HIGHER", 16), x)));
        assert_ne!(draw("HIGHER", 16), draw("HI", 16));
    }
}
