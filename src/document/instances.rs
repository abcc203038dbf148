//! The transforms of the instances of a node's mesh (`EXT_mesh_gpu_instancing`).

use glam::{DMat4, DQuat, DVec3, Quat, Vec3};

use super::accessor;
use super::asset::Asset;
use crate::error::{Error, Result};

/// The transforms of the instances of a node's mesh in the node's own space; one that changes
/// nothing if the node has no instances. Each is scaled, then turned, then moved.
///
/// # Errors
/// [`Error::Invalid`] if the attributes are malformed or of different counts.
pub(crate) fn instances(asset: &Asset, node: &str) -> Result<Vec<DMat4>> {
    let at = format!("{node}/extensions/EXT_mesh_gpu_instancing/attributes");
    if asset.json.pointer(&at).is_none() {
        return Ok(vec![DMat4::IDENTITY]);
    }
    let moves = rows::<3>(asset, &at, "TRANSLATION")?;
    let turns = rows::<4>(asset, &at, "ROTATION")?;
    let scales = rows::<3>(asset, &at, "SCALE")?;
    let counts = [&moves, &scales].map(|rows| rows.as_ref().map(Vec::len));
    let mut counts = counts.into_iter().chain([turns.as_ref().map(Vec::len)]).flatten();
    let count = counts.next().unwrap_or(0);
    if counts.any(|other| other != count) {
        return Err(Error::invalid(at, "attributes of different counts"));
    }
    let instance = |index: usize| {
        let scale = scales.as_ref().map_or(Vec3::ONE, |rows| rows[index].into());
        let turn = turns.as_ref().map_or(Quat::IDENTITY, |rows| Quat::from_array(rows[index]));
        let moved = moves.as_ref().map_or(Vec3::ZERO, |rows| rows[index].into());
        let turn: DQuat = turn.as_dquat().normalize();
        DMat4::from_scale_rotation_translation(scale.as_dvec3(), turn, DVec3::from(moved))
    };
    Ok((0..count).map(instance).collect())
}

/// An attribute of the instances, if they have it.
fn rows<const N: usize>(asset: &Asset, at: &str, name: &str) -> Result<Option<Vec<[f32; N]>>> {
    let Some(index) = asset.reference(at, name, "accessors")? else {
        return Ok(None);
    };
    let at = format!("{at}/{name}");
    let elements = accessor::read(asset, index, &at)?;
    if elements.components != N {
        return Err(Error::invalid(at, format!("it must have {N} components")));
    }
    Ok(Some(elements.floats().as_chunks().0.to_vec()))
}
