//! What each collapse leaves behind: how far off, in shape and in shading, where, and which way it faces.
//!
//! Every point of the source belongs to a triangle, the nearest of those that are left where its own was changed.
//! The error of a collapse is how far the points of the triangles that it leaves are off from these. Since a
//! triangle is always one of the simplification's, with the same points, that is a bound for every state.
//!
//! Shading is off by √(∑ Aᵢ |nᵢ − n|²) over these points: Aᵢ a third of the area of the triangles around a point of
//! the source, nᵢ its unit normal by area, and n that of the triangle it belongs to. It has the unit of a length,
//! and is a sum over samples, no bound.

use glam::{DVec3, Vec3};

use super::forest::{Touch, points_of};
use crate::progressive::mesh::ProgressiveMesh;
use crate::triangle::{area_vector, closest_on_triangle};

/// The bounds of what a collapse leaves.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bounds {
    /// Largest distance of a point of the source from the triangles left.
    pub(crate) error: f32,
    /// Root of the integral, over what the triangles left stand for of the source, of the squared distance of
    /// unit normals: a length, as the error is.
    pub(crate) shading: f32,
    /// A sphere around all of them.
    pub(crate) center: Vec3,
    pub(crate) radius: f32,
    /// A cone around their normals and those of the source's points: its axis, and its half angle in radians.
    pub(crate) axis: Vec3,
    pub(crate) angle: f32,
}

/// A triangle that a collapse leaves.
struct Left {
    triangle: usize,
    corners: [Vec3; 3],
    normal: Vec3,
}

impl Left {
    fn of(mesh: &ProgressiveMesh, triangle: usize) -> Self {
        let corners = mesh.state().triangle_positions(triangle);
        let normal = area_vector(corners).normalize_or_zero().as_vec3();
        Self { triangle, corners, normal }
    }
}

/// The points of the source, by the triangles that they belong to.
pub(crate) struct Samples {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    /// The area of the source that each stands for.
    areas: Vec<f32>,
    /// Per triangle: the first of its points; per point: the next one.
    first: Vec<u32>,
    next: Vec<u32>,
    /// Those of the collapse at hand.
    own: Vec<u32>,
    pub(crate) bounds: Vec<Bounds>,
}

const END: u32 = u32::MAX;

/// Lengths of area vectors, of which each of three points gets a share, in areas.
const AREA: f32 = 6.0;

impl Samples {
    /// Those of a mesh at its finest.
    pub(crate) fn of(mesh: &ProgressiveMesh) -> Self {
        let state = mesh.state();
        let mut own = Self {
            positions: state.positions.clone(),
            normals: vec![Vec3::ZERO; state.positions.len()],
            areas: vec![0.0; state.positions.len()],
            first: vec![END; state.triangles.len()],
            next: vec![END; state.positions.len()],
            own: Vec::new(),
            bounds: Vec::with_capacity(mesh.collapses()),
        };
        let mut is_known = vec![false; state.positions.len()];
        for triangle in 0..state.triangles.len() {
            let normal = area_vector(state.triangle_positions(triangle)).as_vec3();
            for point in state.triangle_points(triangle) {
                own.normals[point.index()] += normal;
                own.areas[point.index()] += normal.length() / AREA;
                if !std::mem::replace(&mut is_known[point.index()], true) {
                    own.put(point.index() as u32, triangle);
                }
            }
        }
        own.normals.iter_mut().for_each(|normal| *normal = normal.normalize_or_zero());
        own
    }

    fn put(&mut self, sample: u32, triangle: usize) {
        self.next[sample as usize] = std::mem::replace(&mut self.first[triangle], sample);
    }

    /// Takes the points of the triangles that a collapse is about to change.
    pub(crate) fn take(&mut self, touches: &[Touch]) {
        self.own.clear();
        for touch in touches {
            let mut sample = std::mem::replace(&mut self.first[touch.triangle.index()], END);
            while sample != END {
                self.own.push(sample);
                sample = self.next[sample as usize];
            }
        }
        self.own.sort_unstable();
    }

    /// Gives them to the triangles that it has left, and notes its bounds.
    pub(crate) fn give(&mut self, mesh: &ProgressiveMesh, touches: &[Touch]) {
        let left: Vec<Left> = touches
            .iter()
            .filter(|touch| touch.stays)
            .map(|touch| Left::of(mesh, touch.triangle.index()))
            .collect();
        let own = std::mem::take(&mut self.own);
        let (mut square, mut shading) = (0.0f64, 0.0f32);
        for &sample in &own {
            let position = self.positions[sample as usize].as_dvec3();
            let off = |own: &Left| closest_on_triangle(position, &own.corners).2;
            let all = left.iter().map(|own| (own, off(own)));
            if let Some((nearest, off)) = all.min_by(|a, b| a.1.total_cmp(&b.1)) {
                square = square.max(off);
                let turn = self.normals[sample as usize].distance_squared(nearest.normal);
                shading += self.areas[sample as usize] * turn;
                self.put(sample, nearest.triangle);
            }
        }
        let bounds = self.bounds_of(mesh, touches, (&own, &left), square.sqrt());
        self.bounds.push(Bounds { shading: shading.sqrt(), ..bounds });
        self.own = own;
    }

    fn bounds_of(
        &self,
        mesh: &ProgressiveMesh,
        touches: &[Touch],
        (samples, left): (&[u32], &[Left]),
        error: f64,
    ) -> Bounds {
        let samples = samples.iter().map(|&sample| sample as usize);
        let points = points_of(mesh, touches).into_iter().map(|own| mesh.state().positions[own]);
        let places: Vec<Vec3> =
            points.chain(samples.clone().map(|sample| self.positions[sample])).collect();
        let low = places.iter().copied().reduce(Vec3::min).unwrap_or_default();
        let high = places.iter().copied().reduce(Vec3::max).unwrap_or_default();
        let center = 0.5 * (low + high);
        let radius = places.iter().map(|place| place.distance(center)).fold(0.0, f32::max);
        let normals: Vec<Vec3> = left
            .iter()
            .map(|own| own.normal)
            .chain(samples.map(|sample| self.normals[sample]))
            .filter(|normal| *normal != Vec3::ZERO)
            .collect();
        let sum: DVec3 = normals.iter().map(|normal| normal.as_dvec3()).sum();
        let axis = sum.normalize_or(DVec3::Z).as_vec3();
        let least = normals.iter().map(|normal| normal.dot(axis)).fold(1.0, f32::min);
        // What goes as a whole is off by all of itself.
        let error = if left.is_empty() { error.max(2.0 * f64::from(radius)) } else { error };
        let angle = least.clamp(-1.0, 1.0).acos();
        Bounds { error: error as f32, shading: 0.0, center, radius, axis, angle }
    }
}
