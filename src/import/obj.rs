//! Wavefront OBJ.
//!
//! Each object or group, by its name, becomes a mesh, and its faces of one material and with the
//! same of normals and UVs a primitive. Colors behind the positions (`v x y z r g b`) are taken if
//! all have them. Where there are no normals, smoothing groups make them. Curves, points and lines are
//! left out with a warning.
//!
//! Crates that read OBJ were looked at: the one that is kept, tobj 4, panics on a `Kd` of one
//! number, names no line in its errors, and shifts all UVs behind a face that has none.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use rustc_hash::FxHashMap;

use super::builder::Document;
use super::colors::to_linear;
use super::find::Named;
use super::finite::{NO_NORMAL, NO_POSITION, NO_UV, finite_uv, unit};
use super::images::Pictures;
use super::libraries::{Libraries, folder_of, library_files};
use super::mtl::{self, Material};
use super::options::ReadOptions;
use super::part::Part;
use super::polygon::triangulate;
use super::smoothing::{Smoothing, group};
use super::text::{Line, decode, lines, shorten, words};
use super::uri::UriPolicy;
use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::warning::Warnings;

/// Lines of what is no surface.
const NO_SURFACE: [&str; 5] = ["p", "l", "curv", "curv2", "surf"];

/// A corner of a face: its position and, if it has them, its UV and normal, each from 0.
type Corner = (u32, Option<u32>, Option<u32>);

/// Reads an OBJ and its materials and pictures.
///
/// # Errors
/// [`Error::Invalid`] with the line, and the file if it is another; [`Error::Unsupported`] if a
/// picture is of a kind that this version lacks.
pub(super) fn read(bytes: &[u8], folder: &Path, options: ReadOptions) -> Result<Asset> {
    let text = join_lines(decode(bytes));
    let mut reader = Reader { smoothing: Smoothing::of(&text), ..Reader::default() };
    for line in lines(&text) {
        reader.take(line, options.uri_policy(folder))?;
    }
    reader.into_asset(folder, options)
}

/// The material files that an OBJ names, and the pictures that they name.
pub(super) fn named_files(bytes: &[u8], uri_policy: UriPolicy<'_>) -> Vec<PathBuf> {
    let text = join_lines(decode(bytes));
    let libraries = lines(&text).map(Line::split).filter(|(key, _)| *key == "mtllib");
    let path = |named: &Named| Some(named.find(uri_policy).ok()?.path);
    let libraries: BTreeSet<PathBuf> = libraries
        .flat_map(|(_, rest)| library_files(uri_policy, rest))
        .filter_map(|named| path(&named))
        .collect();
    let read = |file: &PathBuf| {
        let base = folder_of(file, uri_policy.folder);
        Some(mtl::parse(&std::fs::read(file).ok()?, "", &base, &mut Warnings::default()))
    };
    let materials: Vec<Material> = libraries.iter().filter_map(read).flatten().collect();
    let maps = materials.iter().flat_map(Material::maps).filter_map(|map| path(&map.named));
    libraries.iter().cloned().chain(maps).collect()
}

/// The text with lines that end in a backslash joined to the next. Numbers of lines stay.
fn join_lines(text: Cow<'_, str>) -> Cow<'_, str> {
    if !text.contains('\\') {
        return text;
    }
    let (mut joined, mut owed) = (String::with_capacity(text.len()), 0);
    for line in text.lines() {
        if let Some(begun) = line.strip_suffix('\\') {
            joined.push_str(begun);
            joined.push(' ');
            owed += 1;
        } else {
            joined.push_str(line);
            joined.extend(std::iter::repeat_n('\n', 1 + std::mem::take(&mut owed)));
        }
    }
    joined.into()
}

/// A primitive: an object's faces of one material, with or without UVs and normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    object: usize,
    /// The use of a material.
    material: Option<usize>,
    has_uvs: bool,
    has_normals: bool,
}

/// A primitive that grows.
#[derive(Debug)]
struct Faces {
    key: Key,
    triangles: Vec<u32>,
    /// The corner that each vertex was made from; `vertices` is the inverse.
    corners: Vec<Corner>,
    vertices: FxHashMap<Corner, u32>,
}

/// The content read so far.
#[derive(Debug, Default)]
struct Reader {
    positions: Vec<[f64; 3]>,
    colors: Vec<[f32; 4]>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    /// In place of `normals`, if there are none.
    smoothing: Option<Smoothing>,
    libraries: Libraries,
    material: Option<usize>,
    /// The names of the objects, and the number of each.
    objects: Vec<String>,
    object_numbers: FxHashMap<String, usize>,
    object: Option<usize>,
    parts: Vec<Faces>,
    part_numbers: FxHashMap<Key, usize>,
    warnings: Warnings,
}

