//! The record of a descent leads back to the source and through every level between.

use std::collections::HashMap;
use std::sync::atomic::AtomicUsize;

use crate::sound::{Recipe, with_options};
use arbitrary::Unstructured;
use glam::Vec3;
use proptest::prelude::*;
use rayon::ThreadPoolBuilder;
use seamwise_attr::{
    Extracted, Layout, Level, Mesh, MorphEnd, Options, PointId, Polish, ProgressiveMesh, Recorded,
    Shared, Vertices, WedgeId, polish_chain, record_chain, record_together, simplify_chain,
    simplify_together, weld,
};

fn recorded(recipe: &Recipe) -> Option<(Mesh, (Recorded, Vec<Level>))> {
    with_options(recipe, |mesh, targets, options| {
        let done = AtomicUsize::new(0);
        let levels = simplify_chain(mesh, targets, options, &done).expect("levels");
        (record_chain(mesh, targets, options, &done).expect("a record"), levels)
    })
}

/// A hilly sheet of n × n squares in two groups, with UVs that jump in its middle and colors.
fn hills(n: usize) -> Mesh {
    let mut vertices =
        Vertices { layout: Layout { uv_sets: 1, normal: true, color: 3 }, ..Vertices::default() };
    for side in [0, 1] {
        let (first, columns) = (vertices.positions.len() as u32, n / 2 + 1);
        for row in 0..=n {
            for column in 0..columns {
                let (x, y) = ((column + side * n / 2) as f32 / n as f32, row as f32 / n as f32);
                let z = 0.1 * (9.0 * x).sin() * (7.0 * y).cos() + 0.01 * (90.0 * x * y).sin();
                vertices.positions.push(Vec3::new(x, y, z));
                let normal = Vec3::new(-x, y, 2.0).normalize();
                vertices.attributes.extend([x + side as f32, y]);
                vertices.attributes.extend(normal.to_array());
                vertices.attributes.extend([x, y, 0.5 + z]);
            }
        }
        for row in 0..n {
            for column in 0..columns - 1 {
                let a = first + (row * columns + column) as u32;
                let above = a + columns as u32;
                vertices.triangles.extend([[a, a + 1, above + 1], [a, above + 1, above]]);
                vertices.groups.extend([u32::from(4 * row > n); 2]);
            }
        }
    }
    weld(&vertices).expect("a sheet").mesh
}

/// Triangles with two corners at one point, and those that lie on another.
fn faults(mesh: &Mesh) -> [usize; 2] {
    let mut known: HashMap<[PointId; 3], usize> = HashMap::new();
    let mut degenerate = 0;
    for triangle in 0..mesh.triangles.len() {
        let mut points = mesh.triangle_points(triangle);
        points.sort_unstable();
        degenerate += usize::from(points[0] == points[1] || points[1] == points[2]);
        *known.entry(points).or_default() += 1;
    }
    [degenerate, known.values().map(|count| count - 1).sum()]
}

/// The wedges of all triangles by their numbers in the source, in order.
fn triangles(mesh: &Mesh, wedges: &[WedgeId]) -> Vec<[WedgeId; 3]> {
    let mut all: Vec<_> = mesh.triangles.iter().map(|own| own.map(|w| wedges[w.index()])).collect();
    all.sort_unstable();
    all
}

/// Fails unless a mesh is a level but for what the level has of the source, which the level gets back
/// rounded.
fn assert_is_level(own: &Extracted, level: &Level, source: &Mesh) {
    assert!(triangles(&own.mesh, &own.wedges) == triangles(&level.mesh, &level.wedge_sources));
    let wedges = |of: &[WedgeId]| -> HashMap<WedgeId, WedgeId> {
        of.iter().zip(0..).map(|(&source, at)| (source, WedgeId(at))).collect()
    };
    let there = wedges(&level.wedge_sources);
    assert_eq!(own.wedges.len(), level.wedge_sources.len());
    for (at, name) in own.wedges.iter().enumerate() {
        let (wedge, other) = (WedgeId::new(at), there[name]);
        let (row, of_level) = (own.mesh.row(wedge), level.mesh.row(other));
        assert!(row == of_level || row == source.row(*name), "{row:?} {of_level:?}");
        let [point, other] = [own.mesh.wedge_points[wedge], level.mesh.wedge_points[other]];
        assert_eq!(own.points[point.index()], level.point_sources[other.index()]);
        let [here, there] = [own.mesh.positions[point], level.mesh.positions[other]];
        assert!(here == there || here == source.positions[own.points[point.index()]]);
    }
}

