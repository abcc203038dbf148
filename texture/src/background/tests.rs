use super::*;
use image::{Luma, Rgb, RgbImage};

const MAGENTA: [f32; 4] = [1.0, 0.0, 1.0, 1.0];
const BLACK: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// A red chart of 12 × 12 on magenta 32 × 32, its rim half covered, one magenta texel within.
fn atlas() -> DynamicImage {
    DynamicImage::ImageRgb8(RgbImage::from_fn(32, 32, |x, y| {
        let at = |low, high| (low..high).contains(&x) && (low..high).contains(&y);
        match (x, y) {
            (15, 15) => Rgb([255, 0, 255]),
            _ if at(11, 21) => Rgb([255, 0, 0]),
            _ if at(10, 22) => Rgb([255, 0, 128]),
            _ => Rgb([255, 0, 255]),
        }
    }))
}

#[test]
fn the_rim_is_trimmed_and_content_stays() {
    let validity = Background::of_colors(&atlas(), &[MAGENTA], 0.0).validity();
    let inside = |v: usize| (11..21).contains(&v);
    for y in 0..32 {
        for x in 0..32 {
            assert_eq!(validity.is_valid(x, y), inside(x) && inside(y), "{x} {y}");
        }
    }
}

#[test]
fn a_large_gap_between_charts_is_background_although_it_reaches_no_border() {
    let ring = |gap: u32| {
        let image = RgbImage::from_fn(24, 24, |x, y| {
            let hole = (8..8 + gap).contains(&x) && (8..8 + gap).contains(&y);
            if hole { Rgb([255, 0, 255]) } else { Rgb([9, 9, 9]) }
        });
        Background::of_colors(&image.into(), &[MAGENTA], 0.01).validity().invalid()
    };
    assert_eq!(ring(7), 0);
    assert_eq!(ring(8), 100);
}

/// A lightmap of 48²: a chart of 20² texels of light 0.5, black around it but for squares of so
/// many texels and so much light, one after the other below the chart.
fn lightmap(squares: &[(u32, f32)]) -> DynamicImage {
    DynamicImage::ImageRgb32F(image::Rgb32FImage::from_fn(48, 48, |x, y| {
        let light = match (x, y) {
            (3..23, 3..23) => 0.5,
            _ => {
                let square = squares.get(x as usize / 12);
                let inside = |side| y >= 30 && y < 30 + side && x % 12 >= 1 && x % 12 < 1 + side;
                square.filter(|(side, _)| inside(*side)).map_or(0.0, |(_, light)| *light)
            }
        };
        Rgb([light; 3])
    }))
}

#[test]
fn fireflies_between_charts_are_never_valid() {
    let valid = |squares: &[(u32, f32)]| {
        let image = lightmap(squares);
        let validity = Background::detect(&image, 0.0).unwrap().validity();
        (24..48 * 48).filter(|texel| texel / 48 >= 24 && validity.flags()[*texel]).count()
    };
    // Trimmed by a texel on each side.
    assert_eq!(valid(&[(1, 65024.0), (2, 65024.0), (3, 65024.0), (4, 65024.0)]), 0);
    assert_eq!(valid(&[(3, 0.5), (4, 0.5)]), 0, "specks");
    assert_eq!(valid(&[(6, 0.5), (6, 9.9)]), 2 * 16, "small charts");
    assert_eq!(valid(&[(6, 10.1), (9, 65024.0)]), 0);
    // A chart of its own is as bright as it is.
    assert_eq!(valid(&[(10, 65024.0)]), 64);
}

#[test]
fn what_is_no_number_between_charts_joins_no_firefly_to_them() {
    let mut image = lightmap(&[(4, 0.0)]).into_rgb32f();
    let before = Background::of_colors(&image.clone().into(), &[BLACK], 0.0).validity();
    // A bridge from the chart to a firefly of 3 × 3.
    (23..40).for_each(|y| (10..13).for_each(|x| image.put_pixel(x, y, Rgb([f32::NAN; 3]))));
    (36..39).for_each(|y| (10..13).for_each(|x| image.put_pixel(x, y, Rgb([6e4; 3]))));
    let after = Background::of_colors(&image.into(), &[BLACK], 0.0).validity();
    assert_eq!(before, after);
}

fn colors(image: &DynamicImage) -> Option<Vec<[f32; 4]>> {
    Background::detect(image, 0.0).map(|found| found.colors().to_vec())
}

#[test]
fn the_background_is_found_only_if_there_is_one() {
    assert_eq!(colors(&atlas()), Some(vec![MAGENTA]));
    assert_eq!(colors(&RgbImage::from_pixel(9, 9, Rgb([1, 2, 3])).into()), None);
    let gradient = image::GrayImage::from_fn(64, 64, |x, y| Luma([(x * 2 + y) as u8]));
    assert_eq!(colors(&gradient.into()), None);
    for size in [[0, 0], [0, 3], [1, 1], [1, 7], [2, 2]] {
        assert_eq!(colors(&DynamicImage::new_rgb8(size[0], size[1])), None);
    }
}

