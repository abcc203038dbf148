//! The texels of an image that a bilinear tap at some mip level is made of.
//!
//! A bilinear tap at level m blends four texels of that level, each of them the mean of texels of
//! the image itself (box filter, as in [`Mips`](crate::Mips)): every tap is a sum of the image's
//! texels with weights that do not depend on their values. Both steps are separable, so the weights
//! of a texel are those of its column times those of its row.

use glam::DVec2;

use crate::mips::{box_taps, half};
use crate::wrap::Wrap;

/// Texels and the weights they are read with: index `y · width + x`, no texel twice, sum 1.
pub(super) type Taps = Vec<(usize, f64)>;

/// The sampler of an image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampler {
    /// Width and height in texels.
    pub(super) size: [usize; 2],
    /// Wrap modes along u and v.
    pub(super) wrap: [Wrap; 2],
}

impl Sampler {
    /// The texels that the bilinear tap at `at`, in texels of the image, reads at mip level
    /// `level`.
    pub(super) fn taps(&self, at: DVec2, level: usize) -> Taps {
        let columns = axis_taps(at.x, self.size[0], self.wrap[0], level);
        let rows = axis_taps(at.y, self.size[1], self.wrap[1], level);
        let row = |&(y, wy): &(usize, f64)| {
            columns.iter().map(move |&(x, wx)| (y * self.size[0] + x, wx * wy)).collect::<Taps>()
        };
        rows.iter().flat_map(row).collect()
    }
}

/// The texels of an axis of `size` that a linear tap at `at` (texels of level 0) reads at a level.
fn axis_taps(at: f64, size: usize, wrap: Wrap, level: usize) -> Taps {
    let mut sizes = vec![size];
    for step in 0..level {
        sizes.push(half(sizes[step]));
    }
    let own = sizes[level];
    let position = at * (own as f64 / size as f64) - 0.5;
    let first = position.floor();
    let second_weight = position - first;
    let first = first as i64;
    let mut taps = vec![
        (wrap.texel(first, own), 1.0 - second_weight),
        (wrap.texel(first.saturating_add(1), own), second_weight),
    ];
    for &size in sizes[..level].iter().rev() {
        let under = |(texel, weight): (usize, f64)| {
            box_taps(texel, size).map(|(under, part)| (under, weight * f64::from(part)))
        };
        taps = merge(taps.into_iter().flat_map(under).collect());
    }
    merge(taps)
}

/// Sorts by texel, adds up what is there twice and leaves out what has no weight.
fn merge(mut taps: Taps) -> Taps {
    taps.sort_unstable_by_key(|tap| tap.0);
    taps.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
        }
        same
    });
    taps.retain(|tap| tap.1 > 0.0);
    taps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mips::Mips;
    use crate::plane::Plane;
    use crate::raster::to_texels;
    use glam::Vec2;
    use proptest::prelude::*;

    proptest! {
        /// The sampler of the mip maps, which builds the levels, is the oracle.
        #[test]
        fn taps_are_what_a_sampler_of_mip_maps_reads(
            size in [1..23usize, 1..23usize],
            modes in [0..3usize, 0..3usize],
            uv in [-2.0..3.0f32, -2.0..3.0f32],
            level in 0..4usize,
        ) {
            let wrap = modes.map(|m| [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp][m]);
            let [width, height] = size;
            let values = (0..width * height).map(|i| ((i * 7919) % 101) as f32 / 101.0).collect();
            let plane = Plane::from_vec(width, height, 1, values);
            let mips = Mips::from_plane(&plane).unwrap();
            prop_assume!(level < mips.levels());
            let uv = Vec2::from(uv);
            let taps = Sampler { size, wrap }.taps(to_texels(uv, size), level);
            let sum: f64 = taps.iter().map(|tap| tap.1).sum();
            let value: f64 = taps.iter().map(|tap| tap.1 * f64::from(plane.data()[tap.0])).sum();
            let expected = f64::from(mips.sample_bilinear(level, uv, wrap)[0]);
            prop_assert!((sum - 1.0).abs() < 1e-6);
            prop_assert!((value - expected).abs() < 1e-4, "{} instead of {}", value, expected);
        }
    }

    #[test]
    fn a_tap_across_the_border_reads_the_other_side_once() {
        let sampler = |wrap| Sampler { size: [4, 1], wrap: [wrap, Wrap::Clamp] };
        let at = DVec2::new(0.0, 0.5);
        assert_eq!(sampler(Wrap::Repeat).taps(at, 0), [(0, 0.5), (3, 0.5)]);
        assert_eq!(sampler(Wrap::Mirror).taps(at, 0), [(0, 1.0)]);
        assert_eq!(sampler(Wrap::Clamp).taps(at, 0), [(0, 1.0)]);
    }
}
