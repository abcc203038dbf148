//! The textures that a material uses: their roles, UVs and samplers.

use glam::{Affine2, Vec2};
use gltf::json;
use serde_json::Value;

use seamwise_texture::{Role, Wrap};

use super::asset::Asset;
use super::edit::put;
use super::extensions::{drop_unused_extension, remove_extension, require_extension};
use super::primitive::Primitive;
use crate::error::{Error, Result};
use crate::image_file::encoded::EncodedImage;

/// A texture as a material uses it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TextureSlot {
    /// JSON pointer of the texture info in the material.
    pub(crate) at: String,
    /// The meaning of its texels.
    pub(crate) role: Role,
    /// The image.
    pub(crate) image: usize,
    /// The wrap modes of UVs outside 0…1, for u and v.
    pub(crate) wrap: [Wrap; 2],
    /// The UV set.
    pub(crate) uv_set: usize,
    /// The transform from a vertex's UV to the texture's, as `KHR_texture_transform` has it.
    pub(crate) transform: Affine2,
    /// Factor on x and y of a normal.
    pub(crate) normal_scale: f32,
}

/// Extensions by which a texture names an image of a format that core glTF lacks, those that are
/// preferred to others first.
const SOURCES: [&str; 2] = ["EXT_texture_webp", "KHR_texture_basisu"];

