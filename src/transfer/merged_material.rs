//! Materials that become one, and what is folded into its atlas.
//!
//! An atlas holds textures and factors, texel by texel: base color and alpha, metalness and
//! roughness, normals, occlusion and emission. A texture t with a factor f reads t·f, in linear light,
//! and one with an occlusion strength s reads 1 + s·(t − 1); a material without a texture reads white,
//! or a flat normal. In the merged material all factors are 1, but for those in which all agree and
//! none has a texture.

use glam::{Affine2, Vec3, Vec4};
use gltf::json::material::{AlphaMode, Material};
use gltf::json::validation::Checked;
use seamwise_texture::{Role, Wrap};
use serde_json::{Value, json};

use super::layout::{Charts, Class, Folded, FoldedReading, SourceReading, UvLayout};
use crate::document::material::TextureSlot;
use crate::surface::geometry::Geometry;

const BASE_COLOR: &str = "pbrMetallicRoughness/baseColorTexture";
const METALLIC_ROUGHNESS: &str = "pbrMetallicRoughness/metallicRoughnessTexture";
const NORMAL: &str = "normalTexture";
const OCCLUSION: &str = "occlusionTexture";
const EMISSIVE: &str = "emissiveTexture";
/// The textures that an atlas holds.
pub(super) const PLACES: [&str; 5] = [BASE_COLOR, METALLIC_ROUGHNESS, NORMAL, OCCLUSION, EMISSIVE];

/// A material as an atlas holds it.
pub(super) struct Look<'a> {
    pub(super) material: usize,
    pub(super) json: Material,
    /// One per place.
    pub(super) slots: [Option<&'a TextureSlot>; 5],
    /// The surfaces and groups that use it.
    pub(super) groups: Vec<(usize, u32)>,
}

impl Look<'_> {
    fn slot(&self, place: &str) -> Option<&TextureSlot> {
        self.slots[PLACES.iter().position(|own| *own == place)?]
    }

    fn is_opaque(&self) -> bool {
        self.json.alpha_mode == Checked::Valid(AlphaMode::Opaque)
    }

    fn base_color(&self) -> Vec4 {
        let color = Vec4::from_array(self.json.pbr_metallic_roughness.base_color_factor.0);
        if self.is_opaque() { color.with_w(1.0) } else { color }
    }

    /// Factors on occlusion, roughness and metalness as an image holds them; no occlusion yet.
    fn roughness_metalness(&self) -> Vec3 {
        let pbr = &self.json.pbr_metallic_roughness;
        Vec3::new(0.0, pbr.roughness_factor.0, pbr.metallic_factor.0)
    }

    fn emission(&self) -> Vec3 {
        Vec3::from_array(self.json.emissive_factor.0)
    }

    /// The share of occlusion that is seen; none without a texture.
    fn occlusion(&self) -> f32 {
        self.json.occlusion_texture.as_ref().map_or(0.0, |own| own.strength.0)
    }

    /// Whether occlusion lies in the image of metalness and roughness, if it has any.
    fn is_packed(&self) -> bool {
        let Some(own) = self.slot(OCCLUSION) else { return true };
        let is_same = |with: &TextureSlot| {
            (with.image, with.uv_set, with.transform) == (own.image, own.uv_set, own.transform)
        };
        self.slot(METALLIC_ROUGHNESS).is_some_and(is_same)
    }

    fn reading(&self, place: &str, factor: Vec4, offset: Vec4) -> FoldedReading {
        let source = self.slot(place).map(|slot| {
            let &TextureSlot { image, uv_set, transform, wrap, normal_scale, .. } = slot;
            (image, SourceReading { uv_set, transform, wrap, normal_scale })
        });
        FoldedReading { source, factor, offset }
    }
}

/// The layout and the material of a class.
pub(super) fn layout(mut json: Value, looks: &[Look<'_>], surfaces: &[Geometry]) -> UvLayout {
    let (mut charts, mut chart_looks) = (Vec::new(), Vec::new());
    for (index, look) in looks.iter().enumerate() {
        let anew = |&(surface, group): &(usize, u32)| Charts {
            surface,
            group,
            uv_set: 0,
            transform: Affine2::IDENTITY,
        };
        charts.extend(look.groups.iter().map(anew));
        chart_looks.extend(look.groups.iter().map(|_| index));
    }
    let is_unlit = json.pointer("/extensions/KHR_materials_unlit").is_some();
    let mut class = Fold { looks, chart_looks: &chart_looks, json: &mut json, outputs: Vec::new() };
    class.base_color();
    if !is_unlit {
        class.surface();
        class.normals(charts.iter().all(|own| surfaces[own.surface].welded.mesh.layout.normal));
    }
    class.emission();
    let outputs = class.outputs;
    json["name"] = json!("merged");
    let materials: Vec<usize> = looks.iter().map(|look| look.material).collect();
    let chart_materials = chart_looks.into_iter().map(|index| materials[index]).collect();
    UvLayout {
        charts,
        wrap: [Wrap::Clamp; 2],
        images: Vec::new(),
        is_new: true,
        class: Some(Class { materials, json, chart_materials, outputs }),
    }
}

/// A class in the making.
struct Fold<'a> {
    looks: &'a [Look<'a>],
    /// One per entry of the layout's charts: its look.
    chart_looks: &'a [usize],
    json: &'a mut Value,
    outputs: Vec<Folded>,
}

