//! The plan of a transfer: the images of an asset that it makes anew, in which layout, and those
//! that it must leave.

use std::collections::BTreeMap;

use glam::Affine2;
use seamwise_texture::Role;

use super::image_uses::{Used, used_together, uses};
use super::join_primitives::Joins;
use super::layout::{
    ChartGroup, ImageUse, MergeGroup, NewColors, NewNormals, SharedReason, TextureLike, UvLayout,
};
use super::merge_materials::{Merging, NotMerged};
use super::options::{Atlas, TransferOptions};
use crate::document::asset::Asset;
use crate::document::material::{TextureSlot, material_slots, materials_of};
use crate::error::Result;
use crate::limit::MemoryLimit;
use crate::surface::geometry::Geometry;
use crate::surface::part::Part;

/// The plan of a transfer.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plan {
    pub(crate) layouts: Vec<UvLayout>,
    pub(crate) normals: Vec<NewNormals>,
    pub(crate) colors: Vec<NewColors>,
    /// One per image; `None` if it is made anew. With a choice, one whose texels are used in several
    /// places may be made anew too.
    pub(crate) shared: Vec<Option<SharedReason>>,
    /// By material: the reason why it stays by itself, where materials are to be merged.
    pub(crate) not_merged: BTreeMap<usize, NotMerged>,
    /// The parts that become one primitive, one entry per surface and part.
    pub(crate) joins: Joins,
    /// One per surface: whether its levels are without UVs until they are unwrapped.
    pub(crate) is_free: Vec<bool>,
}

impl Plan {
    /// The materials that are made of several.
    pub(crate) fn merge_groups(&self) -> impl Iterator<Item = &MergeGroup> {
        self.layouts.iter().filter_map(|layout| layout.merge_group.as_ref())
    }

    /// Plans the transfer from the uses of images.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) if a material or an image is malformed.
    pub(crate) fn new(
        asset: &Asset,
        surfaces: &[Geometry],
        limit: MemoryLimit,
        options: &TransferOptions,
    ) -> Result<Self> {
        let &TransferOptions { atlas, chooses, unwraps, .. } = options;
        let mut slots = material_slots(asset)?;
        let mut merging = Merging::default();
        if atlas == Atlas::Merged {
            merging = Merging::new(asset, surfaces, &slots)?;
            merging
                .merge_groups()
                .flat_map(|merge_group| &merge_group.materials)
                .for_each(|&own| slots[own].clear());
        }
        let uses = uses(asset, surfaces, &slots, limit)?;
        let mut plan = match atlas {
            Atlas::Keep => Self::in_place(uses, surfaces, chooses),
            Atlas::New | Atlas::Merged => Self::anew(&uses, surfaces),
        };
        plan.add_normals(asset, surfaces, &slots)?;
        if unwraps {
            plan.add_bare(asset, surfaces, &slots, options.bake_normals)?;
        }
        plan.layouts.extend(merging.layouts);
        plan.not_merged = merging.not_merged;
        plan.joins = Joins::new(asset, surfaces, &plan.layouts);
        plan.is_free = (0..surfaces.len()).map(|at| unwraps && plan.frees(surfaces, at)).collect();
        Ok(plan)
    }

    /// Whether all parts of a surface that have UVs are laid out anew.
    fn frees(&self, surfaces: &[Geometry], surface: usize) -> bool {
        let anew = self.layouts.iter().filter(|layout| layout.is_new);
        let own = anew.flat_map(|own| &own.charts).filter(|charts| charts.surface == surface);
        let groups: Vec<usize> = own.map(|charts| charts.group as usize).collect();
        let has_uvs = |part: &Part| part.primitive.accessor("TEXCOORD_0").is_some();
        let mut parts = surfaces[surface].parts.iter().enumerate();
        !groups.is_empty() && parts.all(|(at, part)| groups.contains(&at) || !has_uvs(part))
    }

    /// Whether the vertices of a surface have their colors in textures of levels.
    pub(crate) fn takes_colors(&self, surface: usize) -> bool {
        self.colors.iter().flat_map(|own| &own.charts).any(|charts| charts.surface == surface)
    }

    /// A plan with each image in the source's layout. Texels that several places use are made for the
    /// first of them, if a choice is to tell whether they do for the others.
    fn in_place(uses: Vec<Used>, surfaces: &[Geometry], chooses: bool) -> Self {
        let mut plan = Self::default();
        for (image, used) in uses.into_iter().enumerate() {
            let shared = used.shared(surfaces);
            if shared.is_none() || chooses && matches!(shared, Some(SharedReason::Overlap(_))) {
                plan.add(image, used);
            }
            plan.shared.push(shared);
        }
        plan
    }

    fn add(&mut self, image: usize, used: Used) {
        let Used { charts, wrap, role, readings, .. } = used;
        let own = ImageUse { image, role, readings: readings.into_iter().map(Some).collect() };
        let same = |layout: &&mut UvLayout| layout.charts == charts && layout.wrap == wrap;
        match self.layouts.iter_mut().find(same) {
            Some(layout) => layout.images.push(own),
            None => {
                self.layouts.push(UvLayout {
                    charts,
                    wrap,
                    images: vec![own],
                    is_new: false,
                    merge_group: None,
                });
            }
        }
    }

