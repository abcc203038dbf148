//! How far a level looks from its source with the source's images, and with its own.
//!
//! Both are read at places spread evenly over the level, and held against what the source shows at
//! the place that belongs to each: colors as they are encoded in sRGB, with their alpha, data as it is
//! stored, and directions of shading for normal maps. No mip maps: what is told is what is seen from near by.
//!
//! Where UVs have hardly slid, a place in a thousand has about nine tenths of the squares: those about seams. So
//! if chance may have told which image is better, several times as many places are looked at. A printed
//! box at 25 %, shared and own: 0.00177 and 0.00190 at 50,000 places, 0.00136 and 0.00119 at 200,000, 0.00152 and
//! 0.00124 at 400,000; 4 million samples of the evaluation have 0.00145 and 0.00129.

use glam::{Mat3, Vec3, Vec4};
use rayon::prelude::*;

use super::correspond::LevelPoint;
use super::picture::Picture;
use super::row::{scaled, vector};
use super::shading_mesh::SurfacePoint;
use super::{Job, Reading};
use crate::color::linear_to_srgb;
use crate::role::Role;

/// Places that are looked at in one go.
const CHUNK: usize = 1024;
/// Places are so many times as many where the first leave open which image is better.
const MORE: usize = 4;
/// Standard errors that tell one image from another.
const CLEAR: f64 = 2.0;
/// Nearest places on the rim of two charts, within so many texels, are in the own one. With the fifth of a
/// texel of a transfer that box has 0.00099 and 0.00069 at 400,000 places: what lies across a seam is left out.
const TIE: f32 = 0.002;
/// The golden ratio's fraction and its square's spread places over triangles (Roberts' R2 sequence).
const SPREAD: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053_2];

/// Errors of an image over a level, as root mean squares.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageErrors {
    /// With the source's image, or without any where it has none.
    pub shared: f64,
    /// With each of the level's own.
    pub own: Vec<f64>,
    /// The share of the level that uses it.
    pub share: f64,
}

#[derive(Clone, Default)]
struct Squares {
    shared: f64,
    own: Vec<f64>,
    count: usize,
}

/// The errors of each output of a job at so many places, or at a few times as many if those leave open which
/// is better; `made` has images that it may be, of any size, the one that is most like the source first.
pub fn errors(job: &Job<'_>, made: &[Vec<Picture>], places: usize) -> Vec<ImageErrors> {
    let areas: Vec<f64> =
        job.faces.iter().map(|face| area(job, face.pair, face.triangle)).collect();
    let mut ends = areas;
    let mut sum = 0.0;
    for end in &mut ends {
        sum += *end;
        *end = sum;
    }
    if sum <= 0.0 || made.len() != job.outputs.len() {
        return vec![ImageErrors::default(); job.outputs.len()];
    }
    let texels = job.texels();
    let chunk = |chunk: usize, places: usize| {
        let none =
            |made: &Vec<Picture>| Squares { own: vec![0.0; made.len()], ..Squares::default() };
        let mut squares: Vec<Squares> = made.iter().map(none).collect();
        let mut last = None;
        for place in chunk * CHUNK..((chunk + 1) * CHUNK).min(places) {
            let at = (place as f64 + 0.5) / places as f64 * sum;
            let face = ends.partition_point(|&end| end < at).min(ends.len() - 1);
            look(job, made, (face, texels[face], place), &mut squares, &mut last);
        }
        squares
    };
    let look_at = |places: usize| -> Vec<Vec<Squares>> {
        let chunks = (0..places.div_ceil(CHUNK)).into_par_iter();
        chunks.map(|at| chunk(at, places)).collect()
    };
    let (mut places, mut chunks) = (places, look_at(places));
    if (0..job.outputs.len()).any(|output| is_open(&chunks, output)) {
        places *= MORE;
        chunks = look_at(places);
    }
    let of = |output: usize| {
        let count: usize = chunks.iter().map(|chunk| chunk[output].count).sum();
        let rms = |square: &dyn Fn(&Squares) -> f64| {
            let sum: f64 = chunks.iter().map(|chunk| square(&chunk[output])).sum();
            (sum / count.max(1) as f64).sqrt()
        };
        let own = (0..made[output].len()).map(|at| rms(&|squares| squares.own[at])).collect();
        let share = count as f64 / places.max(1) as f64;
        ImageErrors { shared: rms(&|squares| squares.shared), own, share }
    };
    (0..job.outputs.len()).map(of).collect()
}

/// Whether chance may have told which of the source's image and the first of the level's own is better.
fn is_open(chunks: &[Vec<Squares>], output: usize) -> bool {
    let squares = chunks.iter().map(|chunk| &chunk[output]);
    let off: Vec<f64> = squares.filter_map(|own| Some(own.own.first()? - own.shared)).collect();
    let (count, sum) = (off.len() as f64, off.iter().sum::<f64>());
    let spread: f64 = off.iter().map(|off| (off - sum / count).powi(2)).sum();
    sum.abs() < CLEAR * (spread * count / (count - 1.0).max(1.0)).sqrt()
}

