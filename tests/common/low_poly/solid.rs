//! Faces in groups: within a group normals are smooth, between groups edges are hard.

use std::collections::HashMap;

use glam::{Quat, Vec2, Vec3};

use super::super::shapes::Shape;

/// A triangle, counterclockwise from outside.
#[derive(Clone, Debug)]
struct Face {
    points: [Vec3; 3],
    uvs: [Vec2; 3],
    group: u32,
}

/// What a form is made of.
#[derive(Clone, Debug, Default)]
pub(crate) struct Solid {
    faces: Vec<Face>,
    groups: u32,
}

impl Solid {
    /// A new group.
    pub(crate) fn group(&mut self) -> u32 {
        self.groups += 1;
        self.groups - 1
    }

    /// A triangle, unless two of its points are one.
    pub(crate) fn triangle(&mut self, group: u32, points: [Vec3; 3], uvs: [Vec2; 3]) {
        // Adding 0 makes −0 a 0, so that points that are equal are so to the bit.
        let [a, b, c] = points.map(|point| point + Vec3::ZERO);
        let points = [a, b, c];
        if a != b && b != c && c != a {
            self.faces.push(Face { points, uvs, group });
        }
    }

    /// A quad with these corners in its texture.
    pub(crate) fn quad_at(&mut self, group: u32, points: [Vec3; 4], uvs: [Vec2; 4]) {
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            let corners = [points[a], points[b], points[c]];
            self.triangle(group, corners, [uvs[a], uvs[b], uvs[c]]);
        }
    }

    /// A flat quad that shows all of its texture.
    pub(crate) fn quad(&mut self, points: [Vec3; 4]) {
        let group = self.group();
        self.quad_at(group, points, [Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO]);
    }

    /// The same with every point mapped by what keeps orientation.
    pub(crate) fn mapped(mut self, map: impl Fn(Vec3) -> Vec3) -> Self {
        self.faces.iter_mut().flat_map(|f| &mut f.points).for_each(|p| *p = map(*p) + Vec3::ZERO);
        self
    }

    /// The same with every UV mapped.
    pub(crate) fn uv_mapped(mut self, map: impl Fn(Vec2) -> Vec2) -> Self {
        self.faces.iter_mut().flat_map(|f| &mut f.uvs).for_each(|uv| *uv = map(*uv));
        self
    }

    pub(crate) fn moved(self, x: f32, y: f32, z: f32) -> Self {
        self.mapped(|point| point + Vec3::new(x, y, z))
    }

    pub(crate) fn scaled(self, x: f32, y: f32, z: f32) -> Self {
        self.mapped(|point| point * Vec3::new(x, y, z))
    }

    /// The same turned about an axis through the origin.
    pub(crate) fn turned(self, axis: Vec3, degrees: f32) -> Self {
        let turn = Quat::from_axis_angle(axis, degrees.to_radians());
        self.mapped(|point| turn * point)
    }

    /// The same seen from the other side.
    pub(crate) fn flipped(mut self) -> Self {
        for face in &mut self.faces {
            face.points.swap(1, 2);
            face.uvs.swap(1, 2);
        }
        self
    }

    /// This and another beside it.
    pub(crate) fn with(mut self, other: Self) -> Self {
        let groups = self.groups;
        self.groups += other.groups;
        let faces = other.faces.into_iter();
        self.faces.extend(faces.map(|face| Face { group: face.group + groups, ..face }));
        self
    }

    /// Several side by side.
    pub(crate) fn of(solids: impl IntoIterator<Item = Self>) -> Self {
        solids.into_iter().fold(Self::default(), Self::with)
    }

    /// As a primitive: a vertex for each point, group and UV, its normal the group's mean by area.
    pub(crate) fn shape(&self) -> Shape {
        let bits = |point: Vec3| point.to_array().map(f32::to_bits);
        let mut normals: HashMap<_, Vec3> = HashMap::new();
        for face in &self.faces {
            let [a, b, c] = face.points;
            for point in face.points {
                *normals.entry((bits(point), face.group)).or_default() += (b - a).cross(c - a);
            }
        }
        let mut shape = Shape::default();
        let mut known = HashMap::new();
        for face in &self.faces {
            let corner = |k: usize| {
                let (point, uv) = (face.points[k], face.uvs[k]);
                let key = (bits(point), face.group, uv.to_array().map(f32::to_bits));
                *known.entry(key).or_insert_with(|| {
                    shape.positions.push(point.to_array());
                    let normal = normals[&(bits(point), face.group)].normalize_or(Vec3::Y);
                    shape.normals.push(normal.to_array());
                    shape.uvs.push(uv.to_array());
                    shape.positions.len() as u32 - 1
                })
            };
            let triangle = [0, 1, 2].map(corner);
            shape.triangles.push(triangle);
        }
        shape
    }
}
