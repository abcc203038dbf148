//! The wall time of a job by the number of threads: an experiment of several runs.

use serde::Serialize;

use super::chart::{Chart, Point, Series};
use super::seconds::Seconds;
use crate::error::{Error, Result};

/// Runs of a bake on so many threads.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ThreadTimes {
    /// Threads it had.
    pub threads: usize,
    /// Number of runs.
    pub runs: usize,
    /// Wall time of all stages together but for the evaluation.
    pub total: Spread,
    /// Wall time of each stage that takes any.
    pub stages: Vec<StageTime>,
    /// Wall time of the evaluation, if there is one.
    pub evaluate: Option<Spread>,
}

/// Wall time of a stage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageTime {
    /// Its name, as in `seconds`.
    pub stage: &'static str,
    /// In seconds.
    #[serde(flatten)]
    pub time: Spread,
}

/// Seconds over several runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Their mean.
    pub mean: f64,
    /// The standard deviation of a run, estimated from these; 0 for a single one.
    pub deviation: f64,
}

impl Spread {
    fn of(values: &[f64]) -> Self {
        let count = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        Self { mean, deviation: (squares / (count - 1.0).max(1.0)).sqrt() }
    }
}

/// Runs a job `runs` times on 1, 2, … `most` threads each. Rounds over all numbers of threads follow each other,
/// so that what else the machine does falls on all alike.
///
/// # Errors
/// The job's error; [`Error::Internal`] if threads can't be had.
pub(crate) fn time_threads(
    most: usize,
    runs: usize,
    run: impl Fn() -> Result<Seconds> + Sync,
) -> Result<Vec<ThreadTimes>> {
    let mut seconds: Vec<Vec<Seconds>> = vec![Vec::new(); most.max(1)];
    for _ in 0..runs.max(1) {
        for (before, own) in seconds.iter_mut().enumerate() {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(before + 1)
                .build()
                .map_err(Error::internal)?;
            own.push(pool.install(&run)?);
        }
    }
    Ok((1..).zip(&seconds).map(|(threads, runs)| ThreadTimes::of(threads, runs)).collect())
}

impl ThreadTimes {
    fn of(threads: usize, runs: &[Seconds]) -> Self {
        let spread =
            |of: &dyn Fn(&Seconds) -> f64| Spread::of(&runs.iter().map(of).collect::<Vec<_>>());
        let stages = runs.first().map_or(Vec::new(), |first| {
            let names = first.work().into_iter().enumerate();
            let time = names
                .map(|(at, (stage, _))| StageTime { stage, time: spread(&|own| own.work()[at].1) });
            time.filter(|own| own.time.mean > 0.0).collect()
        });
        Self {
            threads,
            runs: runs.len(),
            total: spread(&|own| own.work().iter().map(|(_, seconds)| seconds).sum()),
            stages,
            evaluate: Some(spread(&|own| own.evaluate)).filter(|own| own.mean > 0.0),
        }
    }
}

impl Seconds {
    /// The stages that make what a bake writes.
    fn work(&self) -> [(&'static str, f64); 7] {
        [
            ("read", self.read),
            ("weld", self.weld),
            ("simplify", self.simplify),
            ("polish", self.polish),
            ("repair", self.repair),
            ("transfer", self.transfer),
            ("write", self.write),
        ]
    }
}

/// Stages of a smaller share of the time have no line of their own.
const LEAST_SHARE: f64 = 0.02;

/// The times of the stages as one chart, and those of the evaluation as another; none if nothing was timed.
pub(super) fn thread_charts(times: &[ThreadTimes]) -> Vec<Chart> {
    let line = |color: usize, name: &str, of: &dyn Fn(&ThreadTimes) -> Option<Spread>| {
        let point = |own: &ThreadTimes| {
            let Spread { mean: value, deviation } = of(own)?;
            Some(Point { triangles: own.threads, value, deviation, name: name.to_owned() })
        };
        Series { color, points: times.iter().filter_map(point).collect() }
    };
    let Some(one) = times.first() else { return Vec::new() };
    let shown = one.stages.iter().filter(|own| own.time.mean > LEAST_SHARE * one.total.mean);
    let mut series = vec![line(0, "all but the evaluation", &|own| Some(own.total))];
    series.extend((1..).zip(shown).map(|(color, stage)| {
        line(color, stage.stage, &|own| {
            own.stages.iter().find(|own| own.stage == stage.stage).map(|own| own.time)
        })
    }));
    let chart =
        |title, series| Chart { title, unit: "seconds", ideal: 0.0, across: "threads", series };
    let evaluation = line(0, "evaluation", &|own| own.evaluate);
    vec![chart("Stages", series), chart("Evaluation", vec![evaluation])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn each_run_has_its_threads_and_stages_have_mean_and_deviation() {
        let seen = Mutex::new(Vec::new());
        let run = || {
            let mut seen = seen.lock().unwrap();
            seen.push(rayon::current_num_threads());
            let simplify = if seen.len() <= 3 { 1.0 } else { 3.0 };
            Ok(Seconds { simplify, evaluate: 7.0, ..Seconds::default() })
        };
        let times = time_threads(3, 2, run).unwrap();
        assert_eq!(*seen.lock().unwrap(), [1, 2, 3, 1, 2, 3]);
        for (threads, own) in (1..).zip(&times) {
            assert_eq!((own.threads, own.runs, own.stages.len()), (threads, 2, 1));
            let spread = Spread { mean: 2.0, deviation: 2f64.sqrt() };
            assert_eq!((own.total, own.stages[0].time), (spread, spread), "no evaluation in it");
            assert_eq!(own.evaluate, Some(Spread { mean: 7.0, deviation: 0.0 }));
        }
        let charts = thread_charts(&times);
        assert_eq!(charts[0].series.len(), 2);
        assert!(charts[0].to_svg().contains("threads"));
        let failing = || Err::<Seconds, _>(Error::internal("no"));
        assert!(time_threads(2, 1, failing).is_err());
        assert!(thread_charts(&[]).is_empty());
    }
}
