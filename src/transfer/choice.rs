//! The choice between the source's image, which levels share, and one of a level's own in one of several
//! sizes.
//!
//! All are held against the source at places all over the level (see
//! [`errors`](fn@seamwise_texture::transfer::errors)), as they are stored. A shared image costs nothing
//! and shows its finest print, but not where UVs have slid or a seam has moved; an own one costs its
//! bytes and is sampled once more, which blurs. Each image of a material is chosen by itself: a color may
//! stay shared where normals are a level's own, and each has a size of its own.
//!
//! Unless a budget is given, own images of all levels together add as many bytes as the source's textures
//! have, or a byte for each texel of the source, or 64 KiB, if that is more: a palette of few colors packs
//! into so little that nothing else, a normal map least of all, would have room. In a file of all levels each adds
//! all of its bytes; where each level is a file of its own, which holds a shared image too, only those
//! that it has more than that.
//!
//! Measured, lit luminance and color of auto over the better of repair and transfer, a scanned box with a
//! palette at 25 and 6.25 %: 1.00 1.04 and 1.02 1.37 with the source's bytes and one size for all images of
//! a material, as colors were cut with the normals; **1.00 1.03 and 1.00 1.00** as it is.

use image::DynamicImage;
use serde::Serialize;

use seamwise_texture::{Role, Validity, scale_down_often};

use crate::error::{Error, Result};
use crate::image_file::encoded::EncodedImage;
use crate::image_file::ktx2::encode::stored_size;

/// The most halvings of an image that is chosen among.
const HALVINGS: u32 = 3;
/// A smaller side is not made for a choice.
const LEAST_SIDE: usize = 64;
/// The error of an own image over that of the shared one, or of a smaller one of its own, from which on
/// it is worth its bytes.
const WORTH: f64 = 0.98;
/// Luminance that is lost by a radian in a normal, about, and by a unit of roughness or occlusion.
const SHADING: f64 = 0.5;
const DATA: f64 = 0.2;
/// Places at which images are compared.
pub(super) const PLACES: usize = 50_000;

/// The choice of an image for a level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TextureChoice {
    /// The level, 1 for the first.
    pub level: usize,
    /// Whether the level has its own.
    pub own: bool,
    /// The reason.
    pub why: ChoiceReason,
    /// The RMS error of the source's image on the level: of sRGB colors, of data, or of directions of
    /// shading in radians.
    pub shared_error: f64,
    /// The same of the chosen image, or of the largest of the level's own where it has none.
    pub own_error: f64,
    /// Its width and height.
    pub own_size: [usize; 2],
    /// Its bytes.
    pub own_bytes: usize,
    /// Whether it is a normal map where the source has none.
    pub gained: bool,
    /// All images of the level's own that were made, the largest first.
    pub candidates: Vec<Candidate>,
}

/// An image of a level's own that may be chosen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Candidate {
    /// Width and height.
    pub size: [usize; 2],
    /// Bytes of the file.
    pub bytes: usize,
    /// RMS error.
    pub error: f64,
}

/// The reason of a choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum ChoiceReason {
    /// No image of the level's own shows less error than the source's.
    #[error("none of its own shows less error")]
    NoBetter,
    /// Shading is off by less than is seen, so that no normal map is gained.
    #[error("shading has lost nothing that is seen")]
    NotLost,
    /// The level's own shows the least error.
    #[error("it shows the least error")]
    Better,
    /// A larger one of its own would show less error, but not for bytes that are worth more elsewhere.
    #[error("the bytes of a larger one are worth more elsewhere")]
    SmallerForBudget,
    /// One of its own would show less error, but for bytes that are worth more elsewhere.
    #[error("the bytes of one of its own are worth more elsewhere")]
    SharedForBudget,
}

/// An image of a level with all that it may be.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    /// The image that it replaces, or the one whose layout a gained normal map has.
    pub(super) image: usize,
    pub(super) role: Role,
    pub(super) gained: bool,
    /// RMS error of the source's.
    pub(super) shared_error: f64,
    /// The share of the level that uses it.
    pub(super) share: f64,
    /// Bytes that are saved by not sharing: those of the source's image where each level is a file.
    pub(super) shared_bytes: usize,
    /// Of the level's own, the largest first; none where shading has lost nothing.
    pub(super) own: Vec<(Candidate, EncodedImage)>,
}

impl Measured {
    /// The squared error that is seen over the whole level with one of its own, or the source's.
    pub(super) fn loss(&self, own: Option<usize>) -> f64 {
        let seen = match self.role {
            Role::Color => 1.0,
            Role::Normal => SHADING,
            Role::Data => DATA,
        };
        let error = own.map_or(self.shared_error, |own| self.own[own].0.error);
        self.share * (seen * error).powi(2)
    }

    pub(super) fn bytes(&self, own: Option<usize>) -> usize {
        own.map_or(self.shared_bytes, |own| self.own[own].0.bytes)
    }

    /// What may be chosen, the smallest first: each is worth its bytes beside all that are smaller.
    pub(super) fn options(&self) -> Vec<Option<usize>> {
        let mut options = vec![None];
        let mut least = self.shared_error;
        for own in (0..self.own.len()).rev() {
            let error = self.own[own].0.error;
            if error < WORTH * least {
                options.push(Some(own));
                least = error;
            }
        }
        options
    }

    /// The report of a choice for a level.
    pub(super) fn choice(&self, level: usize, own: Option<usize>) -> TextureChoice {
        let best = self.options().last().copied().flatten();
        let why = match (own, best) {
            _ if self.own.is_empty() => ChoiceReason::NotLost,
            (None, None) => ChoiceReason::NoBetter,
            (None, Some(_)) => ChoiceReason::SharedForBudget,
            (own, best) if own == best => ChoiceReason::Better,
            _ => ChoiceReason::SmallerForBudget,
        };
        let candidates: Vec<Candidate> = self.own.iter().map(|own| own.0).collect();
        let none = Candidate { size: [0; 2], bytes: 0, error: self.shared_error };
        let told = candidates.get(own.unwrap_or(0)).copied().unwrap_or(none);
        TextureChoice {
            level,
            own: own.is_some(),
            why,
            shared_error: self.shared_error,
            own_error: told.error,
            own_size: told.size,
            own_bytes: told.bytes,
            gained: self.gained,
            candidates,
        }
    }
}

/// An image in its own size and in smaller ones, of whole blocks if they are to be compressed; none at all if it is
/// not wanted.
pub(super) fn smaller(
    (image, validity): &(DynamicImage, Validity),
    role: Role,
    (is_wanted, in_blocks): (bool, bool),
) -> Result<Vec<(DynamicImage, Validity)>> {
    if !is_wanted {
        return Ok(Vec::new());
    }
    let sides = [image.width() as usize, image.height() as usize];
    let is_made = |halvings: &u32| {
        let size = sides.map(|side| side >> halvings);
        size[0].min(size[1]) >= LEAST_SIDE && !(in_blocks && stored_size(size) != size)
    };
    let times = (1..=HALVINGS).take_while(is_made).count() as u32;
    let mut all = vec![(image.clone(), validity.clone())];
    all.extend(scale_down_often(image, role, validity, times).map_err(Error::internal)?);
    Ok(all)
}