fn area(job: &Job<'_>, pair: u32, triangle: u32) -> f64 {
    let mesh = job.pairs[pair as usize].level.mesh;
    let [a, b, c] = mesh.triangle_positions(triangle as usize);
    (b - a).as_dvec3().cross((c - a).as_dvec3()).length()
}

/// Adds the errors at a place on a face.
fn look(
    job: &Job<'_>,
    made: &[Vec<Picture>],
    (index, texel, place): (usize, f32, usize),
    squares: &mut [Squares],
    last: &mut Option<(u32, SurfacePoint)>,
) {
    let face = &job.faces[index];
    let pair = &job.pairs[face.pair as usize];
    let at = SurfacePoint { triangle: face.triangle as usize, barycentrics: spread(place) };
    let triangle = pair.level.triangle(at.triangle);
    let smooth = triangle.smooth_normal(at.barycentrics).normalize_or_zero();
    let point = LevelPoint {
        position: triangle.position(at.barycentrics),
        smooth,
        plane: triangle.plane,
        group: pair.level.mesh.groups[at.triangle],
        chart: pair.level.charts[at.triangle],
        slide: TIE * texel,
    };
    let guess = last.filter(|last| last.0 == face.pair).map(|last| last.1);
    let Some(there) = pair.source.find(&point, guess) else { return };
    *last = Some((face.pair, there));
    for ((output, made), squares) in job.outputs.iter().zip(made).zip(squares) {
        let Some(reading) = &output.readings[face.reading as usize] else { continue };
        let Reading { picture, uv_set, transform, wrap, .. } = *reading;
        let read = |side: &super::ShadingMesh<'_>, at| {
            let uv = transform.transform_point2(side.uv(at, uv_set));
            picture.map(|picture| picture.near(uv, wrap))
        };
        let truth = read(&pair.source.side, there);
        let shared =
            if uv_set < pair.level.mesh.layout.uv_sets { read(&pair.level, at) } else { truth };
        let uv = face.uv(at.barycentrics);
        let own = made.iter().map(|made| made.near(uv, job.wrap));
        let add = |off: &dyn Fn(Option<Vec4>, f32) -> f64| {
            squares.shared += off(shared, reading.normal_scale).powi(2);
            for (square, own) in squares.own.iter_mut().zip(own) {
                *square += off(Some(own), reading.level_normal_scale).powi(2);
            }
        };
        match output.role {
            Role::Normal => {
                let turn = |frame: Mat3, read: Option<Vec4>, scale: f32| {
                    let read = read.map_or(Vec3::Z, vector);
                    (frame * scaled(read, scale)).normalize_or(smooth)
                };
                let truth = turn(pair.source.side.frame(there), truth, reading.normal_scale);
                let frame = triangle.frame(at.barycentrics);
                add(&|read, scale| {
                    let normal = if read.is_some() { turn(frame, read, scale) } else { smooth };
                    f64::from(normal.angle_between(truth))
                });
            }
            Role::Color => {
                let truth = encoded(truth.unwrap_or(Vec4::ONE));
                add(&|read, _| per_channel(encoded(read.unwrap_or(Vec4::ONE)) - truth));
            }
            Role::Data => {
                let truth = truth.unwrap_or(Vec4::ONE);
                add(&|read, _| per_channel((read.unwrap_or(Vec4::ONE) - truth).with_w(0.0)));
            }
        }
        squares.count += 1;
    }
}

/// Barycentrics of a place: evenly spread over a triangle as places go on.
fn spread(place: usize) -> Vec3 {
    let [mut a, mut b] = SPREAD.map(|step| (0.5 + step * (place + 1) as f64).fract());
    if a + b > 1.0 {
        (a, b) = (1.0 - a, 1.0 - b);
    }
    Vec3::new((1.0 - a - b) as f32, a as f32, b as f32)
}

/// The root of the mean of the squares of three channels; what more there is, alpha, adds to it.
fn per_channel(off: Vec4) -> f64 {
    (f64::from(off.length_squared()) / 3.0).sqrt()
}

/// A color in sRGB by how much of it is seen, and that.
fn encoded(color: Vec4) -> Vec4 {
    let alpha = color.w.clamp(0.0, 1.0);
    let seen = color.truncate().to_array().map(|x| linear_to_srgb(x.clamp(0.0, 1.0)) * alpha);
    Vec3::from(seen).extend(alpha)
}

#[cfg(test)]
mod tests {

    use image::{ColorType, DynamicImage, Rgb, RgbImage, Rgba, RgbaImage};
    use seamwise_attr::{Layout, Mesh, Vertices, weld};

