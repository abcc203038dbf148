//! A progressive file as fine as eyes ask for.

use std::path::Path;

use glam::{DMat4, Vec3};
use seamwise_attr::{
    Camera, Goal, Mesh, PointId, ProgressiveMesh, Refined, SelectiveMesh, TriangleId, WedgeId,
    refine_together,
};

use super::decode::{Fineness, read_observed};
use super::document::with_parts;
use super::extract::{Container, told};
use super::format::EXTENSION;
use super::header::Header;
use super::parts::parts;
use super::recorded::Recorder;
use super::surface::Surface;
use crate::document::asset::Asset;
use crate::document::nodes::mesh_worlds;
use crate::error::{Error, Result};
use crate::export::glb::container;
use crate::import::options::ReadOptions;
use crate::import::read_bytes_with;

/// A scene that is refined for one picture after the other.
#[derive(Debug)]
pub struct RefinedScene {
    header: Header,
    plain: Asset,
    surfaces: Vec<Surface>,
    meshes: Vec<SelectiveMesh>,
    /// Per surface: where it is shown.
    worlds: Vec<Vec<DMat4>>,
    /// The reason why it is not as fine as the source, if it is not.
    pub missed: Option<&'static str>,
}

impl RefinedScene {
    /// Reads a progressive file, and looks at all of its splits.
    ///
    /// # Errors
    /// As [`extract`](super::extract::extract).
    pub fn read(bytes: &[u8], options: ReadOptions) -> Result<Self> {
        let Container { header, asset, blocks } = Container::read(bytes)?;
        let most = usize::try_from(options.memory_limit.bytes()).unwrap_or(usize::MAX) / 8;
        let at = || format!("/extensions/{EXTENSION}");
        let mut recorder = Recorder::new(header.surfaces.len());
        let read = read_observed(&header, blocks, Fineness::Source, most, &mut recorder)
            .map_err(|damage| Error::invalid(at(), told(damage)))?;
        let plain = read_bytes_with(&container(&asset)?, Path::new(""), options)?;
        let mut meshes = Vec::new();
        for (surface, splits) in read.surfaces.iter().zip(&recorder.splits) {
            let mesh = ProgressiveMesh::from_splits(mesh_of(surface), splits)
                .map_err(|error| Error::invalid(at(), error.to_string()))?;
            meshes.push(SelectiveMesh::new(mesh));
        }
        let worlds = mesh_worlds(&plain)?;
        let shown = |own: &super::header::SurfaceHeader| {
            let mesh = own.parts.first().map(|part| part.mesh);
            mesh.and_then(|mesh| worlds.get(&mesh)).cloned().unwrap_or_default()
        };
        let worlds = header.surfaces.iter().map(shown).collect();
        let missed = read.damage.map(told);
        let surfaces = read.surfaces;
        Ok(Self { header, plain, surfaces, meshes, worlds, missed })
    }

    /// Triangles of the source.
    pub fn source_triangles(&self) -> usize {
        self.meshes.iter().map(SelectiveMesh::source_triangles).sum()
    }

    /// Triangles now, in meshes each once.
    pub fn triangles(&self) -> usize {
        self.meshes.iter().map(SelectiveMesh::triangles).sum()
    }

    /// Refines for a camera in the world. What the goal counts, it counts for all surfaces together.
    pub fn refine_for(&mut self, camera: &Camera, goal: Goal) -> Refined {
        let in_spaces = |worlds: &Vec<DMat4>| {
            worlds.iter().filter_map(|world| camera.in_space(world)).collect()
        };
        let cameras: Vec<Vec<Camera>> = self.worlds.iter().map(in_spaces).collect();
        refine_together(&mut self.meshes, &cameras, goal)
    }

    /// The scene as it is now, as a document.
    ///
    /// # Errors
    /// [`Error::Invalid`] if a primitive that it names is not there.
    pub fn asset(&self) -> Result<Asset> {
        let made = self.surfaces.iter().zip(&self.meshes).zip(&self.header.surfaces);
        let made: Vec<_> = made
            .map(|((surface, mesh), header)| parts(&shown(surface, mesh), header, &[]))
            .collect();
        with_parts(&self.plain, &self.header, &made, &[])
    }
}

/// A camera in the world, as `seamwise refine` asks for it: degrees, and pixels across and upright.
///
/// # Errors
/// [`Error::Options`] if nothing can be seen so.
pub fn camera(eye: Vec3, target: Vec3, degrees: f32, size: [u32; 2]) -> Result<Camera> {
    Camera::new(eye, target, degrees.to_radians(), size).map_err(|error| {
        let seamwise_attr::Error::Options { what } = error else {
            return Error::internal(error);
        };
        Error::Options { what }
    })
}

fn mesh_of(surface: &Surface) -> Mesh {
    let group = |triangle: &[u32; 3]| surface.wedge_groups[triangle[0] as usize];
    Mesh {
        positions: surface.positions.clone(),
        wedge_points: surface.wedge_points.iter().map(|&own| PointId(own)).collect(),
        layout: surface.layout,
        attributes: surface.rows.clone(),
        triangles: surface.triangles.iter().map(|own| own.map(WedgeId)).collect(),
        groups: surface.triangles.iter().map(group).collect(),
    }
}

/// A surface with the values and the triangles that are there.
fn shown(surface: &Surface, mesh: &SelectiveMesh) -> Surface {
    let (mut own, state) = (surface.clone(), mesh.state());
    own.positions.clone_from(&state.positions);
    own.wedge_points = state.wedge_points.iter().map(|point| point.0).collect();
    own.rows.clone_from(&state.attributes);
    let live = (0..state.triangles.len()).filter(|&at| mesh.is_live(TriangleId::new(at)));
    own.triangles = live.map(|at| state.triangles[at].map(|wedge| wedge.0)).collect();
    own
}
