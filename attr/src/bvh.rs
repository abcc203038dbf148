//! A binary tree of bounding boxes, split where the surface area heuristic says (MacDonald & Booth,
//! "Heuristics for ray tracing using space subdivision", The Visual Computer 1990), estimated in
//! bins (Wald, "On fast construction of SAH-based bounding volume hierarchies", RT 2007).
//!
//! Guarantees: the same tree at any thread count; depth at most [`MAX_DEPTH`], and time in
//! O(n log n), whatever the boxes are. Not guaranteed: a good tree for boxes that all overlap.
//!
//! Lab note: the builder of obvhs 0.4 (PLOC) merges one pair a pass when all costs tie, as with
//! equal triangles or ones that lie on a line: 16,000 copies of a triangle took it 6.7 s, 1,000
//! copies 0.026 s, with a tree as deep as there are triangles. A damaged file must not do that.

use std::ops::Range;

use glam::Vec3;

/// Bins per axis, as Wald has them.
const BINS: usize = 16;
/// Below this depth boxes are split at the median, so that the depth stays bounded.
const MEDIAN_DEPTH: usize = 40;
/// No path from the root is longer: 2³² boxes are halved 32 times.
const MAX_DEPTH: usize = MEDIAN_DEPTH + 33;
/// A leaf with more boxes is split even where the heuristic would not.
const MAX_LEAF: usize = 8;
/// The cost of visiting a node, in tests of a triangle. With 0.25, 1 and 2 building and searching a
/// sphere of 1e5 triangles was no faster.
const NODE_COST: f32 = 0.5;
/// Subtrees of fewer boxes are built by one thread.
const PARALLEL_MIN: usize = 4096;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Aabb {
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
}

impl Aabb {
    const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The box around `points`.
    pub(crate) fn around(points: &[Vec3]) -> Self {
        points.iter().fold(Self::EMPTY, |bounds, &p| bounds.union(Self { min: p, max: p }))
    }

    /// The box around a triangle.
    #[inline]
    pub(crate) fn of_triangle([a, b, c]: &[Vec3; 3]) -> Self {
        Self { min: a.min(*b).min(*c), max: a.max(*b).max(*c) }
    }

    /// Squared distance from `p`. Differences in f32, squares in f64, where they neither overflow nor
    /// vanish.
    #[inline]
    pub(crate) fn distance_squared(&self, p: Vec3) -> f64 {
        let outside = (self.min - p).max(p - self.max).max(Vec3::ZERO);
        outside.as_dvec3().length_squared()
    }

    fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Halved before they are added, so that no finite box has an infinite center.
    fn center(&self) -> Vec3 {
        self.min * 0.5 + self.max * 0.5
    }

    fn half_area(&self) -> f32 {
        let d = self.max - self.min;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// A node of the tree. Nodes lie in depth-first order: an inner node's first child follows it, its
/// second lies `offset` nodes on.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Node {
    pub(crate) min: Vec3,
    /// Boxes of a leaf; 0 in an inner node.
    pub(crate) count: u32,
    pub(crate) max: Vec3,
    /// A leaf's first place in the order of the boxes; an inner node's offset to its second child.
    pub(crate) offset: u32,
}

impl Node {
    /// Squared distance from `p` to the box.
    #[inline]
    pub(crate) fn distance_squared(&self, p: Vec3) -> f64 {
        Aabb { min: self.min, max: self.max }.distance_squared(p)
    }
}

/// The tree.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bvh {
    /// Depth-first; empty if there are no boxes.
    nodes: Vec<Node>,
}

#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    index: u32,
}

impl Bvh {
    /// Builds the tree over finite boxes; also their indices, leaf after leaf.
    pub(crate) fn build(boxes: impl IntoIterator<Item = Aabb>) -> (Self, Vec<u32>) {
        let mut items: Vec<Item> =
            (0..).zip(boxes).map(|(index, bounds)| Item { bounds, index }).collect();
        let mut nodes = Vec::with_capacity(items.len());
        if !items.is_empty() {
            grow(&mut items, 0, 0, &mut nodes);
        }
        (Self { nodes }, items.iter().map(|item| item.index).collect())
    }

