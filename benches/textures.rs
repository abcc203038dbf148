//! What do levels look like with the source's textures, with their own, and with those chosen?
//!
//! ```text
//! cargo bench --bench textures                         # two scans, 25 and 6.25 %, a few small views
//! cargo bench --bench textures -- --full               # all assets
//! cargo bench --bench textures -- --only popcorn --ratios 0.25
//! ```
//!
//! The ways: the source's images, filled; own ones in its layout; own ones of levels without its charts
//! (benches/TEXTURES.md); a choice of the first two. A row a level and way: RMS of lit sRGB luminance, of
//! base color and of distance, bytes of the level's textures, and the seconds that all levels' textures
//! took. Then the ratios of `auto` to `transfer`, and to the better of it and `repair`, as geometric means.

use std::path::Path;

use clap::Parser;
use seamwise::bake::options::{BakeOptions, Targets, Textures};
use seamwise::bake::{Input, bake_in_memory};
use seamwise::evaluate::{self, Metrics};
use seamwise::progress::Progress;
use seamwise::transfer::{Atlas, TransferOptions};

const ASSETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/assets");
const MODELS: [(&str, &str); 6] = [
    ("popcorn", "scan/popcorn.glb"),
    ("frypan", "scan/frypan.glb"),
    ("gelatin_box", "scan/gelatin_box.glb"),
    ("FlightHelmet", "pbr/FlightHelmet/FlightHelmet.gltf"),
    ("TennisRacquet", "pbr/TennisRacquet/TennisRacquet.gltf"),
    ("dutch_ship", "pbr/dutch_ship/dutch_ship_medium_1k.gltf"),
];

/// What is measured unless all is asked for.
const USUAL: [&str; 2] = ["popcorn", "gelatin_box"];

#[derive(Parser)]
struct Arguments {
    /// Assets whose name contains this.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// All assets, and 24 views of 512² and 200,000 samples unless others are given.
    #[arg(long)]
    full: bool,
    /// Shares of the triangles.
    #[arg(long, value_delimiter = ',', default_value = "0.25,0.0625")]
    ratios: Vec<f64>,
    #[arg(long, default_value_t = 6)]
    #[arg(default_value_if("full", "true", "24"))]
    views: usize,
    #[arg(long, default_value_t = 256)]
    #[arg(default_value_if("full", "true", "512"))]
    resolution: usize,
    #[arg(long, default_value_t = 30_000)]
    #[arg(default_value_if("full", "true", "200000"))]
    samples: usize,
    /// Cargo says this.
    #[arg(long, hide = true)]
    bench: bool,
}

/// The ways, the chosen one last.
fn ways() -> [(&'static str, Textures); 4] {
    let transfer = TransferOptions::default();
    let free = TransferOptions { atlas: Atlas::New, unwraps: true, ..transfer };
    let auto = TransferOptions { chooses: true, ..transfer };
    [
        ("repair", Textures::Repair),
        ("transfer", Textures::Transfer(transfer)),
        ("free", Textures::Transfer(free)),
        ("auto", Textures::Transfer(auto)),
    ]
}

/// Luminance and color of a level.
fn looks(metrics: &Metrics) -> [f64; 2] {
    [metrics.rms_luminance_srgb, metrics.color_rms]
}

/// The levels of an asset with each way; tells each in a row.
fn measure(name: &str, path: &Path, arguments: &Arguments) -> Vec<Vec<[f64; 2]>> {
    let evaluate = evaluate::Options {
        views: arguments.views,
        resolution: arguments.resolution,
        samples: arguments.samples,
        ..evaluate::Options::default()
    };
    let targets = Targets::ratios(arguments.ratios.clone()).expect("shares from fine to coarse");
    let bake = |(way, textures): (&str, Textures)| {
        let (targets, evaluate) = (targets.clone(), Some(evaluate));
        let options = BakeOptions { targets, textures, evaluate, ..BakeOptions::default() };
        let baked = bake_in_memory(Input::File(path), &options, &Progress::hidden());
        let report = baked.expect("a bake").report;
        let seconds = report.seconds.transfer;
        let row = |level: &seamwise::report::LevelReport| {
            let metrics = level.metrics.as_ref().expect("a measured level");
            let [luminance, color] = looks(metrics);
            println!(
                "{name:14} {:6.2} % {way:8} {luminance:.5} {color:.5} {:.2e} {:>9} {seconds:6.1}",
                100.0 * level.ratio,
                metrics.distance_rms,
                level.texture_bytes,
            );
            [luminance, color]
        };
        report.levels.iter().map(row).collect()
    };
    ways().into_iter().map(bake).collect()
}

fn main() {
    let arguments = Arguments::parse();
    println!("model            share way      luminance color  distance    bytes seconds");
    let mut ratios: Vec<[f64; 4]> = Vec::new();
    for (name, path) in MODELS {
        let wanted = arguments.only.iter().any(|own| name.contains(own.as_str()));
        let is_usual = arguments.only.is_empty() && (arguments.full || USUAL.contains(&name));
        let path = Path::new(ASSETS).join(path);
        if !(wanted || is_usual) || !path.exists() {
            continue;
        }
        let ways = measure(name, &path, &arguments);
        for ((repair, transfer), auto) in ways[0].iter().zip(&ways[1]).zip(&ways[3]) {
            let better = [0, 1].map(|at| auto[at] / repair[at].min(transfer[at]));
            ratios.push([auto[0] / transfer[0], auto[1] / transfer[1], better[0], better[1]]);
        }
    }
    let mean = |at: usize| {
        let sum: f64 = ratios.iter().map(|own| own[at].ln()).sum();
        (sum / ratios.len().max(1) as f64).exp()
    };
    let worst = |at: usize| ratios.iter().map(|own| own[at]).fold(0.0, f64::max);
    println!("auto over transfer: luminance {:.3}, color {:.3}", mean(0), mean(1));
    println!(
        "auto over the better: luminance {:.3}, color {:.3}; at worst {:.3} and {:.3}",
        mean(2),
        mean(3),
        worst(2),
        worst(3)
    );
}
