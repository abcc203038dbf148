//! The color of a point of the scene: attributes interpolated, textures read, material lit.
//!
//! Textures are trilinear and isotropic, their level of detail from the change of the UV over one
//! *pixel* of the image, not over one sample: what supersampling would hide, a mip map that bleeds
//! over a seam, shows as on a screen that does not supersample.

use std::sync::Arc;

use glam::{DVec2, Vec2, Vec3, Vec4};

use super::light::{Light, Surface};
use super::raster::{Facet, Hit, View};
use super::scene::{Alpha, Material, Mode, Scene, TextureRef};

/// Colors the points that one view sees.
pub(super) struct Shader<'a> {
    view: &'a View<'a>,
    mode: Mode,
    light: Light,
}

/// A point with what its triangle says of it.
struct Point<'a> {
    scene: &'a Scene,
    material: &'a Material,
    triangle: usize,
    hit: Hit,
}

impl<'a> Shader<'a> {
    pub(super) fn new(view: &'a View<'a>, mode: Mode) -> Self {
        Self { view, mode, light: Light::of(view.camera) }
    }

    /// The alpha of a triangle at a point of the image, in samples.
    pub(super) fn alpha(&self, facet: &Facet, at: DVec2) -> f32 {
        self.point(facet, at).map_or(0.0, |point| point.base_color().w)
    }

    /// The color of a triangle at a point of the image, in samples: linear light held to 0…1, as a
    /// screen would, and alpha (1 where the material is not blended).
    pub(super) fn color(&self, facet: &Facet, at: DVec2) -> Vec4 {
        let Some(point) = self.point(facet, at) else { return Vec4::ZERO };
        let base = point.base_color();
        let rgb = if self.mode == Mode::Unlit || point.material.unlit {
            base.truncate()
        } else {
            let ray = self.view.ray(at);
            let camera = self.view.camera;
            let along = camera.right * ray.x + camera.up * ray.y + camera.forward;
            let surface = point.surface(base.truncate(), facet.front, -along.normalize().as_vec3());
            self.light.reflect(&surface) + point.emissive()
        };
        let alpha = if point.material.alpha == Alpha::Blend { base.w } else { 1.0 };
        Vec4::from_array(rgb.extend(alpha).to_array().map(unit))
    }

    fn point(&self, facet: &Facet, at: DVec2) -> Option<Point<'a>> {
        let scene = self.view.scene;
        let material = material_of(scene, facet.triangle)?;
        Some(Point { scene, material, triangle: facet.triangle, hit: facet.hit(self.view, at) })
    }
}

/// The material a triangle uses; nothing if the scene names none.
pub(super) fn material_of(scene: &Scene, triangle: usize) -> Option<&Material> {
    scene.materials.get(*scene.triangle_materials.get(triangle)? as usize)
}

impl Point<'_> {
    fn base_color(&self) -> Vec4 {
        let color =
            self.hit.interpolate(self.scene.triangles[self.triangle].map(|vertex| {
                self.scene.colors.get(vertex as usize).copied().unwrap_or(Vec4::ONE)
            }));
        let texture = &self.material.base_color_texture;
        self.material.base_color * color * texture.as_ref().map_or(Vec4::ONE, |t| self.read(t))
    }

    fn emissive(&self) -> Vec3 {
        if self.material.emissive == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let texture = &self.material.emissive_texture;
        self.material.emissive * texture.as_ref().map_or(Vec3::ONE, |t| self.read(t).truncate())
    }

    /// Everything that the light asks of the point.
    fn surface(&self, base_color: Vec3, front: bool, to_eye: Vec3) -> Surface {
        let material = self.material;
        let packed = material.metallic_roughness_texture.as_ref();
        let packed_value = packed.map_or(Vec4::ONE, |texture| self.read(texture));
        let occlusion = material.occlusion_texture.as_ref().map_or(1.0, |texture| {
            // The three are most often the channels of one image.
            let shared = packed.is_some_and(|packed| same_texture(packed, texture));
            if shared { packed_value.x } else { self.read(texture).x }
        });
        Surface {
            base_color,
            metallic: unit(material.metallic * packed_value.z),
            roughness: unit(material.roughness * packed_value.y),
            occlusion: unit(1.0 + material.occlusion_strength * (occlusion - 1.0)),
            normal: self.normal(front, to_eye),
            to_eye,
        }
    }

    /// The unit shading normal in the world, with the normal map; turned for a back face (glTF 2.0
    /// §3.9.6). Neither it nor the tangent is made unit before the map is applied, as MikkTSpace
    /// asks.
    fn normal(&self, front: bool, to_eye: Vec3) -> Vec3 {
        let corners = self.scene.triangles[self.triangle];
        let smooth = self.hit.interpolate(
            corners.map(|v| self.scene.normals.get(v as usize).copied().unwrap_or(Vec3::ZERO)),
        );
        let mapped = match &self.material.normal_texture {
            Some(texture) => self.map_normal(texture, smooth),
            None => smooth,
        };
        let turned = if front { mapped } else { -mapped };
        turned.try_normalize().unwrap_or(to_eye)
    }

    fn map_normal(&self, texture: &TextureRef, smooth: Vec3) -> Vec3 {
        let corners = self.scene.tangents.get(self.triangle).copied().unwrap_or_default();
        let tangent = self.hit.interpolate(corners.map(Vec4::truncate));
        let sign = if corners[0].w < 0.0 { -1.0 } else { 1.0 };
        let bitangent = smooth.cross(tangent) * sign;
        let scale = self.material.normal_scale;
        let map = self.read(texture).truncate() * 2.0 - 1.0;
        tangent * (map.x * scale) + bitangent * (map.y * scale) + smooth * map.z
    }

    fn read(&self, texture: &TextureRef) -> Vec4 {
        let set = self.scene.uvs.get(texture.uv_set);
        let uv = |v: u32| set.and_then(|set| set.get(v as usize)).copied().unwrap_or(Vec2::ZERO);
        let corners @ [a, b, c] = self.scene.triangles[self.triangle].map(uv);
        let change = |of: Vec3| (b - a) * of.y + (c - a) * of.z;
        let at = texture.transform.transform_point2(self.hit.interpolate(corners));
        let dx = texture.transform.transform_vector2(change(self.hit.dx));
        let dy = texture.transform.transform_vector2(change(self.hit.dy));
        let lod = texture.mips.lod(dx, dy);
        Vec4::from_array(texture.mips.sample(at, texture.wrap, lod))
    }
}

fn same_texture(a: &TextureRef, b: &TextureRef) -> bool {
    Arc::ptr_eq(&a.mips, &b.mips)
        && (a.uv_set, a.wrap, a.transform) == (b.uv_set, b.wrap, b.transform)
}

/// Held to 0…1; what is not a number is 0.
fn unit(value: f32) -> f32 {
    if value > 0.0 { value.min(1.0) } else { 0.0 }
}
