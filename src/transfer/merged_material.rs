//! Materials that become one, and the textures and factors that are baked into its atlas.
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

use super::layout::{BakedReading, BakedTexture, ChartGroup, MergeGroup, SourceReading, UvLayout};
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
pub(super) struct MaterialInputs<'a> {
    pub(super) material: usize,
    pub(super) json: Material,
    /// One per place.
    pub(super) slots: [Option<&'a TextureSlot>; 5],
    /// The surfaces and groups that use it.
    pub(super) groups: Vec<(usize, u32)>,
}

impl MaterialInputs<'_> {
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

    fn reading(&self, place: &str, factor: Vec4, offset: Vec4) -> BakedReading {
        let source = self.slot(place).map(|slot| {
            let &TextureSlot { image, uv_set, transform, wrap, normal_scale, .. } = slot;
            (image, SourceReading { uv_set, transform, wrap, normal_scale })
        });
        BakedReading { source, factor, offset }
    }
}

/// The layout and the material of a merge group.
pub(super) fn layout(
    mut json: Value,
    inputs: &[MaterialInputs<'_>],
    surfaces: &[Geometry],
) -> UvLayout {
    let (mut charts, mut chart_inputs) = (Vec::new(), Vec::new());
    for (index, input) in inputs.iter().enumerate() {
        let anew = |&(surface, group): &(usize, u32)| ChartGroup {
            surface,
            group,
            uv_set: 0,
            transform: Affine2::IDENTITY,
        };
        charts.extend(input.groups.iter().map(anew));
        chart_inputs.extend(input.groups.iter().map(|_| index));
    }
    let is_unlit = json.pointer("/extensions/KHR_materials_unlit").is_some();
    let mut merge_group =
        BakePlan { inputs, chart_inputs: &chart_inputs, json: &mut json, outputs: Vec::new() };
    merge_group.base_color();
    if !is_unlit {
        merge_group.surface();
        merge_group
            .normals(charts.iter().all(|own| surfaces[own.surface].welded.mesh.layout.normal));
    }
    merge_group.emission();
    let outputs = merge_group.outputs;
    json["name"] = json!("merged");
    let materials: Vec<usize> = inputs.iter().map(|input| input.material).collect();
    let chart_materials = chart_inputs.into_iter().map(|index| materials[index]).collect();
    UvLayout {
        charts,
        wrap: [Wrap::Clamp; 2],
        images: Vec::new(),
        is_new: true,
        merge_group: Some(MergeGroup { materials, json, chart_materials, outputs }),
    }
}

/// A merge group in the making.
struct BakePlan<'a> {
    inputs: &'a [MaterialInputs<'a>],
    /// One per entry of the layout's charts: its input.
    chart_inputs: &'a [usize],
    json: &'a mut Value,
    outputs: Vec<BakedTexture>,
}

impl<'a> BakePlan<'a> {
    fn has(&self, place: &str) -> bool {
        self.inputs.iter().any(|input| input.slot(place).is_some())
    }

    /// Whether the materials differ in something, or in what a texture shows.
    fn varies<T: PartialEq>(&self, place: &str, of: impl Fn(&MaterialInputs<'a>) -> T) -> bool {
        self.has(place) || self.inputs.iter().any(|input| of(input) != of(&self.inputs[0]))
    }

    fn add(
        &mut self,
        places: &[&'static str],
        (role, channels): (Role, usize),
        reading: impl Fn(&MaterialInputs<'_>) -> BakedReading,
    ) {
        let readings =
            self.chart_inputs.iter().map(|&index| reading(&self.inputs[index])).collect();
        let places = places.to_vec();
        self.outputs.push(BakedTexture { places, role, channels, readings, is_gained: false });
    }

    fn base_color(&mut self) {
        if !self.varies(BASE_COLOR, MaterialInputs::base_color) {
            let color = self.inputs[0].base_color();
            self.json["pbrMetallicRoughness"]["baseColorFactor"] = json!(color.to_array());
            return;
        }
        let channels = if self.inputs[0].is_opaque() { 3 } else { 4 };
        self.add(&[BASE_COLOR], (Role::Color, channels), |input| match input.is_opaque() {
            // What it stores as alpha is not seen, and weighs nothing.
            true => input.reading(BASE_COLOR, input.base_color().with_w(0.0), Vec4::W),
            false => input.reading(BASE_COLOR, input.base_color(), Vec4::ZERO),
        });
    }

    /// Metalness, roughness and occlusion.
    fn surface(&mut self) {
        let occluded = |input: &MaterialInputs<'_>| {
            let seen = input.occlusion();
            (Vec4::X * seen, Vec4::new(1.0 - seen, 0.0, 0.0, 1.0))
        };
        let has_occlusion = self.has(OCCLUSION);
        let is_packed = has_occlusion && self.inputs.iter().all(MaterialInputs::is_packed);
        if self.varies(METALLIC_ROUGHNESS, MaterialInputs::roughness_metalness) {
            let places = [METALLIC_ROUGHNESS, OCCLUSION];
            let places = if is_packed { &places[..] } else { &places[..1] };
            self.add(places, (Role::Data, 3), |input| {
                let (seen, unseen) =
                    if is_packed { occluded(input) } else { (Vec4::ZERO, Vec4::ONE) };
                let factor = seen + input.roughness_metalness().extend(0.0);
                input.reading(METALLIC_ROUGHNESS, factor, unseen * Vec4::new(1.0, 0.0, 0.0, 1.0))
            });
        } else {
            let own = self.inputs[0].roughness_metalness();
            self.json["pbrMetallicRoughness"]["roughnessFactor"] = json!(own.y);
            self.json["pbrMetallicRoughness"]["metallicFactor"] = json!(own.z);
        }
        if has_occlusion && !is_packed {
            self.add(&[OCCLUSION], (Role::Data, 1), |input| {
                let (factor, offset) = occluded(input);
                input.reading(OCCLUSION, factor, offset)
            });
        }
    }

    /// The normal map; `can_gain` tells whether all surfaces have normals to bend.
    fn normals(&mut self, can_gain: bool) {
        let is_gained = !self.has(NORMAL);
        if is_gained && !(can_gain && PLACES.iter().any(|place| self.has(place))) {
            return;
        }
        self.add(&[NORMAL], (Role::Normal, 3), |input| {
            input.reading(NORMAL, Vec4::ONE, Vec4::ZERO)
        });
        self.outputs.last_mut().into_iter().for_each(|own| own.is_gained = is_gained);
    }

    fn emission(&mut self) {
        if self.varies(EMISSIVE, MaterialInputs::emission) {
            self.json["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
            self.add(&[EMISSIVE], (Role::Color, 3), |input| {
                input.reading(EMISSIVE, input.emission().extend(0.0), Vec4::W)
            });
        } else if self.inputs[0].emission() != Vec3::ZERO {
            self.json["emissiveFactor"] = json!(self.inputs[0].emission().to_array());
        }
    }
}
