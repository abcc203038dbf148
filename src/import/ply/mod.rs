//! The Stanford Polygon File Format, as text and in both byte orders, by the crate ply-rs-bw.
//!
//! Vertices may carry normals, colors and UVs under their usual names; faces may have UVs of their
//! corners, a color and a picture's number, and the header may name pictures, as MeshLab writes them:
//! `comment TextureFile NAME`. Strips of triangles are faces too. A cloud of points is refused.

mod parts;
mod rows;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Header, PropertyAccess, PropertyType, ScalarType};
use serde_json::json;

use super::builder::Document;
use super::colors::to_linear;
use super::find::Named;
use super::finite::{NO_NORMAL, NO_POSITION, NO_UV, finite_uv, unit};
use super::images::Pictures;
use super::options::ReadOptions;
use super::part::{Part, Vertices};
use super::text::{decode, is_no_number, too_large};
use super::uri::UriPolicy;
use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::warning::Warnings;
use parts::Parts;
use rows::{Face, Skipped, Slot, Slots, Vertex, unused_of_faces, unused_of_vertices};

/// Reads a PLY and its pictures.
///
/// # Errors
/// [`Error::Invalid`] with the line, or the byte of a binary file; [`Error::Unsupported`] if it has
/// no faces, or a picture is of a kind that this version lacks.
pub(super) fn read(bytes: &[u8], folder: &Path, options: ReadOptions) -> Result<Asset> {
    let bytes = &*with_line_feeds(bytes);
    let mut file = File { reader: Reader::new(bytes), length: bytes.len() };
    let header = Parser::<Skipped>::new().read_header(&mut file.reader);
    let header = header.map_err(|error| file.error(&error, Encoding::Ascii))?;
    let (mut vertices, mut faces) = (None, None);
    for (name, element) in &header.elements {
        file.check_size(&header, element)?;
        match name.as_str() {
            "vertex" => vertices = Some((element, file.rows::<Vertex>(&header, element)?)),
            "face" => faces = Some((element, file.rows::<Face>(&header, element)?)),
            "tristrips" => {
                let strips = file.rows::<Face>(&header, element)?;
                faces = Some((element, Face::of_strips(strips)));
            }
            _ => drop(file.rows::<Skipped>(&header, element)?),
        }
        if vertices.is_some() && faces.is_some() {
            break;
        }
    }
    let Some((face, faces)) = faces.filter(|(_, faces)| !faces.is_empty()) else {
        let what = "a PLY without faces, a cloud of points,".into();
        return Err(Error::Unsupported { what });
    };
    let Some((vertex, vertices)) = vertices else {
        return Err(Error::invalid("the header", "there is no element vertex"));
    };
    let mut document = Document::new();
    let warnings = &mut document.warnings;
    warn_of_unused(&header, [vertex, face], warnings);
    let vertices = to_vertices(vertex, &vertices, warnings)?;
    let colors = face_colors(face, &faces, &vertices, warnings);
    let names: Vec<&str> = texture_files(&header).collect();
    let parts = Parts::new(vertices, colors, names.len(), warnings).fill(&faces)?;
    to_asset(document, parts, &names, Pictures::new(folder, options))
}

/// The pictures that a PLY names.
pub(super) fn named_files(bytes: &[u8], uri_policy: UriPolicy<'_>) -> Vec<PathBuf> {
    let bytes = with_line_feeds(bytes);
    let header = Parser::<Skipped>::new().read_header(&mut Reader::new(&*bytes));
    let path = |name: &str| Some(picture(name).find(uri_policy).ok()?.path);
    header.map(|header| texture_files(&header).filter_map(path).collect()).unwrap_or_default()
}

fn texture_files(header: &Header) -> impl Iterator<Item = &str> {
    header
        .comments
        .iter()
        .filter_map(|text| text.trim().strip_prefix("TextureFile "))
        .map(str::trim)
}

/// A picture that the header names.
fn picture(name: &str) -> Named {
    Named { file: name.to_owned(), base: PathBuf::new(), at: "comment TextureFile".to_owned() }
}

/// The last line of a header.
const END: &[u8] = b"end_header";

/// A file whose header's lines end as the parser knows them, and which is no UTF-16, and in whose rows NaN is a number. What follows a
/// header whose lines end in carriage returns alone begins behind the last of them.
fn with_line_feeds(bytes: &[u8]) -> Cow<'_, [u8]> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return decode(bytes).into_owned().into_bytes().into();
    }
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    let end = bytes.windows(END.len()).position(|window| window == END);
    let (header, rest) = bytes.split_at(end.map_or(0, |end| bytes.len().min(end + END.len() + 1)));
    let is_alone = header.starts_with(b"ply\r") && header.get(4) != Some(&b'\n');
    let is_text = header.windows(12).any(|window| window == b"format ascii");
    let is_finite = |byte: &u8| !byte.is_ascii_alphabetic() || b"eE".contains(byte);
    let has_others = is_text && !rest.iter().all(is_finite);
    if !is_alone && !has_others {
        return bytes.into();
    }
    let with_feeds = |part: &[u8]| -> Vec<u8> {
        part.iter().map(|&byte| if byte == b'\r' { b'\n' } else { byte }).collect()
    };
    let header = if is_alone { with_feeds(header) } else { header.to_vec() };
    let rest = if is_alone && is_text { with_feeds(rest) } else { rest.to_vec() };
    let rest = if has_others { with_infinities(&rest) } else { rest };
    [header, rest].concat().into()
}

