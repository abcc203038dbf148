//! The sizes of images that a choice is among, each held against the source.

use seamwise_texture::transfer::{ImageErrors, Job, Picture, errors};

use super::choice::{Candidate, Measured, PLACES};
use super::original::Origin;
use super::sheet::{Made, Sheet};
use crate::error::Result;
use crate::image_file::encoded::EncodedImage;
use crate::image_file::ktx2::encode::bytes_with_mips;

impl Sheet<'_> {
    /// Takes what was chosen for a level, one per output.
    pub(super) fn take(&self, made: &mut Made, level: usize, picks: &[Option<usize>]) {
        for (at, (mut own, pick)) in
            std::mem::take(&mut made.measured).into_iter().zip(picks).enumerate()
        {
            made.choices.push((own.image, own.choice(level, *pick)));
            self.put(made, at, pick.map(|pick| own.own.swap_remove(pick).1));
        }
    }

    /// Holds the images of each output, as they are stored, against the source.
    pub(super) fn measure(
        &self,
        job: &Job<'_>,
        stored: Vec<Vec<(EncodedImage, Picture)>>,
        origin: &Origin<'_>,
        in_blocks: bool,
    ) -> Result<Vec<Measured>> {
        let bytes = |image: &EncodedImage, size: [usize; 2]| match in_blocks {
            true => bytes_with_mips(size),
            false => image.bytes.len(),
        };
        let (stored, pictures): (Vec<Vec<EncodedImage>>, Vec<Vec<Picture>>) =
            stored.into_iter().map(|own| own.into_iter().unzip()).unzip();
        let size = |picture: &Picture| [0, 1].map(|axis| picture.size()[axis] as usize);
        let sizes: Vec<Vec<_>> =
            pictures.iter().map(|own| own.iter().map(size).collect()).collect();
        let errors = errors(job, &pictures, PLACES);
        let old = self.images.iter().map(|own| (own.image, false));
        // A choice is among images in the source's layout alone, each of which is like another.
        let gained = self.normals.iter().filter_map(|own| Some((own.like.as_ref()?.image, true)));
        let uses = old.chain(gained);
        let of = |(at, ((image, gained), files)): (usize, ((usize, bool), Vec<EncodedImage>))| {
            let ImageErrors { shared, own, share } = &errors[at];
            let own = files.into_iter().zip(own).zip(&sizes[at]).map(|((file, &error), &size)| {
                (Candidate { size, bytes: bytes(&file, size), error }, file)
            });
            let (role, own) = (job.outputs[at].role, own.collect());
            let in_file = origin.has_level_files_alone && !gained;
            let shared_bytes = if in_file { bytes(&origin.images[image], self.size) } else { 0 };
            Measured {
                shared_bytes,
                image,
                role,
                gained,
                shared_error: *shared,
                share: *share,
                own,
            }
        };
        Ok(uses.zip(stored).enumerate().map(of).collect())
    }
}
