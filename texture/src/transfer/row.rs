//! Rows of texels, each read at its places on the source and averaged.

use glam::{DVec2, Mat3, Vec2, Vec3, Vec4};
use image::{ImageBuffer, Pixel};
use rayon::prelude::*;

use super::correspond::{LevelPoint, SLIDE};
use super::level_face::LevelFace;
use super::owners::Owners;
use super::places::{BLOCK, Places, Wanted};
use super::{Job, Reading};
use crate::role::Role;
use crate::samples::{Coding, Group, Sample};

/// A mapped normal leans away from the level's by less than a right angle, as renderers expect.
const LEAST_UP: f32 = 0.02;

/// A place of the source whose UV is farther from the level's lies in another chart.
const SLID: f32 = 0.05;

/// Of so many texels each way one is looked at for an estimate.
const SPARSE: usize = 8;

/// The input of texels.
pub(super) struct Maker<'a> {
    pub(super) job: &'a Job<'a>,
    /// The owners of the parts of texels.
    pub(super) owners: &'a Owners,
    /// Parts along each side of a texel.
    pub(super) parts: usize,
    /// One per face.
    pub(super) faces: Vec<LevelFace>,
    /// One per face and output.
    pub(super) lods: Vec<f32>,
    /// One per face: the side of a texel on the level.
    pub(super) texels: Vec<f32>,
}

/// Rows that were made.
pub(super) struct Rows {
    /// The rows of each output after the other: linear light and alpha, data as stored, or unit vectors.
    pub(super) values: Vec<Vec4>,
    /// One per value: whether there is one.
    pub(super) made: Vec<bool>,
    /// Those between the source's shading normals and the level's own.
    pub(super) angles: Angles,
}

/// Angles, summed up.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Angles {
    /// Sum of their squares.
    sum: f64,
    count: usize,
}

impl Angles {
    pub(super) fn add(&mut self, other: Self) {
        self.sum += other.sum;
        self.count += other.count;
    }

    /// The root of the mean of the squares, in degrees.
    pub(super) fn degrees_rms(self) -> f64 {
        (self.sum / self.count.max(1) as f64).sqrt().to_degrees()
    }
}

