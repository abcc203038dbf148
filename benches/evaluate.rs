//! What does it cost to judge a chain? A helmet of 94,722 triangles and 15 textures against its four
//! levels: 24 views of 512², and 200,000 samples each way; and the two halves of it apart. Skipped
//! where the model is not there.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use seamwise::bake::{Input, bake};
use seamwise::evaluate::camera::Rig;
use seamwise::evaluate::distance::{SampledSurface, correspond};
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::evaluate::render::render_views;
use seamwise::evaluate::scene::{Mode, Scene};
use seamwise::evaluate::{Options, Reference};
use seamwise::options::BakeOptions;
use seamwise::progress::Progress;
use seamwise::read::read;

const HELMET: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/assets/pbr/FlightHelmet/FlightHelmet.gltf");

/// The helmet and its four levels.
fn scenes() -> Option<Vec<Scene>> {
    let helmet = Path::new(HELMET);
    if !helmet.exists() {
        eprintln!("skipped: {HELMET} is absent");
        return None;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = BakeOptions { evaluate: None, ..BakeOptions::default() };
    bake(Input::File(helmet), folder.path(), &options, &Progress::hidden()).expect("a bake");
    let mut cache = TextureCache::default();
    let levels = (1..=4).map(|level| folder.path().join(format!("FlightHelmet_lod{level}.glb")));
    let files = [helmet.to_owned()].into_iter().chain(levels);
    let scene = |path: std::path::PathBuf| {
        load(&read(&path).expect("a readable model"), &mut cache).expect("a sound model")
    };
    Some(files.map(scene).collect())
}

fn evaluate(criterion: &mut Criterion) {
    let Some(scenes) = scenes() else { return };
    let options = Options::default();
    let mut group = criterion.benchmark_group("evaluate");
    group.sample_size(10);
    group.bench_function("a helmet against four levels", |bencher| {
        bencher.iter(|| {
            let reference = Reference::new(&scenes[0], options).expect("a surface");
            for level in &scenes[1..] {
                black_box(reference.compare(level).expect("a surface"));
            }
        });
    });
    let rig = Rig::around(&scenes[0], options.views, options.resolution);
    let pixels = options.views * options.resolution * options.resolution;
    group.throughput(Throughput::Elements(pixels as u64));
    group.bench_function("pixels", |bencher| {
        bencher.iter(|| black_box(render_views(&scenes[0], &rig, Mode::Lit)));
    });
    let surface = |scene: &'_ Scene| (scene.positions.clone(), scene.triangles.clone());
    let (from, to) = (surface(&scenes[0]), surface(&scenes[2]));
    let from = SampledSurface::new(&from.0, &from.1, options.samples, 1);
    let to = SampledSurface::new(&to.0, &to.1, options.samples, 1);
    group.throughput(Throughput::Elements(options.samples as u64));
    group.bench_function("distance samples", |bencher| {
        bencher.iter(|| black_box(correspond(&from, &to)));
    });
    group.finish();
}

criterion_group!(benches, evaluate);
criterion_main!(benches);
