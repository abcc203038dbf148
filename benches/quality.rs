//! How near to the source do levels stay, beside the rival's at equal triangle counts?
//!
//! ```text
//! cargo bench --bench quality                          # two scans, a few small views
//! cargo bench --bench quality -- --full                # all assets, as the README's table
//! cargo bench --bench quality -- --only popcorn --alone --uv 0.5 --normal 0.01
//! ```
//!
//! Textures stay as they are in both. Counts are equal in each mesh: where the rival stops above its
//! target, ours is held to the same count for the comparison, and the target that ours reaches is
//! told beside it. The last row is the geometric mean of the ratios.

#[path = "common/rival.rs"]
mod rival;
#[path = "common/rival_levels.rs"]
mod rival_levels;
#[path = "common/sphere.rs"]
mod sphere;

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicUsize;

use clap::Parser;
use rayon::prelude::*;
use seamwise::document::asset::Asset;
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::evaluate::scene::{Material, Scene};
use seamwise::evaluate::{self, Metrics, Reference};
use seamwise::export::document::level_asset;
use seamwise::import::read;
use seamwise::level::textures::{LevelTextures, PartTextures};
use seamwise::level::{AssetLevel, LevelMesh};
use seamwise::limit::MemoryLimit;
use seamwise::surface::geometry::Geometry;
use seamwise::surface::group::weld_all;
use seamwise_attr::{
    Level, Mesh, Options, Polish, Settings, Weights, polish_chain, simplify_chain, weld,
};

const ASSETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/assets");
const MODELS: [(&str, &str); 7] = [
    ("popcorn", "scan/popcorn.glb"),
    ("frypan", "scan/frypan.glb"),
    ("gelatin_box", "scan/gelatin_box.glb"),
    ("FlightHelmet", "pbr/FlightHelmet/FlightHelmet.gltf"),
    ("TennisRacquet", "pbr/TennisRacquet/TennisRacquet.gltf"),
    ("dutch_ship", "pbr/dutch_ship/dutch_ship_medium_1k.gltf"),
    ("mars_tiles", "scan/mars_tiles.glb"),
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
    /// A further file to measure.
    #[arg(long)]
    file: Vec<PathBuf>,
    /// Without the rival: levels at the nominal counts.
    #[arg(long)]
    alone: bool,
    /// Shares of the triangles.
    #[arg(long, value_delimiter = ',', default_value = "0.5,0.25,0.125,0.0625")]
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
    #[arg(long, default_value_t = Weights::default().uv)]
    uv: f64,
    #[arg(long, default_value_t = Weights::default().normal)]
    normal: f64,
    #[arg(long, default_value_t = Weights::default().color)]
    color: f64,
    #[arg(long, default_value_t = Weights::default().border)]
    border: f64,
    #[arg(long, default_value_t = Weights::default().seam)]
    seam: f64,
    /// Rounds of polish; 0 leaves the levels as the descent left them.
    #[arg(long, default_value_t = Polish::default().rounds)]
    rounds: usize,
    #[arg(long, default_value_t = Polish::default().density)]
    density: f64,
    #[arg(long, default_value_t = Polish::default().damping)]
    damping: f64,
    #[arg(long, default_value_t = Polish::default().attribute_damping)]
    attribute_damping: f64,
    /// Cargo says this.
    #[arg(long, hide = true)]
    bench: bool,
}

impl Arguments {
    fn polish(&self) -> Option<Polish> {
        let Self { rounds, density, damping, attribute_damping, .. } = *self;
        (rounds > 0).then_some(Polish { rounds, density, damping, attribute_damping })
    }

    fn options(&self) -> Options<'static> {
        let weights = Weights {
            uv: self.uv,
            normal: self.normal,
            color: self.color,
            motion: Weights::default().motion,
            border: self.border,
            seam: self.seam,
        };
        Settings { weights, ..Settings::default() }.into()
    }

    fn is_wanted(&self, name: &str) -> bool {
        let is_named = self.only.iter().any(|own| name.contains(own.as_str()));
        let is_usual = self.full || USUAL.contains(&name);
        is_named || self.only.is_empty() && self.file.is_empty() && is_usual
    }
}

/// What is measured: its surfaces, and how levels of them become a scene.
enum Subject {
    Asset { asset: Asset, geometries: Vec<Geometry>, textures: Box<TextureCache> },
    Bare(Box<Mesh>),
}

