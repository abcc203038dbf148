//! Damaged and hostile files: whatever is in them, reading and baking end soon, in a result or an
//! error, and never in a panic.

use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

use crate::common;
use crate::common::assets::{cube, pointers, victim};
use crate::common::build::{Build, glb};
use crate::common::{Random, chained, crc, shapes, within};
use image::RgbaImage;
use seamwise::bake::options::{BakeOptions, Targets};
use seamwise::bake::{Input, bake};
use seamwise::evaluate;
use seamwise::progress::Progress;
use seamwise::report::peak_memory;
use serde_json::{Value, json};
use tempfile::TempDir;

/// Most seconds that one damaged file may take; most take a millisecond.
const MOST_SECONDS: f64 = 10.0;
/// Most memory that any of these may take: all of them are smaller than 100 kB.
const MOST_BYTES: u64 = 1 << 30;

/// Bakes whatever it is given, with everything switched on, and counts what came of it.
struct Victim {
    folder: TempDir,
    options: BakeOptions,
    well: usize,
    errors: usize,
}

impl Victim {
    fn new() -> Self {
        let evaluate = evaluate::Options {
            views: 1,
            resolution: 16,
            samples: 50,
            pixel_tolerance: 1.0,
            screen_height: 128,
        };
        let options =
            BakeOptions { targets: Targets::halves(2), evaluate: Some(evaluate), ..chained() };
        let folder = tempfile::tempdir().expect("a temporary folder");
        Self { folder, options, well: 0, errors: 0 }
    }

    /// Tries every case, by its name and its bytes, on a thread for each core. Not on those of rayon: one
    /// that waits for a part of a bake would begin another case, and count its time.
    fn try_all(cases: impl Iterator<Item = (String, Vec<u8>)> + Send) -> Self {
        let cases = Mutex::new(cases);
        let next = || cases.lock().expect("a case").next();
        let work = || {
            let mut victim = Self::new();
            while let Some((what, bytes)) = next() {
                let _ = victim.try_bake(&what, &bytes);
            }
            victim
        };
        std::thread::scope(|scope| {
            let cores = std::thread::available_parallelism().map_or(1, usize::from);
            let workers: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
            let tried = workers.into_iter().map(|own| own.join().expect("a well worker"));
            let sum = |one: Self, other: Self| Self {
                well: one.well + other.well,
                errors: one.errors + other.errors,
                ..one
            };
            tried.reduce(sum).expect("a worker")
        })
    }

    /// Fails if it panics or takes long. An error has something to say.
    fn try_bake(&mut self, what: &str, bytes: &[u8]) -> Result<(), String> {
        let (start, before) = (Instant::now(), processor_seconds());
        let input = Input::Bytes(bytes, "victim");
        let result = bake(input, self.folder.path(), &self.options, &Progress::hidden());
        // A machine that others keep busy is no fault of a bake.
        let busy =
            processor_seconds().zip(before).map_or(f64::INFINITY, |(now, before)| now - before);
        let seconds = start.elapsed().as_secs_f64().min(busy);
        assert!(seconds < MOST_SECONDS, "{what}: {seconds} s");
        match result {
            Ok(_) => {
                self.well += 1;
                Ok(())
            }
            Err(error) => {
                self.errors += 1;
                let text = error.to_string();
                assert!(!text.is_empty(), "{what}");
                assert!(!text.contains("internal error"), "{what}: {text}");
                Err(text)
            }
        }
    }

    /// Fails if what was tried took more memory than such small files may.
    fn finish(&self) {
        println!("{} baked, {} refused", self.well, self.errors);
        if let Some(bytes) = peak_memory() {
            assert!(bytes < MOST_BYTES, "{bytes} bytes at once");
        }
    }
}

/// Seconds that all threads have spent, in the program and for it, where the system tells.
fn processor_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // After the name, which may hold anything, in brackets: the 12th and the 13th, in hundredths.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks: Vec<f64> = fields.get(11..13)?.iter().filter_map(|own| own.parse().ok()).collect();
    (ticks.len() == 2).then(|| ticks.iter().sum::<f64>() / 100.0)
}

#[test]
fn the_victim_is_well_before_it_is_damaged() {
    let mut victim_bake = Victim::new();
    assert_eq!(victim_bake.try_bake("undamaged", &victim().glb()), Ok(()));
    assert_eq!(victim_bake.try_bake("undamaged", &cube(4).glb()), Ok(()));
}