    /// Opens every node whose `key` is finite and at most `bound`, the child of the lower key
    /// first. `visit` gets a leaf's slots and returns the new bound.
    #[inline]
    pub(crate) fn walk(
        &self,
        mut bound: f64,
        key: impl Fn(&Node) -> f64,
        mut visit: impl FnMut(Range<usize>) -> f64,
    ) {
        let Some(root) = self.nodes.first() else { return };
        let mut stack = [(0.0, 0); MAX_DEPTH];
        let mut height = 0;
        let (mut near, mut at) = (key(root), 0);
        loop {
            if near <= bound.min(f64::MAX) {
                let node = &self.nodes[at];
                if node.count == 0 {
                    let (left, right) = (at + 1, at + node.offset as usize);
                    let (mut first, mut second) =
                        ((key(&self.nodes[left]), left), (key(&self.nodes[right]), right));
                    if second.0 < first.0 {
                        (first, second) = (second, first);
                    }
                    stack[height] = second;
                    height += 1;
                    (near, at) = first;
                    continue;
                }
                bound = visit(node.offset as usize..(node.offset + node.count) as usize);
            }
            if height == 0 {
                return;
            }
            height -= 1;
            (near, at) = stack[height];
        }
    }
}

/// Appends the subtree of `items`, whose first has the place `first` in the order.
fn grow(items: &mut [Item], first: u32, depth: usize, nodes: &mut Vec<Node>) {
    let bounds = items.iter().fold(Aabb::EMPTY, |bounds, item| bounds.union(item.bounds));
    let centers = items.iter().fold(Aabb::EMPTY, |bounds, item| {
        let center = item.bounds.center();
        bounds.union(Aabb { min: center, max: center })
    });
    let at = nodes.len();
    let count = items.len() as u32;
    nodes.push(Node { min: bounds.min, max: bounds.max, count, offset: first });
    if items.len() == 1 {
        return;
    }
    let split = if depth < MEDIAN_DEPTH { best_split(items, &centers) } else { None };
    if items.len() <= MAX_LEAF {
        let leaf = bounds.half_area() * items.len() as f32;
        let best = split.map_or(f32::INFINITY, |split| split.cost);
        if best + NODE_COST * bounds.half_area() >= leaf {
            return;
        }
    }
    let middle = match split {
        Some(split) => partition(items, |item| split.is_left(&item.bounds)),
        None => halve(items, &centers),
    };
    nodes[at].count = 0;
    let (left, right) = items.split_at_mut(middle);
    let right_first = first + middle as u32;
    if left.len() + right.len() < PARALLEL_MIN {
        grow(left, first, depth + 1, nodes);
        nodes[at].offset = (nodes.len() - at) as u32;
        grow(right, right_first, depth + 1, nodes);
    } else {
        // Offsets are relative, so a subtree may be grown apart and appended as it is.
        let mut apart = Vec::new();
        rayon::join(
            || grow(left, first, depth + 1, nodes),
            || grow(right, right_first, depth + 1, &mut apart),
        );
        nodes[at].offset = (nodes.len() - at) as u32;
        nodes.append(&mut apart);
    }
}

/// A cut: boxes whose center falls into a bin before `bin` of `axis` go left.
#[derive(Clone, Copy)]
struct Split {
    cost: f32,
    axis: usize,
    bin: usize,
    origin: f32,
    scale: f32,
}

impl Split {
    fn bin_of(axis: usize, origin: f32, scale: f32, bounds: &Aabb) -> usize {
        // A cast of NaN (an infinite scale) gives 0: any bin will do, if it is always the same.
        (((bounds.center()[axis] - origin) * scale) as usize).min(BINS - 1)
    }

    fn is_left(&self, bounds: &Aabb) -> bool {
        Self::bin_of(self.axis, self.origin, self.scale, bounds) < self.bin
    }
}

/// The cheapest cut over the three axes; none if all boxes fall into one bin on every axis, or all
/// costs overflow. Both sides of a cut hold a box.
fn best_split(items: &[Item], centers: &Aabb) -> Option<Split> {
    let mut best: Option<Split> = None;
    for axis in 0..3 {
        let origin = centers.min[axis];
        let extent = centers.max[axis] - origin;
        if extent <= 0.0 {
            continue;
        }
        let scale = BINS as f32 / extent;
        let mut bins = [(Aabb::EMPTY, 0u32); BINS];
        for item in items {
            let bin = &mut bins[Split::bin_of(axis, origin, scale, &item.bounds)];
            *bin = (bin.0.union(item.bounds), bin.1 + 1);
        }
        let mut right_costs = [0.0; BINS];
        let mut side = (Aabb::EMPTY, 0);
        for bin in (1..BINS).rev() {
            side = (side.0.union(bins[bin].0), side.1 + bins[bin].1);
            right_costs[bin] =
                if side.1 == 0 { f32::NAN } else { side.0.half_area() * side.1 as f32 };
        }
        side = (Aabb::EMPTY, 0);
        for bin in 1..BINS {
            side = (side.0.union(bins[bin - 1].0), side.1 + bins[bin - 1].1);
            if side.1 == 0 {
                continue;
            }
            let cost = side.0.half_area() * side.1 as f32 + right_costs[bin];
            // An empty right side costs NaN, which is less than nothing.
            if cost < best.map_or(f32::INFINITY, |best| best.cost) {
                best = Some(Split { cost, axis, bin, origin, scale });
            }
        }
    }
    best
}

