//! Which keys of edges still are what they cost.

use crate::id::{EdgeId, PointId};

/// No key of an edge stands.
const NEVER: u32 = u32::MAX;

/// When edges were evaluated last, and when points changed, both in collapses: a key stands as long as neither
/// end has changed. About a fifth of the evaluations of a smooth surface are of such edges.
pub(super) struct Evaluated {
    edges: Vec<u32>,
    points: Vec<u32>,
    now: u32,
}

impl Evaluated {
    /// All edges were evaluated as they were queued but those that have a bound of an earlier descent.
    pub(super) fn new(bounds: &[f32], points: usize) -> Self {
        let edges = bounds.iter().map(|&bound| if bound > 0.0 { NEVER } else { 0 });
        Self { edges: edges.collect(), points: vec![0; points], now: 0 }
    }

    /// Whether an edge costs what it did when it was queued, by the quadrics of its `ends`.
    pub(super) fn stands(&self, edge: EdgeId, ends: [PointId; 2]) -> bool {
        let then = self.edges[edge];
        then != NEVER && ends.iter().all(|&end| self.points[end] <= then)
    }

    /// Notes that an edge is queued with what it costs now.
    pub(super) fn set(&mut self, edge: EdgeId) {
        self.edges[edge] = self.now;
    }

    /// Notes that a point has changed.
    pub(super) fn change(&mut self, point: PointId) {
        self.now += 1;
        self.points[point] = self.now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_stands_until_an_end_changes() {
        let mut evaluated = Evaluated::new(&[0.0, 0.5], 3);
        let (first, second) = (EdgeId(0), EdgeId(1));
        let ends = [PointId(0), PointId(1)];
        assert!(evaluated.stands(first, ends) && !evaluated.stands(second, ends));
        evaluated.change(PointId(2));
        assert!(evaluated.stands(first, ends), "another point");
        evaluated.change(PointId(1));
        assert!(!evaluated.stands(first, ends));
        evaluated.set(first);
        assert!(evaluated.stands(first, ends));
    }
}
