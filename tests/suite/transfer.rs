//! Textures made anew from the source's surface, from the outside: an asset in its own place keeps
//! its textures.

use crate::common::build::Build;
use crate::common::output::Output;
use crate::common::shapes::{self, Shape};
use crate::common::textured::{Pictures, bumps, covered_texels, share_alike};
use crate::common::{Baked, shared_assets, transferred};
use glam::{Vec2, Vec3};
use image::DynamicImage;
use seamwise::bake::Input;
use seamwise::bake::options::BakeOptions;
use seamwise::transfer::BakeNormals;
use seamwise_attr::{TangentInput, compute_tangents};
use serde_json::{Value, json};

/// Texels along each side of what the small assets use.
const SIZE: u32 = 96;

/// The level is the source: all its triangles, at the full size.
fn identity() -> BakeOptions {
    transferred(&[1.0], 1.0, BakeNormals::Auto)
}

/// An asset, and how its charts lie in its images.
struct Textured {
    build: Build,
    shape: Shape,
}

impl Textured {
    /// A torus, all of whose chart is read, in a material of noise.
    fn new(pictures: &Pictures, info: &Value) -> Self {
        let shape = shapes::torus(40, 20);
        let mut build = Build::new();
        let material = build.textured_material(pictures, &json!({}), info);
        build.add_shape(&shape, material);
        Self { build, shape }
    }

    fn attribute(&mut self, name: &str, accessor: usize) {
        self.build.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
    }

    fn assert_unchanged(&self, name: &str) {
        let baked = Baked::bytes(name, &self.build.glb(), &identity());
        assert_eq!(baked.report.levels[0].triangles, self.shape.triangles.len(), "{name}");
        assert_images_unchanged(name, &self.build.glb(), &baked.level(1), &self.shape);
    }
}

fn assert_images_unchanged(name: &str, before: &[u8], after: &Output, shape: &Shape) {
    let before = Output::from_bytes(before, name);
    for image in 0..before.gltf.images().len() {
        assert!(
            before.image_bytes(image) != after.image_bytes(image),
            "{name}: {image} was shared"
        );
        let [before, after] = [&before, after].map(|output| output.picture(image));
        let texels =
            covered_texels(&shape.uvs, &shape.triangles, [before.width(), before.height()]);
        let share = share_alike(&before, &after, texels.into_iter().map(|(texel, ..)| texel));
        assert!(share >= 0.999, "{name}: image {image} is alike in {:.4} %", 100.0 * share);
    }
}

/// What renderers make of a normal map on this shape.
fn mikk_tangents(shape: &Shape) -> Vec<[f32; 4]> {
    let vectors = |rows: &[[f32; 3]]| rows.iter().map(|&row| Vec3::from(row)).collect::<Vec<_>>();
    let tangents = compute_tangents(&TangentInput {
        positions: &vectors(&shape.positions),
        normals: &vectors(&shape.normals),
        uvs: &shape.uvs.iter().map(|&uv| Vec2::from(uv)).collect::<Vec<_>>(),
        triangles: &shape.triangles,
    })
    .expect("a sound shape");
    let mut of_vertex = vec![[0.0; 4]; shape.positions.len()];
    for (corners, tangents) in shape.triangles.iter().zip(tangents) {
        for (&vertex, tangent) in corners.iter().zip(tangents) {
            of_vertex[vertex as usize] = tangent.to_array();
        }
    }
    of_vertex
}

#[test]
fn an_asset_in_its_own_place_keeps_every_image() {
    let noise = Pictures::noise(SIZE);
    Textured::new(&noise, &json!({})).assert_unchanged("no tangents");

    let mut own = Textured::new(&noise, &json!({}));
    let tangents = own.build.floats(&mikk_tangents(&own.shape));
    own.attribute("TANGENT", tangents);
    own.assert_unchanged("tangents");

    Textured::new(&noise.clone().in_16_bits(), &json!({})).assert_unchanged("16 bits");

    let mut alpha = noise.clone();
    let mut seen = alpha.base.to_rgba8();
    seen.enumerate_pixels_mut()
        .for_each(|(x, y, texel)| texel.0[3] = ((x * 5 + y * 3) % 255) as u8 + 1);
    alpha.base = seen.into();
    let mut own = Textured::new(&alpha, &json!({}));
    own.build.json["materials"][0]["alphaMode"] = json!("BLEND");
    own.assert_unchanged("alpha");

    let images = [&noise.base, &noise.data].map(|image| image.to_luma8().into());
    let [base, data] = images;
    Textured::new(&Pictures { base, data, ..noise }, &json!({})).assert_unchanged("gray");
}

