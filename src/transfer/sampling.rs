//! Tangents and charts of the source's surfaces and of their levels, as a transfer needs them.

use glam::Vec4;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use seamwise_attr::{DisjointSets, Level, Mesh, WedgeId};
use seamwise_texture::transfer::{ShadingMesh, Source};

use crate::document::asset::Asset;
use crate::error::Result;
use crate::surface::geometry::Geometry;
use crate::surface::tangents::{mesh_tangents, source_tangents};

/// One per part: the UV set of its normal map.
type Sets = Vec<Option<usize>>;

/// Tangents and charts of one surface, of the source or of a level.
pub(super) struct Tags {
    /// One triple per triangle.
    pub(super) tangents: Vec<[Vec4; 3]>,
    /// One per triangle.
    pub(super) charts: Vec<u32>,
}

/// The tags of the source, one entry per surface. Where levels are free of charts, parts stand for these.
pub(super) fn source_tags(
    asset: &Asset,
    surfaces: &[Geometry],
    sets: &[Sets],
    is_free: &[bool],
) -> Result<Vec<Tags>> {
    let of = |((surface, sets), is_free): ((&Geometry, &Sets), &bool)| {
        let mesh = &surface.welded.mesh;
        let charts = if *is_free {
            mesh.groups.clone()
        } else {
            let charts = wedge_charts(mesh);
            mesh.triangles.iter().map(|wedges| charts[wedges[0].index()]).collect()
        };
        Ok(Tags { tangents: source_tangents(asset, surface, sets)?, charts })
    };
    surfaces.par_iter().zip(sets).zip(is_free).map(of).collect()
}

/// The tags of a level of each surface. `laid_out` are the same levels in their final layout.
pub(super) fn level_tags(
    surfaces: &[Geometry],
    levels: &[Level],
    laid_out: &[&Mesh],
    (sets, is_free): (&[Sets], &[bool]),
) -> Result<Vec<Tags>> {
    let of = |index: usize| {
        let level = &levels[index];
        let charts = if is_free[index] {
            level.mesh.groups.clone()
        } else {
            let charts = wedge_charts(&surfaces[index].welded.mesh);
            let source = |wedge: WedgeId| level.wedge_sources[wedge.index()].index();
            level.mesh.triangles.iter().map(|wedges| charts[source(wedges[0])]).collect()
        };
        Ok(Tags { tangents: mesh_tangents(laid_out[index], &sets[index])?, charts })
    };
    (0..surfaces.len()).into_par_iter().map(of).collect()
}

/// The source, ready to be searched.
pub(super) fn sources<'a>(surfaces: &'a [Geometry], tags: &'a [Tags]) -> Vec<Source<'a>> {
    let sides = surfaces.par_iter().zip(tags);
    sides.map(|(surface, tags)| Source::new(tags.side(&surface.welded.mesh))).collect()
}

impl Tags {
    /// Their mesh with them.
    pub(super) fn side<'a>(&'a self, mesh: &'a Mesh) -> ShadingMesh<'a> {
        ShadingMesh { mesh, tangents: &self.tangents, charts: &self.charts }
    }
}

/// One per wedge: its chart. Triangles are of one chart where they share a point with the same UVs,
/// whatever their normals.
fn wedge_charts(mesh: &Mesh) -> Vec<u32> {
    let mut sets = DisjointSets::new(mesh.wedge_points.len());
    let uvs = 2 * mesh.layout.uv_sets;
    let mut known: FxHashMap<(u32, Vec<u32>), u32> = FxHashMap::default();
    for triangle in &mesh.triangles {
        for &wedge in triangle {
            let bits = mesh.row(wedge)[..uvs].iter().map(|x| x.to_bits()).collect();
            let same = *known.entry((mesh.wedge_points[wedge].0, bits)).or_insert(wedge.0);
            sets.join(wedge.0, same);
            sets.join(wedge.0, triangle[0].0);
        }
    }
    (0..mesh.wedge_points.len() as u32).map(|wedge| sets.root(wedge)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use seamwise_attr::{Vertices, weld};

    #[test]
    fn charts_end_at_seams_of_uvs_and_go_on_over_creases() {
        // Three triangles in a fan: the second has normals of its own, the third UVs.
        let layout = seamwise_attr::Layout { uv_sets: 1, normal: true, color: 0 };
        let corner = |x: f32, y: f32, uv: f32, up: f32| {
            (Vec3::new(x, y, 0.0), [x + uv, y, 0.0, up, 1.0 - up])
        };
        let fan = |a: [f32; 2], b: [f32; 2], uv, up| {
            [corner(0.0, 0.0, uv, up), corner(a[0], a[1], uv, up), corner(b[0], b[1], uv, up)]
        };
        let corners = [
            fan([1.0, 0.0], [0.0, 1.0], 0.0, 0.0),
            fan([0.0, 1.0], [-1.0, 0.0], 0.0, 1.0),
            fan([-1.0, 0.0], [0.0, -1.0], 5.0, 0.0),
        ];
        let corners = corners.as_flattened();
        let vertices = Vertices {
            positions: corners.iter().map(|corner| corner.0).collect(),
            layout,
            attributes: corners.iter().flat_map(|corner| corner.1).collect(),
            triangles: vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]],
            groups: vec![0; 3],
            ..Vertices::default()
        };
        let mesh = weld(&vertices).unwrap().mesh;
        let charts = wedge_charts(&mesh);
        let of = |triangle: usize| charts[mesh.triangles[triangle][0].index()];
        assert_eq!(of(0), of(1));
        assert_ne!(of(1), of(2));
    }
}
