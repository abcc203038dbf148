//! Putting a level's textures into a document: in place of the source's where a level stands alone,
//! beside them where all levels share a document.

use std::sync::Arc;

use serde_json::{Value, json};

use crate::document::asset::Asset;
use crate::document::edit::{Packer, put};
use crate::document::material::slots;
use crate::error::{Error, Result};
use crate::level::textures::LevelTextures;

/// Replaces the textures of the document's own materials. Returns one entry per material of the
/// source: the one that stands for it.
pub(crate) fn replace_textures(
    packer: &mut Packer,
    textures: &LevelTextures,
) -> Result<Vec<usize>> {
    for (index, image) in textures.images.iter().enumerate() {
        packer.set_image(index, image.clone());
    }
    for &material in &textures.repacked {
        for slot in slots(packer.asset(), material)? {
            packer.json().pointer_mut(&slot.at).into_iter().for_each(read_plainly);
        }
    }
    let mut materials: Vec<usize> = (0..packer.asset().count("materials")).collect();
    add_colors(packer, textures, &materials);
    add_normals(packer, textures, &materials)?;
    add_merged(packer, textures, &mut materials);
    Ok(materials)
}

/// Adds merged materials, and puts them in the place of those that they stand for.
fn add_merged(packer: &mut Packer, textures: &LevelTextures, materials: &mut [usize]) {
    const CLAMP: u32 = gltf::json::texture::CLAMP_TO_EDGE;
    for merged in &textures.merged {
        let mut json = merged.json.clone();
        let sampler = json!({"magFilter": 9729, "minFilter": 9987, "wrapS": CLAMP, "wrapT": CLAMP});
        let sampler = put(packer.json(), "samplers", None, sampler);
        for (places, image) in &merged.images {
            let source = packer.add_image(image.clone());
            let texture = json!({"sampler": sampler, "source": source});
            let texture = put(packer.json(), "textures", None, texture);
            for place in places {
                let at = place.split('/').fold(&mut json, |json, key| &mut json[key]);
                at["index"] = json!(texture);
            }
        }
        let own = put(packer.json(), "materials", None, json);
        merged.materials.iter().for_each(|&material| materials[material] = own);
    }
}

/// Adds the materials and textures of a level beside those of the source: one entry per material of the source, the
/// material that the level uses instead. `materials` and images of `source` are those of the
/// document's beginning.
pub(crate) fn add_level_materials(
    packer: &mut Packer,
    source: &Asset,
    textures: &LevelTextures,
) -> Result<Vec<usize>> {
    let new = add_textures(packer, source, textures);
    let gains = |material| {
        let normals = textures.normals.iter().map(|own| &own.materials);
        let mut all = normals.chain(textures.colors.iter().map(|own| &own.materials));
        all.any(|own| own.contains(&material))
    };
    let mut materials = Vec::new();
    for material in 0..source.count("materials") {
        let mut json = source.json["materials"][material].clone();
        let at = format!("/materials/{material}");
        let mut is_other = gains(material);
        let own = if textures.is_merged(material) { Vec::new() } else { slots(source, material)? };
        for slot in own {
            let texture = source.reference(&slot.at, "index", "textures")?.unwrap_or_default();
            let info = slot.at.strip_prefix(&at).and_then(|own| json.pointer_mut(own));
            if let (Some(info), Some(new)) = (info, new[texture]) {
                info["index"] = json!(new);
                if textures.repacked.contains(&material) {
                    read_plainly(info);
                }
                is_other = true;
            }
        }
        let own = if is_other { put(packer.json(), "materials", None, json) } else { material };
        materials.push(own);
    }
    add_colors(packer, textures, &materials);
    add_normals(packer, textures, &materials)?;
    add_merged(packer, textures, &mut materials);
    Ok(materials)
}

/// Adds images that differ from the document's, and a texture for each that shows one. One per texture
/// of the source: what stands for it.
fn add_textures(
    packer: &mut Packer,
    source: &Asset,
    textures: &LevelTextures,
) -> Vec<Option<usize>> {
    let mut new = Vec::new();
    for (index, image) in textures.images.iter().enumerate() {
        let is_same = Arc::ptr_eq(&packer.asset().images[index].bytes, &image.bytes);
        new.push((!is_same).then(|| packer.add_image(image.clone())));
    }
    let mut texture_of = Vec::new();
    for texture in source.json["textures"].as_array().into_iter().flatten() {
        let mut json = texture.clone();
        let is_other = redirect(&mut json, &new);
        texture_of.push(is_other.then(|| put(packer.json(), "textures", None, json)));
    }
    texture_of
}

/// Reads a texture in the first UV set, as it is.
fn read_plainly(info: &mut Value) {
    let Some(info) = info.as_object_mut() else { return };
    info.shift_remove("texCoord");
    if let Some(extensions) = info.get_mut("extensions").and_then(Value::as_object_mut) {
        extensions.shift_remove("KHR_texture_transform");
        if extensions.is_empty() {
            info.shift_remove("extensions");
        }
    }
}

/// Turns every source of a texture, its extensions' too, to the new images; false if it has none.
fn redirect(texture: &mut Value, new: &[Option<usize>]) -> bool {
    let mut is_other = false;
    for (key, value) in texture.as_object_mut().into_iter().flatten() {
        let image = value.as_u64().and_then(|image| *new.get(image as usize)?);
        match (key.as_str(), image) {
            ("source", Some(image)) => {
                *value = json!(image);
                is_other = true;
            }
            _ => is_other |= value.is_object() && redirect(value, new),
        }
    }
    is_other
}

/// Adds base colors; `materials` tells where those of the source stand.
fn add_colors(packer: &mut Packer, textures: &LevelTextures, materials: &[usize]) {
    for colors in &textures.colors {
        let texture = json!({"source": packer.add_image(colors.image.clone())});
        let info = json!({"index": put(packer.json(), "textures", None, texture)});
        for &material in &colors.materials {
            let own = &mut packer.json()["materials"][materials[material]];
            own["pbrMetallicRoughness"]["baseColorTexture"] = info.clone();
        }
    }
}

/// Adds normal maps; `materials` tells where those of the source stand.
fn add_normals(packer: &mut Packer, textures: &LevelTextures, materials: &[usize]) -> Result<()> {
    for normals in &textures.normals {
        let image = packer.add_image(normals.image.clone());
        let (mut texture, mut info) = (json!({"source": image}), json!({}));
        if let Some(at) = &normals.like {
            let invalid = || Error::invalid(at, "there is no such texture");
            info = packer.json().pointer(at).cloned().ok_or_else(invalid)?;
            let like = info["index"].as_u64().ok_or_else(invalid)? as usize;
            if let Some(sampler) = packer.json()["textures"][like].get("sampler") {
                texture["sampler"] = sampler.clone();
            }
        }
        info["index"] = json!(put(packer.json(), "textures", None, texture));
        if normals.materials.iter().all(|material| textures.repacked.contains(material)) {
            read_plainly(&mut info);
        }
        for &material in &normals.materials {
            packer.json()["materials"][materials[material]]["normalTexture"] = info.clone();
        }
    }
    Ok(())
}
