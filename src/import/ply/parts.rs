//! The faces of a PLY, by the pictures on them.

use rustc_hash::FxHashMap;

use super::rows::Face;
use crate::error::{Error, Result};

use crate::import::finite::{NO_UV, finite_uv};
use crate::import::part::{Part, Vertices};
use crate::import::polygon::triangulate;
use crate::warning::Warnings;

/// The key of a part's vertex: its number in the file, and the bits of the UV and color of its corner.
type Corner = (u32, [u32; 2], [u32; 4]);

/// The faces of each picture, and last those of none.
pub(super) struct Parts<'a> {
    vertices: Vertices,
    parts: Vec<Part>,
    numbers: Vec<FxHashMap<Corner, u32>>,
    /// Whether UVs are those of corners.
    by_corner: bool,
    /// One per face in linear light, if colors are those of faces.
    colors: Vec<[f32; 4]>,
    warnings: &'a mut Warnings,
}

impl<'a> Parts<'a> {
    pub(super) fn new(
        vertices: Vertices,
        colors: Vec<[f32; 4]>,
        pictures: usize,
        warnings: &'a mut Warnings,
    ) -> Self {
        let parts = vec![Part::default(); pictures + 1];
        let numbers = vec![FxHashMap::default(); pictures + 1];
        Self { vertices, parts, numbers, by_corner: false, colors, warnings }
    }

    pub(super) fn fill(mut self, faces: &[Face]) -> Result<Vec<Part>> {
        self.by_corner = faces.iter().any(|face| !face.uvs.is_empty());
        let pictures: Vec<usize> =
            faces.iter().enumerate().map(|(number, face)| self.picture(number, face)).collect();
        let first = pictures.first().copied().unwrap_or_default();
        // All vertices as they are.
        let whole = (!self.by_corner && self.colors.is_empty())
            .then_some(first)
            .filter(|first| pictures.iter().all(|picture| picture == first));
        for (number, (face, part)) in faces.iter().zip(pictures).enumerate() {
            let place = || format!("face {number}");
            if let Some(what) = self.fault(face) {
                return Err(Error::invalid(place(), what));
            }
            let positions = face.corners.iter().map(|&at| self.vertices.positions[at as usize]);
            let outline: Vec<[f64; 3]> = positions.collect();
            if !outline.iter().all(Part::is_placed) {
                continue;
            }
            let corners: Vec<u32> = match whole {
                Some(_) => face.corners.clone(),
                None => {
                    let uvs = self.uvs(face, &place);
                    let corners = face.corners.iter().zip(uvs);
                    corners.map(|(&own, uv)| self.vertex(part, number, own, uv)).collect()
                }
            };
            let triangles = triangulate(&outline).into_iter().flatten();
            self.parts[part].triangles.extend(triangles.map(|corner| corners[corner]));
        }
        if let Some(part) = whole {
            self.parts[part].vertices = self.vertices;
        }
        Ok(self.parts)
    }

    /// The part of a face.
    fn picture(&mut self, number: usize, face: &Face) -> usize {
        let plain = self.parts.len() - 1;
        match usize::try_from(face.texture) {
            Ok(picture) if picture < plain => return picture,
            Ok(_) if plain > 0 => {
                let what = "a picture is named that the header has not: the face is plain; name it \
                            by `comment TextureFile`";
                self.warnings.add(format_args!("face {number}"), what);
            }
            _ => {}
        }
        plain
    }

    /// A message on a face that names a vertex which is not there.
    fn fault(&self, face: &Face) -> Option<String> {
        let vertices = self.vertices.positions.len();
        let bad = face.corners.iter().find(|&&corner| corner as usize >= vertices)?;
        Some(format!("{} is not one of the {vertices} vertices", bad.cast_signed()))
    }

    /// The UV of each corner: its own where corners have them, else that of its vertex.
    fn uvs(&mut self, face: &Face, place: &dyn Fn() -> String) -> Vec<Option<[f32; 2]>> {
        if !self.by_corner {
            let uvs = &self.vertices.uvs;
            return face.corners.iter().map(|&at| uvs.get(at as usize).copied()).collect();
        }
        if !face.uvs.is_empty() && face.uvs.len() != 2 * face.corners.len() {
            let what = "there is not a UV for each corner: all are taken for 0 0; export it anew";
            self.warnings.add(place(), what);
            return vec![Some([0.0; 2]); face.corners.len()];
        }
        let mut uvs = face.uvs.as_chunks().0.iter();
        let mut uv = |_| {
            let &[u, v] = uvs.next().unwrap_or(&[0.0, 1.0]);
            let uv = finite_uv([u, 1.0 - v]);
            if uv.is_none() {
                self.warnings.add(place(), NO_UV);
            }
            Some(uv.unwrap_or_default())
        };
        face.corners.iter().map(&mut uv).collect()
    }

    /// The vertex of a face's corner in a part, a new one if no corner before it was the same.
    fn vertex(&mut self, part: usize, face: usize, own: u32, uv: Option<[f32; 2]>) -> u32 {
        let from = &self.vertices;
        let at = own as usize;
        let color = self.colors.get(face).or_else(|| from.colors.get(at)).copied();
        let lists = &mut self.parts[part].vertices;
        let uv_bits = uv.unwrap_or_default().map(f32::to_bits);
        let color_bits = color.unwrap_or_default().map(f32::to_bits);
        *self.numbers[part].entry((own, uv_bits, color_bits)).or_insert_with(|| {
            lists.positions.push(from.positions[at]);
            lists.normals.extend(from.normals.get(at));
            lists.colors.extend(color);
            lists.uvs.extend(uv);
            lists.positions.len() as u32 - 1
        })
    }
}
