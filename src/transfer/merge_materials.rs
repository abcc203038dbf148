//! Materials of an asset that become one: those that agree in all that an atlas does not hold,
//! which are alpha mode and cutoff, sides, and extensions.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::layout::{MergeGroup, UvLayout};
use super::merged_material::{MaterialInputs, PLACES, layout};
use crate::document::asset::Asset;
use crate::document::features::has_textures;
use crate::document::material::{TextureSlot, materials_of};
use crate::document::primitive::Primitive;
use crate::error::Result;
use crate::surface::geometry::Geometry;

/// The reason why a material stays by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotMerged {
    /// Variants of the asset put another in its place.
    #[error("variants put others in its place")]
    Variants,
    /// Points or lines use it, whose reads no chart bounds.
    #[error("points or lines use it")]
    BeyondCharts,
    /// Channels of an animation point to it.
    #[error("an animation changes it")]
    Animated,
    /// It has a texture that is none of the core's, or a direction that depends on its UVs.
    #[error("it has an extension that an atlas does not hold")]
    Extension,
    /// An image file is not there.
    #[error("one of its images is missing")]
    Missing,
    /// The triangles that use it lack the UVs, or have more sets of them than levels are made of.
    #[error("what uses it has no UVs for it")]
    NoCharts,
    /// Ids or properties are read in a texture by the UVs of what uses it.
    #[error("ids in a texture need the UVs of what uses it")]
    Ids,
    /// No other has its alpha mode, cutoff, sides and extensions.
    #[error("no other agrees with it in alpha mode, sides and extensions")]
    Alone,
}

/// The merging of an asset's materials.
#[derive(Clone, Debug, Default)]
pub(crate) struct Merging {
    /// A layout for each merged material.
    pub(crate) layouts: Vec<UvLayout>,
    /// By material: the reason why it is not merged, though surfaces use it.
    pub(crate) not_merged: BTreeMap<usize, NotMerged>,
}

