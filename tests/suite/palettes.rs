//! Models whose UVs name colors of a small map, whole or in part: every face keeps its color.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::common::build::Build;
use crate::common::output::Output;
use crate::common::shapes::{self, Shape};
use crate::common::{Baked, shared_assets, unmeasured};
use glam::Vec3;
use image::{DynamicImage, Rgba, RgbaImage};
use seamwise::bake::Input;
use seamwise::bake::options::{BakeOptions, Targets, Textures};
use seamwise::transfer::{Atlas, TransferOptions};

/// Colors of the made map, along each side.
const SIDE: u32 = 4;

fn options(textures: Textures) -> BakeOptions {
    let targets = Targets::ratios(vec![0.5, 0.25]).expect("shares from fine to coarse");
    BakeOptions { targets, textures, ..unmeasured() }
}

fn ways() -> Vec<(&'static str, Textures)> {
    let chosen = TransferOptions { chooses: true, ..TransferOptions::default() };
    let anew = TransferOptions { atlas: Atlas::New, ..TransferOptions::default() };
    vec![
        ("repair", Textures::Repair),
        ("transfer", Textures::Transfer(TransferOptions::default())),
        ("transfer, new atlas", Textures::Transfer(anew)),
        ("auto", Textures::Transfer(chosen)),
    ]
}

/// A shape whose triangles have the colors that `color` tells by their middles; `place` is where the
/// UVs of a color lie.
fn colored(
    shape: &Shape,
    color: impl Fn(Vec3) -> u32,
    place: impl Fn(u32, usize) -> [f32; 2],
) -> Shape {
    let mut shape = shape.unindexed();
    for triangle in shape.triangles.clone() {
        let middle: Vec3 = triangle.iter().map(|&v| Vec3::from(shape.positions[v as usize])).sum();
        let own = color(middle / 3.0);
        for (corner, vertex) in triangle.into_iter().enumerate() {
            shape.uvs[vertex as usize] = place(own, corner);
        }
    }
    shape
}

/// The color of a place.
type Paint = fn(Vec3) -> u32;

/// A cab, a load, wheels and a bumper, with 16 colors in all.
fn truck_parts() -> Vec<(Shape, Paint)> {
    let wheel = |x: f32, z: f32| shapes::torus(20, 10).scaled(0.4).moved([x, -0.6, z]);
    vec![
        (shapes::seam_cube(10).scaled(1.2), |p| u32::from(p.y > 0.24) + 2 * u32::from(p.x > 0.12)),
        (shapes::sphere(28, 20).moved([-2.4, 0.2, 0.0]), |p| 4 + ((p.z + 1.0) * 2.0) as u32 % 4),
        (wheel(-2.0, 1.0), |p| 8 + u32::from(p.y > -0.6)),
        (wheel(0.5, 1.0), |p| 10 + u32::from(p.y > -0.6)),
        (wheel(0.5, -1.0), |p| 12 + u32::from(p.x > 0.5)),
        (shapes::bar(30, 12).scaled(0.8).moved([1.0, 0.0, -0.4]), |p| 14 + u32::from(p.y > 0.0)),
    ]
}

fn map(scale: u32) -> RgbaImage {
    RgbaImage::from_fn(SIDE * scale, SIDE * scale, |x, y| {
        let color = y / scale * SIDE + x / scale;
        Rgba([(color * 16 + 3) as u8, (251 - color * 13) as u8, (color * 101 % 256) as u8, 255])
    })
}

/// The truck as two meshes, the second of two primitives.
fn truck(scale: u32, spread: f32) -> Build {
    let mut build = Build::new();
    let material = build.textured(&map(scale));
    let place = |color: u32, corner: usize| {
        let middle = [(color % SIDE) as f32 + 0.5, (color / SIDE) as f32 + 0.5];
        let by = [[0.0, 0.0], [spread, 0.0], [0.0, spread]][corner];
        [(middle[0] + by[0]) / SIDE as f32, (middle[1] + by[1]) / SIDE as f32]
    };
    let mut primitives: Vec<_> = truck_parts()
        .iter()
        .map(|(shape, color)| {
            let mut primitive = build.primitive(&colored(shape, color, place));
            primitive["material"] = material.into();
            primitive
        })
        .collect();
    let rest = primitives.split_off(2);
    build.mesh(primitives);
    build.mesh(rest);
    build
}

/// The color that every bilinear read at a UV has, or none if it mixes several.
fn color_at(picture: &DynamicImage, uv: [f32; 2]) -> Option<[u8; 4]> {
    let picture = picture.to_rgba8();
    let side = |x: f32, size: u32| {
        let at = x * size as f32 - 0.5;
        [at.floor(), at.ceil()].map(|x| x.clamp(0.0, size as f32 - 1.0) as u32)
    };
    let (xs, ys) = (side(uv[0], picture.width()), side(uv[1], picture.height()));
    let reads: BTreeSet<[u8; 4]> =
        xs.iter().flat_map(|&x| ys.map(|y| picture.get_pixel(x, y).0)).collect();
    (reads.len() == 1).then(|| reads.into_iter().next()).flatten()
}

/// The area of each color, over faces whose corners all have one; and the UVs of those faces.
fn colors(output: &Output, is_color: impl Fn([f32; 2]) -> bool) -> BTreeMap<[u8; 4], f32> {
    let picture = output.picture(0);
    let mut areas = BTreeMap::new();
    for mesh in 0..output.gltf.meshes().len() {
        for part in output.parts(mesh) {
            for triangle in &part.triangles {
                let uvs = triangle.map(|v| uv(&part.uvs[v as usize]));
                if !is_color(uvs[0]) {
                    continue;
                }
                let own = uvs.map(|uv| color_at(&picture, uv).expect("a color of its own"));
                assert!(own[0] == own[1] && own[1] == own[2], "a face of several colors: {uvs:?}");
                let [a, b, c] = triangle.map(|v| Vec3::from(part.positions[v as usize]));
                *areas.entry(own[0]).or_default() += (b - a).cross(c - a).length() / 2.0;
            }
        }
    }
    areas
}

