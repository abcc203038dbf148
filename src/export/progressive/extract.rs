//! A level of a progressive file.

use std::path::Path;

use serde_json::{Value, json};

use super::blocks::Damage;
pub use super::decode::Fineness;
use super::decode::{Decoded, read_splits};
use super::document::with_parts;
use super::format::EXTENSION;
use super::header::Header;
use super::parts::parts;
use super::surface::Surface;
use super::whole::read_whole;
use crate::document::asset::Asset;
use crate::document::extensions::drop_unused_extension;
use crate::error::{Error, Result};
use crate::import::options::ReadOptions;
use crate::import::read_bytes_with;

/// A level of a progressive file.
#[derive(Clone, Debug)]
pub struct Extracted {
    /// The level as a document.
    pub asset: Asset,
    /// Its triangles, and those of the coarsest level and of the source.
    pub triangles: u64,
    /// Those of the coarsest level.
    pub coarsest: u64,
    /// Those of the source.
    pub finest: u64,
    /// The error of the level: 0 of the source.
    pub error: f32,
    /// The reason why it is not what was asked, if it is not.
    pub missed: Option<&'static str>,
}

/// The triangles of a progressive file's coarsest level and of its source.
///
/// # Errors
/// As [`extract`].
pub fn triangles(bytes: &[u8]) -> Result<[u64; 2]> {
    Ok(Container::read(bytes)?.header.triangles)
}

/// Extracts a level. The file may end early: then the level is as fine as what is there allows.
///
/// # Errors
/// [`Error::Kind`] if it is no progressive file; [`Error::Invalid`] if even its coarsest level is not
/// there, with the place of the fault.
pub fn extract(bytes: &[u8], fineness: Fineness, options: ReadOptions) -> Result<Extracted> {
    let Container { header, asset, blocks } = Container::read(bytes)?;
    let most = usize::try_from(options.memory_limit.bytes()).unwrap_or(usize::MAX) / 8;
    let damaged = |damage| Error::invalid(format!("/extensions/{EXTENSION}"), told(damage));
    let Decoded { surfaces, triangles, error, damage, rest, .. } =
        read_splits(&header, blocks, fineness, most).map_err(damaged)?;
    let whole = rest.map(|rest| read_whole(&header, &blocks[rest..], most));
    let (whole, damage) = match whole {
        Some(Ok(whole)) => (whole, damage),
        Some(Err(found)) => (Vec::new(), Some(found)),
        None => (Vec::new(), damage),
    };
    let [coarsest, finest] = header.triangles;
    let is_too_fine = matches!(fineness, Fineness::Triangles(most) if triangles > most);
    let missed = match damage {
        Some(damage) => Some(told(damage)),
        None => is_too_fine.then_some("its coarsest level has more triangles"),
    };
    let made = surfaces.iter().map(Surface::shown).zip(&header.surfaces).enumerate();
    let made: Vec<_> = made
        .map(|(at, (surface, header))| {
            parts(&surface, header, whole.get(at).map_or(&[], Vec::as_slice))
        })
        .collect();
    let plain = read_bytes_with(&glb(&asset)?, Path::new(""), options)?;
    let asset = with_parts(&plain, &header, &made, &[])?;
    Ok(Extracted { asset, triangles, coarsest, finest, error, missed })
}

/// What is wrong with a file, in words.
pub(super) fn told(damage: Damage) -> &'static str {
    match damage {
        Damage::Truncated => "the file ends before its last split",
        Damage::Changed => "a block of splits is damaged",
    }
}

/// A progressive file taken apart.
pub(super) struct Container<'a> {
    pub(super) header: Header,
    /// The document without its splits.
    pub(super) asset: Asset,
    pub(super) blocks: &'a [u8],
}

impl<'a> Container<'a> {
    pub(super) fn read(bytes: &'a [u8]) -> Result<Self> {
        let [document, buffer] = chunks(bytes)?;
        let mut json: Value = serde_json::from_slice(document)
            .map_err(|error| Error::invalid("its JSON", error.to_string()))?;
        let at = format!("/extensions/{EXTENSION}");
        let Some(own) = json.pointer(&at) else {
            let what = format!(
                "no progressive file: it has no {EXTENSION}; `seamwise bake --progressive` makes one"
            );
            return Err(Error::Kind { what });
        };
        let header: Header = serde_json::from_value(own.clone())
            .map_err(|error| Error::invalid(&at, error.to_string()))?;
        header.check()?;
        let view = format!("/bufferViews/{}", header.buffer_view);
        let number = |key: &str| {
            let value = json.pointer(&format!("{view}/{key}")).and_then(Value::as_u64);
            value.and_then(|value| usize::try_from(value).ok())
        };
        let (Some(start), Some(length)) = (number("byteOffset"), number("byteLength")) else {
            return Err(Error::invalid(view, "there is no such view of splits"));
        };
        let Some(rest) = buffer.get(start..) else {
            let what = "the file ends before its coarsest level";
            return Err(Error::invalid(view, what));
        };
        let blocks = &rest[..length.min(rest.len())];
        remove(&mut json, header.buffer_view, start)?;
        let buffers = vec![buffer[..start].to_vec().into()];
        Ok(Self { header, asset: Asset { json, buffers, ..Asset::default() }, blocks })
    }
}

