//! Do levels move as their sources do? Under morph targets and skins, measured from the outside.

mod common;

use std::path::Path;

use common::output::Output;
use common::pose::{Moved, Pose, deform};
use common::{Baked, shared_assets, unmeasured};
use seamwise::bake::Input;
use seamwise::options::{BakeOptions, Textures};

/// The worst of several poses.
#[derive(Clone, Copy, Debug, Default)]
struct Worst {
    /// Root of the mean of the squares, over the poses.
    rms: f64,
    max: f64,
}

impl Worst {
    /// Compares a level with its source in every one of the poses that `moved` gives.
    fn over(source: &Output, level: &Output, poses: &[Box<dyn Fn(&Output) -> Moved>]) -> Self {
        let mut worst = Self::default();
        for pose in poses {
            let distances = pose(source).distances(&pose(level), 4000);
            worst.rms += distances.rms * distances.rms / poses.len() as f64;
            worst.max = worst.max.max(distances.max);
        }
        Self { rms: worst.rms.sqrt(), ..worst }
    }
}

type Poses = Vec<Box<dyn Fn(&Output) -> Moved>>;

/// Each animation at four times.
fn animations(output: &Output, mesh: usize) -> Poses {
    let count = output.gltf.animations().len();
    let at = |i: usize| -> Box<dyn Fn(&Output) -> Moved> {
        Box::new(move |output| {
            let animation = output.gltf.animations().nth(i / 4).expect("an animation");
            let pose = Pose::animated(output, &animation, (i % 4) as f32 / 4.0 + 0.125);
            deform(output, mesh, None, Some(&pose))
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

fn at_rest(mesh: usize) -> Poses {
    vec![Box::new(move |output| deform(output, mesh, None, None))]
}

#[test]
fn levels_of_real_rigs_move_as_their_sources_do() {
    let Some(folder) = shared_assets() else { return };
    for name in ["Fox", "bitmoji"] {
        let path = folder.join(format!("rigged/{name}.glb"));
        let source = Output::read(Path::new(&path));
        let options = BakeOptions { textures: Textures::Keep, ..unmeasured() };
        let baked = Baked::input(Input::File(&path), &options).expect("a bake");
        let mut all: Vec<(String, Poses)> = Vec::new();
        for mesh in 0..source.gltf.meshes().len() {
            all.push((format!("{mesh} rest"), at_rest(mesh)));
            all.push((format!("{mesh} animations"), animations(&source, mesh)));
            all.push((format!("{mesh} turns"), turns(mesh)));
            all.push((format!("{mesh} targets"), targets(&source, mesh)));
        }
        for (what, poses) in all.iter().filter(|(_, poses)| !poses.is_empty()) {
            for (index, level) in baked.levels().iter().enumerate() {
                let start = std::time::Instant::now();
                let worst = Worst::over(&source, level, poses);
                println!("{name} {what} level {}: {worst:?} {:?}", index + 1, start.elapsed());
            }
        }
    }
}
