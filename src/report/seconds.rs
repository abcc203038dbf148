//! The wall time of a bake, stage by stage.

use serde::Serialize;

/// Wall time of each stage in seconds; 0 for one that did not run.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// Files to assets.
    pub read: f64,
    /// Vertices to points and wedges.
    pub weld: f64,
    /// The descent.
    pub simplify: f64,
    /// The fit of the levels to the source.
    pub polish: f64,
    /// Filling the atlases.
    pub repair: f64,
    /// Sampling textures anew.
    pub transfer: f64,
    /// Levels to files.
    pub write: f64,
    /// Measuring the levels.
    pub evaluate: f64,
    /// Drawing the pictures of the page.
    pub report: f64,
}
