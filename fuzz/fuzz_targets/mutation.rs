//! Changes values in a document, which stays JSON.

use libfuzzer_sys::fuzzer_mutate;
use serde_json::{Value, json};

/// Numbers that are at an edge of something.
const NUMBERS: [f64; 14] = [
    0.0,
    1.0,
    2.0,
    3.0,
    4.0,
    24.0,
    255.0,
    65_535.0,
    65_536.0,
    4_294_967_295.0,
    4_294_967_296.0,
    9.3e18,
    -1.0,
    0.5,
];

/// Keys that may stand anywhere.
const KEYS: [&str; 40] = [
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "MSFT_lod",
    "accessors",
    "animations",
    "attributes",
    "bufferView",
    "buffers",
    "byteLength",
    "byteOffset",
    "byteStride",
    "children",
    "componentType",
    "count",
    "extensions",
    "images",
    "indices",
    "joints",
    "material",
    "matrix",
    "mesh",
    "mode",
    "normalized",
    "rotation",
    "samplers",
    "scale",
    "scenes",
    "skin",
    "skins",
    "source",
    "sparse",
    "targets",
    "texCoord",
    "uri",
    "values",
    "weights",
];

/// Numbers that follow from a seed (Vigna's splitmix64).
pub struct Random(u64);

impl Random {
    /// Those of a seed.
    pub fn new(seed: u32) -> Self {
        Self(seed.into())
    }

    /// A number below a limit.
    pub fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) % limit.max(1) as u64) as usize
    }
}

/// Changes the first `size` bytes of `data`, up to `most`; tells how many there are then.
#[allow(dead_code, reason = "not all targets that edit JSON change bytes by it")]
pub fn mutate(data: &mut [u8], size: usize, most: usize, seed: u32) -> usize {
    let mut random = Random::new(seed);
    let end = data[..size].iter().position(|&byte| byte == 0);
    let json = end.and_then(|end| serde_json::from_slice::<Value>(&data[..end]).ok());
    let (Some(end), Some(mut json)) = (end, json) else {
        return fuzzer_mutate(data, size, most);
    };
    match random.below(8) {
        0 => return fuzzer_mutate(data, size, most),
        1 => return end + 1 + fuzzer_mutate(&mut data[end + 1..], size - end - 1, most - end - 1),
        _ => {}
    }
    for _ in 0..1 + random.below(3) {
        edit(&mut json, &mut random);
    }
    let text = json.to_string().into_bytes();
    let tail = data[end..size].to_vec();
    let length = text.len() + tail.len();
    if length > most {
        return fuzzer_mutate(data, size, most);
    }
    data[..text.len()].copy_from_slice(&text);
    data[text.len()..length].copy_from_slice(&tail);
    length
}

/// Changes one value.
pub fn edit(json: &mut Value, random: &mut Random) {
    let places = places(json);
    let place = |random: &mut Random| places[random.below(places.len())].clone();
    let (own, other) = (place(random), place(random));
    let other = json.pointer(&other).cloned().unwrap_or_default();
    let Some(own) = json.pointer_mut(&own) else { return };
    match (random.below(6), own) {
        (0, own) => *own = other,
        (1, own) => {
            let any = [json!(null), json!([]), json!({}), json!(""), json!(true), json!([0, 0])];
            *own = any[random.below(any.len())].clone();
        }
        (2, Value::Array(list)) if !list.is_empty() => drop(list.remove(random.below(list.len()))),
        (3, Value::Array(list)) if !list.is_empty() => {
            list.push(list[random.below(list.len())].clone())
        }
        (2, Value::Object(object)) => {
            let key = object.keys().nth(random.below(object.len())).cloned();
            key.map(|key| object.remove(&key));
        }
        (_, Value::Object(object)) => {
            object.insert(KEYS[random.below(KEYS.len())].to_owned(), other);
        }
        (_, Value::Array(list)) => list.push(other),
        (_, own) => *own = number(NUMBERS[random.below(NUMBERS.len())]),
    }
}

/// A number as JSON has it in indices: whole if it is.
fn number(x: f64) -> Value {
    if x.fract() == 0.0 && x >= 0.0 { json!(x as u64) } else { json!(x) }
}

/// Pointers to all values.
fn places(json: &Value) -> Vec<String> {
    let mut places = vec![String::new()];
    let mut next = 0;
    while next < places.len() {
        let at = places[next].clone();
        match json.pointer(&at) {
            Some(Value::Object(object)) => {
                places.extend(
                    object
                        .keys()
                        .map(|key| format!("{at}/{}", key.replace('~', "~0").replace('/', "~1"))),
                );
            }
            Some(Value::Array(list)) => {
                places.extend((0..list.len()).map(|index| format!("{at}/{index}")))
            }
            _ => {}
        }
        next += 1;
    }
    places
}
