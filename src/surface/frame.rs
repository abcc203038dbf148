//! The space of a mesh within that of the surface that it is a part of.

use glam::{DMat3, DMat4, DQuat, DVec3, Vec3};

/// The largest difference of a turned and scaled unit vector to what a similarity makes of it.
const SAME: f64 = 1e-5;

/// A turn, a scale and a move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Similarity {
    scale: f64,
    rotation: DQuat,
    translation: DVec3,
}

impl Similarity {
    /// The way from the space of one node to that of another; none if it shears, mirrors or flattens, or
    /// scales along some axis alone.
    pub(crate) fn between(from: &DMat4, to: &DMat4) -> Option<Self> {
        let way = to.inverse() * *from;
        let linear = DMat3::from_mat4(way);
        let volume = linear.determinant();
        if !(volume > 0.0 && way.is_finite()) {
            return None;
        }
        let scale = volume.cbrt();
        let rotation = DQuat::from_mat3(&(linear * scale.recip())).normalize();
        let exact = DMat3::from_quat(rotation) * scale;
        let off = (0..3).map(|axis| exact.col(axis).distance(linear.col(axis)));
        let is_one = rotation.is_finite() && off.fold(0.0, f64::max) <= SAME * scale;
        is_one.then_some(Self { scale, rotation, translation: way.w_axis.truncate() })
    }

    /// The factor on lengths.
    pub(crate) fn scale(&self) -> f64 {
        self.scale
    }

    /// A point of the mesh on the surface.
    pub(crate) fn point(&self, point: Vec3) -> Vec3 {
        (self.rotation * (point.as_dvec3() * self.scale) + self.translation).as_vec3()
    }

    /// A point of the surface on the mesh.
    pub(crate) fn point_back(&self, point: Vec3) -> Vec3 {
        let turned = self.rotation.inverse() * (point.as_dvec3() - self.translation);
        (turned / self.scale).as_vec3()
    }

    /// The way from the surface to the mesh.
    pub(crate) fn back(&self) -> DMat4 {
        let scale = DVec3::splat(self.scale);
        DMat4::from_scale_rotation_translation(scale, self.rotation, self.translation).inverse()
    }

    /// A direction on the mesh as one on the surface.
    pub(crate) fn direction(&self, direction: Vec3) -> Vec3 {
        (self.rotation * direction.as_dvec3()).as_vec3()
    }

    /// A direction on the surface as one on the mesh.
    pub(crate) fn direction_back(&self, direction: Vec3) -> Vec3 {
        (self.rotation.inverse() * direction.as_dvec3()).as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back_is_where_it_was_and_what_mirrors_or_squeezes_is_no_similarity() {
        let place = |scale: DVec3, turn: f64| {
            let axis = DVec3::new(1.0, 2.0, -1.0).normalize();
            let rotation = DQuat::from_axis_angle(axis, turn);
            DMat4::from_scale_rotation_translation(scale, rotation, DVec3::new(5.0, 0.0, -7.0))
        };
        let [a, b] = [place(DVec3::splat(2.0), 0.3), place(DVec3::splat(0.5), -1.1)];
        let way = Similarity::between(&a, &b).expect("a similarity");
        assert!((way.scale() - 4.0).abs() < 1e-12);
        let p = Vec3::new(1.0, -2.0, 0.5);
        let shown = |world: &DMat4, p: Vec3| world.transform_point3(p.as_dvec3());
        assert!(shown(&a, p).distance(shown(&b, way.point(p))) < 1e-5);
        assert!(way.point_back(way.point(p)).distance(p) < 1e-5);
        assert!(way.direction_back(way.direction(Vec3::Y)).distance(Vec3::Y) < 1e-6);
        let squeezed = place(DVec3::new(1.0, 1.0, 1.01), 0.0);
        let mirrored = place(DVec3::new(-1.0, 1.0, 1.0), 0.0);
        for other in [squeezed, mirrored, place(DVec3::ZERO, 0.0)] {
            assert_eq!(Similarity::between(&other, &a), None);
        }
        let both = Similarity::between(&squeezed, &(squeezed * DMat4::IDENTITY));
        assert!(both.is_some(), "squeezed alike");
    }
}
