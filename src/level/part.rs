//! A primitive of a level.

use crate::document::accessor::Elements;

/// A primitive of a level, ready to be written.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LevelPart {
    /// Three indices per triangle.
    pub(crate) indices: Vec<u32>,
    /// The attributes by name, in the order of the source.
    pub(crate) attributes: Vec<(String, Elements)>,
    /// The morph targets.
    pub(crate) targets: Vec<Vec<(String, Elements)>>,
}
