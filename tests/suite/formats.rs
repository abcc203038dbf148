//! OBJ, PLY and OFF: each comes in as the same mesh in glTF does, and damaged ones are errors.

use std::path::{Path, PathBuf};

use crate::common;
use crate::common::assets::picture;
use crate::common::build::{Build, png};
use crate::common::formats::{ENCODINGS, obj, off, ply, ply_color};
use crate::common::output::Output;
use crate::common::shapes::{Shape, seam_cube, sphere};
use crate::common::within;
use seamwise::document::asset::Asset;
use seamwise::export::glb::to_glb;
use seamwise::import::options::ReadOptions;
use seamwise::import::{read, read_with};
use serde_json::{Value, json};
use tempfile::TempDir;

/// A corner of a triangle: position, normal, UV and color, as far as it has them.
pub(super) type Corner = Vec<f32>;

pub(super) struct Stage(pub(super) TempDir);

impl Stage {
    pub(super) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    pub(super) fn put(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).expect("a file");
        path
    }

    pub(super) fn read(&self, name: &str, bytes: impl AsRef<[u8]>) -> Asset {
        read(&self.put(name, bytes)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub(super) fn error(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        let result = read(&self.put(name, bytes.as_ref()));
        result.expect_err(&String::from_utf8_lossy(bytes.as_ref())).to_string()
    }
}

/// The triangles of an asset, as an independent reader of its .glb has them.
pub(super) fn corners(asset: &Asset) -> Vec<Corner> {
    let output = Output::from_bytes(&to_glb(asset).expect("a .glb"), "asset");
    let mut corners = Vec::new();
    for mesh in output.gltf.meshes() {
        for primitive in mesh.primitives() {
            let rows = |kind| primitive.get(&kind).map(|accessor| output.rows(&accessor));
            let columns = [
                rows(gltf::Semantic::Positions),
                rows(gltf::Semantic::Normals),
                rows(gltf::Semantic::TexCoords(0)),
                rows(gltf::Semantic::Colors(0)),
            ];
            let indices = output.element_bytes(&primitive.indices().expect("indices"));
            for index in indices.as_chunks().0 {
                let index = u32::from_le_bytes(*index) as usize;
                let of = |rows: &Vec<Vec<f32>>| rows[index].clone();
                corners.push(columns.iter().flatten().flat_map(of).collect());
            }
        }
    }
    corners
}

fn as_gltf(shape: &Shape) -> Vec<Corner> {
    let glb = Build::of(shape).glb();
    corners(&seamwise::import::read_bytes(&glb, Path::new("")).expect("a .glb"))
}

fn assert_near(own: &[Corner], other: &[Corner], what: &str) {
    assert_eq!(own.len(), other.len(), "{what}");
    for (own, other) in own.iter().zip(other) {
        assert_eq!(own.len(), other.len(), "{what}");
        let is_near = own.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(is_near, "{what}: {own:?} {other:?}");
    }
}

#[test]
fn each_format_gives_the_mesh_that_gltf_gives() {
    let stage = Stage::new();
    stage.put("shape.mtl", "newmtl clay\nKd 0.5 0.25 0.125\n");
    for shape in [sphere(12, 8), seam_cube(3)] {
        let same = as_gltf(&shape);
        let asset = stage.read("a.obj", obj(&shape, "clay"));
        assert_near(&corners(&asset), &same, "OBJ");
        assert_eq!(asset.json["meshes"][0]["name"], "shape");
        assert_near(&corners(&stage.read("a.off", off(&shape))), &same, "OFF");
        let colored: Vec<Corner> = shape
            .triangles
            .iter()
            .flatten()
            .zip(same)
            .map(|(&vertex, corner)| {
                let linear =
                    ply_color(vertex as usize).map(seamwise_texture::color::srgb8_to_linear);
                [corner, linear.to_vec()].concat()
            })
            .collect();
        for encoding in ENCODINGS {
            let asset = stage.read("a.PLY", ply(&shape, encoding, ""));
            assert_near(&corners(&asset), &colored, encoding);
        }
    }
}

#[test]
fn positions_of_a_polygon_of_any_size_come_as_triangles() {
    let stage = Stage::new();
    let positions = |text: &str| -> Vec<Vec<f32>> {
        corners(&stage.read("a.obj", text)).into_iter().map(|corner| corner[..3].to_vec()).collect()
    };
    let square = "v 0 0 0\nv 1 0 0 # a corner\nv 1 1 0\nv 0 1 0\r\n";
    let two = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
    for face in [
        "f 1 2 3 4",
        "f -4 -3 -2 -1",
        "f 1 2 3 4 # all",
        "f 1 2 \\\n 3 4",
        "l 1 2\nf 1 2\nf 1 2 3 4",
    ] {
        assert_eq!(positions(&format!("{square}{face}")), two, "{face}");
    }
    let off = "4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3";
    for text in
        [format!("OFF\n{off}"), format!("OFF{off}"), off.into(), format!("#\nOFF #\n\n{off}\n#")]
    {
        let asset = stage.read("a.off", &text);
        assert_near(&corners(&asset), &two.map(|corner| corner.to_vec()), &text);
    }
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\n\
        property double z\nelement face 1\nproperty list uchar uint vertex_index\nend_header\n\
        0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
    assert_near(&corners(&stage.read("a.ply", ply)), &two.map(|corner| corner.to_vec()), "PLY");
}

#[test]
fn colors_come_in_linear_light() {
    let stage = Stage::new();
    let half = seamwise_texture::color::srgb_to_linear(0.5);
    let rest = "3 0 1 2";
    let vertex =
        |color: &str| ["0 0 0", "1 0 0", "0 1 0"].map(|p| format!("{p} {color}")).join("\n");
    let off = |color: &str| format!("COFF\n3 1 0\n{}\n{rest}", vertex(color));
    let ply = |kind: &str, color: &str| {
        let property = |name: &str| format!("property {kind} {name}\n");
        let names: String = ["red", "green", "blue", "alpha"].map(property).concat();
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
             property float z\n{names}element face 1\nproperty list uchar int vertex_indices\n\
             end_header\n{}\n{rest}\n",
            vertex(color)
        )
    };
    let obj = format!("v {}\nf 1 2 3", vertex("1 0 0.5").replace('\n', "\nv "));
    for (name, text, color) in [
        ("a.off", off("1 0 0.5"), vec![1.0, 0.0, half]),
        ("a.off", off("1 0 0.5 0.25"), vec![1.0, 0.0, half, 0.25]),
        ("a.off", off("255 0 127.5 51"), vec![1.0, 0.0, half, 0.2]),
        ("a.ply", ply("float", "1 0 0.5 0.25"), vec![1.0, 0.0, half, 0.25]),
        ("a.ply", ply("uchar", "255 0 0 51"), vec![1.0, 0.0, 0.0, 0.2]),
        ("a.obj", obj, vec![1.0, 0.0, half]),
    ] {
        let corner = corners(&stage.read(name, text)).remove(0);
        assert_near(&[corner[3..].to_vec()], &[color], name);
    }
}

