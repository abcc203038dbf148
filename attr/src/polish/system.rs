//! Symmetric positive definite systems over the vertices of a triangle mesh: a block for each vertex
//! and each edge, solved by conjugate gradients (Hestenes & Stiefel, "Methods of conjugate gradients
//! for solving linear systems", 1952) with the diagonal blocks as preconditioner.
//!
//! Guarantee: the same bits at any thread count. Rows are summed in the order of the triangles, dot
//! products in fixed chunks.

use std::ops::{Add, AddAssign, Mul, Sub};
use std::sync::Arc;

use glam::{DVec3, DVec4, Vec3Swizzles as _};
use rayon::prelude::*;

use super::fans::Fans;

/// Rows that one task works on, and terms that a dot product sums at a time.
const CHUNK: usize = 2048;

/// The unknown at a vertex.
pub(super) trait Unknown:
    Copy
    + Default
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<f64, Output = Self>
    + AddAssign
{
    fn dot(self, other: Self) -> f64;
}

impl Unknown for f64 {
    fn dot(self, other: Self) -> f64 {
        self * other
    }
}

impl Unknown for DVec3 {
    fn dot(self, other: Self) -> f64 {
        self.dot(other)
    }
}

/// Four unknowns that share one matrix.
impl Unknown for DVec4 {
    fn dot(self, other: Self) -> f64 {
        self.dot(other)
    }
}

/// A block of the matrix: the coupling of two vertices, or of one with itself.
pub(super) trait Block: Copy + Default + Send + Sync + AddAssign {
    /// Plus `by` times the identity.
    fn damped(self, by: f64) -> Self;
}

/// What a block does with unknowns of a kind.
pub(super) trait Couples<V: Unknown>: Block {
    fn apply(&self, v: V) -> V;
    /// The vector that this block maps to `v`; zero if there is none.
    fn solve(&self, v: V) -> V;
}

impl Block for f64 {
    fn damped(self, by: f64) -> Self {
        self + by
    }
}

impl<V: Unknown> Couples<V> for f64 {
    fn apply(&self, v: V) -> V {
        v * *self
    }

    fn solve(&self, v: V) -> V {
        if *self > 0.0 { v * (1.0 / self) } else { V::default() }
    }
}

/// A symmetric 3 × 3 matrix: xx, xy, xz, yy, yz, zz. In f32, as memory is what a product waits for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Symmetric([f32; 6]);

impl Symmetric {
    /// `weight` times n nᵀ.
    #[inline]
    pub(super) fn outer(n: DVec3, weight: f64) -> Self {
        let w = n * weight;
        let all = [w.x * n.x, w.x * n.y, w.x * n.z, w.y * n.y, w.y * n.z, w.z * n.z];
        Self(all.map(|x| x as f32))
    }
}

impl AddAssign for Symmetric {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        for (mine, theirs) in self.0.iter_mut().zip(other.0) {
            *mine += theirs;
        }
    }
}

impl Block for Symmetric {
    fn damped(mut self, by: f64) -> Self {
        [0, 3, 5].into_iter().for_each(|at| self.0[at] += by as f32);
        self
    }
}

impl Couples<DVec3> for Symmetric {
    #[inline]
    fn apply(&self, v: DVec3) -> DVec3 {
        let [xx, xy, xz, yy, yz, zz] = self.0.map(f64::from);
        DVec3::new(
            xx * v.x + xy * v.y + xz * v.z,
            xy * v.x + yy * v.y + yz * v.z,
            xz * v.x + yz * v.y + zz * v.z,
        )
    }

    #[inline]
    fn solve(&self, v: DVec3) -> DVec3 {
        let [xx, xy, xz, yy, yz, zz] = self.0.map(f64::from);
        let rows = [DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz)];
        let cofactors = [rows[1].cross(rows[2]), rows[2].cross(rows[0]), rows[0].cross(rows[1])];
        let determinant = rows[0].dot(cofactors[0]);
        if determinant <= 0.0 {
            return DVec3::ZERO;
        }
        (cofactors[0] * v.x + cofactors[1] * v.y + cofactors[2] * v.z) / determinant
    }
}

/// The vertices that triangles join.
pub(super) struct Graph {
    fans: Arc<Fans>,
    neighbor_starts: Vec<u32>,
    neighbors: Vec<u32>,
}

