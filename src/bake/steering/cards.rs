//! Cards: small open shells of a crowd, as the leaves of a tree, that grow as others go.

use rustc_hash::FxHashMap;
use seamwise_attr::{DisjointSets, Mesh, PointId, border_edges};

use crate::document::asset::Asset;
use crate::surface::geometry::Geometry;
use crate::surface::part::Part;

/// Triangles of a card at most.
const MAX_TRIANGLES: usize = 16;
/// Fewer cards are no crowd.
const LEAST_CARDS: usize = 16;

/// The surfaces whose cards grow as others go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GrowCards {
    /// Those of materials that are cut out by alpha (`MASK`).
    #[default]
    Masked,
    /// All.
    All,
    /// None.
    None,
}

impl GrowCards {
    /// One per point: whether it is of a card that may go as others grow. Empty if none is.
    pub(super) fn of_points(
        self,
        asset: &Asset,
        geometry: &Geometry,
        locked: &[bool],
    ) -> Vec<bool> {
        let is_cut_out = |part: &Part| {
            let material = part.primitive.material.map(|own| &asset.json["materials"][own]);
            material.is_some_and(|own| own["alphaMode"] == "MASK")
        };
        let parts: Vec<bool> = match self {
            Self::None => return Vec::new(),
            Self::All => vec![true; geometry.parts.len()],
            Self::Masked => geometry.parts.iter().map(is_cut_out).collect(),
        };
        if parts.contains(&true) {
            cards(&geometry.welded.mesh, &parts, locked)
        } else {
            Vec::new()
        }
    }
}

/// The points of small open shells of these parts without a locked point, if they are a crowd.
fn cards(mesh: &Mesh, parts: &[bool], locked: &[bool]) -> Vec<bool> {
    let mut sets = DisjointSets::new(mesh.positions.len());
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.triangle_points(triangle).map(|point| point.0);
        sets.join(a, b);
        sets.join(b, c);
    }
    // Triangles of each shell, and whether all of them are of such a part.
    let mut shells: FxHashMap<u32, (usize, bool)> = FxHashMap::default();
    for triangle in 0..mesh.triangles.len() {
        let shell = shells.entry(sets.root(mesh.triangle_points(triangle)[0].0));
        let (count, fits) = shell.or_insert((0, true));
        let is_locked = |point: PointId| locked.get(point.index()) == Some(&true);
        *count += 1;
        *fits &= parts[mesh.groups[triangle] as usize]
            && !mesh.triangle_points(triangle).into_iter().any(is_locked);
    }
    let mut open: Vec<u32> =
        border_edges(mesh).iter().map(|&[point, _]| sets.root(point.0)).collect();
    open.sort_unstable();
    open.dedup();
    open.retain(|shell| {
        shells.get(shell).is_some_and(|&(count, fits)| fits && count <= MAX_TRIANGLES)
    });
    if open.len() < LEAST_CARDS {
        return Vec::new();
    }
    let is_card = |point: u32| open.binary_search(&sets.root(point)).is_ok();
    (0..mesh.positions.len() as u32).map(is_card).collect()
}
