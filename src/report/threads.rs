//! The wall time of a job by the number of threads.

use std::time::Instant;

use crate::error::{Error, Result};

/// A run of a job.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ThreadTime {
    /// Threads it had.
    pub(crate) threads: usize,
    /// Wall time.
    pub(crate) seconds: f64,
}

/// Runs a job once on 1, 2, … `most` threads each.
///
/// # Errors
/// The job's error; [`Error::Internal`] if threads can't be had.
pub(crate) fn time_threads<T>(
    most: usize,
    run: impl Fn() -> Result<T> + Sync,
) -> Result<Vec<ThreadTime>> {
    let time = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(Error::internal)?;
        let start = Instant::now();
        // The result goes on this thread, so that nothing of it need be sent.
        pool.install(|| run().map(drop))?;
        Ok(ThreadTime { threads, seconds: start.elapsed().as_secs_f64() })
    };
    (1..=most.max(1)).map(time).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn each_run_has_its_threads() {
        let seen = Mutex::new(Vec::new());
        let run = || {
            seen.lock().unwrap().push(rayon::current_num_threads());
            Ok(())
        };
        let times = time_threads(3, run).unwrap();
        assert_eq!(*seen.lock().unwrap(), [1, 2, 3]);
        let threads: Vec<usize> = times.iter().map(|time| time.threads).collect();
        assert_eq!(threads, [1, 2, 3]);
        let failing = || Err::<(), _>(Error::internal("no"));
        assert!(time_threads(2, failing).is_err());
    }
}
