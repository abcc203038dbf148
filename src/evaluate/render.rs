//! The renderer: a scene and a camera make an image, with the same bits on every run.
//!
//! Tile by tile the nearest triangle of each of the 2 × 2 samples of a pixel is found (`tiles`, `raster`,
//! `layer`), then each sample is shaded (`paint`, `patch`, `shade`, `coat`, `batch`, `light`) and held to
//! 0…1 as on a screen, and the box averages them. Opaque and masked triangles are drawn first; of the
//! blended ones the nearest is laid over them.
//!
//! Views are rendered in parallel and share nothing, so the thread count changes nothing. Not
//! guaranteed: the same bits on another machine, whose `log2` may round otherwise.

use rayon::prelude::*;

use super::camera::{Camera, Rig};
pub use super::frame::{BACKGROUND, Image};
use super::paint::Painter;
use super::raster::View;
use super::scene::{Mode, Scene};
use super::shade::Shader;
use super::tiles::{Tile, for_each_tile};

/// Renders every view of a rig, in its order.
pub fn render_views(scene: &Scene, rig: &Rig, mode: Mode) -> Vec<Image> {
    rig.cameras.par_iter().map(|camera| render(scene, camera, rig.resolution, mode)).collect()
}

/// Renders one view of `resolution` pixels each way.
///
/// Every scene gives an image: a triangle that names a vertex or material that is
/// not there, or has no area or a corner that is not finite, is not seen; attributes that are
/// missing are white (color) or zero; what is nearer than the camera's near plane is cut away.
pub fn render(scene: &Scene, camera: &Camera, resolution: usize, mode: Mode) -> Image {
    render_with(scene, camera, (resolution, mode), |_| ())
}

