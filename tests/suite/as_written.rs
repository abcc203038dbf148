//! OBJ, MTL, PLY and OFF as the world writes them: what has a clear meaning is read, and what is left
//! out, guessed or mended is said and may be refused.

use image::{DynamicImage, GrayImage, Luma};
use serde_json::{Value, json};

use super::formats::{Corner, Stage, corners};
use crate::common::assets::picture;
use crate::common::build::png;
use crate::common::formats::ply;
use crate::common::shapes::sphere;
use seamwise::document::asset::Asset;
use seamwise::import::options::ReadOptions;
use seamwise::import::read_with;

/// Three corners, and a face of them.
const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn said(asset: &Asset) -> Vec<String> {
    asset.warnings.iter().map(ToString::to_string).collect()
}

/// Reads a text that is to be warned of once, in words that hold `what`, at `place`; strictly, that is
/// an error.
fn warned(stage: &Stage, name: &str, text: impl AsRef<[u8]>, [place, what]: [&str; 2]) -> Asset {
    let asset = stage.read(name, text);
    let lines = said(&asset);
    assert!(lines.len() == 1 && lines[0].contains(place), "{place}: {lines:?}");
    assert!(lines[0].contains(what) && lines[0].contains(';'), "{what}: {lines:?}");
    let options = ReadOptions { strict: true, ..ReadOptions::default() };
    let error = read_with(&stage.0.path().join(name), options).expect_err("an error").to_string();
    assert!(error.starts_with(place) && error.contains(what), "{error}");
    assert!(error.contains("--strict") && !error.contains('\n'), "{error}");
    asset
}

/// The parts of corners behind their positions.
fn attributes(asset: &Asset) -> Vec<Corner> {
    corners(asset).into_iter().map(|corner| corner[3..].to_vec()).collect()
}

/// The one material of a triangle in an OBJ whose material file holds this beside `newmtl one`.
fn material(stage: &Stage, lines: &str) -> Value {
    stage.put("one.mtl", format!("newmtl one\n{lines}"));
    let asset = stage.read("a.obj", format!("mtllib one.mtl\nusemtl one\n{TRIANGLE}"));
    asset.json["materials"][0].clone()
}

fn opacity(material: &Value) -> f64 {
    material["pbrMetallicRoughness"]["baseColorFactor"][3].as_f64().expect("an opacity")
}

#[test]
fn a_byte_order_mark_hides_no_material_and_utf_16_is_a_text() {
    let stage = Stage::new();
    stage.put("one.mtl", "\u{feff}newmtl one\nKd 0.5 0.5 0.5\n");
    let text = format!("\u{feff}mtllib one.mtl\nusemtl one\n{TRIANGLE}");
    let units = text.encode_utf16();
    let wide: Vec<u8> = units.clone().flat_map(u16::to_le_bytes).collect();
    let wide_big: Vec<u8> = units.flat_map(u16::to_be_bytes).collect();
    let returns = text.replace('\n', "\r");
    for bytes in [text.as_bytes(), &wide, &wide_big, returns.as_bytes()] {
        let asset = stage.read("a.obj", bytes);
        assert_eq!(asset.json["materials"][0]["name"], "one");
        assert!(said(&asset).is_empty());
    }
}

#[test]
fn a_material_file_may_be_named_after_its_use_or_be_missing() {
    let stage = Stage::new();
    stage.put("one.mtl", "newmtl one\nnewmtl two\n");
    let used = TRIANGLE.replace("f ", "usemtl one\nf ");
    let asset = stage.read("a.obj", format!("{used}mtllib one.mtl\n"));
    assert_eq!(
        asset.json["materials"],
        stage.read("b.obj", format!("mtllib one.mtl\n{used}")).json["materials"]
    );
    assert_eq!(asset.json["materials"][0]["name"], "one");
    let plain = |asset: Asset| assert_eq!(asset.json["materials"][0]["name"], "plain");
    plain(warned(&stage, "c.obj", format!("mtllib no.mtl\n{used}"), ["line 1", "no.mtl"]));
    plain(warned(&stage, "c.obj", &used, ["line 4", "`mtllib`"]));
    let other = format!("mtllib one.mtl\n{}", used.replace("one", "steel"));
    plain(warned(&stage, "c.obj", other, ["line 5", "no material `steel`"]));
}

