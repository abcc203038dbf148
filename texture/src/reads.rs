//! How many invalid texels filtering reads, level by level.
//!
//! A texel of mip level m + 1 is made from the texels of level m whose area it overlaps, and is
//! clean when all of those are. At each level, bilinear taps at positions inside a UV triangle read
//! the texels whose centres lie less than one texel from it along both axes. The count is of
//! distinct texels read that are not clean; it is 0 when every valid position filters cleanly at
//! every level, trilinear reads between two levels included.
//!
//! Guaranteed: for mips made by box filters, of sizes that halve and round down, 0 means that no
//! bilinear or trilinear read at a position of a triangle touches an invalid texel. A count above 0
//! is exact, but for triangles that leave a clamped image or span more than eight repeats: those
//! may count a few texels that no tap reads. Not guaranteed:
//! anisotropic reads, whose taps step outside the triangle, and mips made by wider kernels
//! (Kaiser, Lanczos).

use glam::Vec2;

use crate::coverage::Coverage;
use crate::raster::{UvTriangle, to_texels};
use crate::{Validity, Wrap};

/// What bilinear taps inside the charts read at one mip level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MipReads {
    /// Width of the level in texels.
    pub width: usize,
    /// Height of the level in texels.
    pub height: usize,
    /// Distinct texels that are read.
    pub read: usize,
    /// Those of them that an invalid texel went into.
    pub invalid: usize,
}

/// Counts the reads of each mip level down to one texel, the image itself first.
///
/// `uvs` is what `triangles` index; triangles out of range, not finite or without area are left
/// out, as in [`Validity::from_charts`].
pub fn count_reads(
    validity: &Validity,
    wrap: [Wrap; 2],
    uvs: &[Vec2],
    triangles: &[[u32; 3]],
) -> Vec<MipReads> {
    let mut levels = Vec::new();
    let (mut width, mut height) = (validity.width(), validity.height());
    if width == 0 || height == 0 {
        return levels;
    }
    let mut clean = validity.flags().to_vec();
    loop {
        let reads = texels_read([width, height], wrap, uvs, triangles);
        let read = reads.iter().filter(|&&read| read).count();
        let invalid = reads.iter().zip(&clean).filter(|&(&read, &clean)| read && !clean).count();
        levels.push(MipReads { width, height, read, invalid });
        if width == 1 && height == 1 {
            return levels;
        }
        let halved = [(width / 2).max(1), (height / 2).max(1)];
        clean = shrink(&clean, [width, height], halved);
        [width, height] = halved;
    }
}

fn texels_read(
    size: [usize; 2],
    wrap: [Wrap; 2],
    uvs: &[Vec2],
    triangles: &[[u32; 3]],
) -> Vec<bool> {
    let mut coverage = Coverage::new(size[0], size[1], wrap);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|uv| uvs.get(uv as usize));
        if let (Some(&a), Some(&b), Some(&c)) = (a, b, c)
            && let Some(uv) = UvTriangle::new([a, b, c].map(|uv| to_texels(uv, size)))
        {
            coverage.add(&uv.grown_by_filter());
        }
    }
    coverage.finish()
}

/// The next level: clean where all that a texel overlaps is.
fn shrink(clean: &[bool], size: [usize; 2], halved: [usize; 2]) -> Vec<bool> {
    let under = |texel: usize, axis: usize| {
        let start = texel * size[axis] / halved[axis];
        start..((texel + 1) * size[axis]).div_ceil(halved[axis])
    };
    let mut coarser = Vec::with_capacity(halved[0] * halved[1]);
    for y in 0..halved[1] {
        for x in 0..halved[0] {
            let mut rows = under(y, 1);
            coarser.push(rows.all(|v| under(x, 0).all(|u| clean[v * size[0] + u])));
        }
    }
    coarser
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CLAMP: [Wrap; 2] = [Wrap::Clamp; 2];
    const QUAD: [[u32; 3]; 2] = [[0, 1, 2], [2, 3, 0]];

    fn quad(low: f32, high: f32) -> [Vec2; 4] {
        [[low, low], [high, low], [high, high], [low, high]].map(Vec2::from)
    }

    #[test]
    fn a_quad_reads_one_texel_around_it_at_every_level() {
        // 4…12 of 16, whose outline runs between texels.
        let uvs = quad(0.25, 0.75);
        let validity = Validity::from_charts(16, 16, CLAMP, &uvs, &QUAD);
        let reads = count_reads(&validity, CLAMP, &uvs, &QUAD);
        let counts: Vec<_> =
            reads.iter().map(|level| (level.width, level.read, level.invalid)).collect();
        // 10² − 8², 6² − 4², 4² − 2², then everything, mixed with background.
        assert_eq!(counts, [(16, 100, 36), (8, 36, 20), (4, 16, 12), (2, 4, 4), (1, 1, 1)]);
    }

    #[test]
    fn an_image_without_holes_has_no_invalid_reads() {
        let uvs = quad(-3.0, 5.3);
        for size in [[1, 1], [7, 3], [16, 5]] {
            let all = Validity::from_flags(size[0], size[1], vec![true; size[0] * size[1]]);
            let reads = count_reads(&all, [Wrap::Repeat, Wrap::Mirror], &uvs, &QUAD);
            assert!(reads.iter().all(|level| level.invalid == 0 && level.read > 0));
        }
    }

    #[test]
    fn one_hole_spoils_all_it_goes_into() {
        let mut flags = vec![true; 35];
        flags[17] = false;
        let uvs = quad(0.0, 1.0);
        let reads = count_reads(&Validity::from_flags(7, 5, flags), CLAMP, &uvs, &QUAD);
        // Column 3 of 7 goes into the middle one of three, row 2 of 5 into both of two.
        assert_eq!(reads.iter().map(|level| level.invalid).collect::<Vec<_>>(), [1, 2, 1]);
    }

    proptest! {
        /// Positions all over a triangle, and the four texels a sampler blends at each.
        #[test]
        fn no_bilinear_tap_reads_beyond_the_count(
            corners in prop::array::uniform3([-0.5..1.5f32, -0.5..1.5f32]),
            size in [1..12usize, 1..12usize],
            modes in [0..3usize, 0..3usize],
        ) {
            let wrap = modes.map(|m| [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp][m]);
            let uvs = corners.map(Vec2::from);
            let reads = texels_read(size, wrap, &uvs, &[[0, 1, 2]]);
            for i in 0..=20 {
                for j in 0..=20 - i {
                    let [a, b] = [f64::from(i) / 20.0, f64::from(j) / 20.0];
                    let [p, q, r] = uvs.map(|uv| to_texels(uv, size));
                    let at = p * a + q * b + r * (1.0 - a - b) - 0.5;
                    let floor = at.floor();
                    for corner in 0..4 {
                        let step = glam::DVec2::new(f64::from(corner & 1), f64::from(corner >> 1));
                        let weight = (1.0 - (at - floor - step).abs()).min_element();
                        let texel = floor + step;
                        let x = wrap[0].texel(texel.x as i64, size[0]);
                        let y = wrap[1].texel(texel.y as i64, size[1]);
                        prop_assert!(weight < 1e-9 || reads[y * size[0] + x]);
                    }
                }
            }
        }
    }
}
