//! What the alpha of an atlas does, and its coverage as the atlas is scaled.

use image::DynamicImage;
use seamwise_texture::{Role, Validity, alpha_coverage, keep_coverage, scale_down};

use crate::document::material::AlphaUse;

/// The use of an image's alpha in all materials that have it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Alpha {
    /// Whether some of them hide what has alpha 0: it is the base color of a `MASK` or `BLEND`.
    pub hides: bool,
    /// Whether others show it regardless.
    pub shows: bool,
    /// The least alpha that the first `MASK` among them shows.
    pub cutoff: Option<f32>,
}

impl Alpha {
    pub(super) fn add(&mut self, alpha: AlphaUse) {
        match alpha {
            AlphaUse::CutsAt(cutoff) => {
                self.hides = true;
                self.cutoff = self.cutoff.or(Some(cutoff));
            }
            AlphaUse::Blends => self.hides = true,
            AlphaUse::Shows => self.shows = true,
        }
    }
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

impl KeptCoverage {
    /// For people.
    pub(crate) fn note(&self) -> String {
        let Self { cutoff, before, scaled, after } = self;
        let [before, scaled, after] = [before, scaled, after].map(|share| 100.0 * share);
        format!(
            "alpha is scaled so that {after:.1} % of it pass {cutoff} as {before:.1} % did, not {scaled:.1} %"
        )
    }
}

/// A scaling of an image before its repair.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    pub(crate) role: Role,
    /// Number of halvings of each axis.
    pub(crate) halvings: u32,
    /// The least alpha that passes, if the share of texels that do is to stay.
    pub(crate) cutoff: Option<f32>,
}

impl Scale {
    /// Scales an image and what is valid of it; what was done to its alpha.
    pub(crate) fn down(
        self,
        texels: &mut DynamicImage,
        validity: &mut Validity,
    ) -> seamwise_texture::Result<Option<KeptCoverage>> {
        let before = self.coverage(texels, validity)?;
        (*texels, *validity) = scale_down(texels, self.role, validity, self.halvings)?;
        let (Some(cutoff), Some(before)) = (self.cutoff, before) else {
            return Ok(None);
        };
        let scaled = self.coverage(texels, validity)?.unwrap_or(before);
        keep_coverage(texels, validity, cutoff, before)?;
        let after = self.coverage(texels, validity)?.unwrap_or(before);
        Ok(Some(KeptCoverage { cutoff, before, scaled, after }))
    }

    fn coverage(
        self,
        texels: &DynamicImage,
        validity: &Validity,
    ) -> seamwise_texture::Result<Option<f64>> {
        // A cutoff of 0 or below shows all, and one above 1 nothing.
        let cutoff = self.cutoff.filter(|cutoff| *cutoff > 0.0 && *cutoff <= 1.0);
        cutoff.map_or(Ok(None), |cutoff| alpha_coverage(texels, validity, cutoff))
    }
}
