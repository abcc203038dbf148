//! Meshes of a document as one surface.
//!
//! All triangle primitives of a mesh, or of several that border on one another, are one surface: a
//! material boundary is a seam in it, not a crack. UVs, normals and `COLOR_0` go through the metric.
//! Tangents are computed anew. Joints, weights and morph targets are blended where a level lies on
//! the source; whatever else a vertex carries (further colors, an application's own) is taken over
//! from the source vertex that a wedge stands for.

use glam::Vec3;
use seamwise_attr::{Level, Precision, WedgeId, Welded, weld};

use super::part::{Member, Part};
use super::reader::{Reader, layout};
use crate::document::accessor;
use crate::document::asset::Asset;
use crate::document::primitive::Primitive;
use crate::error::{Error, Result};
use crate::limit::{Budget, MemoryLimit};

/// The surface of one or more glTF meshes.
#[derive(Clone, Debug)]
pub struct Geometry {
    /// The indices of the meshes in the document.
    pub meshes: Vec<usize>,
    /// Points and wedges; a triangle's group is its part.
    pub welded: Welded,
    /// The triangle primitives, in order.
    pub parts: Vec<Part>,
    /// One per part: how exact its positions are.
    pub(crate) precision: Vec<Precision>,
}

impl Geometry {
    /// Reads and welds the triangles of meshes in one space, one at least. `None` if they have none.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the place in the document.
    pub fn read(asset: &Asset, meshes: &[usize]) -> Result<Option<Self>> {
        let member = |&mesh: &usize| Member { mesh, frame: None, slack: 0.0 };
        Self::read_members(asset, &meshes.iter().map(member).collect::<Vec<_>>())
    }

    /// Reads and welds the triangles of meshes, the first of which the surface has its space from.
    pub(crate) fn read_members(asset: &Asset, members: &[Member]) -> Result<Option<Self>> {
        let meshes: Vec<usize> = members.iter().map(|member| member.mesh).collect();
        let all = meshes.iter().map(|&mesh| Primitive::of_mesh(asset, mesh));
        let mut primitives = all.collect::<Result<Vec<_>>>()?.concat();
        primitives.retain(Primitive::is_surface);
        let mut reader = Reader::new(asset, layout(asset, &primitives)?);
        for primitive in primitives {
            let member = members.iter().find(|member| member.mesh == primitive.mesh);
            reader.add(primitive, member.copied())?;
        }
        let Reader { vertices, parts, .. } = reader;
        let at = || format!("/meshes/{}", meshes[0]);
        let welded = weld(&vertices).map_err(|error| Error::invalid(at(), error.to_string()))?;
        let precision = vertices.precision;
        let own = Self { meshes, welded, parts, precision };
        Ok((!own.welded.mesh.triangles.is_empty()).then_some(own))
    }

    /// The position of a level's wedge in the space of its mesh: that of the vertex it stands for, to the
    /// bit, where it has not moved. With `rounds` that of its point, since two that are about to be rounded may
    /// come a step apart.
    pub(crate) fn position(&self, level: &Level, wedge: WedgeId, rounds: bool) -> Vec3 {
        let (source, own) = (level.wedge_sources[wedge], &level.mesh);
        let position = own.positions[own.wedge_points[wedge]];
        let stays = position == self.welded.mesh.positions[self.welded.mesh.wedge_points[source]];
        let vertex = self.welded.wedge_vertices[source.index()];
        let part = self.part_of(vertex);
        match (&part.local, stays) {
            (Some(local), true) => local.positions[(vertex - part.first) as usize],
            (Some(local), false) => local.frame.point_back(position),
            (None, true) if !rounds => {
                let own = self.welded.vertex_position(source);
                // Of two zeros that of the point, as its other wedges have it.
                if own == position { position } else { own }
            }
            (None, _) => position,
        }
    }

    /// The position of the vertex that a wedge of the source stands for, in the space of its mesh.
    pub(crate) fn source_position(&self, wedge: WedgeId) -> Vec3 {
        let vertex = self.welded.wedge_vertices[wedge.index()];
        let part = self.part_of(vertex);
        let own = part.local.as_ref().map(|own| own.positions[(vertex - part.first) as usize]);
        own.unwrap_or_else(|| self.welded.vertex_position(wedge))
    }

    /// The normal of a level's wedge in the space of its mesh, as it was there if it has not turned.
    pub(crate) fn normal(&self, level: &Level, wedge: WedgeId) -> Vec3 {
        let (source, at) = (level.wedge_sources[wedge], level.mesh.layout.normal());
        let normal = &level.mesh.row(wedge)[at..at + 3];
        // A level whose charts are laid out anew has another set of UVs before its normals.
        let before = self.welded.mesh.layout.normal();
        let stays = *normal == self.welded.mesh.row(source)[before..before + 3];
        let vertex = self.welded.wedge_vertices[source.index()];
        let part = self.part_of(vertex);
        let normal = Vec3::from_slice(normal);
        let Some(local) = &part.local else { return normal };
        let own = local.normals.get((vertex - part.first) as usize).filter(|_| stays);
        own.copied().unwrap_or_else(|| local.frame.direction_back(normal))
    }

    /// The part that a vertex belongs to, by its number among those of all parts.
    pub(crate) fn part_of(&self, vertex: u32) -> &Part {
        &self.parts[self.parts.partition_point(|part| part.first <= vertex) - 1]
    }
}

/// Bytes that a vertex takes besides what it carries, and that a corner of a triangle takes; a
/// primitive takes some even if it has neither.
const BYTES_PER_VERTEX: u64 = 32;
const BYTES_PER_CORNER: u64 = 8;
const BYTES_PER_PRIMITIVE: u64 = 1024;

/// Makes sure that all surfaces of an asset fit the limit before any is read: primitives and morph
/// targets may share accessors, and a few bytes more in the document are then as many vertices once
/// more.
///
/// # Errors
/// [`Error::Invalid`] with the primitive that is too much, or the accessor that is malformed.
pub(crate) fn check_size(asset: &Asset, limit: MemoryLimit) -> Result<()> {
    let mut budget = Budget::of(limit);
    for mesh in 0..asset.count("meshes") {
        for primitive in Primitive::of_mesh(asset, mesh)?.iter().filter(|p| p.is_surface()) {
            let mut bytes = BYTES_PER_PRIMITIVE;
            let carried = primitive.attributes.iter().chain(primitive.targets.iter().flatten());
            for (name, accessor) in carried {
                let [count, own] = accessor::measure(asset, *accessor)?;
                let vertices = if name == "POSITION" { count * BYTES_PER_VERTEX } else { 0 };
                bytes = bytes.saturating_add(own).saturating_add(vertices);
            }
            if let Some(indices) = primitive.indices {
                let [count, _] = accessor::measure(asset, indices)?;
                bytes = bytes.saturating_add(count * BYTES_PER_CORNER);
            }
            let taken = budget.take("all vertices and triangles", bytes);
            taken.map_err(|what| Error::invalid(&primitive.at, what))?;
        }
    }
    Ok(())
}