/// Takes the splits from a document: their view is its last, at the end of its buffer.
fn remove(json: &mut Value, view: usize, start: usize) -> Result<()> {
    let views = json.get_mut("bufferViews").and_then(Value::as_array_mut);
    let views = views.filter(|views| views.len() == view + 1);
    let views = views.ok_or_else(|| Error::invalid("/bufferViews", "splits that are not last"))?;
    views.pop();
    let is_empty = views.is_empty();
    if let Some(object) = json.as_object_mut() {
        if is_empty {
            object.shift_remove("bufferViews");
        }
        if let Some(extensions) = object.get_mut("extensions").and_then(Value::as_object_mut) {
            extensions.shift_remove(EXTENSION);
            if extensions.is_empty() {
                object.shift_remove("extensions");
            }
        }
    }
    drop_unused_extension(json, EXTENSION);
    json["buffers"] = json!([{"byteLength": start}]);
    Ok(())
}

/// A document and its only buffer as a .glb.
fn glb(asset: &Asset) -> Result<Vec<u8>> {
    crate::export::glb::container(asset)
}

/// The JSON and the buffer of a .glb, as far as they are there.
fn chunks(bytes: &[u8]) -> Result<[&[u8]; 2]> {
    let word = |at: usize| {
        let own = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes([own[0], own[1], own[2], own[3]]) as usize)
    };
    if !bytes.starts_with(b"glTF") {
        return Err(Error::Kind { what: "no .glb: a progressive file is one".into() });
    }
    let cut = || Error::invalid("its header", "the file ends before its document does");
    let length = word(12).ok_or_else(cut)?;
    let document = bytes.get(20..).and_then(|rest| rest.get(..length)).ok_or_else(cut)?;
    let start = (20 + length).min(bytes.len());
    let length = word(start).unwrap_or(0);
    let rest = bytes.get(start + 8..).unwrap_or_default();
    Ok([document, &rest[..length.min(rest.len())]])
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::BakeOptions;
    use crate::bake::options::{Targets, Textures};
    use crate::export::files::OutputOptions;
    use crate::export::progressive::blocks::Reader;
    use crate::export::progressive::parts::parts;

    /// The sample's progressive file.
    pub(in crate::export::progressive) fn sample() -> Vec<u8> {
        let options = BakeOptions {
            targets: Targets::Ratios(vec![0.3, 0.1]),
            textures: Textures::Keep,
            evaluate: None,
            polish: None,
            output: OutputOptions { progressive: true, ..OutputOptions::default() },
            ..BakeOptions::default()
        };
        let bytes = include_bytes!("../../../data/sample.glb");
        let files = crate::bake_bytes(bytes, "sample", &options).unwrap().files;
        files.into_iter().find(|file| file.name.ends_with("_progressive.glb")).unwrap().bytes
    }

    /// Where checksums are right whatever is in a block.
    #[test]
    fn splits_that_make_no_sense_are_no_panic() {
        let file = sample();
        let Container { header, blocks, .. } = Container::read(&file).unwrap();
        let (_, columns) = header.forms();
        let most = 1 << 28;
        let mut random = 1u64;
        let mut next = |limit: usize| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695);
            (random >> 33) as usize % limit.max(1)
        };
        let mut told = 0;
        for _ in 0..24 {
            let (mut rest, mut changed) = (blocks, Vec::new());
            for at in 0..3 {
                let (reader, length) = Reader::unpack(rest, columns, most).unwrap();
                rest = &rest[length..];
                let block = reader.into_columns(|all| {
                    // The coarsest level is changed less often: it is told first.
                    for _ in 0..next(if at == 0 { 2 } else { 4 }) {
                        let kinds = if next(3) > 0 { 13 } else { columns };
                        let column = next(kinds);
                        let length = all[column].len();
                        if let Some(byte) = all[column].get_mut(next(length)) {
                            *byte =
                                if next(2) == 0 { next(256) as u8 } else { *byte ^ 1 << next(8) };
                        }
                    }
                });
                changed.extend(block.pack().unwrap());
            }
            changed.extend_from_slice(rest);
            match read_splits(&header, &changed, Fineness::Source, most) {
                Ok(read) => {
                    told += usize::from(read.damage.is_some());
                    for (surface, header) in read.surfaces.iter().zip(&header.surfaces) {
                        parts(&surface.shown(), header, &[]);
                    }
                }
                Err(damage) => told += usize::from(damage == Damage::Changed),
            }
        }
        assert!(told > 4, "{told} told");
    }
}