#[test]
fn objects_and_materials_become_meshes_and_primitives() {
    let stage = Stage::new();
    stage.put("a b.mtl", "newmtl one\nnewmtl two\n");
    let text = "mtllib a b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 2\nvt 0.25 0.25\n\
        o left\nusemtl one\nf 1 2 3\nf 1//1 2//1 3//1\ng right\nusemtl two\nf 1/1 2/1 3/1\n\
        o left\nf 3 2 1\nusemtl one\nf 3 1 2\no empty\n";
    let asset = stage.read("a.obj", text);
    let meshes = asset.json["meshes"].as_array().expect("meshes");
    let names: Vec<&Value> = meshes.iter().map(|mesh| &mesh["name"]).collect();
    assert_eq!(names, ["left", "right"]);
    let parts = meshes[0]["primitives"].as_array().expect("primitives");
    let materials: Vec<&Value> = parts.iter().map(|part| &part["material"]).collect();
    assert_eq!(materials, [&json!(0), &json!(0), &json!(1)]);
    assert_eq!(corners(&asset)[6], [0.0, 0.0, 0.0, 0.0, 0.0, 1.0], "a normal of unit length");
    assert_eq!(corners(&asset).last().map(|corner| corner[3..].to_vec()), Some(vec![0.25, 0.75]));
}

