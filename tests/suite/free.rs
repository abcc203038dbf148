//! Levels without the source's charts, unwrapped: does each texel belong to one place, and is the shape the
//! better for it?

use crate::common::assets::{cube, picture, rigged, textured};
use crate::common::build::Build;
use crate::common::output::{Output, Part};
use crate::common::shapes::{sphere, torus};
use crate::common::{Baked, measured, unmeasured};
use glam::Vec3;
use seamwise::bake::Input;
use seamwise::bake::options::{BakeOptions, Targets, Textures};
use seamwise::export::files::{Layout, OutputOptions};
use seamwise::transfer::{Atlas, BakeNormals, Sizes, TransferOptions};
use serde_json::json;

/// Texels along the grid on which overlaps are looked for.
const GRID: usize = 256;

fn options(unwraps: bool, base: BakeOptions) -> BakeOptions {
    let atlas = Atlas::New;
    let own = TransferOptions { atlas, unwraps, sizes: Sizes::Scale(1.0), ..Default::default() };
    let targets = Targets::ratios(vec![0.25]).expect("a ratio");
    BakeOptions { targets, textures: Textures::Transfer(own), ..base }
}

/// Two balls in one mesh, each with a texture of its own.
fn balls() -> Build {
    let mut build = Build::new();
    let mut primitives = Vec::new();
    for (index, side) in [64, 32].into_iter().enumerate() {
        let material = build.textured(&picture(side));
        let mut primitive = build.primitive(&sphere(32, 16).moved([3.0 * index as f32, 0.0, 0.0]));
        primitive["material"] = json!(material);
        primitives.push(primitive);
    }
    build.mesh(primitives);
    build
}

