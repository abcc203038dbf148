//! Disjoint sets of numbers (Galler & Fischer, "An improved equivalence algorithm", CACM 1964), paths
//! halved as they are walked.
//!
//! Guaranteed: a set is named by its least number, so names do not depend on the order of joins. Not
//! guaranteed: the amortized bound of a union by rank, which would give up those names.

/// Numbers 0 to n − 1, each in one set.
#[derive(Clone, Debug, Default)]
pub struct DisjointSets {
    parents: Vec<u32>,
}

impl DisjointSets {
    /// Each number in a set of its own.
    pub fn new(count: usize) -> Self {
        Self { parents: (0..count as u32).collect() }
    }

    /// Each of `count` numbers in a set of its own again, in the room there is.
    pub(crate) fn reset(&mut self, count: usize) {
        self.parents.clear();
        self.parents.extend(0..count as u32);
    }

    /// The least number of the set that holds `at`.
    ///
    /// # Panics
    /// If there is no such number.
    pub fn root(&mut self, mut at: u32) -> u32 {
        while self.parents[at as usize] != at {
            self.parents[at as usize] = self.parents[self.parents[at as usize] as usize];
            at = self.parents[at as usize];
        }
        at
    }

    /// Unites the sets of two numbers; false if they were one.
    ///
    /// # Panics
    /// If one of them is not there.
    pub fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.parents[a.max(b) as usize] = a.min(b);
        a != b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_is_named_by_its_least_number_in_any_order_of_joins() {
        for joins in [[(4, 2), (2, 3), (0, 1)], [(0, 1), (3, 4), (2, 4)]] {
            let mut sets = DisjointSets::new(5);
            assert!(joins.into_iter().all(|(a, b)| sets.join(a, b)));
            assert!(!sets.join(3, 2));
            assert_eq!([0, 1, 2, 3, 4].map(|at| sets.root(at)), [0, 0, 2, 2, 2]);
        }
    }
}
