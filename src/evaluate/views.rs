//! A scene as a rig sees it, and how two such sets of pictures differ.

use rayon::prelude::*;

use super::camera::Rig;
use super::luminance::Difference;
use super::metrics::{AtSwitch, ViewMetrics};
use super::render::{Image, render_views, render_with};
use super::scene::{Mode, Scene};
use super::seams::{mark_band, seam_edges};
use super::similarity::{Similarity, Tones};
use super::tiles::Tile;
use super::visible::Colors;

/// One picture per camera, in their order.
pub(super) struct Views {
    pub(super) images: Vec<Image>,
    tones: Vec<Tones>,
    /// One per picture: the pixels in the band around the scene's seams, if they were looked for.
    seams: Vec<Vec<bool>>,
}

/// How the pictures of two scenes differ, in one view or in many.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen {
    pub(super) difference: Difference,
    pub(super) similarity: Similarity,
}

impl Views {
    pub(super) fn new(scene: &Scene, rig: &Rig, mode: Mode) -> Self {
        let images = render_views(scene, rig, mode);
        let tones = images.par_iter().map(Tones::of).collect();
        Self { images, tones, seams: Vec::new() }
    }

    /// Besides, finds the band around the scene's seams.
    pub(super) fn with_seams(scene: &Scene, rig: &Rig, mode: Mode) -> Self {
        let edges = seam_edges(scene);
        let render = |camera| {
            let mut band = vec![false; rig.resolution * rig.resolution];
            let mark = |tile: &Tile<'_>| mark_band(tile, &edges, &mut band);
            (render_with(scene, camera, (rig.resolution, mode), mark), band)
        };
        let (images, seams): (Vec<Image>, _) = rig.cameras.par_iter().map(render).unzip();
        let tones = images.par_iter().map(Tones::of).collect();
        Self { images, tones, seams }
    }

    /// Whether the scene is in any picture.
    pub(super) fn show_something(&self) -> bool {
        self.images.iter().any(|image| image.coverage.iter().any(|samples| *samples != 0))
    }

    /// Compares those of a candidate by the same rig, view by view.
    pub(super) fn compare(&self, candidate: &Self) -> Vec<Seen> {
        let compare = |view: usize| {
            let band = self.seams.get(view).map_or(&[][..], Vec::as_slice);
            let difference = Difference::between(&self.images[view], &candidate.images[view], band);
            let similarity = Similarity::between(&self.tones[view], &candidate.tones[view]);
            Seen { difference, similarity }
        };
        (0..self.images.len()).into_par_iter().map(compare).collect()
    }
}

impl Views {
    /// The largest difference that is seen in a view of both; see [`super::visible`].
    pub(super) fn visible_difference(&self, candidate: &Self) -> f64 {
        let difference = |(own, other)| Colors::of(own).difference(&Colors::of(other));
        let pairs = self.images.par_iter().zip(&candidate.images);
        pairs.map(difference).collect::<Vec<f64>>().into_iter().fold(0.0, f64::max)
    }
}

impl Seen {
    /// Pools views as if they were one picture, in their order, so that the thread count changes no
    /// bit.
    pub(super) fn pool(views: &[Self]) -> Self {
        let mut pooled = Self::default();
        for view in views {
            pooled.difference += view.difference;
            pooled.similarity += view.similarity;
        }
        pooled
    }

    /// The figures of one view.
    pub(super) fn metrics(&self) -> ViewMetrics {
        let Self { difference, similarity } = self;
        ViewMetrics {
            rms_luminance: difference.rms(),
            rms_luminance_srgb: difference.rms_srgb(),
            rms_luminance_covered: difference.rms_covered(),
            rms_luminance_srgb_covered: difference.rms_covered_srgb(),
            ssim: similarity.mean(),
            silhouette_iou: difference.overlap(),
        }
    }
}

impl AtSwitch {
    pub(super) fn new(pixels: f64, resolution: usize, seen: &Seen, visible: f64) -> Self {
        Self {
            pixels,
            resolution,
            rms_luminance: seen.difference.rms(),
            rms_luminance_srgb: seen.difference.rms_srgb(),
            ssim: seen.similarity.mean(),
            visible_difference: visible,
        }
    }
}
