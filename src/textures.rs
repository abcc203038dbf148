//! Which textures a material uses, for what, and how it reads them.

use glam::{Affine2, Vec2};
use gltf::json;
use serde_json::Value;

use seamwise_texture::{Role, Wrap};

use crate::asset::Asset;
use crate::error::{Error, Result};

/// A texture as a material uses it.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureSlot {
    /// JSON pointer of the texture info in the material.
    pub at: String,
    /// What its texels mean.
    pub role: Role,
    /// The image.
    pub image: usize,
    /// How UVs outside 0…1 are read, for u and v.
    pub wrap: [Wrap; 2],
    /// The UV set.
    pub uv_set: usize,
    /// From a vertex's UV to the texture's, after `KHR_texture_transform`.
    pub transform: Affine2,
    /// Factor on x and y of a normal.
    pub normal_scale: f32,
}

/// Every texture of a material, those of its extensions too: whatever stands under a key that ends
/// in `Texture` and has an index.
///
/// # Errors
/// [`Error::Invalid`] if a texture, sampler or image that it names is not there;
/// [`Error::Unsupported`] if a texture has no core image.
pub fn slots(asset: &Asset, material: usize) -> Result<Vec<TextureSlot>> {
    let at = format!("/materials/{material}");
    let mut found = Vec::new();
    if let Some(json) = asset.json.pointer(&at) {
        collect(json, &at, &mut found);
    }
    found.into_iter().map(|at| slot(asset, at)).collect()
}

fn collect(json: &Value, at: &str, found: &mut Vec<String>) {
    for (key, value) in json.as_object().into_iter().flatten() {
        let at = format!("{at}/{key}");
        if key.to_lowercase().ends_with("texture") && value.get("index").is_some() {
            found.push(at);
        } else if value.is_object() {
            collect(value, &at, found);
        }
    }
}

fn slot(asset: &Asset, at: String) -> Result<TextureSlot> {
    let texture = asset
        .reference(&at, "index", "textures")?
        .ok_or_else(|| Error::invalid(&at, "it names no texture"))?;
    let texture = format!("/textures/{texture}");
    let image = asset.reference(&texture, "source", "images")?.ok_or_else(|| {
        Error::Unsupported { what: format!("{texture}: a texture without a PNG or JPEG image") }
    })?;
    let wrap = match asset.reference(&texture, "sampler", "samplers")? {
        None => [Wrap::Repeat; 2],
        Some(sampler) => {
            let at = format!("/samplers/{sampler}");
            [wrap(asset, &format!("{at}/wrapS"))?, wrap(asset, &format!("{at}/wrapT"))?]
        }
    };
    let (uv_set, transform) = layout(asset, &at)?;
    let role = role(&at);
    let has_scale = role == Role::Normal;
    let normal_scale = if has_scale { parse_or(asset, &format!("{at}/scale"), 1.0)? } else { 1.0 };
    Ok(TextureSlot { role, image, wrap, uv_set, transform, normal_scale, at })
}

fn wrap(asset: &Asset, at: &str) -> Result<Wrap> {
    match asset.json.pointer(at).map(Value::as_u64) {
        None => Ok(Wrap::Repeat),
        Some(Some(mode)) if mode == u64::from(json::texture::REPEAT) => Ok(Wrap::Repeat),
        Some(Some(mode)) if mode == u64::from(json::texture::MIRRORED_REPEAT) => Ok(Wrap::Mirror),
        Some(Some(mode)) if mode == u64::from(json::texture::CLAMP_TO_EDGE) => Ok(Wrap::Clamp),
        Some(_) => Err(Error::invalid(at, "unknown wrap mode")),
    }
}

