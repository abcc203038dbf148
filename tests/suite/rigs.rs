//! Do levels move as their sources do? Under morph targets and skins, measured from the outside.

use std::collections::{BTreeMap, BTreeSet};

use crate::common::build::Build;
use crate::common::output::Output;
use crate::common::pose::{Moved, Pose, deform, influences};
use crate::common::rigs::{Kind, bent_bar, halves, second_share, zeros};
use crate::common::{Baked, chained, shared_assets, unmeasured};
use gltf::Semantic;
use gltf::accessor::DataType;
use seamwise::bake::Input;
use seamwise::bake::options::{BakeOptions, BudgetPer, Targets, Textures};
use seamwise::export::files::OutputOptions;
use seamwise::export::glb::to_glb;
use seamwise::import::read;

/// Ways to pose a document's surface.
type Poses = Vec<Box<dyn Fn(&Output) -> Moved>>;

/// Root mean square and maximum over the diagonal of the source as it is posed.
type Figures = (f64, f64);

/// Compares a level with its source in every pose.
fn measure(source: &Output, level: &Output, poses: &Poses) -> Figures {
    let (mut square, mut max) = (0.0, 0.0f64);
    for pose in poses {
        let distances = pose(source).distances(&pose(level), 4000);
        square += distances.rms * distances.rms / poses.len() as f64;
        max = max.max(distances.max);
    }
    (square.sqrt(), max)
}

/// Each animation at four times.
fn animations(output: &Output) -> Poses {
    let count = output.gltf.animations().len();
    let at = |i: usize| -> Box<dyn Fn(&Output) -> Moved> {
        Box::new(move |output| {
            let animation = output.gltf.animations().nth(i / 4).expect("an animation");
            let pose = Pose::animated(output, &animation, (i % 4) as f32 / 4.0 + 0.125);
            deform(output, 0, None, Some(&pose))
        })
    };
    (0..4 * count).map(at).collect()
}

/// Each morph target at weight 1.
fn targets(output: &Output, mesh: usize) -> Poses {
    let document = output.gltf.meshes().nth(mesh).expect("a mesh");
    let count = document.primitives().next().expect("a primitive").morph_targets().len();
    let at = |target: usize| -> Box<dyn Fn(&Output) -> Moved> {
        Box::new(move |output| deform(output, mesh, Some(target), None))
    };
    (0..count).map(at).collect()
}

/// Every joint turned, by two angles.
fn turns(mesh: usize) -> Poses {
    let at = |angle: f32| -> Box<dyn Fn(&Output) -> Moved> {
        Box::new(move |output| deform(output, mesh, None, Some(&Pose::turned(output, angle))))
    };
    [0.2, -0.4].map(at).into()
}

/// A real asset and its levels.
fn bake_real(name: &str, targets: Targets) -> Option<(Output, Baked)> {
    let path = shared_assets()?.join(format!("rigged/{name}.glb"));
    // The limits are those of each mesh's own share.
    let budget_per = BudgetPer::Mesh;
    let options = BakeOptions { textures: Textures::Keep, targets, budget_per, ..unmeasured() };
    Some((Output::read(&path), Baked::input(Input::File(&path), &options).expect("a bake")))
}

/// Fails if a level of 50, 25, 12.5 or 6.25 % is farther from its source than `limits`.
fn assert_within(what: &str, source: &Output, baked: &Baked, poses: &Poses, limits: [Figures; 4]) {
    assert_levels_within(what, source, &baked.levels(), poses, limits);
}

/// The same of levels that were read already.
fn assert_levels_within(
    what: &str,
    source: &Output,
    levels: &[Output],
    poses: &Poses,
    limits: [Figures; 4],
) {
    assert!(!poses.is_empty(), "{what}: nothing moves");
    for (index, (level, limit)) in levels.iter().zip(limits).enumerate() {
        let found = measure(source, level, poses);
        println!("{what}, level {}: RMS {:.6}, maximum {:.5}", index + 1, found.0, found.1);
        assert!(
            found.0 <= limit.0 && found.1 <= limit.1,
            "{what}, level {}: {found:?}, and {limit:?} allowed",
            index + 1
        );
    }
}

/// Fails unless the weights of every vertex sum to 1, with at most four joints a set, each told once.
fn assert_bound(what: &str, output: &Output) {
    for primitive in output.gltf.meshes().flat_map(|mesh| mesh.primitives()) {
        let Some(weights) = primitive.get(&Semantic::Weights(0)) else { continue };
        let whole = match weights.data_type() {
            DataType::U8 => Some(255.0),
            DataType::U16 => Some(65535.0),
            _ => None,
        };
        for influences in influences(output, &primitive) {
            let used = influences.iter().filter(|&&(_, weight)| weight > 0.0);
            let joints: BTreeSet<usize> = used.clone().map(|&(joint, _)| joint).collect();
            assert!(
                influences.len() == 4 && joints.len() == used.count(),
                "{what}: {influences:?}"
            );
            let weights = influences.iter().map(|&(_, weight)| f64::from(weight));
            let sum: f64 = match whole {
                Some(whole) => weights.map(|weight| (weight * whole).round()).sum::<f64>() / whole,
                None => weights.sum(),
            };
            let slack = if whole.is_some() { 0.0 } else { 1e-6 };
            assert!((sum - 1.0).abs() <= slack, "{what}: {influences:?} sum to {sum}");
        }
    }
}

