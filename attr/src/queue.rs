//! A lazy priority queue, the cheapest first: keys are lower bounds, re-evaluated on pop.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Numbered items, each keyed by a lower bound of its cost.
///
/// An item and its key are one number: the key, rounded to f32, above the item. So comparing is one
/// instruction, an entry is 8 bytes, and between equal keys the lesser item comes first. A key is
/// not raised when the cost rises: the caller computes the cost of the item that it pops, and
/// pushes it again if another may be cheaper.
#[derive(Default)]
pub(crate) struct Queue {
    heap: BinaryHeap<Reverse<u64>>,
}

fn entry(cost: f64, item: u32) -> u64 {
    u64::from((cost as f32).to_bits()) << 32 | u64::from(item)
}

fn cost_of(entry: u64) -> f64 {
    f64::from(f32::from_bits((entry >> 32) as u32))
}

impl Queue {
    /// A queue of items with their keys, which must be 0 or more.
    pub(crate) fn new(items: impl IntoIterator<Item = (f64, u32)>) -> Self {
        let entries: Vec<_> =
            items.into_iter().map(|(cost, item)| Reverse(entry(cost, item))).collect();
        Self { heap: entries.into() }
    }

    pub(crate) fn push(&mut self, cost: f64, item: u32) {
        self.heap.push(Reverse(entry(cost, item)));
    }

    pub(crate) fn pop(&mut self) -> Option<u32> {
        self.heap.pop().map(|Reverse(entry)| entry as u32)
    }

    /// The queued keys and items, in no order.
    pub(crate) fn into_items(self) -> impl Iterator<Item = (f64, u32)> {
        self.heap.into_iter().map(|Reverse(entry)| (cost_of(entry), entry as u32))
    }

    /// The least key, infinite if nothing is queued.
    pub(crate) fn least(&self) -> f64 {
        self.heap.peek().map_or(f64::INFINITY, |Reverse(entry)| cost_of(*entry))
    }

    /// Whether the least key is below `cost`.
    pub(crate) fn has_cheaper(&self, cost: f64) -> bool {
        self.least() < f64::from(cost as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cheapest_comes_first_and_ties_go_by_number() {
        let mut queue = Queue::new([(2.0, 1), (1.0, 9), (1.0, 3), (f64::INFINITY, 0)]);
        queue.push(0.5, 6);
        queue.push(1e-300, 7);
        assert!(queue.has_cheaper(0.5) && !queue.has_cheaper(0.0));
        let order: Vec<u32> = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(order, [7, 6, 3, 9, 1, 0]);
        assert!(!queue.has_cheaper(f64::INFINITY));
    }
}
