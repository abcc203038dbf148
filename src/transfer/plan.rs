//! Which images of an asset a transfer can make anew in their own layout, and which it must leave.

use glam::Affine2;
use seamwise_attr::Mesh;
use seamwise_texture::transfer::{Face, overlap};
use seamwise_texture::{Role, Wrap};

use crate::asset::Asset;
use crate::atlas::{main_role, material_slots, worn, worn_materials};
use crate::error::Result;
use crate::geometry::Geometry;
use crate::primitive::Primitive;
use crate::textures::TextureSlot;

/// Texels of a side at which overlaps are looked for.
const LOOK: usize = 512;
/// More than this share of its covered texels at several places, and a layout is not to be told apart.
const MOST_OVERLAP: f64 = 0.02;

/// Triangles of a group as they read an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Charts {
    /// Index among the surfaces.
    pub(crate) surface: usize,
    /// Their group in it.
    pub(crate) group: u32,
    pub(crate) uv_set: usize,
    pub(crate) transform: Affine2,
}

impl Charts {
    /// Whether a texture is read as they are.
    fn reads_like(&self, slot: &TextureSlot) -> bool {
        self.uv_set == slot.uv_set && self.transform == slot.transform
    }
}

/// Images that the same triangles read at the same places.
#[derive(Clone, Debug)]
pub(crate) struct UvLayout {
    pub(crate) charts: Vec<Charts>,
    pub(crate) wrap: [Wrap; 2],
    pub(crate) images: Vec<ImageUse>,
}

/// An image of a layout.
#[derive(Clone, Debug)]
pub(crate) struct ImageUse {
    pub(crate) image: usize,
    /// What its texels mean.
    pub(crate) role: Role,
    /// One per entry of the layout's charts: factor on x and y of a normal.
    pub(crate) normal_scales: Vec<f32>,
}

/// Why an image is shared by all levels instead of made anew.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Shared {
    /// No material that a surface wears names it.
    #[error("no surface wears it")]
    NotWorn,
    /// No chart tells which texels those read.
    #[error("points or lines wear it")]
    BeyondCharts,
    /// What wears it lacks the UVs, or has more sets of them than levels are made of.
    #[error("what wears it has no UVs for it")]
    NoCharts,
    /// UVs run over the image again and again.
    #[error("its UVs tile")]
    Tiling,
    /// Texels are worn in more than one place.
    #[error("{:.0} % of its texels are worn in several places", .0 * 100.0)]
    Overlap(f64),
}

/// A normal map for materials that have none, in the layout of another of their images.
#[derive(Clone, Debug)]
pub(crate) struct NewNormals {
    pub(crate) charts: Vec<Charts>,
    pub(crate) materials: Vec<usize>,
    /// JSON pointer of the texture info that it is read like.
    pub(crate) like: String,
    /// The image of that texture, whose layout and size it takes.
    pub(crate) image: usize,
}

/// What becomes of each image.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) layouts: Vec<UvLayout>,
    pub(crate) normals: Vec<NewNormals>,
    /// One per image; `None` if it is made anew.
    pub(crate) shared: Vec<Option<Shared>>,
}

impl Plan {
    /// Looks at who wears which image where.
    pub(crate) fn new(asset: &Asset, surfaces: &[Geometry]) -> Result<Self> {
        let uses = uses(asset, surfaces)?;
        let (layouts, normals, shared) = (Vec::new(), Vec::new(), Vec::new());
        let mut plan = Self { layouts, normals, shared };
        for (image, used) in uses.into_iter().enumerate() {
            let shared = used.shared(surfaces);
            if shared.is_none() {
                plan.add(image, used);
            }
            plan.shared.push(shared);
        }
        plan.add_normals(asset, surfaces)?;
        Ok(plan)
    }

