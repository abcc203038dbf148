//! The meaning of texels.

/// The meaning of an image's samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Role {
    /// Base color, emission: sRGB in integer images, linear light in float images.
    #[default]
    Color,
    /// A normal map: unit vectors stored as (v + 1) / 2 in three channels.
    Normal,
    /// Anything else, channel by channel as stored: occlusion, roughness, metalness, masks.
    Data,
}
