//! Progress bars on a terminal's standard error, and nothing anywhere else.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Where progress is shown.
#[derive(Clone, Debug)]
pub struct Progress {
    bars: MultiProgress,
}

impl Progress {
    /// On standard error, if that is a terminal.
    pub fn terminal() -> Self {
        Self { bars: MultiProgress::new() }
    }

    /// Nowhere.
    pub fn hidden() -> Self {
        Self { bars: MultiProgress::with_draw_target(ProgressDrawTarget::hidden()) }
    }

    /// Runs a stage that does `total` steps and counts them on the counter it is given.
    pub fn stage<T>(&self, name: &str, total: usize, run: impl FnOnce(&AtomicUsize) -> T) -> T {
        let bar = self.bars.add(ProgressBar::new(total as u64));
        let style = ProgressStyle::with_template("{prefix:>10} {wide_bar} {percent:>3} % {eta:>4}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_prefix(name.to_owned());
        let (count, finished) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let result = if bar.is_hidden() {
            run(&count)
        } else {
            std::thread::scope(|scope| {
                let watcher = scope.spawn(|| {
                    while finished.load(Ordering::Relaxed) == 0 {
                        bar.set_position(count.load(Ordering::Relaxed) as u64);
                        std::thread::park_timeout(Duration::from_millis(100));
                    }
                });
                let result = run(&count);
                finished.store(1, Ordering::Relaxed);
                watcher.thread().unpark();
                result
            })
        };
        bar.finish_and_clear();
        self.bars.remove(&bar);
        result
    }
}
