//! A glTF mesh as one surface, and a level of that surface as primitives again.
//!
//! All triangle primitives of a mesh are one surface: a material boundary is a seam in it, not a
//! crack. UVs, normals and `COLOR_0` go through the metric. Tangents are computed anew. Whatever
//! else a vertex carries (joints, weights, morph targets, further colors, an application's own)
//! is taken over from the source vertex that a wedge stands for.

use glam::{Vec2, Vec3, Vec4};
use gltf::json::accessor::ComponentType;
use rustc_hash::FxHashMap;
use seamwise_attr::{
    Layout, Level, Mesh, PointId, TangentInput, Vertices, WedgeId, Welded, compute_tangents, weld,
};

use crate::accessor::Elements;
use crate::asset::Asset;
use crate::error::{Error, Result};
use crate::primitive::{Attributes, Primitive, read_checked};

/// Most UV sets that the metric takes; further ones are carried along.
const MOST_UV_SETS: usize = 4;

/// The surface of one glTF mesh.
#[derive(Clone, Debug)]
pub struct Geometry {
    /// The index of the mesh in the document.
    pub mesh: usize,
    /// Points and wedges; a triangle's group is its part.
    pub welded: Welded,
    /// The triangle primitives, in order.
    pub parts: Vec<Part>,
}

/// A triangle primitive and what its vertices carry.
#[derive(Clone, Debug)]
pub struct Part {
    /// The primitive.
    pub primitive: Primitive,
    /// Number of its vertices.
    pub vertices: usize,
    /// Number of its first vertex among those of all parts.
    first: u32,
    /// What the metric does not see, by attribute name.
    carried: Vec<(String, Elements)>,
    /// The morph targets, by attribute name.
    targets: Vec<Vec<(String, Elements)>>,
    /// Components and type of `COLOR_0` in the file.
    color: Option<(usize, ComponentType)>,
    /// Which UV set the normal map is laid out in.
    normal_uv: usize,
}

impl Geometry {
    /// Reads and welds the triangles of a mesh. `None` if it has none.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the place in the document.
    pub fn read(asset: &Asset, mesh: usize) -> Result<Option<Self>> {
        let mut primitives = Primitive::of_mesh(asset, mesh)?;
        primitives.retain(Primitive::is_surface);
        let mut reader = Reader::new(asset, layout(asset, &primitives)?);
        for primitive in primitives {
            reader.add(primitive)?;
        }
        let Reader { vertices, parts, .. } = reader;
        let at = format!("/meshes/{mesh}");
        let welded = weld(&vertices).map_err(|error| Error::invalid(&at, error.to_string()))?;
        Ok((!welded.mesh.triangles.is_empty()).then_some(Self { mesh, welded, parts }))
    }
}

/// The union of what the primitives' vertices carry for the metric.
fn layout(asset: &Asset, primitives: &[Primitive]) -> Result<Layout> {
    let mut layout = Layout::default();
    for primitive in primitives {
        let has = |name: &str| primitive.accessor(name).is_some();
        let sets = (0..MOST_UV_SETS).take_while(|set| has(&format!("TEXCOORD_{set}"))).count();
        layout.uv_sets = layout.uv_sets.max(sets);
        layout.normal |= has("NORMAL");
        if let Some(index) = primitive.accessor("COLOR_0") {
            let at = format!("{}/attributes/COLOR_0", primitive.at);
            let components = crate::accessor::read(asset, index, &at)?.components;
            if components != 3 && components != 4 {
                return Err(Error::invalid(at, "a color must have three or four components"));
            }
            layout.color = layout.color.max(components);
        }
    }
    Ok(layout)
}

/// Numbers for byte strings, the same for the same bytes.
#[derive(Default)]
struct Classes {
    known: FxHashMap<Vec<u8>, u32>,
}

impl Classes {
    fn class(&mut self, bytes: Vec<u8>) -> u32 {
        let next = self.known.len() as u32;
        *self.known.entry(bytes).or_insert(next)
    }
}

/// Gathers the vertices of all parts.
struct Reader<'a> {
    asset: &'a Asset,
    vertices: Vertices,
    classes: Classes,
    parts: Vec<Part>,
}

impl<'a> Reader<'a> {
    fn new(asset: &'a Asset, layout: Layout) -> Self {
        let vertices = Vertices { layout, ..Vertices::default() };
        Self { asset, vertices, classes: Classes::default(), parts: Vec::new() }
    }

    fn add(&mut self, primitive: Primitive) -> Result<()> {
        let positions = primitive.positions(self.asset)?;
        let triangles = primitive.triangles(self.asset, positions.len())?;
        let part = self.part(primitive, positions.len())?;
        self.add_rows(&part)?;
        for vertex in 0..positions.len() {
            self.vertices.motion.push(self.classes.class(part.motion(vertex)));
            self.vertices.rest.push(self.classes.class(part.rest(vertex)));
        }
        self.vertices.positions.extend(positions);
        let group = self.parts.len() as u32;
        self.vertices.groups.extend(triangles.iter().map(|_| group));
        self.vertices.triangles.extend(triangles.iter().map(|t| t.map(|v| v + part.first)));
        self.parts.push(part);
        Ok(())
    }

