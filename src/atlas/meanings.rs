//! Which images are pictures of one meaning, that may be scaled and compressed as such.

use seamwise_texture::Role;

use super::image::atlas_of_each;
use crate::document::asset::Asset;
use crate::document::material::{TextureSlot, material_slots};
use crate::error::Result;
use crate::image_file::codec::dimensions;
use crate::limit::MemoryLimit;

/// The reason why an image is no picture of one meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoPicture {
    /// No primitive uses it.
    Unused,
    /// Its file is not there.
    Missing,
    /// It is read both as color and as other data.
    Mixed,
    /// Its charts are single colors, which neighbors must not be mixed with.
    Colors,
}

/// One per image: what its texels mean, or why it is no picture.
///
/// # Errors
/// [`Error::Invalid`](crate::Error::Invalid) if the document or the header of an image is malformed.
pub(crate) fn meanings(
    asset: &Asset,
    limit: MemoryLimit,
) -> Result<Vec<std::result::Result<Role, NoPicture>>> {
    let slots = material_slots(asset)?.concat();
    let is_color = |slot: &TextureSlot| slot.role == Role::Color;
    let mut meanings = Vec::new();
    for (image, atlas) in atlas_of_each(asset)?.into_iter().enumerate() {
        let file = &asset.images[image];
        let mut own = slots.iter().filter(|slot| slot.image == image);
        let Some(atlas) = atlas else {
            meanings.push(Err(NoPicture::Unused));
            continue;
        };
        meanings.push(if file.is_missing() {
            Err(NoPicture::Missing)
        } else if own.clone().any(is_color) && !own.all(is_color) {
            Err(NoPicture::Mixed)
        } else if !atlas.charts.triangles.is_empty()
            && atlas.charts.are_colors(dimensions(file, &format!("/images/{image}"), limit)?)
        {
            Err(NoPicture::Colors)
        } else {
            Ok(atlas.role)
        });
    }
    Ok(meanings)
}
