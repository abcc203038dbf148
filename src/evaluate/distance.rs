//! How far two surfaces are apart, after Cignoni, Rocchini & Scopigno, "Metro: measuring error on
//! simplified surfaces", Computer Graphics Forum 1998: samples of one surface, each with the nearest
//! point on the other.
//!
//! The two directions differ (a lost spike is far from what remains, but what remains is near to the
//! spike), so both are given, and the larger of them as the symmetric figure. RMS and mean are over
//! samples spread by area. The maximum is found by bounds (`farthest`, which says when it gives up):
//! the Hausdorff distance within 0.2 % and 2e-6 of the diagonal.
//!
//! A triangle that both surfaces have, bit for bit, is its own nearest: samples on it correspond at
//! distance 0 without a search. So a surface against itself gives exactly 0, in distance and in
//! every attribute, also where its triangles overlap. Elsewhere a distance is off by about 1e-16 of
//! the positions' magnitude.
//!
//! On a thin sheet the nearest point is often on the wrong side. Distance does not mind; color and
//! normal do. So a sample whose nearest triangle faces away from its own takes its attributes from
//! the nearest triangle that does not, if there is one at most a hundredth of the diagonal farther.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use seamwise_attr::{
    Foot, Sample, Surface, TriangleId, area_vector, closest_on_triangle, sample_surface,
};

use super::farthest::{Target, farthest};
use super::volume::bounding_diagonal;

/// How much farther than the nearest point one on the same side may be, over the diagonal.
///
/// Lab note: share of samples on a wrong side when a model is bent by a smooth field of up to 0.9 %
/// of its diagonal, for limits of 0, 0.001, 0.003, 0.01, 0.03: a frying pan 13, 10, 4.3, 0.1, 0.1 %;
/// a racquet 18, 6.6, 1.9, 1.6, 1.6 %; a ship 21, 12, 6.4, 5.8, 5.8 %; a helmet 17, 9.7, 3.1, 1.3,
/// 1.3 %; a box 0.1 % or less. More gains nothing. The second search costs time on thin models: the
/// helmet's 200,000 samples took 0.48 s instead of 0.23 s, on two cores of a busy machine.
const SHEET: f64 = 0.01;
/// Parts of triangles that the search for the greatest distance may look at, for each sample: it
/// takes a few times as long as the samples at most.
const PARTS_PER_SAMPLE: usize = 8;
/// Samples that one task looks up.
const CHUNK: usize = 1024;

/// A surface with its samples, ready to be compared with several others.
#[derive(Clone, Debug)]
pub struct SampledSurface<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    surface: Surface,
    samples: Vec<Sample>,
    diagonal: f64,
    /// The triangles by what they look like, sorted.
    shapes: Vec<Shape>,
}

/// A triangle's corners as bits, its least first; its index; and which corner the least was.
type Shape = ([[u32; 3]; 3], u32, usize);

impl<'a> SampledSurface<'a> {
    /// Spreads `count` samples over `triangles`, three indices into `positions` each.
    ///
    /// # Panics
    /// If a triangle names a position that is not there.
    pub fn new(
        positions: &'a [Vec3],
        triangles: &'a [[u32; 3]],
        count: usize,
        seed: u64,
    ) -> SampledSurface<'a> {
        let mut shapes: Vec<Shape> = (0..)
            .zip(triangles)
            .map(|(at, &t)| shape(at, t.map(|p| positions[p as usize])))
            .collect();
        shapes.par_sort_unstable();
        Self {
            positions,
            triangles,
            surface: Surface::new(positions, triangles.iter().copied()),
            samples: sample_surface(positions, triangles, count, seed),
            diagonal: bounding_diagonal(positions, triangles),
            shapes,
        }
    }

    /// The samples, in the order of the triangles.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// The length of the bounding box's diagonal, which distances are divided by to be compared
    /// across models.
    pub fn diagonal(&self) -> f64 {
        self.diagonal
    }

    /// The triangle nearest to a place; `None` if that is not finite, or there is none.
    pub(super) fn nearest(&self, place: DVec3) -> Option<TriangleId> {
        self.surface.closest_foot(place, f64::INFINITY, |_| true).map(|foot| foot.triangle)
    }

    fn corners(&self, triangle: TriangleId) -> [DVec3; 3] {
        self.triangles[triangle].map(|p| self.positions[p as usize].as_dvec3())
    }

    fn normal(&self, triangle: TriangleId) -> DVec3 {
        area_vector(self.triangles[triangle].map(|p| self.positions[p as usize]))
    }

    /// One per triangle: the triangle of `other` with the same corners in the same turn, and how far
    /// its corners are turned. Of several equal ones each has its own.
    fn find_shared(&self, other: &Self) -> Vec<Option<(TriangleId, usize)>> {
        let mut shared = vec![None; self.triangles.len()];
        let mut others = other.shapes.iter().peekable();
        for (corners, index, least) in &self.shapes {
            while others.next_if(|shape| shape.0 < *corners).is_some() {}
            if let Some(found) = others.next_if(|shape| shape.0 == *corners) {
                shared[*index as usize] = Some((TriangleId(found.1), (3 + found.2 - least) % 3));
            }
        }
        shared
    }
}

