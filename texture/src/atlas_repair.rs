//! The repair of an atlas image, step by step in the one order that works: padding that may be
//! trusted stays, the image gets smaller from valid texels alone, all others are filled, and both sides
//! of seams are made to read the same.

use image::DynamicImage;

use crate::alpha::{alpha_coverage, keep_coverage};
use crate::equalize::{self, Equalized, Seam};
use crate::error::Result;
use crate::padding::keep_padding;
use crate::repair::{Outcome, fill};
use crate::role::Role;
use crate::scale::scale_down;
use crate::validity::Validity;
use crate::wrap::Wrap;

/// A repair of an image in memory.
///
/// Which texels are valid is told by UVs ([`Validity::from_charts`]), by a mask
/// ([`Validity::from_mask`]) or by the background between the charts
/// ([`Background::detect`](crate::Background::detect)).
///
/// ```
/// use seamwise_texture::image::{DynamicImage, Rgb, RgbImage};
/// use seamwise_texture::{Repair, Role, Validity, Wrap, glam::Vec2};
///
/// // A red chart on the left half of an atlas that is magenta elsewhere.
/// let paint = |x, _| if x < 8 { Rgb([200, 30, 20]) } else { Rgb([255, 0, 255]) };
/// let mut atlas = DynamicImage::ImageRgb8(RgbImage::from_fn(16, 16, paint));
/// let uvs = [[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [0.0, 1.0]].map(Vec2::from_array);
/// let mut validity =
///     Validity::from_charts(16, 16, [Wrap::Clamp; 2], &uvs, &[[0, 1, 2], [0, 2, 3]]);
///
/// let done = Repair::new(Role::Color).wrap([Wrap::Clamp; 2]).run(&mut atlas, &mut validity)?;
/// assert_eq!(done.outcome.filled, 128);
/// assert_eq!(atlas.to_rgb8().get_pixel(15, 8), &Rgb([200, 30, 20]));
/// # Ok::<(), seamwise_texture::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Repair<'a> {
    role: Role,
    wrap: [Wrap; 2],
    rings: usize,
    halvings: u32,
    cutoff: Option<f32>,
    fills_hidden: bool,
    seams: &'a [Seam],
    equalize: Option<equalize::Options>,
}

/// The result of each step of a [`Repair`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RepairSummary {
    /// Number of texels of padding that were kept.
    pub padding: usize,
    /// The shares of texels that pass the alpha cutoff, if they were to be kept and the image was
    /// scaled down.
    pub coverage: Option<KeptCoverage>,
    /// The result of the fill.
    pub outcome: Outcome,
    /// The result of the equalization, if there was one.
    pub equalized: Option<Equalized>,
}

/// The alpha of an image that was scaled down, scaled so that as many texels pass a cutoff as before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeptCoverage {
    /// The least alpha that passes.
    pub cutoff: f32,
    /// The share of valid texels that passed in the image as it was…
    pub before: f64,
    /// …in the smaller one…
    pub scaled: f64,
    /// …and in that with its alpha scaled.
    pub after: f64,
}

impl<'a> Repair<'a> {
    /// A repair of texels of this meaning, which repeat beyond the image's edges: a fill alone.
    pub fn new(role: Role) -> Self {
        Self {
            role,
            wrap: [Wrap::Repeat; 2],
            rings: 0,
            halvings: 0,
            cutoff: None,
            fills_hidden: false,
            seams: &[],
            equalize: None,
        }
    }

    /// How the sampler reads beyond the edges, along u and v.
    #[must_use]
    pub fn wrap(self, wrap: [Wrap; 2]) -> Self {
        Self { wrap, ..self }
    }

    /// Keeps up to so many rings of texels around the charts that agree with them: see
    /// [`keep_padding`](fn@keep_padding).
    #[must_use]
    pub fn keep_padding(self, rings: usize) -> Self {
        Self { rings, ..self }
    }

    /// Halves both sides so many times first, each texel the mean of valid ones.
    #[must_use]
    pub fn halve(self, halvings: u32) -> Self {
        Self { halvings, ..self }
    }

    /// Scales the alpha of a smaller image so that as large a share of it passes `cutoff`, 0…1; not
    /// at all without one.
    #[must_use]
    pub fn keep_coverage(self, cutoff: Option<f32>) -> Self {
        Self { cutoff, ..self }
    }

    /// Whether the colors of valid texels of alpha 0 are filled too, from those that are seen and whatever
    /// the role: for images whose alpha says how much of a texel is there, and nothing else.
    #[must_use]
    pub fn fill_hidden(self, fills_hidden: bool) -> Self {
        Self { fills_hidden, ..self }
    }

    /// Makes both sides of seams read the same after the fill, unless there are no options for it.
    #[must_use]
    pub fn equalize(self, seams: &'a [Seam], options: Option<equalize::Options>) -> Self {
        Self { seams, equalize: options, ..self }
    }

    /// Repairs `image`. `validity` is of its size and tells which texels stay to the bit; in the end it is
    /// of the size of the result, and padding that was kept is valid.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if `validity` has another size than `image`, or the image
    /// is of a kind that [`repair`](fn@crate::repair) does not know.
    pub fn run(&self, image: &mut DynamicImage, validity: &mut Validity) -> Result<RepairSummary> {
        let Self { role, wrap, .. } = *self;
        let padding = keep_padding(image, role, validity, wrap, self.rings)?;
        let coverage = if self.halvings > 0 { self.scale(image, validity)? } else { None };
        let outcome = fill(image, role, validity, wrap, self.fills_hidden)?;
        let equalize =
            |options| equalize::equalize(image, role, validity, wrap, self.seams, options);
        let equalized = self.equalize.map(equalize).transpose()?;
        Ok(RepairSummary { padding, coverage, outcome, equalized })
    }

    /// Scales an image and what is valid of it; the result tells what was done to its alpha.
    fn scale(
        &self,
        image: &mut DynamicImage,
        validity: &mut Validity,
    ) -> Result<Option<KeptCoverage>> {
        let before = self.coverage(image, validity)?;
        (*image, *validity) = scale_down(image, self.role, validity, self.halvings)?;
        let (Some(cutoff), Some(before)) = (self.cutoff, before) else { return Ok(None) };
        let scaled = self.coverage(image, validity)?.unwrap_or(before);
        keep_coverage(image, validity, cutoff, before)?;
        let after = self.coverage(image, validity)?.unwrap_or(before);
        Ok(Some(KeptCoverage { cutoff, before, scaled, after }))
    }

    fn coverage(&self, image: &DynamicImage, validity: &Validity) -> Result<Option<f64>> {
        // A cutoff of 0 or below shows all, and one above 1 nothing.
        let cutoff = self.cutoff.filter(|cutoff| *cutoff > 0.0 && *cutoff <= 1.0);
        cutoff.map_or(Ok(None), |cutoff| alpha_coverage(image, validity, cutoff))
    }
}
