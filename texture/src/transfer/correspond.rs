//! Where on the source a point of a level lies.
//!
//! A ray both ways along the level's normal, no farther than a cage around it, finds what an eye
//! sees there; the nearer hit of the two counts. A ray that finds nothing, beyond a silhouette or
//! in a fold, leaves it to the nearest point. Neither may land on the wrong sheet: only triangles
//! of the same group are looked at, and first only those that face the same way as the level's smooth
//! normal or its triangle. So the inside of a cup never takes the picture of its outside, however thin
//! its wall is. Of those the ones of the chart that the level's triangle comes from go before all
//! others, so that no picture of the other side of a seam gets into the rim of a chart, where mip maps
//! would spread it.

use glam::Vec3;
use rayon::prelude::*;
use seamwise_attr::{Mesh, Surface, TriangleId};

use super::side::{Side, Spot};

/// Cosine between normals of the level and a source triangle's from which on it lies on the same side.
const SAME_SIDE: f32 = 0.2;

/// A source, ready to be searched.
#[derive(Clone, Debug)]
pub struct Source<'a> {
    pub(super) side: Side<'a>,
    surface: Surface,
    /// One per triangle.
    face_normals: Vec<Vec3>,
}

impl<'a> Source<'a> {
    /// Builds the tree over the triangles of a surface.
    pub fn new(side: Side<'a>) -> Self {
        let mesh = side.mesh;
        let points = (0..mesh.triangles.len())
            .map(|triangle| mesh.triangle_points(triangle).map(|point| point.0));
        Self {
            surface: Surface::new(&mesh.positions, points),
            face_normals: (0..mesh.triangles.len()).map(|t| side.face_normal(t)).collect(),
            side,
        }
    }

    /// RMS distance from the level to the source and back, the larger of the two, at the points and
    /// the middles of triangles; in the units of the mesh.
    pub fn rms_distance(&self, level: &Mesh) -> f32 {
        let own = &self.side.mesh;
        let points = level.triangles.iter().map(|t| t.map(|wedge| level.wedge_points[wedge].0));
        let there = Surface::new(&level.positions, points);
        f32::max(rms(probes(level), &self.surface), rms(probes(own), &there))
    }

    /// The place that belongs to a point of a level, of a triangle of this group and chart. None if the
    /// group has no triangle. `normals`: the smooth one there, and that of its triangle. A ray along the
    /// smooth one looks no farther than `cage`, nor does the search for a place of the same chart.
    pub(super) fn find(
        &self,
        p: Vec3,
        [smooth, plane]: [Vec3; 2],
        (group, chart): (u32, u32),
        cage: f32,
    ) -> Option<Spot> {
        // Vertex normals may point inward all over; a triangle is what has sides.
        let normal = if smooth.dot(plane) < 0.0 { -smooth } else { smooth };
        let is_own = |triangle: TriangleId| self.side.mesh.groups[triangle] == group;
        let faces = |triangle: TriangleId| {
            let face = self.face_normals[triangle];
            is_own(triangle) && face.dot(normal).max(face.dot(plane)) > SAME_SIDE
        };
        let in_chart =
            |triangle: TriangleId| self.side.charts[triangle] == chart && faces(triangle);
        let nearest = |most: f32, accept: &dyn Fn(TriangleId) -> bool| {
            let near = self.surface.closest_point_where(p, most, accept)?;
            Some(Spot { triangle: near.triangle.index(), barycentrics: near.barycentrics })
        };
        self.hit(p, normal, cage, &in_chart)
            .or_else(|| nearest(cage, &in_chart))
            .or_else(|| self.hit(p, normal, cage, &faces))
            .or_else(|| nearest(f32::INFINITY, &faces))
            .or_else(|| nearest(f32::INFINITY, &is_own))
    }

    /// The nearer of the first hits along a normal and against it.
    fn hit(
        &self,
        p: Vec3,
        normal: Vec3,
        cage: f32,
        accept: &dyn Fn(TriangleId) -> bool,
    ) -> Option<Spot> {
        let ray = |way: Vec3| self.surface.first_hit_where(p, way, cage, accept);
        let hits = [ray(normal), ray(-normal)].into_iter().flatten();
        let hit = hits.min_by(|a, b| a.distance.total_cmp(&b.distance))?;
        Some(Spot { triangle: hit.triangle.index(), barycentrics: hit.barycentrics })
    }
}

/// The points of a mesh and the middles of its triangles.
fn probes(mesh: &Mesh) -> Vec<Vec3> {
    let middle = |triangle| mesh.triangle_positions(triangle).into_iter().sum::<Vec3>() / 3.0;
    let middles = (0..mesh.triangles.len()).map(middle);
    mesh.positions.iter().copied().chain(middles).collect()
}

