//! What does it cost to judge a chain? A scan of 17,982 triangles against its four levels: 24 views of
//! 512², and 200,000 samples each way; also where each level is looked at once more, smaller; and what a
//! million of its pixels and a million samples take. With `--full` a helmet of 94,722 triangles and 15
//! textures takes its place. Skipped where the model is not there.

#[path = "common/full.rs"]
mod full;

use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

use criterion::{Criterion, SamplingMode};
use full::{criterion, is_full};
use seamwise::bake::options::BakeOptions;
use seamwise::bake::{Input, bake};
use seamwise::evaluate::camera::Rig;
use seamwise::evaluate::distance::{SampledSurface, correspond};
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::evaluate::render::render_views;
use seamwise::evaluate::scene::{Mode, Scene};
use seamwise::evaluate::{Options, Reference};
use seamwise::import::read;
use seamwise::progress::Progress;

const HELMET: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/assets/pbr/FlightHelmet/FlightHelmet.gltf");
const SCAN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/assets/scan/popcorn.glb");

/// A model and its four levels.
fn scenes(model: &str) -> Option<Vec<Scene>> {
    let model = Path::new(model);
    if !model.exists() {
        eprintln!("skipped: {} is absent", model.display());
        return None;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = BakeOptions { evaluate: None, ..BakeOptions::default() };
    bake(Input::File(model), folder.path(), &options, &Progress::hidden()).expect("a bake");
    let stem = model.file_stem().expect("a file").to_string_lossy();
    let mut cache = TextureCache::default();
    let levels = (1..=4).map(|level| folder.path().join(format!("{stem}_lod{level}.glb")));
    let files = [model.to_owned()].into_iter().chain(levels);
    let scene = |path: std::path::PathBuf| {
        load(&read(&path).expect("a readable model"), &mut cache).expect("a sound model")
    };
    Some(files.map(scene).collect())
}

/// Compares the levels, the first of the scenes with the others.
fn compare_all(scenes: &[Scene], options: Options) {
    let reference = Reference::new(&scenes[0], options).expect("a surface");
    for level in &scenes[1..] {
        black_box(reference.compare(level).expect("a surface"));
    }
}

/// The time of so many runs of what handles `count` things, over a million of them.
fn per_million<T>(runs: u64, count: usize, run: impl Fn() -> T) -> Duration {
    let start = Instant::now();
    for _ in 0..runs {
        black_box(run());
    }
    start.elapsed().div_f64(count as f64 / 1e6)
}

fn evaluate(criterion: &mut Criterion) {
    let options = Options::default();
    let (name, model) = if is_full() { ("a helmet", HELMET) } else { ("a scan", SCAN) };
    let Some(scenes) = scenes(model) else { return };
    let mut group = criterion.benchmark_group(format!("evaluate {name}"));
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group.warm_up_time(Duration::from_secs(1));
    group.bench_function("four levels", |bencher| {
        bencher.iter(|| compare_all(&scenes, options));
    });
    // So strict that even the finest level takes over at less than the size of the views.
    let strict = Options { pixel_tolerance: 0.015, ..options };
    group.bench_function("four levels, all seen twice", |bencher| {
        bencher.iter(|| compare_all(&scenes, strict));
    });
    let rig = Rig::around(&scenes[0], options.views, options.resolution);
    let pixels = options.views * options.resolution * options.resolution;
    group.bench_function("a million pixels", |bencher| {
        let render = || render_views(&scenes[0], &rig, Mode::Lit);
        bencher.iter_custom(|runs| per_million(runs, pixels, render));
    });
    let surface = |scene: &Scene| (scene.positions.clone(), scene.triangles.clone());
    let (from, to) = (surface(&scenes[0]), surface(&scenes[2]));
    let from = SampledSurface::new(&from.0, &from.1, options.samples, 1);
    let to = SampledSurface::new(&to.0, &to.1, options.samples, 1);
    group.bench_function("a million distance samples", |bencher| {
        bencher.iter_custom(|runs| per_million(runs, options.samples, || correspond(&from, &to)));
    });
    group.finish();
}

fn main() {
    let mut criterion = criterion();
    evaluate(&mut criterion);
    criterion.final_summary();
}
