//! Who uses which texture after a transfer: shared images, materials of several users, and damaged input.

use std::collections::BTreeMap;

use crate::common::assets::picture;
use crate::common::build::Build;
use crate::common::output::Output;
use crate::common::shapes::{self, Shape};
use crate::common::textured::{bumps, covered_texels};
use crate::common::{Baked, transferred, unmeasured, within};
use image::DynamicImage;
use seamwise::bake::options::BakeOptions;
use seamwise::transfer::BakeNormals;
use serde_json::{Value, json};

/// Every texture of a material in a document: where it is named, how it is read, and what it shows.
fn textures_of(output: &Output, material: &Value) -> BTreeMap<String, (Value, Vec<u8>)> {
    fn collect(json: &Value, at: &str, found: &mut Vec<(String, Value)>) {
        for (key, value) in json.as_object().into_iter().flatten() {
            let at = format!("{at}/{key}");
            if key.ends_with("Texture") {
                found.push((at, value.clone()));
            } else {
                collect(value, &at, found);
            }
        }
    }
    let mut found = Vec::new();
    if let Some(material) = material.as_u64() {
        collect(&output.json["materials"][material as usize], "", &mut found);
    }
    let shown = |(at, mut info): (String, Value)| {
        let texture = &output.json["textures"][info["index"].take().as_u64().unwrap() as usize];
        let image = texture["source"].as_u64().unwrap() as usize;
        (at, (info, output.image_bytes(image).to_vec()))
    };
    found.into_iter().map(shown).collect()
}

/// The materials of a primitive, those of its variants too.
fn materials(primitive: &Value) -> Vec<Value> {
    let mappings = primitive["extensions"]["KHR_materials_variants"]["mappings"].as_array();
    let variants = mappings.into_iter().flatten().map(|mapping| mapping["material"].clone());
    std::iter::once(primitive["material"].clone()).chain(variants).collect()
}

/// Fails unless every level in the file of all of them uses what it does in its own.
fn assert_worn_alike(baked: &Baked) {
    let chain = baked.chain();
    for (index, level) in baked.levels().iter().enumerate() {
        for (number, node) in level.json["nodes"].as_array().unwrap().iter().enumerate() {
            let id = &chain.json["nodes"][number]["extensions"]["MSFT_lod"]["ids"][index];
            let mesh = chain.json["nodes"][id.as_u64().unwrap() as usize]["mesh"].as_u64().unwrap();
            let own = &level.json["meshes"][node["mesh"].as_u64().unwrap() as usize]["primitives"];
            let there = &chain.json["meshes"][mesh as usize]["primitives"];
            let [own, there] = [own, there].map(|list| list.as_array().unwrap());
            assert_eq!(own.len(), there.len());
            for (own, there) in own.iter().zip(there) {
                let [mine, theirs] = [materials(own), materials(there)];
                assert_eq!(mine.len(), theirs.len());
                for (mine, theirs) in mine.iter().zip(&theirs) {
                    assert!(
                        textures_of(level, mine) == textures_of(&chain, theirs),
                        "level {}",
                        index + 1
                    );
                }
                let has = |primitive: &Value| primitive["attributes"].get("TANGENT").is_some();
                assert_eq!(has(own), has(there));
            }
        }
    }
}

fn info<'a>(output: &'a Output, material: usize, slot: &str) -> &'a Value {
    output.json["materials"][material].pointer(slot).unwrap_or(&Value::Null)
}

/// The waved sheet in a part of the image: `columns` × `rows` of them fill it.
fn tile(column: u32, row: u32, [columns, rows]: [u32; 2]) -> Shape {
    let mut shape = shapes::patch(16).moved([3.0 * column as f32, 0.0, 3.0 * row as f32]);
    for uv in &mut shape.uvs {
        *uv = [
            (column as f32 + 0.05 + 0.9 * uv[0]) / columns as f32,
            (row as f32 + 0.05 + 0.9 * uv[1]) / rows as f32,
        ];
    }
    shape
}

fn levels(bake_normals: BakeNormals) -> BakeOptions {
    transferred(&[0.5, 0.15], 0.5, bake_normals)
}