fn rms(probes: Vec<Vec3>, surface: &Surface) -> f32 {
    let square = |p: Vec3| surface.closest_point(p).map(|near| f64::from(near.distance_squared));
    let squares: Vec<f64> = probes.into_par_iter().filter_map(square).collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt() as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use seamwise_attr::{Layout, PointId, WedgeId};

    /// Squares of two triangles at heights, each a group of its own; those of a negative sign face
    /// down.
    fn squares(heights: &[f32]) -> Mesh {
        let mut mesh = Mesh { layout: Layout::default(), ..Mesh::default() };
        for (group, &height) in (0..).zip(heights) {
            let first = mesh.positions.len() as u32;
            for (x, y) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
                mesh.positions.push(Vec3::new(x, y, height.abs()));
                mesh.wedge_points.push(PointId(mesh.positions.len() as u32 - 1));
            }
            for mut corners in [[0, 1, 2], [0, 2, 3]] {
                if height < 0.0 {
                    corners.swap(1, 2);
                }
                mesh.triangles.push(corners.map(|corner| WedgeId(first + corner)));
                mesh.groups.push(group);
            }
        }
        mesh
    }

    fn source(mesh: &Mesh) -> Source<'_> {
        Source::new(Side { mesh, tangents: &[], charts: &[0; 4] })
    }

    fn height(mesh: &Mesh, spot: Spot) -> f32 {
        mesh.triangle_positions(spot.triangle)[0].z
    }

    #[test]
    fn the_nearer_hit_along_the_normal_is_taken_within_the_cage() {
        let mut mesh = squares(&[0.1, 0.5]);
        mesh.groups.fill(0);
        let source = source(&mesh);
        let found = |z: f32, cage| {
            let p = Vec3::new(0.3, 0.6, z);
            height(&mesh, source.find(p, [Vec3::Z; 2], (0, 0), cage).unwrap())
        };
        assert_eq!([found(0.2, 1.0), found(0.4, 1.0), found(0.4, 0.01)], [0.1, 0.5, 0.5]);
    }

    #[test]
    fn neither_another_side_nor_another_group_answers() {
        let mut mesh = squares(&[0.2, -0.21]);
        mesh.groups.fill(0);
        let source = source(&mesh);
        let p = Vec3::new(0.3, 0.6, 0.209);
        let found = |normal: Vec3| height(&mesh, source.find(p, [normal; 2], (0, 0), 1.0).unwrap());
        assert_eq!([found(Vec3::Z), found(Vec3::NEG_Z)], [0.2, 0.21]);
        // Where nothing faces the same way, any place of the group is better than none.
        assert!(source.find(p, [Vec3::X; 2], (0, 0), 1.0).is_some());
        assert!(source.find(p, [Vec3::Z; 2], (1, 0), 1.0).is_none());
    }

    #[test]
    fn a_triangle_finds_itself_whichever_way_its_vertex_normals_point() {
        let mut mesh = squares(&[0.2, -0.21]);
        mesh.groups.fill(0);
        let source = source(&mesh);
        let p = Vec3::new(0.3, 0.6, 0.2);
        for smooth in [Vec3::new(1.0, 0.0, 0.1).normalize(), Vec3::X, Vec3::NEG_Z] {
            let found = source.find(p, [smooth, Vec3::Z], (0, 0), 1.0).unwrap();
            assert_eq!(height(&mesh, found), 0.2, "{smooth}");
        }
    }

    #[test]
    fn the_own_chart_answers_within_the_cage_though_another_is_nearer() {
        let mut mesh = squares(&[0.1, 0.3]);
        mesh.groups.fill(0);
        let charts = [0, 0, 1, 1];
        let source = Source::new(Side { mesh: &mesh, tangents: &[], charts: &charts });
        let found = |chart, cage| {
            let p = Vec3::new(0.3, 0.6, 0.15);
            height(&mesh, source.find(p, [Vec3::Z; 2], (0, chart), cage).unwrap())
        };
        assert_eq!([found(0, 1.0), found(1, 1.0), found(1, 0.1)], [0.1, 0.3, 0.1]);
    }

    #[test]
    fn the_distance_is_that_of_the_farther_way() {
        let (near, far) = (squares(&[0.5]), squares(&[0.5, 0.9]));
        assert!((source(&near).rms_distance(&squares(&[0.75])) - 0.25).abs() < 1e-6);
        let expected = 0.4 * 0.5f32.sqrt();
        assert!((source(&near).rms_distance(&far) - expected).abs() < 1e-6);
        assert!((source(&far).rms_distance(&near) - expected).abs() < 1e-6);
    }
}
