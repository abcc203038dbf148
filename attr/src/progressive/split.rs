//! A record from vertex splits, as a file tells them.

use glam::Vec3;

use crate::error::{Error, Result};
use crate::id::{PointId, TriangleId};
use crate::mesh::Mesh;
use crate::progressive::mesh::{Change, Ends, Moved, ProgressiveMesh};

/// A vertex split: a collapse as it is undone, by the numbers of the source.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Split {
    /// The points that were one, first the one whose number that had; none if a shell comes.
    pub points: Vec<PointId>,
    /// Where it was before the split.
    pub position: Vec3,
    /// The error before the split: see `Collapse::error`.
    pub error: f32,
    /// The wedges that were at it, with the points that they are at after.
    pub moved: Vec<Moved>,
    /// A row of the layout for each, as it was before.
    pub rows: Vec<f32>,
    /// The corners that get other wedges.
    pub corners: Vec<Change>,
    /// The triangles that come.
    pub triangles: Vec<TriangleId>,
}

impl ProgressiveMesh {
    /// A record of splits in their order, the last of which gives the source.
    ///
    /// # Errors
    /// [`Error::Invalid`] names the first that does not fit.
    pub fn from_splits(source: Mesh, splits: &[Split]) -> Result<Self> {
        let mut own = Self {
            live: vec![true; source.triangles.len()],
            counts: vec![source.triangles.len()],
            mesh: source,
            applied: 0,
            collapses: Vec::with_capacity(splits.len()),
            points: Vec::new(),
            moved: Vec::new(),
            rows: Vec::new(),
            corners: Vec::new(),
            triangles: Vec::new(),
            levels: Vec::new(),
            settles: Vec::new(),
        };
        let mut left = own.live.len();
        for split in splits.iter().rev() {
            own.points.extend(&split.points);
            own.moved.extend(&split.moved);
            own.rows.extend(&split.rows);
            own.corners.extend(&split.corners);
            own.triangles.extend(&split.triangles);
            left = left.saturating_sub(split.triangles.len());
            own.counts.push(left);
            own.collapses.push(Ends {
                position: (!split.points.is_empty()).then_some(split.position),
                error: split.error,
                points: own.points.len(),
                moved: own.moved.len(),
                corners: own.corners.len(),
                triangles: own.triangles.len(),
            });
        }
        if own.rows.len() != own.moved.len() * own.mesh.layout.len() {
            return Err(Error::Invalid { what: "rows that do not fit the layout".into() });
        }
        own.validate()?;
        Ok(own)
    }
}
