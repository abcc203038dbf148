//! The ways in which a surface moves, as attributes that a simplification keeps.
//!
//! A point that moves under joints and morph targets has a place in each pose. Between collapses those are
//! interpolated over triangles like any attribute, so that where they are not linear they need
//! points, however flat the surface is at rest (Mohr & Gleicher, "Deformation sensitive decimation", 2003,
//! with the generalized quadric in place of one for each pose). All poses together are more
//! numbers than a wedge may carry. What a collapse does wrong is the part that is not linear over two
//! neighboring triangles; so of all combinations of poses those count that have most of it: the principal
//! components of the jumps at edges, by which the squares of errors, summed over poses, stay what they are.
//!
//! What turns as a whole is linear in space, but not over the triangles of a curved surface, each of which knows
//! its own plane. So a triangle's linear function goes on along its normal to where the normal turns.

use glam::{DVec3, Vec3};
use nalgebra::{DMatrix, SymmetricEigen};

use crate::edges::visit_edges;
use crate::id::PointId;
use crate::mesh::Mesh;
use crate::quadric::{Gradient, MAX_ATTRIBUTES};
use crate::triangle::area_vector;

/// The most floats of a point that tell how it moves.
///
/// Each takes four numbers more in every quadric.
const MAX_WIDTH: usize = 6;
/// Components whose part is below this share of the first are left out.
const LEAST_PART: f64 = 1e-3;
/// The most edges that jumps are looked at; of more, every so many.
const MAX_EDGES: usize = 20_000;
/// A triangle this many times its size away from the point beyond its edge says nothing about it.
const MAX_EXTRAPOLATION: f64 = 8.0;

/// A pose of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// One per point: the difference from where it is to where it goes, in the units of the mesh.
    pub moves: Vec<Vec3>,
    /// How many times as much an error in this pose counts as one at rest.
    pub weight: f64,
}

/// The ways in which the points of a mesh move.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// Floats of a point.
    pub(crate) width: usize,
    /// So many per point, in the units of the mesh.
    rows: Vec<f32>,
    /// As many per point: what a length along the normal there goes by beside the point itself.
    normals: Vec<f32>,
    /// The largest factor that it may come to count by; none below 1.
    pub(crate) growth: f64,
}

impl Motion {
    /// The motion of a mesh in these poses. Nothing moves if all of them are linear everywhere.
    ///
    /// # Panics
    /// If a pose has not one difference for each point.
    pub fn new(mesh: &Mesh, poses: &[Pose]) -> Self {
        let points = mesh.positions.len();
        assert!(poses.iter().all(|pose| pose.moves.len() == points), "one for each point");
        let most = MAX_WIDTH.min(MAX_ATTRIBUTES.saturating_sub(mesh.layout.len()));
        let basis = principal_components(jumps(mesh, poses), most);
        let still = normals(mesh, &[]);
        let (mut rows, mut turns) =
            (vec![0.0; points * basis.len()], vec![0.0; points * basis.len()]);
        for (at, pose) in poses.iter().enumerate() {
            let turned = normals(mesh, &pose.moves);
            for point in 0..points {
                let (moved, turn) = (pose.moves[point].as_dvec3(), turned[point] - still[point]);
                for (k, component) in basis.iter().enumerate() {
                    let by = DVec3::from_slice(&component[3 * at..]) * pose.weight.sqrt();
                    rows[point * basis.len() + k] += by.dot(moved) as f32;
                    turns[point * basis.len() + k] += by.dot(turn) as f32;
                }
            }
        }
        Self { width: basis.len(), rows, normals: turns, growth: 0.0 }
    }

    /// The same motion, counting up to `most` times as much the coarser a level is.
    #[must_use]
    pub fn growing_to(self, most: f64) -> Self {
        Self { growth: most, ..self }
    }

    /// The number of points that it is of, 0 if nothing moves.
    pub(crate) fn points(&self) -> usize {
        self.rows.len().checked_div(self.width).unwrap_or(0)
    }

    /// The floats of all points, and what a length along the normal at each goes by beside it.
    pub(crate) fn rows(&self) -> [&[f32]; 2] {
        [&self.rows, &self.normals]
    }
}

/// The normal at each point, moved by `moves` if there are any.
fn normals(mesh: &Mesh, moves: &[Vec3]) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; mesh.positions.len()];
    for triangle in 0..mesh.triangles.len() {
        let points = mesh.triangle_points(triangle);
        let at = |point: PointId| {
            mesh.positions[point] + moves.get(point.index()).copied().unwrap_or_default()
        };
        let area = area_vector(points.map(at));
        points.iter().for_each(|point| normals[point.index()] += area);
    }
    normals.into_iter().map(DVec3::normalize_or_zero).collect()
}

