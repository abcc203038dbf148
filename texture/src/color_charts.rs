//! Charts without area: colors, not pictures.
//!
//! Low-poly models often read one small map of colors and gradients, with all UVs of a face in one
//! texel, or along a line down a gradient. Such charts cover no texel's center. What lies between
//! their UVs is nothing that could be sampled anew or filled, and a UV off the line is another color.

use glam::Vec2;
use rustc_hash::FxHashMap;
use seamwise_attr::DisjointSets;

use crate::raster::to_texels;

/// A chart narrower than this, in texels, is a line.
const LEAST_WIDTH: f64 = 0.5;

/// The bounds of a chart in texels, and the area of its triangles.
#[derive(Clone, Copy)]
struct Extent {
    low: glam::DVec2,
    high: glam::DVec2,
    area: f64,
}

impl Extent {
    const EMPTY: Self =
        Self { low: glam::DVec2::INFINITY, high: glam::DVec2::NEG_INFINITY, area: 0.0 };

    fn add(&mut self, [a, b, c]: [glam::DVec2; 3]) {
        self.low = self.low.min(a).min(b).min(c);
        self.high = self.high.max(a).max(b).max(c);
        self.area += 0.5 * (b - a).perp_dot(c - a).abs();
    }

    fn is_color(&self) -> bool {
        let sides = self.high - self.low;
        let longest = sides.max_element();
        // Triangles may lie on each other.
        let area = self.area.min(sides.x * sides.y);
        sides.is_finite() && (longest <= 1.0 || area <= LEAST_WIDTH * longest)
    }
}

/// One per triangle with these UVs, in an image of `size`: the number of its chart, if that is a color.
/// Triangles with a UV in common, to the bit, are of one chart.
pub fn color_charts(size: [usize; 2], triangles: &[[Vec2; 3]]) -> Vec<Option<u32>> {
    let mut known: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    let mut number = |uv: Vec2| {
        let next = known.len() as u32;
        *known.entry(uv.to_array().map(|x| (x + 0.0).to_bits())).or_insert(next)
    };
    let corners: Vec<[u32; 3]> = triangles.iter().map(|uvs| uvs.map(&mut number)).collect();
    let mut sets = DisjointSets::new(known.len());
    for [a, b, c] in &corners {
        sets.join(*a, *b);
        sets.join(*b, *c);
    }
    let mut extents = vec![Extent::EMPTY; known.len()];
    for (uvs, [first, ..]) in triangles.iter().zip(&corners) {
        extents[sets.root(*first) as usize].add(uvs.map(|uv| to_texels(uv, size)));
    }
    let of = |[first, ..]: &[u32; 3]| {
        let chart = sets.root(*first);
        extents[chart as usize].is_color().then_some(chart)
    };
    corners.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(corners: [[f32; 2]; 3]) -> [Vec2; 3] {
        corners.map(|[x, y]| Vec2::new(x, y) / 64.0)
    }

    fn are_colors(triangles: &[[Vec2; 3]]) -> Vec<bool> {
        color_charts([64; 2], triangles).iter().map(Option::is_some).collect()
    }

    #[test]
    fn points_lines_and_what_lies_in_a_texel_are_colors() {
        let point = triangle([[9.5, 9.5]; 3]);
        let line = triangle([[20.5, 3.0], [20.5, 30.0], [20.5, 7.0]]);
        let small = triangle([[40.1, 40.1], [40.9, 40.1], [40.1, 40.9]]);
        let picture = triangle([[50.0, 50.0], [53.0, 50.0], [50.0, 53.0]]);
        let strip = triangle([[0.0, 60.0], [60.0, 60.0], [0.0, 61.5]]);
        let all = [point, line, small, picture, strip];
        assert_eq!(are_colors(&all), [true, true, true, false, false]);
        let charts = color_charts([64; 2], &all);
        assert!(charts[0] != charts[1] && charts[1] != charts[2]);
        // In a small map the same triangle lies in one texel.
        assert_eq!(color_charts([4; 2], &[picture])[0], Some(0));
    }

    #[test]
    fn small_triangles_of_a_large_chart_are_none_and_any_number_in_one_texel_are() {
        let cell = |x: f32, y: f32, by: f32| triangle([[x, y], [x + by, y], [x, y + by]]);
        let (n, by) = (40, 0.25);
        let grid: Vec<[Vec2; 3]> =
            (0..n * n).map(|at| cell((at % n) as f32 * by, (at / n) as f32 * by, by)).collect();
        assert!(are_colors(&grid).iter().all(|is_color| !is_color));
        let stack = vec![cell(3.1, 3.1, 0.8); 100];
        assert!(are_colors(&stack).iter().all(|&is_color| is_color));
        assert_eq!(are_colors(&[[Vec2::NAN; 3], [Vec2::INFINITY; 3]]), [false; 2]);
    }
}
