use super::*;
use serde_json::{Value, json};

fn asset(accessor: &Value, views: &Value, bytes: &[u8]) -> Asset {
    Asset {
        json: json!({"accessors": [accessor], "bufferViews": views}),
        buffers: vec![bytes.to_vec().into()],
        ..Asset::default()
    }
}

fn floats(accessor: &Value, views: &Value, bytes: &[u8]) -> Vec<f32> {
    read(&asset(accessor, views, bytes), 0, "/test").unwrap().floats()
}

#[test]
fn each_component_type_is_read_and_normalized() {
    let view = json!([{"buffer": 0, "byteLength": 4}]);
    let read = |component: u32, count: u32, normalized: bool, bytes: &[u8]| {
        let accessor = json!({"bufferView": 0, "componentType": component, "count": count,
            "type": "SCALAR", "normalized": normalized});
        floats(&accessor, &view, bytes)
    };
    assert_eq!(read(5121, 2, true, &[255, 51, 0, 0]), [1.0, 0.2]);
    assert_eq!(read(5121, 2, false, &[255, 51, 0, 0]), [255.0, 51.0]);
    assert_eq!(read(5120, 2, true, &[127, 128, 0, 0]), [1.0, -1.0]);
    assert_eq!(read(5123, 1, true, &[255, 255, 0, 0]), [1.0]);
    assert_eq!(read(5122, 2, true, &[255, 127, 0, 128]), [1.0, -1.0]);
    assert_eq!(read(5125, 1, false, &[1, 1, 0, 0]), [257.0]);
    assert_eq!(read(5126, 1, false, &2.5f32.to_le_bytes()), [2.5]);
}

#[test]
fn what_is_encoded_is_read_back() {
    for (component, normalized) in [
        (ComponentType::I8, true),
        (ComponentType::U8, true),
        (ComponentType::I16, true),
        (ComponentType::U16, true),
        (ComponentType::U8, false),
        (ComponentType::I16, false),
        (ComponentType::F32, false),
    ] {
        let mut elements = Elements { bytes: Vec::new(), component, components: 2, normalized };
        elements.bytes = elements.encode([1.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        assert_eq!(elements.floats(), [1.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        assert_eq!(elements.row(1), [0.0, 1.0]);
    }
}

#[test]
fn strided_elements_are_made_tight() {
    let accessor = json!({"bufferView": 0, "componentType": 5121, "count": 2, "type": "VEC3",
        "byteOffset": 1});
    let views = json!([{"buffer": 0, "byteLength": 8, "byteStride": 4}]);
    assert_eq!(floats(&accessor, &views, &[0, 1, 2, 3, 0, 4, 5, 6]), [1., 2., 3., 4., 5., 6.]);
}

#[test]
fn sparse_values_replace_what_lies_below_or_zeros() {
    let sparse = json!({"count": 1, "indices": {"bufferView": 0, "componentType": 5121},
        "values": {"bufferView": 1}});
    let accessor = json!({"componentType": 5121, "count": 3, "type": "SCALAR", "sparse": sparse});
    let views =
        json!([{"buffer": 0, "byteLength": 1}, {"buffer": 0, "byteOffset": 1, "byteLength": 1}]);
    assert_eq!(floats(&accessor, &views, &[2, 9]), [0.0, 0.0, 9.0]);
}

#[test]
fn what_runs_past_its_data_is_an_error_before_it_is_memory() {
    let views = json!([{"buffer": 0, "byteLength": 8}]);
    for (count, offset) in [(3u64, 0u64), (2, 1), (u64::MAX, 0), (1, u64::MAX)] {
        let accessor = json!({"bufferView": 0, "componentType": 5126, "count": count,
            "type": "SCALAR", "byteOffset": offset});
        let error = read(&asset(&accessor, &views, &[0; 8]), 0, "/test").unwrap_err();
        assert!(error.to_string().starts_with("/accessors/0"), "{error}");
    }
    let zeros = json!({"componentType": 5126, "count": u64::MAX, "type": "VEC4"});
    assert!(read(&asset(&zeros, &json!([]), &[]), 0, "/test").is_err());
    assert!(read(&asset(&json!({}), &json!([]), &[]), 7, "/test").is_err());
}
