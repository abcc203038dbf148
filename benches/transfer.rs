//! What do textures made anew for each level gain over shared ones, and what do they cost?
//!
//! ```text
//! cargo bench --bench transfer                            # texels per second
//! cargo bench --bench transfer -- quality --only popcorn  # beside a repair, at equal triangles
//! cargo bench --bench transfer -- time                    # four levels of the helmet at 1024²
//! cargo bench --bench transfer -- memory                  # 4096² over 100,000 triangles
//! ```
//!
//! The reference of the tables has its atlases filled first, as otherwise what bleeds in it would
//! count as right. Ratios are those of a transfer over a repair; means are geometric.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "common/sphere.rs"]
mod sphere;

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Parser, Subcommand};
use common::build::Build;
use common::shapes::Shape;
use common::textured::Pictures;
use common::{Baked, transferred};
use criterion::{Criterion, Throughput};
use image::{ColorType, RgbImage, imageops::FilterType};
use seamwise::atlas::{encode_repaired, repair_all};
use seamwise::bake::Input;
use seamwise::bake::options::{BakeOptions, Textures};
use seamwise::document::asset::Asset;
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::evaluate::scene::Scene;
use seamwise::evaluate::{self, Metrics, Reference};
use seamwise::export::glb::to_glb;
use seamwise::image_file::codec::{EncodeOptions, decode, encode};
use seamwise::image_file::encoded::EncodedImage;
use seamwise::import::read;
use seamwise::transfer::BakeNormals;
use seamwise_attr::{Mesh, Options, simplify_chain, weld};
use seamwise_texture::transfer::{
    Face, Job, Output, Pair, Picture, Reading, ShadingMesh, Source, transfer,
};
use seamwise_texture::{Role, Wrap};
use serde_json::json;

const ASSETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/assets");
const HELMET: &str = "pbr/FlightHelmet/FlightHelmet.gltf";
const MODELS: [(&str, &str); 5] = [
    ("popcorn", "scan/popcorn.glb"),
    ("frypan", "scan/frypan.glb"),
    ("gelatin_box", "scan/gelatin_box.glb"),
    ("FlightHelmet", HELMET),
    ("TennisRacquet", "pbr/TennisRacquet/TennisRacquet.gltf"),
];

#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    question: Option<Question>,
    /// Cargo says this.
    #[arg(long, hide = true, global = true)]
    bench: bool,
}

#[derive(Subcommand)]
enum Question {
    /// Levels beside those of a repair, at full size and at half the size for each level.
    Quality {
        /// Assets whose name contains one of these; all if not given.
        #[arg(long, value_delimiter = ',')]
        only: Vec<String>,
    },
    /// Seconds for four levels of the helmet, its images scaled to so many texels a side.
    Time {
        #[arg(long, default_value_t = 1024)]
        side: u32,
    },
    /// The most memory that a bake takes.
    Memory {
        #[arg(long, default_value_t = 4096)]
        side: u32,
        /// The source has 4 · rows · (rows − 1) triangles.
        #[arg(long, default_value_t = 159)]
        rows: usize,
    },
}

/// The scene of an asset, with its atlases filled.
fn clean_scene(mut asset: Asset, cache: &mut TextureCache) -> Scene {
    let repairs = repair_all(&asset, Default::default()).expect("sound atlases");
    asset.images = encode_repaired(&asset, &repairs, EncodeOptions::default()).expect("images");
    load(&asset, cache).expect("a sound model")
}

/// Images of all levels in bytes, and what each level is measured to be.
fn measure(
    reference: &Reference<'_>,
    baked: &Baked,
    cache: &mut TextureCache,
) -> (usize, Vec<Metrics>) {
    let level = |number| read(&baked.level_path(number)).expect("a level");
    let levels: Vec<Asset> = (1..=baked.report.levels.len()).map(level).collect();
    let bytes = levels.iter().flat_map(|level| &level.images).map(|image| image.bytes.len()).sum();
    let compare = |level: &Asset| reference.compare(&load(level, cache)?);
    (bytes, levels.iter().map(compare).collect::<Result<_, _>>().expect("sound levels"))
}

/// The same levels with shared textures.
fn repaired(options: &BakeOptions) -> BakeOptions {
    BakeOptions { textures: Textures::Repair, ..options.clone() }
}

#[derive(Default)]
struct Means([Vec<f64>; 4]);

