//! The levels of a bake as documents, each with its name and its measured error.

use serde_json::{Value, json};

use super::certificate::{certificate, certify};
use super::document::{Coverage, chain_asset, with_source_morphs};
use super::files::{Layout, OutputOptions};
use super::needle::{Sources, needle_documents};
use crate::document::asset::Asset;
use crate::error::Result;
use crate::evaluate::{Metrics, Part};
use crate::image_file::encoded::EncodedImage;
use crate::level::AssetLevel;
use crate::level::geomorph::SourceMorph;
use crate::limit::MemoryLimit;
use crate::screen::{Screen, switch_sizes};
use crate::warning::Warnings;

/// The input of all files of a bake.
pub(crate) struct Chain<'a> {
    pub(crate) asset: &'a Asset,
    pub(crate) levels: &'a [AssetLevel<'a>],
    pub(crate) images: &'a [EncodedImage],
    pub(crate) output: OutputOptions,
    /// The screen that the certificates are computed for.
    pub(crate) screen: Screen,
    /// The ways of the source's primitives to the first level, if they are to have them.
    pub(crate) source_morphs: Vec<SourceMorph>,
    /// Most memory that decoding one image may take.
    pub(crate) limit: MemoryLimit,
}

impl Chain<'_> {
    /// The documents of the levels, certified if they were measured, and the one of all of them if
    /// there is to be one, and what belongs beside that; each with its name.
    pub(crate) fn documents(
        &self,
        mut levels: Vec<Asset>,
        measured: Option<&Measured>,
        stem: &str,
    ) -> Result<Vec<(String, Asset)>> {
        let certificates = measured.map(|measured| self.certificates(measured));
        for (level, certificate) in levels.iter_mut().zip(certificates.iter().flatten()) {
            certify(level, certificate.clone());
        }
        let (output, screen) = (self.output, &self.screen);
        let mut beside = Vec::new();
        if output.layout != Layout::None {
            let sizes = measured.map(Measured::sizes);
            let coverage = measured.zip(sizes.as_deref()).map(|(measured, sizes)| Coverage {
                screen,
                sizes,
                diagonal: measured.diagonal,
            });
            let (asset, levels_of, images) = (self.asset, self.levels, self.images);
            let mut all = if output.layout == Layout::Needle {
                let limit = self.limit;
                let sources = Sources { asset, levels: levels_of, images, coverage, stem, limit };
                let all;
                (all, beside) = needle_documents(&sources)?;
                all
            } else {
                chain_asset(asset, levels_of, images, output, coverage.as_ref())?
            };
            if !self.source_morphs.is_empty() {
                all = with_source_morphs(&all, &self.source_morphs)?;
            }
            if let Some(certificates) = certificates {
                certify(&mut all, json!({"levels": certificates}));
            }
            levels.push(all);
        }
        let names = output.names(stem, self.levels.len());
        Ok(names.into_iter().zip(levels).chain(beside).collect())
    }

    /// The certificates of the levels, the finest first.
    fn certificates(&self, measured: &Measured) -> Vec<Value> {
        let sizes = measured.sizes();
        let of_level = |(index, metrics): (usize, &Metrics)| {
            let triangles = self.levels[index].meshes.iter().map(|mesh| mesh.triangles).sum();
            certificate(index + 1, metrics, triangles, sizes[index], &self.screen)
        };
        measured.metrics.iter().enumerate().map(of_level).collect()
    }
}

/// Results of the evaluation of levels.
pub(crate) struct Measured {
    /// One per level.
    pub(crate) metrics: Vec<Metrics>,
    /// One per level: the part of the source where it is off the most, if it is.
    pub(crate) farthest: Vec<Option<Part>>,
    /// Diagonal of the source's bounding box, in world units.
    pub(crate) diagonal: f64,
    /// Warnings about the measurement as a whole.
    pub(crate) warnings: Warnings,
}

impl Measured {
    /// Empty results for a source whose bounding box has this diagonal.
    pub(crate) fn new(diagonal: f64) -> Self {
        Self { metrics: Vec::new(), farthest: Vec::new(), diagonal, warnings: Warnings::default() }
    }

    /// The largest size of each level in pixels, by [`switch_sizes`].
    pub(crate) fn sizes(&self) -> Vec<f64> {
        switch_sizes(self.metrics.iter().map(|metrics| metrics.at_switch.pixels))
    }
}
