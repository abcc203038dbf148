//! Progress bars on a terminal's standard error, and nothing anywhere else; and the end of the time that
//! a job may take.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::Thread;
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::error::{Error, Result};

/// Where progress is shown.
#[derive(Clone, Debug)]
pub struct Progress {
    bars: MultiProgress,
    /// The bar that all stages of one file share.
    file: Option<ProgressBar>,
    /// When the job started, and how long it may take.
    limit: Option<(Instant, Duration)>,
}

/// A stage of its own.
const STAGE: &str = "{prefix:>10} {wide_bar} {percent:>3} % {eta:>4}";
/// One of several files, and the stage that it is in.
const FILE: &str = "{prefix:>20} {msg:>8} {wide_bar} {percent:>3} %";

/// Ends a watcher when the stage does, be it by a panic.
struct End<'a> {
    finished: &'a AtomicBool,
    watcher: &'a Thread,
}

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.finished.store(true, Ordering::Relaxed);
        self.watcher.unpark();
    }
}

impl Progress {
    /// On standard error, if that is a terminal.
    pub fn terminal() -> Self {
        Self { bars: MultiProgress::new(), file: None, limit: None }
    }

    /// Nowhere.
    pub fn hidden() -> Self {
        let bars = MultiProgress::with_draw_target(ProgressDrawTarget::hidden());
        Self { bars, file: None, limit: None }
    }

    /// Runs a stage that does `total` steps and counts them on the counter it is given.
    pub fn stage<T>(&self, name: &str, total: usize, run: impl FnOnce(&AtomicUsize) -> T) -> T {
        let bar = match &self.file {
            Some(bar) => bar.clone(),
            None => self.add(STAGE, name),
        };
        bar.reset();
        bar.set_length(total as u64);
        bar.set_message(name.to_owned());
        let (count, finished) = (AtomicUsize::new(0), AtomicBool::new(false));
        let result = if bar.is_hidden() {
            run(&count)
        } else {
            std::thread::scope(|scope| {
                let watcher = scope.spawn(|| {
                    while !finished.load(Ordering::Relaxed) {
                        bar.set_position(count.load(Ordering::Relaxed) as u64);
                        std::thread::park_timeout(Duration::from_millis(100));
                    }
                });
                let _end = End { finished: &finished, watcher: watcher.thread() };
                run(&count)
            })
        };
        if self.file.is_none() {
            self.remove(&bar);
        }
        result
    }

    /// Runs what is done to one of several files: its stages share a bar with the file's name.
    pub fn file<T>(&self, name: &str, run: impl FnOnce(&Self) -> T) -> T {
        let bar = self.add(FILE, name);
        let result = run(&Self { file: Some(bar.clone()), ..self.clone() });
        self.remove(&bar);
        result
    }

    /// The same for a job that starts now and may take so long.
    pub fn within(&self, limit: Option<Duration>) -> Self {
        Self { limit: limit.map(|limit| (Instant::now(), limit)), ..self.clone() }
    }

    /// Whether a job may go on. Long work asks between its steps.
    ///
    /// # Errors
    /// [`Error::TimeLimit`] if its time is over.
    pub fn check(&self) -> Result<()> {
        match self.limit {
            Some((start, limit)) if start.elapsed() >= limit => Err(Error::TimeLimit { limit }),
            _ => Ok(()),
        }
    }

    /// Runs what prints, with no bar in its way.
    pub fn suspend<T>(&self, print: impl FnOnce() -> T) -> T {
        self.bars.suspend(print)
    }

    fn add(&self, template: &str, name: &str) -> ProgressBar {
        let bar = self.bars.add(ProgressBar::new(0));
        let style = ProgressStyle::with_template(template);
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_prefix(name.to_owned());
        bar
    }

    fn remove(&self, bar: &ProgressBar) {
        bar.finish_and_clear();
        self.bars.remove(bar);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_ends_with_its_time_and_others_go_on() {
        let all = Progress::hidden();
        let late = all.within(Some(Duration::ZERO));
        let error = late.check().unwrap_err().to_string();
        assert_eq!(error, "it was not done within the time limit of 0 s");
        assert!(late.file("a", Progress::check).is_err());
        let more = Duration::from_secs(3600);
        for going in [&all, &all.within(None), &all.within(Some(more))] {
            assert!(going.check().is_ok());
        }
    }
}
