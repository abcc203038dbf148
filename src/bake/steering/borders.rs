//! Open borders that stay as they are, so that what is baked apart still meets.

use glam::{DMat4, DVec3};
use seamwise_attr::{Mesh, border_edges};

use super::scene_box::SceneBox;
use crate::error::{Error, Result};

/// How far from a side of the box a border may lie that is on it, as a share of the box's longest side.
const ON_SIDE: f64 = 1e-5;

/// The open borders that are locked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BorderLock {
    /// All of them.
    All,
    /// Those on the sides of the box around the scene.
    Sides,
    /// Those on the sides of this box, in the units of the scene.
    Box {
        /// The least coordinates.
        low: DVec3,
        /// The greatest.
        high: DVec3,
    },
}

impl BorderLock {
    /// Checks that a box has its corners in order.
    pub(super) fn check(&self) -> Result<()> {
        match self {
            Self::Box { low, high } if !low.cmple(*high).all() => Err(Error::Options {
                what: "the box of locked borders must have its least coordinates first".into(),
            }),
            _ => Ok(()),
        }
    }
}

/// Locks the ends of border edges of a mesh that is shown by `worlds`.
pub(super) fn lock_borders(
    lock: &BorderLock,
    locked: &mut Vec<bool>,
    mesh: &Mesh,
    worlds: &[DMat4],
    scene: &SceneBox,
) {
    let sides = match *lock {
        BorderLock::All => None,
        BorderLock::Sides => Some([scene.low, scene.high]),
        BorderLock::Box { low, high } => Some([low, high]),
    };
    let here = [DMat4::IDENTITY];
    let worlds = if worlds.is_empty() { &here[..] } else { worlds };
    locked.resize(mesh.positions.len(), false);
    for edge in border_edges(mesh) {
        let ends = edge.map(|end| mesh.positions[end].as_dvec3());
        let is_on = |world: &DMat4, sides: &[DVec3; 2]| {
            is_on_a_side(ends.map(|end| world.transform_point3(end)), sides)
        };
        if sides.as_ref().is_none_or(|sides| worlds.iter().any(|world| is_on(world, sides))) {
            edge.into_iter().for_each(|end| locked[end.index()] = true);
        }
    }
}

/// Whether both ends of an edge lie on one side of a box.
fn is_on_a_side(ends: [DVec3; 2], [low, high]: &[DVec3; 2]) -> bool {
    let most = ON_SIDE * (*high - *low).max_element();
    let off = |side: &DVec3| (ends[0] - *side).abs().max((ends[1] - *side).abs());
    [low, high].into_iter().any(|side| off(side).min_element() <= most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_is_on_a_side_with_both_ends_on_the_same() {
        let sides = [DVec3::ZERO, DVec3::new(10.0, 10.0, 1.0)];
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.5);
        assert!(is_on_a_side([at(0.0, 1.0), at(0.0, 2.0)], &sides));
        assert!(is_on_a_side([at(4.0, 10.00001), at(5.0, 9.99999)], &sides));
        assert!(!is_on_a_side([at(0.0, 1.0), at(1.0, 0.0)], &sides), "across a corner");
        assert!(!is_on_a_side([at(4.0, 5.0), at(5.0, 5.0)], &sides));
    }
}
