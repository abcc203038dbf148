//! Which way the tangents of a file turn.
//!
//! The `w` of a tangent says where the bitangent points. By MikkTSpace it follows from how a triangle
//! lies in the UVs; files whose normal maps count green downward, or whose exporter mirrored them, have
//! the opposite throughout. Computed anew without regard to that, tangents would turn every dent into a
//! bump (8 of 58 normal-mapped primitives of public files).

use crate::document::asset::Asset;
use crate::document::primitive::Primitive;

/// Whether most tangents of a primitive have the sign opposite to MikkTSpace's, with UVs in the set of
/// its normal map. Not without tangents and UVs, or if they are malformed: tangents are made anew.
pub(super) fn is_flipped(
    asset: &Asset,
    primitive: &Primitive,
    triangles: &[[u32; 3]],
    (vertices, uv_set): (usize, usize),
) -> bool {
    let read = |name: &str, components| {
        primitive.floats(asset, name, components, vertices).ok().flatten().unwrap_or_default()
    };
    let (tangents, uvs) = (read("TANGENT", 4), read(&format!("TEXCOORD_{uv_set}"), 2));
    if tangents.is_empty() || uvs.is_empty() {
        return false;
    }
    let uv = |vertex: u32| [0, 1].map(|axis| f64::from(uvs[2 * vertex as usize + axis]));
    let votes = |triangle: &[u32; 3]| -> i64 {
        let [a, b, c] = triangle.map(uv);
        // Twice the area in the image, where v runs downward.
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        let sign = if area > 0.0 { -1.0 } else { 1.0 };
        let vote = |&vertex: &u32| match tangents[4 * vertex as usize + 3] * sign {
            product if product < 0.0 => 1,
            product if product > 0.0 => -1,
            _ => 0,
        };
        if area == 0.0 { 0 } else { triangle.iter().map(vote).sum() }
    };
    triangles.iter().map(votes).sum::<i64>() > 0
}
