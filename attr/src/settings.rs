//! Settings of a simplification that no list of points belongs to.

use crate::error::{Error, Result};

/// The cost that orders collapses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cost {
    /// The generalized quadric, and what a collapse exposes.
    #[default]
    Quadric,
    /// The squared length of the edge, as a baseline to compare with.
    EdgeLength,
    /// The plain sum of squared distances to planes, as a baseline to compare with (Garland & Heckbert,
    /// "Surface simplification using quadric error metrics", SIGGRAPH 1997): one plane for each triangle at a
    /// point, unweighted and summed once; weights count for nothing, and nothing is held at borders and
    /// seams or charged for what a collapse exposes. Attributes follow at their own minimum.
    Classic,
}

impl Cost {
    /// Whether quadrics are summed anew as the surface is simplified.
    pub(crate) fn is_summed_anew(self) -> bool {
        self != Self::Classic
    }
}

/// The placement of a merged point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Placement {
    /// At the minimum of the cost.
    #[default]
    Best,
    /// At the cheaper end of the edge, with its attributes: all points and, but where a seam ends,
    /// all wedges of a level are the source's to the bit, and a polish leaves them alone.
    Ends,
    /// At the middle of the edge, as a baseline to compare with.
    Middle,
}

/// Weights of a unit of error in each attribute beside a unit of distance.
///
/// Lab note (`cargo bench --bench quality -- --alone --full --views 6 --resolution 256 --samples 30000`):
/// the normal's weight decides. RMS sRGB luminance and RMS distance over the diagonal at 6.25 %:
///
/// | UV, normal | scanned box | gelatin box | racquet |
/// |---|---|---|---|
/// | 0.5, 0.05 | 0.0078, 4.5e-4 | 0.0075, 4.8e-4 | 0.0262, 6.0e-3 |
/// | 1, 0.02 | 0.0055, 2.9e-4 | 0.0061, 3.6e-4 | 0.0247, 5.7e-3 |
/// | 0.5, 0.01 | 0.0044, 2.2e-4 | 0.0056, 3.0e-4 | 0.0231, 5.8e-3 |
/// | **0.5, 0.005** | 0.0042, 1.9e-4 | 0.0056, 2.6e-4 | 0.0212, 4.8e-3 |
/// | 0.2, 0.005 | 0.0042, 2.0e-4 | 0.0056, 2.6e-4 | 0.0204, 4.7e-3 |
/// | 0.5, 0.002 | 0.0043, 1.8e-4 | 0.0058, 2.4e-4 | 0.0204, 4.8e-3 |
///
/// Less than 0.005 buys distance with shading. Seams at 0.1 instead of 1 gain 4 to 11 % in distance
/// on the boxes and let their outlines slide (color 0.0024 → 0.0036 on the first); borders at 1
/// instead of 4 cost the racquet a quarter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Weight of UVs, measured in lengths on the surface.
    pub uv: f64,
    /// Weight of unit normals, in shares of the mesh's extent.
    pub normal: f64,
    /// Weight of colors in 0…1, in shares of the mesh's extent.
    pub color: f64,
    /// Weight of where points move to, in lengths.
    pub motion: f64,
    /// Weight of the planes that hold borders.
    pub border: f64,
    /// Weight of the planes that hold seams and material boundaries.
    pub seam: f64,
}

impl Weights {
    /// Nothing counts but the distance to planes.
    pub(crate) const NONE: Self =
        Self { uv: 0.0, normal: 0.0, color: 0.0, motion: 0.0, border: 0.0, seam: 0.0 };
}

impl Default for Weights {
    fn default() -> Self {
        Self { uv: 0.5, normal: 0.005, color: 0.02, motion: 1.0, border: 4.0, seam: 1.0 }
    }
}

/// The largest distance between a level and its source by default, as a share of the diagonal of the
/// scene's bounding box: beyond it a level is no level of its source any more. Figures are in
/// benches/METRIC.md, where a descent stops.
pub const MAX_DEVIATION: f64 = 0.025;

/// The share of its area that a surface may lose by default.
const MAX_LOST_AREA: f64 = 0.1;

