//! Seams, where they lie in an image, and the points along them that are compared.

use glam::{DMat3, DVec2, DVec3, Mat3, Vec2};
use rayon::prelude::*;

use super::footprint::{Sampler, Taps};
use crate::raster::to_texels;

/// A seam as long as this many times the image's longer side is left out: it would cost samples
/// without end.
const MOST_REPEATS: f64 = 8.0;
/// The most length of all seams together, in texels; seams beyond are left out.
const MOST_LENGTH: f64 = 4e6;

/// An edge of a surface that two triangles read at two places of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// UVs of the edge's two ends, for each of its two triangles.
    pub sides: [[Vec2; 2]; 2],
    /// The matrix from the second side's tangent space to the first's, at either end. `None` where
    /// the shading normals differ, or if they are not needed: a normal map is then left as it is.
    pub turns: Option<[Mat3; 2]>,
}

/// A seam in texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    sides: [[DVec2; 2]; 2],
    turns: Option<[DMat3; 2]>,
    /// Length of the longer side, in texels.
    length: f64,
}

/// A point of a seam that is compared at a mip level.
#[derive(Clone, Debug)]
pub(super) struct Station {
    /// The texels that either side reads.
    pub(super) taps: [Taps; 2],
    /// The matrix that the second side's vectors are multiplied by, if they are tangent vectors.
    pub(super) turn: Option<DMat3>,
    /// The length of seam that the point stands for, in texels.
    pub(super) length: f64,
}

/// The distribution of points along a seam.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spread {
    /// At least two points a texel, both ends among them: what is solved for.
    Ends,
    /// At least four points a texel, none of them among those: what is reported.
    Middles,
}

/// Places seams in an image; those without extent, not finite or of excessive length are left out.
/// `vectors` keeps only those whose turn is known.
pub(super) fn place(seams: &[Seam], sampler: &Sampler, vectors: bool) -> Vec<Placed> {
    let longest = sampler.size[0].max(sampler.size[1]) as f64;
    let mut sum = 0.0;
    let place = |seam: &Seam| {
        let sides = seam.sides.map(|side| side.map(|uv| to_texels(uv, sampler.size)));
        let length = sides.map(|[from, to]| from.distance(to)).into_iter().fold(0.0, f64::max);
        let turns = seam.turns.filter(|_| vectors).map(|turns| turns.map(|turn| turn.as_dmat3()));
        let near = |at: &DVec2| at.is_finite() && at.abs().max_element() < longest * 1e6;
        let near = sides.iter().flatten().all(near);
        let sound = near && length > 0.0 && length <= MOST_REPEATS * longest;
        let turned = !vectors || turns.is_some_and(|turns| turns.iter().all(DMat3::is_finite));
        (sound && turned).then_some(Placed { sides, turns, length })
    };
    let within = |placed: &Placed| {
        sum += placed.length;
        sum <= MOST_LENGTH
    };
    seams.iter().filter_map(place).take_while(within).collect()
}

impl Placed {
    /// The points of this seam at a mip level.
    pub(super) fn stations(
        &self,
        sampler: Sampler,
        level: usize,
        spread: Spread,
    ) -> impl Iterator<Item = Station> + '_ {
        let texels = self.length / (1u64 << level) as f64;
        let (steps, count) = match spread {
            Spread::Ends => {
                let steps = (2.0 * texels).ceil().max(1.0);
                (steps, steps as usize + 1)
            }
            Spread::Middles => {
                let steps = (4.0 * texels).ceil().max(1.0);
                (steps, steps as usize)
            }
        };
        (0..count).map(move |index| {
            let (offset, ends) = match spread {
                Spread::Ends => (0.0, index == 0 || index + 1 == count),
                Spread::Middles => (0.5, false),
            };
            let t = (index as f64 + offset) / steps;
            let share = if ends { 0.5 } else { 1.0 };
            Station {
                taps: self.sides.map(|[from, to]| sampler.taps(from.lerp(to, t), level)),
                turn: self.turns.map(|[from, to]| from * (1.0 - t) + to * t),
                length: share * self.length / steps,
            }
        })
    }
}

impl Station {
    /// A vector of the second side as the first sees it.
    pub(super) fn turned(&self, value: DVec3) -> DVec3 {
        self.turn.map_or(value, |turn| turn * value)
    }

    /// The first side's value less the second's.
    pub(super) fn step(&self, value: impl Fn(usize) -> DVec3) -> DVec3 {
        let read = |taps: &Taps| taps.iter().map(|&(texel, weight)| weight * value(texel)).sum();
        let [own, other]: [DVec3; 2] = [read(&self.taps[0]), read(&self.taps[1])];
        own - self.turned(other)
    }
}

/// RMS of the step over all seams at a mip level, in the unit of `value`, over `channels` channels;
/// 0 without seams. Points where a texel is no number do not count.
pub(super) fn rms_step(
    seams: &[Placed],
    sampler: Sampler,
    level: usize,
    channels: usize,
    value: impl Fn(usize) -> DVec3 + Sync,
) -> f64 {
    let of_seam = |seam: &Placed| {
        let (mut squares, mut length) = (0.0, 0.0);
        for station in seam.stations(sampler, level, Spread::Middles) {
            let step = station.step(&value);
            if step.is_finite() {
                squares += station.length * step.length_squared();
                length += station.length;
            }
        }
        (squares, length)
    };
    let sums: Vec<(f64, f64)> = seams.par_iter().map(of_seam).collect();
    // Added up in one order, whatever the threads.
    let (squares, length) =
        sums.into_iter().fold((0.0, 0.0), |sum, own| (sum.0 + own.0, sum.1 + own.1));
    if length > 0.0 { (squares / (length * channels as f64)).sqrt() } else { 0.0 }
}