/// Renders one view, and shows each of its tiles to `look`.
pub(super) fn render_with(
    scene: &Scene,
    camera: &Camera,
    (resolution, mode): (usize, Mode),
    mut look: impl FnMut(&Tile<'_>),
) -> Image {
    let view = View::new(scene, camera, resolution);
    let shader = Shader::new(&view, mode);
    let mut image = Image {
        width: resolution,
        height: resolution,
        rgb: vec![[BACKGROUND; 3]; resolution * resolution],
        coverage: vec![0; resolution * resolution],
    };
    let mut painter = Painter::new(&shader);
    for_each_tile(&view, &shader, |tile| {
        look(tile);
        painter.paint(tile, &mut image);
    });
    image
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{Affine2, DVec3, Vec2, Vec3, Vec4};
    use proptest::prelude::*;
    use seamwise_texture::{ColorEncoding, Mips, Plane, Wrap};

    use super::super::luminance::Difference;
    use super::super::scene::{Alpha, Material, TextureRef};
    use super::*;

    /// Sees the square −1…1 of the plane z = 0, and all of it.
    fn camera() -> Camera {
        Camera::look_at(DVec3::Z * 2.0, DVec3::ZERO, 2.0 * 0.5f64.atan(), 0.1)
    }

    fn texture(mips: Mips) -> Option<TextureRef> {
        let transform = Affine2::IDENTITY;
        Some(TextureRef { mips: Arc::new(mips), wrap: [Wrap::Clamp; 2], uv_set: 0, transform })
    }

    /// A texture of one row of texels.
    fn bytes(texels: &[[u8; 4]], encoding: ColorEncoding) -> Option<TextureRef> {
        texture(Mips::from_rgba8(texels.len(), 1, texels.as_flattened(), encoding).unwrap())
    }

    /// Gray that grows by `slope` per texel from left to right, 64 texels wide.
    fn ramp(slope: f32) -> Option<TextureRef> {
        let data = (0..64 * 64).map(|texel| (texel % 64) as f32 * slope).collect();
        texture(Mips::from_plane(&Plane::from_vec(64, 64, 1, data)).unwrap())
    }

    fn material() -> Material {
        Material { metallic: 0.0, roughness: 0.7, ..Material::default() }
    }

    /// The square −1…1 as a grid of 2·n² triangles, pushed through `place`; the image upright on it.
    fn square(n: u32, material: Material, place: impl Fn(Vec2) -> Vec3) -> Scene {
        let mut scene = Scene { materials: vec![material], ..Scene::default() };
        for row in 0..=n {
            for column in 0..=n {
                let uv = Vec2::new(column as f32, row as f32) / n as f32;
                scene.uvs[0].push(uv);
                scene.positions.push(place(Vec2::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y)));
                scene.normals.push(Vec3::Z);
            }
        }
        for cell in 0..n * n {
            let a = cell / n * (n + 1) + cell % n;
            let (b, c, d) = (a + 1, a + n + 1, a + n + 2);
            scene.triangles.extend([[c, d, b], [c, b, a]]);
        }
        scene.uvs[1] = scene.uvs[0].clone();
        scene.tangents = vec![[Vec4::new(1.0, 0.0, 0.0, 1.0); 3]; scene.triangles.len()];
        scene.triangle_materials = vec![0; scene.triangles.len()];
        scene
    }

    fn flat(material: Material) -> Scene {
        square(1, material, |at| at.extend(0.0))
    }

    fn tilt(at: Vec2) -> Vec3 {
        Vec3::new(at.x * 3.0, at.y * 3.0, at.x * 1.5)
    }

    fn look(scene: &Scene, mode: Mode) -> Image {
        render(scene, &camera(), 32, mode)
    }

    #[test]
    fn nothing_is_background() {
        let image = look(&Scene::default(), Mode::Lit);
        assert!(image.rgb.iter().all(|pixel| *pixel == [BACKGROUND; 3]));
        assert!(image.coverage.iter().all(|mask| *mask == 0));
        assert_eq!(image.to_srgb8().get_pixel(3, 3).0, [128; 3]);
    }

    #[test]
    fn a_constant_texture_gives_exactly_its_color() {
        let base_color_texture = bytes(&[[200, 100, 50, 255]; 8], ColorEncoding::Srgb);
        let image = look(&flat(Material { base_color_texture, ..material() }), Mode::Unlit);
        let expected = [200, 100, 50].map(seamwise_texture::color::srgb8_to_linear);
        assert!(image.rgb.iter().all(|pixel| *pixel == expected));
        assert!(image.coverage.iter().all(|mask| *mask == 15));
        assert_eq!(image.to_srgb8().get_pixel(0, 31).0, [200, 100, 50]);
    }

    #[test]
    fn a_tilted_ramp_is_seen_in_perspective() {
        let scene = square(1, Material { base_color_texture: ramp(0.01), ..material() }, tilt);
        let image = look(&scene, Mode::Unlit);
        for (at, pixel) in image.rgb.iter().enumerate() {
            let expected = [0.25f32, 0.75].map(|offset| {
                // The ray (s, ·, −1)·t from (0, 0, 2) meets the plane z = x/2 where s·t = 4 − 2·t.
                let s = ((at % 32) as f32 + offset) / 32.0 - 0.5;
                let x = s * 2.0 / (1.0 + s / 2.0);
                ((x / 3.0 + 1.0) * 32.0 - 0.5) * 0.01
            });
            let expected = (expected[0] + expected[1]) / 2.0;
            assert!((pixel[0] - expected).abs() < 1e-5, "{at}: {} {expected}", pixel[0]);
        }
    }

    #[test]
    fn a_shift_of_half_a_texel_shows_as_half_the_slope() {
        let shifted = |texels: f32| {
            let mut base_color_texture = ramp(0.01);
            if let Some(texture) = &mut base_color_texture {
                texture.transform = Affine2::from_translation(Vec2::X * texels / 64.0);
            }
            let material = Material { base_color_texture, ..material() };
            look(&square(1, material, |at| (at * 2.0).extend(0.0)), Mode::Unlit)
        };
        let difference = Difference::between(&shifted(0.0), &shifted(0.5), &[]);
        assert!((difference.rms() - 0.005).abs() < 1e-6, "{}", difference.rms());
        assert_eq!((difference.rms(), difference.overlap()), (difference.rms_covered(), 1.0));
    }

    #[test]
    fn a_texture_reads_the_uv_set_it_names() {
        let mut base_color_texture = bytes(&[[0, 0, 0, 255], [255; 4]], ColorEncoding::Linear);
        base_color_texture.as_mut().unwrap().uv_set = 1;
        let mut scene = flat(Material { base_color_texture, ..material() });
        scene.uvs[1].fill(Vec2::ONE);
        assert!(look(&scene, Mode::Unlit).rgb.iter().all(|pixel| *pixel == [1.0; 3]));
    }

    #[test]
    fn the_image_does_not_depend_on_how_a_surface_is_cut() {
        let noise = |i: usize| (i as u32).wrapping_mul(2_654_435_761) >> 24;
        let data = (0..64 * 64).map(|i| noise(i) as f32 / 255.0).collect();
        let mips = Mips::from_plane(&Plane::from_vec(64, 64, 1, data)).unwrap();
        let textured = Material { base_color_texture: texture(mips), ..material() };
        let [coarse, fine] = [1, 40].map(|n| look(&square(n, textured.clone(), tilt), Mode::Lit));
        let difference = Difference::between(&coarse, &fine, &[]);
        assert!(difference.rms() < 1e-5, "{}", difference.rms());
        assert_eq!(difference.overlap(), 1.0);
    }

    #[test]
    fn a_flat_normal_map_is_no_normal_map() {
        let normal_texture = bytes(&[[128, 128, 255, 255]; 4], ColorEncoding::Linear);
        let with = look(&flat(Material { normal_texture, ..material() }), Mode::Lit);
        let without = look(&flat(material()), Mode::Lit);
        assert!(Difference::between(&with, &without, &[]).rms() < 0.002);
    }

    #[test]
    fn green_in_a_normal_map_leans_to_the_top_of_the_image() {
        // 0.6 up and 0.8 out, as 255·(1 + n)/2.
        let normal_texture = bytes(&[[128, 204, 230, 255]; 4], ColorEncoding::Linear);
        let mapped = look(&flat(Material { normal_texture, ..material() }), Mode::Lit);
        let mut leaning = flat(material());
        leaning.normals.fill(Vec3::new(0.0, 0.6, 0.8));
        assert!(Difference::between(&mapped, &look(&leaning, Mode::Lit), &[]).rms() < 0.002);
        leaning.normals.fill(Vec3::new(0.0, -0.6, 0.8));
        assert!(Difference::between(&mapped, &look(&leaning, Mode::Lit), &[]).rms() > 0.05);
    }

    #[test]
    fn a_mask_cuts_holes_and_blending_lets_through() {
        let half = bytes(&[[255, 255, 255, 0], [255; 4]], ColorEncoding::Srgb);
        let masked = |alpha| Material { base_color_texture: half.clone(), alpha, ..material() };
        let image = look(&flat(masked(Alpha::Mask(0.5))), Mode::Unlit);
        assert_eq!(image.coverage[..32], [[0; 16], [15; 16]].concat());
        let base_color = Vec4::new(1.0, 1.0, 1.0, 0.25);
        let glass = Material { base_color, alpha: Alpha::Blend, ..material() };
        let image = look(&flat(glass), Mode::Unlit);
        assert!((image.rgb[0][0] - (0.25 + 0.75 * BACKGROUND)).abs() < 1e-6);
        let opaque = look(&flat(Material { base_color, ..material() }), Mode::Unlit);
        assert_eq!(opaque.rgb[0], [1.0; 3]);
    }

    #[test]
    fn a_back_is_seen_only_of_the_double_sided_and_lit_like_a_front() {
        let back = |double_sided| {
            let mut scene = flat(Material { double_sided, ..material() });
            scene.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
            scene.normals.fill(Vec3::NEG_Z);
            look(&scene, Mode::Lit)
        };
        assert!(back(false).coverage.iter().all(|mask| *mask == 0));
        assert_eq!(back(true), look(&flat(material()), Mode::Lit));
    }

    #[test]
    fn the_thread_count_changes_no_bit() {
        let scene = square(9, Material { base_color_texture: ramp(0.01), ..material() }, tilt);
        let rig = Rig::around(&scene, 5, 24);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| render_views(&scene, &rig, Mode::Lit))
        };
        assert_eq!(with(1), with(2));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn whatever_the_numbers_the_image_is_of_numbers(
            numbers in prop::collection::vec(
                prop_oneof![8 => -2.0f32..2.0, 1 => any::<f32>(), 1 => Just(f32::NAN)], 64,
            ),
            alpha in prop_oneof![Just(Alpha::Opaque), Just(Alpha::Mask(0.3)), Just(Alpha::Blend)],
            bad in 0u32..6,
        ) {
            let map = bytes(&[[9, 200, 77, 200], [255, 0, 3, 90]], ColorEncoding::Linear);
            let mut scene = flat(Material {
                base_color_texture: map.clone(), metallic_roughness_texture: map.clone(),
                occlusion_texture: map.clone(), emissive_texture: map.clone(), normal_texture: map,
                emissive: Vec3::from_slice(&numbers[60..]), metallic: numbers[63],
                double_sided: true, alpha, ..material()
            });
            scene.positions[1] = Vec3::from_slice(&numbers[..3]);
            scene.normals = numbers[3..15].chunks(3).map(Vec3::from_slice).collect();
            scene.uvs[0] = numbers[15..23].chunks(2).map(Vec2::from_slice).collect();
            scene.colors = numbers[23..39].chunks(4).map(Vec4::from_slice).collect();
            scene.tangents[0] = [39, 43, 47].map(|at| Vec4::from_slice(&numbers[at..]));
            scene.triangles.push([0, bad, 2]);
            scene.triangle_materials.push(bad / 3);
            for mode in [Mode::Lit, Mode::Unlit] {
                let image = render(&scene, &camera(), 8, mode);
                prop_assert!(image.rgb.as_flattened().iter().all(|v| (0.0..=1.0).contains(v)));
            }
        }
    }
}
