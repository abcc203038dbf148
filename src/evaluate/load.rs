//! An asset's default scene as the evaluator looks at it.

use std::sync::Arc;

use glam::{DMat4, DVec3, Mat3, Vec2, Vec3, Vec4};
use gltf::json;
use gltf::json::validation::Checked;
use image::DynamicImage;
use rustc_hash::FxHashMap;
use seamwise_attr::{TangentInput, compute_tangents};
use seamwise_texture::{ColorEncoding, Mips, Role};
use serde_json::Value;

use crate::document::asset::Asset;
use crate::document::instances::instances;
use crate::document::material::{TextureSlot, parse_or, slots};
use crate::document::nodes::{mesh_worlds, world_nodes};
use crate::document::primitive::Primitive;
use crate::error::{Error, Result};
use crate::evaluate::scene::{Alpha, Material, Scene, TextureRef};
use crate::image_file::codec::decode;
use crate::image_file::encoded::{EncodedImage, ImageFormat};
use crate::limit::{Budget, MemoryLimit};

/// Decoded textures, kept so that assets which share an image decode it once.
#[derive(Default)]
pub struct TextureCache {
    /// By where the image's bytes lie, which the entry keeps alive, and by how they are decoded.
    known: FxHashMap<(usize, bool), (EncodedImage, Arc<Mips>)>,
    /// Texels of images that stand for them, by where the image's bytes lie.
    texels: FxHashMap<usize, (EncodedImage, DynamicImage)>,
    limit: MemoryLimit,
}

impl TextureCache {
    /// An empty cache for images that take no more memory than the limit.
    pub fn with_limit(limit: MemoryLimit) -> Self {
        Self { limit, ..Self::default() }
    }

    /// An image that is these texels for this cache, without a file.
    pub(super) fn stand_in(&mut self, texels: DynamicImage) -> EncodedImage {
        let image = EncodedImage { bytes: Arc::new(vec![0]), format: ImageFormat::Png };
        self.texels.insert(Arc::as_ptr(&image.bytes).addr(), (image.clone(), texels));
        image
    }

    fn mips(&mut self, image: &EncodedImage, role: Role, at: &str) -> Result<Arc<Mips>> {
        if image.is_missing() {
            return neutral(role).map(Arc::new);
        }
        let is_color = role == Role::Color;
        let key = (Arc::as_ptr(&image.bytes).addr(), is_color);
        if let Some((_, mips)) = self.known.get(&key) {
            return Ok(mips.clone());
        }
        let texels = match self.texels.get(&key.0) {
            Some((_, texels)) => texels.to_rgba8(),
            None => decode(image, at, self.limit)?.into_rgba8(),
        };
        let (width, height) = (texels.width() as usize, texels.height() as usize);
        let encoding = if is_color { ColorEncoding::Srgb } else { ColorEncoding::Linear };
        let mips = Mips::from_rgba8(width, height, texels.as_raw(), encoding)
            .map_err(|error| Error::invalid(at, error.to_string()))?;
        let mips = Arc::new(mips);
        self.known.insert(key, (image.clone(), mips.clone()));
        Ok(mips)
    }
}

/// Bytes that a vertex, a triangle, and a primitive with neither take in a scene: a few in the file are
/// enough to show a mesh once more.
const BYTES_PER_VERTEX: u64 = 56;
const BYTES_PER_TRIANGLE: u64 = 64;
const BYTES_PER_PRIMITIVE: u64 = 1024;

/// One texel that changes nothing: white, or the surface's own normal.
fn neutral(role: Role) -> Result<Mips> {
    let texel = match role {
        Role::Normal => [128, 128, 255, 255],
        Role::Color | Role::Data => [255; 4],
    };
    Mips::from_rgba8(1, 1, &texel, ColorEncoding::Linear).map_err(Error::internal)
}

