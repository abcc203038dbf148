//! Levels by what they are to reach instead of how many triangles they have: how alike, how many bytes,
//! how many pixels off, how many vertices.
//!
//! A bake for each guess would do; but one descent gives any number of levels, so a few are baked at
//! once, spread evenly over the octaves of triangle counts, and measured by what the goal needs and no
//! more. The next ones lie between the two that hold the bound between them, until these are
//! [`CLOSE`] or one collapse apart. The levels are then baked as if the counts had been asked for.
//!
//! Guaranteed: each level holds its bound as measured, or the bake fails and says by how much. Not
//! guaranteed: that no level elsewhere holds it too, where a figure does not go one way with the
//! triangles.

use super::input::Input;
use super::options::{BakeOptions, Targets, Textures};
use crate::error::{Error, Result};
use crate::evaluate;
use crate::export::files::{Format, Layout};
use crate::progress::Progress;
use crate::report::LevelReport;
pub use crate::report::goal::Measure;
use crate::report::goal::Reached;
use crate::transfer::Sizes;

/// Levels of the first run, each of half the triangles of the one before.
const OCTAVES: u32 = 10;
/// Levels of each further run for each bound.
const BETWEEN: u32 = 5;
/// Runs at most: ten octaves, then steps of 12, 2, and 0.3 %.
const RUNS: usize = 4;
/// Ratio of two counts of triangles that are one.
const CLOSE: f64 = 1.004;
/// Bytes that the certificate of an evaluated level takes in its file.
const CERTIFICATE: usize = 1200;

/// What the levels of a bake are to reach.
#[derive(Clone, Debug, PartialEq)]
pub struct Goals {
    measure: Measure,
    /// One per level, from fine to coarse.
    bounds: Vec<f64>,
    /// The size at which levels are looked at.
    pixels: u32,
}

/// A level that was tried.
#[derive(Clone, Copy, Debug)]
struct Trial {
    target: usize,
    triangles: usize,
    value: f64,
    texture_bytes: usize,
}

impl Goals {
    /// A bound for each level, from fine to coarse; levels are looked at where they span `pixels`.
    ///
    /// # Errors
    /// [`Error::Options`] if there are none, one can't be reached, or a later one is stricter.
    pub fn new(measure: Measure, bounds: Vec<f64>, pixels: u32) -> Result<Self> {
        let options = |what: &str| Err(Error::Options { what: what.into() });
        let is_possible = |bound: &f64| *bound > 0.0 && bound.is_finite();
        if bounds.is_empty() || !bounds.iter().all(is_possible) {
            return options("each bound must be above 0");
        }
        if measure == Measure::Quality && bounds.iter().any(|bound| *bound >= 1.0) {
            return options(
                "a quality lies below 1, which only the source has: 0.99 for instance; for that of JPEGs \
                 say --jpeg-quality",
            );
        }
        let falls = |pair: &[f64]| match measure {
            Measure::PixelsOff => pair[0] <= pair[1],
            Measure::Quality | Measure::Bytes | Measure::Vertices => pair[0] >= pair[1],
        };
        if !bounds.windows(2).all(falls) {
            return options("bounds must be given from fine to coarse");
        }
        Ok(Self { measure, bounds, pixels })
    }

    /// Number of levels.
    pub fn count(&self) -> usize {
        self.bounds.len()
    }

    /// Options by which one run measures levels of so many triangles.
    fn trial(&self, options: &BakeOptions, counts: Vec<usize>) -> BakeOptions {
        let mut own = BakeOptions { targets: Targets::Triangles(counts), ..options.clone() };
        (own.goals, own.report) = (None, None);
        (own.output.layout, own.output.format) = (Layout::None, Format::Glb);
        let look = evaluate::Options { screen_height: 0, ..evaluate::Options::default() };
        own.evaluate = match self.measure {
            Measure::Quality => {
                Some(evaluate::Options { resolution: self.pixels as usize, samples: 1000, ..look })
            }
            Measure::PixelsOff => Some(evaluate::Options { views: 1, resolution: 16, ..look }),
            Measure::Bytes | Measure::Vertices => None,
        };
        own
    }