fn assert_within_one_collapse(mesh: &mut ProgressiveMesh, source: &Mesh, triangles: usize) {
    let level = mesh.mesh_at(triangles);
    level.validate().expect("a sound mesh");
    assert_eq!(level.triangles.len(), mesh.triangles());
    let is_last = mesh.applied() == mesh.collapses();
    assert!(level.triangles.len() <= triangles || is_last, "{} of {triangles}", mesh.triangles());
    let before = mesh.applied().checked_sub(1).map(|at| mesh.triangles_after(at));
    assert!(before.is_none_or(|before| before > triangles));
    let (own, of_source) = (faults(&level), faults(source));
    assert!(own[0] == 0 && own[1] <= of_source[1], "{own:?} of {of_source:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn all_splits_give_the_source_and_each_level_lies_between(
        bytes in prop::collection::vec(any::<u8>(), 0..128),
        counts in prop::collection::vec(any::<u16>(), 8),
    ) {
        let recipe = Recipe::read(&mut Unstructured::new(&bytes)).expect("zeros");
        let Some((source, (recorded, levels))) = recorded(&recipe) else { return Ok(()) };
        let mut mesh = recorded.scene.meshes()[0].clone();
        mesh.validate().unwrap();
        prop_assert!(mesh.extract().mesh.triangles.len() == source.triangles.len());
        prop_assert!(mesh.state() == &source);
        for ((level, own), &at) in levels.iter().zip(&recorded.levels[0]).zip(mesh.levels().to_vec().iter()) {
            prop_assert!(level.mesh == own.mesh, "the record changes nothing");
            mesh.seek(at);
            let extracted = mesh.extract();
            prop_assert_eq!(&extracted.mesh.groups, &level.mesh.groups);
            assert_is_level(&extracted, level, &source);
            prop_assert_eq!(mesh.error(), level.error as f32);
        }
        for count in counts {
            let count = usize::from(count) % (source.triangles.len() + 1);
            assert_within_one_collapse(&mut mesh, &source, count);
        }
        mesh.seek(0);
        prop_assert!(mesh.state() == &source);
    }

    #[test]
    fn to_coarsen_and_to_refine_again_changes_nothing(
        bytes in prop::collection::vec(any::<u8>(), 64),
        steps in prop::collection::vec((any::<u8>(), any::<bool>()), 12),
    ) {
        let recipe = Recipe::read(&mut Unstructured::new(&bytes)).expect("zeros");
        let Some((_, (recorded, _))) = recorded(&recipe) else { return Ok(()) };
        let mut mesh = recorded.scene.meshes()[0].clone();
        for (n, is_coarser_first) in steps {
            let before = mesh.clone();
            let n = usize::from(n);
            if is_coarser_first {
                let done = mesh.coarsen(n);
                prop_assert_eq!(mesh.refine(done), done);
            } else {
                let done = mesh.refine(n);
                prop_assert_eq!(mesh.coarsen(done), done);
            }
            prop_assert!(mesh == before);
            mesh.coarsen(n / 2);
        }
    }
}

#[test]
fn attributes_at_a_level_are_those_of_the_level() {
    let source = hills(24);
    let options = Options::default();
    let targets = [600, 300, 100, 40];
    let Recorded { levels, scene } =
        record_chain(&source, &targets, &options, &AtomicUsize::new(0)).unwrap();
    let mut mesh = scene.meshes()[0].clone();
    for (level, target) in levels[0].iter().zip(targets) {
        mesh.mesh_at(target);
        assert_is_level(&mesh.extract(), level, &source);
    }
    assert!(mesh.collapses() > 500);
}

