//! Fireflies between the charts of an image of floats.
//!
//! One of them, taken for a chart, would light up the whole gap. So after trimming, valid texels in a
//! component (connected along rows, columns and diagonals) of at most 4, or of fewer than 64 with one
//! in it that is brighter than 20 times the 99.9th percentile of the components of 64 and more, are
//! invalid.

use image::Rgba32FImage;

use super::regions::{AROUND, collect_region};
use crate::color::luminance;

/// A component of at most this many valid texels is a firefly…
const SPECK: usize = 4;

/// …and so is one of fewer than this many…
const LEAST_CHART: usize = 64;

/// …with a texel so many times brighter than all but a thousandth of the others.
const FIREFLY: f32 = 20.0;

/// Takes fireflies out of a mask of valid texels.
pub(super) fn drop_fireflies(image: &Rgba32FImage, mask: &mut [bool]) {
    let light = |&texel: &usize| {
        let [r, g, b, _] = image.as_raw()[4 * texel..4 * texel + 4] else { return 0.0 };
        luminance([r, g, b])
    };
    let width = image.width() as usize;
    let mut left = mask.to_vec();
    let (mut region, mut small, mut usual) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..left.len() {
        if !std::mem::take(&mut left[seed]) {
            continue;
        }
        collect_region(&mut left, width, seed, &AROUND, &mut region);
        if region.len() <= SPECK {
            region.iter().for_each(|&texel| mask[texel] = false);
        } else if region.len() < LEAST_CHART {
            small.push(region.clone());
        } else {
            usual.extend(region.iter().map(light).filter(|light| light.is_finite()));
        }
    }
    let rank = usual.len() * 999 / 1000;
    if usual.is_empty() {
        return;
    }
    let limit = FIREFLY * *usual.select_nth_unstable_by(rank, f32::total_cmp).1;
    for region in small.iter().filter(|region| region.iter().any(|texel| light(texel) > limit)) {
        region.iter().for_each(|&texel| mask[texel] = false);
    }
}
