//! Vertices to points and wedges.
//!
//! A file splits a vertex wherever an attribute jumps, so its index buffer tears the surface along
//! every seam. Welding mends it: vertices at bitwise equal positions (−0 = 0) are one point, and
//! among those the ones with bitwise equal attributes in the same group are one wedge. Layers that lie on
//! each other back to back are taken apart again: see `layers.rs`. Borders that roundings alone keep apart
//! are made one: see `stitch.rs`.

use std::hash::Hasher;

use glam::Vec3;
use hashbrown::HashTable;
use hashbrown::hash_table::Entry;
use rustc_hash::FxHasher;

use crate::error::{Error, Result};
use crate::id::{PointId, WedgeId};
use crate::layers::separate_layers;
use crate::mesh::Mesh;
use crate::stitch::{OwnPosition, stitch};
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
    points: HashTable<PointId>,
    wedges: HashTable<WedgeId>,
    /// Per vertex: the group that it became a wedge in last, and that wedge.
    known: Vec<(u32, WedgeId)>,
    /// One per point: the vertex that it was made of.
    point_vertices: Vec<u32>,
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
            points: HashTable::with_capacity(vertices.positions.len()),
            wedges: HashTable::with_capacity(vertices.positions.len()),
            known: vec![NONE; vertices.positions.len()],
            point_vertices: Vec::new(),
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

    /// The wedge of a vertex: one of its point, its group, and what else tells wedges apart.
    fn wedge(&mut self, vertex: u32, group: u32) -> WedgeId {
        let known = self.known[vertex as usize];
        if known != NONE && known.0 == group {
            return known.1;
        }
        let point = self.point(vertex);
        let Self { vertices, wedges, groups, welded, .. } = self;
        let key = |point: PointId, group: u32, vertex: u32| {
            [point.0, group].into_iter().chain(wedge_words(vertices, vertex))
        };
        let own = || key(point, group, vertex);
        let key_of = |&wedge: &WedgeId| {
            let at = wedge.index();
            key(welded.mesh.wedge_points[wedge], groups[at], welded.wedge_vertices[at])
        };
        let is_same = |wedge: &WedgeId| key_of(wedge).eq(own());
        let wedge = match wedges.entry(hash(own()), is_same, |wedge| hash(key_of(wedge))) {
            Entry::Occupied(known) => *known.get(),
            Entry::Vacant(free) => {
                let wedge = *free.insert(WedgeId::new(welded.wedge_vertices.len())).get();
                welded.wedge_vertices.push(vertex);
                welded.mesh.wedge_points.push(point);
                welded.mesh.attributes.extend_from_slice(attributes(vertices, vertex));
                groups.push(group);
                wedge
            }
        };
        self.known[vertex as usize] = (group, wedge);
        wedge
    }

    fn point(&mut self, vertex: u32) -> PointId {
        let Self { vertices, points, point_vertices, welded, .. } = self;
        let key_of = |point: &PointId| point_words(vertices, point_vertices[point.index()]);
        let own = || point_words(vertices, vertex);
        let is_same = |point: &PointId| key_of(point).eq(own());
        match points.entry(hash(own()), is_same, |point| hash(key_of(point))) {
            Entry::Occupied(known) => *known.get(),
            Entry::Vacant(free) => {
                let point = *free.insert(PointId::new(point_vertices.len())).get();
                point_vertices.push(vertex);
                welded.mesh.positions.push(vertices.positions[vertex as usize]);
                point
            }
        }
    }
}

/// What tells points apart: position, and the class of motion.
fn point_words(vertices: &Vertices, vertex: u32) -> impl Iterator<Item = u32> {
    let motion = vertices.motion.get(vertex as usize).copied().unwrap_or(0);
    vertices.positions[vertex as usize].to_array().map(bits).into_iter().chain([motion])
}

/// What tells wedges of a point apart: the class of what the metric does not see, and the row of attributes.
fn wedge_words(vertices: &Vertices, vertex: u32) -> impl Iterator<Item = u32> {
    let rest = vertices.rest.get(vertex as usize).copied().unwrap_or(0);
    [rest].into_iter().chain(attributes(vertices, vertex).iter().copied().map(bits))
}

fn attributes(vertices: &Vertices, vertex: u32) -> &[f32] {
    let len = vertices.layout.len();
    &vertices.attributes[vertex as usize * len..][..len]
}

fn hash(words: impl Iterator<Item = u32>) -> u64 {
    let mut hasher = FxHasher::default();
    words.for_each(|word| hasher.write_u32(word));
    hasher.finish()
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
