//! What the source has beyond its surface: corners whose vertex differs from its wedge, in a tangent or by a
//! rounding, and triangles without area. It comes last, and counts where all splits are done.

use std::collections::HashMap;

use super::blocks::{Columns, Damage, Reader, Result};
use super::header::{Header, PartHeader};
use crate::document::accessor::{Elements, Named};
use crate::level::part::LevelPart;

/// Numbers of a part: of vertices, corners and further triangles, and what belongs to these.
const NUMBERS: usize = 0;
/// Bytes of vertices.
const BYTES: usize = 1;
const COLUMNS: usize = 2;

/// What a part has beyond its surface.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct WholePart {
    /// Elements of all attributes, those of morph targets last.
    pub(super) vertices: Vec<Vec<u8>>,
    /// Corners by their places among the indices, and the vertices that they have.
    pub(super) corners: Vec<[u32; 2]>,
    /// Corners of further triangles.
    pub(super) further: Vec<u32>,
}

impl WholePart {
    /// What a part has to be given to be the source. `made` is what it is by itself; `source` are the elements of
    /// the source in the same order, and `corners` the vertex there of each corner of the part; `further` those
    /// of triangles that are not on the surface.
    pub(super) fn of(
        made: &LevelPart,
        source: &[Elements],
        corners: &[u32],
        further: &[u32],
    ) -> Self {
        let own: Vec<&Elements> = all(made).map(|(_, elements)| elements).collect();
        let mut whole = Self::default();
        let mut known: HashMap<Vec<u8>, u32> = HashMap::new();
        let mut add = |vertices: &mut Vec<Vec<u8>>, vertex: u32| {
            let element = |elements: &Elements| elements.element(vertex as usize).to_vec();
            let elements: Vec<Vec<u8>> = source.iter().map(element).collect();
            *known.entry(elements.concat()).or_insert_with(|| {
                vertices.push(elements.concat());
                vertices.len() as u32 - 1
            })
        };
        for (at, (&index, &vertex)) in made.indices.iter().zip(corners).enumerate() {
            let is_same = own.iter().zip(source).all(|(own, source)| {
                own.element(index as usize) == source.element(vertex as usize)
            });
            if !is_same {
                whole.corners.push([at as u32, add(&mut whole.vertices, vertex)]);
            }
        }
        for &vertex in further {
            whole.further.push(add(&mut whole.vertices, vertex));
        }
        whole
    }

    /// Makes a part the source. It has so many vertices by itself.
    pub(super) fn apply(&self, made: &mut LevelPart, indices: &mut Vec<u32>, vertices: usize) {
        for [corner, vertex] in &self.corners {
            if let Some(index) = indices.get_mut(*corner as usize) {
                *index = vertices as u32 + vertex;
            }
        }
        indices.extend(self.further.iter().map(|vertex| vertices as u32 + vertex));
        let mut at = 0;
        let targets = made.targets.iter_mut().flatten();
        for (_, elements) in made.attributes.iter_mut().chain(targets) {
            let size = elements.size();
            let own = self.vertices.iter().flat_map(|vertex| &vertex[at..at + size]);
            elements.bytes.extend(own);
            at += size;
        }
    }
}

/// All attributes of a part, those of morph targets last.
pub(super) fn all(part: &LevelPart) -> impl Iterator<Item = &Named> {
    part.attributes.iter().chain(part.targets.iter().flatten())
}

/// The block of all parts.
pub(super) fn write_whole(parts: &[WholePart]) -> std::io::Result<Vec<u8>> {
    let mut out = Columns::new(COLUMNS);
    for part in parts {
        let WholePart { vertices, corners, further } = part;
        for count in [vertices.len(), corners.len(), further.len()] {
            out.number(NUMBERS, count as u32);
        }
        let mut before = 0;
        for [corner, vertex] in corners {
            out.number(NUMBERS, corner - std::mem::replace(&mut before, *corner));
            out.number(NUMBERS, *vertex);
        }
        further.iter().for_each(|&vertex| out.number(NUMBERS, vertex));
        vertices.iter().flatten().for_each(|&byte| out.byte(BYTES, byte));
    }
    out.pack()
}

/// Reads the block of all parts, surface by surface.
pub(super) fn read_whole(
    header: &Header,
    block: &[u8],
    most: usize,
) -> Result<Vec<Vec<WholePart>>> {
    let (mut from, _) = Reader::unpack(block, COLUMNS, most)?;
    let mut surfaces = Vec::new();
    for surface in &header.surfaces {
        let mut parts = Vec::new();
        for part in &surface.parts {
            // As they are made: floats where they are of a row.
            let made = |name: &str| surface.is_made(name) && name != "COLOR_0";
            parts.push(read_part(&mut from, part, made)?);
        }
        surfaces.push(parts);
    }
    Ok(surfaces)
}

fn read_part(
    from: &mut Reader,
    part: &PartHeader,
    is_float: impl Fn(&str) -> bool,
) -> Result<WholePart> {
    let mut counts = [0; 3];
    for count in &mut counts {
        *count = from.number(NUMBERS)?;
    }
    let [vertices, corners, further] = counts;
    let known = |vertex: u32| if vertex < vertices { Ok(vertex) } else { Err(Damage::Changed) };
    let mut whole = WholePart::default();
    let mut corner = 0u32;
    for _ in 0..corners {
        corner = corner.checked_add(from.number(NUMBERS)?).ok_or(Damage::Changed)?;
        whole.corners.push([corner, known(from.number(NUMBERS)?)?]);
    }
    for _ in 0..further {
        whole.further.push(known(from.number(NUMBERS)?)?);
    }
    if whole.further.len() % 3 != 0 {
        return Err(Damage::Changed);
    }
    let size = |own: &super::header::AttributeHeader| {
        if is_float(&own.name) { 4 * own.components } else { own.size() }
    };
    let attributes = part.attributes.iter().map(size);
    let targets = part.targets.iter().flatten().map(super::header::AttributeHeader::size);
    let length: usize = attributes.chain(targets).sum();
    for _ in 0..vertices {
        let bytes = (0..length).map(|_| from.byte(BYTES)).collect::<Result<Vec<u8>>>();
        whole.vertices.push(bytes?);
    }
    Ok(whole)
}