/// The most triangles that one texel's centre lies in, but for their outlines.
fn most_at_one_texel(parts: &[Part]) -> usize {
    let mut counts = vec![0; GRID * GRID];
    for part in parts {
        for triangle in &part.triangles {
            let [a, b, c] = triangle.map(|v| {
                let uv = &part.uvs[v as usize];
                [f64::from(uv[0]), f64::from(uv[1])].map(|x| x * GRID as f64)
            });
            let side = |[x0, y0]: [f64; 2], [x1, y1]: [f64; 2], [x, y]: [f64; 2]| {
                (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
            };
            let all = side(a, b, c);
            for (at, count) in counts.iter_mut().enumerate() {
                let p = [at % GRID, at / GRID].map(|x| x as f64 + 0.5);
                let is_in = |x: f64| x / all > 1e-6;
                *count += usize::from(
                    is_in(side(a, b, p)) && is_in(side(b, c, p)) && is_in(side(c, a, p)),
                );
            }
        }
    }
    counts.into_iter().max().unwrap_or(0)
}

#[test]
fn each_texel_belongs_to_one_place() {
    let torus = textured(&torus(48, 24), &picture(64));
    let all = [("torus", torus), ("cube", cube(12)), ("balls", balls()), ("rigged", rigged())];
    for (name, build) in all {
        let level = Baked::bytes(name, &build.glb(), &options(true, unmeasured())).level(1);
        let parts: Vec<Part> =
            (0..level.gltf.meshes().len()).flat_map(|m| level.parts(m)).collect();
        let uvs: Vec<&Vec<f32>> = parts.iter().flat_map(|part| &part.uvs).collect();
        assert!(!uvs.is_empty(), "{name}");
        assert!(uvs.iter().all(|uv| uv.iter().all(|x| (0.0..=1.0).contains(x))), "{name}");
        // Materials have images of their own.
        let mut materials: Vec<Option<usize>> = parts.iter().map(|part| part.material).collect();
        materials.dedup();
        for material in materials {
            let own = parts.iter().filter(|part| part.material == material);
            assert_eq!(most_at_one_texel(&own.cloned().collect::<Vec<_>>()), 1, "{name}");
        }
    }
}

#[test]
fn a_shape_that_charts_cut_is_nearer_without_them_and_looks_as_it_did() {
    // A torus of one chart has two seams all around it.
    let glb = textured(&torus(64, 24), &picture(256)).glb();
    let [kept, free] = [false, true].map(|unwraps| {
        let report = Baked::bytes("torus", &glb, &options(unwraps, measured())).report;
        report.levels[0].metrics.expect("figures")
    });
    let (own, other) = (free.distance_rms, kept.distance_rms);
    assert!(own < other, "{own} of {other}");
    let [own, other] = [&free, &kept].map(|metrics| metrics.color_rms);
    // The source's one chart fills the image, those of the torus in space leave corners free.
    assert!(own < 2.0 * other, "color {own} of {other}");
}

#[test]
fn a_new_layout_has_as_many_texels_as_the_source_shows() {
    // Both halves of the source read all of its texels.
    let mut shape = torus(48, 24);
    shape.uvs.iter_mut().for_each(|uv| uv[0] = (2.0 * uv[0] - 1.0).abs());
    let glb = textured(&shape, &picture(128)).glb();
    let color = |unwraps: bool, sizes: Sizes| {
        let own = TransferOptions { atlas: Atlas::New, unwraps, sizes, ..Default::default() };
        let options =
            BakeOptions { textures: Textures::Transfer(own), ..options(unwraps, measured()) };
        let baked = Baked::bytes("mirrored", &glb, &options);
        let width = baked.level(1).picture(0).width();
        (width, baked.report.levels[0].metrics.expect("figures").color_rms)
    };
    for unwraps in [false, true] {
        let [(as_before, blurred), (dense, own)] =
            [Sizes::Scale(1.0), Sizes::Needed].map(|sizes| color(unwraps, sizes));
        assert_eq!([as_before, dense], [128, 256]);
        assert!(own < blurred, "{own} of {blurred}");
    }
}

#[test]
fn what_keeps_charts_on_a_surface_keeps_all_of_them() {
    let mut build = balls();
    // Its UVs have no texture to be laid out with.
    build.json["materials"][1] = json!({"pbrMetallicRoughness": {"metallicFactor": 0.0}});
    let glb = build.glb();
    let [kept, free] = [false, true].map(|unwraps| {
        let baked = Baked::bytes("sheet", &glb, &options(unwraps, unmeasured()));
        let told = baked.report.warnings.iter().any(|own| own.what.contains("--atlas free"));
        assert_eq!(told, unwraps);
        std::fs::read(baked.level_path(1)).expect("a level")
    });
    assert!(kept == free);
}

/// A ball with fine waves in its normals, without UVs and without a material.
fn wavy_ball() -> Vec<u8> {
    let mut shape = sphere(128, 64);
    for normal in &mut shape.normals {
        let wave = |x: f32| 0.25 * (24.0 * x).cos();
        let bent = Vec3::from_array(*normal) + Vec3::from_array(normal.map(wave));
        *normal = bent.normalize().to_array();
    }
    let mut build = Build::of(&shape);
    let attributes = build.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut();
    attributes.expect("attributes").remove("TEXCOORD_0");
    build.glb()
}

#[test]
fn levels_of_a_source_without_uvs_gain_some_and_a_map_of_the_shape_that_is_lost() {
    let glb = wavy_ball();
    let own = |textures| {
        let targets = Targets::ratios(vec![0.04]).expect("a ratio");
        Baked::bytes("ball", &glb, &BakeOptions { targets, textures, ..measured() })
    };
    let free = TransferOptions { atlas: Atlas::New, unwraps: true, ..Default::default() };
    let [plain, free] = [Textures::Repair, Textures::Transfer(free)].map(own);
    let level = free.level(1);
    let parts = level.parts(0);
    assert!(parts[0].uvs.iter().all(|uv| uv.len() == 2), "UVs");
    assert_eq!(most_at_one_texel(&parts), 1);
    let primitive = level.gltf.meshes().next().and_then(|mesh| mesh.primitives().next());
    let primitive = primitive.expect("a primitive");
    assert!(primitive.get(&gltf::Semantic::Tangents).is_some());
    assert!(primitive.material().normal_texture().is_some());
    assert!(plain.level(1).gltf.materials().next().is_none());
    let off = |baked: &Baked| baked.report.levels[0].metrics.expect("figures").rms_luminance;
    assert!(off(&free) < 0.4 * off(&plain), "{} of {}", off(&free), off(&plain));
}

#[test]
fn colors_of_vertices_become_a_texture_of_levels_that_are_free() {
    let shape = sphere(128, 64);
    let stripes = |p: &[f32; 3]| {
        let wave = |x: f32| 0.5 + 0.5 * (20.0 * x).sin();
        [wave(p[0]), 0.3, wave(p[1] + p[2])]
    };
    let colors: Vec<[f32; 3]> = shape.positions.iter().map(stripes).collect();
    let mut build = Build::of(&shape);
    let colors = build.floats(&colors);
    let material = json!({"pbrMetallicRoughness": {"metallicFactor": 0.0}});
    let material = build.add("materials", material);
    let primitive = &mut build.json["meshes"][0]["primitives"][0];
    primitive["material"] = json!(material);
    let attributes = primitive["attributes"].as_object_mut().expect("attributes");
    attributes.remove("TEXCOORD_0");
    attributes.insert("COLOR_0".into(), json!(colors));
    let glb = build.glb();
    let own = |textures| {
        let targets = Targets::ratios(vec![0.05]).expect("a ratio");
        let output = OutputOptions { layout: Layout::MsftLod, ..OutputOptions::default() };
        let options = BakeOptions { targets, textures, output, ..measured() };
        Baked::bytes("ball", &glb, &options)
    };
    let free = TransferOptions { atlas: Atlas::New, unwraps: true, ..Default::default() };
    let [plain, free] = [Textures::Repair, Textures::Transfer(free)].map(own);
    let has_colors = |output: &Output, mesh: usize| {
        let mesh = output.gltf.meshes().nth(mesh).expect("a mesh");
        let primitive = mesh.primitives().next().expect("a primitive");
        let is_read = primitive.get(&gltf::Semantic::Colors(0)).is_some();
        let pbr = primitive.material().pbr_metallic_roughness();
        (is_read, pbr.base_color_texture().is_some())
    };
    assert_eq!(has_colors(&plain.level(1), 0), (true, false));
    assert_eq!(has_colors(&free.level(1), 0), (false, true));
    let chain = free.chain();
    assert_eq!([0, 1].map(|mesh| has_colors(&chain, mesh)), [(true, false), (false, true)]);
    let off = |baked: &Baked| baked.report.levels[0].metrics.expect("figures");
    let [free, plain] = [off(&free), off(&plain)];
    assert!(free.color_rms < 0.3 * plain.color_rms, "{} of {}", free.color_rms, plain.color_rms);
    assert!(free.distance_rms <= 1.05 * plain.distance_rms);
}

#[test]
fn a_normal_map_that_has_nowhere_to_be_is_told() {
    let own = TransferOptions { bake_normals: BakeNormals::On, ..Default::default() };
    let options = BakeOptions { textures: Textures::Transfer(own), ..unmeasured() };
    let warnings = Baked::bytes("ball", &wavy_ball(), &options).report.warnings;
    assert!(warnings.iter().any(|own| own.what.contains("it has no UVs")));
}

#[test]
fn a_record_of_all_levels_needs_the_sources_charts() {
    let mut own = options(true, unmeasured());
    own.output = OutputOptions { progressive: true, ..OutputOptions::default() };
    let glb = cube(4).glb();
    let error = Baked::input(Input::Bytes(&glb, "cube"), &own).map(drop).expect_err("no record");
    assert!(error.to_string().contains("--progressive"), "{error}");
}
