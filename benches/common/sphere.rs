//! A displaced UV sphere: dense, curved everywhere, with one seam and two poles.

use std::f32::consts::PI;

use glam::Vec3;
use seamwise_attr::{Layout, Vertices};

/// A sphere of `rows` by `2 · rows` squares with UVs and normals, its radius waved by a few
/// octaves: 4 · rows · (rows − 1) triangles.
pub(crate) fn displaced_sphere(rows: usize) -> Vertices {
    let columns = 2 * rows;
    let layout = Layout { uv_sets: 1, normal: true, color: 0 };
    let mut vertices = Vertices { layout, ..Vertices::default() };
    for row in 0..=rows {
        for column in 0..=columns {
            let (u, v) = (column as f32 / columns as f32, row as f32 / rows as f32);
            let turn = if column == columns { 0.0 } else { u };
            let at = point(turn, v.clamp(0.0, 1.0), row == 0 || row == rows);
            vertices.positions.push(at);
            let normal = normal(at);
            vertices.attributes.extend([u, v, normal.x, normal.y, normal.z]);
        }
    }
    let stride = columns as u32 + 1;
    for row in 0..rows as u32 {
        for column in 0..columns as u32 {
            let a = row * stride + column;
            let below = a + stride;
            if row > 0 {
                vertices.triangles.push([a, below, a + 1]);
            }
            if row + 1 < rows as u32 {
                vertices.triangles.push([a + 1, below, below + 1]);
            }
        }
    }
    vertices.groups = vec![0; vertices.triangles.len()];
    vertices
}

fn point(u: f32, v: f32, pole: bool) -> Vec3 {
    let ring = if pole { 0.0 } else { (v * PI).sin() };
    let direction =
        Vec3::new(ring * (u * 2.0 * PI).cos(), (v * PI).cos(), ring * (u * 2.0 * PI).sin());
    direction * radius(direction)
}

fn radius(d: Vec3) -> f32 {
    let wave = |scale: f32, phase: f32| {
        (d.x * scale + phase).sin()
            * (d.y * scale * 1.1 - phase).sin()
            * (d.z * scale * 0.9 + 2.0 * phase).cos()
    };
    1.0 + 0.08 * wave(5.0, 0.3) + 0.03 * wave(17.0, 1.1) + 0.008 * wave(53.0, 2.3)
}

/// By differences along two tangents.
fn normal(at: Vec3) -> Vec3 {
    let direction = at.normalize();
    let (a, b) = direction.any_orthonormal_pair();
    let h = 1e-3;
    let on = |d: Vec3| {
        let d = d.normalize();
        d * radius(d)
    };
    let (a, b) = (
        on(direction + a * h) - on(direction - a * h),
        on(direction + b * h) - on(direction - b * h),
    );
    let normal = a.cross(b).normalize_or(direction);
    if normal.dot(direction) < 0.0 { -normal } else { normal }
}
