//! The charts of a level laid out anew: the UVs of its first set are replaced.

use glam::{Vec2, Vec3};
use rustc_hash::FxHashMap;
use seamwise_attr::{Level, Mesh, WedgeId};
use seamwise_texture::Error::Full;
use seamwise_texture::{RepackOptions, Repacked, UvMesh, repack};

use super::layout::{SourceReading, UvLayout};
use super::sheet::Sheet;
use super::sizes::{SheetSizes, TexelDensity};
use super::unwrap::{Unwrapped, unwrap};
use crate::error::{Error, Result};
use crate::level::lods::Lods;
use crate::surface::geometry::Geometry;

/// Padding between charts, as a share of the atlas's side.
const PADDING: f64 = 1.0 / 256.0;
/// Texels between charts at least: a bilinear tap on each side.
const LEAST_PADDING: usize = 2;

/// An atlas grows up to this many times where it would not hold all charts.
const MOST_TIMES: usize = 64;

/// The levels with the charts of new layouts in their places; `None` if there are no such layouts.
/// Sizes grow where an atlas would not hold all charts.
pub(super) fn repack_all(
    sheets: &[Sheet<'_>],
    sizes: &mut SheetSizes,
    (lods, is_free): (&Lods, &[bool]),
    (texel_density, sources): (&TexelDensity, &[Geometry]),
) -> Result<Option<Lods>> {
    if !sheets.iter().any(|sheet| sheet.layout.is_new) {
        return Ok(None);
    }
    let mut repacked = Vec::with_capacity(lods.count());
    for (level, surfaces) in lods.levels().enumerate() {
        let mut surfaces = surfaces.to_vec();
        let layouts = sheets.chunk_by(|a, b| std::ptr::eq(a.layout, b.layout));
        let mut sizes = sizes.iter_mut();
        for own in layouts {
            let sizes: Vec<_> = sizes.by_ref().take(own.len()).collect();
            if !own[0].layout.is_new {
                continue;
            }
            let side = sizes.iter().flat_map(|sizes| sizes[level]).max().unwrap_or(1);
            let density = own[0].densities(texel_density, sources);
            let layout = (own[0].layout, &density[..]);
            let levels = (&mut surfaces[..], is_free);
            let times = repack_charts(layout, levels, texel_density.stretches(), side)?;
            for sizes in sizes {
                sizes[level] = sizes[level].map(|side| side * times);
            }
        }
        repacked.push(surfaces);
    }
    Ok(Some(Lods::new(repacked)))
}

/// Lays the triangles of a layout out anew on a level, one entry per surface, in an atlas of `side`
/// texels along each axis; those of free surfaces, which have no charts, are unwrapped first. `density` has the texels per length of each entry of its charts, 1 where it
/// is empty, and `stretches` the lengths in the scene over those of each surface's mesh. Returns how many times larger the atlas must be to hold all charts.
///
/// # Errors
/// [`Error::Unsupported`] if no atlas holds them.
fn repack_charts(
    (layout, density): (&UvLayout, &[f64]),
    (levels, is_free): (&mut [Level], &[bool]),
    stretches: &[f64],
    side: usize,
) -> Result<usize> {
    for charts in &layout.charts {
        add_uvs(&mut levels[charts.surface].mesh);
    }
    let gathered = Gathered::new(layout, levels, stretches).unwrapped(is_free)?;
    let mesh = UvMesh {
        positions: &gathered.positions,
        uvs: &gathered.uvs,
        triangles: &gathered.triangles,
        groups: &gathered.groups,
    };
    let mut times = 1;
    loop {
        let size = side * times;
        let padding = ((size as f64 * PADDING).round() as usize).max(LEAST_PADDING);
        match repack(&mesh, &RepackOptions { size, padding, density: density.to_vec() }) {
            Ok(repacked) => {
                gathered.apply(&repacked, levels);
                return Ok(times);
            }
            Err(Full { .. }) if times < MOST_TIMES => times *= 2,
            Err(error) => {
                let what = format!("laying the charts of a level out anew: {error}");
                return Err(Error::Unsupported { what });
            }
        }
    }
}

/// Gives a mesh without UVs a set of them.
fn add_uvs(mesh: &mut Mesh) {
    let width = mesh.layout.len();
    if mesh.layout.uv_sets > 0 {
        return;
    }
    mesh.layout.uv_sets = 1;
    let row =
        |wedge: usize| [&[0.0; 2], &mesh.attributes[wedge * width..(wedge + 1) * width]].concat();
    mesh.attributes = (0..mesh.wedge_points.len()).flat_map(row).collect();
}

/// The triangles of a layout, of all surfaces together.
#[derive(Default)]
struct Gathered {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
    groups: Vec<u32>,
    /// One per vertex: its surface and wedge.
    wedges: Vec<(usize, WedgeId)>,
    /// One per triangle: its surface and number.
    numbers: Vec<(usize, usize)>,
}

impl Gathered {
    fn new(layout: &UvLayout, levels: &[Level], stretches: &[f64]) -> Self {
        let mut gathered = Self::default();
        let mut known: FxHashMap<(usize, WedgeId), u32> = FxHashMap::default();
        for (index, charts) in layout.charts.iter().enumerate() {
            let reading = layout.reading(index);
            if reading.is_none() && layout.merge_group.is_none() && !layout.images.is_empty() {
                continue;
            }
            let mesh = &levels[charts.surface].mesh;
            let own = (0..mesh.triangles.len()).filter(|&t| mesh.groups[t] == charts.group);
            for triangle in own {
                let corners = mesh.triangles[triangle].map(|wedge| {
                    *known.entry((charts.surface, wedge)).or_insert_with(|| {
                        gathered.wedges.push((charts.surface, wedge));
                        gathered.add(mesh, wedge, reading, stretches[charts.surface])
                    })
                });
                gathered.triangles.push(corners);
                gathered.groups.push(index as u32);
                gathered.numbers.push((charts.surface, triangle));
            }
        }
        gathered
    }

    /// Adds a triangle's wedge. Triangles that read no image keep the charts of their first UV set,
    /// if they have one.
    fn add(
        &mut self,
        mesh: &Mesh,
        wedge: WedgeId,
        reading: Option<SourceReading>,
        stretch: f64,
    ) -> u32 {
        let position = mesh.positions[mesh.wedge_points[wedge]];
        self.positions.push(position * stretch as f32);
        self.uvs.push(match reading {
            Some(reading) if reading.uv_set < mesh.layout.uv_sets => {
                reading.transform.transform_point2(mesh.uv(wedge, reading.uv_set))
            }
            None if mesh.layout.uv_sets > 0 => mesh.uv(wedge, 0),
            _ => Vec2::ZERO,
        });
        self.uvs.len() as u32 - 1
    }

    /// The triangles of free surfaces in charts of their own.
    fn unwrapped(mut self, is_free: &[bool]) -> Result<Self> {
        let own = (0..self.triangles.len()).filter(|&at| is_free[self.numbers[at].0]);
        let own: Vec<usize> = own.collect();
        if own.is_empty() {
            return Ok(self);
        }
        let triangles: Vec<[u32; 3]> = own.iter().map(|&at| self.triangles[at]).collect();
        let groups: Vec<u32> = own.iter().map(|&at| self.groups[at]).collect();
        let Unwrapped { uvs, vertices, triangles } = unwrap(&self.positions, &triangles, &groups)?;
        let first = self.uvs.len() as u32;
        for (uv, vertex) in uvs.into_iter().zip(vertices) {
            self.uvs.push(uv);
            self.positions.push(self.positions[vertex as usize]);
            self.wedges.push(self.wedges[vertex as usize]);
        }
        for (at, corners) in own.into_iter().zip(triangles) {
            self.triangles[at] = corners.map(|corner| first + corner);
        }
        Ok(self)
    }

    /// Gives the levels the new layout: a wedge for each of its vertices.
    fn apply(&self, repacked: &Repacked, levels: &mut [Level]) {
        let mut new = Vec::with_capacity(repacked.uvs.len());
        for (&vertex, uv) in repacked.vertices.iter().zip(&repacked.uvs) {
            let (surface, wedge) = self.wedges[vertex as usize];
            let Level { mesh, wedge_sources, .. } = &mut levels[surface];
            let mut row = mesh.row(wedge).to_vec();
            let set = mesh.layout.uv(0);
            row[set..set + 2].copy_from_slice(&uv.to_array());
            mesh.attributes.extend(row);
            mesh.wedge_points.push(mesh.wedge_points[wedge]);
            wedge_sources.push(wedge_sources[wedge.index()]);
            new.push(WedgeId::new(mesh.wedge_points.len() - 1));
        }
        for (&(surface, triangle), corners) in self.numbers.iter().zip(&repacked.triangles) {
            levels[surface].mesh.triangles[triangle] = corners.map(|corner| new[corner as usize]);
        }
        levels.iter_mut().for_each(drop_unused);
    }
}

/// Leaves out the wedges that no triangle has any more.
fn drop_unused(level: &mut Level) {
    let Level { mesh, wedge_sources, .. } = level;
    let mut is_used = vec![false; mesh.wedge_points.len()];
    mesh.triangles.iter().flatten().for_each(|&wedge| is_used[wedge] = true);
    let width = mesh.layout.len();
    let mut new = vec![WedgeId(0); is_used.len()];
    let mut kept = 0;
    for old in (0..is_used.len()).filter(|&wedge| is_used[wedge]) {
        new[old] = WedgeId::new(kept);
        mesh.wedge_points[kept] = mesh.wedge_points[old];
        wedge_sources[kept] = wedge_sources[old];
        mesh.attributes.copy_within(old * width..(old + 1) * width, kept * width);
        kept += 1;
    }
    mesh.wedge_points.truncate(kept);
    wedge_sources.truncate(kept);
    mesh.attributes.truncate(kept * width);
    for wedge in mesh.triangles.iter_mut().flatten() {
        *wedge = new[*wedge];
    }
}