#[test]
fn a_file_cut_short_is_an_error() {
    within(120, "truncations", || {
        let mut victim = Victim::new();
        let whole = cube(4).glb();
        let all = (0..64).chain((64..whole.len()).step_by(37)).chain([whole.len() - 1]);
        for length in all {
            let result = victim.try_bake(&format!("{length} bytes"), &whole[..length]);
            assert!(result.is_err(), "{length} of {} bytes", whole.len());
        }
        victim.finish();
    });
}

#[test]
fn random_bytes_changed_do_no_harm() {
    within(200, "byte flips", || {
        let mut victim_bake = Victim::new();
        let mut random = Random(1);
        for (name, whole) in [("victim", victim().glb()), ("cube", cube(4).glb())] {
            for case in 0..250 {
                let mut bytes = whole.clone();
                // The document more often than its share of the bytes.
                let limit = if case % 3 == 0 { bytes.len() } else { bytes.len().min(6000) };
                for _ in 0..1 + random.below(4) {
                    let at = random.below(limit);
                    bytes[at] = if case % 2 == 0 {
                        bytes[at] ^ (1 << random.below(8))
                    } else {
                        random.next() as u8
                    };
                }
                let _ = victim_bake.try_bake(&format!("{name} {case}"), &bytes);
            }
        }
        assert!(victim_bake.well > 20 && victim_bake.errors > 20);
        victim_bake.finish();
    });
}

#[test]
fn any_value_of_any_type_anywhere_does_no_harm() {
    within(280, "wrong types", || {
        let build = victim();
        // With its buffer listed, so that it is damaged too.
        let mut document = build.json.clone();
        document["buffers"] = json!([{"byteLength": build.bin.len()}]);
        let wrong = [
            Value::Null,
            json!(-1),
            json!("x"),
            json!([]),
            json!({}),
            json!(1e300),
            json!(0),
            json!(4_294_967_295u64),
            json!(u64::MAX),
        ];
        let case = |(pointer, value): (&String, &Value)| {
            let mut damaged = document.clone();
            *damaged.pointer_mut(pointer).expect("a place in the document") = value.clone();
            let bytes = glb(damaged.to_string().as_bytes(), &build.bin);
            (format!("{pointer} = {value}"), bytes)
        };
        let places = pointers(&document);
        let pairs = places.iter().flat_map(|place| wrong.iter().map(move |value| (place, value)));
        let victim_bake = Victim::try_all(pairs.map(case));
        assert!(victim_bake.well > 100 && victim_bake.errors > 500);
        victim_bake.finish();
    });
}

#[test]
fn any_member_may_be_missing_or_stand_twice_as_long() {
    within(100, "missing members", || {
        let mut victim_bake = Victim::new();
        let build = victim();
        let mut document = build.json.clone();
        document["buffers"] = json!([{"byteLength": build.bin.len()}]);
        for pointer in pointers(&document).iter().skip(1) {
            let (parent, key) = pointer.rsplit_once('/').expect("a member");
            let mut damaged = document.clone();
            match damaged.pointer_mut(parent).expect("a place in the document") {
                Value::Object(object) => drop(object.shift_remove(key)),
                Value::Array(list) => drop(list.remove(key.parse().expect("an index"))),
                _ => unreachable!("a member stands in an object or a list"),
            }
            let bytes = glb(damaged.to_string().as_bytes(), &build.bin);
            let _ = victim_bake.try_bake(&format!("without {pointer}"), &bytes);
            let mut damaged = document.clone();
            if let Some(Value::Array(list)) = damaged.pointer_mut(pointer) {
                list.extend(list.clone());
                let bytes = glb(damaged.to_string().as_bytes(), &build.bin);
                let _ = victim_bake.try_bake(&format!("{pointer} twice"), &bytes);
            }
        }
        victim_bake.finish();
    });
}

#[test]
fn nodes_that_form_no_tree_are_refused() {
    within(20, "cyclic nodes", || {
        let mut victim = Victim::new();
        let with = |nodes: Value, roots: Value| {
            let mut build = Build::of(&shapes::patch(4));
            let mesh = build.json["nodes"][0]["mesh"].clone();
            build.json["nodes"] = nodes;
            build.json["nodes"][0]["mesh"] = mesh;
            build.json["scenes"][0]["nodes"] = roots;
            build.glb()
        };
        let cases = [
            ("its own child", json!([{"children": [0]}]), json!([0])),
            ("a cycle of two", json!([{"children": [1]}, {"children": [0]}]), json!([0])),
            ("a child of two", json!([{}, {"children": [0]}, {"children": [0]}]), json!([1, 2])),
            ("twice a root", json!([{}]), json!([0, 0])),
        ];
        for (what, nodes, roots) in cases {
            assert!(victim.try_bake(what, &with(nodes, roots)).is_err(), "{what}");
        }
        let long = (0..50_000).map(|i| json!({"children": [i + 1]})).chain([json!({})]);
        let chain = with(Value::Array(long.collect()), json!([0]));
        assert_eq!(victim.try_bake("a long chain", &chain), Ok(()));
        // A binary tree whose sides are one: 2^60 paths to its foot.
        let twins = (0..60).map(|i| json!({"children": [i + 1, i + 1]})).chain([json!({})]);
        let tree = with(Value::Array(twins.collect()), json!([0]));
        assert!(victim.try_bake("a tree of twins", &tree).is_err());
    });
}