    fn value(&self, level: &LevelReport, bytes: usize) -> f64 {
        let metrics = level.metrics.unwrap_or_default();
        match self.measure {
            Measure::Quality => metrics.ssim_worst_view,
            Measure::PixelsOff => metrics.distance_p999 * f64::from(self.pixels),
            Measure::Bytes => bytes as f64,
            Measure::Vertices => level.vertices as f64,
        }
    }

    /// What a level of a bake has; `value` where the bake does not tell.
    pub(super) fn reached(
        &self,
        index: usize,
        level: &LevelReport,
        bytes: Option<usize>,
        value: f64,
    ) -> Reached {
        let value = match self.measure {
            Measure::Bytes => bytes.map_or(value, |bytes| bytes as f64),
            Measure::Vertices => level.vertices as f64,
            Measure::Quality | Measure::PixelsOff => value,
        };
        let pixels = self.measure.wants_coarsest().then_some(self.pixels);
        Reached { measure: self.measure, bound: self.bounds[index], value, pixels }
    }

    /// The triangles of each level, and what each then has, by trying. `run` bakes and gives reports on
    /// the levels, and the bytes of each; it is first given one level of all triangles.
    fn search(&self, run: &mut dyn FnMut(Vec<usize>) -> Result<Vec<Trial>>) -> Result<Vec<Trial>> {
        let total = run(vec![usize::MAX])?.first().map_or(1, |whole| whole.triangles).max(1);
        let octaves = (0..OCTAVES).map(|octave| (total >> octave).max(1));
        let mut tried = run(distinct(octaves.collect()))?;
        for _ in 1..RUNS {
            let mut counts = Vec::new();
            for bound in &self.bounds {
                let (holding, failing) = self.bracket(&tried, *bound);
                if let (Some(holding), Some(failing)) = (holding, failing) {
                    counts.extend(between(holding.target, failing.target));
                }
            }
            counts.retain(|count| tried.iter().all(|trial| trial.target != *count));
            if counts.is_empty() {
                break;
            }
            tried.extend(run(distinct(counts))?);
        }
        let of =
            |bound: &f64| self.bracket(&tried, *bound).0.ok_or_else(|| self.refuse(&tried, *bound));
        self.bounds.iter().map(of).collect()
    }

    /// The best trial that holds a bound, and the next one beyond it, which does not.
    fn bracket(&self, tried: &[Trial], bound: f64) -> (Option<Trial>, Option<Trial>) {
        let mut sorted = tried.to_vec();
        sorted.sort_by_key(|trial| trial.target);
        if self.measure.wants_coarsest() {
            sorted.reverse();
        }
        // From what holds by far to what does not; the last that holds before the first that fails.
        let failing = sorted.iter().position(|trial| !self.measure.holds(trial.value, bound));
        let holding = failing.unwrap_or(sorted.len()).checked_sub(1);
        (holding.map(|at| sorted[at]), failing.map(|at| sorted[at]))
    }

    fn refuse(&self, tried: &[Trial], bound: f64) -> Error {
        let value = |trial: &&Trial| trial.value;
        let best = tried.iter().min_by(|a, b| value(a).total_cmp(&value(b)));
        let what = match (self.measure, best) {
            (Measure::Bytes, Some(best)) => format!(
                "no level fits in {bound} bytes: {} triangles take {}, of which {} are textures; \
                 --textures transfer makes those of a level smaller, --compress its geometry",
                best.triangles, best.value, best.texture_bytes
            ),
            (Measure::Vertices, Some(best)) => format!(
                "no level has {bound} vertices or less: the coarsest has {}; --reach-target goes on",
                best.value
            ),
            _ => format!("no level holds the bound of {bound}, not even the source"),
        };
        Error::Options { what }
    }
}

/// Counts from many to few, each once.
fn distinct(mut counts: Vec<usize>) -> Vec<usize> {
    counts.sort_unstable_by(|a, b| b.cmp(a));
    counts.dedup();
    counts
}

