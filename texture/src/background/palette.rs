//! The colors of a background, from those along the image's border.
//!
//! Colors within the noise of a codec, or of a grain, are one. A color is one of the background's
//!
//! - if it holds a quarter of the border;
//! - if it alternates with others along it: they are of much the same share, each in six places at
//!   least, and hold half of the border together: a checkerboard, blotches;
//! - if it holds an eighth of the border and has at least two charts of its own within it, as where
//!   atlases of several backgrounds were put side by side.
//!
//! A swatch at the border is none of these, and neither is a smooth sky. The shares are held from both
//! sides by the atlases and the pictures of the tests; they were not tuned on a corpus.

use std::collections::BTreeMap;

use image::Rgba32FImage;

use super::regions::{AROUND, BESIDE, NONE, collect_region, is_near, labels, neighbors};

/// A color of the background holds this share of the border alone…
const ALONE: f64 = 0.25;
/// …this, with charts within it…
const WITH_CHARTS: f64 = 0.125;
/// …or this, if it alternates with others…
const ALTERNATING: f64 = 0.02;
/// …in at least so many places…
const PLACES: usize = 6;
/// …and this share of what the most frequent one holds…
const ALIKE: f64 = 0.25;
/// …and all of them hold this.
const TOGETHER: f64 = 0.5;

/// Most colors of a background.
const COLORS: usize = 16;

/// Charts within a color, and the least texels of one.
const CHARTS: usize = 2;
const LEAST_CHART: usize = 64;

/// The most that texels of one color differ: three steps of 8 bits, what a JPEG of good quality does
/// to a flat color.
const CODEC_NOISE: f32 = 3.0 / 255.0;

/// The most that they differ if they are grain, which differs from texel to texel.
const GRAIN: f32 = 12.0 / 255.0;

/// Neighbors in a grain differ by this share of what any two texels of it do, squared: 1 if each is
/// drawn anew (1.00 in the grain of the tests), 0.005 and less in soft light.
const GRAIN_STEP: f64 = 0.5;

/// Steps that take the middle of a grain to the mean of all near it.
const MEANS: usize = 8;

/// The margin of a bound on a difference of bytes.
const HALF_STEP: f32 = 0.5 / 255.0;

/// The colors of a background.
pub(super) struct Palette {
    /// As stored, the most frequent first.
    pub(super) colors: Vec<[f32; 4]>,
    /// The most that a channel of the background differs from one of them.
    pub(super) tolerance: f32,
}

/// A color along the border.
struct Candidate {
    color: [f32; 4],
    /// Texels of the border that are near it, as a share.
    share: f64,
    /// Texels of the border that have it, as a share.
    exact: f64,
}

impl Palette {
    /// The palette of an image whose texels are looked at but for those that are `hidden`. The
    /// tolerance grows where the background has a grain, if `may_be_grainy`.
    pub(super) fn find(
        image: &Rgba32FImage,
        hidden: &[bool],
        tolerance: f32,
        may_be_grainy: bool,
    ) -> Option<Self> {
        let border = Border::of(image, hidden);
        let flat = border.palette(image, hidden, CODEC_NOISE);
        let is_noisy = |own: &Candidate| own.exact < 0.5 * own.share;
        let noisy = flat.as_ref().is_none_or(|flat| flat.iter().any(is_noisy));
        if noisy && may_be_grainy {
            // A grain may fall into several colors that alternate: fewer explain it better.
            let grainy = border.palette(image, hidden, GRAIN).filter(|grainy| {
                grainy.len() < flat.as_ref().map_or(usize::MAX, Vec::len)
                    && grainy.iter().map(|own| own.share).sum::<f64>() >= TOGETHER
                    && grainy.iter().all(|own| is_grain(image, own.color))
            });
            if let Some(grainy) = grainy {
                return Some(Self::of(&grainy, GRAIN + HALF_STEP));
            }
        }
        let wider = if noisy && may_be_grainy { CODEC_NOISE + HALF_STEP } else { tolerance };
        flat.map(|flat| Self::of(&flat, tolerance.max(wider)))
    }

