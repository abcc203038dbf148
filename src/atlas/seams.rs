//! The seams of images.
//!
//! A seam of an image is an edge of exactly two triangles that read it at different UVs. Edges of
//! more triangles are no seams of an image: where a thin sheet has two sides in one place, nothing
//! tells which of them belong together.
//!
//! Of a normal map each triangle reads vectors in a frame of its own (tangent, bitangent, normal), so
//! equal texels are no equal normals. [`Seam::turns`] has what turns one frame into the other, where
//! the shading normals agree; where they do not, the edge is hard, and its step is meant.

use glam::{Affine2, Mat3, Vec2, Vec3, Vec4};
use seamwise_attr::{TangentInput, compute_tangents};
use seamwise_texture::Role;
use seamwise_texture::equalize::Seam;

use super::charts::Charts;
use crate::document::asset::Asset;
use crate::document::material::{TextureSlot, material_slots, textures_of};
use crate::document::primitive::Primitive;
use crate::error::{Error, Result};
use crate::surface::edges::{Side, same_edge, sides_by_edge};

/// Cosine of the angle between the normals of both sides from which on an edge is hard: 2.6°.
const HARD_EDGE_COSINE: f32 = 0.999;

/// The seams of each image of an asset, over all surfaces and UV sets that read it.
///
/// # Errors
/// [`Error::Invalid`] or [`Error::Unsupported`] with the place in the document.
pub(crate) fn seams_of_images(asset: &Asset) -> Result<Vec<Vec<Seam>>> {
    let materials = material_slots(asset)?;
    let mut seams = vec![Vec::new(); asset.count("images")];
    for mesh in 0..asset.count("meshes") {
        let primitives = Primitive::of_mesh(asset, mesh)?;
        for reading in readings(asset, &primitives, &materials)? {
            let mut surface = Surface::default();
            for primitive in &reading.primitives {
                let Reading { uv_set, transform, vectors, .. } = reading;
                surface.add(asset, primitive, uv_set, transform, vectors)?;
            }
            seams[reading.image].extend(surface.seams());
        }
    }
    Ok(seams)
}

/// The primitives of a mesh that read an image in the same way.
struct Reading<'a> {
    image: usize,
    uv_set: usize,
    transform: Affine2,
    /// Whether as a normal map.
    vectors: bool,
    primitives: Vec<&'a Primitive>,
}

fn readings<'a>(
    asset: &Asset,
    primitives: &'a [Primitive],
    materials: &[Vec<TextureSlot>],
) -> Result<Vec<Reading<'a>>> {
    let mut readings: Vec<Reading<'_>> = Vec::new();
    for primitive in primitives.iter().filter(|primitive| primitive.is_surface()) {
        for &TextureSlot { image, uv_set, transform, role, .. } in
            textures_of(asset, primitive, materials)?
        {
            let key = (image, uv_set, transform);
            let known = readings.iter().position(|r| (r.image, r.uv_set, r.transform) == key);
            let at = known.unwrap_or_else(|| {
                let (vectors, primitives) = (false, Vec::new());
                readings.push(Reading { image, uv_set, transform, vectors, primitives });
                readings.len() - 1
            });
            let reading = &mut readings[at];
            reading.vectors |= role == Role::Normal;
            if reading.primitives.last().is_none_or(|last| last.index != primitive.index) {
                reading.primitives.push(primitive);
            }
        }
    }
    Ok(readings)
}

/// Triangles that read one image.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surface {
    charts: Charts,
    /// One per UV.
    positions: Vec<Vec3>,
    /// One per corner: tangent, bitangent and normal, where they are known and asked for.
    frames: Vec<[Option<Mat3>; 3]>,
}

impl Surface {
    /// Adds a primitive that reads the image in a UV set, moved by `transform`; with the frames of
    /// tangent vectors if `vectors`.
    ///
    /// # Errors
    /// [`Error::Invalid`] if an attribute is malformed.
    pub(crate) fn add(
        &mut self,
        asset: &Asset,
        primitive: &Primitive,
        uv_set: usize,
        transform: Affine2,
        vectors: bool,
    ) -> Result<()> {
        let Some(charts) = Charts::read(asset, primitive, uv_set, transform)? else {
            return Ok(());
        };
        let positions = primitive.positions(asset)?;
        let frames = if vectors { frames(asset, primitive, uv_set, &positions)? } else { None };
        let none = || vec![[None; 3]; charts.triangles.len()];
        self.frames.extend(frames.unwrap_or_else(none));
        self.positions.extend(positions);
        self.charts.append(charts);
        Ok(())
    }

    /// The seams between all these triangles.
    pub(crate) fn seams(&self) -> Vec<Seam> {
        let triangles = &self.charts.triangles;
        let seam = |sides: &[Side]| {
            let &[a, b] = sides else { return None };
            if a.points[0] == a.points[1] {
                return None;
            }
            let uvs = [a, b].map(|side| side.ends(triangles, |vertex| self.charts.uvs[vertex]));
            let frames = |side: Side| side.slots.map(|slot| self.frames[side.triangle][slot]);
            let ([a0, a1], [b0, b1]) = (frames(a), frames(b));
            let turns = turn(a0, b0).zip(turn(a1, b1)).map(|(from, to)| [from, to]);
            (uvs[0] != uvs[1]).then_some(Seam { sides: uvs, turns })
        };
        let sides = sides_by_edge(triangles, &self.positions);
        sides.chunk_by(same_edge).filter_map(seam).collect()
    }
}

