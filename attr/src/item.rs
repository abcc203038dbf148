//! The items of the queue: the steps that a descent may take.

use crate::id::{EdgeId, PointId};

/// A step of a descent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Item {
    /// The collapse of an edge.
    Edge(EdgeId),
    /// The end of the shell that a point belongs to.
    Shell(PointId),
    /// Two points of different shells that meet, by their number among the pairs.
    Pair(u32),
    /// The loop of three edges, one of them this, that costs least to become a point.
    Loop(EdgeId),
}

/// Bits of the number under the kind.
const BITS: u32 = 30;

/// The most triangles of a mesh: each may have three edges of its own.
pub(crate) const MAX_TRIANGLES: usize = (1 << BITS) / 3;

impl Item {
    /// Kind and number as one. Of equal costs the lesser comes first: edges, then shells, then pairs,
    /// then loops.
    pub(crate) fn pack(self) -> u32 {
        let (kind, number) = match self {
            Self::Edge(edge) => (0, edge.0),
            Self::Shell(point) => (1, point.0),
            Self::Pair(pair) => (2, pair),
            Self::Loop(edge) => (3, edge.0),
        };
        debug_assert!(number >> BITS == 0, "item {number} of a mesh that is too large");
        kind << BITS | number
    }

    /// The item that was packed.
    pub(crate) fn unpack(packed: u32) -> Self {
        let number = packed & ((1 << BITS) - 1);
        match packed >> BITS {
            0 => Self::Edge(EdgeId(number)),
            1 => Self::Shell(PointId(number)),
            2 => Self::Pair(number),
            _ => Self::Loop(EdgeId(number)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_come_back_as_they_were_and_edges_come_first() {
        let items = [
            Item::Edge(EdgeId(7)),
            Item::Shell(PointId(3)),
            Item::Pair((1 << BITS) - 1),
            Item::Loop(EdgeId(0)),
        ];
        assert_eq!(items.map(|item| Item::unpack(item.pack())), items);
        assert!(items.is_sorted_by_key(|item| item.pack()));
    }
}
