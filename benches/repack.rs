//! How long do charts take to be packed, and how much of the atlas do they cover?
//!
//! ```text
//! cargo bench --bench repack                                    # time of made charts
//! cargo bench --bench repack -- --coverage --draw target/repack # levels of real assets, and pictures
//! ```
//!
//! Coverage is that of each material of a level, and of all materials in one atlas.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicUsize;
use std::time::Instant;

use clap::Parser;
use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use seamwise::import::read;
use seamwise::limit::MemoryLimit;
use seamwise::surface::geometry::Geometry;
use seamwise::surface::group::weld_all;
use seamwise_attr::{Mesh, Options, Polish, WedgeId, polish_chain, simplify_chain};
use seamwise_texture::{RepackOptions, Repacked, UvMesh, repack};

const ASSETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/assets");
const MODELS: [&str; 7] = [
    "pbr/FlightHelmet/FlightHelmet.gltf",
    "pbr/TennisRacquet/TennisRacquet.gltf",
    "pbr/dutch_ship/dutch_ship_medium_1k.gltf",
    "scan/mars_tiles.glb",
    "scan/popcorn.glb",
    "scan/frypan.glb",
    "scan/gelatin_box.glb",
];

#[derive(Parser)]
struct Arguments {
    /// Coverage of real assets instead of time.
    #[arg(long)]
    coverage: bool,
    /// Files to lay out instead of the usual ones.
    #[arg(long)]
    file: Vec<PathBuf>,
    /// Share of the triangles.
    #[arg(long, default_value_t = 0.25)]
    ratio: f64,
    #[arg(long, default_value_t = 1024)]
    size: usize,
    #[arg(long, default_value_t = 4)]
    padding: usize,
    /// Where pictures of the layouts go.
    #[arg(long)]
    draw: Option<PathBuf>,
    /// Cargo says this.
    #[arg(long, hide = true)]
    bench: bool,
}

/// A surface that owns its arrays.
#[derive(Clone, Default)]
struct Surface {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
    groups: Vec<u32>,
}

impl Surface {
    fn mesh(&self) -> UvMesh<'_> {
        let Self { positions, uvs, triangles, groups } = self;
        UvMesh { positions, uvs, triangles, groups }
    }

    /// Disks with bays, from large to small, on top of one another.
    fn disks(count: usize) -> Self {
        let mut surface = Self::default();
        for disk in 0..count {
            let first = surface.positions.len() as u32;
            let radius = 1.0 / (1.0 + disk as f32 * 16.0 / count as f32);
            let corners = 8 + (disk * 7 % 17) as u32;
            for corner in 0..=corners {
                let turn = corner as f32 / corners as f32 * std::f32::consts::TAU;
                let bays = radius * (1.0 + 0.4 * (turn * (2 + disk % 3) as f32).sin());
                let uv = if corner == 0 { Vec2::ZERO } else { Vec2::from_angle(turn) * bays };
                surface.positions.push(uv.extend(disk as f32));
                surface.uvs.push(uv);
            }
            for corner in 1..=corners {
                surface.triangles.push([first, first + corner, first + corner % corners + 1]);
            }
        }
        surface.groups = vec![0; surface.triangles.len()];
        surface
    }

    /// A level of all meshes of an asset; groups are materials, those without one last.
    fn level(path: &Path, ratio: f64) -> Self {
        let asset = read(path).expect("a readable model");
        let geometries = weld_all(&asset, MemoryLimit::default()).expect("sound meshes");
        let none = asset.count("materials");
        let levels: Vec<Mesh> = geometries.par_iter().map(|g| simplified(g, ratio)).collect();
        let mut surface = Self::default();
        for (geometry, mesh) in geometries.iter().zip(&levels) {
            let first = surface.positions.len() as u32;
            surface.positions.extend(mesh.wedge_points.iter().map(|p| mesh.positions[p.index()]));
            let has_uvs = mesh.layout.uv_sets > 0;
            let uv = |w| if has_uvs { mesh.uv(WedgeId::new(w), 0) } else { Vec2::ZERO };
            surface.uvs.extend((0..mesh.wedge_points.len()).map(uv));
            surface.triangles.extend(mesh.triangles.iter().map(|t| t.map(|w| w.0 + first)));
            let material = |&g: &u32| geometry.parts[g as usize].primitive.material.unwrap_or(none);
            surface.groups.extend(mesh.groups.iter().map(|group| material(group) as u32));
        }
        surface
    }

    fn group(&self, group: u32) -> Self {
        let mut part = self.clone();
        let own = |at: &usize| self.groups[*at] == group;
        let own: Vec<usize> = (0..self.triangles.len()).filter(own).collect();
        part.triangles = own.iter().map(|&at| self.triangles[at]).collect();
        part.groups = vec![0; own.len()];
        part
    }
}

