//! Progressive files: any level of them, and the source.

use seamwise::bake::options::{BudgetPer, Targets, Textures};
use seamwise::document::asset::Asset;
use seamwise::document::primitive::Primitive;
use seamwise::export::files::OutputOptions;
use seamwise::export::glb::to_glb;
use seamwise::export::progressive::extract::{Extracted, Fineness, extract, triangles};
use seamwise::import::options::ReadOptions;
use seamwise::import::{read, read_bytes};
use seamwise::{BakeOptions, bake_bytes};
use std::path::Path;

use crate::common::{Random, assets, shared_assets, unmeasured};

fn progressive(name: &str, bytes: &[u8], options: &BakeOptions) -> Vec<u8> {
    let output = OutputOptions { progressive: true, ..options.output };
    let options = BakeOptions { output, textures: Textures::Keep, ..options.clone() };
    let baked = bake_bytes(bytes, name, &options).unwrap_or_else(|e| panic!("{name}: {e}"));
    let own = format!("{name}_progressive.glb");
    let file = baked.files.into_iter().find(|file| file.name == own);
    file.unwrap_or_else(|| panic!("{own} is not there")).bytes
}

fn level(file: &[u8], fineness: Fineness) -> Extracted {
    extract(file, fineness, ReadOptions::default()).expect("a level")
}

/// All triangles with all attributes of their corners, by their primitives and in order.
fn soup(asset: &Asset) -> Vec<Vec<u32>> {
    let mut all = Vec::new();
    for mesh in 0..asset.count("meshes") {
        for own in Primitive::of_mesh(asset, mesh).expect("primitives") {
            if !own.is_surface() {
                continue;
            }
            let count = own.positions(asset).expect("positions").len();
            let mut names = own.attributes.clone();
            names.sort();
            let attributes: Vec<_> = names
                .iter()
                .chain(own.targets.iter().flatten())
                .map(|(_, accessor)| {
                    seamwise::document::accessor::read(asset, *accessor, "").expect("elements")
                })
                .collect();
            for triangle in own.triangles(asset, count).expect("triangles") {
                let mut corners = vec![mesh as u32, own.index as u32];
                for (vertex, elements) in
                    triangle.iter().flat_map(|v| attributes.iter().map(move |e| (v, e)))
                {
                    corners.extend(elements.row(*vertex as usize).iter().map(|x| x.to_bits()));
                }
                all.push(corners);
            }
        }
    }
    all.sort_unstable();
    all
}

/// Triangles of all primitives.
fn count(asset: &Asset) -> u64 {
    let of = |mesh| Primitive::of_mesh(asset, mesh).expect("primitives");
    let surfaces = (0..asset.count("meshes")).flat_map(of).filter(Primitive::is_surface);
    let triangles = |own: Primitive| {
        let count = own.positions(asset).expect("positions").len();
        own.triangles(asset, count).expect("triangles").len() as u64
    };
    surfaces.map(triangles).sum()
}

fn assert_whole(name: &str, source: &Asset, file: &[u8]) {
    let whole = level(file, Fineness::Source);
    assert_eq!((whole.missed, whole.error), (None, 0.0), "{name}");
    let (source, own) = (soup(source), soup(&whole.asset));
    assert_eq!(source.len(), own.len(), "{name}");
    let differs = source.iter().zip(&own).filter(|(a, b)| a != b).count();
    assert_eq!(differs, 0, "{name}: of {}", source.len());
}

#[test]
fn all_splits_give_the_source_whatever_it_carries() {
    let options = BakeOptions { targets: Targets::Ratios(vec![0.6, 0.3]), ..unmeasured() };
    for (name, build) in assets::all() {
        let bytes = build.glb();
        for budget_per in [BudgetPer::Scene, BudgetPer::Mesh] {
            let file = progressive(name, &bytes, &BakeOptions { budget_per, ..options.clone() });
            let source = read_bytes(&bytes, Path::new("")).expect("the source");
            assert_whole(name, &source, &file);
            let plain = read_bytes(&file, Path::new("")).expect("the coarsest level");
            let [coarsest, finest] = triangles(&file).expect("counts");
            assert!(coarsest < finest && count(&plain) >= coarsest, "{name}");
        }
    }
}

