//! Whether a document is one that the stages after reading can take, as far as its JSON tells.

use serde_json::Value;

use crate::document::known_extensions::{Describes, known};
use crate::error::{Error, Result};
use crate::warning::Warnings;

/// Checks that it is a glTF document of a version that is known.
pub(super) fn check_version(json: &Value) -> Result<()> {
    match json.pointer("/asset/version").and_then(Value::as_str) {
        Some(version) if version.starts_with("2.") => Ok(()),
        Some(version) => Err(Error::Unsupported { what: format!("glTF version {version}") }),
        None => Err(Error::invalid("/asset/version", "there is none: not a glTF document")),
    }
}

/// Checks that lists are lists and objects are objects wherever a later stage changes them.
pub(super) fn check_shape(json: &Value) -> Result<()> {
    let lists = [
        "accessors",
        "animations",
        "bufferViews",
        "buffers",
        "images",
        "materials",
        "meshes",
        "nodes",
        "samplers",
        "scenes",
        "skins",
        "textures",
    ];
    for list in lists {
        check_objects(json, list, "")?;
    }
    for key in ["extensionsUsed", "extensionsRequired"] {
        if json.get(key).is_some_and(|names| !names.is_array()) {
            return Err(Error::invalid(format!("/{key}"), "not a list"));
        }
    }
    for (index, mesh) in json["meshes"].as_array().into_iter().flatten().enumerate() {
        let at = format!("/meshes/{index}");
        check_objects(mesh, "primitives", &at)?;
        for (part, primitive) in mesh["primitives"].as_array().into_iter().flatten().enumerate() {
            check_objects(primitive, "targets", &format!("{at}/primitives/{part}"))?;
        }
    }
    for (index, node) in json["nodes"].as_array().into_iter().flatten().enumerate() {
        if node.get("children").is_some_and(|children| !children.is_array()) {
            return Err(Error::invalid(format!("/nodes/{index}/children"), "not a list"));
        }
    }
    Ok(())
}

/// Checks that what stands under `key`, if anything, is a list of objects, and that their
/// extensions are objects.
fn check_objects(parent: &Value, key: &str, at: &str) -> Result<()> {
    let Some(list) = parent.get(key) else {
        return Ok(());
    };
    let at = format!("{at}/{key}");
    let list = list.as_array().ok_or_else(|| Error::invalid(&at, "not a list"))?;
    for (index, object) in list.iter().enumerate() {
        if !object.is_object() {
            return Err(Error::invalid(format!("{at}/{index}"), "not an object"));
        }
        if object.get("extensions").is_some_and(|extensions| !extensions.is_object()) {
            return Err(Error::invalid(format!("{at}/{index}/extensions"), "not an object"));
        }
    }
    Ok(())
}

/// Checks that what the document requires is known: see
/// [`known_extensions`](crate::document::known_extensions). With `allow_unknown` the rest is a warning.
pub(super) fn check_extensions(
    json: &Value,
    allow_unknown: bool,
    warnings: &mut Warnings,
) -> Result<()> {
    let at = "/extensionsRequired";
    let required = json.get("extensionsRequired").and_then(Value::as_array);
    for name in required.into_iter().flatten() {
        let name = name.as_str().ok_or_else(|| Error::invalid(at, "names must be strings"))?;
        let why = match known(name).map(|known| known.describes) {
            Some(Describes::Neither | Describes::Read) => continue,
            Some(Describes::Geometry) => ", which describes geometry that changes,",
            Some(Describes::Textures) => ", which describes textures of another kind,",
            None => "",
        };
        if !allow_unknown {
            let what =
                format!("the required extension {name}{why} (--allow-unknown keeps it unread)");
            return Err(Error::Unsupported { what });
        }
        let name: String = name.chars().take(100).collect();
        let what = format!(
            "{name} is required and not known: what it says of geometry and textures is not read; \
             look at the levels where it is"
        );
        warnings.add(at, what);
    }
    Ok(())
}