/// The matrix from frame `b` to frame `a`; `None` where the edge is hard.
fn turn(a: Option<Mat3>, b: Option<Mat3>) -> Option<Mat3> {
    let (a, b) = a.zip(b)?;
    (a.z_axis.dot(b.z_axis) >= HARD_EDGE_COSINE).then(|| a.transpose() * b)
}

/// The frame at each corner, by the file's tangents or else by MikkTSpace; `None` without normals:
/// then every edge is hard.
fn frames(
    asset: &Asset,
    primitive: &Primitive,
    uv_set: usize,
    positions: &[Vec3],
) -> Result<Option<Vec<[Option<Mat3>; 3]>>> {
    let count = positions.len();
    let Some(normals) = primitive.floats(asset, "NORMAL", 3, count)? else {
        return Ok(None);
    };
    let normals: Vec<Vec3> = normals.as_chunks().0.iter().map(|&n| Vec3::from_array(n)).collect();
    let triangles = primitive.triangles(asset, count)?;
    let tangents: Vec<[Vec4; 3]> = match primitive.floats(asset, "TANGENT", 4, count)? {
        Some(tangents) => {
            let tangents = tangents.as_chunks().0;
            triangles.iter().map(|t| t.map(|v| Vec4::from_array(tangents[v as usize]))).collect()
        }
        None => {
            // As MikkTSpace asks, by UVs without the texture's transform.
            let charts = Charts::read(asset, primitive, uv_set, Affine2::IDENTITY)?;
            let uvs: Vec<Vec2> = charts.map(|charts| charts.uvs).unwrap_or_default();
            let input =
                TangentInput { positions, normals: &normals, uvs: &uvs, triangles: &triangles };
            compute_tangents(&input).map_err(|e| Error::invalid(&primitive.at, e.to_string()))?
        }
    };
    let corner = |tangent: Vec4, vertex: u32| frame(normals[vertex as usize], tangent);
    let corners = triangles
        .iter()
        .zip(tangents)
        .map(|([a, b, c], [ta, tb, tc])| [corner(ta, *a), corner(tb, *b), corner(tc, *c)]);
    Ok(Some(corners.collect()))
}

/// Tangent, bitangent and normal as unit vectors at right angles.
fn frame(normal: Vec3, tangent: Vec4) -> Option<Mat3> {
    let normal = normal.try_normalize()?;
    let tangent_axis = tangent.truncate().reject_from_normalized(normal).try_normalize()?;
    let sign = if tangent.w < 0.0 { -1.0 } else { 1.0 };
    Some(Mat3::from_cols(tangent_axis, normal.cross(tangent_axis) * sign, normal))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of two squares, the second with UVs of its own and a tangent turned by 90°.
    fn strip(normal: Vec3) -> Surface {
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let positions =
            [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(1.0, 0.0), at(2.0, 0.0), at(1.0, 1.0)];
        let uvs = [[0.0, 1.0], [0.25, 1.0], [0.25, 0.5], [0.5, 0.5], [0.5, 1.0], [0.75, 0.5]];
        let frames =
            [[frame(Vec3::Z, Vec3::X.extend(1.0)); 3], [frame(normal, Vec3::Y.extend(1.0)); 3]];
        let triangles = vec![[0, 1, 2], [3, 4, 5]];
        let charts = Charts { uvs: uvs.map(Vec2::from).to_vec(), triangles };
        Surface { charts, positions: positions.to_vec(), frames: frames.to_vec() }
    }

    #[test]
    fn a_seam_has_the_uvs_of_both_sides_end_by_end_and_turns_the_second() {
        let [seam] = strip(Vec3::Z).seams().try_into().unwrap();
        let [a, b] = [[[0.25, 1.0], [0.25, 0.5]], [[0.5, 0.5], [0.75, 0.5]]];
        assert_eq!(seam.sides, [a.map(Vec2::from), b.map(Vec2::from)]);
        // Along y is up for the first side and along its tangent for the second.
        let [from, to] = seam.turns.unwrap();
        assert!(from.x_axis.distance(Vec3::Y) < 1e-6 && from == to);
    }

    #[test]
    fn a_hard_edge_is_a_seam_without_a_turn() {
        let [seam] = strip(Vec3::new(0.0, 0.3, 1.0)).seams().try_into().unwrap();
        assert_eq!(seam.turns, None);
    }

    #[test]
    fn edges_of_three_triangles_and_edges_of_one_uv_are_no_seams() {
        let mut surface = strip(Vec3::Z);
        surface.charts.triangles.push([3, 0, 5]);
        surface.frames.push([None; 3]);
        assert!(surface.seams().iter().all(|seam| seam.sides[0][0] != Vec2::new(0.25, 1.0)));
        let mut surface = strip(Vec3::Z);
        surface.charts.uvs[3] = surface.charts.uvs[1];
        surface.charts.uvs[5] = surface.charts.uvs[2];
        assert_eq!(surface.seams(), []);
    }

    #[test]
    fn an_edge_without_extent_is_no_seam() {
        let mut surface = strip(Vec3::Z);
        surface.positions.fill(Vec3::ONE);
        assert_eq!(surface.seams(), []);
    }
}
