//! Small surfaces with UVs, by formula. Points that belong together are equal to the bit, so that
//! a weld closes what is closed.

use std::f32::consts::{PI, TAU};

/// Vertices and triangles of one primitive; normals and UVs one per vertex.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shape {
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) normals: Vec<[f32; 3]>,
    pub(crate) uvs: Vec<[f32; 2]>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Shape {
    fn vertex(&mut self, position: [f32; 3], normal: [f32; 3], uv: [f32; 2]) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        self.uvs.push(uv);
        self.positions.len() as u32 - 1
    }

    /// Joins a grid of `columns` × `rows` vertices that starts at `first`.
    fn grid(&mut self, first: u32, columns: u32, rows: u32) {
        for row in 0..rows - 1 {
            for column in 0..columns - 1 {
                let a = first + row * columns + column;
                let (b, c, d) = (a + 1, a + columns, a + columns + 1);
                self.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
    }

    /// The same with every position scaled.
    pub(crate) fn scaled(mut self, factor: f32) -> Self {
        self.positions.iter_mut().flatten().for_each(|x| *x *= factor);
        self
    }

    /// The same with every position moved.
    pub(crate) fn moved(mut self, by: [f32; 3]) -> Self {
        for position in &mut self.positions {
            *position = std::array::from_fn(|axis| position[axis] + by[axis]);
        }
        self
    }

    /// The same with every UV moved.
    pub(crate) fn uv_moved(mut self, by: [f32; 2]) -> Self {
        for uv in &mut self.uvs {
            *uv = [uv[0] + by[0], uv[1] + by[1]];
        }
        self
    }

    /// The same without an index: three vertices for each triangle.
    pub(crate) fn unindexed(&self) -> Self {
        let order = || self.triangles.iter().flatten().map(|&vertex| vertex as usize);
        Self {
            positions: order().map(|v| self.positions[v]).collect(),
            normals: order().map(|v| self.normals[v]).collect(),
            uvs: order().map(|v| self.uvs[v]).collect(),
            triangles: (0..self.triangles.len() as u32)
                .map(|t| [0, 1, 2].map(|k| 3 * t + k))
                .collect(),
        }
    }
}

/// A closed sphere of radius 1 with a seam along one meridian; 2 · `segments` · (`rings` − 1)
/// triangles.
pub(crate) fn sphere(segments: u32, rings: u32) -> Shape {
    let mut shape = Shape::default();
    for ring in 0..=rings {
        for segment in 0..=segments {
            let (v, u) = (ring as f32 / rings as f32, segment as f32 / segments as f32);
            let (sin, cos) = match ring {
                0 => (0.0, 1.0),
                ring if ring == rings => (0.0, -1.0),
                _ => (v * PI).sin_cos(),
            };
            let (z, x) = ((segment % segments) as f32 / segments as f32 * TAU).sin_cos();
            let point = [sin * x, cos, -sin * z];
            shape.vertex(point, point, [0.02 + 0.96 * u, 0.02 + 0.96 * v]);
        }
    }
    for ring in 0..rings {
        for segment in 0..segments {
            let a = ring * (segments + 1) + segment;
            let (b, c, d) = (a + 1, a + segments + 1, a + segments + 2);
            if ring + 1 < rings {
                shape.triangles.push([a, c, d]);
            }
            if ring > 0 {
                shape.triangles.push([a, d, b]);
            }
        }
    }
    shape
}

/// A closed torus of radii 1 and 0.4 with a seam each way; 2 · `major` · `minor` triangles.
pub(crate) fn torus(major: u32, minor: u32) -> Shape {
    let mut shape = Shape::default();
    for i in 0..=major {
        for j in 0..=minor {
            let (u, v) = (i as f32 / major as f32, j as f32 / minor as f32);
            let (sin, cos) = ((i % major) as f32 / major as f32 * TAU).sin_cos();
            let (up, out) = ((j % minor) as f32 / minor as f32 * TAU).sin_cos();
            let radius = 1.0 + 0.4 * out;
            let uv = [0.05 + 0.9 * u, 0.05 + 0.9 * v];
            shape.vertex([radius * cos, 0.4 * up, -radius * sin], [out * cos, up, -out * sin], uv);
        }
    }
    shape.grid(0, minor + 1, major + 1);
    for triangle in &mut shape.triangles {
        triangle.swap(1, 2);
    }
    shape
}

/// Texels along a cell of the seam cube's atlas, and around the chart in it.
pub(crate) const CELL: u32 = 32;
/// Texels between a cell's rim and its chart.
pub(crate) const MARGIN: u32 = 4;
/// Size of the seam cube's atlas: three cells by two.
pub(crate) const ATLAS: [u32; 2] = [3 * CELL, 2 * CELL];

/// A closed cube of edge 2, each side `n` × `n` squares and a chart of its own in an atlas of
/// three cells by two.
pub(crate) fn seam_cube(n: u32) -> Shape {
    let mut shape = Shape::default();
    // Right, up and outward, right-handed.
    let sides: [[[f32; 3]; 3]; 6] = [
        [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
        [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]],
        [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
        [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]],
    ];
    for (side, [right, up, out]) in sides.into_iter().enumerate() {
        let first = shape.positions.len() as u32;
        let corner = [side as u32 % 3, side as u32 / 3].map(|cell| (cell * CELL + MARGIN) as f32);
        for row in 0..=n {
            for column in 0..=n {
                // Whole numbers over n, so that neighbors agree to the bit.
                let at = [column, row].map(|i| (2 * i as i32 - n as i32) as f32 / n as f32);
                let point = std::array::from_fn(|k| right[k] * at[0] + up[k] * at[1] + out[k]);
                let side = (CELL - 2 * MARGIN) as f32 / n as f32;
                let u = (corner[0] + column as f32 * side) / ATLAS[0] as f32;
                let v = (corner[1] + (n - row) as f32 * side) / ATLAS[1] as f32;
                shape.vertex(point, out, [u, v]);
            }
        }
        shape.grid(first, n + 1, n + 1);
    }
    shape
}

/// An open, gently waved sheet over −1…1 squared; 2 · `n`² triangles.
pub(crate) fn patch(n: u32) -> Shape {
    let mut shape = Shape::default();
    for row in 0..=n {
        for column in 0..=n {
            let [u, v] = [column, row].map(|i| i as f32 / n as f32);
            let (x, z) = (2.0 * u - 1.0, 1.0 - 2.0 * v);
            let [slope_x, slope_z] = [0.45 * (3.0 * x).cos(), -0.3 * (2.0 * z).sin()];
            let y = 0.15 * (3.0 * x).sin() + 0.15 * (2.0 * z).cos();
            let length = (1.0 + slope_x * slope_x + slope_z * slope_z).sqrt();
            let normal = [-slope_x / length, 1.0 / length, -slope_z / length];
            shape.vertex([x, y, z], normal, [u, 1.0 - v]);
        }
    }
    shape.grid(0, n + 1, n + 1);
    shape
}

/// A round bar along x over −1…1, open at its ends, with a seam; 2 · `segments` · `sides` triangles.
pub(crate) fn bar(segments: u32, sides: u32) -> Shape {
    let mut shape = Shape::default();
    for i in 0..=segments {
        for j in 0..=sides {
            let [u, v] = [i as f32 / segments as f32, j as f32 / sides as f32];
            let (sin, cos) = ((j % sides) as f32 / sides as f32 * TAU).sin_cos();
            shape.vertex([2.0 * u - 1.0, 0.2 * cos, 0.2 * sin], [0.0, cos, sin], [u, v]);
        }
    }
    shape.grid(0, sides + 1, segments + 1);
    shape
}

/// A book of `pages` sheets that share a spine: every edge of it has that many triangles.
pub(crate) fn book(pages: u32, n: u32) -> Shape {
    let mut shape = Shape::default();
    for page in 0..pages {
        let first = shape.positions.len() as u32;
        let (sin, cos) = (page as f32 / pages as f32 * TAU).sin_cos();
        for row in 0..=n {
            for column in 0..=n {
                let [u, v] = [column, row].map(|i| i as f32 / n as f32);
                let uv = [(page as f32 + 0.1 + 0.8 * u) / pages as f32, v];
                // Written so that the spine's points are +0 on every page.
                let point = if column == 0 { [0.0, v, 0.0] } else { [u * cos, v, u * sin] };
                shape.vertex(point, [-sin, 0.0, cos], uv);
            }
        }
        shape.grid(first, n + 1, n + 1);
    }
    shape
}