#[test]
fn an_asset_in_its_own_place_keeps_every_image_wherever_its_charts_lie() {
    let noise = Pictures::noise(SIZE);

    let mut second = Textured::new(&noise, &json!({"texCoord": 1}));
    let uvs = second.build.floats(&second.shape.uvs);
    let unlike: Vec<[f32; 2]> = second.shape.uvs.iter().map(|uv| [0.3 * uv[1], uv[0]]).collect();
    let unlike = second.build.floats(&unlike);
    second.attribute("TEXCOORD_0", unlike);
    second.attribute("TEXCOORD_1", uvs);
    second.assert_unchanged("the second set");

    let (offset, turn, scale) = ([0.3f32, 0.9], 0.4f32, [0.7f32, 0.6]);
    let transform = json!({"offset": offset, "rotation": turn, "scale": scale});
    let info = json!({"extensions": {"KHR_texture_transform": transform}});
    let mut turned = Textured::new(&noise, &info);
    turned.build.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
    for uv in &mut turned.shape.uvs {
        let ([u, v], (sin, cos)) = ([uv[0] * scale[0], uv[1] * scale[1]], turn.sin_cos());
        *uv = [cos * u + sin * v + offset[0], cos * v - sin * u + offset[1]];
    }
    turned.assert_unchanged("a transform");

    for by in [[0.5, 0.0], [0.37, -2.21], [-0.5, 3.4], [20.3, -31.0]] {
        let mut wrapped = Textured::new(&noise, &json!({}));
        wrapped.shape = wrapped.shape.uv_moved(by);
        let uvs = wrapped.build.floats(&wrapped.shape.uvs);
        wrapped.attribute("TEXCOORD_0", uvs);
        wrapped.assert_unchanged("a chart across the edge");
    }
}

#[test]
fn tangents_of_the_file_that_are_not_mikktspaces_are_obeyed() {
    let mut own =
        Textured::new(&Pictures { normal: bumps(SIZE, 0.3), ..Pictures::noise(SIZE) }, &json!({}));
    // Each a right angle on: what the map calls x is what MikkTSpace calls y.
    let turned: Vec<[f32; 4]> = mikk_tangents(&own.shape)
        .iter()
        .zip(&own.shape.normals)
        .map(|(&[x, y, z, w], &normal)| {
            let [x, y, z] = (Vec3::from(normal).cross(Vec3::new(x, y, z)) * w).to_array();
            [x, y, z, w]
        })
        .collect();
    let tangents = own.build.floats(&turned);
    own.attribute("TANGENT", tangents);
    let glb = own.build.glb();
    let baked = Baked::bytes("turned", &glb, &identity());
    let [before, after] =
        [Output::from_bytes(&glb, "turned").picture(1), baked.level(1).picture(1)]
            .map(|picture| picture.to_rgb8());
    for ([x, y], ..) in covered_texels(&own.shape.uvs, &own.shape.triangles, [SIZE; 2]) {
        let ([bx, by, _], [ax, ay, _]) = (before.get_pixel(x, y).0, after.get_pixel(x, y).0);
        // (x, y) along (T, B) is (−y, x) along (−B, T): the source's frame is (B, −T).
        assert!(
            ax.abs_diff(255 - by) <= 2 && ay.abs_diff(bx) <= 2,
            "{x} {y}: {bx} {by} → {ax} {ay}"
        );
    }
}

