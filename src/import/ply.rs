//! The Stanford Polygon File Format, as text and in both byte orders, by the crate ply-rs-bw.
//!
//! Vertices may carry normals, colors and UVs under their usual names; faces may have UVs of their
//! corners and a picture's number, and the header may name pictures, as MeshLab writes them:
//! `comment TextureFile NAME`. A cloud of points is refused.

use std::path::{Path, PathBuf};

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
    ScalarType,
};
use rustc_hash::FxHashMap;
use seamwise_texture::color::srgb_to_linear;
use serde_json::json;

use super::builder::{Document, Part, Vertices};
use super::images::{Pictures, find};
use super::options::ReadOptions;
use super::polygon::triangulate;
use super::uri::UriPolicy;
use crate::document::asset::Asset;
use crate::error::{Error, Result};

/// Reads a PLY and its pictures.
///
/// # Errors
/// [`Error::Invalid`] with the line, or the byte of a binary file; [`Error::Unsupported`] if it has
/// no faces, or a picture is of a kind that this version lacks.
pub(super) fn read(bytes: &[u8], folder: &Path, options: ReadOptions) -> Result<Asset> {
    let mut file = File { reader: Reader::new(bytes), length: bytes.len() };
    let header = Parser::<Skipped>::new().read_header(&mut file.reader);
    let header = header.map_err(|error| file.error(&error, Encoding::Ascii))?;
    let (mut vertices, mut faces) = (None, None);
    for (name, element) in &header.elements {
        file.check_size(&header, element)?;
        match name.as_str() {
            "vertex" => vertices = Some((element, file.rows::<Vertex>(&header, element)?)),
            "face" => faces = Some((element, file.rows::<Face>(&header, element)?)),
            _ => drop(file.rows::<Skipped>(&header, element)?),
        }
        if vertices.is_some() && faces.is_some() {
            break;
        }
    }
    let Some((_, faces)) = faces.filter(|(_, faces)| !faces.is_empty()) else {
        let what = "a PLY without faces, a cloud of points,".into();
        return Err(Error::Unsupported { what });
    };
    let Some((element, vertices)) = vertices else {
        return Err(Error::invalid("the header", "there is no element vertex"));
    };
    let vertices = to_vertices(element, &vertices)?;
    let names: Vec<&str> = texture_files(&header).collect();
    let parts = Parts::new(vertices, names.len()).fill(&faces)?;
    to_asset(parts, &names, Pictures::new(folder, options))
}

/// The pictures that a PLY names.
pub(super) fn named_files(bytes: &[u8], uri_policy: UriPolicy<'_>) -> Vec<PathBuf> {
    let header = Parser::<Skipped>::new().read_header(&mut Reader::new(bytes));
    let files =
        |header| texture_files(&header).filter_map(|name| find(uri_policy, name).ok()).collect();
    header.map(files).unwrap_or_default()
}

fn texture_files(header: &Header) -> impl Iterator<Item = &str> {
    header
        .comments
        .iter()
        .filter_map(|text| text.trim().strip_prefix("TextureFile "))
        .map(str::trim)
}

/// A file that is being read.
struct File<'a> {
    reader: Reader<&'a [u8]>,
    length: usize,
}

impl File<'_> {
    fn rows<E: PropertyAccess>(&mut self, header: &Header, element: &ElementDef) -> Result<Vec<E>> {
        let rows = Parser::new().read_payload_for_element(&mut self.reader, element, header);
        rows.map_err(|error| self.error(&error, header.encoding))
    }

    /// Makes sure that what is announced can be there: the parser makes a row of nothing at all, and
    /// as many as it is told.
    fn check_size(&self, header: &Header, element: &ElementDef) -> Result<()> {
        let size = |kind: &ScalarType| match kind {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        };
        let least = |kind: &PropertyType| match (header.encoding, kind) {
            (Encoding::Ascii, _) => 2,
            (_, PropertyType::Scalar(kind) | PropertyType::List(kind, _)) => size(kind),
        };
        let row: usize = element.properties.values().map(|own| least(&own.data_type)).sum();
        // The last line may have no end.
        let there = self.reader.get_ref().len() + 1;
        if element.count.checked_mul(row.max(1)).is_some_and(|bytes| bytes <= there) {
            return Ok(());
        }
        let what =
            format!("{} rows of {} are more than the file holds", element.count, element.name);
        Err(Error::invalid("the header", what))
    }

    /// An error of the parser, in one line, with its place.
    fn error(&self, error: &ParseError, encoding: Encoding) -> Error {
        let place = match (encoding, error.line()) {
            (Encoding::Ascii, Some(line)) => format!("line {line}"),
            _ => format!("byte {}", self.length - self.reader.get_ref().len()),
        };
        let text = error.to_string();
        let text = text.split_once(": ").filter(|(line, _)| line.starts_with("Line "));
        let text = text.map_or_else(|| error.to_string(), |(_, text)| text.to_owned());
        let words: Vec<&str> = text.split_whitespace().collect();
        Error::invalid(place, words.join(" ").chars().take(200).collect::<String>())
    }
}

