//! Normals for surfaces that have none, on request.
//!
//! At each corner of a triangle the normal is the mean of the faces around its position that bend from the
//! triangle's own by at most an angle, each by its angle there (Thürmer & Wüthrich, "Computing vertex
//! normals from polygonal facets", Journal of Graphics Tools 1998). Where corners of one vertex differ it
//! becomes several.

use glam::{DVec3, Vec3};
use gltf::json::accessor::ComponentType;
use rustc_hash::{FxHashMap, FxHashSet};
use serde_json::{Value, json};

use super::finite::corner_normals;
use crate::document::accessor::Elements;
use crate::document::asset::Asset;
use crate::document::edit::Packer;
use crate::document::primitive::{Primitive, read_checked};
use crate::document::references::replaced_accessors;
use crate::error::Result;

/// Gives normals to all triangle primitives without, if there is an angle in degrees.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) if such a primitive is malformed.
pub(super) fn add_normals(asset: &mut Asset, degrees: Option<u8>) -> Result<()> {
    let Some(degrees) = degrees else { return Ok(()) };
    let cosine = f64::from(degrees).to_radians().cos() - 1e-9;
    let mut bare = Vec::new();
    for mesh in 0..asset.count("meshes") {
        let own = Primitive::of_mesh(asset, mesh)?.into_iter();
        bare.extend(own.filter(|own| own.is_surface() && own.accessor("NORMAL").is_none()));
    }
    if bare.is_empty() {
        return Ok(());
    }
    let places: FxHashSet<[usize; 2]> = bare.iter().map(|own| [own.mesh, own.index]).collect();
    let is_bare = |own: &Primitive| places.contains(&[own.mesh, own.index]);
    let mut packer = Packer::new(asset, &replaced_accessors(asset, is_bare)?);
    for primitive in &bare {
        add_to(&mut packer, asset, primitive, cosine)?;
    }
    *asset = packer.finish();
    Ok(())
}

/// A surface with a vertex for each normal.
struct Smooth {
    /// One per vertex: the one that it was.
    before: Vec<u32>,
    normals: Vec<Vec3>,
    indices: Vec<u32>,
}

fn add_to(packer: &mut Packer, asset: &Asset, primitive: &Primitive, cosine: f64) -> Result<()> {
    let positions = primitive.positions(asset)?;
    let smooth = smooth(&positions, &primitive.triangles(asset, positions.len())?, cosine);
    let mut add = |name: &str, accessor: usize| -> Result<usize> {
        let at = format!("{}/attributes/{name}", primitive.at);
        let own = read_checked(asset, accessor, &at, positions.len())?;
        let bytes = smooth.before.iter().flat_map(|&vertex| own.element(vertex as usize)).copied();
        let elements = Elements { bytes: bytes.collect(), ..own };
        Ok(packer.add_vertices(&elements, name == "POSITION"))
    };
    let mut attributes = serde_json::Map::new();
    for (name, accessor) in &primitive.attributes {
        attributes.insert(name.clone(), json!(add(name, *accessor)?));
    }
    let mut targets = Vec::new();
    for target in &primitive.targets {
        let mut own = serde_json::Map::new();
        for (name, accessor) in target {
            own.insert(name.clone(), json!(add(name, *accessor)?));
        }
        targets.push(Value::Object(own));
    }
    let bytes = smooth.normals.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes);
    let component = ComponentType::F32;
    let normals = Elements { bytes: bytes.collect(), component, components: 3, normalized: false };
    attributes.insert("NORMAL".to_owned(), json!(packer.add_vertices(&normals, false)));
    let indices = packer.add_indices(&smooth.indices);
    if let Some(json) = packer.json().pointer_mut(&primitive.at).and_then(Value::as_object_mut) {
        json.insert("attributes".to_owned(), Value::Object(attributes));
        json.insert("indices".to_owned(), json!(indices));
        json.remove("mode");
        if !targets.is_empty() {
            json.insert("targets".to_owned(), json!(targets));
        }
    }
    Ok(())
}

fn smooth(positions: &[Vec3], triangles: &[[u32; 3]], cosine: f64) -> Smooth {
    let key = |vertex: u32| (positions[vertex as usize] + 0.0).to_array().map(f32::to_bits);
    let corners: Vec<[DVec3; 3]> = triangles
        .iter()
        .map(|own| corner_normals(own.map(|vertex| positions[vertex as usize].as_dvec3())))
        .collect();
    let mut around: FxHashMap<[u32; 3], Vec<DVec3>> = FxHashMap::default();
    for (triangle, normals) in triangles.iter().zip(&corners) {
        for (&vertex, &normal) in triangle.iter().zip(normals) {
            around.entry(key(vertex)).or_default().push(normal);
        }
    }
    let mut numbers: FxHashMap<(u32, [u32; 3]), u32> = FxHashMap::default();
    let mut own = Smooth { before: Vec::new(), normals: Vec::new(), indices: Vec::new() };
    for (triangle, normals) in triangles.iter().zip(&corners) {
        for (&vertex, normal) in triangle.iter().zip(normals) {
            let face = normal.normalize_or_zero();
            // In the order of the triangles: corners that have the same faces have the same bits.
            let near = around[&key(vertex)].iter().filter(|other| {
                face.dot(**other) >= cosine * other.length() || face == DVec3::ZERO
            });
            let normal = near.sum::<DVec3>().normalize_or(DVec3::Z).as_vec3();
            let bits = normal.to_array().map(f32::to_bits);
            own.indices.push(*numbers.entry((vertex, bits)).or_insert_with(|| {
                own.before.push(vertex);
                own.normals.push(normal);
                own.before.len() as u32 - 1
            }));
        }
    }
    own
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ridge_is_smooth_below_its_angle_and_a_crease_above() {
        // Two faces that meet along y with 60° between their normals.
        let (sin, cos) = 30f32.to_radians().sin_cos();
        let positions =
            [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [cos, 0.0, -sin], [-cos, 0.0, -sin]].map(Vec3::from);
        let triangles = [[0, 2, 1], [0, 1, 3]];
        let of = |degrees: f64| smooth(&positions, &triangles, degrees.to_radians().cos());
        let round = of(61.0);
        assert_eq!(round.before, [0, 2, 1, 3]);
        assert!((round.normals[0] - Vec3::Z).length() < 1e-6, "{}", round.normals[0]);
        let sharp = of(59.0);
        assert_eq!((sharp.before.len(), sharp.indices.len()), (6, 6));
        assert!((sharp.normals[0] - Vec3::new(sin, 0.0, cos)).length() < 1e-6);
    }

    #[test]
    fn vertices_at_one_place_share_their_faces() {
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.3],
            [1.0, 1.0, 0.0],
        ]
        .map(Vec3::from);
        let own = smooth(&positions, &[[0, 1, 2], [3, 5, 4]], -2.0);
        assert_eq!(own.before.len(), 6, "no more than there were");
        assert_eq!(own.normals[1], own.normals[3]);
    }
}
