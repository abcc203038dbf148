//! Values that are no numbers, and normals without a direction, mended.

use glam::DVec3;
use rustc_hash::FxHashMap;

/// The warning of a position that is not finite.
pub(super) const NO_POSITION: &str =
    "a position that is not finite: the faces there are left out; export it anew";
/// The warning of a normal without a direction.
pub(super) const NO_NORMAL: &str =
    "a normal without a direction: it is computed from the faces around; export normals anew";
/// The warning of a UV that is not finite.
pub(super) const NO_UV: &str = "a UV that is not finite: it is taken for 0 0; export it anew";

/// A normal of unit length, which glTF demands; NaN where it has no direction.
pub(super) fn unit(normal: [f64; 3]) -> [f32; 3] {
    let normal = DVec3::from_array(normal);
    // What is small or large is still a direction.
    let unit = (normal / normal.abs().max_element()).try_normalize();
    unit.filter(|_| normal.is_finite()).map_or([f32::NAN; 3], |unit| unit.as_vec3().to_array())
}

/// A UV as floats, unless it is not finite as such.
pub(super) fn finite_uv(uv: [f64; 2]) -> Option<[f32; 2]> {
    let uv = uv.map(|x| x as f32);
    uv.iter().all(|x| x.is_finite()).then_some(uv)
}

/// Three points to what their triangle adds to the normal at each: its own unit normal, times the angle
/// there, so that it matters not into which triangles a polygon was cut.
pub(super) fn corner_normals(corners: [DVec3; 3]) -> [DVec3; 3] {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let angle = |at: usize| {
        let [own, next, last] = [0, 1, 2].map(|step| corners[(at + step) % 3]);
        let angle = (next - own).angle_between(last - own);
        if angle.is_finite() { angle } else { 0.0 }
    };
    [0, 1, 2].map(|at| normal * angle(at))
}

/// Computes the normals that are NaN from all faces around their positions.
pub(super) fn recompute_normals(
    positions: &[[f64; 3]],
    triangles: &[u32],
    normals: &mut [[f32; 3]],
) {
    let is_missing = |normal: &[f32; 3]| normal[0].is_nan();
    if !normals.iter().any(is_missing) {
        return;
    }
    // Vertices apart may be at one place.
    let place = |vertex: usize| positions[vertex].map(|x| (x + 0.0).to_bits());
    let mut sums: FxHashMap<[u64; 3], DVec3> = FxHashMap::default();
    for triangle in triangles.as_chunks::<3>().0 {
        let vertices = triangle.map(|vertex| vertex as usize);
        let corners = vertices.map(|vertex| DVec3::from_array(positions[vertex]));
        for (vertex, normal) in vertices.into_iter().zip(corner_normals(corners)) {
            *sums.entry(place(vertex)).or_default() += normal;
        }
    }
    for (vertex, normal) in normals.iter_mut().enumerate().filter(|(_, own)| is_missing(own)) {
        let sum = sums.get(&place(vertex)).copied().unwrap_or_default();
        *normal = sum.try_normalize().unwrap_or(DVec3::Z).as_vec3().to_array();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_normal_at_a_cubes_corner_is_its_diagonal_however_its_squares_are_cut() {
        // The corner at 0 of a cube that lies towards +x, +y, +z: two triangles of one square, one
        // of each other.
        let points = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 1.]];
        let triangles = [0, 2, 1, 0, 3, 2, 0, 1, 4, 0, 4, 3];
        let mut normals = [[f32::NAN; 3]; 5];
        normals[1] = [1.0, 0.0, 0.0];
        recompute_normals(&points, &triangles, &mut normals);
        let expected = -DVec3::splat(1.0 / 3f64.sqrt()).as_vec3();
        assert!((glam::Vec3::from_array(normals[0]) - expected).length() < 1e-6, "{normals:?}");
        assert_eq!(normals[1], [1.0, 0.0, 0.0], "one that is there stays");
    }

    #[test]
    fn what_has_no_direction_is_told_from_what_is_small() {
        assert_eq!(unit([0.0, 1e-200, 0.0]), [0.0, 1.0, 0.0]);
        assert_eq!(unit([0.0, 0.0, 1e200]), [0.0, 0.0, 1.0]);
        for normal in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]] {
            assert!(unit(normal)[0].is_nan());
        }
        assert_eq!(finite_uv([0.5, 1e300]), None);
    }
}
