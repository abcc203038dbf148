//! Materials of an OBJ: MTL files to glTF materials.
//!
//! A material of diffuse color `Kd` becomes one of that base color, no metal, as rough as its
//! exponent `Ns` says: a Blinn-Phong lobe of exponent n is as wide as a Beckmann lobe of
//! α = √(2 / (n + 2)) (Walter, Marschner, Li & Torrance, "Microfacet models for refraction through
//! rough surfaces", EGSR 2007), and glTF's roughness is √α. `Pr` and `Pm` say both outright. Where
//! there is a `map_Kd` it is the color alone, as most exporters mean it: what they write as `Kd`
//! beside it is a default. Factors are taken for
//! linear, as glTF's are. `map_Bump` is a normal map if it is colored; a map of heights, which glTF
//! has no place for, is left out. So are `Ks`, `Ka`, `map_d` and whatever else is no part of that.

use std::path::Path;

use serde_json::{Value, json};

use super::builder::Document;
use super::images::Pictures;
use super::text::{Line, decode, lines, words};
use crate::error::Result;

/// A picture as a material uses it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    pub(super) file: String,
    /// Where it is named.
    at: String,
    offset: [f32; 2],
    scale: [f32; 2],
    strength: f32,
    clamp: bool,
}

/// A material as the file has it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Material {
    pub(super) name: String,
    color: [f32; 3],
    opacity: f32,
    exponent: Option<f32>,
    roughness: Option<f32>,
    metal: f32,
    emission: [f32; 3],
    color_map: Option<Map>,
    emission_map: Option<Map>,
    normal_map: Option<Map>,
    bump_map: Option<Map>,
}

impl Material {
    fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            color: [0.8; 3],
            opacity: 1.0,
            exponent: None,
            roughness: None,
            metal: 0.0,
            emission: [0.0; 3],
            color_map: None,
            emission_map: None,
            normal_map: None,
            bump_map: None,
        }
    }

    /// The pictures that it names.
    pub(super) fn maps(&self) -> impl Iterator<Item = &Map> {
        let maps = [&self.color_map, &self.emission_map, &self.normal_map, &self.bump_map];
        maps.into_iter().flatten()
    }

    /// Takes one line of the file.
    fn set(&mut self, line: Line<'_>, file: &str) -> Result<()> {
        let (key, rest) = line.split();
        let number = || line.floats::<1>(rest).map(|[number]| number);
        let map = || Map::parse(line, rest, file).map(Some);
        match key.to_ascii_lowercase().as_str() {
            "kd" => self.color = color(line, rest)?,
            "ke" => self.emission = color(line, rest)?,
            "d" => self.opacity = number()?.clamp(0.0, 1.0),
            "tr" => self.opacity = 1.0 - number()?.clamp(0.0, 1.0),
            "ns" => self.exponent = Some(number()?.max(0.0)),
            "pr" => self.roughness = Some(number()?.clamp(0.0, 1.0)),
            "pm" => self.metal = number()?.clamp(0.0, 1.0),
            "map_kd" => self.color_map = map()?,
            "map_ke" => self.emission_map = map()?,
            "norm" | "map_kn" => self.normal_map = map()?,
            "map_bump" | "bump" => self.bump_map = map()?,
            _ => {}
        }
        Ok(())
    }

    fn roughness(&self) -> f32 {
        let of_exponent = |exponent: f32| (2.0 / (exponent + 2.0)).sqrt().sqrt();
        self.roughness.or(self.exponent.map(of_exponent)).unwrap_or(1.0)
    }

    /// The glTF material, put into a document.
    ///
    /// # Errors
    /// As [`Pictures::texture`].
    pub(super) fn add_to(
        &self,
        document: &mut Document,
        pictures: &mut Pictures<'_>,
    ) -> Result<usize> {
        let color = if self.color_map.is_some() { [1.0; 3] } else { self.color };
        let mut json = json!({"name": self.name, "pbrMetallicRoughness": {
            "baseColorFactor": [color[0], color[1], color[2], self.opacity],
            "metallicFactor": self.metal,
            "roughnessFactor": self.roughness(),
        }});
        if self.opacity < 1.0 {
            json["alphaMode"] = json!("BLEND");
        }
        if let Some(map) = &self.color_map {
            json["pbrMetallicRoughness"]["baseColorTexture"] = map.texture(document, pictures)?;
        }
        if let Some(map) = &self.emission_map {
            json["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
            json["emissiveTexture"] = map.texture(document, pictures)?;
        } else if self.emission != [0.0; 3] {
            json["emissiveFactor"] = json!(self.emission);
        }
        let bump = || self.bump_map.as_ref().filter(|map| !pictures.is_gray(&map.file));
        if let Some(map) = self.normal_map.as_ref().or_else(bump) {
            json["normalTexture"] = map.texture(document, pictures)?;
            json["normalTexture"]["scale"] = json!(map.strength);
        }
        Ok(document.add("materials", json))
    }
}

