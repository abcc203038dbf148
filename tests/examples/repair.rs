//! Repairs an image in memory: a disk of color on a gaudy background, found by its color, and written
//! to the file that is named.

use seamwise::image::{DynamicImage, Rgb, RgbImage};
use seamwise::texture::{Background, Repair, Role};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("give a file to write")?;
    let center = |x: u32, y: u32| (f64::from(x) - 128.0).hypot(f64::from(y) - 128.0);
    let mut atlas = DynamicImage::ImageRgb8(RgbImage::from_fn(256, 256, |x, y| {
        if center(x, y) < 90.0 { Rgb([x as u8, y as u8, 40]) } else { Rgb([255, 0, 255]) }
    }));
    let background = Background::detect(&atlas, 0.0).ok_or("it has no background")?;
    let mut validity = background.validity();
    let done = Repair::new(Role::Color).run(&mut atlas, &mut validity)?;
    println!("{} texels stay, {} are filled", validity.valid(), done.outcome.filled);
    Ok(atlas.save(path)?)
}
