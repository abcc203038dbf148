//! Figures of levels from any tool, and of what is in a file.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use seamwise::document::asset::Asset;
use seamwise::evaluate::{Metrics, Options, compare_assets};
use seamwise::import::options::ReadOptions;
use seamwise::import::{read_bytes_with, read_with};
use seamwise::limit::MemoryLimit;

use crate::errors::raise;

/// An asset as a file or in memory.
#[derive(FromPyObject)]
pub(crate) enum Source {
    Bytes(Vec<u8>),
    Path(PathBuf),
}

impl Source {
    pub(crate) fn path(&self) -> Option<&Path> {
        match self {
            Self::Bytes(_) => None,
            Self::Path(path) => Some(path),
        }
    }

    fn read(&self, options: ReadOptions) -> seamwise::Result<Asset> {
        match self {
            Self::Bytes(bytes) => read_bytes_with(bytes, Path::new(""), options),
            Self::Path(path) => read_with(path, options),
        }
    }
}

/// How to look; `None` stands for the tool's default.
#[derive(Clone, Copy, FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Looks {
    views: Option<usize>,
    resolution: Option<usize>,
    samples: Option<usize>,
    pixel_tolerance: Option<f64>,
}

impl Looks {
    pub(crate) fn options(self) -> Options {
        let base = Options::default();
        Options {
            views: self.views.unwrap_or(base.views),
            resolution: self.resolution.unwrap_or(base.resolution),
            samples: self.samples.unwrap_or(base.samples),
            pixel_tolerance: self.pixel_tolerance.unwrap_or(base.pixel_tolerance),
            ..base
        }
    }
}

/// The metrics of each candidate, in their order, as JSON.
#[pyfunction]
#[allow(clippy::needless_pass_by_value, reason = "arguments of Python are extracted by value")]
pub(crate) fn evaluate(
    py: Python<'_>,
    reference: Source,
    candidates: Vec<Source>,
    looks: Looks,
    allow_missing: bool,
) -> PyResult<String> {
    let reading = ReadOptions { allow_missing, ..ReadOptions::default() };
    let read = |source: &Source| {
        py.detach(|| source.read(reading)).map_err(|error| raise(py, &error, source.path()))
    };
    let own = read(&reference)?;
    let others: Vec<Asset> = candidates.iter().map(read).collect::<PyResult<_>>()?;
    let metrics: Vec<Metrics> = py
        .detach(|| compare_assets(&own, &others, looks.options()))
        .map_err(|error| raise(py, &error, reference.path()))?;
    json(py, &metrics)
}

/// The contents of an asset as JSON.
#[pyfunction]
#[allow(clippy::needless_pass_by_value, reason = "arguments of Python are extracted by value")]
pub(crate) fn inspect(py: Python<'_>, source: Source) -> PyResult<String> {
    let look = || {
        let asset = source.read(ReadOptions { allow_missing: true, ..ReadOptions::default() })?;
        let footprint = seamwise::texture::Footprint::default();
        seamwise::inspect::inspect(&asset, MemoryLimit::default(), footprint)?.to_json()
    };
    py.detach(look).map_err(|error| raise(py, &error, source.path()))
}

fn json(py: Python<'_>, value: &impl serde::Serialize) -> PyResult<String> {
    let failed = |error: serde_json::Error| crate::errors::refuse(py, "InternalError", error);
    serde_json::to_string(value).map_err(failed)
}
