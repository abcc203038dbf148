//! Charts for triangles that have none, by a crate: grown within a cone of normals, flattened with little
//! distortion, without overlap.

use std::panic::{AssertUnwindSafe, catch_unwind};

use glam::{Vec2, Vec3};
use uvunwrap::{MeshInput, Options, Packing};

use crate::error::{Error, Result};

/// Triangles in charts.
pub(super) struct Unwrapped {
    /// One per new vertex, in lengths that are alike for all charts.
    pub(super) uvs: Vec<Vec2>,
    /// One per new vertex: the vertex that it came from.
    pub(super) vertices: Vec<u32>,
    /// One per triangle, corner for corner: indices of new vertices.
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Unwraps triangles; no chart spans two groups.
///
/// # Errors
/// [`Error::Internal`] with what the crate says.
pub(super) fn unwrap(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    groups: &[u32],
) -> Result<Unwrapped> {
    let positions: Vec<[f32; 3]> = positions.iter().map(Vec3::to_array).collect();
    let input = MeshInput {
        face_materials: Some(groups),
        ..MeshInput::new(&positions, triangles.as_flattened())
    };
    // Packed once more anyway, at the densities of the source.
    let options = Options { packing: Packing::Fast, ..Options::default() };
    // A fault in it is one of this asset alone.
    let run = || uvunwrap::generate(&[input], &options);
    let atlas = catch_unwind(AssertUnwindSafe(run))
        .map_err(|_| Error::Internal { what: "unwrapping a level: it panicked".into() })?
        .map_err(|error| Error::Internal { what: format!("unwrapping a level: {error}") })?;
    let size = Vec2::new(atlas.width as f32, atlas.height as f32);
    let [mesh] = &atlas.meshes[..] else {
        return Err(Error::Internal { what: "unwrapping a level: it came out in parts".into() });
    };
    Ok(Unwrapped {
        uvs: mesh.vertices.iter().map(|own| Vec2::from(own.uv) * size).collect(),
        vertices: mesh.vertices.iter().map(|own| own.xref).collect(),
        triangles: mesh.indices.as_chunks().0.to_vec(),
    })
}
