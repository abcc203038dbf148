//! The choice between the source's image, which levels share, and one of a level's own.
//!
//! Both are held against the source at places all over the level (see [`errors`](fn@seamwise_texture::transfer::errors)).
//! A shared image costs nothing and shows its finest print, but not where UVs have slid or a seam has
//! moved; an own one costs its bytes and is sampled once more, which blurs. An own image has to be
//! better by a twentieth to be worth its bytes.
//!
//! Unless a budget is given, all own images of all levels together take as many bytes as the source's
//! textures at most, so that a file of the source and all levels holds twice as many.

use serde::Serialize;

use seamwise_texture::Role;
use seamwise_texture::transfer::ImageErrors;

/// The error of an own image over that of the shared one from which on it is worth its bytes.
const WORTH: f64 = 0.95;
/// Luminance that is lost by a radian in a normal, about, and by a unit of roughness or occlusion.
const SHADING: f64 = 0.5;
const DATA: f64 = 0.2;
/// Places at which images are compared.
pub(super) const PLACES: usize = 50_000;

/// The choice of an image for a level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TextureChoice {
    /// The level, 1 for the first.
    pub level: usize,
    /// Whether the level has its own.
    pub own: bool,
    /// The RMS error of the source's image on the level: of sRGB colors, of data, or of directions of
    /// shading in radians.
    pub shared_error: f64,
    /// The same of an image of the level's own.
    pub own_error: f64,
    /// Width and height of the level's own.
    pub own_size: [usize; 2],
    /// Bytes of the level's own; from the source's and its size where it was not stored.
    pub own_bytes: usize,
    /// Whether it is a normal map where the source has none.
    pub gained: bool,
    /// The squared error in what is seen that an own image takes away, over the whole level.
    #[serde(skip)]
    pub(super) worth: f64,
}

/// The worth of an own image: see [`TextureChoice::worth`].
pub(super) fn worth(errors: &ImageErrors, role: Role) -> f64 {
    let seen = match role {
        Role::Color => 1.0,
        Role::Normal => SHADING,
        Role::Data => DATA,
    };
    errors.share * seen * seen * (errors.shared.powi(2) - errors.own.powi(2)).max(0.0)
}

/// Whether an own image is worth its bytes.
pub(super) fn is_worth(errors: &ImageErrors) -> bool {
    errors.own < WORTH * errors.shared
}