/// The UV set and the transform of a texture info. A rotation turns UVs counter-clockwise as they
/// are seen in the image, where v runs downward.
fn layout(asset: &Asset, at: &str) -> Result<(usize, Affine2)> {
    let own = |key: &str| parse_or(asset, &format!("{at}/{key}"), 0usize);
    let extension = format!("{at}/extensions/KHR_texture_transform");
    if asset.json.pointer(&extension).is_none() {
        return Ok((own("texCoord")?, Affine2::IDENTITY));
    }
    let offset: [f32; 2] = parse_or(asset, &format!("{extension}/offset"), [0.0; 2])?;
    let scale: [f32; 2] = parse_or(asset, &format!("{extension}/scale"), [1.0; 2])?;
    let rotation: f32 = parse_or(asset, &format!("{extension}/rotation"), 0.0)?;
    let uv_set = parse_or(asset, &format!("{extension}/texCoord"), own("texCoord")?)?;
    let transform =
        Affine2::from_scale_angle_translation(Vec2::from(scale), -rotation, Vec2::from(offset));
    Ok((uv_set, transform))
}

/// What stands at a JSON pointer, or a default.
fn parse_or<T: serde::de::DeserializeOwned>(asset: &Asset, at: &str, default: T) -> Result<T> {
    if asset.json.pointer(at).is_some() { asset.parse(at) } else { Ok(default) }
}

/// What the texels of a texture mean, from its name in the material: glTF stores colors in sRGB,
/// everything else linear.
fn role(at: &str) -> Role {
    const COLORS: &[&str] = &[
        "baseColorTexture",
        "emissiveTexture",
        "diffuseTexture",
        "specularGlossinessTexture",
        "sheenColorTexture",
        "specularColorTexture",
        "diffuseTransmissionColorTexture",
    ];
    let name = at.rsplit('/').next().unwrap_or(at);
    if COLORS.contains(&name) {
        Role::Color
    } else if name.to_lowercase().ends_with("normaltexture") {
        Role::Normal
    } else {
        Role::Data
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn asset() -> Asset {
        Asset {
            json: json!({
                "materials": [{
                    "pbrMetallicRoughness": {
                        "baseColorTexture": {"index": 0},
                        "metallicRoughnessTexture": {"index": 0, "texCoord": 1},
                    },
                    "normalTexture": {"index": 1},
                    "extensions": {"KHR_materials_clearcoat": {"clearcoatNormalTexture": {
                        "index": 1,
                        "extensions": {"KHR_texture_transform": {
                            "offset": [0.5, 0.0], "rotation": std::f32::consts::FRAC_PI_2,
                            "texCoord": 1,
                        }},
                    }}},
                }],
                "textures": [{"source": 1, "sampler": 0}, {"source": 0}],
                "samplers": [{"wrapS": 33071, "wrapT": 33648}],
                "images": [{}, {}],
            }),
            buffers: Vec::new(),
            images: Vec::new(),
        }
    }

    #[test]
    fn every_texture_is_found_with_its_role_and_reading() {
        let slots = slots(&asset(), 0).unwrap();
        let seen: Vec<_> = slots.iter().map(|s| (s.role, s.image, s.uv_set, s.wrap)).collect();
        let (clamped, repeated) = ([Wrap::Clamp, Wrap::Mirror], [Wrap::Repeat; 2]);
        assert_eq!(
            seen,
            [
                (Role::Color, 1, 0, clamped),
                (Role::Data, 1, 1, clamped),
                (Role::Normal, 0, 0, repeated),
                (Role::Normal, 0, 1, repeated),
            ]
        );
    }

    #[test]
    fn a_rotation_turns_uvs_as_the_image_shows_them() {
        let transform = slots(&asset(), 0).unwrap()[3].transform;
        let turned = transform.transform_point2(Vec2::new(1.0, 0.0));
        assert!((turned - Vec2::new(0.5, -1.0)).length() < 1e-6, "right becomes up: {turned}");
    }

    #[test]
    fn a_missing_image_is_named() {
        let mut asset = asset();
        asset.json["textures"][1]["source"] = json!(9);
        assert!(slots(&asset, 0).unwrap_err().to_string().starts_with("/textures/1/source"));
    }
}
