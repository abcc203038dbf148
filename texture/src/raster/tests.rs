use super::*;
use proptest::prelude::*;

fn triangle(corners: [[f64; 2]; 3]) -> Option<UvTriangle> {
    UvTriangle::new(corners.map(DVec2::from))
}

fn covered(triangle: &UvTriangle, window: &Window) -> Vec<(i64, i64)> {
    let mut texels = Vec::new();
    triangle.texels(window, |texel| texels.push((texel.x, texel.y)));
    texels
}

#[test]
fn centres_on_the_outline_are_covered_in_either_orientation() {
    // Both legs run through the centres of row 0 and column 0, the hypotenuse as well.
    let window = Window::image(8, 8);
    let expected = [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (0, 2)];
    let one = triangle([[0.5, 0.5], [2.5, 0.5], [0.5, 2.5]]).unwrap();
    let other = triangle([[0.5, 0.5], [0.5, 2.5], [2.5, 0.5]]).unwrap();
    assert_eq!(covered(&one, &window), expected);
    assert_eq!(covered(&other, &window), expected);
}

#[test]
fn texels_left_of_and_above_the_image_keep_their_coordinates() {
    let window = Window { x: -10..10, y: -10..10 };
    let triangle = triangle([[-2.0, -1.0], [-1.0, -1.0], [-2.0, 3.0]]).unwrap();
    assert_eq!(covered(&triangle, &window), [(-2, -1), (-2, 0)]);
}

#[test]
fn hostile_triangles_are_empty_or_stay_in_the_window() {
    assert!(triangle([[f64::NAN, 0.0], [1.0, 0.0], [0.0, 1.0]]).is_none());
    assert!(triangle([[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]]).is_none());
    assert!(triangle([[f64::MAX, 0.0], [-f64::MAX, 1.0], [0.0, f64::MAX]]).is_none());
    let window = Window { x: -4..4, y: -4..4 };
    let huge = triangle([[-1e30, -1e30], [1e30, -1e30], [0.0, 1e30]]).unwrap();
    assert_eq!(covered(&huge, &window).len(), 64);
    let far = triangle([[1e30, 1e30], [2e30, 1e30], [1e30, 3e30]]).unwrap();
    assert!(covered(&far, &window).is_empty());
    let everywhere = Window { x: i64::MIN..i64::MAX, y: 0..1 };
    huge.spans(&everywhere, |_, span| assert!(span.end - span.start > 1 << 50));
}

#[test]
fn a_grown_triangle_covers_what_bilinear_taps_read() {
    // Taps at (1…2, 1…2) blend columns and rows 0 to 2, with weight 0 for 0 and 2 at the ends.
    let inner = triangle([[1.0, 1.0], [2.0, 1.0], [1.0, 2.0]]).unwrap();
    let window = Window { x: -8..8, y: -8..8 };
    let texels = covered(&inner.grown_by_filter(1.0), &window);
    assert_eq!(texels, [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2)]);
    // (2, 2) has its centre exactly one texel from the hypotenuse: no tap gives it weight.
}

#[test]
fn part_of_a_triangle_spans_its_own_columns() {
    let triangle = triangle([[0.0, 0.0], [8.0, 0.0], [0.0, 8.0]]).unwrap();
    assert_eq!(triangle.columns_within([4.0, 9.0]), 0..4);
    assert_eq!(triangle.columns_within([-9.0, -1.0]), 0..0);
}

fn grid_point() -> impl Strategy<Value = [f64; 2]> {
    // Multiples of ⅛ hit centres and outlines often.
    prop::array::uniform2((-40..120i32).prop_map(|v| f64::from(v) / 8.0))
}

proptest! {
    #[test]
    fn coverage_is_that_of_exact_edge_functions(corners in [grid_point(), grid_point(), grid_point()]) {
        let window = Window { x: -8..18, y: -8..18 };
        let [a, b, c] = corners.map(|p| p.map(|v| (v * 16.0) as i64));
        let side = |p: [i64; 2], q: [i64; 2], r: [i64; 2]| {
            ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])).signum()
        };
        let area = side(a, b, c);
        let mut expected = Vec::new();
        for y in window.y.clone() {
            for x in window.x.clone() {
                let p = [x * 16 + 8, y * 16 + 8];
                let inside = [side(a, b, p), side(b, c, p), side(c, a, p)];
                if area != 0 && inside.iter().all(|s| s * area >= 0) {
                    expected.push((x, y));
                }
            }
        }
        let found = triangle(corners).map(|t| covered(&t, &window)).unwrap_or_default();
        prop_assert_eq!(found, expected);
    }

    #[test]
    fn triangles_around_a_point_leave_no_gap(
        hub in [1.0..15.0f64, 1.0..15.0f64],
        scale in prop::sample::select(vec![1.0, 1e3, 1e6]),
    ) {
        let rim = [[0.0, 0.0], [16.0, 0.0], [16.0, 16.0], [0.0, 16.0]];
        let shift = |p: [f64; 2]| [p[0] + scale, p[1] + scale];
        let base = scale as i64;
        let window = Window { x: base..base + 16, y: base..base + 16 };
        let mut hits = std::collections::BTreeSet::new();
        for i in 0..4 {
            if let Some(t) = triangle([shift(hub), shift(rim[i]), shift(rim[(i + 1) % 4])]) {
                hits.extend(covered(&t, &window));
            }
        }
        prop_assert_eq!(hits.len(), 256);
    }

    #[test]
    fn barycentrics_rebuild_the_centre(corners in [grid_point(), grid_point(), grid_point()]) {
        if let Some(t) = triangle(corners) {
            t.texels(&Window { x: -8..18, y: -8..18 }, |texel| {
                let b = texel.barycentrics;
                let at = (0..3).map(|i| b[i] * DVec2::from(corners[i])).sum::<DVec2>();
                assert!(b.iter().all(|&w| w >= 0.0));
                assert!(at.distance(DVec2::new(texel.x as f64 + 0.5, texel.y as f64 + 0.5)) < 1e-9);
            });
        }
    }
}