    fn part(&self, primitive: Primitive, count: usize) -> Result<Part> {
        let first = u32::try_from(self.vertices.positions.len())
            .ok()
            .filter(|first| first.checked_add(count as u32).is_some())
            .ok_or_else(|| Error::Unsupported { what: "a mesh of 2^32 vertices".into() })?;
        Ok(Part {
            vertices: count,
            first,
            carried: carried(self.asset, &primitive, self.vertices.layout, count)?,
            targets: targets(self.asset, &primitive, count)?,
            color: primitive
                .elements(self.asset, "COLOR_0", count)?
                .map(|color| (color.components, color.component)),
            normal_uv: normal_uv(self.asset, &primitive)?,
            primitive,
        })
    }

    /// Appends the attribute rows of a part's vertices.
    fn add_rows(&mut self, part: &Part) -> Result<()> {
        let (layout, count) = (self.vertices.layout, part.vertices);
        let read = |name: &str, components| {
            let values = part.primitive.floats(self.asset, name, components, count)?;
            Ok::<_, Error>((values.unwrap_or_default(), components))
        };
        let mut columns = Vec::new();
        for set in 0..layout.uv_sets {
            columns.push((layout.uv(set), read(&format!("TEXCOORD_{set}"), 2)?));
        }
        if layout.normal {
            columns.push((layout.normal(), read("NORMAL", 3)?));
        }
        if let Some((components, _)) = part.color {
            columns.push((layout.color(), read("COLOR_0", components)?));
            if components < layout.color {
                columns.push((layout.color() + 3, (vec![1.0; count], 1)));
            }
        }
        let rows = &mut self.vertices.attributes;
        let start = rows.len();
        rows.resize(start + count * layout.len(), 0.0);
        for (offset, (values, components)) in columns {
            let rows = rows[start..].chunks_exact_mut(layout.len());
            for (row, value) in rows.zip(values.chunks_exact(components)) {
                row[offset..offset + components].copy_from_slice(value);
            }
        }
        Ok(())
    }
}

/// Whether the metric or the writer makes an attribute, so that it need not be carried.
fn is_made(name: &str, layout: Layout) -> bool {
    match name.strip_prefix("TEXCOORD_").map(str::parse::<usize>) {
        Some(Ok(set)) => set < layout.uv_sets,
        _ => matches!(name, "POSITION" | "NORMAL" | "TANGENT" | "COLOR_0"),
    }
}

/// Whether an attribute moves the vertex at run time.
fn is_motion(name: &str) -> bool {
    name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_")
}

fn carried(
    asset: &Asset,
    primitive: &Primitive,
    layout: Layout,
    count: usize,
) -> Result<Vec<(String, Elements)>> {
    let kept: Attributes =
        primitive.attributes.iter().filter(|(name, _)| !is_made(name, layout)).cloned().collect();
    read_all(asset, &kept, &format!("{}/attributes", primitive.at), count)
}

fn targets(
    asset: &Asset,
    primitive: &Primitive,
    count: usize,
) -> Result<Vec<Vec<(String, Elements)>>> {
    let read = |(index, target): (usize, &Attributes)| {
        read_all(asset, target, &format!("{}/targets/{index}", primitive.at), count)
    };
    primitive.targets.iter().enumerate().map(read).collect()
}

fn read_all(
    asset: &Asset,
    attributes: &Attributes,
    at: &str,
    count: usize,
) -> Result<Vec<(String, Elements)>> {
    attributes
        .iter()
        .map(|(name, accessor)| {
            let elements = read_checked(asset, *accessor, &format!("{at}/{name}"), count)?;
            Ok((name.clone(), elements))
        })
        .collect()
}

fn normal_uv(asset: &Asset, primitive: &Primitive) -> Result<usize> {
    let Some(material) = primitive.material else {
        return Ok(0);
    };
    let at = format!("/materials/{material}/normalTexture/texCoord");
    Ok(if asset.json.pointer(&at).is_some() { asset.parse(&at)? } else { 0 })
}

impl Part {
    /// The bytes that decide how a vertex moves.
    fn motion(&self, vertex: usize) -> Vec<u8> {
        let skin = self.carried.iter().filter(|(name, _)| is_motion(name));
        let morph = self.targets.iter().flatten().filter(|(name, _)| name == "POSITION");
        concat(skin.chain(morph), vertex)
    }

    /// The bytes of everything else that it carries.
    fn rest(&self, vertex: usize) -> Vec<u8> {
        let own = self.carried.iter().filter(|(name, _)| !is_motion(name));
        let morph = self.targets.iter().flatten().filter(|(name, _)| name != "POSITION");
        concat(own.chain(morph), vertex)
    }
}

fn concat<'a>(attributes: impl Iterator<Item = &'a (String, Elements)>, vertex: usize) -> Vec<u8> {
    attributes.flat_map(|(_, elements)| elements.element(vertex)).copied().collect()
}

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