/// Flattens the default scene of an asset to world space. A skinned mesh stands in its bind pose,
/// at the origin, as its node's transform does not move it (glTF 2.0 §3.7.3.3). A scene that is far from
/// the world's origin for its size is counted from its own middle.
///
/// # Errors
/// [`Error::Invalid`] with the place in the document, also if the scene takes more memory than the
/// limit of `cache`.
pub fn load(asset: &Asset, cache: &mut TextureCache) -> Result<Scene> {
    let mut scene = Scene { origin: origin(asset)?, ..Scene::default() };
    let mut budget = Budget::of(cache.limit);
    scene.materials = load_materials(asset, cache)?;
    for (node, world) in world_nodes(asset)? {
        let at = format!("/nodes/{node}");
        let Some(mesh) = asset.reference(&at, "mesh", "meshes")? else {
            continue;
        };
        let skinned = asset.reference(&at, "skin", "skins")?.is_some();
        let world = if skinned { DMat4::IDENTITY } else { world };
        let instances = instances(asset, &at)?;
        for primitive in Primitive::of_mesh(asset, mesh)?.iter().filter(|p| p.is_surface()) {
            let soup = Soup::read(asset, primitive)?;
            let material = primitive.material.unwrap_or(scene.materials.len() - 1);
            let tangents = soup.corner_tangents(&scene.materials[material])?;
            for instance in &instances {
                let taken = budget.take("the scene with all its instances", soup.bytes());
                taken.map_err(|what| Error::invalid(&at, what))?;
                if u32::try_from(scene.positions.len() + soup.positions.len()).is_err() {
                    return Err(Error::Unsupported { what: "a scene of 2^32 vertices".into() });
                }
                soup.place(&tangents, material, world * instance, &mut scene);
                scene.triangle_meshes.resize(scene.triangles.len(), mesh as u32);
            }
        }
    }
    scene.origin += center(asset);
    Ok(scene)
}

/// The materials of an asset, and the default one.
pub(super) fn load_materials(asset: &Asset, cache: &mut TextureCache) -> Result<Vec<Material>> {
    let own = (0..asset.count("materials")).map(|material| load_material(asset, material, cache));
    own.chain([Ok(Material::default())]).collect()
}

/// The place that all coordinates of an asset are counted from (`CESIUM_RTC`): the world's origin unless it
/// says otherwise.
pub(crate) fn center(asset: &Asset) -> DVec3 {
    let center = asset.json.pointer("/extensions/CESIUM_RTC/center").cloned();
    let center = center.and_then(|center| serde_json::from_value::<[f64; 3]>(center).ok());
    center.map_or(DVec3::ZERO, DVec3::from)
}

/// How many times its own size a scene stands from the world's origin before its positions are counted
/// from its middle. Nearer, a float has a step of two millionths of that size at most.
const FAR: f64 = 16.0;

/// Where the positions of a scene are counted from, itself counted from the asset's center.
fn origin(asset: &Asset) -> Result<DVec3> {
    let [mut low, mut high] = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for (mesh, worlds) in mesh_worlds(asset)? {
        let Some([from, to]) = bounds(asset, mesh)? else { continue };
        for world in worlds {
            for corner in 0..8 {
                let pick = |axis: usize| [from, to][corner >> axis & 1][axis];
                let place = world.transform_point3(DVec3::new(pick(0), pick(1), pick(2)));
                (low, high) = (low.min(place), high.max(place));
            }
        }
    }
    let [middle, size] = [(low + high) / 2.0, (high - low) / 2.0];
    let is_far = middle.abs().max_element() > FAR * size.max_element();
    Ok(if is_far && middle.is_finite() { middle.round() } else { DVec3::ZERO })
}

/// The box around a mesh's surfaces.
fn bounds(asset: &Asset, mesh: usize) -> Result<Option<[DVec3; 2]>> {
    let mut bounds: Option<[DVec3; 2]> = None;
    for primitive in Primitive::of_mesh(asset, mesh)?.iter().filter(|p| p.is_surface()) {
        for position in primitive.positions(asset)? {
            let place = position.as_dvec3();
            let [low, high] = bounds.unwrap_or([place; 2]);
            bounds = Some([low.min(place), high.max(place)]);
        }
    }
    Ok(bounds)
}

/// A primitive in its own space, one normal and one UV per set for each vertex.
struct Soup {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: [Vec<Vec2>; 2],
    colors: Vec<Vec4>,
    triangles: Vec<[u32; 3]>,
    tangents: Option<Vec<Vec4>>,
}

