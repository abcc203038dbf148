//! The image of a render: linear light and coverage of each pixel.

use seamwise_texture::color::linear_to_srgb8;

/// Background of a render, in linear light: the gray that is 0.5 in sRGB. Halfway on the screen
/// between black and white, so a hole or a lost outline counts as much on a dark model as on a light
/// one.
pub const BACKGROUND: f32 = 0.214_041_14;

/// A render.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// In pixels.
    pub width: usize,
    /// In pixels.
    pub height: usize,
    /// One per pixel, row-major from the top: linear Rec. 709, 0…1.
    pub rgb: Vec<[f32; 3]>,
    /// One per pixel: a bit for each of its four samples that sees the scene.
    pub coverage: Vec<u8>,
}

impl Image {
    /// The image as a screen shows it: sRGB, 8 bits.
    pub fn to_srgb8(&self) -> image::RgbImage {
        image::RgbImage::from_fn(self.width as u32, self.height as u32, |x, y| {
            let linear = self.rgb[y as usize * self.width + x as usize];
            image::Rgb(linear.map(linear_to_srgb8))
        })
    }
}

/// The rectangle `[left, top, right, bottom]` around what is covered of rows of that width; the last two
/// are not included. `None` if nothing is.
pub(super) fn rectangle(covered: &[bool], width: usize) -> Option<[usize; 4]> {
    let mut rectangle: Option<[usize; 4]> = None;
    for (y, row) in covered.chunks_exact(width.max(1)).enumerate() {
        let Some(first) = row.iter().position(|covered| *covered) else { continue };
        let last = row.iter().rposition(|covered| *covered).unwrap_or(first);
        let [left, top, right, _] = rectangle.unwrap_or([first, y, last, y]);
        rectangle = Some([left.min(first), top, right.max(last + 1), y + 1]);
    }
    rectangle
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rectangle_holds_what_is_covered() {
        let mut covered = [false; 35];
        assert_eq!(rectangle(&covered, 7), None);
        covered[7 + 4] = true;
        assert_eq!(rectangle(&covered, 7), Some([4, 1, 5, 2]));
        (covered[2 * 7 + 1], covered[3 * 7 + 6]) = (true, true);
        assert_eq!(rectangle(&covered, 7), Some([1, 1, 7, 4]));
    }
}
