//! Wavefront OBJ.
//!
//! Each object or group, by its name, becomes a mesh, and its faces of one material and with the
//! same of normals and UVs a primitive. Colors behind the positions (`v x y z r g b`) are taken if
//! all have them. Curves, points, lines and smoothing groups are passed over.
//!
//! Crates that read OBJ were looked at: the one that is kept, tobj 4, panics on a `Kd` of one
//! number, names no line in its errors, and shifts all UVs behind a face that has none.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use rustc_hash::{FxHashMap, FxHashSet};
use seamwise_texture::color::srgb_to_linear;

use super::builder::{Document, Part};
use super::images::{Pictures, find};
use super::mtl::{self, Material};
use super::options::ReadOptions;
use super::polygon::triangulate;
use super::text::{Line, decode, lines, shorten, words};
use super::uri::UriPolicy;
use crate::document::asset::Asset;
use crate::error::{Error, Result};

/// Names by which exporters say that faces have no material.
const NO_MATERIAL: [&str; 4] = ["", "(null)", "default", "none"];

/// A corner of a face: its position and, if it has them, its UV and normal, each from 0.
type Corner = (u32, Option<u32>, Option<u32>);

/// Reads an OBJ and its materials and pictures.
///
/// # Errors
/// [`Error::Invalid`] with the line, and the file if it is another; [`Error::Unsupported`] if a
/// picture is of a kind that this version lacks.
pub(super) fn read(bytes: &[u8], folder: &Path, options: ReadOptions) -> Result<Asset> {
    let text = join_lines(decode(bytes));
    let mut reader = Reader::default();
    for line in lines(&text) {
        reader.take(line, folder, options)?;
    }
    reader.into_asset(folder, options)
}

/// The material files that an OBJ names, and the pictures that they name.
pub(super) fn named_files(bytes: &[u8], uri_policy: UriPolicy<'_>) -> Vec<PathBuf> {
    let text = join_lines(decode(bytes));
    let libraries = lines(&text).map(Line::split).filter(|(key, _)| *key == "mtllib");
    let libraries: BTreeSet<PathBuf> = libraries
        .flat_map(|(_, rest)| library_files(uri_policy, rest))
        .filter_map(|(_, path)| path.ok())
        .collect();
    let read = |path: &PathBuf| mtl::parse(&std::fs::read(path).ok()?, "").ok();
    let materials: Vec<Material> = libraries.iter().filter_map(read).flatten().collect();
    let maps = materials
        .iter()
        .flat_map(Material::maps)
        .filter_map(|map| find(uri_policy, &map.file).ok());
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

/// A file's name, and where it is if it may be read.
type Named = (String, std::result::Result<PathBuf, String>);

/// The files of a `mtllib` line: one whose name may hold spaces, or several.
fn library_files(uri_policy: UriPolicy<'_>, rest: &str) -> Vec<Named> {
    let file = |name: &str| (name.to_owned(), find(uri_policy, name));
    let whole = file(rest);
    let is_there = whole.1.as_ref().is_ok_and(|path| path.is_file());
    if is_there { vec![whole] } else { rest.split_whitespace().map(file).collect() }
}

/// A primitive: an object's faces of one material, with or without UVs and normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    object: usize,
    material: Option<usize>,
    has_uvs: bool,
    has_normals: bool,
}

/// What was read so far.
#[derive(Debug, Default)]
struct Reader {
    positions: Vec<[f32; 3]>,
    colors: Vec<[f32; 4]>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    materials: Vec<Material>,
    /// The number of each by its name; the last of a name counts.
    material_numbers: FxHashMap<String, usize>,
    libraries: FxHashSet<PathBuf>,
    material: Option<usize>,
    /// The names of the objects, and the number of each.
    objects: Vec<String>,
    object_numbers: FxHashMap<String, usize>,
    object: Option<usize>,
    parts: Vec<(Key, Part, FxHashMap<Corner, u32>)>,
    part_numbers: FxHashMap<Key, usize>,
}

impl Reader {
    fn take(&mut self, line: Line<'_>, folder: &Path, options: ReadOptions) -> Result<()> {
        let (key, rest) = line.split();
        match key {
            "v" => {
                self.positions.push(line.floats(rest)?);
                if words(rest).count() >= 6 {
                    let [_, _, _, r, g, b] = line.floats(rest)?;
                    let [r, g, b] = [r, g, b].map(|x: f32| srgb_to_linear(x.clamp(0.0, 1.0)));
                    self.colors.push([r, g, b, 1.0]);
                }
            }
            "vt" => {
                let v = words(rest).nth(1).map_or(Ok(0.0), |word| line.parse(word))?;
                self.uvs.push([line.floats::<1>(rest)?[0], 1.0 - v]);
            }
            "vn" => self.normals.push(line.floats(rest)?),
            "f" => self.take_face(line, rest)?,
            "o" | "g" => self.object = Some(self.object(rest)),
            "usemtl" => self.material = self.material_number(line, rest)?,
            "mtllib" => self.take_library(line, rest, folder, options)?,
            _ => {}
        }
        Ok(())
    }

    fn object(&mut self, name: &str) -> usize {
        *self.object_numbers.entry(name.to_owned()).or_insert_with(|| {
            self.objects.push(name.to_owned());
            self.objects.len() - 1
        })
    }

