//! Values of points and wedges as they are told. Those of the source are known once they were told, whatever a point or
//! wedge has in between.

use glam::Vec3;
use seamwise_attr::Layout;

use super::blocks::Result;

/// A place that values come from.
pub(super) trait Values {
    /// The position of a point that is expected at a place. `known` is the source's once it was told.
    fn position(&mut self, point: u32, expected: Vec3, known: &mut Option<Vec3>) -> Result<Vec3>;
    /// The row of a wedge, in the place of what is expected; and whether it is the source's. `known` is that once it
    /// was told.
    fn row(&mut self, wedge: u32, row: &mut [f32], known: Option<&[f32]>) -> Result<bool>;
    /// What else a wedge of a group carries, in the place of what is expected.
    fn carried(&mut self, wedge: u32, group: u32, bytes: &mut [u8]) -> Result<()>;
}

/// Values of the source that were told.
#[derive(Clone, Debug, Default)]
pub(super) struct Known {
    positions: Vec<Option<Vec3>>,
    /// Rows, and per wedge whether it is there.
    rows: Vec<f32>,
    has_row: Vec<bool>,
}

impl Known {
    pub(super) fn add_point(&mut self) {
        self.positions.push(None);
    }

    pub(super) fn add_wedge(&mut self) {
        self.has_row.push(false);
    }

    /// The position of a point.
    pub(super) fn position(
        &mut self,
        point: u32,
        expected: Vec3,
        from: &mut impl Values,
    ) -> Result<Vec3> {
        from.position(point, expected, &mut self.positions[point as usize])
    }

    /// The row of a wedge, in the place of what is expected.
    pub(super) fn row(
        &mut self,
        wedge: u32,
        row: &mut [f32],
        from: &mut impl Values,
    ) -> Result<()> {
        let own = wedge as usize * row.len()..(wedge as usize + 1) * row.len();
        let has_row = &mut self.has_row[wedge as usize];
        if from.row(wedge, row, has_row.then(|| &self.rows[own.clone()]))? {
            self.rows.resize(self.rows.len().max(own.end), 0.0);
            self.rows[own].copy_from_slice(row);
            *has_row = true;
        }
        Ok(())
    }
}

/// Makes the normal of a row a unit vector.
pub(super) fn to_unit(layout: Layout, row: &mut [f32]) {
    if layout.normal {
        let normal = &mut row[layout.normal()..][..3];
        let unit = Vec3::from_slice(normal).normalize_or(Vec3::Z);
        normal.copy_from_slice(&unit.to_array());
    }
}