#[test]
fn a_material_that_is_defined_anew_is_the_one_that_was_last_where_it_is_used() {
    let stage = Stage::new();
    stage.put("a.mtl", "newmtl one\nKd 1 0 0\n");
    stage.put("b.mtl", "newmtl one\nKd 0 1 0\n");
    let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}mtllib b.mtl\nusemtl one\nf 1 3 2\n");
    let json = stage.read("a.obj", text).json;
    let color = |index: usize| {
        let material = json["meshes"][0]["primitives"][index]["material"].as_u64().expect("one");
        json["materials"][material as usize]["pbrMetallicRoughness"]["baseColorFactor"].clone()
    };
    assert_eq!([color(0), color(1)], [json!([1.0, 0.0, 0.0, 1.0]), json!([0.0, 1.0, 0.0, 1.0])]);
}

#[test]
fn tr_of_old_exporters_hides_nothing_and_d_wins() {
    let stage = Stage::new();
    stage.put("one.mtl", "newmtl one\nTr 1.000000\n");
    let text = format!("mtllib one.mtl\nusemtl one\n{TRIANGLE}");
    let asset = warned(&stage, "a.obj", text, ["one.mtl, line 2", "`Tr 1`"]);
    assert_eq!(opacity(&asset.json["materials"][0]), 1.0);
    assert_eq!(asset.json["materials"][0].get("alphaMode"), None);
    for (lines, expected) in [
        ("Tr 0.25\n", 0.75),
        ("Tr 0\n", 1.0),
        ("d 0.5\nTr 1\n", 0.5),
        ("Tr 1\nd 0.5\n", 0.5),
        ("d 0\n", 0.0),
        ("d -halo 0.5\n", 0.5),
        // Another that is seen says that this one is meant not to be.
        ("Tr 1\nnewmtl two\nTr 0\n", 0.0),
        // Two of the old kind.
        ("Tr 0.25\nnewmtl two\nTr 1\n", 0.25),
        ("Tr 1\nnewmtl two\nd 1\n", 1.0),
    ] {
        let own = material(&stage, lines);
        assert_eq!(opacity(&own), expected, "{lines}");
        assert_eq!(own.get("alphaMode").is_some(), expected < 1.0, "{lines}");
    }
}

#[test]
fn a_line_of_a_material_file_that_makes_no_sense_costs_that_line_alone() {
    let stage = Stage::new();
    stage.put("one.mtl", "newmtl one\nNs nan\nKd 0.5 0.5 0.5\n");
    let text = format!("mtllib one.mtl\nusemtl one\n{TRIANGLE}");
    let asset = warned(&stage, "a.obj", text, ["one.mtl, line 2", "`ns` is left out"]);
    let color = &asset.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"];
    assert_eq!(*color, json!([0.5, 0.5, 0.5, 1.0]));
}

#[test]
fn a_map_of_opacity_becomes_the_alpha_of_the_base_color() {
    let stage = Stage::new();
    let color = DynamicImage::from(picture(32)).to_rgb8();
    stage.put("tex.png", png(&DynamicImage::from(color.clone()).to_rgba8()));
    let save = |name: &str, alpha: fn(u32) -> u8| {
        let mask = GrayImage::from_fn(32, 32, |x, _| Luma([alpha(x)]));
        mask.save(stage.0.path().join(name)).expect("a picture");
        mask
    };
    let hard = save("hard.png", |x| if x < 16 { 0 } else { 255 });
    save("soft.png", |x| x as u8 * 8);
    save("opaque.png", |_| 255);
    let texels = |asset: &Asset| {
        let texture = &asset.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
        let texture = &asset.json["textures"][texture["index"].as_u64().expect("one") as usize];
        let image = texture["source"].as_u64().expect("an image") as usize;
        image::load_from_memory(&asset.images[image].bytes).expect("a picture").to_rgba8()
    };
    let read = |lines: &str| {
        stage.put("one.mtl", format!("newmtl one\n{lines}"));
        stage.read("a.obj", format!("mtllib one.mtl\nusemtl one\n{TRIANGLE}"))
    };
    let asset = read("map_Kd tex.png\nmap_d hard.png\n");
    assert_eq!(asset.json["materials"][0]["alphaMode"], "MASK");
    for ((texel, color), alpha) in texels(&asset).pixels().zip(color.pixels()).zip(hard.pixels()) {
        assert_eq!((&texel.0[..3], texel[3]), (&color.0[..], alpha[0]));
    }
    assert_eq!(asset.images.len(), 1, "the color alone is in nothing");
    assert!(said(&asset).is_empty());
    let asset = read("map_Kd tex.png\nmap_d soft.png\n");
    assert_eq!(asset.json["materials"][0]["alphaMode"], "BLEND");
    let asset = read("map_Kd tex.png\nmap_d opaque.png\n");
    assert_eq!(asset.json["materials"][0].get("alphaMode"), None);
    assert_eq!(texels(&asset), DynamicImage::from(color).to_rgba8());
    let asset = read("Kd 1 0 0\nmap_d hard.png\n");
    assert_eq!(opacity(&asset.json["materials"][0]), 1.0);
    assert_eq!(texels(&asset)[(31, 0)].0, [255; 4]);
    let asset = read("map_Kd tex.png\nmap_d -s 2 2 hard.png\n");
    assert!(said(&asset)[0].starts_with("one.mtl, line 3: `map_d` lies otherwise"));
}