/// Numbers that look like chance and are the same on every run.
fn chance(x: u32, y: u32, seed: u32) -> u32 {
    let mut v =
        x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77) ^ seed.wrapping_mul(0xc2b2_ae3d);
    v = (v ^ (v >> 15)).wrapping_mul(0x2c1b_3c6d);
    v = (v ^ (v >> 12)).wrapping_mul(0x297a_2d39);
    v ^ (v >> 15)
}

/// Whether a texel of an atlas of 128² lies in one of its charts: discs, a slanted one, and one that
/// touches the border.
fn in_chart(x: u32, y: u32) -> bool {
    let disc = |cx: i32, cy: i32, r: i32| (x as i32 - cx).pow(2) + (y as i32 - cy).pow(2) < r * r;
    let slanted = (70..120).contains(&y) && (x + y / 3).abs_diff(50) < 18;
    disc(30, 32, 22) || disc(92, 30, 25) || slanted || disc(127, 96, 25)
}

/// The content of charts: waves and grain of muted colors.
fn content(x: u32, y: u32) -> [u8; 3] {
    let wave = |v: u32, k: f32| 40.0 * (v as f32 * k).sin();
    let noise = (chance(x, y, 7) % 17) as f32;
    [120.0 + wave(x, 0.2) + noise, 110.0 + wave(y, 0.3), 90.0 + wave(x + y, 0.1) + noise]
        .map(|v| v as u8)
}

fn atlas_on(background: impl Fn(u32, u32) -> [u8; 3]) -> DynamicImage {
    let texel = |x, y| if in_chart(x, y) { content(x, y) } else { background(x, y) };
    RgbImage::from_fn(128, 128, |x, y| Rgb(texel(x, y))).into()
}

/// Asserts that a background is found where no chart is, and returns how many colors it has. `rims`
/// allows charts to lose their outermost texels.
fn assert_found(name: &str, image: &DynamicImage, rims: bool) -> usize {
    let found = Background::detect(image, 0.5 / 255.0).unwrap_or_else(|| panic!("{name}: none"));
    let validity = found.validity();
    let charts = Validity::from_flags(
        128,
        128,
        (0..128 * 128).map(|texel| in_chart(texel % 128, texel / 128)).collect(),
    );
    let least = if rims { charts.without_rims() } else { charts.clone() };
    for (texel, &valid) in validity.flags().iter().enumerate() {
        let [x, y] = [texel % 128, texel / 128];
        assert!(!valid || charts.flags()[texel], "{name}: background at {x} {y} is valid");
        assert!(valid || !least.flags()[texel], "{name}: {x} {y} is lost");
    }
    assert!(rims || !found.is_blended(), "{name}");
    found.colors().len()
}

const PALE: [[u8; 3]; 6] =
    [[250, 240, 230], [230, 250, 240], [240, 230, 250], [220, 220, 250], [250, 220, 220], [200; 3]];

#[test]
fn backgrounds_of_one_color_and_of_several_are_found() {
    let of = |background: &dyn Fn(u32, u32) -> [u8; 3]| atlas_on(background);
    assert_eq!(assert_found("black", &of(&|_, _| [0; 3]), false), 1);
    let checkers = |side: u32, a: [u8; 3], b: [u8; 3]| {
        move |x: u32, y: u32| if (x / side + y / side).is_multiple_of(2) { a } else { b }
    };
    for side in [1, 4, 8, 16] {
        let name = format!("checkers of {side}");
        let image = of(&checkers(side, [255, 0, 255], [0, 255, 0]));
        assert_eq!(assert_found(&name, &image, false), 2);
        let image = of(&checkers(side, [255; 3], [204; 3]));
        assert_eq!(assert_found(&name, &image, false), 2);
    }
    let four = of(&|x, y| PALE[(x / 8 % 2 + 2 * (y / 8 % 2)) as usize]);
    assert_eq!(assert_found("four colors", &four, false), 4);
    let mottled = of(&|x, y| PALE[chance(x / 5, y / 5, 1) as usize % 6]);
    assert_eq!(assert_found("mottled", &mottled, false), 6);
    let halves = of(&|x, _| if x < 64 { [0; 3] } else { [255; 3] });
    assert_eq!(assert_found("halves", &halves, false), 2);
}

#[test]
fn a_grain_over_the_background_is_of_it() {
    for most in [2u8, 6, 11] {
        let grain = |v: u8, x, y, k| v - most + (chance(x, y, k) % (2 * u32::from(most) + 1)) as u8;
        let image = atlas_on(|x, y| [0, 1, 2].map(|k| grain(230, x, y, k)));
        assert_eq!(assert_found(&format!("grain of {most}"), &image, true), 1);
    }
}

