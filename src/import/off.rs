//! Geomview's Object File Format: `OFF`, and with colors, normals and UVs `COFF`, `NOFF`, `STOFF`
//! or several of them (`STCNOFF`).
//!
//! A vertex is a position, then its normal, color and UV, as far as the first word says. Colors are
//! of three or four numbers, up to 1, or up to 255 if any is 2 or more. Colors of faces are left out
//! with a warning. What belongs to one vertex or face may run over lines. Files in four or in n
//! dimensions, and binary ones, are refused.

use std::borrow::Cow;

use super::builder::Document;
use super::colors::to_linear;
use super::finite::{NO_NORMAL, NO_POSITION, NO_UV, finite_uv, unit};
use super::part::Part;
use super::polygon::triangulate;
use super::text::{Line, decode, lines, shorten, words};
use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::warning::Warnings;

/// The attributes of vertices beside their positions.
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
    let mut reader = Reader { kind, part: Part::default(), warnings: Warnings::default() };
    for _ in 0..vertices {
        reader.take_vertex(lines.next().ok_or_else(end)?, &mut lines)?;
    }
    for _ in 0..faces {
        reader.take_face(lines.next().ok_or_else(end)?, &mut lines)?;
    }
    let Reader { mut part, warnings, .. } = reader;
    if part.triangles.is_empty() {
        return Err(Error::Unsupported { what: "an OFF without faces".into() });
    }
    to_linear(&mut part.vertices.colors);
    let mut document = Document::new();
    document.warnings = warnings;
    document.add_mesh("mesh", vec![part]);
    Ok(document.into_asset())
}

/// Parses the keyword, as `STCNOFF`, into the attributes that it announces and the rest of its line; it
/// may be left out.
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

/// The content read so far.
struct Reader {
    kind: Kind,
    part: Part,
    warnings: Warnings,
}

impl Reader {
    /// Takes a vertex; a color without an opacity gets a negative one.
    fn take_vertex<'a>(
        &mut self,
        line: Line<'a>,
        others: &mut impl Iterator<Item = Line<'a>>,
    ) -> Result<()> {
        let Kind { uvs, colors, normals } = self.kind;
        let least = 3 * (1 + usize::from(normals) + usize::from(colors)) + 2 * usize::from(uvs);
        let text = join(line, others, least);
        let all: Vec<&str> = words(&text).collect();
        let mut rest = &all[..];
        let mut take = |count: usize| {
            let (own, others) = rest.split_at(count.min(rest.len()));
            rest = others;
            own.join(" ")
        };
        let position = line.position(&take(3))?;
        let mut warn = |is_wrong: bool, what: &'static str| {
            if is_wrong {
                self.warnings.add(line.place(), what);
            }
        };
        let lists = &mut self.part.vertices;
        warn(!Part::is_placed(&position), NO_POSITION);
        lists.positions.push(position);
        if normals {
            let normal = unit(line.numbers(&take(3))?);
            warn(normal[0].is_nan(), NO_NORMAL);
            lists.normals.push(normal);
        }
        if colors {
            let [r, g, b, alpha] = match all.len() > least {
                true => line.numbers::<4>(&take(4))?,
                false => {
                    let [r, g, b] = line.numbers::<3>(&take(3))?;
                    [r, g, b, -1.0]
                }
            };
            lists.colors.push([r, g, b, alpha].map(|x| x as f32));
        }
        if uvs {
            let [u, v] = line.numbers(&take(2))?;
            let uv = finite_uv([u, 1.0 - v]);
            warn(uv.is_none(), NO_UV);
            lists.uvs.push(uv.unwrap_or_default());
        }
        Ok(())
    }

    fn take_face<'a>(
        &mut self,
        line: Line<'a>,
        others: &mut impl Iterator<Item = Line<'a>>,
    ) -> Result<()> {
        let count: usize = line.parse(words(line.text).next().unwrap_or_default())?;
        let text = join(line, others, count.saturating_add(1));
        let mut words = words(&text).skip(1);
        let vertices = self.part.vertices.positions.len();
        let corner = |word: &str| match line.parse::<u32>(word)? {
            corner if (corner as usize) < vertices => Ok(corner),
            corner => Err(line.error(format!("{corner} is not one of the {vertices} vertices"))),
        };
        let corners: Vec<u32> = words.by_ref().take(count).map(corner).collect::<Result<_>>()?;
        if corners.len() < count {
            return Err(line.error(format!("a face of {count} corners has {}", corners.len())));
        }
        if words.next().is_some() {
            let what = "the colors of faces are left out; give vertices colors (COFF)";
            self.warnings.add(line.place(), what);
        }
        let positions = &self.part.vertices.positions;
        let outline: Vec<[f64; 3]> = corners.iter().map(|&at| positions[at as usize]).collect();
        if outline.iter().all(Part::is_placed) {
            let triangles = triangulate(&outline).into_iter().flatten();
            self.part.triangles.extend(triangles.map(|corner| corners[corner]));
        }
        Ok(())
    }
}

/// A line, with those after it until there are so many words, or none is left.
fn join<'a>(
    line: Line<'a>,
    others: &mut impl Iterator<Item = Line<'a>>,
    least: usize,
) -> Cow<'a, str> {
    let mut count = words(line.text).count();
    if count >= least {
        return line.text.into();
    }
    let mut text: String = words(line.text).collect::<Vec<_>>().join(" ");
    while count < least
        && let Some(next) = others.next()
    {
        for word in words(next.text) {
            text.push(' ');
            text.push_str(word);
            count += 1;
        }
    }
    text.into()
}
