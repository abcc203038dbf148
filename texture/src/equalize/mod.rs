//! Seam equalisation: both sides of a seam are made to read the same.
//!
//! A chart's outline is cut along edges of the surface, and each such edge lies at two places of the
//! image. Bilinear filtering blends other texels on one side than on the other, so the surface shows
//! a step along the seam even where every texel is right. Moving the texels next to the seam a little
//! takes the step away: with x the texels and A x the difference between both sides, sampled along
//! all seams at mip level 0 and the next levels,
//!
//! ```text
//! minimise  Σ L (A x)²  +  Σ λ (x − x₀)²
//! ```
//!
//! over the texels that those samples read, with L the length of seam that a sample stands for. λ is
//! small for texels that no chart covers, which nobody looks at, and greater for those that one
//! covers. No texel leaves the range of values around it on both sides.
//!
//! This is the image part of: S. Liu, Z. Ferguson, A. Jacobson, Y. Gingold, "Seamless: seam erasure
//! and seam-aware decoupling of shape from mesh resolution", ACM Trans. Graph. 36(6), SIGGRAPH Asia
//! 2017, §3, with sampled seams instead of integrals in closed form, one problem for several mip
//! levels, and tangent vectors compared after they are turned into one frame.
//!
//! Colors are compared in linear light, normals as tangent vectors, anything else as stored; alpha
//! stays. Guaranteed: texels that no seam reads keep their bits. Not guaranteed: that steps vanish;
//! where two colors meet at a seam on purpose, the change is spread over the texels next to it.
//!
//! Lab note, RMS step in thousandths at mips 0 to 3 after a fill, frypan.glb (22.7 21.0 20.6 24.8
//! before), and the greatest change of a covered texel, as 8-bit PNG:
//!
//! | λ covered, free | levels solved for | after | change |
//! |---|---|---|---|
//! | 0.01, 1e-4 | 0 | 1.2 10.1 15.9 23.2 | 0.09 |
//! | 0.01, 1e-4 | 0–2 | 1.4 1.3 1.8 14.8 | 0.33 |
//! | 0.1, 1e-3 | 0–2 | 1.8 2.2 2.6 15.6 | 0.12 |
//! | 1, 1e-3 | 0–2 | 2.9 2.9 3.0 15.8 | 0.04 |
//!
//! With the last: popcorn.glb 43.3 48.3 60.0 70.8 → 3.0 3.1 5.7 38.2, gelatin_box.glb 38.8 43.4 52.5
//! 58.1 → 2.9 2.3 2.3 31.7, leather of FlightHelmet 26.8 25.5 21.7 17.6 → 2.3 1.6 1.8 7.0, its normals
//! 65.2 57.1 45.4 33.4 → 11.9 7.5 6.2 13.0; level 3 too would take 2.5 times as long.
//!
//! Mip 0 alone leaves the levels below nearly as they were. A stiff chart costs little: the texels
//! around it do most of it. `seamwise repair <asset> -o out.glb --equalize-seams` prints the steps.

mod assemble;
mod footprint;
mod seam;
mod solve;

use glam::DVec3;
use image::{DynamicImage, ImageBuffer, Pixel};

use self::assemble::{Assembled, Assembly};
use self::footprint::Sampler;
use self::seam::{Placed, place, rms_step};
use self::solve::TOLERANCE;
use crate::error::Result;
use crate::plane::Plane;
use crate::role::Role;
use crate::samples::{Coding, Group, Sample, with_buffer};
use crate::validity::Validity;
use crate::wrap::Wrap;

pub use seam::Seam;

/// Mip levels at which steps are reported, the image itself first.
pub const STEP_LEVELS: usize = 4;

/// Options of an equalization: how far texels may change to make both sides of a seam equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// λ of a texel that a chart covers: the weight of a change of it beside a step along one texel
    /// of seam. Above 0.
    pub stiffness: f64,
    /// λ of a texel that no chart covers. Above 0.
    pub free_stiffness: f64,
    /// Most change of a texel's channel, in the working space: linear light, vectors −1…1.
    pub max_change: f64,
    /// The coarsest mip level whose steps are made small, at most 3; levels below 0 move only texels
    /// that no chart covers, beside those of level 0.
    pub mips: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { stiffness: 1.0, free_stiffness: 1e-3, max_change: f64::INFINITY, mips: 2 }
    }
}

/// The result of an equalization.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Equalized {
    /// Number of seams that were compared.
    pub seams: usize,
    /// RMS step across the seams at each mip level before, as a share of the range of the working
    /// space: 0…1 for light and numbers, of which floats may have more, −1…1 for vectors.
    pub before: [f64; STEP_LEVELS],
    /// RMS step after, in the samples that the image can hold.
    pub after: [f64; STEP_LEVELS],
    /// Number of texels that changed.
    pub texels: usize,
    /// Number of changed texels that a chart covers.
    pub covered_texels: usize,
    /// Greatest change of a channel of a texel, as a share of the range.
    pub max_change: f64,
}

