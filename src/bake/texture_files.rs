//! The files of textures, once all are made: in KTX2 for graphics processors.
//!
//! Each image is encoded once, however many levels share it. What is no picture stays as it is: an image whose charts are
//! single colors, which blocks of 4 × 4 texels would mix, and one that is read both as color and as other data, of
//! which a file can be only one.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use rayon::prelude::*;
use rustc_hash::FxHashMap;
use seamwise_texture::Role;

use super::options::BakeOptions;
use crate::atlas::atlases;
use crate::document::asset::Asset;
use crate::document::material::{TextureSlot, material_slots, role_of};
use crate::error::Result;
use crate::export::files::Layout;
use crate::image_file::codec::{decode, dimensions};
use crate::image_file::encoded::{EncodedImage, ImageFormat};
use crate::image_file::ktx2::encode::{self, stored_size};
use crate::level::textures::LevelTextures;
use crate::limit::MemoryLimit;
use crate::progress::Progress;
use crate::warning::Warnings;

/// The images of a bake, each in the file it came in or was made in.
pub(super) struct Images<'a> {
    pub(super) asset: &'a Asset,
    /// Those of the source, filled if they are to be.
    pub(super) of_source: &'a mut [EncodedImage],
    /// Those of the levels.
    pub(super) of_levels: &'a mut [LevelTextures],
}

impl Images<'_> {
    /// Makes them KTX2, if the options ask for it.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if one is damaged or takes more memory than the limit.
    pub(super) fn finish(
        &mut self,
        options: &BakeOptions,
        progress: &Progress,
    ) -> Result<Warnings> {
        let mut warnings = Warnings::default();
        if !options.texture_files.ktx2 {
            return Ok(warnings);
        }
        let limit = options.reading.memory_limit;
        let roles = self.roles(limit, &mut warnings)?;
        // Where each level is a file, the source's images are written only as far as levels share them.
        let has_source = options.output.layout != Layout::None || options.output.progressive;
        let (mut jobs, mut places) = (Vec::new(), FxHashMap::default());
        self.visit(&roles, has_source, |image, role, at| {
            places.entry(key(image, role)).or_insert_with(|| {
                jobs.push(Job { image: image.clone(), role, at: at.to_owned() });
                jobs.len() - 1
            });
        });
        let done = progress.stage("ktx2", jobs.len(), |count| {
            let run = |job: &Job| {
                progress.check("ktx2")?;
                let done = job.run(limit)?;
                count.fetch_add(1, Ordering::Relaxed);
                Ok(done)
            };
            jobs.par_iter().map(run).collect::<Result<Vec<Done>>>()
        })?;
        self.visit(&roles, true, |image, role, _| {
            if let Some(&place) = places.get(&key(image, role)) {
                *image = done[place].image.clone();
            }
        });
        done.into_iter().for_each(|own| warnings.extend(own.warnings));
        Ok(warnings)
    }

    /// The meaning of each of the source's images that becomes KTX2.
    fn roles(&self, limit: MemoryLimit, warnings: &mut Warnings) -> Result<Vec<Option<Role>>> {
        let mut roles = vec![None; self.of_source.len()];
        let slots = material_slots(self.asset)?.concat();
        let is_color = |slot: &TextureSlot| slot.role == Role::Color;
        for atlas in atlases(self.asset)? {
            let image = &self.asset.images[atlas.image];
            if image.is_missing() {
                continue;
            }
            let at = format!("/images/{}", atlas.image);
            let mut own = slots.iter().filter(|slot| slot.image == atlas.image);
            if own.clone().any(is_color) && !own.all(is_color) {
                let what = "it is used both as color and as other data, and a KTX2 can be only one: it stays as it \
                            is; give each use an image of its own";
                warnings.add(&at, what);
                continue;
            }
            if atlas.charts.are_colors(dimensions(image, &at, limit)?) {
                let what = "its charts are single colors, which the blocks of a KTX2 would mix: it stays as it is";
                warnings.add(&at, what);
                continue;
            }
            roles[atlas.image] = Some(atlas.role);
        }
        Ok(roles)
    }

    /// Visits all images that may become KTX2, each with its meaning and its place; those of the source's own document
    /// only if it is written.
    fn visit(
        &mut self,
        roles: &[Option<Role>],
        has_source: bool,
        mut each: impl FnMut(&mut EncodedImage, Role, &str),
    ) {
        let mut visit = |image: &mut EncodedImage, role: Role, at: &str| {
            if !image.is_missing() && image.format != ImageFormat::Ktx2 {
                each(image, role, at);
            }
        };
        let own = |index: usize| roles[index].map(|role| (role, format!("/images/{index}")));
        for (index, image) in self.of_source.iter_mut().enumerate().filter(|_| has_source) {
            if let Some((role, at)) = own(index) {
                visit(image, role, &at);
            }
        }
        for level in &mut *self.of_levels {
            for (index, image) in level.images.iter_mut().enumerate() {
                if let Some((role, at)) = own(index).filter(|_| !level.left.contains(&index)) {
                    visit(image, role, &at);
                }
            }
            for normals in &mut level.normals {
                visit(&mut normals.image, Role::Normal, "a gained normal map");
            }
            for (places, image) in level.merged.iter_mut().flat_map(|own| &mut own.images) {
                visit(image, role_of(places.first().copied().unwrap_or("")), "a merged material");
            }
        }
    }
}

/// What tells images apart: the file in memory, and its meaning.
type Key = (usize, u8);

fn key(image: &EncodedImage, role: Role) -> Key {
    (Arc::as_ptr(&image.bytes) as usize, role as u8)
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
    fn run(&self, limit: MemoryLimit) -> Result<Done> {
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
}
