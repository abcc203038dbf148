//! The mesh that flows through the pipeline: points, wedges and triangles (Hoppe, "New quadric
//! metric for simplifying meshes with appearance attributes", Visualization 1999).
//!
//! A *point* is a position. A *wedge* is one attribute tuple at a point; the corners that agree on
//! it share it. Two triangles that meet at a point with different wedges meet at a *seam*. So the
//! surface is connected through its points, and its attributes through its wedges.

use glam::{Vec2, Vec3};

use crate::error::{Error, Result};
use crate::id::{PointId, WedgeId};

/// The attributes that a wedge carries, and their order in its row of [`Mesh::attributes`]: UV sets
/// first (2 floats each), then the normal (3), then the color (`color` floats).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// Number of UV sets.
    pub uv_sets: usize,
    /// Whether the row holds a shading normal.
    pub normal: bool,
    /// Channels of `COLOR_0`: 0, 3 or 4.
    pub color: usize,
}

impl Layout {
    /// Floats in one wedge's row.
    pub const fn len(&self) -> usize {
        2 * self.uv_sets + if self.normal { 3 } else { 0 } + self.color
    }

    /// Whether wedges carry nothing at all.
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Offset of UV set `set` in a row.
    pub const fn uv(&self, set: usize) -> usize {
        2 * set
    }

    /// Offset of the normal in a row.
    pub const fn normal(&self) -> usize {
        2 * self.uv_sets
    }

    /// Offset of the color in a row.
    pub const fn color(&self) -> usize {
        self.normal() + if self.normal { 3 } else { 0 }
    }
}

/// A triangle mesh with attributes in wedges.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// One per point, in the units of the file.
    pub positions: Vec<Vec3>,
    /// One per wedge: the point it sits at.
    pub wedge_points: Vec<PointId>,
    /// The layout of a wedge's row.
    pub layout: Layout,
    /// `layout.len()` floats per wedge, row after row.
    pub attributes: Vec<f32>,
    /// One per triangle: its corners' wedges, counter-clockwise from outside.
    pub triangles: Vec<[WedgeId; 3]>,
    /// One per triangle: the material (or primitive) it belongs to. Wedges are not shared between
    /// groups, so a group's outline is a seam.
    pub groups: Vec<u32>,
}

impl Mesh {
    /// The points of a triangle's corners.
    #[inline]
    pub fn triangle_points(&self, triangle: usize) -> [PointId; 3] {
        self.triangles[triangle].map(|wedge| self.wedge_points[wedge])
    }

    /// The positions of a triangle's corners.
    #[inline]
    pub fn triangle_positions(&self, triangle: usize) -> [Vec3; 3] {
        self.triangle_points(triangle).map(|point| self.positions[point])
    }

    /// A wedge's attribute row, `layout.len()` floats.
    #[inline]
    pub fn row(&self, wedge: WedgeId) -> &[f32] {
        let len = self.layout.len();
        &self.attributes[wedge.index() * len..(wedge.index() + 1) * len]
    }

    /// A wedge's UV in set `set`.
    #[inline]
    pub fn uv(&self, wedge: WedgeId, set: usize) -> Vec2 {
        Vec2::from_slice(&self.row(wedge)[self.layout.uv(set)..])
    }

    /// Checks that every index is in range and every array has its length, that no value is NaN or
    /// infinite and that a group's wedges are its own.
    ///
    /// # Errors
    /// [`Error::Invalid`] names the first element that is wrong.
    pub fn validate(&self) -> Result<()> {
        let invalid = |what: String| Err(Error::Invalid { what });
        if self.attributes.len() != self.wedge_points.len() * self.layout.len() {
            return invalid("attribute rows and wedges differ in number".into());
        }
        if self.groups.len() != self.triangles.len() {
            return invalid("groups and triangles differ in number".into());
        }
        if let Some(point) = self.positions.iter().position(|p| !p.is_finite()) {
            return invalid(format!("the position of point {point} is not finite"));
        }
        if let Some(at) = self.attributes.iter().position(|a| !a.is_finite()) {
            return invalid(format!(
                "an attribute of wedge {} is not finite",
                at / self.layout.len()
            ));
        }
        if let Some(wedge) =
            self.wedge_points.iter().position(|p| p.index() >= self.positions.len())
        {
            return invalid(format!("wedge {wedge} names a point that is not there"));
        }
        let mut owner = vec![u32::MAX; self.wedge_points.len()];
        for (triangle, (wedges, &group)) in self.triangles.iter().zip(&self.groups).enumerate() {
            for wedge in wedges {
                match owner.get_mut(wedge.index()) {
                    None => {
                        return invalid(format!(
                            "triangle {triangle} names a wedge that is not there"
                        ));
                    }
                    Some(owner) if *owner == u32::MAX => *owner = group,
                    Some(owner) if *owner != group => {
                        return invalid(format!(
                            "triangle {triangle} shares a wedge with another group"
                        ));
                    }
                    Some(_) => {}
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            wedge_points: vec![PointId(0), PointId(1), PointId(2)],
            layout: Layout { uv_sets: 1, normal: false, color: 0 },
            attributes: vec![0.0, 0.0, 1.0, 0.0, 0.0, 1.0],
            triangles: vec![[WedgeId(0), WedgeId(1), WedgeId(2)]],
            groups: vec![0],
        }
    }

    #[test]
    fn layout_places_uv_then_normal_then_color() {
        let layout = Layout { uv_sets: 2, normal: true, color: 4 };
        assert_eq!((layout.uv(1), layout.normal(), layout.color(), layout.len()), (2, 4, 7, 11));
    }

    #[test]
    fn a_sound_mesh_validates_and_a_broken_one_says_where() {
        triangle().validate().unwrap();
        let mut broken = triangle();
        broken.positions[1].y = f32::NAN;
        assert!(broken.validate().unwrap_err().to_string().contains("point 1"));
        let mut broken = triangle();
        broken.triangles[0][2] = WedgeId(9);
        assert!(broken.validate().unwrap_err().to_string().contains("triangle 0"));
    }
}
