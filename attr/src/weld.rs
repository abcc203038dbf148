//! Vertices to points and wedges.
//!
//! A file splits a vertex wherever an attribute jumps, so its index buffer tears the surface along
//! every seam. Welding mends it: vertices at bitwise equal positions (−0 = 0) are one point, and
//! among those the ones with bitwise equal attributes in the same group are one wedge. Layers that lie on
//! each other back to back are taken apart again: see `layers.rs`. Borders that roundings alone keep apart
//! are made one: see `stitch.rs`.

use glam::Vec3;

use crate::error::{Error, Result};
use crate::id::{PointId, WedgeId};
use crate::layers::separate_layers;
use crate::mesh::Mesh;
use crate::stitch::{OwnPosition, stitch};
use crate::table::{Table, hash_words};
use crate::vertices::Vertices;

/// The result of [`weld`].
#[derive(Clone, Debug, Default)]
pub struct Welded {
    /// The mesh.
    pub mesh: Mesh,
    /// One per wedge: a vertex it was made from.
    pub wedge_vertices: Vec<u32>,
    /// Triangles left out because two of their corners are one point: they have no area and
    /// would tie the surface into a knot.
    pub degenerate: usize,
    /// Wedges whose vertices lie a rounding, or a step of their grid, beside their point, in order.
    pub own_positions: Vec<OwnPosition>,
}

impl Welded {
    /// The position of the vertices that a wedge was made from.
    pub fn vertex_position(&self, wedge: WedgeId) -> Vec3 {
        let own = self.own_positions.binary_search_by_key(&wedge, |own| own.wedge);
        own.map_or_else(
            |_| self.mesh.positions[self.mesh.wedge_points[wedge]],
            |at| self.own_positions[at].position,
        )
    }
}

/// Welds vertices to points and wedges; the front and the back of a doubled sheet have points of their
/// own. Vertices that no triangle uses are left out. Points and wedges
/// are numbered in the order in which the triangles first name them.
///
/// ```
/// use seamwise_attr::{Vertices, weld};
///
/// // Two triangles that a file keeps apart along the edge they share, since their UVs jump there.
/// let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
/// let corners = [0, 1, 2, 2, 1, 3].map(|at| positions[at]);
/// let uvs = [[0.0, 0.0], [0.4, 0.0], [0.0, 0.4], [0.6, 1.0], [1.0, 0.6], [1.0, 1.0]];
/// let welded = weld(&Vertices::new(&corners, &[0, 1, 2, 3, 4, 5])?.with_uvs(&uvs)?)?;
/// assert_eq!(welded.mesh.positions.len(), 4, "points");
/// assert_eq!(welded.mesh.wedge_points.len(), 6, "wedges: the shared edge is a seam");
/// # Ok::<(), seamwise_attr::Error>(())
/// ```
///
/// # Errors
/// [`Error::Invalid`] if an index is out of range or a used position or attribute is not finite.
pub fn weld(vertices: &Vertices) -> Result<Welded> {
    check(vertices)?;
    let mut welder = Welder::new(vertices);
    for (at, triangle) in vertices.triangles.iter().enumerate() {
        welder.add(*triangle, vertices.groups.get(at).copied().unwrap_or(0));
    }
    let mut welded = welder.welded;
    welded.mesh.validate()?;
    separate_layers(&mut welded.mesh, &mut welded.wedge_vertices);
    stitch_borders(vertices, &mut welded);
    Ok(welded)
}

fn stitch_borders(vertices: &Vertices, welded: &mut Welded) {
    let mut motion = Vec::new();
    if !vertices.motion.is_empty() {
        motion.resize(welded.mesh.positions.len(), 0);
        for (&point, &vertex) in welded.mesh.wedge_points.iter().zip(&welded.wedge_vertices) {
            motion[point] = vertices.motion[vertex as usize];
        }
    }
    let motion = |point: PointId| motion.get(point.index()).copied().unwrap_or(0);
    welded.own_positions = stitch(&mut welded.mesh, &vertices.precision, motion);
}