#[test]
fn maps_are_found_from_their_material_file_and_guesses_are_told() {
    let stage = Stage::new();
    let folder = stage.0.path();
    std::fs::create_dir_all(folder.join("materials/images")).expect("a folder");
    for (name, size) in
        [("materials/images/a b.png", 4), ("beside.png", 8), ("materials/beside.png", 2)]
    {
        stage.put(name, png(&picture(size)));
    }
    let text = format!("mtllib materials/one.mtl\nusemtl one\n{TRIANGLE}");
    let read = |map: &str| {
        stage.put("materials/one.mtl", format!("newmtl one\nmap_Kd {map}\n"));
        stage.read("a.obj", &text)
    };
    for (map, uri, is_guess) in [
        ("images/a b.png", "materials/images/a b.png", false),
        ("\"images\\a b.png\"", "materials/images/a b.png", false),
        ("beside.png", "materials/beside.png", false),
        ("../beside.png", "beside.png", false),
        ("Images/A B.png", "materials/images/a b.png", true),
        ("C:\\work\\beside.png", "materials/beside.png", true),
    ] {
        let asset = read(map);
        assert_eq!(asset.json["images"][0]["uri"], uri, "{map}");
        let lines = said(&asset);
        assert_eq!(lines.len(), usize::from(is_guess), "{lines:?}");
        assert!(
            lines
                .iter()
                .all(|line| line.starts_with("materials/one.mtl, line 2: ") && line.contains(uri))
        );
    }
    read("beside.png");
    let quoted = text.replace("materials/one.mtl", "\"materials\\one.mtl\"");
    assert_eq!(stage.read("b.obj", quoted).json["materials"][0]["name"], "one");
    warned(&stage, "b.obj", text.replace("one.mtl", "One.mtl"), ["line 1", "is taken"]);
}

#[test]
fn maps_without_a_place_are_told_of() {
    let stage = Stage::new();
    picture(8);
    let heights = DynamicImage::from(picture(8)).to_luma8();
    heights.save(stage.0.path().join("heights.png")).expect("a picture");
    let text = format!("mtllib one.mtl\nusemtl one\n{TRIANGLE}");
    stage.put("one.mtl", "newmtl one\nmap_Bump heights.png\n");
    warned(&stage, "a.obj", &text, ["one.mtl, line 2", "heights"]);
    stage.put("one.mtl", "newmtl one\nmap_Ks gloss.png\n");
    let asset = stage.read("a.obj", &text);
    assert!(said(&asset)[0].starts_with("one.mtl, line 2: the map `map_ks`"), "{:?}", said(&asset));
}

