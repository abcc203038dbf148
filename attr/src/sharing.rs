//! One budget for several surfaces that are simplified step by step: the cheapest step of all comes first.
//!
//! Done one step at a time, that needs one queue over all and one thread. But none of them minds what
//! the others do, and where each stands once no step of it costs up to some limit depends on the limit
//! alone. So all are simplified side by side to one limit that rises, and only near the target step by step.

use rayon::prelude::*;

use crate::queue::Queue;

/// The factor by which the limit rises. Where a cost is about the cube of a triangle's area, two
/// that stop at either end of such a rise differ by 3 % of their triangles.
const LIMIT_RISE: f64 = 1.1;
/// The most triangles that a step takes.
const MAX_TRIANGLES_PER_STEP: usize = 16;

/// A surface that is simplified in steps.
pub(crate) trait Simplifiable: Send {
    /// Its triangles now.
    fn triangles(&self) -> usize;

    /// A lower bound of the cost of the next step; infinite if there is none.
    fn least(&self) -> f64;

    /// Simplifies while `goes_on` is true of the lower bound of the next step's cost and of the
    /// triangles left, or to its end.
    fn descend_while(&mut self, goes_on: impl FnMut(f64, usize) -> bool);
}

/// Simplifies all to at most `target` triangles together, and below that by the last step alone,
/// unless none can go on. The result is the same at any number of threads.
pub(crate) fn share_out<T: Simplifiable>(all: &mut [T], target: usize) {
    let mut limit = 0.0f64;
    loop {
        let total: usize = all.iter().map(T::triangles).sum();
        limit = limit.max(all.iter().map(T::least).fold(f64::INFINITY, f64::min));
        if total <= target || limit == f64::INFINITY {
            return;
        }
        let ready = || all.iter().filter(|one| one.least() <= limit);
        let (count, own) = (ready().count(), ready().map(T::triangles).sum::<usize>());
        let surplus = total - target;
        if surplus < 2 * MAX_TRIANGLES_PER_STEP * count {
            return go_step_by_step(all, target);
        }
        // None takes more than its part of what is to go and one step, so that all together don't
        // take more either.
        let parts = (surplus - MAX_TRIANGLES_PER_STEP * count) as u128;
        let part = |triangles: usize| (parts * triangles as u128 / own as u128) as usize;
        let held = all.par_iter_mut().filter(|one| one.least() <= limit).map(|one| {
            let end = one.triangles().saturating_sub(part(one.triangles()));
            one.descend_while(|cost, triangles| cost <= limit && triangles >= end);
            one.least() <= limit
        });
        if !held.reduce(|| false, |a, b| a || b) {
            limit *= LIMIT_RISE;
        }
    }
}

/// Does the cheapest step of all surfaces, one at a time, until at most `target` triangles are left
/// or no surface has a step.
fn go_step_by_step<T: Simplifiable>(all: &mut [T], target: usize) {
    let mut total: usize = all.iter().map(T::triangles).sum();
    let can_go = |(cost, _): &(f64, u32)| *cost < f64::INFINITY;
    let mut queue = Queue::new(all.iter().map(T::least).zip(0..).filter(can_go));
    while total > target
        && let Some(item) = queue.pop()
    {
        let one = &mut all[item as usize];
        let before = one.triangles();
        one.descend_while(|cost, triangles| triangles == before && !queue.has_cheaper(cost));
        total -= before - one.triangles();
        if one.least() < f64::INFINITY {
            queue.push(one.least(), item);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Steps of one triangle each at these costs, which rise.
    #[derive(Clone)]
    struct Curve {
        costs: Vec<f64>,
        gone: usize,
    }

    impl Simplifiable for Curve {
        fn triangles(&self) -> usize {
            self.costs.len() + 1 - self.gone
        }

        fn least(&self) -> f64 {
            self.costs.get(self.gone).copied().unwrap_or(f64::INFINITY)
        }

        fn descend_while(&mut self, mut goes_on: impl FnMut(f64, usize) -> bool) {
            while self.gone < self.costs.len() && goes_on(self.least(), self.triangles()) {
                self.gone += 1;
            }
        }
    }

    fn curve(mut costs: Vec<f64>) -> Curve {
        costs.sort_by(f64::total_cmp);
        Curve { costs, gone: 0 }
    }

    fn spent(curves: &[Curve]) -> f64 {
        curves.iter().flat_map(|curve| &curve.costs[..curve.gone]).sum()
    }

    /// The least that so many steps cost, over all ways to split them.
    fn least_of_all_splits(curves: &[Curve], steps: usize) -> f64 {
        let Some((first, rest)) = curves.split_first() else {
            return if steps == 0 { 0.0 } else { f64::INFINITY };
        };
        let own = |taken: usize| first.costs[..taken].iter().sum::<f64>();
        (0..=steps.min(first.costs.len()))
            .map(|taken| own(taken) + least_of_all_splits(rest, steps - taken))
            .fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn no_other_split_costs_less(
            costs in prop::collection::vec(prop::collection::vec(0.0..10.0f64, 0..9), 1..5),
            share in 0.0..1.0f64,
        ) {
            let mut curves: Vec<Curve> = costs.into_iter().map(curve).collect();
            let all: usize = curves.iter().map(|curve| curve.costs.len()).sum();
            let steps = (all as f64 * share) as usize;
            let least = least_of_all_splits(&curves, steps);
            let whole: usize = curves.iter().map(Curve::triangles).sum();
            share_out(&mut curves, whole - steps);
            prop_assert_eq!(curves.iter().map(|curve| curve.gone).sum::<usize>(), steps);
            // The queue orders by costs of 24 bits.
            prop_assert!(spent(&curves) <= least + 1e-4, "{} of {least}", spent(&curves));
        }
    }

    #[test]
    fn long_ways_end_at_one_cost_and_at_the_target() {
        // Side by side: a cost that rises with the cube of what a triangle covers.
        let way = |count: usize, scale: f64| {
            curve((0..count - 1).map(|gone| scale / ((count - gone) as f64).powi(3)).collect())
        };
        let mut ways = [way(10_000, 1.0), way(4000, 1e-3), way(6000, 64.0)];
        share_out(&mut ways, 5000);
        assert_eq!(ways.iter().map(Curve::triangles).sum::<usize>(), 5000);
        let [least, most] = [f64::min, f64::max]
            .map(|of| ways.iter().map(Curve::least).reduce(of).expect("three ways"));
        assert!(most / least < LIMIT_RISE * LIMIT_RISE, "{least} to {most}");
    }

    #[test]
    fn where_nothing_costs_anything_all_give_their_part() {
        let mut ways = [curve(vec![0.0; 30_000]), curve(vec![0.0; 10_000])];
        share_out(&mut ways, 4000);
        let left = ways.map(|way| way.triangles());
        assert_eq!(left.iter().sum::<usize>(), 4000);
        assert!((2900..3100).contains(&left[0]), "{left:?}");
    }

    #[test]
    fn what_cannot_be_reached_is_gone_for_as_far_as_it_goes() {
        let mut ways = [curve(vec![1.0; 5]), curve(vec![])];
        share_out(&mut ways, 1);
        assert_eq!(ways.map(|way| way.triangles()), [1, 1]);
    }
}
