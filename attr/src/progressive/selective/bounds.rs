//! What each collapse leaves behind: how far off, in shape and in shading, where, and which way it faces.
//!
//! Every point of the source belongs to a triangle, the nearest of those that are left where its own was changed.
//! The error of a collapse is how far the points of the triangles that it leaves are off from these. Since a
//! triangle is always one of the simplification's, with the same points, that is a bound for every state.
//!
//! Of an error only what lies across the view is seen. The ways from points to their triangles follow the normals,
//! more or less: the parts along the axis of these and across it are kept apart (Hoppe 1997: the deviation space of
//! a uniform and a directional part).
//!
//! [`Shading`] is how far unit normals are off, and where they face: over the same points, a sum and no bound.

use glam::{DVec3, Vec3};

use super::forest::{Touch, points_of};
use super::shading::Shading;
use crate::progressive::mesh::ProgressiveMesh;
use crate::triangle::{area_vector, closest_on_triangle};

/// The bounds of what a collapse leaves.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bounds {
    /// Largest distance of a point of the source from the triangles left.
    pub(crate) error: f32,
    /// The parts of these distances along the axis below, and across it.
    pub(crate) along: f32,
    pub(crate) across: f32,
    pub(crate) shading: Shading,
    /// A sphere around all of them.
    pub(crate) center: Vec3,
    pub(crate) radius: f32,
    /// A cone around their normals and those of the source's points: its axis, and the cosine and the sine of its
    /// half angle.
    pub(crate) axis: Vec3,
    pub(crate) cosine: f32,
    pub(crate) sine: f32,
}

impl Bounds {
    /// Takes the ways from points of the source to the triangles left.
    fn measure(&mut self, ways: &[DVec3]) {
        let axis = self.axis.as_dvec3();
        for way in ways {
            let along = way.dot(axis);
            self.error = self.error.max(way.length() as f32);
            self.along = self.along.max(along.abs() as f32);
            self.across = self.across.max((way - along * axis).length() as f32);
        }
    }

    /// The largest part of an error that lies across a way of the view, whose angle with the axis has this cosine,
    /// or across one that makes an angle of at most this sine with that.
    pub(super) fn across_view(&self, facing: f32, spread: f32) -> f32 {
        let sine = (sine_of(facing) + spread).min(1.0);
        self.error.min(self.along * sine + self.across)
    }

    /// Whether all of it faces away from an eye that looks along such ways.
    pub(super) fn faces_away(&self, facing: f32, spread: f32) -> bool {
        let straight = sine_of(spread);
        let slack = cosine_of_sum([self.cosine, self.sine], [straight, spread]);
        slack > 0.0 && facing > self.sine * straight + self.cosine * spread
    }
}

/// The sine of an angle up to two right ones by its cosine, or the other way round.
pub(super) fn sine_of(cosine: f32) -> f32 {
    (1.0 - cosine * cosine).max(0.0).sqrt()
}

/// The cosine of the sum of two angles of which these are cosines and sines.
pub(super) fn cosine_of_sum(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] - a[1] * b[1]
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
        let mut bounds = Bounds::default();
        let mut ways = Vec::with_capacity(own.len());
        for &sample in &own {
            let position = self.positions[sample as usize].as_dvec3();
            let off = |own: &Left| closest_on_triangle(position, &own.corners);
            let all = left.iter().map(|own| (own, off(own)));
            if let Some((nearest, (_, foot, _))) = all.min_by(|a, b| a.1.2.total_cmp(&b.1.2)) {
                ways.push(foot - position);
                let normal = self.normals[sample as usize];
                bounds.shading.add(self.areas[sample as usize], normal, nearest.normal);
                self.put(sample, nearest.triangle);
            }
        }
        self.enclose(mesh, touches, (&own, &left), &mut bounds);
        bounds.measure(&ways);
        self.bounds.push(bounds);
        self.own = own;
    }

    /// Finds the sphere and the cone around what a collapse leaves, and takes for its error that of what leaves
    /// nothing.
    fn enclose(
        &self,
        mesh: &ProgressiveMesh,
        touches: &[Touch],
        (samples, left): (&[u32], &[Left]),
        out: &mut Bounds,
    ) {
        let samples = samples.iter().map(|&sample| sample as usize);
        let points = points_of(mesh, touches).into_iter().map(|own| mesh.state().positions[own]);
        let places: Vec<Vec3> =
            points.chain(samples.clone().map(|sample| self.positions[sample])).collect();
        let low = places.iter().copied().reduce(Vec3::min).unwrap_or_default();
        let high = places.iter().copied().reduce(Vec3::max).unwrap_or_default();
        out.center = 0.5 * (low + high);
        out.radius = places.iter().map(|place| place.distance(out.center)).fold(0.0, f32::max);
        let normals: Vec<Vec3> = left
            .iter()
            .map(|own| own.normal)
            .chain(samples.map(|sample| self.normals[sample]))
            .filter(|normal| *normal != Vec3::ZERO)
            .collect();
        let sum: DVec3 = normals.iter().map(|normal| normal.as_dvec3()).sum();
        out.axis = sum.normalize_or(DVec3::Z).as_vec3();
        let least = normals.iter().map(|normal| normal.dot(out.axis)).fold(1.0, f32::min);
        out.cosine = least.max(-1.0);
        out.sine = sine_of(out.cosine);
        if left.is_empty() {
            // What goes as a whole is off by all of itself.
            out.across = 2.0 * out.radius;
            out.error = out.across;
        }
    }
}