impl Soup {
    fn read(asset: &Asset, primitive: &Primitive) -> Result<Self> {
        let positions = primitive.positions(asset)?;
        let count = positions.len();
        let triangles = primitive.triangles(asset, count)?;
        let floats = |name: &str, components| primitive.floats(asset, name, components, count);
        let vec3s = |name: &str| -> Result<Option<Vec<Vec3>>> {
            let values = floats(name, 3)?;
            Ok(values.map(|v| v.as_chunks().0.iter().map(|&n| Vec3::from_array(n)).collect()))
        };
        let uv_set = |name: &str| -> Result<Vec<Vec2>> {
            Ok(floats(name, 2)?.map_or(vec![Vec2::ZERO; count], |values| {
                values.as_chunks().0.iter().map(|&uv| Vec2::from_array(uv)).collect()
            }))
        };
        let tangents = floats("TANGENT", 4)?;
        let soup = Self {
            uvs: [uv_set("TEXCOORD_0")?, uv_set("TEXCOORD_1")?],
            colors: colors(asset, primitive, count)?,
            tangents: tangents
                .map(|v| v.as_chunks().0.iter().map(|&t| Vec4::from_array(t)).collect()),
            normals: Vec::new(),
            positions,
            triangles,
        };
        Ok(match vec3s("NORMAL")? {
            Some(normals) => Self { normals, ..soup },
            None => soup.flat(),
        })
    }

    /// Bytes that one instance takes in a scene.
    fn bytes(&self) -> u64 {
        let [vertices, triangles] = [self.positions.len(), self.triangles.len()];
        BYTES_PER_PRIMITIVE
            + BYTES_PER_VERTEX * vertices as u64
            + BYTES_PER_TRIANGLE * triangles as u64
    }

    /// Puts one instance into a scene. `tangents`: one per corner of its triangles.
    fn place(&self, tangents: &[[Vec4; 3]], material: usize, world: DMat4, scene: &mut Scene) {
        let mirrored = world.determinant() < 0.0;
        let linear = Mat3::from_mat4(world.as_mat4());
        let to_normal = linear.inverse().transpose();
        let first = scene.positions.len() as u32;
        let origin = scene.origin;
        let place = |p: &Vec3| (world.transform_point3(p.as_dvec3()) - origin).as_vec3();
        scene.positions.extend(self.positions.iter().map(place));
        scene.normals.extend(self.normals.iter().map(|&n| (to_normal * n).normalize_or(Vec3::Z)));
        for (all, own) in scene.uvs.iter_mut().zip(&self.uvs) {
            all.extend(own);
        }
        scene.colors.extend(&self.colors);
        for (triangle, corners) in self.triangles.iter().zip(tangents) {
            let mut triangle = triangle.map(|vertex| vertex + first);
            let mut corners = corners.map(|t| {
                let sign = if mirrored { -t.w } else { t.w };
                (linear * t.truncate()).normalize_or_zero().extend(sign)
            });
            if mirrored {
                triangle.swap(1, 2);
                corners.swap(1, 2);
            }
            scene.triangles.push(triangle);
            scene.tangents.push(corners);
            scene.triangle_materials.push(material as u32);
        }
    }

