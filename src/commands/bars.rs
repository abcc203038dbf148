//! Progress bars on a terminal's standard error, and nothing anywhere else.

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use seamwise::progress::{Bar, Display};

/// A stage on a line of its own.
const STAGE: &str = "{prefix:>10} {wide_bar} {percent:>3} % {eta:>4}";
/// One of several files, and the stage that it is in.
const FILE: &str = "{prefix:>20} {msg:>8} {wide_bar} {percent:>3} %";

/// All bars of a run.
#[derive(Clone, Debug)]
pub(crate) struct Bars(MultiProgress);

impl Bars {
    /// Bars on standard error, if that is a terminal.
    pub(crate) fn terminal() -> Self {
        Self(MultiProgress::new())
    }

    /// Runs what prints, with no bar in its way.
    pub(crate) fn suspend<T>(&self, print: impl FnOnce() -> T) -> T {
        self.0.suspend(print)
    }

    fn add(&self, template: &str, name: &str) -> Line {
        let bar = self.0.add(ProgressBar::new(0));
        let style = ProgressStyle::with_template(template);
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_prefix(name.to_owned());
        Line { bars: self.0.clone(), bar }
    }
}

impl Display for Bars {
    fn stage(&self, name: &str, total: usize) -> Box<dyn Bar> {
        let line = self.add(STAGE, name);
        line.bar.set_length(total as u64);
        Box::new(line)
    }

    fn file(&self, name: &str) -> Option<Box<dyn Display>> {
        Some(Box::new(self.add(FILE, name)))
    }
}

/// A line that is taken off the terminal when it is dropped.
#[derive(Debug)]
struct Line {
    bars: MultiProgress,
    bar: ProgressBar,
}

/// The stages of a file share its line.
impl Display for Line {
    fn stage(&self, name: &str, total: usize) -> Box<dyn Bar> {
        self.bar.reset();
        self.bar.set_length(total as u64);
        self.bar.set_message(name.to_owned());
        Box::new(Stage(self.bar.clone()))
    }
}

impl Bar for Line {
    fn update(&self, done: usize) {
        self.bar.set_position(done as u64);
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        self.bars.remove(&self.bar);
    }
}

/// A stage on the line of its file.
struct Stage(ProgressBar);

impl Bar for Stage {
    fn update(&self, done: usize) {
        self.0.set_position(done as u64);
    }
}
