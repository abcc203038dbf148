//! The color that each point of a mesh is seen in, for shells that stand out from what lies behind.

use image::RgbaImage;
use rustc_hash::FxHashMap;
use seamwise_attr::{DisjointSets, Mesh, WedgeId};
use seamwise_texture::Role;
use seamwise_texture::color::{linear_to_srgb, srgb8_to_linear};

use crate::document::asset::Asset;
use crate::document::material::{TextureSlot, parse_or, slots};
use crate::error::Result;
use crate::image_file::codec::decode;
use crate::limit::MemoryLimit;
use crate::surface::geometry::Geometry;

/// Base color and emission of the materials of an asset.
pub(super) struct Colors<'a> {
    asset: &'a Asset,
    limit: MemoryLimit,
    /// Texels by image; `None` if they can't be had, which counts as white.
    images: FxHashMap<usize, Option<RgbaImage>>,
}

impl<'a> Colors<'a> {
    /// Colors of an asset, with no image decoded yet. Decoding an image may take as much memory as
    /// `limit`.
    pub(super) fn new(asset: &'a Asset, limit: MemoryLimit) -> Self {
        Self { asset, limit, images: FxHashMap::default() }
    }

    /// One per point, sRGB in 0…1: that of its first wedge. Empty for a mesh of one shell, where no
    /// one needs them, or of one color.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) if a material is malformed.
    pub(super) fn of_points(&mut self, geometry: &Geometry) -> Result<Vec<[f32; 3]>> {
        let mesh = &geometry.welded.mesh;
        if is_one_shell(mesh) {
            return Ok(Vec::new());
        }
        let materials = geometry.parts.iter().map(|part| self.material(part.primitive.material));
        let materials: Vec<Paint> = materials.collect::<Result<_>>()?;
        let mut colors = vec![None; mesh.positions.len()];
        for (wedges, &group) in mesh.triangles.iter().zip(&mesh.groups) {
            for &wedge in wedges {
                let point = mesh.wedge_points[wedge];
                colors[point.index()]
                    .get_or_insert_with(|| self.color(mesh, wedge, &materials[group as usize]));
            }
        }
        let colors: Vec<[f32; 3]> = colors.into_iter().map(Option::unwrap_or_default).collect();
        let is_plain = colors.iter().all(|color| *color == colors[0]);
        Ok(if is_plain { Vec::new() } else { colors })
    }

    fn material(&mut self, material: Option<usize>) -> Result<Paint> {
        let Some(material) = material else {
            return Ok(Paint { base: [1.0; 3], emissive: [0.0; 3], slot: None });
        };
        let at = format!("/materials/{material}");
        let base = format!("{at}/pbrMetallicRoughness/baseColorFactor");
        let [r, g, b, _] = parse_or(self.asset, &base, [1.0f32; 4])?;
        let emissive = parse_or(self.asset, &format!("{at}/emissiveFactor"), [0.0f32; 3])?;
        let is_base = |slot: &TextureSlot| {
            slot.role == Role::Color
                && ["baseColorTexture", "diffuseTexture"].iter().any(|name| slot.at.ends_with(name))
        };
        let slot = slots(self.asset, material)?.into_iter().find(is_base);
        if let Some(slot) = &slot {
            let (asset, limit, image) = (self.asset, self.limit, slot.image);
            self.images.entry(image).or_insert_with(|| {
                let image = asset.images.get(image).filter(|image| !image.is_missing())?;
                decode(image, "", limit).ok().map(image::DynamicImage::into_rgba8)
            });
        }
        Ok(Paint { base: [r, g, b], emissive, slot })
    }

    /// The color of a wedge.
    fn color(&self, mesh: &Mesh, wedge: WedgeId, paint: &Paint) -> [f32; 3] {
        let texel = paint.slot.as_ref().and_then(|slot| {
            let image = self.images.get(&slot.image)?.as_ref()?;
            let uv_set = slot.uv_set.min(mesh.layout.uv_sets.checked_sub(1)?);
            let uv = slot.transform.transform_point2(mesh.uv(wedge, uv_set));
            let texel =
                |x: f32, size: u32| ((x.rem_euclid(1.0) * size as f32) as u32).min(size - 1);
            Some(image.get_pixel(texel(uv.x, image.width()), texel(uv.y, image.height())).0)
        });
        let vertex = &mesh.row(wedge)[mesh.layout.color()..];
        std::array::from_fn(|channel| {
            let texel = texel.map_or(1.0, |texel| srgb8_to_linear(texel[channel]));
            let own = texel * paint.base[channel] * vertex.get(channel).copied().unwrap_or(1.0);
            linear_to_srgb((own + paint.emissive[channel]).clamp(0.0, 1.0))
        })
    }
}

/// The color of a material: factors in linear light, and its texture.
struct Paint {
    base: [f32; 3],
    emissive: [f32; 3],
    slot: Option<TextureSlot>,
}

fn is_one_shell(mesh: &Mesh) -> bool {
    let mut sets = DisjointSets::new(mesh.positions.len());
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.triangle_points(triangle).map(|point| point.0);
        sets.join(a, b);
        sets.join(b, c);
    }
    (0..mesh.positions.len() as u32).all(|point| sets.root(point) == 0)
}
