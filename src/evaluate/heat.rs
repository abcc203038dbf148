//! Where two renders of one camera differ, as a picture: the difference in sRGB luminance from
//! black over red and yellow to white.

use image::{Rgb, RgbImage};
use seamwise_texture::color::{linear_to_srgb, luminance};

use super::render::Image;

/// The difference in sRGB luminance that is shown white: an eighth of the way from black to white.
pub const WHITE: f32 = 1.0 / 8.0;

/// The difference of two images of one size.
pub fn difference_map(reference: &Image, candidate: &Image) -> RgbImage {
    let encoded = |rgb: [f32; 3]| linear_to_srgb(luminance(rgb).clamp(0.0, 1.0));
    RgbImage::from_fn(reference.width as u32, reference.height as u32, |x, y| {
        let at = y as usize * reference.width + x as usize;
        heat_color((encoded(reference.rgb[at]) - encoded(candidate.rgb[at])).abs())
    })
}

/// The color of a difference in sRGB luminance, 0…1; all from [`WHITE`] on are white.
pub fn heat_color(difference: f32) -> Rgb<u8> {
    let thirds = difference / WHITE * 3.0;
    Rgb([0.0, 1.0, 2.0].map(|start| ((thirds - start).clamp(0.0, 1.0) * 255.0) as u8))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heat_rises_over_red_and_yellow_to_white() {
        let colors = [0.0, 1.0, 2.0, 3.0, 9.0].map(|third| heat_color(third / 24.0).0);
        assert_eq!(colors[..3], [[0; 3], [255, 0, 0], [255, 255, 0]]);
        assert_eq!(colors[3..], [[255; 3]; 2]);
    }

    #[test]
    fn the_map_is_of_srgb_luminance() {
        let image = |rgb| Image { width: 2, height: 1, rgb, coverage: vec![15; 2] };
        // 0.5 and 7/12 in sRGB: two thirds of an eighth apart.
        let [gray, lighter] = [0.5f32, 0.583_333_3].map(|srgb| {
            let linear = ((srgb + 0.055) / 1.055).powf(2.4);
            [linear; 3]
        });
        let map = difference_map(&image(vec![gray; 2]), &image(vec![gray, lighter]));
        assert_eq!(map.get_pixel(0, 0).0, [0; 3]);
        let [red, green, blue] = map.get_pixel(1, 0).0;
        assert!(red == 255 && green > 253 && blue < 2, "{red} {green} {blue}");
    }
}
