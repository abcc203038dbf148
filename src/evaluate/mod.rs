//! How far a candidate is from its reference: in pictures, over the surface, and in volume.
//!
//! The rig of cameras stands around the reference, so every candidate is seen from the same
//! places; distances are divided by the diagonal of the reference's bounding box. A thing compared
//! with itself is 0 away from itself in every figure, exactly.

pub mod appearance;
pub mod camera;
pub mod distance;
mod farthest;
mod light;
pub mod load;
pub mod luminance;
mod raster;
pub mod render;
pub mod sample;
pub mod scene;
mod shade;
pub mod sheet;
pub mod volume;

use seamwise_attr::TriangleId;
use serde::Serialize;

use glam::{Vec2, Vec3, Vec4};

use crate::error::{Error, Result};
use appearance::{Appearance, compare_appearance};
use camera::Rig;
use distance::{Distances, SampledSurface, correspond};
use luminance::Difference;
use render::{Image, render_views};
use scene::{Mode, Scene, TextureRef};
use volume::{Measures, Soundness, check_soundness, measure};

/// How thoroughly to look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Cameras, 1 to 24.
    pub views: usize,
    /// Pixels along each side of a view.
    pub resolution: usize,
    /// Samples on each surface.
    pub samples: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { views: 24, resolution: 512, samples: 200_000 }
    }
}

/// A reference, rendered and sampled once for all its candidates.
pub struct Reference<'a> {
    scene: &'a Scene,
    options: Options,
    mode: Mode,
    rig: Rig,
    images: Vec<Image>,
    surface: SampledSurface<'a>,
    measures: Measures,
    soundness: Soundness,
}

/// How far a candidate is from its reference. Distances are over the diagonal of the reference's
/// bounding box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Metrics {
    /// RMS difference in Rec. 709 luminance of linear light, over all pixels of all views.
    pub rms_luminance: f64,
    /// The same with luminance encoded as sRGB.
    pub rms_luminance_srgb: f64,
    /// [`Metrics::rms_luminance`] over the pixels that either of the two covers.
    pub rms_luminance_covered: f64,
    /// [`Metrics::rms_luminance_srgb`] over the pixels that either of the two covers.
    pub rms_luminance_srgb_covered: f64,
    /// Silhouettes: what both cover over what either covers.
    pub silhouette_iou: f64,
    /// The larger of the two RMS distances.
    pub distance_rms: f64,
    /// The larger of the two mean distances.
    pub distance_mean: f64,
    /// The larger of the two greatest distances.
    pub distance_max: f64,
    /// From the reference to the candidate.
    pub forward: Way,
    /// From the candidate to the reference.
    pub backward: Way,
    /// RMS difference in sRGB base color at nearest points.
    pub color_rms: f64,
    /// RMS angle between shading normals at nearest points, in degrees.
    pub normal_degrees_rms: f64,
    /// Signed volume over that of the reference; `None` where that has none.
    pub volume_ratio: Option<f64>,
    /// Area over that of the reference.
    pub area_ratio: f64,
    /// Triangles without area.
    pub degenerate_triangles: usize,
    /// Edges of one triangle, more than the reference has.
    pub border_edges_gained: i64,
    /// Edges of three triangles or more, more than the reference has.
    pub non_manifold_edges_gained: i64,
}

/// Distances in one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Way {
    /// Root of the mean square.
    pub distance_rms: f64,
    /// Mean.
    pub distance_mean: f64,
    /// Greatest of any point, within 1 % and 1e-5 of the diagonal.
    pub distance_max: f64,
}

impl Way {
    fn new(distances: Distances, diagonal: f64) -> Self {
        Self {
            distance_rms: distances.rms / diagonal,
            distance_mean: distances.mean / diagonal,
            distance_max: distances.max / diagonal,
        }
    }
}

/// Seed of the samples; any would do, but it must stay.
const SEED: u64 = 1;

impl<'a> Reference<'a> {
    /// Renders and samples a reference, lit.
    ///
    /// # Errors
    /// [`Error::Invalid`] if it has no surface to compare with.
    pub fn new(scene: &'a Scene, options: Options) -> Result<Self> {
        Self::with_mode(scene, options, Mode::Lit)
    }

    /// Renders and samples a reference. `mode` is that of all renders: with [`Mode::Unlit`] the
    /// luminance is that of the base color, and shading normals show in no picture.
    ///
    /// # Errors
    /// [`Error::Invalid`] if it has no surface to compare with.
    pub fn with_mode(scene: &'a Scene, options: Options, mode: Mode) -> Result<Self> {
        let measures = measure(&scene.positions, &scene.triangles);
        if measures.area.is_nan() || measures.area <= 0.0 {
            return Err(Error::invalid("the reference", "it has no surface"));
        }
        let rig = Rig::around(scene, options.views, options.resolution);
        Ok(Self {
            options,
            mode,
            images: render_views(scene, &rig, mode),
            rig,
            surface: SampledSurface::new(&scene.positions, &scene.triangles, options.samples, SEED),
            measures,
            soundness: check_soundness(&scene.positions, &scene.triangles),
            scene,
        })
    }

    /// The diagonal of its bounding box, in world units.
    pub fn diagonal(&self) -> f64 {
        self.measures.diagonal
    }

