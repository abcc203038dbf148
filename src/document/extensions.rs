//! The lists of extensions that a document uses and requires, kept true as extensions come and go.

use serde_json::{Value, json};

/// Takes an extension from an object, and the empty list of extensions it may leave.
pub(crate) fn remove_extension(json: &mut Value, name: &str) -> Option<Value> {
    let object = json.as_object_mut()?;
    let extensions = object.get_mut("extensions")?.as_object_mut()?;
    let removed = extensions.shift_remove(name);
    if extensions.is_empty() {
        object.shift_remove("extensions");
    }
    removed
}

/// Lists an extension among those used.
pub(crate) fn name_extension(json: &mut Value, name: &str) {
    list_extension(json, "extensionsUsed", name);
}

/// Lists an extension among those used and required.
pub(crate) fn require_extension(json: &mut Value, name: &str) {
    name_extension(json, name);
    list_extension(json, "extensionsRequired", name);
}

fn list_extension(json: &mut Value, key: &str, name: &str) {
    let list = &mut json[key];
    match list.as_array_mut() {
        Some(list) if list.iter().any(|own| own == name) => {}
        Some(list) => list.push(json!(name)),
        None => *list = json!([name]),
    }
}

/// Takes an extension that no object has from the lists of those used and required.
pub(crate) fn drop_unused_extension(json: &mut Value, name: &str) {
    if !is_used(json, name) {
        unlist_extension(json, name);
    }
}

/// Takes an extension from the lists of those used and required, and a list that is empty then.
pub(crate) fn unlist_extension(json: &mut Value, name: &str) {
    let Some(document) = json.as_object_mut() else {
        return;
    };
    for key in ["extensionsUsed", "extensionsRequired"] {
        let Some(list) = document.get_mut(key).and_then(Value::as_array_mut) else {
            continue;
        };
        list.retain(|own| own != name);
        if list.is_empty() {
            document.shift_remove(key);
        }
    }
}

/// Whether any object of a document has an extension.
fn is_used(json: &Value, name: &str) -> bool {
    match json {
        Value::Object(object) => object.iter().any(|(key, value)| {
            let is_own = key == "extensions" && value.get(name).is_some();
            is_own || is_used(value, name)
        }),
        Value::Array(list) => list.iter().any(|value| is_used(value, name)),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_extension_is_listed_as_long_as_an_object_has_it() {
        let mut json = json!({
            "extensionsUsed": ["A", "B"], "extensionsRequired": ["A"],
            "nodes": [{"extensions": {"A": {}, "B": {}}}, {"extensions": {"A": 1}}],
        });
        assert_eq!(remove_extension(&mut json["nodes"][1], "A"), Some(json!(1)));
        assert_eq!(json["nodes"][1], json!({}));
        drop_unused_extension(&mut json, "A");
        assert_eq!(json["extensionsRequired"], json!(["A"]), "the first node has it");
        assert_eq!(remove_extension(&mut json["nodes"][0], "A"), Some(json!({})));
        drop_unused_extension(&mut json, "A");
        assert_eq!(
            json,
            json!({"extensionsUsed": ["B"], "nodes": [{"extensions": {"B": {}}}, {}]})
        );
    }
}
