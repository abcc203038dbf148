//! A level's vertices as small integers, as `KHR_mesh_quantization` and core glTF have them.
//!
//! | attribute | becomes | is off by at most |
//! |---|---|---|
//! | positions | 16-bit steps of a cube around the surface | half a step along each axis, `extent / 131070` |
//! | normals, tangents | 8-bit −1…1 | 1/254 a component, 0.4° |
//! | UVs within 0…1 | 16-bit 0…1 | 1/131070: 1/32 of a texel of 4096 |
//! | float colors within 0…1 | 8-bit 0…1 | 1/510 |
//! | joints below 256 | 8-bit | nothing |
//! | float weights | 8-bit 0…1 that sum to 1 | 1/255 |
//!
//! All points of a surface lie on one grid with equal steps along all axes, so no crack opens and no
//! normal leans. Positions stay floats where a half step is more than the level's own error, and where a
//! scale of the node would mean something else: under a skin, which ignores the node; with morph targets,
//! whose deltas are floats; with instances, which are placed by the node; in materials with a volume,
//! whose thickness scales with the node; and where several nodes place the meshes of one surface, whose
//! grids would not meet. A level without error stays as it is altogether.

use glam::Vec3;
use gltf::json::accessor::ComponentType;

use super::part::LevelPart;
use super::skin::round_to_whole;
use crate::document::accessor::{Elements, Named};
use crate::document::asset::Asset;
use crate::error::Result;
use crate::surface::geometry::Geometry;

/// The steps along the longest side of a surface.
const STEPS: f32 = 65535.0;

/// The positions of integers q: `low + step · q`, in the units of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Grid {
    /// The least coordinates.
    pub(crate) low: [f32; 3],
    /// The step, along each axis.
    pub(crate) step: f32,
}

impl Grid {
    /// The finest grid around points, if they have any extent.
    fn around(points: impl Iterator<Item = Vec3>) -> Option<Self> {
        let (low, high) = points
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let step = (high - low).max_element() / STEPS;
        (step.is_normal() && low.is_finite()).then_some(Self { low: low.to_array(), step })
    }

    /// The farthest that a point is from its place on the grid: half a diagonal of a cell.
    pub(crate) fn error(&self) -> f32 {
        self.step * 0.75f32.sqrt()
    }

    fn place(&self, position: &[f32; 3]) -> [u16; 3] {
        let [low, step] = [self.low.map(f64::from), [f64::from(self.step); 3]];
        [0, 1, 2].map(|axis| ((f64::from(position[axis]) - low[axis]) / step[axis]).round() as u16)
    }
}

