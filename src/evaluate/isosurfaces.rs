//! Ellipsoids over a shape of clay, each sample where its ray meets their quadric.

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec3};
use image::RgbImage;
use seamwise_attr::{Ellipsoid, PointQuadric, Ray};
use seamwise_texture::color::srgb8_to_linear;

use super::camera::Camera;
use super::raster::{SAMPLES, View};
use super::scene::Scene;
use super::wireframe::{Overlay, clay, draw_under};

/// Light of the outline of a solid over that within it: flat ones that lie side by side have one shade.
const OUTLINE: f32 = 0.4;
/// Width of an outline in pixels.
const OUTLINE_WIDTH: f64 = 1.2;

/// An ellipsoid to be drawn: where a quadric has a value.
#[derive(Clone, Copy, Debug)]
pub struct Solid {
    /// The quadric, over places that are counted from the scene's origin.
    pub quadric: PointQuadric,
    /// Its value there.
    pub value: f64,
    /// What that is.
    pub ellipsoid: Ellipsoid,
    /// Its color, an index of those that it is drawn with.
    pub color: usize,
}

/// Draws a scene's edges and the solids in `colors`, sRGB, one view of `resolution` pixels each way.
///
/// # Panics
/// If a solid has a color beyond those.
pub fn draw_isosurfaces(
    scene: &Scene,
    solids: &[Solid],
    colors: &[[u8; 3]],
    camera: &Camera,
    resolution: usize,
) -> RgbImage {
    let view = View::new(scene, camera, resolution);
    let mut overlay = Overlay::new(&view);
    let turn = DMat3::from_cols(camera.right, camera.up, camera.forward).transpose();
    let map = DAffine3 { matrix3: turn, translation: -(turn * camera.eye) };
    for solid in solids {
        let color = Vec3::from_array(colors[solid.color].map(srgb8_to_linear));
        draw(&view, solid, color, &map, &mut overlay);
    }
    draw_under(&view, &overlay)
}

fn draw(view: &View<'_>, solid: &Solid, color: Vec3, map: &DAffine3, overlay: &mut Overlay) {
    let Some(quadric) = solid.quadric.transformed(map) else { return };
    let center = map.transform_point3(solid.ellipsoid.center);
    let [columns, rows] = extent(view, center, map.matrix3 * solid.ellipsoid.map);
    let hit = |at: DVec2| {
        let ray = Ray { origin: DVec3::ZERO, direction: view.ray(at) };
        Some((ray, quadric.intersect(&ray, solid.value)?))
    };
    let width = OUTLINE_WIDTH * SAMPLES as f64;
    let beside = [DVec2::X, DVec2::Y, -DVec2::X, -DVec2::Y].map(|side| side * width);
    for y in rows[0]..rows[1] {
        for x in columns[0]..columns[1] {
            let at = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            let Some((ray, [near, far])) = hit(at) else { continue };
            // From within, its far side is what is seen. Along a ray of depth 1 distances are depths.
            let depth = if near >= view.camera.near { near } else { far };
            if depth < view.camera.near {
                continue;
            }
            let normal = quadric.gradient(ray.at(depth)).normalize_or_zero();
            let facing = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
            let is_rim = beside.iter().any(|side| hit(at + side).is_none());
            let shade = if is_rim { OUTLINE } else { 1.0 };
            overlay.put([x, y], depth, color * (1.3 * clay(facing) * shade));
        }
    }
}

/// The samples that an ellipsoid may cover, columns and rows: its outline in a picture is a conic, the dual of
/// which is that of the ellipsoid without depth (Hartley & Zisserman, "Multiple view geometry", §8.3).
fn extent(view: &View<'_>, center: DVec3, map: DMat3) -> [[usize; 2]; 2] {
    let size = view.size();
    let shape = map * map.transpose();
    let dual = |row: usize, column: usize| shape.col(column)[row] - center[row] * center[column];
    if center.z <= 0.0 || dual(2, 2) >= 0.0 {
        // The eye is within it or beside it: it may be anywhere.
        let all =
            if center.z + shape.z_axis.z.sqrt() > view.camera.near { [0, size] } else { [0, 0] };
        return [all; 2];
    }
    let range = |axis: usize, sign: f64| {
        let root = (dual(axis, 2).powi(2) - dual(axis, axis) * dual(2, 2)).max(0.0).sqrt();
        let ends = [-root, root].map(|root| (dual(axis, 2) + root) / dual(2, 2));
        let place = |at: f64| (1.0 + sign * at / view.camera.half_width) * size as f64 / 2.0;
        let [low, high] = [place(ends[0]).min(place(ends[1])), place(ends[0]).max(place(ends[1]))];
        let clamp = |at: f64| at.clamp(0.0, size as f64) as usize;
        [clamp((low - 1.0).floor()), clamp((high + 1.0).ceil())]
    };
    [range(0, 1.0), range(1, -1.0)]
}

