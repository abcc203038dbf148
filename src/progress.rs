//! Progress bars on a terminal's standard error, and nothing anywhere else; and when there is to be no
//! more of it.
//!
//! A bake may be given a time. It is looked at between stages and, within one, before each surface
//! or level: what is under way is ended first, so a bake ends late by a step at most, and every
//! file is still written or none.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::Thread;
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::error::{Error, Result};

/// The display of progress.
#[derive(Clone, Debug)]
pub struct Progress {
    bars: MultiProgress,
    /// The bar that all stages of one file share.
    file: Option<ProgressBar>,
    deadline: Option<Deadline>,
}

/// The end of a time limit, and its length.
#[derive(Clone, Copy, Debug)]
struct Deadline {
    end: Instant,
    limit: Duration,
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
    /// Progress on standard error, if that is a terminal.
    pub fn terminal() -> Self {
        Self { bars: MultiProgress::new(), file: None, deadline: None }
    }

    /// Progress that is not shown.
    pub fn hidden() -> Self {
        let bars = MultiProgress::with_draw_target(ProgressDrawTarget::hidden());
        Self { bars, file: None, deadline: None }
    }

    /// This progress with a time limit from now on, if there is one.
    pub(crate) fn limited(&self, limit: Option<Duration>) -> Self {
        let end = |limit| Some(Deadline { end: Instant::now().checked_add(limit)?, limit });
        Self { deadline: limit.and_then(end), ..self.clone() }
    }

    /// This progress, not shown.
    pub(crate) fn unseen(&self) -> Self {
        Self { deadline: self.deadline, ..Self::hidden() }
    }

    /// Makes sure that there is time left; `stage` is what it would be for, or was.
    ///
    /// # Errors
    /// [`Error::Time`] with the stage.
    pub(crate) fn check(&self, stage: &str) -> Result<()> {
        match self.deadline {
            Some(Deadline { end, limit }) if Instant::now() >= end => {
                Err(Error::Time { stage: stage.to_owned(), limit })
            }
            _ => Ok(()),
        }
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
    fn time_is_over_at_its_end_and_never_without_one() {
        let progress = Progress::hidden();
        assert!(progress.check("read").is_ok());
        assert!(progress.limited(Some(Duration::MAX)).check("read").is_ok());
        assert!(progress.limited(Some(Duration::from_secs(3600))).check("read").is_ok());
        let over = progress.limited(Some(Duration::ZERO));
        for over in [over.unseen(), over.file("a.glb", Progress::clone), over] {
            let said = over.check("simplify").unwrap_err().to_string();
            assert!(said.contains("`simplify`") && said.contains("--time-limit"), "{said}");
            assert!(over.limited(None).check("simplify").is_ok());
        }
    }
}