    fn of(candidates: &[Candidate], tolerance: f32) -> Self {
        Self { colors: candidates.iter().map(|own| own.color).collect(), tolerance }
    }
}

/// The texels along an image's border that are seen.
struct Border {
    /// The number of texels of each color, as its bits.
    counts: BTreeMap<[u32; 4], usize>,
    texels: usize,
}

impl Border {
    fn of(image: &Rgba32FImage, hidden: &[bool]) -> Self {
        let width = image.width() as usize;
        let texels = border_texels(width, image.height() as usize);
        let mut counts = BTreeMap::new();
        for &texel in texels.iter().filter(|&&texel| !hidden[texel]) {
            let color = texel_of(image, texel);
            if color.iter().all(|v| v.is_finite()) {
                // Zeros of both signs are one color.
                *counts.entry(color.map(|v| (v + 0.0).to_bits())).or_insert(0usize) += 1;
            }
        }
        Self { counts, texels: texels.len() }
    }

    /// The most frequent colors, each with those within `reach` of it. Of equally frequent ones the
    /// last in the order of their bits, the same one every time.
    fn candidates(&self, reach: f32) -> Vec<Candidate> {
        let mut left: Vec<([f32; 4], usize)> =
            self.counts.iter().map(|(bits, count)| (bits.map(f32::from_bits), *count)).collect();
        let share = |count: usize| count as f64 / self.texels as f64;
        let mut candidates = Vec::new();
        while let Some(&(color, exact)) = left.iter().max_by_key(|(_, count)| *count)
            && candidates.len() < COLORS
        {
            let mut near = near_to(&left, color, reach);
            let mut center = color;
            if 2 * exact < near.texels {
                // The most frequent color of a grain may be any: its middle is where the mean stays.
                for _ in 0..MEANS {
                    center = near.mean;
                    near = near_to(&left, center, reach);
                }
            }
            left.retain(|(other, _)| *other != color && !is_near(other, &center, reach));
            if share(near.texels) < ALTERNATING {
                break;
            }
            let (share, exact) = (share(near.texels), share(exact));
            candidates.push(Candidate { color: center, share, exact });
        }
        candidates
    }

    /// The candidates that are of the background; `None` if there are none.
    fn palette(&self, image: &Rgba32FImage, hidden: &[bool], reach: f32) -> Option<Vec<Candidate>> {
        let candidates = self.candidates(reach);
        let most = candidates.iter().map(|own| own.share).fold(0.0, f64::max);
        if candidates.is_empty() || candidates.iter().map(|own| own.share).sum::<f64>() < ALONE {
            return None;
        }
        let colors: Vec<[f32; 4]> = candidates.iter().map(|own| own.color).collect();
        let mut labels = labels(image, &colors, reach);
        labels.iter_mut().zip(hidden).filter(|(_, hidden)| **hidden).for_each(|(l, _)| *l = NONE);
        let width = image.width() as usize;
        let places = border_places(&labels, width, candidates.len());
        let alternates = |at: usize| places[at] >= PLACES && candidates[at].share >= ALIKE * most;
        let together: f64 =
            (0..candidates.len()).filter(|&at| alternates(at)).map(|at| candidates[at].share).sum();
        let is_background = |at: usize| {
            let share = candidates[at].share;
            share >= ALONE
                || together >= TOGETHER && alternates(at)
                || share >= WITH_CHARTS && charts_within(&labels, width, at as u8) >= CHARTS
        };
        let kept: Vec<bool> = (0..candidates.len()).map(is_background).collect();
        let found: Vec<Candidate> = candidates
            .into_iter()
            .zip(kept)
            .filter_map(|(own, kept)| kept.then_some(own))
            .collect();
        (!found.is_empty()).then_some(found)
    }
}