    /// A plan with a new layout for each set of images that triangles use together.
    fn anew(uses: &[Used], surfaces: &[Geometry]) -> Self {
        let shared = uses.iter().map(|used| used.fixed(surfaces)).collect();
        let mut plan = Self { shared, ..Self::default() };
        for images in used_together(uses) {
            if images.iter().any(|&image| plan.shared[image].is_some()) {
                for image in images {
                    plan.shared[image].get_or_insert(SharedReason::ConflictingUvs);
                }
                continue;
            }
            let charts = images.iter().flat_map(|&image| &uses[image].charts);
            let mut groups: Vec<(usize, u32)> = charts.map(|c| (c.surface, c.group)).collect();
            groups.sort_unstable();
            groups.dedup();
            let own = |&image: &usize| uses[image].image_use(image, &groups);
            let anew = |&(surface, group): &(usize, u32)| ChartGroup {
                surface,
                group,
                uv_set: 0,
                transform: Affine2::IDENTITY,
            };
            plan.layouts.push(UvLayout {
                wrap: uses[images[0]].wrap,
                images: images.iter().map(own).collect(),
                charts: groups.iter().map(anew).collect(),
                is_new: true,
                merge_group: None,
            });
        }
        plan
    }

    /// Plans a normal map for each lit material without one, where one of its images is made anew.
    fn add_normals(
        &mut self,
        asset: &Asset,
        surfaces: &[Geometry],
        slots: &[Vec<TextureSlot>],
    ) -> Result<()> {
        for (material, slots) in slots.iter().enumerate() {
            let at = format!("/materials/{material}");
            let has = |key: &str| asset.json.pointer(&format!("{at}/{key}")).is_some();
            if has("normalTexture") || has("extensions/KHR_materials_unlit") {
                continue;
            }
            let is_base = |slot: &&TextureSlot| slot.at.ends_with("baseColorTexture");
            let Some(slot) = slots.iter().find(is_base).or(slots.first()) else { continue };
            let is_like =
                |layout: &&UvLayout| layout.images.iter().any(|own| own.image == slot.image);
            let Some(layout) = self.layouts.iter().find(is_like) else { continue };
            let mut charts = Vec::new();
            let own = layout.charts.iter().filter(|c| layout.is_new || c.reads_like(slot));
            for own in own {
                let part = &surfaces[own.surface].parts[own.group as usize];
                let normals = surfaces[own.surface].welded.mesh.layout.normal;
                if normals && materials_of(asset, &part.primitive)?.contains(&material) {
                    charts.push(*own);
                }
            }
            // What reads the image in another way reads its normal map so too.
            let is_alike = |own: &&mut NewNormals| {
                own.like.as_ref().is_some_and(|like| like.image == slot.image)
                    && own.charts.iter().all(|charts| charts.reads_like(slot))
            };
            match self.normals.iter_mut().find(is_alike) {
                _ if charts.is_empty() => {}
                Some(own) => {
                    charts.retain(|charts| !own.charts.contains(charts));
                    own.charts.extend(charts);
                    own.materials.push(material);
                }
                None => self.normals.push(NewNormals {
                    charts,
                    materials: vec![material],
                    like: Some(TextureLike { at: slot.at.clone(), image: slot.image }),
                }),
            }
        }
        Ok(())
    }

    /// One per surface and part: the UV set by whose tangents a level reads a normal map that is made
    /// anew. `gains` tells which materials gain one, `is_own` which images of the source are made anew.
    pub(crate) fn level_sets(
        &self,
        surfaces: &[Geometry],
        gains: impl Fn(usize) -> bool,
        is_own: impl Fn(usize) -> bool,
    ) -> Vec<Vec<Option<usize>>> {
        let mut sets = no_sets(surfaces);
        let gained = self.normals.iter().filter(|own| gains(own.materials[0]));
        let made = gained.map(|normals| &normals.charts);
        let old = self.normal_maps().filter(|(_, own)| is_own(own.image));
        let old = old.map(|(layout, _)| &layout.charts);
        let has = |layout: &&UvLayout| {
            let merge_group = layout.merge_group.as_ref();
            merge_group
                .is_some_and(|merge_group| merge_group.has_normals(gains(merge_group.materials[0])))
        };
        let merged = self.layouts.iter().filter(has).map(|layout| &layout.charts);
        for charts in old.chain(made).chain(merged).flatten() {
            sets[charts.surface][charts.group as usize] = Some(charts.uv_set);
        }
        sets
    }

    /// One per surface and part: the UV set in which the source reads its normal map.
    pub(crate) fn source_sets(&self, surfaces: &[Geometry]) -> Vec<Vec<Option<usize>>> {
        let mut sets = no_sets(surfaces);
        for (layout, own) in self.normal_maps() {
            for (charts, reading) in layout.charts.iter().zip(&own.readings) {
                if let Some(reading) = reading {
                    sets[charts.surface][charts.group as usize] = Some(reading.uv_set);
                }
            }
        }
        let merged = self.layouts.iter().filter_map(|own| Some((own, own.merge_group.as_ref()?)));
        for (layout, merge_group) in merged {
            for own in merge_group.outputs.iter().filter(|own| own.role == Role::Normal) {
                for (charts, folded) in layout.charts.iter().zip(&own.readings) {
                    let set = folded.source.map(|(_, reading)| reading.uv_set);
                    sets[charts.surface][charts.group as usize] = set;
                }
            }
        }
        sets
    }

    /// The normal maps that are made anew from the source's.
    fn normal_maps(&self) -> impl Iterator<Item = (&UvLayout, &ImageUse)> {
        let all = self.layouts.iter().flat_map(|l| l.images.iter().map(move |own| (l, own)));
        all.filter(|(_, own)| own.role == Role::Normal)
    }
}

fn no_sets(surfaces: &[Geometry]) -> Vec<Vec<Option<usize>>> {
    surfaces.iter().map(|surface| vec![None; surface.parts.len()]).collect()
}
