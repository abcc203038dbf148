use super::*;
use crate::edges::Census;
use crate::mesh::Layout;
use crate::vertices::Vertices;
use crate::weld::{Welded, weld};
use glam::Vec3;
use std::f64::consts::TAU;

/// A grid of columns × rows squares bent to `shape` over 0…1 × 0…1, its last column and row computed.
fn sheet([columns, rows]: [u32; 2], shape: impl Fn(f64, f64) -> DVec3) -> Vertices {
    let mut vertices =
        Vertices { layout: Layout { uv_sets: 1, normal: false, color: 0 }, ..Vertices::default() };
    for row in 0..=rows {
        for column in 0..=columns {
            let [u, v] =
                [(column, columns), (row, rows)].map(|(at, n)| f64::from(at) / f64::from(n));
            vertices.positions.push(shape(u, v).as_vec3());
            vertices.attributes.extend([u as f32, v as f32]);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let [b, c, d] = [a + 1, a + columns + 2, a + columns + 1];
            vertices.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    vertices.groups = vec![0; vertices.triangles.len()];
    vertices
}

/// Both as one, the second in a group of its own.
fn both(mut a: Vertices, b: &Vertices) -> Vertices {
    let (first, group) = (a.positions.len() as u32, a.groups.iter().max().map_or(0, |g| g + 1));
    a.positions.extend(&b.positions);
    a.attributes.extend(&b.attributes);
    a.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + first)));
    a.groups.extend(b.groups.iter().map(|_| group));
    a
}

fn census(vertices: &Vertices) -> Census {
    Census::new(&weld(vertices).unwrap().mesh)
}

fn torus() -> Vertices {
    sheet([40, 16], |u, v| {
        let [(sin, cos), (up, out)] = [u, v].map(|turn| (turn * TAU).sin_cos());
        DVec3::new((1.0 + 0.4 * out) * cos, (1.0 + 0.4 * out) * sin, 0.4 * up)
    })
}

#[test]
fn a_torus_whose_seams_are_roundings_apart_is_closed_and_its_vertices_stay() {
    let torus = torus();
    let Welded { mesh, wedge_vertices, own_positions, .. } = &weld(&torus).unwrap();
    assert_eq!((Census::new(mesh).borders, Census::new(mesh).complex), (0, 0));
    assert_eq!(mesh.positions.len(), 40 * 16);
    assert!(!own_positions.is_empty());
    let welded = weld(&torus).unwrap();
    for (wedge, &vertex) in wedge_vertices.iter().enumerate() {
        let position = welded.vertex_position(WedgeId::new(wedge));
        assert_eq!(position, torus.positions[vertex as usize]);
    }
}

#[test]
fn poles_that_every_triangle_has_of_its_own_are_one_point() {
    let ball = sheet([24, 12], |u, v| {
        let ((sin, cos), (ring, up)) = ((u * TAU).sin_cos(), (v * TAU / 2.0).sin_cos());
        DVec3::new(ring * cos, ring * sin, up)
    });
    let mut ball = ball;
    let positions = ball.positions.clone();
    let is_thin = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        (b - a).cross(c - a).length() < 1e-6
    };
    ball.triangles.retain(|t| !is_thin(t));
    ball.groups = vec![0; ball.triangles.len()];
    assert_eq!(census(&ball).borders, 0);
}

/// The halves of a ball, each rounded to `steps` over its own longest side.
fn halves(steps: f64, precision: bool) -> Vertices {
    let half = |from: f64| {
        let mut half = sheet([24, 24], |u, v| {
            let (turn, tilt) = ((from + u / 2.0) * TAU, (0.02 + 0.96 * v) * TAU / 2.0);
            DVec3::new(tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos())
        });
        let (low, high) = half
            .positions
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), &p| (l.min(p), h.max(p)));
        let step = f64::from((high - low).max_element()) / steps;
        for p in &mut half.positions {
            let places = ((*p - low).as_dvec3() / step).round();
            *p = (low.as_dvec3() + places * step).as_vec3();
        }
        (half, step)
    };
    let ((a, step), (b, _)) = (half(0.1), half(0.6));
    let mut ball = both(a, &b);
    if precision {
        let slack = step * 0.75f64.sqrt();
        ball.precision = [1, 2].map(|grid| Precision { grid, slack }).to_vec();
    }
    ball
}

#[test]
fn halves_on_grids_of_their_own_meet_only_if_that_is_told() {
    // What is left open are the rings around the poles.
    for steps in [1023.0, 16383.0] {
        assert_eq!(census(&halves(steps, true)).borders, 2 * 48);
        assert!(census(&halves(steps, false)).borders > 2 * 48 + 2 * 30);
    }
}

#[test]
fn a_plate_of_two_sheets_and_layers_stay_apart() {
    let flat = |z: f64| sheet([8, 8], move |u, v| DVec3::new(u, v, z + 0.05 * (3.0 * u).sin()));
    let flipped = |z: f64| {
        let mut own = flat(z);
        own.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        own
    };
    for thickness in [0.0, 1e-7, 1e-6] {
        let plate = both(flat(0.0), &flipped(thickness));
        assert_eq!(census(&plate).borders, 64, "{thickness}");
    }
    assert_eq!(census(&both(flat(0.0), &flat(1e-7))).borders, 64);
    // Two layers of two tiles each, all edges along the cut a rounding apart: which goes on in which?
    let tile = |x: f64, z: f64| sheet([8, 8], move |u, v| DVec3::new(x + u, v, z));
    let layer = |z: f64| both(tile(0.0, z), &tile(1.0, z + 6e-8));
    assert_eq!(census(&layer(0.0)).borders, 48);
    assert_eq!(census(&both(layer(0.0), &layer(1.2e-7))).borders, 128);
}

#[test]
fn lips_that_move_apart_stay_apart() {
    let mut lips = both(
        sheet([8, 4], |u, v| DVec3::new(u, v, 0.0)),
        &sheet([8, 4], |u, v| DVec3::new(u, v - 1.0 + 6e-8, 0.0)),
    );
    assert_eq!(census(&lips).shells, 1);
    lips.motion = (0..lips.positions.len()).map(|v| u32::from(v >= 45)).collect();
    assert_eq!(census(&lips).shells, 2);
}

#[test]
fn a_crowd_of_layers_takes_no_time() {
    let card = |k: u32| {
        let off = DVec3::new(0.0, 0.0, 1e-12 * f64::from(k));
        sheet([1, 1], move |u, v| DVec3::new(u, v, 1e-3) + off)
    };
    let mut cards = card(0);
    for k in 1..4000 {
        let (own, first) = (card(k), cards.positions.len() as u32);
        cards.positions.extend(own.positions.iter().map(|p| *p + Vec3::Z * 1e-10 * k as f32));
        cards.attributes.extend(own.attributes);
        cards.triangles.extend(own.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    cards.groups = vec![0; cards.triangles.len()];
    let start = std::time::Instant::now();
    assert!(weld(&cards).is_ok());
    assert!(start.elapsed().as_secs() < 5);
}

#[test]
fn a_strip_narrower_than_a_rounding_keeps_its_triangles() {
    let strip = sheet([4, 1], |u, v| DVec3::new(u, 1e-7 * v, 0.0));
    let welded = weld(&strip).unwrap();
    assert_eq!((welded.mesh.triangles.len(), welded.mesh.positions.len()), (8, 10));
}