#[test]
fn what_tiles_or_overlaps_is_shared_as_in_a_repair_and_the_rest_is_made_anew() {
    let mut build = Build::new();
    let mut add = |shapes: &[Shape]| {
        let texture = build.texture(&picture(64).into(), json!({}));
        let material = build.painted(texture);
        for shape in shapes {
            build.add_shape(shape, material);
        }
    };
    let mut mirrored = tile(0, 1, [1, 1]).uv_moved([0.0, -1.0]);
    mirrored.uvs.iter_mut().for_each(|uv| uv[0] = 1.0 - uv[0]);
    mirrored.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    add(&[tile(0, 0, [1, 1]), mirrored]);
    let mut tiling = tile(1, 0, [1, 1]);
    tiling.uvs.iter_mut().flatten().for_each(|at| *at *= 5.0);
    add(&[tiling]);
    add(&[shapes::torus(32, 16).moved([0.0, 5.0, 0.0])]);
    let bytes = build.glb();
    let anew = Baked::bytes("shared", &bytes, &levels(BakeNormals::On));
    let repaired = Baked::bytes(
        "shared",
        &bytes,
        &BakeOptions { targets: levels(BakeNormals::On).targets, ..unmeasured() },
    );
    for (own, repaired) in anew.levels().iter().zip(repaired.levels()) {
        for image in 0..3 {
            let is_same = own.image_bytes(image) == repaired.image_bytes(image);
            assert_eq!(is_same, image < 2, "image {image}");
        }
        let gained: Vec<bool> =
            (0..3).map(|material| info(own, material, "/normalTexture").is_object()).collect();
        assert_eq!(gained, [false, false, true]);
    }
    assert_worn_alike(&anew);
}

/// Fails unless the texels that a level's charts cover show what the source's image has there.
fn assert_shows(output: &Output, image: usize, source: &DynamicImage) {
    let own = output.picture(image).to_rgb8();
    let source = source.to_rgb8();
    let (mut sum, mut all) = (0.0, 0.0);
    for part in (0..output.gltf.meshes().len()).flat_map(|mesh| output.parts(mesh)) {
        let uvs: Vec<[f32; 2]> = part.uvs.iter().map(|uv| [uv[0], uv[1]]).collect();
        for ([x, y], ..) in covered_texels(&uvs, &part.triangles, [own.width(), own.height()]) {
            let scale = source.width() / own.width();
            let there = source.get_pixel(x * scale + scale / 2, y * scale + scale / 2);
            let pairs = own.get_pixel(x, y).0.into_iter().zip(there.0);
            sum += pairs.map(|(a, b)| f64::from(a.abs_diff(b))).sum::<f64>() / 3.0;
            all += 1.0;
        }
    }
    assert!(all > 0.0 && sum / all < 6.0, "texels are off by {}", sum / all);
}

#[test]
fn an_image_of_two_materials_and_two_meshes_is_made_for_both() {
    let mut build = Build::new();
    let texture = build.texture(&picture(128).into(), json!({"wrapS": 33071, "wrapT": 33071}));
    let [mapped, plain] = [build.painted(texture), build.painted(texture)];
    let normal = build.texture(&bumps(128, 0.3), json!({}));
    build.json["materials"][mapped]["normalTexture"] = json!({"index": normal, "scale": 0.7});
    build.add_shape(&tile(0, 0, [2, 1]), mapped);
    build.add_shape(&tile(1, 0, [2, 1]), plain);
    let baked = Baked::bytes("both", &build.glb(), &levels(BakeNormals::On));
    for level in baked.levels() {
        assert_shows(&level, 0, &picture(128).into());
        let base = |material| info(&level, material, "/pbrMetallicRoughness/baseColorTexture");
        assert_eq!(base(mapped), base(plain));
        let [old, new] = [mapped, plain].map(|material| info(&level, material, "/normalTexture"));
        assert_eq!((&old["index"], &old["scale"]), (&json!(normal), &json!(0.7)));
        assert!(new["index"].is_u64() && new["index"] != old["index"], "{new}");
        let tangents = level.json["meshes"].as_array().unwrap().iter();
        assert!(tangents.into_iter().all(|m| m["primitives"][0]["attributes"]["TANGENT"].is_u64()));
    }
    assert_worn_alike(&baked);
    let chain = baked.chain();
    assert_eq!(info(&chain, plain, "/normalTexture"), &Value::Null, "the source stays as it is");
}

#[test]
fn materials_worn_through_variants_are_made_anew_too() {
    let mut build = Build::new();
    let textures: [usize; 2] =
        std::array::from_fn(|at| build.texture(&picture(64 << at).into(), json!({})));
    let [own, other] = textures.map(|texture| build.painted(texture));
    let mut primitive = build.primitive(&tile(0, 0, [1, 1]));
    primitive["material"] = json!(own);
    let mappings =
        json!([{"material": own, "variants": [0]}, {"material": other, "variants": [1]}]);
    primitive["extensions"] = json!({"KHR_materials_variants": {"mappings": mappings}});
    build.mesh(vec![primitive]);
    let names = json!({"variants": [{"name": "day"}, {"name": "night"}]});
    build.json["extensions"] = json!({"KHR_materials_variants": names});
    build.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    let baked = Baked::bytes("variants", &build.glb(), &levels(BakeNormals::On));
    for (level, output) in (1..).zip(baked.levels()) {
        for (image, size) in [64, 128].into_iter().enumerate() {
            assert_eq!(output.picture(image).width(), size >> level);
            assert_shows(&output, image, &picture(size).into());
        }
        assert!([own, other].iter().all(|&m| info(&output, m, "/normalTexture").is_object()));
    }
    assert_worn_alike(&baked);
}

