//! Which texels of an asset's images its surfaces wear, and the repair of all others.

use glam::{Affine2, Vec2};
use image::DynamicImage;
use rayon::prelude::*;
use seamwise_texture::{Role, Validity, Wrap, repair};
use serde_json::Value;

use crate::asset::{Asset, EncodedImage};
use crate::error::{Error, Result};
use crate::images::{decode, encode};
use crate::primitive::Primitive;
use crate::textures::{TextureSlot, slots};

/// An image as an atlas: what its texels mean and which charts lie in it.
#[derive(Clone, Debug)]
pub struct Atlas {
    /// The image.
    pub image: usize,
    /// What its texels mean.
    pub role: Role,
    /// How it is read beyond its edges.
    pub wrap: [Wrap; 2],
    /// The surfaces that wear it.
    pub charts: Vec<Charts>,
    /// Whether points or lines wear it too, of which no chart tells.
    pub beyond_charts: bool,
}

/// The UV triangles of one primitive.
#[derive(Clone, Debug, PartialEq)]
pub struct Charts {
    /// One per vertex, after the texture's own transform.
    pub uvs: Vec<Vec2>,
    /// Indices into `uvs`.
    pub triangles: Vec<[u32; 3]>,
}

/// Every image that a material of some primitive uses, in the order of the document.
///
/// # Errors
/// [`Error::Invalid`] or [`Error::Unsupported`] with the place in the document.
pub fn atlases(asset: &Asset) -> Result<Vec<Atlas>> {
    let materials: Vec<Vec<TextureSlot>> =
        (0..asset.count("materials")).map(|m| slots(asset, m)).collect::<Result<_>>()?;
    let mut atlases: Vec<Option<Atlas>> = vec![None; asset.count("images")];
    for mesh in 0..asset.count("meshes") {
        for primitive in Primitive::of_mesh(asset, mesh)? {
            add_primitive(asset, &primitive, &materials, &mut atlases)?;
        }
    }
    Ok(atlases.into_iter().flatten().collect())
}

fn add_primitive(
    asset: &Asset,
    primitive: &Primitive,
    materials: &[Vec<TextureSlot>],
    atlases: &mut [Option<Atlas>],
) -> Result<()> {
    let worn = primitive.material.into_iter().chain(variants(asset, primitive)?);
    let slots: Vec<&TextureSlot> = worn.flat_map(|material| &materials[material]).collect();
    let mut seen: Vec<(usize, usize, Affine2)> = Vec::new();
    for slot in slots {
        let atlas = atlases[slot.image].get_or_insert_with(|| Atlas {
            image: slot.image,
            role: slot.role,
            wrap: slot.wrap,
            charts: Vec::new(),
            beyond_charts: false,
        });
        atlas.role = main_role(atlas.role, slot.role);
        atlas.beyond_charts |= !primitive.is_surface();
        let reading = (slot.image, slot.uv_set, slot.transform);
        if primitive.is_surface() && !seen.contains(&reading) {
            atlas.charts.extend(read_charts(asset, primitive, slot)?);
            seen.push(reading);
        }
    }
    Ok(())
}

/// The role of an image that is used in two: a color says most about what its texels mean.
fn main_role(a: Role, b: Role) -> Role {
    match (a, b) {
        (Role::Color, _) | (_, Role::Color) => Role::Color,
        (Role::Normal, _) | (_, Role::Normal) => Role::Normal,
        _ => Role::Data,
    }
}

/// Further materials that `KHR_materials_variants` puts on a primitive.
fn variants(asset: &Asset, primitive: &Primitive) -> Result<Vec<usize>> {
    let at = format!("{}/extensions/KHR_materials_variants/mappings", primitive.at);
    let mappings = asset.json.pointer(&at).and_then(Value::as_array).map_or(0, Vec::len);
    let material = |mapping| asset.reference(&format!("{at}/{mapping}"), "material", "materials");
    (0..mappings).filter_map(|mapping| material(mapping).transpose()).collect()
}

fn read_charts(asset: &Asset, primitive: &Primitive, slot: &TextureSlot) -> Result<Option<Charts>> {
    let vertices = primitive.positions(asset)?.len();
    let name = format!("TEXCOORD_{}", slot.uv_set);
    let Some(uvs) = primitive.floats(asset, &name, 2, vertices)? else {
        return Ok(None);
    };
    let uvs =
        uvs.as_chunks().0.iter().map(|&uv| slot.transform.transform_point2(Vec2::from_array(uv)));
    let triangles = primitive.triangles(asset, vertices)?;
    Ok(Some(Charts { uvs: uvs.collect(), triangles }))
}

impl Atlas {
    /// All charts as one list of triangles.
    pub fn joined_charts(&self) -> Charts {
        let mut joined = Charts { uvs: Vec::new(), triangles: Vec::new() };
        for charts in &self.charts {
            let first = joined.uvs.len() as u32;
            joined.uvs.extend(&charts.uvs);
            joined.triangles.extend(charts.triangles.iter().map(|t| t.map(|uv| uv + first)));
        }
        joined
    }

    /// Which texels of a `width` × `height` image the charts cover.
    pub fn validity(&self, width: usize, height: usize) -> Validity {
        let charts = self.joined_charts();
        Validity::from_charts(width, height, self.wrap, &charts.uvs, &charts.triangles)
    }
}

/// What the repair did to one image.
#[derive(Clone, Debug)]
pub struct Repaired {
    /// The image.
    pub image: usize,
    /// Its texels, repaired.
    pub texels: DynamicImage,
    /// How many texels the charts cover.
    pub covered: usize,
    /// How many were filled.
    pub filled: usize,
}

/// Repairs every atlas of an asset whose charts leave texels uncovered. Images that no surface
/// wears, that points or lines wear too, or that are covered whole are left alone.
///
/// # Errors
/// [`Error::Invalid`] if an image is damaged.
pub fn repair_all(asset: &Asset) -> Result<Vec<Repaired>> {
    let atlases = atlases(asset)?;
    let repaired: Result<Vec<Option<Repaired>>> =
        atlases.par_iter().map(|atlas| repair_one(asset, atlas)).collect();
    Ok(repaired?.into_iter().flatten().collect())
}

fn repair_one(asset: &Asset, atlas: &Atlas) -> Result<Option<Repaired>> {
    if atlas.beyond_charts || atlas.charts.is_empty() {
        return Ok(None);
    }
    let at = format!("/images/{}", atlas.image);
    let mut texels = decode(&asset.images[atlas.image], &at)?;
    let validity = atlas.validity(texels.width() as usize, texels.height() as usize);
    if validity.valid() == 0 || validity.invalid() == 0 {
        return Ok(None);
    }
    let outcome = repair(&mut texels, atlas.role, &validity, atlas.wrap)
        .map_err(|error| Error::invalid(&at, error.to_string()))?;
    Ok(Some(Repaired {
        image: atlas.image,
        texels,
        covered: validity.valid(),
        filled: outcome.filled,
    }))
}

/// The asset's images with the repaired ones in their places, each in the format it came in.
///
/// # Errors
/// [`Error::Internal`] if an encoder refuses its texels.
pub fn encode_repaired(asset: &Asset, repaired: &[Repaired]) -> Result<Vec<EncodedImage>> {
    let mut images = asset.images.clone();
    let encoded: Vec<EncodedImage> = repaired
        .par_iter()
        .map(|r| encode(&r.texels, asset.images[r.image].format))
        .collect::<Result<_>>()?;
    for (repaired, image) in repaired.iter().zip(encoded) {
        images[repaired.image] = image;
    }
    Ok(images)
}
