//! The least-squares problem of a set of seams, and its solution by conjugate gradients.
//!
//! With d the change of the unknown texels, s the steps as they are, A the taps' weights, L the
//! length that each point stands for and Λ the stiffness of each texel, it minimises
//!
//! ```text
//! (A d + s)ᵀ L (A d + s) + dᵀ Λ d,   so   (Aᵀ L A + Λ) d = −Aᵀ L s
//! ```
//!
//! and keeps each d between two bounds: what lies beyond is put on its bound and held there, and
//! the others are solved for once more. The matrix is never formed; its diagonal preconditions.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Residual of the normal equations, relative to the first, at which the solution is good enough:
/// steps of two scans at mips 0 to 3 are those of 1e-6 within 0.4 %, in 0.4 and 0.5 of the time.
pub(super) const TOLERANCE: f64 = 1e-4;
/// Iterations that end a solution that does not get there.
const MOST_ITERATIONS: usize = 500;
/// The most rounds in which unknowns beyond their bounds are held and the others solved for again.
const MOST_ROUNDS: usize = 8;

/// A sparse matrix by rows.
#[derive(Clone, Debug)]
pub(super) struct Sparse {
    starts: Vec<usize>,
    entries: Vec<(u32, f32)>,
}

impl Default for Sparse {
    fn default() -> Self {
        Self { starts: vec![0], entries: Vec::new() }
    }
}

impl Sparse {
    pub(super) fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    pub(super) fn row(&self, row: usize) -> &[(u32, f32)] {
        &self.entries[self.starts[row]..self.starts[row + 1]]
    }

    pub(super) fn push(&mut self, row: impl IntoIterator<Item = (u32, f32)>) {
        self.entries.extend(row);
        self.starts.push(self.entries.len());
    }

    pub(super) fn append(&mut self, other: &Self) {
        let first = self.entries.len();
        self.entries.extend(&other.entries);
        self.starts.extend(other.starts[1..].iter().map(|start| first + start));
    }

    fn transposed(&self, columns: usize) -> Self {
        let mut starts = vec![0; columns + 1];
        for entry in &self.entries {
            starts[entry.0 as usize + 1] += 1;
        }
        for column in 0..columns {
            starts[column + 1] += starts[column];
        }
        let mut next = starts.clone();
        let mut entries = vec![(0, 0.0); self.entries.len()];
        for row in 0..self.rows() {
            for &(column, weight) in self.row(row) {
                let place = &mut next[column as usize];
                entries[*place] = (row as u32, weight);
                *place += 1;
            }
        }
        Self { starts, entries }
    }

    fn times(&self, vector: &[DVec3]) -> Vec<DVec3> {
        let product = |row| {
            let terms = self.row(row).iter();
            terms.map(|&(at, weight)| f64::from(weight) * vector[at as usize]).sum()
        };
        (0..self.rows()).into_par_iter().map(product).collect()
    }
}

/// The problem. Up to three channels side by side, which do not touch but where vectors are turned.
#[derive(Clone, Debug, Default)]
pub(super) struct Problem {
    /// Weights of the unknowns: rows 2i and 2i + 1 are the two sides of point i.
    pub(super) sides: Sparse,
    /// One per point, or none: what turns the second side.
    pub(super) turns: Vec<DMat3>,
    /// One per point: its length.
    pub(super) lengths: Vec<f64>,
    /// One per point: the step before.
    pub(super) steps: Vec<DVec3>,
    /// One per unknown.
    pub(super) stiffness: Vec<f64>,
    /// One per unknown: the least and the greatest change.
    pub(super) bounds: Vec<[DVec3; 2]>,
}

impl Problem {
    /// The change of each unknown, to a tolerance. The same to the bit on any number of threads.
    pub(super) fn solve(&self, tolerance: f64) -> Vec<DVec3> {
        let unknowns = self.stiffness.len();
        let by_unknown = self.sides.transposed(unknowns);
        let diagonal = self.diagonal(&by_unknown);
        let mut change = vec![DVec3::ZERO; unknowns];
        let mut free = vec![DVec3::ONE; unknowns];
        for _ in 0..MOST_ROUNDS {
            self.descend(&by_unknown, &diagonal, &free, tolerance, &mut change);
            let mut held = false;
            for ((change, free), [least, most]) in
                change.iter_mut().zip(&mut free).zip(&self.bounds)
            {
                let within = change.clamp(*least, *most);
                for channel in 0..3 {
                    if within[channel] != change[channel] {
                        free[channel] = 0.0;
                        held = true;
                    }
                }
                *change = within;
            }
            if !held {
                break;
            }
        }
        change
    }