impl Merging {
    /// Finds the materials that can be merged; `slots` has the textures of each material.
    pub(crate) fn new(
        asset: &Asset,
        surfaces: &[Geometry],
        slots: &[Vec<TextureSlot>],
    ) -> Result<Self> {
        let mut merging = Self::default();
        let mut merge_groups: Vec<(Value, Vec<MaterialInputs<'_>>)> = Vec::new();
        let fixed = fixed(asset, surfaces)?;
        for (material, groups) in wearers(asset, surfaces)? {
            let own = &slots[material];
            let why = fixed.get(&material).copied();
            if let Some(why) = why.or_else(|| unfit(asset, surfaces, (material, &groups), own)) {
                merging.not_merged.insert(material, why);
                continue;
            }
            let at = format!("/materials/{material}");
            let slots = PLACES.map(|place| own.iter().find(|s| s.at == format!("{at}/{place}")));
            let input = MaterialInputs { material, json: asset.parse(&at)?, slots, groups };
            let key = agreement(&asset.json["materials"][material]);
            match merge_groups.iter_mut().find(|(other, _)| *other == key) {
                Some((_, inputs)) => inputs.push(input),
                None => merge_groups.push((key, vec![input])),
            }
        }
        for (key, inputs) in merge_groups {
            match inputs.as_slice() {
                [alone] => drop(merging.not_merged.insert(alone.material, NotMerged::Alone)),
                inputs => merging.layouts.push(layout(key, inputs, surfaces)),
            }
        }
        Ok(merging)
    }

    /// The merged materials.
    pub(crate) fn merge_groups(&self) -> impl Iterator<Item = &MergeGroup> {
        self.layouts.iter().filter_map(|layout| layout.merge_group.as_ref())
    }
}

/// Surfaces and groups by the material that they use.
fn wearers(asset: &Asset, surfaces: &[Geometry]) -> Result<BTreeMap<usize, Vec<(usize, u32)>>> {
    let mut wearers: BTreeMap<usize, Vec<(usize, u32)>> = BTreeMap::new();
    for (index, surface) in surfaces.iter().enumerate() {
        for (group, part) in (0..).zip(&surface.parts) {
            for material in materials_of(asset, &part.primitive)? {
                let groups = wearers.entry(material).or_default();
                if groups.last() != Some(&(index, group)) {
                    groups.push((index, group));
                }
            }
        }
    }
    Ok(wearers)
}

/// Materials that something else refers to: variants, points and lines, animations.
fn fixed(asset: &Asset, surfaces: &[Geometry]) -> Result<BTreeMap<usize, NotMerged>> {
    let mut fixed = BTreeMap::new();
    animated(asset.json.get("animations").unwrap_or(&Value::Null), &mut fixed);
    for mesh in 0..asset.count("meshes") {
        for own in Primitive::of_mesh(asset, mesh)?.iter().filter(|own| !own.is_surface()) {
            fixed.extend(
                materials_of(asset, own)?.into_iter().map(|m| (m, NotMerged::BeyondCharts)),
            );
        }
    }
    for part in surfaces.iter().flat_map(|surface| &surface.parts) {
        let materials = materials_of(asset, &part.primitive)?;
        if materials.len() > 1 {
            fixed.extend(materials.into_iter().map(|material| (material, NotMerged::Variants)));
        } else if has_textures(asset, &part.primitive) {
            fixed.extend(materials.into_iter().map(|material| (material, NotMerged::Ids)));
        }
    }
    Ok(fixed)
}

/// Materials that a pointer in animations leads to.
fn animated(json: &Value, found: &mut BTreeMap<usize, NotMerged>) {
    match json {
        Value::String(text) => {
            let index = text.strip_prefix("/materials/").and_then(|rest| rest.split('/').next());
            found.extend(index.and_then(|i| i.parse().ok()).map(|i| (i, NotMerged::Animated)));
        }
        Value::Array(list) => list.iter().for_each(|own| animated(own, found)),
        Value::Object(object) => object.values().for_each(|own| animated(own, found)),
        _ => {}
    }
}

/// The reason why a material can't be merged with any, if there is one.
fn unfit(
    asset: &Asset,
    surfaces: &[Geometry],
    (material, groups): (usize, &[(usize, u32)]),
    slots: &[TextureSlot],
) -> Option<NotMerged> {
    let at = format!("/materials/{material}/");
    let is_core = |slot: &TextureSlot| PLACES.iter().any(|place| slot.at[at.len()..] == **place);
    let anisotropy = asset.json.pointer(&format!("{at}extensions/KHR_materials_anisotropy"));
    let lacks_uvs = |slot: &TextureSlot| {
        let sets = |&(surface, _): &(usize, u32)| surfaces[surface].welded.mesh.layout.uv_sets;
        groups.iter().map(sets).any(|sets| slot.uv_set >= sets)
    };
    if !slots.iter().all(is_core) || anisotropy.is_some() {
        Some(NotMerged::Extension)
    } else if slots.iter().any(|slot| asset.images[slot.image].is_missing()) {
        Some(NotMerged::Missing)
    } else {
        slots.iter().any(lacks_uvs).then_some(NotMerged::NoCharts)
    }
}

/// The properties that materials of a merge group agree in, as the beginning of the merged one.
fn agreement(material: &Value) -> Value {
    let mut own = Map::new();
    let mut keep = |key: &str, default: Value| {
        if let Some(value) = material.get(key).filter(|value| **value != default) {
            own.insert(key.to_owned(), value.clone());
        }
    };
    keep("alphaMode", json!("OPAQUE"));
    if material.get("alphaMode") == Some(&json!("MASK")) {
        keep("alphaCutoff", json!(0.5));
    }
    keep("doubleSided", json!(false));
    keep("extensions", json!({}));
    Value::Object(own)
}