/// All parts of a document as one shape.
fn worn_by(output: &Output, image: usize) -> Shape {
    let mut shape = Shape::default();
    let uses = |material: &gltf::Material<'_>| {
        let pbr = material.pbr_metallic_roughness();
        let textures = [
            pbr.base_color_texture().map(|info| info.texture()),
            pbr.metallic_roughness_texture().map(|info| info.texture()),
            material.normal_texture().map(|info| info.texture()),
            material.occlusion_texture().map(|info| info.texture()),
        ];
        textures.into_iter().flatten().any(|texture| texture.source().index() == image)
    };
    let used: Vec<bool> = output.gltf.materials().map(|material| uses(&material)).collect();
    for part in (0..output.gltf.meshes().len()).flat_map(|mesh| output.parts(mesh)) {
        if part.material.is_some_and(|material| used[material]) {
            let first = shape.uvs.len() as u32;
            shape.uvs.extend(part.uvs.iter().map(|uv| [uv[0], uv[1]]));
            shape.triangles.extend(part.triangles.iter().map(|t| t.map(|vertex| first + vertex)));
        }
    }
    shape
}

fn is_normal(output: &Output, image: usize) -> bool {
    let maps = output.gltf.materials().filter_map(|m| m.normal_texture().map(|i| i.texture()));
    maps.into_iter().any(|texture| texture.source().index() == image)
}

/// A normal map with the same directions, of length 1: a transfer has those, whatever its source.
fn unit_vectors(map: &DynamicImage) -> DynamicImage {
    let mut map = map.to_rgb32f();
    for texel in map.pixels_mut() {
        let vector = Vec3::from(texel.0) * 2.0 - 1.0;
        texel.0 = (0.5 + 0.5 * vector.normalize_or(Vec3::Z)).to_array();
    }
    DynamicImage::from(map).to_rgb8().into()
}

#[test]
#[ignore = "long: real models; the gate runs it"]
fn real_assets_in_their_own_place_keep_every_image() {
    let Some(assets) = shared_assets() else {
        return;
    };
    for path in ["scan/popcorn.glb", "pbr/FlightHelmet/FlightHelmet.gltf"] {
        let path = assets.join(path);
        let baked = Baked::input(Input::File(&path), &identity()).unwrap();
        let (source, level) = (seamwise::import::read(&path).unwrap(), baked.level(1));
        for (image, encoded) in source.images.iter().enumerate() {
            let mut before = image::load_from_memory(&encoded.bytes).unwrap();
            let mut after = level.picture(image);
            if is_normal(&level, image) {
                [before, after] = [before, after].map(|map| unit_vectors(&map));
            }
            let shape = worn_by(&level, image);
            let size = [before.width(), before.height()];
            let texels = covered_texels(&shape.uvs, &shape.triangles, size);
            let texels = texels.into_iter().map(|(texel, ..)| texel);
            let share = share_alike(&before, &after, texels);
            // The helmet's own tangents are off from MikkTSpace by a degree or two in places, and its
            // levels are read by MikkTSpace.
            let least = if is_normal(&level, image) { 0.98 } else { 0.999 };
            assert!(share >= least, "{}: image {image}: {share}", path.display());
        }
    }
}

#[test]
fn nothing_that_filtering_reads_inside_the_charts_is_invalid() {
    let sphere = shapes::sphere(64, 32);
    let mut build = Build::new();
    let material = build.textured_material(
        &Pictures::noise(SIZE),
        &json!({"wrapS": 33071, "wrapT": 33071}),
        &json!({}),
    );
    build.add_shape(&sphere, material);
    let options = transferred(&[0.25, 0.05], 0.5, BakeNormals::On);
    let baked = Baked::bytes("sphere", &build.glb(), &options);
    for level in 1..=2 {
        let asset = seamwise::import::read(&baked.level_path(level)).unwrap();
        let found = seamwise::inspect::inspect(&asset, Default::default(), Default::default());
        for atlas in found.unwrap().atlases {
            assert!(!atlas.mips.is_empty() && atlas.mips.iter().all(|mip| mip.invalid_after == 0));
        }
    }
}

#[test]
fn levels_are_the_same_on_one_thread_and_on_three() {
    let mut build = Build::new();
    let texture = build.texture(&Pictures::noise(SIZE).base, json!({}));
    let material = build.painted(texture);
    build.add_shape(&shapes::torus(40, 20), material);
    let bytes = build.glb();
    let files = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = transferred(&[0.5, 0.1], 0.5, BakeNormals::On);
        let files = pool.install(|| Baked::bytes("torus", &bytes, &options).files());
        files.into_iter().filter(|(name, _)| !name.ends_with(".json")).collect::<Vec<_>>()
    });
    assert_eq!(files[0].len(), 3);
    assert!(files[0] == files[1]);
}