#[cfg(test)]
mod tests {
    use seamwise_attr::Isosurface;

    use super::*;

    const RED: [[u8; 3]; 1] = [[200, 30, 30]];

    fn solid(center: DVec3, half: DVec3) -> Solid {
        let [x, y, z] = (half * half).recip().to_array();
        let mut quadric = PointQuadric { a: [x, 0.0, 0.0, y, 0.0, z], ..PointQuadric::default() };
        quadric = quadric.transformed(&DAffine3::from_translation(center)).unwrap();
        let Isosurface::Ellipsoid(ellipsoid) = quadric.isosurface(1.0) else { panic!("closed") };
        Solid { quadric, value: 1.0, ellipsoid, color: 0 }
    }

    #[test]
    fn an_ellipsoid_covers_the_pixels_of_its_outline_and_hides_what_lies_behind() {
        let camera = Camera::look_at(DVec3::Z * 5.0, DVec3::ZERO, 2.0 * 0.5f64.atan(), 0.1);
        let half = DVec3::new(1.5, 0.5, 1.0);
        let picture =
            draw_isosurfaces(&Scene::default(), &[solid(DVec3::ZERO, half)], &RED, &camera, 100);
        let red = |x: u32, y: u32| picture.get_pixel(x, y).0[0] > picture.get_pixel(x, y).0[1] + 30;
        // The tangent from 5 away to an ellipse of half axes a and 1 is at a / √(25 − 1), of 0.5 half a frame.
        let reach = |half: f64| half / 24f64.sqrt() / 0.5 * 50.0;
        for step in 0..50 {
            let inside = |half| f64::from(step) + 1.0 < reach(half);
            let outside = |half| f64::from(step) - 1.0 > reach(half);
            assert!(!inside(1.5) || red(50 + step, 50), "{step}");
            assert!(!outside(1.5) || !red(50 + step, 50), "{step}");
            assert!(!inside(0.5) || red(50, 50 - step), "{step}");
            assert!(!outside(0.5) || !red(50, 50 - step), "{step}");
        }
        let wall = Scene {
            positions: [[-9.0, -9.0], [9.0, -9.0], [0.0, 9.0]]
                .map(|[x, y]| Vec3::new(x, y, 0.9))
                .to_vec(),
            triangles: vec![[0, 1, 2]],
            triangle_materials: vec![0],
            materials: vec![super::super::scene::Material::default()],
            ..Scene::default()
        };
        let picture = draw_isosurfaces(&wall, &[solid(DVec3::ZERO, half)], &RED, &camera, 100);
        let red = |x: u32, y: u32| picture.get_pixel(x, y).0[0] > picture.get_pixel(x, y).0[1] + 30;
        assert!(red(50, 50), "its tip is before the wall");
        assert!(!red(70, 50), "and the rest behind it");
    }

    #[test]
    fn one_around_the_eye_is_seen_from_within_and_one_behind_it_is_not() {
        let camera = Camera::look_at(DVec3::Z * 5.0, DVec3::ZERO, 1.0, 0.1);
        let draw = |center, half| {
            let solids = [solid(center, half)];
            let own = draw_isosurfaces(&Scene::default(), &solids, &RED, &camera, 16);
            own.pixels().filter(|own| own.0[0] > own.0[1] + 20).count()
        };
        assert_eq!(draw(DVec3::Z * 5.0, DVec3::splat(2.0)), 256);
        assert_eq!(draw(DVec3::Z * 9.0, DVec3::splat(2.0)), 0);
    }
}
