//! The images of the levels, sheet by sheet, so that each image of the source is decoded once.

use std::sync::atomic::AtomicUsize;

use image::{ColorType, DynamicImage};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use seamwise_attr::Mesh;
use seamwise_texture::transfer::{
    ImageErrors, Job, Output, Pair, Picture, Reading, Transferred, errors, transfer,
};
use seamwise_texture::{Role, Validity, keep_coverage, repair};

use super::choice::{PLACES, TextureChoice, is_worth, worth};
use super::encode::store;
use super::layout::{ChartGroup, ImageUse, MergeGroup, NewNormals, SourceReading, UvLayout, faces};
use super::merged_images;
use super::options::{BakeNormals, TransferOptions};
use super::original::{Coverage, Origin, Original};
use super::plan::Plan;
use super::sizes::TexelDensity;
use crate::error::{Error, Result};
use crate::image_file::codec::{decode, dimensions};
use crate::image_file::encoded::EncodedImage;
use crate::level::textures::{MergedMaterial, NormalMap};
use crate::surface::geometry::Geometry;

/// Levels gain a normal map for a loss of shading from this RMS angle on, in degrees.
const LOST_SHAPE_DEGREES: f64 = 1.0;

/// The surfaces of a level, with its textures' UVs.
pub(super) struct LevelSurfaces<'a> {
    /// One per surface.
    pub(super) meshes: Vec<&'a Mesh>,
    /// The surfaces with their sources.
    pub(super) pairs: Vec<Pair<'a>>,
}

/// Images of one layout and one size, which are made together.
pub(super) struct Sheet<'a> {
    pub(super) layout: &'a UvLayout,
    /// Width and height of the source's images.
    pub(super) size: [usize; 2],
    /// One per entry of the charts of a merged material: texels of the images it is made of, if any.
    pub(super) texels: Vec<Option<f64>>,
    images: Vec<&'a ImageUse>,
    /// Normal maps that take this size.
    normals: Vec<&'a NewNormals>,
}

/// The images of a sheet for one level.
#[derive(Clone, Debug)]
pub(super) struct Made {
    pub(super) size: [usize; 2],
    /// The images, each with the index of the one that it replaces.
    pub(super) images: Vec<(usize, EncodedImage)>,
    pub(super) normals: Vec<NormalMap>,
    pub(super) merged: Option<MergedMaterial>,
    /// The choices between them and the source's, if one was made: each with the index of the image, or
    /// of the one whose layout a gained normal map has. Levels are told by the caller.
    pub(super) choices: Vec<(usize, TextureChoice)>,
}

impl Made {
    /// Bytes of all files.
    pub(super) fn bytes(&self) -> usize {
        let old = self.images.iter().map(|(_, image)| image.bytes.len());
        let new = self.normals.iter().map(|own| own.image.bytes.len());
        old.chain(new).sum::<usize>() + self.merged.as_ref().map_or(0, MergedMaterial::bytes)
    }
}

