//! Levels of arrays.

use std::collections::BTreeMap;

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use seamwise::attr::{
    Cost, Error, Placement, Polish, Settings, Simplified, Simplifier, Target, Vertices, Weights,
};

use crate::arrays::{rows, table, values};
use crate::errors::refuse;

/// The arrays of a mesh, one row per vertex, and of its triangles.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Arrays<'py> {
    positions: PyReadonlyArray2<'py, f32>,
    triangles: PyReadonlyArray2<'py, u32>,
    uvs: Vec<PyReadonlyArray2<'py, f32>>,
    normals: Option<PyReadonlyArray2<'py, f32>>,
    colors: Option<PyReadonlyArray2<'py, f32>>,
    groups: Option<PyReadonlyArray1<'py, u32>>,
    locked: Option<PyReadonlyArray1<'py, bool>>,
    importance: Option<PyReadonlyArray1<'py, f32>>,
}

/// What a descent is to do; `None` stands for the tool's default.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Keywords {
    cost: String,
    placement: String,
    max_error: Option<f64>,
    max_rotation: Option<f64>,
    join_distance: Option<f64>,
    keep_volume: bool,
    reach_target: bool,
    polish: bool,
    weights: BTreeMap<String, f64>,
}

/// A size as Python gives it: a count, or a share.
#[derive(FromPyObject)]
pub(crate) enum Size {
    Triangles(usize),
    Ratio(f64),
}

/// Makes a level for each target; each is a dictionary of arrays.
#[pyfunction]
#[allow(clippy::needless_pass_by_value, reason = "arguments of Python are extracted by value")]
pub(crate) fn simplify<'py>(
    py: Python<'py>,
    arrays: Arrays<'py>,
    targets: Vec<Size>,
    keywords: Keywords,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let vertices = vertices(py, &arrays)?;
    let locked = arrays.locked.as_ref().map(values).transpose()?.unwrap_or_default();
    let importance = arrays.importance.as_ref().map(values).transpose()?.unwrap_or_default();
    let targets: Vec<Target> = targets
        .iter()
        .map(|size| match *size {
            Size::Triangles(count) => Target::Triangles(count),
            Size::Ratio(share) => Target::Ratio(share),
        })
        .collect();
    let settings = keywords.settings(&vertices).map_err(|what| refuse(py, "OptionsError", what))?;
    let polish = keywords.polish.then(Polish::default);
    let run = || {
        let simplifier = Simplifier::new(&vertices).settings(settings).polish(polish);
        simplifier.locked(locked).importance(importance).run(&targets)
    };
    let levels = py.detach(run).map_err(|error| raise(py, &error))?;
    levels.into_iter().map(|level| dictionary(py, level)).collect()
}

/// The exception for an error of arrays.
fn raise(py: Python<'_>, error: &Error) -> PyErr {
    match error {
        Error::Invalid { .. } => refuse(py, "InvalidError", error),
        Error::Options { .. } => refuse(py, "OptionsError", error),
    }
}

fn vertices(py: Python<'_>, arrays: &Arrays<'_>) -> PyResult<Vertices> {
    let triangles = rows::<u32, 3>(&arrays.triangles, "triangles")?;
    let fail = |error: Error| raise(py, &error);
    let positions = rows::<f32, 3>(&arrays.positions, "positions")?;
    let mut own = Vertices::new(positions, triangles.as_flattened()).map_err(fail)?;
    for uvs in &arrays.uvs {
        own = own.with_uvs(rows::<f32, 2>(uvs, "uvs")?).map_err(fail)?;
    }
    if let Some(normals) = &arrays.normals {
        own = own.with_normals(rows::<f32, 3>(normals, "normals")?).map_err(fail)?;
    }
    own = match &arrays.colors {
        Some(colors) if colors.as_array().dim().1 == 3 => {
            own.with_colors::<3>(rows(colors, "colors")?).map_err(fail)?
        }
        Some(colors) => own.with_colors::<4>(rows(colors, "colors")?).map_err(fail)?,
        None => own,
    };
    match &arrays.groups {
        Some(groups) => Ok(own.with_groups(values(groups)?.to_vec())),
        None => Ok(own),
    }
}

impl Keywords {
    fn settings(&self, vertices: &Vertices) -> Result<Settings, String> {
        let base = match self.reach_target {
            true => Settings::default(),
            false => Settings::for_diagonal(vertices.diagonal()),
        };
        let mut weights = Weights::default();
        for (name, &weight) in &self.weights {
            *match name.as_str() {
                "uv" => &mut weights.uv,
                "normal" => &mut weights.normal,
                "color" => &mut weights.color,
                "border" => &mut weights.border,
                "seam" => &mut weights.seam,
                other => {
                    return Err(format!(
                        "{other:?} has no weight: \"uv\", \"normal\", \"color\", \"border\", \"seam\" have"
                    ));
                }
            } = weight;
        }
        let cost = match self.cost.as_str() {
            "quadric" => Cost::Quadric,
            "edge-length" => Cost::EdgeLength,
            "classic" => Cost::Classic,
            other => {
                return Err(format!(
                    "{other:?} is no cost: \"quadric\", \"edge-length\" or \"classic\""
                ));
            }
        };
        let placement = match self.placement.as_str() {
            "best" => Placement::Best,
            "ends" => Placement::Ends,
            "middle" => Placement::Middle,
            other => {
                return Err(format!("{other:?} is no placement: \"best\", \"ends\" or \"middle\""));
            }
        };
        Ok(Settings {
            weights,
            cost,
            placement,
            max_error: self.max_error,
            max_rotation: self.max_rotation.unwrap_or(base.max_rotation),
            join_distance: self.join_distance,
            keep_volume: self.keep_volume,
            ..base
        })
    }
}

fn dictionary(py: Python<'_>, level: Simplified) -> PyResult<Bound<'_, PyDict>> {
    let Simplified { vertices, sources, target, error, stopped } = level;
    let own = PyDict::new(py);
    let flat = |points: &[seamwise::glam::Vec3]| points.iter().flat_map(|p| p.to_array()).collect();
    own.set_item("positions", table(py, flat(&vertices.positions), 3)?)?;
    own.set_item("triangles", table(py, vertices.indices().to_vec(), 3)?)?;
    let uvs = (0..vertices.layout.uv_sets)
        .map(|set| table(py, vertices.uvs(set).flat_map(|uv| uv.to_array()).collect(), 2));
    own.set_item("uvs", uvs.collect::<PyResult<Vec<_>>>()?)?;
    if vertices.layout.normal {
        let normals = vertices.normals().flat_map(|n| n.to_array()).collect();
        own.set_item("normals", table(py, normals, 3)?)?;
    }
    if vertices.layout.color > 0 {
        let colors = vertices.colors().flatten().copied().collect();
        own.set_item("colors", table(py, colors, vertices.layout.color)?)?;
    }
    if !vertices.groups.is_empty() {
        own.set_item("groups", PyArray1::from_vec(py, vertices.groups))?;
    }
    own.set_item("sources", PyArray1::from_vec(py, sources))?;
    own.set_item("target", target)?;
    own.set_item("error", error)?;
    own.set_item("stopped", stopped.map(|stop| stop.to_string()))?;
    Ok(own)
}
