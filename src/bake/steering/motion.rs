//! Where the points of a surface go as it moves: under the joints of its skin and its morph targets.

use glam::{DMat3, DMat4, DVec3, Vec3};
use nalgebra::Matrix3;
use seamwise_attr::{Mesh, Motion, Pose};

use super::frame::ShownFrame;
use crate::document::accessor::Elements;
use crate::document::asset::Asset;
use crate::document::poses::joint_poses;
use crate::error::Result;
use crate::surface::geometry::Geometry;
use crate::surface::part::Part;

/// The weight of errors in the poses of animations, all of them together, beside one of errors at rest; and of
/// those in poses that are guessed, and in each morph target, which is seldom there in full.
///
/// Lab note (`tests/surfaces/motion.py`): RMS distance in the animations of a fox, and at rest, over those
/// of levels that do not know how it moves, at 50, 25, 12.5 and 6.25 %; without the growth from level to level
/// that the metric adds:
///
/// | | moving | at rest |
/// |---|---|---|
/// | 0 | 0.86, 0.89, 0.99, 0.98 | 1, 1, 1, 1 |
/// | 0.1 | 0.81, 0.89, 0.95, 0.93 | 1.01, 1.00, 1.00, 0.98 |
/// | **0.25** | 0.79, 0.85, 0.93, 0.95 | 1.01, 0.96, 0.91, 1.01 |
/// | 1 | 0.69, 0.86, 0.96, 0.95 | 1.28, 0.96, 1.02, 1.03 |
/// | 2 | 0.62, 0.83, 0.86, 0.79 | 1.25, 1.00, 0.92, 0.82 |
///
/// A head of 82 targets and no animation is at 1.02, 1.00, 1.00 and 0.99 of its distance at rest with 0.02, and
/// at 1.09 with 1, where its targets are no nearer.
const ANIMATED: f64 = 0.25;
const GUESSED: f64 = 0.02;

/// The largest factors that known and guessed motion comes to count by in coarse levels.
///
/// Lab note (as above; the fox also at 40, 20, 10 and 5 %, which nothing was tuned on):
///
/// | | moving | at rest | moving, 40 to 5 % |
/// |---|---|---|---|
/// | in proportion, to 2.8 | 0.79, 0.86, 0.94, 0.93 | 1.01, 0.96, 0.94, 0.93 | 0.79, 0.82, 0.87, 0.87 |
/// | **by the square, to 8** | 0.79, 0.83, 0.83, 0.92 | 1.01, 0.92, 0.93, 0.95 | 0.77, 0.90, 0.74, 0.81 |
/// | by the square, to 20 | 0.79, 0.83, 0.89, 0.82 | 1.01, 0.92, 0.93, 0.84 | 0.77, 0.90, 0.74, 0.74 |
///
/// The head of 82 targets is at 1.01, 1.02, 1.01 and 0.99 of its distance at rest with 2.8, at 1.01, 1.02, 1.04
/// and 0.99 with 8.
const KNOWN_GROWTH: f64 = 8.0;
const GUESSED_GROWTH: f64 = 2.8;

/// Places of points in all poses together; of more poses every so many are taken.
const MAX_PLACES: usize = 1 << 24;

/// The motion of a surface, in the frame that it is simplified in: under its skin, and with each morph target in full. `None` if nothing moves.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) if the skin is malformed.
pub(super) fn motion(
    asset: &Asset,
    geometry: &Geometry,
    frame: Option<&ShownFrame>,
) -> Result<Option<Motion>> {
    let mesh = &geometry.welded.mesh;
    let points = vertices_of_points(geometry);
    let most = (MAX_PLACES / points.len().max(1)).max(1);
    let (mut poses, mut growth) = (Vec::new(), GUESSED_GROWTH);
    if let Some(skin) = skin_of(asset, geometry)? {
        // A skin that can't be read is passed on as it is: this is about costs.
        let poses_of = joint_poses(asset, skin).unwrap_or_default();
        let joints = every(poses_of.matrices, most);
        let influences: Vec<Vec<(usize, f64)>> =
            points.iter().map(|&vertex| influences(geometry, vertex)).collect();
        let posed = joints.iter().map(|joints| posed(mesh, &influences, joints));
        let posed = posed.collect::<Vec<_>>();
        let size = size(&mesh.positions.iter().map(|p| p.as_dvec3()).collect::<Vec<_>>());
        let scale = size / posed.first().map_or(1.0, |own| self::size(own));
        let (all, most) =
            if poses_of.is_known { (ANIMATED, KNOWN_GROWTH) } else { (GUESSED, GUESSED_GROWTH) };
        let weight = all / posed.len() as f64;
        growth = most;
        let pose = |own: &Vec<DVec3>| Pose { moves: moves(mesh, own, scale), weight };
        let is_sound = |pose: &Pose| pose.moves.iter().all(|p| p.is_finite());
        poses.extend(posed.iter().map(pose).filter(is_sound));
    }
    let targets = geometry.parts.iter().map(|part| part.targets.len()).max().unwrap_or(0);
    for target in every((0..targets).collect(), most.saturating_sub(poses.len()).max(1)) {
        let moves = points.iter().map(|&vertex| delta(geometry, vertex, target)).collect();
        poses.push(Pose { moves, weight: GUESSED });
    }
    if poses.is_empty() {
        return Ok(None);
    }
    let Some(frame) = frame else {
        return Ok(Some(Motion::new(mesh, &poses).growing_to(growth)));
    };
    for by in poses.iter_mut().flat_map(|pose| &mut pose.moves) {
        *by = frame.shift(*by);
    }
    Ok(Some(Motion::new(&frame.show(mesh), &poses).growing_to(growth)))
}

