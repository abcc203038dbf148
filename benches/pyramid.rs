//! How many texels a second pull-push fills: an RGB atlas, half of it unused, as a scan has it.
//!
//! ```text
//! cargo bench --bench pyramid
//! cargo bench --bench pyramid -- --once 2048   # one fill: seconds, and how far it is from the field
//! ```
//!
//! `fill_peer.py` holds the latter against OpenImageIO's pull-push.

use std::time::Instant;

use criterion::{BenchmarkId, Criterion, Throughput};
use seamwise_texture::{Plane, TexelRole, Wrap, fill_holes};

/// A smooth field over the unit square, 0…1.
fn field(x: usize, y: usize, size: usize) -> [f32; 3] {
    let [u, v] = [x, y].map(|at| (at as f64 + 0.5) / size as f64 * std::f64::consts::TAU);
    let red = 0.5 + 0.4 * (1.5 * u).sin() * v.cos();
    let green = 0.5 + 0.4 * (u + 2.0 * v).cos();
    [red, green, u / std::f64::consts::TAU].map(|x| x as f32)
}

/// Charts of 48 texels with gaps of 16 and a quarter of the rows empty: 42 % valid.
fn is_valid(x: usize, y: usize) -> bool {
    x % 64 < 48 && y % 64 < 48 && y % 256 < 192
}

fn atlas(size: usize) -> (Plane, Vec<TexelRole>) {
    let mut plane = Plane::new(size, size, 3);
    let mut parts = Vec::with_capacity(size * size);
    for y in 0..size {
        for x in 0..size {
            let valid = is_valid(x, y);
            parts.push(if valid { TexelRole::Source } else { TexelRole::Hole });
            let color = if valid { field(x, y, size) } else { [0.0; 3] };
            plane.texel_mut(x, y).copy_from_slice(&color);
        }
    }
    (plane, parts)
}

fn measure(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("fill_holes");
    group.sample_size(20);
    for size in [512, 2048] {
        let (mut plane, parts) = atlas(size);
        group.throughput(Throughput::Elements((size * size) as u64));
        group.bench_function(BenchmarkId::new("rgb", size), |bencher| {
            bencher.iter(|| fill_holes(&mut plane, &parts, [Wrap::Repeat; 2]));
        });
    }
    group.finish();
}

/// Fills once, and tells how long it took and the RMS error of what was filled.
fn once(size: usize) {
    let (mut plane, parts) = atlas(size);
    let start = Instant::now();
    fill_holes(&mut plane, &parts, [Wrap::Clamp; 2]);
    let seconds = start.elapsed().as_secs_f64();
    let holes = (0..size * size).filter(|&at| parts[at] == TexelRole::Hole);
    let (mut sum, mut count) = (0.0, 0);
    for (x, y) in holes.map(|at| (at % size, at / size)) {
        for (is, should) in plane.texel(x, y).iter().zip(field(x, y, size)) {
            sum += f64::from(is - should).powi(2);
            count += 1;
        }
    }
    println!("{seconds} {}", (sum / f64::from(count)).sqrt());
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let size = arguments.iter().position(|argument| argument == "--once");
    if let Some(size) = size.and_then(|at| arguments.get(at + 1)?.parse().ok()) {
        return once(size);
    }
    let mut criterion = Criterion::default().configure_from_args();
    measure(&mut criterion);
    criterion.final_summary();
}