impl Made {
    /// Leaves an image, by its number among the choices, to the source's.
    pub(super) fn leave(&mut self, output: usize) {
        let (image, choice) = self.choices[output];
        if choice.gained {
            let before = self.choices[..output].iter();
            let at = before.filter(|(_, other)| other.gained && other.own).count();
            self.normals.remove(at);
        } else {
            self.images.retain(|(own, _)| *own != image);
        }
        self.choices[output].1.own = false;
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
        if let Some(merge_group) = &layout.merge_group {
            sheets.push(merged_sheet(origin, layout, merge_group)?);
        }
        for own in &layout.images {
            let size = image_size(origin, own.image)?;
            let known = sheets[first..].iter().position(|sheet| sheet.size == size);
            let at = known.map_or(sheets.len(), |at| first + at);
            if at == sheets.len() {
                let (images, normals, texels) = (Vec::new(), Vec::new(), Vec::new());
                sheets.push(Sheet { layout, size, texels, images, normals });
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

/// The errors of the images of a job, and of the source's in their place.
fn measure(job: &Job<'_>, images: &[DynamicImage]) -> Result<Vec<ImageErrors>> {
    let read = |(image, output): (&DynamicImage, &Output<'_>)| Picture::new(image, output.role);
    let pictures = images.par_iter().zip(job.outputs).map(read);
    let pictures: Vec<Picture> =
        pictures.collect::<std::result::Result<_, _>>().map_err(Error::internal)?;
    Ok(errors(job, &pictures, PLACES))
}

fn image_size(origin: &Origin<'_>, image: usize) -> Result<[usize; 2]> {
    dimensions(&origin.asset.images[image], &format!("/images/{image}"), origin.limit)
}

/// The sheet of a merged material, as large as the images together that it is made of.
fn merged_sheet<'a>(
    origin: &Origin<'_>,
    layout: &'a UvLayout,
    merge_group: &MergeGroup,
) -> Result<Sheet<'a>> {
    let mut most: FxHashMap<usize, f64> = FxHashMap::default();
    for output in &merge_group.outputs {
        for (material, folded) in merge_group.chart_materials.iter().zip(&output.readings) {
            let Some((image, _)) = folded.source else { continue };
            let [width, height] = image_size(origin, image)?;
            let most = most.entry(*material).or_default();
            *most = most.max((width * height) as f64);
        }
    }
    let of = |material: &usize| most.get(material).copied();
    let side = merged_images::side(merge_group.materials.iter().map(of));
    let texels = merge_group.chart_materials.iter().map(of).collect();
    Ok(Sheet { layout, size: [side; 2], texels, images: Vec::new(), normals: Vec::new() })
}

impl Sheet<'_> {
    /// The source's images, each with what its texels mean.
    fn pictures(&self) -> Vec<(usize, Role)> {
        match &self.layout.merge_group {
            Some(merge_group) => merge_group.pictures(),
            None => self.images.iter().map(|own| (own.image, own.role)).collect(),
        }
    }

    /// The source's images.
    pub(super) fn originals(
        &self,
        origin: &Origin<'_>,
        options: &TransferOptions,
    ) -> Result<Vec<Original>> {
        let read = |(index, role): (usize, Role)| {
            let at = format!("/images/{index}");
            let image = &origin.asset.images[index];
            let decoded;
            let texels = match &origin.repairs[index].result {
                Ok(repaired) => &repaired.texels,
                Err(_) => {
                    decoded = decode(image, &at, origin.limit)?;
                    &decoded
                }
            };
            let picture = Picture::new(texels, role);
            let picture = picture.map_err(|error| Error::invalid(&at, error.to_string()))?;
            let coverage = match options.keep_coverage {
                true => Coverage::of(&origin.repairs[index], texels)?,
                false => None,
            };
            Ok(Original { color: texels.color(), format: image.format, picture, coverage })
        };
        self.pictures().into_par_iter().map(read).collect()
    }

    /// The charts that show each of the source's images.
    pub(super) fn shown(&self) -> Vec<Vec<ChartGroup>> {
        let charts = &self.layout.charts;
        let of = |picture: (usize, Role)| match &self.layout.merge_group {
            Some(merge_group) => {
                let is_shown = |at: &usize| merge_group.shows(*at, picture);
                (0..charts.len()).filter(is_shown).map(|at| charts[at]).collect()
            }
            None => charts.clone(),
        };
        self.pictures().into_iter().map(of).collect()
    }

    /// Texels per length of each entry of the charts; all 1 if it is empty.
    pub(super) fn densities(
        &self,
        texel_density: &TexelDensity,
        surfaces: &[Geometry],
    ) -> Vec<f64> {
        let Some(merge_group) = &self.layout.merge_group else { return Vec::new() };
        let area = |charts| texel_density.used_area(surfaces, std::slice::from_ref(charts));
        let areas: Vec<f64> = self.layout.charts.iter().map(area).collect();
        merged_images::densities(&merge_group.chart_materials, &areas, &self.texels)
    }

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
        let job = Job { pairs, faces, size, wrap, is_in_place, outputs };
        let Transferred { images, normal_degrees_rms } =
            transfer(&job, rows).map_err(Error::internal)?;
        let coverage = |output: usize| {
            originals.get(output).filter(|_| merge_group.is_none()).and_then(|own| own.coverage)
        };
        let fill = |(at, (mut image, validity)): (usize, (DynamicImage, Validity))| {
            if let Some(Coverage { cutoff, share }) = coverage(at) {
                keep_coverage(&mut image, &validity, cutoff, share).map_err(Error::internal)?;
            }
            repair(&mut image, outputs[at].role, &validity, wrap).map_err(Error::internal)?;
            Ok(image)
        };
        let filled = images.into_par_iter().enumerate().map(fill).collect::<Result<Vec<_>>>()?;
        let is_lost =
            options.bake_normals == BakeNormals::On || normal_degrees_rms >= LOST_SHAPE_DEGREES;
        let format = (options.format, options.quality);
        if let Some(merge_group) = merge_group {
            let (had, gains) = (gains, gains && is_lost);
            let merged =
                merged_images::finish(merge_group, originals, (&filled, had), gains, format)?;
            let (images, normals) = (Vec::new(), Vec::new());
            let choices = Vec::new();
            return Ok(Made { size, images, normals, merged: Some(merged), choices });
        }
        let errors = match options.chooses && is_in_place {
            true => Some(measure(&job, &filled)?),
            false => None,
        };
        let is_own = |at: usize| errors.as_ref().is_none_or(|errors| is_worth(&errors[at]));
        let stored = |(at, image): (usize, &DynamicImage)| {
            let is_gained = at >= self.images.len();
            if !is_own(at) || is_gained && !is_lost {
                return Ok(None);
            }
            let own = self.images.get(at);
            let before = own.map(|own| &origin.asset.images[own.image]);
            store(image, outputs[at].role, before, format).map(Some)
        };
        let mut stored: Vec<Option<EncodedImage>> =
            filled.par_iter().enumerate().map(stored).collect::<Result<_>>()?;
        let choices =
            errors.map_or(Vec::new(), |errors| self.choices(origin, size, &errors, &stored));
        let new = stored.split_off(self.images.len());
        let old = self.images.iter().zip(stored);
        let gain = |(normals, image): (&&NewNormals, Option<EncodedImage>)| {
            let (materials, like) = (normals.materials.clone(), normals.like.clone());
            Some(NormalMap { image: image?, materials, like })
        };
        Ok(Made {
            size,
            images: old.filter_map(|(own, image)| Some((own.image, image?))).collect(),
            normals: self.normals.iter().zip(new).filter_map(gain).collect(),
            merged: None,
            choices,
        })
    }

    /// The choices of images of `size`, of which those are stored that are a level's own.
    fn choices(
        &self,
        origin: &Origin<'_>,
        size: [usize; 2],
        errors: &[ImageErrors],
        stored: &[Option<EncodedImage>],
    ) -> Vec<(usize, TextureChoice)> {
        let old = self.images.iter().map(|own| (own.image, own.role, false));
        let new = self.normals.iter().map(|own| (own.image, Role::Normal, true));
        let outputs = old.chain(new).enumerate();
        let share = (size[0] * size[1]) as f64 / (self.size[0] * self.size[1]) as f64;
        let of = |(at, (image, role, gained)): (usize, (usize, Role, bool))| {
            let (errors, own) = (&errors[at], stored[at].as_ref());
            let guess = || (origin.asset.images[image].bytes.len() as f64 * share) as usize;
            let choice = TextureChoice {
                level: 0,
                own: own.is_some(),
                shared_error: errors.shared,
                own_error: errors.own,
                own_size: size,
                worth: worth(errors, role),
                own_bytes: own.map_or_else(guess, |own| own.bytes.len()),
                gained,
            };
            (image, choice)
        };
        outputs.map(of).collect()
    }

    /// The source's images, then the new normal maps.
    fn outputs<'a>(&self, originals: &'a [Original]) -> Vec<Output<'a>> {
        let charts = &self.layout.charts;
        let old = self.images.iter().zip(originals).map(|(own, original)| {
            let reading = |reading: &Option<SourceReading>| {
                let SourceReading { uv_set, transform, wrap, normal_scale } = (*reading)?;
                let (picture, level_normal_scale) = (Some(&original.picture), normal_scale);
                let own = Reading { picture, uv_set, transform, wrap, ..Reading::default() };
                Some(Reading { normal_scale, level_normal_scale, ..own })
            };
            let readings = own.readings.iter().map(reading).collect();
            Output { role: own.role, color: original.color, readings }
        });
        let new = self.normals.iter().map(|normals| {
            let reading =
                |charts: &ChartGroup| normals.charts.contains(charts).then(Reading::default);
            let readings = charts.iter().map(reading).collect();
            Output { role: Role::Normal, color: ColorType::Rgb8, readings }
        });
        old.chain(new).collect()
    }
}
