//! Sides that all triangles of a shell face: height fields, and whatever else is a graph over a plane.
//!
//! A triangle of such a shell that turns its back to the plane lies under others, even where it has
//! turned by little. So as long as a shell faces a direction as a whole, no step may end that. Tried are
//! the axes and the sum of the area vectors of the shell, which is that of the plane through its border if
//! that is flat.

use glam::DVec3;

use crate::id::PointId;
use crate::mesh::Mesh;
use crate::sets::DisjointSets;
use crate::triangle::area_vector;

/// The least cosine between the normal of a triangle and the direction that it faces: one edge-on would turn
/// by rounding.
const LEAST_COSINE: f64 = 1e-3;
/// Directions that are tried for each shell.
const TRIED: usize = 7;

/// The directions that the shells of a mesh face.
#[derive(Clone, Debug, Default)]
pub(crate) struct Facing {
    /// One per point: its shell, by the list of its directions. Empty if no shell faces any.
    shells: Vec<u32>,
    directions: Vec<Vec<DVec3>>,
}

impl Facing {
    /// The directions of a mesh.
    pub(crate) fn of(mesh: &Mesh) -> Self {
        let mut sets = DisjointSets::new(mesh.positions.len());
        let triangles = 0..mesh.triangles.len();
        for triangle in triangles.clone() {
            let [a, b, c] = mesh.triangle_points(triangle).map(|point| point.0);
            sets.join(a, b);
            sets.join(b, c);
        }
        let roots: Vec<u32> =
            (0..mesh.positions.len() as u32).map(|point| sets.root(point)).collect();
        let root = |triangle: usize| roots[mesh.triangle_points(triangle)[0].index()] as usize;
        let mut sums = vec![DVec3::ZERO; roots.len()];
        let vector = |triangle| area_vector(mesh.triangle_positions(triangle));
        triangles.clone().for_each(|triangle| sums[root(triangle)] += vector(triangle));
        // Of closed shells the sum is nothing but rounding, and no axis is faced either.
        let mut faced = vec![[true; TRIED]; roots.len()];
        for triangle in triangles {
            let shell = root(triangle);
            if faced[shell] == [false; TRIED] {
                continue;
            }
            let own = vector(triangle);
            for (faced, direction) in faced[shell].iter_mut().zip(tried(sums[shell])) {
                *faced &= own.dot(direction) >= LEAST_COSINE * own.length();
            }
        }
        let mut facing = Self { shells: roots, directions: Vec::new() };
        facing.number(&sums, &faced);
        facing
    }

    /// Names each shell by the number of its directions instead of its root.
    fn number(&mut self, sums: &[DVec3], faced: &[[bool; TRIED]]) {
        let mut numbers = vec![None; sums.len()];
        self.directions = vec![Vec::new()];
        for shell in &mut self.shells {
            let root = *shell as usize;
            *shell = *numbers[root].get_or_insert_with(|| {
                let all = tried(sums[root]).into_iter().zip(faced[root]);
                let own: Vec<DVec3> =
                    all.filter(|(_, faced)| *faced).map(|(direction, _)| direction).collect();
                if own.is_empty() || sums[root] == DVec3::ZERO {
                    return 0;
                }
                self.directions.push(own);
                self.directions.len() as u32 - 1
            });
        }
        if self.directions.len() == 1 {
            *self = Self::default();
        }
    }

    /// The list of directions that the shell of a point faces, by its number; 0 is the empty one.
    pub(crate) fn shell(&self, point: PointId) -> u32 {
        self.shells.get(point.index()).copied().unwrap_or(0)
    }

    /// Whether no shell faces any direction.
    pub(crate) fn is_empty(&self) -> bool {
        self.directions.is_empty()
    }

    /// Whether a triangle of a shell turns its back on a direction that the shell faces.
    pub(crate) fn turns_back(&self, shell: u32, before: [DVec3; 3], after: [DVec3; 3]) -> bool {
        let directions = self.directions.get(shell as usize).map_or(&[][..], Vec::as_slice);
        let vector = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize_or_zero();
        let falls = |direction: &DVec3| {
            let after = vector(after).dot(*direction);
            after < LEAST_COSINE && after < vector(before).dot(*direction)
        };
        directions.iter().any(falls)
    }
}

fn tried(sum: DVec3) -> [DVec3; TRIED] {
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
    [x, y, z, -x, -y, -z, sum.normalize_or_zero()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{sphere, surface};
    use glam::Vec3;

    #[test]
    fn a_height_field_faces_up_and_a_sphere_faces_nowhere() {
        let rough = surface(9, |x, y| Vec3::new(x, y, 0.3 * (40.0 * x * y).sin()));
        let facing = Facing::of(&rough);
        assert!(facing.directions[1].contains(&DVec3::Z), "{:?}", facing.directions);
        assert!(Facing::of(&sphere(8)).is_empty());
    }

    #[test]
    fn a_tilted_field_faces_the_plane_of_its_border() {
        let turn = glam::Quat::from_axis_angle(Vec3::new(1.0, 2.0, 0.0).normalize(), 1.1);
        let bump = |x: f32, y: f32| 2.0 * (x * y * (1.0 - x) * (1.0 - y)) * (25.0 * x).sin();
        let field = surface(12, |x, y| turn * Vec3::new(x, y, bump(x, y)));
        let facing = Facing::of(&field);
        let up = (turn * Vec3::Z).as_dvec3();
        assert!(facing.directions[1].iter().any(|own| own.dot(up) > 1.0 - 1e-6));
        let before = [DVec3::ZERO, turn.as_dquat() * DVec3::X, turn.as_dquat() * DVec3::Y];
        let shell = facing.shell(PointId(0));
        assert!(facing.turns_back(shell, before, [before[0], before[2], before[1]]));
        assert!(!facing.turns_back(shell, before, before.map(|p| p * 2.0)));
        assert!(!facing.turns_back(0, before, [before[0], before[2], before[1]]));
    }
}
