//! The compiled half of the Python package: arrays and files in, arrays and JSON out. The other half,
//! in `package/`, checks and documents what users give.

mod arrays;
mod bake;
mod errors;
mod evaluate;
mod progress;
mod repair;
mod simplify;

/// The module.
#[pyo3::pymodule]
mod _seamwise {
    #[pymodule_export]
    use super::bake::{bake, manifest};
    #[pymodule_export]
    use super::evaluate::{evaluate, inspect};
    #[pymodule_export]
    use super::repair::{repair, repair_file};
    #[pymodule_export]
    use super::simplify::simplify;
}