#[test]
fn any_count_gives_a_level_of_it_that_can_be_read() {
    let file = progressive("cube", &assets::cube(12).glb(), &unmeasured());
    let [coarsest, finest] = triangles(&file).expect("counts");
    let mut random = Random(7);
    for _ in 0..40 {
        let asked = coarsest + random.below((finest - coarsest + 1) as usize) as u64;
        let own = level(&file, Fineness::Triangles(asked));
        assert!(
            own.triangles <= asked && own.triangles + 2 >= asked,
            "{} of {asked}",
            own.triangles
        );
        let back = read_bytes(&to_glb(&own.asset).expect("a file"), Path::new("")).expect("read");
        assert_eq!(count(&back), own.triangles);
        assert_eq!(soup(&back), soup(&own.asset));
        let same = level(&file, Fineness::Error(own.error));
        assert!(same.triangles <= own.triangles && same.error <= own.error);
    }
    let least = level(&file, Fineness::Triangles(0));
    assert_eq!((least.triangles, least.missed.is_some()), (coarsest, true));
}

#[test]
fn a_file_that_ends_early_gives_what_is_there() {
    let file = progressive("cube", &assets::cube(24).glb(), &unmeasured());
    let [coarsest, finest] = triangles(&file).expect("counts");
    let (mut before, mut levels) = (0, 0);
    for part in 0..=60 {
        let cut = &file[..file.len() * part / 60];
        match extract(cut, Fineness::Source, ReadOptions::default()) {
            Err(_) => assert_eq!(before, 0, "a longer file gave nothing"),
            Ok(own) => {
                assert!(own.triangles >= before && own.triangles >= coarsest);
                assert_eq!(own.missed.is_none(), part == 60, "{part}");
                levels += usize::from(own.triangles > before);
                before = own.triangles;
            }
        }
    }
    assert_eq!(before, finest);
    assert!(levels > 3, "{levels} levels of a file in parts");
}

#[test]
fn a_damaged_file_is_an_error_or_a_coarser_level() {
    let file = progressive("cube", &assets::cube(12).glb(), &unmeasured());
    let mut random = Random(3);
    for round in 0..300 {
        let mut damaged = file.clone();
        // Half of them in the splits.
        let first = if round % 2 == 0 { 12 } else { file.len() * 3 / 4 };
        for _ in 0..=random.below(3) {
            let at = first + random.below(file.len() - first);
            damaged[at] ^= 1 << random.below(8);
        }
        if let Ok(own) = extract(&damaged, Fineness::Source, ReadOptions::default()) {
            to_glb(&own.asset).expect("a file");
        }
    }
}

#[test]
fn real_assets_come_back() {
    let Some(shared) = shared_assets() else { return };
    let options = BakeOptions { evaluate: None, ..unmeasured() };
    for name in ["rigged/Fox.glb", "scan/popcorn.glb"] {
        let path = shared.join(name);
        let source = read(&path).expect("the source");
        let bytes = to_glb(&source).expect("its bytes");
        let file = progressive("own", &bytes, &options);
        assert_whole(name, &source, &file);
    }
}

#[test]
fn a_file_is_refined_where_an_eye_looks() {
    use glam::Vec3;
    use seamwise::export::progressive::refine::{RefinedScene, camera};
    use seamwise_attr::Goal;

    for (name, build) in assets::all() {
        let bytes = build.glb();
        let options = BakeOptions { targets: Targets::Ratios(vec![0.5, 0.2]), ..unmeasured() };
        let file = progressive(name, &bytes, &options);
        let mut scene = RefinedScene::read(&file, ReadOptions::default()).expect("a scene");
        let [coarsest, finest] = triangles(&file).expect("counts");
        assert_eq!(scene.source_triangles() as u64, finest, "{name}");
        let mut random = Random(5);
        for _ in 0..8 {
            let place = |random: &mut Random| {
                let x = [0; 3].map(|_| random.below(100) as f32 / 20.0 - 2.5);
                Vec3::from(x)
            };
            let eye = place(&mut random);
            let camera = camera(eye, eye + Vec3::ONE, 60.0, [640, 480]).expect("a camera");
            let most = coarsest as usize + random.below((finest - coarsest) as usize + 1);
            scene.refine_for(&camera, Goal { triangles: most, ..Goal::default() });
            let own = scene.triangles();
            assert!(own <= most, "{name}: {own} of {most}");
            let glb = to_glb(&scene.asset().expect("a document")).expect("a file");
            let back = read_bytes(&glb, Path::new("")).expect("read");
            assert!(count(&back) >= own as u64, "{name}");
            let all = Goal { pixels: 0.1, ..Goal::default() };
            assert!(scene.refine_for(&camera, all).pixels <= 0.1, "{name}");
        }
    }
}
