//! Refinement of a progressive file for eyes.

use std::path::Path;

use anyhow::Result;
use glam::Vec3;
use seamwise_attr::{Camera, Goal, Refined};
use serde::{Deserialize, Serialize};

use seamwise::error::Error;
use seamwise::export::disk::{refuse_overwriting, write_files};
use seamwise::export::glb::to_glb;
use seamwise::export::progressive::refine::{RefinedScene, camera};
use seamwise::import::options::ReadOptions;

use super::console::{check_files, read_stdin, say, write_stdout};
use crate::cli::{Common, RefineArgs, is_dash};

/// A camera of a path.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Place {
    eye: [f32; 3],
    target: [f32; 3],
    fov: Option<f32>,
}

/// What a frame has.
#[derive(Serialize)]
struct Frame {
    eye: [f32; 3],
    triangles: usize,
    pixels: f32,
    splits: usize,
    collapses: usize,
}

/// Refines for an eye or along a path, and says what came of it.
pub(crate) fn refine(args: &RefineArgs, common: Common) -> Result<usize> {
    check_files(args.output.iter().chain(&args.json))?;
    if let Some(output) = args.output.as_ref().filter(|own| !is_dash(own)) {
        refuse_overwriting(&args.input, std::slice::from_ref(output))?;
    }
    let goal = Goal {
        triangles: args.triangles.unwrap_or(usize::MAX),
        pixels: args.pixels.unwrap_or(0.0),
        steps: args.steps.unwrap_or(usize::MAX),
    };
    let cameras = cameras(args)?;
    let bytes = if is_dash(&args.input) { read_stdin(common)? } else { read(&args.input)? };
    let options = ReadOptions {
        memory_limit: common.memory_limit,
        strict: common.strict,
        ..ReadOptions::default()
    };
    let mut scene =
        RefinedScene::read(&bytes, options).map_err(|error| error.in_file(&args.input))?;
    if let Some(missed) = scene.missed.filter(|_| !common.quiet) {
        eprintln!("seamwise: warning: {}: {missed}: it is no finer", args.input.display());
    }
    let mut frames = Vec::new();
    for camera in &cameras {
        let own = scene.refine_for(camera, goal);
        let eye = camera.eye().to_array();
        let (triangles, Refined { pixels, splits, collapses }) = (scene.triangles(), own);
        frames.push(Frame { eye, triangles, pixels, splits, collapses });
    }
    write(args, &scene, &frames)?;
    let is_told = args.json.is_none() && args.path.is_none();
    if let Some(last) = frames.last().filter(|_| is_told) {
        let Frame { triangles, pixels, .. } = last;
        let source = scene.source_triangles();
        say(common.quiet, &format!("{triangles} of {source} triangles, {pixels:.2} pixels off\n"))?;
    }
    Ok(0)
}

fn write(args: &RefineArgs, scene: &RefinedScene, frames: &[Frame]) -> Result<()> {
    if let Some(output) = &args.output {
        let file = to_glb(&scene.asset()?)?;
        if is_dash(output) {
            write_stdout(&file)?;
        } else {
            write_files(&[(output.clone(), file)])?;
        }
    }
    let text = serde_json::to_string_pretty(frames)? + "\n";
    match &args.json {
        Some(json) if !is_dash(json) => write_files(&[(json.clone(), text.into_bytes())])?,
        None if args.path.is_none() => {}
        _ => write_stdout(text.as_bytes())?,
    }
    Ok(())
}

fn cameras(args: &RefineArgs) -> Result<Vec<Camera>> {
    let size = [args.width, args.height];
    let of = |own: &Place| {
        let degrees = own.fov.unwrap_or(args.fov);
        camera(Vec3::from(own.eye), Vec3::from(own.target), degrees, size)
    };
    let Some(path) = &args.path else {
        let place = args.eye.zip(args.target);
        let place = place.map(|(eye, target)| {
            let [eye, target] = [eye, target].map(|own| own.as_vec3().to_array());
            Place { eye, target, fov: None }
        });
        return Ok(place.iter().map(of).collect::<Result<_, _>>()?);
    };
    let places: Vec<Place> = serde_json::from_slice(&read(path)?).map_err(|error| {
        Error::Invalid { what: error.to_string(), at: path.display().to_string() }
    })?;
    Ok(places.iter().map(of).collect::<Result<_, _>>()?)
}

fn read(path: &Path) -> seamwise::error::Result<Vec<u8>> {
    std::fs::read(path).map_err(|source| Error::Io { path: path.to_owned(), source })
}