impl Maker<'_> {
    /// About the RMS angle between the shading normals of the source and the level's own, in degrees.
    pub(super) fn degrees_of_some(&self) -> f64 {
        let [width, height] = self.job.size;
        let of_row = |y: usize| {
            let mut sums = vec![Sum::default(); self.job.outputs.len()];
            let mut places = Places::default();
            let mut out = Rows { values: vec![], made: vec![], angles: Angles::default() };
            for x in (SPARSE / 2..width).step_by(SPARSE) {
                let at = [x, y].map(|at| at * self.parts);
                places.begin(at, 0);
                self.add_part(at, &mut sums, &mut places, &mut out);
            }
            out.angles
        };
        let rows = (SPARSE / 2..height).into_par_iter().step_by(SPARSE);
        let mut angles = Angles::default();
        rows.map(of_row).collect::<Vec<_>>().into_iter().for_each(|own| angles.add(own));
        angles.degrees_rms()
    }

    /// Makes [`BLOCK`] rows from row `top` on, or as many as there are, of the first outputs.
    pub(super) fn rows(&self, top: usize, outputs: usize) -> Rows {
        let [width, height] = self.job.size;
        let rows = BLOCK.min(height - top);
        let count = width * rows * outputs;
        let (values, made) = (vec![Vec4::ZERO; count], vec![false; count]);
        let mut out = Rows { values, made, angles: Angles::default() };
        let mut sums = vec![Sum::default(); outputs];
        let mut places = Places::default();
        for left in (0..width).step_by(BLOCK) {
            places.begin([left, top].map(|at| at * self.parts), BLOCK * self.parts);
            for (row, x) in
                (0..rows).flat_map(|row| (left..(left + BLOCK).min(width)).map(move |x| (row, x)))
            {
                sums.fill(Sum::default());
                let corner = [x, top + row].map(|at| at * self.parts);
                for part in 0..self.parts * self.parts {
                    let at = [corner[0] + part % self.parts, corner[1] + part / self.parts];
                    self.add_part(at, &mut sums, &mut places, &mut out);
                }
                for (index, (sum, output)) in sums.iter().zip(self.job.outputs).enumerate() {
                    if sum.parts > 0.0 {
                        let at = (index * rows + row) * width + x;
                        out.values[at] = sum.mean(output.role);
                        out.made[at] = true;
                    }
                }
            }
        }
        out
    }

    /// Finds the places of one part of a texel and adds what every output reads there. Of several each
    /// counts by the area that it shows on the level.
    #[inline]
    fn add_part(&self, at: [usize; 2], sums: &mut [Sum], places: &mut Places, out: &mut Rows) {
        if let Some(face) = self.owners.only(at[0], at[1]) {
            self.add_place(at, (0, face, 1.0), sums, places, out);
            return;
        }
        let area = |face: usize| self.texels[face] * self.texels[face];
        let all: f32 = self.owners.of(at[0], at[1]).map(area).sum();
        for (owner, face) in self.owners.of(at[0], at[1]).enumerate() {
            let share = if all > 0.0 { area(face) / all } else { 1.0 };
            self.add_place(at, (owner, face, share), sums, places, out);
        }
    }

    /// Adds what every output reads at the place of one face, which counts as a share of the part.
    #[inline]
    fn add_place(
        &self,
        at: [usize; 2],
        (owner, index, share): (usize, usize, f32),
        sums: &mut [Sum],
        places: &mut Places,
        out: &mut Rows,
    ) {
        let job = self.job;
        let face = &job.faces[index];
        let pair = &job.pairs[face.pair as usize];
        let level = &self.faces[index];
        let spot = level.placed.find(at);
        let weights = spot.weights;
        let own = weights[0];
        let unit = level.triangle.smooth_normal(own).normalize_or_zero();
        let point = LevelPoint {
            position: level.triangle.position(own),
            smooth: unit,
            plane: level.triangle.plane,
            group: level.group,
            chart: level.chart,
            slide: SLIDE * self.texels[index],
        };
        let center = DVec2::new(at[0] as f64 + 0.5, at[1] as f64 + 0.5);
        let wanted = Wanted { pair: face.pair, owner, face: level, spot, center };
        let Some(there) = places.find(pair, &point, &wanted) else { return };
        let uvs = [face.uv(own), face.uv(weights[1])];
        let step = if job.is_in_place { uvs[1] - uvs[0] } else { Vec2::ZERO };
        let outputs = job.outputs.iter().zip(sums).enumerate();
        for (at, (output, sum)) in outputs {
            let Some(reading) = &output.readings[face.reading as usize] else { continue };
            let lod = self.lods[index * job.outputs.len() + at];
            let colors = || reading.vertex_colors.then(|| pair.source.side.color(there));
            let read = reading.picture.map(|picture| {
                let at = pair.source.side.uv(there, reading.uv_set);
                let at = reading.transform.transform_point2(at);
                // In another chart the way goes elsewhere.
                let is_own = at.distance_squared(uvs[0]) < SLID * SLID;
                picture.read(if is_own { at + step } else { at }, reading.wrap, lod)
            });
            let read = read.or_else(colors);
            match output.role {
                Role::Normal => {
                    let triangle = places.triangle(face.pair, pair, there);
                    let shading = triangle.frame(there.barycentrics)
                        * scaled(read.map_or(Vec3::Z, vector), reading.normal_scale);
                    let shading = shading.normalize_or(unit);
                    out.angles.sum += f64::from(shading.angle_between(unit)).powi(2);
                    out.angles.count += 1;
                    let mapped = into_frame(level.triangle.frame(own), shading);
                    sum.add_vector(scaled(mapped, reading.level_normal_scale.recip()), share);
                }
                Role::Color => sum.add_color(folded(read, reading), share),
                Role::Data => sum.add_data(folded(read, reading), share),
            }
        }
    }
}

/// The color or value that is read, white without an image, with the factor and offset that the
/// source has beside it.
fn folded(read: Option<Vec4>, reading: &Reading<'_>) -> Vec4 {
    read.unwrap_or(Vec4::ONE) * reading.factor + reading.offset
}

/// The vector that a texel of a normal map stands for.
pub(super) fn vector(texel: Vec4) -> Vec3 {
    texel.truncate() * 2.0 - 1.0
}

/// A normal of a map whose x and y have a factor.
pub(super) fn scaled(normal: Vec3, scale: f32) -> Vec3 {
    if scale.is_finite() { normal * Vec3::new(scale, scale, 1.0) } else { normal }
}

/// A direction in a tangent frame, leaning away from its normal by less than a right angle; the flat
/// normal where there is no frame.
fn into_frame(frame: Mat3, direction: Vec3) -> Vec3 {
    // The inverse but for a factor: its rows are the cross products of the columns.
    let cofactors = Mat3::from_cols(
        frame.y_axis.cross(frame.z_axis),
        frame.z_axis.cross(frame.x_axis),
        frame.x_axis.cross(frame.y_axis),
    );
    let volume = frame.x_axis.dot(cofactors.x_axis);
    let mapped = cofactors.transpose() * direction * volume.signum();
    let mapped = mapped.normalize_or_zero();
    if volume == 0.0 || mapped == Vec3::ZERO {
        return Vec3::Z;
    }
    Vec3::new(mapped.x, mapped.y, mapped.z.max(LEAST_UP)).normalize()
}

