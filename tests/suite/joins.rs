//! Borders that are meant to be one, and are not to the bit: do levels open cracks there? And borders that
//! only lie near each other: do they stay apart?

use std::collections::BTreeMap;

use crate::common::build::Build;
use crate::common::output::Output;
use crate::common::shapes::Shape;
use crate::common::{Baked, unmeasured};
use glam::{DMat4, DQuat, DVec3, Mat4};
use seamwise::bake::options::BakeOptions;
use seamwise::bake::steering::{BorderLock, Steering};
use seamwise::export::files::OutputOptions;
use serde_json::json;

/// A grid of columns × rows squares bent to `shape` over 0…1 × 0…1, every point computed in doubles.
fn sheet([columns, rows]: [u32; 2], shape: impl Fn(f64, f64) -> DVec3) -> Shape {
    let mut own = Shape::default();
    let at = |u: f64, v: f64| shape(u, v);
    for row in 0..=rows {
        for column in 0..=columns {
            let [u, v] =
                [(column, columns), (row, rows)].map(|(at, n)| f64::from(at) / f64::from(n));
            let across = at(u + 1e-4, v) - at(u - 1e-4, v);
            let up = at(u, v + 1e-4) - at(u, v - 1e-4);
            own.positions.push(at(u, v).as_vec3().to_array());
            own.normals.push(across.cross(up).normalize().as_vec3().to_array());
            own.uvs.push([u as f32, v as f32]);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let [b, c, d] = [a + 1, a + columns + 2, a + columns + 1];
            own.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    own
}

/// The triangles that a scene shows, in the world.
fn world_triangles(output: &Output) -> Vec<[DVec3; 3]> {
    let scene = output.gltf.default_scene().expect("a scene");
    let mut nodes: Vec<_> = scene.nodes().map(|node| (node, DMat4::IDENTITY)).collect();
    let mut triangles = Vec::new();
    while let Some((node, above)) = nodes.pop() {
        let own = Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
        let world = above * own;
        nodes.extend(node.children().map(|child| (child, world)));
        for part in node.mesh().map_or(Vec::new(), |mesh| output.parts(mesh.index())) {
            let place = |v: u32| {
                let p = part.positions[v as usize].map(f64::from);
                world.transform_point3(DVec3::from(p))
            };
            triangles.extend(part.triangles.iter().map(|t| t.map(place)));
        }
    }
    triangles
}

/// Edges of one triangle that no other runs back along, within `near`.
fn open_edges(triangles: &[[DVec3; 3]], near: f64) -> Vec<[DVec3; 2]> {
    let key = |p: DVec3| p.to_array().map(|x| (x + 0.0).to_bits());
    let edges = || triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut exact = BTreeMap::new();
    edges().for_each(|[a, b]| _ = exact.insert([key(a), key(b)], ()));
    let left: Vec<[DVec3; 2]> =
        edges().filter(|&[a, b]| !exact.contains_key(&[key(b), key(a)])).collect();
    let is_met = |&[a, b]: &[DVec3; 2]| {
        left.iter().any(|&[c, d]| a.distance(d) <= near && b.distance(c) <= near)
    };
    left.iter().copied().filter(|edge| !is_met(edge)).collect()
}

fn opened(baked: &Baked, near: f64) -> Vec<usize> {
    let count = |level: &Output| open_edges(&world_triangles(level), near).len();
    baked.levels().iter().map(count).collect()
}

#[test]
fn a_torus_whose_seams_are_roundings_apart_has_no_cracks() {
    let turn = std::f64::consts::TAU;
    let torus = sheet([64, 24], |u, v| {
        let [(sin, cos), (up, out)] = [u, v].map(|x| (x * turn).sin_cos());
        DVec3::new((3.0 + out) * cos, (3.0 + out) * sin, up)
    });
    let glb = Build::of(&torus).glb();
    let baked = Baked::bytes("torus", &glb, &unmeasured());
    assert_eq!(opened(&baked, 1e-6), [0; 4]);
    let output = OutputOptions { compress: true, ..OutputOptions::default() };
    let small = Baked::bytes("torus", &glb, &BakeOptions { output, ..unmeasured() });
    for level in 1..=4 {
        let level = seamwise::import::read(&small.level_path(level)).expect("a level");
        let surface = seamwise::surface::geometry::Geometry::read(&level, &[0]);
        let mesh = surface.expect("a surface").expect("triangles").welded.mesh;
        assert_eq!(seamwise_attr::border_edges(&mesh).len(), 0);
    }
    // What has not moved is as it was.
    let stood: std::collections::BTreeSet<[u32; 3]> =
        torus.positions.iter().map(|p| p.map(f32::to_bits)).collect();
    let options = BakeOptions { polish: None, ..unmeasured() };
    let level = Baked::bytes("torus", &glb, &options).level(1);
    let parts = level.parts(0);
    let own = parts[0].positions.iter().filter(|p| stood.contains(&p.map(f32::to_bits)));
    assert!(own.count() > 100);
}

/// Both halves of a ball, each on a grid of 14 bits over its own box; open around the poles.
fn ball_on_two_grids() -> Build {
    let mut build = Build::new();
    let halves = [0.07, 0.57].map(|from| {
        let turn = std::f64::consts::TAU;
        let mut half = sheet([32, 32], |u, v| {
            let (a, b) = ((from + u / 2.0) * turn, (0.03 + 0.94 * v) * turn / 2.0);
            DVec3::new(b.sin() * a.cos(), b.sin() * a.sin(), b.cos())
        });
        let bound = |pick: fn(f32, f32) -> f32, axis: usize| {
            half.positions.iter().map(|p| p[axis]).reduce(pick).expect("positions")
        };
        let (low, high) =
            ([0, 1, 2].map(|k| bound(f32::min, k)), [0, 1, 2].map(|k| bound(f32::max, k)));
        let side = (0..3).map(|k| high[k] - low[k]).fold(0.0, f32::max);
        let step = side / 16383.0;
        for p in &mut half.positions {
            *p = [0, 1, 2].map(|k| low[k] + ((p[k] - low[k]) / step).round() * step);
        }
        build.primitive(&half)
    });
    build.mesh(halves.to_vec());
    build
}

#[test]
fn primitives_on_grids_of_their_own_do_not_come_apart() {
    let baked = Baked::bytes("ball", &ball_on_two_grids().glb(), &unmeasured());
    for level in baked.levels() {
        for [a, b] in open_edges(&world_triangles(&level), 4e-4) {
            let is_pole = |p: DVec3| p.z.abs() > 0.98;
            assert!(is_pole(a) && is_pole(b), "a crack from {a} to {b}");
        }
    }
}

/// The hill that chunks are cut of.
fn hill(x: f64, y: f64) -> DVec3 {
    DVec3::new(x, 0.08 * (5.0 * x).sin() * (4.0 * y).cos(), -y)
}

/// Chunks of a hill over 0…2 × 0…2, each under a node of its own: `place` tells its transform.
fn chunks(place: impl Fn(u32) -> DMat4) -> Build {
    let mut build = Build::new();
    for number in 0..4 {
        let (x, y) = (f64::from(number % 2), f64::from(number / 2));
        let back = place(number).inverse();
        let shape = sheet([16, 16], |u, v| back.transform_point3(hill(x + u, y + v)));
        let primitive = build.primitive(&shape);
        let (scale, turn, by) = place(number).to_scale_rotation_translation();
        let node = build.mesh(vec![primitive]);
        build.json["nodes"][node] = json!({
            "mesh": number, "translation": by.as_vec3().to_array(),
            "rotation": turn.as_quat().to_array(), "scale": scale.as_vec3().to_array(),
        });
    }
    build
}

fn is_outer([a, b]: [DVec3; 2]) -> bool {
    let on = |axis: usize, at: f64| (a[axis] - at).abs() < 0.03 && (b[axis] - at).abs() < 0.03;
    [0.0, 2.0].into_iter().any(|at| on(0, at) || on(2, -at))
}

#[test]
fn chunks_that_nodes_move_turn_and_scale_do_not_come_apart() {
    let moved =
        |number: u32| DMat4::from_translation(DVec3::new(0.3 + f64::from(number % 2), -1.7, -0.9));
    let turned = |number: u32| {
        let turn = DQuat::from_rotation_y(0.7 * f64::from(number)) * DQuat::from_rotation_x(0.2);
        let by = DVec3::new(f64::from(number), 0.4, 7.0);
        DMat4::from_scale_rotation_translation(DVec3::splat(0.5 + f64::from(number)), turn, by)
    };
    for build in [chunks(moved), chunks(turned)] {
        let baked = Baked::bytes("chunks", &build.glb(), &unmeasured());
        for level in baked.levels() {
            for edge in open_edges(&world_triangles(&level), 1e-5) {
                assert!(is_outer(edge), "a crack from {} to {}", edge[0], edge[1]);
            }
        }
        assert_eq!(baked.chain().gltf.meshes().len(), 4 + 4 * 4);
        // Small integers on grids of several nodes would not meet.
        let output = OutputOptions { compress: true, ..OutputOptions::default() };
        let small = Baked::bytes("chunks", &build.glb(), &BakeOptions { output, ..unmeasured() });
        let level = seamwise::import::read(&small.level_path(2)).expect("a level");
        assert!(level.json["meshes"].as_array().is_some_and(|meshes| meshes.len() == 4));
    }
}

#[test]
fn normals_of_turned_chunks_point_away_from_the_hill() {
    let turned = |number: u32| DMat4::from_rotation_x(1.1 * f64::from(number));
    let baked = Baked::bytes("chunks", &chunks(turned).glb(), &unmeasured());
    let level = baked.level(2);
    for node in level.gltf.nodes() {
        let world = Mat4::from_cols_array_2d(&node.transform().matrix());
        for part in node.mesh().map_or(Vec::new(), |mesh| level.parts(mesh.index())) {
            for normal in &part.normals {
                let up = world.transform_vector3(glam::Vec3::from_slice(normal)).y;
                assert!(up > 0.8, "{up}");
            }
        }
    }
}

#[test]
fn a_plate_of_two_thin_sheets_and_mirrored_halves_stay_meshes_of_their_own() {
    let flat = |z: f64, flip: bool| {
        let mut own = sheet([12, 12], |u, v| DVec3::new(u, v, z));
        if flip {
            own.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        own
    };
    let mut plate = Build::new();
    for shape in [flat(0.0, false), flat(1e-6, true)] {
        let primitive = plate.primitive(&shape);
        plate.mesh(vec![primitive]);
    }
    let mut halves = Build::new();
    for (number, scale) in [(0, 1.0), (1, -1.0)] {
        let half = sheet([12, 12], |u, v| DVec3::new(u, v, 0.1 * (3.0 * u).sin()));
        let primitive = halves.primitive(&half);
        let node = halves.mesh(vec![primitive]);
        halves.json["nodes"][node] = json!({"mesh": number, "scale": [scale, 1.0, 1.0]});
    }
    for build in [plate, halves] {
        let baked = Baked::bytes("plate", &build.glb(), &unmeasured());
        assert_eq!(baked.report.meshes.len(), 2);
    }
}

#[test]
fn tiles_that_are_baked_apart_meet_to_the_bit_where_their_borders_are_locked() {
    let tile = |x: f64| sheet([24, 24], move |u, v| hill(x + u, v));
    for (lock, compress) in
        [(BorderLock::All, false), (BorderLock::All, true), (BorderLock::Sides, false)]
    {
        let border = |x: f64| -> Vec<Vec<[u32; 3]>> {
            let steering = Steering { lock_border: Some(lock), ..Steering::default() };
            let output = OutputOptions { compress, ..OutputOptions::default() };
            let options = BakeOptions { steering, output, ..unmeasured() };
            let baked = Baked::bytes("tile", &Build::of(&tile(x)).glb(), &options);
            let at_cut = |level: usize| {
                let read = seamwise::import::read(&baked.level_path(level));
                let primitive = &seamwise::document::primitive::Primitive::of_mesh(
                    read.as_ref().expect("a level"),
                    0,
                )
                .expect("primitives")[0];
                let positions = primitive.positions(&read.expect("a level")).expect("positions");
                let on = positions.iter().filter(|p| p.x == 1.0);
                let mut on: Vec<[u32; 3]> = on.map(|p| p.to_array().map(f32::to_bits)).collect();
                on.sort_unstable();
                on.dedup();
                on
            };
            (1..=4).map(at_cut).collect()
        };
        let (left, right) = (border(0.0), border(1.0));
        assert!(left == right && left.iter().all(|points| points.len() == 25), "{lock:?}");
    }
}

#[test]
fn what_a_node_squeezes_is_simplified_as_it_is_shown() {
    let bumps = |height: f64| {
        sheet([48, 48], move |u, v| {
            DVec3::new(u, height * 0.05 * (11.0 * u).sin() * (7.0 * v).cos(), -v)
        })
    };
    let shown = |height: f64| {
        let mut build = Build::of(&bumps(height));
        build.json["nodes"][0]["scale"] = json!([1.0, 1.0 / height, 1.0]);
        Baked::bytes("bumps", &build.glb(), &unmeasured())
    };
    let off = |baked: &Baked, level: usize| {
        let triangles = world_triangles(&baked.level(level));
        let points: Vec<DVec3> = triangles.iter().map(|t| (t[0] + t[1] + t[2]) / 3.0).collect();
        let height = |p: &DVec3| p.y - 0.05 * (11.0 * p.x).sin() * (-7.0 * p.z).cos();
        (points.iter().map(|p| height(p).powi(2)).sum::<f64>() / points.len() as f64).sqrt()
    };
    let (plain, squeezed) = (shown(1.0), shown(100.0));
    for level in 1..=4 {
        let (own, other) = (off(&squeezed, level), off(&plain, level));
        assert!(own < 1.1 * other, "{own} and {other} at level {level}");
    }
}