/// The sum of the squares of jumps at edges, three rows and columns for each pose.
fn jumps(mesh: &Mesh, poses: &[Pose]) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(3 * poses.len(), 3 * poses.len());
    let stride = (3 * mesh.triangles.len() / 2).div_ceil(MAX_EDGES).max(1);
    let (mut at, mut jump) = (0, Vec::new());
    visit_edges(mesh, |_, sides| {
        let &[(_, one), (_, other)] = sides else { return };
        at += 1;
        if at % stride != 0 {
            return;
        }
        let own = mesh.triangle_points(one);
        let beyond = mesh.triangle_points(other).into_iter().find(|p| !own.contains(p));
        let Some(beyond) = beyond else { return };
        let corners = mesh.triangle_positions(one).map(Vec3::as_dvec3);
        let place = mesh.positions[beyond].as_dvec3();
        let share = |values| {
            let Gradient { g, d } = Gradient::new(corners, values);
            g.dot(place) + d
        };
        let shares = [share([1.0, 0.0, 0.0]), share([0.0, 1.0, 0.0]), share([0.0, 0.0, 1.0])];
        if !shares.iter().all(|share| share.abs() < MAX_EXTRAPOLATION) {
            return;
        }
        let still = area_vector(mesh.triangle_positions(one)).normalize_or_zero();
        let height = still.dot(place - corners[0]);
        jump.clear();
        for (pose, Pose { moves, weight }) in poses.iter().enumerate() {
            let linear: DVec3 = (0..3).map(|k| moves[own[k].index()].as_dvec3() * shares[k]).sum();
            let posed = own.map(|point| mesh.positions[point] + moves[point.index()]);
            let turn = area_vector(posed).normalize_or_zero() - still;
            let off = moves[beyond.index()].as_dvec3() - linear - turn * height;
            let off = (off * weight.sqrt()).to_array();
            let places = off.into_iter().zip(3 * pose..).filter(|(off, _)| *off != 0.0);
            jump.extend(places.map(|(off, at)| (at, off)));
        }
        let area = [one, other].map(|t| area_vector(mesh.triangle_positions(t)).length());
        for &(row, a) in &jump {
            for &(column, b) in &jump {
                sum[(row, column)] += (area[0] + area[1]) * a * b;
            }
        }
    });
    sum
}

/// The eigenvectors of the greatest eigenvalues of a symmetric matrix, `most` of them or fewer.
fn principal_components(matrix: DMatrix<f64>, most: usize) -> Vec<Vec<f64>> {
    if matrix.nrows() == 0 {
        return Vec::new();
    }
    let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(matrix);
    let mut order: Vec<usize> = (0..eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigenvalues[b].total_cmp(&eigenvalues[a]));
    let least = LEAST_PART * eigenvalues[order[0]];
    let counts = |&at: &usize| eigenvalues[at] > 0.0 && eigenvalues[at] >= least;
    let vector = |at: usize| eigenvectors.column(at).iter().copied().collect();
    order.into_iter().take(most).filter(counts).map(vector).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{grid, sphere, surface};
    use glam::{Quat, Vec2};

    fn pose(mesh: &Mesh, moves: impl Fn(Vec3) -> Vec3) -> Pose {
        Pose { moves: mesh.positions.iter().map(|&p| moves(p)).collect(), weight: 1.0 }
    }

    fn row(motion: &Motion, point: usize) -> &[f32] {
        &motion.rows[point * motion.width..][..motion.width]
    }

    #[test]
    fn what_is_linear_over_a_plane_is_no_motion() {
        let mesh = grid(12);
        let shear = pose(&mesh, |p| Vec3::new(0.5 * p.y, -0.5 * p.x, 2.0 * p.x + 1.0));
        let bump = pose(&mesh, |p| Vec3::Z * (6.0 * p.x).sin());
        let bent = Motion::new(&mesh, &[shear, bump.clone()]);
        assert_eq!(bent.width, 1);
        for (point, bump) in bump.moves.iter().enumerate() {
            assert!((row(&bent, point)[0].abs() - bump.z.abs()).abs() < 1e-3);
        }
    }

    #[test]
    fn what_turns_as_a_whole_is_far_less_than_what_bends() {
        let mesh = sphere(16);
        let turn = Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 1.0);
        let part = |pose: Pose| jumps(&mesh, &[pose]).trace();
        let turned = part(pose(&mesh, |p| turn * p - p));
        let bent = part(pose(&mesh, |p| if p.z > 0.0 { turn * p - p } else { Vec3::ZERO }));
        assert!(turned < 1e-6 * bent, "{turned} of {bent}");
    }

    #[test]
    fn the_squares_of_a_few_components_are_those_of_many_poses() {
        let mesh = surface(16, |x, y| Vec3::new(x, y, 0.0));
        let bump = |at: f32| {
            move |p: Vec3| Vec3::Z * (-40.0 * p.truncate().distance_squared(Vec2::splat(at))).exp()
        };
        let poses: Vec<Pose> = [0.3, 0.7, 0.3, 0.7].map(|at| pose(&mesh, bump(at))).into();
        let motion = Motion::new(&mesh, &poses);
        assert_eq!(motion.width, 2, "of two bumps, each there twice");
        for point in 0..mesh.positions.len() {
            let all: f32 = poses.iter().map(|pose| pose.moves[point].length_squared()).sum();
            let own: f32 = row(&motion, point).iter().map(|x| x * x).sum();
            assert!((all - own).abs() < 1e-4);
        }
    }

    #[test]
    fn a_mesh_without_poses_does_not_move() {
        assert_eq!(Motion::new(&grid(2), &[]), Motion::default());
    }
}
