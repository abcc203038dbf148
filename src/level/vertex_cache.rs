//! The order in which a graphics processor reads a level: triangles so that the vertices which were
//! just transformed are used again, then vertices in the order in which the triangles first name
//! them. The same triangles, each with its corners in the same turn.
//!
//! Triangles are ordered by meshoptimizer, after Sander, Nehab and Barczak, "Fast triangle reordering
//! for vertex locality and reduced overdraw", SIGGRAPH 2007, and Forsyth, "Linear-speed vertex cache
//! optimisation", 2006. No level of the order depends on threads.

use meshopt::{optimize_vertex_cache_in_place, optimize_vertex_fetch_remap};

/// Orders triangles, and tells in what order the vertices then follow one another: by their old
/// numbers. Every one of the `vertices` must be used.
pub(crate) fn order_for_cache(indices: &mut [u32], vertices: usize) -> Vec<usize> {
    optimize_vertex_cache_in_place(indices, vertices);
    let places = optimize_vertex_fetch_remap(indices, vertices);
    for index in indices.iter_mut() {
        *index = places[*index as usize];
    }
    let mut order = vec![0; vertices];
    for (old, &new) in places.iter().enumerate() {
        order[new as usize] = old;
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vertices that a first-in-first-out cache of 16 misses, per triangle.
    fn misses(indices: &[u32]) -> f64 {
        let mut cache = std::collections::VecDeque::new();
        let mut misses = 0;
        for index in indices {
            if !cache.contains(index) {
                misses += 1;
                cache.push_front(*index);
                cache.truncate(16);
            }
        }
        f64::from(misses) / (indices.len() / 3) as f64
    }

    /// The triangles of a square of cells, in an order that helps nobody.
    fn scattered(side: u32) -> Vec<u32> {
        let cells = side * side;
        let cell = |i: u32| (i * 577) % cells;
        let corners = |cell: u32| {
            let corner = cell / side * (side + 1) + cell % side;
            let above = corner + side + 1;
            [corner, corner + 1, above, above, corner + 1, above + 1]
        };
        (0..cells).map(cell).flat_map(corners).collect()
    }

    #[test]
    fn the_same_triangles_miss_the_cache_less_and_name_new_vertices_in_turn() {
        let (side, before) = (32, scattered(32));
        let mut indices = before.clone();
        let order = order_for_cache(&mut indices, (side + 1) * (side + 1));
        let seen = |indices: &[u32]| {
            let mut triangles: Vec<[u32; 3]> = indices.as_chunks().0.to_vec();
            for triangle in &mut triangles {
                let least = (0..3).min_by_key(|&corner| triangle[corner]);
                triangle.rotate_left(least.unwrap_or_default());
            }
            triangles.sort_unstable();
            triangles
        };
        let old: Vec<u32> = indices.iter().map(|&index| order[index as usize] as u32).collect();
        assert_eq!(seen(&old), seen(&before));
        assert!(misses(&before) > 1.8 && misses(&indices) < 0.8, "{}", misses(&indices));
        let mut next = 0;
        for &index in &indices {
            assert!(index <= next, "vertex {index} before {next}");
            next = next.max(index + 1);
        }
    }
}