    /// Conjugate gradients from `change` on, over the unknowns that are free.
    fn descend(
        &self,
        by_unknown: &Sparse,
        diagonal: &[f64],
        free: &[DVec3],
        tolerance: f64,
        change: &mut [DVec3],
    ) {
        let precondition = |residual: &[DVec3]| -> Vec<DVec3> {
            residual.iter().zip(diagonal).map(|(r, d)| r / d).collect()
        };
        let force = self.transposed_times(by_unknown, &self.steps);
        let product = self.times(by_unknown, change);
        let mut residual: Vec<DVec3> =
            force.iter().zip(&product).zip(free).map(|((f, p), free)| -(f + p) * free).collect();
        let enough = self.dot(&force, &precondition(&force)) * (tolerance * tolerance);
        let mut steepest = precondition(&residual);
        let mut direction = steepest.clone();
        let mut norm = self.dot(&residual, &steepest);
        for _ in 0..MOST_ITERATIONS {
            if norm.cmple(enough).all() {
                return;
            }
            let product = self.times(by_unknown, &direction);
            let curvature = self.dot(&direction, &product);
            let length = ratio(norm, curvature);
            for (((change, residual), (direction, product)), free) in
                change.iter_mut().zip(&mut residual).zip(direction.iter().zip(&product)).zip(free)
            {
                *change += length * direction;
                *residual -= length * product * free;
            }
            steepest = precondition(&residual);
            let next = self.dot(&residual, &steepest);
            let share = ratio(next, norm);
            norm = next;
            for (direction, steepest) in direction.iter_mut().zip(&steepest) {
                *direction = steepest + share * *direction;
            }
        }
    }

    /// (Aᵀ L A + Λ) v.
    fn times(&self, by_unknown: &Sparse, vector: &[DVec3]) -> Vec<DVec3> {
        let sides = self.sides.times(vector);
        let step = |point: usize| {
            let [own, other] = [sides[2 * point], sides[2 * point + 1]];
            own - self.turns.get(point).map_or(other, |turn| turn * other)
        };
        let steps: Vec<DVec3> = (0..self.lengths.len()).map(step).collect();
        let mut product = self.transposed_times(by_unknown, &steps);
        for ((product, vector), stiffness) in product.iter_mut().zip(vector).zip(&self.stiffness) {
            *product += stiffness * vector;
        }
        product
    }

    /// Aᵀ L s.
    fn transposed_times(&self, by_unknown: &Sparse, steps: &[DVec3]) -> Vec<DVec3> {
        let mut sides = Vec::with_capacity(2 * steps.len());
        for (point, (step, length)) in steps.iter().zip(&self.lengths).enumerate() {
            let pull = step * length;
            let back = self.turns.get(point).map_or(pull, |turn| turn.transpose() * pull);
            sides.extend([pull, -back]);
        }
        by_unknown.times(&sides)
    }

    /// The diagonal of Aᵀ L A + Λ, but for texels that both sides of a point read: an estimate is
    /// enough for what it is used for.
    fn diagonal(&self, by_unknown: &Sparse) -> Vec<f64> {
        let of = |unknown: usize| {
            let entries = by_unknown.row(unknown).iter();
            let squares = entries.map(|&(side, weight)| {
                self.lengths[side as usize / 2] * f64::from(weight) * f64::from(weight)
            });
            squares.sum::<f64>() + self.stiffness[unknown]
        };
        (0..self.stiffness.len()).into_par_iter().map(of).collect()
    }

    /// Scalar products, channel by channel; of turned vectors, which mix channels, over all three.
    fn dot(&self, a: &[DVec3], b: &[DVec3]) -> DVec3 {
        let product: DVec3 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        if self.turns.is_empty() { product } else { DVec3::splat(product.element_sum()) }
    }
}