    /// The material of a name; none where that says so, or where no material file is named or it
    /// was let go missing.
    fn material_number(&self, line: Line<'_>, name: &str) -> Result<Option<usize>> {
        let found = self.material_numbers.get(name).copied();
        let is_none = NO_MATERIAL.iter().any(|none| none.eq_ignore_ascii_case(name));
        if found.is_none() && !self.materials.is_empty() && !is_none {
            let what = format!("there is no material `{}`", shorten(name));
            return Err(line.error(what));
        }
        Ok(found)
    }

    fn take_library(
        &mut self,
        line: Line<'_>,
        rest: &str,
        folder: &Path,
        options: ReadOptions,
    ) -> Result<()> {
        for (name, path) in library_files(options.uri_policy(folder), rest) {
            let path = path.map_err(|what| line.error(what))?;
            if !self.libraries.insert(path.clone()) {
                continue;
            }
            match std::fs::read(&path) {
                Ok(bytes) => {
                    for material in mtl::parse(&bytes, &name)? {
                        let number = self.materials.len();
                        self.material_numbers.insert(material.name.clone(), number);
                        self.materials.push(material);
                    }
                }
                Err(error) if options.allow_missing && error.kind() == ErrorKind::NotFound => {}
                Err(error) => return Err(line.error(format!("{name} can't be read: {error}"))),
            }
        }
        Ok(())
    }

    fn take_face(&mut self, line: Line<'_>, rest: &str) -> Result<()> {
        let corners: Vec<Corner> =
            words(rest).map(|word| self.corner(line, word)).collect::<Result<_>>()?;
        let object = match self.object {
            Some(object) => object,
            None => self.object("mesh"),
        };
        let key = Key {
            object,
            material: self.material,
            has_uvs: corners.iter().all(|(_, uv, _)| uv.is_some()),
            has_normals: corners.iter().all(|(_, _, normal)| normal.is_some()),
        };
        let part = *self.part_numbers.entry(key).or_insert_with(|| {
            let part = Part { material: key.material, ..Part::default() };
            self.parts.push((key, part, FxHashMap::default()));
            self.parts.len() - 1
        });
        let outline: Vec<[f32; 3]> =
            corners.iter().map(|&(position, ..)| self.positions[position as usize]).collect();
        let vertices: Vec<u32> =
            corners.into_iter().map(|corner| self.vertex(part, corner)).collect();
        let triangles = triangulate(&outline).into_iter().flatten();
        self.parts[part].1.triangles.extend(triangles.map(|corner| vertices[corner]));
        Ok(())
    }

    /// Reads `v`, `v/vt`, `v//vn` or `v/vt/vn`; each counts from 1, or from the last back if it is
    /// negative.
    fn corner(&self, line: Line<'_>, word: &str) -> Result<Corner> {
        let index = |text: Option<&str>, what: &str, count: usize| -> Result<Option<u32>> {
            let Some(text) = text.filter(|text| !text.is_empty()) else {
                return Ok(None);
            };
            let number: i64 = line.parse(text)?;
            let from = if number < 0 { count as i64 } else { -1 };
            match u32::try_from(number.saturating_add(from)) {
                Ok(index) if (index as usize) < count => Ok(Some(index)),
                _ => Err(line.error(format!("{number} is not one of the {count} {what} so far"))),
            }
        };
        let mut parts = word.split('/');
        let position = index(parts.next(), "positions", self.positions.len())?;
        let uv = index(parts.next(), "UVs", self.uvs.len())?;
        let normal = index(parts.next(), "normals", self.normals.len())?;
        match position {
            Some(position) if parts.next().is_none() => Ok((position, uv, normal)),
            _ => Err(line.error(format!("`{}` is no corner", shorten(word)))),
        }
    }

    /// The vertex of a corner in a part, a new one if no corner before it was the same.
    fn vertex(&mut self, part: usize, corner: Corner) -> u32 {
        let (key, part, vertices) = &mut self.parts[part];
        let (position, uv, normal) = corner;
        let uv = uv.filter(|_| key.has_uvs);
        let normal = normal.filter(|_| key.has_normals);
        let lists = &mut part.vertices;
        *vertices.entry((position, uv, normal)).or_insert_with(|| {
            lists.positions.push(self.positions[position as usize]);
            lists.uvs.extend(uv.map(|uv| self.uvs[uv as usize]));
            lists.normals.extend(normal.map(|normal| self.normals[normal as usize]));
            if let Some(color) = self.colors.get(position as usize) {
                lists.colors.push(*color);
            }
            lists.positions.len() as u32 - 1
        })
    }

    fn into_asset(mut self, folder: &Path, options: ReadOptions) -> Result<Asset> {
        self.parts.retain(|(_, part, _)| !part.triangles.is_empty());
        if self.parts.is_empty() {
            return Err(Error::Unsupported { what: "an OBJ without faces".into() });
        }
        let mut document = Document::new();
        let mut pictures = Pictures::new(folder, options);
        let mut materials = FxHashMap::default();
        let has_colors = self.colors.len() == self.positions.len();
        for (key, part, _) in &mut self.parts {
            if let Some(number) = key.material {
                let material = match materials.get(&number) {
                    Some(material) => *material,
                    None => self.materials[number].add_to(&mut document, &mut pictures)?,
                };
                materials.insert(number, material);
                part.material = Some(material);
            }
            if !has_colors {
                part.vertices.colors.clear();
            }
        }
        let mut meshes = vec![Vec::new(); self.objects.len()];
        for (key, part, _) in self.parts {
            meshes[key.object].push(part);
        }
        for (name, parts) in self.objects.iter().zip(&meshes).filter(|(_, parts)| !parts.is_empty())
        {
            document.add_mesh(name, parts);
        }
        Ok(document.into_asset())
    }
}