impl Graph {
    pub(super) fn new(fans: Arc<Fans>) -> Self {
        let vertices = fans.vertices();
        let mut graph = Self { fans, neighbor_starts: vec![0], neighbors: Vec::new() };
        let mut own = Vec::new();
        for vertex in 0..vertices {
            own.clear();
            for corner in graph.fans.corners(vertex as u32) {
                let triangle = graph.fans.triangles[corner.triangle().index()];
                let slot = corner.slot();
                own.extend([triangle[(slot + 1) % 3], triangle[(slot + 2) % 3]]);
            }
            own.sort_unstable();
            own.dedup();
            graph.neighbors.extend_from_slice(&own);
            graph.neighbor_starts.push(graph.neighbors.len() as u32);
        }
        graph
    }

    fn vertices(&self) -> usize {
        self.neighbor_starts.len() - 1
    }

    fn neighbors(&self, vertex: usize) -> std::ops::Range<usize> {
        self.neighbor_starts[vertex] as usize..self.neighbor_starts[vertex + 1] as usize
    }

    /// One per vertex: the sum over its corners.
    pub(super) fn sum_corners<V: Unknown>(&self, of_corner: impl Fn(usize) -> V + Sync) -> Vec<V> {
        (0..self.vertices())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|vertex| {
                let mut sum = V::default();
                let corners = self.fans.corners(vertex as u32);
                corners.for_each(|corner| sum += of_corner(corner.index()));
                sum
            })
            .collect()
    }

    /// `values`, one per neighbor of each vertex, cut after every `CHUNK` vertices.
    fn cut<'b, T>(&self, mut values: &'b mut [T]) -> Vec<&'b mut [T]> {
        let mut cut = Vec::new();
        for first in (0..self.vertices()).step_by(CHUNK) {
            let last = (first + CHUNK).min(self.vertices());
            let len = (self.neighbor_starts[last] - self.neighbor_starts[first]) as usize;
            let (own, rest) = values.split_at_mut(len);
            cut.push(own);
            values = rest;
        }
        cut
    }
}

/// The terms that a triangle adds to the matrix: at its corners, then at its edges 01, 12 and 20.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Element<B> {
    pub(super) corners: [B; 3],
    pub(super) edges: [B; 3],
}

impl Element<f64> {
    /// Adds the products of a sample's barycentrics, as many times as it counts.
    #[inline]
    pub(super) fn add(&mut self, b: DVec3, weight: f64) {
        let w = b * weight;
        for (own, product) in self.corners.iter_mut().zip((w * b).to_array()) {
            *own += product;
        }
        for (own, product) in self.edges.iter_mut().zip((w * b.yzx()).to_array()) {
            *own += product;
        }
    }

    /// The weight of all samples: barycentrics sum to 1.
    pub(super) fn weight(&self) -> f64 {
        self.corners.iter().sum::<f64>() + 2.0 * self.edges.iter().sum::<f64>()
    }
}

/// A matrix over a mesh.
pub(super) struct System<'a, B> {
    graph: &'a Graph,
    diagonal: Vec<B>,
    /// One per neighbor of each vertex.
    off: Vec<B>,
}

impl<'a, B: Block> System<'a, B> {
    /// Sums the elements, one per triangle, plus `damping` on the diagonal.
    pub(super) fn new(graph: &'a Graph, elements: &[Element<B>], damping: f64) -> Self {
        let mut diagonal = vec![B::default().damped(damping); graph.vertices()];
        let mut off = vec![B::default(); graph.neighbors.len()];
        let chunks = diagonal.par_chunks_mut(CHUNK).zip(graph.cut(&mut off)).enumerate();
        chunks.for_each(|(chunk, (diagonal, mut off))| {
            for (vertex, diagonal) in (chunk * CHUNK..).zip(diagonal) {
                let (own, rest) = off.split_at_mut(graph.neighbors(vertex).len());
                fill_row(graph, elements, vertex, diagonal, own);
                off = rest;
            }
        });
        Self { graph, diagonal, off }
    }

    fn apply<V: Unknown>(&self, v: &[V]) -> Vec<V>
    where
        B: Couples<V>,
    {
        (0..self.diagonal.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|vertex| {
                let mut sum = self.diagonal[vertex].apply(v[vertex]);
                for at in self.graph.neighbors(vertex) {
                    sum += self.off[at].apply(v[self.graph.neighbors[at] as usize]);
                }
                sum
            })
            .collect()
    }

