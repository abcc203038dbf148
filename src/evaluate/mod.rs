//! How far a candidate is from its reference: in pictures, over the surface, and in volume.
//!
//! The rig of cameras stands around the reference, so every candidate is seen from the same
//! places; distances are divided by the diagonal of the reference's bounding box. A thing compared
//! with itself is 0 away from itself in every figure, exactly.

pub mod appearance;
mod batch;
pub mod camera;
mod coat;
pub mod distance;
mod farthest;
mod frame;
pub mod heat;
pub mod isosurfaces;
pub(crate) mod label;
mod layer;
mod light;
pub mod load;
mod looks;
pub mod luminance;
mod metrics;
mod paint;
mod patch;
mod raster;
pub mod reference;
pub mod render;
pub mod scene;
mod seams;
mod shade;
pub mod sheet;
pub mod similarity;
mod switch;
mod tiles;
mod vectors;
mod views;
pub mod visible;
pub mod volume;
pub mod wireframe;

use glam::DVec3;

use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::limit::MemoryLimit;
use crate::screen::Screen;
use crate::warning::Warnings;
use appearance::compare_appearance;
use camera::Rig;
use distance::{SampledSurface, correspond};
use load::{TextureCache, load};
use looks::count_foldovers;
use reference::ReferenceScene;
use scene::{Mode, Scene};
use switch::{KnownColors, Sight, SwitchSearch};
use views::{Seen, Views};
use volume::{Measures, Soundness, check_soundness, measure};

pub use metrics::{AtSwitch, Metrics, OneSidedDistance, ViewMetrics};

/// How thoroughly to look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Cameras, 1 to 24.
    pub views: usize,
    /// Pixels along each side of a view.
    pub resolution: usize,
    /// Samples on each surface.
    pub samples: usize,
    /// How many pixels a surface may be off where a candidate takes over; see
    /// [`screen`](crate::screen).
    pub pixel_tolerance: f64,
    /// The largest size at which pictures are looked at to find where a candidate takes over: the
    /// screen's height in pixels. With 0 its surface alone decides.
    pub screen_height: u32,
}

impl Default for Options {
    fn default() -> Self {
        let Screen { pixel_tolerance, height: screen_height, .. } = Screen::default();
        Self { views: 24, resolution: 512, samples: 200_000, pixel_tolerance, screen_height }
    }
}

/// A reference, rendered and sampled once for all its candidates.
pub struct Reference<'a> {
    scene: &'a Scene,
    options: Options,
    mode: Mode,
    rig: Rig,
    views: Views,
    colors: KnownColors,
    surface: SampledSurface<'a>,
    measures: Measures,
    soundness: Soundness,
}