#[test]
fn normals_without_a_direction_are_computed_from_the_faces() {
    let stage = Stage::new();
    for bad in ["nan nan nan", "0 0 0", "-nan(ind) 0 0", "1.#QNAN 0 0", "inf 0 0"] {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 1 0 0\nvn {bad}\nf 1//1 2//2 3//2\n");
        let asset = warned(&stage, "a.obj", text, ["line 5", "computed from the faces"]);
        let expected = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
        assert_eq!(attributes(&asset), expected, "{bad}");
    }
    let off = "NOFF\n3 1 0\n0 0 0 0 0 1\n1 0 0 nan 0 1\n0 1 0 0 0 1\n3 0 1 2\n";
    let asset = warned(&stage, "a.off", off, ["line 4", "computed from the faces"]);
    assert_eq!(attributes(&asset), [[0.0, 0.0, 1.0]; 3]);
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nproperty float nx\nproperty float ny\nproperty float nz\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n0 0 0 0 0 0\n1 0 0 0 0 1\n0 1 0 0 0 1\n\
        3 0 1 2\n";
    let asset = warned(&stage, "a.ply", ply, ["vertex 0", "computed from the faces"]);
    assert_eq!(attributes(&asset), [[0.0, 0.0, 1.0]; 3]);
}

#[test]
fn uvs_that_are_no_numbers_are_zero_and_positions_drop_their_faces() {
    let stage = Stage::new();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 0.5\nvt 1 0\nf 1/1 2/2 3/2\n";
    let asset = warned(&stage, "a.obj", text, ["line 4", "taken for 0 0"]);
    assert_eq!(attributes(&asset), [[0.0, 0.0], [1.0, 1.0], [1.0, 1.0]]);
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 4 3\nf 1 2 3\nf 4 2 3\n";
    let asset = warned(&stage, "a.obj", text, ["line 4", "faces there are left out"]);
    assert_eq!(corners(&asset), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let off = "OFF\n4 2 0\nnan 0 0\n0 0 0\n1 0 0\n0 1 0\n3 1 2 3\n3 0 1 2\n";
    let asset = warned(&stage, "a.off", off, ["line 3", "faces there are left out"]);
    assert_eq!(corners(&asset), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\
        nan 0 0\n0 0 0\n1 0 0\n0 1 0\n3 1 2 3\n3 0 1 2\n";
    let asset = warned(&stage, "a.ply", ply, ["vertex 0", "faces there are left out"]);
    assert_eq!(corners(&asset), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let all = stage.error("a.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    assert!(all.contains("without faces"), "{all}");
}

#[test]
fn uvs_and_normals_that_are_not_there_are_as_if_none_were_named() {
    let stage = Stage::new();
    let points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";
    let asset =
        warned(&stage, "a.obj", format!("{points}f 1/1/1 2/9/1 3/1/1\n"), ["line 6", "a UV"]);
    assert_eq!(attributes(&asset), [[0.0, 0.0, 1.0]; 3]);
    let asset =
        warned(&stage, "a.obj", format!("{points}f 1/1/1 2/1/-2 3/1/1\n"), ["line 6", "a normal"]);
    assert_eq!(attributes(&asset), [[0.0, 1.0]; 3]);
}

#[test]
fn colors_to_255_are_scaled_and_a_few_left_out() {
    let stage = Stage::new();
    let text = "v 0 0 0 255 0 127.5\nv 1 0 0 0 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n";
    let asset = warned(&stage, "a.obj", text, ["the colors", "count to 255"]);
    let half = seamwise_texture::color::srgb_to_linear(0.5);
    assert_eq!(attributes(&asset)[0], [1.0, 0.0, half]);
    let text = "v 0 0 0 1 0 1.0001\nv 1 0 0 0 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n";
    assert_eq!(attributes(&stage.read("a.obj", text))[0], [1.0, 0.0, 1.0]);
    let text = "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    warned(&stage, "a.obj", text, ["the colors", "some none"]);
}

#[test]
fn what_is_no_face_is_told_of() {
    let stage = Stage::new();
    warned(&stage, "a.obj", format!("{TRIANGLE}l 1 2\np 1\n"), ["line 5", "points, lines"]);
    warned(&stage, "a.obj", format!("{TRIANGLE}f 1 2\n"), ["line 5", "fewer than three"]);
}

#[test]
fn smoothing_groups_make_normals_where_there_are_none() {
    let stage = Stage::new();
    // A roof: two squares that meet at a ridge along y, at a right angle.
    let points = "v -1 0 0\nv 0 0 1\nv 1 0 0\nv -1 1 0\nv 0 1 1\nv 1 1 0\n";
    let roof = |groups: [&str; 2]| {
        let [left, right] = groups;
        let asset =
            stage.read("a.obj", format!("{points}s {left}\nf 1 2 5 4\ns {right}\nf 2 3 6 5\n"));
        assert!(said(&asset).is_empty());
        corners(&asset)
    };
    let normal = |corners: &[Corner], position: [f32; 3]| {
        let own = corners.iter().filter(|corner| corner[..3] == position);
        own.map(|corner| corner[3..].to_vec()).collect::<Vec<_>>()
    };
    let is_near =
        |own: &[f32], other: [f32; 3]| own.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-6);
    let half = 0.5f32.sqrt();
    let smooth = roof(["1", "1"]);
    assert!(normal(&smooth, [0.0, 0.0, 1.0]).iter().all(|own| is_near(own, [0.0, 0.0, 1.0])));
    assert!(normal(&smooth, [1.0, 0.0, 0.0]).iter().all(|own| is_near(own, [half, 0.0, half])));
    let sharp = roof(["1", "2"]);
    let ridge = normal(&sharp, [0.0, 1.0, 1.0]);
    assert!(ridge.iter().any(|own| is_near(own, [-half, 0.0, half])), "{ridge:?}");
    assert!(ridge.iter().any(|own| is_near(own, [half, 0.0, half])));
    // Flat faces beside smooth ones have none, and neither has a file without groups.
    assert_eq!(roof(["1", "off"]).iter().filter(|corner| corner.len() == 3).count(), 6);
    assert!(roof(["off", "0"]).iter().all(|corner| corner.len() == 3));
    // Where there are normals, groups say nothing.
    let own = format!("{points}vn 0 1 0\ns 1\nf 1//1 2//1 5//1 4//1\n");
    assert!(attributes(&stage.read("a.obj", own)).iter().all(|own| is_near(own, [0.0, 1.0, 0.0])));
}

/// A header for three vertices with these properties and a face with those, and the rows.
fn ascii_ply(vertex: &str, face: &str, rows: &str) -> String {
    let properties = |kinds: &str| -> String {
        kinds.split(", ").map(|property| format!("property {property}\n")).collect()
    };
    format!(
        "ply\nformat ascii 1.0\nelement vertex 3\n{}element face 1\n{}end_header\n{rows}",
        properties(&format!("float x, float y, float z{vertex}")),
        properties(&format!("list uchar int vertex_indices{face}")),
    )
}

#[test]
fn plies_name_their_properties_in_many_ways() {
    let stage = Stage::new();
    let uvs = [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]];
    for name in ["texcoord", "t", "uv", "texcoords"] {
        let rows = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 0 0 1\n";
        let asset = stage.read("a.ply", ascii_ply("", &format!(", list uchar float {name}"), rows));
        assert_eq!(attributes(&asset), uvs, "{name}");
        assert!(said(&asset).is_empty());
    }
    let rows = "0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n";
    for names in [
        ["s", "t"],
        ["u", "v"],
        ["texture_u", "texture_v"],
        ["texcoord_u", "texcoord_v"],
        ["S", "T"],
    ] {
        let [u, v] = names;
        let asset = stage.read("a.ply", ascii_ply(&format!(", float {u}, float {v}"), "", rows));
        assert_eq!(attributes(&asset), uvs, "{names:?}");
    }
    let colors = ", uchar red, uchar green, uchar blue";
    let rows = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 255\n";
    let asset = stage.read("a.ply", ascii_ply("", colors, rows));
    assert_eq!(attributes(&asset), [[1.0, 0.0, 1.0]; 3], "the color of a face");
    let rows = "0 0 0 255 0 0\n1 0 0 0 0 0\n0 1 0 0 0 0\n3 0 1 2\n";
    let floats = colors.replace("uchar", "float");
    let asset = warned(&stage, "a.ply", ascii_ply(&floats, "", rows), ["the colors", "to 255"]);
    assert_eq!(attributes(&asset)[0], [1.0, 0.0, 0.0]);
    let rows = "0 0 0 7\n1 0 0 7\n0 1 0 7\n3 0 1 2 7\n";
    let asset = stage.read("a.ply", ascii_ply(", float quality", ", int flags", rows));
    let lines = said(&asset);
    assert!(
        lines[0].contains("vertices `quality`") && lines[1].contains("faces `flags`"),
        "{lines:?}"
    );
}

#[test]
fn faces_of_different_colors_share_no_vertex() {
    let stage = Stage::new();
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nelement face 2\nproperty list uchar int vertex_indices\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n\
        0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3 0 255 0\n";
    let colors = attributes(&stage.read("a.ply", text));
    assert_eq!(colors[..3], vec![vec![1.0, 0.0, 0.0]; 3]);
    assert_eq!(colors[3..], vec![vec![0.0, 1.0, 0.0]; 3]);
}

#[test]
fn a_ply_whose_header_ends_its_lines_in_returns_is_the_same() {
    let stage = Stage::new();
    let shape = sphere(8, 6);
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let bytes = ply(&shape, encoding, "comment TextureFile tex.png\n");
        stage.put("tex.png", png(&picture(4)));
        let expected = corners(&stage.read("a.ply", &bytes));
        let end = bytes.windows(11).position(|window| window == b"end_header\n").expect("one") + 11;
        let (header, rows) = bytes.split_at(end);
        let header = String::from_utf8(header.to_vec()).expect("a text");
        let mut rows = rows.to_vec();
        if encoding == "ascii" {
            rows.iter_mut().filter(|byte| **byte == b'\n').for_each(|byte| *byte = b'\r');
        }
        let returns = [header.replace('\n', "\r").as_bytes(), &rows].concat();
        let asset = stage.read("b.ply", returns);
        assert!(corners(&asset) == expected, "{encoding}");
        assert_eq!(asset.images.len(), 1);
    }
}

#[test]
fn pictures_that_a_ply_has_not_leave_faces_plain() {
    let stage = Stage::new();
    stage.put("tex.png", png(&picture(4)));
    let rows = |number: i32| {
        let text =
            ascii_ply("", ", int texnumber", &format!("0 0 0\n1 0 0\n0 1 0\n3 0 1 2 {number}\n"));
        text.replace("element vertex", "comment TextureFile tex.png\nelement vertex")
    };
    let material = |asset: &Asset| {
        let index = asset.json["meshes"][0]["primitives"][0]["material"].as_u64().expect("one");
        asset.json["materials"][index as usize]["name"].clone()
    };
    assert_eq!(material(&stage.read("a.ply", rows(0))), "tex.png");
    let asset = stage.read("a.ply", rows(-1));
    assert!(material(&asset) == "plain" && said(&asset).is_empty());
    assert_eq!(material(&warned(&stage, "a.ply", rows(3), ["face 0", "TextureFile"])), "plain");
}

#[test]
fn strips_of_a_ply_are_faces() {
    let stage = Stage::new();
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n1 1 0\n5 0 1 2 3 -1\n";
    let own = corners(&stage.read("a.ply", text));
    let expected: [[f32; 3]; 6] =
        [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 1., 0.], [1., 0., 0.], [1., 1., 0.]];
    assert_eq!(own, expected);
}

