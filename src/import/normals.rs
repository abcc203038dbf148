//! Normals that are none: too short or too long, as those of few bits are, zero, or not finite.
//!
//! They are made unit vectors in the document itself, so that the source in the file of all levels is
//! right as well. Where there is no direction to keep, it is that of the triangles around the vertex.

use std::collections::BTreeMap;

use glam::Vec3;
use gltf::json::accessor::ComponentType;
use serde_json::json;

use crate::document::accessor::{self, Elements};
use crate::document::asset::Asset;
use crate::document::edit::put;
use crate::document::primitive::Primitive;
use crate::error::{Error, Result};
use crate::limit::{Budget, MemoryLimit};

/// How far a length may be from 1: what the Khronos validator tolerates, as eight bits a component are
/// rounded by so much.
const MAX_LENGTH_ERROR: f32 = 0.00674;

/// Mends the normals of all primitives.
///
/// # Errors
/// [`Error::Invalid`] if all of them, as floats, take more memory than `limit`: accessors may share their
/// bytes.
pub(super) fn mend_normals(asset: &mut Asset, limit: MemoryLimit) -> Result<()> {
    let mut bytes = Vec::new();
    let (buffer, mut budget) = (asset.buffers.len(), Budget::of(limit));
    for (index, primitive) in normal_accessors(asset) {
        // What is malformed is an error where it is used.
        let Ok([count, _]) = accessor::measure(asset, index) else { continue };
        let taken = budget.take("all normals", count.saturating_mul(12));
        taken.map_err(|what| Error::invalid(format!("/accessors/{index}"), what))?;
        let Some(normals) = mended(asset, index, &primitive) else { continue };
        let view = json!({
            "buffer": buffer, "byteOffset": bytes.len(), "byteLength": 12 * normals.len(),
            "target": 34962,
        });
        bytes.extend(normals.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes));
        let view = put(&mut asset.json, "bufferViews", None, view);
        asset.json["accessors"][index] = json!({
            "bufferView": view, "componentType": ComponentType::F32.as_gl_enum(),
            "count": normals.len(), "type": "VEC3",
        });
    }
    if !bytes.is_empty() {
        put(&mut asset.json, "buffers", None, json!({"byteLength": bytes.len()}));
        asset.buffers.push(bytes.into());
    }
    Ok(())
}

/// The accessors of normals, each with the first primitive that has it.
fn normal_accessors(asset: &Asset) -> BTreeMap<usize, Primitive> {
    let mut found = BTreeMap::new();
    for mesh in 0..asset.count("meshes") {
        for primitive in Primitive::of_mesh(asset, mesh).unwrap_or_default() {
            if let Some(index) = primitive.accessor("NORMAL") {
                found.entry(index).or_insert(primitive);
            }
        }
    }
    found
}

/// The normals of an accessor as unit vectors, with a warning, if one of them is none.
fn mended(asset: &mut Asset, index: usize, primitive: &Primitive) -> Option<Vec<Vec3>> {
    let elements: Elements = accessor::read(asset, index, &primitive.at).ok()?;
    if elements.components != 3 {
        return None;
    }
    let floats = elements.floats();
    let mut normals: Vec<Vec3> = floats.as_chunks().0.iter().map(|&n| Vec3::from(n)).collect();
    let is_unit = |normal: &Vec3| (normal.length() - 1.0).abs() <= MAX_LENGTH_ERROR;
    if normals.iter().all(is_unit) {
        return None;
    }
    let at = format!("/accessors/{index}");
    if normals.iter().any(|normal| !has_direction(normal)) {
        let what = "normals that are zero or not finite are made anew from the triangles around them; \
                    export them again";
        asset.warnings.add(&at, what);
        let around = around(asset, primitive, normals.len());
        for (vertex, normal) in normals.iter_mut().enumerate().filter(|(_, n)| !has_direction(n)) {
            *normal = around.get(vertex).copied().unwrap_or(Vec3::Z);
        }
    }
    if normals.iter().any(|normal| !is_unit(normal)) {
        let what = "normals that are not of unit length are made so; export them with more bits";
        asset.warnings.add(&at, what);
    }
    Some(normals.into_iter().map(|normal| normal.normalize_or(Vec3::Z)).collect())
}

fn has_direction(normal: &Vec3) -> bool {
    normal.try_normalize().is_some()
}

/// One per vertex: the mean direction of its triangles by their area.
fn around(asset: &Asset, primitive: &Primitive, count: usize) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; count];
    let positions = primitive.positions(asset).unwrap_or_default();
    let triangles = match primitive.is_surface() && positions.len() == count {
        true => primitive.triangles(asset, count).unwrap_or_default(),
        false => Vec::new(),
    };
    for triangle in triangles {
        let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
        let normal = (b - a).cross(c - a);
        triangle.iter().for_each(|&vertex| sums[vertex as usize] += normal);
    }
    sums.into_iter().map(|sum| sum.normalize_or(Vec3::Z)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle in the plane z = 0 with these normals, as bytes of −1…1.
    fn triangle(normals: [[i8; 3]; 3]) -> Asset {
        let corners: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let mut bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
        for normal in normals {
            bytes.extend(normal.map(|x| x as u8));
            bytes.push(0);
        }
        let accessor = |view: usize, component: u32| json!({"bufferView": view, "componentType": component, "count": 3, "type": "VEC3"});
        let mut normals = accessor(1, 5120);
        normals["normalized"] = json!(true);
        Asset {
            json: json!({
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}}]}],
                "accessors": [accessor(0, 5126), normals],
                "bufferViews": [{"buffer": 0, "byteLength": 36},
                    {"buffer": 0, "byteOffset": 36, "byteLength": 12, "byteStride": 4}],
                "buffers": [{"byteLength": 48}],
            }),
            buffers: vec![bytes.into()],
            ..Asset::default()
        }
    }

    fn normals(asset: &Asset) -> Vec<Vec3> {
        let floats = accessor::read(asset, 1, "").unwrap().floats();
        floats.as_chunks().0.iter().map(|&n| Vec3::from(n)).collect()
    }

    #[test]
    fn few_bits_are_made_unit_vectors_and_what_has_no_direction_gets_that_of_its_triangles() {
        let mut asset = triangle([[64, 0, 64], [0, 0, 0], [0, -127, 0]]);
        mend_normals(&mut asset, MemoryLimit::default()).unwrap();
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let expected = [Vec3::new(half, 0.0, half), Vec3::Z, Vec3::NEG_Y];
        for (own, expected) in normals(&asset).iter().zip(expected) {
            assert!((own - expected).length() < 1e-6, "{own} {expected}");
        }
        let said: Vec<String> = asset.warnings.iter().map(ToString::to_string).collect();
        assert_eq!(said.len(), 2);
        assert!(
            said.iter().all(|line| line.starts_with("/accessors/1: normals that are")),
            "{said:?}"
        );
    }

    #[test]
    fn normals_as_good_as_eight_bits_can_be_stay_as_they_are() {
        let mut asset = triangle([[73, 73, 73], [127, 0, 0], [90, -90, 0]]);
        let before = asset.json.clone();
        mend_normals(&mut asset, MemoryLimit::default()).unwrap();
        assert_eq!((asset.json, asset.warnings.is_empty()), (before, true));
    }
}
