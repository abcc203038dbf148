//! The uses of images: by which triangles, in which UVs and roles.

use glam::Vec2;
use seamwise_attr::{Mesh, area_vector};
use seamwise_texture::color_charts;
use seamwise_texture::transfer::{Face, overlap};
use seamwise_texture::{Role, Wrap};

use super::layout::{ChartGroup, ImageUse, SharedReason, SourceReading, faces};
use crate::document::asset::Asset;
use crate::document::features::has_textures;
use crate::document::material::{TextureSlot, main_role, textures_of};
use crate::document::primitive::Primitive;
use crate::error::Result;
use crate::image_file::codec::dimensions;
use crate::image_file::encoded::EncodedImage;
use crate::limit::MemoryLimit;
use crate::surface::geometry::Geometry;

/// Texels of a side at which overlaps are looked for.
const COVERAGE_SIDE: usize = 512;
/// More than this share of its covered texels at several places, and a layout is not to be told apart.
const MOST_OVERLAP: f64 = 0.02;
/// An image is shared from this share of the surface on that reads it by charts without area. A scan
/// has fewer triangles that its unwrapping missed.
const MOST_COLORS: f64 = 0.002;

/// Images in sets: two are in one if the same triangles use both.
pub(super) fn used_together(uses: &[Used]) -> Vec<Vec<usize>> {
    type Set = (Vec<usize>, Vec<(usize, u32)>);
    let mut sets: Vec<Set> = Vec::new();
    for (image, used) in uses.iter().enumerate().filter(|(_, used)| !used.charts.is_empty()) {
        let own: Vec<(usize, u32)> = used.charts.iter().map(|c| (c.surface, c.group)).collect();
        let (with, apart): (Vec<_>, Vec<_>) =
            sets.into_iter().partition(|(_, groups)| groups.iter().any(|g| own.contains(g)));
        let (mut images, mut groups) = (vec![image], own);
        for (other, more) in with {
            images.extend(other);
            groups.extend(more);
        }
        images.sort_unstable();
        sets = apart;
        sets.push((images, groups));
    }
    sets.into_iter().map(|(images, _)| images).collect()
}

/// The uses of an image.
#[derive(Clone, Debug, Default)]
pub(super) struct Used {
    pub(super) role: Role,
    pub(super) wrap: [Wrap; 2],
    pub(super) charts: Vec<ChartGroup>,
    /// One per entry of `charts`.
    pub(super) readings: Vec<SourceReading>,
    /// Width and height; 0 if its file can't be read.
    size: [usize; 2],
    is_used: bool,
    is_missing: bool,
    beyond_charts: bool,
    lacks_uvs: bool,
    has_ids: bool,
}

impl Used {
    fn add(&mut self, slot: &TextureSlot) {
        self.role = if self.is_used { main_role(self.role, slot.role) } else { slot.role };
        self.wrap = slot.wrap;
        self.is_used = true;
    }

    fn add_charts(&mut self, surface: usize, group: u32, slot: &TextureSlot, mesh: &Mesh) {
        let charts = ChartGroup { surface, group, uv_set: slot.uv_set, transform: slot.transform };
        if slot.uv_set >= mesh.layout.uv_sets {
            self.lacks_uvs = true;
        } else if !self.charts.contains(&charts) {
            let &TextureSlot { uv_set, transform, wrap, normal_scale, .. } = slot;
            self.charts.push(charts);
            self.readings.push(SourceReading { uv_set, transform, wrap, normal_scale });
        }
    }

    /// The reason why it can't be made anew in its own layout, if there is one.
    pub(super) fn shared(&self, surfaces: &[Geometry]) -> Option<SharedReason> {
        self.unfit(|| false).or_else(|| {
            let meshes: Vec<&Mesh> = surfaces.iter().map(|surface| &surface.welded.mesh).collect();
            let faces = faces(&self.charts, &meshes);
            let share = self.colors(&faces, &meshes);
            if share > MOST_COLORS {
                return Some(SharedReason::Colors(share));
            }
            let spans = |face: &Face| {
                let [a, b, c] = face.uvs;
                (a.max(b).max(c) - a.min(b).min(c)).max_element() > 1.0
            };
            if faces.iter().any(spans) {
                return Some(SharedReason::Tiling);
            }
            let share = overlap(&faces, [COVERAGE_SIDE; 2], self.wrap);
            (share > MOST_OVERLAP).then_some(SharedReason::Overlap(share))
        })
    }