/// Whether the node of a surface may be scaled without that meaning anything else.
pub(crate) fn may_scale(asset: &Asset, surface: &Geometry) -> Result<bool> {
    if surface.parts.iter().any(|part| !part.targets.is_empty() || part.local.is_some()) {
        return Ok(false);
    }
    for material in surface.parts.iter().filter_map(|part| part.primitive.material) {
        let volume = format!("/materials/{material}/extensions/KHR_materials_volume");
        if asset.json.pointer(&volume).is_some() {
            return Ok(false);
        }
    }
    for node in 0..asset.count("nodes") {
        let at = format!("/nodes/{node}");
        let mesh = asset.reference(&at, "mesh", "meshes")?;
        let has = |key: &str| asset.json.pointer(&format!("{at}/{key}")).is_some();
        if mesh.is_some_and(|mesh| surface.meshes.contains(&mesh))
            && (has("skin") || has("extensions/EXT_mesh_gpu_instancing"))
        {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Makes a level's parts small. `error` is what the level is off by, in the units of the mesh; with
/// `may_scale`, the positions may come out as integers of the grid that is returned.
pub(crate) fn quantize(
    parts: &mut [Option<LevelPart>],
    error: f64,
    may_scale: bool,
) -> Option<Grid> {
    if error <= 0.0 {
        return None;
    }
    let own = parts.iter().flatten().flat_map(|part| &part.attributes);
    let positions = own.filter(|(name, _)| name == "POSITION");
    let points = positions.flat_map(|(_, elements)| {
        elements.floats().as_chunks().0.iter().copied().map(Vec3::from_array).collect::<Vec<_>>()
    });
    let grid = Grid::around(points).filter(|grid| may_scale && f64::from(grid.error()) <= error);
    for part in parts.iter_mut().flatten() {
        quantize_weights(&mut part.attributes);
        for (name, elements) in &mut part.attributes {
            match grid {
                Some(grid) if name == "POSITION" => *elements = on_grid(elements, &grid),
                _ => quantize_attribute(name, elements),
            }
        }
    }
    grid
}

fn on_grid(positions: &Elements, grid: &Grid) -> Elements {
    let floats = positions.floats();
    let places = floats.as_chunks().0.iter().flat_map(|position| grid.place(position));
    Elements {
        bytes: places.flat_map(u16::to_le_bytes).collect(),
        component: ComponentType::U16,
        components: 3,
        normalized: false,
    }
}

fn quantize_attribute(name: &str, elements: &mut Elements) {
    let is_float = elements.component == ComponentType::F32;
    let is_within = |low: f32| elements.floats().iter().all(|x| (low..=1.0).contains(x));
    let component = match name {
        "NORMAL" | "TANGENT" if is_float && is_within(-1.0) => ComponentType::I8,
        _ if name.starts_with("TEXCOORD_") && is_float && is_within(0.0) => ComponentType::U16,
        _ if name.starts_with("COLOR_") && is_float && is_within(0.0) => ComponentType::U8,
        _ if name.starts_with("JOINTS_") => return narrow_joints(elements),
        _ => return,
    };
    let mut small = Elements { bytes: Vec::new(), component, normalized: true, ..*elements };
    small.bytes = small.encode(elements.floats());
    *elements = small;
}

fn narrow_joints(joints: &mut Elements) {
    let indices = joints.floats();
    if joints.component == ComponentType::U16 && indices.iter().all(|&joint| joint < 256.0) {
        let bytes = indices.iter().map(|&joint| joint as u8).collect();
        *joints = Elements { bytes, component: ComponentType::U8, ..*joints };
    }
}

/// Brings the float weights of all sets to bytes that sum to 255 at each vertex; as they are if a
/// vertex has none.
fn quantize_weights(attributes: &mut [Named]) {
    let is_set = |(name, elements): &&mut Named| {
        name.starts_with("WEIGHTS_") && elements.component == ComponentType::F32
    };
    let sets: Vec<&mut Named> = attributes.iter_mut().filter(|own| is_set(own)).collect();
    let Some(count) = sets.iter().map(|(_, elements)| elements.count()).min() else { return };
    let mut bytes = vec![Vec::new(); sets.len()];
    for vertex in 0..count {
        let rows: Vec<Vec<f32>> = sets.iter().map(|(_, own)| own.row(vertex)).collect();
        let weights: Vec<f64> = rows.concat().iter().map(|&weight| f64::from(weight)).collect();
        let sum: f64 = weights.iter().sum();
        if !(sum > 0.0 && sum.is_finite()) || weights.iter().any(|&weight| weight < 0.0) {
            return;
        }
        let shares: Vec<f64> = weights.iter().map(|weight| weight / sum).collect();
        let mut units = round_to_whole(&shares, 255.0).into_iter();
        for (bytes, row) in bytes.iter_mut().zip(&rows) {
            bytes.extend(units.by_ref().take(row.len()).map(|unit| unit as u8));
        }
    }
    for ((_, elements), bytes) in sets.into_iter().zip(bytes) {
        *elements = Elements { bytes, component: ComponentType::U8, normalized: true, ..*elements };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(attributes: &[(&str, usize, &[f32])]) -> Vec<Option<LevelPart>> {
        let named = |&(name, components, values): &(&str, usize, &[f32])| {
            let bytes = values.iter().flat_map(|x| x.to_le_bytes()).collect();
            let component = ComponentType::F32;
            (name.to_owned(), Elements { bytes, component, components, normalized: false })
        };
        let attributes = attributes.iter().map(named).collect();
        vec![Some(LevelPart { indices: vec![0, 1, 0], attributes, targets: Vec::new() }), None]
    }

    fn found<'a>(parts: &'a [Option<LevelPart>], name: &str) -> &'a Elements {
        let part = parts[0].as_ref().unwrap();
        &part.attributes.iter().find(|(own, _)| own == name).unwrap().1
    }

    const POSITIONS: (&str, usize, &[f32]) =
        ("POSITION", 3, &[10.0, -5.0, 0.3, 12.0, -4.0, 0.3, 10.77, -4.2, 0.9]);

    #[test]
    fn positions_are_off_by_half_a_step_at_most() {
        let mut parts = part(&[POSITIONS]);
        let grid = quantize(&mut parts, 0.1, true).unwrap();
        assert_eq!(grid.step, 2.0 / 65535.0);
        let places = found(&parts, "POSITION").floats();
        for (at, (&place, &own)) in places.iter().zip(POSITIONS.2).enumerate() {
            let back = f64::from(grid.low[at % 3]) + f64::from(place) * f64::from(grid.step);
            let half = f64::from(grid.step) / 2.0;
            assert!((back - f64::from(own)).abs() <= half * 1.001, "{back} for {own}");
        }
    }

    #[test]
    fn positions_stay_floats_where_a_step_shows_or_no_node_may_scale() {
        for (error, may_scale) in [(1e-6, true), (0.1, false)] {
            let mut parts = part(&[POSITIONS]);
            assert_eq!(quantize(&mut parts, error, may_scale), None);
            assert_eq!(parts, part(&[POSITIONS]));
        }
        let mut flat = part(&[("POSITION", 3, &[1.0; 9]), ("NORMAL", 3, &[0.0, 1.0, 0.0])]);
        assert_eq!(quantize(&mut flat, 0.1, true), None, "no extent");
        assert_eq!(found(&flat, "NORMAL").bytes, [0, 127, 0]);
    }

    #[test]
    fn a_level_without_error_stays_as_it_is() {
        let own: [(&str, usize, &[f32]); 2] = [POSITIONS, ("NORMAL", 3, &[0.6, 0.8, 0.0])];
        let mut parts = part(&own);
        assert_eq!(quantize(&mut parts, 0.0, true), None);
        assert_eq!(parts, part(&own));
    }

    #[test]
    fn uvs_and_colors_are_small_only_within_their_range() {
        let mut parts = part(&[
            ("TEXCOORD_0", 2, &[0.0, 1.0]),
            ("TEXCOORD_1", 2, &[0.0, 1.5]),
            ("COLOR_0", 4, &[0.0, 0.2, 1.0, 1.0]),
            ("COLOR_1", 3, &[0.0, 7.0, 1.0]),
            ("_HEAT", 1, &[0.5]),
        ]);
        quantize(&mut parts, 1.0, true);
        assert_eq!(found(&parts, "TEXCOORD_0").bytes, [0, 0, 255, 255]);
        assert_eq!(found(&parts, "COLOR_0").bytes, [0, 51, 255, 255]);
        for name in ["TEXCOORD_1", "COLOR_1", "_HEAT"] {
            assert_eq!(found(&parts, name).component, ComponentType::F32, "{name}");
        }
    }

    #[test]
    fn weights_of_all_sets_sum_to_the_whole() {
        let third = [1.0 / 3.0, 1.0 / 3.0, 0.0, 0.0];
        let mut parts = part(&[("WEIGHTS_0", 4, &third), ("WEIGHTS_1", 4, &third)]);
        quantize(&mut parts, 1.0, false);
        let sum: u32 = ["WEIGHTS_0", "WEIGHTS_1"]
            .iter()
            .flat_map(|name| &found(&parts, name).bytes)
            .map(|&weight| u32::from(weight))
            .sum();
        assert_eq!(sum, 255);
        let none = [("WEIGHTS_0", 4, [0.0; 4].as_slice())];
        let mut parts = part(&none);
        quantize(&mut parts, 1.0, false);
        assert_eq!(parts, part(&none), "no weight to speak of");
    }
}
