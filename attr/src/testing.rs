//! Meshes that the tests of several modules draw on.

use glam::Vec3;

use crate::{Layout, Mesh, PointId, Vertices, weld};

/// A flat grid of n × n squares over 0…1, each cut along its rising diagonal, with its own (x, y)
/// as UV. Points are numbered row by row.
pub(crate) fn grid(n: usize) -> Mesh {
    surface(n, |x, y| Vec3::new(x, y, 0.0))
}

/// A grid of n × n squares bent to `shape` over 0…1 × 0…1.
pub(crate) fn surface(n: usize, shape: impl Fn(f32, f32) -> Vec3) -> Mesh {
    let at = |i: usize| i as f32 / n as f32;
    let mut vertices =
        Vertices { layout: Layout { uv_sets: 1, normal: false, color: 0 }, ..Vertices::default() };
    for row in 0..=n {
        for column in 0..=n {
            vertices.positions.push(shape(at(column), at(row)));
            vertices.attributes.extend([at(column), at(row)]);
        }
    }
    for row in 0..n {
        for column in 0..n {
            let corner = (row * (n + 1) + column) as u32;
            let above = corner + n as u32 + 1;
            vertices.triangles.push([corner, corner + 1, above + 1]);
            vertices.triangles.push([corner, above + 1, above]);
        }
    }
    vertices.groups = vec![0; vertices.triangles.len()];
    let welded = weld(&vertices).expect("a sound grid");
    renumber(welded.mesh, &vertices.positions)
}

/// A UV sphere of radius 1 with a seam where its UVs close, `n` rows by `2n` columns.
pub(crate) fn sphere(n: usize) -> Mesh {
    use std::f32::consts::PI;
    let mut vertices =
        Vertices { layout: Layout { uv_sets: 1, normal: true, color: 0 }, ..Vertices::default() };
    let columns = 2 * n;
    for row in 0..=n {
        for column in 0..=columns {
            let (u, v) = (column as f32 / columns as f32, row as f32 / n as f32);
            let turn = if column == columns { 0.0 } else { u * 2.0 * PI };
            let ring = if row == 0 || row == n { 0.0 } else { (v * PI).sin() };
            let normal = Vec3::new(ring * turn.cos(), ring * turn.sin(), (v * PI).cos());
            vertices.positions.push(normal);
            vertices.attributes.extend([u, v, normal.x, normal.y, normal.z]);
        }
    }
    let stride = columns as u32 + 1;
    for row in 0..n as u32 {
        for column in 0..columns as u32 {
            let a = row * stride + column;
            let below = a + stride;
            if row > 0 {
                vertices.triangles.push([a, below, a + 1]);
            }
            if row + 1 < n as u32 {
                vertices.triangles.push([a + 1, below, below + 1]);
            }
        }
    }
    vertices.groups = vec![0; vertices.triangles.len()];
    weld(&vertices).expect("a sound sphere").mesh
}

/// Points in the order of `positions` again, for tests that name them by number.
fn renumber(mesh: Mesh, positions: &[Vec3]) -> Mesh {
    let find = |p: Vec3| positions.iter().position(|&q| q == p).expect("a point of the grid");
    let order: Vec<usize> = mesh.positions.iter().map(|&p| find(p)).collect();
    Mesh {
        positions: positions.to_vec(),
        wedge_points: mesh.wedge_points.iter().map(|p| PointId::new(order[p.index()])).collect(),
        ..mesh
    }
}
