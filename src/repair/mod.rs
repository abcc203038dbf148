//! The repair of a file: every texel that may not be trusted is filled, everything else stays.
//!
//! A glTF asset knows which of its texels surfaces use, and how its samplers read them: see
//! [`atlas`](crate::atlas). A picture on its own does not. For it, [`RepairOptions`] names what
//! tells: a mesh, a painted mask, the background by its colors or by alpha, found or given. Given
//! several, a texel must pass all of them. Where alpha tells, or hides what has alpha 0 in all materials
//! that use an image, colors spread under it, and alpha stays to the bit. [`several`] repairs the maps
//! of a set by one background. A picture's sampler is not known either: it is taken to repeat, as glTF's default does.
//!
//! Guaranteed: valid texels of PNG, WebP, TIFF, HDR and EXR files keep their values, in EXR files
//! to the bit, and what the file holds beside them comes along; what does not is said. Not
//! guaranteed: the same texels of JPEGs, which are compressed anew. A damaged file, or one that
//! claims more memory than [`RepairOptions::reading`] allows, is an error, and nothing is written.

mod background;
mod channels;
mod find;
mod layers;
pub mod options;
mod picture;
mod pyramid;
mod set;
pub mod several;
mod smaller;
mod sources;

use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageFormat, RgbImage};
use seamwise_texture::{Role, Validity, Wrap, seen_texels};

use crate::atlas::alpha::coverage_note;
use crate::atlas::fill_picture::draw_fill;
use crate::atlas::{ImageRepair, Repaired, encode_repaired, repair_all_with};
use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::export::disk::{check_writable, refuse_overwriting, write_files};
use crate::export::glb::to_glb;
use crate::image_file::codec::{EncodeOptions, detect_format, encode};
use crate::image_file::encoded::{self, EncodedImage};
use crate::image_file::metadata::png_widening;
use crate::image_file::picture::{LOSSLESSLY, reencoded};
use crate::import::foreign::refuse_foreign;
use crate::import::options::folder_of;
use crate::import::read_bytes_with;
use crate::report::repair::{ImageReport, LevelPicture, RepairReport};
use options::{Background, RepairOptions};
use pyramid::Pyramid;
use set::Shared;

/// How a picture is read beyond its edges, as nothing tells otherwise.
const WRAP: [Wrap; 2] = [Wrap::Repeat; 2];

/// Kind of a file, told by its first bytes; an asset also by its name.
enum Kind {
    Asset,
    Exr,
    Picture(ImageFormat),
}

impl Kind {
    fn of(path: &Path, bytes: &[u8]) -> Result<Self> {
        if bytes.starts_with(b"glTF") || is_named(path, &["gltf", "glb"]) {
            return Ok(Self::Asset);
        }
        if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
            return Ok(Self::Exr);
        }
        match detect_format(bytes) {
            Some(format) => Ok(Self::Picture(format)),
            None if is_named(path, &["obj", "off", "ply"]) => {
                let what =
                    "a model with pictures of its own: repair those, with --mesh and this file";
                Err(Error::Kind { what: what.into() }.in_file(path))
            }
            None => {
                refuse_foreign(path, bytes).map_err(|error| error.in_file(path))?;
                let what =
                    "neither a .glb or .gltf nor a picture (.png, .jpg, .webp, .tif, .hdr, .exr)";
                Err(Error::Kind { what: what.into() }.in_file(path))
            }
        }
    }
}

/// Repairs the file `input` and writes the result to `output`: an asset with all its images, as
/// .glb; an .exr with all its layers; or a picture, in the format of `output`'s extension.
///
/// Where [`RepairOptions::diff`] names a .png, it shows the result in dim gray and what was filled in
/// color. Of several images each has a picture of its own, with its number before the extension:
/// `FILE_0.png`.
///
/// # Errors
/// [`Error::Io`], [`Error::Invalid`] or [`Error::Unsupported`] if a file can't be read or written,
/// with its name; [`Error::Options`] if `output` is one of the files read or of another kind, or
/// if nothing tells which texels are valid.
pub fn repair_file(input: &Path, output: &Path, options: &RepairOptions) -> Result<RepairReport> {
    repair_map(input, output, options, None)
}

/// Checks that the output and what is drawn of it can be written and have the names of what they are.
fn check_drawn(output: &Path, options: &RepairOptions) -> Result<()> {
    let RepairOptions { diff, pyramid, .. } = options;
    let refuse = |path: &Path, what: &str| {
        Err(Error::Options { what: format!("{}: {what}", path.display()) })
    };
    if let Some(path) = diff.as_ref().filter(|path| !is_named(path, &["png"])) {
        return refuse(path, "what was filled is drawn to a .png");
    }
    let mut written = vec![output.to_owned()];
    written.extend(diff.clone());
    if let Some(path) = pyramid {
        let is_file = is_named(path, &["png"]);
        if !is_file && path.extension().is_some() && !path.is_dir() {
            return refuse(path, "levels of the fill are drawn to a .png, or into a folder");
        }
        written.push(if is_file { path.clone() } else { path.join("0_pull.png") });
    }
    check_writable(&written)
}