fn check(vertices: &Vertices) -> Result<()> {
    let count = vertices.positions.len();
    let invalid = |what: String| Err(Error::Invalid { what });
    if vertices.attributes.len() != count * vertices.layout.len() {
        return invalid("attribute rows and vertices differ in number".into());
    }
    for classes in [&vertices.motion, &vertices.rest] {
        if !classes.is_empty() && classes.len() != count {
            return invalid("vertex classes and vertices differ in number".into());
        }
    }
    if !vertices.groups.is_empty() && vertices.groups.len() != vertices.triangles.len() {
        return invalid("groups and triangles differ in number".into());
    }
    let past_end = |triangle: &[u32; 3]| triangle.iter().any(|&v| v as usize >= count);
    if let Some(triangle) = vertices.triangles.iter().position(past_end) {
        return invalid(format!("triangle {triangle} names a vertex past the end ({count})"));
    }
    Ok(())
}

/// No wedge yet.
const NONE: (u32, WedgeId) = (0, WedgeId(u32::MAX));

struct Welder<'a> {
    vertices: &'a Vertices,
    points: Table,
    wedges: Table,
    /// Per vertex: the group that it became a wedge in last, and that wedge.
    known: Vec<(u32, WedgeId)>,
    /// One per point: the class of its motion.
    motions: Vec<u32>,
    /// One per wedge: its group.
    groups: Vec<u32>,
    welded: Welded,
}

impl<'a> Welder<'a> {
    fn new(vertices: &'a Vertices) -> Self {
        let mut welded = Welded::default();
        welded.mesh.layout = vertices.layout;
        welded.mesh.triangles.reserve_exact(vertices.triangles.len());
        welded.mesh.groups.reserve_exact(vertices.triangles.len());
        Self {
            vertices,
            points: Table::new(),
            wedges: Table::new(),
            known: vec![NONE; vertices.positions.len()],
            motions: Vec::new(),
            groups: Vec::new(),
            welded,
        }
    }

    fn add(&mut self, triangle: [u32; 3], group: u32) {
        let wedges = triangle.map(|vertex| self.wedge(vertex, group));
        let mesh = &mut self.welded.mesh;
        let [a, b, c] = wedges.map(|wedge| mesh.wedge_points[wedge]);
        if a == b || b == c || c == a {
            self.welded.degenerate += 1;
        } else {
            mesh.triangles.push(wedges);
            mesh.groups.push(group);
        }
    }

    /// The wedge of a vertex: one of its point, its group, its class of what the metric does not see, and the
    /// bits of its row.
    fn wedge(&mut self, vertex: u32, group: u32) -> WedgeId {
        let known = self.known[vertex as usize];
        if known != NONE && known.0 == group {
            return known.1;
        }
        let point = self.point(vertex);
        let Self { vertices, welded, groups, .. } = self;
        let len = vertices.layout.len();
        let row = |vertex: u32| &vertices.attributes[vertex as usize * len..][..len];
        let rest = |vertex: u32| vertices.rest.get(vertex as usize).copied().unwrap_or(0);
        let (own, own_rest) = (row(vertex), rest(vertex));
        let words = [point.0, group, own_rest].into_iter().chain(own.iter().map(|&x| bits(x)));
        let is_same = |wedge: u32| {
            let other = welded.wedge_vertices[wedge as usize];
            welded.mesh.wedge_points[WedgeId(wedge)] == point
                && groups[wedge as usize] == group
                && rest(other) == own_rest
                && row(other).iter().map(|&x| bits(x)).eq(own.iter().map(|&x| bits(x)))
        };
        let next = welded.wedge_vertices.len() as u32;
        let wedge = WedgeId(self.wedges.find_or(hash_words(words), is_same, || next));
        if wedge.0 == next {
            welded.wedge_vertices.push(vertex);
            welded.mesh.wedge_points.push(point);
            welded.mesh.attributes.extend_from_slice(own);
            groups.push(group);
        }
        self.known[vertex as usize] = (group, wedge);
        wedge
    }

