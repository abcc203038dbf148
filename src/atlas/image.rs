//! Images as atlases, with the charts of all surfaces that use them.

use glam::Affine2;
use seamwise_texture::{Role, Validity, Wrap};

use super::alpha::Alpha;
use super::charts::Charts;
use crate::document::asset::Asset;
use crate::document::material::{AlphaUse, TextureSlot, main_role, material_slots, textures_of};
use crate::document::primitive::Primitive;
use crate::error::Result;

/// An image as an atlas: the meaning of its texels and the charts that lie in it.
#[derive(Clone, Debug)]
pub struct Atlas {
    /// The image.
    pub image: usize,
    /// The meaning of its texels.
    pub role: Role,
    /// Its wrap modes along u and v.
    pub wrap: [Wrap; 2],
    /// The charts of all surfaces that use it.
    pub charts: Charts,
    /// Whether points or lines use it too, of which no chart tells.
    pub beyond_charts: bool,
    /// The use of its alpha.
    pub alpha: Alpha,
}

/// Every image that a material of some primitive uses, in the order of the document.
///
/// # Errors
/// [`Error::Invalid`] or [`Error::Unsupported`] with the place in the document.
///
/// [`Error::Invalid`]: crate::error::Error::Invalid
/// [`Error::Unsupported`]: crate::error::Error::Unsupported
pub fn atlases(asset: &Asset) -> Result<Vec<Atlas>> {
    Ok(atlas_of_each(asset)?.into_iter().flatten().collect())
}

/// One per image; `None` if nothing uses it.
pub(super) fn atlas_of_each(asset: &Asset) -> Result<Vec<Option<Atlas>>> {
    let materials = material_slots(asset)?;
    let mut atlases: Vec<Option<Atlas>> = vec![None; asset.count("images")];
    for mesh in 0..asset.count("meshes") {
        for primitive in Primitive::of_mesh(asset, mesh)? {
            add_primitive(asset, &primitive, &materials, &mut atlases)?;
        }
    }
    Ok(atlases)
}

fn add_primitive(
    asset: &Asset,
    primitive: &Primitive,
    materials: &[Vec<TextureSlot>],
    atlases: &mut [Option<Atlas>],
) -> Result<()> {
    let mut seen: Vec<(usize, usize, Affine2)> = Vec::new();
    for slot in textures_of(asset, primitive, materials)? {
        let atlas = atlases[slot.image].get_or_insert_with(|| Atlas {
            image: slot.image,
            role: slot.role,
            wrap: slot.wrap,
            charts: Charts::default(),
            beyond_charts: false,
            alpha: Alpha::default(),
        });
        atlas.role = main_role(atlas.role, slot.role);
        atlas.alpha.add(AlphaUse::of(asset, slot)?);
        atlas.beyond_charts |= !primitive.is_surface();
        let reading = (slot.image, slot.uv_set, slot.transform);
        if primitive.is_surface() && !seen.contains(&reading) {
            let charts = Charts::read(asset, primitive, slot.uv_set, slot.transform)?;
            charts.into_iter().for_each(|charts| atlas.charts.append(charts));
            seen.push(reading);
        }
    }
    Ok(())
}

impl Atlas {
    /// The texels of a `width` × `height` image that the charts cover.
    pub fn validity(&self, width: usize, height: usize) -> Validity {
        let Charts { uvs, triangles } = &self.charts;
        Validity::from_charts(width, height, self.wrap, uvs, triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    #[test]
    fn charts_of_several_primitives_are_united() {
        let quarter = |x: f32| Charts {
            uvs: [[x, 0.0], [x, 1.0], [x + 0.25, 0.0], [x + 0.25, 1.0]].map(Vec2::from).to_vec(),
            triangles: vec![[0, 1, 2], [2, 1, 3]],
        };
        let mut charts = quarter(0.0);
        charts.append(quarter(0.5));
        let wrap = [Wrap::Repeat; 2];
        let alpha = Alpha::default();
        let beyond_charts = false;
        let atlas = Atlas { image: 0, role: Role::Color, wrap, charts, beyond_charts, alpha };
        let flags = [true, false, true, false].repeat(2);
        assert_eq!(atlas.validity(4, 2), Validity::from_flags(4, 2, flags));
    }
}
