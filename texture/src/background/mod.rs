//! Validity without a mesh: what is background is invalid.
//!
//! A background has a color, or several: a checkerboard, blotches, halves of two colors. Its colors
//! are looked for along the image's border (`palette`). Thresholding them is not enough at two
//! places. A texel of such a color amid a chart is content: only background that reaches the image's
//! border, or has the area of a gap between charts, counts (`regions`).
//! And the rim of a chart may be blended with the background, or stained by a lossy codec: then the
//! outermost ring of texels is trimmed (`rims`). A rim that goes on as its chart does stays.
//!
//! Between the charts of a lightmap lie fireflies: texels that a path tracer hit once, of a light
//! far above all others, and of infinite light or none that is a number (`fireflies`).
//!
//! Guaranteed: an image whose charts would lie along its border for the most part, as the ground of
//! a photograph below an overexposed sky does, has no background. Not guaranteed: a picture with a
//! flat frame of its own, white paper say, is taken for charts on a background.

mod fireflies;
mod palette;
mod regions;
mod rims;

use image::{DynamicImage, Rgba32FImage};

use crate::alpha::hidden_texels;
use crate::validity::Validity;
use fireflies::drop_fireflies;
use palette::Palette;
use regions::unused_texels;

/// Background holds at least this share of all texels.
const IMAGE_SHARE: f64 = 0.02;

/// Of the outline of what is left, at most this share lies on the image's border. Of the sample asset
/// that is 0, of an atlas with one of four charts across the border 0.1; of the ground below a sky it
/// is 0.62, and of one swatch of four, or three, 0.5 and 0.75.
const BORDER_OUTLINE: f64 = 1.0 / 3.0;

/// A tolerance above this is one for colors that a lossy codec or a grain has changed, and what is
/// beside those is changed too.
const LOSSY: f32 = 1.0 / 255.0;

/// Where the background of an image lies.
#[derive(Clone, Debug, PartialEq)]
pub struct Background {
    colors: Vec<[f32; 4]>,
    charts: Validity,
    is_blended: bool,
}

impl Background {
    /// The background of an atlas, if it has one that can be told: one color that holds a quarter of
    /// the image's border, or up to 16 that hold half of it together, alternating all along it or
    /// each with charts within. It holds a fiftieth of the image, and what is left is surrounded by
    /// it. Texels of alpha 0 count as surroundings, and their color for nothing.
    ///
    /// `tolerance`: see [`Background::of_colors`]; that of the colors found may be larger, where a
    /// grain lies over them.
    ///
    /// ```
    /// use seamwise_texture::Background;
    /// use seamwise_texture::image::{DynamicImage, Rgb, RgbImage};
    ///
    /// // A blue chart on a checkerboard of gray and white.
    /// let atlas = DynamicImage::ImageRgb8(RgbImage::from_fn(64, 64, |x, y| match (x, y) {
    ///     (16..48, 16..48) => Rgb([20, 60, 200]),
    ///     _ if (x / 8 + y / 8) % 2 == 0 => Rgb([255; 3]),
    ///     _ => Rgb([192; 3]),
    /// }));
    /// let background = Background::detect(&atlas, 0.0).expect("two colors");
    /// assert_eq!(background.colors().len(), 2);
    /// assert_eq!(background.charts().valid(), 32 * 32);
    /// ```
    pub fn detect(image: &DynamicImage, tolerance: f32) -> Option<Self> {
        let hidden = hidden_texels(image);
        let rgba = image.to_rgba32f();
        let size = [rgba.width() as usize, rgba.height() as usize];
        let may_be_grainy = !is_of_floats(image);
        let Palette { colors, tolerance } =
            Palette::find(&rgba, &hidden, tolerance, may_be_grainy)?;
        let unused = unused_texels(&rgba, &colors, tolerance);
        let count = unused.iter().filter(|&&unused| unused).count();
        let around: Vec<bool> = unused.iter().zip(&hidden).map(|(a, b)| *a || *b).collect();
        let left = around.iter().filter(|&&around| !around).count();
        let is_told = left > 0
            && count as f64 >= IMAGE_SHARE * unused.len() as f64
            && regions::outline_on_border(&around, size) <= BORDER_OUTLINE;
        is_told.then(|| Self::new((image, &rgba), colors, &unused, tolerance))
    }

    /// The background of these colors, RGBA as stored (encoded, not linear), 0…1 for integer images;
    /// gray counts as three equal channels, an image without alpha has alpha 1. `tolerance` is the
    /// most that any channel may differ, in the same unit; above a step of 8 bits it is also taken
    /// to say that rims of charts are stained.
    ///
    /// Background are the texels of these colors that are connected, along rows and columns, to the
    /// image's border or to an area of at least 64 texels. Not guaranteed: a chart's own content of
    /// that color and such an area is lost; so is, where rims are trimmed, a chart of two texels'
    /// width.
    ///
    /// In an image of floats fireflies between the charts are background too; so is a small chart
    /// that is far brighter than the rest.
    pub fn of_colors(image: &DynamicImage, colors: &[[f32; 4]], tolerance: f32) -> Self {
        let rgba = image.to_rgba32f();
        let unused = unused_texels(&rgba, colors, tolerance);
        Self::new((image, &rgba), colors.to_vec(), &unused, tolerance)
    }

    /// With an image as it is stored and in floats.
    fn new(
        (image, rgba): (&DynamicImage, &Rgba32FImage),
        colors: Vec<[f32; 4]>,
        unused: &[bool],
        tolerance: f32,
    ) -> Self {
        let size = [image.width() as usize, image.height() as usize];
        if is_of_floats(image) {
            let mut mask = rims::trimmed(unused, size);
            drop_fireflies(rgba, &mut mask);
            let charts = Validity::from_flags(size[0], size[1], mask);
            return Self { colors, charts, is_blended: false };
        }
        let is_blended = tolerance > LOSSY || rims::are_blended(rgba, unused);
        let mask = unused.iter().map(|unused| !unused).collect();
        Self { colors, charts: Validity::from_flags(size[0], size[1], mask), is_blended }
    }

    /// Its colors, RGBA as stored, the most frequent along the border first.
    pub fn colors(&self) -> &[[f32; 4]] {
        &self.colors
    }

    /// The texels that are no background, rims that are stained by it among them.
    pub fn charts(&self) -> &Validity {
        &self.charts
    }

    /// Whether the outermost ring of the charts is blended with the background, or stained by a codec.
    pub fn is_blended(&self) -> bool {
        self.is_blended
    }

    /// The texels to trust: the charts, without their outermost ring if that is blended.
    pub fn validity(&self) -> Validity {
        if self.is_blended { self.charts.without_rims() } else { self.charts.clone() }
    }
}

fn is_of_floats(image: &DynamicImage) -> bool {
    matches!(image, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_))
}

impl Validity {
    /// Only texels all of whose neighbors, along rows, columns and diagonals, are valid too. What lies
    /// beyond the image counts as valid.
    pub fn without_rims(&self) -> Self {
        let size = [self.width(), self.height()];
        let invalid: Vec<bool> = self.flags().iter().map(|valid| !valid).collect();
        Self::from_flags(size[0], size[1], rims::trimmed(&invalid, size))
    }
}

#[cfg(test)]
mod tests;
