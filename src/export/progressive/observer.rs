//! Somebody who looks on while splits are done.

use super::surface::{Changes, Surface};

/// Is told of all that changes a surface, which is named by its number.
pub(super) trait Observer {
    /// The surface is at its coarsest.
    fn begun(&mut self, _index: usize, _surface: &Surface) {}
    /// A split has changed corners, and values not yet.
    fn parted(&mut self, _index: usize, _surface: &Surface, _changes: &Changes) {}
    /// The split is done. `error` is that before it.
    fn placed(&mut self, _index: usize, _surface: &Surface, _changes: &Changes, _error: f32) {}
    /// All points and wedges have the values of before a level was settled.
    fn unsettled(&mut self, _index: usize, _surface: &Surface) {}
}

/// Nobody.
impl Observer for () {}