/// Counts between two, in even ratios; none if these are close.
fn between(a: usize, b: usize) -> Vec<usize> {
    let (low, high) = (a.min(b), a.max(b));
    if high - low <= 2 || high as f64 <= CLOSE * low as f64 {
        return Vec::new();
    }
    let ratio = high as f64 / low as f64;
    let at = |step: u32| {
        (low as f64 * ratio.powf(f64::from(step) / f64::from(BETWEEN + 1))).round() as usize
    };
    (1..=BETWEEN).map(at).filter(|count| (low + 1..high).contains(count)).collect()
}

/// The options by which the levels reach their goals, and what each has as measured on the way; those
/// given, and nothing, if there are no goals.
pub(super) fn resolve(
    input: Input<'_>,
    options: &BakeOptions,
    progress: &Progress,
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
        let own = goals.trial(options, counts);
        let levels = super::bake_levels(input, &own, &progress.unseen())?;
        let trial = |((level, target), (_, file)): ((&LevelReport, usize), &(String, Vec<u8>))| {
            let value = goals.value(level, file.len() + margin);
            let (triangles, texture_bytes) = (level.triangles, level.texture_bytes);
            Trial { target: target.min(triangles), triangles, value, texture_bytes }
        };
        Ok(levels.report.levels.iter().zip(targets).zip(&levels.files).map(trial).collect())
    };
    let found = goals.search(&mut run)?;
    let counts = found.iter().map(|trial| trial.target).collect();
    let options =
        BakeOptions { targets: Targets::Triangles(counts), goals: None, ..options.clone() };
    Ok((options, found.iter().map(|trial| trial.value).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stand-in for a bake of 10,000 triangles: a level of n of them has `value(n)`.
    fn search(goals: &Goals, value: impl Fn(usize) -> f64) -> Result<Vec<Trial>> {
        let mut run = |counts: Vec<usize>| {
            let trial = |target: usize| {
                let target = target.min(10_000);
                Trial { target, triangles: target, value: value(target), texture_bytes: 7 }
            };
            Ok(counts.into_iter().map(trial).collect())
        };
        goals.search(&mut run)
    }

    #[test]
    fn the_coarsest_level_that_is_alike_enough_is_found() {
        let goals = Goals::new(Measure::Quality, vec![0.99, 0.9, 0.5], 512).unwrap();
        let found = search(&goals, |n| 1.0 - 10.0 / n as f64).unwrap();
        for (trial, least) in found.iter().zip([1000.0, 100.0, 20.0]) {
            let n = trial.triangles as f64;
            assert!(n >= least && n <= (least * 1.004).max(least + 2.0), "{n} {least}");
        }
        assert!(search(&goals, |_| 0.4).unwrap_err().to_string().contains("not even the source"));
    }

    #[test]
    fn the_finest_level_that_fits_is_found() {
        let goals = Goals::new(Measure::Bytes, vec![100_000.0, 20_000.0], 512).unwrap();
        let found = search(&goals, |n| 5000.0 + 20.0 * n as f64).unwrap();
        for (trial, most) in found.iter().zip([4750.0, 750.0]) {
            let n = trial.triangles as f64;
            assert!(n <= most && n >= (most / 1.004).min(most - 2.0), "{n} {most}");
        }
        // All of it fits.
        assert_eq!(search(&goals, |_| 10.0).unwrap()[0].triangles, 10_000);
        let refused = search(&goals, |n| 30_000.0 + n as f64).unwrap_err().to_string();
        assert!(
            refused.contains("no level fits in 20000 bytes") && refused.contains("textures"),
            "{refused}"
        );
    }

    #[test]
    fn bounds_that_make_no_sense_are_refused() {
        let new = |measure, bounds: &[f64]| Goals::new(measure, bounds.to_vec(), 512);
        assert!(
            new(Measure::Quality, &[]).is_err() && new(Measure::Quality, &[0.9, 0.99]).is_err()
        );
        assert!(new(Measure::Quality, &[90.0]).unwrap_err().to_string().contains("--jpeg-quality"));
        assert!(new(Measure::PixelsOff, &[2.0, 1.0]).is_err());
        assert!(new(Measure::PixelsOff, &[1.0, 2.0]).is_ok());
        assert!(new(Measure::Vertices, &[f64::NAN]).is_err());
    }
}
