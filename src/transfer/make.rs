//! The images of a sheet for one level: their texels, then filled, chosen among or merged, and compressed.

use std::sync::atomic::AtomicUsize;

use image::DynamicImage;
use rayon::prelude::*;
use seamwise_texture::transfer::{Gained, Job, Output, Transferred, transfer};
use seamwise_texture::{Validity, keep_coverage, repair};

use super::choice::{Measured, smaller};
use super::encode::{store, store_to_read};
use super::layout::{MergeGroup, faces};
use super::merged_images;
use super::options::{BakeNormals, TransferOptions};
use super::original::{Coverage, Origin, Original};
use super::sheet::{LevelSurfaces, Made, Sheet};
use crate::error::{Error, Result};
use crate::image_file::encoded::EncodedImage;
use crate::level::textures::MergedMaterial;

/// Levels gain a normal map for a loss of shading from this RMS angle on, in degrees.
///
/// Lab note (`bake --textures auto --views 6 --samples 50000`, six assets at 25 and 6.25 %, six at 50 and 12.5 %):
/// over 1°, 0.5° moves two levels of 24, popcorn's of 25 % to 0.937 of the luminance, 0.825 of the color and 1.17
/// of the bytes, gelatin_box's of 50 % to 0.956 of the luminance and 1.70 of the bytes, from 0.28 MB.
const LOST_SHAPE_DEGREES: f64 = 0.5;

impl Sheet<'_> {
    /// Makes the images for one level, `size` texels large. `rows` counts those that are done.
    pub(super) fn make(
        &self,
        origin: &Origin<'_>,
        originals: &[Original],
        (level, size): (&LevelSurfaces<'_>, [usize; 2]),
        options: &TransferOptions,
        rows: &AtomicUsize,
    ) -> Result<Made> {
        let (wrap, is_in_place) = (self.layout.wrap, !self.layout.is_new);
        let merge_group = self.layout.merge_group.as_ref();
        let gains = options.bake_normals != BakeNormals::Off;
        let outputs = match merge_group {
            Some(merge_group) => merged_images::outputs(merge_group, originals, gains),
            None => self.outputs(originals),
        };
        let faces = faces(&self.layout.charts, &level.meshes);
        let (pairs, faces, outputs) = (&level.pairs[..], &faces[..], &outputs[..]);
        let is_optional = options.bake_normals == BakeNormals::Auto && merge_group.is_none();
        let first = self.images.len() + self.colors.len();
        let gained = Gained { first, least_degrees: LOST_SHAPE_DEGREES };
        let gained = Some(gained).filter(|own| is_optional && own.first < outputs.len());
        let job = Job { pairs, faces, size, wrap, is_in_place, outputs, gained };
        let Transferred { images, normal_degrees_rms } =
            transfer(&job, rows).map_err(Error::internal)?;
        let is_lost =
            options.bake_normals == BakeNormals::On || normal_degrees_rms >= LOST_SHAPE_DEGREES;
        let finish =
            Finish { sheet: self, origin, originals, options, outputs, gained: first, is_lost };
        let mut made = Made { size, ..Made::default() };
        match merge_group {
            Some(group) => made.merged = Some(finish.merged(group, images)?),
            None if options.chooses && is_in_place => {
                made.measured = finish.candidates(&job, &images)?;
            }
            None => {
                for (at, image) in finish.files(images)?.into_iter().enumerate() {
                    self.put(&mut made, at, image);
                }
            }
        }
        Ok(made)
    }
}

/// One image per output, with which of its texels have a place on the level.
type Texels = Vec<(DynamicImage, Validity)>;

/// The images of a sheet for one level, on their way into files.
struct Finish<'a> {
    sheet: &'a Sheet<'a>,
    origin: &'a Origin<'a>,
    originals: &'a [Original],
    options: &'a TransferOptions,
    outputs: &'a [Output<'a>],
    /// Outputs from this one on are normal maps that the source lacks, wanted if so much shape is lost.
    gained: usize,
    /// Whether shading has lost enough for that.
    is_lost: bool,
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
    fn candidates(&self, job: &Job<'_>, images: &Texels) -> Result<Vec<Measured>> {
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
    fn merged(&self, group: &MergeGroup, images: Texels) -> Result<MergedMaterial> {
        let filled = self.fill_all(images)?;
        let had = self.options.bake_normals != BakeNormals::Off;
        let format = (self.options.format, self.options.quality);
        let gains = had && self.is_lost;
        merged_images::finish(group, self.originals, (&filled, had), gains, format)
    }

    /// One file per output that is wanted.
    fn files(&self, images: Texels) -> Result<Vec<Option<EncodedImage>>> {
        let filled = self.fill_all(images)?;
        let format = (self.options.format, self.options.quality);
        let file = |(at, image): (usize, &DynamicImage)| match self.is_wanted(at) {
            true => store(image, self.outputs[at].role, self.before(at), format).map(Some),
            false => Ok(None),
        };
        filled.par_iter().enumerate().map(file).collect()
    }
}
