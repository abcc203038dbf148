//! How far off the shading of a patch is, and how much of it is seen from a side.
//!
//! Over the points of the source that belong to its triangles, wᵢ = Aᵢ |nᵢ − n|²: Aᵢ a third of the area of the
//! triangles around a point, nᵢ its unit normal by area, and n that of the triangle that it belongs to. Their sum
//! has the unit of an area. An eye that looks along v sees ∑ wᵢ max(0, −nᵢ·v) of it, which is
//! ½ (∑ wᵢ |nᵢ·v| − ∑ wᵢ nᵢ·v). By the inequality of Cauchy and Schwarz the first sum is at most
//! √(∑ wᵢ · vᵀ(∑ wᵢ nᵢnᵢᵀ)v), so moments are enough. That is close where hills are seen aslant, of which a cone
//! around the normals tells little.

use glam::{Vec3, Vec3Swizzles};

/// The moments of a patch.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shading {
    /// ∑ wᵢ
    sum: f32,
    /// ∑ wᵢ nᵢ
    normal: Vec3,
    /// ∑ wᵢ nᵢnᵢᵀ: its diagonal, and what stands at xy, yz and zx.
    squares: Vec3,
    products: Vec3,
}

impl Shading {
    /// Adds a point that stands for an area, with its unit normal and that of its triangle.
    pub(super) fn add(&mut self, area: f32, normal: Vec3, shown: Vec3) {
        let weight = area * normal.distance_squared(shown);
        self.sum += weight;
        self.normal += weight * normal;
        self.squares += weight * normal * normal;
        self.products += weight * normal * normal.yzx();
    }

    /// What an eye sees of it at most that looks along a unit vector.
    pub(super) fn seen(&self, way: Vec3) -> f32 {
        let square = self.squares.dot(way * way) + 2.0 * self.products.dot(way * way.yzx());
        let all = (self.sum * square.max(0.0)).sqrt();
        (0.5 * (all - self.normal.dot(way))).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_seen_is_no_less_than_what_faces_the_eye() {
        let normal = |at: u32| {
            let [x, z] = [0.9 * (at as f32).sin(), 0.7 * (2.3 * at as f32).cos()];
            Vec3::new(x, 1.0, z).normalize()
        };
        let area = |at: u32| 1.0 + (0.7 * at as f32).sin();
        let mut patch = Shading::default();
        (0..40).for_each(|at| patch.add(area(at), normal(at), Vec3::Y));
        for step in 0..60 {
            let [turn, down] = [0.3 * step as f32, (0.17 * step as f32).sin()];
            let way = Vec3::new(turn.cos(), -down, turn.sin()).normalize();
            let weight = |at| area(at) * normal(at).distance_squared(Vec3::Y);
            let facing = |at| weight(at) * (-normal(at).dot(way)).max(0.0);
            let (seen, own) = ((0..40).map(facing).sum::<f32>(), patch.seen(way));
            assert!(own > seen - 1e-4 && own < seen + 0.2 * patch.sum, "{own} for {seen}");
        }
    }

    #[test]
    fn a_flat_patch_is_seen_by_its_slant() {
        let mut patch = Shading::default();
        patch.add(2.0, Vec3::Y, Vec3::X);
        let aslant = Vec3::new(0.6, -0.8, 0.0);
        assert!((patch.seen(aslant) - 0.8 * 4.0).abs() < 1e-5);
        assert_eq!(patch.seen(-aslant), 0.0);
    }
}
