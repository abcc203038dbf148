//! Triangles over indexed vertices, as files and graphics programs hold them.

use glam::{DVec3, Vec2, Vec3};

use crate::error::{Error, Result};
use crate::mesh::Layout;

/// Triangles over indexed vertices, with interleaved attributes.
///
/// ```
/// use seamwise_attr::Vertices;
///
/// let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// let triangle = Vertices::new(&positions, &[0, 1, 2])?.with_uvs(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])?;
/// assert_eq!(triangle.uvs(0).last(), Some([0.0, 1.0].into()));
/// assert_eq!(triangle.indices(), [0, 1, 2]);
/// # Ok::<(), seamwise_attr::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vertices {
    /// One per vertex.
    pub positions: Vec<Vec3>,
    /// The layout of a vertex's row.
    pub layout: Layout,
    /// `layout.len()` floats per vertex.
    pub attributes: Vec<f32>,
    /// One per vertex, or empty: vertices of different `motion` move apart under a skin or a
    /// morph target, so they are never one point even where they coincide.
    pub motion: Vec<u32>,
    /// One per vertex, or empty: vertices of different `rest` differ in something that the metric
    /// does not see, so they are never one wedge.
    pub rest: Vec<u32>,
    /// Vertex indices of each triangle, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// One per triangle, its material or primitive; or empty if all are of group 0.
    pub groups: Vec<u32>,
    /// One per group, or empty if positions are off by the rounding of floats alone.
    pub precision: Vec<Precision>,
}

/// How exact the positions of a group are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Precision {
    /// The number of the grid that they lie on. Groups of one grid have in common what is meant to be one.
    pub grid: u32,
    /// How far they may be off what they stand for, beyond the rounding of floats: borders of groups on
    /// different grids that are no farther apart than both, edge for edge, are one.
    pub slack: f64,
}

impl Vertices {
    /// Vertices at `positions`, without attributes. Three `indices` make a triangle.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the indices are not a multiple of three.
    pub fn new(positions: &[impl Into<Vec3> + Copy], indices: &[u32]) -> Result<Self> {
        let (triangles, []) = indices.as_chunks::<3>() else {
            let what = format!("{} indices are not three for each triangle", indices.len());
            return Err(Error::Invalid { what });
        };
        let positions = positions.iter().map(|&p| p.into()).collect();
        Ok(Self { positions, triangles: triangles.to_vec(), ..Self::default() })
    }

    /// The same with another set of UVs, one per vertex.
    ///
    /// # Errors
    /// [`Error::Invalid`] if they are not as many as the vertices.
    pub fn with_uvs(mut self, uvs: &[impl Into<Vec2> + Copy]) -> Result<Self> {
        let at = self.layout.normal();
        self.insert(at, uvs.iter().map(|&uv| uv.into().to_array()), "UVs")?;
        self.layout.uv_sets += 1;
        Ok(self)
    }

    /// The same with shading normals of unit length, one per vertex.
    ///
    /// # Errors
    /// [`Error::Invalid`] if they are not as many as the vertices, or there are normals already.
    pub fn with_normals(mut self, normals: &[impl Into<Vec3> + Copy]) -> Result<Self> {
        if self.layout.normal {
            return Err(Error::Invalid { what: "vertices have one normal each".into() });
        }
        let at = self.layout.normal();
        self.insert(at, normals.iter().map(|&normal| normal.into().to_array()), "normals")?;
        self.layout.normal = true;
        Ok(self)
    }

    /// The same with linear colors of three or four channels in 0…1, one per vertex.
    ///
    /// # Errors
    /// [`Error::Invalid`] if they are not as many as the vertices, or there are colors already.
    pub fn with_colors<const N: usize>(mut self, colors: &[[f32; N]]) -> Result<Self> {
        const { assert!(N == 3 || N == 4, "colors have three or four channels") };
        if self.layout.color != 0 {
            return Err(Error::Invalid { what: "vertices have one color each".into() });
        }
        let at = self.layout.color();
        self.insert(at, colors.iter().copied(), "colors")?;
        self.layout.color = N;
        Ok(self)
    }

    /// The same with groups, one per triangle: its material or primitive.
    #[must_use]
    pub fn with_groups(mut self, groups: Vec<u32>) -> Self {
        self.groups = groups;
        self
    }