/// a / b, 0 where b is.
fn ratio(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::select(b.cmpgt(DVec3::ZERO), a / b, DVec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    /// Points over a few unknowns, of which each side reads two; turned ones mix channels.
    fn problem(numbers: &[f64], turned: bool) -> Problem {
        const UNKNOWNS: u32 = 9;
        let mut problem = Problem::default();
        for (point, pair) in (0u32..).zip(numbers.chunks_exact(4)) {
            for side in 0..2 {
                let first = (point * 5 + side * 4) % UNKNOWNS;
                let weight = pair[side as usize].abs() as f32;
                problem.sides.push([(first, weight), ((first + 2) % UNKNOWNS, 1.0 - weight)]);
            }
            if turned {
                problem.turns.push(DMat3::from_rotation_z(7.0 * pair[2]));
            }
            problem.lengths.push(0.1 + pair[3].abs());
            problem.steps.push(DVec3::new(pair[2], pair[3], pair[0] - pair[1]));
        }
        problem.stiffness = (1..=UNKNOWNS).map(|unknown| 0.05 * f64::from(unknown)).collect();
        problem.bounds = vec![[DVec3::NEG_INFINITY, DVec3::INFINITY]; UNKNOWNS as usize];
        problem
    }

    /// Solves by a dense matrix over all channels of all unknowns.
    fn solve_dense(problem: &Problem) -> Vec<DVec3> {
        let (points, unknowns) = (problem.lengths.len(), problem.stiffness.len());
        let mut rows = DMatrix::<f64>::zeros(3 * points, 3 * unknowns);
        let mut steps = DVector::<f64>::zeros(3 * points);
        for point in 0..points {
            let root = problem.lengths[point].sqrt();
            let turn = problem.turns.get(point).copied().unwrap_or(DMat3::IDENTITY);
            for (side, matrix) in [(0, DMat3::IDENTITY), (1, -turn)] {
                for &(unknown, weight) in problem.sides.row(2 * point + side) {
                    for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
                        rows[(3 * point + i, 3 * unknown as usize + j)] +=
                            root * f64::from(weight) * matrix.col(j)[i];
                    }
                }
            }
            for channel in 0..3 {
                steps[3 * point + channel] = root * problem.steps[point][channel];
            }
        }
        let mut normal = rows.transpose() * &rows;
        for at in 0..3 * unknowns {
            normal[(at, at)] += problem.stiffness[at / 3];
        }
        let force = -(rows.transpose() * steps);
        let change = normal.cholesky().unwrap().solve(&force);
        change.as_slice().chunks_exact(3).map(DVec3::from_slice).collect()
    }

    proptest! {
        #[test]
        fn the_solution_is_that_of_a_dense_matrix(
            numbers in prop::collection::vec(-1.0..1.0f64, 4..60),
            turned in any::<bool>(),
        ) {
            let problem = problem(&numbers, turned);
            for (found, expected) in problem.solve(1e-6).iter().zip(solve_dense(&problem)) {
                prop_assert!(found.distance(expected) < 1e-4, "{} {}", found, expected);
            }
        }

        #[test]
        fn no_change_goes_beyond_its_bounds_and_the_others_are_the_best(
            numbers in prop::collection::vec(-1.0..1.0f64, 4..60),
        ) {
            let mut problem = problem(&numbers, false);
            problem.bounds = vec![[DVec3::splat(-0.02), DVec3::splat(0.03)]; 9];
            let change = problem.solve(1e-6);
            for change in &change {
                prop_assert!(change.min_element() >= -0.02 && change.max_element() <= 0.03);
            }
            // What is between its bounds lies where the cost is least.
            let by_unknown = problem.sides.transposed(9);
            let force = problem.transposed_times(&by_unknown, &problem.steps);
            let slope = problem.times(&by_unknown, &change);
            for (at, change) in change.iter().enumerate() {
                for channel in 0..3 {
                    let free = change[channel] > -0.02 && change[channel] < 0.03;
                    let slope = slope[at][channel] + force[at][channel];
                    prop_assert!(!free || slope.abs() < 1e-3, "{}", slope);
                }
            }
        }
    }
}
