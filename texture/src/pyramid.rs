//! Fills the holes of an image by pull and push through a pyramid (Gortler, Grzeszczuk, Szeliski &
//! Cohen, "The Lumigraph", SIGGRAPH 1996; Kraus, "The pull-push algorithm revisited", GRAPP 2009).
//!
//! Each texel has a value x and a weight w: 1 for a source, 0 for any other. *Pull* makes level
//! r + 1 from level r, at half the size rounded up, with h̃ = (1 2 2 1)ᵀ(1 2 2 1) / 36:
//!
//! ```text
//! w' = min(4 Σ h̃ w, 1)        x' = Σ h̃ w x / Σ h̃ w
//! ```
//!
//! so that a coarse texel counts in full once it has seen one whole fine texel (the `kernel` module has the measurements).
//! *Push* goes back from one texel to the image, with h = (¼ ¾)ᵀ(¼ ¾) about the nearest four:
//!
//! ```text
//! tw = Σ h w'    tx = Σ h w' x' / tw    x ← tx (1 − w) + w x    w ← tw (1 − w) + w
//! ```
//!
//! Levels hold w·x instead of x, so that both sums are plain. Indices beyond a level wrap as the sampler's do. A size that is odd under [`Wrap::Repeat`] or
//! [`Wrap::Mirror`] makes one texel of the next level straddle the image's edge: its value belongs
//! half a texel of that level off, and the fill stays smooth but is not exactly periodic.
//!
//! Guaranteed: nothing but holes is written; a filled value is a weighted mean of sources, so it
//! lies between their least and greatest up to f32 rounding; values that are not sources, NaN
//! among them, have no influence; the bits are the same at any number of threads. Not guaranteed:
//! a ramp across a hole comes out bent, off by about an eighth of what it rises there, and beyond
//! the sources the fill levels off.

use rayon::prelude::*;

use crate::kernel::{
    Cell, Level, ROWS, blend_columns, blend_rows, pull_level, pull_rows, push_level,
};
use crate::plane::Plane;
use crate::wrap::Wrap;

/// The role of a texel in a fill.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TexelRole {
    /// Gives its value to holes, and keeps it. The value must be finite.
    Source,
    /// Keeps its value, and gives nothing.
    Bystander,
    /// Takes what the sources give.
    Hole,
}

/// Fills the holes of `plane` from its sources; false, and nothing written, if there are no
/// sources. `parts`: one per texel, row after row; `wrap`: along x and y. Every channel is filled
/// alike.
///
/// Takes memory for a third of the image more, and one weight per three channels.
///
/// # Panics
/// If `parts` has not one element per texel.
pub fn fill_holes(plane: &mut Plane, parts: &[TexelRole], wrap: [Wrap; 2]) -> bool {
    assert_eq!(parts.len(), plane.width() * plane.height(), "parts and texels differ in number");
    let (size, channels) = ([plane.width(), plane.height()], plane.channels());
    (0..channels).step_by(3).all(|first| {
        let own = first..channels.min(first + 3);
        let mut texels = Texels {
            samples: plane.data_mut(),
            stride: channels,
            size,
            wrap,
            read: |texel: &[f32], values: &mut [f32]| values.copy_from_slice(&texel[own.clone()]),
            write: |texel: &mut [f32], values: &mut [f32]| {
                texel[own.clone()].copy_from_slice(values);
            },
        };
        texels.fill(own.len(), parts)
    })
}

/// The texels of an image as its file stores them, and how to read and write some channels of one:
/// no copy of the image in floats is needed.
pub(crate) struct Texels<'a, T, R, W> {
    /// `stride` per texel, row after row.
    pub(crate) samples: &'a mut [T],
    pub(crate) stride: usize,
    /// Width and height.
    pub(crate) size: [usize; 2],
    pub(crate) wrap: [Wrap; 2],
    /// Reads the channels of a source.
    pub(crate) read: R,
    /// Writes the channels of a hole; what becomes of the numbers does not matter.
    pub(crate) write: W,
}

