//! Weights of joints fitted to what the source has over a level.
//!
//! A level takes its weights at its points, and between those they are linear; where the source's bend, as
//! they do at every joint, that is off on one side alone. Here the weights of each joint are fitted by least
//! squares over all of the level, as attributes are (see the parent module):
//!
//! ```text
//! min Σ (Σ_k b_k w_k − w(s))² + λ Σ |w − w_before|²
//! ```
//!
//! over samples of the level, with w(s) the weight at their place on the source. A joint stays with the points
//! whose triangles it moves on the source. Points that stand on one of the source hold still.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::fans::Fans;
use super::system::{Element, Graph, System};
use crate::buckets::Buckets;
use crate::chain::Level;
use crate::id::WedgeId;
use crate::mesh::Mesh;
use crate::origin::{Origin, OriginFinder};
use crate::triangle::area_vector;

/// Joints with their weights.
pub type Influences = Vec<(u32, f64)>;

const ITERATIONS: usize = 12;
const TOLERANCE: f64 = 1e-3;
/// What holds weights where they were, in shares of the area around a point.
const DAMPING: f64 = 0.01;
/// A weight below is none.
const LEAST_WEIGHT: f64 = 1e-3;
/// A triangle is cut into the square of this many, and looked at in the middle of each.
const CUTS: usize = 3;

/// A place on a level, and the difference of its weights to those that it should have.
struct Sample {
    triangle: usize,
    shares: [f64; 3],
    area: f64,
    off: Influences,
}

/// Fits the weights of a level that was made from `source`. `influences`: one list per wedge of the source;
/// `origins`: one per wedge of the level. Gives one list per point of the level, weights above 0 but not of
/// sum 1; an empty one where a point keeps the weights that it has, and none at all if groups of
/// several `kinds` (one per group) meet, or the level has all triangles of the source.
pub fn fit_influences(
    source: &Mesh,
    level: &Level,
    kinds: &[u32],
    origins: &[Origin],
    influences: &[Influences],
) -> Vec<Influences> {
    let mesh = &level.mesh;
    let is_whole = mesh.triangles.len() == source.triangles.len();
    if is_whole || kinds.windows(2).any(|pair| pair[0] != pair[1]) {
        return Vec::new();
    }
    let mut before = vec![Influences::new(); mesh.positions.len()];
    let mut free = vec![false; mesh.positions.len()];
    for (wedge, origin) in origins.iter().enumerate() {
        let point = mesh.wedge_points[wedge];
        before[point] = blended(origin, influences);
        free[point.index()] = origin.barycentrics.max_element() < 1.0;
    }
    let finder = OriginFinder::new(source, level, kinds);
    let samples: Vec<Sample> = (0..mesh.triangles.len())
        .into_par_iter()
        .map_init(Default::default, |search, triangle| {
            let find = |place, slot| {
                let wedge: WedgeId = mesh.triangles[triangle][slot];
                finder.foot_of_place(place, wedge, search)
            };
            sample(mesh, triangle, find, &before, influences)
        })
        .flatten_iter()
        .collect();
    solve(mesh, &samples, &free, before)
}

/// The samples of a triangle.
fn sample(
    mesh: &Mesh,
    triangle: usize,
    mut find: impl FnMut(DVec3, usize) -> Origin,
    before: &[Influences],
    influences: &[Influences],
) -> Vec<Sample> {
    let corners = mesh.triangle_positions(triangle).map(Vec3::as_dvec3);
    let points = mesh.triangle_points(triangle);
    let area = area_vector(mesh.triangle_positions(triangle)).length() / (CUTS * CUTS) as f64;
    let at = |shares: [f64; 3]| {
        let place = (0..3).map(|k| corners[k] * shares[k]).sum();
        let nearest = (0..3).fold(0, |best, k| if shares[k] > shares[best] { k } else { best });
        let mut off = blended(&find(place, nearest), influences);
        for k in 0..3 {
            off.extend(before[points[k].index()].iter().map(|&(j, w)| (j, -w * shares[k])));
        }
        Sample { triangle, shares, area, off: summed(off) }
    };
    middles().map(at).collect()
}

