//! The bakes by which levels find what they are to reach.

use super::goals::{Goals, Measure, Trial};
use super::options::{BakeOptions, Targets, Textures};
use crate::error::{Error, Result};
use crate::evaluate;
use crate::export::files::{Format, Layout};
use crate::progress::Progress;
use crate::report::LevelReport;
use crate::transfer::Sizes;

/// Bytes that the certificate of an evaluated level takes in its file.
const CERTIFICATE: usize = 1200;

/// A level of a bake, and the bytes of its file.
pub(super) struct Tried {
    pub(super) level: LevelReport,
    pub(super) bytes: usize,
}

/// The options by which the levels reach their goals, and what each has as measured on the way; those
/// given, and nothing, if there are no goals. `bake` bakes with other options.
pub(super) fn resolve(
    options: &BakeOptions,
    progress: &Progress,
    bake: impl Fn(&BakeOptions) -> Result<Vec<Tried>>,
) -> Result<(BakeOptions, Vec<f64>)> {
    let Some(goals) = &options.goals else { return Ok((options.clone(), Vec::new())) };
    if let Textures::Transfer(transfer) = options.textures
        && transfer.sizes != Sizes::Needed
    {
        let what =
            "goals go with textures as large as needed: leave out --texture-scale and --budget";
        return Err(Error::Options { what: what.into() });
    }
    let margin = if options.evaluate.is_some() { CERTIFICATE } else { 0 };
    let mut run = |counts: Vec<usize>| {
        progress.check("goals")?;
        let targets = counts.clone();
        let levels = bake(&trial(goals, options, counts))?;
        let tried = |(Tried { level, bytes }, target): (Tried, usize)| Trial {
            target: target.min(level.triangles),
            triangles: level.triangles,
            value: goals.value(&level, bytes + margin),
            texture_bytes: level.texture_bytes,
        };
        Ok(levels.into_iter().zip(targets).map(tried).collect())
    };
    let found = goals.search(&mut run)?;
    let counts = found.iter().map(|trial| trial.target).collect();
    let options =
        BakeOptions { targets: Targets::Triangles(counts), goals: None, ..options.clone() };
    Ok((options, found.iter().map(|trial| trial.value).collect()))
}

/// Options by which one run measures levels of so many triangles.
fn trial(goals: &Goals, options: &BakeOptions, counts: Vec<usize>) -> BakeOptions {
    let mut own = BakeOptions { targets: Targets::Triangles(counts), ..options.clone() };
    (own.goals, own.report) = (None, None);
    (own.output.layout, own.output.format) = (Layout::None, Format::Glb);
    let counts_vertices_anew =
        goals.measure == Measure::Vertices && matches!(own.textures, Textures::Transfer(_));
    if matches!(goals.measure, Measure::PixelsOff | Measure::Vertices) && !counts_vertices_anew {
        own.textures = Textures::Keep;
    }
    let look = evaluate::Options { screen_height: 0, ..options.evaluate.unwrap_or_default() };
    own.evaluate = match goals.measure {
        Measure::Quality => {
            Some(evaluate::Options { resolution: goals.pixels as usize, samples: 1000, ..look })
        }
        Measure::PixelsOff => Some(evaluate::Options { views: 1, resolution: 16, ..look }),
        Measure::Bytes | Measure::Vertices => None,
    };
    own
}
