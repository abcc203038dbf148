//! An image with its mip maps.

use crate::Plane;

/// An image and its mip maps, each half the size of the one before, down to one texel.
#[derive(Clone, Debug)]
pub struct Mips {
    levels: Vec<Plane>,
}
