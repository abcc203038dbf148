//! How far two surfaces are apart, by samples that are dense everywhere.

use glam::{DVec3, Vec3};
use seamwise_attr::{Mesh, Surface};

/// Triangle sides are cut into so many parts at most.
const MOST_A_SIDE: usize = 60;

/// The greatest distance of any sample of `from` to `to`. Samples are a `spacing` apart along sides.
pub(crate) fn farthest(from: &Mesh, to: &Mesh, spacing: f64) -> f64 {
    let triangles = (0..to.triangles.len()).map(|t| to.triangle_points(t).map(|p| p.0));
    let surface = Surface::new(&to.positions, triangles);
    let mut farthest = 0.0f64;
    for triangle in 0..from.triangles.len() {
        let [a, b, c] = from.triangle_positions(triangle).map(Vec3::as_dvec3);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let n = ((longest / spacing).ceil() as usize).clamp(1, MOST_A_SIDE);
        for (i, j) in (0..=n).flat_map(|i| (0..=n - i).map(move |j| (i, j))) {
            let at = DVec3::new(i as f64, j as f64, (n - i - j) as f64) / n as f64;
            let place = a * at.x + b * at.y + c * at.z;
            let foot = surface.closest_foot(place, f64::INFINITY, |_| true);
            farthest = farthest.max(foot.expect("a triangle").distance_squared);
        }
    }
    farthest.sqrt()
}

/// The length of the diagonal of the box around a mesh.
pub(crate) fn diagonal(mesh: &Mesh) -> f64 {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for p in mesh.positions.iter().map(|p| p.as_dvec3()) {
        (low, high) = (low.min(p), high.max(p));
    }
    low.distance(high)
}
