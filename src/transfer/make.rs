//! The images of the levels, sheet by sheet, so that each image of the source is decoded once.

use std::sync::atomic::AtomicUsize;

use image::{ColorType, DynamicImage, GenericImageView, ImageDecoder};
use rayon::prelude::*;
use seamwise_attr::Mesh;
use seamwise_texture::transfer::{Job, Output, Pair, Picture, Reading, Transferred, transfer};
use seamwise_texture::{Role, Validity, repair};

use super::plan::{Charts, ImageUse, NewNormals, SourceReading, UvLayout, faces};
use super::store::store;
use super::{BakeNormals, Origin, Plan, TransferOptions};
use crate::asset::EncodedImage;
use crate::dress::NormalMap;
use crate::error::{Error, Result};
use crate::images::{decode, open};
use crate::limit::MemoryLimit;

/// Levels gain a normal map for a loss of shading from this RMS angle on, in degrees.
const LOST: f64 = 1.0;

/// A level as it is worn.
pub(super) struct Worn<'a> {
    /// One per surface.
    pub(super) meshes: Vec<&'a Mesh>,
    /// The same with their sources.
    pub(super) pairs: Vec<Pair<'a>>,
}

/// Images of one layout and one size, which are made together.
pub(super) struct Sheet<'a> {
    pub(super) layout: &'a UvLayout,
    /// Width and height of the source's images.
    pub(super) size: [usize; 2],
    images: Vec<&'a ImageUse>,
    /// Normal maps that take this size.
    normals: Vec<&'a NewNormals>,
}

/// The images of a sheet for one level.
#[derive(Clone, Debug)]
pub(super) struct Made {
    pub(super) size: [usize; 2],
    /// With what they replace.
    pub(super) images: Vec<(usize, EncodedImage)>,
    pub(super) normals: Vec<NormalMap>,
}

impl Made {
    /// Of all files.
    pub(super) fn bytes(&self) -> usize {
        let old = self.images.iter().map(|(_, image)| image.bytes.len());
        let new = self.normals.iter().map(|own| own.image.bytes.len());
        old.chain(new).sum()
    }
}

/// The sheets of all layouts.
pub(super) fn sheets<'a>(
    origin: &Origin<'_>,
    plan: &'a Plan,
    options: &TransferOptions,
) -> Result<Vec<Sheet<'a>>> {
    let mut sheets: Vec<Sheet<'a>> = Vec::new();
    for layout in &plan.layouts {
        let first = sheets.len();
        for own in &layout.images {
            let size = header_size(&origin.asset.images[own.image], own.image, origin.limit)?;
            let known = sheets[first..].iter().position(|sheet| sheet.size == size);
            let at = known.map_or(sheets.len(), |at| first + at);
            if at == sheets.len() {
                sheets.push(Sheet { layout, size, images: Vec::new(), normals: Vec::new() });
            }
            sheets[at].images.push(own);
            if options.bake_normals != BakeNormals::Off {
                let new = plan.normals.iter().filter(|normals| normals.image == own.image);
                sheets[at].normals.extend(new);
            }
        }
    }
    Ok(sheets)
}

fn header_size(image: &EncodedImage, index: usize, limit: MemoryLimit) -> Result<[usize; 2]> {
    let at = format!("/images/{index}");
    let (width, height) = match image.format.codec() {
        Some(codec) => open(&image.bytes, codec, limit)
            .map_err(|error| Error::invalid(at, error.to_string()))?
            .dimensions(),
        None => decode(image, &at, limit)?.dimensions(),
    };
    Ok([width as usize, height as usize])
}

/// An image of the source, ready to be read.
pub(super) struct Original {
    color: ColorType,
    pub(super) picture: Picture,
}

impl Sheet<'_> {
    /// The source's images.
    pub(super) fn originals(&self, origin: &Origin<'_>) -> Result<Vec<Original>> {
        let read = |own: &&ImageUse| {
            let at = format!("/images/{}", own.image);
            let decoded;
            let texels = match &origin.repairs[own.image].result {
                Ok(repaired) => &repaired.texels,
                Err(_) => {
                    decoded = decode(&origin.asset.images[own.image], &at, origin.limit)?;
                    &decoded
                }
            };
            let picture = Picture::new(texels, own.role);
            let picture = picture.map_err(|error| Error::invalid(&at, error.to_string()))?;
            Ok(Original { color: texels.color(), picture })
        };
        self.images.par_iter().map(read).collect()
    }

    /// Makes the images for one level, `size` texels large. `rows` counts those that are done.
    pub(super) fn make(
        &self,
        origin: &Origin<'_>,
        originals: &[Original],
        (worn, size): (&Worn<'_>, [usize; 2]),
        options: &TransferOptions,
        rows: &AtomicUsize,
    ) -> Result<Made> {
        let (wrap, is_in_place) = (self.layout.wrap, !self.layout.is_new);
        let outputs = self.outputs(originals);
        let faces = faces(&self.layout.charts, &worn.meshes);
        let (pairs, faces, outputs) = (&worn.pairs[..], &faces[..], &outputs[..]);
        let job = Job { pairs, faces, size, wrap, is_in_place, outputs };
        let internal = |error: seamwise_texture::Error| Error::Internal { what: error.to_string() };
        let Transferred { images, normal_degrees_rms } = transfer(&job, rows).map_err(internal)?;
        let fill = |((mut image, validity), output): ((DynamicImage, Validity), &Output<'_>)| {
            repair(&mut image, output.role, &validity, wrap).map_err(internal)?;
            Ok(image)
        };
        let filled = images.into_par_iter().zip(outputs).map(fill).collect::<Result<Vec<_>>>()?;
        let (old, new) = filled.split_at(self.images.len());
        let format = (options.format, options.quality);
        let finish = |(own, image): (&&ImageUse, &DynamicImage)| {
            let before = &origin.asset.images[own.image];
            Ok((own.image, store(image, own.role, Some(before), format)?))
        };
        let is_lost = options.bake_normals == BakeNormals::On || normal_degrees_rms >= LOST;
        let gain = |(normals, image): (&&NewNormals, &DynamicImage)| {
            let (materials, like) = (normals.materials.clone(), normals.like.clone());
            Ok(NormalMap { image: store(image, Role::Normal, None, format)?, materials, like })
        };
        Ok(Made {
            size,
            images: self.images.par_iter().zip(old).map(finish).collect::<Result<_>>()?,
            normals: match is_lost {
                true => self.normals.par_iter().zip(new).map(gain).collect::<Result<_>>()?,
                false => Vec::new(),
            },
        })
    }

    /// The source's images, then the new normal maps.
    fn outputs<'a>(&self, originals: &'a [Original]) -> Vec<Output<'a>> {
        let charts = &self.layout.charts;
        let old = self.images.iter().zip(originals).map(|(own, original)| {
            let reading = |reading: &Option<SourceReading>| {
                let SourceReading { uv_set, transform, wrap, normal_scale } = (*reading)?;
                let (picture, level_normal_scale) = (Some(&original.picture), normal_scale);
                Some(Reading { picture, uv_set, transform, wrap, normal_scale, level_normal_scale })
            };
            let readings = own.readings.iter().map(reading).collect();
            Output { role: own.role, color: original.color, readings }
        });
        let new = self.normals.iter().map(|normals| {
            let reading = |charts: &Charts| normals.charts.contains(charts).then(Reading::default);
            let readings = charts.iter().map(reading).collect();
            Output { role: Role::Normal, color: ColorType::Rgb8, readings }
        });
        old.chain(new).collect()
    }
}
