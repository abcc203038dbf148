//! A surface and the ellipsoids of its points as a .glb.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3, Quat, Vec3};
use seamwise_texture::color::srgb8_to_linear;
use serde_json::{Value, json};

use super::{COLORS, Quadrics};
use crate::document::asset::Asset;
use crate::error::Result;
use crate::evaluate::isosurfaces::Solid;
use crate::export::glb::to_glb as container;

/// Times that each triangle of an octahedron is cut into four to make a sphere.
const CUTS: usize = 3;

/// Lists of numbers as accessors of one buffer.
#[derive(Default)]
struct Lists {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Lists {
    fn add(&mut self, bytes: &[u8], (component, kind): (u32, &str), count: usize) -> usize {
        let start = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": bytes.len()}));
        let view = self.views.len() - 1;
        let accessor =
            json!({"bufferView": view, "componentType": component, "type": kind, "count": count});
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, rows: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let kind = if N == 4 { "VEC4" } else { "VEC3" };
        self.add(&bytes, (5126, kind), rows.len())
    }

    fn positions(&mut self, positions: &[Vec3]) -> usize {
        let rows: Vec<[f32; 3]> = positions.iter().map(Vec3::to_array).collect();
        let at = self.floats(&rows);
        let bound = |pick: fn(Vec3, Vec3) -> Vec3| {
            positions.iter().copied().reduce(pick).unwrap_or_default().to_array()
        };
        self.accessors[at]["min"] = json!(bound(Vec3::min));
        self.accessors[at]["max"] = json!(bound(Vec3::max));
        at
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> usize {
        let bytes: Vec<u8> = triangles.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        self.add(&bytes, (5125, "SCALAR"), 3 * triangles.len())
    }
}

/// The surface and the ellipsoids as a .glb: instances of one sphere (`EXT_mesh_gpu_instancing`).
///
/// # Errors
/// [`Error::Unsupported`](crate::error::Error::Unsupported) if it is larger than the container can hold.
pub fn to_glb(quadrics: &Quadrics) -> Result<Vec<u8>> {
    let mut lists = Lists::default();
    let scene = &quadrics.scene;
    let surface = json!({"name": "surface", "primitives": [{
        "attributes": {"POSITION": lists.positions(&scene.positions)},
        "indices": lists.triangles(&scene.triangles),
        "material": 0,
    }]});
    let (points, corners) = sphere();
    let at = lists.positions(&points);
    let (normals, indices) = (at, lists.triangles(&corners));
    let mut meshes = vec![surface];
    let mut materials = vec![json!({"name": "surface", "doubleSided": true,
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1.0], "metallicFactor": 0.0}})];
    let mut nodes = vec![json!({"name": "surface", "mesh": 0})];
    let mut groups: BTreeMap<usize, Vec<&Solid>> = BTreeMap::new();
    for solid in &quadrics.solids {
        groups.entry(solid.color).or_default().push(solid);
    }
    for (color, solids) in groups {
        let name = format!("ellipsoids {} of {}, from flat to round", color + 1, COLORS.len());
        let [red, green, blue] = COLORS[color].map(srgb8_to_linear);
        materials.push(json!({"name": name, "pbrMetallicRoughness":
            {"baseColorFactor": [red, green, blue, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6}}));
        meshes.push(json!({"name": name, "primitives": [{
            "attributes": {"POSITION": at, "NORMAL": normals}, "indices": indices,
            "material": materials.len() - 1,
        }]}));
        let attributes = instances(&solids, &mut lists);
        nodes.push(json!({"name": name, "mesh": meshes.len() - 1,
            "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}}));
    }
    let children: Vec<usize> = (0..nodes.len()).collect();
    nodes.push(
        json!({"name": "quadrics", "translation": scene.origin.to_array(), "children": children}),
    );
    let (root, extension) = (nodes.len() - 1, ["EXT_mesh_gpu_instancing"]);
    let json = json!({
        "asset": {"version": "2.0", "generator": concat!("Seamwise ", env!("CARGO_PKG_VERSION"))},
        "scene": 0, "scenes": [{"nodes": [root]}], "nodes": nodes, "meshes": meshes,
        "materials": materials, "accessors": lists.accessors, "bufferViews": lists.views,
        "buffers": [{"byteLength": lists.bytes.len()}],
        "extensionsUsed": extension, "extensionsRequired": extension,
    });
    container(&Asset { json, buffers: vec![lists.bytes.into()], ..Asset::default() })
}

/// Where the sphere is for each ellipsoid: turned to its axes and scaled along them.
fn instances(solids: &[&Solid], lists: &mut Lists) -> Value {
    let list = |of: fn(&Solid) -> DVec3| {
        solids.iter().map(|solid| of(solid).as_vec3().to_array()).collect::<Vec<_>>()
    };
    let moves = list(|solid| solid.ellipsoid.center);
    let scales = list(|solid| solid.ellipsoid.half_axes);
    let turn = |solid: &&Solid| {
        let turn = DQuat::from_mat3(&solid.ellipsoid.directions).normalize();
        let turn: Quat = turn.as_quat();
        turn.to_array()
    };
    let turns: Vec<[f32; 4]> = solids.iter().map(turn).collect();
    json!({
        "TRANSLATION": lists.floats(&moves),
        "ROTATION": lists.floats(&turns),
        "SCALE": lists.floats(&scales),
    })
}

/// A sphere of radius 1: an octahedron, cut.
fn sphere() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut points = vec![Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let mut corners: Vec<[u32; 3]> = vec![
        [0, 2, 4],
        [2, 1, 4],
        [1, 3, 4],
        [3, 0, 4],
        [2, 0, 5],
        [1, 2, 5],
        [3, 1, 5],
        [0, 3, 5],
    ];
    for _ in 0..CUTS {
        let mut middles: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut cut = Vec::with_capacity(4 * corners.len());
        for [a, b, c] in corners {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[from, to]| {
                *middles.entry([from.min(to), from.max(to)]).or_insert_with(|| {
                    points.push((points[from as usize] + points[to as usize]).normalize());
                    points.len() as u32 - 1
                })
            });
            cut.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        corners = cut;
    }
    (points, corners)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sphere_is_closed_and_faces_outward() {
        let (points, corners) = sphere();
        assert_eq!(
            (points.len(), corners.len()),
            (258, 512),
            "two less than half of the triangles"
        );
        for [a, b, c] in corners.iter().map(|own| own.map(|at| points[at as usize])) {
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0);
        }
    }
}