/// As [`repair_file`], of a picture that is one of a set if that has a background.
fn repair_map(
    input: &Path,
    output: &Path,
    options: &RepairOptions,
    shared: Option<&Shared>,
) -> Result<RepairReport> {
    let mesh = options.mesh.as_ref().map(|mesh| mesh.file.as_path());
    let refuse = |outputs: &[PathBuf]| {
        let mut read = [Some(input), mesh, options.mask.as_deref()].into_iter().flatten();
        read.try_for_each(|read| refuse_overwriting(read, outputs))
    };
    refuse(&[output.to_owned()])?;
    check_drawn(output, options)?;
    let bytes = if is_named(input, &["gltf", "glb"]) {
        std::fs::read(input).map_err(|error| Error::io(input, error))?
    } else {
        options.reading.memory_limit.read_file(input)?
    };
    let (file, report) = Job { input, output, options, shared }.run(&bytes)?;
    let mut files = vec![(output.to_owned(), file)];
    files.extend(options.diff.iter().flat_map(|diff| report.diffs(diff)));
    files.extend(options.pyramid.iter().flat_map(|path| report.pyramids(path)));
    let names: Vec<PathBuf> = files.iter().map(|(name, _)| name.clone()).collect();
    refuse(&names)?;
    if names[1..].contains(&names[0]) {
        let what = format!("{}: both the result and the picture of it", output.display());
        return Err(Error::Options { what });
    }
    write_files(&files)?;
    Ok(report)
}

/// Repairs the file `input`, which holds `bytes`, and gives what [`repair_file`] writes to `output`.
///
/// # Errors
/// As [`repair_file`].
pub fn repair_bytes(
    bytes: &[u8],
    input: &Path,
    output: &Path,
    options: &RepairOptions,
) -> Result<(Vec<u8>, RepairReport)> {
    Job { input, output, options, shared: None }.run(bytes)
}

fn is_named(path: &Path, extensions: &[&str]) -> bool {
    let is = |own: &std::ffi::OsStr| extensions.iter().any(|other| own.eq_ignore_ascii_case(other));
    path.extension().is_some_and(is)
}

/// From one file to another.
#[derive(Clone, Copy)]
struct Job<'a> {
    input: &'a Path,
    output: &'a Path,
    options: &'a RepairOptions,
    /// The background of the set that a picture is of, if it is of one.
    shared: Option<&'a Shared>,
}

impl Job<'_> {
    fn run(&self, bytes: &[u8]) -> Result<(Vec<u8>, RepairReport)> {
        let (file, report) = match Kind::of(self.input, bytes)? {
            Kind::Asset => self.asset(bytes),
            Kind::Exr => self.exr(bytes),
            Kind::Picture(format) => self.picture(bytes, format),
        }?;
        let strict = self.options.reading.strict;
        report.warnings.refuse_if(strict).map_err(|error| error.in_file(self.input))?;
        Ok((file, report))
    }

    /// Checks that the output's name says what it will be.
    fn expect_extension(&self, extension: &str) -> Result<()> {
        if is_named(self.output, &[extension]) {
            return Ok(());
        }
        let [input, output] = [self.input, self.output].map(Path::display);
        let what = format!("{output}: {input} is repaired to a .{extension} file");
        Err(Error::Options { what })
    }

    /// The picture of what was filled, if it is asked for; `kept` are the other texels.
    fn diff(&self, texels: &DynamicImage, kept: &Validity) -> Result<Option<Vec<u8>>> {
        let draw = || png(draw_fill(texels, kept));
        self.options.diff.is_some().then(draw).transpose()
    }

    /// The pictures of the levels of the fill, if they are asked for: one of all, or one each in a folder.
    fn pyramid(
        &self,
        texels: &DynamicImage,
        kept: &Validity,
        role: Option<Role>,
    ) -> Result<Vec<LevelPicture>> {
        let Some(path) = &self.options.pyramid else { return Ok(Vec::new()) };
        let pyramid = Pyramid::of(texels, kept, role);
        let pictures = match is_named(path, &["png"]) {
            true => vec![(String::new(), pyramid.sheet())],
            false => pyramid.pictures(),
        };
        let encoded =
            pictures.into_iter().map(|(name, own)| Ok(LevelPicture { name, png: png(own)? }));
        encoded.collect()
    }

    fn asset(&self, bytes: &[u8]) -> Result<(Vec<u8>, RepairReport)> {
        self.expect_extension("glb")?;
        let RepairOptions { mesh, mask, background, role, encoding, .. } = self.options;
        let own = mesh.is_none() && mask.is_none() && role.is_none();
        if !own || *background != Background::Auto {
            let what = "mesh, mask, background and role are for pictures: an asset has its own";
            return Err(Error::Options { what: format!("{}: {what}", self.input.display()) });
        }
        let run = || {
            let asset = read_bytes_with(bytes, folder_of(self.input), self.options.reading)?;
            let repairs = repair_all_with(&asset, self.options.for_atlases())?;
            let images = encode_repaired(&asset, &repairs, *encoding)?;
            let report = repairs.iter().map(|repair| {
                let mut report = asset_image(&asset, repair, self.options);
                if let Ok(repaired) = &repair.result {
                    let mut kept = repaired.validity.clone();
                    if repaired.outcome.hidden > 0 {
                        kept.intersect(&seen_texels(&repaired.texels));
                    }
                    report.diff = self.diff(&repaired.texels, &kept)?;
                    report.pyramid = self.pyramid(&repaired.texels, &kept, repair.role)?;
                }
                Ok(report)
            });
            let report = report.collect::<Result<_>>()?;
            let warnings = asset.warnings.clone();
            let glb = to_glb(&Asset { images, ..asset })?;
            Ok((glb, RepairReport { images: report, warnings }))
        };
        run().map_err(|error: Error| error.in_file(self.input))
    }
}