/// A part of a document: indices of a mesh and of a material of it, if that is not the default.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// The mesh.
    pub mesh: usize,
    /// The material.
    pub material: Option<usize>,
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
        let rig = Rig::around(scene, options.views, options.resolution);
        Self::with_rig(scene, options, mode, rig)
    }

    /// Renders a reference by cameras of the caller's, and samples it. They replace the views and
    /// the resolution of the options.
    ///
    /// # Errors
    /// [`Error::Invalid`] if it has no surface to compare with.
    pub fn with_rig(scene: &'a Scene, options: Options, mode: Mode, rig: Rig) -> Result<Self> {
        let measures = measure(&scene.positions, &scene.triangles);
        if measures.area.is_nan() || measures.area <= 0.0 {
            return Err(Error::invalid("the reference", "it has no surface"));
        }
        Ok(Self {
            options,
            mode,
            views: Views::with_seams(scene, &rig, mode),
            colors: KnownColors::default(),
            rig,
            surface: SampledSurface::new(&scene.positions, &scene.triangles, options.samples, SEED),
            measures,
            soundness: check_soundness(&scene.positions, &scene.triangles),
            scene,
        })
    }

    /// Warns if it is in no view, where all candidates look alike.
    pub fn warn_if_unseen(&self, warnings: &mut Warnings) {
        if !self.views.show_something() {
            let what = "no view shows it, so that figures of what is seen say nothing; look at its \
                        opacity and at its sides";
            warnings.add("the source", what);
        }
    }

    /// The diagonal of its bounding box, in world units.
    pub fn diagonal(&self) -> f64 {
        self.measures.diagonal
    }

    /// The mesh and the material of its triangle nearest to a place, in world units; `None` if that is not
    /// finite.
    pub fn part_at(&self, place: [f64; 3]) -> Option<Part> {
        let triangle = self.surface.nearest(DVec3::from_array(place) - self.scene.origin)?;
        let material = self.scene.triangle_materials[triangle] as usize;
        let is_default = material + 1 == self.scene.materials.len();
        let mesh = *self.scene.triangle_meshes.get(triangle.index())? as usize;
        Some(Part { mesh, material: (!is_default).then_some(material) })
    }

    /// A place in the world.
    fn in_world(&self, place: &DVec3) -> [f64; 3] {
        (self.scene.origin + place).to_array()
    }

    /// Where the cameras are counted from, in the world.
    pub fn origin(&self) -> DVec3 {
        self.scene.origin
    }

    /// The cameras that see it and every candidate, counted from [`Reference::origin`].
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    fn sight(&self) -> Sight<'_> {
        let Options { pixel_tolerance, screen_height, .. } = self.options;
        Sight {
            scene: self.scene,
            mode: self.mode,
            rig: &self.rig,
            views: &self.views,
            colors: &self.colors,
            diagonal: self.diagonal(),
            pixel_tolerance,
            screen_height,
        }
    }

    /// Compares a candidate.
    ///
    /// # Errors
    /// [`Error::Invalid`] if it has no surface to compare.
    pub fn compare(&self, candidate: &Scene) -> Result<Metrics> {
        Ok(self.compare_by_view(candidate)?.0)
    }

    /// Compares a candidate; besides, tells how it differs in each view, in the order of the rig.
    ///
    /// # Errors
    /// [`Error::Invalid`] if it has no surface to compare.
    pub fn compare_by_view(&self, candidate: &Scene) -> Result<(Metrics, Vec<ViewMetrics>)> {
        let candidate = &*candidate.counted_from(self.scene.origin);
        let no_surface = || Error::invalid("the candidate", "it has no surface");
        let (positions, triangles) = (&candidate.positions, &candidate.triangles);
        let surface = SampledSurface::new(positions, triangles, self.options.samples, SEED);
        let forward = correspond(&self.surface, &surface).ok_or_else(no_surface)?;
        let backward = correspond(&surface, &self.surface).ok_or_else(no_surface)?;
        let (there, back) = (forward.distances(), backward.distances());
        let both = OneSidedDistance::new(there.symmetric(back), self.measures.diagonal);
        let looks = compare_appearance(self.scene, candidate, &forward, &backward).pooled;
        let (measures, soundness) =
            (measure(positions, triangles), check_soundness(positions, triangles));
        let views = Views::new(candidate, &self.rig, self.mode);
        let by_view = self.views.compare(&views);
        let seen = Seen::pool(&by_view);
        let difference = seen.difference;
        let reference = self.sight();
        let search = SwitchSearch { reference, candidate, views: &views, by_view: &by_view };
        let at_switch = search.run(both.distance_p999);
        let gained = |now: usize, before: usize| now as i64 - before as i64;
        let metrics = Metrics {
            rms_luminance: difference.rms(),
            rms_luminance_srgb: difference.rms_srgb(),
            rms_luminance_covered: difference.rms_covered(),
            rms_luminance_srgb_covered: difference.rms_covered_srgb(),
            rms_luminance_seams: difference.rms_seams(),
            rms_luminance_srgb_seams: difference.rms_seams_srgb(),
            psnr_srgb: peak_ratio(difference.rms_srgb()),
            ssim: seen.similarity.mean(),
            ssim_worst_view: by_view.iter().map(|seen| seen.similarity.mean()).fold(1.0, f64::min),
            silhouette_iou: difference.overlap(),
            at_switch,
            distance_rms: both.distance_rms,
            distance_mean: both.distance_mean,
            distance_p999: both.distance_p999,
            distance_max: both.distance_max,
            distance_max_at: self
                .in_world(&if there.max < back.max { &backward } else { &forward }.farthest),
            forward: OneSidedDistance::new(there, self.measures.diagonal),
            backward: OneSidedDistance::new(back, self.measures.diagonal),
            color_rms: looks.color_rms,
            normal_degrees_rms: looks.normal_degrees_rms,
            volume: self.volume_ratio(&measures).map(|_| measures.volume),
            area: measures.area,
            volume_ratio: self.volume_ratio(&measures),
            area_ratio: measures.area / self.measures.area,
            diagonal_ratio: measures.diagonal / self.measures.diagonal,
            uv_foldovers: count_foldovers(self.scene, candidate, &backward),
            degenerate_triangles: soundness.degenerate_triangles,
            border_edges_gained: gained(soundness.border_edges, self.soundness.border_edges),
            non_manifold_edges_gained: gained(
                soundness.non_manifold_edges,
                self.soundness.non_manifold_edges,
            ),
        };
        let is_seen = self.views.show_something() || views.show_something();
        let metrics = if is_seen { metrics } else { metrics.unseen() };
        Ok((metrics, by_view.iter().map(Seen::metrics).collect()))
    }

    /// A sheet or a flat thing has no volume of its own: what rounding leaves says nothing.
    fn volume_ratio(&self, candidate: &Measures) -> Option<f64> {
        let own = self.measures;
        let is_solid = own.volume.abs() > 1e-6 * own.area * own.diagonal;
        is_solid.then(|| candidate.volume / own.volume)
    }
}