/// Every texture of a material, those of its extensions too: whatever stands under a key that ends
/// in `Texture` and has an index.
///
/// A texture that names an image in an extension, and another in the core for readers without it,
/// gives two slots, the extension's first: who shows it takes the first slot of a place, who changes
/// what surfaces use takes all.
///
/// # Errors
/// [`Error::Invalid`] if a texture, sampler or image that it names is not there.
pub(crate) fn slots(asset: &Asset, material: usize) -> Result<Vec<TextureSlot>> {
    let at = format!("/materials/{material}");
    let mut found = Vec::new();
    if let Some(json) = asset.json.pointer(&at) {
        collect(json, &at, &mut found);
    }
    let slots: Vec<_> = found.into_iter().map(|at| slots_at(asset, &at)).collect::<Result<_>>()?;
    Ok(slots.into_iter().flatten().collect())
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

/// The slots of one texture info, one for each of its images.
fn slots_at(asset: &Asset, at: &str) -> Result<Vec<TextureSlot>> {
    let texture = asset
        .reference(at, "index", "textures")?
        .ok_or_else(|| Error::invalid(at, "it names no texture"))?;
    let texture = format!("/textures/{texture}");
    let wrap = match asset.reference(&texture, "sampler", "samplers")? {
        None => [Wrap::Repeat; 2],
        Some(sampler) => {
            let at = format!("/samplers/{sampler}");
            [wrap(asset, &format!("{at}/wrapS"))?, wrap(asset, &format!("{at}/wrapT"))?]
        }
    };
    let (uv_set, transform) = layout(asset, at)?;
    let role = role_of(at);
    let has_scale = role == Role::Normal;
    let normal_scale = if has_scale { parse_or(asset, &format!("{at}/scale"), 1.0)? } else { 1.0 };
    let slot = |image| {
        let at = at.to_owned();
        TextureSlot { role, image, wrap, uv_set, transform, normal_scale, at }
    };
    Ok(sources(asset, &texture)?.into_iter().map(slot).collect())
}

/// The images of a texture, the preferred one first; none at all if it names none that can be read,
/// which is then no texture.
pub(crate) fn sources(asset: &Asset, texture: &str) -> Result<Vec<usize>> {
    let extended = SOURCES.map(|name| format!("{texture}/extensions/{name}"));
    let mut images = Vec::new();
    for at in extended.iter().map(String::as_str).chain([texture]) {
        images.extend(asset.reference(at, "source", "images")?);
    }
    Ok(images)
}

/// Makes textures name their images as the images' formats ask: where an image that an extension
/// names has become one of the core's, it moves to the core's key, and the extension goes; where one
/// of the core's needs an extension by now, it moves there.
pub(crate) fn match_formats(json: &mut Value, images: &[EncodedImage]) {
    let textures = json.get_mut("textures").and_then(Value::as_array_mut);
    for texture in textures.into_iter().flatten() {
        for name in SOURCES {
            let Some(source) = texture.pointer(&format!("/extensions/{name}/source")) else {
                continue;
            };
            let image = source.as_u64().and_then(|index| images.get(index as usize));
            let is_other =
                |own: &EncodedImage| !own.is_missing() && own.format.extension() != Some(name);
            if image.is_some_and(is_other) {
                texture["source"] = source.clone();
                remove_extension(texture, name);
            }
        }
    }
    let textures = json.get_mut("textures").and_then(Value::as_array_mut);
    let mut gained = Vec::new();
    for texture in textures.into_iter().flatten() {
        let source = texture.get("source").and_then(Value::as_u64);
        let image = source.and_then(|index| images.get(index as usize));
        let name = image.filter(|own| !own.is_missing()).and_then(|own| own.format.extension());
        if let (Some(source), Some(name)) = (source, name) {
            texture.as_object_mut().map(|texture| texture.shift_remove("source"));
            texture["extensions"][name] = serde_json::json!({"source": source});
            gained.push(name);
        }
    }
    for name in gained {
        require_extension(json, name);
    }
    for name in SOURCES {
        drop_unused_extension(json, name);
    }
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

/// The value at a JSON pointer, or a default.
pub(crate) fn parse_or<T: serde::de::DeserializeOwned>(
    asset: &Asset,
    at: &str,
    default: T,
) -> Result<T> {
    if asset.json.pointer(at).is_some() { asset.parse(at) } else { Ok(default) }
}

/// The meaning of a texture's texels, from its name in the material: glTF stores colors in sRGB,
/// everything else linear.
pub(crate) fn role_of(at: &str) -> Role {
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

/// The use of an image's alpha in a place of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum AlphaUse {
    /// It hides what lies below the cutoff (`MASK`).
    CutsAt(f32),
    /// It says how much of a texel is there (`BLEND`).
    Blends,
    /// Nothing, or something that hides no color: the image is no base color, or the material `OPAQUE`.
    Shows,
}

impl AlphaUse {
    /// The use in this place.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the cutoff is no number.
    pub(crate) fn of(asset: &Asset, slot: &TextureSlot) -> Result<Self> {
        const WITH_ALPHA: [&str; 2] = ["/baseColorTexture", "/diffuseTexture"];
        let index = slot.at.strip_prefix("/materials/").and_then(|rest| rest.split('/').next());
        let Some(index) = index.filter(|_| WITH_ALPHA.iter().any(|name| slot.at.ends_with(name)))
        else {
            return Ok(Self::Shows);
        };
        let material = format!("/materials/{index}");
        match asset.json.pointer(&format!("{material}/alphaMode")).and_then(Value::as_str) {
            Some("MASK") => {
                Ok(Self::CutsAt(parse_or(asset, &format!("{material}/alphaCutoff"), 0.5)?))
            }
            Some("BLEND") => Ok(Self::Blends),
            _ => Ok(Self::Shows),
        }
    }
}

/// The textures of each material.
pub(crate) fn material_slots(asset: &Asset) -> Result<Vec<Vec<TextureSlot>>> {
    (0..asset.count("materials")).map(|material| slots(asset, material)).collect()
}

/// Every texture of every material that a primitive may use.
pub(crate) fn textures_of<'a>(
    asset: &Asset,
    primitive: &Primitive,
    materials: &'a [Vec<TextureSlot>],
) -> Result<Vec<&'a TextureSlot>> {
    Ok(materials_of(asset, primitive)?.into_iter().flat_map(|own| &materials[own]).collect())
}

/// Every material that a primitive may use: its own and those of `KHR_materials_variants`.
pub(crate) fn materials_of(asset: &Asset, primitive: &Primitive) -> Result<Vec<usize>> {
    let at = format!("{}/extensions/KHR_materials_variants/mappings", primitive.at);
    let mappings = asset.json.pointer(&at).and_then(Value::as_array).map_or(0, Vec::len);
    let material = |mapping| asset.reference(&format!("{at}/{mapping}"), "material", "materials");
    let variants = (0..mappings).filter_map(|mapping| material(mapping).transpose());
    primitive.material.map(Ok).into_iter().chain(variants).collect()
}