/// At most `most` of a list, evenly.
fn every<T>(all: Vec<T>, most: usize) -> Vec<T> {
    let stride = all.len().div_ceil(most).max(1);
    all.into_iter().step_by(stride).collect()
}

/// A vertex of each point.
fn vertices_of_points(geometry: &Geometry) -> Vec<u32> {
    let mut vertices = vec![0; geometry.welded.mesh.positions.len()];
    let wedges = geometry.welded.mesh.wedge_points.iter().zip(&geometry.welded.wedge_vertices);
    wedges.for_each(|(&point, &vertex)| vertices[point.index()] = vertex);
    vertices
}

/// The skin of the first node that shows a surface.
fn skin_of(asset: &Asset, geometry: &Geometry) -> Result<Option<usize>> {
    for node in 0..asset.count("nodes") {
        let at = format!("/nodes/{node}");
        let mesh = asset.reference(&at, "mesh", "meshes")?;
        if mesh.is_some_and(|mesh| geometry.meshes.contains(&mesh))
            && let Some(skin) = asset.reference(&at, "skin", "skins")?
        {
            return Ok(Some(skin));
        }
    }
    Ok(None)
}

/// The joints that a vertex follows, with their weights.
fn influences(geometry: &Geometry, vertex: u32) -> Vec<(usize, f64)> {
    let part = geometry.part_of(vertex);
    let at = (vertex - part.first) as usize;
    let mut all = Vec::new();
    for set in 0.. {
        let (joints, weights) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
        let (Some(joints), Some(weights)) = (find(part, &joints), find(part, &weights)) else {
            break;
        };
        let own = joints.row(at).into_iter().zip(weights.row(at));
        let own = own.filter(|(_, weight)| *weight > 0.0);
        all.extend(own.map(|(joint, weight)| (joint as usize, f64::from(weight))));
    }
    all
}

fn find<'a>(part: &'a Part, name: &str) -> Option<&'a Elements> {
    part.carried.iter().find(|(own, _)| own == name).map(|(_, elements)| elements)
}

/// Where joints have each point; one without joints stays.
fn posed(mesh: &Mesh, influences: &[Vec<(usize, f64)>], joints: &[DMat4]) -> Vec<DVec3> {
    let place = |(p, influences): (&Vec3, &Vec<(usize, f64)>)| {
        let p = p.as_dvec3();
        let bound =
            influences.iter().filter_map(|&(joint, weight)| Some((joints.get(joint)?, weight)));
        let (sum, whole) = bound.fold((DVec3::ZERO, 0.0), |(sum, whole), (joint, weight)| {
            (sum + joint.transform_point3(p) * weight, whole + weight)
        });
        if whole > 0.0 { sum / whole } else { p }
    };
    mesh.positions.iter().zip(influences).map(place).collect()
}

fn center(places: &[DVec3]) -> DVec3 {
    places.iter().sum::<DVec3>() / places.len().max(1) as f64
}

/// The distance of places from their center, RMS.
fn size(places: &[DVec3]) -> f64 {
    let center = center(places);
    let square: f64 = places.iter().map(|p| p.distance_squared(center)).sum();
    (square / places.len().max(1) as f64).sqrt()
}

/// How places differ from where the points are: at the scale of the mesh, and without what
/// moves and turns all of it (Kabsch, "A solution for the best rotation to relate two sets of vectors",
/// 1976).
fn moves(mesh: &Mesh, places: &[DVec3], scale: f64) -> Vec<Vec3> {
    let rest: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
    let (from, to) = (center(places), center(&rest));
    let mut covariance = DMat3::ZERO;
    for (place, rest) in places.iter().zip(&rest) {
        let (a, b) = (*place - from, *rest - to);
        covariance += DMat3::from_cols(b * a.x, b * a.y, b * a.z);
    }
    let turn = rotation(covariance);
    let moved =
        |(place, rest): (&DVec3, &DVec3)| (turn * (*place - from) * scale + to - *rest).as_vec3();
    places.iter().zip(&rest).map(moved).collect()
}

/// The rotation nearest to a matrix.
fn rotation(matrix: DMat3) -> DMat3 {
    let svd = Matrix3::from_column_slice(&matrix.to_cols_array()).svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else { return DMat3::IDENTITY };
    let turn = (u * v).determinant();
    let sign = Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0, 1.0, turn.signum()));
    let turned = u * sign * v;
    let turned = DMat3::from_cols_slice(turned.as_slice());
    if turned.is_finite() { turned } else { DMat3::IDENTITY }
}

/// The delta of a vertex in a morph target.
fn delta(geometry: &Geometry, vertex: u32, target: usize) -> Vec3 {
    let part = geometry.part_of(vertex);
    let own =
        part.targets.get(target).and_then(|own| own.iter().find(|(name, _)| name == "POSITION"));
    own.map_or(Vec3::ZERO, |(_, elements)| {
        let row = elements.row((vertex - part.first) as usize);
        Vec3::new(row[0], row[1], row[2])
    })
}