    /// The solution for the right-hand side `right`, started from zero, in at most `iterations`
    /// steps, or until the residual has shrunk to `tolerance` of what it was. Zero where `free` is
    /// not set.
    pub(super) fn solve<V: Unknown>(
        &self,
        right: &[V],
        free: &[bool],
        iterations: usize,
        tolerance: f64,
    ) -> Vec<V>
    where
        B: Couples<V>,
    {
        let mask = |v: &mut Vec<V>| {
            v.iter_mut().zip(free).filter(|(_, free)| !**free).for_each(|(v, _)| *v = V::default());
        };
        let precondition = |r: &[V]| -> Vec<V> {
            let pairs = r.par_iter().zip(&self.diagonal).with_min_len(CHUNK);
            pairs.map(|(r, block)| block.solve(*r)).collect()
        };
        let mut solution = vec![V::default(); right.len()];
        let mut residual = right.to_vec();
        mask(&mut residual);
        let mut step = precondition(&residual);
        let mut square = dot(&residual, &step);
        let enough = square * tolerance * tolerance;
        for _ in 0..iterations {
            if square <= enough || !square.is_finite() {
                break;
            }
            let mut image = self.apply(&step);
            mask(&mut image);
            let length = square / dot(&step, &image);
            if !length.is_finite() {
                break;
            }
            for ((x, r), (d, q)) in
                solution.iter_mut().zip(&mut residual).zip(step.iter().zip(&image))
            {
                *x += *d * length;
                *r = *r - *q * length;
            }
            let next = precondition(&residual);
            let next_square = dot(&residual, &next);
            let turn = next_square / square;
            step.iter_mut().zip(&next).for_each(|(d, z)| *d = *z + *d * turn);
            square = next_square;
        }
        solution
    }
}

/// Sums the row of a vertex: its block on the diagonal, and one for each of its neighbors.
fn fill_row<B: Block>(
    graph: &Graph,
    elements: &[Element<B>],
    vertex: usize,
    diagonal: &mut B,
    off: &mut [B],
) {
    let neighbors = &graph.neighbors[graph.neighbors(vertex)];
    for corner in graph.fans.corners(vertex as u32) {
        let (triangle, slot) = (corner.triangle().index(), corner.slot());
        let element = &elements[triangle];
        *diagonal += element.corners[slot];
        for (other, edge) in [((slot + 1) % 3, slot), ((slot + 2) % 3, (slot + 2) % 3)] {
            let other = graph.fans.triangles[triangle][other];
            if let Ok(at) = neighbors.binary_search(&other) {
                off[at] += element.edges[edge];
            }
        }
    }
}

fn dot<V: Unknown>(a: &[V], b: &[V]) -> f64 {
    let chunks = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK));
    let sums: Vec<f64> =
        chunks.map(|(a, b)| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()).collect();
    sums.into_iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fan of three triangles around vertex 0.
    fn fan() -> Graph {
        Graph::new(Arc::new(Fans::new(vec![[0, 1, 2], [0, 2, 3], [0, 3, 1]], 4)))
    }

    fn element(seed: f64) -> Element<Symmetric> {
        let mut element = Element::default();
        for sample in 0..9 {
            let t = f64::from(sample) * 0.7 + seed;
            let (n, b) = (
                DVec3::new(t.sin(), (2.0 * t).cos(), (t * 1.7).sin()).normalize(),
                DVec3::new(0.2 + 0.1 * t.cos(), 0.3, 0.5 - 0.1 * t.cos()),
            );
            for slot in 0..3 {
                element.corners[slot] += Symmetric::outer(n, b[slot] * b[slot]);
                element.edges[slot] += Symmetric::outer(n, b[slot] * b[(slot + 1) % 3]);
            }
        }
        element
    }

    #[test]
    fn the_solution_solves_and_held_vertices_stay() {
        let graph = fan();
        let elements = [element(0.0), element(1.0), element(2.0)];
        let system = System::new(&graph, &elements, 0.1);
        let right: Vec<DVec3> = (0..4).map(|i| DVec3::new(f64::from(i), 1.0, -0.5)).collect();
        let x = system.solve(&right, &[true; 4], 100, 1e-12);
        for (image, right) in system.apply(&x).iter().zip(&right) {
            assert!((*image - *right).length() < 1e-9);
        }
        let x = system.solve(&right, &[true, false, true, true], 100, 1e-12);
        assert_eq!(x[1], DVec3::ZERO);
        let image = system.apply(&x);
        assert!([0, 2, 3].iter().all(|&i| (image[i] - right[i]).length() < 1e-9));
    }

    #[test]
    fn a_block_undoes_itself() {
        let mut block = Symmetric::outer(DVec3::new(0.6, 0.8, 0.0), 2.0);
        block += Symmetric::outer(DVec3::new(0.0, 0.6, -0.8), 3.0);
        let block = block.damped(0.5);
        let v = DVec3::new(1.0, -2.0, 3.0);
        assert!((block.solve(block.apply(v)) - v).length() < 1e-12);
        assert_eq!(Symmetric::default().solve(v), DVec3::ZERO);
        assert_eq!(2.0.solve(2.0.apply(DVec4::ONE)), DVec4::ONE);
    }
}
