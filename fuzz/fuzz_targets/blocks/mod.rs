//! Changes in a progressive file that leave its container and its checksums right: written from the page
//! of the format, not from the code that reads it.

use std::io::Read;

use flate2::Crc;
use flate2::read::DeflateDecoder;
use libfuzzer_sys::fuzzer_mutate;
use serde_json::Value;

use crate::mutation::{Random, edit};

/// Most bytes that a column may become.
const MAX_COLUMN: usize = 1 << 16;

/// The document of a .glb, and its buffer.
fn take_apart(bytes: &[u8]) -> Option<(Value, Vec<u8>)> {
    let word =
        |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?) as usize);
    let length = word(12)?;
    let json = serde_json::from_slice(bytes.get(20..)?.get(..length)?).ok()?;
    Some((json, bytes.get(28 + length..)?.to_vec()))
}

fn put_together(json: &Value, buffer: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let word = |length: usize| (length as u32).to_le_bytes();
    let mut glb = [&b"glTF\x02\0\0\0"[..], &word(28 + text.len() + buffer.len())].concat();
    glb.extend([&word(text.len())[..], b"JSON", &text].concat());
    glb.extend([&word(buffer.len())[..], b"BIN\0", buffer].concat());
    glb
}

/// Changes values of the document.
pub fn change_json(bytes: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let (mut json, buffer) = take_apart(bytes)?;
    for _ in 0..1 + random.below(3) {
        let own = json.pointer_mut("/extensions/SEAMWISE_progressive_mesh");
        match own.filter(|_| random.below(4) > 0) {
            Some(own) => edit(own, random),
            None => edit(&mut json, random),
        }
    }
    Some(put_together(&json, &buffer))
}

/// Changes one column of one block, which is stored as it is then.
pub fn change_column(bytes: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let (json, mut buffer) = take_apart(bytes)?;
    let view = json.pointer("/extensions/SEAMWISE_progressive_mesh/bufferView")?;
    let view = json.pointer(&format!("/bufferViews/{view}"))?;
    let start = view.get("byteOffset")?.as_u64()? as usize;
    let mut blocks = Vec::new();
    let mut at = start;
    while let Some(header) = buffer.get(at..at + 8) {
        let length = u32::from_le_bytes(header[..4].try_into().ok()?) as usize;
        buffer.get(at + 8..)?.get(..length)?;
        blocks.push(at..at + 8 + length);
        at += 8 + length;
    }
    let block = blocks.get(random.below(blocks.len()))?.clone();
    let mut columns = unpack(&buffer[block.start + 8..block.end])?;
    let filled: Vec<usize> = (0..columns.len()).filter(|&own| !columns[own].is_empty()).collect();
    let column = &mut columns[*filled.get(random.below(filled.len()))?];
    let size = column.len();
    column.resize((size + 16).min(MAX_COLUMN).max(size), 0);
    let most = column.len();
    let size = fuzzer_mutate(column, size, most);
    column.truncate(size);
    buffer.splice(block, pack(&columns));
    let mut json = json;
    let all = buffer.len();
    *json.pointer_mut("/buffers/0/byteLength")? = all.into();
    let views = json.pointer_mut("/bufferViews")?.as_array_mut()?;
    views.last_mut()?.as_object_mut()?.insert("byteLength".into(), (all - start).into());
    Some(put_together(&json, &buffer))
}

fn unpack(mut rest: &[u8]) -> Option<Vec<Vec<u8>>> {
    let mut columns = Vec::new();
    while !rest.is_empty() {
        let whole = number(&mut rest)?;
        if whole == 0 {
            columns.push(Vec::new());
            continue;
        }
        let packed = number(&mut rest)?;
        let stored = rest.get(..if packed > 0 { packed } else { whole })?;
        rest = &rest[stored.len()..];
        let mut column = stored.to_vec();
        if packed > 0 {
            column.clear();
            DeflateDecoder::new(stored).take(MAX_COLUMN as u64).read_to_end(&mut column).ok()?;
        }
        columns.push(column);
    }
    Some(columns)
}

fn pack(columns: &[Vec<u8>]) -> Vec<u8> {
    let mut payload = Vec::new();
    for column in columns {
        put_number(&mut payload, column.len());
        if !column.is_empty() {
            put_number(&mut payload, 0);
            payload.extend(column);
        }
    }
    let mut crc = Crc::new();
    crc.update(&payload);
    [&(payload.len() as u32).to_le_bytes()[..], &crc.sum().to_le_bytes(), &payload].concat()
}

fn number(rest: &mut &[u8]) -> Option<usize> {
    let mut number = 0;
    for at in 0..5 {
        let (&byte, tail) = rest.split_first()?;
        *rest = tail;
        number |= usize::from(byte & 127) << (7 * at);
        if byte < 128 {
            return Some(number);
        }
    }
    None
}

fn put_number(out: &mut Vec<u8>, mut number: usize) {
    while number > 127 {
        out.push(number as u8 | 128);
        number >>= 7;
    }
    out.push(number as u8);
}
