//! What a program with Seamwise as its only dependency does: the three calls, and a comparison.

use std::path::Path;

use seamwise::attr::{Vertices, simplify};
use seamwise::evaluate::{self, compare_assets};
use seamwise::glam::Vec3;
use seamwise::image::{DynamicImage, Rgba, RgbaImage};
use seamwise::import::read_bytes;
use seamwise::texture::{Repair, Role, Validity};
use seamwise::{BakeOptions, bake_bytes};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("give a model")?;
    let bytes = std::fs::read(path)?;
    let options = BakeOptions { evaluate: None, ..BakeOptions::default() };
    let baked = bake_bytes(&bytes, "model", &options)?;

    let few = evaluate::Options {
        views: 1,
        resolution: 64,
        samples: 1000,
        pixel_tolerance: 1.0,
        screen_height: 128,
    };
    let nowhere = Path::new("");
    let levels = [&baked.files[0].bytes, &baked.files[3].bytes];
    let levels = levels
        .map(|level| read_bytes(level, nowhere))
        .into_iter()
        .collect::<Result<Vec<_>, _>>()?;
    let metrics = compare_assets(&read_bytes(&bytes, nowhere)?, &levels, few)?;
    assert!(metrics[0].distance_rms < metrics[1].distance_rms);

    let corners = [Vec3::ZERO, Vec3::X, Vec3::ONE.with_z(0.0), Vec3::Y, Vec3::new(0.5, 0.5, 0.0)];
    let fan = Vertices::new(&corners, &[0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4])?;
    let level = simplify(&fan, &[0.5])?.remove(0);
    assert_eq!(level.vertices.triangles.len(), 2);

    let mut image = DynamicImage::ImageRgba8(RgbaImage::from_pixel(8, 8, Rgba([0, 0, 0, 255])));
    let mut validity = Validity::from_flags(8, 8, vec![false; 64]);
    assert!(Repair::new(Role::Color).run(&mut image, &mut validity)?.outcome.remaining > 0);
    Ok(())
}
