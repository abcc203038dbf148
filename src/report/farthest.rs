//! The part of the source that a level is farthest from.

use serde::Serialize;

use crate::document::asset::Asset;
use crate::evaluate::{Metrics, Part};

/// Off by more than this share of the diagonal, a level gets a warning.
const WARNED_SHARE: f64 = 0.02;

/// The part of the source at the greatest distance of a level.
#[derive(Clone, Debug, Serialize)]
pub struct FarthestPart {
    /// The point that is farthest off, of the source or of the level, in world units.
    pub place: [f64; 3],
    /// Its mesh's index in the document.
    pub mesh: usize,
    /// The mesh's name, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh_name: Option<String>,
    /// Its material's index in the document, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<usize>,
    /// The material's name, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material_name: Option<String>,
}

impl FarthestPart {
    /// A part of `asset` with its names, where it is off the most at `place`.
    pub(crate) fn new(asset: &Asset, part: Part, place: [f64; 3]) -> Self {
        let name =
            |list: &str, index: usize| asset.json[list][index]["name"].as_str().map(str::to_owned);
        Self {
            place,
            mesh: part.mesh,
            mesh_name: name("meshes", part.mesh),
            material: part.material,
            material_name: part.material.and_then(|index| name("materials", index)),
        }
    }

    /// Its name in messages: its mesh, and its material if it has one.
    fn called(&self) -> String {
        let mesh = match &self.mesh_name {
            Some(name) => format!("mesh {name}"),
            None => format!("mesh {}", self.mesh),
        };
        match (&self.material_name, self.material) {
            (Some(name), _) => format!("{mesh}, material {name}"),
            (None, Some(index)) => format!("{mesh}, material {index}"),
            (None, None) => mesh,
        }
    }

    /// A line that tells where level `index` is off the most, a warning if that is far.
    pub(super) fn line(&self, index: usize, metrics: &Metrics) -> Option<String> {
        let [x, y, z] = self.place;
        let off = metrics.distance_max;
        (off > WARNED_SHARE).then(|| {
            format!(
                "warning: level {index} is off by {:.1} % of the diagonal in {}, at {x:.4}, {y:.4}, {z:.4}",
                100.0 * off,
                self.called()
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_level_that_is_far_off_is_warned_of_with_the_part_and_the_place() {
        let json = json!({"meshes": [{}, {"name": "hull"}], "materials": [{"name": "paint"}]});
        let asset = Asset { json, ..Asset::default() };
        let place = [1.0, -0.5, 0.0];
        let part = |mesh, material| FarthestPart::new(&asset, Part { mesh, material }, place);
        let metrics = Metrics { distance_max: 0.0314, ..Metrics::default() };
        let expected = "warning: level 3 is off by 3.1 % of the diagonal in mesh hull, material paint, \
            at 1.0000, -0.5000, 0.0000";
        assert_eq!(part(1, Some(0)).line(3, &metrics).unwrap(), expected);
        assert_eq!(part(0, None).called(), "mesh 0");
        let near = Metrics { distance_max: 0.019, ..metrics };
        assert_eq!(part(1, Some(0)).line(3, &near), None);
    }
}
