//! A surface whose points are looked for: once everywhere, later from where they were.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::edges::visit_edges;
use crate::id::TriangleId;
use crate::mesh::Mesh;
use crate::surface::Surface;
use crate::triangle::{area_vector, closest_on_triangle};

/// Points whose normals have a cosine below this lie on two sheets.
const SAME_SIDE: f64 = 0.2;
/// No neighbor: the edge has not just two triangles.
const NONE: u32 = u32::MAX;
/// The most steps from one triangle to the next: a point moves by a fraction of a level's triangle,
/// and that may be some triangles of the source.
const STEPS: usize = 32;

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    pub(super) triangle: TriangleId,
    /// The barycentrics of the second and the third corner.
    weights: [f32; 2],
}

impl SurfacePoint {
    pub(super) fn new(triangle: TriangleId, barycentrics: DVec3) -> Self {
        Self { triangle, weights: [barycentrics.y as f32, barycentrics.z as f32] }
    }

    /// One per corner, sum 1.
    pub(super) fn barycentrics(&self) -> DVec3 {
        let [second, third] = self.weights.map(f64::from);
        DVec3::new(1.0 - second - third, second, third)
    }
}

/// Per triangle: those beyond the edges opposite its corners.
pub(super) type Neighbors = Arc<Vec<[u32; 3]>>;

/// Finds the neighbors of every triangle.
pub(super) fn neighbors(mesh: &Mesh) -> Neighbors {
    let mut neighbors = vec![[NONE; 3]; mesh.triangles.len()];
    visit_edges(mesh, |_, sides| {
        let &[(points, a), (_, b)] = sides else { return };
        for (own, other) in [(a, b), (b, a)] {
            let corners = mesh.triangle_points(own);
            if let Some(slot) = corners.iter().position(|p| !points.contains(p)) {
                neighbors[own][slot] = other as u32;
            }
        }
    });
    neighbors.into()
}

/// A surface as it lies now.
pub(super) struct Sheet<'a> {
    pub(super) mesh: &'a Mesh,
    /// One per triangle: its unit normal, zero if it has no area.
    pub(super) normals: Vec<DVec3>,
    neighbors: Neighbors,
}

impl<'a> Sheet<'a> {
    pub(super) fn new(mesh: &'a Mesh, neighbors: Neighbors) -> Self {
        let normals = (0..mesh.triangles.len())
            .into_par_iter()
            .map(|t| area_vector(mesh.triangle_positions(t)).normalize_or_zero())
            .collect();
        Self { mesh, normals, neighbors }
    }

    /// The points of each triangle.
    pub(super) fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        (0..self.mesh.triangles.len()).map(|t| self.mesh.triangle_points(t).map(|p| p.0))
    }

    /// This surface as a tree, to be searched everywhere.
    pub(super) fn surface(&self) -> Surface {
        Surface::new(&self.mesh.positions, self.triangles())
    }

    /// The position of a point.
    pub(super) fn place(&self, point: &SurfacePoint) -> DVec3 {
        let [a, b, c] = self.mesh.triangle_positions(point.triangle.index()).map(Vec3::as_dvec3);
        let weights = point.barycentrics();
        a * weights.x + b * weights.y + c * weights.z
    }

    /// Whether a triangle faces about the way that `normal` points.
    fn faces(&self, triangle: TriangleId, normal: DVec3) -> bool {
        self.normals[triangle].dot(normal) > SAME_SIDE
    }

    /// The point of this surface, given as `surface` too, nearest to one of `other`, on the same side.
    pub(super) fn find(
        &self,
        surface: &Surface,
        other: &Self,
        point: &SurfacePoint,
    ) -> Option<SurfacePoint> {
        let normal = other.normals[point.triangle];
        let found =
            surface.closest_foot(other.place(point), f64::INFINITY, |t| self.faces(t, normal))?;
        Some(SurfacePoint::new(found.triangle, found.barycentrics))
    }

    /// The nearest point, found from `start` by going to neighbors while they are nearer. Not
    /// always the nearest of all, but never farther than what `start` has.
    pub(super) fn follow(
        &self,
        start: TriangleId,
        other: &Self,
        point: &SurfacePoint,
    ) -> SurfacePoint {
        let (p, normal) = (other.place(point), other.normals[point.triangle]);
        let closest = |t: TriangleId| {
            let corners = self.mesh.triangle_positions(t.index());
            let (weights, _, square) = closest_on_triangle(p, &corners);
            (square, weights, t)
        };
        let mut best = closest(start);
        for _ in 0..STEPS {
            let (_, weights, at) = best;
            let nearer = (0..3)
                .filter(|&slot| weights[slot] == 0.0 && self.neighbors[at.index()][slot] != NONE)
                .map(|slot| TriangleId(self.neighbors[at.index()][slot]))
                .filter(|&t| self.faces(t, normal))
                .map(closest)
                .fold(best, |best, next| if next.0 < best.0 { next } else { best });
            if nearer.2 == at {
                break;
            }
            best = nearer;
        }
        SurfacePoint::new(best.2, best.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::grid;

    #[test]
    fn a_point_is_followed_over_a_sheet_to_what_is_nearest() {
        let mut below = grid(8);
        let above = grid(8);
        for p in &mut below.positions {
            p.z = -0.1;
        }
        let (below, above) =
            (Sheet::new(&below, neighbors(&below)), Sheet::new(&above, neighbors(&above)));
        let surface = below.surface();
        let middle = DVec3::new(0.5, 0.3, 0.2);
        for t in 0..above.mesh.triangles.len() {
            let point = SurfacePoint::new(TriangleId::new(t), middle);
            let nearest = below.find(&surface, &above, &point).expect("a foot");
            let start = TriangleId::new(above.mesh.triangles.len() / 2);
            let found = below.follow(start, &above, &point);
            assert_eq!(found.triangle, nearest.triangle);
            assert!((above.place(&point) - below.place(&found)).length() < 0.1 + 1e-6);
        }
    }

    #[test]
    fn neighbors_are_mutual_and_borders_have_none() {
        let mesh = grid(4);
        let all = neighbors(&mesh);
        let mut borders = 0;
        for (t, own) in all.iter().enumerate() {
            for &other in own {
                borders += usize::from(other == NONE);
                assert!(other == NONE || all[other as usize].contains(&(t as u32)));
            }
        }
        assert_eq!(borders, 16);
    }
}
