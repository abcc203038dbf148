//! The tangents by which a mesh's normal maps are read.

use glam::{Vec2, Vec3, Vec4};
use rustc_hash::FxHashMap;
use seamwise_attr::{Mesh, TangentInput, WedgeId, compute_tangents};

use super::geometry::Geometry;
use crate::document::asset::Asset;
use crate::error::{Error, Result};

/// The triangles of one group over the wedges they use.
pub(crate) struct Corners {
    pub(crate) wedges: Vec<WedgeId>,
    /// Indices into `wedges`.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// One per triangle: its number in the mesh.
    numbers: Vec<usize>,
}

impl Corners {
    pub(crate) fn of_group(mesh: &Mesh, group: u32) -> Self {
        let mut corners = Self { wedges: Vec::new(), triangles: Vec::new(), numbers: Vec::new() };
        let mut local: FxHashMap<WedgeId, u32> = FxHashMap::default();
        for number in (0..mesh.triangles.len()).filter(|&t| mesh.groups[t] == group) {
            corners.numbers.push(number);
            corners.triangles.push(mesh.triangles[number].map(|wedge| {
                *local.entry(wedge).or_insert_with(|| {
                    corners.wedges.push(wedge);
                    corners.wedges.len() as u32 - 1
                })
            }));
        }
        corners
    }

    /// MikkTSpace at each corner of the triangles, in the space of a UV set.
    pub(crate) fn tangents(&self, mesh: &Mesh, uv_set: usize) -> Result<Vec<[Vec4; 3]>> {
        let layout = mesh.layout;
        let position = |&wedge: &WedgeId| mesh.positions[mesh.wedge_points[wedge]];
        let normal = |&wedge: &WedgeId| match layout.normal {
            true => Vec3::from_slice(&mesh.row(wedge)[layout.normal()..layout.normal() + 3]),
            false => Vec3::Z,
        };
        let uv = |&wedge: &WedgeId| match uv_set < layout.uv_sets {
            true => mesh.uv(wedge, uv_set),
            false => Vec2::ZERO,
        };
        compute_tangents(&TangentInput {
            positions: &self.wedges.iter().map(position).collect::<Vec<_>>(),
            normals: &self.wedges.iter().map(normal).collect::<Vec<_>>(),
            uvs: &self.wedges.iter().map(uv).collect::<Vec<_>>(),
            triangles: &self.triangles,
        })
        .map_err(Error::internal)
    }
}

/// One triple per triangle of a mesh, by MikkTSpace in the UV set of its group; zero where `sets`, one
/// per group, has none.
pub(crate) fn mesh_tangents(mesh: &Mesh, sets: &[Option<usize>]) -> Result<Vec<[Vec4; 3]>> {
    let mut tangents = vec![[Vec4::ZERO; 3]; mesh.triangles.len()];
    for (group, set) in (0..).zip(sets) {
        let Some(set) = *set else { continue };
        let corners = Corners::of_group(mesh, group);
        for (&number, own) in corners.numbers.iter().zip(corners.tangents(mesh, set)?) {
            tangents[number] = own;
        }
    }
    Ok(tangents)
}

/// One triple per triangle of the surface of a source: the file's own tangents where it has them.
///
/// A wedge may stand for vertices of two mirrored sides. Of those only one side's tangents are known
/// by its vertex; the other's are by MikkTSpace.
///
/// # Errors
/// [`Error::Invalid`] if the file's are malformed.
pub(crate) fn source_tangents(
    asset: &Asset,
    surface: &Geometry,
    sets: &[Option<usize>],
) -> Result<Vec<[Vec4; 3]>> {
    let mesh = &surface.welded.mesh;
    let mut tangents = mesh_tangents(mesh, sets)?;
    for (group, part) in (0..).zip(&surface.parts) {
        let values = match sets[group as usize] {
            Some(_) => part.primitive.floats(asset, "TANGENT", 4, part.vertices)?,
            None => None,
        };
        let Some(values) = values else { continue };
        let own = mesh.groups.iter().zip(&mesh.triangles).zip(&mut tangents);
        for ((_, wedges), corners) in own.filter(|((own, _), _)| **own == group) {
            for (wedge, tangent) in wedges.iter().zip(corners) {
                tangent.w *= part.tangent_sign;
                let vertex = surface.welded.wedge_vertices[wedge.index()] - part.first;
                let mut stored = Vec4::from_slice(&values[4 * vertex as usize..]);
                if let Some(local) = &part.local {
                    stored = local.frame.direction(stored.truncate()).extend(stored.w);
                }
                if stored.is_finite() && stored.w * tangent.w > 0.0 {
                    *tangent = stored;
                }
            }
        }
    }
    Ok(tangents)
}
