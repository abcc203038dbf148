//! The images of merged materials: factors and textures of several in one atlas.

use image::{ColorType, DynamicImage};
use rayon::prelude::*;
use seamwise_texture::transfer::{Output, Reading};

use super::encode::{TextureFormat, store};
use super::layout::{BakedReading, BakedTexture, MergeGroup};
use super::original::Original;
use crate::error::Result;
use crate::image_file::encoded::ImageFormat;
use crate::level::textures::MergedMaterial;

/// Texels along each axis, at most.
const MAX_SIDE_TEXELS: usize = 4096;
/// Texels along each axis that a material without textures adds, squared: enough for the padding
/// between its charts.
const PLAIN: f64 = 64.0 * 64.0;
/// Texels per length are not below this share of the most of any material.
const LEAST_DENSITY: f64 = 1.0 / 16.0;

/// The side of an atlas that holds the texels of materials, one entry each and `None` for one
/// without textures: a power of two, as mip maps and compressed blocks like it best.
pub(super) fn side(texels: impl Iterator<Item = Option<f64>>) -> usize {
    let sum: f64 = texels.map(|own| own.unwrap_or(PLAIN)).sum();
    (sum.sqrt().ceil() as usize).min(MAX_SIDE_TEXELS).next_power_of_two()
}

/// Texels per length of each entry of a layout's charts, over the most of them: as dense as its
/// material's images are, over the area that uses it. `areas` has one per entry, and so has `texels`,
/// with `None` where there are no textures: such are as the least dense of all.
pub(super) fn densities(materials: &[usize], areas: &[f64], texels: &[Option<f64>]) -> Vec<f64> {
    let density = |at: usize| {
        let own = areas.iter().zip(materials).filter(|(_, other)| **other == materials[at]);
        let density = (texels[at]? / own.map(|(area, _)| area).sum::<f64>()).sqrt();
        density.is_finite().then_some(density)
    };
    let densities: Vec<Option<f64>> = (0..materials.len()).map(density).collect();
    let known = || densities.iter().flatten().copied();
    let most = known().fold(0.0, f64::max);
    let least = known().fold(f64::INFINITY, f64::min).min(most);
    let share = |own: Option<f64>| {
        let share = own.unwrap_or(least) / most;
        if share.is_finite() { share.clamp(LEAST_DENSITY, 1.0) } else { 1.0 }
    };
    densities.into_iter().map(share).collect()
}

/// The images of a merge group; without a gained normal map if it `gains` none.
pub(super) fn outputs<'a>(
    merge_group: &MergeGroup,
    originals: &'a [Original],
    gains: bool,
) -> Vec<Output<'a>> {
    let pictures = merge_group.pictures();
    let of = |own: &BakedTexture| {
        let mut is_deep = false;
        let mut reading = |folded: &BakedReading| {
            let &BakedReading { source, factor, offset } = folded;
            let plain = Reading { factor, offset, ..Reading::default() };
            let Some((image, source)) = source else { return plain };
            let at = pictures.iter().position(|picture| *picture == (image, own.role));
            let original = at.map(|at| &originals[at]);
            is_deep |= original.is_some_and(Original::is_deep);
            Reading {
                picture: original.map(|original| &original.picture),
                uv_set: source.uv_set,
                transform: source.transform,
                wrap: source.wrap,
                normal_scale: source.normal_scale,
                ..plain
            }
        };
        let readings = own.readings.iter().map(|own| Some(reading(own))).collect();
        Output { role: own.role, readings, color: color(own.channels, is_deep) }
    };
    made(merge_group, gains).map(of).collect()
}

fn color(channels: usize, is_deep: bool) -> ColorType {
    match (channels, is_deep) {
        (1, false) => ColorType::L8,
        (1, true) => ColorType::L16,
        (4, false) => ColorType::Rgba8,
        (4, true) => ColorType::Rgba16,
        (_, false) => ColorType::Rgb8,
        (_, true) => ColorType::Rgb16,
    }
}

fn made(merge_group: &MergeGroup, gains: bool) -> impl Iterator<Item = &BakedTexture> {
    merge_group.outputs.iter().filter(move |own| gains || !own.is_gained)
}

/// The merged material, of the images that [`outputs`] led to; it keeps a normal map that it gained if
/// it `gains` one.
pub(super) fn finish(
    merge_group: &MergeGroup,
    originals: &[Original],
    (images, had): (&[DynamicImage], bool),
    gains: bool,
    format: (TextureFormat, u8),
) -> Result<MergedMaterial> {
    let pictures = merge_group.pictures();
    let of = |(own, image): (&BakedTexture, &DynamicImage)| {
        let sources = own.readings.iter().filter_map(|own| own.source);
        let mut formats = sources.map(|(image, _)| {
            let at = pictures.iter().position(|picture| *picture == (image, own.role));
            at.map(|at| originals[at].format)
        });
        let is_lossy = formats.clone().next().is_some()
            && formats.all(|format| format == Some(ImageFormat::Jpeg));
        let is_jpeg = is_lossy && !image.color().has_alpha();
        let format = match format {
            (TextureFormat::Keep, quality) if is_jpeg => (TextureFormat::Jpeg, quality),
            asked => asked,
        };
        Ok((own.places.clone(), store(image, own.role, None, format)?))
    };
    let kept: Vec<(&BakedTexture, &DynamicImage)> =
        made(merge_group, had).zip(images).filter(|(own, _)| gains || !own.is_gained).collect();
    Ok(MergedMaterial {
        materials: merge_group.materials.clone(),
        json: merge_group.json.clone(),
        images: kept.into_par_iter().map(of).collect::<Result<_>>()?,
        has_normals: merge_group.has_normals(gains),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_atlas_has_as_many_texels_as_the_images_together_up_to_a_most() {
        assert_eq!(side([Some(64.0 * 64.0), Some(64.0 * 64.0), None].into_iter()), 128);
        assert_eq!(side([Some(1e9)].into_iter()), MAX_SIDE_TEXELS);
        assert_eq!(side([None].into_iter()), 64);
    }

    #[test]
    fn charts_are_as_dense_as_their_images_and_plain_ones_as_the_least() {
        // Two charts of one material share its texels.
        let texels = [Some(400.0), Some(400.0), Some(100.0), None];
        let densities = densities(&[7, 7, 8, 9], &[1.0, 3.0, 4.0, 50.0], &texels);
        assert_eq!(densities, [1.0, 1.0, 0.5, 0.5]);
    }

    #[test]
    fn a_surface_without_area_or_any_image_has_some_density() {
        assert_eq!(densities(&[1, 2], &[0.0, 1.0], &[Some(9.0), Some(4.0)]), [1.0, 1.0]);
        assert_eq!(densities(&[1, 2], &[1.0, 2.0], &[None, None]), [1.0, 1.0]);
        assert_eq!(densities(&[1, 2], &[1.0, 1e9], &[Some(9.0), Some(1.0)]), [1.0, LEAST_DENSITY]);
    }
}