#[test]
fn rims_are_trimmed_where_they_are_blended_and_only_there() {
    let coverage = |x: u32, y: u32| {
        let part = |v: u32, k: u32| v as f32 + (k as f32 + 0.5) / 4.0;
        let inside = |u: f32, v: f32| (u - 64.0).hypot(v - 64.0) < 40.0;
        let parts = (0..16).filter(|k| inside(part(x, k % 4), part(y, k / 4)));
        parts.count() as f32 / 16.0
    };
    let image = |smooth: bool| -> DynamicImage {
        RgbImage::from_fn(128, 128, |x, y| {
            let share = coverage(x, y);
            let share = if smooth { share } else { share.ceil() };
            let mix = |own: u8| (share * f32::from(own) + (1.0 - share) * 255.0) as u8;
            Rgb(content(x, y).map(mix))
        })
        .into()
    };
    let smooth = Background::detect(&image(true), 0.0).unwrap();
    let hard = Background::detect(&image(false), 0.0).unwrap();
    assert!(smooth.is_blended() && !hard.is_blended());
    for (texel, &valid) in smooth.validity().flags().iter().enumerate() {
        assert!(!valid || coverage(texel as u32 % 128, texel as u32 / 128) == 1.0, "{texel}");
    }
    assert_eq!(hard.validity(), *hard.charts());
}

/// The color of a texel.
type Texel<'a> = dyn Fn(u32, u32) -> [u8; 3] + 'a;

/// Hills of light: a few waves.
fn hills(x: u32, y: u32) -> f32 {
    let wave = |k: f32| (x as f32 * 0.031 * k + y as f32 * 0.017 * k * k).sin() / k;
    [1.0, 1.7, 2.9, 5.3].map(wave).iter().sum()
}

#[test]
fn pictures_that_are_no_atlas_and_atlases_that_are_full_have_no_background() {
    let image = |texel: &dyn Fn(u32, u32) -> [u8; 3]| -> DynamicImage {
        RgbImage::from_fn(128, 128, |x, y| Rgb(texel(x, y))).into()
    };
    let gray = |light: f32| [light.clamp(0.0, 255.0) as u8; 3];
    let cases: [(&str, &Texel<'_>); 10] = [
        ("noise", &|x, y| [0, 1, 2].map(|k| chance(x, y, k) as u8)),
        ("a gradient", &|x, y| [2 * x as u8, 2 * y as u8, 80]),
        ("a soft gradient", &|x, y| [200 + (x / 16) as u8, 190 + (y / 16) as u8, 180]),
        ("all valid", &content),
        ("hills", &|x, y| gray(128.0 + 60.0 * hills(x, y))),
        ("hills below a sky that is white", &|x, y| {
            let ridge = 50.0 + 12.0 * hills(x, 0);
            if (y as f32) < ridge { [255; 3] } else { content(x, y) }
        }),
        ("hills below a smooth sky", &|x, y| {
            let ridge = 90.0 + 12.0 * hills(x, 0);
            if (y as f32) < ridge {
                [120 + (y / 2) as u8, 170 + (y / 3) as u8, 230]
            } else {
                content(x, y)
            }
        }),
        ("swatches", &|x, y| [0, 1, 2].map(|k| chance(x / 16, y / 16, k) as u8)),
        ("four swatches, one painted", &|x, y| match (x < 64, y < 64) {
            (true, true) => content(x, y),
            (a, b) => [if a { 20 } else { 220 }, if b { 20 } else { 220 }, 40],
        }),
        ("a dark picture in soft light", &|x, y| {
            gray(250.0 - 0.03 * ((x as f32 - 64.0).powi(2) + (y as f32 - 64.0).powi(2)))
        }),
    ];
    for (name, texel) in cases {
        let found = Background::detect(&image(texel), 0.5 / 255.0);
        assert!(found.is_none(), "{name}: {:?}", found.map(|found| found.colors().to_vec()));
    }
}

#[test]
fn what_has_alpha_0_is_no_background_of_that_color() {
    let texel = |x: u32, y: u32| match (in_chart(x, y), y < 120) {
        (true, _) => image::Rgba([90, 120, 60, 255]),
        (_, true) => image::Rgba([255, 255, 255, 0]),
        _ => image::Rgba([255, 0, 255, 255]),
    };
    let image = image::RgbaImage::from_fn(128, 128, texel);
    assert_eq!(colors(&image.into()), Some(vec![MAGENTA]));
    let clear = image::RgbaImage::from_pixel(16, 16, image::Rgba([255, 255, 255, 0]));
    assert_eq!(colors(&clear.into()), None);
}