impl<'a> Fold<'a> {
    fn has(&self, place: &str) -> bool {
        self.looks.iter().any(|look| look.slot(place).is_some())
    }

    /// Whether the materials differ in something, or in what a texture shows.
    fn varies<T: PartialEq>(&self, place: &str, of: impl Fn(&Look<'a>) -> T) -> bool {
        self.has(place) || self.looks.iter().any(|look| of(look) != of(&self.looks[0]))
    }

    fn add(
        &mut self,
        places: &[&'static str],
        (role, channels): (Role, usize),
        reading: impl Fn(&Look<'_>) -> FoldedReading,
    ) {
        let readings = self.chart_looks.iter().map(|&index| reading(&self.looks[index])).collect();
        let places = places.to_vec();
        self.outputs.push(Folded { places, role, channels, readings, is_gained: false });
    }

    fn base_color(&mut self) {
        if !self.varies(BASE_COLOR, Look::base_color) {
            let color = self.looks[0].base_color();
            self.json["pbrMetallicRoughness"]["baseColorFactor"] = json!(color.to_array());
            return;
        }
        let channels = if self.looks[0].is_opaque() { 3 } else { 4 };
        self.add(&[BASE_COLOR], (Role::Color, channels), |look| match look.is_opaque() {
            // What it stores as alpha is not seen, and weighs nothing.
            true => look.reading(BASE_COLOR, look.base_color().with_w(0.0), Vec4::W),
            false => look.reading(BASE_COLOR, look.base_color(), Vec4::ZERO),
        });
    }

    /// Metalness, roughness and occlusion.
    fn surface(&mut self) {
        let occluded = |look: &Look<'_>| {
            let seen = look.occlusion();
            (Vec4::X * seen, Vec4::new(1.0 - seen, 0.0, 0.0, 1.0))
        };
        let has_occlusion = self.has(OCCLUSION);
        let is_packed = has_occlusion && self.looks.iter().all(Look::is_packed);
        if self.varies(METALLIC_ROUGHNESS, Look::roughness_metalness) {
            let places = [METALLIC_ROUGHNESS, OCCLUSION];
            let places = if is_packed { &places[..] } else { &places[..1] };
            self.add(places, (Role::Data, 3), |look| {
                let (seen, unseen) =
                    if is_packed { occluded(look) } else { (Vec4::ZERO, Vec4::ONE) };
                let factor = seen + look.roughness_metalness().extend(0.0);
                look.reading(METALLIC_ROUGHNESS, factor, unseen * Vec4::new(1.0, 0.0, 0.0, 1.0))
            });
        } else {
            let own = self.looks[0].roughness_metalness();
            self.json["pbrMetallicRoughness"]["roughnessFactor"] = json!(own.y);
            self.json["pbrMetallicRoughness"]["metallicFactor"] = json!(own.z);
        }
        if has_occlusion && !is_packed {
            self.add(&[OCCLUSION], (Role::Data, 1), |look| {
                let (factor, offset) = occluded(look);
                look.reading(OCCLUSION, factor, offset)
            });
        }
    }

    /// The normal map; `can_gain` tells whether all surfaces have normals to bend.
    fn normals(&mut self, can_gain: bool) {
        let is_gained = !self.has(NORMAL);
        if is_gained && !(can_gain && PLACES.iter().any(|place| self.has(place))) {
            return;
        }
        self.add(&[NORMAL], (Role::Normal, 3), |look| look.reading(NORMAL, Vec4::ONE, Vec4::ZERO));
        self.outputs.last_mut().into_iter().for_each(|own| own.is_gained = is_gained);
    }

    fn emission(&mut self) {
        if self.varies(EMISSIVE, Look::emission) {
            self.json["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
            self.add(&[EMISSIVE], (Role::Color, 3), |look| {
                look.reading(EMISSIVE, look.emission().extend(0.0), Vec4::W)
            });
        } else if self.looks[0].emission() != Vec3::ZERO {
            self.json["emissiveFactor"] = json!(self.looks[0].emission().to_array());
        }
    }
}
