//! KTX2 files with Basis Universal textures, as `KHR_texture_basisu` has them: `container` is their form,
//! `decode` reads the first level of one, `encode` writes one in UASTC with all of its mip maps.

pub(crate) mod container;
pub(crate) mod decode;
pub(crate) mod encode;