/// A sheet with one value of its document changed.
fn patch_with(pointer: &str, value: Value) -> Vec<u8> {
    let mut build = Build::of(&shapes::patch(4));
    build.json["buffers"] = json!([{"byteLength": build.bin.len()}]);
    let (parent, key) = pointer.rsplit_once('/').expect("a member");
    build.json.pointer_mut(parent).expect("a place in the document")[key] = value;
    glb(build.json.to_string().as_bytes(), &build.bin)
}

#[test]
fn accessors_past_the_end_are_named() {
    within(60, "accessors", || {
        let mut victim = Victim::new();
        let huge = [json!(26), json!(4_000_000_000u64), json!(u64::MAX), json!(i64::MAX)];
        for value in huge {
            let at = [
                "/accessors/0/count",
                "/accessors/0/byteOffset",
                "/bufferViews/0/byteLength",
                "/bufferViews/0/byteOffset",
                "/buffers/0/byteLength",
                "/accessors/3/count",
            ];
            for pointer in at {
                // A few bytes fewer or more may still lie in the buffer.
                let value = if value == json!(26) && !pointer.starts_with("/accessors/0/count") {
                    json!(1_000_000)
                } else {
                    value.clone()
                };
                let what = format!("{pointer} = {value}");
                let tried = victim.try_bake(&what, &patch_with(pointer, value));
                // A buffer may announce more than its views read.
                if pointer == "/buffers/0/byteLength" && tried.is_ok() {
                    continue;
                }
                let error = tried.expect_err(&what);
                assert!(
                    error.contains("/accessors/")
                        || error.contains("/bufferViews/")
                        || error.contains("/buffers/")
                        || error.contains("/meshes/"),
                    "{what}: {error}"
                );
            }
        }
        for stride in [0, 1, 4, 11, 252, u32::MAX] {
            let _ = victim
                .try_bake("a stride", &patch_with("/bufferViews/0/byteStride", json!(stride)));
        }
        victim.finish();
    });
}

#[test]
fn indices_past_the_vertices_are_named() {
    within(20, "indices", || {
        let mut victim = Victim::new();
        for index in [25, 65_535, u32::MAX] {
            let mut shape = shapes::patch(4);
            shape.triangles[3][1] = index;
            let error = victim.try_bake("an index", &Build::of(&shape).glb()).unwrap_err();
            assert!(error.contains("/accessors/3") || error.contains("/meshes/0"), "{error}");
        }
        let mut build = Build::of(&shapes::patch(4));
        build.json["accessors"][0]["sparse"] = json!({
            "count": 1, "indices": {"bufferView": 3, "componentType": 5125, "byteOffset": 100},
            "values": {"bufferView": 0},
        });
        build.bin[1000..].fill(0xff);
        assert!(victim.try_bake("sparse", &build.glb()).is_err());
    });
}

#[test]
fn what_costs_a_file_nothing_costs_little() {
    within(120, "zeros", || {
        let mut victim = Victim::new();
        // Accessors without a buffer view are all zeros, of any length.
        for count in [1_000u64, 1_000_000, 20_000_000, 4_000_000_000, u64::MAX] {
            let mut build = Build::new();
            let zeros = json!({"componentType": 5126, "count": count, "type": "VEC3"});
            let zeros = build.add("accessors", zeros);
            let primitive = json!({"attributes": {"POSITION": zeros}});
            build.mesh(vec![primitive; 16]);
            assert!(victim.try_bake(&format!("{count} zeros"), &build.glb()).is_err());
        }
        victim.finish();
    });
}