/// What the levels of a fox may be off by in its animations.
const RUNNING: [Figures; 4] = [(0.0027, 0.030), (0.0060, 0.052), (0.0100, 0.069), (0.0175, 0.143)];

#[test]
fn compressed_levels_of_a_fox_run_as_plain_ones_do() {
    let Some(folder) = shared_assets() else { return };
    let path = folder.join("rigged/Fox.glb");
    let output = OutputOptions { compress: true, ..chained().output };
    let options = BakeOptions { textures: Textures::Keep, output, ..unmeasured() };
    let baked = Baked::input(Input::File(&path), &options).expect("a bake");
    let plain = |level: usize| {
        let asset = read(&baked.level_path(level)).expect("an asset");
        Output::from_bytes(&to_glb(&asset).expect("a file"), "Fox")
    };
    let levels: Vec<Output> = (1..=4).map(plain).collect();
    let source = Output::read(&path);
    assert_levels_within("compressed", &source, &levels, &animations(&source), RUNNING);
    levels.iter().for_each(|level| assert_bound("Fox", level));
}

#[test]
fn levels_of_a_fox_run_as_it_does() {
    let Some((source, baked)) = bake_real("Fox", Targets::halves(4)) else { return };
    assert_within("animations", &source, &baked, &animations(&source), RUNNING);
    let limits = [(0.0034, 0.036), (0.0063, 0.046), (0.0105, 0.07), (0.0181, 0.135)];
    assert_within("turns", &source, &baked, &turns(0), limits);
    baked.levels().iter().for_each(|level| assert_bound("Fox", level));
}

#[test]
#[ignore = "long: a real head; the gate runs it"]
fn levels_of_a_face_make_its_faces() {
    let Some((source, baked)) = bake_real("bitmoji", Targets::halves(4)) else { return };
    let limits = [(0.00044, 0.0068), (0.00104, 0.0115), (0.0018, 0.0210), (0.0029, 0.0312)];
    assert_within("turned hair", &source, &baked, &turns(0), limits);
    let limits = [(0.00026, 0.0081), (0.0007, 0.0125), (0.0014, 0.0195), (0.0026, 0.0215)];
    assert_within("turned head", &source, &baked, &turns(1), limits);
    let limits = [(0.00017, 0.0105), (0.00052, 0.0145), (0.00115, 0.019), (0.0023, 0.0277)];
    assert_within("targets", &source, &baked, &targets(&source, 1), limits);
    baked.levels().iter().for_each(|level| assert_bound("bitmoji", level));
}

/// Fails unless every vertex of a level is one of its source, and moves so. Vertices of the source may
/// be lost: those that no triangle uses, and those that differ only in the sign of a zero.
fn assert_same_motion(what: &str, source: &Output, level: &Output) {
    let (before, after) = (motions(source), motions(level));
    let new = after.difference(&before).count();
    assert_eq!(new, 0, "{what}: of {} vertices some are new", after.len());
    assert!(after.len() * 20 > before.len() * 19, "{what}: {} of {}", after.len(), before.len());
}

/// All that moves each vertex, by its bytes, and where it is, to a millionth: next to zero a position
/// is rounded.
fn motions(output: &Output) -> BTreeSet<([i32; 3], Vec<u8>)> {
    let mut all = BTreeSet::new();
    for primitive in output.gltf.meshes().flat_map(|mesh| mesh.primitives()) {
        let positions = output.rows(&primitive.get(&Semantic::Positions).expect("positions"));
        let skin = [Semantic::Joints(0), Semantic::Weights(0)].map(|name| primitive.get(&name));
        let deltas = primitive.morph_targets().map(|target| target.positions());
        let rows: Vec<(Vec<u8>, usize)> = skin
            .into_iter()
            .chain(deltas)
            .flatten()
            .map(|accessor| (output.element_bytes(&accessor), accessor.size()))
            .collect();
        for (vertex, p) in positions.iter().enumerate() {
            let element =
                |(bytes, size): &(Vec<u8>, usize)| bytes[vertex * size..][..*size].to_vec();
            let at = [p[0], p[1], p[2]].map(|x| (x * 1e6).round() as i32);
            all.insert((at, rows.iter().flat_map(element).collect()));
        }
    }
    all
}

