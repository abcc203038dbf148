//! Images over a surface. Knows no files.
//!
//! # Why an atlas bleeds
//!
//! A texture atlas holds charts, islands of the unfolded surface, with unused texels between them.
//! Filtering reads past a chart's outline: a bilinear tap half a texel, a tap at mip level m up to
//! 2^m texels, a simplified mesh wherever its UVs now run. Whatever lies there, black or magenta,
//! shows as a line along the seam. The repair keeps every texel that a chart covers to the bit and
//! replaces all others by a smooth continuation of the charts.
//!
//! # Which texels are valid
//!
//! [`UvTriangle`] rasterises the mesh's UVs with exact edge functions, [`Validity`] collects the
//! texels whose centres are covered; without a mesh, [`Background`] finds the unused colors, and
//! [`alpha_tells`] whether alpha says what is there.
//! [`agreeing_padding`] finds what an earlier tool painted around the charts and may stay.
//! [`count_reads`] counts, mip level by mip level, the texels that filtering inside the charts
//! reads and that invalid ones went into: what there was to repair, and 0 once it is.
//! [`charts_share_from`] tells from which level on no fill helps, as charts lie in one texel.
//!
//! # Pull-push
//!
//! [`fill_holes`] interpolates scattered texels in time linear in the image. *Pull* halves the
//! image again and again, averaging valid texels only and keeping what share of each average was
//! valid. At some level every hole has shrunk below the kernel. *Push* walks back up: where a texel
//! is invalid, or valid in part, the level below interpolates what is missing. Near a chart the
//! fill has the colors of its nearest texels; far away, ever wider averages. With a box filter down
//! and nearest texels up the fill would show its blocks; the smooth 4 × 4 kernel down and bilinear
//! weights up hide them.
//!
//! [`repair`](fn@repair) does this in the space where averages mean something: linear light for
//! colors, vectors for normals. So does [`scale_down`], which makes an image smaller from valid
//! texels alone. Where alpha cuts leaves out, [`Repair::fill_hidden`] fills colors under alpha 0 too, and
//! [`keep_coverage`] keeps leaves from thinning out as they are scaled.
//!
//! # Seams
//!
//! [`equalize`](fn@equalize::equalize) moves texels next to seams, so that both sides of a seam read
//! the same under bilinear filtering.
//!
//! # A new layout
//!
//! [`repack`](fn@repack) lays charts out anew in one atlas, for surfaces whose UVs tile, overlap or
//! are mirrored, where one texel belongs to several places.
//!
//! # Transfer
//!
//! [`transfer`](mod@transfer) makes the images of a level anew: each texel takes the nearest place on the surface of
//! the source and is sampled there, and a normal map gets the shape that the level has lost.
//! [`repack`](fn@repack) lays charts out anew where their own layout tiles or overlaps.
//!
//! - S. Gortler, R. Grzeszczuk, R. Szeliski, M. Cohen, "The Lumigraph", SIGGRAPH 1996: pull-push for
//!   scattered samples, with weights that saturate.
//! - M. Kraus, "The pull-push algorithm revisited", GRAPP 2009: smooth kernels for both directions,
//!   on hardware that filters bilinearly.
//! - H. Hedin, "Evaluation of an appearance-preserving mesh simplification scheme", Linköping 2018:
//!   pull-push for the texels that a simplified mesh reaches outside its charts.

mod alpha;
mod atlas_repair;
mod background;
pub mod color;
mod color_charts;
mod coverage;
pub mod equalize;
mod error;
mod kernel;
mod levels;
mod many;
mod mips;
mod normal_map;
mod padding;
mod plane;
mod pyramid;
mod raster;
mod reads;
mod repack;
mod repair;
mod role;
mod samples;
mod scale;
mod sharing;
mod taps;
pub mod transfer;
mod validity;
mod wrap;

pub use alpha::{alpha_coverage, alpha_tells, keep_coverage, seen_texels};
pub use atlas_repair::{KeptCoverage, Repair, RepairSummary};
pub use background::Background;
pub use color_charts::color_charts;
pub use error::{Error, Result};
pub use levels::{PyramidLevel, pyramid_levels};
pub use many::{MANY, ManyTaps, Spots};
pub use mips::{ColorEncoding, MipLevel, Mips};
pub use normal_map::is_normal_map;
pub use padding::{agreeing_padding, keep_padding};
pub use plane::Plane;
pub use pyramid::{TexelRole, fill_holes};
pub use raster::{Texel, UvTriangle, Window, to_texels};
pub use reads::{Footprint, MipReads, count_reads};
pub use repack::{RepackOptions, Repacked, UvMesh, padding_for_mips, repack};
pub use repair::{Outcome, repair};
pub use role::Role;
pub use scale::{scale_down, scale_down_often};
pub use sharing::charts_share_from;
pub use taps::Taps;
pub use validity::Validity;
pub use wrap::Wrap;

pub use glam;
pub use image;