/// The barycentrics of the middles of the pieces that a triangle is cut into.
fn middles() -> impl Iterator<Item = [f64; 3]> {
    let third = |x: usize, up: usize| (3 * x + up) as f64 / (3 * CUTS) as f64;
    let pieces = |up: usize| {
        let rows = CUTS + 1 - up;
        (0..rows)
            .flat_map(move |i| (0..rows - i).map(move |j| [i, j, rows - 1 - i - j]))
            .map(move |row| row.map(|x| third(x, up)))
    };
    // Those that stand as the whole, then those that stand on their heads.
    pieces(1).chain(pieces(2))
}

/// The weights at a place of the source.
fn blended(origin: &Origin, influences: &[Influences]) -> Influences {
    let shares: [f64; 3] = origin.barycentrics.to_array();
    let corners = origin.wedges.iter().zip(shares).filter(|(_, share)| *share > 0.0);
    let all = corners.flat_map(|(wedge, share)| {
        influences[wedge.index()].iter().map(move |&(joint, weight)| (joint, weight * share))
    });
    summed(all.collect())
}

/// The same with one weight for each joint.
fn summed(mut all: Influences) -> Influences {
    all.sort_by_key(|&(joint, _)| joint);
    let sum = |run: &[(u32, f64)]| (run[0].0, run.iter().map(|&(_, weight)| weight).sum());
    all.chunk_by(|a, b| a.0 == b.0).map(sum).collect()
}