#[test]
fn a_settled_mesh_is_each_polished_level_to_the_bit_and_does_not_jump_between() {
    let source = hills(24);
    let (options, done) = (Options::default(), AtomicUsize::new(0));
    let targets = [600, 300, 100, 40];
    let Recorded { mut levels, scene } = record_chain(&source, &targets, &options, &done).unwrap();
    polish_chain(&source, &mut levels[0], &options, &Polish::default(), &done).unwrap();
    let mut mesh = scene.meshes()[0].clone();
    let places = mesh.levels().to_vec();
    mesh.settle(&places, &levels[0].iter().collect::<Vec<_>>());
    mesh.validate().unwrap();
    for (level, target) in levels[0].iter().zip(targets) {
        assert!(mesh.mesh_at(target) == level.mesh, "{target}");
    }
    mesh.seek(0);
    assert!(mesh.state() == &source);
    // One collapse before a level and at it: all but what that collapse moves stays.
    let length = |a: Vec3, b: Vec3| f64::from(a.distance(b));
    for at in places {
        mesh.seek(at - 1);
        let (before, gone) = (mesh.extract(), mesh.collapse(at - 1).points.to_vec());
        mesh.seek(at);
        let after = mesh.extract();
        let there: HashMap<PointId, Vec3> =
            after.points.iter().copied().zip(after.mesh.positions.iter().copied()).collect();
        let stays = before.points.iter().zip(&before.mesh.positions);
        let moves = stays
            .filter(|(point, _)| !gone.contains(point))
            .filter_map(|(point, p)| Some(length(*p, *there.get(point)?)));
        let farthest = moves.fold(0.0, f64::max);
        assert!(farthest < 2e-3, "{farthest} at {at}");
    }
}

#[test]
fn a_large_mesh_has_one_record_at_any_number_of_threads() {
    let source = hills(200);
    let targets = [40_000, 10_000, 5_000];
    let run = |threads: usize| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let done = AtomicUsize::new(0);
        pool.install(|| record_chain(&source, &targets, &Options::default(), &done)).unwrap()
    };
    let (one, three) = (run(1), run(3));
    assert!(one.scene == three.scene);
    let levels =
        simplify_chain(&source, &targets, &Options::default(), &AtomicUsize::new(0)).unwrap();
    let mut mesh = one.scene.meshes()[0].clone();
    mesh.validate().unwrap();
    assert!(mesh.state() == &source);
    for (level, own) in levels.iter().zip(&one.levels[0]) {
        assert!(level.mesh == own.mesh, "the record changes nothing");
        mesh.mesh_at(level.target);
        assert_is_level(&mesh.extract(), level, &source);
    }
    for at in 1..20 {
        assert_within_one_collapse(&mut mesh, &source, at * 4001);
    }
}

#[test]
fn surfaces_that_share_a_budget_go_down_in_one_order() {
    let meshes = [hills(20), hills(12), hills(6)];
    let shared: Vec<Shared<'_>> = meshes
        .iter()
        .map(|mesh| Shared { mesh, options: Options::default(), stretches: &[1.0] })
        .collect();
    let targets = [600, 300, 80];
    let recorded = record_together(&shared, &targets, &AtomicUsize::new(0)).unwrap();
    let levels = simplify_together(&shared, &targets, &AtomicUsize::new(0)).unwrap();
    let mut scene = recorded.scene;
    for (at, target) in targets.into_iter().enumerate() {
        scene.seek(scene.collapses_to(target));
        assert!(scene.triangles() <= target && scene.triangles() + 2 > target);
        let sources = meshes.iter().zip(&recorded.levels);
        for ((mesh, level), (source, own)) in scene.meshes().iter().zip(&levels).zip(sources) {
            assert!(level[at].mesh == own[at].mesh, "the record changes nothing");
            assert_is_level(&mesh.extract(), &level[at], source);
        }
    }
    for triangles in 80..1160 {
        scene.seek(scene.collapses_to(triangles));
        assert!(scene.triangles().abs_diff(triangles) <= 2);
    }
    scene.seek(0);
    assert!(scene.meshes().iter().zip(&meshes).all(|(own, source)| own.state() == source));
}