    /// Gives each triangle vertices of its own and its plane's normal, as glTF asks where a file
    /// has no normals (glTF 2.0 §3.7.2.1).
    fn flat(self) -> Self {
        let order: Vec<usize> = self.triangles.iter().flatten().map(|&v| v as usize).collect();
        fn pick<T: Copy>(order: &[usize], values: &[T]) -> Vec<T> {
            order.iter().map(|&vertex| values[vertex]).collect()
        }
        let positions = pick(&order, &self.positions);
        let normals = positions
            .as_chunks()
            .0
            .iter()
            .flat_map(|[a, b, c]| [(b - a).cross(c - a).normalize_or(Vec3::Z); 3])
            .collect();
        Self {
            normals,
            uvs: self.uvs.map(|uvs| pick(&order, &uvs)),
            colors: pick(&order, &self.colors),
            triangles: (0..order.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            tangents: self.tangents.map(|tangents| pick(&order, &tangents)),
            positions,
        }
    }

    /// The tangents at each triangle's corners: those of the file, else MikkTSpace; zero where no
    /// normal map asks for them.
    fn corner_tangents(&self, material: &Material) -> Result<Vec<[Vec4; 3]>> {
        let Some(normal_map) = &material.normal_texture else {
            return Ok(vec![[Vec4::ZERO; 3]; self.triangles.len()]);
        };
        if let Some(tangents) = &self.tangents {
            return Ok(self.triangles.iter().map(|t| t.map(|v| tangents[v as usize])).collect());
        }
        compute_tangents(&TangentInput {
            positions: &self.positions,
            normals: &self.normals,
            uvs: &self.uvs[normal_map.uv_set],
            triangles: &self.triangles,
        })
        .map_err(Error::internal)
    }
}

/// `COLOR_0` with alpha, white where there is none.
fn colors(asset: &Asset, primitive: &Primitive, count: usize) -> Result<Vec<Vec4>> {
    let Some(elements) = primitive.elements(asset, "COLOR_0", count)? else {
        return Ok(vec![Vec4::ONE; count]);
    };
    let rows = elements.floats();
    match elements.components {
        3 => Ok(rows.as_chunks().0.iter().map(|&c| Vec3::from_array(c).extend(1.0)).collect()),
        4 => Ok(rows.as_chunks().0.iter().map(|&c| Vec4::from_array(c)).collect()),
        _ => {
            let at = format!("{}/attributes/COLOR_0", primitive.at);
            Err(Error::invalid(at, "a color must have three or four components"))
        }
    }
}

fn load_material(asset: &Asset, material: usize, cache: &mut TextureCache) -> Result<Material> {
    let at = format!("/materials/{material}");
    let json: json::Material = asset.parse(&at)?;
    let slots = slots(asset, material)?;
    let mut texture = |name: &str| -> Result<Option<TextureRef>> {
        let slot = slots.iter().find(|slot| slot.at == format!("{at}/{name}"));
        slot.map(|slot| texture_ref(asset, slot, cache)).transpose()
    };
    let pbr = &json.pbr_metallic_roughness;
    // The older model's diffuse color is what it shows of a metalness of 0.
    let older = "extensions/KHR_materials_pbrSpecularGlossiness";
    let diffuse = asset.json.pointer(&format!("{at}/{older}"));
    let diffuse_factor =
        diffuse.map(|_| parse_or(asset, &format!("{at}/{older}/diffuseFactor"), [1.0; 4]));
    let base_color = match diffuse_factor.transpose()? {
        Some(factor) => (factor, texture(&format!("{older}/diffuseTexture"))?),
        None => (pbr.base_color_factor.0, texture("pbrMetallicRoughness/baseColorTexture")?),
    };
    let strength = asset
        .json
        .pointer(&format!("{at}/extensions/KHR_materials_emissive_strength/emissiveStrength"))
        .and_then(Value::as_f64);
    Ok(Material {
        base_color: Vec4::from_array(base_color.0),
        base_color_texture: base_color.1,
        metallic: if diffuse.is_some() { 0.0 } else { pbr.metallic_factor.0 },
        roughness: pbr.roughness_factor.0,
        metallic_roughness_texture: texture("pbrMetallicRoughness/metallicRoughnessTexture")?,
        normal_texture: texture("normalTexture")?,
        normal_scale: json.normal_texture.as_ref().map_or(1.0, |normal| normal.scale),
        occlusion_texture: texture("occlusionTexture")?,
        occlusion_strength: json.occlusion_texture.as_ref().map_or(1.0, |o| o.strength.0),
        emissive: Vec3::from_array(json.emissive_factor.0) * strength.unwrap_or(1.0) as f32,
        emissive_texture: texture("emissiveTexture")?,
        alpha: match json.alpha_mode {
            Checked::Valid(json::material::AlphaMode::Mask) => {
                Alpha::Mask(json.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0))
            }
            Checked::Valid(json::material::AlphaMode::Blend) => Alpha::Blend,
            _ => Alpha::Opaque,
        },
        double_sided: json.double_sided,
        unlit: asset.json.pointer(&format!("{at}/extensions/KHR_materials_unlit")).is_some(),
    })
}

fn texture_ref(asset: &Asset, slot: &TextureSlot, cache: &mut TextureCache) -> Result<TextureRef> {
    if slot.uv_set > 1 {
        let what = format!("{}: evaluating UV set {}", slot.at, slot.uv_set);
        return Err(Error::Unsupported { what });
    }
    let image = &asset.images[slot.image];
    Ok(TextureRef {
        mips: cache.mips(image, slot.role, &format!("/images/{}", slot.image))?,
        wrap: slot.wrap,
        uv_set: slot.uv_set,
        transform: slot.transform,
    })
}

#[cfg(test)]
mod tests;
