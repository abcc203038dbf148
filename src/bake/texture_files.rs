//! The files of textures, once all are made: in KTX2 for graphics processors, or PNGs as small as they can be.
//!
//! Each image is encoded once, however many levels share it. What is no picture stays out of KTX2: an image whose charts are
//! single colors, which blocks of 4 × 4 texels would mix, and one that is read both as color and as other data, of
//! which a file can be only one.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use rayon::prelude::*;
use rustc_hash::FxHashMap;
use seamwise_texture::Role;

use super::options::{BakeOptions, Textures};
use crate::atlas::meanings::{NoPicture, meanings};
use crate::document::asset::Asset;
use crate::document::material::role_of;
use crate::error::Result;
use crate::export::files::Layout;
use crate::image_file::codec::decode;
use crate::image_file::encoded::{EncodedImage, ImageFormat};
use crate::image_file::ktx2::encode::{self, stored_size};
use crate::image_file::{lossy_webp, smallest_png};
use crate::level::textures::LevelTextures;
use crate::limit::MemoryLimit;
use crate::progress::Progress;
use crate::transfer::TextureFormat;
use crate::warning::Warnings;

/// Makes sure that this build has the encoders that a bake needs.
///
/// # Errors
/// [`Error::Options`](crate::Error::Options) that names the feature which is lacking.
pub(super) fn check_encoders(options: &BakeOptions) -> Result<()> {
    if options.texture_files.ktx2 {
        encode::check_built()?;
    }
    if options.texture_files.smallest_png {
        smallest_png::check_built()?;
    }
    match options.textures {
        Textures::Transfer(own) if own.format == TextureFormat::LossyWebP => {
            lossy_webp::check_built()
        }
        _ => Ok(()),
    }
}

/// The images of a bake, each in the file it came in or was made in.
pub(super) struct Images<'a> {
    pub(super) asset: &'a Asset,
    /// Those of the source, filled if they are to be.
    pub(super) of_source: &'a mut [EncodedImage],
    /// Those of the levels.
    pub(super) of_levels: &'a mut [LevelTextures],
}

/// Where an image is used: in the source's document by its index, or only in levels with one meaning.
#[derive(Clone, Copy)]
enum Use {
    Source(usize),
    Level(Role),
}

