//! What a level has lost of its source's shape, and which side its pictures come from.

use std::f32::consts::{PI, TAU};

use crate::common::build::Build;
use crate::common::output::{Output, Part};
use crate::common::shapes::{self, Shape};
use crate::common::textured::covered_texels;
use crate::common::{Baked, transferred};
use glam::Vec3;
use image::{DynamicImage, RgbImage};
use seamwise::bake::options::BakeOptions;
use seamwise::evaluate;
use seamwise::transfer::BakeNormals;
use serde_json::json;

/// A sphere of bumps, with the normals that they have.
fn bumpy_sphere(segments: u32, rings: u32) -> Shape {
    let radius =
        |d: Vec3| 1.0 + 0.012 * (20.0 * d.x).sin() * (22.0 * d.y).sin() * (18.0 * d.z).cos();
    let on = |d: Vec3| d.normalize() * radius(d.normalize());
    let mut shape = shapes::sphere(segments, rings);
    for (position, normal) in shape.positions.iter_mut().zip(&mut shape.normals) {
        let d = Vec3::from(*position);
        let (a, b) = d.any_orthonormal_pair();
        let slope = |way: Vec3| on(d + way * 1e-3) - on(d - way * 1e-3);
        *normal = slope(a).cross(slope(b)).normalize().to_array();
        *position = on(d).to_array();
    }
    shape
}

#[test]
fn a_level_of_few_triangles_shows_the_bumps_that_it_has_lost() {
    let mut build = Build::new();
    let gray = RgbImage::from_pixel(512, 512, image::Rgb([128; 3])).into();
    let texture = build.texture(&gray, json!({}));
    let material = build.painted(texture);
    build.add_shape(&bumpy_sphere(200, 100), material);
    let bytes = build.glb();
    let degrees = [BakeNormals::Off, BakeNormals::Auto].map(|bake_normals| {
        let measure = evaluate::Options {
            views: 4,
            resolution: 64,
            samples: 50_000,
            pixel_tolerance: 1.0,
            screen_height: 128,
        };
        let options =
            BakeOptions { evaluate: Some(measure), ..transferred(&[0.01], 1.0, bake_normals) };
        let baked = Baked::bytes("bumpy", &bytes, &options);
        assert!(baked.report.levels[0].triangles < 420);
        let gained = baked.level(1).gltf.materials().all(|own| own.normal_texture().is_some());
        assert_eq!(gained, bake_normals == BakeNormals::Auto);
        baked.report.levels[0].metrics.unwrap().normal_degrees_rms
    });
    let [off, baked] = degrees;
    assert!(baked <= 0.4 * off, "{baked:.2}° of {off:.2}° are left, {:.3} of them", baked / off);
}

/// The wall of the cup, and the distance of the sheet's sides, in units of their size.
const THIN: f32 = 0.004;

/// A color that tells of two numbers in 0…1, and on which side it is.
fn painted(a: f32, b: f32, side: u8) -> [u8; 3] {
    [(255.0 * a).round() as u8, (255.0 * b).round() as u8, side]
}

/// What the picture of both shapes shows at a UV: the left half belongs to one side, the right one to
/// the other.
fn two_sided_picture(size: u32) -> DynamicImage {
    let texel = |x: u32, y: u32| {
        let [u, v] = [x, y].map(|at| (at as f32 + 0.5) / size as f32);
        let (u, side) = if u < 0.5 { (2.0 * u, 255) } else { (2.0 * u - 1.0, 0) };
        // There and back, so that it has no edge where the angle starts anew.
        image::Rgb(painted((2.0 * u - 1.0).abs(), v, side))
    };
    RgbImage::from_fn(size, size, texel).into()
}

/// A grid of points, all of which lie on one side: its UVs fill the left half of the picture or the
/// right one.
fn side(
    shape: &mut Shape,
    [columns, rows]: [u32; 2],
    right: bool,
    at: impl Fn(f32, f32) -> [Vec3; 2],
) {
    let first = shape.positions.len() as u32;
    for row in 0..=rows {
        for column in 0..=columns {
            let (u, v) = (column as f32 / columns as f32, row as f32 / rows as f32);
            let [position, normal] = at(u, v);
            shape.positions.push(position.to_array());
            shape.normals.push(normal.to_array());
            let half = if right { 0.5 } else { 0.0 };
            shape.uvs.push([half + 0.05 + 0.4 * u, 0.1 + 0.8 * v]);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = first + row * (columns + 1) + column;
            let (b, c, d) = (a + 1, a + columns + 1, a + columns + 2);
            for [a, b, c] in [[a, b, d], [a, d, c]] {
                shape.triangles.push(if right { [a, c, b] } else { [a, b, c] });
            }
        }
    }
}