impl Means {
    /// Adds ratios, and writes them.
    fn add(&mut self, pairs: [[f64; 2]; 4]) -> String {
        let add = |(logs, [own, other]): (&mut Vec<f64>, [f64; 2])| {
            let ratio = own / other;
            if ratio.is_finite() && ratio > 0.0 {
                logs.push(ratio.ln());
            }
            format!("{own:.5} / {other:.5} | **{ratio:.3}**")
        };
        self.0.iter_mut().zip(pairs).map(add).collect::<Vec<_>>().join(" | ")
    }

    fn row(&self) -> String {
        let mean = |logs: &Vec<f64>| (logs.iter().sum::<f64>() / logs.len() as f64).exp();
        let cells = self.0.iter().map(|logs| format!("| **{:.3}**", mean(logs)));
        cells.collect::<Vec<_>>().join(" | ")
    }
}

fn quality(only: &[String]) {
    let wanted = MODELS
        .iter()
        .filter(|(name, _)| only.is_empty() || only.iter().any(|own| name.contains(own.as_str())));
    let full = transferred(&[0.25, 0.0625], 1.0, BakeNormals::Auto);
    let halves = transferred(&[0.5, 0.25, 0.125, 0.0625], 0.5, BakeNormals::Auto);
    println!(
        "| asset | level | lit luminance | ratio | color | ratio | distance | ratio | normal ° | ratio |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut means = Means::default();
    let mut second = Vec::new();
    for (name, path) in wanted {
        let path = Path::new(ASSETS).join(path);
        let (mut cache, asset) = (TextureCache::default(), read(&path).expect("a readable model"));
        let bytes: usize = asset.images.iter().map(|image| image.bytes.len()).sum();
        let scene = clean_scene(asset, &mut cache);
        let reference = Reference::new(&scene, evaluate::Options::default()).expect("a surface");
        let mut run = |options: &BakeOptions| {
            let baked = Baked::input(Input::File(&path), options).expect("a sound model");
            measure(&reference, &baked, &mut cache)
        };
        let [(_, own), (_, other)] = [&full, &repaired(&full)].map(&mut run);
        for ((a, b), level) in own.iter().zip(&other).zip(["25 %", "6.25 %"]) {
            let row = means.add([
                [a.rms_luminance_srgb, b.rms_luminance_srgb],
                [a.color_rms, b.color_rms],
                [a.distance_rms, b.distance_rms],
                [a.normal_degrees_rms, b.normal_degrees_rms],
            ]);
            println!("| {name} | {level} | {row} |");
        }
        let [(small, own), (_, other)] = [&halves, &repaired(&halves)].map(&mut run);
        let share = small as f64 / bytes as f64;
        for (level, (a, b)) in own.iter().zip(&other).enumerate() {
            let [a, b] = [a, b].map(|metrics| metrics.at_switch);
            let ratio = a.rms_luminance_srgb / b.rms_luminance_srgb;
            second.push(format!(
                "| {name} | {} | {:.0} | {:.5} / {:.5} | **{ratio:.3}** | {share:.3} |",
                level + 1,
                a.pixels,
                a.rms_luminance_srgb,
                b.rms_luminance_srgb,
            ));
        }
    }
    println!("| geometric mean | {} |\n", means.row());
    println!(
        "| asset | level | pixels at the switch | lit luminance there | ratio | bytes of four levels' images over the source's |"
    );
    println!("|---|---|---|---|---|---|");
    second.iter().for_each(|row| println!("{row}"));
}

/// An asset with all its images scaled, in memory.
fn scaled(path: &Path, side: u32) -> Vec<u8> {
    let mut asset = read(path).expect("a readable model");
    let scale = |image: &EncodedImage| {
        let texels = decode(image, "an image", Default::default()).expect("a picture");
        let texels = texels.resize_exact(side, side, FilterType::CatmullRom);
        encode(&texels, image.format).expect("a picture")
    };
    asset.images = asset.images.iter().map(scale).collect();
    to_glb(&asset).expect("a file")
}

fn time(side: u32) {
    let bytes = scaled(&Path::new(ASSETS).join(HELMET), side);
    let options = transferred(&[0.5, 0.25, 0.125, 0.0625], 1.0, BakeNormals::Auto);
    let start = Instant::now();
    let baked = Baked::bytes("helmet", &bytes, &options);
    let wall = start.elapsed().as_secs_f64();
    let source = baked.chain();
    let anew = |level: usize| {
        let level = baked.level(level);
        let images = 0..source.gltf.images().len().min(level.gltf.images().len());
        images.filter(|&image| level.image_bytes(image) != source.image_bytes(image)).count()
    };
    let images: usize = (1..=4).map(anew).sum();
    let texels = images as f64 * f64::from(side).powi(2);
    let seconds = baked.report.seconds.transfer;
    println!(
        "{images} images of {side}²: {seconds:.1} s of transfer, {:.2e} texels/s; {wall:.1} s in all",
        texels / seconds
    );
}

/// The displaced sphere as a shape to be written.
fn bumpy(rows: usize) -> Shape {
    let vertices = sphere::displaced_sphere(rows);
    let row = |row: &[f32]| ([row[0], row[1]], [row[2], row[3], row[4]]);
    let (uvs, normals) = vertices.attributes.chunks_exact(5).map(row).unzip();
    let positions = vertices.positions.iter().map(glam::Vec3::to_array).collect();
    Shape { positions, normals, uvs, triangles: vertices.triangles }
}

fn memory(side: u32, rows: usize) {
    let texel = |x: u32, y: u32| image::Rgb([(x / 16) as u8, (y / 16) as u8, (x ^ y) as u8]);
    let mut build = Build::new();
    let texture = build.texture(&RgbImage::from_fn(side, side, texel).into(), json!({}));
    let material = build.painted(texture);
    build.add_shape(&bumpy(rows), material);
    let folder = tempfile::tempdir().expect("a folder");
    let path: PathBuf = folder.path().join("bumpy.glb");
    std::fs::write(&path, build.glb()).expect("a file");
    drop(build);
    let options = transferred(&[0.5, 0.25, 0.125, 0.0625], 1.0, BakeNormals::Auto);
    let baked = Baked::input(Input::File(&path), &options).expect("a sound model");
    let report = &baked.report;
    let peak = report.peak_memory_bytes.map_or(f64::NAN, |bytes| bytes as f64 / 1e9);
    println!(
        "{} triangles, {side}²: {peak:.2} GB at most; {:.1} s of transfer",
        report.input.triangles, report.seconds.transfer
    );
}

/// A level of the displaced sphere, one image of which is made anew.
fn speed(criterion: &mut Criterion) {
    const SIDE: usize = 512;
    let mesh = weld(&sphere::displaced_sphere(80)).expect("a sound sphere").mesh;
    let target = mesh.triangles.len() / 16;
    let level = simplify_chain(&mesh, &[target], &Options::default(), &Default::default());
    let level = level.expect("a sound sphere").remove(0).mesh;
    let charts = vec![0; mesh.triangles.len()];
    let side = |mesh| ShadingMesh { mesh, tangents: &[], charts: &charts };
    let source = Source::new(side(&mesh));
    let pairs = [Pair { source: &source, level: side(&level) }];
    let face = |triangle: usize| Face {
        pair: 0,
        triangle: triangle as u32,
        reading: 0,
        uvs: uvs(&level, triangle),
    };
    let faces: Vec<Face> = (0..level.triangles.len()).map(face).collect();
    let picture = Picture::new(&Pictures::noise(SIDE as u32).base, Role::Color).expect("an image");
    let wrap = [Wrap::Repeat; 2];
    let reading = Reading { picture: Some(&picture), wrap, ..Reading::default() };
    let outputs =
        [Output { role: Role::Color, color: ColorType::Rgb8, readings: vec![Some(reading)] }];
    let job = Job {
        pairs: &pairs,
        faces: &faces,
        size: [SIDE; 2],
        wrap,
        is_in_place: true,
        gained: None,
        outputs: &outputs,
    };
    let mut group = criterion.benchmark_group("transfer");
    group.sample_size(10).throughput(Throughput::Elements((SIDE * SIDE) as u64));
    group.bench_function("color", |bencher| bencher.iter(|| transfer(&job, &Default::default())));
    group.finish();
}

fn uvs(mesh: &Mesh, triangle: usize) -> [glam::Vec2; 3] {
    mesh.triangles[triangle].map(|wedge| mesh.uv(wedge, 0))
}

fn main() {
    // Criterion has arguments of its own.
    let question = std::env::args().nth(1).filter(|first| !first.starts_with('-'));
    if !question.is_some_and(|first| ["quality", "time", "memory"].contains(&first.as_str())) {
        let mut criterion = Criterion::default().configure_from_args();
        speed(&mut criterion);
        criterion.final_summary();
        return;
    }
    match Arguments::parse().question {
        Some(Question::Memory { side, rows }) => memory(side, rows),
        _ if !Path::new(ASSETS).exists() => eprintln!("skipped: {ASSETS} is absent"),
        Some(Question::Quality { only }) => quality(&only),
        Some(Question::Time { side }) => time(side),
        None => {}
    }
}