/// Colors near to one.
struct Near {
    texels: usize,
    mean: [f32; 4],
}

fn near_to(counts: &[([f32; 4], usize)], color: [f32; 4], reach: f32) -> Near {
    let near = counts.iter().filter(|(other, _)| is_near(other, &color, reach));
    let (mut texels, mut sum) = (0, [0.0f64; 4]);
    for (other, count) in near {
        texels += count;
        sum.iter_mut().zip(other).for_each(|(sum, v)| *sum += *count as f64 * f64::from(*v));
    }
    Near { texels, mean: sum.map(|sum| (sum / texels.max(1) as f64) as f32) }
}

/// The texels along the border of an image, each once.
fn border_texels(width: usize, height: usize) -> Vec<usize> {
    let is_border = move |x: usize, y: usize| x == 0 || y == 0 || x + 1 == width || y + 1 == height;
    let row = |y: usize| {
        // Between the first and the last row only the ends count.
        let step = if y == 0 || y + 1 == height { 1 } else { width.saturating_sub(1).max(1) };
        (0..width).step_by(step).filter(move |&x| is_border(x, y)).map(move |x| y * width + x)
    };
    (0..height).flat_map(row).collect()
}

fn texel_of(image: &Rgba32FImage, texel: usize) -> [f32; 4] {
    [0, 1, 2, 3].map(|channel| image.as_raw()[4 * texel + channel])
}

/// In how many connected places each of so many labels touches the border.
fn border_places(labels: &[u8], width: usize, count: usize) -> Vec<usize> {
    let mut places = vec![0; count];
    let mut seen = vec![false; labels.len()];
    let mut region = Vec::new();
    for seed in border_texels(width, labels.len() / width.max(1)) {
        let label = labels[seed];
        if label == NONE || std::mem::replace(&mut seen[seed], true) {
            continue;
        }
        places[label as usize] += 1;
        region.clear();
        region.push(seed);
        while let Some(texel) = region.pop() {
            for next in neighbors(texel, width, labels.len(), &BESIDE).flatten() {
                if labels[next] == label && !std::mem::replace(&mut seen[next], true) {
                    region.push(next);
                }
            }
        }
    }
    places
}

/// The number of pieces without that label, of 64 texels or more, lie away from the border.
fn charts_within(labels: &[u8], width: usize, label: u8) -> usize {
    let mut others: Vec<bool> = labels.iter().map(|own| *own != label).collect();
    let (mut region, mut found) = (Vec::new(), 0);
    for seed in 0..others.len() {
        if std::mem::take(&mut others[seed]) {
            let at_border = collect_region(&mut others, width, seed, &AROUND, &mut region);
            found += usize::from(!at_border && region.len() >= LEAST_CHART);
        }
    }
    found
}

/// Whether the texels near a color differ from their neighbors as they do from any other of them.
fn is_grain(image: &Rgba32FImage, color: [f32; 4]) -> bool {
    let width = image.width() as usize;
    let near = |texel: usize| {
        let own = texel_of(image, texel);
        is_near(&own, &color, GRAIN).then_some(own)
    };
    let (mut sum, mut squares, mut all) = ([0.0f64; 4], 0.0f64, 0usize);
    let (mut steps, mut pairs) = (0.0f64, 0usize);
    for texel in 0..width * image.height() as usize {
        let Some(own) = near(texel) else { continue };
        all += 1;
        for (sum, value) in sum.iter_mut().zip(own) {
            *sum += f64::from(value);
            squares += f64::from(value) * f64::from(value);
        }
        if (texel + 1) % width != 0
            && let Some(next) = near(texel + 1)
        {
            pairs += 1;
            steps += own.iter().zip(next).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
        }
    }
    let all = all.max(1) as f64;
    let variance = squares / all - sum.iter().map(|sum| (sum / all).powi(2)).sum::<f64>();
    steps / pairs.max(1) as f64 >= GRAIN_STEP * 2.0 * variance
}
