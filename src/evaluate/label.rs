//! Words on pictures, in the letters of a font of 8 by 8 pixels.

use font8x8::UnicodeFonts;
use image::{Rgb, RgbImage};

/// Pixels of a letter each way.
const LETTER: u32 = 8;
/// Pixels of a picture across for each pixel that a dot of a letter is wide.
const SIDE_PER_DOT: u32 = 256;
/// Pixels above a line and below it.
const MARGIN: u32 = 3;
const INK: Rgb<u8> = Rgb([255; 3]);

/// Pixels that the dots of the letters are wide above a picture of so many.
fn dot(side: u32) -> u32 {
    (side / SIDE_PER_DOT).max(1)
}

/// Pixels that a name takes above a picture of so many pixels across.
pub(crate) fn head(side: u32) -> u32 {
    LETTER * dot(side) + 2 * MARGIN
}

/// Writes the name of a picture of `side` pixels across into its head, the top left corner of which is at
/// `x`, `y`, as far as it fits; what has no letter is a question mark.
pub(crate) fn write_head(picture: &mut RgbImage, text: &str, [x, y]: [u32; 2], side: u32) {
    let (dot, y) = (dot(side), y + MARGIN);
    let room = (side / (LETTER * dot)) as usize;
    let cut: String = match text.chars().count() > room {
        true => text.chars().take(room.saturating_sub(1)).chain(['~']).collect(),
        false => text.to_owned(),
    };
    for (at, sign) in (0..).zip(cut.chars().take(room)) {
        let fonts = font8x8::BASIC_FONTS.get(sign).or_else(|| font8x8::LATIN_FONTS.get(sign));
        let rows = fonts.or_else(|| font8x8::BASIC_FONTS.get('?')).unwrap_or_default();
        for (row, bits) in (0..).zip(rows) {
            for column in (0..LETTER).filter(|column| bits >> column & 1 == 1) {
                let corner = [x + (at * LETTER + column) * dot, y + row * dot];
                fill(picture, corner, dot);
            }
        }
    }
}

fn fill(picture: &mut RgbImage, [x, y]: [u32; 2], side: u32) {
    for at in 0..side * side {
        if let Some(pixel) = picture.get_pixel_mut_checked(x + at % side, y + at / side) {
            *pixel = INK;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_stays_in_its_room_and_says_that_it_was_cut() {
        let draw = |text: &str, width| {
            let mut picture = RgbImage::new(40, head(width));
            write_head(&mut picture, text, [1, 0], width);
            picture
        };
        let lit = |picture: &RgbImage, x: u32| (0..14).any(|y| picture.get_pixel(x, y).0[0] > 0);
        let two = draw("HI", 40);
        assert!((1..8).any(|x| lit(&two, x)) && (9..16).any(|x| lit(&two, x)));
        assert!((17..40).all(|x| !lit(&two, x)));
        assert!((17..40).all(|x| !lit(&draw("HIGHER", 16), x)));
        assert_ne!(draw("HIGHER", 16), draw("HI", 16));
    }

    #[test]
    fn letters_grow_with_the_picture() {
        let mut large = RgbImage::new(512, head(512));
        write_head(&mut large, "seam", [0, 0], 512);
        let lit = |x: u32, y: u32| large.get_pixel(x, y).0[0] > 0;
        assert_eq!(large.height(), 22);
        let blocks = |x: u32, y: u32| [lit(x, y), lit(x + 1, y), lit(x, y + 1), lit(x + 1, y + 1)];
        let all = (0..32).flat_map(|x| (0..8).map(move |y| blocks(2 * x, 3 + 2 * y)));
        assert!(
            all.clone().all(|block| block == [block[0]; 4]) && all.clone().any(|block| block[0])
        );
    }
}
