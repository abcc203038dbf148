//! Refinement by what is seen: no crack, no flip, errors as they are told, and fine where the eye is near.

use std::collections::HashMap;
use std::sync::atomic::AtomicUsize;
use std::time::Instant;

use glam::{DMat4, DVec3, Vec3};
use seamwise_attr::{
    Camera, Extracted, Goal, Mesh, Options, PointId, SelectiveMesh, Surface, TriangleId, Vertices,
    closest_on_triangle, record_chain, refine_together, weld,
};

/// A hilly square of n × n squares, 1 a side, in the plane of x and z.
fn terrain(n: usize) -> Mesh {
    let height = |x: f32, z: f32| {
        let mut sum = 0.0;
        let (mut size, mut share) = (5.0f32, 0.06f32);
        for octave in 0..6 {
            let turn = octave as f32 * 1.3;
            sum += share * (size * x + turn).sin() * (size * z - 2.0 * turn).cos();
            (size, share) = (2.1 * size, 0.45 * share);
        }
        sum
    };
    let mut vertices = Vertices::default();
    for row in 0..=n {
        for column in 0..=n {
            let (x, z) = (column as f32 / n as f32, row as f32 / n as f32);
            vertices.positions.push(Vec3::new(x, height(x, z), z));
        }
    }
    for row in 0..n {
        for column in 0..n {
            let a = (row * (n + 1) + column) as u32;
            let below = a + n as u32 + 1;
            vertices.triangles.extend([[a, below, a + 1], [a + 1, below, below + 1]]);
        }
    }
    vertices.groups = vec![0; vertices.triangles.len()];
    weld(&vertices).expect("a terrain").mesh
}

fn selective(source: &Mesh, coarsest: usize) -> SelectiveMesh {
    let options = Options::default();
    let recorded = record_chain(source, &[coarsest], &options, &AtomicUsize::new(0)).unwrap();
    SelectiveMesh::new(recorded.scene.meshes()[0].clone())
}

/// The way that the first eye looks.
const AHEAD: Vec3 = Vec3::new(0.4, -0.3, 1.0);

/// An eye at the edge that looks across.
fn camera(way: f32) -> Camera {
    let eye = Vec3::new(0.3 + 0.4 * way, 0.13, -0.02 + 0.5 * way);
    let target = eye + AHEAD - Vec3::X * (0.8 * way);
    Camera::new(eye, target, 0.9, [1280, 720]).expect("a camera")
}

/// Fails unless a mesh is sound, faces up everywhere, and its only border is that of the source.
fn assert_whole(own: &Extracted, source: &Mesh) {
    own.mesh.validate().expect("a sound mesh");
    let border = |mesh: &Mesh| {
        let mut edges: HashMap<[PointId; 2], i32> = HashMap::new();
        for triangle in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.triangle_points(triangle);
            assert!(a != b && b != c && c != a, "two corners at one point");
            for [a, b] in [[a, b], [b, c], [c, a]] {
                *edges.entry([a, b]).or_default() += 1;
                assert_eq!(edges[&[a, b]], 1, "two triangles on one side of an edge");
            }
        }
        let is_border = |own: &&[PointId; 2]| !edges.contains_key(&[own[1], own[0]]);
        edges.keys().filter(is_border).copied().collect::<Vec<_>>()
    };
    // A crack would be a loop more, or a point with two.
    let next: HashMap<PointId, PointId> = border(&own.mesh).iter().map(|&[a, b]| (a, b)).collect();
    let start = *next.keys().next().expect("a border");
    let (mut at, mut length) = (next[&start], 1);
    while at != start {
        (at, length) = (next[&at], length + 1);
    }
    assert_eq!(length, border(&own.mesh).len(), "a crack");
    for triangle in 0..own.mesh.triangles.len() {
        let [a, b, c] = own.mesh.triangle_positions(triangle);
        assert!((b - a).cross(c - a).y > 0.0, "triangle {triangle} has flipped");
    }
    assert!(own.mesh.triangles.len() <= source.triangles.len());
}

/// How many of a mesh's triangles lie in each third of the terrain, by the distance from an eye.
fn thirds(source: &Mesh, own: &Mesh, eye: Vec3) -> [usize; 3] {
    let mut distances: Vec<f32> = source.positions.iter().map(|own| own.distance(eye)).collect();
    distances.sort_by(f32::total_cmp);
    let mut thirds = [0; 3];
    for triangle in 0..own.triangles.len() {
        let middle = own.triangle_positions(triangle).iter().sum::<Vec3>() / 3.0;
        let nearer = distances.partition_point(|&own| own < middle.distance(eye));
        thirds[(3 * nearer / distances.len()).min(2)] += 1;
    }
    thirds
}

