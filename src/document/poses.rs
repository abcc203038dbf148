//! The joints of a skin in some poses: as the nodes stand, and in animations or turned.

use glam::{DMat4, DQuat, DVec3, Mat4};
use serde_json::Value;

use super::accessor::{self, Elements};
use super::asset::Asset;
use super::nodes::local_transform;
use crate::error::Result;

/// Poses of all animations together, at even times; a skin that none moves is turned in so many.
const MAX_POSES: usize = 24;
const TURNED_POSES: usize = 4;
/// The angle of a turned joint, in radians.
const TURN: f64 = 0.5;

/// The joints of a skin in some poses.
#[derive(Default)]
pub(crate) struct JointPoses {
    /// One per pose: the matrix of each joint.
    pub(crate) matrices: Vec<Vec<DMat4>>,
    /// Whether they are those of animations, not made up.
    pub(crate) is_known: bool,
}

/// The matrices of a skin's joints in each pose, the first as the nodes stand.
///
/// An animation that can't be read moves nothing: it is passed on as it is, and this is about costs.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) if the skin or a node is malformed.
pub(crate) fn joint_poses(asset: &Asset, skin: usize) -> Result<JointPoses> {
    let rig = Rig::read(asset, skin)?;
    let rest = Nodes::read(asset)?;
    let clips: Vec<Clip> =
        (0..asset.count("animations")).filter_map(|at| Clip::read(asset, at, &rig)).collect();
    let mut poses = vec![rest.clone()];
    if clips.is_empty() {
        poses.extend((0..TURNED_POSES).map(|pose| rest.turned(&rig, pose)));
    }
    let stride = clips.len().div_ceil(MAX_POSES).max(1);
    let times = MAX_POSES / clips.len().clamp(1, MAX_POSES);
    for clip in clips.iter().step_by(stride) {
        let shares = (0..times).map(|at| (at as f64 + 0.5) / times as f64);
        poses.extend(shares.map(|share| clip.apply(&rest, share)));
    }
    let matrices = poses.iter().map(|nodes| rig.matrices(nodes)).collect();
    Ok(JointPoses { matrices, is_known: !clips.is_empty() })
}

/// The joints of a skin, and the inverses of where they were bound.
struct Rig {
    joints: Vec<usize>,
    binds: Vec<DMat4>,
}

impl Rig {
    fn read(asset: &Asset, skin: usize) -> Result<Self> {
        let at = format!("/skins/{skin}");
        let entries = asset.json.pointer(&format!("{at}/joints")).and_then(Value::as_array);
        let joints = (0..entries.map_or(0, Vec::len))
            .map(|entry| asset.reference(&format!("{at}/joints"), &entry.to_string(), "nodes"))
            .filter_map(Result::transpose)
            .collect::<Result<Vec<_>>>()?;
        let mut binds = vec![DMat4::IDENTITY; joints.len()];
        if let Some(index) = asset.reference(&at, "inverseBindMatrices", "accessors")? {
            let matrices = accessor::matrices(asset, index, &at)?;
            for (bind, matrix) in binds.iter_mut().zip(&matrices) {
                *bind = Mat4::from_cols_array(matrix).as_dmat4();
            }
        }
        Ok(Self { joints, binds })
    }

    fn matrices(&self, nodes: &Nodes) -> Vec<DMat4> {
        let all = self.joints.iter().zip(&self.binds);
        all.map(|(&joint, bind)| nodes.world(joint) * *bind).collect()
    }
}

/// The transform of a node in its parent.
#[derive(Clone, Copy)]
struct Local {
    scale: DVec3,
    rotation: DQuat,
    translation: DVec3,
}

/// All nodes of a document.
#[derive(Clone)]
struct Nodes {
    locals: Vec<Local>,
    parents: Vec<Option<usize>>,
}

impl Nodes {
    fn read(asset: &Asset) -> Result<Self> {
        let count = asset.count("nodes");
        let mut nodes = Self { locals: Vec::with_capacity(count), parents: vec![None; count] };
        for node in 0..count {
            let local = local_transform(asset, &format!("/nodes/{node}"))?;
            let (scale, rotation, translation) = local.to_scale_rotation_translation();
            let rotation = if rotation.is_finite() { rotation } else { DQuat::IDENTITY };
            nodes.locals.push(Local { scale, rotation, translation });
            let children = asset.json["nodes"][node].get("children").and_then(Value::as_array);
            for child in children.into_iter().flatten().filter_map(Value::as_u64) {
                if let Some(parent) = nodes.parents.get_mut(child as usize) {
                    *parent = Some(node);
                }
            }
        }
        Ok(nodes)
    }

    fn world(&self, node: usize) -> DMat4 {
        let (mut world, mut at) = (DMat4::IDENTITY, Some(node));
        // A circle of parents is refused where the scene is read.
        for _ in 0..self.locals.len() {
            let Some(node) = at else { break };
            let Local { scale, rotation, translation } = self.locals[node];
            world = DMat4::from_scale_rotation_translation(scale, rotation, translation) * world;
            at = self.parents[node];
        }
        world
    }

