//! From texels that are made to images as they are written: filled, chosen among or merged, and compressed.

use image::DynamicImage;
use rayon::prelude::*;
use seamwise_texture::transfer::{Job, Output};
use seamwise_texture::{Validity, keep_coverage, repair};

use super::choice::{Measured, smaller};
use super::encode::{store, store_to_read};
use super::layout::MergeGroup;
use super::merged_images;
use super::options::{BakeNormals, TransferOptions};
use super::original::{Coverage, Origin, Original};
use super::sheet::Sheet;
use crate::error::{Error, Result};
use crate::image_file::encoded::EncodedImage;
use crate::level::textures::MergedMaterial;

/// One image per output, with which of its texels have a place on the level.
type Texels = Vec<(DynamicImage, Validity)>;

/// The images of a sheet for one level, on their way into files.
pub(super) struct Finish<'a> {
    pub(super) sheet: &'a Sheet<'a>,
    pub(super) origin: &'a Origin<'a>,
    pub(super) originals: &'a [Original],
    pub(super) options: &'a TransferOptions,
    pub(super) outputs: &'a [Output<'a>],
    /// Outputs from this one on are normal maps that the source lacks, wanted if so much shape is lost.
    pub(super) gained: usize,
    pub(super) is_lost: bool,
}

impl Finish<'_> {
    fn is_wanted(&self, output: usize) -> bool {
        output < self.gained || self.is_lost
    }

    /// The image of the source that an output replaces.
    fn before(&self, output: usize) -> Option<&EncodedImage> {
        self.sheet.images.get(output).map(|own| &self.origin.asset.images[own.image])
    }

    /// Gives texels without a place what filtering may read there, and cut-outs the coverage of the source.
    fn fill(
        &self,
        output: usize,
        mut image: DynamicImage,
        validity: &Validity,
    ) -> Result<DynamicImage> {
        let is_merged = self.sheet.layout.merge_group.is_some();
        let original = self.originals.get(output).filter(|_| !is_merged);
        if let Some(Coverage { cutoff, share }) = original.and_then(|own| own.coverage) {
            keep_coverage(&mut image, validity, cutoff, share).map_err(Error::internal)?;
        }
        let (role, wrap) = (self.outputs[output].role, self.sheet.layout.wrap);
        repair(&mut image, role, validity, wrap).map_err(Error::internal)?;
        Ok(image)
    }

    fn fill_all(&self, images: Texels) -> Result<Vec<DynamicImage>> {
        let images = images.into_par_iter().enumerate();
        images.map(|(at, (image, validity))| self.fill(at, image, &validity)).collect()
    }

    /// The images in several sizes each, stored and held against the source.
    pub(super) fn candidates(&self, job: &Job<'_>, images: &Texels) -> Result<Vec<Measured>> {
        let TransferOptions { format, quality, in_blocks, .. } = *self.options;
        let of = |(at, image): (usize, &(DynamicImage, Validity))| {
            let role = self.outputs[at].role;
            let one = |(image, validity): (DynamicImage, Validity)| {
                let image = self.fill(at, image, &validity)?;
                store_to_read(&image, role, self.before(at), (format, quality), self.origin.limit)
            };
            let smaller = smaller(image, role, (self.is_wanted(at), in_blocks))?;
            smaller.into_par_iter().map(one).collect::<Result<Vec<_>>>()
        };
        let stored = images.par_iter().enumerate().map(of);
        let mut stored = stored.collect::<Result<Vec<_>>>()?;
        stored.resize_with(self.outputs.len(), Vec::new);
        self.sheet.measure(job, stored, self.origin, in_blocks)
    }

    /// The images of a merged material.
    pub(super) fn merged(&self, group: &MergeGroup, images: Texels) -> Result<MergedMaterial> {
        let filled = self.fill_all(images)?;
        let had = self.options.bake_normals != BakeNormals::Off;
        let format = (self.options.format, self.options.quality);
        let gains = had && self.is_lost;
        merged_images::finish(group, self.originals, (&filled, had), gains, format)
    }

    /// One file per output that is wanted.
    pub(super) fn files(&self, images: Texels) -> Result<Vec<Option<EncodedImage>>> {
        let filled = self.fill_all(images)?;
        let format = (self.options.format, self.options.quality);
        let file = |(at, image): (usize, &DynamicImage)| match self.is_wanted(at) {
            true => store(image, self.outputs[at].role, self.before(at), format).map(Some),
            false => Ok(None),
        };
        filled.par_iter().enumerate().map(file).collect()
    }
}