    /// Plans a normal map for each lit material without one, where one of its images is made anew.
    fn add_normals(&mut self, asset: &Asset, surfaces: &[Geometry]) -> Result<()> {
        for (material, slots) in material_slots(asset)?.iter().enumerate() {
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
            for own in layout.charts.iter().filter(|c| c.reads_like(slot)) {
                let part = &surfaces[own.surface].parts[own.group as usize];
                let normals = surfaces[own.surface].welded.mesh.layout.normal;
                if normals && worn_materials(asset, &part.primitive)?.contains(&material) {
                    charts.push(*own);
                }
            }
            // What reads the image in another way reads its normal map so too.
            let is_alike = |own: &&mut NewNormals| {
                own.image == slot.image && own.charts.iter().all(|charts| charts.reads_like(slot))
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
                    like: slot.at.clone(),
                    image: slot.image,
                }),
            }
        }
        Ok(())
    }

    /// One per surface and part: the UV set by whose tangents a normal map is made anew.
    /// `has` tells which of the planned ones are.
    pub(crate) fn normal_sets(
        &self,
        surfaces: &[Geometry],
        has: impl Fn(&NewNormals) -> bool,
    ) -> Vec<Vec<Option<usize>>> {
        let none = |surface: &Geometry| vec![None; surface.parts.len()];
        let mut sets: Vec<Vec<Option<usize>>> = surfaces.iter().map(none).collect();
        let is_normal =
            |layout: &&UvLayout| layout.images.iter().any(|own| own.role == Role::Normal);
        let made = self.normals.iter().filter(|own| has(own)).map(|normals| &normals.charts);
        let old = self.layouts.iter().filter(is_normal).map(|layout| &layout.charts);
        for charts in old.chain(made).flatten() {
            sets[charts.surface][charts.group as usize] = Some(charts.uv_set);
        }
        sets
    }

    fn add(&mut self, image: usize, used: Used) {
        let Used { charts, wrap, role, normal_scales, .. } = used;
        let own = ImageUse { image, role, normal_scales };
        let same = |layout: &&mut UvLayout| layout.charts == charts && layout.wrap == wrap;
        match self.layouts.iter_mut().find(same) {
            Some(layout) => layout.images.push(own),
            None => self.layouts.push(UvLayout { charts, wrap, images: vec![own] }),
        }
    }
}

/// How an image is used.
#[derive(Clone, Debug, Default)]
struct Used {
    role: Role,
    wrap: [Wrap; 2],
    charts: Vec<Charts>,
    /// One per entry of `charts`.
    normal_scales: Vec<f32>,
    is_worn: bool,
    beyond_charts: bool,
    lacks_uvs: bool,
}

impl Used {
    fn add(&mut self, slot: &TextureSlot) {
        self.role = if self.is_worn { main_role(self.role, slot.role) } else { slot.role };
        self.wrap = slot.wrap;
        self.is_worn = true;
    }

    fn add_charts(&mut self, surface: usize, group: u32, slot: &TextureSlot, mesh: &Mesh) {
        let charts = Charts { surface, group, uv_set: slot.uv_set, transform: slot.transform };
        if slot.uv_set >= mesh.layout.uv_sets {
            self.lacks_uvs = true;
        } else if !self.charts.contains(&charts) {
            self.charts.push(charts);
            self.normal_scales.push(slot.normal_scale);
        }
    }

    /// Why it can't be made anew.
    fn shared(&self, surfaces: &[Geometry]) -> Option<Shared> {
        if !self.is_worn {
            return Some(Shared::NotWorn);
        }
        if self.beyond_charts {
            return Some(Shared::BeyondCharts);
        }
        if self.lacks_uvs || self.charts.is_empty() {
            return Some(Shared::NoCharts);
        }
        let meshes: Vec<&Mesh> = surfaces.iter().map(|surface| &surface.welded.mesh).collect();
        let faces = faces(&self.charts, &meshes);
        let spans = |face: &Face| {
            let [a, b, c] = face.uvs;
            (a.max(b).max(c) - a.min(b).min(c)).max_element() > 1.0
        };
        if faces.iter().any(spans) {
            return Some(Shared::Tiling);
        }
        let share = overlap(&faces, [LOOK; 2], self.wrap);
        (share > MOST_OVERLAP).then_some(Shared::Overlap(share))
    }
}

/// One per image: how it is used.
fn uses(asset: &Asset, surfaces: &[Geometry]) -> Result<Vec<Used>> {
    let materials = material_slots(asset)?;
    let mut uses = vec![Used::default(); asset.count("images")];
    for mesh in 0..asset.count("meshes") {
        for primitive in Primitive::of_mesh(asset, mesh)?.iter().filter(|p| !p.is_surface()) {
            for slot in worn(asset, primitive, &materials)? {
                uses[slot.image].add(slot);
                uses[slot.image].beyond_charts = true;
            }
        }
    }
    for (index, surface) in surfaces.iter().enumerate() {
        for (group, part) in (0..).zip(&surface.parts) {
            for slot in worn(asset, &part.primitive, &materials)? {
                uses[slot.image].add(slot);
                uses[slot.image].add_charts(index, group, slot, &surface.welded.mesh);
            }
        }
    }
    Ok(uses)
}

/// The triangles of charts, those of each surface in `meshes`; a reading is an index of `charts`.
pub(crate) fn faces(charts: &[Charts], meshes: &[&Mesh]) -> Vec<Face> {
    let of = |(reading, charts): (u32, &Charts)| {
        let mesh = meshes[charts.surface];
        let own = (0..mesh.triangles.len()).filter(|&t| mesh.groups[t] == charts.group);
        let face = |triangle: usize| Face {
            pair: charts.surface as u32,
            triangle: triangle as u32,
            reading,
            uvs: mesh.triangles[triangle]
                .map(|wedge| charts.transform.transform_point2(mesh.uv(wedge, charts.uv_set))),
        };
        own.map(face).collect::<Vec<_>>()
    };
    (0..).zip(charts).flat_map(of).collect()
}