/// The largest error in pixels of a point of the source in the picture, by brute force.
fn seen_error(source: &Mesh, own: &Mesh, camera: &Camera) -> f32 {
    let corners = own.triangles.iter().map(|t| t.map(|w| own.wedge_points[w].0));
    let surface = Surface::new(&own.positions, corners);
    let mut most = 0.0f32;
    for &position in &source.positions {
        if !camera.sees(position, 0.0) {
            continue;
        }
        let nearest = surface.closest_point(position).expect("a point");
        let off = nearest.point.distance(position);
        most = most.max(camera.pixels_of(off, camera.eye().distance(position)));
    }
    most
}

/// The luminance of a matt surface that the first camera sees, by rays.
fn lit(mesh: &Mesh) -> Vec<f32> {
    let corners = mesh.triangles.iter().map(|t| t.map(|w| mesh.wedge_points[w].0));
    let surface = Surface::new(&mesh.positions, corners);
    let (size, tangent, light) =
        ([480, 270], (0.45f32).tan(), Vec3::new(0.5, 0.6, -0.6).normalize());
    let back = -AHEAD.normalize();
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let pixel = |at: usize| {
        let [x, y] = [at % size[0], at / size[0]].map(|x| x as f32 + 0.5);
        let [x, y] = [2.0 * x - size[0] as f32, size[1] as f32 - 2.0 * y];
        let way = tangent / size[1] as f32 * (x * right + y * up) - back;
        let hit = surface.first_hit(camera(0.0).eye(), way, f32::INFINITY);
        hit.map_or(0.0, |hit| {
            let [a, b, c] = mesh.triangle_positions(hit.triangle.index());
            (b - a).cross(c - a).normalize().dot(light).max(0.0)
        })
    };
    (0..size[0] * size[1]).map(pixel).collect()
}

#[test]
fn a_walk_shows_sound_meshes_whose_errors_are_as_told() {
    let source = terrain(60);
    let mut mesh = selective(&source, 60);
    for frame in 0..12 {
        let camera = camera(frame as f32 / 11.0);
        let goal = match frame % 3 {
            0 => Goal { pixels: 2.0, ..Goal::default() },
            1 => Goal { triangles: 900, ..Goal::default() },
            _ => Goal { triangles: 2000, pixels: 1.0, ..Goal::default() },
        };
        let refined = mesh.refine_for(&[camera], goal);
        let own = mesh.extract();
        assert_eq!(own.mesh.triangles.len(), mesh.triangles());
        assert!(mesh.triangles() <= goal.triangles);
        assert_whole(&own, &source);
        if goal.triangles == usize::MAX {
            assert!(refined.pixels <= goal.pixels);
        }
        let seen = seen_error(&source, &own.mesh, &camera);
        // What faces away counts a tenth, and hills hide some of it; none is off by more than ten times.
        assert!(seen <= 10.0 * refined.pixels.max(0.1), "{seen} of {refined:?}");
    }
}

/// Fails if a point of the source that is in the picture and faces the eye is farther off in it than is told, by
/// brute force: from the nearest places of all triangles of which it may be a point.
fn assert_no_farther(source: &Mesh, mesh: &SelectiveMesh, camera: &Camera, pixels: f32) {
    let own = mesh.extract().mesh;
    let live = (0..source.triangles.len()).map(TriangleId::new).filter(|&at| mesh.is_live(at));
    let errors: Vec<f32> = live.map(|at| mesh.error_at(at)).collect();
    let mut normals = vec![Vec3::ZERO; source.positions.len()];
    for triangle in 0..source.triangles.len() {
        let [a, b, c] = source.triangle_positions(triangle);
        for point in source.triangle_points(triangle) {
            normals[point.index()] += (b - a).cross(c - a);
        }
    }
    for (&place, normal) in source.positions.iter().zip(normals) {
        if !camera.sees(place, 0.0) || normal.dot(camera.eye() - place) < 0.0 {
            continue;
        }
        let seen = camera.project(place).expect("in the picture");
        let off = |(triangle, error): (usize, &f32)| {
            let corners = own.triangle_positions(triangle);
            let (_, foot, square) = closest_on_triangle(place.as_dvec3(), &corners);
            let is_own = square.sqrt() as f32 <= 1.0001 * error + 1e-6;
            let foot = is_own.then(|| camera.project(foot.as_vec3())).flatten()?;
            Some(foot.distance(seen))
        };
        let least = errors.iter().enumerate().filter_map(off).fold(f32::INFINITY, f32::min);
        assert!(least <= 1.01 * pixels + 0.01, "{place} is off by {least} pixels of {pixels}");
    }
}

