//! One budget for several surfaces that are simplified step by step: the cheapest step of all comes first.
//!
//! Done one step at a time, that needs one queue over all. But none of them minds what the others do, and where
//! each stands once no step of it costs up to some limit depends on the limit alone. So each has a curve of its
//! own, and only the limit is looked for.

/// How a surface goes down on its own: its triangles at first and after each step, and the limits that are the
/// least it takes to get there.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    /// They shrink.
    triangles: Vec<u32>,
    /// The first is 0, and they don't shrink.
    limits: Vec<f64>,
}

impl Curve {
    /// A surface that has not gone down yet.
    pub(crate) fn new(triangles: usize) -> Self {
        Self { triangles: vec![triangles as u32], limits: vec![0.0] }
    }

    /// Adds a step to so many triangles at a cost of 0 or more.
    pub(crate) fn push(&mut self, triangles: usize, cost: f64) {
        self.triangles.push(triangles as u32);
        self.limits.push(cost.max(self.limits[self.limits.len() - 1]));
    }

    /// Gives back what room is left for further steps.
    pub(crate) fn shrink_to_fit(&mut self) {
        self.triangles.shrink_to_fit();
        self.limits.shrink_to_fit();
    }

    /// Triangles after so many steps.
    pub(crate) fn triangles(&self, steps: usize) -> usize {
        self.triangles[steps] as usize
    }

    /// Triangles after all its steps.
    pub(crate) fn least_triangles(&self) -> usize {
        self.triangles(self.triangles.len() - 1)
    }

    /// Steps that it does, from `done` on, within a limit.
    fn steps_within(&self, limit: f64, done: usize) -> usize {
        done.max(self.limits.partition_point(|&own| own <= limit) - 1)
    }

    /// Steps that it does, from `done` on, below a limit.
    fn steps_below(&self, limit: f64, done: usize) -> usize {
        done.max(self.limits.partition_point(|&own| own < limit).saturating_sub(1))
    }

    /// The most steps that take no more than so many triangles off what `done` steps left.
    fn steps_taking(&self, part: usize, done: usize) -> usize {
        let end = self.triangles(done).saturating_sub(part);
        done + self.triangles[done..].partition_point(|&own| own as usize >= end) - 1
    }
}

/// Goes on from steps that are `done`, one entry per curve, to at most `target` triangles together, and below
/// that by the last step alone, unless there are no further steps.
///
/// All go to the limit that the target takes. Of those steps that cost just that, as where nothing costs anything,
/// each curve does its part.
pub(crate) fn share_out(curves: &[Curve], done: &mut [usize], target: usize) {
    let total = |done: &[usize]| -> usize {
        curves.iter().zip(done).map(|(curve, &done)| curve.triangles(done)).sum()
    };
    let within = |limit: f64| -> Vec<usize> {
        curves.iter().zip(&*done).map(|(curve, &done)| curve.steps_within(limit, done)).collect()
    };
    if total(done) <= target {
        return;
    }
    let limit = least_limit(|limit| total(&within(limit)) <= target);
    let ends = within(limit);
    for (curve, done) in curves.iter().zip(&mut *done) {
        *done = curve.steps_below(limit, *done);
    }
    let mut surplus = total(done).saturating_sub(target);
    let (parts, all) = (surplus as u128, (total(done) - total(&ends)).max(1) as u128);
    let lists = || curves.iter().zip(&ends);
    for ((curve, &end), done) in lists().zip(&mut *done) {
        let own = curve.triangles(*done) - curve.triangles(end);
        let to = curve.steps_taking((parts * own as u128 / all) as usize, *done).min(end);
        surplus -= curve.triangles(*done) - curve.triangles(to);
        *done = to;
    }
    while surplus > 0 && *done != ends {
        for ((curve, &end), done) in lists().zip(&mut *done) {
            if surplus > 0 && *done < end {
                let step = curve.triangles(*done) - curve.triangles(*done + 1);
                (*done, surplus) = (*done + 1, surplus.saturating_sub(step));
            }
        }
    }
}

