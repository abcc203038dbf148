//! The count of invalid texels that filtering reads, level by level.
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
//! may count a few texels that no tap reads. Not guaranteed: mips made by wider kernels (Kaiser,
//! Lanczos).
//!
//! # Anisotropic reads
//!
//! Of at most N taps, spread along the longer axis of a pixel's footprint, whose length is P texels
//! of the image: the level is log₂(P / n) for n ≤ N taps (Vulkan 1.3 §16.5.7 and §16.5.9), so that
//! P is n texels there. A trilinear read also takes the next finer of two levels, in whose texels P
//! is less than 2n. The outermost taps lie (n − 1) / (2n) · P from the middle where taps are spaced
//! evenly, and less in Vulkan's formula: less than n − 1 texels of the finer level, in any
//! direction, and (n − 1) / 2 of the level itself. With the bilinear taps' own reach of one texel,
//! a read at a position inside a triangle gives weight to texels whose centres lie less than N
//! texels from it along both axes. That is what is counted: a bound, as most footprints are shorter
//! and none is long along both axes.
//!
//! # Blocks
//!
//! A texture compressed in blocks of 4 × 4 texels (BC, ETC2, ASTC 4 × 4) has few colors per block:
//! a texel that is read takes its color from all 16. So it counts its whole block as read, level by
//! level; a block at the right or bottom edge has fewer texels.

use glam::Vec2;

use crate::coverage::Coverage;
use crate::raster::{UvTriangle, to_texels};
use crate::validity::Validity;
use crate::wrap::Wrap;

/// The counts of texels that bilinear taps inside the charts read at one mip level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MipReads {
    /// Width of the level in texels.
    pub width: usize,
    /// Height of the level in texels.
    pub height: usize,
    /// Number of distinct texels that are read.
    pub read: usize,
    /// Number of those that an invalid texel went into.
    pub invalid: usize,
}

/// The filtering and storage of a texture, beyond plain bilinear taps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Footprint {
    /// Most taps of an anisotropic read; 1 for reads that are not.
    pub anisotropy: u8,
    /// Whether texels are stored in blocks of 4 × 4, each of which is read as a whole.
    pub blocks: bool,
}

impl Default for Footprint {
    /// Bilinear taps of single texels.
    fn default() -> Self {
        Self { anisotropy: 1, blocks: false }
    }
}

/// Texels along a side of a block.
const BLOCK: usize = 4;

/// Counts the reads of each mip level down to one texel, the image itself first.
///
/// `uvs` is what `triangles` index; triangles out of range, not finite or without area are left
/// out, as in [`Validity::from_charts`].
pub fn count_reads(
    validity: &Validity,
    wrap: [Wrap; 2],
    uvs: &[Vec2],
    triangles: &[[u32; 3]],
    footprint: Footprint,
) -> Vec<MipReads> {
    let mut levels = Vec::new();
    let (mut width, mut height) = (validity.width(), validity.height());
    if width == 0 || height == 0 {
        return levels;
    }
    let mut clean = validity.flags().to_vec();
    loop {
        let reads = texels_read([width, height], wrap, uvs, triangles, footprint);
        let read = reads.iter().filter(|&&read| read).count();
        let invalid = reads.iter().zip(&clean).filter(|&(&read, &clean)| read && !clean).count();
        levels.push(MipReads { width, height, read, invalid });
        if width == 1 && height == 1 {
            return levels;
        }
        let halved = halve([width, height]);
        clean = shrink(&clean, [width, height], halved);
        [width, height] = halved;
    }
}

fn texels_read(
    size: [usize; 2],
    wrap: [Wrap; 2],
    uvs: &[Vec2],
    triangles: &[[u32; 3]],
    footprint: Footprint,
) -> Vec<bool> {
    let mut coverage = Coverage::new(size[0], size[1], wrap);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|uv| uvs.get(uv as usize));
        if let (Some(&a), Some(&b), Some(&c)) = (a, b, c)
            && let Some(uv) = UvTriangle::new([a, b, c].map(|uv| to_texels(uv, size)))
        {
            coverage.add(&uv.grown_by_filter(f64::from(footprint.anisotropy.max(1))));
        }
    }
    let mut read = coverage.finish();
    if footprint.blocks {
        read_blocks(&mut read, size[0]);
    }
    read
}

/// Marks the whole block of each texel that is read.
fn read_blocks(read: &mut [bool], width: usize) {
    for rows in read.chunks_mut(BLOCK * width) {
        for start in (0..width).step_by(BLOCK) {
            let block = start..(start + BLOCK).min(width);
            if rows.chunks(width).any(|row| row[block.clone()].contains(&true)) {
                rows.chunks_mut(width).for_each(|row| row[block.clone()].fill(true));
            }
        }
    }
}

/// The size of the next level.
pub(crate) fn halve(size: [usize; 2]) -> [usize; 2] {
    size.map(|side| (side / 2).max(1))
}

/// The texels of an axis of `size` that a texel of the next level, of `halved`, overlaps.
pub(crate) fn under(texel: usize, size: usize, halved: usize) -> std::ops::Range<usize> {
    texel * size / halved..((texel + 1) * size).div_ceil(halved)
}

