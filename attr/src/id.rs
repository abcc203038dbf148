//! Indices that can't be mistaken for one another.
//!
//! A point, a wedge and a triangle are all a `u32`; mixing them up compiles in a language of plain
//! integers and corrupts a mesh. Here each is its own type, and a flat array of per-point data is
//! indexed by a [`PointId`] only.

use std::ops::{Index, IndexMut};

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// The id of the `index`-th element of an array.
            ///
            /// # Panics
            /// If `index` does not fit in 32 bits; meshes are limited to that at the reader.
            #[inline]
            pub fn new(index: usize) -> Self {
                Self(u32::try_from(index).expect("more than 2^32 mesh elements"))
            }

            /// The position in an array.
            #[inline]
            pub const fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl<T> Index<$name> for [T] {
            type Output = T;
            #[inline]
            fn index(&self, id: $name) -> &T {
                &self[id.0 as usize]
            }
        }

        impl<T> IndexMut<$name> for [T] {
            #[inline]
            fn index_mut(&mut self, id: $name) -> &mut T {
                &mut self[id.0 as usize]
            }
        }

        impl<T> Index<$name> for Vec<T> {
            type Output = T;
            #[inline]
            fn index(&self, id: $name) -> &T {
                &self.as_slice()[id.0 as usize]
            }
        }

        impl<T> IndexMut<$name> for Vec<T> {
            #[inline]
            fn index_mut(&mut self, id: $name) -> &mut T {
                &mut self.as_mut_slice()[id.0 as usize]
            }
        }
    };
}

id! {
    /// A point: a position, unique bitwise after weld.
    PointId
}
id! {
    /// A wedge: one attribute tuple at a point, shared by the corners that agree.
    WedgeId
}
id! {
    /// A triangle of a mesh.
    TriangleId
}
id! {
    /// A corner of a triangle: `3 · triangle + slot`.
    CornerId
}

id! {
    /// An edge: two points that a triangle joins, however many triangles that are.
    EdgeId
}

impl CornerId {
    /// The triangle this corner belongs to.
    #[inline]
    pub const fn triangle(self) -> TriangleId {
        TriangleId(self.0 / 3)
    }

    /// The slot of the corner in its triangle: 0, 1 or 2.
    #[inline]
    pub const fn slot(self) -> usize {
        (self.0 % 3) as usize
    }
}

impl TriangleId {
    /// The triangle's corner in `slot` (0, 1 or 2).
    #[inline]
    pub const fn corner(self, slot: usize) -> CornerId {
        CornerId(self.0 * 3 + slot as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corner_and_triangle_name_each_other() {
        let corner = TriangleId(7).corner(2);
        assert_eq!(corner, CornerId(23));
        assert_eq!((corner.triangle(), corner.slot()), (TriangleId(7), 2));
    }

    #[test]
    fn a_slice_is_indexed_by_its_id() {
        let mut values = [10, 20, 30];
        values[PointId(1)] += 1;
        assert_eq!(values[PointId(1)], 21);
    }
}