/// A texel in the making: the sum over its parts.
#[derive(Clone, Copy, Default)]
struct Sum {
    /// Sum of values; of colors, with alpha in place.
    all: Vec4,
    /// Sum of colors times alpha.
    seen: Vec3,
    parts: f32,
}

impl Sum {
    fn add_color(&mut self, color: Vec4, share: f32) {
        self.seen += color.truncate() * color.w * share;
        self.add_data(color, share);
    }

    fn add_data(&mut self, value: Vec4, share: f32) {
        self.all += value * share;
        self.parts += share;
    }

    fn add_vector(&mut self, vector: Vec3, share: f32) {
        self.add_data(vector.extend(0.0), share);
    }

    /// The mean over the parts: of colors by how much they are seen, of vectors made unit.
    fn mean(&self, role: Role) -> Vec4 {
        if self.parts == 0.0 {
            return Vec4::ZERO;
        }
        let mean = self.all / self.parts;
        match role {
            Role::Normal => mean.truncate().normalize_or(Vec3::Z).extend(1.0),
            Role::Color if self.all.w > 0.0 => (self.seen / self.all.w).extend(mean.w),
            Role::Color | Role::Data => mean,
        }
    }
}

/// Writes rows of values into an image, from row `first` on.
pub(super) fn write<P>(
    image: &mut ImageBuffer<P, Vec<P::Subpixel>>,
    role: Role,
    first: usize,
    rows: &[&[Vec4]],
) where
    P: Pixel,
    P::Subpixel: Sample,
{
    let stride = P::CHANNEL_COUNT as usize;
    let (color, alpha) = Group::of(role, stride);
    let width = image.width() as usize * stride;
    let samples: &mut [P::Subpixel] = image;
    let from = samples[first * width..].par_chunks_exact_mut(width.max(1));
    from.zip(rows).for_each(|(samples, row)| {
        for (texel, value) in samples.chunks_exact_mut(stride).zip(*row) {
            let channels = value.to_array();
            for (sample, value) in texel[..color.count].iter_mut().zip(channels) {
                *sample = Sample::encode(value, color.coding);
            }
            if let Some(alpha) = alpha {
                texel[alpha.first] = Sample::encode(value.w, Coding::Linear);
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_comes_back_from_any_frame() {
        let normal = Vec3::new(0.1, -0.2, 0.9);
        let tangent = Vec3::new(0.8, 0.3, 0.2);
        for sign in [1.0, -1.0] {
            let frame = Mat3::from_cols(tangent, normal.cross(tangent) * sign, normal);
            let direction = Vec3::new(0.4, 0.3, 0.8).normalize();
            let mapped = into_frame(frame, direction);
            assert!((frame * mapped).normalize().distance(direction) < 1e-6);
        }
    }

    #[test]
    fn factors_are_folded_into_what_is_read_and_stand_alone_without_an_image() {
        let (factor, offset) = (Vec4::new(0.5, 1.0, 0.0, 0.0), Vec4::new(0.5, 0.0, 0.25, 1.0));
        let reading = Reading { factor, offset, ..Reading::default() };
        let read = Some(Vec4::new(0.5, 0.25, 0.9, 0.1));
        assert_eq!(folded(read, &reading), Vec4::new(0.75, 0.25, 0.25, 1.0));
        assert_eq!(folded(None, &reading), Vec4::new(1.0, 1.0, 0.25, 1.0));
    }

    #[test]
    fn without_a_frame_the_normal_is_flat_and_none_points_inward() {
        assert_eq!(into_frame(Mat3::ZERO, Vec3::X), Vec3::Z);
        assert!(into_frame(Mat3::IDENTITY, Vec3::new(1.0, 0.0, -1.0).normalize()).z > 0.0);
    }

    #[test]
    fn the_unseen_part_of_a_texel_lends_no_color() {
        let mut sum = Sum::default();
        sum.add_color(Vec4::new(0.5, 0.0, 0.0, 1.0), 1.0);
        sum.add_color(Vec4::new(0.0, 1.0, 0.0, 0.0), 1.0);
        assert_eq!(sum.mean(Role::Color), Vec4::new(0.5, 0.0, 0.0, 0.5));
        assert_eq!(Sum::default().mean(Role::Color), Vec4::ZERO);
    }
}