impl Map {
    /// Reads options and a file's name, which may hold spaces.
    fn parse(line: Line<'_>, rest: &str, file: &str) -> Result<Self> {
        let at = format!("{file}, line {}", line.number);
        let mut map = Self {
            file: String::new(),
            at,
            offset: [0.0; 2],
            scale: [1.0; 2],
            strength: 1.0,
            clamp: false,
        };
        let mut rest = rest;
        while let Some((option, after)) = rest.split_once(char::is_whitespace)
            && option.starts_with('-')
        {
            let (most, is_number) = match option {
                "-o" | "-s" | "-t" => (3, true),
                "-mm" => (2, true),
                _ => (1, false),
            };
            let (values, after) = take_values(after, most, is_number);
            map.set(line, option, &values)?;
            rest = after;
        }
        if rest.is_empty() {
            return Err(line.error("a map without a file"));
        }
        map.file = rest.to_owned();
        Ok(map)
    }

    fn set(&mut self, line: Line<'_>, option: &str, values: &[&str]) -> Result<()> {
        let target = match option {
            "-o" => &mut self.offset,
            "-s" => &mut self.scale,
            "-bm" => {
                self.strength = line.floats::<1>(&values.join(" "))?[0];
                return Ok(());
            }
            "-clamp" => {
                self.clamp = values == ["on"];
                return Ok(());
            }
            _ => return Ok(()),
        };
        for (slot, value) in target.iter_mut().zip(values) {
            *slot = line.parse(value)?;
        }
        Ok(())
    }

    /// The texture info of a glTF material. A point at (u, v), v upward, is read at
    /// (s u + o); turned downward, v' = 1 − s (1 − v) − o.
    fn texture(&self, document: &mut Document, pictures: &mut Pictures<'_>) -> Result<Value> {
        let index = pictures.texture(document, &self.file, self.clamp, &self.at)?;
        let mut info = json!({"index": index});
        if (self.offset, self.scale) != ([0.0; 2], [1.0; 2]) {
            let [u, v] = self.offset;
            let offset = [u, 1.0 - self.scale[1] - v];
            info["extensions"] =
                json!({"KHR_texture_transform": {"offset": offset, "scale": self.scale}});
            document.use_extension("KHR_texture_transform", false);
        }
        Ok(info)
    }
}

/// The values of an option, at most so many, and what follows them. Numbers end where a word is
/// none.
fn take_values(mut rest: &str, most: usize, numbers: bool) -> (Vec<&str>, &str) {
    let mut values = Vec::new();
    while values.len() < most
        && let Some((word, after)) = rest.trim_start().split_once(char::is_whitespace)
        && (!numbers || word.parse::<f32>().is_ok())
    {
        values.push(word);
        rest = after;
    }
    (values, rest.trim_start())
}

/// A color of three numbers, or of one for all three.
fn color(line: Line<'_>, rest: &str) -> Result<[f32; 3]> {
    if words(rest).nth(1).is_none() {
        return Ok([line.floats::<1>(rest)?[0].clamp(0.0, 1.0); 3]);
    }
    Ok(line.floats::<3>(rest)?.map(|x| x.clamp(0.0, 1.0)))
}

/// Reads the materials of an MTL file; `file` is what it is called in messages.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) with the file and the line.
pub(super) fn parse(bytes: &[u8], file: &str) -> Result<Vec<Material>> {
    let mut materials: Vec<Material> = Vec::new();
    for line in lines(&decode(bytes)) {
        let (key, rest) = line.split();
        if key == "newmtl" {
            materials.push(Material::new(rest));
        } else if let Some(material) = materials.last_mut() {
            material.set(line, file).map_err(|error| error.in_file(Path::new(file)))?;
        }
    }
    Ok(materials)
}