    /// The cameras that see it and every candidate.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// Compares a candidate.
    ///
    /// # Errors
    /// [`Error::Invalid`] if it has no surface to compare.
    pub fn compare(&self, candidate: &Scene) -> Result<Metrics> {
        let no_surface = || Error::invalid("the candidate", "it has no surface");
        let (positions, triangles) = (&candidate.positions, &candidate.triangles);
        let surface = SampledSurface::new(positions, triangles, self.options.samples, SEED);
        let forward = correspond(&self.surface, &surface).ok_or_else(no_surface)?;
        let backward = correspond(&surface, &self.surface).ok_or_else(no_surface)?;
        let (there, back) = (forward.distances(), backward.distances());
        let both = Way::new(there.symmetric(back), self.measures.diagonal);
        let looks = compare_appearance(self.scene, candidate, &forward, &backward).pooled;
        let (measures, soundness) =
            (measure(positions, triangles), check_soundness(positions, triangles));
        let seen = self.difference(candidate);
        let gained = |now: usize, before: usize| now as i64 - before as i64;
        Ok(Metrics {
            rms_luminance: seen.rms(),
            rms_luminance_srgb: seen.rms_srgb(),
            rms_luminance_covered: seen.rms_covered(),
            rms_luminance_srgb_covered: seen.rms_covered_srgb(),
            silhouette_iou: seen.overlap(),
            distance_rms: both.distance_rms,
            distance_mean: both.distance_mean,
            distance_max: both.distance_max,
            forward: Way::new(there, self.measures.diagonal),
            backward: Way::new(back, self.measures.diagonal),
            color_rms: looks.color_rms,
            normal_degrees_rms: looks.normal_degrees_rms,
            volume_ratio: self.volume_ratio(&measures),
            area_ratio: measures.area / self.measures.area,
            degenerate_triangles: soundness.degenerate_triangles,
            border_edges_gained: gained(soundness.border_edges, self.soundness.border_edges),
            non_manifold_edges_gained: gained(
                soundness.non_manifold_edges,
                self.soundness.non_manifold_edges,
            ),
        })
    }

    /// Renders a candidate view by view and sums up the differences.
    fn difference(&self, candidate: &Scene) -> Difference {
        let views = render_views(candidate, &self.rig, self.mode);
        let mut pooled = Difference::default();
        for (own, view) in self.images.iter().zip(&views) {
            pooled += Difference::between(own, view);
        }
        pooled
    }

    /// A sheet or a flat thing has no volume of its own: what rounding leaves says nothing.
    fn volume_ratio(&self, candidate: &Measures) -> Option<f64> {
        let own = self.measures;
        let is_solid = own.volume.abs() > 1e-6 * own.area * own.diagonal;
        is_solid.then(|| candidate.volume / own.volume)
    }
}

impl Scene {
    fn interpolate<T>(&self, values: &[T], triangle: TriangleId, at: Vec3) -> T
    where
        T: Copy + std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
    {
        let [a, b, c] = self.triangles[triangle].map(|vertex| values[vertex as usize]);
        a * at.x + b * at.y + c * at.z
    }

    /// A texture at a point of the surface, at full resolution.
    fn texel(&self, texture: &TextureRef, triangle: TriangleId, at: Vec3) -> Vec4 {
        let uv: Vec2 = self.interpolate(&self.uvs[texture.uv_set], triangle, at);
        let uv = texture.transform.transform_point2(uv);
        Vec4::from_array(texture.mips.sample_bilinear(0, uv, texture.wrap))
    }
}

impl Appearance for Scene {
    fn color(&self, triangle: TriangleId, at: Vec3) -> [f32; 3] {
        let material = &self.materials[self.triangle_materials[triangle] as usize];
        let texel = |texture| self.texel(texture, triangle, at);
        let texture = material.base_color_texture.as_ref().map_or(Vec4::ONE, texel);
        let color = material.base_color * texture * self.interpolate(&self.colors, triangle, at);
        color
            .truncate()
            .to_array()
            .map(|x| seamwise_texture::color::linear_to_srgb(x.clamp(0.0, 1.0)))
    }

    fn normal(&self, triangle: TriangleId, at: Vec3) -> Vec3 {
        let material = &self.materials[self.triangle_materials[triangle] as usize];
        let normal = self.interpolate(&self.normals, triangle, at).normalize_or_zero();
        let Some(map) = &material.normal_texture else {
            return normal;
        };
        let [a, b, c] = self.tangents[triangle];
        let tangent = (a * at.x + b * at.y + c * at.z).truncate();
        let bitangent = normal.cross(tangent) * a.w;
        let mapped = self.texel(map, triangle, at).truncate() * 2.0 - 1.0;
        let scale = material.normal_scale;
        (tangent * (mapped.x * scale) + bitangent * (mapped.y * scale) + normal * mapped.z)
            .normalize_or(normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::{Alpha, Material};

    /// A white triangle whose normals lean to one side.
    fn leaning(normal: Vec3) -> Scene {
        let white = Material {
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 0.0,
            metallic_roughness_texture: None,
            roughness: 1.0,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            alpha: Alpha::Opaque,
            double_sided: true,
            unlit: false,
        };
        Scene {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![normal; 3],
            colors: vec![Vec4::ONE; 3],
            triangles: vec![[0, 1, 2]],
            tangents: vec![[Vec4::ZERO; 3]],
            triangle_materials: vec![0],
            materials: vec![white],
            ..Scene::default()
        }
    }

    #[test]
    fn without_light_normals_do_not_show() {
        let (reference, candidate) = (leaning(Vec3::Z), leaning(Vec3::X));
        let options = Options { views: 2, resolution: 32, samples: 100 };
        let luminance = |mode| {
            let metrics = Reference::with_mode(&reference, options, mode)?.compare(&candidate)?;
            Ok::<_, Error>(metrics.rms_luminance)
        };
        assert_eq!(luminance(Mode::Unlit).unwrap(), 0.0);
        assert!(luminance(Mode::Lit).unwrap() > 0.01);
    }
}
