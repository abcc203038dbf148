//! The images of the levels, sheet by sheet, so that each image of the source is decoded once.

use image::ColorType;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use seamwise_attr::Mesh;
use seamwise_texture::Role;
use seamwise_texture::transfer::{Output, Pair, Picture, Reading};

use super::choice::{Measured, TextureChoice};
use super::layout::{
    ChartGroup, ImageUse, MergeGroup, NewColors, NewNormals, SourceReading, UvLayout,
};
use super::merged_images;
use super::options::{BakeNormals, TransferOptions};
use super::original::{Coverage, Origin, Original};
use super::plan::Plan;
use super::sizes::{MOST_SIDE, Sizes, TexelDensity, as_dense};
use crate::error::{Error, Result};
use crate::image_file::codec::{decode, dimensions};
use crate::image_file::encoded::EncodedImage;
use crate::level::textures::{ColorMap, MergedMaterial, NormalMap};
use crate::surface::geometry::Geometry;

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
    /// Width and height of the source's images, or of as many texels in a new layout.
    pub(super) size: [usize; 2],
    /// One per entry of the charts of a merged material: texels of the images it is made of, if any.
    pub(super) texels: Vec<Option<f64>>,
    pub(super) images: Vec<&'a ImageUse>,
    /// Base colors of what has no images.
    pub(super) colors: Vec<&'a NewColors>,
    /// Normal maps that take this size.
    pub(super) normals: Vec<&'a NewNormals>,
}

/// The images of a sheet for one level.
#[derive(Clone, Debug, Default)]
pub(super) struct Made {
    pub(super) size: [usize; 2],
    /// The images, each with the index of the one that it replaces.
    pub(super) images: Vec<(usize, EncodedImage)>,
    pub(super) colors: Vec<ColorMap>,
    pub(super) normals: Vec<NormalMap>,
    pub(super) merged: Option<MergedMaterial>,
    /// All that they may be, where they are chosen; then nothing is above before the choice is made.
    pub(super) measured: Vec<Measured>,
    /// The choices: each with the index of the image, or of the one whose layout a gained normal map has.
    pub(super) choices: Vec<(usize, TextureChoice)>,
}

impl Made {
    /// Number of images.
    pub(super) fn count(&self) -> usize {
        let merged = self.merged.as_ref().map_or(0, |own| own.images.len());
        self.images.len() + self.colors.len() + self.normals.len() + merged
    }

    /// Bytes of all files.
    pub(super) fn bytes(&self) -> usize {
        let old = self.images.iter().map(|(_, image)| image.bytes.len());
        let new = self.normals.iter().map(|own| own.image.bytes.len());
        let new = new.chain(self.colors.iter().map(|own| own.image.bytes.len()));
        old.chain(new).sum::<usize>() + self.merged.as_ref().map_or(0, MergedMaterial::bytes)
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
            let mut size = image_size(origin, own.image)?;
            if layout.is_new && !matches!(options.sizes, Sizes::Scale(_)) {
                size = as_dense(origin.surfaces, layout, size);
            }
            let known = sheets[first..].iter().position(|sheet| sheet.size == size);
            let at = known.map_or(sheets.len(), |at| first + at);
            if at == sheets.len() {
                sheets.push(Sheet::empty(layout, size));
            }
            sheets[at].images.push(own);
            if options.bake_normals != BakeNormals::Off {
                let is_like = |normals: &&NewNormals| {
                    normals.like.as_ref().is_some_and(|like| like.image == own.image)
                };
                sheets[at].normals.extend(plan.normals.iter().filter(is_like));
            }
        }
        if layout.images.is_empty() && layout.merge_group.is_none() {
            let mut bare = Sheet::empty(layout, [MOST_SIDE; 2]);
            bare.colors.extend(plan.colors.iter().filter(|own| own.charts == layout.charts));
            let is_own = |own: &&NewNormals| own.like.is_none() && own.charts == layout.charts;
            bare.normals.extend(plan.normals.iter().filter(is_own));
            sheets.push(bare);
        }
    }
    Ok(sheets)
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
    Ok(Sheet { texels, ..Sheet::empty(layout, [side; 2]) })
}

impl<'a> Sheet<'a> {
    fn empty(layout: &'a UvLayout, size: [usize; 2]) -> Self {
        let (texels, images, colors, normals) = (vec![], vec![], vec![], vec![]);
        Self { layout, size, texels, images, colors, normals }
    }
}

impl Sheet<'_> {
    /// The source's images, each with what its texels mean.
    pub(super) fn pictures(&self) -> Vec<(usize, Role)> {
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

    /// Takes an image as that of an output.
    pub(super) fn put(&self, made: &mut Made, output: usize, image: Option<EncodedImage>) {
        let Some(image) = image else { return };
        let [old, colors] = [self.images.len(), self.colors.len()];
        if let Some(own) = self.images.get(output) {
            made.images.push((own.image, image));
        } else if let Some(own) = self.colors.get(output - old) {
            made.colors.push(ColorMap { image, materials: own.materials.clone() });
        } else {
            let normals = self.normals[output - old - colors];
            let like = normals.like.as_ref().map(|like| like.at.clone());
            made.normals.push(NormalMap { image, materials: normals.materials.clone(), like });
        }
    }

    /// The source's images, then the new base colors and normal maps.
    pub(super) fn outputs<'a>(&self, originals: &'a [Original]) -> Vec<Output<'a>> {
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
        let colors = self.colors.iter().map(|own| {
            let color = if own.channels == 4 { ColorType::Rgba8 } else { ColorType::Rgb8 };
            let reading = Some(Reading { vertex_colors: true, ..Reading::default() });
            Output { role: Role::Color, color, readings: vec![reading; charts.len()] }
        });
        let new = self.normals.iter().map(|normals| {
            let reading =
                |charts: &ChartGroup| normals.charts.contains(charts).then(Reading::default);
            let readings = charts.iter().map(reading).collect();
            Output { role: Role::Normal, color: ColorType::Rgb8, readings }
        });
        old.chain(colors).chain(new).collect()
    }
}
