//! Textures that each level has of its own only where they show less error than the source's.

use crate::common::build::Build;
use crate::common::{Baked, measured, shapes};
use image::{Rgba, RgbaImage};
use seamwise::bake::options::{BakeOptions, Targets, Textures};
use seamwise::transfer::{Sizes, TextureChoice, TransferOptions};

/// Stripes that a slide of UVs shows, on a torus.
fn striped(uv: impl Fn(&mut [f32; 2])) -> Vec<u8> {
    let picture = RgbaImage::from_fn(256, 256, |x, y| {
        let wave = |x: f32| (127.0 + 120.0 * x.sin()) as u8;
        let (x, y) = (x as f32, y as f32);
        Rgba([wave(x * 0.4), wave(y * 0.3 + x * 0.1), wave((x + y) * 0.2), 255])
    });
    let mut build = Build::new();
    let material = build.textured(&picture);
    let mut shape = shapes::torus(64, 32);
    shape.uvs.iter_mut().for_each(uv);
    let mut primitive = build.primitive(&shape);
    primitive["material"] = material.into();
    build.mesh(vec![primitive]);
    build.glb()
}

/// The whole chart lies apart from the image's edges.
fn apart(uv: &mut [f32; 2]) {
    uv.iter_mut().for_each(|x| *x = 0.05 + 0.9 * *x);
}

/// Both halves lie on each other.
fn mirrored(uv: &mut [f32; 2]) {
    uv[0] = (2.0 * uv[0] - 1.0).abs();
    apart(uv);
}

fn bake(glb: &[u8], textures: Textures) -> Baked {
    let targets = Targets::ratios(vec![0.25, 0.0625]).expect("shares from fine to coarse");
    Baked::bytes("striped", glb, &BakeOptions { targets, textures, ..measured() })
}

fn auto(sizes: Sizes) -> Textures {
    Textures::Transfer(TransferOptions { chooses: true, sizes, ..TransferOptions::default() })
}

fn choices(baked: &Baked) -> Vec<TextureChoice> {
    let textures = baked.report.materials.iter().flat_map(|own| &own.textures);
    textures.flat_map(|own| own.choices.iter().cloned()).collect()
}

#[test]
fn a_choice_is_no_worse_than_either_way_and_its_estimate_is_what_is_measured() {
    let glb = striped(apart);
    let chosen = bake(&glb, auto(Sizes::Scale(1.0)));
    let transferred = TransferOptions { sizes: Sizes::Scale(1.0), ..TransferOptions::default() };
    let forced = [Textures::Repair, Textures::Transfer(transferred)].map(|own| bake(&glb, own));
    for level in 0..2 {
        let color = |baked: &Baked| {
            let metrics = &baked.report.levels[level].metrics;
            metrics.as_ref().expect("a measured level").color_rms
        };
        let least = color(&forced[0]).min(color(&forced[1]));
        assert!(color(&chosen) <= 1.02 * least, "{} {least}", color(&chosen));
        let told = choices(&chosen);
        let told = told.iter().find(|own| own.level == level + 1 && !own.gained).expect("a choice");
        for (estimate, forced) in [told.shared_error, told.own_error].into_iter().zip(&forced) {
            let ratio = estimate / color(forced);
            assert!((0.8..1.25).contains(&ratio), "{level}: {estimate} {}", color(forced));
        }
        assert_eq!(told.own, told.own_error < 0.98 * told.shared_error);
    }
}

#[test]
fn own_images_take_no_more_bytes_than_the_source_or_a_budget() {
    let glb = striped(apart);
    let source = crate::common::output::Output::from_bytes(&glb, "striped").image_bytes(0).len();
    let own_bytes = |sizes| {
        let own = choices(&bake(&glb, auto(sizes))).into_iter().filter(|choice| choice.own);
        own.map(|choice| choice.own_bytes).sum::<usize>()
    };
    assert!(own_bytes(Sizes::Needed) <= source);
    assert!(own_bytes(Sizes::Budget(source as u64 / 8)) <= source / 8);
    assert_eq!(own_bytes(Sizes::Budget(0)), 0);
}

#[test]
fn texels_of_two_halves_are_made_anew_where_they_do_for_both() {
    let glb = striped(mirrored);
    let [chosen, shared] = [auto(Sizes::Needed), Textures::Repair].map(|own| bake(&glb, own));
    let color = |baked: &Baked| {
        let metrics = &baked.report.levels[1].metrics;
        metrics.as_ref().expect("a measured level").color_rms
    };
    assert!(choices(&chosen).iter().any(|own| own.level == 2 && own.own));
    assert!(color(&chosen) <= 0.92 * color(&shared), "{} {}", color(&chosen), color(&shared));
}
