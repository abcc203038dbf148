//! Where the charts lie in the atlas, and which point of the surface each texel shows.

use glam::{DMat2, DVec2, DVec3};

use crate::model::{CHARTS, Model, Triangle};

/// Texels along an edge of the atlas that the layout is made for.
pub(crate) const SIZE: usize = 1024;
/// Texels of that atlas per millimetre of the surface, where a chart is not stretched.
/// Together with the angles of [`CHARTS`] the best of a hundred random tries: 1.98 with the first angles
/// thought of, 2.12 with these.
const DENSITY: f64 = 2.12;
/// The charts are placed on cells of this many texels, at least two cells apart.
const CELL: usize = 4;
/// Cells along an edge of the atlas.
const CELLS: usize = SIZE / CELL;

/// The UVs of every triangle's corners (glTF: v downwards).
pub(crate) struct Atlas {
    /// One per triangle.
    pub(crate) uvs: Vec<[DVec2; 3]>,
}

impl Atlas {
    /// Turns each chart as the table says, and puts the large ones first, each at the first place
    /// from the top left where it keeps its distance from those already there.
    ///
    /// # Panics
    /// If a chart finds no place: then the density is too high for the table's angles.
    pub(crate) fn new(model: &Model) -> Self {
        let mut of_chart = vec![vec![]; CHARTS.len()];
        for (index, triangle) in model.triangles.iter().enumerate() {
            of_chart[triangle.chart].push(index);
        }
        let mut uvs = vec![[DVec2::ZERO; 3]; model.triangles.len()];
        let lay = |&index: &usize| lay_down(&model.triangles[index]);
        let laid: Vec<Vec<[DVec2; 3]>> =
            of_chart.iter().map(|list| to_corner(list.iter().map(lay).collect())).collect();
        let mut order: Vec<usize> = (0..CHARTS.len()).collect();
        order.sort_by_key(|&chart| std::cmp::Reverse(cells_of(&laid[chart]).len()));
        let mut taken = vec![false; CELLS * CELLS];
        for chart in order {
            let cells = cells_of(&laid[chart]);
            let (x, y) = first_place(&cells, &taken)
                .unwrap_or_else(|| panic!("the atlas is full at chart {}", CHARTS[chart].name));
            for (cx, cy) in cells {
                taken[(y + cy) * CELLS + x + cx] = true;
            }
            let offset = DVec2::new(x as f64, y as f64) * CELL as f64;
            for (&index, triangle) in of_chart[chart].iter().zip(&laid[chart]) {
                uvs[index] = triangle.map(|texel| (texel + offset) / SIZE as f64);
            }
        }
        Self { uvs }
    }

    /// For an image of `size`² texels: what each texel shows, row by row from the top; `None`
    /// where no chart touches it.
    pub(crate) fn texels(&self, size: usize) -> Vec<Option<Texel>> {
        let mut texels: Vec<Option<Texel>> = vec![None; size * size];
        for (index, uvs) in self.uvs.iter().enumerate() {
            let corners = uvs.map(|uv| uv * size as f64);
            for (x, y) in touched(corners) {
                let center = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let nearest = nearest_weights(corners, center);
                let away = center.distance(blend2(corners, nearest));
                let texel = &mut texels[y * size + x];
                if texel.is_none_or(|old| away < old.away) {
                    *texel = Some(Texel { triangle: index, weights: nearest, away });
                }
            }
        }
        texels
    }
}

/// What a texel shows: the point of the surface that the UVs bring to its centre or, if the chart
/// only touches the texel elsewhere, the nearest point of the chart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Texel {
    /// Index into [`Model::triangles`].
    pub(crate) triangle: usize,
    /// Barycentric weights of its corners.
    pub(crate) weights: DVec3,
    /// Texels from the texel's centre to the triangle; 0 inside.
    away: f64,
}

/// A triangle's corners in texels, turned and mirrored as its chart asks, y downwards.
fn lay_down(triangle: &Triangle) -> [DVec2; 3] {
    let chart = &CHARTS[triangle.chart];
    let mirror = if chart.mirrored { -1.0 } else { 1.0 };
    let turn = DMat2::from_angle(chart.angle.to_radians());
    triangle.corners.map(|corner| {
        let flat = turn * (corner.flat * DVec2::new(mirror, 1.0));
        DVec2::new(flat.x, -flat.y) * DENSITY
    })
}

/// Moves triangles so that they start one cell from the top left corner.
fn to_corner(triangles: Vec<[DVec2; 3]>) -> Vec<[DVec2; 3]> {
    let low = triangles.iter().flatten().fold(DVec2::MAX, |low, &p| low.min(p));
    let shift = DVec2::splat(CELL as f64 + 0.37) - low;
    triangles.into_iter().map(|triangle| triangle.map(|p| p + shift)).collect()
}

/// The cells that the triangles touch, sorted, each once.
fn cells_of(triangles: &[[DVec2; 3]]) -> Vec<(usize, usize)> {
    let mut cells: Vec<(usize, usize)> =
        triangles.iter().flat_map(|t| touched(t.map(|p| p / CELL as f64))).collect();
    cells.sort_unstable();
    cells.dedup();
    cells
}