    /// Every joint turned about an axis of its own, another in each pose.
    fn turned(&self, rig: &Rig, pose: usize) -> Self {
        let mut nodes = self.clone();
        for (at, &joint) in rig.joints.iter().enumerate() {
            // Axes spread over the sphere (a Fibonacci lattice).
            let n = (at * TURNED_POSES + pose) as f64;
            let z = 1.0 - 2.0 * (0.618_033_988_749_895 * n).fract();
            let (sin, cos) = (2.399_963_229_728_653 * n).sin_cos();
            let r = (1.0 - z * z).max(0.0).sqrt();
            let axis = DVec3::new(r * cos, r * sin, z).normalize();
            nodes.locals[joint].rotation *= DQuat::from_axis_angle(axis, TURN);
        }
        nodes
    }
}

/// A property of a node over time.
struct Track {
    node: usize,
    path: Path,
    times: Vec<f32>,
    /// As many floats for each time.
    values: Vec<f32>,
}

/// The properties that move a node.
#[derive(Clone, Copy)]
enum Path {
    Translation,
    Rotation,
    Scale,
}

/// An animation that moves nodes.
struct Clip {
    tracks: Vec<Track>,
    end: f64,
}

impl Clip {
    /// `None` if it moves no node above or at a joint.
    fn read(asset: &Asset, animation: usize, rig: &Rig) -> Option<Self> {
        let json = asset.json.pointer(&format!("/animations/{animation}"))?;
        let channels = json.get("channels")?.as_array()?;
        let tracks: Vec<Track> =
            channels.iter().filter_map(|channel| Track::read(asset, json, channel)).collect();
        let moves = tracks.iter().any(|track| rig.joints.contains(&track.node));
        let ends = tracks.iter().filter_map(|track| track.times.last());
        let end = ends.fold(0.0, |end, &time| f64::from(time).max(end));
        moves.then_some(Self { tracks, end })
    }

    fn apply(&self, rest: &Nodes, share: f64) -> Nodes {
        let mut nodes = rest.clone();
        for track in &self.tracks {
            track.apply(share * self.end, &mut nodes.locals[track.node]);
        }
        nodes
    }
}

impl Track {
    fn read(asset: &Asset, animation: &Value, channel: &Value) -> Option<Self> {
        let node = channel.pointer("/target/node")?.as_u64()? as usize;
        let (path, components) = match channel.pointer("/target/path")?.as_str()? {
            "translation" => (Path::Translation, 3),
            "rotation" => (Path::Rotation, 4),
            "scale" => (Path::Scale, 3),
            _ => return None,
        };
        let sampler = animation.get("samplers")?.get(channel.get("sampler")?.as_u64()? as usize)?;
        let read = |name: &str| -> Option<Elements> {
            accessor::read(asset, sampler.get(name)?.as_u64()? as usize, "").ok()
        };
        let (times, values) = (read("input")?.floats(), read("output")?.floats());
        let is_cubic = sampler.get("interpolation").is_some_and(|own| own == "CUBICSPLINE");
        // Of a spline the values at its keys, between its tangents.
        let values = match is_cubic {
            true => values
                .chunks_exact(3 * components)
                .flat_map(|key| key[components..2 * components].to_vec())
                .collect(),
            false => values,
        };
        let is_whole = !times.is_empty() && values.len() == times.len() * components;
        let is_sound =
            node < asset.count("nodes") && values.iter().chain(&times).all(|x| x.is_finite());
        (is_whole && is_sound).then_some(Self { node, path, times, values })
    }

    /// Sets the property at a time, keys joined by lines.
    fn apply(&self, time: f64, local: &mut Local) {
        let next =
            self.times.partition_point(|&key| f64::from(key) < time).min(self.times.len() - 1);
        let last = next.saturating_sub(1);
        let span = f64::from(self.times[next]) - f64::from(self.times[last]);
        let part = (time - f64::from(self.times[last])) / span;
        let part = if span > 0.0 { part.clamp(0.0, 1.0) } else { 1.0 };
        let components = self.values.len() / self.times.len();
        let at = |key: usize, k: usize| f64::from(self.values[key * components + k]);
        let vector = |key| DVec3::new(at(key, 0), at(key, 1), at(key, 2));
        let quaternion =
            |key| DQuat::from_xyzw(at(key, 0), at(key, 1), at(key, 2), at(key, 3)).normalize();
        let along = || vector(last).lerp(vector(next), part);
        match self.path {
            Path::Translation => local.translation = along(),
            Path::Scale => local.scale = along(),
            Path::Rotation => {
                let turned = quaternion(last).slerp(quaternion(next), part);
                if turned.is_finite() {
                    local.rotation = turned;
                }
            }
        }
    }
}
