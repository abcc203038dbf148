//! Solids with colors, as the meshes, materials and nodes of a glTF document.

use std::collections::BTreeMap;

use glam::{Quat, Vec2, Vec3, vec2};
use image::{Rgba, RgbaImage};
use serde_json::json;

use super::super::build::Build;
use super::super::output::Output;
use super::solid::Solid;

/// sRGB, as 0xrrggbb.
pub(crate) type Color = u32;

/// How colors get onto the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Finish {
    /// A material for each color.
    Plain,
    /// One material, whose texture is a map of colors; all UVs of a piece are one point of it.
    Palette,
    /// A material for each color, under a texture of stripes.
    Striped,
    /// A material for each color, seen from both sides.
    TwoSided,
    /// As this, cut out by a texture of a leaf.
    Leaf,
}

/// Where a mesh is shown: moved, turned about y in degrees, and scaled.
pub(crate) type Place = ([f32; 3], f32, f32);

/// A mesh, its pieces by color, and its places.
#[derive(Clone, Debug)]
struct Mesh {
    name: &'static str,
    pieces: Vec<(Color, Solid)>,
    places: Vec<Place>,
}

/// A model while it is put together.
#[derive(Clone, Debug)]
pub(crate) struct Prop {
    finish: Finish,
    meshes: Vec<Mesh>,
}

/// What the material of a palette is called; others are called by their color.
const PALETTE: &str = "palette";

/// Cells along each side of a palette, and texels along each side of a cell.
const CELLS: u32 = 4;
const CELL: u32 = 8;

impl Prop {
    pub(crate) fn new(finish: Finish) -> Self {
        Self { finish, meshes: Vec::new() }
    }

    /// A model of one mesh.
    pub(crate) fn single(finish: Finish, pieces: Vec<(Color, Solid)>) -> Self {
        Self::new(finish).mesh("prop", pieces)
    }

    /// The same with a mesh more, in one place.
    pub(crate) fn mesh(self, name: &'static str, pieces: Vec<(Color, Solid)>) -> Self {
        self.placed(name, vec![([0.0; 3], 0.0, 1.0)], pieces)
    }

    /// The same with a mesh more, in several places.
    pub(crate) fn placed(
        mut self,
        name: &'static str,
        places: Vec<Place>,
        pieces: Vec<(Color, Solid)>,
    ) -> Self {
        self.meshes.push(Mesh { name, pieces, places });
        self
    }

    /// As a document.
    pub(crate) fn build(&self) -> Build {
        let mut build = Build::new();
        let colors = self.colors();
        let materials = self.materials(&mut build, &colors);
        for (index, mesh) in self.meshes.iter().enumerate() {
            let primitives = self.primitives(mesh, &colors, &materials);
            let primitives = primitives.into_iter().map(|(material, solid)| {
                let mut primitive = build.primitive(&solid.shape());
                primitive["material"] = json!(material);
                primitive
            });
            let primitives: Vec<_> = primitives.collect();
            build.add("meshes", json!({"name": mesh.name, "primitives": primitives}));
            for &(at, degrees, scale) in &mesh.places {
                let turn = Quat::from_axis_angle(Vec3::Y, degrees.to_radians()).to_array();
                let node = build.add(
                    "nodes",
                    json!({
                        "name": mesh.name, "mesh": index, "translation": at, "rotation": turn,
                        "scale": [scale, scale, scale],
                    }),
                );
                let nodes = build.json["scenes"][0]["nodes"].as_array_mut().expect("a list");
                nodes.push(json!(node));
            }
        }
        build
    }

    /// Every color once, in the order of their use.
    fn colors(&self) -> Vec<Color> {
        let mut colors = Vec::new();
        for (color, _) in self.meshes.iter().flat_map(|mesh| &mesh.pieces) {
            if !colors.contains(color) {
                colors.push(*color);
            }
        }
        assert!(colors.len() <= (CELLS * CELLS) as usize, "a palette has sixteen colors");
        colors
    }

    /// The material of each color.
    fn materials(&self, build: &mut Build, colors: &[Color]) -> Vec<usize> {
        match self.finish {
            Finish::Palette => {
                let material = build.textured(&palette(colors));
                build.json["materials"][material]["name"] = json!(PALETTE);
                vec![material; colors.len()]
            }
            Finish::Plain => colors.iter().map(|&color| plain(build, color)).collect(),
            Finish::TwoSided => {
                let materials: Vec<_> = colors.iter().map(|&color| plain(build, color)).collect();
                for &material in &materials {
                    build.json["materials"][material]["doubleSided"] = json!(true);
                }
                materials
            }
            Finish::Striped => tinted(build, colors, &stripes()),
            Finish::Leaf => {
                let materials = tinted(build, colors, &leaf());
                for &material in &materials {
                    build.json["materials"][material]["doubleSided"] = json!(true);
                    build.json["materials"][material]["alphaMode"] = json!("MASK");
                }
                materials
            }
        }
    }

