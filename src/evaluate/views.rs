//! A scene as a rig sees it, and how two such sets of pictures differ.

use rayon::prelude::*;

use super::camera::Rig;
use super::luminance::Difference;
use super::render::{Image, render_views};
use super::scene::{Mode, Scene};
use super::similarity::{Similarity, Tones};
use crate::error::Result;

/// One picture per camera, in their order.
pub(super) struct Views {
    images: Vec<Image>,
    tones: Vec<Tones>,
}

/// How the pictures of two scenes differ, all views pooled.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen {
    pub(super) difference: Difference,
    pub(super) similarity: Similarity,
}

impl Views {
    pub(super) fn new(scene: &Scene, rig: &Rig, mode: Mode) -> Self {
        let images = render_views(scene, rig, mode);
        let tones = images.par_iter().map(Tones::of).collect();
        Self { images, tones }
    }

    /// Compares those of a candidate by the same rig. `seams` tells for each view the pixels in the
    /// band around seams, and may be empty.
    pub(super) fn compare(&self, candidate: &Self, seams: &[Vec<bool>]) -> Result<Seen> {
        let compare = |view: usize| {
            let band = seams.get(view).map_or(&[][..], Vec::as_slice);
            let difference = Difference::between(&self.images[view], &candidate.images[view], band);
            let similarity = Similarity::between(&self.tones[view], &candidate.tones[view])?;
            Ok((difference, similarity))
        };
        let views: Vec<_> =
            (0..self.images.len()).into_par_iter().map(compare).collect::<Result<_>>()?;
        // In their order, so that the thread count changes no bit.
        let mut pooled = Seen::default();
        for (difference, similarity) in views {
            pooled.difference += difference;
            pooled.similarity += similarity;
        }
        Ok(pooled)
    }
}