    fn point(&mut self, vertex: u32) -> PointId {
        let position = self.vertices.positions[vertex as usize];
        let motion = self.vertices.motion.get(vertex as usize).copied().unwrap_or(0);
        let key = position.to_array().map(bits);
        let (positions, motions) = (&mut self.welded.mesh.positions, &mut self.motions);
        let next = positions.len() as u32;
        let is_same = |point: u32| {
            positions[PointId(point)].to_array().map(bits) == key
                && motions[point as usize] == motion
        };
        let hash = hash_words(key.into_iter().chain([motion]));
        let point = self.points.find_or(hash, is_same, || next);
        if point == next {
            positions.push(position);
            motions.push(motion);
        }
        PointId(point)
    }
}

/// The bits of a float, with −0 as 0.
fn bits(x: f32) -> u32 {
    if x == 0.0 { 0 } else { x.to_bits() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Layout;

    /// Two triangles over the square 0…1, with a vertex each per corner:
    ///
    /// ```text
    /// 3,5─────4
    ///  │ ╲    │
    ///  │   ╲  │
    ///  0─────1,2
    /// ```
    fn torn_square(uvs: [[f32; 2]; 6]) -> Vertices {
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        Vertices {
            positions: vec![
                at(0.0, 0.0),
                at(1.0, 0.0),
                at(1.0, -0.0),
                at(0.0, 1.0),
                at(1.0, 1.0),
                at(-0.0, 1.0),
            ],
            layout: Layout { uv_sets: 1, normal: false, color: 0 },
            attributes: uvs.concat(),
            triangles: vec![[0, 1, 3], [2, 4, 5]],
            groups: vec![0, 0],
            ..Vertices::default()
        }
    }

    const SMOOTH: [[f32; 2]; 6] =
        [[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.0, 1.0]];

    #[test]
    fn equal_vertices_become_one_wedge_and_minus_zero_is_zero() {
        let welded = weld(&torn_square(SMOOTH)).unwrap();
        assert_eq!((welded.mesh.positions.len(), welded.mesh.wedge_points.len()), (4, 4));
    }

    #[test]
    fn a_uv_jump_keeps_two_wedges_at_one_point() {
        let mut uvs = SMOOTH;
        uvs[2] = [5.0, 0.0];
        let welded = weld(&torn_square(uvs)).unwrap();
        assert_eq!((welded.mesh.positions.len(), welded.mesh.wedge_points.len()), (4, 5));
    }

    #[test]
    fn a_material_boundary_is_a_seam_on_one_surface() {
        let mut vertices = torn_square(SMOOTH);
        vertices.groups[1] = 7;
        let welded = weld(&vertices).unwrap();
        assert_eq!((welded.mesh.positions.len(), welded.mesh.wedge_points.len()), (4, 6));
    }

    #[test]
    fn lips_that_open_are_not_welded_shut() {
        let mut vertices = torn_square(SMOOTH);
        vertices.motion = vec![0, 0, 1, 0, 1, 1];
        assert_eq!(weld(&vertices).unwrap().mesh.positions.len(), 6);
    }

    #[test]
    fn degenerate_triangles_are_left_out_and_counted() {
        let mut vertices = torn_square(SMOOTH);
        vertices.triangles.push([1, 2, 4]);
        vertices.groups.push(0);
        let welded = weld(&vertices).unwrap();
        assert_eq!((welded.degenerate, welded.mesh.triangles.len()), (1, 2));
    }

    #[test]
    fn an_index_past_the_end_is_an_error() {
        let mut vertices = torn_square(SMOOTH);
        vertices.triangles[1][0] = 6;
        assert!(weld(&vertices).unwrap_err().to_string().contains("triangle 1"));
    }
}