    /// The solids of a mesh by their material.
    fn primitives(
        &self,
        mesh: &Mesh,
        colors: &[Color],
        materials: &[usize],
    ) -> Vec<(usize, Solid)> {
        let mut primitives: Vec<(usize, Solid)> = Vec::new();
        for (color, solid) in &mesh.pieces {
            let index = colors.iter().position(|c| c == color).expect("a known color");
            let solid = match self.finish {
                Finish::Palette => solid.clone().uv_mapped(|_| cell_center(index)),
                _ => solid.clone(),
            };
            let material = materials[index];
            match primitives.iter_mut().find(|(known, _)| *known == material) {
                Some((_, known)) => *known = std::mem::take(known).with(solid),
                None => primitives.push((material, solid)),
            }
        }
        primitives
    }
}

/// The area of each color in the meshes of a prop or of a level of it.
pub(crate) fn color_areas(output: &Output) -> BTreeMap<String, f32> {
    let mut areas = BTreeMap::new();
    for part in (0..output.gltf.meshes().len()).flat_map(|mesh| output.parts(mesh)) {
        let material = output.gltf.materials().nth(part.material.expect("a material"));
        let name = material.as_ref().and_then(gltf::Material::name).expect("a name").to_owned();
        for triangle in &part.triangles {
            let [a, b, c] = triangle.map(|v| Vec3::from_array(part.positions[v as usize]));
            let mut color = name.clone();
            if name == PALETTE {
                let uv: Vec2 =
                    triangle.map(|v| Vec2::from_slice(&part.uvs[v as usize])).iter().sum();
                let cell = (uv / 3.0 * CELLS as f32).as_ivec2();
                color = format!("{name} {cell}");
            }
            *areas.entry(color).or_insert(0.0) += (b - a).cross(c - a).length() / 2.0;
        }
    }
    areas
}

fn channels(color: Color) -> [u8; 3] {
    let [_, red, green, blue] = color.to_be_bytes();
    [red, green, blue]
}

/// A color's linear light, with a gamma near enough to sRGB's.
fn linear(color: Color) -> [f32; 4] {
    let [r, g, b] = channels(color).map(|channel| (f32::from(channel) / 255.0).powf(2.2));
    [r, g, b, 1.0]
}

/// A rough material of a color.
fn plain(build: &mut Build, color: Color) -> usize {
    build.add(
        "materials",
        json!({"name": format!("{color:06x}"), "pbrMetallicRoughness": {
            "baseColorFactor": linear(color), "metallicFactor": 0.0, "roughnessFactor": 0.8,
        }}),
    )
}

/// Materials of these colors that share a picture.
fn tinted(build: &mut Build, colors: &[Color], picture: &RgbaImage) -> Vec<usize> {
    let first = build.textured(picture);
    let rest = colors[1..].iter().map(|_| {
        let material = build.json["materials"][first].clone();
        build.add("materials", material)
    });
    let materials: Vec<_> = std::iter::once(first).chain(rest.collect::<Vec<_>>()).collect();
    for (&material, &color) in materials.iter().zip(colors) {
        let material = &mut build.json["materials"][material];
        material["name"] = json!(format!("{color:06x}"));
        material["pbrMetallicRoughness"]["baseColorFactor"] = json!(linear(color));
    }
    materials
}

fn cell_center(index: usize) -> Vec2 {
    let cell = |at: u32| (at as f32 + 0.5) / CELLS as f32;
    vec2(cell(index as u32 % CELLS), cell(index as u32 / CELLS))
}

fn palette(colors: &[Color]) -> RgbaImage {
    RgbaImage::from_fn(CELLS * CELL, CELLS * CELL, |x, y| {
        let index = (y / CELL * CELLS + x / CELL) as usize;
        let [r, g, b] = channels(colors.get(index).copied().unwrap_or(0xffffff));
        Rgba([r, g, b, 255])
    })
}

fn stripes() -> RgbaImage {
    RgbaImage::from_fn(64, 64, |x, y| {
        let shade = 255 - 40 * u8::from((x + y / 4) / 8 % 2 == 0) - (y as u8 / 2);
        Rgba([shade, shade, shade, 255])
    })
}

fn leaf() -> RgbaImage {
    RgbaImage::from_fn(64, 64, |x, y| {
        let [u, v] = [x, y].map(|at| (at as f32 + 0.5) / 64.0);
        let width = 0.9 * (v * std::f32::consts::PI).sin();
        let alpha = if (2.0 * u - 1.0).abs() < width { 255 } else { 0 };
        let shade = 200 + if (u - 0.5).abs() < 0.04 { 55 } else { (20.0 * v) as u8 };
        Rgba([shade, shade, shade, alpha])
    })
}