    /// The share of the surface that uses it by charts without area.
    fn colors(&self, faces: &[Face], meshes: &[&Mesh]) -> f64 {
        let uvs: Vec<[Vec2; 3]> = faces.iter().map(|face| face.uvs).collect();
        let (mut colors, mut all) = (0.0, 0.0);
        for (face, chart) in faces.iter().zip(color_charts(self.size, &uvs)) {
            let corners = meshes[face.pair as usize].triangle_positions(face.triangle as usize);
            let area = area_vector(corners).length();
            all += area;
            colors += if chart.is_some() { area } else { 0.0 };
        }
        if all > 0.0 { colors / all } else { 0.0 }
    }

    /// The reason why it can't be made anew in any layout, if there is one.
    fn unfit(&self, has_conflicting_uvs: impl Fn() -> bool) -> Option<SharedReason> {
        if !self.is_used {
            Some(SharedReason::Unused)
        } else if self.is_missing {
            Some(SharedReason::Missing)
        } else if self.beyond_charts {
            Some(SharedReason::BeyondCharts)
        } else if self.lacks_uvs || self.charts.is_empty() {
            Some(SharedReason::NoCharts)
        } else if has_conflicting_uvs() {
            Some(SharedReason::ConflictingUvs)
        } else {
            None
        }
    }

    /// Why it can't be made anew in a new layout.
    pub(super) fn fixed(&self, surfaces: &[Geometry]) -> Option<SharedReason> {
        let fixed = self.unfit(|| self.has_conflicting_uvs());
        fixed.or_else(|| self.has_ids.then_some(SharedReason::Ids)).or_else(|| {
            let meshes: Vec<&Mesh> = surfaces.iter().map(|surface| &surface.welded.mesh).collect();
            let share = self.colors(&faces(&self.charts, &meshes), &meshes);
            (share > MOST_COLORS).then_some(SharedReason::Colors(share))
        })
    }

    /// Whether triangles read it in several ways.
    fn has_conflicting_uvs(&self) -> bool {
        let mut groups: Vec<_> = self.charts.iter().map(|c| (c.surface, c.group)).collect();
        groups.sort_unstable();
        groups.windows(2).any(|pair| pair[0] == pair[1])
    }

    /// The image in a new layout of groups.
    pub(super) fn image_use(&self, image: usize, groups: &[(usize, u32)]) -> ImageUse {
        let reading = |&(surface, group): &(usize, u32)| {
            let own = self.charts.iter().position(|c| (c.surface, c.group) == (surface, group));
            own.map(|at| self.readings[at])
        };
        ImageUse { image, role: self.role, readings: groups.iter().map(reading).collect() }
    }
}

/// One per image: how it is used; `materials` has the textures of each.
pub(super) fn uses(
    asset: &Asset,
    surfaces: &[Geometry],
    materials: &[Vec<TextureSlot>],
    limit: MemoryLimit,
) -> Result<Vec<Used>> {
    let used = |(index, image): (usize, &EncodedImage)| {
        let is_missing = image.is_missing();
        let size = match is_missing {
            true => [0; 2],
            false => dimensions(image, &format!("/images/{index}"), limit).unwrap_or_default(),
        };
        Used { is_missing, size, ..Used::default() }
    };
    let mut uses: Vec<Used> = asset.images.iter().enumerate().map(used).collect();
    for mesh in 0..asset.count("meshes") {
        for primitive in Primitive::of_mesh(asset, mesh)?.iter().filter(|p| !p.is_surface()) {
            for slot in textures_of(asset, primitive, materials)? {
                uses[slot.image].add(slot);
                uses[slot.image].beyond_charts = true;
            }
        }
    }
    for (index, surface) in surfaces.iter().enumerate() {
        for (group, part) in (0..).zip(&surface.parts) {
            for slot in textures_of(asset, &part.primitive, materials)? {
                uses[slot.image].add(slot);
                uses[slot.image].add_charts(index, group, slot, &surface.welded.mesh);
                uses[slot.image].has_ids |= has_textures(asset, &part.primitive);
            }
        }
    }
    Ok(uses)
}