fn uv(row: &[f32]) -> [f32; 2] {
    [row[0], row[1]]
}

fn uv_bits(output: &Output) -> BTreeSet<[u32; 2]> {
    let meshes = 0..output.gltf.meshes().len();
    let parts = meshes.flat_map(|mesh| output.parts(mesh));
    parts.flat_map(|part| part.uvs).map(|row| uv(&row).map(f32::to_bits)).collect()
}

fn assert_same_colors(name: &str, source: &Output, level: &Output, within: f32) {
    let [before, after] = [source, level].map(|output| colors(output, |_| true));
    let keys = |areas: &BTreeMap<[u8; 4], f32>| areas.keys().copied().collect::<Vec<_>>();
    assert_eq!(keys(&before), keys(&after), "{name}");
    let off = |(color, area): (&[u8; 4], &f32)| after[color] / area - 1.0;
    let off: Vec<f32> = before.iter().map(off).collect();
    assert!(off.iter().all(|off| off.abs() < within), "{name}: areas are off by {off:.2?}");
}

#[test]
fn a_palette_mapped_truck_keeps_the_color_of_every_face() {
    for (kind, scale, spread) in [("points", 1, 0.0), ("in a texel", 8, 0.1), ("swatches", 16, 0.0)]
    {
        let glb = truck(scale, spread).glb();
        let source = Output::from_bytes(&glb, kind);
        for (way, textures) in ways() {
            let baked = Baked::bytes("truck", &glb, &options(textures));
            for (number, level) in baked.levels().iter().enumerate() {
                let name = format!("{kind}, {way}, level {number}");
                assert_eq!(source.image_bytes(0), level.image_bytes(0), "{name}");
                assert!(uv_bits(level).is_subset(&uv_bits(&source)), "{name}: UVs are others");
                assert_same_colors(&name, &source, level, 0.5);
            }
        }
    }
}

#[test]
fn the_color_parts_of_an_atlas_keep_their_colors() {
    let mut build = Build::new();
    // Noise on the left, one color in each texel of the right, with nothing around it.
    let noise = crate::common::textured::Pictures::noise(64).base.to_rgba8();
    let (place, is_color) = (
        |color: u32, _| [0.625 + (color % 4) as f32 / 8.0, 0.625 - (color / 4) as f32 / 8.0],
        |uv: [f32; 2]| uv[0] > 0.5,
    );
    let palette = map(1);
    let picture = RgbaImage::from_fn(128, 64, |x, y| {
        let named = (0..16).find(|&color| {
            let uv = place(color, 0);
            let at = [uv[0] * 128.0, uv[1] * 64.0];
            (at[0] - x as f32 - 0.5).abs() <= 1.0 && (at[1] - y as f32 - 0.5).abs() <= 1.0
        });
        match named {
            Some(color) => *palette.get_pixel(color % SIDE, color / SIDE),
            None if x < 64 => *noise.get_pixel(x, y),
            None => Rgba([0, 0, 0, 255]),
        }
    });
    let material = build.textured(&picture);
    let mut body = shapes::sphere(40, 24).scaled(3.0);
    body.uvs.iter_mut().for_each(|uv| *uv = [uv[0] * 0.46 + 0.01, uv[1] * 0.9 + 0.05]);
    let mut primitives = vec![build.primitive(&body)];
    for (shape, color) in truck_parts() {
        primitives.push(build.primitive(&colored(&shape, color, place)));
    }
    primitives.iter_mut().for_each(|primitive| primitive["material"] = material.into());
    build.mesh(primitives);
    let source = Output::from_bytes(&build.glb(), "mixed");
    let before = colors(&source, is_color);
    assert_eq!(before.len(), 16);
    for (way, textures) in ways() {
        let baked = Baked::bytes("mixed", &build.glb(), &options(textures));
        for level in baked.levels() {
            let after = colors(&level, is_color);
            assert!(before.keys().eq(after.keys()), "{way}: {after:?}");
        }
    }
}

#[test]
fn props_with_color_maps_keep_the_uvs_and_the_map() {
    let Some(assets) = shared_assets() else { return };
    let folders = ["props/kenney_racing", "props/kenney_platformer"].map(|own| assets.join(own));
    let files = folders.iter().flat_map(|folder| folder.read_dir().expect("a folder"));
    let mut files: Vec<_> = files.map(|entry| entry.expect("an entry").path()).collect();
    files.retain(|path| path.extension().is_some_and(|own| own == "glb"));
    for path in files {
        assert_kept(&path);
    }
}

fn assert_kept(path: &Path) {
    let name = path.display();
    let map = image::open(path.parent().expect("a folder").join("Textures/colormap.png"));
    let map = map.expect("a map").to_rgba8();
    let all = BakeOptions {
        targets: Targets::ratios(vec![1.0]).expect("a share"),
        textures: Textures::Keep,
        polish: None,
        ..unmeasured()
    };
    let source = Baked::input(Input::File(path), &all).expect("a bake");
    let uvs = uv_bits(&source.level(1));
    for (way, textures) in ways() {
        let baked = Baked::input(Input::File(path), &options(textures)).expect("a bake");
        for level in baked.levels() {
            assert_eq!(level.picture(0).to_rgba8(), map, "{name}, {way}");
            assert!(uv_bits(&level).is_subset(&uvs), "{name}, {way}: UVs are others");
        }
    }
}