impl Subject {
    fn read(path: &Path) -> Self {
        let asset = read(path).expect("a readable model");
        let geometries = weld_all(&asset, MemoryLimit::default()).expect("sound meshes");
        Self::Asset { asset, geometries, textures: Box::default() }
    }

    fn meshes(&self) -> Vec<&Mesh> {
        match self {
            Self::Asset { geometries, .. } => geometries.iter().map(|g| &g.welded.mesh).collect(),
            Self::Bare(mesh) => vec![&**mesh],
        }
    }

    fn source(&mut self) -> Scene {
        match self {
            Self::Asset { asset, textures, .. } => load(asset, textures).expect("a sound model"),
            Self::Bare(mesh) => bare_scene(mesh),
        }
    }

    fn scene(&mut self, levels: &[&Level]) -> Scene {
        match self {
            Self::Bare(_) => bare_scene(&levels[0].mesh),
            Self::Asset { asset, geometries, textures } => {
                let meshes: Vec<LevelMesh<'_>> = geometries
                    .iter()
                    .zip(levels)
                    .map(|(geometry, level)| {
                        LevelMesh::new(geometry, level, &plain(geometry)).expect("parts")
                    })
                    .collect();
                let shared = LevelTextures::shared(&asset.images, geometries);
                let level = AssetLevel { meshes, textures: shared };
                let level = level_asset(asset, &level).expect("a document");
                load(&level, textures).expect("a sound level")
            }
        }
    }
}

/// Textures that ask nothing of the parts.
fn plain(geometry: &Geometry) -> Vec<PartTextures> {
    vec![PartTextures::default(); geometry.parts.len()]
}

/// A mesh without an asset, in white.
fn bare_scene(mesh: &Mesh) -> Scene {
    let row = |w: usize| mesh.row(seamwise_attr::WedgeId::new(w));
    let wedges = 0..mesh.wedge_points.len();
    let white = Material { metallic: 0.0, ..Material::default() };
    Scene {
        origin: glam::DVec3::ZERO,
        positions: mesh.wedge_points.iter().map(|p| mesh.positions[p.index()]).collect(),
        normals: wedges
            .clone()
            .map(|w| glam::Vec3::from_slice(&row(w)[mesh.layout.normal()..]))
            .collect(),
        uvs: [wedges.map(|w| glam::Vec2::from_slice(row(w))).collect(), Vec::new()],
        colors: vec![glam::Vec4::ONE; mesh.wedge_points.len()],
        triangles: mesh.triangles.iter().map(|t| t.map(|w| w.0)).collect(),
        tangents: vec![[glam::Vec4::ZERO; 3]; mesh.triangles.len()],
        triangle_meshes: Vec::new(),
        triangle_materials: vec![0; mesh.triangles.len()],
        materials: vec![white],
    }
}

/// Per mesh a level per target.
fn ours(subject: &Subject, targets: &[Vec<usize>], arguments: &Arguments) -> Vec<Vec<Level>> {
    let (options, removed) = (arguments.options(), AtomicUsize::new(0));
    subject
        .meshes()
        .par_iter()
        .zip(targets)
        .map(|(mesh, targets)| {
            let mut levels = simplify_chain(mesh, targets, &options, &removed).expect("a chain");
            if let Some(polish) = arguments.polish() {
                polish_chain(mesh, &mut levels, &options, &polish, &removed)
                    .expect("sound options");
            }
            levels
        })
        .collect()
}

fn nominal(mesh: &Mesh, ratios: &[f64]) -> Vec<usize> {
    let count = mesh.triangles.len() as f64;
    ratios.iter().map(|ratio| ((count * ratio).round() as usize).max(1)).collect()
}

/// Levels of all meshes, and the triangles of each.
fn measure(
    subject: &mut Subject,
    reference: &Reference<'_>,
    chains: &[Vec<Level>],
) -> Vec<(usize, Metrics)> {
    (0..chains[0].len())
        .map(|index| {
            let levels: Vec<&Level> = chains.iter().map(|chain| &chain[index]).collect();
            let triangles = levels.iter().map(|level| level.mesh.triangles.len()).sum();
            (triangles, reference.compare(&subject.scene(&levels)).expect("a comparison"))
        })
        .collect()
}

/// Logarithms of the ratios to the rival, of luminance and of distance.
#[derive(Default)]
struct Means {
    luminance: Vec<f64>,
    distance: Vec<f64>,
}

