//! A primitive on a surface, with what its vertices carry.

use glam::Vec3;
use gltf::json::accessor::ComponentType;

use super::frame::Similarity;
use crate::document::accessor::Elements;
use crate::document::primitive::Primitive;

/// A triangle primitive and the attributes of its vertices.
#[derive(Clone, Debug)]
pub struct Part {
    /// The primitive.
    pub primitive: Primitive,
    /// Number of its vertices.
    pub vertices: usize,
    /// Number of its first vertex among those of all parts.
    pub(crate) first: u32,
    /// The attributes that the metric does not see, by name.
    pub(crate) carried: Vec<(String, Elements)>,
    /// The morph targets, by attribute name.
    pub(crate) targets: Vec<Vec<(String, Elements)>>,
    /// Components and type of `COLOR_0` in the file.
    pub(crate) color: Option<(usize, ComponentType)>,
    /// The UV set of the normal map.
    pub(crate) normal_uv: usize,
    /// The sign of the file's tangents over that of MikkTSpace's: 1, or −1 if they are flipped.
    pub(crate) tangent_sign: f32,
    /// Its vertices in the space of its mesh, where that is not the surface's.
    pub(crate) local: Option<Local>,
}

/// The vertices of a part in the space of its mesh, which is another than that of the surface.
#[derive(Clone, Debug)]
pub(crate) struct Local {
    /// The way from there to the surface.
    pub(crate) frame: Similarity,
    pub(super) positions: Vec<Vec3>,
    /// None at all if the part has no normals.
    pub(super) normals: Vec<Vec3>,
}

/// A mesh and its place on a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    /// The mesh.
    pub(crate) mesh: usize,
    /// The way from its space to that of the surface, if these are two.
    pub(crate) frame: Option<Similarity>,
    /// How far its positions may be off on the surface by that.
    pub(crate) slack: f64,
}

/// Whether an attribute moves the vertex at run time.
pub(crate) fn is_motion(name: &str) -> bool {
    name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_")
}

impl Part {
    /// The bytes that decide how a vertex moves.
    pub(crate) fn motion(&self, vertex: usize) -> Vec<u8> {
        let skin = self.carried.iter().filter(|(name, _)| is_motion(name));
        let morph = self.targets.iter().flatten().filter(|(name, _)| name == "POSITION");
        concat(skin.chain(morph), vertex)
    }

    /// The bytes of everything else that it carries.
    pub(super) fn rest(&self, vertex: usize) -> Vec<u8> {
        let own = self.carried.iter().filter(|(name, _)| !is_motion(name));
        let morph = self.targets.iter().flatten().filter(|(name, _)| name != "POSITION");
        concat(own.chain(morph), vertex)
    }
}

fn concat<'a>(attributes: impl Iterator<Item = &'a (String, Elements)>, vertex: usize) -> Vec<u8> {
    attributes.flat_map(|(_, elements)| elements.element(vertex)).copied().collect()
}
