//! The collapses that wait, the cheapest first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::id::PointId;

/// A collapse that waits: of an edge, or of the whole shell of a point, named twice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub(crate) cost: f64,
    pub(crate) points: [PointId; 2],
    pub(crate) versions: [u32; 2],
}

impl Entry {
    pub(crate) fn is_shell(&self) -> bool {
        self.points[0] == self.points[1]
    }
}

impl Ord for Entry {
    /// By cost; between equals by points, so that the order is total.
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.cost
            .total_cmp(&other.cost)
            .then_with(|| self.points.cmp(&other.points))
            .then_with(|| self.versions.cmp(&other.versions))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Entry {}

/// Collapses by cost. An entry whose points have changed since is stale, and skipped when it
/// comes up.
#[derive(Default)]
pub(crate) struct Queue {
    heap: BinaryHeap<Reverse<Entry>>,
    rejected: Vec<Entry>,
}

impl From<Vec<Entry>> for Queue {
    fn from(entries: Vec<Entry>) -> Self {
        Self { heap: entries.into_iter().map(Reverse).collect(), rejected: Vec::new() }
    }
}

impl Queue {
    pub(crate) fn push(&mut self, entry: Entry) {
        self.heap.push(Reverse(entry));
    }

    pub(crate) fn pop(&mut self) -> Option<Entry> {
        self.heap.pop().map(|Reverse(entry)| entry)
    }

    /// The least cost that waits.
    pub(crate) fn least(&self) -> f64 {
        self.heap.peek().map_or(f64::INFINITY, |Reverse(entry)| entry.cost)
    }

    pub(crate) fn reject(&mut self, entry: Entry) {
        self.rejected.push(entry);
    }

    pub(crate) fn retry_rejected(&mut self) {
        self.heap.extend(self.rejected.drain(..).map(Reverse));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(cost: f64, points: [u32; 2]) -> Entry {
        Entry { cost, points: points.map(PointId), versions: [0; 2] }
    }

    #[test]
    fn the_cheapest_comes_first_and_ties_go_by_points() {
        let entries = vec![entry(2.0, [0, 1]), entry(1.0, [4, 5]), entry(1.0, [2, 3])];
        let mut queue = Queue::from(entries);
        queue.push(entry(0.5, [6, 7]));
        assert_eq!(queue.least(), 0.5);
        let order: Vec<u32> = std::iter::from_fn(|| queue.pop()).map(|e| e.points[0].0).collect();
        assert_eq!(order, [6, 2, 4, 0]);
    }

    #[test]
    fn rejected_entries_come_back_when_they_are_retried() {
        let mut queue = Queue::default();
        queue.reject(entry(1.0, [0, 1]));
        assert!(queue.pop().is_none());
        queue.retry_rejected();
        assert_eq!(queue.pop(), Some(entry(1.0, [0, 1])));
        queue.retry_rejected();
        assert!(queue.pop().is_none());
    }
}