/// The rows of a text with infinities for what is no number: the parser knows no NaN.
fn with_infinities(rows: &[u8]) -> Vec<u8> {
    let is_space = |byte: &u8| byte.is_ascii_whitespace();
    let word = |word: &[u8]| match std::str::from_utf8(word) {
        Ok(text) if is_no_number(text) => b"1e999".to_vec(),
        _ => word.to_vec(),
    };
    let mut words = rows.chunk_by(|one, other| is_space(one) == is_space(other)).map(word);
    words.by_ref().flatten().collect()
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

/// Warns of elements and properties that are left out.
fn warn_of_unused(header: &Header, used: [&ElementDef; 2], warnings: &mut Warnings) {
    let mut warn = |things: &str, names: Vec<&str>| {
        if !names.is_empty() {
            let names = names.join("`, `").chars().take(200).collect::<String>();
            let what =
                format!("the {things} `{names}` are left out, as glTF has no place for them");
            warnings.add("the header", what);
        }
    };
    let [vertex, face] = used;
    let elements = header.elements.values().filter(|element| element.count > 0);
    let others = elements.filter(|own| own.name != vertex.name && own.name != face.name);
    warn("elements", others.map(|element| element.name.as_str()).collect());
    warn("properties of vertices", unused_of_vertices(vertex));
    warn("properties of faces", unused_of_faces(face));
}

/// The rows as lists of what the element has.
fn to_vertices(element: &ElementDef, rows: &[Vertex], warnings: &mut Warnings) -> Result<Vertices> {
    let slots = Slots::of(element);
    if !slots.has(Slot::Position, 3) {
        return Err(Error::invalid("the header", "vertices have no x, y and z"));
    }
    let mut vertices = Vertices::default();
    for (at, row) in rows.iter().enumerate() {
        if let Some(what) = too_large(row.position) {
            return Err(Error::invalid(format!("vertex {at}"), what));
        }
        if !Part::is_placed(&row.position) {
            warnings.add(format_args!("vertex {at}"), NO_POSITION);
        }
        vertices.positions.push(row.position);
        if slots.has(Slot::Normal, 3) {
            let normal = unit(row.normal);
            if normal[0].is_nan() {
                warnings.add(format_args!("vertex {at}"), NO_NORMAL);
            }
            vertices.normals.push(normal);
        }
        if slots.has(Slot::Uv, 2) {
            let uv = finite_uv([row.uv[0], 1.0 - row.uv[1]]);
            if uv.is_none() {
                warnings.add(format_args!("vertex {at}"), NO_UV);
            }
            vertices.uvs.push(uv.unwrap_or_default());
        }
    }
    if slots.has(Slot::Color, 3) {
        vertices.colors = rows.iter().map(|row| row.color).collect();
        finish_colors(&mut vertices.colors, "vertices", warnings);
    }
    Ok(vertices)
}

/// The colors of faces, if they have some and vertices have none.
fn face_colors(
    element: &ElementDef,
    faces: &[Face],
    vertices: &Vertices,
    warnings: &mut Warnings,
) -> Vec<[f32; 4]> {
    if !Slots::of(element).has(Slot::Color, 3) {
        return Vec::new();
    }
    if !vertices.colors.is_empty() {
        let what = "those of faces are left out, as vertices have some; keep one of both";
        warnings.add("the colors", what);
        return Vec::new();
    }
    let mut colors: Vec<[f32; 4]> = faces.iter().map(|face| face.color).collect();
    finish_colors(&mut colors, "faces", warnings);
    colors
}

fn finish_colors(colors: &mut [[f32; 4]], of: &str, warnings: &mut Warnings) {
    if to_linear(colors) {
        let what = "they are taken to count to 255; write floats from 0 to 1";
        warnings.add(format_args!("the colors of the {of}"), what);
    }
}

fn to_asset(
    mut document: Document,
    mut parts: Vec<Part>,
    names: &[&str],
    mut pictures: Pictures<'_>,
) -> Result<Asset> {
    for (part, name) in parts.iter_mut().zip(names) {
        let texture = pictures.texture(&mut document, &picture(name), false)?;
        let material = json!({"name": name, "pbrMetallicRoughness": {
            "baseColorTexture": {"index": texture}, "metallicFactor": 0.0,
        }});
        part.material = Some(document.add("materials", material));
    }
    parts.retain(|part| !part.triangles.is_empty());
    if parts.is_empty() {
        return Err(Error::Unsupported { what: "a PLY whose faces have no area".into() });
    }
    document.add_mesh("mesh", parts);
    Ok(document.into_asset())
}