/// Equalizes the seams of an image in place, after its repair; `wrap` is how its sampler reads
/// beyond the edges, and `validity` tells which texels charts cover.
///
/// In the role of a normal map, only seams whose turn is known count.
///
/// # Errors
/// [`Error::Invalid`](crate::Error::Invalid) if `validity` has another size than `image`, or the
/// image is of a kind that [`repair`](crate::repair::repair()) does not know.
pub fn equalize(
    image: &mut DynamicImage,
    role: Role,
    validity: &Validity,
    wrap: [Wrap; 2],
    seams: &[Seam],
    options: Options,
) -> Result<Equalized> {
    validity.expect_size_of(image)?;
    let job = Job { role, validity, wrap, seams, options };
    with_buffer!(image, buffer => job.run(buffer))
}

/// Equalizes the seams of up to three channels that are numbers as they are, as a light map's.
///
/// # Errors
/// [`Error::Invalid`](crate::Error::Invalid) if `validity` has another size than `plane`.
///
/// # Panics
/// If there are no channels or more than three.
pub fn equalize_plane(
    plane: &mut Plane,
    validity: &Validity,
    wrap: [Wrap; 2],
    seams: &[Seam],
    options: Options,
) -> Result<Equalized> {
    let count = plane.channels();
    assert!((1..=3).contains(&count), "{count} channels");
    validity.expect_size([plane.width(), plane.height()])?;
    let job = Job { role: Role::Data, validity, wrap, seams, options };
    let group = Group { first: 0, count, stride: count, coding: Coding::Linear };
    Ok(job.run_on(&mut Samples { samples: plane.data_mut(), group }))
}

#[derive(Clone, Copy)]
struct Job<'a> {
    role: Role,
    validity: &'a Validity,
    wrap: [Wrap; 2],
    seams: &'a [Seam],
    options: Options,
}

/// The color channels of an image.
struct Samples<'a, S> {
    samples: &'a mut [S],
    group: Group,
}

impl<S: Sample> Samples<'_, S> {
    /// A texel as numbers; channels that are not there are 0.
    fn value(&self, texel: usize) -> DVec3 {
        let mut value = DVec3::ZERO;
        let Group { count, stride, coding, .. } = self.group;
        for (channel, sample) in self.samples[texel * stride..][..count].iter().enumerate() {
            value[channel] = f64::from(sample.decode(coding));
        }
        value
    }

    /// Writes the samples nearest to a value; returns by how much the texel changed.
    fn write(&mut self, texel: usize, value: DVec3) -> DVec3 {
        let before = self.value(texel);
        let Group { count, stride, coding, .. } = self.group;
        for (channel, sample) in self.samples[texel * stride..][..count].iter_mut().enumerate() {
            let next = S::encode(value[channel] as f32, coding);
            // Where no number changes, the bits stay too.
            if f64::from(next.decode(coding)) != before[channel] {
                *sample = next;
            }
        }
        (self.value(texel) - before).abs()
    }
}

impl Job<'_> {
    fn run<P>(self, image: &mut ImageBuffer<P, Vec<P::Subpixel>>) -> Equalized
    where
        P: Pixel,
        P::Subpixel: Sample,
    {
        let (group, _) = Group::of(self.role, P::CHANNEL_COUNT as usize);
        self.run_on(&mut Samples { samples: image, group })
    }

    fn run_on<S: Sample>(self, image: &mut Samples<'_, S>) -> Equalized {
        let size = [self.validity.width(), self.validity.height()];
        let sampler = Sampler { size, wrap: self.wrap };
        let vectors = image.group.coding == Coding::Vector;
        let seams = place(self.seams, &sampler, vectors);
        let mut done = Equalized { seams: seams.len(), ..Equalized::default() };
        if seams.is_empty() {
            return done;
        }
        let range = if vectors { 2.0 } else { 1.0 };
        done.before = steps(&seams, sampler, image, range);
        let options = Options { mips: self.options.mips.min(STEP_LEVELS - 1), ..self.options };
        let assembly = Assembly { seams: &seams, sampler, validity: self.validity, options };
        let Assembled { texels, problem } = assembly.build(|texel| image.value(texel));
        let flags = self.validity.flags();
        for (&texel, change) in texels.iter().zip(problem.solve(TOLERANCE)) {
            let before = image.value(texel);
            let value = if vectors { of_length(before + change, before) } else { before + change };
            if !value.is_finite() || value == before {
                continue;
            }
            let change = image.write(texel, value).max_element() / range;
            done.texels += usize::from(change > 0.0);
            done.covered_texels += usize::from(change > 0.0 && flags[texel]);
            done.max_change = done.max_change.max(change);
        }
        done.after = steps(&seams, sampler, image, range);
        done
    }
}

/// The RMS steps at each mip level as shares of the range.
fn steps<S: Sample>(
    seams: &[Placed],
    sampler: Sampler,
    image: &Samples<'_, S>,
    range: f64,
) -> [f64; STEP_LEVELS] {
    let value = |texel: usize| image.value(texel);
    std::array::from_fn(|level| rms_step(seams, sampler, level, image.group.count, value) / range)
}

/// A vector scaled to the length of another; that other if it has no direction.
fn of_length(vector: DVec3, other: DVec3) -> DVec3 {
    vector.try_normalize().map_or(other, |unit| unit * other.length())
}

#[cfg(test)]
mod tests;
