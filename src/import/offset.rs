//! Positions that floats cannot hold: those of a survey, millions of meters from 0.
//!
//! glTF stores positions as 32-bit floats, which resolve half a meter at 4,500,000: of a grid of 0.1 m a
//! fifth of the rows is left. So where rounding would move a position by more than a hundredth of
//! the median edge, the middle of all goes to the translation of their nodes, and what is left is
//! small. The translation is whole numbers that a float holds, so every reader adds the same.

use glam::DVec3;

use super::part::Part;

/// Most triangles that the median edge is taken over: a sample is as good.
const MAX_SAMPLED: usize = 100_000;

/// How far rounding may move a position, in median edges.
const MAX_SHIFT: f64 = 0.01;

/// How floats hold all positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fit {
    /// As they are.
    Whole,
    /// With this taken off.
    Offset(DVec3),
    /// Rounded: they are too large and too fine at once.
    Rounded,
}

/// How floats hold the positions of these parts.
pub(super) fn fit(parts: &[&Part]) -> Fit {
    offset(parts).unwrap_or(Fit::Whole)
}

fn offset(parts: &[&Part]) -> Option<Fit> {
    let positions = || parts.iter().flat_map(|part| &part.vertices.positions);
    let shift = positions().flatten().map(|&x| (x - f64::from(x as f32)).abs()).fold(0.0, f64::max);
    if shift == 0.0 || shift <= MAX_SHIFT * median_edge(parts)? {
        return None;
    }
    let points = || positions().map(|&position| DVec3::from_array(position));
    let [low, high] = [points().reduce(DVec3::min)?, points().reduce(DVec3::max)?];
    let offset = ((low + high) / 2.0).round().as_vec3().as_dvec3();
    let far = |[low, high]: [DVec3; 2]| low.abs().max(high.abs()).max_element();
    // The middle of what is large itself gains nothing.
    let gains = 2.0 * far([low - offset, high - offset]) < far([low, high]);
    Some(if gains { Fit::Offset(offset) } else { Fit::Rounded })
}

fn median_edge(parts: &[&Part]) -> Option<f64> {
    let count: usize = parts.iter().map(|part| part.triangles.len() / 3).sum();
    let triangles = parts.iter().flat_map(|part| {
        let triangles = part.triangles.as_chunks::<3>().0.iter();
        triangles.map(|triangle| (&part.vertices.positions, triangle))
    });
    let sampled = triangles
        .step_by(count.div_ceil(MAX_SAMPLED).max(1))
        .map(|(positions, own)| own.map(|vertex| DVec3::from_array(positions[vertex as usize])));
    let edges = sampled.flat_map(|[a, b, c]| [a - b, b - c, c - a].map(DVec3::length));
    let mut edges: Vec<f64> = edges.filter(|length| *length > 0.0).collect();
    if edges.is_empty() {
        return None;
    }
    let middle = edges.len() / 2;
    Some(*edges.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle with edges of `size`, with a corner at `at`.
    fn triangle(at: [f64; 3], size: f64) -> Part {
        let mut part = Part { triangles: vec![0, 1, 2], ..Part::default() };
        let corners = [[0.0, 0.0], [size, 0.0], [0.0, size]];
        part.vertices.positions = corners.map(|[x, y]| [at[0] + x, at[1] + y, at[2]]).to_vec();
        part
    }

    #[test]
    fn what_floats_hold_stays_where_it_is() {
        for (at, size) in [([0.0; 3], 0.1), ([1000.0, 5.0, -3.0], 1.0), ([1e6, 0.0, 0.0], 4.0)] {
            assert_eq!(fit(&[&triangle(at, size)]), Fit::Whole, "{at:?}");
        }
        // What comes as floats has lost already what it had to lose.
        assert_eq!(fit(&[&triangle([16_777_216.0, 0.0, 0.0], 2.0)]), Fit::Whole);
    }

    #[test]
    fn what_is_far_away_moves_by_whole_numbers() {
        let part = triangle([458_213.37, 4_512_345.21, 212.8], 0.1);
        assert_eq!(fit(&[&part]), Fit::Offset(DVec3::new(458_213.0, 4_512_345.0, 213.0)));
        // From one end of the world to the other, there is no middle.
        let ends = [triangle([-4e9 + 0.1, 0.0, 0.0], 0.1), triangle([4e9 + 0.1, 0.0, 0.0], 0.1)];
        assert_eq!(fit(&ends.each_ref()), Fit::Rounded);
    }
}
