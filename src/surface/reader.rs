//! Reads the vertices of primitives for one surface.

use glam::Vec3;
use rustc_hash::FxHashMap;
use seamwise_attr::{Layout, Vertices};

use super::frame::Similarity;
use super::handedness::is_flipped;
use super::part::{Local, Member, Part};
use super::precision::{Grid, Grids, Moved};
use crate::document::accessor::{self, Elements};
use crate::document::asset::Asset;
use crate::document::primitive::{Attributes, Primitive, read_checked};
use crate::error::{Error, Result};

/// Most UV sets that the metric takes; further ones are carried along.
const MOST_UV_SETS: usize = 4;

/// The union of what the primitives' vertices carry for the metric.
pub(super) fn layout(asset: &Asset, primitives: &[Primitive]) -> Result<Layout> {
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
pub(super) struct Reader<'a> {
    asset: &'a Asset,
    pub(super) vertices: Vertices,
    classes: Classes,
    grids: Grids,
    pub(super) parts: Vec<Part>,
}

impl<'a> Reader<'a> {
    pub(super) fn new(asset: &'a Asset, layout: Layout) -> Self {
        let vertices = Vertices { layout, ..Vertices::default() };
        let (classes, grids) = (Classes::default(), Grids::default());
        Self { asset, vertices, classes, grids, parts: Vec::new() }
    }

    /// Adds a primitive, moved onto the surface if its mesh is in another space.
    pub(super) fn add(&mut self, primitive: Primitive, member: Option<Member>) -> Result<()> {
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
        self.add_classes(&part);
        self.vertices.positions.extend(positions);
        let group = self.parts.len() as u32;
        self.vertices.groups.extend(triangles.iter().map(|_| group));
        self.vertices.triangles.extend(triangles.iter().map(|t| t.map(|v| v + part.first)));
        self.parts.push(part);
        Ok(())
    }

    /// Appends the classes of a part's vertices: one of all if they carry nothing.
    fn add_classes(&mut self, part: &Part) {
        let Vertices { motion, rest, .. } = &mut self.vertices;
        if part.carried.is_empty() && part.targets.is_empty() {
            let class = self.classes.class(Vec::new());
            motion.resize(motion.len() + part.vertices, class);
            rest.resize(rest.len() + part.vertices, class);
            return;
        }
        for vertex in 0..part.vertices {
            motion.push(self.classes.class(part.motion(vertex)));
            rest.push(self.classes.class(part.rest(vertex)));
        }
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
            carried: self.carried(&primitive, count)?,
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

    /// The attributes that neither the metric nor the writer makes.
    fn carried(&self, primitive: &Primitive, count: usize) -> Result<Vec<(String, Elements)>> {
        let is_carried = |name: &str| !is_made(name, self.vertices.layout);
        let all = primitive.attributes.iter();
        let kept: Attributes = all.filter(|(name, _)| is_carried(name)).cloned().collect();
        read_all(self.asset, &kept, &format!("{}/attributes", primitive.at), count)
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