#[test]
fn a_level_of_all_triangles_moves_as_its_source_to_the_bit() {
    let whole = || Targets::ratios(vec![1.0]).expect("a ratio");
    for name in ["Fox", "bitmoji"] {
        let Some((source, baked)) = bake_real(name, whole()) else { return };
        assert_same_motion(name, &source, &baked.level(1));
    }
    for kind in [Kind::U8, Kind::U16, Kind::F32] {
        let glb = bent_bar(kind).glb();
        let options = BakeOptions { targets: whole(), ..unmeasured() };
        let baked = Baked::bytes("bar", &glb, &options);
        assert_same_motion(&format!("{kind:?}"), &Output::from_bytes(&glb, "bar"), &baked.level(1));
    }
}

#[test]
fn what_is_linear_along_a_bar_stays_so() {
    for kind in [Kind::U8, Kind::U16, Kind::F32] {
        let baked = Baked::bytes("bar", &bent_bar(kind).glb(), &unmeasured());
        for (index, output) in baked.levels().iter().enumerate() {
            let what = format!("{kind:?}, level {}", index + 1);
            assert_bound(&what, output);
            let mesh = output.gltf.meshes().next().expect("a mesh");
            let primitive = mesh.primitives().next().expect("a primitive");
            let target = primitive.morph_targets().next().expect("a target");
            let stretch = output.rows(&target.positions().expect("deltas"));
            let turns = output.rows(&target.normals().expect("deltas of normals"));
            let positions = &output.parts(0)[0].positions;
            let bound = influences(output, &primitive);
            for (vertex, (position, influences)) in positions.iter().zip(bound).enumerate() {
                let second = influences.iter().filter(|&&(joint, _)| joint == 1);
                let weight: f32 = second.map(|&(_, weight)| weight).sum();
                let off = (weight - second_share(position[0])).abs();
                assert!(off < 1e-3 + 2.0 * kind.step(), "{what}: a weight is off by {off}");
                for delta in [stretch[vertex][0], turns[vertex][2]] {
                    let off = (delta - position[0].clamp(-1.0, 1.0)).abs();
                    assert!(off < 1e-3, "{what}: a delta is off by {off}");
                }
            }
        }
    }
}

/// What the vertices at one position are.
#[derive(Default)]
struct Shared {
    parts: BTreeSet<usize>,
    /// Joints with the bits of their weights.
    bindings: BTreeSet<Vec<(usize, u32)>>,
}

#[test]
fn parts_that_meet_move_as_one() {
    let baked = Baked::bytes("halves", &halves(|_, _| {}).glb(), &unmeasured());
    for (index, output) in baked.levels().iter().enumerate() {
        let mut at: BTreeMap<[u32; 3], Shared> = BTreeMap::new();
        let mesh = output.gltf.meshes().next().expect("a mesh");
        for (part, primitive) in mesh.primitives().enumerate() {
            let positions = &output.parts(0)[part].positions;
            for (position, influences) in positions.iter().zip(influences(output, &primitive)) {
                let entry = at.entry(position.map(f32::to_bits)).or_default();
                entry.parts.insert(part);
                let bits = influences.iter().map(|&(joint, weight)| (joint, weight.to_bits()));
                entry.bindings.insert(bits.collect());
            }
        }
        let shared = at.values().filter(|shared| shared.parts.len() == 2).count();
        assert!(shared >= 2, "level {}: the halves share {shared} points", index + 1);
        assert!(at.values().all(|shared| shared.bindings.len() == 1), "level {}", index + 1);
    }
}

#[test]
fn odd_skins_are_no_obstacle() {
    let odd: [(&str, Build); 4] = [
        (
            "a half without a skin",
            halves(|_, right| {
                let attributes = right["attributes"].as_object_mut().expect("attributes");
                attributes.shift_remove("JOINTS_0");
                attributes.shift_remove("WEIGHTS_0");
            }),
        ),
        (
            "joints without weights",
            halves(|_, right| {
                right["attributes"].as_object_mut().expect("attributes").shift_remove("WEIGHTS_0");
            }),
        ),
        (
            "no weight at all",
            halves(|build, right| {
                let weights = &mut right["attributes"]["WEIGHTS_0"];
                *weights = zeros(build, weights);
            }),
        ),
        (
            "a set of floats for joints",
            halves(|_, right| {
                right["attributes"]["JOINTS_0"] = right["attributes"]["WEIGHTS_0"].clone();
            }),
        ),
    ];
    for (what, build) in odd {
        let progress = seamwise::progress::Progress::hidden();
        let folder = tempfile::tempdir().expect("a folder");
        let input = Input::Bytes(&build.glb(), "odd");
        let report = seamwise::bake::bake(input, folder.path(), &unmeasured(), &progress);
        let report = report.unwrap_or_else(|error| panic!("{what}: {error}"));
        assert!(report.levels.iter().all(|level| level.reached), "{what}: {:?}", report.levels);
    }
}
