//! How fast is a surface built and searched? A sphere of 100,352 triangles; nearest points for
//! samples one percent of the radius off it, in the order of the triangles, and rays from inside in
//! no order. The rival for building and rays is obvhs, which knows no nearest point.

use std::hint::black_box;
use std::time::Duration;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use obvhs::{BvhBuildParams, bvh2::Bvh2, bvh2::builder::build_bvh2_from_tris};
use obvhs::{ray::Ray, ray::RayHit, triangle::Triangle};
use rayon::prelude::*;
use seamwise_attr::Surface;

const SIDE: u32 = 224;
const QUERIES: u32 = 200_000;

fn on_sphere(u: f32, v: f32) -> Vec3 {
    let (polar, around) = (v * std::f32::consts::PI, u * std::f32::consts::TAU);
    Vec3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos())
}

fn sphere() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let row = SIDE + 1;
    let positions = (0..row * row)
        .map(|at| on_sphere((at % row) as f32 / SIDE as f32, (at / row) as f32 / SIDE as f32));
    let quads = (0..SIDE * SIDE).map(|at| at / SIDE * row + at % SIDE);
    let triangles = quads.flat_map(|a| [[a, a + row, a + row + 1], [a, a + row + 1, a + 1]]);
    (positions.collect(), triangles.collect())
}

/// Points on the sphere, row after row.
fn queries() -> Vec<Vec3> {
    let side = f64::from(QUERIES).sqrt() as u32;
    let spot = |at: u32| {
        let (u, v) = (at % side, at / side);
        on_sphere((u as f32 + 0.37) / side as f32, (v as f32 + 0.61) / side as f32)
    };
    (0..side * side).map(spot).collect()
}

/// As many directions in no order.
fn directions() -> Vec<Vec3> {
    let share = |at: u32, step: u32| at.wrapping_mul(step) as f32 / u32::MAX as f32;
    (0..QUERIES).map(|at| on_sphere(share(at, 0x9E37_79B9), share(at, 0x85EB_CA6B))).collect()
}

fn rival_triangles(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Triangle> {
    let corner = |p: u32| positions[p as usize].into();
    let soup = triangles.iter();
    soup.map(|t| Triangle { v0: corner(t[0]), v1: corner(t[1]), v2: corner(t[2]) }).collect()
}

fn rival(triangles: &[Triangle]) -> Bvh2 {
    build_bvh2_from_tris(triangles, BvhBuildParams::medium_build(), &mut Duration::default())
}

fn build(criterion: &mut Criterion) {
    let (positions, triangles) = sphere();
    let soup = rival_triangles(&positions, &triangles);
    let mut group = criterion.benchmark_group("build");
    group.throughput(Throughput::Elements(triangles.len() as u64)).sample_size(20);
    group.bench_function("seamwise", |bench| {
        bench.iter(|| Surface::new(&positions, triangles.iter().copied()));
    });
    group.bench_function("obvhs", |bench| {
        bench.iter_batched(|| soup.clone(), |soup| rival(&soup), BatchSize::LargeInput);
    });
    group.finish();
}

fn nearest(criterion: &mut Criterion) {
    let (positions, triangles) = sphere();
    let surface = Surface::new(&positions, triangles.iter().copied());
    let queries: Vec<Vec3> = queries().into_iter().map(|q| q * 1.01).collect();
    let mut group = criterion.benchmark_group("nearest");
    group.throughput(Throughput::Elements(queries.len() as u64)).sample_size(10);
    group.bench_function("one thread", |bench| {
        bench.iter(|| queries.iter().filter(|&&q| surface.closest_point(q).is_some()).count());
    });
    group.bench_function("all threads", |bench| {
        bench.iter(|| queries.par_iter().filter(|&&q| surface.closest_point(q).is_some()).count());
    });
    group.finish();
}

fn rays(criterion: &mut Criterion) {
    let (positions, triangles) = sphere();
    let surface = Surface::new(&positions, triangles.iter().copied());
    let soup = rival_triangles(&positions, &triangles);
    let tree = rival(&soup);
    let origin = Vec3::new(0.1, 0.2, -0.3);
    let directions = directions();
    let mut group = criterion.benchmark_group("rays");
    group.throughput(Throughput::Elements(directions.len() as u64)).sample_size(10);
    group.bench_function("seamwise", |bench| {
        bench.iter(|| {
            for &way in &directions {
                black_box(surface.first_hit(origin, way, f32::INFINITY));
            }
        });
    });
    group.bench_function("obvhs", |bench| {
        bench.iter(|| {
            for &way in &directions {
                let mut hit = RayHit::none();
                tree.ray_traverse(Ray::new_inf(origin.into(), way.into()), &mut hit, |ray, at| {
                    soup[tree.primitive_indices[at] as usize].intersect(ray)
                });
                black_box(hit);
            }
        });
    });
    group.finish();
}

criterion_group!(benches, build, nearest, rays);
criterion_main!(benches);
