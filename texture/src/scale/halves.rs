//! Halves of an image without alpha, halves of these, and so on: from sums, so that no texel is read twice
//! and none is rounded on the way.

use image::{ImageBuffer, Pixel};
use rayon::prelude::*;

use crate::repair::renormalize;
use crate::role::Role;
use crate::samples::{Coding, Group, Sample};
use crate::validity::Validity;

/// The sum of each of three channels over valid texels, and their number.
type Sum = [f64; 4];

/// An image and which of its texels are valid.
type Image<P> = (ImageBuffer<P, Vec<<P as Pixel>::Subpixel>>, Validity);

/// So many halves; the sides are whole multiples of the last.
pub(super) fn halve_often<P>(
    image: &ImageBuffer<P, Vec<P::Subpixel>>,
    role: Role,
    validity: &Validity,
    times: u32,
) -> Vec<Image<P>>
where
    P: Pixel,
    P::Subpixel: Sample,
{
    let stride = P::CHANNEL_COUNT as usize;
    let color = Group::of(role, stride).0;
    let decode = <P::Subpixel>::decoder(color.coding);
    let (samples, flags): (&[P::Subpixel], &[bool]) = (image, validity.flags());
    let mut size = [validity.width(), validity.height()];
    let mut sums = halve(size, |at, sum| {
        let texel = &samples[at * stride..][..stride];
        if flags[at] && texel.iter().all(|sample| sample.is_number()) {
            for channel in 0..stride.min(3) {
                sum[channel] += f64::from(decode(texel[channel]));
            }
            sum[3] += 1.0;
        }
    });
    let mut halves = Vec::new();
    for half in 1..=times {
        if half > 1 {
            let finer = std::mem::take(&mut sums);
            sums = halve(size, |at, sum| {
                for k in 0..4 {
                    sum[k] += finer[at][k];
                }
            });
        }
        size = size.map(|side| side / 2);
        halves.push(means(&sums, size, color));
    }
    halves
}

/// The sums over squares of two by two cells of a grid, each of which `add` adds.
fn halve([width, height]: [usize; 2], add: impl Fn(usize, &mut Sum) + Sync) -> Vec<Sum> {
    let half = width / 2;
    let mut sums = vec![[0.0; 4]; half * (height / 2)];
    sums.par_chunks_exact_mut(half.max(1)).enumerate().for_each(|(y, row)| {
        for (x, sum) in row.iter_mut().enumerate() {
            let first = 2 * y * width + 2 * x;
            for at in [first, first + 1, first + width, first + width + 1] {
                add(at, sum);
            }
        }
    });
    sums
}

/// The image of the means.
fn means<P>(sums: &[Sum], [width, height]: [usize; 2], color: Group) -> Image<P>
where
    P: Pixel,
    P::Subpixel: Sample,
{
    let stride = P::CHANNEL_COUNT as usize;
    let mut image = ImageBuffer::new(width as u32, height as u32);
    let samples: &mut [P::Subpixel] = &mut image;
    samples.par_chunks_exact_mut(stride).zip(sums).with_min_len(width).for_each(|(texel, sum)| {
        if sum[3] == 0.0 {
            return;
        }
        let mut mean = [0.0; 3];
        for channel in 0..3 {
            mean[channel] = (sum[channel] / sum[3]) as f32;
        }
        if color.coding == Coding::Vector {
            renormalize(&mut mean);
        }
        for channel in 0..stride.min(3) {
            texel[channel] = Sample::encode(mean[channel], color.coding);
        }
    });
    let valid = sums.iter().map(|sum| sum[3] > 0.0).collect();
    (image, Validity::from_flags(width, height, valid))
}
