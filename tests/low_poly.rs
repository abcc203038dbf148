//! Low-poly props: that they are what they are meant to be.

mod common;

use std::collections::{BTreeMap, BTreeSet};

use common::low_poly::MODELS;
use common::output::{Output, half_edges, volume6};

fn source(model: &common::low_poly::Model) -> Output {
    Output::from_bytes(&model.build().glb(), model.name)
}

#[test]
fn props_are_low_poly() {
    for model in MODELS {
        let triangles = source(&model).triangle_count();
        assert!((100..=2000).contains(&triangles), "{}: {triangles} triangles", model.name);
    }
}

#[test]
fn props_are_closed_where_they_are_meant_to_be() {
    for model in MODELS {
        let output = source(&model);
        let parts: Vec<_> =
            (0..output.gltf.meshes().len()).map(|mesh| output.parts(mesh)).collect();
        let closed = parts.iter().all(|parts| {
            let edges = half_edges(parts);
            edges.iter().all(|(&(a, b), count)| edges.get(&(b, a)) == Some(count))
        });
        assert_eq!(closed, model.closed, "{}", model.name);
        if closed && model.name != "doubled_sheet" {
            assert!(parts.iter().all(|parts| volume6(parts) > 0.0), "{}: inside out", model.name);
        }
    }
}

#[test]
fn props_have_hard_edges_and_sound_normals() {
    for model in MODELS {
        let output = source(&model);
        let mut normals: BTreeMap<[u32; 3], BTreeSet<Vec<u32>>> = BTreeMap::new();
        for part in (0..output.gltf.meshes().len()).flat_map(|mesh| output.parts(mesh)) {
            for (position, normal) in part.positions.iter().zip(&part.normals) {
                let length = normal.iter().map(|x| x * x).sum::<f32>().sqrt();
                assert!((length - 1.0).abs() < 1e-4, "{}: a normal of {length}", model.name);
                let normal = normal.iter().map(|x| x.to_bits()).collect();
                normals.entry(position.map(f32::to_bits)).or_default().insert(normal);
            }
            for triangle in &part.triangles {
                let [a, b, c] =
                    triangle.map(|v| glam::Vec3::from_array(part.positions[v as usize]));
                assert!((b - a).cross(c - a).length() > 0.0, "{}: no area", model.name);
            }
        }
        let split = normals.values().filter(|normals| normals.len() > 1).count();
        // Cards have borders instead.
        assert!(split > 0 || !model.closed, "{}: smooth all over", model.name);
    }
}

#[test]
fn props_are_unlike_one_another() {
    let mut known = BTreeSet::new();
    for model in MODELS {
        let output = source(&model);
        let [low, high] = output.scene_box();
        // Ten steps of each side over the longest.
        let shape = ((high - low) / (high - low).max_element() * 10.0).round().as_ivec3();
        let meshes = output.gltf.meshes().len();
        let what = (output.triangle_count() / 50, meshes, shape.to_array());
        assert!(known.insert(what), "{}: as another", model.name);
        assert_eq!(model.build().glb(), model.build().glb(), "{}: not the same twice", model.name);
    }
}