/// What each wedge of a level is once it has come to lie in the next.
fn ended(level: &Level, next: &Level, ends: &[MorphEnd]) -> Vec<(Vec3, Vec<u32>)> {
    let bits = |row: &[f32]| row.iter().map(|x| x.to_bits()).collect();
    let end = |(wedge, end): (usize, &MorphEnd)| match *end {
        MorphEnd::Wedge(end) => {
            let point = next.mesh.wedge_points[end];
            (next.mesh.positions[point], bits(next.mesh.row(end)))
        }
        MorphEnd::Place(place) => (place, bits(level.mesh.row(WedgeId::new(wedge)))),
    };
    ends.iter().enumerate().map(end).collect()
}

/// Triangles that have an area, by their group and all that their corners have, the first one first.
type Corner = (Vec<u32>, Vec<u32>);

fn drawn(mesh: &Mesh, wedges: &[(Vec3, Vec<u32>)]) -> Vec<(u32, Vec<Corner>)> {
    let mut all = Vec::new();
    for (triangle, &group) in mesh.triangles.iter().zip(&mesh.groups) {
        let [a, b, c] = triangle.map(|wedge| wedges[wedge.index()].0);
        if a == b || b == c || c == a {
            continue;
        }
        let corner = |wedge: &WedgeId| {
            let (position, row) = &wedges[wedge.index()];
            (position.to_array().map(|x| (x + 0.0).to_bits()).to_vec(), row.clone())
        };
        let mut corners: Vec<_> = triangle.iter().map(corner).collect();
        let first = (0..3).min_by_key(|&at| &corners[at]).expect("three");
        corners.rotate_left(first);
        all.push((group, corners));
    }
    all.sort_unstable();
    all
}

/// Fails unless each level that has come to lie in the next is the next, to the bit.
fn assert_morphs_end(source: &Mesh, levels: &[Level], record: &ProgressiveMesh) {
    let mut record = record.clone();
    let source = Level {
        mesh: source.clone(),
        point_sources: (0..source.positions.len()).map(PointId::new).collect(),
        wedge_sources: (0..source.wedge_points.len()).map(WedgeId::new).collect(),
        target: 0,
        error: 0.0,
        stopped: None,
    };
    let all: Vec<&Level> = [&source].into_iter().chain(levels).collect();
    let places: Vec<usize> = [0].into_iter().chain(record.levels().to_vec()).collect();
    for (pair, places) in all.windows(2).zip(places.windows(2)) {
        let ends = record.morph(pair[0], pair[1], places[0]..places[1]);
        let still: Vec<MorphEnd> = (0..pair[1].mesh.wedge_points.len())
            .map(|at| MorphEnd::Wedge(WedgeId::new(at)))
            .collect();
        let moved = drawn(&pair[0].mesh, &ended(pair[0], pair[1], &ends));
        let next = drawn(&pair[1].mesh, &ended(pair[1], pair[1], &still));
        assert!(moved == next, "{} triangles, not {}", moved.len(), next.len());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn a_level_comes_to_lie_in_the_next_to_the_bit(bytes in prop::collection::vec(any::<u8>(), 0..128)) {
        let recipe = Recipe::read(&mut Unstructured::new(&bytes)).expect("zeros");
        let Some((source, (recorded, _))) = recorded(&recipe) else { return Ok(()) };
        assert_morphs_end(&source, &recorded.levels[0], &recorded.scene.meshes()[0]);
    }
}

#[test]
fn polished_levels_with_seams_and_groups_come_to_lie_in_the_next_to_the_bit() {
    let source = hills(24);
    let (options, done) = (Options::default(), AtomicUsize::new(0));
    let mut recorded = record_chain(&source, &[600, 300, 100, 40], &options, &done).unwrap();
    let levels = &mut recorded.levels[0];
    polish_chain(&source, levels, &options, &Polish::default(), &done).unwrap();
    assert_morphs_end(&source, levels, &recorded.scene.meshes()[0]);
}
