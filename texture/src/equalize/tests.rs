use super::*;
use glam::{Mat3, Vec2};

const CLAMP: [Wrap; 2] = [Wrap::Clamp; 2];

/// Two charts of 12 × 24 texels in an image of 48 × 32, at x = 4…16 and 28…40; the second a bit
/// brighter. What lies around them has the value of the nearer.
fn charts() -> (DynamicImage, Validity) {
    let gray =
        |x: u32, y: u32| image::Luma([60 + 2 * (y % 16) as u8 + if x < 22 { 0 } else { 40 }]);
    let covered = |at: usize| {
        let (x, y) = (at % 48, at / 48);
        (4..28).contains(&y) && ((4..16).contains(&x) || (28..40).contains(&x))
    };
    let image = image::GrayImage::from_fn(48, 32, gray);
    let flags = (0..48 * 32).map(covered).collect();
    (image.into(), Validity::from_flags(48, 32, flags))
}

/// A seam between two segments, in texels of that image.
fn seam(a: [[f32; 2]; 2], b: [[f32; 2]; 2]) -> Seam {
    let uv = |[x, y]: [f32; 2]| Vec2::new(x / 48.0, y / 32.0);
    Seam { sides: [a.map(uv), b.map(uv)], turns: None }
}

fn right_to_left() -> Seam {
    seam([[16.0, 4.0], [16.0, 28.0]], [[28.0, 4.0], [28.0, 28.0]])
}

fn run(
    image: &mut DynamicImage,
    validity: &Validity,
    wrap: [Wrap; 2],
    seams: &[Seam],
) -> Equalized {
    equalize(image, Role::Data, validity, wrap, seams, Options::default()).unwrap()
}

#[test]
fn two_charts_become_continuous_and_all_else_keeps_its_bits() {
    let (before, validity) = charts();
    let mut after = before.clone();
    let done = run(&mut after, &validity, CLAMP, &[right_to_left()]);
    assert!((done.before[0] - 40.0 / 255.0).abs() < 1e-3, "{done:?}");
    for level in 0..=2 {
        assert!(done.after[level] < 0.1 * done.before[level], "{done:?}");
    }
    let [before, after] = [before.to_luma8(), after.to_luma8()];
    let changed: Vec<_> = before
        .enumerate_pixels()
        .filter(|(x, y, texel)| *texel != after.get_pixel(*x, *y))
        .collect();
    assert_eq!(changed.len(), done.texels);
    assert!(done.texels > 0 && done.covered_texels < done.texels);
    for (x, y, _) in changed {
        let valid = validity.is_valid(x as usize, y as usize);
        // Covered ones next to the seam, others as far as a tap of mip level 2 reaches.
        let reach = if valid { 1.0 } else { 8.0 };
        let near = [16.0, 28.0].iter().any(|seam| (x as f32 + 0.5 - seam).abs() < reach);
        assert!(near, "{x} {y}");
        let value = after.get_pixel(x, y).0[0];
        assert!((60..=130).contains(&value), "within the values around it: {value}");
    }
}

#[test]
fn seams_may_be_mirrored_rotated_and_of_other_lengths() {
    for other in
        [[[28.0, 28.0], [28.0, 4.0]], [[28.0, 4.0], [40.0, 4.0]], [[38.0, 27.0], [29.0, 6.0]]]
    {
        let (mut image, validity) = charts();
        let done = run(&mut image, &validity, CLAMP, &[seam([[16.0, 4.0], [16.0, 28.0]], other)]);
        assert!(done.seams == 1 && done.after[0] < 0.3 * done.before[0], "{other:?} {done:?}");
    }
}

#[test]
fn a_seam_across_the_border_moves_texels_on_both_sides_of_it() {
    let (mut image, validity) = charts();
    let wrap = [Wrap::Repeat; 2];
    let done = run(
        &mut image,
        &validity,
        wrap,
        &[seam([[0.0, 4.0], [0.0, 20.0]], [[24.0, 4.0], [24.0, 20.0]])],
    );
    assert!(done.after[0] < 0.3 * done.before[0], "{done:?}");
    let (before, after) = (charts().0.to_luma8(), image.to_luma8());
    let differs = |x| before.get_pixel(x, 10) != after.get_pixel(x, 10);
    assert!(differs(0) || differs(47));
}

