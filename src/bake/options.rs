//! Options of a bake, resolved and checked.

use std::time::Duration;

use seamwise_attr::Polish;

use super::goals::Goals;
use super::steering::Steering;
use crate::error::{Error, Result};
use crate::evaluate;
use crate::export::files::{Geomorph, Layout, OutputOptions};
use crate::import::options::ReadOptions;
use crate::screen::Screen;
use crate::transfer::TransferOptions;

/// Options of a bake.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// The target triangle count of each level, the finest first.
    pub targets: Targets,
    /// What levels are to reach instead, if anything: as many as `targets` has, whose counts are then
    /// found.
    pub goals: Option<Goals>,
    /// The scope of those counts: over each mesh or over the scene.
    pub budget_per: BudgetPer,
    /// Options of the simplification.
    pub steering: Steering,
    /// Options of the fit of levels to the source after simplification, if there is one.
    pub polish: Option<Polish>,
    /// The handling of textures.
    pub textures: Textures,
    /// The files of textures, once all are made.
    pub texture_files: TextureFiles,
    /// Options of the evaluation of levels, if there is one; for the pixel tolerance of `screen`, and for
    /// its height unless they have another than their default.
    pub evaluate: Option<evaluate::Options>,
    /// Whether the display of progress gets a table of rough figures before levels are measured.
    pub preview: bool,
    /// Whether levels are measured against the source as it is even where its atlases bleed, instead of
    /// with them filled.
    pub reference_as_is: bool,
    /// The screen that the sizes of the levels are computed for.
    pub screen: Screen,
    /// Whether a page with charts and pictures is written.
    pub report: Option<ReportOptions>,
    /// Options of reading the asset. Their memory limit is also the most that decoding one image
    /// may take, all vertices, and all of the scene with its instances. Images that may be missing
    /// are measured as white or flat, and stay named.
    pub reading: ReadOptions,
    /// The time limit of a bake, if any. It is tested between steps, so a bake ends late by one at
    /// most, and writes nothing.
    pub time_limit: Option<Duration>,
    /// The files that levels are written to, and their form.
    pub output: OutputOptions,
    /// Whether an asset in which there is nothing, not even a point, is baked as it is, as one among many;
    /// else it is an error.
    pub allow_empty: bool,
}

/// Options of the page of a bake beyond its results.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReportOptions {
    /// The time of the same bake on 1, 2, … threads up to all, which runs it as many times more.
    pub threads: bool,
    /// How many times it runs on each.
    pub thread_runs: usize,
    /// Whether the page is not written with the levels: it is for the caller to put somewhere.
    pub apart: bool,
}

impl BakeOptions {
    /// Makes sure that they can be had together.
    ///
    /// # Errors
    /// [`Error::Options`] if not.
    pub(super) fn check(&self) -> Result<()> {
        self.output.check()?;
        let has_own_textures = matches!(self.textures, Textures::Transfer(_));
        if self.output.layout == Layout::Needle && has_own_textures {
            let what = "in the layout needle all levels share the source's textures: choose the textures repair or \
                        keep, or another layout";
            return Err(Error::Options { what: what.into() });
        }
        Ok(())
    }

    /// Options of the evaluation of levels, for the screen that their sizes are found for.
    pub fn evaluation(&self) -> Option<evaluate::Options> {
        let Screen { pixel_tolerance, height, .. } = self.screen;
        let usual = evaluate::Options::default().screen_height;
        self.evaluate.map(|own| {
            let screen_height = if own.screen_height == usual { height } else { own.screen_height };
            evaluate::Options { pixel_tolerance, screen_height, ..own }
        })
    }
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self {
            targets: Targets::default(),
            goals: None,
            budget_per: BudgetPer::default(),
            steering: Steering::default(),
            polish: Some(Polish::default()),
            textures: Textures::default(),
            texture_files: TextureFiles::default(),
            evaluate: Some(evaluate::Options::default()),
            preview: false,
            reference_as_is: false,
            screen: Screen::default(),
            report: None,
            reading: ReadOptions::default(),
            time_limit: None,
            output: OutputOptions::default(),
            allow_empty: false,
        }
    }
}

/// Triangles of each level, the finest first. Those of a mesh count once, however often it is shown.
#[derive(Clone, Debug, PartialEq)]
pub enum Targets {
    /// Shares of the source's triangles, 0…1.
    Ratios(Vec<f64>),
    /// Triangle counts over the whole asset.
    Triangles(Vec<usize>),
}

/// The distribution of a level's triangles over the meshes of an asset. Meshes whose borders meet
/// are one in this.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BudgetPer {
    /// Each mesh keeps the same share of its own, and twelve at least if it has them.
    Mesh,
    /// Each keeps the triangles that cost most to lose, as large and as often as the scene shows
    /// it.
    #[default]
    Scene,
}

impl Default for Targets {
    /// Four levels, each half of the one before.
    fn default() -> Self {
        Self::halves(4)
    }
}

impl Targets {
    /// Targets of so many levels, each half of the one before.
    pub fn halves(levels: usize) -> Self {
        Self::Ratios((1..=levels).map(|level| 0.5f64.powi(level as i32)).collect())
    }