impl Reader {
    fn take(&mut self, line: Line<'_>, uri_policy: UriPolicy<'_>) -> Result<()> {
        let (key, rest) = line.split();
        match key {
            "v" => self.take_position(line, rest)?,
            "vt" => {
                let v = words(rest).nth(1).map_or(Ok(0.0), |word| line.number(word))?;
                let uv = finite_uv([line.numbers::<1>(rest)?[0], 1.0 - v]);
                if uv.is_none() {
                    self.warnings.add(line.place(), NO_UV);
                }
                self.uvs.push(uv.unwrap_or_default());
            }
            "vn" => {
                let normal = unit(line.numbers(rest)?);
                if normal[0].is_nan() {
                    self.warnings.add(line.place(), NO_NORMAL);
                }
                self.normals.push(normal);
            }
            "f" => self.take_face(line, rest)?,
            "o" | "g" => self.object = Some(self.object(rest)),
            "s" => {
                if let Some(smoothing) = &mut self.smoothing {
                    smoothing.group = group(rest);
                }
            }
            "usemtl" => self.material = Some(self.libraries.use_of(line, rest)),
            "mtllib" => self.libraries.take(line, rest, uri_policy, &mut self.warnings)?,
            key if NO_SURFACE.contains(&key) => {
                let what = "points, lines and curves are left out; make faces of them";
                self.warnings.add(line.place(), what);
            }
            _ => {}
        }
        Ok(())
    }

    fn take_position(&mut self, line: Line<'_>, rest: &str) -> Result<()> {
        let position = line.position(rest)?;
        if !Part::is_placed(&position) {
            self.warnings.add(line.place(), NO_POSITION);
        }
        self.positions.push(position);
        if words(rest).count() >= 6 {
            let [.., r, g, b] = line.numbers::<6>(rest)?;
            self.colors.push([r as f32, g as f32, b as f32, -1.0]);
        }
        Ok(())
    }

    fn object(&mut self, name: &str) -> usize {
        *self.object_numbers.entry(name.to_owned()).or_insert_with(|| {
            self.objects.push(name.to_owned());
            self.objects.len() - 1
        })
    }

    fn take_face(&mut self, line: Line<'_>, rest: &str) -> Result<()> {
        let mut corners: Vec<Corner> =
            words(rest).map(|word| self.corner(line, word)).collect::<Result<_>>()?;
        let outline: Vec<[f64; 3]> =
            corners.iter().map(|&(position, ..)| self.positions[position as usize]).collect();
        if corners.len() < 3 {
            let what = "a face of fewer than three corners is left out; give it three";
            self.warnings.add(line.place(), what);
        }
        if corners.len() < 3 || !outline.iter().all(Part::is_placed) {
            return Ok(());
        }
        let triangles = triangulate(&outline);
        if let Some(smoothing) = &mut self.smoothing {
            smooth(smoothing, &mut corners, &outline, &triangles);
        }
        let object = match self.object {
            Some(object) => object,
            None => self.object("mesh"),
        };
        let part = self.part(Key {
            object,
            material: self.material,
            has_uvs: corners.iter().all(|(_, uv, _)| uv.is_some()),
            has_normals: corners.iter().all(|(.., normal)| normal.is_some()),
        });
        let vertices: Vec<u32> = corners.into_iter().map(|corner| part.vertex(corner)).collect();
        part.triangles.extend(triangles.into_iter().flatten().map(|corner| vertices[corner]));
        Ok(())
    }

    fn part(&mut self, key: Key) -> &mut Faces {
        let number = *self.part_numbers.entry(key).or_insert_with(|| {
            self.parts.push(Faces {
                key,
                triangles: Vec::new(),
                corners: Vec::new(),
                vertices: FxHashMap::default(),
            });
            self.parts.len() - 1
        });
        &mut self.parts[number]
    }