#[test]
fn a_material_file_becomes_gltf_materials() {
    let stage = Stage::new();
    let picture = image::DynamicImage::from(picture(8));
    for name in ["c.tga", "d.bmp", "e.jpg", "f.webp"] {
        picture.to_rgb8().save(stage.0.path().join(name)).expect("a picture");
    }
    stage.put("bump.png", png(&picture.to_rgba8()));
    picture.to_luma8().save(stage.0.path().join("heights.png")).expect("a picture");
    stage.put(
        "shape.mtl",
        "newmtl plain\nKd 0.5 0.25 0.125\nd 0.5\nNs 30\n\
         newmtl tga\nKd 0 0 0\nmap_Kd C:\\work\\c.tga\nmap_Bump -bm 0.5 bump.png\n\
         newmtl bmp\nmap_Kd -s 2 4 1 -o 0.5 0.25 d.bmp\nbump heights.png\nKe 2 1 0\n\
         newmtl jpg\nmap_Kd -clamp on e.jpg\nnorm bump.png\nPr 0.3\nPm 1\nmap_Ke bump.png\n\
         newmtl webp\nTr 0.25\nmap_Kd f.webp\n",
    );
    let names = ["plain", "tga", "bmp", "jpg", "webp"];
    let faces: String = names.iter().map(|name| format!("usemtl {name}\nf 1 2 3\n")).collect();
    let text = format!("mtllib shape.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{faces}");
    let json = stage.read("a.obj", &text).json;
    let [plain, tga, bmp, jpg, webp] = std::array::from_fn(|at| &json["materials"][at]);
    let pbr = |material: &Value, key: &str| material["pbrMetallicRoughness"][key].clone();
    assert_eq!(pbr(plain, "baseColorFactor"), json!([0.5, 0.25, 0.125, 0.5]));
    assert_eq!((&plain["alphaMode"], pbr(plain, "roughnessFactor")), (&json!("BLEND"), json!(0.5)));
    assert_eq!(pbr(tga, "baseColorFactor"), json!([1.0, 1.0, 1.0, 1.0]));
    assert_eq!(tga["normalTexture"]["scale"], 0.5);
    assert_eq!(bmp["emissiveFactor"], json!([1.0, 1.0, 0.0]));
    assert_eq!(bmp.get("normalTexture"), None, "a map of heights");
    let transform = &bmp["pbrMetallicRoughness"]["baseColorTexture"]["extensions"];
    let expected = json!({"offset": [0.5, -3.25], "scale": [2.0, 4.0]});
    assert_eq!(transform["KHR_texture_transform"], expected);
    assert_eq!(
        (pbr(jpg, "metallicFactor"), pbr(jpg, "roughnessFactor")),
        (json!(1.0), json!(0.3f32))
    );
    assert!(jpg["normalTexture"].is_object() && jpg["emissiveTexture"].is_object());
    let clamped =
        &json["textures"][pbr(jpg, "baseColorTexture")["index"].as_u64().expect("one") as usize];
    assert_eq!(
        json["samplers"][clamped["sampler"].as_u64().expect("one") as usize]["wrapS"],
        33071
    );
    assert_eq!(json["extensionsRequired"], json!(["EXT_texture_webp"]));
    assert_eq!(pbr(webp, "baseColorFactor")[3], 0.75);
    let asset = stage.read("a.obj", &text);
    let kinds: Vec<&[u8]> = asset.images.iter().map(|image| &image.bytes[..4]).collect();
    assert_eq!(kinds, [b"\x89PNG", b"\x89PNG", b"\x89PNG", b"\xff\xd8\xff\xe0", b"RIFF"]);
    for (at, image) in asset.images.iter().enumerate().take(3) {
        let decoded = image::load_from_memory(&image.bytes).expect("a PNG");
        assert_eq!(decoded.to_rgb8(), picture.to_rgb8(), "{at}");
    }
}

