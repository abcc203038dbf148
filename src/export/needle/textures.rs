//! The sizes of each texture as files: halves of halves, the smallest inside the file that is opened.
//!
//! Each texel of a half is the mean over its exact extent, as [`seamwise_texture::scale_down`] has it. An image
//! that is no picture of one meaning stays whole inside, and so does one of a texture that names two images.

use image::DynamicImage;
use rayon::prelude::*;
use seamwise_texture::{Role, Validity, scale_down};
use serde_json::{Value, json};

use super::extension::Beside;
use super::sources::Sources;
use crate::atlas::meanings::meanings;
use crate::document::asset::Asset;
use crate::document::material::sources;
use crate::error::{Error, Result};
use crate::image_file::codec::{EncodeOptions, decode, encode_anew};
use crate::image_file::encoded::{EncodedImage, ImageFormat};
use crate::image_file::ktx2;
use crate::limit::MemoryLimit;

/// Most texels along a side of an image inside the file that is opened.
const MOST_INSIDE: u32 = 128;

/// The textures of the document that is opened.
pub(super) struct TextureFiles {
    /// One per image of the source: as it is inside.
    pub(super) images: Vec<EncodedImage>,
    /// Textures with what leads to their larger sizes.
    pub(super) textures: Vec<(usize, Value)>,
}

/// An image in one size.
struct Size {
    width: u32,
    height: u32,
    file: EncodedImage,
}

/// Writes the larger sizes of all textures.
pub(super) fn texture_files(input: &Sources<'_>, beside: &mut Beside<'_>) -> Result<TextureFiles> {
    let Sources { asset, images, limit, .. } = *input;
    let users = users(asset)?;
    let meanings = meanings(asset, limit)?;
    let jobs = images.par_iter().zip(meanings).zip(&users).enumerate();
    let sizes = jobs.map(|(index, ((image, meaning), users))| match (meaning, users) {
        (Ok(role), Some(users)) if !users.is_empty() => sizes(image, index, role, limit),
        _ => Ok(Vec::new()),
    });
    let sizes: Vec<Vec<Size>> = sizes.collect::<Result<_>>()?;
    let mut files = TextureFiles { images: images.to_vec(), textures: Vec::new() };
    for (index, (mut sizes, users)) in sizes.into_iter().zip(users).enumerate() {
        let (Some(users), Some(inside)) = (users, sizes.pop()) else { continue };
        files.images[index] = inside.file;
        let document = |size: &Size| {
            let name = format!("image{index}_{}x{}", size.width, size.height);
            (name, document(asset, &users, size.file.clone()))
        };
        let documents = sizes.iter().map(document).collect();
        let places: Vec<String> = (0..users.len()).map(|own| format!("/textures/{own}")).collect();
        let (guids, mut lods) = beside.add(documents, &places)?;
        for (lod, size) in lods.iter_mut().zip(&sizes) {
            (lod["width"], lod["height"]) = (json!(size.width), json!(size.height));
        }
        let told = guids.iter().map(|guid| json!({"guid": guid, "lods": lods}));
        files.textures.extend(users.into_iter().zip(told));
    }
    Ok(files)
}

/// One per image: the textures that show it; none if one of them names another image too.
fn users(asset: &Asset) -> Result<Vec<Option<Vec<usize>>>> {
    let mut users = vec![Some(Vec::new()); asset.count("images")];
    for texture in 0..asset.count("textures") {
        match &sources(asset, &format!("/textures/{texture}"))?[..] {
            [image] => users[*image].iter_mut().for_each(|own| own.push(texture)),
            several => several.iter().for_each(|&image| users[image] = None),
        }
    }
    Ok(users)
}

/// An image and its halves, down to what stays inside; none at all if it is small enough itself.
fn sizes(image: &EncodedImage, index: usize, role: Role, limit: MemoryLimit) -> Result<Vec<Size>> {
    let texels = decode(image, &format!("/images/{index}"), limit)?;
    let [width, height] = [texels.width(), texels.height()];
    let mut sizes = vec![Size { width, height, file: image.clone() }];
    let all = Validity::from_flags(
        width as usize,
        height as usize,
        vec![true; width as usize * height as usize],
    );
    for halvings in 1.. {
        if width.max(height) >> (halvings - 1) <= MOST_INSIDE {
            break;
        }
        let (half, _) = scale_down(&texels, role, &all, halvings).map_err(Error::internal)?;
        let file = store(&half, role, image)?;
        sizes.push(Size { width: half.width(), height: half.height(), file });
    }
    Ok(if sizes.len() > 1 { sizes } else { Vec::new() })
}

/// Stores a half as the whole is stored.
fn store(half: &DynamicImage, role: Role, whole: &EncodedImage) -> Result<EncodedImage> {
    if whole.format == ImageFormat::Ktx2 && ktx2::encode::check_built().is_ok() {
        let bytes = ktx2::encode::encode(half, role)?.into();
        return Ok(EncodedImage { bytes, format: ImageFormat::Ktx2 });
    }
    encode_anew(half, whole, EncodeOptions::default())
}

/// A document of the textures that show an image, each with its sampler.
fn document(asset: &Asset, users: &[usize], image: EncodedImage) -> Asset {
    let mut samplers: Vec<Value> = Vec::new();
    let texture = |&texture: &usize| {
        let mut json = json!({"source": 0});
        let sampler = asset.json["textures"][texture]["sampler"].as_u64();
        if let Some(sampler) = sampler.map(|own| &asset.json["samplers"][own as usize]) {
            let known = samplers.iter().position(|own| own == sampler);
            json["sampler"] = json!(known.unwrap_or(samplers.len()));
            if known.is_none() {
                samplers.push(sampler.clone());
            }
        }
        json
    };
    let textures: Vec<Value> = users.iter().map(texture).collect();
    let mut json = json!({"asset": {"version": "2.0"}, "textures": textures, "images": [{}]});
    if !samplers.is_empty() {
        json["samplers"] = json!(samplers);
    }
    Asset { json, images: vec![image], ..Asset::default() }
}