/// A row of an element that is of no use here.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}

struct Vertex {
    position: [f32; 3],
    normal: [f32; 3],
    uv: [f32; 2],
    /// As it is stored, from 0 to 1.
    color: [f32; 4],
}

/// The list of a vertex that a property is a number of, and its place there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Slot {
    Position(usize),
    Normal(usize),
    Uv(usize),
    Color(usize),
}

impl Slot {
    fn of(property: &str) -> Option<Self> {
        Some(match property {
            "x" => Self::Position(0),
            "y" => Self::Position(1),
            "z" => Self::Position(2),
            "nx" => Self::Normal(0),
            "ny" => Self::Normal(1),
            "nz" => Self::Normal(2),
            "s" | "u" | "texture_u" | "texture_s" => Self::Uv(0),
            "t" | "v" | "texture_v" | "texture_t" => Self::Uv(1),
            "red" | "r" | "diffuse_red" => Self::Color(0),
            "green" | "g" | "diffuse_green" => Self::Color(1),
            "blue" | "b" | "diffuse_blue" => Self::Color(2),
            "alpha" | "a" | "diffuse_alpha" => Self::Color(3),
            _ => return None,
        })
    }
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self { position: [0.0; 3], normal: [0.0; 3], uv: [0.0; 2], color: [1.0; 4] }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let (Some(slot), Some(value)) = (Slot::of(name), property.to_f32_lossy()) else {
            return PropertyAccessResult::Ignored;
        };
        match slot {
            Slot::Position(at) => self.position[at] = value,
            Slot::Normal(at) => self.normal[at] = value,
            Slot::Uv(at) => self.uv[at] = value,
            Slot::Color(at) => {
                let whole = match property {
                    Property::UChar(_) => f32::from(u8::MAX),
                    Property::UShort(_) => f32::from(u16::MAX),
                    _ => 1.0,
                };
                self.color[at] = (value / whole).clamp(0.0, 1.0);
            }
        }
        PropertyAccessResult::Set
    }
}

