//! UVs of charts without area (see [`color_charts`]), which name colors: a level has those of the
//! source, to the bit.
//!
//! A collapse unifies wedges of one chart alone, so a level's triangle keeps the chart that it had. Only
//! by rounding, and along lines, its UVs are others than the source's.

use glam::Vec2;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use seamwise_attr::{Level, Mesh, WedgeId};
use seamwise_texture::color_charts;

use super::geometry::Geometry;
use super::part::Part;
use crate::document::asset::Asset;
use crate::document::material::{TextureSlot, material_slots, textures_of};
use crate::error::Result;
use crate::image_file::codec::dimensions;
use crate::limit::MemoryLimit;

/// A chart with more UVs than this is not searched for the nearest.
const MOST_UVS: usize = 4096;

/// The reading of a UV set by the largest image that a part reads in it.
struct Set {
    group: u32,
    uv_set: usize,
    slot: TextureSlot,
    size: [usize; 2],
}

/// Gives the levels of each surface the UVs of the source in charts that are colors.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) if a material or an image is malformed.
pub(crate) fn keep_colors(
    asset: &Asset,
    surfaces: &[Geometry],
    levels: &mut [Vec<Level>],
    limit: MemoryLimit,
) -> Result<()> {
    let slots = material_slots(asset)?;
    let mut sizes: FxHashMap<usize, Option<[usize; 2]>> = FxHashMap::default();
    for (surface, levels) in surfaces.iter().zip(levels) {
        for (group, part) in (0..).zip(&surface.parts) {
            for set in sets(asset, (group, part), &slots, (&mut sizes, limit))? {
                if let Some(colors) = Colors::of(&surface.welded.mesh, &set) {
                    levels.par_iter_mut().for_each(|level| colors.keep(level));
                }
            }
        }
    }
    Ok(())
}

/// The UV sets in which a part reads images.
fn sets(
    asset: &Asset,
    (group, part): (u32, &Part),
    slots: &[Vec<TextureSlot>],
    (sizes, limit): (&mut FxHashMap<usize, Option<[usize; 2]>>, MemoryLimit),
) -> Result<Vec<Set>> {
    let mut sets: Vec<Set> = Vec::new();
    for slot in textures_of(asset, &part.primitive, slots)? {
        let image = &asset.images[slot.image];
        let read = || {
            let at = format!("/images/{}", slot.image);
            (!image.is_missing()).then(|| dimensions(image, &at, limit).ok()).flatten()
        };
        let Some(size) = *sizes.entry(slot.image).or_insert_with(read) else { continue };
        let uv_set = slot.uv_set;
        match sets.iter_mut().find(|own| own.uv_set == uv_set) {
            Some(own) if own.size[0] * own.size[1] >= size[0] * size[1] => {}
            Some(own) => (own.slot, own.size) = (slot.clone(), size),
            None => sets.push(Set { group, uv_set, slot: slot.clone(), size }),
        }
    }
    Ok(sets)
}

/// The charts of a group of triangles that are colors.
struct Colors {
    group: u32,
    uv_set: usize,
    /// One per wedge of the source: its chart, if it is of one.
    charts: FxHashMap<WedgeId, u32>,
    /// The UVs of each chart.
    uvs: FxHashMap<u32, Vec<Vec2>>,
}

impl Colors {
    /// Those of a part in a UV set; `None` if there are none.
    fn of(mesh: &Mesh, Set { group, uv_set, slot, size }: &Set) -> Option<Self> {
        if *uv_set >= mesh.layout.uv_sets {
            return None;
        }
        let own = (0..mesh.triangles.len()).filter(|&triangle| mesh.groups[triangle] == *group);
        let triangles: Vec<[WedgeId; 3]> = own.map(|triangle| mesh.triangles[triangle]).collect();
        let read = |wedge: WedgeId| slot.transform.transform_point2(mesh.uv(wedge, *uv_set));
        let read_uvs: Vec<[Vec2; 3]> = triangles.iter().map(|own| own.map(read)).collect();
        let mut colors = Self {
            group: *group,
            uv_set: *uv_set,
            charts: FxHashMap::default(),
            uvs: FxHashMap::default(),
        };
        for (wedges, chart) in triangles.iter().zip(color_charts(*size, &read_uvs)) {
            let Some(chart) = chart else { continue };
            for &wedge in wedges {
                if colors.charts.insert(wedge, chart).is_none() {
                    colors.uvs.entry(chart).or_default().push(mesh.uv(wedge, *uv_set));
                }
            }
        }
        for uvs in colors.uvs.values_mut() {
            uvs.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
            uvs.dedup();
        }
        (!colors.charts.is_empty()).then_some(colors)
    }

    /// Gives the wedges of a level that are of such a chart the nearest UV of the source in it.
    fn keep(&self, level: &mut Level) {
        let (width, at) = (level.mesh.layout.len(), level.mesh.layout.uv(self.uv_set));
        for triangle in 0..level.mesh.triangles.len() {
            if level.mesh.groups[triangle] != self.group {
                continue;
            }
            for wedge in level.mesh.triangles[triangle] {
                let source = level.wedge_sources[wedge.index()];
                let Some(uvs) = self.charts.get(&source).map(|chart| &self.uvs[chart]) else {
                    continue;
                };
                let own = level.mesh.uv(wedge, self.uv_set);
                let off = |uv: &&Vec2| uv.distance_squared(own);
                let near = uvs.iter().take(MOST_UVS).min_by(|a, b| off(a).total_cmp(&off(b)));
                let uv = near.copied().unwrap_or(own);
                level.mesh.attributes[wedge.index() * width + at..][..2]
                    .copy_from_slice(&uv.to_array());
            }
        }
    }
}