    /// Reads `v`, `v/vt`, `v//vn` or `v/vt/vn`; each counts from 1, or from the last back if it is
    /// negative. A UV or a normal that is not there is as if none was named.
    fn corner(&mut self, line: Line<'_>, word: &str) -> Result<Corner> {
        let mut parts = word.split('/');
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        let [position, uv, normal] = counts.map(|count| Index::read(line, parts.next(), count));
        let position = match position? {
            Index::There(position) if parts.next().is_none() => position,
            Index::Nowhere(number) => {
                let count = self.positions.len();
                let what = format!("{number} is not one of the {count} positions so far");
                return Err(line.error(what));
            }
            _ => return Err(line.error(format!("`{}` is no corner", shorten(word)))),
        };
        let mut there = |index: Index, what: &'static str| match index {
            Index::There(index) => Some(index),
            Index::None => None,
            Index::Nowhere(_) => {
                self.warnings.add(line.place(), what);
                None
            }
        };
        let uv = there(uv?, "a UV is named that is not there: its face has none; export it anew");
        let what = "a normal is named that is not there: its face has none; export it anew";
        Ok((position, uv, there(normal?, what)))
    }

    fn into_asset(mut self, folder: &Path, options: ReadOptions) -> Result<Asset> {
        self.parts.retain(|part| !part.triangles.is_empty());
        if self.parts.is_empty() {
            return Err(Error::Unsupported { what: "an OBJ without faces".into() });
        }
        let mut document = Document::new();
        self.finish_colors();
        if let Some(smoothing) = &self.smoothing {
            self.normals = smoothing.finish();
        }
        document.warnings = std::mem::take(&mut self.warnings);
        let mut pictures = Pictures::new(folder, options);
        let is_used = |number| self.parts.iter().any(|part| part.key.material == Some(number));
        let materials = self.libraries.add_to(&mut document, &mut pictures, is_used)?;
        let mut meshes = vec![Vec::new(); self.objects.len()];
        for faces in std::mem::take(&mut self.parts) {
            let Key { object, material, .. } = faces.key;
            let material = material.and_then(|number| materials[number]);
            meshes[object].push(self.to_part(faces, material));
        }
        for (name, parts) in self.objects.iter().zip(meshes).filter(|(_, parts)| !parts.is_empty())
        {
            document.add_mesh(name, parts);
        }
        Ok(document.into_asset())
    }

    fn finish_colors(&mut self) {
        let at = "the colors of the vertices";
        if !self.colors.is_empty() && self.colors.len() != self.positions.len() {
            self.colors.clear();
            let what = "some have one and some none: all are left out; give each vertex one";
            self.warnings.add(at, what);
        }
        if to_linear(&mut self.colors) {
            self.warnings.add(at, "they are taken to count to 255; write them from 0 to 1");
        }
    }

    fn to_part(&self, faces: Faces, material: Option<usize>) -> Part {
        let mut part = Part { triangles: faces.triangles, material, ..Part::default() };
        let lists = &mut part.vertices;
        for (position, uv, normal) in faces.corners {
            lists.positions.push(self.positions[position as usize]);
            lists.uvs.extend(uv.map(|uv| self.uvs[uv as usize]));
            lists.normals.extend(normal.map(|normal| self.normals[normal as usize]));
            lists.colors.extend(self.colors.get(position as usize));
        }
        part
    }
}

impl Faces {
    /// The vertex of a corner, a new one if no corner before it was the same.
    fn vertex(&mut self, (position, uv, normal): Corner) -> u32 {
        let uv = uv.filter(|_| self.key.has_uvs);
        let corner = (position, uv, normal.filter(|_| self.key.has_normals));
        *self.vertices.entry(corner).or_insert_with(|| {
            self.corners.push(corner);
            self.corners.len() as u32 - 1
        })
    }
}

/// Gives the corners of a face the normals of the smoothing group of now, if it is in one.
fn smooth(
    smoothing: &mut Smoothing,
    corners: &mut [Corner],
    outline: &[[f64; 3]],
    triangles: &[[usize; 3]],
) {
    let numbers: Option<Vec<u32>> =
        corners.iter().map(|&(position, ..)| smoothing.number(position)).collect();
    let Some(numbers) = numbers else { return };
    for &triangle in triangles {
        smoothing.add(triangle.map(|at| numbers[at]), triangle.map(|at| outline[at]));
    }
    for ((.., normal), number) in corners.iter_mut().zip(numbers) {
        *normal = Some(number);
    }
}

/// A corner's reference into a list: none, an index from 0, or a number out of range as written.
enum Index {
    None,
    There(u32),
    Nowhere(i64),
}

impl Index {
    /// Reads a number of one of `count`.
    fn read(line: Line<'_>, text: Option<&str>, count: usize) -> Result<Self> {
        let Some(text) = text.filter(|text| !text.is_empty()) else {
            return Ok(Self::None);
        };
        let number: i64 = line.parse(text)?;
        let from = if number < 0 { count as i64 } else { -1 };
        Ok(match u32::try_from(number.saturating_add(from)) {
            Ok(index) if (index as usize) < count => Self::There(index),
            _ => Self::Nowhere(number),
        })
    }
}
