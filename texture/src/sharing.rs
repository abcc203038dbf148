//! The first mip level at which two charts lie in one texel.
//!
//! A texel of a coarse level is made from texels of the image, and sooner or later from those of
//! several charts. No fill between the charts helps then: their colors mix in what is valid. Up to
//! the level before, a repaired atlas mixes none.
//!
//! Charts are triangles connected through equal UVs. Charts that cover one texel of the image
//! itself, as mirrored halves do, show it both and count as one. Not guaranteed: charts that cover
//! no texel's centre are left out; and bilinear taps blend the texels beside a chart, so that a
//! neighbor that lies less than one texel of a level away is read there already.

use std::collections::HashMap;

use glam::Vec2;

use crate::raster::{UvTriangle, Window, to_texels};
use crate::reads::{halve, under};
use crate::validity::{Charts, known};
use crate::wrap::Wrap;

/// Triangles may cover the image as often before it counts as tiled.
const MOST_COVERS: usize = 32;

/// No chart.
const NONE: u32 = u32::MAX;

/// The first mip level, 0 being the image of `size` (width, height), that has a texel made from
/// texels of two charts; `None` if no level has, or if charts cover the image dozens of times, as
/// tiled ones do.
///
/// `wrap`, `uvs` and `triangles` are as in [`count_reads`](crate::count_reads); levels halve and
/// round down.
pub fn charts_share_from(
    size: [usize; 2],
    wrap: [Wrap; 2],
    uvs: &[Vec2],
    triangles: &[[u32; 3]],
) -> Option<usize> {
    let mut charts = connect(uvs, triangles);
    let mut labels = paint(size, wrap, uvs, triangles, &mut charts)?;
    for label in labels.iter_mut().filter(|label| **label != NONE) {
        *label = charts.of(*label) as u32;
    }
    let mut size = size;
    for level in 1.. {
        if size[0] <= 1 && size[1] <= 1 {
            break;
        }
        let halved = halve(size);
        match coarser(&labels, size, halved) {
            Some(coarse) => labels = coarse,
            None => return Some(level),
        }
        size = halved;
    }
    None
}

/// Charts through the indices that triangles share, and through equal UVs of different indices.
fn connect(uvs: &[Vec2], triangles: &[[u32; 3]]) -> Charts {
    let mut charts = Charts::new(uvs.len());
    triangles.iter().filter(known(uvs)).for_each(|triangle| charts.join(triangle));
    let mut first: HashMap<[u32; 2], u32> = HashMap::with_capacity(uvs.len());
    for (uv, at) in (0u32..).zip(uvs) {
        // −0 is 0.
        let bits = (*at + Vec2::ZERO).to_array().map(f32::to_bits);
        let other = *first.entry(bits).or_insert(uv);
        charts.join(&[uv, other, other]);
    }
    charts
}

/// One per texel: a UV of the chart that covers it, with charts that cover the same one joined;
/// `None` if that takes too long.
fn paint(
    size @ [width, height]: [usize; 2],
    wrap: [Wrap; 2],
    uvs: &[Vec2],
    triangles: &[[u32; 3]],
    charts: &mut Charts,
) -> Option<Vec<u32>> {
    let mut labels = vec![NONE; width * height];
    let mut left = MOST_COVERS * width * height + 9 * triangles.len();
    for triangle in triangles.iter().filter(known(uvs)) {
        let corners = triangle.map(|uv| to_texels(uvs[uv as usize], size));
        let Some(shape) = UvTriangle::new(corners) else {
            continue;
        };
        let rows = shape.rows();
        let [high, wide] =
            [&rows, &shape.columns()].map(|range| (range.end - range.start) as usize);
        left = left.checked_sub(high.saturating_mul(wide))?;
        shape.spans(&Window::columns_of_rows(rows), |y, span| {
            let row = wrap[1].texel(y, height) * width;
            for x in span {
                let label = &mut labels[row + wrap[0].texel(x, width)];
                if *label == NONE {
                    *label = triangle[0];
                } else if *label != triangle[0] {
                    charts.join(&[*label, triangle[0], triangle[0]]);
                }
            }
        });
    }
    Some(labels)
}

/// The next level; `None` if one of its texels is made from two charts.
fn coarser(labels: &[u32], size: [usize; 2], halved: [usize; 2]) -> Option<Vec<u32>> {
    let mut coarse = Vec::with_capacity(halved[0] * halved[1]);
    for y in 0..halved[1] {
        for x in 0..halved[0] {
            let mut own = NONE;
            for v in under(y, size[1], halved[1]) {
                for u in under(x, size[0], halved[0]) {
                    let label = labels[v * size[0] + u];
                    if label != NONE && own != NONE && label != own {
                        return None;
                    }
                    own = own.min(label);
                }
            }
            coarse.push(own);
        }
    }
    Some(coarse)
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUADS: [[u32; 3]; 4] = [[0, 1, 2], [2, 3, 0], [4, 5, 6], [6, 7, 4]];

    /// Two squares of 4 texels in an image of 32², the second at these columns.
    fn from(start: f32, wrap: Wrap) -> Option<usize> {
        let quad = |x: f32| [[x, 8.0], [x + 4.0, 8.0], [x + 4.0, 12.0], [x, 12.0]];
        let uvs = [quad(0.0), quad(start)].concat();
        let uvs: Vec<Vec2> = uvs.into_iter().map(|uv| Vec2::from(uv) / 32.0).collect();
        charts_share_from([32, 32], [wrap; 2], &uvs, &QUADS)
    }

    #[test]
    fn charts_meet_where_a_texel_reaches_over_both() {
        assert_eq!(from(5.0, Wrap::Repeat), Some(3), "columns 0…4 and 5…9 of texels of 8");
        assert_eq!(from(16.0, Wrap::Repeat), Some(5));
        assert_eq!(from(12.0, Wrap::Repeat), Some(4));
    }

    #[test]
    fn charts_that_share_texels_of_the_image_are_one() {
        for start in [0.0, 2.0, 4.0, 32.0, -32.0] {
            assert_eq!(from(start, Wrap::Repeat), None, "{start}");
        }
        // Beside each other on the clamped edge, and on top of it.
        assert_eq!(from(-9.0, Wrap::Clamp), None);
    }

    #[test]
    fn what_cannot_be_told_is_not_said() {
        for far in [1e9, f32::NAN, 1e30] {
            let uvs = [[0.0, 0.0], [far, 0.0], [0.0, far]].map(Vec2::from);
            let triangles = [[0, 1, 2], [0, 1, 9]];
            assert_eq!(charts_share_from([8, 8], [Wrap::Repeat; 2], &uvs, &triangles), None);
        }
        assert_eq!(charts_share_from([0, 0], [Wrap::Clamp; 2], &[], &[]), None);
    }
}
