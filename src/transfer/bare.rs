//! Textures for surfaces whose source has none, and no UVs for any: the colors of their vertices as a base color,
//! and the shape that a level has lost as a normal map, in charts that levels gain.
//!
//! A base color is the `COLOR_0` of the source's surface, in linear light as glTF has it, stored in sRGB with
//! eight bits a channel; levels have no `COLOR_0` then, and the material's own factor stays. Guaranteed: no
//! material that anything else uses, with UVs or as points and lines, changes. Not guaranteed: colors beyond 0…1
//! and finer than eight bits.

use std::collections::{BTreeMap, BTreeSet};

use glam::Affine2;
use seamwise_texture::Wrap;

use super::layout::{ChartGroup, NewColors, NewNormals, UvLayout};
use super::options::BakeNormals;
use super::plan::Plan;
use crate::document::asset::Asset;
use crate::document::material::{TextureSlot, materials_of};
use crate::document::primitive::Primitive;
use crate::error::Result;
use crate::surface::geometry::Geometry;

impl Plan {
    /// Plans them, in a layout for each material that bare surfaces alone use.
    pub(super) fn add_bare(
        &mut self,
        asset: &Asset,
        surfaces: &[Geometry],
        slots: &[Vec<TextureSlot>],
        normals: BakeNormals,
    ) -> Result<()> {
        let has = |material: usize, extension: &str| {
            let at = format!("/materials/{material}/extensions/{extension}");
            asset.json.pointer(&at).is_some()
        };
        for (material, charts) in bare(asset, surfaces, slots)? {
            let layouts = charts.iter().map(|own| surfaces[own.surface].welded.mesh.layout);
            let channels = layouts.clone().map(|layout| layout.color).max().unwrap_or(0);
            let is_colored = channels > 0 && !has(material, "KHR_materials_pbrSpecularGlossiness");
            let is_lit = !has(material, "KHR_materials_unlit");
            let is_bent = layouts.clone().all(|layout| layout.normal);
            let gains = is_lit && is_bent && normals != BakeNormals::Off;
            let materials = vec![material];
            if is_colored {
                let (charts, materials) = (charts.clone(), materials.clone());
                self.colors.push(NewColors { charts, materials, channels });
            }
            if gains {
                self.normals.push(NewNormals { charts: charts.clone(), materials, like: None });
            }
            if is_colored || gains {
                let (wrap, images) = ([Wrap::default(); 2], Vec::new());
                let layout = UvLayout { charts, wrap, images, is_new: true, merge_group: None };
                self.layouts.push(layout);
            }
        }
        Ok(())
    }
}

/// By material: the parts that use it, of surfaces without UVs all of whose materials no other primitive uses.
fn bare(
    asset: &Asset,
    surfaces: &[Geometry],
    slots: &[Vec<TextureSlot>],
) -> Result<BTreeMap<usize, Vec<ChartGroup>>> {
    let mut uses: BTreeMap<usize, usize> = BTreeMap::new();
    for mesh in 0..asset.count("meshes") {
        for primitive in Primitive::of_mesh(asset, mesh)? {
            for material in materials_of(asset, &primitive)? {
                *uses.entry(material).or_default() += 1;
            }
        }
    }
    let is_bare = |surface: &usize| surfaces[*surface].welded.mesh.layout.uv_sets == 0;
    let mut open: BTreeSet<usize> = (0..surfaces.len()).filter(is_bare).collect();
    loop {
        let mut found: BTreeMap<usize, Vec<ChartGroup>> = BTreeMap::new();
        let mut others = BTreeSet::new();
        for &surface in &open {
            for (group, part) in (0..).zip(&surfaces[surface].parts) {
                let [material] = materials_of(asset, &part.primitive)?[..] else {
                    others.insert(surface);
                    continue;
                };
                let transform = Affine2::IDENTITY;
                let charts = ChartGroup { surface, group, uv_set: 0, transform };
                found.entry(material).or_default().push(charts);
            }
        }
        found.retain(|material, charts| {
            let is_alone = slots[*material].is_empty() && uses[material] == charts.len();
            if !is_alone {
                others.extend(charts.iter().map(|own| own.surface));
            }
            is_alone
        });
        if others.is_empty() {
            return Ok(found);
        }
        open.retain(|surface| !others.contains(surface));
    }
}