/// The peak signal-to-noise ratio of an RMS error on a scale of 0…1, in decibels; `None` where there
/// is no error at all.
fn peak_ratio(rms: f64) -> Option<f64> {
    (rms > 0.0).then(|| -20.0 * rms.log10())
}

/// Compares each candidate, a level of detail from any tool, with the asset that it stands for, as the
/// command line tool does by default: with its atlases filled where it bleeds and that shows. [`Reference`]
/// compares with it as it is.
///
/// ```
/// use seamwise::evaluate::{Options, compare_assets};
/// use seamwise::import::read_bytes;
///
/// # let sample = include_bytes!("../../data/sample.glb");
/// let source = read_bytes(sample, std::path::Path::new(""))?;
/// let options = Options { views: 1, resolution: 64, samples: 1000, ..Options::default() };
/// let metrics = compare_assets(&source, &[source.clone()], options)?.remove(0);
/// assert_eq!(metrics.distance_max, 0.0, "it is as far from itself as it should be");
/// # Ok::<(), seamwise::Error>(())
/// ```
///
/// # Errors
/// [`Error::Invalid`] if the reference has no surface to compare with, or an
/// image of an asset is damaged.
pub fn compare_assets(
    reference: &Asset,
    candidates: &[Asset],
    options: Options,
) -> Result<Vec<Metrics>> {
    let mut textures = TextureCache::default();
    let limit = MemoryLimit::default();
    let own = ReferenceScene::cleaned(reference, None, Mode::Lit, limit, &mut textures)?;
    let reference = Reference::new(&own.scene, options)?;
    candidates.iter().map(|asset| reference.compare(&load(asset, &mut textures)?)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec3, Vec4};
    use scene::Material;

    /// A white triangle whose normals lean to one side.
    fn leaning(normal: Vec3) -> Scene {
        let white = Material { metallic: 0.0, double_sided: true, ..Material::default() };
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
        let options = Options { views: 2, resolution: 32, samples: 100, ..Options::default() };
        let luminance = |mode| {
            let metrics = Reference::with_mode(&reference, options, mode)?.compare(&candidate)?;
            Ok::<_, Error>(metrics.rms_luminance)
        };
        assert_eq!(luminance(Mode::Unlit).unwrap(), 0.0);
        assert!(luminance(Mode::Lit).unwrap() > 0.01);
    }
}
