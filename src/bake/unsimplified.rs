//! Checks for an asset or a level with nothing to simplify: the level is the source, which is warned of.

use super::options::{BakeOptions, Targets};
use crate::document::accessor;
use crate::document::asset::Asset;
use crate::document::known_extensions::lost_with_geometry;
use crate::document::nodes::mesh_worlds;
use crate::document::primitive::Primitive;
use crate::error::{Error, Result};
use crate::report::LevelReport;
use crate::surface::geometry::Geometry;
use crate::warning::Warnings;

/// Whether the scene shows surfaces, so that levels can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Surfaces {
    /// Surfaces that the scene shows.
    Shown,
    /// None at all, or none that the scene shows: there is nothing to look at, and so to measure.
    Unseen,
}

impl Surfaces {
    /// Looks at the surfaces of an asset, and warns where there are none, where the scene shows none, and
    /// of extensions that describe triangles which change.
    ///
    /// # Errors
    /// [`Error::Invalid`] if there is not even a point or a line in the asset, unless `options` allows
    /// that.
    pub(super) fn check(
        asset: &Asset,
        geometries: &[Geometry],
        options: &BakeOptions,
        warnings: &mut Warnings,
    ) -> Result<Self> {
        if geometries.is_empty() {
            let has_any = has_vertices(asset)?;
            if !has_any && !options.allow_empty {
                return Err(Error::invalid("/meshes", "there is nothing in them to bake"));
            }
            let what = "there is not a single triangle to simplify: the levels are the source";
            warnings.add("/meshes", what);
            return Ok(Self::Unseen);
        }
        let used = |name: &&str| {
            let names = asset.json.get("extensionsUsed").and_then(|names| names.as_array());
            names.is_some_and(|names| names.iter().any(|own| own == name))
        };
        for name in lost_with_geometry().filter(used) {
            let what = format!(
                "{name} describes triangles that change: levels do without it; keep the source beside \
                 them"
            );
            warnings.add("/extensionsUsed", what);
        }
        let worlds = mesh_worlds(asset)?;
        if geometries.iter().flat_map(|own| &own.meshes).any(|mesh| worlds.contains_key(mesh)) {
            return Ok(Self::Shown);
        }
        let what = "the scene shows no mesh: the levels are not measured; let a node show each";
        warnings.add("/nodes", what);
        Ok(Self::Unseen)
    }
}

/// Whether an asset has vertices: those of points or lines, as there is no triangle.
fn has_vertices(asset: &Asset) -> Result<bool> {
    for mesh in 0..asset.count("meshes") {
        for primitive in Primitive::of_mesh(asset, mesh)? {
            let positions = primitive.accessor("POSITION");
            if positions
                .map(|own| accessor::measure(asset, own))
                .transpose()?
                .is_some_and(|[count, _]| count > 0)
            {
                return Ok(true);
            }
        }
    }
    Ok(false)
}

/// Warns of levels with all triangles of the source, where the user asked for fewer or for more than
/// there are.
pub(super) fn warn_of_whole_levels(
    levels: &[LevelReport],
    triangles: usize,
    targets: &Targets,
    warnings: &mut Warnings,
) {
    for (index, level) in levels.iter().enumerate() {
        let is_meant = matches!(targets, Targets::Ratios(_)) && level.ratio >= 1.0;
        if triangles > 0 && level.triangles == triangles && level.reached && !is_meant {
            let what = format!(
                "its target leaves all triangles of the source, {triangles}: nothing is simplified; ask for \
                 fewer or leave the level out"
            );
            warnings.add(format_args!("level {}", index + 1), what);
        }
    }
}