fn shape(index: u32, corners: [Vec3; 3]) -> Shape {
    // Adding zero turns −0 into 0.
    let mut bits = corners.map(|p| (p + Vec3::ZERO).to_array().map(f32::to_bits));
    let least = (0..3).min_by_key(|&slot| bits[slot]).unwrap_or(0);
    bits.rotate_left(least);
    (bits, index, least)
}

/// A sample, and what corresponds to it on the other surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Where it was taken.
    pub sample: Sample,
    /// Where its attributes are compared: the nearest point, or the nearest on the same side.
    pub target: Sample,
    /// Distance to the nearest point, in the unit of the positions.
    pub distance: f64,
}

/// One surface seen from another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Correspondence {
    /// One per sample, in their order.
    pub pairs: Vec<Pair>,
    /// The greatest distance of any point, within 0.2 % and 2e-6 of the diagonal.
    pub greatest: f64,
    /// The point that is so far; the origin where none is off.
    pub farthest: DVec3,
}

/// Distances of one surface to another, in the unit of the positions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distances {
    /// Root of the mean of the squares, over the samples.
    pub rms: f64,
    /// Mean over the samples.
    pub mean: f64,
    /// The 99.9th percentile over the samples.
    pub p999: f64,
    /// The greatest of any point, within 0.2 % and 2e-6 of the diagonal.
    pub max: f64,
}

impl Distances {
    /// The larger of the two directions, figure by figure.
    pub fn symmetric(self, other: Self) -> Self {
        Self {
            rms: self.rms.max(other.rms),
            mean: self.mean.max(other.mean),
            p999: self.p999.max(other.p999),
            max: self.max.max(other.max),
        }
    }
}

impl Correspondence {
    /// Sums up the distances.
    pub fn distances(&self) -> Distances {
        let count = self.pairs.len().max(1) as f64;
        let sum: f64 = self.pairs.iter().map(|pair| pair.distance).sum();
        let squares: f64 = self.pairs.iter().map(|pair| pair.distance * pair.distance).sum();
        let (rms, mean) = ((squares / count).sqrt(), sum / count);
        Distances { rms, mean, p999: self.percentile(0.999), max: self.greatest }
    }

    /// The distance that so large a share of the samples does not exceed; 0 without samples.
    fn percentile(&self, share: f64) -> f64 {
        let mut distances: Vec<f64> = self.pairs.iter().map(|pair| pair.distance).collect();
        let Some(last) = distances.len().checked_sub(1) else { return 0.0 };
        let place = ((distances.len() as f64 * share).ceil() as usize).saturating_sub(1).min(last);
        *distances.select_nth_unstable_by(place, f64::total_cmp).1
    }
}