#[test]
fn what_is_missing_is_named_and_may_be_let_go() {
    let stage = Stage::new();
    let face = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl one\nf 1 2 3\n";
    let no_library = format!("\nmtllib none.mtl\n{face}");
    stage.put("one.mtl", "newmtl one\n\nmap_Kd none.png\n");
    let error = stage.error("a.obj", format!("mtllib one.mtl\n{face}"));
    assert!(error.starts_with("one.mtl, line 3: none.png can't be read"), "{error}");
    let asset = stage.read("b.obj", format!("mtllib one.mtl\n{}", face.replace("one", "(null)")));
    assert_eq!(asset.json["materials"][0]["name"], "plain");
    let options = ReadOptions { allow_missing: true, ..ReadOptions::default() };
    let asset = read_with(&stage.0.path().join("a.obj"), options).expect("an asset");
    let said: Vec<String> = asset.warnings.iter().map(ToString::to_string).collect();
    assert!(said[0].starts_with("/images/0/uri: none.png is not there: "), "{said:?}");
    let asset = stage.read("b.obj", no_library);
    let said: Vec<String> = asset.warnings.iter().map(ToString::to_string).collect();
    assert!(said.len() == 1 && said[0].starts_with("line 2: none.mtl can't be read"), "{said:?}");
}