impl<T, R, W> Texels<'_, T, R, W>
where
    T: Send + Sync,
    R: Fn(&[T], &mut [f32]) + Sync,
    W: Fn(&mut [T], &mut [f32]) + Sync,
{
    /// Fills one to three channels; false, and nothing written, if there are no sources.
    pub(crate) fn fill(&mut self, channels: usize, parts: &[TexelRole]) -> bool {
        if !parts.contains(&TexelRole::Source) {
            return false;
        }
        if parts.contains(&TexelRole::Hole) {
            match channels {
                1 => self.fill_channels::<2>(parts),
                2 => self.fill_channels::<3>(parts),
                _ => self.fill_channels::<4>(parts),
            }
        }
        true
    }

    /// Fills `N - 1` channels.
    fn fill_channels<const N: usize>(&mut self, parts: &[TexelRole]) {
        if self.size == [1, 1] {
            return;
        }
        let mut levels = vec![self.pull::<N>(parts)];
        while let Some(last) = levels.last()
            && (last.width > 1 || last.height > 1)
        {
            levels.push(pull_level(last, self.wrap));
        }
        for coarse in (1..levels.len()).rev() {
            let (finer, coarser) = levels.split_at_mut(coarse);
            push_level(&coarser[0], &mut finer[coarse - 1], self.wrap);
        }
        self.push(&levels[0], parts);
    }

    fn pull<const N: usize>(&self, parts: &[TexelRole]) -> Level<N> {
        let (width, stride) = (self.size[0], self.stride);
        pull_rows(self.size, self.wrap, |y, row: &mut [Cell<N>]| {
            let texels = self.samples[y * width * stride..].chunks_exact(stride);
            let parts = &parts[y * width..(y + 1) * width];
            for ((cell, texel), part) in row.iter_mut().zip(texels).zip(parts) {
                *cell = [0.0; N];
                if *part == TexelRole::Source {
                    (self.read)(texel, &mut cell[..N - 1]);
                    cell[N - 1] = 1.0;
                }
            }
        })
    }

    fn push<const N: usize>(&mut self, coarse: &Level<N>, parts: &[TexelRole]) {
        let (width, stride, wrap, write) = (self.size[0], self.stride, self.wrap, &self.write);
        let blocks = self.samples.par_chunks_mut(width * stride * ROWS).enumerate();
        blocks.zip(parts.par_chunks(width * ROWS)).for_each_init(
            || vec![[0.0; N]; coarse.width + 2],
            |blended, ((block, texels), parts)| {
                let rows = texels.chunks_exact_mut(width * stride).zip(parts.chunks_exact(width));
                for (y, (row, parts)) in (block * ROWS..).zip(rows) {
                    if !parts.contains(&TexelRole::Hole) {
                        continue;
                    }
                    blend_rows(coarse, y, wrap, blended);
                    for (x, texel) in row.chunks_exact_mut(stride).enumerate() {
                        if parts[x] == TexelRole::Hole {
                            let mut given: Cell<N> = blend_columns(blended, x);
                            let unit = 1.0 / given[N - 1];
                            given[..N - 1].iter_mut().for_each(|sum| *sum *= unit);
                            write(texel, &mut given[..N - 1]);
                        }
                    }
                }
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MODES: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

    /// Values and weights of a level, computed the slow way: in f64, all 16 taps of the formula.
    struct Slow {
        size: [usize; 2],
        value: Vec<f64>,
        weight: Vec<f64>,
    }

    impl Slow {
        fn at(&self, x: i64, y: i64, wrap: [Wrap; 2]) -> (f64, f64) {
            let texel =
                wrap[1].texel(y, self.size[1]) * self.size[0] + wrap[0].texel(x, self.size[0]);
            (self.value[texel], self.weight[texel])
        }

        fn pull(&self, wrap: [Wrap; 2]) -> Self {
            let size = self.size.map(|n| n.div_ceil(2));
            let mut coarse = Self { size, value: Vec::new(), weight: Vec::new() };
            for (y, x) in (0..size[1] as i64).flat_map(|y| (0..size[0] as i64).map(move |x| (y, x)))
            {
                let kernel = [1.0, 2.0, 2.0, 1.0];
                let (mut sum, mut weight) = (0.0, 0.0);
                for (j, i) in (0..4).flat_map(|j| (0..4).map(move |i| (j, i))) {
                    let (value, w) = self.at(2 * x - 1 + i as i64, 2 * y - 1 + j as i64, wrap);
                    let h = kernel[i] * kernel[j] / 36.0;
                    if w > 0.0 {
                        sum += h * w * value;
                        weight += h * w;
                    }
                }
                coarse.value.push(if weight > 0.0 { sum / weight } else { 0.0 });
                coarse.weight.push((4.0 * weight).min(1.0));
            }
            coarse
        }

        fn push(&mut self, coarse: &Self, wrap: [Wrap; 2]) {
            for y in 0..self.size[1] {
                for x in 0..self.size[0] {
                    let (mut sum, mut weight) = (0.0, 0.0);
                    let taps = |v: usize| {
                        let step = 2 * (v as i64 % 2) - 1;
                        [(v as i64 / 2, 0.75), (v as i64 / 2 + step, 0.25)]
                    };
                    for (v, hv) in taps(y) {
                        for (u, hu) in taps(x) {
                            let (value, w) = coarse.at(u, v, wrap);
                            sum += hu * hv * w * value;
                            weight += hu * hv * w;
                        }
                    }
                    let texel = y * self.size[0] + x;
                    let w = self.weight[texel];
                    let kept = if w > 0.0 { w * self.value[texel] } else { 0.0 };
                    self.value[texel] = sum / weight * (1.0 - w) + kept;
                    self.weight[texel] = weight * (1.0 - w) + w;
                }
            }
        }

        fn fill(&mut self, wrap: [Wrap; 2]) {
            if self.size != [1, 1] {
                let mut coarse = self.pull(wrap);
                coarse.fill(wrap);
                self.push(&coarse, wrap);
            }
        }
    }

    /// A size, wrap modes, one value and one part per texel, with NaN wherever it must not matter.
    fn image() -> impl Strategy<Value = ([usize; 2], [Wrap; 2], Vec<f32>, Vec<TexelRole>)> {
        let modes = [prop::sample::select(&MODES[..]), prop::sample::select(&MODES[..])];
        ([1..40usize, 1..40usize], modes, 1..20u32).prop_flat_map(|(size, wrap, rarity)| {
            let texels = size[0] * size[1];
            let part = prop_oneof![
                1 => Just(TexelRole::Source), 1 => Just(TexelRole::Bystander), rarity => Just(TexelRole::Hole)
            ];
            (prop::collection::vec(-2.0..7.0f32, texels), prop::collection::vec(part, texels))
                .prop_map(move |(mut values, parts)| {
                    for (value, part) in values.iter_mut().zip(&parts) {
                        if *part != TexelRole::Source && value.fract() > 0.5 {
                            *value = if *value > 3.0 { f32::INFINITY } else { f32::NAN };
                        }
                    }
                    (size, wrap, values, parts)
                })
        })
    }

    fn bits(plane: &Plane) -> Vec<u32> {
        plane.data().iter().map(|value| value.to_bits()).collect()
    }

    #[test]
    fn one_level_of_pull_weighs_one_two_two_one_and_trusts_fourfold() {
        // Texel 1 is 2/6 of the first coarse texel and 1/6 of the second; 4/3 saturates.
        let mut plane = Plane::new(4, 1, 1);
        plane.texel_mut(1, 0)[0] = 3.0;
        let parts = [TexelRole::Hole, TexelRole::Source, TexelRole::Hole, TexelRole::Hole];
        let texels = Texels {
            samples: plane.data_mut(),
            stride: 1,
            size: [4, 1],
            wrap: [Wrap::Clamp; 2],
            read: |texel: &[f32], values: &mut [f32]| values.copy_from_slice(texel),
            write: |_: &mut [f32], _: &mut [f32]| {},
        };
        let level = texels.pull::<2>(&parts);
        assert_eq!([level.width, level.height], [2, 1]);
        let expected = [[3.0, 1.0], [2.0, 4.0 / 6.0]];
        for (cell, expected) in level.cells.iter().zip(expected) {
            assert!(cell.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{cell:?}");
        }
    }

    #[test]
    fn without_sources_nothing_is_written() {
        let mut plane = Plane::from_vec(2, 1, 1, vec![5.0, f32::NAN]);
        let before = bits(&plane);
        assert!(!fill_holes(
            &mut plane,
            &[TexelRole::Hole, TexelRole::Bystander],
            [Wrap::Repeat; 2]
        ));
        assert_eq!(bits(&plane), before);
        assert!(!fill_holes(&mut Plane::new(0, 7, 3), &[], [Wrap::Repeat; 2]));
        assert!(fill_holes(&mut Plane::new(1, 1, 3), &[TexelRole::Source], [Wrap::Repeat; 2]));
    }

    #[test]
    fn a_ramp_is_bridged() {
        // A hole 32 wide in a ramp of slope 1: the fill is off by less than a sixth of the hole.
        let mut plane = Plane::new(64, 64, 1);
        let mut parts = vec![TexelRole::Source; 64 * 64];
        for (y, x) in (0..64).flat_map(|y| (0..64).map(move |x| (y, x))) {
            let hole = (16..48).contains(&x) && (16..48).contains(&y);
            plane.texel_mut(x, y)[0] = if hole { -1.0 } else { x as f32 };
            if hole {
                parts[y * 64 + x] = TexelRole::Hole;
            }
        }
        assert!(fill_holes(&mut plane, &parts, [Wrap::Clamp; 2]));
        let error = |x: usize, y: usize| (plane.texel(x, y)[0] - x as f32).abs();
        let most = (0..64).flat_map(|y| (0..64).map(move |x| (x, y))).map(|(x, y)| error(x, y));
        let most = most.fold(0.0, f32::max);
        assert!(most < 32.0 / 6.0, "{most}");
    }

    #[test]
    fn a_fill_crosses_the_edge_only_where_the_image_repeats() {
        // Sources 1 at the left, 9 at the right; the hole lies right of the left one.
        let fill = |wrap| {
            let mut plane = Plane::from_vec(8, 1, 1, vec![1., 0., 0., 0., 0., 0., 0., 9.]);
            let mut parts = [TexelRole::Hole; 8];
            parts[0] = TexelRole::Source;
            parts[7] = TexelRole::Source;
            fill_holes(&mut plane, &parts, [wrap, Wrap::Clamp]);
            plane.texel(1, 0)[0]
        };
        assert!(fill(Wrap::Repeat) > fill(Wrap::Clamp) + 0.5);
        assert_eq!(fill(Wrap::Mirror).to_bits(), fill(Wrap::Clamp).to_bits());
    }

    proptest! {
        #[test]
        fn the_fill_is_that_of_the_formula((size, wrap, values, parts) in image()) {
            let mut plane = Plane::from_vec(size[0], size[1], 1, values.clone());
            let filled = fill_holes(&mut plane, &parts, wrap);
            prop_assert_eq!(filled, parts.contains(&TexelRole::Source));
            let weight = parts.iter().map(|&p| if p == TexelRole::Source { 1.0 } else { 0.0 }).collect();
            let mut slow = Slow { size, value: values.iter().copied().map(f64::from).collect(), weight };
            if filled {
                slow.fill(wrap);
            }
            for (texel, part) in parts.iter().enumerate() {
                let found = plane.data()[texel];
                if filled && *part == TexelRole::Hole {
                    prop_assert!((f64::from(found) - slow.value[texel]).abs() < 2e-5);
                } else {
                    prop_assert_eq!(found.to_bits(), values[texel].to_bits());
                }
            }
        }

        #[test]
        fn filled_values_lie_between_the_sources((size, wrap, values, parts) in image()) {
            let mut plane = Plane::from_vec(size[0], size[1], 1, values.clone());
            if fill_holes(&mut plane, &parts, wrap) {
                let sources = || values.iter().zip(&parts).filter(|s| *s.1 == TexelRole::Source).map(|s| *s.0);
                let least = sources().fold(f32::INFINITY, f32::min);
                let greatest = sources().fold(f32::NEG_INFINITY, f32::max);
                for (&value, part) in plane.data().iter().zip(&parts) {
                    if *part == TexelRole::Hole {
                        prop_assert!(value >= least - 1e-5 && value <= greatest + 1e-5);
                    }
                }
            }
        }

        #[test]
        fn channels_and_threads_do_not_change_the_bits((size, wrap, values, parts) in image(), channels in 1..8usize) {
            let texels = size[0] * size[1];
            let many = (0..texels * channels).map(|i| values[i / channels] + (i % channels) as f32);
            let plane = Plane::from_vec(size[0], size[1], channels, many.collect());
            let fill = |threads: usize| {
                let mut plane = plane.clone();
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| fill_holes(&mut plane, &parts, wrap));
                plane
            };
            let one = fill(1);
            prop_assert_eq!(bits(&one), bits(&fill(2)));
            for channel in 0..channels {
                let alone = values.iter().map(|value| value + channel as f32).collect();
                let mut alone = Plane::from_vec(size[0], size[1], 1, alone);
                fill_holes(&mut alone, &parts, wrap);
                let found = one.data().iter().skip(channel).step_by(channels).map(|v| v.to_bits());
                prop_assert_eq!(found.collect::<Vec<_>>(), bits(&alone));
            }
        }
    }
}