/// The next level: clean where all that a texel overlaps is.
fn shrink(clean: &[bool], size: [usize; 2], halved: [usize; 2]) -> Vec<bool> {
    let mut coarser = Vec::with_capacity(halved[0] * halved[1]);
    for y in 0..halved[1] {
        for x in 0..halved[0] {
            let mut rows = under(y, size[1], halved[1]);
            let columns = under(x, size[0], halved[0]);
            coarser.push(rows.all(|v| columns.clone().all(|u| clean[v * size[0] + u])));
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
    const PLAIN: Footprint = Footprint { anisotropy: 1, blocks: false };

    fn quad(low: f32, high: f32) -> [Vec2; 4] {
        [[low, low], [high, low], [high, high], [low, high]].map(Vec2::from)
    }

    #[test]
    fn a_quad_reads_one_texel_around_it_at_every_level() {
        // 4…12 of 16, whose outline runs between texels.
        let uvs = quad(0.25, 0.75);
        let validity = Validity::from_charts(16, 16, CLAMP, &uvs, &QUAD);
        let reads = count_reads(&validity, CLAMP, &uvs, &QUAD, PLAIN);
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
            let reads = count_reads(&all, [Wrap::Repeat, Wrap::Mirror], &uvs, &QUAD, PLAIN);
            assert!(reads.iter().all(|level| level.invalid == 0 && level.read > 0));
        }
    }

    #[test]
    fn one_hole_spoils_all_it_goes_into() {
        let mut flags = vec![true; 35];
        flags[17] = false;
        let uvs = quad(0.0, 1.0);
        let reads = count_reads(&Validity::from_flags(7, 5, flags), CLAMP, &uvs, &QUAD, PLAIN);
        // Column 3 of 7 goes into the middle one of three, row 2 of 5 into both of two.
        assert_eq!(reads.iter().map(|level| level.invalid).collect::<Vec<_>>(), [1, 2, 1]);
    }

    #[test]
    fn anisotropic_reads_reach_as_many_texels_out_as_they_have_taps() {
        let uvs = quad(0.25, 0.75);
        let validity = Validity::from_charts(32, 32, CLAMP, &uvs, &QUAD);
        for (anisotropy, side) in [(0, 18), (1, 18), (2, 20), (4, 24), (16, 32)] {
            let footprint = Footprint { anisotropy, blocks: false };
            let reads = count_reads(&validity, CLAMP, &uvs, &QUAD, footprint);
            assert_eq!(reads[0].read, side * side, "{anisotropy}");
            assert_eq!(reads[0].invalid, side * side - 256);
        }
    }

    #[test]
    fn a_texel_that_is_read_reads_its_block_at_every_level() {
        // 4…12 of 18 reads columns 3…13: all four whole blocks, and not the one of two columns.
        let uvs = quad(4.0 / 18.0, 12.0 / 18.0);
        let validity = Validity::from_charts(18, 18, CLAMP, &uvs, &QUAD);
        let footprint = Footprint { anisotropy: 1, blocks: true };
        let reads = count_reads(&validity, CLAMP, &uvs, &QUAD, footprint);
        let read: Vec<_> = reads.iter().map(|level| (level.width, level.read)).collect();
        // 9 texels: 1…7 are read, which lie in the first two blocks.
        assert_eq!(read, [(18, 256), (9, 64), (4, 16), (2, 4), (1, 1)]);
    }

    proptest! {
        /// Taps of anisotropic reads, spread over n texels in any direction.
        #[test]
        fn no_anisotropic_tap_reads_beyond_the_count(
            corners in prop::array::uniform3([0.2..0.8f32, 0.2..0.8f32]),
            taps in 1..9u8,
            angle in 0.0..6.3f64,
            // How many texels the finer level's are smaller than those of the level asked for.
            fraction in 1.0..1.999f64,
        ) {
            let size = [64, 48];
            let uvs = corners.map(Vec2::from);
            let footprint = Footprint { anisotropy: taps, blocks: false };
            let reads = texels_read(size, [Wrap::Repeat; 2], &uvs, &[[0, 1, 2]], footprint);
            let n = f64::from(taps);
            let along = glam::DVec2::from_angle(angle) * n * fraction;
            for [a, b] in [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [0.5, 0.5], [0.3, 0.3]] {
                let [p, q, r] = uvs.map(|uv| to_texels(uv, size));
                for tap in 0..taps {
                    let step = along * ((f64::from(tap) + 0.5) / n - 0.5);
                    let at = (p * a + q * b + r * (1.0 - a - b) + step - 0.5).floor();
                    for corner in 0..4 {
                        let texel = at + glam::DVec2::new(f64::from(corner & 1), f64::from(corner >> 1));
                        let x = Wrap::Repeat.texel(texel.x as i64, size[0]);
                        let y = Wrap::Repeat.texel(texel.y as i64, size[1]);
                        let from = p * a + q * b + r * (1.0 - a - b) + step - 0.5;
                        let weight = (1.0 - (from - texel).abs()).min_element();
                        prop_assert!(weight < 1e-9 || reads[y * size[0] + x]);
                    }
                }
            }
        }

        /// Positions all over a triangle, and the four texels a sampler blends at each.
        #[test]
        fn no_bilinear_tap_reads_beyond_the_count(
            corners in prop::array::uniform3([-0.5..1.5f32, -0.5..1.5f32]),
            size in [1..12usize, 1..12usize],
            modes in [0..3usize, 0..3usize],
        ) {
            let wrap = modes.map(|m| [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp][m]);
            let uvs = corners.map(Vec2::from);
            let reads = texels_read(size, wrap, &uvs, &[[0, 1, 2]], PLAIN);
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