#[test]
fn many_primitives_over_one_list_of_vertices_cost_no_more_than_they_use() {
    within(120, "shared vertices", || {
        let mut victim = Victim::new();
        // 3 triangles in each of 2,000 primitives that share 4,225 vertices: 8 million, if each
        // primitive copied all of them.
        let shape = shapes::patch(64);
        let mut build = Build::new();
        let attributes = build.attributes(&shape);
        let primitives = shape.triangles.chunks(3).take(2000).map(|triangles| {
            let indices = build.indices(triangles.iter().flatten().copied());
            json!({"attributes": attributes, "indices": indices})
        });
        let primitives = primitives.collect();
        build.mesh(primitives);
        assert_eq!(victim.try_bake("shared vertices", &build.glb()), Ok(()));
        victim.finish();
    });
}

#[test]
fn numbers_that_are_none_do_no_harm() {
    within(60, "numbers", || {
        let mut victim = Victim::new();
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN_POSITIVE, 1e-45]
        {
            for attribute in 0..3 {
                let mut shape = shapes::patch(6);
                match attribute {
                    0 => shape.positions[7][1] = bad,
                    1 => shape.normals[7][1] = bad,
                    _ => shape.uvs[7][1] = bad,
                }
                let picture = common::assets::picture(16);
                let mut build = common::assets::textured(&shape, &picture);
                // JSON has no NaN.
                for accessor in 0..3 {
                    build.json["accessors"][accessor]["min"] = json!([-1, -1, -1]);
                    build.json["accessors"][accessor]["max"] = json!([1, 1, 1]);
                }
                let result = victim.try_bake(&format!("{bad} in {attribute}"), &build.glb());
                if attribute == 0 && !bad.is_finite() {
                    assert!(result.is_err(), "a position of {bad}");
                }
            }
        }
        for scale in [0.0, 1e-30, 1e30, 3e38] {
            let mut build = Build::of(&shapes::sphere(12, 6));
            build.json["nodes"][0]["scale"] = json!([scale, scale, scale]);
            let _ = victim.try_bake(&format!("scale {scale}"), &build.glb());
            let _ = victim.try_bake(
                "scaled points",
                &Build::of(&shapes::sphere(12, 6).scaled(scale as f32)).glb(),
            );
        }
        victim.finish();
    });
}

#[test]
fn uvs_far_away_do_not_take_forever() {
    within(60, "UVs", || {
        let mut victim = Victim::new();
        for scale in [1e3f32, 1e6, 1e18, 3e38] {
            let mut shape = shapes::patch(6);
            shape.uvs.iter_mut().flatten().for_each(|x| *x *= scale);
            for wrap in [33071, 33648, 10497] {
                let mut build = common::assets::textured(&shape, &common::assets::picture(64));
                build.json["samplers"][0] = json!({"wrapS": wrap, "wrapT": wrap});
                let _ = victim.try_bake(&format!("UVs of {scale}, wrap {wrap}"), &build.glb());
            }
        }
        victim.finish();
    });
}

/// A textured sheet whose image is these bytes.
fn with_image(bytes: &[u8]) -> Vec<u8> {
    let mut build = common::assets::textured(&shapes::patch(4), &RgbaImage::new(2, 2));
    let view = build.view(bytes);
    build.json["images"][0]["bufferView"] = json!(view);
    build.glb()
}

#[test]
fn images_that_lie_are_refused() {
    within(100, "images", || {
        let mut victim = Victim::new();
        let picture =
            RgbaImage::from_fn(16, 16, |x, y| image::Rgba([x as u8 * 9, y as u8 * 9, 80, 255]));
        let png = common::build::png(&picture);
        let mut jpeg = std::io::Cursor::new(Vec::new());
        image::DynamicImage::ImageRgba8(picture.clone())
            .to_rgb8()
            .write_to(&mut jpeg, image::ImageFormat::Jpeg)
            .expect("a JPEG");
        let jpeg = jpeg.into_inner();
        assert_eq!(victim.try_bake("a PNG", &with_image(&png)), Ok(()));
        assert_eq!(victim.try_bake("a JPEG", &with_image(&jpeg)), Ok(()));
        for side in [0u32, 17, 60_000, 0x7fff_ffff, u32::MAX] {
            let mut lying = png.clone();
            lying[16..20].copy_from_slice(&side.to_be_bytes());
            lying[20..24].copy_from_slice(&side.to_be_bytes());
            let sum = crc(&lying[12..29]).to_be_bytes();
            lying[29..33].copy_from_slice(&sum);
            let error = victim.try_bake(&format!("a PNG of {side}²"), &with_image(&lying));
            assert!(error.is_err_and(|error| error.contains("/images/0")), "a PNG of {side}²");
        }
        let frame = jpeg.windows(2).position(|pair| pair == [0xff, 0xc0]).expect("a frame");
        for side in [0u16, 17, 65_535] {
            let mut lying = jpeg.clone();
            lying[frame + 5..frame + 7].copy_from_slice(&side.to_be_bytes());
            lying[frame + 7..frame + 9].copy_from_slice(&side.to_be_bytes());
            // A decoder may take what is missing for gray.
            let _ = victim.try_bake(&format!("a JPEG of {side}²"), &with_image(&lying));
        }
        for (name, whole) in [("PNG", &png), ("JPEG", &jpeg)] {
            for length in (0..whole.len() - 20).step_by(5) {
                let result = victim.try_bake(
                    &format!("{length} bytes of a {name}"),
                    &with_image(&whole[..length]),
                );
                assert!(result.is_err() || name == "JPEG", "{length} bytes of a {name}");
            }
        }
        victim.finish();
    });
}

