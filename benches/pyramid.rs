//! How many texels a second pull-push fills: an RGB atlas, half of it unused, as a scan has it.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use seamwise_texture::{Part, Plane, Wrap, fill_holes};

/// Charts of 48 texels with gaps of 16 and a quarter of the rows empty: 42 % valid.
fn atlas(size: usize) -> (Plane, Vec<Part>) {
    let mut plane = Plane::new(size, size, 3);
    let mut parts = Vec::with_capacity(size * size);
    for y in 0..size {
        for x in 0..size {
            let valid = x % 64 < 48 && y % 64 < 48 && y % 256 < 192;
            parts.push(if valid { Part::Source } else { Part::Hole });
            let color = [x as f32 / size as f32, y as f32 / size as f32, 0.5];
            plane.texel_mut(x, y).copy_from_slice(&color);
        }
    }
    (plane, parts)
}

fn fill(criterion: &mut Criterion) {
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

criterion_group!(benches, fill);
criterion_main!(benches);