impl Images<'_> {
    /// Makes them the files that the options ask for.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if one is damaged or takes more memory than the limit.
    pub(super) fn finish(
        &mut self,
        options: &BakeOptions,
        progress: &Progress,
    ) -> Result<Warnings> {
        let (limit, files) = (options.reading.memory_limit, options.texture_files);
        // Where each level is a file, the source's images are written only as far as levels share them.
        let has_source = options.output.layout != Layout::None || options.output.progressive;
        let mut warnings = Warnings::default();
        if files.ktx2 {
            let roles = self.roles(limit, &mut warnings)?;
            let role = |image: &EncodedImage, own: Use| match own {
                _ if image.format == ImageFormat::Ktx2 => None,
                Use::Source(index) => roles[index],
                Use::Level(role) => Some(role),
            };
            let told = self.change(has_source, progress, role, |job| job.to_ktx2(limit))?;
            warnings.extend(told);
        }
        if files.smallest_png {
            let is_png = |image: &EncodedImage, _| {
                (image.format == ImageFormat::Png).then_some(Role::default())
            };
            self.change(has_source, progress, is_png, Job::to_smallest_png)?;
        }
        Ok(warnings)
    }

    /// The meaning of each of the source's images that becomes KTX2.
    fn roles(&self, limit: MemoryLimit, warnings: &mut Warnings) -> Result<Vec<Option<Role>>> {
        let meanings = meanings(self.asset, limit)?.into_iter().enumerate();
        let role = |(index, meaning): (usize, std::result::Result<Role, NoPicture>)| {
            let why = match meaning {
                Ok(role) => return Some(role),
                Err(NoPicture::Unused | NoPicture::Missing) => return None,
                Err(NoPicture::Mixed) => {
                    "it is used both as color and as other data, and a KTX2 can be only one: it stays as it is; \
                     give each use an image of its own"
                }
                Err(NoPicture::Colors) => {
                    "its charts are single colors, which the blocks of a KTX2 would mix: it stays as it is"
                }
            };
            warnings.add(format!("/images/{index}"), why);
            None
        };
        Ok(meanings.map(role).collect())
    }

    /// Changes all images that are `wanted`, each with its meaning; those of the source's own document only if it is
    /// written, or as far as levels share them. Warns of what was lost.
    fn change(
        &mut self,
        has_source: bool,
        progress: &Progress,
        wanted: impl Fn(&EncodedImage, Use) -> Option<Role>,
        run: impl Fn(&Job) -> Result<Done> + Sync,
    ) -> Result<Warnings> {
        let (mut jobs, mut places) = (Vec::new(), FxHashMap::default());
        self.visit(has_source, |image, own, at| {
            let Some(role) = wanted(image, own) else { return };
            places.entry(key(image, role)).or_insert_with(|| {
                jobs.push(Job { image: image.clone(), role, at });
                jobs.len() - 1
            });
        });
        let done = progress.stage("texture files", jobs.len(), |count| {
            let run = |job: &Job| {
                progress.check("texture files")?;
                let done = run(job)?;
                count.fetch_add(1, Ordering::Relaxed);
                Ok(done)
            };
            jobs.par_iter().map(run).collect::<Result<Vec<Done>>>()
        })?;
        // The jobs hold the images until all have been looked up: no two have one place in memory.
        self.visit(true, |image, own, _| {
            let place = wanted(image, own).and_then(|role| places.get(&key(image, role)));
            if let Some(&place) = place {
                *image = done[place].image.clone();
            }
        });
        let mut warnings = Warnings::default();
        done.into_iter().for_each(|own| warnings.extend(own.warnings));
        Ok(warnings)
    }

    /// Visits all images whose files are there, each with its place.
    fn visit(&mut self, has_source: bool, mut each: impl FnMut(&mut EncodedImage, Use, String)) {
        let mut visit = |image: &mut EncodedImage, own: Use, at: String| {
            if !image.is_missing() {
                each(image, own, at);
            }
        };
        let at = |index: usize| format!("/images/{index}");
        for (index, image) in self.of_source.iter_mut().enumerate().filter(|_| has_source) {
            visit(image, Use::Source(index), at(index));
        }
        for level in &mut *self.of_levels {
            let shown = level.images.iter_mut().enumerate();
            for (index, image) in shown.filter(|(index, _)| !level.left.contains(index)) {
                visit(image, Use::Source(index), at(index));
            }
            for colors in &mut level.colors {
                visit(&mut colors.image, Use::Level(Role::Color), "a gained base color".into());
            }
            for normals in &mut level.normals {
                visit(&mut normals.image, Use::Level(Role::Normal), "a gained normal map".into());
            }
            for (places, image) in level.merged.iter_mut().flat_map(|own| &mut own.images) {
                let role = places.first().map_or(Role::default(), |place| role_of(place));
                visit(image, Use::Level(role), "a merged material".into());
            }
        }
    }
}

/// What tells images apart: the file in memory, and its meaning.
type Key = (usize, Role);

fn key(image: &EncodedImage, role: Role) -> Key {
    (Arc::as_ptr(&image.bytes) as usize, role)
}

/// An image to encode.
struct Job {
    image: EncodedImage,
    role: Role,
    at: String,
}

/// An encoded image, and what was lost on the way.
struct Done {
    image: EncodedImage,
    warnings: Warnings,
}

impl Job {
    fn to_ktx2(&self, limit: MemoryLimit) -> Result<Done> {
        let mut warnings = Warnings::default();
        let texels = decode(&self.image, &self.at, limit)?;
        if texels.color().bytes_per_pixel() > texels.color().channel_count() {
            let what = "it has 16 bits a channel, of which a KTX2 in UASTC keeps 8: use another --texture-format \
                        where they matter";
            warnings.add(&self.at, what);
        }
        let size = [texels.width(), texels.height()].map(|side| side as usize);
        let stored = stored_size(size);
        if stored != size {
            let [[width, height], [wide, high]] = [size, stored];
            warnings.add(
                &self.at,
                format!(
                    "its {width} × {height} texels are stretched to {wide} × {high}, as a KTX2 has sides that are \
                     multiples of four; make them so to keep each texel"
                ),
            );
        }
        let bytes = encode::encode(&texels, self.role)?.into();
        Ok(Done { image: EncodedImage { bytes, format: ImageFormat::Ktx2 }, warnings })
    }

    fn to_smallest_png(&self) -> Result<Done> {
        let bytes = smallest_png::pack(&self.image.bytes)?.into();
        let image = EncodedImage { bytes, format: ImageFormat::Png };
        Ok(Done { image, warnings: Warnings::default() })
    }
}