    /// Shares of the source.
    ///
    /// # Errors
    /// [`Error::Options`] if there are none, one is not in 0…1 or they grow.
    pub fn ratios(ratios: Vec<f64>) -> Result<Self> {
        if ratios.iter().any(|ratio| !(*ratio > 0.0 && *ratio <= 1.0)) {
            let what = "each ratio must lie above 0 and up to 1";
            let hint = as_percents(&ratios).map(|own| format!(": did you mean {own}?"));
            return Err(Error::Options { what: what.to_owned() + &hint.unwrap_or_default() });
        }
        if ratios.is_empty() || ratios.windows(2).any(|pair| pair[0] < pair[1]) {
            return Err(Error::Options { what: "ratios must be given from fine to coarse".into() });
        }
        Ok(Self::Ratios(ratios))
    }

    /// Triangle counts.
    ///
    /// # Errors
    /// [`Error::Options`] if there are none, one is 0 or they grow.
    pub fn triangles(counts: Vec<usize>) -> Result<Self> {
        if counts.contains(&0) {
            return Err(Error::Options { what: "a level must have at least one triangle".into() });
        }
        if counts.is_empty() || counts.windows(2).any(|pair| pair[0] < pair[1]) {
            let what = "triangle counts must be given from fine to coarse".into();
            return Err(Error::Options { what });
        }
        Ok(Self::Triangles(counts))
    }

    /// Number of levels.
    pub fn count(&self) -> usize {
        match self {
            Self::Ratios(ratios) => ratios.len(),
            Self::Triangles(counts) => counts.len(),
        }
    }

    /// The triangles of each level of a source of `total` triangles, 1 at least.
    pub fn counts(&self, total: usize) -> Vec<usize> {
        let count = |share: f64| ((total as f64 * share).round() as usize).max(1);
        self.shares(total).into_iter().map(count).collect()
    }

    /// The shares of a source of `total` triangles.
    pub fn shares(&self, total: usize) -> Vec<f64> {
        match self {
            Self::Ratios(ratios) => ratios.clone(),
            Self::Triangles(counts) => {
                counts.iter().map(|&count| (count as f64 / total as f64).min(1.0)).collect()
            }
        }
    }
}

impl std::fmt::Display for Targets {
    /// As they are typed.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let list: Vec<String> = match self {
            Self::Ratios(ratios) => ratios.iter().map(|own| format!("{} %", own * 100.0)).collect(),
            Self::Triangles(counts) => counts.iter().map(ToString::to_string).collect(),
        };
        write!(f, "{}", list.join(", "))?;
        match self {
            Self::Ratios(_) => Ok(()),
            Self::Triangles(_) => write!(f, " triangles"),
        }
    }
}

/// Percents as the shares that were meant, if they can be that.
fn as_percents(ratios: &[f64]) -> Option<String> {
    let are_percents = ratios.iter().all(|ratio| *ratio >= 1.0 && *ratio <= 100.0);
    let shares: Vec<String> = ratios.iter().map(|ratio| (ratio / 100.0).to_string()).collect();
    are_percents.then(|| shares.join(","))
}

/// The handling of an asset's textures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Textures {
    /// Each level has its own, sampled from the surface of the source; what can't be told apart in
    /// its layout is shared as in a repair.
    Transfer(TransferOptions),
    /// All levels share the source's textures, with every texel that no chart covers filled.
    Repair,
    /// All levels share the source's textures as they are.
    Keep,
}

impl Default for Textures {
    /// Each level has its own where they show less error than the source's, in the layout of these.
    fn default() -> Self {
        Self::Transfer(TransferOptions { chooses: true, ..TransferOptions::default() })
    }
}

impl Textures {
    /// Whether levels share the source's unless more is said: those that goals bound share what they are
    /// bounded by, those that lead to the next one lead its UVs too, and those of the layout needle take each
    /// other's place under one material.
    pub fn are_shared_by_default(goals: Option<&Goals>, output: OutputOptions) -> bool {
        let OutputOptions { geomorph, layout, .. } = output;
        goals.is_some() || geomorph != Geomorph::None || layout == Layout::Needle
    }
}

/// The files of textures, once all are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TextureFiles {
    /// Whether they are KTX2 (`KHR_texture_basisu`), the source's as well as levels' own: UASTC with all mip maps, which
    /// stays compressed on a graphics processor.
    pub ktx2: bool,
    /// Whether PNGs are as small as they can be without loss, the source's as well as levels' own, which takes many times
    /// as long.
    pub smallest_png: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_seen_at_the_sizes_of_the_screen() {
        let screen = Screen { pixel_tolerance: 0.5, ..Screen::default() };
        let options = BakeOptions { screen, ..BakeOptions::default() };
        assert_eq!(options.evaluation().map(|options| options.pixel_tolerance), Some(0.5));
    }

    #[test]
    fn four_halves_are_the_default() {
        assert_eq!(Targets::default().shares(1000), [0.5, 0.25, 0.125, 0.0625]);
    }

    #[test]
    fn counts_become_shares_and_never_more_than_all() {
        let targets = Targets::triangles(vec![2000, 100]).unwrap();
        assert_eq!(targets.shares(1000), [1.0, 0.1]);
    }

    #[test]
    fn targets_that_make_no_sense_are_refused() {
        for ratios in [vec![], vec![0.0], vec![1.5], vec![f64::NAN], vec![0.1, 0.5]] {
            assert!(Targets::ratios(ratios).is_err());
        }
        assert!(Targets::triangles(vec![5, 9]).is_err());
        assert!(Targets::triangles(vec![0]).is_err());
    }
}
