//! Arrays of numpy as slices, and vectors as arrays. Shapes are checked here, types by numpy: the
//! package hands over contiguous arrays of the right type.

use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::errors::refuse;

/// The rows of an array of shape (n, N).
pub(crate) fn rows<'a, T: Element, const N: usize>(
    array: &'a PyReadonlyArray2<'_, T>,
    name: &str,
) -> PyResult<&'a [[T; N]]> {
    let (_, width) = array.as_array().dim();
    let py = array.py();
    if width != N {
        return Err(refuse(
            py,
            "OptionsError",
            format!("{name} are of shape (n, {N}), not (n, {width})"),
        ));
    }
    let (rows, _) = array.as_slice().map_err(PyErr::from)?.as_chunks();
    Ok(rows)
}

/// The values of an array of one axis.
pub(crate) fn values<'a, T: Element>(array: &'a PyReadonlyArray1<'_, T>) -> PyResult<&'a [T]> {
    array.as_slice().map_err(PyErr::from)
}

/// An array of shape (n, N) of so many values.
pub(crate) fn table<'py, T: Element>(
    py: Python<'py>,
    values: Vec<T>,
    width: usize,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let rows = values.len() / width;
    PyArray1::from_vec(py, values).reshape([rows, width])
}
