use proptest::prelude::*;

use super::*;
use crate::color::srgb8_to_linear;

const REPEAT: [Wrap; 2] = [Wrap::Repeat; 2];

/// A row of gray levels in linear light.
fn row(values: &[f32]) -> Mips {
    Mips::from_plane(&Plane::from_vec(values.len(), 1, 1, values.to_vec())).unwrap()
}

#[test]
fn a_constant_stays_constant_in_every_level_of_any_size() {
    let data = [200, 3, 90, 128].repeat(13 * 6);
    for encoding in [ColorEncoding::Srgb, ColorEncoding::Linear] {
        let mips = Mips::from_rgba8(13, 6, &data, encoding).unwrap();
        let color = decode([200, 3, 90, 128], encoding).to_array();
        let sizes: Vec<_> = mips.levels.iter().map(|l| (l.width(), l.height())).collect();
        assert_eq!(sizes, [(13, 6), (6, 3), (3, 1), (1, 1)]);
        for level in &mips.levels {
            assert_eq!(level.texel(0, 0), color);
        }
        assert_eq!(mips.sample(Vec2::new(0.37, 0.81), REPEAT, 1.3), color);
    }
}

#[test]
fn a_checkerboard_goes_to_the_mean_of_its_light() {
    let (black, white) = ([0, 0, 0, 255], [255; 4]);
    let data = [black, white, white, black].concat();
    let mean =
        |encoding| Mips::from_rgba8(2, 2, &data, encoding).unwrap().level(1).texel(0, 0)[0] * 255.0;
    // 188 is the byte nearest to half the light; half the encoded value would be 128.
    assert!((mean(ColorEncoding::Srgb) - srgb8_to_linear(188) * 255.0).abs() < 1e-4);
    assert!((mean(ColorEncoding::Linear) - 128.0).abs() < 1e-4);
}

#[test]
fn an_odd_axis_weighs_texels_by_their_share() {
    let level = row(&[1.0, 0.0, 0.0, 0.0, 0.0]).levels[1].clone();
    assert_eq!([level.texel(0, 0)[0], level.texel(1, 0)[0]], [0.4, 0.0]);
    let level = row(&[0.0, 0.0, 1.0, 0.0, 0.0]).levels[1].clone();
    assert_eq!([level.texel(0, 0)[0], level.texel(1, 0)[0]], [0.2, 0.2]);
}

#[test]
fn a_sample_at_a_texel_center_is_that_texel() {
    let mips = row(&[0.1, 0.5, 0.9, 0.3]);
    for (x, expected) in [0.1, 0.5, 0.9, 0.3].into_iter().enumerate() {
        let uv = Vec2::new((x as f32 + 0.5) / 4.0, 0.5);
        assert_eq!(mips.sample_bilinear(0, uv, REPEAT)[0], expected);
    }
    assert_eq!(mips.sample_bilinear(0, Vec2::new(0.25, 0.5), REPEAT)[0], 0.3);
}

#[test]
fn beyond_the_edge_the_wrap_mode_decides() {
    let mips = row(&[0.0, 1.0]);
    let read = |wrap, u| mips.sample_bilinear(0, Vec2::new(u, 0.5), [wrap; 2])[0];
    assert_eq!([read(Wrap::Repeat, 1.25), read(Wrap::Repeat, 1.0)], [0.0, 0.5]);
    assert_eq!([read(Wrap::Mirror, 1.25), read(Wrap::Mirror, 1.0)], [1.0, 1.0]);
    assert_eq!([read(Wrap::Clamp, 7.0), read(Wrap::Clamp, -7.0)], [1.0, 0.0]);
}

#[test]
fn a_lod_between_levels_mixes_them() {
    let mips = row(&[0.0, 1.0]);
    let read = |lod| mips.sample(Vec2::new(0.25, 0.5), REPEAT, lod)[0];
    assert_eq!(
        [read(-3.0), read(0.0), read(0.5), read(1.0), read(9.0)],
        [0.0, 0.0, 0.25, 0.5, 0.5]
    );
}

#[test]
fn the_lod_is_the_log_of_the_longer_step_in_texels() {
    let mips = Mips::from_plane(&Plane::new(64, 16, 4)).unwrap();
    assert_eq!(mips.lod(Vec2::new(1.0 / 64.0, 0.0), Vec2::new(0.0, 1.0 / 16.0)), 0.0);
    assert_eq!(mips.lod(Vec2::new(1.0 / 64.0, 0.0), Vec2::new(0.0, 0.25)), 2.0);
}

#[test]
fn what_is_not_an_image_is_refused() {
    assert!(Mips::from_rgba8(0, 4, &[], ColorEncoding::Srgb).is_err());
    assert!(Mips::from_rgba8(1, 1, &[0; 3], ColorEncoding::Srgb).is_err());
    assert!(Mips::from_plane(&Plane::new(2, 2, 2)).is_err());
}

proptest! {
    #[test]
    fn the_last_level_is_the_mean(
        width in 1usize..20, height in 1usize..20, seed in any::<u32>(),
    ) {
        let value = |i: usize| ((i as u32).wrapping_mul(seed | 1) >> 8 & 0xff) as f32 / 255.0;
        let data: Vec<f32> = (0..width * height).map(value).collect();
        let mean = data.iter().sum::<f32>() / data.len() as f32;
        let mips = Mips::from_plane(&Plane::from_vec(width, height, 1, data)).unwrap();
        let last = mips.level(mips.levels() - 1).texel(0, 0)[0];
        prop_assert!((last - mean).abs() < 1e-5, "{last} is not {mean}");
    }

    #[test]
    fn no_uv_or_lod_gives_anything_but_a_number(
        u in any::<f32>(), v in any::<f32>(), lod in any::<f32>(),
    ) {
        let mips = Mips::from_rgba8(3, 5, &[77; 60], ColorEncoding::Linear).unwrap();
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let value = mips.sample(Vec2::new(u, v), [wrap; 2], lod)[0];
            prop_assert!((value - 77.0 / 255.0).abs() < 1e-5);
        }
    }
}
