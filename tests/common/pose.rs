//! A document's surfaces as they move: under morph targets and skins (glTF 2.0 §3.7.2.2, §3.7.3.3),
//! read without the code under test.

use glam::{Mat4, Quat, Vec3};
use gltf::Semantic;
use gltf::animation::Property;
use seamwise::evaluate::distance::{Distances, SampledSurface, correspond};

use super::output::Output;

/// Where the nodes of a document stand, each in its parent.
#[derive(Clone, Debug)]
pub(crate) struct Pose {
    locals: Vec<(Vec3, Quat, Vec3)>,
    parents: Vec<Option<usize>>,
}

/// Joints with their weights.
pub(crate) type Influences = Vec<(usize, f32)>;

/// Triangles on the move.
pub(crate) struct Moved {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Pose {
    /// The nodes as the document has them.
    pub(crate) fn rest(output: &Output) -> Self {
        let mut parents = vec![None; output.gltf.nodes().len()];
        for node in output.gltf.nodes() {
            node.children().for_each(|child| parents[child.index()] = Some(node.index()));
        }
        let local = |node: gltf::Node<'_>| {
            let (move_by, turn, scale) = node.transform().decomposed();
            (Vec3::from_array(move_by), Quat::from_array(turn), Vec3::from_array(scale))
        };
        Self { locals: output.gltf.nodes().map(local).collect(), parents }
    }

    /// The nodes under an animation, at a share 0…1 of its time, keys joined by lines.
    pub(crate) fn animated(output: &Output, animation: &gltf::Animation<'_>, share: f32) -> Self {
        let mut pose = Self::rest(output);
        let keys = |channel: &gltf::animation::Channel<'_>| -> Vec<f32> {
            output.rows(&channel.sampler().input()).concat()
        };
        let end = animation.channels().flat_map(|c| keys(&c)).fold(0.0, f32::max);
        for channel in animation.channels() {
            let (times, values) = (keys(&channel), output.rows(&channel.sampler().output()));
            let next = times.partition_point(|&time| time < share * end).min(times.len() - 1);
            let last = next.saturating_sub(1);
            let span = times[next] - times[last];
            let t =
                if span > 0.0 { ((share * end - times[last]) / span).clamp(0.0, 1.0) } else { 0.0 };
            let (a, b) = (&values[last], &values[next]);
            let vector = || Vec3::from_slice(a).lerp(Vec3::from_slice(b), t);
            let local = &mut pose.locals[channel.target().node().index()];
            match channel.target().property() {
                Property::Translation => local.0 = vector(),
                Property::Rotation => local.1 = Quat::from_slice(a).slerp(Quat::from_slice(b), t),
                Property::Scale => local.2 = vector(),
                Property::MorphTargetWeights => {}
            }
        }
        pose
    }

    /// Every joint turned by `angle` about an axis of its own.
    pub(crate) fn turned(output: &Output, angle: f32) -> Self {
        let mut pose = Self::rest(output);
        for joint in output.gltf.skins().flat_map(|skin| skin.joints().collect::<Vec<_>>()) {
            let turn = joint.index() as f32;
            let axis = Vec3::new(turn.sin(), (1.7 * turn).cos(), (0.6 * turn).sin()).normalize();
            let local = &mut pose.locals[joint.index()].1;
            *local *= Quat::from_axis_angle(axis, angle);
        }
        pose
    }

    fn world(&self, node: usize) -> Mat4 {
        let (move_by, turn, scale) = self.locals[node];
        let local = Mat4::from_scale_rotation_translation(scale, turn, move_by);
        self.parents[node].map_or(local, |parent| self.world(parent) * local)
    }

    /// The matrices of a skin: where its joints are, seen from where they were bound.
    fn joints(&self, output: &Output, skin: &gltf::Skin<'_>) -> Vec<Mat4> {
        let binds = skin.inverse_bind_matrices().map(|accessor| output.rows(&accessor));
        let bind = |at: usize| {
            binds.as_ref().map_or(Mat4::IDENTITY, |binds| Mat4::from_cols_slice(&binds[at]))
        };
        skin.joints().enumerate().map(|(at, node)| self.world(node.index()) * bind(at)).collect()
    }
}

/// The influences of every vertex, set after set, those without weight too.
pub(crate) fn influences(output: &Output, primitive: &gltf::Primitive<'_>) -> Vec<Influences> {
    let mut all = Vec::new();
    let sets = (0..).map_while(|set| {
        Some((primitive.get(&Semantic::Joints(set))?, primitive.get(&Semantic::Weights(set))?))
    });
    for (joints, weights) in sets {
        let (joints, weights) = (output.rows(&joints), output.rows(&weights));
        all.resize(joints.len(), Vec::new());
        for ((own, joints), weights) in all.iter_mut().zip(joints).zip(weights) {
            own.extend(joints.into_iter().map(|joint| joint as usize).zip(weights));
        }
    }
    all
}

/// The triangles of a mesh with one of its morph targets at weight 1, then under the first skin.
pub(crate) fn deform(
    output: &Output,
    mesh: usize,
    target: Option<usize>,
    pose: Option<&Pose>,
) -> Moved {
    let mut moved = Moved { positions: Vec::new(), triangles: Vec::new() };
    let skin = pose.zip(output.gltf.skins().next());
    let joints = skin.map(|(pose, skin)| pose.joints(output, &skin)).unwrap_or_default();
    let document = output.gltf.meshes().nth(mesh).expect("a mesh");
    let primitives = document.primitives().filter(|p| p.mode() == gltf::mesh::Mode::Triangles);
    for (primitive, part) in primitives.zip(output.parts(mesh)) {
        let first = moved.positions.len() as u32;
        let mut positions: Vec<Vec3> = part.positions.into_iter().map(Vec3::from_array).collect();
        let deltas = target.and_then(|target| primitive.morph_targets().nth(target)?.positions());
        for (position, delta) in
            positions.iter_mut().zip(deltas.iter().flat_map(|a| output.rows(a)))
        {
            *position += Vec3::from_slice(&delta);
        }
        let influences =
            if joints.is_empty() { Vec::new() } else { influences(output, &primitive) };
        for (position, influences) in positions.iter_mut().zip(&influences) {
            let add = |sum: Mat4, &(joint, weight): &(usize, f32)| sum + joints[joint] * weight;
            *position = influences.iter().fold(Mat4::ZERO, add).transform_point3(*position);
        }
        moved.positions.extend(positions);
        moved.triangles.extend(part.triangles.iter().map(|t| t.map(|vertex| vertex + first)));
    }
    moved
}

impl Moved {
    /// Two-sided distances from this surface to another, over its own bounding box's diagonal.
    pub(crate) fn distances(&self, level: &Self, samples: usize) -> Distances {
        let own = SampledSurface::new(&self.positions, &self.triangles, samples, 1);
        let other = SampledSurface::new(&level.positions, &level.triangles, samples, 2);
        let there = correspond(&own, &other).expect("a surface").distances();
        let back = correspond(&other, &own).expect("a surface").distances();
        let found = there.symmetric(back);
        let over = |distance: f64| distance / own.diagonal();
        let [rms, mean, p999, max] = [found.rms, found.mean, found.p999, found.max].map(over);
        Distances { rms, mean, p999, max }
    }
}
