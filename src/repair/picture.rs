//! The repair of a picture: PNG, JPEG, WebP, TIFF, Radiance HDR.

use image::{DynamicImage, ImageFormat};
use seamwise_texture::{Repair, RepairSummary, Role, Validity, is_normal_map, seen_texels};

use super::background::{Found, tolerance};
use super::options::{Background, RepairOptions};
use super::sources::Sources;
use super::{Job, WRAP, padding_note};
use crate::atlas::alpha::coverage_note;
use crate::error::{Error, Result};
use crate::image_file::picture::Picture;
use crate::report::repair::{ImageReport, RepairReport};

/// The part of a picture that its background leaves.
#[derive(Default)]
struct Backdrop {
    /// The texels it leaves; `None` if there is no background.
    validity: Option<Validity>,
    /// Whether colors spread under alpha 0.
    spreads: bool,
    /// A note for people…
    note: Option<String>,
    /// …and the odd thing about it, if there is one.
    doubt: Option<String>,
}

impl Job<'_> {
    pub(super) fn picture(
        &self,
        bytes: &[u8],
        format: ImageFormat,
    ) -> Result<(Vec<u8>, RepairReport)> {
        let output_format = self.output_format()?;
        let invalid = |what: String| Error::invalid(self.input.display().to_string(), what);
        let encoding = self.options.encoding;
        if encoding.png && output_format != ImageFormat::Png {
            let what = format!("{}: no PNG, but --png is given", self.output.display());
            return Err(Error::Options { what });
        }
        let mut picture = Picture::decode(bytes, format, self.options.reading.memory_limit)
            .map_err(|error| error.in_file(self.input))?;
        let size = [picture.texels.width() as usize, picture.texels.height() as usize];
        self.expect_seams()?;
        let mut sources = Sources::read(self.options)?;
        let found = sources.background(&picture.texels, tolerance(format));
        let Backdrop { validity, spreads, note, doubt } = self.backdrop(&picture.texels, found)?;
        doubt.into_iter().for_each(|doubt| sources.warnings.add("its background", doubt));
        let mut validity = sources.validity(size, validity)?.ok_or_else(|| self.nothing_tells())?;
        if validity.valid() == 0 {
            return Err(self.nothing_valid());
        }
        let (role, guess) = self.role(&picture.texels, &validity);
        let fault = |error: seamwise_texture::Error| invalid(error.to_string());
        let RepairOptions { keep_padding, halvings, keep_coverage, footprint, .. } = *self.options;
        let (seams, equalize) = sources.seams(self.options).unzip();
        let repair = Repair::new(role)
            .wrap(WRAP)
            .keep_padding(keep_padding)
            .halve(halvings)
            .keep_coverage(keep_coverage)
            .fill_hidden(spreads)
            .equalize(seams.unwrap_or_default(), equalize);
        let RepairSummary { padding, coverage, outcome, equalized } =
            repair.run(&mut picture.texels, &mut validity).map_err(fault)?;
        let reads = sources.reads(&validity, footprint);
        let (file, notes) = picture.encode(output_format, encoding.quality).map_err(|what| {
            let output = self.output.display();
            Error::Options { what: format!("{output}: {what}; choose another format") }
        })?;
        let name = self.input.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut report = ImageReport { name, role: Some(role), ..ImageReport::default() };
        report.equalized = equalized;
        report.notes = [picture.notes, notes].concat();
        report.notes.extend(padding_note(padding));
        report.notes.extend(note.into_iter().chain(guess));
        report.notes.extend(coverage.as_ref().map(coverage_note));
        let mut kept = validity.clone();
        if spreads {
            kept.intersect(&seen_texels(&picture.texels));
        }
        report.diff = self.diff(&picture.texels, &kept)?;
        report.pyramid = self.pyramid(&picture.texels, &kept, Some(role))?;
        report.add_outcome(&validity, outcome, reads);
        Ok((file, RepairReport { images: vec![report], warnings: sources.warnings }))
    }

    /// The part of a picture that the background leaves: its own, or that of its set.
    fn backdrop(&self, texels: &DynamicImage, found: Option<Found>) -> Result<Backdrop> {
        let size = [texels.width() as usize, texels.height() as usize];
        let spreads = found.as_ref().is_some_and(|found| found.spreads);
        let Some(shared) = self.shared else {
            let Some(found) = found else { return Ok(Backdrop::default()) };
            let rims = found.is_blended.then(|| found.charts.without_rims());
            let validity = Some(rims.unwrap_or(found.charts));
            return Ok(Backdrop { validity, spreads, note: Some(found.note), doubt: found.doubt });
        };
        let valid = shared.validity(size, found.as_ref());
        let mut valid = valid.map_err(|error| error.in_file(self.input))?;
        if spreads {
            // Its own alpha stays where the set has background.
            let hidden = seen_texels(texels).flags().iter().map(|seen| !seen).collect();
            valid.union(&Validity::from_flags(size[0], size[1], hidden));
        }
        let (validity, note) = (Some(valid), Some(shared.note.clone()));
        Ok(Backdrop { validity, spreads, note, doubt: None })
    }

    /// The meaning of texels, and a note if it is a guess.
    fn role(&self, texels: &DynamicImage, validity: &Validity) -> (Role, Option<String>) {
        match self.options.role {
            Some(role) => (role, None),
            None if is_normal_map(texels, validity) => {
                let note = "its texels are vectors of length 1: it is filled as a normal map; \
                            --role color if it is none";
                (Role::Normal, Some(note.to_owned()))
            }
            None => (Role::Color, None),
        }
    }

    /// Checks that a mesh tells the seams if they are to be equalized.
    pub(super) fn expect_seams(&self) -> Result<()> {
        if self.options.equalize.is_none() || self.options.mesh.is_some() {
            return Ok(());
        }
        let what = "nothing tells where its seams are: give a mesh that uses the picture (--mesh)";
        Err(Error::Options { what: format!("{}: {what}", self.input.display()) })
    }

    /// The error that nothing tells which texels are valid.
    pub(super) fn nothing_tells(&self) -> Error {
        let what = match self.options.background {
            Background::Alpha => "no texel of it has alpha 0, or all have: give ",
            Background::Auto => {
                "no background is found that lies around its charts, neither alpha 0 nor up to 16 \
                 flat colors along its border: give "
            }
            _ => "nothing tells which texels are valid: give ",
        };
        let advice = "a mesh that uses the picture (--mesh), a mask (--mask) or the colors around \
                      its charts (--background)";
        let what = format!("{what}{advice}");
        Error::Options { what: format!("{}: {what}", self.input.display()) }
    }

    /// The error that there is nothing to fill from.
    pub(super) fn nothing_valid(&self) -> Error {
        let what = "no texel is valid by the mesh, mask and background given: nothing to fill from";
        Error::Options { what: format!("{}: {what}", self.input.display()) }
    }

    fn output_format(&self) -> Result<ImageFormat> {
        let known = |format: &ImageFormat| format.writing_enabled();
        ImageFormat::from_path(self.output).ok().filter(known).ok_or_else(|| Error::Options {
            what: format!("{}: no format for pictures that is known", self.output.display()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limit::MemoryLimit;
    use crate::repair::repair_file;
    use image::{ColorType, GrayImage, Luma};
    use std::path::{Path, PathBuf};

    const SIZE: u32 = 24;
    const KINDS: [ColorType; 8] = [
        ColorType::L8,
        ColorType::La8,
        ColorType::Rgb8,
        ColorType::Rgba8,
        ColorType::L16,
        ColorType::La16,
        ColorType::Rgb16,
        ColorType::Rgba16,
    ];

    fn in_chart(x: u32, y: u32) -> bool {
        (5..19).contains(&x) && (7..16).contains(&y)
    }

    /// A chart of muted colors on a garish background.
    fn atlas(kind: ColorType) -> DynamicImage {
        let picture = image::RgbaImage::from_fn(SIZE, SIZE, |x, y| {
            let muted = image::Rgba([100 + x as u8, 110 + y as u8, 120, 255]);
            if in_chart(x, y) { muted } else { image::Rgba([255, 0, 255, 255]) }
        });
        let picture = DynamicImage::ImageRgba8(picture);
        match kind {
            ColorType::L8 => picture.to_luma8().into(),
            ColorType::La8 => picture.to_luma_alpha8().into(),
            ColorType::Rgb8 => picture.to_rgb8().into(),
            ColorType::L16 => picture.to_luma16().into(),
            ColorType::La16 => picture.to_luma_alpha16().into(),
            ColorType::Rgb16 => picture.to_rgb16().into(),
            ColorType::Rgba16 => picture.to_rgba16().into(),
            _ => picture,
        }
    }

    fn mask(folder: &Path, size: u32) -> RepairOptions {
        let path = folder.join(format!("mask{size}.png"));
        let luma = |x, y| Luma([if in_chart(x, y) { 130u8 } else { 120 }]);
        GrayImage::from_fn(size, size, luma).save(&path).unwrap();
        RepairOptions { mask: Some(path), background: Background::None, ..Default::default() }
    }

    fn run(
        before: &DynamicImage,
        names: [&str; 2],
        options: &RepairOptions,
        folder: &Path,
    ) -> Result<(DynamicImage, RepairReport)> {
        let [input, output]: [PathBuf; 2] = names.map(|name| folder.join(name));
        before.save(&input).unwrap();
        let report = repair_file(&input, &output, options)?;
        Ok((Picture::read(&output, MemoryLimit::default())?.texels, report))
    }

    #[test]
    fn a_png_of_any_kind_keeps_its_kind_and_its_valid_texels() {
        let folder = tempfile::tempdir().unwrap();
        let options = mask(folder.path(), SIZE);
        for kind in KINDS {
            let before = atlas(kind);
            let (after, report) =
                run(&before, ["a.png", "b.png"], &options, folder.path()).unwrap();
            assert_eq!(after.color(), kind);
            let report = &report.images[0];
            assert_eq!((report.covered, report.filled, report.remaining), (126, 450, 0));
            let bytes = usize::from(kind.bytes_per_pixel());
            let texels = before.as_bytes().chunks(bytes).zip(after.as_bytes().chunks(bytes));
            for (texel, (before, after)) in (0..).zip(texels) {
                assert!(!in_chart(texel % SIZE, texel / SIZE) || before == after);
            }
            // The chart's colors lie in 100…130; magenta and its gray do not.
            let rgba = after.to_rgba8();
            assert!(rgba.pixels().all(|p| p.0[..3].iter().all(|v| (95..136).contains(v))));
            assert!(rgba.pixels().all(|p| p.0[3] == 255));
        }
    }

    #[test]
    fn the_background_is_found_or_given_and_otherwise_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let before = atlas(ColorType::Rgb8);
        let with = |background| {
            let options = RepairOptions { background, ..Default::default() };
            run(&before, ["a.png", "b.png"], &options, folder.path())
        };
        for background in [Background::Auto, "#ff00ff".parse().unwrap()] {
            // The chart with its rim, which goes on as it does.
            assert_eq!(with(background).unwrap().1.images[0].covered, 14 * 9);
        }
        assert!(with(Background::None).unwrap_err().to_string().contains("--mesh"));
        let flat = DynamicImage::new_rgb8(9, 9);
        let error = run(&flat, ["c.png", "d.png"], &Default::default(), folder.path()).unwrap_err();
        assert!(error.to_string().contains("--mask"), "{error}");
    }

    #[test]
    fn other_formats_keep_the_texels_they_can_hold() {
        let folder = tempfile::tempdir().unwrap();
        let options = mask(folder.path(), SIZE);
        let float = DynamicImage::ImageRgb32F(atlas(ColorType::Rgb8).to_rgb32f());
        for (name, before) in [
            ("b.webp", atlas(ColorType::Rgba8)),
            ("b.tif", atlas(ColorType::Rgb16)),
            ("b.hdr", float),
        ] {
            let first = format!("a.{}", &name[2..]);
            let (_, _) = run(&before, [&first, name], &options, folder.path()).unwrap();
            // What the file holds, which is less than the floats if they are shared exponents.
            let read = |name: &str| {
                Picture::read(&folder.path().join(name), MemoryLimit::default()).unwrap().texels
            };
            let (before, after) = (read(&first), read(name));
            assert_eq!(before.color(), after.color());
            let bytes = usize::from(before.color().bytes_per_pixel());
            let texels = before.as_bytes().chunks(bytes).zip(after.as_bytes().chunks(bytes));
            for (texel, (before, after)) in (0..).zip(texels) {
                assert_eq!(in_chart(texel % SIZE, texel / SIZE), before == after, "{name} {texel}");
            }
        }
        let jpeg = run(&atlas(ColorType::Rgb8), ["a.jpg", "b.jpg"], &options, folder.path());
        assert_eq!(jpeg.unwrap().0.color(), ColorType::Rgb8);
    }

    #[test]
    fn what_does_not_fit_is_an_error_with_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let fits = mask(folder.path(), SIZE);
        let run = |before, output, options: &RepairOptions| {
            run(&before, ["a.png", output], options, folder.path()).unwrap_err().to_string()
        };
        let small = mask(folder.path(), SIZE - 1);
        assert!(run(atlas(ColorType::L8), "b.png", &small).contains("mask23.png"));
        assert!(run(atlas(ColorType::Rgba16), "b.jpg", &fits).contains("b.jpg"));
        assert!(run(atlas(ColorType::L8), "b.txt", &fits).contains("b.txt"));
        let none = folder.path().join("none.png");
        GrayImage::new(SIZE, SIZE).save(&none).unwrap();
        let options = RepairOptions { mask: Some(none), ..fits.clone() };
        assert!(run(atlas(ColorType::L8), "b.png", &options).contains("no texel is valid"));
        let broken = folder.path().join("broken.png");
        std::fs::write(&broken, b"\x89PNG\r\n\x1a\nnothing").unwrap();
        let error = repair_file(&broken, &folder.path().join("b.png"), &fits).unwrap_err();
        assert!(matches!(error, Error::Invalid { .. }), "{error}");
    }
}
