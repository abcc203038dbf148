//! The report of a bake on its source and its levels.

use std::path::PathBuf;

use seamwise_attr::Stop;

use super::input::Input;
use super::options::{BakeOptions, BudgetPer};
use super::simplify::triangle_count;
use super::steering::MeshSteering;
use crate::document::asset::Asset;
use crate::error::Result;
use crate::export::bundle::Measured;
use crate::level::lods::Lods;
use crate::level::{AssetLevel, LevelMesh};
use crate::limit::MemoryLimit;
use crate::report::texture::gpu_bytes_of;
use crate::report::{FarthestPart, InputReport, LevelReport, TextureReport};
use crate::screen::made_needless_by;
use crate::surface::geometry::Geometry;

pub(crate) fn input_report(
    input: Input<'_>,
    files: &[PathBuf],
    asset: &Asset,
    geometries: &[Geometry],
    limit: MemoryLimit,
) -> Result<InputReport> {
    let size = |path: &PathBuf| std::fs::metadata(path).map_or(0, |file| file.len());
    let meshes = geometries.iter().map(|geometry| &geometry.welded);
    Ok(InputReport {
        file: match input {
            Input::File(path) | Input::FileAs(path, _) => path.display().to_string(),
            Input::Bytes(_, name) => name.to_owned(),
        },
        bytes: match input {
            Input::Bytes(bytes, _) => bytes.len() as u64,
            Input::File(_) | Input::FileAs(..) => files.iter().map(size).sum(),
        },
        texture_bytes: asset.images.iter().map(|image| image.bytes.len()).sum(),
        texture_gpu_bytes: gpu_bytes_of(&TextureReport::of(asset, limit)?),
        draw_calls: geometries.iter().map(|geometry| geometry.parts.len()).sum(),
        meshes: geometries.iter().map(|geometry| geometry.meshes.len()).sum(),
        triangles: triangle_count(geometries),
        points: meshes.clone().map(|welded| welded.mesh.positions.len()).sum(),
        wedges: meshes.clone().map(|welded| welded.mesh.wedge_points.len()).sum(),
        degenerate_triangles: meshes.map(|welded| welded.degenerate).sum(),
    })
}

/// A message: why a descent stopped, and what may be done about it.
fn explain(stop: Stop) -> String {
    match stop {
        Stop::Deviation => format!("{stop}; --reach-target goes on"),
        Stop::NoLegalCollapse | Stop::ErrorLimit => stop.to_string(),
    }
}

pub(crate) fn level_reports(
    asset: &Asset,
    (assembled, textures): (&[AssetLevel<'_>], &[Vec<TextureReport>]),
    lods: &Lods,
    steering: &[MeshSteering],
    options: &BakeOptions,
    measured: Option<&Measured>,
) -> Vec<LevelReport> {
    let triangles = |mesh: &LevelMesh<'_>| mesh.geometry.welded.mesh.triangles.len();
    let total = assembled.first().map_or(0, |level| level.meshes.iter().map(triangles).sum());
    let shares = options.targets.shares(total);
    let sizes = measured.map(Measured::sizes);
    let needless = sizes.as_deref().map(made_needless_by);
    let counts = options.targets.counts(total);
    let report = |(index, share): (usize, &f64)| {
        let levels = || lods.level(index).iter();
        let target = match options.budget_per {
            BudgetPer::Mesh => levels().map(|level| level.target).sum(),
            BudgetPer::Scene => counts[index],
        };
        let stopped: Vec<_> = levels().filter_map(|level| level.stopped).collect();
        LevelReport {
            ratio: *share,
            target,
            triangles: levels().map(|level| level.mesh.triangles.len()).sum(),
            points: levels().map(|level| level.mesh.positions.len()).sum(),
            wedges: levels().map(|level| level.mesh.wedge_points.len()).sum(),
            error: levels()
                .zip(steering)
                .map(|(level, steering)| level.error * steering.stretch())
                .fold(0.0, f64::max),
            vertices: assembled[index].meshes.iter().map(LevelMesh::vertices).sum(),
            goal: None,
            draw_calls: assembled[index].meshes.iter().map(LevelMesh::draw_calls).sum(),
            texture_bytes: assembled[index].textures.bytes(),
            texture_gpu_bytes: gpu_bytes_of(&textures[index]),
            textures: textures[index].clone(),
            // Known when it is written.
            bytes: 0,
            reached: stopped.is_empty(),
            why: stopped.first().map(|&stop| match lods.level(index).len() {
                1 => explain(stop),
                surfaces => {
                    format!("in {} of {surfaces} surfaces {}", stopped.len(), explain(stop))
                }
            }),
            largest_size_pixels: sizes.as_ref().map(|sizes| sizes[index]),
            made_needless_by: needless.as_ref().and_then(|own| Some(own[index]? + 1)),
            farthest: measured.and_then(|measured| {
                let place = measured.metrics[index].distance_max_at;
                measured.farthest[index].map(|part| FarthestPart::new(asset, part, place))
            }),
            metrics: measured.map(|measured| measured.metrics[index]),
        }
    };
    shares.iter().enumerate().map(report).collect()
}