    use super::super::{Face, Output, Pair, ShadingMesh, Source};
    use super::*;
    use crate::wrap::Wrap;

    /// A square whose UVs are its coordinates, moved by `slide`.
    fn square(slide: f32) -> Mesh {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let vertices = Vertices {
            positions: corners.iter().map(|&[x, y]| Vec3::new(x, y, 0.0)).collect(),
            layout: Layout { uv_sets: 1, normal: true, color: 0 },
            attributes: corners.iter().flat_map(|[x, y]| [x + slide, *y, 0.0, 0.0, 1.0]).collect(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            groups: vec![0; 2],
            ..Vertices::default()
        };
        weld(&vertices).expect("a square").mesh
    }

    fn measured(role: Role, picture: Option<&Picture>, made: Picture, slide: f32) -> ImageErrors {
        let (source, level) = (square(0.0), square(slide));
        let side = |mesh| ShadingMesh { mesh, tangents: &[], charts: &[0; 2] };
        let source = Source::new(side(&source));
        let pairs = [Pair { source: &source, level: side(&level) }];
        let face = |triangle: u32| Face {
            pair: 0,
            triangle,
            reading: 0,
            uvs: level.triangles[triangle as usize].map(|wedge| level.uv(wedge, 0)),
        };
        let wrap = [Wrap::Clamp; 2];
        let readings = vec![Some(Reading { picture, wrap, ..Reading::default() })];
        let outputs = [Output { role, color: ColorType::Rgb8, readings }];
        let job = Job {
            pairs: &pairs,
            faces: &[face(0), face(1)],
            size: [64; 2],
            wrap,
            is_in_place: true,
            gained: None,
            outputs: &outputs,
        };
        errors(&job, &[vec![made]], 4000).remove(0)
    }

    /// A ramp of encoded values along u, of `by` over the whole image.
    fn ramp(by: f32) -> DynamicImage {
        let value = |x: u32| (40.0 + by * (x as f32 + 0.5) / 64.0).round() as u8;
        RgbImage::from_fn(64, 64, |x, _| Rgb([value(x), 40, 40])).into()
    }

    #[test]
    fn a_slide_costs_the_gradient_and_an_own_image_what_it_lacks() {
        let picture = |by| Picture::new(&ramp(by), Role::Data).expect("a picture");
        let errors = measured(Role::Data, Some(&picture(128.0)), picture(128.0), 0.1);
        // A tenth of 128 of 255, in one channel of three; clamped near the rim.
        let slid = 0.1 * 128.0 / 255.0 / 3f64.sqrt();
        assert!((errors.shared / slid - 1.0).abs() < 0.06, "{errors:?} {slid}");
        assert_eq!((errors.share, errors.own[0]), (1.0, errors.shared));
        let none = measured(Role::Data, Some(&picture(128.0)), picture(0.0), 0.0);
        // The root of the mean of x² over 0…1.
        let lost = 128.0 / 255.0 / 3.0;
        assert!(none.shared < 1e-6 && (none.own[0] / lost - 1.0).abs() < 0.02, "{none:?} {lost}");
    }

    #[test]
    fn what_few_places_tell_is_told_by_more_of_them() {
        let chunks = |own: &[f64]| -> Vec<Vec<Squares>> {
            let one = |&own: &f64| vec![Squares { shared: 1.0, own: vec![own], count: CHUNK }];
            own.iter().map(one).collect()
        };
        // One chunk of many has all of it; all have a little; none has any.
        let mut few = [1.0; 40];
        few[7] = 30.0;
        assert!(is_open(&chunks(&few), 0));
        assert!(!is_open(&chunks(&[1.1, 1.2].repeat(20)), 0));
        assert!(!is_open(&chunks(&[1.0; 40]), 0));
    }

    #[test]
    fn a_lost_cutout_is_an_error_and_what_is_not_seen_is_none() {
        let texels = |alpha: u8, red: u8| {
            let texels = RgbaImage::from_pixel(4, 4, Rgba([red, 40, 40, alpha]));
            Picture::new(&texels.into(), Role::Color).expect("a picture")
        };
        let hidden = measured(Role::Color, Some(&texels(0, 255)), texels(0, 9), 0.0);
        assert_eq!((hidden.shared, hidden.own[0]), (0.0, 0.0));
        let lost = measured(Role::Color, Some(&texels(0, 40)), texels(255, 40), 0.0);
        assert!(lost.own[0] > 0.5, "{lost:?}");
    }

    #[test]
    fn a_gained_normal_map_is_held_against_plain_shading() {
        let lean: DynamicImage = RgbImage::from_pixel(4, 4, Rgb([128, 128, 255])).into();
        let made = Picture::new(&lean, Role::Normal).expect("a picture");
        let errors = measured(Role::Normal, None, made, 0.0);
        assert!(errors.shared < 1e-3 && errors.own[0] < 0.01, "{errors:?}");
    }
}
