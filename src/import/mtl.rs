//! Materials of an OBJ: MTL files to glTF materials.
//!
//! A material of diffuse color `Kd` becomes one of that base color, no metal, as rough as its
//! exponent `Ns` says: a Blinn-Phong lobe of exponent n is as wide as a Beckmann lobe of
//! α = √(2 / (n + 2)) (Walter, Marschner, Li & Torrance, "Microfacet models for refraction through
//! rough surfaces", EGSR 2007), and glTF's roughness is √α. `Pr` and `Pm` say both outright. Where
//! there is a `map_Kd` it is the color alone, as most exporters mean it: what they write as `Kd`
//! beside it is a default. Factors are taken for linear, as glTF's are. `map_Bump` is a normal map if
//! it is colored; a map of heights, which glTF has no place for, is left out with a warning, and so is
//! any other map. `map_d` becomes the alpha of the base color. `Ks` and `Ka` are no part of that.
//!
//! `d` is the opacity. `Tr` is its opposite, but some old exporters mean the same by both: a file
//! whose materials without `d` would all be transparent, and one of them not to be seen at all, is
//! theirs.

use std::path::Path;

use serde_json::{Value, json};

use super::builder::Document;
use super::find::{Named, unquote};
use super::images::Pictures;
use super::text::{Line, decode, lines, shorten, words};
use crate::error::{Error, Result};
use crate::warning::Warnings;

/// Maps that have no place in what becomes of a material.
const NO_PLACE: [&str; 12] = [
    "map_ks", "map_ns", "map_pr", "map_pm", "map_ps", "map_refl", "map_tr", "map_disp", "disp",
    "decal", "refl", "aniso",
];

/// A picture as a material uses it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    pub(super) named: Named,
    offset: [f32; 2],
    scale: [f32; 2],
    strength: f32,
    pub(super) clamp: bool,
}

/// A material as the file has it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Material {
    pub(super) name: String,
    color: [f32; 3],
    /// `d`.
    opacity: Option<f32>,
    /// `Tr`, and where it is.
    transparency: Option<(f32, String)>,
    exponent: Option<f32>,
    roughness: Option<f32>,
    metal: f32,
    emission: [f32; 3],
    color_map: Option<Map>,
    emission_map: Option<Map>,
    normal_map: Option<Map>,
    bump_map: Option<Map>,
    alpha_map: Option<Map>,
}

impl Material {
    fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            color: [0.8; 3],
            opacity: None,
            transparency: None,
            exponent: None,
            roughness: None,
            metal: 0.0,
            emission: [0.0; 3],
            color_map: None,
            emission_map: None,
            normal_map: None,
            bump_map: None,
            alpha_map: None,
        }
    }

    /// The pictures that it names.
    pub(super) fn maps(&self) -> impl Iterator<Item = &Map> {
        let maps = [
            &self.color_map,
            &self.emission_map,
            &self.normal_map,
            &self.bump_map,
            &self.alpha_map,
        ];
        maps.into_iter().flatten()
    }

    /// Takes one line of the file.
    fn set(&mut self, line: Line<'_>, file: &File<'_>) -> Result<()> {
        let (key, rest) = line.split();
        let number = || line.floats::<1>(rest).map(|[number]| number);
        let map = || Map::parse(line, rest, file).map(Some);
        match key.to_ascii_lowercase().as_str() {
            "kd" => self.color = color(line, rest)?,
            "ke" => self.emission = color(line, rest)?,
            "d" => {
                let rest = rest.strip_prefix("-halo").unwrap_or(rest);
                self.opacity = Some(line.floats::<1>(rest)?[0].clamp(0.0, 1.0));
            }
            "tr" => self.transparency = Some((number()?.clamp(0.0, 1.0), file.place(line))),
            "ns" => self.exponent = Some(number()?.max(0.0)),
            "pr" => self.roughness = Some(number()?.clamp(0.0, 1.0)),
            "pm" => self.metal = number()?.clamp(0.0, 1.0),
            "map_kd" => self.color_map = map()?,
            "map_ke" => self.emission_map = map()?,
            "norm" | "map_kn" => self.normal_map = map()?,
            "map_bump" | "bump" => self.bump_map = map()?,
            "map_d" | "map_opacity" => self.alpha_map = map()?,
            _ => {}
        }
        Ok(())
    }

    /// The opacity, where `Tr` is it instead of its opposite if `is_opacity`.
    fn resolve_opacity(&mut self, is_opacity: bool) {
        let transparency =
            self.transparency.as_ref().map_or(0.0, |(transparency, _)| *transparency);
        let opacity = if is_opacity { transparency } else { 1.0 - transparency };
        self.opacity.get_or_insert(opacity);
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
        let opacity = self.opacity.unwrap_or(1.0);
        let mut json = json!({"name": self.name, "pbrMetallicRoughness": {
            "baseColorFactor": [color[0], color[1], color[2], opacity],
            "metallicFactor": self.metal,
            "roughnessFactor": self.roughness(),
        }});
        if opacity < 1.0 {
            json["alphaMode"] = json!("BLEND");
        }
        self.add_color(&mut json, document, pictures)?;
        if let Some(map) = &self.emission_map {
            json["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
            json["emissiveTexture"] = map.texture(document, pictures)?;
        } else if self.emission != [0.0; 3] {
            json["emissiveFactor"] = json!(self.emission);
        }
        let mut normal_map = self.normal_map.as_ref();
        if let (None, Some(map)) = (normal_map, &self.bump_map) {
            if pictures.is_gray(&map.named) {
                let what =
                    "a map of heights is left out, as glTF has none; make a normal map of it";
                document.warnings.add(&map.named.at, what);
            } else {
                normal_map = Some(map);
            }
        }
        if let Some(map) = normal_map {
            json["normalTexture"] = map.texture(document, pictures)?;
            json["normalTexture"]["scale"] = json!(map.strength);
        }
        Ok(document.add("materials", json))
    }

    /// Adds the base color's texture, with `map_d` as its alpha.
    fn add_color(
        &self,
        json: &mut Value,
        document: &mut Document,
        pictures: &mut Pictures<'_>,
    ) -> Result<()> {
        let mut alpha_map = self.alpha_map.as_ref();
        if let (Some(color), Some(alpha)) = (&self.color_map, alpha_map)
            && !color.is_laid_as(alpha)
        {
            let what = "`map_d` lies otherwise than `map_Kd` and is left out; lay both alike";
            document.warnings.add(&alpha.named.at, what);
            alpha_map = None;
        }
        let cutout = alpha_map.map(|alpha| {
            let color = self.color_map.as_ref().map(|map| &map.named);
            pictures.cutout(document, color, &alpha.named, alpha.clamp)
        });
        let texture = match (cutout.transpose()?.flatten(), alpha_map.or(self.color_map.as_ref())) {
            (Some((index, mode)), Some(map)) => {
                if self.opacity.is_none_or(|opacity| opacity == 1.0) {
                    json["alphaMode"] = json!(mode);
                }
                Some(map.info(index, document))
            }
            _ => self.color_map.as_ref().map(|map| map.texture(document, pictures)).transpose()?,
        };
        if let Some(texture) = texture {
            json["pbrMetallicRoughness"]["baseColorTexture"] = texture;
        }
        Ok(())
    }
}

