//! Progress on a terminal's standard error, and nothing anywhere else.

use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use seamwise::progress::{Bar, Display};

/// A stage on a line of its own.
const STAGE: &str = "{prefix:>10} {wide_bar} {percent:>3} % {eta:>4}";
/// A file, and the stage that it is in, which counts its steps.
const STEPS: &str = "{spinner} {prefix:>20} {msg:>9} {wide_bar} {percent:>3} % {elapsed:>4}";
/// A file, and the stage that it is in, which does not.
const MOVING: &str = "{spinner} {prefix:>20} {msg:>9} {elapsed:>4}";
/// How often a line moves.
const TICK: Duration = Duration::from_millis(100);

/// All bars of a run.
#[derive(Clone, Debug)]
pub(crate) struct Bars(MultiProgress);

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

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
        bar.set_style(style(template));
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
        let line = self.add(MOVING, name);
        line.bar.enable_steady_tick(TICK);
        Some(Box::new(line))
    }

    fn note(&self, text: &str) {
        print_above(&self.0, text);
    }
}

/// Prints lines on standard error, above all bars.
fn print_above(bars: &MultiProgress, text: &str) {
    bars.suspend(|| eprintln!("{text}"));
}

/// A line that is taken off the terminal when it is dropped.
#[derive(Debug)]
struct Line {
    bars: MultiProgress,
    bar: ProgressBar,
}

/// The stages of a file share its line, one in another too: the inner one is shown.
impl Display for Line {
    fn stage(&self, name: &str, total: usize) -> Box<dyn Bar> {
        self.bar.set_message(name.to_owned());
        self.bar.set_style(style(if total > 1 { STEPS } else { MOVING }));
        self.bar.set_length(total as u64);
        self.bar.set_position(0);
        Box::new(Stage((total > 1).then(|| self.bar.clone())))
    }

    fn note(&self, text: &str) {
        print_above(&self.bars, text);
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

/// A stage on the line of its file, if it counts its steps.
struct Stage(Option<ProgressBar>);

impl Bar for Stage {
    fn update(&self, done: usize) {
        if let Some(bar) = &self.0 {
            bar.set_position(done as u64);
        }
    }
}
