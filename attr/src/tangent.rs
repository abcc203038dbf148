//! Tangents for normal maps, by MikkTSpace.
//!
//! glTF 2.0 §3.7.2.1 asks for MikkTSpace where a file has no tangents: Mikkelsen, "Simulation of
//! wrinkled surfaces revisited", thesis, Copenhagen 2008; computed by `bevy_mikktspace`.
//!
//! The sign in `w` is such that the bitangent is `w · (normal × tangent)` and points to where the
//! normal map's green grows, up in the image. A glTF UV counts v downward, MikkTSpace takes v to
//! count upward, so its sign is turned here.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{DVec3, Vec2, Vec3, Vec4};

use crate::error::{Error, Result};

/// The input of MikkTSpace; the slices have one element per vertex.
#[derive(Clone, Copy, Debug)]
pub struct TangentInput<'a> {
    /// Positions, in any unit.
    pub positions: &'a [Vec3],
    /// Unit shading normals.
    pub normals: &'a [Vec3],
    /// UVs of the normal texture, v downward as in glTF.
    pub uvs: &'a [Vec2],
    /// Vertex indices, counter-clockwise from outside.
    pub triangles: &'a [[u32; 3]],
}

/// Computes the tangent at every corner.
///
/// Returns one triple per triangle: the unit tangent in xyz, in `w` the sign of the bitangent
/// `w · (normal × tangent)`. A vertex may get several tangents where UVs are mirrored, so they
/// belong to corners. Where a triangle has no direction to give (no extent in space or in UV, a
/// value that is not finite) and no neighbor to take one from, the tangent is some unit vector
/// perpendicular to the normal, with sign 1.
///
/// # Errors
/// [`Error::Invalid`] if the slices differ in length or a triangle names a vertex that is not
/// there.
pub fn compute_tangents(input: &TangentInput<'_>) -> Result<Vec<[Vec4; 3]>> {
    let vertices = input.positions.len();
    if input.normals.len() != vertices || input.uvs.len() != vertices {
        let what = "positions, normals and UVs differ in number".into();
        return Err(Error::Invalid { what });
    }
    if let Some(at) = input.triangles.iter().position(|t| t.iter().any(|v| *v as usize >= vertices))
    {
        let what = format!("triangle {at} names a vertex that is not there");
        return Err(Error::Invalid { what });
    }
    let sound = |v: usize| {
        input.positions[v].is_finite() && input.normals[v].is_finite() && input.uvs[v].is_finite()
    };
    let faces = (0..input.triangles.len())
        .filter(|t| input.triangles[*t].iter().all(|v| sound(*v as usize)))
        .collect();
    let fallback = |v: u32| {
        // In f64, where the square of no f32 is lost to underflow.
        let normal = input.normals[v as usize].as_dvec3().normalize_or(DVec3::Z).as_vec3();
        normal.any_orthonormal_vector().extend(1.0)
    };
    let tangents = input.triangles.iter().map(|triangle| triangle.map(fallback)).collect();
    let mut corners = Corners { input: *input, faces, tangents };
    generate_tangents(&mut corners).map_err(|e| Error::Invalid { what: e.to_string() })?;
    Ok(corners.tangents)
}