/// Gives the triangles that have no material one of their own: that of glTF, which they are shown with anyway.
pub(crate) fn name_default_material(asset: &mut Asset) {
    let mut new = None;
    let count = asset.count("materials");
    let meshes = asset.json.get_mut("meshes").and_then(Value::as_array_mut);
    let all = meshes.into_iter().flatten().filter_map(|mesh| mesh.get_mut("primitives"));
    for primitive in all.filter_map(Value::as_array_mut).flatten() {
        if let Some(own) = primitive.as_object_mut().filter(|own| !own.contains_key("material")) {
            own.insert("material".into(), serde_json::json!(*new.get_or_insert(count)));
        }
    }
    if new.is_some() {
        put(&mut asset.json, "materials", None, serde_json::json!({}));
    }
}

/// The role of an image that is used in two: a color says most about what its texels mean.
pub(crate) fn main_role(a: Role, b: Role) -> Role {
    match (a, b) {
        (Role::Color, _) | (_, Role::Color) => Role::Color,
        (Role::Normal, _) | (_, Role::Normal) => Role::Normal,
        _ => Role::Data,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image_file::encoded::ImageFormat;
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
            ..Asset::default()
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
    fn the_extensions_image_comes_first_and_the_cores_is_not_forgotten() {
        let mut asset = asset();
        asset.json["textures"][1]["extensions"] = json!({"EXT_texture_webp": {"source": 1}});
        let images =
            |asset: &Asset| slots(asset, 0).unwrap().iter().map(|s| s.image).collect::<Vec<_>>();
        assert_eq!(images(&asset), [1, 1, 1, 0, 1, 0]);
        asset.json["textures"][1].as_object_mut().unwrap().shift_remove("source");
        assert_eq!(images(&asset), [1, 1, 1, 1]);
        asset.json["textures"][1]["extensions"]["EXT_texture_webp"]["source"] = json!(2);
        let error = slots(&asset, 0).unwrap_err().to_string();
        assert!(error.starts_with("/textures/1/extensions/EXT_texture_webp/source"), "{error}");
    }

    #[test]
    fn an_image_that_became_a_png_moves_to_the_cores_key() {
        let image = |format| EncodedImage { bytes: vec![1].into(), format };
        let images = [image(ImageFormat::Png), image(ImageFormat::WebP)];
        let texture = |source| json!({"extensions": {"EXT_texture_webp": {"source": source}}});
        let basis = |source| json!({"extensions": {"KHR_texture_basisu": {"source": source}}});
        let lists = |names| json!({"extensionsUsed": names, "extensionsRequired": names});
        let mut json = lists(json!(["EXT_texture_webp", "KHR_materials_unlit"]));
        json["textures"] = json!([texture(0), texture(1)]);
        match_formats(&mut json, &images);
        assert_eq!(json["textures"], json!([{"source": 0}, texture(1)]));
        assert_eq!(json["extensionsRequired"].as_array().unwrap().len(), 2, "one still needs it");
        json["textures"] = json!([texture(0)]);
        match_formats(&mut json, &images);
        assert_eq!(json["extensionsUsed"], json!(["KHR_materials_unlit"]));
        assert_eq!(json["extensionsRequired"], json!(["KHR_materials_unlit"]));
        json["textures"] = json!([basis(0), basis(1)]);
        match_formats(&mut json, &[image(ImageFormat::Ktx2), image(ImageFormat::Png)]);
        assert_eq!(json["textures"], json!([basis(0), {"source": 1}]));
        let mut bare = json!({});
        match_formats(&mut bare, &[]);
        assert_eq!(bare, json!({}));
    }

    #[test]
    fn a_missing_image_is_named() {
        let mut asset = asset();
        asset.json["textures"][1]["source"] = json!(9);
        assert!(slots(&asset, 0).unwrap_err().to_string().starts_with("/textures/1/source"));
    }
}
