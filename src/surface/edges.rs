//! Edges where triangles meet at positions that agree bitwise.

use glam::Vec3;

/// A position as bits, −0 as 0.
pub(crate) type Point = [u32; 3];

/// The bits of a position.
pub(crate) fn point(position: Vec3) -> Point {
    position.to_array().map(|x| (x + 0.0).to_bits())
}

/// A triangle at an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Side {
    /// The edge's ends, the lesser first.
    pub(crate) points: [Point; 2],
    /// The triangle.
    pub(crate) triangle: usize,
    /// Its corners at these ends.
    pub(crate) slots: [usize; 2],
}

impl Side {
    fn new(triangles: &[[u32; 3]], positions: &[Vec3], triangle: usize, corner: usize) -> Self {
        let end = |slot: usize| (point(positions[triangles[triangle][slot] as usize]), slot);
        let (mut a, mut b) = (end((corner + 1) % 3), end((corner + 2) % 3));
        if a.0 > b.0 {
            std::mem::swap(&mut a, &mut b);
        }
        Self { points: [a.0, b.0], triangle, slots: [a.1, b.1] }
    }

    /// The corner opposite the edge.
    pub(crate) fn corner(&self) -> usize {
        3 - self.slots[0] - self.slots[1]
    }

    /// The values `of` the triangle's vertices at the edge's ends.
    pub(crate) fn ends<T>(&self, triangles: &[[u32; 3]], of: impl Fn(usize) -> T) -> [T; 2] {
        self.slots.map(|slot| of(triangles[self.triangle][slot] as usize))
    }
}

/// All sides of all edges, those of an edge next to each other; see [`same_edge`].
pub(crate) fn sides_by_edge(triangles: &[[u32; 3]], positions: &[Vec3]) -> Vec<Side> {
    let all = (0..triangles.len()).flat_map(|triangle| [0, 1, 2].map(|corner| (triangle, corner)));
    let side = |(triangle, corner)| Side::new(triangles, positions, triangle, corner);
    let mut sides: Vec<Side> = all.map(side).collect();
    sides.sort_unstable();
    sides
}

/// Whether two sides belong to one edge.
pub(crate) fn same_edge(a: &Side, b: &Side) -> bool {
    a.points == b.points
}
