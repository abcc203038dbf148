//! How many views a second the renderer makes of a textured sphere of 100,000 triangles.

use std::f32::consts::{PI, TAU};
use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{Affine2, Vec2, Vec3};
use seamwise::evaluate::camera::Rig;
use seamwise::evaluate::render::render_views;
use seamwise::evaluate::scene::Mode;
use seamwise::evaluate::scene::{Material, Scene, TextureRef};
use seamwise_attr::{TangentInput, compute_tangents};
use seamwise_texture::{ColorEncoding, Mips, Wrap};

const VIEWS: usize = 6;

/// Noise of 2048² texels.
fn texture(seed: u32, encoding: ColorEncoding) -> Option<TextureRef> {
    let noise = |i: u32| (i ^ seed).wrapping_mul(2_654_435_761).rotate_left(15) as u8;
    let data: Vec<u8> = (0..2048 * 2048 * 4).map(noise).collect();
    let mips = Mips::from_rgba8(2048, 2048, &data, encoding).expect("the size is right");
    let transform = Affine2::IDENTITY;
    Some(TextureRef { mips: Arc::new(mips), wrap: [Wrap::Repeat; 2], uv_set: 0, transform })
}

fn material() -> Material {
    let packed = texture(2, ColorEncoding::Linear);
    Material {
        base_color_texture: texture(1, ColorEncoding::Srgb),
        metallic_roughness_texture: packed.clone(),
        normal_texture: texture(3, ColorEncoding::Linear),
        normal_scale: 0.3,
        occlusion_texture: packed,
        ..Material::default()
    }
}

/// A unit sphere of 2 · `rows` · 2 · `rows` triangles, those at the poles without area.
fn sphere(rows: u32) -> Scene {
    let columns = 2 * rows;
    let mut scene = Scene { materials: vec![material()], ..Scene::default() };
    for row in 0..=rows {
        for column in 0..=columns {
            let uv = Vec2::new(column as f32 / columns as f32, row as f32 / rows as f32);
            let (around, down) = (uv.x * TAU, uv.y * PI);
            scene.uvs[0].push(uv);
            scene.normals.push(Vec3::new(
                around.sin() * down.sin(),
                down.cos(),
                around.cos() * down.sin(),
            ));
        }
    }
    scene.positions = scene.normals.clone();
    for cell in 0..rows * columns {
        let a = cell / columns * (columns + 1) + cell % columns;
        let (b, c, d) = (a + 1, a + columns + 1, a + columns + 2);
        scene.triangles.extend([[a, c, d], [a, d, b]]);
    }
    scene.triangle_materials = vec![0; scene.triangles.len()];
    let input = TangentInput {
        positions: &scene.positions,
        normals: &scene.normals,
        uvs: &scene.uvs[0],
        triangles: &scene.triangles,
    };
    scene.tangents = compute_tangents(&input).expect("the sphere is sound");
    scene
}

fn views(criterion: &mut Criterion) {
    let scene = sphere(158);
    let rig = Rig::around(&scene, VIEWS, 512);
    let mut group = criterion.benchmark_group("render 99,856 triangles at 512²");
    group.throughput(Throughput::Elements(VIEWS as u64)).sample_size(10);
    for mode in [Mode::Lit, Mode::Unlit] {
        group.bench_function(format!("{mode:?}"), |bencher| {
            bencher.iter(|| render_views(black_box(&scene), &rig, mode));
        });
    }
    group.finish();
}

criterion_group!(benches, views);
criterion_main!(benches);
