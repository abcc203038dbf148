//! Levels by what they are to reach instead of how many triangles they have: how alike, how many bytes,
//! how many pixels off, how many vertices.
//!
//! A bake for each guess would do; but one descent gives any number of levels, so a few are baked at
//! once, spread evenly over the octaves of triangle counts, and measured by what the goal needs and no
//! more. The next ones lie between the two that hold the bound between them, until these are
//! `CLOSE` or one collapse apart. The levels are then baked as if the counts had been asked for.
//!
//! Guaranteed: each level holds its bound as measured, or the bake fails and says by how much. Not
//! guaranteed: that no level elsewhere holds it too, where a figure does not go one way with the
//! triangles.

use crate::error::{Error, Result};
use crate::report::LevelReport;
pub use crate::report::goal::Measure;
use crate::report::goal::Reached;

/// Levels of the first run, each of half the triangles of the one before.
const OCTAVES: u32 = 10;
/// Levels of each further run for each bound.
const BETWEEN: u32 = 5;
/// Runs at most: ten octaves, then steps of 12, 2, and 0.3 %.
const RUNS: usize = 4;
/// Ratio of two counts of triangles that are one.
const CLOSE: f64 = 1.004;
/// Times that the levels are tried together, as they will be baked, and moved until all hold.
const CONFIRMATIONS: usize = 12;

/// What the levels of a bake are to reach.
#[derive(Clone, Debug, PartialEq)]
pub struct Goals {
    pub(super) measure: Measure,
    /// One per level, from fine to coarse.
    bounds: Vec<f64>,
    /// The size at which levels are looked at.
    pub(super) pixels: u32,
}

/// A level that was tried.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trial {
    pub(super) target: usize,
    pub(super) triangles: usize,
    pub(super) value: f64,
    pub(super) texture_bytes: usize,
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
                 say --texture-quality",
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

    pub(super) fn value(&self, level: &LevelReport, bytes: usize) -> f64 {
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
    pub(super) fn search(
        &self,
        run: &mut dyn FnMut(Vec<usize>) -> Result<Vec<Trial>>,
    ) -> Result<Vec<Trial>> {
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
        let found = self.bounds.iter().map(of).collect::<Result<_>>()?;
        self.confirm(found, total, run)
    }

    /// Tries the levels together, since each level takes a little from the finer ones before it, and moves
    /// those that fail towards what holds.
    fn confirm(
        &self,
        mut found: Vec<Trial>,
        total: usize,
        run: &mut dyn FnMut(Vec<usize>) -> Result<Vec<Trial>>,
    ) -> Result<Vec<Trial>> {
        for round in 0..CONFIRMATIONS {
            let counts: Vec<usize> = found.iter().map(|trial| trial.target).collect();
            found = run(counts.clone())?;
            let mut next = counts.clone();
            for ((count, trial), bound) in next.iter_mut().zip(&found).zip(&self.bounds) {
                let step = ((*count << round) / 400).min(*count / 8).max(1);
                if !self.measure.holds(trial.value, *bound) {
                    *count = match self.measure.wants_coarsest() {
                        true => (*count + step).min(total),
                        false => count.saturating_sub(step).max(1),
                    };
                }
            }
            if next == counts {
                return Ok(found);
            }
            for (trial, count) in found.iter_mut().zip(next) {
                trial.target = count;
            }
        }
        let failing = |(trial, bound): &(&Trial, &f64)| !self.measure.holds(trial.value, **bound);
        let bound = found.iter().zip(&self.bounds).find(failing).map_or(0.0, |(_, bound)| *bound);
        Err(self.refuse(&found, bound))
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
        assert!(
            new(Measure::Quality, &[90.0]).unwrap_err().to_string().contains("--texture-quality")
        );
        assert!(new(Measure::PixelsOff, &[2.0, 1.0]).is_err());
        assert!(new(Measure::PixelsOff, &[1.0, 2.0]).is_ok());
        assert!(new(Measure::Vertices, &[f64::NAN]).is_err());
    }
}
