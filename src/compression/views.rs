//! Buffer views in meshoptimizer's codecs.
//!
//! `EXT_meshopt_compression` and `KHR_meshopt_compression` describe a view in the same words; the
//! latter adds a newer version of the vertex codec and the color filter, and both are read under
//! either name. A decoded view is appended to the buffer that it names, and looks as if it had
//! always stood there. A fallback buffer, which need not have any bytes, so holds decoded views and
//! nothing else.
//!
//! meshoptimizer's decoders are made for streams that nobody trusts: they check every read, and
//! write as many elements as they are told. What they only assert, strides and counts, is checked
//! here, and so is the size, before anything is allocated: of a view against its stream, and of all
//! views against the memory limit, as several may share a stream. Indices may come out as anything;
//! the accessors that read them are checked as all others are.

use serde_json::{Value, json};

use super::append::append;
use super::stream::Stream;
use crate::document::asset::Asset;
use crate::document::extensions::{remove_extension, unlist_extension};
use crate::error::{Error, Result};
use crate::limit::{Budget, MemoryLimit};

/// The names of the extension.
const NAMES: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Most bytes that a byte of a stream stands for. The vertex codec's version 1 spends two bits on
/// 256 equal bytes; no other gives as much for as little.
const MOST_GROWTH: usize = 1024;

/// Whether a buffer is there only for readers without the extension, and so may lack its bytes: it is
/// marked as such, or views are in it and all of them are compressed. Most writers leave the mark out.
pub(crate) fn is_fallback(json: &Value, buffer: usize) -> bool {
    let has = |object: &Value, key: &str| {
        NAMES.iter().find_map(|name| object.pointer(&format!("/extensions/{name}{key}")).cloned())
    };
    if has(&json["buffers"][buffer], "/fallback") == Some(json!(true)) {
        return true;
    }
    let views = json.get("bufferViews").and_then(Value::as_array).into_iter().flatten();
    let mut own = views.filter(|view| view["buffer"] == json!(buffer)).peekable();
    own.peek().is_some() && own.all(|view| has(view, "").is_some())
}

/// Decodes all views that are compressed, and takes the extension from the document.
///
/// # Errors
/// [`Error::Invalid`] with the view.
pub(super) fn expand(asset: &mut Asset, limit: MemoryLimit) -> Result<()> {
    let mut budget = Budget::of(limit);
    for view in 0..asset.count("bufferViews") {
        let view = format!("/bufferViews/{view}");
        let places = NAMES.map(|name| format!("{view}/extensions/{name}"));
        let Some(at) = places.iter().find(|at| asset.json.pointer(at).is_some()) else {
            continue;
        };
        let stream: Stream = asset.parse(at)?;
        let fault = |what: String| Error::invalid(at, what);
        let length = length(asset, &view, &stream).map_err(fault)?;
        budget.take("decoded views", length as u64).map_err(fault)?;
        let decoded = stream.bytes(asset).and_then(|bytes| stream.decode(bytes)).map_err(fault)?;
        replace(asset, &view, &decoded)?;
    }
    for buffer in asset.json.get_mut("buffers").and_then(Value::as_array_mut).into_iter().flatten()
    {
        take_extension(buffer);
    }
    for name in NAMES {
        unlist_extension(&mut asset.json, name);
    }
    Ok(())
}

/// The length of a decoded view, if stream and view agree on it and the stream can hold so much.
fn length(asset: &Asset, view: &str, stream: &Stream) -> std::result::Result<usize, String> {
    let Stream { count, byte_stride, byte_length, .. } = *stream;
    let own = asset.json.pointer(view).and_then(|view| view.get("byteLength")?.as_u64());
    match count.checked_mul(byte_stride) {
        Some(length) if Some(length as u64) != own => {
            Err(format!("{count} elements of {byte_stride} bytes are not as long as the view"))
        }
        Some(length) if length / MOST_GROWTH <= byte_length => Ok(length),
        _ => Err(format!("{count} elements of {byte_stride} bytes out of {byte_length}")),
    }
}

