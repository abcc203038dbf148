//! The edges of a sheet where two triangles meet.

use glam::DVec3;

use super::sheet::{Sheet, SurfacePoint};
use crate::edges::{EdgeKind, Side, visit_edges};
use crate::id::TriangleId;

/// An edge, as a side of one of its triangles.
#[derive(Clone, Copy)]
pub(super) struct SheetEdge {
    pub(super) kind: EdgeKind,
    pub(super) triangle: TriangleId,
    /// The triangle on the other side.
    pub(super) other: TriangleId,
    /// The slots of its ends.
    slots: [usize; 2],
}

impl SheetEdge {
    /// The point at a share of the way along.
    pub(super) fn at(&self, share: f64) -> SurfacePoint {
        let mut barycentrics = DVec3::ZERO;
        barycentrics[self.slots[0]] = 1.0 - share;
        barycentrics[self.slots[1]] = share;
        SurfacePoint::new(self.triangle, barycentrics)
    }

    /// Its ends, as vertices of the sheet.
    pub(super) fn vertices(&self, sheet: &Sheet<'_>) -> [u32; 2] {
        self.slots.map(|slot| sheet.fans.triangles[self.triangle.index()][slot])
    }

    /// The way from one end to the other.
    pub(super) fn vector(&self, sheet: &Sheet<'_>) -> DVec3 {
        let corners = sheet.corners(self.triangle);
        corners[self.slots[1]] - corners[self.slots[0]]
    }
}

/// The edges of two triangles each, in the order of their points.
pub(super) fn inner_edges(sheet: &Sheet<'_>) -> Vec<SheetEdge> {
    let mut edges = Vec::new();
    visit_edges(sheet.mesh, |kind, sides: &[Side]| {
        let [(ends, first), (_, second)] = *sides else { return };
        let own = sheet.fans.triangles[first];
        let slot = |point: u32| own.iter().position(|&p| p == point);
        let [Some(from), Some(to)] = ends.map(|point| slot(point.0)) else { return };
        let [triangle, other] = [first, second].map(TriangleId::new);
        edges.push(SheetEdge { kind, triangle, other, slots: [from, to] });
    });
    edges
}