fn png(picture: RgbImage) -> Result<Vec<u8>> {
    Ok(encode(&picture.into(), encoded::ImageFormat::Png)?.bytes.to_vec())
}

/// The report of an image of an asset, which is called by its place and its name.
fn asset_image(asset: &Asset, repair: &ImageRepair, options: &RepairOptions) -> ImageReport {
    let RepairOptions { encoding, footprint, .. } = *options;
    let name = asset.image_name(repair.image).unwrap_or_default();
    let mut report = ImageReport {
        name: format!("{} {name}", repair.image).trim_end().to_owned(),
        role: repair.role,
        ..ImageReport::default()
    };
    match &repair.result {
        Ok(repaired) => {
            report.add_outcome(&repaired.validity, repaired.outcome, repaired.reads(footprint));
            report.equalized = repaired.equalized;
            report.notes = encoding_notes(&asset.images[repair.image], encoding);
            report.notes.extend(padding_note(repaired.padding));
            report.notes.extend(repaired.coverage.as_ref().map(coverage_note));
            report.notes.extend(hidden_note(repaired));
        }
        Err(reason) => report.left_alone = Some(reason.to_string()),
    }
    report
}

/// Notes on the encoding of an asset's image that was repaired.
fn encoding_notes(before: &EncodedImage, encoding: EncodeOptions) -> Vec<String> {
    let note = match before.format {
        encoded::ImageFormat::Png => png_widening(&before.bytes),
        encoded::ImageFormat::Ktx2 => Some("it becomes a PNG".to_owned()),
        _ if encoding.png => Some("it becomes a PNG".to_owned()),
        encoded::ImageFormat::Jpeg => Some(reencoded(encoding.quality)),
        encoded::ImageFormat::WebP => Some(LOSSLESSLY.to_owned()),
    };
    note.into_iter().collect()
}

/// The note on colors under alpha 0.
fn hidden_note(repaired: &Repaired) -> Option<String> {
    let hidden = repaired.outcome.hidden;
    if repaired.is_hidden_in_part() {
        let note =
            "colors under alpha 0 stay: not all that use it are base colors of MASK or BLEND";
        return Some(note.to_owned());
    }
    (hidden > 0).then(|| {
        format!("{hidden} texels of alpha 0 have the color of what is around; alpha stays")
    })
}

/// The note on padding that was kept, if any was.
fn padding_note(texels: usize) -> Option<String> {
    (texels > 0).then(|| format!("{texels} texels of its padding are kept"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_input_is_overwritten_and_no_output_is_called_what_it_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let picture = folder.path().join("a.png");
        image::GrayImage::new(2, 2).save(&picture).unwrap();
        let mask = RepairOptions { mask: Some(picture.clone()), ..RepairOptions::default() };
        let glb = folder.path().join("a.glb");
        std::fs::write(&glb, b"glTF").unwrap();
        for (input, output, options) in [
            (&picture, picture.clone(), &RepairOptions::default()),
            (&glb, picture.clone(), &mask),
            (&glb, folder.path().join("b.png"), &RepairOptions::default()),
            (&glb, folder.path().join("b.glb"), &mask),
            (&picture, folder.path().join("b.glb"), &mask),
        ] {
            let error = repair_file(input, &output, options).unwrap_err();
            assert!(matches!(error, Error::Options { .. }), "{error}");
        }
    }
}
