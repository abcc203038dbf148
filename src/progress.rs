//! How far a run is, for whoever wants to show it; and the end of a run that takes too long.
//!
//! A bake may be given a time, and its display may end it. Both are looked at between stages and, within one, before each surface
//! or level: what is under way is ended first, so a bake ends late by a step at most, and every
//! file is still written or none.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::Thread;
use std::time::{Duration, Instant};

use crate::error::{Error, Result};

/// A display of progress: implement it to show how far a run is.
///
/// ```
/// use std::sync::{Arc, Mutex};
/// use seamwise::progress::{Bar, Display, Progress};
///
/// /// Keeps the names of the stages.
/// #[derive(Debug, Default)]
/// struct Names(Mutex<Vec<String>>);
///
/// impl Display for Names {
///     fn stage(&self, name: &str, _total: usize) -> Box<dyn Bar> {
///         self.0.lock().unwrap().push(name.to_owned());
///         Box::new(())
///     }
/// }
///
/// let names = Arc::new(Names::default());
/// let progress = Progress::new(names.clone());
/// progress.stage("count", 3, |done| done.fetch_add(3, std::sync::atomic::Ordering::Relaxed));
/// assert_eq!(*names.0.lock().unwrap(), ["count"]);
/// ```
pub trait Display: std::fmt::Debug + Send + Sync {
    /// Begins a stage that does `total` steps. It ends when what this returns is dropped.
    fn stage(&self, name: &str, total: usize) -> Box<dyn Bar>;

    /// The display of one of several files, which are worked on side by side: by default that of the stages
    /// of all of them. The file is done when what this returns is dropped.
    fn file(&self, _name: &str) -> Option<Box<dyn Display>> {
        None
    }

    /// Shows some lines that are worth reading before the run is over.
    fn note(&self, _text: &str) {}

    /// Whether the run is to end: asked between stages and, within one, before each surface or level.
    fn is_canceled(&self) -> bool {
        false
    }
}

/// The display of a stage.
pub trait Bar: Send + Sync {
    /// Shows that so many steps are done; called ten times a second.
    fn update(&self, done: usize);
}

/// Shows nothing.
impl Bar for () {
    fn update(&self, _done: usize) {}
}

/// The display of a run, if there is one, and the time that it may take.
#[derive(Clone, Debug, Default)]
pub struct Progress {
    display: Option<Arc<dyn Display>>,
    deadline: Option<Deadline>,
}

/// The end of a time limit, and its length.
#[derive(Clone, Copy, Debug)]
struct Deadline {
    end: Instant,
    limit: Duration,
}

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
    /// Progress that `display` shows.
    pub fn new(display: Arc<dyn Display>) -> Self {
        Self { display: Some(display), deadline: None }
    }

    /// Progress that nobody sees.
    pub fn hidden() -> Self {
        Self::default()
    }

    /// The same with a time from now on, if there is one.
    pub(crate) fn limited(&self, limit: Option<Duration>) -> Self {
        let end = |limit| Some(Deadline { end: Instant::now().checked_add(limit)?, limit });
        Self { deadline: limit.and_then(end), ..self.clone() }
    }

    /// The same, shown nowhere.
    pub(crate) fn unseen(&self) -> Self {
        Self { deadline: self.deadline, ..Self::hidden() }
    }

    /// Makes sure that there is time left and that nobody wants an end; `stage` is the one that it would
    /// be for, or was.
    ///
    /// # Errors
    /// [`Error::Time`] or [`Error::Canceled`] with the stage.
    pub(crate) fn check(&self, stage: &str) -> Result<()> {
        if self.display.as_ref().is_some_and(|display| display.is_canceled()) {
            return Err(Error::Canceled { stage: stage.to_owned() });
        }
        match self.deadline {
            Some(Deadline { end, limit }) if Instant::now() >= end => {
                Err(Error::Time { stage: stage.to_owned(), limit })
            }
            _ => Ok(()),
        }
    }

    /// Shows some lines that are worth reading before the run is over.
    pub fn note(&self, text: &str) {
        self.display.iter().for_each(|display| display.note(text));
    }

    /// Runs a stage that does `total` steps and counts them on the counter it is given.
    pub fn stage<T>(&self, name: &str, total: usize, run: impl FnOnce(&AtomicUsize) -> T) -> T {
        let (count, finished) = (AtomicUsize::new(0), AtomicBool::new(false));
        let Some(display) = &self.display else { return run(&count) };
        let bar = display.stage(name, total);
        std::thread::scope(|scope| {
            let watcher = scope.spawn(|| {
                while !finished.load(Ordering::Relaxed) {
                    bar.update(count.load(Ordering::Relaxed));
                    std::thread::park_timeout(Duration::from_millis(100));
                }
            });
            let _end = End { finished: &finished, watcher: watcher.thread() };
            run(&count)
        })
    }

    /// Runs the work on one of several files: its stages are shown as that file's.
    pub fn file<T>(&self, name: &str, run: impl FnOnce(&Self) -> T) -> T {
        let display = self.display.as_ref().and_then(|display| display.file(name));
        run(&Self { display: display.map(Arc::from).or(self.display.clone()), ..self.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

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

    /// Wants an end.
    #[derive(Debug)]
    struct Impatient;

    impl Display for Impatient {
        fn stage(&self, _name: &str, _total: usize) -> Box<dyn Bar> {
            Box::new(())
        }

        fn is_canceled(&self) -> bool {
            true
        }
    }

    #[test]
    fn a_display_ends_a_run_at_the_stage_that_comes_next() {
        let progress = Progress::new(Arc::new(Impatient));
        for progress in [progress.file("a.glb", Progress::clone), progress.limited(None)] {
            let ended = progress.check("weld").unwrap_err();
            assert!(matches!(&ended, Error::Canceled { stage } if stage == "weld"), "{ended}");
        }
    }

    /// Keeps what it is told, behind the name of its file.
    #[derive(Clone, Debug, Default)]
    struct Log {
        file: String,
        lines: Arc<Mutex<Vec<String>>>,
    }

    impl Log {
        fn say(&self, what: &str) {
            self.lines.lock().unwrap().push(format!("{}{what}", self.file));
        }
    }

    impl Display for Log {
        fn stage(&self, name: &str, total: usize) -> Box<dyn Bar> {
            self.say(&format!("{name} of {total}"));
            Box::new(self.clone())
        }

        fn file(&self, name: &str) -> Option<Box<dyn Display>> {
            Some(Box::new(Self { file: format!("{name}: "), ..self.clone() }))
        }
    }

    impl Bar for Log {
        fn update(&self, done: usize) {
            self.say(&done.to_string());
        }
    }

    #[test]
    fn stages_are_shown_as_those_of_their_file() {
        let log = Log::default();
        let progress = Progress::new(Arc::new(log.clone()));
        let wait = |count: &AtomicUsize| {
            count.store(2, Ordering::Relaxed);
            let seen = |log: &Log| log.lines.lock().unwrap().iter().any(|line| line.ends_with('2'));
            while !seen(&log) {
                std::thread::yield_now();
            }
            7
        };
        assert_eq!(progress.file("a.glb", |progress| progress.stage("read", 5, wait)), 7);
        let lines = log.lines.lock().unwrap().clone();
        assert_eq!(lines[0], "a.glb: read of 5");
        assert_eq!(lines.last().unwrap(), "a.glb: 2");
        drop(lines);
        progress.stage("write", 1, |_| ());
        assert!(log.lines.lock().unwrap().contains(&"write of 1".to_owned()));
    }
}
