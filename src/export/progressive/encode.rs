//! Splits as blocks, the coarsest level first.

use seamwise_attr::ProgressiveScene;

use super::blocks::{Columns, Damage};
use super::script::{ERROR, STEP};
use super::source::Refined;
use crate::error::{Error, Result};

/// Splits of a block: a share of the points there are, within bounds.
const POINTS_PER_SPLIT: usize = 4;
const MIN_SPLITS: usize = 512;
const MAX_SPLITS: usize = 16_384;

/// Tells all splits. `surfaces` are at their coarsest, where `coarsest` looks at them, and are the source after.
pub(super) fn write_splits(
    scene: &ProgressiveScene,
    surfaces: &mut [Refined<'_>],
    columns: usize,
    coarsest: impl FnOnce(&[Refined<'_>]),
) -> Result<Vec<u8>> {
    let internal =
        |damage: Damage| Error::internal(format!("a split that can't be told: {damage:?}"));
    let mut out = Columns::new(columns);
    for surface in &mut *surfaces {
        surface.write_coarsest(&mut out).map_err(internal)?;
    }
    coarsest(surfaces);
    let mut blocks = out.pack().map_err(Error::internal)?;
    let mut error = error_of(surfaces);
    out = Columns::new(columns);
    let (mut splits, mut most) = (0, splits_of(surfaces));
    for &index in scene.order().iter().rev() {
        let surface = &mut surfaces[index as usize];
        if surface.mesh.unsettled().is_some() {
            out.number(STEP, 2 * index + 1);
            surface.write_unsettled(&mut out).map_err(internal)?;
        }
        out.number(STEP, 2 * index);
        surface.write_split(&mut out).map_err(internal)?;
        let finer = error_of(surfaces);
        out.number(ERROR, error.to_bits().saturating_sub(finer.to_bits()));
        error = finer.min(error);
        splits += 1;
        if splits == most {
            blocks.extend(out.pack().map_err(Error::internal)?);
            out = Columns::new(columns);
            (splits, most) = (0, splits_of(surfaces));
        }
    }
    if splits > 0 {
        blocks.extend(out.pack().map_err(Error::internal)?);
    }
    Ok(blocks)
}

/// The error of all surfaces as they are now.
pub(super) fn error_of(surfaces: &[Refined<'_>]) -> f32 {
    surfaces.iter().map(|own| own.mesh.error()).fold(0.0, f32::max)
}

/// Splits of the next block.
fn splits_of(surfaces: &[Refined<'_>]) -> usize {
    let points: usize = surfaces.iter().map(|own| own.surface.positions.len()).sum();
    (points / POINTS_PER_SPLIT).clamp(MIN_SPLITS, MAX_SPLITS)
}