#[test]
fn vertices_and_faces_of_an_off_run_over_lines() {
    let stage = Stage::new();
    let whole = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n4 0 1 2 3\n";
    let broken = "OFF\n4 2 0\n0 0\n0\n1\n0 0 # a\n1 1 0\n0 1 0\n3 0\n1 2\n4\n0 1\n# b\n2\n3\n";
    assert_eq!(corners(&stage.read("a.off", broken)), corners(&stage.read("b.off", whole)));
    let colored = whole.replace("3 0 1 2", "3 0 1 2 255 0 0");
    warned(&stage, "a.off", colored, ["line 7", "colors of faces"]);
}

#[test]
fn coordinates_that_floats_overflow_on_are_refused_with_their_place() {
    let stage = Stage::new();
    let error = stage
        .error("a.obj", TRIANGLE.replace("1 0 0", "340282346999999984391321947108527833088.0 0 0"));
    assert!(error.starts_with("line 2: ") && error.contains("scale it down"), "{error}");
    let error = stage.error("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 -3e38 0\n3 0 1 2\n");
    assert!(error.starts_with("line 5: ") && error.contains("scale it down"), "{error}");
    let error = stage.error("a.ply", ascii_ply("", "", "0 0 0\n3.4e38 0 0\n0 1 0\n3 0 1 2\n"));
    assert!(error.starts_with("vertex 1: ") && error.contains("scale it down"), "{error}");
}
