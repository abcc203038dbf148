//! Arguments of `seamwise bake` for what levels are to reach.

use clap::Args;

use seamwise::bake::goals::{Goals, Measure};
use seamwise::error::{Error, Result};
use seamwise::limit::MemoryLimit;

/// Arguments for goals, of which one may be given, in the place of triangle counts.
#[derive(Debug, Args)]
#[command(next_help_heading = "Levels by what they reach")]
#[group(id = "goals", multiple = true)]
pub(super) struct GoalArgs {
    /// A level for each of these likenesses, above 0 and below 1, from fine to coarse: the one of fewest
    /// triangles whose structural similarity (SSIM) to the source is that in the worst view.
    #[arg(long, value_delimiter = ',', value_name = "Q,Q,…", conflicts_with_all = COUNTS)]
    quality: Option<Vec<f64>>,
    /// A level for each of these sizes, as 1MB,300KB: the finest whose .glb takes no more.
    #[arg(long, value_delimiter = ',', value_name = "SIZE,…", conflicts_with_all = COUNTS)]
    max_bytes: Option<Vec<MemoryLimit>>,
    /// A level for each of these, from fine to coarse: the one of fewest triangles whose surface is off
    /// by no more pixels, but for a thousandth of it.
    #[arg(long, value_delimiter = ',', value_name = "P,P,…", conflicts_with_all = COUNTS)]
    max_pixels_off: Option<Vec<f64>>,
    /// A level for each of these, from fine to coarse: the finest that has no more vertices.
    #[arg(long, value_delimiter = ',', value_name = "N,N,…", conflicts_with_all = COUNTS)]
    vertices: Option<Vec<u32>>,
    /// The size at which --quality and --max-pixels-off look: of the frame, and of the model's diagonal.
    #[arg(long, default_value_t = 512, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=4320))]
    at_pixels: u32,
}

/// Other arguments for the levels.
const COUNTS: [&str; 3] = ["levels", "ratios", "triangles"];

impl GoalArgs {
    /// The goals that these arguments give, if any.
    pub(super) fn resolve(&self) -> Result<Option<Goals>> {
        let floats = |counts: &[u32]| counts.iter().map(|&count| f64::from(count)).collect();
        let bytes = |sizes: &[MemoryLimit]| sizes.iter().map(|size| size.bytes() as f64).collect();
        let given: [(Measure, Option<Vec<f64>>); 4] = [
            (Measure::Quality, self.quality.clone()),
            (Measure::Bytes, self.max_bytes.as_deref().map(bytes)),
            (Measure::PixelsOff, self.max_pixels_off.clone()),
            (Measure::Vertices, self.vertices.as_deref().map(floats)),
        ];
        let mut given = given.into_iter().filter_map(|(measure, bounds)| Some((measure, bounds?)));
        let goals =
            given.next().map(|(measure, bounds)| Goals::new(measure, bounds, self.at_pixels));
        if given.next().is_some() {
            let what =
                "levels have one goal: one of --quality, --max-bytes, --max-pixels-off, --vertices";
            return Err(Error::Options { what: what.into() });
        }
        goals.transpose()
    }
}
