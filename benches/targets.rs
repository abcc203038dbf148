//! Do low-poly props keep their shape on the way to their targets?
//!
//! ```text
//! cargo bench --bench targets                     # thirty props, four levels each, default options
//! cargo bench --bench targets -- --only tugboat,house
//! cargo bench --bench targets -- --write models   # the props themselves, as files
//! ```
//!
//! Distances are the larger of the two directions, over the diagonal of the source's bounding box;
//! area is the level's over the source's, extent the least ratio of the sides of the boxes, and color
//! the least that is left of the area of any one color. A level that stops before its target and says so is marked; the last rows tell means and the worst
//! over all levels, and over those that claim to have reached their targets.

#[path = "../tests/common/mod.rs"]
mod common;

use std::path::{Path, PathBuf};

use clap::Parser;
use common::Baked;
use common::low_poly::prop::color_areas;
use common::low_poly::{MODELS, Model, extent_kept};
use common::output::Output;
use seamwise::bake::options::BakeOptions;
use seamwise::evaluate;

#[derive(Parser)]
struct Arguments {
    /// Props whose name contains this; all if not given.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Writes the props into this folder, and measures nothing.
    #[arg(long)]
    write: Option<PathBuf>,
    #[arg(long, default_value_t = 100_000)]
    samples: usize,
    /// Cargo says this.
    #[arg(long, hide = true)]
    bench: bool,
}

impl Arguments {
    fn is_wanted(&self, name: &str) -> bool {
        self.only.is_empty() || self.only.iter().any(|only| name.contains(only.as_str()))
    }
}

/// A level's figures.
struct Row {
    /// Counted from 1.
    level: usize,
    target: usize,
    triangles: usize,
    reached: bool,
    rms: f64,
    greatest: f64,
    area: f64,
    extent: f32,
    color: f32,
}

fn measure(model: &Model, samples: usize) -> Vec<Row> {
    let bytes = model.build().glb();
    // The figures sought need no pictures.
    let evaluate = evaluate::Options {
        views: 1,
        resolution: 16,
        samples,
        screen_height: 0,
        ..evaluate::Options::default()
    };
    let options = BakeOptions { evaluate: Some(evaluate), ..BakeOptions::default() };
    let source = Output::from_bytes(&bytes, model.name);
    let baked = Baked::bytes(model.name, &bytes, &options);
    let colors = color_areas(&source);
    let levels = baked.report.levels.iter().zip(1..);
    let row = |(report, level): (&seamwise::report::LevelReport, usize)| {
        let output = baked.level(level);
        let left = color_areas(&output);
        let left = colors.iter().map(|(color, area)| left.get(color).unwrap_or(&0.0) / area);
        let metrics = report.metrics.expect("a level that was measured");
        Row {
            level,
            target: report.target,
            triangles: report.triangles,
            reached: report.reached,
            rms: metrics.distance_rms,
            greatest: metrics.distance_max,
            area: metrics.area_ratio,
            extent: extent_kept(&source, &output),
            color: left.fold(f32::INFINITY, f32::min),
        }
    };
    levels.map(row).collect()
}

fn print_rows(name: &str, rows: &[Row]) {
    for row in rows {
        let Row { level, target, triangles, rms, greatest, area, extent, color, .. } = row;
        let stopped = if row.reached { "" } else { "stopped" };
        println!(
            "| {name} | {level} | {target} | {triangles} | {stopped} | {:.3} | {:.2} | {area:.3} | {extent:.3} | {color:.2} |",
            100.0 * rms,
            100.0 * greatest,
        );
    }
}

/// Means and the worst of some rows.
fn print_summary(name: &str, rows: &[&Row]) {
    let count = rows.len().max(1) as f64;
    let mean = |pick: fn(&Row) -> f64| rows.iter().map(|row| pick(row)).sum::<f64>() / count;
    let most = |pick: fn(&Row) -> f64| rows.iter().map(|row| pick(row)).fold(0.0, f64::max);
    let least = |pick: fn(&Row) -> f64| rows.iter().map(|row| pick(row)).fold(f64::MAX, f64::min);
    println!(
        "| {name} | {} levels | {:.3} (at most {:.3}) | {:.2} (at most {:.2}) | {:.3} (at least {:.3}) | {:.3} (at least {:.3}) | {:.2} (at least {:.2}) |",
        rows.len(),
        100.0 * mean(|row| row.rms),
        100.0 * most(|row| row.rms),
        100.0 * mean(|row| row.greatest),
        100.0 * most(|row| row.greatest),
        mean(|row| row.area),
        least(|row| row.area),
        mean(|row| f64::from(row.extent)),
        least(|row| f64::from(row.extent)),
        mean(|row| f64::from(row.color)),
        least(|row| f64::from(row.color)),
    );
}

fn write(folder: &Path, models: &[Model]) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    for model in models {
        std::fs::write(folder.join(format!("{}.glb", model.name)), model.build().glb())?;
    }
    Ok(())
}

fn main() {
    let arguments = Arguments::parse();
    let models: Vec<Model> =
        MODELS.into_iter().filter(|model| arguments.is_wanted(model.name)).collect();
    if let Some(folder) = &arguments.write {
        write(folder, &models).expect("a folder to write into");
        return;
    }
    println!(
        "| prop | level | target | triangles | | RMS % | greatest % | area | extent | color |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut all = Vec::new();
    for model in &models {
        let rows = measure(model, arguments.samples);
        print_rows(model.name, &rows);
        all.extend(rows);
    }
    println!();
    println!("| | | RMS % | greatest % | area | extent | color |");
    println!("|---|---|---|---|---|---|---|");
    for (level, share) in [(1, "50 %"), (2, "25 %"), (3, "12.5 %"), (4, "6.25 %")] {
        let rows = all.iter().filter(|row| row.level == level);
        print_summary(share, &rows.clone().collect::<Vec<_>>());
        let reached: Vec<_> = rows.filter(|row| row.reached).collect();
        if !reached.is_empty() {
            print_summary(&format!("{share}, reached"), &reached);
        }
    }
}
