//! Geomview's Object File Format: `OFF`, and with colors, normals and UVs `COFF`, `NOFF`, `STOFF`
//! or several of them (`STCNOFF`).
//!
//! A vertex is a position, then its normal, color and UV, as far as the first word says. Colors are
//! of three or four numbers, up to 1, or up to 255 if any is above 1. Colors of faces are passed
//! over; files in four or in n dimensions, and binary ones, are refused.

use seamwise_texture::color::srgb_to_linear;

use super::builder::{Document, Part, Vertices};
use super::polygon::triangulate;
use super::text::{Line, decode, lines, shorten, words};
use crate::document::asset::Asset;
use crate::error::{Error, Result};

/// What vertices carry beside their positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Kind {
    uvs: bool,
    colors: bool,
    normals: bool,
}

/// Reads an OFF.
///
/// # Errors
/// [`Error::Invalid`] with the line; [`Error::Unsupported`] if it is of a kind that this version
/// lacks, or has no faces.
pub(super) fn read(bytes: &[u8]) -> Result<Asset> {
    let text = decode(bytes);
    let mut lines = lines(&text);
    let end = || Error::invalid("the end of the file", "there is less in it than it announces");
    let mut first = lines.next().ok_or_else(end)?;
    let (kind, rest) = parse_header(first)?;
    // The numbers may follow on the same line, even without a space.
    if rest.is_empty() {
        first = lines.next().ok_or_else(end)?;
    } else {
        first.text = rest;
    }
    let mut counts = words(first.text).take(2).map(|word| first.parse::<u64>(word));
    let (Some(vertices), Some(faces)) = (counts.next(), counts.next()) else {
        return Err(first.error("not the numbers of vertices and faces"));
    };
    let (vertices, faces) = (vertices?, faces?);
    let mut part = Part::default();
    let mut scale = Scale::default();
    for _ in 0..vertices {
        take_vertex(lines.next().ok_or_else(end)?, kind, &mut part.vertices, &mut scale)?;
    }
    for _ in 0..faces {
        take_face(lines.next().ok_or_else(end)?, &mut part)?;
    }
    if part.triangles.is_empty() {
        return Err(Error::Unsupported { what: "an OFF without faces".into() });
    }
    scale.finish(&mut part.vertices.colors);
    let mut document = Document::new();
    document.add_mesh("mesh", &[part]);
    Ok(document.into_asset())
}

/// What the first word says, and what follows it; `OFF` may be left out.
fn parse_header(line: Line<'_>) -> Result<(Kind, &str)> {
    let mut kind = Kind { uvs: false, colors: false, normals: false };
    let Some((prefix, rest)) = line.text.split_once("OFF") else {
        if line.text.starts_with(|first: char| first.is_ascii_digit()) {
            return Ok((kind, line.text));
        }
        return Err(line.error(format!("`{}` is no beginning of an OFF", shorten(line.text))));
    };
    let (uvs, prefix) = prefix.strip_prefix("ST").map_or((false, prefix), |rest| (true, rest));
    let (colors, prefix) = prefix.strip_prefix('C').map_or((false, prefix), |rest| (true, rest));
    let (normals, prefix) = prefix.strip_prefix('N').map_or((false, prefix), |rest| (true, rest));
    kind = Kind { uvs, colors, normals };
    let rest = words(rest).next().map_or("", |_| rest.trim());
    if !prefix.is_empty() || rest.starts_with("BINARY") {
        let what = format!("line {}: an OFF that begins `{}`", line.number, shorten(line.text));
        return Err(Error::Unsupported { what });
    }
    Ok((kind, rest))
}

/// How colors are counted, which shows when all are known.
#[derive(Debug, Default)]
struct Scale {
    greatest: f32,
}

impl Scale {
    /// Colors to linear light.
    fn finish(&self, colors: &mut [[f32; 4]]) {
        let whole = if self.greatest > 1.0 { 255.0 } else { 1.0 };
        for [rgb @ .., alpha] in colors {
            *rgb = rgb.map(|x| srgb_to_linear((x / whole).clamp(0.0, 1.0)));
            *alpha = if *alpha < 0.0 { 1.0 } else { (*alpha / whole).min(1.0) };
        }
    }
}

/// Takes a vertex; a color without an opacity gets a negative one.
fn take_vertex(
    line: Line<'_>,
    kind: Kind,
    vertices: &mut Vertices,
    scale: &mut Scale,
) -> Result<()> {
    let count = words(line.text).count();
    let mut rest = words(line.text);
    let mut take = |wanted: usize| {
        let mut numbers = [-1.0f32; 4];
        let text: Vec<&str> = rest.by_ref().take(wanted).collect();
        let text = text.join(" ");
        match wanted {
            2 => numbers[..2].copy_from_slice(&line.floats::<2>(&text)?),
            3 => numbers[..3].copy_from_slice(&line.floats::<3>(&text)?),
            _ => numbers = line.floats::<4>(&text)?,
        }
        Ok::<_, Error>(numbers)
    };
    let three = |numbers: [f32; 4]| [numbers[0], numbers[1], numbers[2]];
    vertices.positions.push(three(take(3)?));
    if kind.normals {
        vertices.normals.push(three(take(3)?));
    }
    if kind.colors {
        let others = 3 + 3 * usize::from(kind.normals) + 2 * usize::from(kind.uvs);
        let color = take(if count >= others + 4 { 4 } else { 3 })?;
        scale.greatest = color.into_iter().fold(scale.greatest, f32::max);
        vertices.colors.push(color);
    }
    if kind.uvs {
        let [u, v, ..] = take(2)?;
        vertices.uvs.push([u, 1.0 - v]);
    }
    Ok(())
}

fn take_face(line: Line<'_>, part: &mut Part) -> Result<()> {
    let mut words = words(line.text);
    let count: usize = line.parse(words.next().unwrap_or_default())?;
    let vertices = part.vertices.positions.len();
    let corner = |word: &str| match line.parse::<u32>(word)? {
        corner if (corner as usize) < vertices => Ok(corner),
        corner => Err(line.error(format!("{corner} is not one of the {vertices} vertices"))),
    };
    let corners: Vec<u32> = words.take(count).map(corner).collect::<Result<_>>()?;
    if corners.len() < count {
        return Err(line.error(format!("a face of {count} corners has {}", corners.len())));
    }
    let positions = &part.vertices.positions;
    let outline: Vec<[f32; 3]> = corners.iter().map(|&at| positions[at as usize]).collect();
    let triangles = triangulate(&outline).into_iter().flatten();
    part.triangles.extend(triangles.map(|corner| corners[corner]));
    Ok(())
}
