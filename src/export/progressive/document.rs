//! Surfaces in a document, in place of the primitives that they are of.

use serde_json::Value;

use super::header::Header;
use crate::document::asset::Asset;
use crate::document::edit::Packer;
use crate::document::primitive::Primitive;
use crate::document::references::replaced_accessors;
use crate::error::{Error, Result};
use crate::export::document::{add_geometry, with_geometry};
use crate::image_file::encoded::EncodedImage;
use crate::level::part::LevelPart;

/// The asset with its primitives replaced by parts, one list per surface; with other images, if there
/// are any.
pub(super) fn with_parts(
    asset: &Asset,
    header: &Header,
    parts: &[Vec<LevelPart>],
    images: &[EncodedImage],
) -> Result<Asset> {
    let all = || header.surfaces.iter().flat_map(|own| &own.parts);
    let is_replaced =
        |own: &Primitive| all().any(|part| [part.mesh, part.primitive] == [own.mesh, own.index]);
    let mut packer = Packer::new(asset, &replaced_accessors(asset, is_replaced)?);
    for (index, image) in images.iter().enumerate() {
        packer.set_image(index, image.clone());
    }
    for (part, made) in all().zip(parts.iter().flatten()) {
        let at = format!("/meshes/{}/primitives/{}", part.mesh, part.primitive);
        let Some(source @ Value::Object(_)) = asset.json.pointer(&at) else {
            return Err(Error::invalid(at, "there is no such primitive"));
        };
        let geometry = add_geometry(&mut packer, made);
        let json = with_geometry(source, geometry)?;
        if let Some(own) = packer.json().pointer_mut(&at) {
            *own = json;
        }
    }
    Ok(packer.finish())
}