/// Settings of a simplification. [`Settings::default`] holds to the targets whatever it costs;
/// [`Settings::for_diagonal`] ends a descent before the shape is ruined.
///
/// ```
/// use seamwise_attr::Settings;
///
/// let strict = Settings { max_rotation: 30.0, keep_volume: true, ..Settings::default() };
/// assert!(strict.max_deviation.is_none());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Weights of the metric.
    pub weights: Weights,
    /// The cost that orders collapses.
    pub cost: Cost,
    /// The placement of merged points.
    pub placement: Placement,
    /// No collapse may have an error above this, in the units of the mesh.
    pub max_error: Option<f64>,
    /// No part of the surface may end farther than this from the source, nor of the source from it, in
    /// the units of the mesh: a collapse that would is not done. Measured at samples, and on a mesh that
    /// is simplified in regions from below 65,536 triangles on; a polish comes after.
    pub max_deviation: Option<f64>,
    /// The share of the area that may go as borders recede and shells are removed, 0 to 1; only with
    /// `max_deviation`.
    pub max_lost_area: f64,
    /// No collapse may rotate a triangle by more than this, in degrees above 0 and up to 90, nor may a
    /// polish, seen from the level that it is given.
    pub max_rotation: f64,
    /// Points of two shells nearer than this, in the units of the mesh, may merge at their cost by the
    /// quadrics, as if there were an edge between them.
    pub join_distance: Option<f64>,
    /// Whether points of one shell may merge so as well that have no edge between them.
    pub join_own_shell: bool,
    /// Place merged points where the enclosed volume stays what it is, in the descent and in the polish;
    /// only with the best placement.
    pub keep_volume: bool,
    /// Place points of open borders where the area that the surface covers stays what it is, in the descent;
    /// only with the best placement. A polish leaves borders alone.
    pub keep_area: bool,
}

/// Limits on the deviation and the lost area of a simplification.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// How far the surface may be off, in the units of the metric.
    pub(crate) deviation: f64,
    /// The share of its area that may go.
    pub(crate) area: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            weights: Weights::default(),
            cost: Cost::default(),
            placement: Placement::default(),
            max_error: None,
            max_deviation: None,
            max_lost_area: 1.0,
            max_rotation: 75.0,
            join_distance: None,
            join_own_shell: false,
            keep_volume: false,
            keep_area: false,
        }
    }
}

impl Settings {
    /// The settings of the command line tool for a scene whose bounding box has this diagonal, in the
    /// units of the mesh: a surface ends within [`MAX_DEVIATION`] of it, and keeps nine tenths of its area.
    pub fn for_diagonal(diagonal: f64) -> Self {
        let max_deviation = Some(MAX_DEVIATION * diagonal);
        Self { max_deviation, max_lost_area: MAX_LOST_AREA, ..Self::default() }
    }

    /// The limits of a descent in a space of this unit, if there are any.
    pub(crate) fn limits(&self, unit: f64) -> Option<Limits> {
        let deviation = self.max_deviation?;
        Some(Limits { deviation: deviation / unit, area: self.max_lost_area })
    }

    /// The cosine of the largest rotation.
    pub(crate) fn rotation_cosine(&self) -> f64 {
        self.max_rotation.to_radians().cos()
    }

    /// Checks that every figure makes sense.
    ///
    /// # Errors
    /// [`Error::Options`] with the one that does not, and what it has to be.
    pub fn check(&self) -> Result<()> {
        let refuse = |what: &str| Err(Error::Options { what: what.into() });
        let w = self.weights;
        if [w.uv, w.normal, w.color, w.motion, w.border, w.seam]
            .iter()
            .any(|w| !w.is_finite() || *w < 0.0)
        {
            return refuse("weights must be finite and not negative");
        }
        if self.max_error.is_some_and(|error| error.is_nan() || error < 0.0) {
            return refuse("the error limit must be 0 or more");
        }
        if !(self.max_rotation > 0.0 && self.max_rotation <= 90.0) {
            return refuse("a rotation must be above 0 and at most 90 degrees");
        }
        if self.max_deviation.is_some_and(|x| x.is_nan() || x < 0.0) {
            return refuse("the deviation limit must be 0 or more");
        }
        if !(0.0..=1.0).contains(&self.max_lost_area) {
            return refuse("the share of the area that may go must lie in 0 to 1");
        }
        if self.join_distance.is_some_and(|x| !x.is_finite() || x < 0.0) {
            return refuse("the distance to join across must be finite and not negative");
        }
        if (self.keep_volume || self.keep_area) && self.placement != Placement::Best {
            return refuse("volume and area can only be kept with the best placement");
        }
        Ok(())
    }
}