#[test]
fn no_point_is_farther_off_in_the_picture_than_is_told() {
    let source = terrain(36);
    let mut mesh = selective(&source, 60);
    for frame in 0..6 {
        let camera = camera(frame as f32 / 5.0);
        for goal in [
            Goal { pixels: 6.0, ..Goal::default() },
            Goal { pixels: 1.0, ..Goal::default() },
            Goal { triangles: 500, ..Goal::default() },
        ] {
            let refined = mesh.refine_for(&[camera], goal);
            assert_no_farther(&source, &mesh, &camera, refined.pixels);
        }
    }
}

#[test]
fn a_refinement_of_few_steps_goes_on_in_the_next() {
    let source = terrain(60);
    let mut mesh = selective(&source, 60);
    let [few, many] = [60, usize::MAX].map(|steps| Goal { triangles: 1500, pixels: 1.0, steps });
    let mut before = mesh.triangles();
    for frame in 0..60 {
        let refined = mesh.refine_for(&[camera(frame as f32 / 59.0)], few);
        assert!(refined.splits + refined.collapses <= few.steps);
        assert!(mesh.triangles() <= few.triangles.max(before));
        before = mesh.triangles();
        if frame % 10 == 0 {
            assert_whole(&mesh.extract(), &source);
        }
    }
    // An eye that stands still has all of it after a while, from a mesh far too fine, too.
    for start in [0.0, 1.0] {
        mesh.refine_for(&[camera(start)], Goal { pixels: 0.3, ..Goal::default() });
        let still = camera(0.5);
        let rest = (0..1000).map(|_| mesh.refine_for(&[still], few));
        let last = rest.take_while(|own| own.splits + own.collapses > 0).last().expect("a few");
        assert!(mesh.triangles() <= few.triangles);
        let mut other = mesh.clone();
        let refined = other.refine_for(&[still], many);
        assert!(refined.pixels <= last.pixels && last.pixels < 1.2 * refined.pixels.max(1.0));
    }
}

#[test]
fn meshes_share_their_triangles_by_what_is_seen() {
    let source = terrain(60);
    let mesh = selective(&source, 60);
    let mut meshes = [mesh.clone(), mesh];
    let eye = camera(0.0);
    let far_eye = eye.in_space(&DMat4::from_translation(DVec3::Z * 3.0)).expect("a camera");
    let goal = Goal { triangles: 1500, ..Goal::default() };
    let refined = refine_together(&mut meshes, &[vec![eye], vec![far_eye]], goal);
    let [near, far] = meshes.each_ref().map(SelectiveMesh::triangles);
    assert!(near + far <= goal.triangles && near + far > 1400, "{near} and {far}");
    assert!(near > 2 * far, "{near} and {far}");
    // None has an error left that the other could have made room for.
    for (mesh, camera) in meshes.iter_mut().zip([eye, far_eye]) {
        let goal = Goal { pixels: refined.pixels, ..Goal::default() };
        assert!(mesh.refine_for(&[camera], goal).splits == 0);
    }
}

#[test]
fn all_undone_is_the_source_and_all_done_the_coarsest() {
    let source = terrain(20);
    let mut mesh = selective(&source, 40);
    let coarsest = mesh.extract();
    let camera = camera(0.0);
    mesh.refine_for(&[camera], Goal { pixels: -1.0, ..Goal::default() });
    assert!(mesh.state() == &source && mesh.triangles() == source.triangles.len());
    let all = (0..source.triangles.len()).map(TriangleId::new);
    assert!(all.clone().all(|own| mesh.is_live(own) && mesh.error_at(own) == 0.0));
    mesh.refine_for(&[camera], Goal { triangles: 0, pixels: f32::INFINITY, ..Goal::default() });
    assert!(mesh.extract() == coarsest);
    // The way there does not matter, but for what stays fine a little longer.
    let goal = Goal { pixels: 3.0, ..Goal::default() };
    mesh.refine_for(&[camera], goal);
    let first = mesh.extract();
    mesh.refine_for(&[camera], goal);
    assert!(mesh.extract() == first, "nothing changes for the same picture");
}

