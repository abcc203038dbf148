//! The figures of a comparison.
//!
//! Where a candidate takes over, at the largest size at which it may be shown, nobody looks at it in
//! frames of 512 pixels; the same cameras with frames in which the diagonal spans that size show it,
//! and the reference, as people see them, in frames up to the screen's height.

use serde::Serialize;

use super::distance::Distances;

/// How far a candidate is from its reference. Distances are over the diagonal of the reference's
/// bounding box. What tells of pictures is NaN (`null` in JSON) where no view shows either of the two.
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
    /// [`Metrics::rms_luminance`] over the pixels within two of a seam of the reference: where an
    /// atlas that bleeds shows.
    pub rms_luminance_seams: f64,
    /// [`Metrics::rms_luminance_srgb`] over the pixels within two of a seam of the reference.
    pub rms_luminance_srgb_seams: f64,
    /// Peak signal-to-noise ratio of [`Metrics::rms_luminance_srgb`] in decibels; `None` where there
    /// is no difference.
    pub psnr_srgb: Option<f64>,
    /// Structural similarity of sRGB-encoded luminance, up to 1: the mean over the windows of all
    /// views that hold a pixel of either; see [`super::similarity`].
    pub ssim: f64,
    /// The least structural similarity of a view.
    pub ssim_worst_view: f64,
    /// Silhouettes: what both cover over what either covers.
    pub silhouette_iou: f64,
    /// The largest size at which it may be shown, and how it looks there.
    pub at_switch: AtSwitch,
    /// The larger of the two RMS distances.
    pub distance_rms: f64,
    /// The larger of the two mean distances.
    pub distance_mean: f64,
    /// The larger of the two 99.9th percentiles of the distances.
    pub distance_p999: f64,
    /// The larger of the two greatest distances.
    pub distance_max: f64,
    /// The point that is so far from the other surface, in world units; in the JSON of a bake it stands
    /// with the part that it lies on.
    #[serde(skip)]
    pub distance_max_at: [f64; 3],
    /// From the reference to the candidate.
    pub forward: OneSidedDistance,
    /// From the candidate to the reference.
    pub backward: OneSidedDistance,
    /// RMS difference in sRGB base color at nearest points.
    pub color_rms: f64,
    /// RMS angle between shading normals at nearest points, in degrees.
    pub normal_degrees_rms: f64,
    /// Signed volume, in cubic units of the world; `None` where the reference has none.
    pub volume: Option<f64>,
    /// Area of the surface, in square units of the world.
    pub area: f64,
    /// Signed volume over that of the reference; `None` where that has none.
    pub volume_ratio: Option<f64>,
    /// Area over that of the reference.
    pub area_ratio: f64,
    /// Diagonal of the bounding box over that of the reference.
    pub diagonal_ratio: f64,
    /// Triangles whose UVs are turned over where the nearest of the reference's are not, or the other
    /// way round; of those that hold a sample.
    pub uv_foldovers: usize,
    /// Triangles without area.
    pub degenerate_triangles: usize,
    /// Edges of one triangle, more than the reference has.
    pub border_edges_gained: i64,
    /// Edges of three triangles or more, more than the reference has.
    pub non_manifold_edges_gained: i64,
}

impl Metrics {
    /// The same with no number for what is seen, where no view shows either of the two: that they look
    /// alike says nothing.
    #[must_use]
    pub(super) fn unseen(self) -> Self {
        let at_switch = AtSwitch {
            rms_luminance: f64::NAN,
            rms_luminance_srgb: f64::NAN,
            ssim: f64::NAN,
            ..self.at_switch
        };
        Self {
            rms_luminance: f64::NAN,
            rms_luminance_srgb: f64::NAN,
            rms_luminance_covered: f64::NAN,
            rms_luminance_srgb_covered: f64::NAN,
            rms_luminance_seams: f64::NAN,
            rms_luminance_srgb_seams: f64::NAN,
            psnr_srgb: None,
            ssim: f64::NAN,
            silhouette_iou: f64::NAN,
            at_switch,
            ..self
        }
    }
}

/// How a candidate differs in the picture of one camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ViewMetrics {
    /// As [`Metrics::rms_luminance`].
    pub rms_luminance: f64,
    /// As [`Metrics::rms_luminance_srgb`].
    pub rms_luminance_srgb: f64,
    /// As [`Metrics::rms_luminance_covered`].
    pub rms_luminance_covered: f64,
    /// As [`Metrics::rms_luminance_srgb_covered`].
    pub rms_luminance_srgb_covered: f64,
    /// As [`Metrics::ssim`].
    pub ssim: f64,
    /// As [`Metrics::silhouette_iou`].
    pub silhouette_iou: f64,
}

/// Distances in one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct OneSidedDistance {
    /// Root of the mean square.
    pub distance_rms: f64,
    /// Mean.
    pub distance_mean: f64,
    /// 99.9th percentile: a thousandth of the surface is farther.
    pub distance_p999: f64,
    /// Greatest of any point, within 0.2 % and 2e-6 of the diagonal.
    pub distance_max: f64,
}

impl OneSidedDistance {
    pub(super) fn new(distances: Distances, diagonal: f64) -> Self {
        Self {
            distance_rms: distances.rms / diagonal,
            distance_mean: distances.mean / diagonal,
            distance_p999: distances.p999 / diagonal,
            distance_max: distances.max / diagonal,
        }
    }
}

/// The largest size at which a candidate can't be told from its reference, and how it looks there; see
/// `switch` in this module for how it is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct AtSwitch {
    /// Length of the reference's diagonal on the screen, in pixels; infinite, `null` in JSON, for a
    /// candidate without any difference.
    pub pixels: f64,
    /// Pixels along each side of the views that were looked at there; no larger than the screen.
    pub resolution: usize,
    /// As [`Metrics::rms_luminance`], over the views that were looked at, the worst ones if not all; in
    /// the rig's own frames where those are smaller.
    pub rms_luminance: f64,
    /// As [`Metrics::rms_luminance_srgb`], over the same.
    pub rms_luminance_srgb: f64,
    /// As [`Metrics::ssim`], over the same.
    pub ssim: f64,
    /// The difference that an eye sees in the worst view, up to
    /// [`VISIBLE`](super::visible::VISIBLE) unless even the smallest views differ more.
    pub visible_difference: f64,
}