fn simplified(geometry: &Geometry, ratio: f64) -> Mesh {
    let (mesh, options, removed) = (&geometry.welded.mesh, Options::default(), AtomicUsize::new(0));
    if ratio >= 1.0 {
        return mesh.clone();
    }
    let target = ((mesh.triangles.len() as f64 * ratio).round() as usize).max(1);
    let mut levels = simplify_chain(mesh, &[target], &options, &removed).expect("a chain");
    polish_chain(mesh, &mut levels, &options, &Polish::default(), &removed).expect("a polish");
    levels.remove(0).mesh
}

fn report(name: &str, surface: &Surface, arguments: &Arguments) {
    let options =
        RepackOptions { size: arguments.size, padding: arguments.padding, ..Default::default() };
    let start = Instant::now();
    let layout = match repack(&surface.mesh(), &options) {
        Ok(layout) => layout,
        Err(error) => return println!("| {name} | {} | {error} |", surface.triangles.len()),
    };
    println!(
        "| {name} | {} | {} | {:.1} % | {:.2} s |",
        surface.triangles.len(),
        layout.charts,
        100.0 * layout.coverage,
        start.elapsed().as_secs_f64()
    );
    if let Some(folder) = &arguments.draw {
        std::fs::create_dir_all(folder).expect("a folder");
        draw(&layout, options.size).save(folder.join(format!("{name}.png"))).expect("a picture");
    }
}

/// Each chart in a color of its own, each triangle a little lighter or darker.
fn draw(layout: &Repacked, size: usize) -> image::RgbImage {
    let mut picture = image::RgbImage::new(size as u32, size as u32);
    for (at, (triangle, chart)) in layout.triangles.iter().zip(&layout.triangle_charts).enumerate()
    {
        let corners =
            triangle.map(|v| seamwise_texture::to_texels(layout.uvs[v as usize], [size; 2]));
        let Some(shape) = seamwise_texture::UvTriangle::new(corners) else { continue };
        let hue = chart.wrapping_mul(2_654_435_769);
        let light = 0.75 + 0.25 * (at * 37 % 64) as f32 / 64.0;
        let color = [hue >> 24, hue >> 16 & 255, hue >> 8 & 255]
            .map(|channel| ((60.0 + channel as f32 * 0.76) * light) as u8);
        shape.texels(&seamwise_texture::Window::image(size, size), |texel| {
            picture.put_pixel(texel.x as u32, texel.y as u32, image::Rgb(color));
        });
    }
    picture
}

fn coverage(arguments: &Arguments) {
    println!("| material | triangles | charts | coverage | time |\n|---|---|---|---|---|");
    let usual = MODELS.iter().map(|path| Path::new(ASSETS).join(path));
    let files = if arguments.file.is_empty() { usual.collect() } else { arguments.file.clone() };
    for file in files {
        let surface = Surface::level(&file, arguments.ratio);
        let name = file.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let name = name.unwrap_or_default();
        let mut groups = surface.groups.clone();
        groups.sort_unstable();
        groups.dedup();
        for &group in groups.iter().filter(|_| (2..=8).contains(&groups.len())) {
            report(&format!("{name} {group}"), &surface.group(group), arguments);
        }
        report(&name, &surface, arguments);
    }
}

fn measure(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("repack");
    // Flat: the largest take seconds each, and ten of them tell enough.
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    for (charts, size) in [(30, 1024), (300, 1024), (3000, 256), (1000, 1024), (1000, 4096)] {
        let surface = Surface::disks(charts);
        let options = RepackOptions { size, padding: 2, ..RepackOptions::default() };
        group.throughput(Throughput::Elements(charts as u64));
        let id = BenchmarkId::new(format!("{charts} charts"), size);
        group.bench_function(id, |bencher| bencher.iter(|| repack(&surface.mesh(), &options)));
    }
    group.finish();
}

fn main() {
    if std::env::args().any(|argument| argument == "--coverage") {
        return coverage(&Arguments::parse());
    }
    let mut criterion = Criterion::default().configure_from_args();
    measure(&mut criterion);
    criterion.final_summary();
}