/// The weights that fit best.
fn solve(
    mesh: &Mesh,
    samples: &[Sample],
    free: &[bool],
    before: Vec<Influences>,
) -> Vec<Influences> {
    let points = mesh.positions.len();
    let triangles: Vec<[u32; 3]> =
        (0..mesh.triangles.len()).map(|t| mesh.triangle_points(t).map(|p| p.0)).collect();
    let mut elements = vec![Element::<f64>::default(); triangles.len()];
    let mut area = 0.0;
    for Sample { triangle, shares, area: own, .. } in samples {
        area += own;
        elements[*triangle].add(DVec3::from_array(*shares), *own);
    }
    let offs: Vec<(u32, usize, f64)> = samples
        .iter()
        .enumerate()
        .flat_map(|(at, sample)| sample.off.iter().map(move |&(joint, off)| (joint, at, off)))
        .collect();
    let joints = offs.iter().map(|&(joint, ..)| joint as usize + 1).max().unwrap_or(0);
    let by_joint = Buckets::new(offs.iter().map(|&(joint, ..)| joint), joints);
    let graph = Graph::new(Arc::new(Fans::new(triangles, points)));
    let system = System::new(&graph, &elements, DAMPING * area / points as f64);
    let fit = |joint: usize| {
        let (mut right, mut near) = (vec![0.0; points], vec![false; points]);
        for &(_, at, off) in by_joint.of(joint).iter().map(|&at| &offs[at as usize]) {
            let Sample { triangle, shares, area, .. } = &samples[at];
            for (point, share) in mesh.triangle_points(*triangle).into_iter().zip(shares) {
                right[point.index()] += area * share * off;
                near[point.index()] = true;
            }
        }
        let steps = system.solve(&right, free, ITERATIONS, TOLERANCE);
        let moved = steps.into_iter().zip(near).enumerate();
        let moved = moved.filter(|&(point, (_, near))| near && free[point]);
        moved.map(|(point, (step, _))| (point, step)).collect::<Vec<_>>()
    };
    let steps: Vec<Vec<(usize, f64)>> = (0..joints).into_par_iter().map(fit).collect();
    let mut fitted: Vec<Influences> = before;
    for (joint, steps) in (0..).zip(steps) {
        steps.into_iter().for_each(|(point, step)| fitted[point].push((joint, step)));
    }
    for (own, free) in fitted.iter_mut().zip(free) {
        *own = if *free { summed(std::mem::take(own)) } else { Vec::new() };
        own.retain(|&(_, weight)| weight > LEAST_WEIGHT);
    }
    fitted
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;
    use crate::chain::{polish_chain, simplify_chain};
    use crate::options::Options;
    use crate::origin::find_origins;
    use crate::polish::Polish;
    use crate::testing::surface;

    #[test]
    fn the_middles_of_pieces_lie_around_that_of_the_whole() {
        let all: Vec<[f64; 3]> = middles().collect();
        assert_eq!(all.len(), CUTS * CUTS);
        assert!(all.iter().all(|s| (s.iter().sum::<f64>() - 1.0).abs() < 1e-12));
        let sum: f64 = all.iter().map(|s| s[1]).sum();
        assert!((sum / all.len() as f64 - 1.0 / 3.0).abs() < 1e-12);
    }

    /// The mean square between the weights of the second joint over a level and those over its source, on a
    /// flat sheet, where the place of a sample is known.
    fn off(level: &Mesh, weights: &[f64], wanted: impl Fn(f64) -> f64) -> f64 {
        let (mut sum, mut area) = (0.0, 0.0);
        for t in 0..level.triangles.len() {
            let own = area_vector(level.triangle_positions(t)).length();
            let (p, points) = (level.triangle_positions(t), level.triangle_points(t));
            for s in middles() {
                let x: f64 = (0..3).map(|k| f64::from(p[k].x) * s[k]).sum();
                let w: f64 = (0..3).map(|k| weights[points[k].index()] * s[k]).sum();
                sum += own * (w - wanted(x)).powi(2);
                area += own;
            }
        }
        sum / area
    }

    #[test]
    fn weights_that_bend_are_met_better_than_by_what_lies_at_the_points() {
        let source = surface(48, |x, y| Vec3::new(x, y, 0.0));
        let wanted = |x: f64| 1.0 / (1.0 + (-18.0 * (x - 0.4)).exp());
        let influences: Vec<Influences> = source
            .wedge_points
            .iter()
            .map(|&p| wanted(f64::from(source.positions[p].x)))
            .map(|w| vec![(0, 1.0 - w), (3, w)])
            .collect();
        let (options, done) = (Options::default(), AtomicUsize::new(0));
        let bumpy = surface(48, |x, y| Vec3::new(x, y, 0.02 * (9.0 * x).sin() * (8.0 * y).sin()));
        let mut levels = simplify_chain(&bumpy, &[160], &options, &done).unwrap();
        polish_chain(&bumpy, &mut levels, &options, &Polish::default(), &done).unwrap();
        let mut level = levels.remove(0);
        level.mesh.positions.iter_mut().for_each(|p| p.z = 0.0);
        let origins = find_origins(&source, &level, &[0]);
        let second = |all: &Influences| -> f64 {
            all.iter().filter(|(joint, _)| *joint == 3).map(|&(_, weight)| weight).sum()
        };
        let mut before = vec![0.0; level.mesh.positions.len()];
        for (wedge, origin) in origins.iter().enumerate() {
            before[level.mesh.wedge_points[wedge].index()] = second(&blended(origin, &influences));
        }
        let fitted = fit_influences(&source, &level, &[0], &origins, &influences);
        let after: Vec<f64> = fitted
            .iter()
            .zip(&before)
            .map(|(own, before)| if own.is_empty() { *before } else { second(own) })
            .collect();
        let [before, after] = [before, after].map(|w| off(&level.mesh, &w, wanted));
        assert!(after < 0.6 * before, "{after} after {before}");
        assert!(fitted.iter().flatten().all(|(joint, _)| [0, 3].contains(joint)));
    }
}
