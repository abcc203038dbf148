//! Triangles that must not overlap, in a grid for those near one another.

use glam::DVec2;

use super::cells::touched;
use super::faces::{rounding, turn};

/// Triangles looked at for one before it is taken to overlap: what holds as many in one place, as
/// the hub of a very large fan does, is cut to stay linear.
const MOST_TESTS: usize = 4096;

/// Triangles of one orientation that do not overlap, and fast answers whether another one would.
pub(super) struct Region {
    origin: DVec2,
    /// Grid cells per unit.
    scale: f64,
    size: [usize; 2],
    /// One per cell: the members that touch it.
    cells: Vec<Vec<u32>>,
    members: Vec<[DVec2; 3]>,
    touched: Vec<usize>,
    /// One per member: the last triangle that it was tested against.
    tested: Vec<usize>,
    tests: usize,
}

impl Region {
    /// An empty one, for about `count` triangles between two corners.
    pub(super) fn new([low, high]: [DVec2; 2], count: usize) -> Self {
        let extent = high - low;
        let cell = (extent.x * extent.y / count as f64).sqrt();
        let cell = cell.max(extent.max_element() / (4 * count) as f64);
        let scale = if cell > 0.0 { 1.0 / cell } else { 0.0 };
        let size = [extent.x, extent.y]
            .map(|x| (x * scale).ceil().clamp(1.0, (4 * count) as f64) as usize);
        let cells = vec![Vec::new(); size[0] * size[1]];
        let members = Vec::new();
        Self {
            origin: low,
            scale,
            size,
            cells,
            members,
            touched: Vec::new(),
            tested: Vec::new(),
            tests: 0,
        }
    }

    /// Takes all members out.
    pub(super) fn clear(&mut self) {
        for cell in self.touched.drain(..) {
            self.cells[cell].clear();
        }
        self.members.clear();
        self.tested.clear();
    }

    /// Takes a triangle in unless it overlaps a member; tells whether it did.
    pub(super) fn add(&mut self, corners: [DVec2; 3]) -> bool {
        let in_grid = corners.map(|p| (p - self.origin) * self.scale);
        let mut cells = Vec::new();
        touched(in_grid, self.size, |row, columns| {
            cells.extend(columns.map(|column| row * self.size[0] + column));
        });
        if self.overlaps(corners, &cells) {
            return false;
        }
        for &cell in &cells {
            self.cells[cell].push(self.members.len() as u32);
        }
        self.touched.extend(cells);
        self.members.push(corners);
        self.tested.push(0);
        true
    }

    fn overlaps(&mut self, corners: [DVec2; 3], cells: &[usize]) -> bool {
        self.tests += 1;
        let mut left = MOST_TESTS;
        for &cell in cells {
            for &member in &self.cells[cell] {
                let member = member as usize;
                if self.tested[member] == self.tests {
                    continue;
                }
                self.tested[member] = self.tests;
                if left == 0 || overlap(corners, self.members[member]) {
                    return true;
                }
                left -= 1;
            }
        }
        false
    }
}

/// Whether two triangles of one orientation overlap by more than the rounding of their corners: no
/// edge of either has the other one beyond it (separating axes). Triangles at a common edge do not,
/// whatever the rounding, as an edge's function is exactly 0 at both of its ends.
fn overlap(a: [DVec2; 3], b: [DVec2; 3]) -> bool {
    let slack = rounding(a).max(rounding(b));
    !(parts(a, b, slack) || parts(b, a, slack))
}

/// Whether an edge of `a` has all of `b` on its outer side, but for a depth of `slack`.
fn parts(a: [DVec2; 3], b: [DVec2; 3], slack: f64) -> bool {
    (0..3).any(|i| {
        let [start, end] = [a[i], a[(i + 1) % 3]];
        let depth = slack * (end - start).length();
        b.iter().all(|&p| turn([start, end, p]) <= depth)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn upright(corners: [[f64; 2]; 3]) -> [DVec2; 3] {
        let mut corners = corners.map(DVec2::from);
        if turn(corners) < 0.0 {
            corners.swap(1, 2);
        }
        corners
    }

    #[test]
    fn neighbors_may_touch_but_not_cross() {
        let a = upright([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        let across = upright([[1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]);
        let folded = upright([[0.4, 0.4], [1.0, 0.0], [0.0, 1.0]]);
        let inside = upright([[0.1, 0.1], [0.2, 0.1], [0.1, 0.2]]);
        assert!(!overlap(a, across));
        assert!(overlap(a, folded) && overlap(a, inside) && overlap(a, a));
    }

    #[test]
    fn what_rounding_alone_makes_is_no_overlap() {
        let a = upright([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        let beside = upright([[-1.0, 0.0], [1e-8, 0.3], [1e-8, 0.6]]);
        assert!(!overlap(a, beside));
    }

    fn point() -> impl Strategy<Value = [f64; 2]> {
        prop::array::uniform2((0..12i32).prop_map(f64::from))
    }

    proptest! {
        #[test]
        fn the_grid_finds_what_all_pairs_would(
            triangles in prop::collection::vec(prop::array::uniform3(point()), 1..40),
        ) {
            let triangles: Vec<_> =
                triangles.into_iter().map(upright).filter(|&t| turn(t) > 0.0).collect();
            let mut region = Region::new([DVec2::ZERO, DVec2::splat(11.0)], triangles.len().max(1));
            let mut members: Vec<[DVec2; 3]> = Vec::new();
            for &triangle in &triangles {
                let free = !members.iter().any(|&member| overlap(triangle, member));
                prop_assert_eq!(region.add(triangle), free);
                if free {
                    members.push(triangle);
                }
            }
            region.clear();
            if let Some(&first) = triangles.first() {
                prop_assert!(region.add(first));
            }
        }
    }
}
