//! Broken parts of a document that do no harm: unused views that can't be read, and textures without an
//! image that can.

use std::sync::Arc;

use serde_json::json;

use crate::document::asset::Asset;
use crate::document::edit::put;
use crate::document::material::sources;
use crate::document::references::used_views;

/// Empties views that nothing uses and that can't be read.
pub(super) fn mend_views(asset: &mut Asset) {
    let used = used_views(&asset.json);
    for index in 0..asset.count("bufferViews") {
        if used.contains(&index) || asset.view(index).is_ok() {
            continue;
        }
        if asset.buffers.is_empty() {
            put(&mut asset.json, "buffers", None, json!({"byteLength": 0}));
            asset.buffers.push(Arc::default());
        }
        let what = "it can't be read, and nothing uses it: emptied; take it from the document";
        asset.warnings.add(format_args!("/bufferViews/{index}"), what);
        asset.json["bufferViews"][index] = json!({"buffer": 0, "byteLength": 0});
    }
}

/// Warns of textures that name no image that can be read.
pub(super) fn warn_of_textures(asset: &mut Asset) {
    for index in 0..asset.count("textures") {
        let at = format!("/textures/{index}");
        // One that is malformed is an error where it is used.
        if sources(asset, &at).is_ok_and(|images| images.is_empty()) {
            let what =
                "it names no PNG, JPEG, WebP or KTX2 image: no texture is there; give it a source";
            asset.warnings.add(at, what);
        }
    }
}