struct Face {
    corners: Vec<u32>,
    /// The UVs of its corners, if it has them.
    uvs: Vec<f32>,
    texture: u32,
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self { corners: Vec::new(), uvs: Vec::new(), texture: 0 }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match (name, property) {
            // A negative one is out of range as well.
            ("vertex_indices" | "vertex_index", Property::ListInt(corners)) => {
                self.corners = corners.into_iter().map(i32::cast_unsigned).collect();
            }
            ("vertex_indices" | "vertex_index", list) => match list.to_u32_list() {
                Some(corners) => self.corners = corners,
                None => return PropertyAccessResult::UnsupportedType,
            },
            ("texcoord", Property::ListFloat(uvs)) => self.uvs = uvs,
            ("texcoord", Property::ListDouble(uvs)) => {
                self.uvs = uvs.into_iter().map(|x| x as f32).collect();
            }
            ("texnumber", Property::Int(number)) => self.texture = number.max(0) as u32,
            ("texnumber", Property::UInt(number)) => self.texture = number,
            ("texnumber", Property::UChar(number)) => self.texture = number.into(),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

/// The rows as lists of what the element has.
fn to_vertices(element: &ElementDef, rows: &[Vertex]) -> Result<Vertices> {
    let slots: Vec<Slot> = element.properties.keys().filter_map(|name| Slot::of(name)).collect();
    let has = |slot: &dyn Fn(usize) -> Slot, count| (0..count).all(|at| slots.contains(&slot(at)));
    if !has(&Slot::Position, 3) {
        return Err(Error::invalid("the header", "vertices have no x, y and z"));
    }
    let finite =
        |row: &Vertex| row.position.iter().chain(&row.normal).chain(&row.uv).all(|x| x.is_finite());
    if let Some(at) = rows.iter().position(|row| !finite(row)) {
        return Err(Error::invalid(format!("vertex {at}"), "a number that is not finite"));
    }
    let mut vertices = Vertices {
        positions: rows.iter().map(|row| row.position).collect(),
        ..Vertices::default()
    };
    if has(&Slot::Normal, 3) {
        vertices.normals = rows.iter().map(|row| row.normal).collect();
    }
    if has(&Slot::Uv, 2) {
        vertices.uvs = rows.iter().map(|row| [row.uv[0], 1.0 - row.uv[1]]).collect();
    }
    if has(&Slot::Color, 3) {
        let linear = |[r, g, b, alpha]: [f32; 4]| {
            let [r, g, b] = [r, g, b].map(srgb_to_linear);
            [r, g, b, alpha]
        };
        vertices.colors = rows.iter().map(|row| linear(row.color)).collect();
    }
    Ok(vertices)
}

/// The faces of each picture.
struct Parts {
    vertices: Vertices,
    parts: Vec<Part>,
    /// The vertices of each part by their numbers in the file and the bits of their corner's UV.
    numbers: Vec<FxHashMap<(u32, [u32; 2]), u32>>,
}

impl Parts {
    fn new(vertices: Vertices, textures: usize) -> Self {
        let count = textures.max(1);
        Self {
            vertices,
            parts: vec![Part::default(); count],
            numbers: vec![FxHashMap::default(); count],
        }
    }

    fn fill(mut self, faces: &[Face]) -> Result<Vec<Part>> {
        let by_corner = faces.iter().any(|face| !face.uvs.is_empty());
        let one = self.parts.len() == 1 && !by_corner;
        for (number, face) in faces.iter().enumerate() {
            if let Some(what) = self.fault(face) {
                return Err(Error::invalid(format!("face {number}"), what));
            }
            let part = face.texture as usize;
            let outline: Vec<[f32; 3]> =
                face.corners.iter().map(|&at| self.vertices.positions[at as usize]).collect();
            let corners: Vec<u32> = if one {
                face.corners.clone()
            } else {
                let uv =
                    |at: usize| face.uvs.get(2 * at..2 * at + 2).map(|uv| [uv[0], 1.0 - uv[1]]);
                (0..face.corners.len())
                    .map(|at| self.vertex(part, face.corners[at], uv(at), by_corner))
                    .collect()
            };
            let triangles = triangulate(&outline).into_iter().flatten();
            self.parts[part].triangles.extend(triangles.map(|corner| corners[corner]));
        }
        if one {
            self.parts[0].vertices = self.vertices;
        }
        Ok(self.parts)
    }

    /// What is wrong with a face, if anything is.
    fn fault(&self, face: &Face) -> Option<String> {
        let vertices = self.vertices.positions.len();
        if let Some(bad) = face.corners.iter().find(|&&corner| corner as usize >= vertices) {
            let bad = bad.cast_signed();
            return Some(format!("{bad} is not one of the {vertices} vertices"));
        }
        if face.texture as usize >= self.parts.len() {
            return Some(format!("there is no picture {}", face.texture));
        }
        let is_whole = face.uvs.is_empty() || face.uvs.len() == 2 * face.corners.len();
        let is_well = is_whole && face.uvs.iter().all(|x| x.is_finite());
        (!is_well).then(|| "not a UV for each corner".into())
    }

    /// The vertex of a corner in a part, a new one if no corner before it was the same.
    fn vertex(&mut self, part: usize, own: u32, uv: Option<[f32; 2]>, by_corner: bool) -> u32 {
        let from = &self.vertices;
        let at = own as usize;
        let uv = if by_corner { Some(uv.unwrap_or_default()) } else { from.uvs.get(at).copied() };
        let lists = &mut self.parts[part].vertices;
        let bits = uv.unwrap_or_default().map(f32::to_bits);
        *self.numbers[part].entry((own, bits)).or_insert_with(|| {
            lists.positions.push(from.positions[at]);
            lists.normals.extend(from.normals.get(at));
            lists.colors.extend(from.colors.get(at));
            lists.uvs.extend(uv);
            lists.positions.len() as u32 - 1
        })
    }
}

fn to_asset(mut parts: Vec<Part>, names: &[&str], mut pictures: Pictures<'_>) -> Result<Asset> {
    let mut document = Document::new();
    for (part, name) in parts.iter_mut().zip(names) {
        let texture = pictures.texture(&mut document, name, false, "comment TextureFile")?;
        let material = json!({"name": name, "pbrMetallicRoughness": {
            "baseColorTexture": {"index": texture}, "metallicFactor": 0.0,
        }});
        part.material = Some(document.add("materials", material));
    }
    parts.retain(|part| !part.triangles.is_empty());
    if parts.is_empty() {
        return Err(Error::Unsupported { what: "a PLY whose faces have no area".into() });
    }
    document.add_mesh("mesh", &parts);
    Ok(document.into_asset())
}