/// The numbers of a large terrain. `cargo test --release -p seamwise-attr --test selective -- --ignored --nocapture`.
#[test]
#[ignore = "long: a terrain of half a million triangles; the gate runs it"]
fn a_terrain_of_half_a_million_triangles() {
    let source = terrain(500);
    let start = Instant::now();
    let mut mesh = selective(&source, 1000);
    println!("{} triangles, made ready in {:.1?}", source.triangles.len(), start.elapsed());
    let eye = camera(0.0);
    let budget = Goal { triangles: 10_000, ..Goal::default() };
    let refined = mesh.refine_for(&[eye], budget);
    let own = mesh.extract();
    assert_whole(&own, &source);
    let uniform =
        record_chain(&source, &[10_000], &Options::default(), &AtomicUsize::new(0)).unwrap();
    let shares = [&own.mesh, &uniform.levels[0][0].mesh].map(|mesh| {
        let (all, off) = (lit(&source), lit(mesh));
        let square: f32 = all.iter().zip(&off).map(|(a, b)| (a - b) * (a - b)).sum();
        (square / all.len() as f32).sqrt()
    });
    println!("luminance off by {shares:?}, {:.2} of the uniform level's", shares[0] / shares[1]);
    let seen = seen_error(&source, &own.mesh, &eye);
    let thirds = thirds(&source, &own.mesh, eye.eye());
    println!("{} triangles by thirds {thirds:?}; {refined:?}, seen {seen}", mesh.triangles());
    assert!(thirds[0] >= 3 * thirds[2]);
    assert!(shares[0] < 0.8 * shares[1]);
    for pixels in [4.0, 2.0, 1.0] {
        let goal = Goal { pixels, ..Goal::default() };
        let refined = mesh.refine_for(&[eye], goal);
        let seen = seen_error(&source, &mesh.extract().mesh, &eye);
        println!("{pixels} pixels: {} triangles, {refined:?}, seen {seen}", mesh.triangles());
    }
    walk(&source, mesh, budget);
}

/// Refines for 300 pictures of a walk, five times over: of each the least time, as others may run on the machine.
fn walk(source: &Mesh, mut mesh: SelectiveMesh, budget: Goal) {
    let (mut times, mut steps) = (vec![f64::INFINITY; 300], 0);
    for round in 0..5 {
        mesh.refine_for(&[camera(0.0)], Goal { pixels: 1e3, ..Goal::default() });
        mesh.refine_for(&[camera(0.0)], budget);
        for (frame, least) in times.iter_mut().enumerate() {
            let start = Instant::now();
            let refined = mesh.refine_for(&[camera((frame + 1) as f32 / 300.0)], budget);
            *least = least.min(start.elapsed().as_secs_f64() * 1e3);
            steps += refined.splits + refined.collapses;
            if round == 0 && frame % 50 == 0 {
                assert_whole(&mesh.extract(), source);
            }
        }
    }
    times.sort_by(f64::total_cmp);
    let (median, most) = (times[150], times[299]);
    println!("300 frames: {median:.2} ms, {most:.2} at most; {} steps a frame", steps / 1500);
    assert!(most < 5.0, "{most} ms");
}

#[test]
fn a_record_of_a_large_surface_is_as_fine_in_one_place_as_in_another() {
    // Large enough to be simplified in regions, and with one far target.
    let source = terrain(190);
    let options = Options::default();
    let record = |targets: &[usize]| {
        record_chain(&source, targets, &options, &AtomicUsize::new(0)).expect("a record")
    };
    let mut far = record(&[300]).scene.meshes()[0].clone();
    let between = far.mesh_at(9000);
    let level = &record(&[9000]).levels[0][0].mesh;
    let off = |mesh: &Mesh| {
        let corners = mesh.triangles.iter().map(|t| t.map(|w| mesh.wedge_points[w].0));
        let surface = Surface::new(&mesh.positions, corners);
        let square = |p: &Vec3| surface.closest_point(*p).expect("a point").distance_squared;
        (source.positions.iter().map(square).sum::<f32>() / source.positions.len() as f32).sqrt()
    };
    let [own, other] = [&between, level].map(off);
    assert!(own < 1.1 * other, "{own} of {other}");
}
