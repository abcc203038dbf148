//! Textures in so many charts that simplification can only spoil them.

use seamwise_attr::DisjointSets;

use super::options::{BakeOptions, Textures};
use crate::document::asset::Asset;
use crate::document::material::slots;
use crate::error::Result;
use crate::surface::geometry::Geometry;
use crate::transfer::Atlas;
use crate::warning::Warnings;

/// Charts of fewer triangles on average have no inside: whatever collapses lies on their outlines, and drags
/// each into its neighbor's texels.
const LEAST_TRIANGLES: usize = 3;
/// Fewer charts than this beyond one for each shell, as a leaf may be, can be no trouble.
const LEAST_CHARTS: usize = 64;
/// Charts that cover less than this share of their texture are places of a palette.
const LEAST_COVER: f64 = 0.05;

/// Warns of textured parts that are cut into charts of next to no triangles, unless levels get textures and
/// charts of their own.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) if a material is malformed.
pub(super) fn warn_of_fragments(
    asset: &Asset,
    geometries: &[Geometry],
    options: &BakeOptions,
    warnings: &mut Warnings,
) -> Result<()> {
    if matches!(options.textures, Textures::Transfer(own) if own.atlas != Atlas::Keep) {
        return Ok(());
    }
    for geometry in geometries {
        for (group, part) in (0..).zip(&geometry.parts) {
            let material = part.primitive.material;
            let is_textured = material.map(|own| slots(asset, own)).transpose()?;
            if is_textured.is_none_or(|slots| slots.is_empty()) {
                continue;
            }
            let Charts { triangles, charts, shells, area } = Charts::of(geometry, group);
            let is_whole = charts < shells + LEAST_CHARTS;
            if is_whole || triangles >= LEAST_TRIANGLES * charts || area < LEAST_COVER {
                continue;
            }
            let what = format!(
                "its texture is cut into {charts} charts for {triangles} triangles: levels slide from one \
                 to the next, and their colors are wrong; --textures transfer --atlas new gives each level \
                 charts and textures of its own"
            );
            warnings.add(&part.primitive.at, what);
        }
    }
    Ok(())
}

/// The charts of a part in its first UV set.
struct Charts {
    triangles: usize,
    charts: usize,
    shells: usize,
    /// The area that they cover, in squares of the texture.
    area: f64,
}

impl Charts {
    fn of(geometry: &Geometry, group: u32) -> Self {
        let mesh = &geometry.welded.mesh;
        let mut own = Self { triangles: 0, charts: 0, shells: 0, area: 0.0 };
        if mesh.layout.uv_sets == 0 {
            return own;
        }
        let mut charts = DisjointSets::new(mesh.wedge_points.len());
        let mut shells = DisjointSets::new(mesh.positions.len());
        let mut used = vec![false; mesh.wedge_points.len()];
        for (wedges, _) in mesh.triangles.iter().zip(&mesh.groups).filter(|(_, own)| **own == group)
        {
            let [a, b, c] = wedges.map(|wedge| mesh.uv(wedge, 0).as_dvec2());
            own.area += (b - a).perp_dot(c - a).abs() / 2.0;
            own.triangles += 1;
            let points = wedges.map(|wedge| mesh.wedge_points[wedge.index()]);
            for (from, to) in [(0, 1), (1, 2)] {
                charts.join(wedges[from].0, wedges[to].0);
                shells.join(points[from].0, points[to].0);
            }
            wedges.iter().for_each(|wedge| used[wedge.index()] = true);
        }
        let used = |wedge: &u32| used[*wedge as usize];
        let wedges = || (0..mesh.wedge_points.len() as u32).filter(used);
        own.charts = wedges().filter(|&wedge| charts.root(wedge) == wedge).count();
        let mut points: Vec<u32> =
            wedges().map(|wedge| shells.root(mesh.wedge_points[wedge as usize].0)).collect();
        points.sort_unstable();
        points.dedup();
        own.shells = points.len();
        own
    }
}