/// The least limit of 0 or more that is enough, or the largest that there is.
fn least_limit(is_enough: impl Fn(f64) -> bool) -> f64 {
    // Numbers of 0 or more are in the order of their bits.
    let (mut low, mut high) = (0, f64::MAX.to_bits());
    while low < high {
        let middle = low + (high - low) / 2;
        if is_enough(f64::from_bits(middle)) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    f64::from_bits(high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Steps of one triangle each at these costs, which rise.
    fn curve(mut costs: Vec<f64>) -> Curve {
        costs.sort_by(f64::total_cmp);
        let mut curve = Curve::new(costs.len() + 1);
        (1..=costs.len()).rev().zip(costs).for_each(|(left, cost)| curve.push(left, cost));
        curve
    }

    fn steps(curve: &Curve) -> usize {
        curve.triangles.len() - 1
    }

    /// Steps of each curve when all are simplified to `target`.
    fn share(curves: &[Curve], target: usize) -> Vec<usize> {
        let mut done = vec![0; curves.len()];
        share_out(curves, &mut done, target);
        done
    }

    fn left(curves: &[Curve], done: &[usize]) -> Vec<usize> {
        curves.iter().zip(done).map(|(curve, &done)| curve.triangles(done)).collect()
    }

    /// The least that so many steps cost, over all ways to split them.
    fn least_of_all_splits(curves: &[Curve], count: usize) -> f64 {
        let Some((first, rest)) = curves.split_first() else {
            return if count == 0 { 0.0 } else { f64::INFINITY };
        };
        let own = |taken: usize| first.limits[1..=taken].iter().sum::<f64>();
        (0..=count.min(steps(first)))
            .map(|taken| own(taken) + least_of_all_splits(rest, count - taken))
            .fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn no_other_split_costs_less(
            costs in prop::collection::vec(prop::collection::vec(0.0..10.0f64, 0..9), 1..5),
            share_taken in 0.0..1.0f64,
        ) {
            let curves: Vec<Curve> = costs.into_iter().map(curve).collect();
            let all: usize = curves.iter().map(steps).sum();
            let count = (all as f64 * share_taken) as usize;
            let least = least_of_all_splits(&curves, count);
            let done = share(&curves, all + curves.len() - count);
            prop_assert_eq!(done.iter().sum::<usize>(), count);
            let spent = |(curve, &done): (&Curve, &usize)| curve.limits[1..=done].iter().sum::<f64>();
            let spent: f64 = curves.iter().zip(&done).map(spent).sum();
            prop_assert!(spent <= least + 1e-9, "{spent} of {least}");
        }

        #[test]
        fn targets_are_met_one_after_another_and_missed_by_the_last_step_alone(
            ways in prop::collection::vec(prop::collection::vec((1..16usize, 0..4u8), 0..30), 1..9),
            mut targets in prop::collection::vec(0..2000usize, 1..5),
        ) {
            let curve = |way: Vec<(usize, u8)>| {
                let mut left = 1 + way.iter().map(|(size, _)| size).sum::<usize>();
                let mut curve = Curve::new(left);
                for (size, cost) in way {
                    left -= size;
                    curve.push(left, f64::from(cost));
                }
                curve
            };
            let curves: Vec<Curve> = ways.into_iter().map(curve).collect();
            targets.sort_by(|a, b| b.cmp(a));
            let mut done = vec![0; curves.len()];
            for target in targets {
                let before = done.clone();
                share_out(&curves, &mut done, target);
                prop_assert!(before.iter().zip(&done).all(|(before, done)| before <= done));
                let sum: usize = left(&curves, &done).iter().sum();
                let is_at_end = || done.iter().zip(&curves).all(|(&done, own)| done == steps(own));
                prop_assert!(sum <= target || is_at_end());
                prop_assert!(done == before || sum + 15 >= target, "{sum} of {target}");
            }
        }
    }

    #[test]
    fn long_ways_end_at_one_cost_and_at_the_target() {
        // Side by side: a cost that rises with the cube of what a triangle covers.
        let way = |count: usize, scale: f64| {
            curve((0..count - 1).map(|gone| scale / ((count - gone) as f64).powi(3)).collect())
        };
        let ways = [way(10_000, 1.0), way(4000, 1e-3), way(6000, 64.0)];
        let done = share(&ways, 5000);
        assert_eq!(left(&ways, &done).iter().sum::<usize>(), 5000);
        let next = || ways.iter().zip(&done).map(|(way, &done)| way.limits[done + 1]);
        let last = ways.iter().zip(&done).map(|(way, &done)| way.limits[done]);
        let least = next().fold(f64::INFINITY, f64::min);
        assert!(
            last.fold(0.0, f64::max) <= least,
            "no step that was done costs more than one that was not"
        );
    }

    #[test]
    fn where_nothing_costs_anything_all_give_their_part() {
        let ways = [curve(vec![0.0; 30_000]), curve(vec![0.0; 10_000])];
        let left = left(&ways, &share(&ways, 4000));
        assert_eq!(left.iter().sum::<usize>(), 4000);
        assert!((2900..3100).contains(&left[0]), "{left:?}");
    }

    #[test]
    fn what_cannot_be_reached_is_gone_for_as_far_as_it_goes() {
        let ways = [curve(vec![1.0; 5]), curve(vec![])];
        assert_eq!(left(&ways, &share(&ways, 1)), [1, 1]);
    }
}
