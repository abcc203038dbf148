//! The extension's name, its numbers of objects, and the documents beside the one that is opened.

use blake3::Hasher;
use serde_json::{Value, json};

use super::super::files::uri;
use crate::document::asset::Asset;
use crate::document::extensions::name_extension;
use crate::error::Result;
use crate::export::glb::json_bytes;

/// The name of the extension.
pub(super) const NAME: &str = "NEEDLE_progressive";

/// Hexadecimal digits of a hash in a path, and of a number of an object.
const DIGITS: [usize; 2] = [16, 32];

/// Documents beside the one that is opened, in a folder.
pub(super) struct Beside<'a> {
    pub(super) folder: &'a str,
    /// Each with its name, which begins with the folder's.
    pub(super) documents: Vec<(String, Asset)>,
}

impl Beside<'_> {
    /// Adds the documents of one object's levels, which are in them at these places; each gets a number of its
    /// own, that of what all of them hold. Returns those numbers, and of each document what leads there.
    pub(super) fn add(
        &mut self,
        documents: Vec<(String, Asset)>,
        places: &[String],
    ) -> Result<(Vec<String>, Vec<Value>)> {
        let mut all = Hasher::new();
        all.update(self.folder.as_bytes());
        let mut lods = Vec::new();
        for (name, document) in &documents {
            let own = digest(document)?;
            all.update(own.as_bytes());
            let path = uri(&format!("{}/{name}.glb", self.folder));
            lods.push(json!({"path": path, "hash": &own.to_hex()[..DIGITS[0]]}));
        }
        let number = |place: &String| {
            let own = all.clone().update(place.as_bytes()).finalize();
            own.to_hex()[..DIGITS[1]].to_owned()
        };
        let guids: Vec<String> = places.iter().map(number).collect();
        for (name, mut document) in documents {
            for (place, guid) in places.iter().zip(&guids) {
                if let Some(object) = document.json.pointer_mut(place) {
                    object["extensions"][NAME] = json!({"guid": guid, "lods": []});
                }
            }
            name_extension(&mut document.json, NAME);
            self.documents.push((format!("{}/{name}", self.folder), document));
        }
        Ok((guids, lods))
    }
}

/// A hash of all that a document holds.
fn digest(document: &Asset) -> Result<blake3::Hash> {
    let mut hasher = Hasher::new();
    hasher.update(&json_bytes(&document.json)?);
    let images = document.images.iter().map(|image| &image.bytes[..]);
    for bytes in document.buffers.iter().map(|bytes| &bytes[..]).chain(images) {
        hasher.update(bytes);
    }
    Ok(hasher.finalize())
}
