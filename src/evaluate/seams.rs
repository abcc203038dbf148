//! The band around seams, as a camera sees it: where an atlas that bleeds shows first.
//!
//! A seam is an edge whose two triangles use different materials or disagree in UV, at positions
//! that agree bitwise. A pixel belongs to the band if it sees a triangle with a seam edge from at
//! most [`BAND`] pixels off: the i-th barycentric is 0 on the edge opposite corner i, so its value
//! over the length of its gradient on the screen is the distance in pixels, to first order.

use glam::{DVec2, Vec2};

use super::raster::SAMPLES;
use super::scene::Scene;
use super::tiles::Tile;
use crate::surface::edges::{Side, same_edge, sides_by_edge};

/// Half the width of the band: what a bilinear tap reaches at the mip level of a pixel, and as much
/// again for trilinear filtering.
const BAND: f32 = 2.0;

/// Marks the pixels of a tile, one of the view's each, that lie in the band around a seam of the scene:
/// see [`seam_edges`].
pub(super) fn mark_band(tile: &Tile<'_>, seams: &[[bool; 3]], band: &mut [bool]) {
    for (at, &triangle) in tile.solid.triangles.iter().enumerate() {
        let Some(facet) = tile.facets.get(triangle as usize) else { continue };
        let seams = seams[facet.triangle];
        if seams == [false; 3] {
            continue;
        }
        let [x, y] = [tile.corner[0] + at % tile.size[0], tile.corner[1] + at / tile.size[0]];
        let hit = facet.hit(tile.view, DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
        let near = |corner: usize| {
            let gradient = Vec2::new(hit.dx[corner], hit.dy[corner]).length();
            hit.barycentrics[corner] <= BAND * gradient
        };
        if (0..3).any(|corner| seams[corner] && near(corner)) {
            band[y / SAMPLES * tile.view.resolution + x / SAMPLES] = true;
        }
    }
}

/// One per triangle: whether the edge opposite each corner is a seam.
pub(super) fn seam_edges(scene: &Scene) -> Vec<[bool; 3]> {
    let mut seams = vec![[false; 3]; scene.triangles.len()];
    let sides = sides_by_edge(&scene.triangles, &scene.positions);
    for edge in sides.chunk_by(same_edge) {
        let first = side_key(scene, &edge[0]);
        if edge.iter().any(|side| side_key(scene, side) != first) {
            edge.iter().for_each(|side| seams[side.triangle][side.corner()] = true);
        }
    }
    seams
}

/// The material and UVs at a triangle's side of an edge: its material and the bits of the UVs of both ends in
/// set 0.
fn side_key(scene: &Scene, side: &Side) -> (u32, [[u32; 2]; 2]) {
    let uv = |vertex: usize| scene.uvs[0].get(vertex).copied().unwrap_or_default();
    let bits = |vertex: usize| uv(vertex).to_array().map(|x| (x + 0.0).to_bits());
    let material = scene.triangle_materials.get(side.triangle).copied().unwrap_or_default();
    (material, side.ends(&scene.triangles, bits))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::camera::Camera;
    use crate::evaluate::render::render_with;
    use crate::evaluate::scene::{Material, Mode};
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
        let seams = seam_edges(&scene);
        let mut band = vec![false; 32 * 32];
        render_with(&scene, &camera, (32, Mode::Unlit), |tile| mark_band(tile, &seams, &mut band));
        for y in 2..30 {
            let row = &band[y * 32..][..32];
            let inside: Vec<usize> = (0..32).filter(|&x| row[x]).collect();
            assert_eq!(inside, [14, 15, 16, 17], "row {y}");
        }
    }
}