#[test]
fn odd_seams_are_left_out_or_do_no_harm() {
    let far = 1e30;
    let odd = [
        seam([[16.0, 4.0], [16.0, 4.0]], [[28.0, 4.0], [28.0, 4.0]]),
        seam([[f32::NAN, 4.0], [16.0, 4.0]], [[28.0, 4.0], [28.0, 8.0]]),
        seam([[far, far], [16.0, 4.0]], [[28.0, 4.0], [28.0, 8.0]]),
        seam([[0.0, 0.0], [1e6, 0.0]], [[28.0, 4.0], [28.0, 8.0]]),
    ];
    let (mut image, validity) = charts();
    let done = run(&mut image, &validity, CLAMP, &odd);
    assert!(done.seams == 0 && image == charts().0, "{done:?}");
    // One side without extent, and both in one place.
    let (mut image, validity) = charts();
    let point = seam([[16.0, 4.0], [16.0, 4.0]], [[28.0, 4.0], [28.0, 8.0]]);
    let same = seam([[10.0, 4.0], [10.0, 9.0]], [[10.0, 9.0], [10.0, 4.0]]);
    assert_eq!(run(&mut image, &validity, CLAMP, &[point, same]).seams, 2);
    let none = Validity::from_flags(0, 0, Vec::new());
    assert!(equalize(&mut image, Role::Color, &none, CLAMP, &[point], Options::default()).is_err());
    let mut empty = DynamicImage::new_luma8(0, 0);
    equalize(&mut empty, Role::Color, &none, CLAMP, &[point], Options::default()).unwrap();
}

#[test]
fn what_is_no_number_stays_and_its_neighbors_are_solved_for() {
    let mut values = vec![0.25; 48 * 32];
    values[48 * 10 + 16] = f32::NAN;
    for at in (0..values.len()).filter(|at| at % 48 > 22) {
        values[at] = 0.5;
    }
    let mut plane = Plane::from_vec(48, 32, 1, values);
    let (_, validity) = charts();
    let seams = [right_to_left()];
    let done = equalize_plane(&mut plane, &validity, CLAMP, &seams, Options::default()).unwrap();
    assert!(done.after[0] < 0.1 * done.before[0], "{done:?}");
    assert_eq!(plane.data().iter().filter(|value| value.is_nan()).count(), 1);
}

#[test]
fn the_result_is_the_same_on_any_number_of_threads() {
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (mut image, validity) = charts();
        let seams =
            [right_to_left(), seam([[4.0, 4.0], [16.0, 4.0]], [[28.0, 28.0], [40.0, 27.0]])];
        let done = pool.install(|| run(&mut image, &validity, CLAMP, &seams));
        (image, done)
    };
    let one = on(1);
    assert!(one == on(2) && one == on(5));
}

/// The right side's tangents are turned by 90°: what leans to +x on the left leans to +y there.
#[test]
fn normals_are_compared_in_one_frame_and_keep_their_lengths() {
    let (_, validity) = charts();
    let leaning = |x: u32, _| image::Rgb(if x < 22 { [190u8, 128, 238] } else { [128, 190, 238] });
    let mut image = DynamicImage::from(image::RgbImage::from_fn(48, 32, leaning));
    let flat = image.clone();
    let turned =
        |angle: f32| Seam { turns: Some([Mat3::from_rotation_z(angle); 2]), ..right_to_left() };
    let mut apply = |seam| {
        equalize(&mut image, Role::Normal, &validity, CLAMP, &[seam], Options::default()).unwrap()
    };
    assert_eq!(apply(right_to_left()).seams, 0);
    let right_angle = std::f32::consts::FRAC_PI_2;
    let done = apply(turned(-right_angle));
    // Bytes have no 0: a flat component is 0.004, on either side of it.
    assert!(done.before[0] < 0.003, "{done:?}");
    let done = apply(turned(0.0));
    assert!(done.before[0] > 0.15 && done.after[0] < 0.3 * done.before[0], "{done:?}");
    let length = |image: &DynamicImage, x, y| {
        let vector = image.to_rgb8().get_pixel(x, y).0.map(|v| f32::from(v) / 127.5 - 1.0);
        vector.iter().map(|v| v * v).sum::<f32>().sqrt()
    };
    for x in 14..31 {
        assert!((length(&image, x, 12) - length(&flat, x, 12)).abs() < 0.01);
    }
}

#[test]
fn alpha_stays() {
    let (gray, validity) = charts();
    let mut image = DynamicImage::from(gray.to_luma_alpha8());
    for (x, y, texel) in image.as_mut_luma_alpha8().unwrap().enumerate_pixels_mut() {
        texel.0[1] = (x * 5 + y) as u8;
    }
    run(&mut image, &validity, CLAMP, &[right_to_left()]);
    let texels = image.to_luma_alpha8();
    assert!(texels.enumerate_pixels().all(|(x, y, texel)| texel.0[1] == (x * 5 + y) as u8));
}
