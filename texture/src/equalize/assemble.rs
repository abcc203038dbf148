//! The least-squares problem of seams: the texels that may change, how freely, and within which
//! bounds.

use glam::DVec3;
use rayon::prelude::*;

use super::Options;
use super::footprint::{Sampler, Taps};
use super::seam::{Placed, Spread, Station};
use super::solve::Problem;
use crate::validity::Validity;

/// The problem, and the texel that each unknown is.
pub(super) struct Assembled {
    pub(super) texels: Vec<usize>,
    pub(super) problem: Problem,
}

/// The input of the problem.
#[derive(Clone, Copy)]
pub(super) struct Assembly<'a> {
    pub(super) seams: &'a [Placed],
    pub(super) sampler: Sampler,
    pub(super) validity: &'a Validity,
    pub(super) options: Options,
}

/// The terms that one seam adds to the problem.
#[derive(Default)]
struct Part {
    problem: Problem,
    /// Unknowns, and the least and the greatest value around them.
    ranges: Vec<(u32, [DVec3; 2])>,
}

impl Assembly<'_> {
    /// Sets the problem up for an image of which `value` reads up to three channels.
    pub(super) fn build(self, value: impl Fn(usize) -> DVec3 + Sync) -> Assembled {
        let texels = self.unknowns();
        let part = |seam: &Placed| self.part(seam, &texels, &value);
        let parts: Vec<Part> = self.seams.par_iter().map(part).collect();
        let mut problem = Problem::default();
        let flags = self.validity.flags();
        let stiffness = |&texel: &usize| {
            if flags[texel] { self.options.stiffness } else { self.options.free_stiffness }
        };
        problem.stiffness = texels.iter().map(stiffness).collect();
        let mut ranges: Vec<[DVec3; 2]> = texels.iter().map(|&texel| [value(texel); 2]).collect();
        for part in parts {
            problem.sides.append(&part.problem.sides);
            problem.turns.extend(part.problem.turns);
            problem.lengths.extend(part.problem.lengths);
            problem.steps.extend(part.problem.steps);
            for (unknown, own) in part.ranges {
                let [least, most] = &mut ranges[unknown as usize];
                [*least, *most] = [least.min(own[0]), most.max(own[1])];
            }
        }
        let most = DVec3::splat(self.options.max_change);
        let bound = |(range, &texel): (&[DVec3; 2], &usize)| {
            range.map(|end| (end - value(texel)).clamp(-most, most))
        };
        problem.bounds = ranges.iter().zip(&texels).map(bound).collect();
        Assembled { texels, problem }
    }

    /// The texels that may change, in order: all that seams read at mip level 0, and those of them
    /// that no chart covers at the levels below.
    fn unknowns(self) -> Vec<usize> {
        let flags = self.validity.flags();
        let of_seam = |seam: &Placed| {
            let mut own = Vec::new();
            for level in 0..=self.options.mips {
                for station in seam.stations(self.sampler, level, Spread::Ends) {
                    let read = station.taps.iter().flatten().map(|tap| tap.0);
                    own.extend(read.filter(|&texel| level == 0 || !flags[texel]));
                }
                own.sort_unstable();
                own.dedup();
            }
            own
        };
        let mut texels: Vec<usize> = self.seams.par_iter().flat_map_iter(of_seam).collect();
        texels.par_sort_unstable();
        texels.dedup();
        texels
    }

    fn part(self, seam: &Placed, texels: &[usize], value: impl Fn(usize) -> DVec3) -> Part {
        let mut part = Part::default();
        for level in 0..=self.options.mips {
            for station in seam.stations(self.sampler, level, Spread::Ends) {
                let step = station.step(&value);
                if step.is_finite() {
                    part.add(&station, step, texels, &value);
                }
            }
        }
        part
    }
}

impl Part {
    fn add(
        &mut self,
        station: &Station,
        step: DVec3,
        texels: &[usize],
        value: impl Fn(usize) -> DVec3,
    ) {
        let unknowns = station.taps.each_ref().map(|taps| unknowns_of(taps, texels));
        for side in &unknowns {
            self.problem.sides.push(side.iter().copied());
        }
        self.problem.turns.extend(station.turn);
        self.problem.lengths.push(station.length);
        self.problem.steps.push(step);
        let [own, other] = station
            .taps
            .each_ref()
            .map(|taps| taps.iter().map(|&(texel, _)| value(texel)).collect::<Vec<DVec3>>());
        // Each side's texels may take any value between those of both, as they see them.
        let turn = |v: &DVec3| station.turned(*v);
        let back = |v: &DVec3| station.turn.map_or(*v, |turn| turn.transpose() * *v);
        let seen = [
            range(own.iter().copied().chain(other.iter().map(turn))),
            range(own.iter().map(back).chain(other.iter().copied())),
        ];
        for (side, seen) in unknowns.iter().zip(seen) {
            self.ranges.extend(side.iter().map(|&(unknown, _)| (unknown, seen)));
        }
    }
}

fn range(values: impl Iterator<Item = DVec3>) -> [DVec3; 2] {
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    values.fold(none, |[least, most], value| [least.min(value), most.max(value)])
}

/// The unknowns among the texels that a tap reads.
fn unknowns_of(taps: &Taps, texels: &[usize]) -> Vec<(u32, f32)> {
    let unknown = |&(texel, weight): &(usize, f64)| {
        texels.binary_search(&texel).ok().map(|unknown| (unknown as u32, weight as f32))
    };
    taps.iter().filter_map(unknown).collect()
}
