//! Materials with a picture in every role, and the texels that charts cover.

use std::io::Cursor;

use image::{DynamicImage, ImageFormat, Rgb, Rgb32FImage};
use serde_json::{Value, json};

use super::Random;
use super::build::Build;
use super::shapes::Shape;

/// The pictures of a material.
#[derive(Clone, Debug)]
pub(crate) struct Pictures {
    pub(crate) base: DynamicImage,
    pub(crate) normal: DynamicImage,
    pub(crate) data: DynamicImage,
    pub(crate) emissive: DynamicImage,
}

impl Pictures {
    /// Texels that know nothing of their neighbors, so that no filter gives them back by chance.
    pub(crate) fn noise(size: u32) -> Self {
        let mut random = Random(u64::from(size));
        let mut unit = move || random.below(1 << 16) as f32 / 65535.0;
        let mut colors = || -> DynamicImage {
            let texels = Rgb32FImage::from_fn(size, size, |_, _| Rgb([unit(), unit(), unit()]));
            DynamicImage::from(texels).to_rgb8().into()
        };
        let [base, data, emissive] = std::array::from_fn(|_| colors());
        Self { base, normal: bumps(size, 0.6), data, emissive }
    }

    /// The same texels in 16 bits, with more than 8 bits can tell.
    pub(crate) fn in_16_bits(self) -> Self {
        let deep = |image: &DynamicImage| {
            let mut deep = image.to_rgb16();
            let fine = |(at, sample): (usize, &mut u16)| {
                *sample = sample.saturating_sub((at % 97) as u16);
            };
            deep.iter_mut().enumerate().for_each(fine);
            DynamicImage::from(deep)
        };
        let Self { base, normal, data, emissive } = self;
        let normal = normal.to_rgb16().into();
        Self { base: deep(&base), normal, data: deep(&data), emissive: deep(&emissive) }
    }

    pub(crate) fn all(&self) -> [&DynamicImage; 4] {
        [&self.base, &self.normal, &self.data, &self.emissive]
    }
}

/// A normal map of unit vectors that lean up to `most` to each side, each texel its own way.
pub(crate) fn bumps(size: u32, most: f32) -> DynamicImage {
    let mut random = Random(7);
    let mut lean = move || (random.below(2001) as f32 / 1000.0 - 1.0) * most;
    let texels = Rgb32FImage::from_fn(size, size, |_, _| {
        let (x, y) = (lean(), lean());
        let z = (1.0 - x * x - y * y).sqrt();
        Rgb([x, y, z].map(|value| 0.5 + 0.5 * value))
    });
    DynamicImage::from(texels).to_rgb8().into()
}

impl Build {
    /// A texture that shows a picture, as a PNG, read by `sampler`.
    pub(crate) fn texture(&mut self, picture: &DynamicImage, sampler: Value) -> usize {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Png).expect("a PNG is encoded");
        let view = self.view(&bytes.into_inner());
        let source = self.add("images", json!({"bufferView": view, "mimeType": "image/png"}));
        let sampler = self.add("samplers", sampler);
        self.add("textures", json!({"source": source, "sampler": sampler}))
    }

    /// A material that uses all pictures; `info` is what each texture info holds beside its index.
    pub(crate) fn textured_material(
        &mut self,
        pictures: &Pictures,
        sampler: &Value,
        info: &Value,
    ) -> usize {
        let infos = pictures.all().map(|picture| {
            let mut info = info.clone();
            info["index"] = json!(self.texture(picture, sampler.clone()));
            info
        });
        let [base, normal, data, emissive] = infos;
        self.add(
            "materials",
            json!({
                "pbrMetallicRoughness": {"baseColorTexture": base, "metallicRoughnessTexture": data},
                "normalTexture": normal, "occlusionTexture": data,
                "emissiveTexture": emissive, "emissiveFactor": [1.0, 1.0, 1.0],
            }),
        )
    }

    /// A material with a base color alone.
    pub(crate) fn painted(&mut self, texture: usize) -> usize {
        self.add(
            "materials",
            json!({"pbrMetallicRoughness": {
                "baseColorTexture": {"index": texture}, "metallicFactor": 0.0, "roughnessFactor": 0.5,
            }}),
        )
    }

    /// A mesh of one shape in one material.
    pub(crate) fn add_shape(&mut self, shape: &Shape, material: usize) -> usize {
        let mut primitive = self.primitive(shape);
        primitive["material"] = json!(material);
        self.mesh(vec![primitive])
    }
}

/// The texels of an image whose centers lie in triangles, well inside and not on an outline, the image
/// repeated without end; each with the triangle and the weights of its corners.
pub(crate) fn covered_texels(
    uvs: &[[f32; 2]],
    triangles: &[[u32; 3]],
    size: [u32; 2],
) -> Vec<([u32; 2], usize, [f64; 3])> {
    let mut found = Vec::new();
    for (index, triangle) in triangles.iter().enumerate() {
        let corners = triangle.map(|vertex| {
            [0, 1].map(|axis| f64::from(uvs[vertex as usize][axis]) * f64::from(size[axis]))
        });
        let [a, b, c] = corners;
        let cross = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
            (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        };
        let area = cross(a, b, c);
        let range = |axis: usize| {
            let low = corners.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
            let high = corners.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
            low.floor() as i64..high.ceil() as i64
        };
        for (x, y) in range(0).flat_map(|x| range(1).map(move |y| (x, y))) {
            let p = [x as f64 + 0.5, y as f64 + 0.5];
            let weights = [cross(p, b, c), cross(a, p, c), cross(a, b, p)].map(|w| w / area);
            if weights.iter().all(|&w| w > 1e-9) {
                let texel = [(x, size[0]), (y, size[1])]
                    .map(|(at, side)| at.rem_euclid(i64::from(side)) as u32);
                found.push((texel, index, weights));
            }
        }
    }
    found
}

/// The share of these texels of which no channel differs by more than 1/255.
pub(crate) fn share_alike(
    before: &DynamicImage,
    after: &DynamicImage,
    texels: impl Iterator<Item = [u32; 2]>,
) -> f64 {
    assert_eq!((before.color(), before.width()), (after.color(), after.width()));
    let [before, after] = [before, after].map(DynamicImage::to_rgba32f);
    let (mut alike, mut all) = (0, 0);
    for [x, y] in texels {
        let pairs = before.get_pixel(x, y).0.into_iter().zip(after.get_pixel(x, y).0);
        alike += usize::from(pairs.into_iter().all(|(a, b)| (a - b).abs() <= 1.0 / 255.0 + 1e-6));
        all += 1;
    }
    assert!(all > 0, "no texel is covered");
    f64::from(alike as u32) / f64::from(all)
}