/// Finds what every sample of `from` corresponds to on `to`. None if `from` has no area or `to` no
/// triangle: nothing can be said about them then.
///
/// The same at any thread count.
pub fn correspond(from: &SampledSurface<'_>, to: &SampledSurface<'_>) -> Option<Correspondence> {
    if from.samples.is_empty() || to.surface.is_empty() {
        return None;
    }
    let shared = from.find_shared(to);
    let pairs: Vec<Vec<Pair>> = from
        .samples
        .par_chunks(CHUNK)
        .map(|samples| {
            let mut near = None;
            samples.iter().filter_map(|s| pair(from, to, &shared, *s, &mut near)).collect()
        })
        .collect();
    let pairs = pairs.concat();
    let (greatest, farthest) = greatest_distance(from, to, &shared, &pairs);
    Some(Correspondence { pairs, greatest, farthest })
}

/// The counterpart of one sample. None if its position overflows. `near`: the triangle nearest to the sample
/// before, if one was searched for, which bounds the search; and afterwards that of this one.
fn pair(
    from: &SampledSurface<'_>,
    to: &SampledSurface<'_>,
    shared: &[Option<(TriangleId, usize)>],
    sample: Sample,
    near: &mut Option<TriangleId>,
) -> Option<Pair> {
    if let Some((triangle, turn)) = shared[sample.triangle] {
        let mut barycentrics = sample.barycentrics.to_array();
        barycentrics.rotate_right(turn);
        let target = Sample { triangle, barycentrics: barycentrics.into() };
        return Some(Pair { sample, target, distance: 0.0 });
    }
    let [a, b, c] = from.corners(sample.triangle);
    let weights = sample.barycentrics;
    let point = a * weights.x + b * weights.y + c * weights.z;
    let reach = near.map_or(f64::INFINITY, |near| {
        let corners = to.triangles[near].map(|p| to.positions[p as usize]);
        closest_on_triangle(point, &corners).2.sqrt() * (1.0 + 1e-9) + f64::MIN_POSITIVE
    });
    let nearest = to.surface.closest_foot(point, reach, |_| true)?;
    *near = Some(nearest.triangle);
    let distance = nearest.distance_squared.sqrt();
    let normal = from.normal(sample.triangle);
    let faces = |triangle| to.normal(triangle).dot(normal) > 0.0;
    let same_side = if faces(nearest.triangle) {
        None
    } else {
        to.surface.closest_foot(point, distance + SHEET * to.diagonal, faces)
    };
    let Foot { triangle, barycentrics, .. } = same_side.unwrap_or(nearest);
    Some(Pair { sample, target: Sample { triangle, barycentrics }, distance })
}

/// The greatest distance to `to` of any point of `from`, but those of shared triangles, and that point. Of
/// a triangle without area only the corners count.
fn greatest_distance(
    from: &SampledSurface<'_>,
    to: &SampledSurface<'_>,
    shared: &[Option<(TriangleId, usize)>],
    pairs: &[Pair],
) -> (f64, DVec3) {
    let (mut vertices, mut own) = (Vec::new(), Vec::new());
    for (id, triangle) in (0..).map(TriangleId::new).zip(from.triangles) {
        if shared[id].is_none() {
            vertices.extend(triangle);
            if from.normal(id) != DVec3::ZERO {
                own.push(from.corners(id));
            }
        }
    }
    vertices.sort_unstable();
    vertices.dedup();
    let distance = |vertex: &u32| {
        let place = from.positions[*vertex as usize].as_dvec3();
        let foot = to.surface.closest_foot(place, f64::INFINITY, |_| true)?;
        Some((foot.distance_squared.sqrt(), place))
    };
    let of_vertices: Vec<(f64, DVec3)> = vertices.par_iter().filter_map(distance).collect();
    let of_samples = pairs.iter().map(|pair| {
        let ([a, b, c], w) = (from.corners(pair.sample.triangle), pair.sample.barycentrics);
        (pair.distance, a * w.x + b * w.y + c * w.z)
    });
    let all = of_vertices.into_iter().chain(of_samples);
    let known = all.fold((0.0, DVec3::ZERO), |best, own| if own.0 > best.0 { own } else { best });
    let (positions, triangles, surface) = (to.positions, to.triangles, &to.surface);
    let target = Target { positions, triangles, surface, diagonal: to.diagonal };
    farthest(own, &target, known, PARTS_PER_SAMPLE * pairs.len())
}

#[cfg(test)]
mod tests;