/// A cup without a foot: an outer and an inner wall that meet at its rims.
fn cup() -> Shape {
    let mut shape = Shape::default();
    let wall = |radius: f32| {
        move |u: f32, v: f32| {
            let (sin, cos) = if u == 1.0 { (0.0, 1.0) } else { (TAU * u).sin_cos() };
            let out = Vec3::new(cos, 0.0, sin);
            let radius = if v == 0.0 || v == 1.0 { 1.0 - THIN / 2.0 } else { radius };
            [
                out * radius + Vec3::Y * (2.0 * v - 1.0),
                if radius < 1.0 - THIN / 2.0 { -out } else { out },
            ]
        }
    };
    side(&mut shape, [96, 32], false, wall(1.0));
    side(&mut shape, [96, 32], true, wall(1.0 - THIN));
    shape
}

/// A waved sheet of two sides that meet at its border.
fn sheet() -> Shape {
    let mut shape = Shape::default();
    let of = |apart: f32| {
        move |u: f32, v: f32| {
            let is_border = [u, v].iter().any(|&at| at == 0.0 || at == 1.0);
            let (x, z) = (2.0 * u - 1.0, 2.0 * v - 1.0);
            let y = 0.1 * (2.0 * PI * x).sin() * (2.0 * PI * z).cos();
            let slope = Vec3::new(
                -0.2 * PI * (2.0 * PI * x).cos() * (2.0 * PI * z).cos(),
                1.0,
                0.2 * PI * (2.0 * PI * x).sin() * (2.0 * PI * z).sin(),
            );
            let way = apart.signum();
            let apart = if is_border { 0.0 } else { apart };
            [Vec3::new(x, y + apart, z), slope.normalize() * way]
        }
    };
    side(&mut shape, [48, 48], true, of(THIN / 2.0));
    side(&mut shape, [48, 48], false, of(-THIN / 2.0));
    shape
}

/// How the texels of a level's picture differ from what they should show: the share on the wrong side,
/// and the RMS error in the two numbers that they tell, 0…1.
fn wrong_side_and_error(output: &Output, at: impl Fn(Vec3) -> [f32; 2]) -> (f64, f64) {
    let picture = output.picture(0).to_rgb8();
    let part: Part = output.parts(0).remove(0);
    let uvs: Vec<[f32; 2]> = part.uvs.iter().map(|uv| [uv[0], uv[1]]).collect();
    let (mut wrong, mut squares, mut all) = (0.0, 0.0, 0.0);
    for ([x, y], triangle, weights) in
        covered_texels(&uvs, &part.triangles, [picture.width(), picture.height()])
    {
        let corners = part.triangles[triangle];
        let point: Vec3 = (0..3)
            .map(|k| Vec3::from(part.positions[corners[k] as usize]) * weights[k] as f32)
            .sum();
        let [a, b, side] = picture.get_pixel(x, y).0;
        let expected = at(point);
        let is_left = corners.iter().map(|&vertex| uvs[vertex as usize][0]).sum::<f32>() < 1.5;
        wrong += f64::from(u8::from((side > 127) != is_left));
        for (told, expected) in [a, b].into_iter().zip(expected) {
            squares += f64::from(f32::from(told) / 255.0 - expected).powi(2);
        }
        all += 1.0;
    }
    (wrong / all, (squares / all).sqrt())
}

/// Bakes a shape in the picture of two sides and keeps to what both its levels must show.
fn assert_sides_kept(name: &str, shape: &Shape, at: impl Fn(Vec3) -> [f32; 2]) {
    let mut build = Build::new();
    let texture = build.texture(&two_sided_picture(512), json!({"wrapS": 33071, "wrapT": 33071}));
    let material = build.painted(texture);
    build.add_shape(shape, material);
    let measure = evaluate::Options {
        views: 1,
        resolution: 64,
        samples: 50_000,
        pixel_tolerance: 1.0,
        screen_height: 128,
    };
    let options = BakeOptions {
        evaluate: Some(measure),
        ..transferred(&[0.05, 0.01], 0.5, BakeNormals::Auto)
    };
    let baked = Baked::bytes(name, &build.glb(), &options);
    for (level, report) in baked.report.levels.iter().enumerate() {
        let (wrong, error) = wrong_side_and_error(&baked.level(level + 1), &at);
        // The diagonals of both are about 3.
        let moved = report.metrics.unwrap().distance_max * 3.0;
        assert!(level == 0 || moved > f64::from(THIN), "{name}: the level is too good: {moved}");
        assert!(
            wrong == 0.0,
            "{name}, level {}: {wrong} of the texels are of the other side",
            level + 1
        );
        assert!(error < 0.03, "{name}, level {}: texels are off by {error}", level + 1);
    }
}

#[test]
fn the_inside_and_the_outside_of_a_cup_keep_their_pictures() {
    assert_sides_kept("cup", &cup(), |p| {
        let turn = p.z.atan2(p.x).rem_euclid(TAU) / TAU;
        [(2.0 * (0.1 + 0.8 * turn) - 1.0).abs(), 0.1 + 0.8 * (0.5 + 0.5 * p.y)]
    });
}

#[test]
fn both_sides_of_a_sheet_keep_their_pictures() {
    assert_sides_kept("sheet", &sheet(), |p| {
        let [u, v] = [p.x, p.z].map(|at| 0.1 + 0.8 * (0.5 + 0.5 * at));
        [(2.0 * u - 1.0).abs(), v]
    });
}
