//! Meshes of a document as one surface.
//!
//! All triangle primitives of a mesh, or of several that border on one another, are one surface: a
//! material boundary is a seam in it, not a crack. UVs, normals and `COLOR_0` go through the metric.
//! Tangents are computed anew. Joints, weights and morph targets are blended where a level lies on
//! the source; whatever else a vertex carries (further colors, an application's own) is taken over
//! from the source vertex that a wedge stands for.

use glam::Vec3;
use gltf::json::accessor::ComponentType;
use rustc_hash::FxHashMap;
use seamwise_attr::{Layout, Level, Precision, Vertices, WedgeId, Welded, weld};

use super::frame::Similarity;
use super::handedness::is_flipped;
use super::precision::{Grid, Grids, Moved};
use crate::document::accessor::{self, Elements};
use crate::document::asset::Asset;
use crate::document::primitive::{Attributes, Primitive, read_checked};
use crate::error::{Error, Result};
use crate::limit::{Budget, MemoryLimit};

/// Most UV sets that the metric takes; further ones are carried along.
const MOST_UV_SETS: usize = 4;

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
    positions: Vec<Vec3>,
    /// None at all if the part has no normals.
    normals: Vec<Vec3>,
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
            let components = accessor::read(asset, index, &at)?.components;
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
    grids: Grids,
    parts: Vec<Part>,
}

impl<'a> Reader<'a> {
    fn new(asset: &'a Asset, layout: Layout) -> Self {
        let vertices = Vertices { layout, ..Vertices::default() };
        let (classes, grids) = (Classes::default(), Grids::default());
        Self { asset, vertices, classes, grids, parts: Vec::new() }
    }

    fn add(&mut self, primitive: Primitive, member: Option<Member>) -> Result<()> {
        let mut positions = primitive.positions(self.asset)?;
        let triangles = primitive.triangles(self.asset, positions.len())?;
        let stored = primitive.elements(self.asset, "POSITION", positions.len())?;
        let grid = stored.and_then(|stored| Grid::of(&stored, &positions));
        let frame = member.and_then(|member| Some((member.frame?, member.slack)));
        let moved = frame.map(|(frame, slack)| Moved { scale: frame.scale(), slack });
        self.vertices.precision.push(self.grids.precision(grid, moved));
        let mut part = self.part(primitive, &triangles, positions.len())?;
        self.add_rows(&part)?;
        if let Some((frame, _)) = frame {
            part.local = Some(self.place(&frame, &mut positions));
        }
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

    /// Brings the positions of a part, and the normals of the rows that were added last, onto the surface.
    fn place(&mut self, frame: &Similarity, positions: &mut [Vec3]) -> Local {
        let mut local = Local { frame: *frame, positions: positions.to_vec(), normals: Vec::new() };
        positions.iter_mut().for_each(|position| *position = frame.point(*position));
        let layout = self.vertices.layout;
        if layout.normal {
            let len = layout.len();
            let start = self.vertices.attributes.len() - positions.len() * len;
            for row in self.vertices.attributes[start..].chunks_exact_mut(len) {
                let normal = &mut row[layout.normal()..layout.normal() + 3];
                local.normals.push(Vec3::from_slice(normal));
                normal.copy_from_slice(&frame.direction(Vec3::from_slice(normal)).to_array());
            }
        }
        local
    }

    fn part(&self, primitive: Primitive, triangles: &[[u32; 3]], count: usize) -> Result<Part> {
        let first = u32::try_from(self.vertices.positions.len())
            .ok()
            .filter(|first| first.checked_add(count as u32).is_some())
            .ok_or_else(|| Error::Unsupported { what: "a mesh of 2^32 vertices".into() })?;
        let normal_uv = normal_uv(self.asset, &primitive)?;
        let is_flipped = is_flipped(self.asset, &primitive, triangles, (count, normal_uv));
        Ok(Part {
            vertices: count,
            first,
            carried: carried(self.asset, &primitive, self.vertices.layout, count)?,
            targets: targets(self.asset, &primitive, count)?,
            color: primitive
                .elements(self.asset, "COLOR_0", count)?
                .map(|color| (color.components, color.component)),
            normal_uv,
            tangent_sign: if is_flipped { -1.0 } else { 1.0 },
            local: None,
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
pub(crate) fn is_motion(name: &str) -> bool {
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
    pub(crate) fn motion(&self, vertex: usize) -> Vec<u8> {
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
