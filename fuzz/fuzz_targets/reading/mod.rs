//! What the targets of the reader share: a container around a document, and what a bake reads.

#![allow(dead_code, reason = "each target uses a part of this")]

use std::path::Path;

use seamwise::document::asset::Asset;
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::image_file::codec::decode;
use seamwise::limit::MemoryLimit;
use seamwise::import::options::ReadOptions;
use seamwise::import::read_bytes_of;
use seamwise::surface::group::weld_all;
use serde_json::Value;

/// Most memory that an input may make the reader take.
const LIMIT: MemoryLimit = MemoryLimit::of_bytes(16 << 20);

/// Reads a file as a bake does, up to the descent: whatever comes of it, it must come soon.
pub fn read_all(bytes: &[u8], path: &Path) {
    let options = ReadOptions { memory_limit: LIMIT, ..ReadOptions::default() };
    if let Ok(asset) = read_bytes_of(bytes, path, options) {
        examine(&asset);
    }
}

/// What a bake looks at before the descent: texels, surfaces, and the scene that it evaluates.
fn examine(asset: &Asset) {
    for (index, image) in asset.images.iter().enumerate() {
        let _ = decode(image, &format!("/images/{index}"), LIMIT);
    }
    let _ = weld_all(asset, LIMIT);
    let _ = load(asset, &mut TextureCache::with_limit(LIMIT));
}

/// A .glb of a document and a binary chunk.
pub fn glb(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let chunk = |kind: &[u8; 4], data: &[u8], padding: u8| {
        let length = data.len().next_multiple_of(4);
        let mut chunk = (length as u32).to_le_bytes().to_vec();
        chunk.extend(kind);
        chunk.extend(data);
        chunk.resize(8 + length, padding);
        chunk
    };
    let body = [chunk(b"JSON", json, b' '), chunk(b"BIN\0", bin, 0)].concat();
    let length = (12 + body.len() as u32).to_le_bytes();
    [b"glTF".as_slice(), &2u32.to_le_bytes(), &length, &body].concat()
}

/// Reads a document, whose one buffer is `bin`.
pub fn read_document(json: &Value, bin: &[u8]) {
    read_all(&glb(json.to_string().as_bytes(), bin), Path::new("/nowhere/a.glb"));
}