fn run(name: &str, mut subject: Subject, arguments: &Arguments, means: &mut Means) {
    let source = subject.source();
    let evaluation = evaluate::Options {
        views: arguments.views,
        resolution: arguments.resolution,
        samples: arguments.samples,
        screen_height: 0,
        ..evaluate::Options::default()
    };
    let reference = Reference::new(&source, evaluation).expect("a surface");
    let targets: Vec<Vec<usize>> =
        subject.meshes().iter().map(|mesh| nominal(mesh, &arguments.ratios)).collect();
    let alone = ours(&subject, &targets, arguments);
    let reached: Vec<usize> = (0..arguments.ratios.len())
        .map(|level| alone.iter().map(|chain| chain[level].mesh.triangles.len()).sum())
        .collect();
    if arguments.alone {
        for (triangles, m) in measure(&mut subject, &reference, &alone) {
            println!(
                "| {name} | {triangles} | {:.5} | {:.3e} | {:.3e} | {:.4} | {:.2} | {} | {} {} {} |",
                m.rms_luminance_srgb,
                m.distance_rms,
                m.distance_max,
                m.color_rms,
                m.normal_degrees_rms,
                m.uv_foldovers,
                m.degenerate_triangles,
                m.border_edges_gained,
                m.non_manifold_edges_gained,
            );
        }
        return;
    }
    let rivals: Vec<Vec<Level>> = subject
        .meshes()
        .par_iter()
        .map(|mesh| rival_levels::chain(mesh, &arguments.ratios))
        .collect();
    let counts: Vec<Vec<usize>> = rivals
        .iter()
        .map(|chain| chain.iter().map(|level| level.mesh.triangles.len().max(1)).collect())
        .collect();
    let equal = ours(&subject, &counts, arguments);
    let theirs = measure(&mut subject, &reference, &rivals);
    let own = measure(&mut subject, &reference, &equal);
    for (level, ((n, rival), (m, own))) in theirs.iter().zip(&own).enumerate() {
        let (luminance, distance) = (
            own.rms_luminance_srgb / rival.rms_luminance_srgb,
            own.distance_rms / rival.distance_rms,
        );
        means.luminance.push(luminance.ln());
        means.distance.push(distance.ln());
        println!(
            "| {name} | {} | {m} | {n} | {:.5} / {:.5} | **{luminance:.3}** | {:.3e} / {:.3e} | **{distance:.3}** | {:.4} / {:.4} | {} / {} | {} {} {} |",
            reached[level],
            own.rms_luminance_srgb,
            rival.rms_luminance_srgb,
            own.distance_rms,
            rival.distance_rms,
            own.color_rms,
            rival.color_rms,
            own.uv_foldovers,
            rival.uv_foldovers,
            own.degenerate_triangles,
            own.border_edges_gained,
            own.non_manifold_edges_gained,
        );
    }
}

fn main() {
    let arguments = Arguments::parse();
    if !Path::new(ASSETS).exists() {
        eprintln!("skipped: {ASSETS} is absent");
        return;
    }
    if arguments.alone {
        println!(
            "| asset | triangles | luminance | distance | max | color | normal ° | foldovers | degenerate, borders, non-manifold |"
        );
        println!("|---|---|---|---|---|---|---|---|---|");
    } else {
        println!(
            "| asset | reached | ours | rival's | luminance | ratio | distance | ratio | color | foldovers | degenerate, borders, non-manifold |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|---|");
    }
    let mut means = Means::default();
    for (name, path) in MODELS {
        if arguments.is_wanted(name) {
            run(name, Subject::read(&Path::new(ASSETS).join(path)), &arguments, &mut means);
        }
    }
    for path in &arguments.file {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        run(&name, Subject::read(path), &arguments, &mut means);
    }
    if arguments.is_wanted("sphere") {
        let mesh = weld(&sphere::displaced_sphere(500)).expect("a sound sphere").mesh;
        run("sphere", Subject::Bare(Box::new(mesh)), &arguments, &mut means);
    }
    let mean = |logs: &[f64]| (logs.iter().sum::<f64>() / logs.len() as f64).exp();
    if !arguments.alone {
        println!(
            "| geometric mean | | | | | **{:.3}** | | **{:.3}** | | | |",
            mean(&means.luminance),
            mean(&means.distance)
        );
    }
}