#[test]
fn deep_and_odd_documents_are_refused() {
    within(20, "documents", || {
        let mut victim = Victim::new();
        for depth in [100, 1_000, 100_000, 1_000_000] {
            for (open, close) in [("[", "]"), (r#"{"a":"#, "}")] {
                let nested = open.repeat(depth) + "1" + &close.repeat(depth);
                for json in [
                    nested.clone(),
                    format!(r#"{{"asset": {{"version": "2.0"}}, "extras": {nested}}}"#),
                ] {
                    assert!(victim.try_bake("nested", json.as_bytes()).is_err());
                    assert!(victim.try_bake("nested", &glb(json.as_bytes(), &[])).is_err());
                }
            }
        }
        for json in [
            "",
            " ",
            "null",
            "[]",
            "7",
            "\"glTF\"",
            "{}",
            "{\"asset\": 5}",
            "\u{feff}{}",
            "{\"asset\": {\"version\": \"2.0\"}} x",
        ] {
            assert!(victim.try_bake(json, json.as_bytes()).is_err(), "{json}");
        }
        assert!(victim.try_bake("not UTF-8", b"{\"asset\": \"\xff\xfe\"}").is_err());
        victim.finish();
    });
}

#[test]
fn a_container_that_lies_about_its_lengths_is_refused() {
    within(20, "containers", || {
        let mut victim = Victim::new();
        let whole = cube(4).glb();
        let json_length = u32::from_le_bytes([whole[12], whole[13], whole[14], whole[15]]);
        let bin_at = 20 + json_length as usize;
        for (field, at) in [("file", 8), ("document", 12), ("binary chunk", bin_at)] {
            for length in [0, 1, 19, 20, 0x7fff_ffff, u32::MAX] {
                let mut lying = whole.clone();
                lying[at..at + 4].copy_from_slice(&length.to_le_bytes());
                assert!(victim.try_bake(field, &lying).is_err(), "{field} of {length} bytes");
            }
        }
        for version in [0u32, 1, 3, u32::MAX] {
            let mut lying = whole.clone();
            lying[4..8].copy_from_slice(&version.to_le_bytes());
            assert!(victim.try_bake("version", &lying).is_err(), "version {version}");
        }
    });
}

#[test]
fn uris_lead_nowhere_they_should_not() {
    let read = |uri: &str| {
        let json = json!({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": uri}],
            "bufferViews": [{"buffer": 0, "byteLength": 4}],
            "accessors": [{"bufferView": 0, "componentType": 5121, "type": "SCALAR", "count": 4}]});
        seamwise::import::read_bytes(json.to_string().as_bytes(), Path::new("/nonexistent"))
    };
    for uri in [
        "http://example.com/a.bin",
        "https://example.com/a.bin",
        "data:x;base64,****",
        "",
        "%ff",
        "not there.bin",
        "/dev/zero/x",
    ] {
        let error = read(uri).expect_err(uri).to_string();
        assert!(error.contains("/buffers/0"), "{uri}: {error}");
    }
    assert!(read("data:application/octet-stream;base64,AAECAw==").is_ok());
    assert!(read("data:,abcd").is_ok());
}

#[cfg(unix)]
#[test]
fn a_device_is_not_a_buffer() {
    let json = r#"{"asset": {"version": "2.0"}, "bufferViews": [{"buffer": 0, "byteLength": 4}],
        "accessors": [{"bufferView": 0, "componentType": 5121, "type": "SCALAR", "count": 4}],
        "buffers": [{"byteLength": 4, "uri": "/dev/null"}]}"#;
    let error = seamwise::import::read_bytes(json.as_bytes(), Path::new(""));
    assert!(error.is_err());
}
