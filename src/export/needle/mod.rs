//! All levels as files that a page fetches one by one where they are seen: the coarsest level in the file that
//! is opened, finer ones of each mesh and larger sizes of each texture beside it, in a folder of their own.
//!
//! `NEEDLE_progressive` says what there is, in the form that its public schema has:
//!
//! - on a mesh: a `guid`, and `lods` from the finest on, each with the `path` of a .glb that has the mesh with
//!   the same `guid`, its primitives in the same order, and for each of them a density. A loader shows the first
//!   whose density, divided by the share of the screen's height that the primitive takes, is below a target of
//!   its own, and what is inside the file if none is.
//! - on a texture: a `guid`, and `lods` from the largest on, each with the `path` of a .glb that has the texture,
//!   and its `width` and `height`.
//!
//! [`meshes`] tells what densities are, [`textures`] which sizes there are.

mod extension;
mod meshes;
mod sources;
mod textures;

use serde_json::Value;

use super::document::{add_geometry, with_geometry};
use crate::document::asset::Asset;
use crate::document::edit::Packer;
use crate::document::extensions::{drop_unused_extension, name_extension, remove_extension};
use crate::document::known_extensions::lost_with_geometry;
use crate::document::primitive::Primitive;
use crate::document::references::replaced_accessors;
use crate::error::Result;
use extension::{Beside, NAME};
use meshes::{MeshFiles, part_of};
pub(super) use sources::Sources;
use textures::{TextureFiles, texture_files};

/// The document that is opened, and those beside it, each with its name.
///
/// # Errors
/// [`Error::Invalid`](crate::Error::Invalid) if the document's meshes or images are malformed.
pub(super) fn needle_documents(sources: &Sources<'_>) -> Result<(Asset, Vec<(String, Asset)>)> {
    let Sources { asset, levels, stem, .. } = *sources;
    let folder = format!("{stem}_needle");
    let is_replaced = |own: &Primitive| part_of(levels, [own.mesh, own.index]).is_some();
    let mut packer = Packer::new(asset, &replaced_accessors(asset, is_replaced)?);
    let mut beside = Beside { folder: &folder, documents: Vec::new() };
    let TextureFiles { images, textures } = texture_files(sources, &mut beside)?;
    for (index, image) in images.into_iter().enumerate() {
        packer.set_image(index, image);
    }
    for (texture, lods) in textures {
        packer.json()["textures"][texture]["extensions"][NAME] = lods;
    }
    let files = MeshFiles::new(sources)?;
    for mesh in 0..asset.count("meshes") {
        for index in 0..Primitive::of_mesh(asset, mesh)?.len() {
            if let Some(part) = part_of(levels, [mesh, index]) {
                let geometry = add_geometry(&mut packer, part);
                let own = &mut packer.json()["meshes"][mesh]["primitives"][index];
                *own = with_geometry(own, geometry)?;
            }
        }
        if let Some(lods) = files.write(mesh, &mut beside)? {
            packer.json()["meshes"][mesh]["extensions"][NAME] = lods;
        }
    }
    lost_with_geometry().for_each(|name| drop_unused_extension(packer.json(), name));
    name_extension(packer.json(), NAME);
    drop_unused_extension(packer.json(), NAME);
    Ok((packer.finish(), beside.documents))
}

/// Takes from a source what it says of files beside it: they are of its own levels, and not beside the levels that
/// are made of it.
pub(crate) fn drop_files_beside(asset: &mut Asset) {
    for list in ["meshes", "textures"] {
        let objects = asset.json.get_mut(list).and_then(Value::as_array_mut);
        for (index, object) in objects.into_iter().flatten().enumerate() {
            let has_files = object.get("extensions").is_some_and(|own| own.get(NAME).is_some());
            if has_files && remove_extension(object, NAME).is_some() {
                let what = "finer levels in files beside it are not read, and are left out of what is made of it: \
                            bake what these were made of";
                asset.warnings.add(format_args!("/{list}/{index}/extensions/{NAME}"), what);
            }
        }
    }
    drop_unused_extension(&mut asset.json, NAME);
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_a_source_says_of_files_beside_it_is_left_out_with_a_warning() {
        let own =
            json!({NAME: {"guid": "1", "lods": [{"path": "old_needle/mesh_0_0.glb"}]}, "A": {}});
        let json = json!({
            "meshes": [{"primitives": []}, {"primitives": [], "extensions": own}],
            "textures": [{"extensions": {NAME: {}}}],
            "extensionsUsed": ["A", NAME], "extensionsRequired": [NAME],
        });
        let mut asset = Asset { json, ..Asset::default() };
        drop_files_beside(&mut asset);
        let left = json!({
            "meshes": [{"primitives": []}, {"primitives": [], "extensions": {"A": {}}}],
            "textures": [{}], "extensionsUsed": ["A"],
        });
        assert_eq!(asset.json, left);
        let warning = asset.warnings.iter().next().expect("a warning");
        assert_eq!((warning.times, &*warning.at), (2, "/meshes/1/extensions/NEEDLE_progressive"));
    }
}
