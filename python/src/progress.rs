//! Progress as a call of a Python function, and the end of a run by an exception or by Ctrl-C.

use std::sync::{Arc, Mutex};

use pyo3::prelude::*;
use seamwise::progress::{Bar, Display, Progress};

/// A function of (stage, done, total), if there is one, and the exception that ended the run.
#[derive(Clone, Debug)]
pub(crate) struct Watch {
    callback: Option<Arc<Py<PyAny>>>,
    ended: Arc<Mutex<Option<PyErr>>>,
}

/// A stage that is told about.
struct Stage {
    watch: Watch,
    name: String,
    total: usize,
}

impl Watch {
    pub(crate) fn new(callback: Option<Py<PyAny>>) -> Self {
        Self { callback: callback.map(Arc::new), ended: Arc::default() }
    }

    pub(crate) fn progress(&self) -> Progress {
        Progress::new(Arc::new(self.clone()))
    }

    /// The exception that ended the run.
    pub(crate) fn take(&self) -> Option<PyErr> {
        self.ended.lock().ok()?.take()
    }

    fn end(&self, error: PyErr) {
        if let Ok(mut ended) = self.ended.lock() {
            ended.get_or_insert(error);
        }
    }

    fn has_ended(&self) -> bool {
        self.ended.lock().is_ok_and(|ended| ended.is_some())
    }

    fn tell(&self, name: &str, done: usize, total: usize) {
        let Some(callback) = self.callback.as_ref().filter(|_| !self.has_ended()) else { return };
        Python::attach(|py| {
            if let Err(error) = callback.call1(py, (name, done, total)) {
                self.end(error);
            }
        });
    }
}

impl Display for Watch {
    fn stage(&self, name: &str, total: usize) -> Box<dyn Bar> {
        self.tell(name, 0, total);
        Box::new(Stage { watch: self.clone(), name: name.to_owned(), total })
    }

    /// Signals reach the main thread alone, so others find nothing here.
    fn is_canceled(&self) -> bool {
        if !self.has_ended()
            && let Err(error) = Python::attach(|py| py.check_signals())
        {
            self.end(error);
        }
        self.has_ended()
    }
}

impl Bar for Stage {
    fn update(&self, done: usize) {
        self.watch.tell(&self.name, done, self.total);
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.watch.tell(&self.name, self.total, self.total);
    }
}
