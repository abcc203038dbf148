//! The quadrics of a surface's points as a picture or a model.

use anyhow::{Result, bail};

use seamwise::evaluate::camera::Rig;
use seamwise::evaluate::isosurfaces::draw_isosurfaces;
use seamwise::export::disk::{refuse_overwriting, write_files};
use seamwise::image_file::codec::encode;
use seamwise::image_file::encoded::ImageFormat;
use seamwise::inspect::quadrics::glb::to_glb;
use seamwise::inspect::quadrics::{COLORS, Quadrics};

use super::console::{check_files, read_warned, say};
use crate::cli::{Common, QuadricsArgs};

/// Draws the ellipsoids, and says what became of the points.
pub(crate) fn quadrics(args: &QuadricsArgs, common: Common) -> Result<usize> {
    let output = &args.output;
    let ending = output.extension().and_then(|own| own.to_str()).unwrap_or_default();
    let is_glb = match ending.to_ascii_lowercase().as_str() {
        "glb" => true,
        "png" => false,
        _ => bail!("{}: a picture ends in .png, a model in .glb", output.display()),
    };
    check_files([output])?;
    refuse_overwriting(&args.input, std::slice::from_ref(output))?;
    let named = |error: seamwise::error::Error| error.in_file(&args.input);
    let asset = read_warned(&args.input, &args.reading, common).map_err(named)?;
    let own = Quadrics::of(&asset, args.level, args.epsilon, common.memory_limit).map_err(named)?;
    let bytes = if is_glb {
        to_glb(&own)?
    } else {
        let side = usize::from(args.resolution);
        let camera = match args.camera {
            Some(camera) => camera.camera(own.scene.origin),
            None => Rig::around(&own.scene, 1, side).cameras[0],
        };
        let picture = draw_isosurfaces(&own.scene, &own.solids, &COLORS, &camera, side);
        encode(&picture.into(), ImageFormat::Png)?.bytes.to_vec()
    };
    write_files(&[(output.clone(), bytes)])?;
    let (triangles, epsilon) = (own.scene.triangles.len(), own.epsilon);
    let text = format!("{triangles} triangles, {}; epsilon {epsilon:.3e}\n", own.census);
    say(common.quiet, &text)?;
    Ok(0)
}
