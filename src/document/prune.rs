//! Taking out of a document what no level uses any more: materials that others stand for, with the
//! textures and images that only they had.
//!
//! The rest moves up. Where an extension that we do not know might refer to one of them by its
//! index, all stay where they are, and the images shrink to a texel.

use std::collections::BTreeSet;

use image::DynamicImage;
use serde_json::{Value, json};

use super::asset::Asset;
use super::edit::{Packer, drop_from};
use super::known_extensions::known;
use super::material::slots;
use crate::error::Result;
use crate::image_file::codec::encode;
use crate::image_file::encoded::ImageFormat;

/// Textures and images that only some materials use.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Leftovers {
    textures: BTreeSet<usize>,
    pub(crate) images: BTreeSet<usize>,
}

impl Leftovers {
    /// The textures and images that only the given materials use.
    pub(crate) fn of(asset: &Asset, materials: &BTreeSet<usize>) -> Result<Self> {
        let mut left = [BTreeSet::new(), BTreeSet::new()];
        let mut kept = [BTreeSet::new(), BTreeSet::new()];
        for material in 0..asset.count("materials") {
            let own = if materials.contains(&material) { &mut left } else { &mut kept };
            for slot in slots(asset, material)? {
                own[0].extend(asset.reference(&slot.at, "index", "textures")?);
                own[1].insert(slot.image);
            }
        }
        let [textures, images] = [0, 1].map(|list| &left[list] - &kept[list]);
        Ok(Self { textures, images })
    }
}

/// Takes out materials that no primitive uses, and the textures and images that only they had.
pub(crate) fn prune(packer: &mut Packer, materials: &BTreeSet<usize>) -> Result<()> {
    if materials.is_empty() {
        return Ok(());
    }
    let Leftovers { textures, images } = Leftovers::of(packer.asset(), materials)?;
    if !is_known(packer.json()) {
        let texel = encode(&DynamicImage::new_rgb8(1, 1), ImageFormat::Png)?;
        images.into_iter().for_each(|image| packer.set_image(image, texel.clone()));
        return Ok(());
    }
    let mut infos = Vec::new();
    for material in 0..packer.asset().count("materials") {
        infos.extend(slots(packer.asset(), material)?.into_iter().map(|slot| slot.at));
    }
    // A texture with two images has two slots.
    infos.dedup();
    let json = packer.json();
    let moved = moved(json, "textures", &textures);
    for info in infos {
        json.pointer_mut(&info).into_iter().for_each(|info| change(info, "index", &moved));
    }
    let moved = self::moved(json, "images", &images);
    list(json, "textures").iter_mut().for_each(|texture| change_all(texture, "source", &moved));
    let moved = self::moved(json, "materials", materials);
    for mesh in list(json, "meshes") {
        change_all(mesh, "material", &moved);
    }
    drop_from(json, "materials", materials);
    drop_from(json, "textures", &textures);
    packer.drop_images(&images);
    Ok(())
}

/// Whether all that may refer to something by its index is known.
fn is_known(json: &Value) -> bool {
    let used = json.get("extensionsUsed").and_then(Value::as_array);
    used.into_iter()
        .flatten()
        .filter_map(Value::as_str)
        .all(|name| known(name).is_some_and(|known| !known.holds_indices))
}

fn list<'a>(json: &'a mut Value, name: &str) -> &'a mut [Value] {
    json.get_mut(name).and_then(Value::as_array_mut).map_or(&mut [], Vec::as_mut_slice)
}

/// One per entry of a list: where it will be.
fn moved(json: &mut Value, name: &str, gone: &BTreeSet<usize>) -> Vec<usize> {
    let before = |index| index - gone.range(..index).count();
    (0..list(json, name).len()).map(before).collect()
}

/// Changes an index under a key.
fn change(json: &mut Value, key: &str, moved: &[usize]) {
    if let Some(value) = json.get_mut(key)
        && let Some(index) = value.as_u64().and_then(|index| moved.get(index as usize))
    {
        *value = json!(index);
    }
}