    /// The diagonal of the bounding box of the finite positions, 0 if there are none.
    pub fn diagonal(&self) -> f64 {
        let finite = || self.positions.iter().filter(|p| p.is_finite()).map(|p| p.as_dvec3());
        let (low, high) = (finite().reduce(DVec3::min), finite().reduce(DVec3::max));
        low.zip(high).map_or(0.0, |(low, high)| low.distance(high))
    }

    /// The indices of all triangles, three of each.
    pub fn indices(&self) -> &[u32] {
        self.triangles.as_flattened()
    }

    /// The UVs of a set, one per vertex.
    ///
    /// # Panics
    /// Panics if there is no such set.
    pub fn uvs(&self, set: usize) -> impl Iterator<Item = Vec2> {
        assert!(set < self.layout.uv_sets, "there are {} sets of UVs", self.layout.uv_sets);
        let at = self.layout.uv(set);
        self.rows().map(move |row| Vec2::from_slice(&row[at..]))
    }

    /// The normals, one per vertex; none at all without normals.
    pub fn normals(&self) -> impl Iterator<Item = Vec3> {
        let at = self.layout.normal();
        self.rows().filter(|_| self.layout.normal).map(move |row| Vec3::from_slice(&row[at..]))
    }

    /// The colors, three or four channels per vertex; none at all without colors.
    pub fn colors(&self) -> impl Iterator<Item = &[f32]> {
        let at = self.layout.color();
        self.rows().filter(|_| self.layout.color != 0).map(move |row| &row[at..])
    }

    fn rows(&self) -> impl Iterator<Item = &[f32]> {
        self.attributes.chunks_exact(self.layout.len().max(1))
    }

    /// Inserts columns of values at an offset of each row.
    fn insert<const N: usize>(
        &mut self,
        at: usize,
        values: impl ExactSizeIterator<Item = [f32; N]>,
        what: &str,
    ) -> Result<()> {
        let (count, vertices) = (values.len(), self.positions.len());
        if count != vertices {
            return Err(Error::Invalid { what: format!("{count} {what} for {vertices} vertices") });
        }
        let len = self.layout.len();
        let mut attributes = Vec::with_capacity(vertices * (len + N));
        for (vertex, value) in values.enumerate() {
            let row = &self.attributes[vertex * len..][..len];
            attributes.extend_from_slice(&row[..at]);
            attributes.extend_from_slice(&value);
            attributes.extend_from_slice(&row[at..]);
        }
        self.attributes = attributes;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_lie_in_the_order_of_the_layout_however_they_are_given() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let (uvs, normals, colors) = ([[0.5f32, 0.25]; 3], [Vec3::Z; 3], [[0.1f32, 0.2, 0.3]; 3]);
        let new = || Vertices::new(&positions, &[0, 1, 2]).unwrap();
        let ordered = new().with_uvs(&uvs).and_then(|v| v.with_normals(&normals));
        let ordered = ordered.and_then(|v| v.with_colors(&colors)).unwrap();
        let shuffled = new().with_colors(&colors).and_then(|v| v.with_normals(&normals));
        let shuffled = shuffled.and_then(|v| v.with_uvs(&uvs)).unwrap();
        assert_eq!(ordered, shuffled);
        assert_eq!(ordered.attributes[..8], [0.5, 0.25, 0.0, 0.0, 1.0, 0.1, 0.2, 0.3]);
        assert_eq!(ordered.normals().collect::<Vec<_>>(), normals);
        assert_eq!(ordered.colors().collect::<Vec<_>>(), colors);
        assert_eq!((new().normals().count(), new().colors().count()), (0, 0));
    }

    #[test]
    fn arrays_that_do_not_fit_are_refused_with_their_counts() {
        let positions = [Vec3::ZERO; 3];
        let refused = Vertices::new(&positions, &[0, 1]).unwrap_err().to_string();
        assert!(refused.contains("2 indices"), "{refused}");
        let one = || Vertices::new(&positions, &[0, 1, 2]).unwrap();
        let refused = one().with_uvs(&[Vec2::ZERO; 2]).unwrap_err().to_string();
        assert!(refused.contains("2 UVs for 3 vertices"), "{refused}");
        let twice = one().with_normals(&positions).and_then(|v| v.with_normals(&positions));
        assert!(twice.is_err());
    }
}
