//! What a level was to reach, and what it has.

use serde::Serialize;

/// The figure of a level that is bounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// SSIM of the worst of all views, at least the bound, in frames of so many pixels each way.
    Quality,
    /// Pixels that the surface is off, but for a thousandth of it, at most the bound, where the
    /// diagonal spans so many pixels.
    PixelsOff,
    /// Bytes of the level as a .glb, at most the bound.
    Bytes,
    /// Vertices of the level, at most the bound.
    Vertices,
}

impl Measure {
    /// Whether a value is within a bound.
    pub(crate) fn holds(self, value: f64, bound: f64) -> bool {
        if self == Self::Quality { value >= bound } else { value <= bound }
    }

    /// Whether the coarsest level that holds the bound is wanted, and not the finest.
    pub(crate) fn wants_coarsest(self) -> bool {
        matches!(self, Self::Quality | Self::PixelsOff)
    }
}

/// The bound of a level and what it has.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Reached {
    /// The figure.
    pub measure: Measure,
    /// Its bound.
    pub bound: f64,
    /// What the level has.
    pub value: f64,
    /// The size at which it was looked at, in pixels, if it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixels: Option<u32>,
}

impl Reached {
    /// A line that tells it of a level.
    pub(crate) fn line(&self, level: usize) -> String {
        let Self { bound, value, pixels, .. } = self;
        let at = pixels.map_or(String::new(), |pixels| format!(" at {pixels} pixels"));
        match self.measure {
            Measure::Quality => {
                format!(
                    "level {level}: similarity {value:.4} in the worst view{at}, of {bound} asked"
                )
            }
            Measure::PixelsOff => {
                format!("level {level}: off by {value:.3} pixels{at}, of at most {bound}")
            }
            Measure::Bytes => format!("level {level}: {value} bytes, of at most {bound}"),
            Measure::Vertices => format!("level {level}: {value} vertices, of at most {bound}"),
        }
    }
}