/// The mesh as MikkTSpace reads it: only the triangles whose numbers are all finite.
struct Corners<'a> {
    input: TangentInput<'a>,
    /// One per face of MikkTSpace: the triangle.
    faces: Vec<usize>,
    tangents: Vec<[Vec4; 3]>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, slot: usize) -> usize {
        self.input.triangles[self.faces[face]][slot] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.faces.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, slot: usize) -> [f32; 3] {
        self.input.positions[self.vertex(face, slot)].to_array()
    }

    fn normal(&self, face: usize, slot: usize) -> [f32; 3] {
        self.input.normals[self.vertex(face, slot)].to_array()
    }

    fn tex_coord(&self, face: usize, slot: usize) -> [f32; 2] {
        self.input.uvs[self.vertex(face, slot)].to_array()
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, slot: usize) {
        let Some(tangent) = space.map(|space| Vec4::from_array(space.tangent_encoded())) else {
            return;
        };
        let length = tangent.truncate().length_squared();
        if tangent.is_finite() && (length - 1.0).abs() < 1e-3 {
            self.tangents[self.faces[face]][slot] = tangent.truncate().extend(-tangent.w);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A square in the plane z = 0, seen from +z:
    /// ```text
    /// 3──2
    /// │ ╱│
    /// 0──1
    /// ```
    fn square(uv: impl Fn(Vec3) -> Vec2) -> Vec<[Vec4; 3]> {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
        let uvs = positions.map(uv);
        let input = TangentInput {
            positions: &positions,
            normals: &[Vec3::Z; 4],
            uvs: &uvs,
            triangles: &[[0, 1, 2], [0, 2, 3]],
        };
        compute_tangents(&input).unwrap()
    }

    #[test]
    fn an_upright_image_has_its_bitangent_up() {
        // v downward: the top of the image is at v = 0.
        for tangent in square(|p| Vec2::new(p.x, 1.0 - p.y)).as_flattened() {
            assert_eq!(*tangent, Vec4::new(1.0, 0.0, 0.0, 1.0));
            assert_eq!(Vec3::Z.cross(tangent.truncate()) * tangent.w, Vec3::Y);
        }
    }

    #[test]
    fn a_mirrored_image_turns_the_tangent_and_keeps_the_bitangent() {
        for tangent in square(|p| Vec2::new(1.0 - p.x, 1.0 - p.y)).as_flattened() {
            assert_eq!(*tangent, Vec4::new(-1.0, 0.0, 0.0, -1.0));
            assert_eq!(Vec3::Z.cross(tangent.truncate()) * tangent.w, Vec3::Y);
        }
    }

    #[test]
    fn an_index_that_is_not_there_is_an_error() {
        let input = TangentInput {
            positions: &[Vec3::ZERO],
            normals: &[Vec3::Z],
            uvs: &[Vec2::ZERO],
            triangles: &[[0, 0, 1]],
        };
        assert!(compute_tangents(&input).unwrap_err().to_string().contains("triangle 0"));
        assert!(compute_tangents(&TangentInput { uvs: &[], ..input }).is_err());
    }

    #[test]
    fn a_normal_whose_square_underflows_gives_a_unit_tangent() {
        let input = TangentInput {
            positions: &[Vec3::ZERO],
            normals: &[Vec3::Y * -5.223_229e-23],
            uvs: &[Vec2::ZERO],
            triangles: &[[0, 0, 0]],
        };
        let tangent = compute_tangents(&input).unwrap()[0][0].truncate();
        assert!((tangent.length() - 1.0).abs() < 1e-6, "{tangent}");
    }

    /// Few values, so that points and UVs coincide; huge ones and those that are no number.
    fn number() -> impl Strategy<Value = f32> {
        prop_oneof![
            8 => (-2i8..=2).prop_map(f32::from),
            1 => any::<f32>(),
            1 => Just(f32::NAN),
        ]
    }

    proptest! {
        #[test]
        fn any_numbers_give_unit_tangents(
            numbers in prop::collection::vec(number(), 8 * 7),
            triangles in prop::collection::vec(prop::array::uniform3(0u32..7), 0..12),
        ) {
            let vec3 = |at: usize| Vec3::from_slice(&numbers[at..]);
            let positions: Vec<_> = (0..7).map(|v| vec3(8 * v)).collect();
            let normals: Vec<_> = (0..7).map(|v| vec3(8 * v + 3)).collect();
            let uvs: Vec<_> = (0..7).map(|v| Vec2::from_slice(&numbers[8 * v + 6..])).collect();
            let input = TangentInput {
                positions: &positions, normals: &normals, uvs: &uvs, triangles: &triangles,
            };
            for tangent in compute_tangents(&input).unwrap().as_flattened() {
                prop_assert!((tangent.truncate().length() - 1.0).abs() < 1e-3);
                prop_assert!(tangent.w.abs() == 1.0);
            }
        }
    }
}
