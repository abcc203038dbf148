//! The files that the fuzz targets of the reader start from, made when they are asked for: out of the
//! tests' own assets, and out of those in ../shared/assets, made small.
//!
//! `SEAMWISE_CORPUS=fuzz/corpus cargo test --test suite seeds` writes them into a folder for each
//! target.

use std::path::{Path, PathBuf};

use crate::common;
use crate::common::assets::{cube, mixed, rigged, two_materials, victim};
use crate::common::build::{Build, png};
use crate::common::formats::{ENCODINGS, obj, ply};
use crate::common::shapes::{patch, sphere};
use seamwise::bake::options::Textures;
use seamwise::document::accessor;
use seamwise::document::asset::Asset;
use seamwise::export::files::OutputOptions;
use seamwise::import::options::ReadOptions;
use seamwise::import::read_with;
use seamwise::{BakeOptions, bake_bytes};
use serde_json::{Value, json};

/// Most elements that an accessor keeps.
const MOST_ELEMENTS: usize = 24;
/// Largest document that is taken; a fuzzer is slow with larger ones.
const MOST_BYTES: usize = 40_000;

/// The folder of a target, and how many files are in it.
struct Corpus {
    folder: PathBuf,
    files: usize,
}

impl Corpus {
    fn new(root: &Path, target: &str) -> Self {
        let folder = root.join(target);
        std::fs::create_dir_all(&folder).expect("a folder");
        Self { folder, files: 0 }
    }

    fn add(&mut self, parts: &[&[u8]]) {
        let path = self.folder.join(format!("seed{}", self.files));
        std::fs::write(path, parts.concat()).expect("a file");
        self.files += 1;
    }

    /// A document, a zero byte and its buffer, as the target `document` takes them.
    fn add_document(&mut self, json: &Value, bin: &[u8]) {
        let mut json = json.clone();
        json["buffers"] = json!([{"byteLength": bin.len()}]);
        let text = json.to_string();
        if text.len() + bin.len() < MOST_BYTES {
            self.add(&[text.as_bytes(), &[0], bin]);
        }
    }
}

#[test]
fn seeds() {
    let Some(root) = std::env::var_os("SEAMWISE_CORPUS") else { return };
    let root = Path::new(&root);
    let assets = common::shared_assets().map_or(Vec::new(), |folder| models(&folder));
    documents(Corpus::new(root, "document"), &assets);
    streams(Corpus::new(root, "compressed"), &assets);
    texts(Corpus::new(root, "models"));
    progressive(Corpus::new(root, "progressive"));
}

/// Progressive files of all kinds of small assets.
fn progressive(mut corpus: Corpus) {
    let output = OutputOptions { progressive: true, ..OutputOptions::default() };
    let options = BakeOptions { output, textures: Textures::Keep, ..common::unmeasured() };
    for build in [cube(2), two_materials(5), rigged(), mixed(), Build::of(&patch(7))] {
        let baked = bake_bytes(&build.glb(), "seed", &options).expect("a bake");
        let own = baked.files.iter().find(|file| file.name == "seed_progressive.glb");
        corpus.add(&[&own.expect("a progressive file").bytes]);
    }
}

/// All .glb and .gltf files under a folder.
fn models(folder: &Path) -> Vec<PathBuf> {
    let files = walkdir::WalkDir::new(folder).sort_by_file_name().into_iter().flatten();
    let paths = files.map(walkdir::DirEntry::into_path);
    paths.filter(|path| path.extension().is_some_and(|end| end == "glb" || end == "gltf")).collect()
}

fn documents(mut corpus: Corpus, assets: &[PathBuf]) {
    let own = [victim(), cube(1), two_materials(2), Build::of(&patch(2))];
    for build in &own {
        corpus.add_document(&build.json, &build.bin);
        corpus.add(&[&build.glb()]);
    }
    for path in assets {
        let options = ReadOptions { allow_missing: true, ..ReadOptions::default() };
        let asset = read_with(path, options).expect("an asset");
        let (json, bin) = shrunk(&asset);
        corpus.add_document(&json, &bin);
    }
    assert!(corpus.files > 8 || assets.is_empty(), "{} documents", corpus.files);
}

/// A document with the first elements of each accessor and one texel instead of each image.
fn shrunk(asset: &Asset) -> (Value, Vec<u8>) {
    let mut build = Build { json: asset.json.clone(), bin: Vec::new() };
    build.json["bufferViews"] = json!([]);
    for index in 0..asset.count("accessors") {
        let json = &mut build.json["accessors"][index];
        json.as_object_mut()
            .expect("an object")
            .retain(|key, _| key != "sparse" && key != "byteOffset");
        let Ok(elements) = accessor::read(asset, index, "") else {
            // A matrix, of which nothing is left.
            json.as_object_mut().expect("an object").shift_remove("bufferView");
            json["count"] = json!(1);
            continue;
        };
        let count = elements.count().min(MOST_ELEMENTS);
        let is_indices = elements.components == 1 && elements.indices("").is_ok();
        let values = elements.floats().into_iter().take(count * elements.components);
        let bytes = match is_indices {
            true => elements.encode(values.map(|index| index % MOST_ELEMENTS as f32)),
            false => elements.bytes[..count * elements.size()].to_vec(),
        };
        let view = build.view(&bytes);
        build.json["accessors"][index]["bufferView"] = json!(view);
        build.json["accessors"][index]["count"] = json!(count);
    }
    let texel = png(&image::RgbaImage::new(1, 1));
    for index in 0..asset.count("images") {
        let view = build.view(&texel);
        build.json["images"][index] = json!({"bufferView": view});
    }
    (build.json, build.bin)
}

