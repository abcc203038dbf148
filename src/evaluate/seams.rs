//! The band around seams, as a camera sees it: where an atlas that bleeds shows first.
//!
//! A seam is an edge whose two triangles wear different materials or disagree in UV, at positions
//! that agree bitwise. A pixel belongs to the band if it sees a triangle with a seam edge from at
//! most [`BAND`] pixels off: the i-th barycentric is 0 on the edge opposite corner i, so its value
//! over the length of its gradient on the screen is the distance in pixels, to first order.

use glam::{DVec2, Vec2};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::camera::{Camera, Rig};
use super::raster::{NONE, SAMPLES, View};
use super::render::find_visible;
use super::scene::{Mode, Scene};
use super::shade::Shader;

/// Half the width of the band: what a bilinear tap reaches at the mip level of a pixel, and as much
/// again for trilinear filtering.
const BAND: f32 = 2.0;

/// One per view of the rig: whether each pixel lies in the band around a seam of the scene.
pub(super) fn seam_bands(scene: &Scene, rig: &Rig) -> Vec<Vec<bool>> {
    let seams = seam_edges(scene);
    rig.cameras.par_iter().map(|camera| seam_band(scene, camera, rig.resolution, &seams)).collect()
}

fn seam_band(scene: &Scene, camera: &Camera, resolution: usize, seams: &[[bool; 3]]) -> Vec<bool> {
    let view = View::new(scene, camera, resolution);
    let (solid, _) = find_visible(&view, &Shader::new(&view, Mode::Unlit));
    let mut band = vec![false; resolution * resolution];
    for (at, &triangle) in solid.triangles.iter().enumerate() {
        if triangle == NONE || seams[triangle as usize] == [false; 3] {
            continue;
        }
        let (x, y) = (at % view.size(), at / view.size());
        let Some(facet) = view.facet(triangle as usize) else { continue };
        let hit = facet.hit(&view, DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
        let near = |corner: usize| {
            let gradient = Vec2::new(hit.dx[corner], hit.dy[corner]).length();
            hit.barycentrics[corner] <= BAND * gradient
        };
        if (0..3).any(|corner| seams[triangle as usize][corner] && near(corner)) {
            band[y / SAMPLES * resolution + x / SAMPLES] = true;
        }
    }
    band
}

/// A position as bits, −0 as 0.
type Point = [u32; 3];
/// What a triangle's side of an edge wears: its material and the UVs of both ends in set 0.
type Worn = (u32, [[u32; 2]; 2]);

/// One per triangle: whether the edge opposite each corner is a seam.
fn seam_edges(scene: &Scene) -> Vec<[bool; 3]> {
    let mut sides: FxHashMap<[Point; 2], (Worn, bool)> = FxHashMap::default();
    for triangle in 0..scene.triangles.len() {
        for corner in 0..3 {
            let (edge, worn) = side(scene, triangle, corner);
            let known = sides.entry(edge).or_insert((worn, false));
            known.1 |= known.0 != worn;
        }
    }
    let is_seam = |triangle, corner| sides[&side(scene, triangle, corner).0].1;
    (0..scene.triangles.len()).map(|t| [0, 1, 2].map(|corner| is_seam(t, corner))).collect()
}

/// The edge opposite a corner, its lesser end first, and what the triangle wears along it.
fn side(scene: &Scene, triangle: usize, corner: usize) -> ([Point; 2], Worn) {
    let end = |slot: usize| {
        let vertex = scene.triangles[triangle][slot % 3] as usize;
        let uv = scene.uvs[0].get(vertex).copied().unwrap_or_default();
        let bits = |x: f32| (x + 0.0).to_bits();
        (scene.positions[vertex].to_array().map(bits), uv.to_array().map(bits))
    };
    let (mut a, mut b) = (end(corner + 1), end(corner + 2));
    if a.0 > b.0 {
        std::mem::swap(&mut a, &mut b);
    }
    let material = scene.triangle_materials.get(triangle).copied().unwrap_or_default();
    ([a.0, b.0], (material, [a.1, b.1]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::scene::Material;
    use glam::{DVec3, Vec3};

    /// The square −1…1 of the plane z = 0, halved by the line x = 0: its right half has UVs of its
    /// own, so that line is a seam.
    fn halves() -> Scene {
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let positions = [(-1.0, -1.0), (0.0, -1.0), (0.0, 1.0), (-1.0, 1.0)].map(|(x, y)| at(x, y));
        let right = positions.map(|p| p + Vec3::X);
        Scene {
            positions: [positions, right].concat(),
            normals: vec![Vec3::Z; 8],
            uvs: [
                [positions, right.map(|p| p + Vec3::Y)]
                    .concat()
                    .iter()
                    .map(|p| p.truncate())
                    .collect(),
                Vec::new(),
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
            triangle_materials: vec![0; 4],
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    #[test]
    fn the_seam_is_found_and_the_diagonals_and_borders_are_not() {
        let seams = seam_edges(&halves());
        let count = seams.iter().flatten().filter(|&&seam| seam).count();
        assert_eq!(count, 2);
        assert!(seams[0][0] && seams[3][1]);
    }

    #[test]
    fn the_band_is_two_pixels_on_either_side() {
        let scene = halves();
        let camera = Camera::look_at(DVec3::Z * 2.0, DVec3::ZERO, 2.0 * 0.5f64.atan(), 0.1);
        let band = seam_band(&scene, &camera, 32, &seam_edges(&scene));
        for y in 2..30 {
            let row = &band[y * 32..][..32];
            let inside: Vec<usize> = (0..32).filter(|&x| row[x]).collect();
            assert_eq!(inside, [14, 15, 16, 17], "row {y}");
        }
    }
}
