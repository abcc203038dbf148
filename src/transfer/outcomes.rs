//! The outcome of a transfer for each material, for the report.

use serde::Serialize;
use serde_json::Value;

use super::choice::TextureChoice;
use super::layout::UvLayout;
use super::merge_materials::NotMerged;
use super::plan::Plan;
use crate::document::asset::Asset;
use crate::document::material::material_slots;
use crate::error::Result;

/// The reason why levels share what they could have had of their own.
const NO_BETTER: &str =
    "it shows as little error as one of a level's own, or one is not worth its bytes";

/// The outcome of a material's textures.
#[derive(Clone, Debug, Serialize)]
pub struct MaterialTextures {
    /// Its index.
    pub material: usize,
    /// Its name, if it has one.
    pub name: Option<String>,
    /// Its textures.
    pub textures: Vec<TextureOutcome>,
    /// The materials that it is merged with, itself among them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub merged: Vec<usize>,
    /// The reason why it, or a primitive that uses it, stays by itself, if materials are to be
    /// merged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub apart: Option<String>,
}

impl MaterialTextures {
    /// Its name in messages, or else its index.
    pub(crate) fn called(&self) -> String {
        self.name.clone().unwrap_or_else(|| self.material.to_string())
    }
}

/// The outcome of a texture.
#[derive(Clone, Debug, Serialize)]
pub struct TextureOutcome {
    /// Its place in the material.
    pub texture: String,
    /// Its image.
    pub image: usize,
    /// The place of each level's texels.
    #[serde(rename = "fate")]
    pub outcome: Outcome,
    /// The reason why it is shared, if it is.
    pub why: Option<String>,
    /// The choice for each level, if there was one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<TextureChoice>,
}

/// The place of the texels of a level's texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// In the same places as the source's.
    InPlace,
    /// In a new atlas.
    NewAtlas,
    /// In the atlas of a merged material.
    Merged,
    /// In the source's image, which all levels share.
    Shared,
}

impl Plan {
    /// The outcome of the textures of each material.
    pub(crate) fn outcomes(
        &self,
        asset: &Asset,
        choices: &[(usize, TextureChoice)],
    ) -> Result<Vec<MaterialTextures>> {
        let materials = material_slots(asset)?.into_iter().enumerate();
        let textures = materials.map(|(material, slots)| {
            let at = format!("/materials/{material}");
            let name = asset.json.pointer(&format!("{at}/name")).and_then(Value::as_str);
            let merge_group =
                self.merge_groups().find(|merge_group| merge_group.materials.contains(&material));
            let textures = slots.iter().map(|slot| {
                let own = choices.iter().filter(|(image, _)| *image == slot.image);
                let choices: Vec<TextureChoice> = own.map(|(_, choice)| choice.clone()).collect();
                let mut old = choices.iter().filter(|choice| !choice.gained).peekable();
                let stays = old.peek().is_some() && old.all(|choice| !choice.own);
                let outcome = match merge_group {
                    Some(_) => Outcome::Merged,
                    None if stays => Outcome::Shared,
                    None => self.outcome(slot.image),
                };
                let reason = self.shared[slot.image].map(|why| why.to_string());
                TextureOutcome {
                    texture: slot.at.trim_start_matches(&at).trim_start_matches('/').to_owned(),
                    image: slot.image,
                    outcome,
                    why: match outcome {
                        Outcome::Shared => reason.or_else(|| Some(NO_BETTER.to_owned())),
                        _ => None,
                    },
                    choices,
                }
            });
            let rest = self.joins.rest.contains(&material);
            let rest = rest.then(|| "its vertices have other attributes than others'".to_owned());
            MaterialTextures {
                material,
                name: name.map(str::to_owned),
                textures: textures.collect(),
                merged: merge_group.map_or(Vec::new(), |merge_group| merge_group.materials.clone()),
                apart: self.not_merged.get(&material).map(NotMerged::to_string).or(rest),
            }
        });
        let is_told = |own: &MaterialTextures| {
            !own.textures.is_empty() || !own.merged.is_empty() || own.apart.is_some()
        };
        Ok(textures.filter(is_told).collect())
    }

    fn outcome(&self, image: usize) -> Outcome {
        let is_own = |layout: &&UvLayout| layout.images.iter().any(|own| own.image == image);
        match self.layouts.iter().find(is_own) {
            Some(layout) if layout.is_new => Outcome::NewAtlas,
            Some(_) => Outcome::InPlace,
            None => Outcome::Shared,
        }
    }
}