impl Map {
    /// Reads options and a file's name, which may hold spaces.
    fn parse(line: Line<'_>, rest: &str, file: &File<'_>) -> Result<Self> {
        let (base, at) = (file.base.to_owned(), file.place(line));
        let mut map = Self {
            named: Named { file: String::new(), base, at },
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
        unquote(rest).clone_into(&mut map.named.file);
        Ok(map)
    }

    /// Whether it lies on a surface as another does.
    fn is_laid_as(&self, other: &Self) -> bool {
        (self.offset, self.scale, self.clamp) == (other.offset, other.scale, other.clamp)
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

    /// The texture info of a glTF material.
    fn texture(&self, document: &mut Document, pictures: &mut Pictures<'_>) -> Result<Value> {
        let index = pictures.texture(document, &self.named, self.clamp)?;
        Ok(self.info(index, document))
    }

    /// The texture info of a texture that lies as this map. A point at (u, v), v upward, is read at
    /// (s u + o); turned downward, v' = 1 − s (1 − v) − o.
    fn info(&self, index: usize, document: &mut Document) -> Value {
        let mut info = json!({"index": index});
        if (self.offset, self.scale) != ([0.0; 2], [1.0; 2]) {
            let [u, v] = self.offset;
            let offset = [u, 1.0 - self.scale[1] - v];
            info["extensions"] =
                json!({"KHR_texture_transform": {"offset": offset, "scale": self.scale}});
            document.use_extension("KHR_texture_transform", false);
        }
        info
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

/// A material file, for what is said of it and found from it.
struct File<'a> {
    name: &'a str,
    base: &'a Path,
}

impl File<'_> {
    fn place(&self, line: Line<'_>) -> String {
        format!("{}, {}", self.name, line.place())
    }
}

/// Reads the materials of an MTL file; `name` is what it is called in messages, `base` the folder that
/// names in it start from. A line that makes no sense is left out with a warning.
pub(super) fn parse(
    bytes: &[u8],
    name: &str,
    base: &Path,
    warnings: &mut Warnings,
) -> Vec<Material> {
    let file = File { name, base };
    let mut materials: Vec<Material> = Vec::new();
    for line in lines(&decode(bytes)) {
        let (key, rest) = line.split();
        let Some(material) = materials.last_mut().filter(|_| key != "newmtl") else {
            if key == "newmtl" {
                materials.push(Material::new(rest));
            }
            continue;
        };
        let key = key.to_ascii_lowercase();
        if NO_PLACE.contains(&key.as_str()) {
            let what = format!("the map `{key}` is left out, as there is no place for it in glTF");
            warnings.add(file.place(line), what);
        } else if let Err(error) = material.set(line, &file) {
            let what = match error {
                Error::Invalid { what, .. } => what,
                other => other.to_string(),
            };
            let what = format!("`{}` is left out ({what}); mend the line", shorten(&key));
            warnings.add(file.place(line), what);
        }
    }
    resolve_opacities(&mut materials, warnings);
    materials
}

/// Tells how `Tr` is meant in a file, and takes it so.
fn resolve_opacities(materials: &mut [Material], warnings: &mut Warnings) {
    let alone = materials.iter().filter(|material| material.opacity.is_none());
    let alone: Vec<&(f32, String)> = alone.filter_map(|own| own.transparency.as_ref()).collect();
    let hidden = alone.iter().find(|(transparency, _)| *transparency == 1.0);
    let is_opacity = hidden.filter(|_| alone.iter().all(|(own, _)| *own > 0.0));
    if let Some((_, at)) = is_opacity {
        let what = "`Tr 1` would hide it: `Tr` is taken for the opacity in this file; write `d`";
        warnings.add(at, what);
    }
    let is_opacity = is_opacity.is_some();
    materials.iter_mut().for_each(|material| material.resolve_opacity(is_opacity));
}