/// Moves the items for which `is_left` holds to the front; returns how many they are.
fn partition(items: &mut [Item], is_left: impl Fn(&Item) -> bool) -> usize {
    let mut middle = 0;
    for at in 0..items.len() {
        if is_left(&items[at]) {
            items.swap(middle, at);
            middle += 1;
        }
    }
    middle
}

/// Puts the half with the lower centers on the widest axis first, equal ones by index.
fn halve(items: &mut [Item], centers: &Aabb) -> usize {
    let extent = centers.max * 0.5 - centers.min * 0.5;
    let axis = extent.max_position();
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        let (x, y) = (a.bounds.center()[axis], b.bounds.center()[axis]);
        x.total_cmp(&y).then(a.index.cmp(&b.index))
    });
    middle
}

#[cfg(test)]
mod tests {
    use super::*;

    fn depth(bvh: &Bvh, at: usize) -> usize {
        let node = bvh.nodes[at];
        if node.count > 0 {
            return 1;
        }
        1 + depth(bvh, at + 1).max(depth(bvh, at + node.offset as usize))
    }

    /// Every box lies in exactly one leaf, and every node around its boxes; returns the depth.
    fn check(boxes: &[Aabb]) -> usize {
        let (bvh, order) = Bvh::build(boxes.iter().copied());
        let mut seen = vec![0; boxes.len()];
        for node in &bvh.nodes {
            for &index in &order[node.offset as usize..][..node.count as usize] {
                seen[index as usize] += 1;
                let bounds = boxes[index as usize];
                assert!(node.min.cmple(bounds.min).all() && node.max.cmpge(bounds.max).all());
            }
        }
        assert!(seen.iter().all(|&times| times == 1));
        depth(&bvh, 0)
    }

    fn point_box(p: Vec3) -> Aabb {
        Aabb { min: p, max: p }
    }

    #[test]
    fn a_grid_is_split_evenly() {
        let boxes: Vec<Aabb> = (0..4096u16)
            .map(|i| Vec3::new(f32::from(i % 64), f32::from(i / 64), 0.0))
            .map(|p| Aabb { min: p, max: p + 1.0 })
            .collect();
        assert!(check(&boxes) <= 16);
    }

    #[test]
    fn equal_boxes_are_halved() {
        assert!(check(&vec![point_box(Vec3::ONE); 20_000]) <= 16);
    }

    #[test]
    fn no_spacing_makes_the_tree_deep() {
        let spaced: Vec<Aabb> = (-126..127).map(|e| point_box(Vec3::X * 2f32.powi(e))).collect();
        assert!(check(&spaced) <= MAX_DEPTH);
        let huge: Vec<Aabb> =
            (0..999u16).map(|i| point_box(Vec3::splat((f32::from(i) - 500.0) * 6e35))).collect();
        assert!(check(&huge) <= MAX_DEPTH);
        let tiny: Vec<Aabb> = (0..999).map(|i| point_box(Vec3::X * f32::from_bits(i))).collect();
        assert!(check(&tiny) <= MAX_DEPTH);
    }

    #[test]
    fn no_boxes_make_no_nodes() {
        assert!(Bvh::build([]).0.nodes.is_empty());
    }

    #[test]
    fn the_tree_does_not_depend_on_the_thread_count() {
        let boxes: Vec<Aabb> = (0..20_000u32)
            .map(|i| {
                let hash = |k: u32| (i.wrapping_mul(k) >> 8) as f32;
                point_box(Vec3::new(hash(0x9E37_79B9), hash(0x85EB_CA6B), hash(0xC2B2_AE35)))
            })
            .collect();
        let build = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Bvh::build(boxes.iter().copied()))
        };
        let (one, three) = (build(1), build(3));
        assert_eq!(one.1, three.1);
        assert_eq!(format!("{:?}", one.0), format!("{:?}", three.0));
    }
}