#[test]
fn a_ply_wears_the_pictures_that_it_names() {
    let stage = Stage::new();
    for name in ["a.png", "b.png"] {
        stage.put(name, png(&picture(4)));
    }
    let shape = sphere(6, 4);
    let asset = stage.read("a.ply", ply(&shape, "ascii", "comment TextureFile a.png\n"));
    assert_eq!(asset.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
    assert_eq!(corners(&asset).len(), 3 * shape.triangles.len());
    let by_corner = "ply\nformat ascii 1.0\ncomment TextureFile a.png\ncomment TextureFile b.png\n\
        element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n\
        property list uchar int vertex_indices\nproperty list uchar float texcoord\n\
        property int texnumber\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n\
        3 0 1 2 6 0 0 1 0 1 1 0\n3 0 2 3 6 0.5 0 1 1 0 1 1\n";
    let asset = stage.read("a.ply", by_corner);
    let materials: Vec<u64> = asset.json["meshes"][0]["primitives"]
        .as_array()
        .expect("primitives")
        .iter()
        .map(|primitive| primitive["material"].as_u64().expect("a material"))
        .collect();
    assert_eq!(materials, [0, 1]);
    let uvs: Vec<&[f32]> =
        vec![&[0.0, 1.0], &[1.0, 1.0], &[1.0, 0.0], &[0.5, 1.0], &[1.0, 0.0], &[0.0, 0.0]];
    let own = corners(&asset);
    assert_eq!(own.iter().map(|corner| &corner[3..]).collect::<Vec<_>>(), uvs);
}

#[test]
fn damage_is_named_with_its_place() {
    let stage = Stage::new();
    let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (text, place, what) in [
        ("v 0 0\n".into(), "line 1", "fewer than 3"),
        ("\n# x\nv 0 zero 0\n".into(), "line 3", "`zero`"),
        ("v 0 0 -2e18\n".into(), "line 1", "scale it down"),
        (format!("{three}f 1 2 4\n"), "line 4", "4 is not one of the 3 positions"),
        (format!("{three}f 1 2 -4\n"), "line 4", "-4"),
        (format!("{three}f 0 1 2\n"), "line 4", "0 is not"),
        (format!("{three}f 1///1 2 3\n"), "line 4", "`1///1` is no corner"),
        (format!("{three}f 9223372036854775807 2 3\n"), "line 4", "is not one"),
        (three.into(), "an OBJ without faces", "not supported"),
    ] {
        let error = stage.error("a.obj", &text);
        assert!(error.starts_with(place) && error.contains(what), "{text}: {error}");
    }
    for (text, place, what) in [
        ("", "the end", "less"),
        ("PLY\n", "line 1", "`PLY`"),
        ("4OFF\n", "line 1", "4OFF"),
        ("OFF BINARY\n", "line 1", "BINARY"),
        ("OFF\n3\n", "line 2", "numbers"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n", "the end", "less"),
        ("OFF\n18446744073709551615 1 0\n0 0 0\n", "the end", "less"),
        ("OFF\n1 1 0\n0 0\n", "line 3", "fewer"),
        ("OFF\n1 1 0\n0 0 0\n3 0 0 1\n", "line 4", "1 is not one of the 1"),
        ("OFF\n1 1 0\n0 0 0\n18446744073709551615 0 0\n", "line 4", "has 2"),
        ("OFF\n1 0 0\n0 0 0\n", "an OFF without faces", "not supported"),
    ] {
        let error = stage.error("a.off", text);
        assert!(error.starts_with(place) && error.contains(what), "{text}: {error}");
    }
    let of = |rest: &str| format!("ply\nformat ascii 1.0\n{rest}");
    let point = "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
    let face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    for (text, place, what) in [
        ("".into(), "byte 0", "end of file"),
        ("plyx\n".into(), "line 1", "ply"),
        (of("element vertex 1\nproperty flat x\n"), "line 4", "flat"),
        (of("element vertex 18446744073709551615\nend_header\n"), "the header", "more than"),
        (of(&format!("{point}end_header\n0 0 0\n")), "a PLY without faces", "not supported"),
        (of(&format!("{point}{face}0 x 0\n3 0 0 0\n")), "line 10", "x"),
        (of(&format!("{point}{face}0 0 0\n3 0 0 1\n")), "face 0", "1 is not one"),
        (of(&format!("{point}{face}0 0 0\n3 0 0 -1\n")), "face 0", "-1 is not one"),
        (of(&format!("{point}{face}0 0 0\n3 0 0\n")), "line 11", "found only 2"),
        (
            of(&format!("{}{face}0\n3 0 0 0\n", "element vertex 1\nproperty float x\n")),
            "the header",
            "x, y and z",
        ),
    ] {
        let error = stage.error("a.ply", &text);
        assert!(error.starts_with(place) && error.contains(what), "{text}: {error}");
    }
    let mut binary = ply(&sphere(6, 4), "binary_little_endian", "");
    let cut = binary.len() - 5;
    binary.truncate(cut);
    let error = stage.error("a.ply", &binary);
    assert!(error.starts_with("byte ") && error.contains("fill whole buffer"), "{error}");
}

#[test]
fn no_damage_makes_a_reader_panic_or_hang() {
    let stage = Stage::new();
    stage.put("clay.png", png(&picture(4)));
    let library = "newmtl clay\nKd 1\nmap_Kd -o 1 -s 2 2 clay.png\nTr 0.5\nbump -bm 2 clay.png\n\
        map_d -o 1 -s 2 2 \"Clay.png\"\nmap_Ks clay.png\n";
    stage.put("shape.mtl", library);
    let shape = sphere(6, 4);
    let text = obj(&shape, "clay").into_bytes();
    let smooth = "mtllib shape.mtl\nv 458213.37 4512345.21 0 255 0 0\nv 458213.47 4512345.21 0 0 0 0\n\
        v 458213.47 4512345.31 0 9 9 9\nv nan 0 0 0 0 0\ns 1\nusemtl clay\nf 1 2 3\nf 1 3 4 2\ns off\n\
        f -4/1 -3 -2\nl 1 2\n";
    // The file that is damaged, and the one that is read.
    let mut files = vec![
        ("a.obj", "a.obj", text.clone()),
        ("a.off", "a.off", off(&shape).into_bytes()),
        ("shape.mtl", "b.obj", library.into()),
        ("c.obj", "c.obj", smooth.into()),
    ];
    stage.put("b.obj", text);
    let plies = ENCODINGS.map(|encoding| ply(&shape, encoding, "comment TextureFile clay.png\n"));
    files.extend(plies.map(|bytes| ("a.ply", "a.ply", bytes)));
    let mut random = common::Random(7);
    for (name, whole, bytes) in files {
        let (path, whole) = (stage.put(name, &bytes), stage.0.path().join(whole));
        assert!(read(&whole).is_ok(), "{name} is read before it is damaged");
        for _ in 0..200 {
            let mut damaged = bytes.clone();
            for _ in 0..1 + random.below(4) {
                let at = random.below(damaged.len());
                damaged[at] = random.next() as u8;
            }
            if random.below(3) == 0 {
                damaged.truncate(random.below(damaged.len()));
            }
            std::fs::write(&path, damaged).expect("a file");
            let whole = whole.clone();
            within(10, name, move || drop(read(&whole)));
        }
        std::fs::write(&path, bytes).expect("a file");
    }
}

#[test]
fn each_command_takes_them() {
    let stage = Stage::new();
    stage.put("shape.mtl", "newmtl clay\nmap_Kd clay.png\n");
    stage.put("clay.png", png(&picture(16)));
    let shape = sphere(16, 12);
    stage.put("a.obj", obj(&shape, "clay"));
    stage.put("b.off", off(&shape));
    stage.put("c.ply", ply(&shape, "binary_big_endian", "comment TextureFile clay.png\n"));
    let run = |arguments: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_seamwise"));
        let output = command.current_dir(&stage.0).args(arguments).output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), said.as_str()), (Some(0), ""), "{arguments:?}");
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    let told = run(&["bake", ".", "-o", "out", "--no-evaluate", "--levels", "1"]);
    assert!(told.ends_with("3 baked, 0 skipped, 0 failed\n"), "{told}");
    for stem in ["a", "b", "c"] {
        let level = Output::read(&stage.0.path().join(format!("out/{stem}_lod1.glb")));
        assert_eq!(level.triangle_count(), shape.triangles.len() / 2, "{stem}");
        assert_eq!(level.json["images"].as_array().map_or(0, Vec::len), usize::from(stem != "b"));
    }
    let told = run(&["bake", ".", "-o", "out", "--no-evaluate", "--levels", "1", "--resume"]);
    assert!(told.ends_with("0 baked, 3 skipped, 0 failed\n"), "{told}");
    stage.put("clay.png", png(&picture(8)));
    let told = run(&["bake", ".", "-o", "out", "--no-evaluate", "--levels", "1", "--resume"]);
    assert!(told.ends_with("2 baked, 1 skipped, 0 failed\n"), "the picture counts: {told}");
    run(&["evaluate", "a.obj", "b.off", "--views", "1", "--samples", "1000", "--json", "e.json"]);
    let json = std::fs::read(stage.0.path().join("e.json")).expect("a file");
    let json: Value = serde_json::from_slice(&json).expect("JSON");
    let distance = json["candidates"][0]["metrics"]["distance_max"].as_f64().expect("a distance");
    assert!(distance < 1e-6, "{distance}");
    for name in ["a.obj", "b.off", "c.ply"] {
        let told = run(&["inspect", name, "--json"]);
        let told: Value = serde_json::from_str(&told).expect("JSON");
        assert_eq!(told["total"]["triangles"], shape.triangles.len(), "{name}");
    }
}
