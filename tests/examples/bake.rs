//! Bakes a self-contained .gltf or .glb in memory, and writes what comes of it into a folder:
//! `cargo run --example bake -- model.glb out`.

use std::path::Path;

use seamwise::{BakeOptions, bake_bytes};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let [_, model, folder] = &std::env::args().collect::<Vec<_>>()[..] else {
        return Err("give a model and a folder".into());
    };
    let stem = Path::new(model).file_stem().unwrap_or_default().to_string_lossy();
    let options = BakeOptions { report: None, ..BakeOptions::default() };
    let baked = bake_bytes(&std::fs::read(model)?, &stem, &options)?;
    for level in &baked.report.levels {
        println!("{} of {} triangles", level.triangles, baked.report.input.triangles);
    }
    baked.report.warnings.iter().for_each(|warning| eprintln!("{warning}"));
    baked.write(Path::new(folder))?;
    Ok(())
}