fn streams(mut corpus: Corpus, assets: &[PathBuf]) {
    let [draco, etc1s, uastc, zstd]: [&[u8]; 4] = [
        include_bytes!("../encoded/patch.drc"),
        include_bytes!("../encoded/etc1s.ktx2"),
        include_bytes!("../encoded/uastc.ktx2"),
        include_bytes!("../encoded/uastc_zstd.ktx2"),
    ];
    corpus.add(&[&[1], draco]);
    for file in [etc1s, uastc, zstd] {
        corpus.add(&[&[2], file]);
    }
    for (_, file) in common::files::all() {
        corpus.add(&[&[2], &file]);
    }
    for filter in 0..5u8 {
        let rows: Vec<[u8; 8]> = (0..40u8).map(|row| [row, 3 * row, 7, 0, row, 1, 2, 3]).collect();
        let stream = meshopt::encode_vertex_buffer(&rows).expect("a stream");
        corpus.add(&[&[0, 0, filter, 8, 40, 0], &stream]);
    }
    let indices: Vec<u32> = (0..20).flat_map(|i| [i, i + 1, i + 2]).collect();
    let triangles = meshopt::encode_index_buffer(&indices, 22).expect("a stream");
    let sequence = meshopt::encode_index_sequence(&indices, 22).expect("a stream");
    for stride in [2, 4] {
        corpus.add(&[&[0, 1, 0, stride, 60, 0], &triangles]);
        corpus.add(&[&[0, 2, 0, stride, 60, 0], &sequence]);
    }
    for path in assets.iter().filter(|path| path.ends_with("pirate_meshopt_quant.glb")) {
        add_views(&mut corpus, &std::fs::read(path).expect("a file"));
    }
}

/// The streams of a .glb.
fn add_views(corpus: &mut Corpus, glb: &[u8]) {
    let glb = gltf::Glb::from_slice(glb).expect("a container");
    let json: Value = serde_json::from_slice(&glb.json).expect("JSON");
    let bin = glb.bin.expect("a binary chunk");
    for view in json["bufferViews"].as_array().expect("views") {
        let stream = &view["extensions"]["EXT_meshopt_compression"];
        let number = |key: &str| stream[key].as_u64().unwrap_or(0) as usize;
        let name = |key: &str| stream[key].as_str().unwrap_or("NONE");
        let place =
            |names: &[&str], key| names.iter().position(|own| *own == name(key)).unwrap_or(0);
        let mode = place(&["ATTRIBUTES", "TRIANGLES", "INDICES"], "mode");
        let filter = place(&["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"], "filter");
        let [low, high] = (number("count") as u16).to_le_bytes();
        let header = [0, mode as u8, filter as u8, number("byteStride") as u8, low, high];
        corpus.add(&[&header, &bin[number("byteOffset")..][..number("byteLength")]]);
    }
}

fn texts(mut corpus: Corpus) {
    let shape = sphere(6, 4);
    let text = obj(&shape, "one");
    let library = "newmtl one\nKd 0.5 0.6 0.7\nKe 0 0 0.1\nNs 30\nd 0.5\nPr 0.4\nPm 0.2\n\
        map_Kd -o 0.1 0.2 -s 2 2 -clamp on a.bmp\nmap_Bump -bm 0.5 a.bmp\nnorm a.bmp\n\
        map_d -o 0.1 0.2 -s 2 2 -clamp on \"A.bmp\"\nTr 1\n";
    corpus.add(&[&[0], text.as_bytes()]);
    corpus.add(&[&[3], text.as_bytes(), &[0], library.as_bytes()]);
    corpus.add(&[
        &[0],
        b"v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv .4 .3 0 1 1 1\ng a\nf 1 2 \\\n3 -1\n",
    ]);
    corpus.add(&[
        &[3],
        b"v 458213.37 1e7 0 255 0 0\nv 458213.47 1e7 0 0 0 0\nv nan 0 0 0 0 0\nv 0 0 1.5 0 0 0\n\
        s 1\nusemtl one\nf 1 2 4\ns off\nf 1/9 4 2\nf 1 2 3\nl 1 2\n\0newmtl one\nmap_d a.bmp\nTr 1\n",
    ]);
    let strips = "ply\rformat ascii 1.0\relement vertex 3\rproperty double x\rproperty double y\r\
        property double Z\relement tristrips 1\rproperty list int int vertex_indices\rend_header\r\
        0 0 nan\r1e7 0 0\r1e7 0.01 0\r5 0 1 2 -1 0\r";
    corpus.add(&[&[1], strips.as_bytes()]);
    for encoding in ENCODINGS {
        corpus.add(&[&[1], &ply(&shape, encoding, "comment TextureFile a.bmp\n")]);
        corpus.add(&[&[1], &ply(&shape, encoding, "")]);
    }
    corpus.add(&[&[2], b"OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n4 0 1 2 3\n"]);
    corpus.add(&[&[2], b"NOFF\n3 1 0\n0 0\n0 nan 0 0\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0\n1 2 9 9 9\n"]);
    corpus.add(&[
        &[2],
        b"STCNOFF\n3 1 0\n0 0 0 0 0 1 255 0 0 0 0\n1 0 0 0 0 1 0 255 0 1 0\n\
        0 1 0 0 0 1 0 0 255 0 1\n3 0 1 2\n",
    ]);
}
