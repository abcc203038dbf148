//! A level of a surface as primitives again.
//!
//! UVs, normals and `COLOR_0` come from the level's wedges, tangents are computed anew, and all
//! else is taken over from the source vertices that the wedges stand for.

use glam::{Vec2, Vec3, Vec4};
use gltf::json::accessor::ComponentType;
use rustc_hash::FxHashMap;
use seamwise_attr::{Level, Mesh, PointId, TangentInput, WedgeId, compute_tangents};

use crate::accessor::Elements;
use crate::error::{Error, Result};
use crate::geometry::{Geometry, Part, is_motion};

/// A primitive of a level, ready to be written.
#[derive(Clone, Debug)]
pub struct LevelPart {
    /// Three indices per triangle.
    pub indices: Vec<u32>,
    /// The attributes by name, in the order of the source.
    pub attributes: Vec<(String, Elements)>,
    /// The morph targets.
    pub targets: Vec<Vec<(String, Elements)>>,
}

/// Turns a level back into primitives, one for each part of the source. A part of which no
/// triangle is left is `None`.
///
/// # Errors
/// [`Error::Internal`] if the level does not belong to the geometry.
pub fn level_parts(geometry: &Geometry, level: &Level) -> Result<Vec<Option<LevelPart>>> {
    let sources = Sources::new(geometry, level);
    (0..geometry.parts.len())
        .map(|group| {
            let corners = Corners::of_group(&level.mesh, group as u32);
            if corners.triangles.is_empty() {
                return Ok(None);
            }
            let part = &geometry.parts[group];
            let tangents = match part.primitive.accessor("TANGENT") {
                Some(_) => tangents(&level.mesh, &corners, part.normal_uv)?,
                None => Vec::new(),
            };
            let vertices = split_by_tangent(&corners, &tangents);
            Ok(Some(LevelPart {
                attributes: part
                    .primitive
                    .attributes
                    .iter()
                    .map(|(name, _)| {
                        (name.clone(), attribute(name, part, level, &vertices, &sources))
                    })
                    .collect(),
                targets: part
                    .targets
                    .iter()
                    .map(|target| {
                        target
                            .iter()
                            .map(|(name, elements)| {
                                let motion = name == "POSITION";
                                (name.clone(), gather(elements, part, &vertices, &sources, motion))
                            })
                            .collect()
                    })
                    .collect(),
                indices: vertices.indices,
            }))
        })
        .collect()
}

/// Which source vertices a level's wedges stand for.
struct Sources {
    /// One per wedge of the level.
    rest: Vec<u32>,
    /// One per wedge of the level: a vertex at the point that the wedge's own point stands for,
    /// so that all wedges at a point move alike.
    motion: Vec<u32>,
}

impl Sources {
    fn new(geometry: &Geometry, level: &Level) -> Self {
        let source = &geometry.welded;
        let mut at_point: FxHashMap<(PointId, u32), u32> = FxHashMap::default();
        for (wedges, &group) in source.mesh.triangles.iter().zip(&source.mesh.groups) {
            for &wedge in wedges {
                let vertex = source.wedge_vertices[wedge.index()];
                at_point.entry((source.mesh.wedge_points[wedge], group)).or_insert(vertex);
            }
        }
        let mut groups = vec![0; level.mesh.wedge_points.len()];
        for (wedges, &group) in level.mesh.triangles.iter().zip(&level.mesh.groups) {
            wedges.iter().for_each(|&wedge| groups[wedge] = group);
        }
        let rest: Vec<u32> =
            level.wedge_sources.iter().map(|w| source.wedge_vertices[w.index()]).collect();
        let motion = level
            .mesh
            .wedge_points
            .iter()
            .zip(&groups)
            .zip(&rest)
            .map(|((&point, &group), &own)| {
                let stands_for = level.point_sources[point];
                at_point.get(&(stands_for, group)).copied().unwrap_or(own)
            })
            .collect();
        Self { rest, motion }
    }
}

/// The triangles of one group over the wedges they use.
struct Corners {
    wedges: Vec<WedgeId>,
    /// Indices into `wedges`.
    triangles: Vec<[u32; 3]>,
}

impl Corners {
    fn of_group(mesh: &Mesh, group: u32) -> Self {
        let mut corners = Self { wedges: Vec::new(), triangles: Vec::new() };
        let mut local: FxHashMap<WedgeId, u32> = FxHashMap::default();
        for (wedges, _) in mesh.triangles.iter().zip(&mesh.groups).filter(|&(_, &g)| g == group) {
            corners.triangles.push(wedges.map(|wedge| {
                *local.entry(wedge).or_insert_with(|| {
                    corners.wedges.push(wedge);
                    corners.wedges.len() as u32 - 1
                })
            }));
        }
        corners
    }
}