#[test]
fn a_gained_normal_map_is_read_as_its_own_material_reads_the_image() {
    let mut build = Build::new();
    let texture = build.texture(&picture(128).into(), json!({}));
    let [left, right] = [build.painted(texture), build.painted(texture)];
    let transform = json!({"KHR_texture_transform": {"offset": [0.5, 0.0], "scale": [0.5, 1.0]}});
    let slot = "/pbrMetallicRoughness/baseColorTexture";
    for (material, offset) in [(left, 0.0), (right, 0.5)] {
        let info = build.json["materials"][material].pointer_mut(slot).unwrap();
        info["extensions"] = transform.clone();
        info["extensions"]["KHR_texture_transform"]["offset"] = json!([offset, 0.0]);
    }
    build.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
    build.add_shape(&tile(0, 0, [1, 1]), left);
    build.add_shape(&tile(0, 0, [1, 1]).moved([3.0, 0.0, 0.0]), right);
    let baked = Baked::bytes("atlas", &build.glb(), &levels(BakeNormals::On));
    for level in baked.levels() {
        for material in [left, right] {
            let [normal, base] = ["/normalTexture", slot].map(|slot| info(&level, material, slot));
            assert!(normal["index"].is_u64());
            assert_eq!(normal["extensions"], base["extensions"], "material {material}");
        }
    }
    assert_worn_alike(&baked);
}

/// A sheet in a material with a base color and a normal map, one of its accessors put in place of
/// another, or its pictures of another size.
fn damaged(size: u32, edit: impl Fn(&mut Build, &mut Shape, &mut Value)) -> Build {
    let mut build = Build::new();
    let mut shape = tile(0, 0, [1, 1]);
    let [base, normal] = [DynamicImage::from(picture(size.max(8))), bumps(size, 0.3)];
    let base = build.texture(&base.crop_imm(0, 0, size, size), json!({}));
    let normal = build.texture(&normal, json!({}));
    let [mapped, plain] = [build.painted(base), build.painted(base)];
    build.json["materials"][mapped]["normalTexture"] = json!({"index": normal});
    let mut primitive = json!({"material": mapped});
    edit(&mut build, &mut shape, &mut primitive);
    let mut made = build.primitive(&shape);
    let made = made.as_object_mut().expect("a primitive");
    for (key, value) in primitive.as_object().expect("a primitive") {
        match value {
            Value::Null => drop(made["attributes"].as_object_mut().unwrap().shift_remove(key)),
            _ => drop(made.insert(key.clone(), value.clone())),
        }
    }
    let made = Value::Object(made.clone());
    build.mesh(vec![made]);
    build.json["materials"][plain]["doubleSided"] = json!(true);
    build
}

#[test]
fn damaged_charts_and_the_smallest_images_come_through_or_are_refused() {
    type Edit = fn(&mut Build, &mut Shape, &mut Value);
    let cases: [(&str, u32, Edit); 9] = [
        ("NaN", 32, |_, shape, _| shape.uvs[40] = [f32::NAN, 0.5]),
        ("infinite", 32, |_, shape, _| shape.uvs[40] = [f32::INFINITY, 0.5]),
        ("huge", 32, |_, shape, _| shape.uvs[40] = [1e30, -1e30]),
        ("far", 32, |_, shape, _| shape.uvs.iter_mut().for_each(|uv| uv[0] += 1e7)),
        ("one texel", 1, |_, _, _| {}),
        ("no area in the atlas", 32, |_, shape, _| shape.uvs.fill([0.5, 0.5])),
        ("no area", 32, |_, shape, _| {
            let extra = shape.triangles[..8].iter().map(|t| [t[0], t[1], t[1]]).collect::<Vec<_>>();
            shape.triangles.extend(extra);
            shape.positions[30] = shape.positions[31];
        }),
        ("no normals", 32, |_, _, primitive| {
            primitive["NORMAL"] = Value::Null;
            primitive["material"] = json!(1);
        }),
        ("zero normals", 32, |_, shape, _| shape.normals.fill([0.0; 3])),
    ];
    for (name, size, edit) in cases {
        let bytes = damaged(size, edit).glb();
        let result = within(120, name, move || {
            let options = levels(BakeNormals::On);
            Baked::input(seamwise::bake::Input::Bytes(&bytes, "damaged"), &options)
        });
        match result {
            Ok(baked) => {
                for level in baked.levels() {
                    (0..level.gltf.images().len()).for_each(|image| drop(level.picture(image)));
                }
                println!("{name}: baked");
            }
            Err(error) => {
                println!("{name}: {error}");
                assert!(error.to_string().contains("/"), "{name}: {error}");
            }
        }
    }
}
