//! Four samples at a time: a number of each in a [`Vec4`], a vector of each in a [`Lanes`].

use std::ops::{Add, Mul, Neg, Sub};

use glam::{BVec4A, Mat4, Vec3, Vec4};

/// Four vectors, coordinate by coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lanes {
    pub(super) x: Vec4,
    pub(super) y: Vec4,
    pub(super) z: Vec4,
}

impl Lanes {
    #[inline]
    pub(super) fn splat(vector: Vec3) -> Self {
        Self { x: Vec4::splat(vector.x), y: Vec4::splat(vector.y), z: Vec4::splat(vector.z) }
    }

    /// The first three coordinates of four vectors, and their last.
    #[inline]
    pub(super) fn of([a, b, c, d]: [Vec4; 4]) -> (Self, Vec4) {
        let columns = Mat4::from_cols(a, b, c, d).transpose();
        (Self { x: columns.x_axis, y: columns.y_axis, z: columns.z_axis }, columns.w_axis)
    }

    #[inline]
    pub(super) fn select(mask: BVec4A, if_true: Self, if_false: Self) -> Self {
        Self {
            x: Vec4::select(mask, if_true.x, if_false.x),
            y: Vec4::select(mask, if_true.y, if_false.y),
            z: Vec4::select(mask, if_true.z, if_false.z),
        }
    }

    #[inline]
    pub(super) fn dot(self, other: Self) -> Vec4 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline]
    pub(super) fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    /// Of length 1; `fallback` where that can't be.
    #[inline]
    pub(super) fn normalize_or(self, fallback: Self) -> Self {
        let scale = self.dot(self).sqrt().recip();
        let is_finite = scale.is_finite_mask() & scale.cmpgt(Vec4::ZERO);
        Self::select(is_finite, self * scale, fallback)
    }

    /// Each coordinate changed alike.
    #[inline]
    pub(super) fn map(self, change: impl Fn(Vec4) -> Vec4) -> Self {
        Self { x: change(self.x), y: change(self.y), z: change(self.z) }
    }
}

impl Add for Lanes {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl Sub for Lanes {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl Mul for Lanes {
    type Output = Self;

    #[inline]
    fn mul(self, other: Self) -> Self {
        Self { x: self.x * other.x, y: self.y * other.y, z: self.z * other.z }
    }
}

impl Mul<Vec4> for Lanes {
    type Output = Self;

    #[inline]
    fn mul(self, scale: Vec4) -> Self {
        Self { x: self.x * scale, y: self.y * scale, z: self.z * scale }
    }
}

impl Neg for Lanes {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}

/// Held to 0…1; what is not a number is 0.
#[inline]
pub(super) fn unit(value: Vec4) -> Vec4 {
    Vec4::select(value.cmpgt(Vec4::ZERO), value.min(Vec4::ONE), Vec4::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_length_falls_back() {
        let rows = [Vec4::X * 3.0, Vec4::ZERO, Vec4::NAN, Vec4::Y * 1e30];
        let (lanes, last) = Lanes::of(rows);
        assert!(last.x == 0.0 && last.z.is_nan());
        let unit = lanes.normalize_or(Lanes::splat(Vec3::Z));
        let at = |slot: usize| Vec3::new(unit.x[slot], unit.y[slot], unit.z[slot]);
        assert_eq!([at(0), at(1), at(2), at(3)], [Vec3::X, Vec3::Z, Vec3::Z, Vec3::Z]);
    }

    #[test]
    fn products_are_those_of_each_vector() {
        let rows = [[1.0, 2.0, 3.0, 0.0], [0.5, -1.0, 4.0, 0.0], [7.0, 0.0, 1.0, 0.0], [0.0; 4]];
        let other = Vec3::new(2.0, -3.0, 0.25);
        let (lanes, _) = Lanes::of(rows.map(Vec4::from_array));
        let (dot, cross) = (lanes.dot(Lanes::splat(other)), lanes.cross(Lanes::splat(other)));
        for (slot, row) in rows.iter().enumerate() {
            let row = Vec3::from_slice(row);
            assert_eq!(dot[slot], row.dot(other));
            let found = Vec3::new(cross.x[slot], cross.y[slot], cross.z[slot]);
            assert_eq!(found, row.cross(other));
        }
    }

    #[test]
    fn unit_holds_to_the_range_of_a_screen() {
        let values = Vec4::new(f32::NAN, -1.0, f32::INFINITY, 0.25);
        assert_eq!(unit(values), Vec4::new(0.0, 0.0, 1.0, 0.25));
    }
}
