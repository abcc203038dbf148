//! How fast is the descent, and how much memory does it take? Four levels of 50, 25, 12.5 and 6.25 %
//! of a displaced sphere of 249,000 triangles, with `--full` of 998,000, beside meshoptimizer's four chained calls in the same
//! run, on one thread and on all. Welding, and the rival's tables, are made before the clock runs;
//! what either needs to give finished levels is within. The polish is timed alone.
//!
//! After the benchmarks the medians of paired runs are printed as ratios. With `--memory ours`,
//! `--memory polished` or `--memory rival` one chain runs instead, and the process tells how much
//! memory it took at most. With `--file model.glb` its first mesh takes the sphere's place, in the pairs
//! and in the memory.

#[path = "common/full.rs"]
mod full;
#[path = "common/rival.rs"]
mod rival;
#[path = "common/rival_levels.rs"]
mod rival_levels;
#[path = "common/sphere.rs"]
mod sphere;

use std::hint::black_box;
use std::path::Path;
use std::sync::atomic::AtomicUsize;
use std::time::{Duration, Instant};

use criterion::{BatchSize, Criterion, SamplingMode};
use full::{criterion, is_full};
use rayon::ThreadPoolBuilder;
use rival::Group;
use seamwise::import::read;
use seamwise::report::peak_memory;
use seamwise::surface::geometry::Geometry;
use seamwise_attr::{Level, Mesh, Options, Polish, polish_chain, simplify_chain, weld};
use sphere::displaced_sphere;

/// 249,000 triangles, and 998,000.
const ROWS: usize = 250;
const FULL_ROWS: usize = 500;
const SHARES: [f64; 4] = [0.5, 0.25, 0.125, 0.0625];
const PAIRS: usize = 5;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let after = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        arguments.get(at + 1).map(String::as_str)
    };
    let file = after("--file");
    let mesh = file.map_or_else(
        || {
            weld(&displaced_sphere(if is_full() { FULL_ROWS } else { ROWS }))
                .expect("a sound sphere")
                .mesh
        },
        |file| first_mesh(Path::new(file)),
    );
    if let Some(who) = after("--memory") {
        return tell_memory(&mesh, who);
    }
    if file.is_some() {
        return compare(&mesh);
    }
    let mut criterion = criterion();
    measure(&mut criterion, &mesh);
    compare(&mesh);
    criterion.final_summary();
}

fn first_mesh(path: &Path) -> Mesh {
    let asset = read(path).expect("a readable model");
    let geometry = Geometry::read(&asset, &[0]).expect("a sound mesh");
    geometry.expect("triangles").welded.mesh
}

fn measure(criterion: &mut Criterion, mesh: &Mesh) {
    let name = format!("{} triangles to four levels", mesh.triangles.len());
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group.warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(10));
    for threads in thread_counts() {
        let name = format!("simplify, {threads} threads");
        group.bench_function(name, |b| b.iter(|| black_box(on(threads, || ours(mesh)))));
    }
    group.bench_function("polish, all threads", |b| {
        let levels = ours(mesh);
        b.iter_batched(
            || levels.clone(),
            |levels| polished(mesh, levels, &Polish::default()),
            BatchSize::PerIteration,
        );
    });
    group.bench_function("meshoptimizer, four calls", |b| {
        b.iter_batched(|| Group::split(mesh), theirs, BatchSize::PerIteration);
    });
    group.finish();
}

/// Ratios of medians over alternating runs.
fn compare(mesh: &Mesh) {
    let counts = thread_counts();
    let (mut rival, mut own) = (Vec::new(), vec![Vec::new(); counts.len()]);
    for _ in 0..PAIRS {
        let groups = Group::split(mesh);
        rival.push(seconds(|| theirs(groups)));
        for (times, &threads) in own.iter_mut().zip(&counts) {
            times.push(seconds(|| on(threads, || ours(mesh))));
        }
    }
    let reached = |levels: Vec<Level>| levels.last().map_or(0, |level| level.mesh.triangles.len());
    let (own_triangles, rival_triangles) =
        (reached(ours(mesh)), reached(rival_levels::chain(mesh, &SHARES)));
    println!("triangles at the end: {own_triangles}, the rival's {rival_triangles}");
    let rival = median(&mut rival);
    println!("meshoptimizer: {rival:.2} s");
    for (times, threads) in own.iter_mut().zip(counts) {
        let own = median(times);
        println!("simplify on {threads} threads: {own:.2} s, {:.2} of the rival's", own / rival);
    }
    let levels = ours(mesh);
    for (name, polish) in [("polish", &Polish::default()), ("fast polish", &Polish::FAST)] {
        let levels = levels.clone();
        let polish = seconds(|| polished(mesh, levels, polish));
        println!("{name}, all threads: {polish:.2} s, {:.2} of the rival's", polish / rival);
    }
}

fn tell_memory(mesh: &Mesh, who: &str) {
    let mega = |bytes: Option<u64>| bytes.map_or(f64::NAN, |bytes| bytes as f64 / 1e6);
    let before = mega(peak_memory());
    match who {
        "ours" => drop(black_box(ours(mesh))),
        "polished" => drop(black_box(polished(mesh, ours(mesh), &Polish::default()))),
        "rival" => drop(black_box(theirs(Group::split(mesh)))),
        _ => return eprintln!("--memory ours, polished or rival"),
    }
    let after = mega(peak_memory());
    println!("{after:.0} MB at most, {before:.0} MB before the chain");
}

fn thread_counts() -> Vec<usize> {
    let all = rayon::current_num_threads();
    if all > 1 { vec![1, all] } else { vec![1] }
}

fn on<T: Send>(threads: usize, run: impl FnOnce() -> T + Send) -> T {
    ThreadPoolBuilder::new().num_threads(threads).build().expect("threads").install(run)
}

fn ours(mesh: &Mesh) -> Vec<Level> {
    let targets = SHARES.map(|share| (mesh.triangles.len() as f64 * share) as usize);
    simplify_chain(mesh, &targets, &Options::default(), &AtomicUsize::new(0)).expect("a chain")
}

fn polished(mesh: &Mesh, mut levels: Vec<Level>, polish: &Polish) -> Vec<Level> {
    let done = AtomicUsize::new(0);
    polish_chain(mesh, &mut levels, &Options::default(), polish, &done).expect("sound options");
    levels
}

/// The rival's calls, with its arrays kept for each level, as a chain needs them.
fn theirs(groups: Vec<Group>) -> Vec<Vec<Group>> {
    rival::simplify(groups, &SHARES)
}

fn seconds<T>(run: impl FnOnce() -> T) -> f64 {
    let start = Instant::now();
    black_box(run());
    start.elapsed().as_secs_f64()
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    times[times.len() / 2]
}