/// Tangents at the corners of a group, in the space of the UV set of its normal map.
fn tangents(mesh: &Mesh, corners: &Corners, uv_set: usize) -> Result<Vec<[Vec4; 3]>> {
    let layout = mesh.layout;
    let row = |wedge: &WedgeId| mesh.row(*wedge);
    let positions: Vec<Vec3> =
        corners.wedges.iter().map(|&w| mesh.positions[mesh.wedge_points[w]]).collect();
    let normals: Vec<Vec3> = corners
        .wedges
        .iter()
        .map(|w| if layout.normal { Vec3::from_slice(&row(w)[layout.normal()..]) } else { Vec3::Z })
        .collect();
    let uvs: Vec<Vec2> = corners
        .wedges
        .iter()
        .map(|&w| if uv_set < layout.uv_sets { mesh.uv(w, uv_set) } else { Vec2::ZERO })
        .collect();
    compute_tangents(&TangentInput {
        positions: &positions,
        normals: &normals,
        uvs: &uvs,
        triangles: &corners.triangles,
    })
    .map_err(|error| Error::Internal { what: error.to_string() })
}

/// The vertices of a primitive: a wedge, once for each tangent that its corners have.
struct LevelVertices {
    wedges: Vec<WedgeId>,
    tangents: Vec<Vec4>,
    indices: Vec<u32>,
}

fn split_by_tangent(corners: &Corners, tangents: &[[Vec4; 3]]) -> LevelVertices {
    let mut vertices =
        LevelVertices { wedges: Vec::new(), tangents: Vec::new(), indices: Vec::new() };
    let mut known: FxHashMap<(u32, [u32; 4]), u32> = FxHashMap::default();
    for (triangle, local) in corners.triangles.iter().enumerate() {
        for (slot, &wedge) in local.iter().enumerate() {
            let tangent = tangents.get(triangle).map_or(Vec4::ZERO, |t| t[slot]);
            let key = (wedge, tangent.to_array().map(f32::to_bits));
            let index = *known.entry(key).or_insert_with(|| {
                vertices.wedges.push(corners.wedges[wedge as usize]);
                vertices.tangents.push(tangent);
                vertices.wedges.len() as u32 - 1
            });
            vertices.indices.push(index);
        }
    }
    vertices
}

/// One attribute of a level's primitive.
fn attribute(
    name: &str,
    part: &Part,
    level: &Level,
    vertices: &LevelVertices,
    sources: &Sources,
) -> Elements {
    let (mesh, layout) = (&level.mesh, level.mesh.layout);
    let rows = |offset: usize, components: usize| {
        let row = |wedge: &WedgeId| mesh.row(*wedge)[offset..offset + components].to_vec();
        float_elements(components, vertices.wedges.iter().flat_map(row))
    };
    let uv_set = name.strip_prefix("TEXCOORD_").and_then(|set| set.parse::<usize>().ok());
    match (name, uv_set) {
        ("POSITION", _) => {
            let position = |&wedge: &WedgeId| mesh.positions[mesh.wedge_points[wedge]].to_array();
            float_elements(3, vertices.wedges.iter().flat_map(position))
        }
        ("NORMAL", _) => rows(layout.normal(), 3),
        ("TANGENT", _) => float_elements(4, vertices.tangents.iter().flat_map(Vec4::to_array)),
        ("COLOR_0", _) => {
            let (components, component) = part.color.unwrap_or((4, ComponentType::F32));
            quantize(&rows(layout.color(), components), component)
        }
        (_, Some(set)) if set < layout.uv_sets => rows(layout.uv(set), 2),
        _ => {
            let carried = part.carried.iter().find(|(own, _)| own == name);
            let (_, elements) = carried.expect("every attribute is made or carried");
            gather(elements, part, vertices, sources, is_motion(name))
        }
    }
}

/// Takes a carried attribute over from the source vertices.
fn gather(
    elements: &Elements,
    part: &Part,
    vertices: &LevelVertices,
    sources: &Sources,
    motion: bool,
) -> Elements {
    let sources = if motion { &sources.motion } else { &sources.rest };
    let element = |wedge: &WedgeId| elements.element((sources[*wedge] - part.first) as usize);
    Elements { bytes: vertices.wedges.iter().flat_map(element).copied().collect(), ..*elements }
}

fn float_elements(components: usize, values: impl Iterator<Item = f32>) -> Elements {
    Elements {
        bytes: values.flat_map(f32::to_le_bytes).collect(),
        component: ComponentType::F32,
        components,
        normalized: false,
    }
}

/// Brings 0…1 floats into the type that the file had them in.
fn quantize(floats: &Elements, component: ComponentType) -> Elements {
    let values = floats.floats();
    let bytes = match component {
        ComponentType::U8 => values.iter().map(|x| (x * 255.0).round() as u8).collect(),
        ComponentType::U16 => {
            values.iter().flat_map(|x| ((x * 65535.0).round() as u16).to_le_bytes()).collect()
        }
        _ => return floats.clone(),
    };
    Elements { bytes, component, components: floats.components, normalized: true }
}