/// Changes every index under a key, of all that lies below as well but for extras.
fn change_all(json: &mut Value, key: &str, moved: &[usize]) {
    change(json, key, moved);
    match json {
        Value::Object(object) => {
            let own =
                object.iter_mut().filter(|(name, _)| *name != "extras" && *name != "attributes");
            own.for_each(|(_, value)| change_all(value, key, moved));
        }
        Value::Array(list) => list.iter_mut().for_each(|value| change_all(value, key, moved)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image_file::encoded::EncodedImage;

    fn asset() -> Asset {
        let image = |byte: u8| EncodedImage { bytes: vec![byte].into(), format: ImageFormat::Png };
        let base =
            |index: usize| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": index}}});
        Asset {
            json: json!({
                "meshes": [{"primitives": [
                    {"attributes": {}, "material": 2, "extras": {"material": 2}},
                    {"attributes": {}, "material": 1, "extensions": {"KHR_materials_variants": {
                        "mappings": [{"variants": [0], "material": 3}]}}},
                ]}],
                "materials": [base(0), base(1), base(3), base(2)],
                "textures": [
                    {"source": 0}, {"source": 1}, {"source": 0},
                    {"source": 2, "extensions": {"EXT_texture_webp": {"source": 3}}},
                ],
                "images": [{}, {}, {}, {"bufferView": 0}],
                "bufferViews": [{"buffer": 0, "byteLength": 3}],
                "buffers": [{"byteLength": 3}],
            }),
            buffers: vec![vec![0; 3].into()],
            images: (0..4).map(image).collect(),
            ..Asset::default()
        }
    }

    #[test]
    fn what_only_dropped_materials_had_goes_and_the_rest_moves_up() {
        let mut packer = Packer::new(&asset(), &[]);
        prune(&mut packer, &BTreeSet::from([0, 1])).unwrap();
        let pruned = packer.finish();
        let json = &pruned.json;
        assert_eq!((pruned.count("materials"), pruned.count("textures")), (2, 2));
        // The image of the first texture is that of the third as well.
        let bytes: Vec<u8> = pruned.images.iter().map(|image| image.bytes[0]).collect();
        assert_eq!((pruned.count("images"), bytes), (3, vec![0, 2, 3]));
        assert_eq!(json["textures"][1]["extensions"]["EXT_texture_webp"]["source"], 2);
        assert_eq!(json["textures"][0]["source"], 0);
        let info = "/materials/0/pbrMetallicRoughness/baseColorTexture/index";
        assert_eq!(json.pointer(info), Some(&json!(1)));
        let primitives = &json["meshes"][0]["primitives"];
        assert_eq!(
            (&primitives[0]["material"], &primitives[0]["extras"]["material"]),
            (&json!(0), &json!(2))
        );
        let mapping = "/extensions/KHR_materials_variants/mappings/0/material";
        assert_eq!(primitives[1].pointer(mapping), Some(&json!(1)));
        let mut packer = Packer::new(&asset(), &[]);
        prune(&mut packer, &BTreeSet::from([2])).unwrap();
        assert_eq!(packer.finish().count("bufferViews"), 0, "the image's bytes go as well");
    }

    #[test]
    fn where_an_unknown_extension_might_refer_to_them_all_stay_and_images_shrink() {
        let mut asset = asset();
        asset.json["extensionsUsed"] = json!(["EXT_unknown"]);
        let mut packer = Packer::new(&asset, &[]);
        prune(&mut packer, &BTreeSet::from([1, 2])).unwrap();
        let pruned = packer.finish();
        assert_eq!((pruned.json, pruned.images[0].bytes[0]), (asset.json, 0));
        assert!(pruned.images[1..].iter().all(|image| image.bytes.len() > 1));
    }
}