/// Puts a view's bytes at the end of its buffer, instead of what the extension says.
fn replace(asset: &mut Asset, at: &str, decoded: &[u8]) -> Result<()> {
    let (_, start) = append(asset, at, decoded)?;
    if let Some(view) = asset.json.pointer_mut(at) {
        view["byteOffset"] = json!(start);
        take_extension(view);
    }
    Ok(())
}

fn take_extension(json: &mut Value) {
    for name in NAMES {
        remove_extension(json, name);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use meshopt::{
        EncodeExpMode, encode_filter_color, encode_filter_exp, encode_filter_oct,
        encode_filter_quat, encode_index_buffer, encode_index_sequence, encode_vertex_buffer,
        encode_vertex_buffer_level,
    };

    /// An asset with one compressed view of `count` elements, in a fallback buffer.
    fn asset(name: &str, stream: &[u8], description: &Value) -> Asset {
        let [count, stride] = ["count", "byteStride"].map(|key| description[key].as_u64().unwrap());
        let mut extension = json!({"buffer": 0, "byteOffset": 1, "byteLength": stream.len()});
        let own = description.as_object().unwrap().clone();
        extension.as_object_mut().unwrap().extend(own);
        Asset {
            json: json!({
                "bufferViews": [{
                    "buffer": 1, "byteOffset": 0, "byteLength": count * stride,
                    "extensions": {name: extension},
                }],
                "buffers": [
                    {"byteLength": stream.len() + 1},
                    {"byteLength": count * stride, "extensions": {name: {"fallback": true}}},
                ],
                "extensionsUsed": [name], "extensionsRequired": [name],
            }),
            buffers: vec![[&[7], stream].concat().into(), Arc::default()],
            ..Asset::default()
        }
    }

    fn decoded(name: &str, stream: &[u8], description: &Value) -> Vec<u8> {
        let mut asset = asset(name, stream, description);
        assert!(is_fallback(&asset.json, 1) && !is_fallback(&asset.json, 0));
        expand(&mut asset, MemoryLimit::default()).unwrap();
        let length = asset.buffers[1].len();
        let view = json!({"buffer": 1, "byteOffset": 0, "byteLength": length});
        let sizes = json!([{"byteLength": stream.len() + 1}, {"byteLength": length}]);
        assert_eq!(asset.json, json!({"bufferViews": [view], "buffers": sizes}), "plain");
        asset.buffers.remove(1).to_vec()
    }

    fn error(asset: &mut Asset, limit: MemoryLimit) -> String {
        expand(asset, limit).unwrap_err().to_string()
    }

    #[test]
    fn each_mode_comes_back_under_both_names() {
        let rows: Vec<[u8; 12]> = (0..300).map(|i| [i as u8; 12]).collect();
        let indices: Vec<u32> = (0..297).map(|i| (i * 7) % 100).collect();
        let short: Vec<u8> = indices.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect();
        let long: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let old = encode_vertex_buffer_level(&rows, 2, Some(0)).unwrap();
        let new = encode_vertex_buffer(&rows).unwrap();
        let sequence = encode_index_sequence(&indices, 100).unwrap();
        for name in NAMES {
            let attributes = json!({"mode": "ATTRIBUTES", "count": 300, "byteStride": 12});
            assert_eq!(decoded(name, &old, &attributes), rows.as_flattened());
            assert_eq!(decoded(name, &new, &attributes), rows.as_flattened());
            for (stride, bytes) in [(2, &short), (4, &long)] {
                let shape = json!({"mode": "INDICES", "count": 297, "byteStride": stride});
                assert_eq!(decoded(name, &sequence, &shape), *bytes);
            }
        }
    }

    #[test]
    fn a_buffer_without_a_mark_is_a_fallback_if_all_views_in_it_are_compressed() {
        let stream = encode_vertex_buffer(&[[1u8; 16]; 50]).unwrap();
        let shape = json!({"mode": "ATTRIBUTES", "count": 50, "byteStride": 16});
        let mut asset = asset(NAMES[0], &stream, &shape);
        asset.json["buffers"][1].as_object_mut().unwrap().remove("extensions");
        assert!(is_fallback(&asset.json, 1) && !is_fallback(&asset.json, 0));
        let plain = json!({"buffer": 1, "byteOffset": 0, "byteLength": 4});
        asset.json["bufferViews"].as_array_mut().unwrap().push(plain);
        assert!(!is_fallback(&asset.json, 1), "a reader needs its bytes");
    }

    #[test]
    fn triangles_come_back_turned_at_most() {
        let indices: Vec<u32> = (0..50).flat_map(|i| [i, i + 1, i + 2]).collect();
        let stream = encode_index_buffer(&indices, 52).unwrap();
        let shape = json!({"mode": "TRIANGLES", "count": 150, "byteStride": 2});
        let bytes = decoded(NAMES[0], &stream, &shape);
        for (triangle, bytes) in indices.as_chunks::<3>().0.iter().zip(bytes.as_chunks::<6>().0) {
            let mut own =
                [0, 2, 4].map(|at| u32::from(u16::from_le_bytes([bytes[at], bytes[at + 1]])));
            let first = own.iter().position(|index| *index == triangle[0]).unwrap();
            own.rotate_left(first);
            assert_eq!(own, *triangle);
        }
    }

    #[test]
    fn each_filter_gives_what_was_filtered_within_its_bits() {
        let turn = |i: usize| (i as f32 * 0.1).sin_cos();
        let units: Vec<[f32; 4]> =
            (0..100).map(turn).map(|(sin, cos)| [cos * 0.6, cos * 0.8, sin, 0.0]).collect();
        let quaternions: Vec<[f32; 4]> = units.iter().map(|q| [q[3], q[0], q[1], q[2]]).collect();
        let colors: Vec<[f32; 4]> = units.iter().map(|u| u.map(|x| 0.5 + 0.5 * x)).collect();
        let describe = |filter: &str, stride: usize| json!({"mode": "ATTRIBUTES", "filter": filter, "count": 100, "byteStride": stride});
        let close = |values: &[f32], bytes: &[f32], within: f32| {
            assert_eq!(values.len(), bytes.len());
            let far = values.iter().zip(bytes).filter(|(a, b)| (**a - **b).abs() > within).count();
            assert_eq!(far, 0, "{values:?} {bytes:?}");
        };
        let shorts = |bytes: &[u8]| -> Vec<f32> {
            let shorts = bytes.as_chunks::<2>().0.iter();
            shorts.map(|&x| f32::from(i16::from_le_bytes(x)) / 32767.0).collect()
        };
        let bytes = |bytes: &[u8]| -> Vec<f32> {
            bytes.iter().map(|&x| f32::from(x as i8) / 127.0).collect()
        };
        let stream = encode_vertex_buffer(&encode_filter_oct::<i8>(&units, 8)).unwrap();
        close(
            units.as_flattened(),
            &bytes(&decoded(NAMES[0], &stream, &describe("OCTAHEDRAL", 4))),
            0.02,
        );
        let stream = encode_vertex_buffer(&encode_filter_oct::<i16>(&units, 12)).unwrap();
        close(
            units.as_flattened(),
            &shorts(&decoded(NAMES[0], &stream, &describe("OCTAHEDRAL", 8))),
            0.002,
        );
        let stream = encode_vertex_buffer(&encode_filter_quat(&quaternions, 16)).unwrap();
        let turned = shorts(&decoded(NAMES[0], &stream, &describe("QUATERNION", 8)));
        for (quaternion, own) in quaternions.iter().zip(turned.as_chunks::<4>().0) {
            let cos: f32 = quaternion.iter().zip(own).map(|(a, b)| a * b).sum();
            assert!((cos.abs() - 1.0).abs() < 0.001, "the same turn, or its negative");
        }
        let floats: Vec<[f32; 3]> = (0..100).map(|i| [i as f32 * 0.37, -1e3, 1e-3]).collect();
        let exponents = encode_filter_exp(&floats, 24, EncodeExpMode::Separate);
        let stream = encode_vertex_buffer(&exponents).unwrap();
        let back = decoded(NAMES[0], &stream, &describe("EXPONENTIAL", 12));
        let back: Vec<f32> = back.as_chunks().0.iter().map(|&x| f32::from_le_bytes(x)).collect();
        close(floats.as_flattened(), &back, 1e-4);
        let stream = encode_vertex_buffer(&encode_filter_color::<u8>(&colors, 8)).unwrap();
        let back = decoded(NAMES[1], &stream, &describe("COLOR", 4));
        let back: Vec<f32> = back.iter().map(|&x| f32::from(x) / 255.0).collect();
        close(colors.as_flattened(), &back, 0.02);
    }

    #[test]
    fn a_damaged_stream_is_an_error_or_garbage_but_no_panic() {
        let rows: Vec<[u8; 16]> = (0..500).map(|i| [(i * i) as u8; 16]).collect();
        let vertices = encode_vertex_buffer(&rows).unwrap();
        let triangles = encode_index_buffer(&(0..300).collect::<Vec<_>>(), 300).unwrap();
        let sequence = encode_index_sequence(&(0..300).collect::<Vec<_>>(), 300).unwrap();
        for (stream, mode, count, stride) in [
            (vertices, "ATTRIBUTES", 500, 16),
            (triangles, "TRIANGLES", 300, 2),
            (sequence, "INDICES", 300, 4),
        ] {
            let shape = json!({"mode": mode, "count": count, "byteStride": stride});
            for length in 0..stream.len() {
                let mut cut = asset(NAMES[0], &stream[..length], &shape);
                let error = error(&mut cut, MemoryLimit::default());
                assert!(error.starts_with("/bufferViews/0/extensions/EXT_meshopt"), "{error}");
            }
            for at in 0..stream.len() {
                let mut bent = stream.clone();
                bent[at] ^= 0x5a;
                let mut bent = asset(NAMES[0], &bent, &shape);
                let _ = expand(&mut bent, MemoryLimit::default());
            }
        }
    }

    #[test]
    fn wrong_counts_sizes_and_modes_are_errors_with_their_place() {
        // Within a group of 16 a stream does not tell how many there are.
        let stream = encode_vertex_buffer(&[[1u8; 16]; 500]).unwrap();
        let right = json!({"mode": "ATTRIBUTES", "count": 500, "byteStride": 16});
        assert_eq!(decoded(NAMES[0], &stream, &right).len(), 8000);
        let limit = MemoryLimit::default();
        for (key, value) in [
            ("count", json!(600)),
            ("count", json!(0)),
            ("count", json!(1u64 << 50)),
            ("byteStride", json!(8)),
            ("byteStride", json!(6)),
            ("byteStride", json!(512)),
            ("byteLength", json!(1u64 << 60)),
            ("byteOffset", json!(u64::MAX)),
            ("buffer", json!(9)),
            ("mode", json!("TRIANGLES")),
            ("mode", json!("NOTHING")),
            ("filter", json!("OCTAHEDRAL")),
            ("filter", json!("QUATERNION")),
        ] {
            let mut shape = right.clone();
            shape[key] = value;
            let mut asset = asset(NAMES[0], &stream, &shape);
            let error = error(&mut asset, limit);
            assert!(error.starts_with("/bufferViews/0/extensions/EXT"), "{error}");
        }
        let mut differing = asset(NAMES[0], &stream, &right);
        differing.json["bufferViews"][0]["byteLength"] = json!(7999);
        assert!(error(&mut differing, limit).contains("as long as the view"));
        let large = error(&mut asset(NAMES[0], &stream, &right), MemoryLimit::of_bytes(7000));
        assert!(large.contains("--memory-limit"), "{large}");
    }
}