/// The first offset, in cells, at which `cells` and their neighbours two cells around are free.
fn first_place(cells: &[(usize, usize)], taken: &[bool]) -> Option<(usize, usize)> {
    let near = |at: usize| at.saturating_sub(2)..(at + 3).min(CELLS);
    let mut blocked = vec![false; CELLS * CELLS];
    for (index, _) in taken.iter().enumerate().filter(|(_, taken)| **taken) {
        for y in near(index / CELLS) {
            near(index % CELLS).for_each(|x| blocked[y * CELLS + x] = true);
        }
    }
    let (wide, high) = cells.iter().fold((0, 0), |(w, h), &(x, y)| (w.max(x + 2), h.max(y + 2)));
    // A collision is most often found at the outline's far ends: look at scattered cells first.
    let scattered: Vec<(usize, usize)> =
        (0..17).flat_map(|start| cells.iter().skip(start).step_by(17)).copied().collect();
    let free =
        |x: usize, y: usize| scattered.iter().all(|&(cx, cy)| !blocked[(y + cy) * CELLS + x + cx]);
    (0..=CELLS.checked_sub(high)?)
        .flat_map(|y| (0..=CELLS.saturating_sub(wide)).map(move |x| (x, y)))
        .find(|&(x, y)| wide <= CELLS && free(x, y))
}

/// The unit squares (column, row) of the positive quadrant that a triangle touches.
pub(crate) fn touched(triangle: [DVec2; 3]) -> Vec<(usize, usize)> {
    let low = triangle[0].min(triangle[1]).min(triangle[2]).floor();
    let high = triangle[0].max(triangle[1]).max(triangle[2]).ceil();
    let square = |x: usize, y: usize| touches(triangle, DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
    (low.y as usize..high.y as usize)
        .flat_map(|y| (low.x as usize..high.x as usize).map(move |x| (x, y)))
        .filter(|&(x, y)| square(x, y))
        .collect()
}

/// Whether a triangle touches the unit square about `center`: no edge's normal separates them (the
/// axes do not, since the caller looks only at squares in the triangle's bounds).
fn touches(triangle: [DVec2; 3], center: DVec2) -> bool {
    (0..3).all(|slot| {
        let (a, b, c) = (triangle[slot], triangle[(slot + 1) % 3], triangle[(slot + 2) % 3]);
        let normal = (b - a).perp();
        let normal = if normal.dot(c - a) < 0.0 { -normal } else { normal };
        normal.dot(center - a) + 0.5 * (normal.x.abs() + normal.y.abs()) > 0.0
    })
}

/// Barycentric weights of the point of a triangle nearest to `point`.
fn nearest_weights(triangle: [DVec2; 3], point: DVec2) -> DVec3 {
    let [a, b, c] = triangle;
    let whole = (b - a).perp_dot(c - a);
    let weights =
        DVec3::new((b - point).perp_dot(c - point), (c - point).perp_dot(a - point), 0.0) / whole;
    let weights = weights.with_z(1.0 - weights.x - weights.y);
    if weights.min_element() >= 0.0 {
        return weights;
    }
    let on_edge = |slot: usize| {
        let (from, to) = (triangle[slot], triangle[(slot + 1) % 3]);
        let t = ((point - from).dot(to - from) / from.distance_squared(to)).clamp(0.0, 1.0);
        let mut weights = [0.0; 3];
        weights[slot] = 1.0 - t;
        weights[(slot + 1) % 3] = t;
        DVec3::from_array(weights)
    };
    let distance = |weights: &DVec3| blend2(triangle, *weights).distance_squared(point);
    let edges = [0, 1, 2].map(on_edge);
    edges.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(weights)
}

/// The point of a triangle with these barycentric weights.
fn blend2(triangle: [DVec2; 3], weights: DVec3) -> DVec2 {
    triangle[0] * weights.x + triangle[1] * weights.y + triangle[2] * weights.z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_half_square_touches_the_squares_it_enters() {
        let triangle = [DVec2::new(0.0, 0.0), DVec2::new(2.0, 0.0), DVec2::new(0.0, 2.0)];
        assert_eq!(touched(triangle), [(0, 0), (1, 0), (0, 1)]);
    }

    #[test]
    fn the_nearest_point_lies_inside_on_an_edge_or_at_a_corner() {
        let triangle = [DVec2::ZERO, DVec2::X, DVec2::Y];
        let near = |x, y| nearest_weights(triangle, DVec2::new(x, y));
        assert!(near(0.25, 0.25).abs_diff_eq(DVec3::new(0.5, 0.25, 0.25), 1e-12));
        assert!(near(0.5, -1.0).abs_diff_eq(DVec3::new(0.5, 0.5, 0.0), 1e-12));
        assert!(near(-1.0, -1.0).abs_diff_eq(DVec3::X, 1e-12));
    }
}
