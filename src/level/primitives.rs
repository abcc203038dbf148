//! A level of a surface as primitives again.
//!
//! UVs, normals and `COLOR_0` come from the level's wedges, tangents are computed anew, and all
//! else is taken over from the source as `resample` tells. Triangles and vertices stand in the order in
//! which graphics processors read them fastest.

use glam::Vec4;
use rustc_hash::FxHashMap;
use seamwise_attr::{Level, WedgeId};

use super::elements::{color_elements, float_elements};
use super::geomorph::{Morph, PREFIX};
use super::join::join_parts;
use super::part::LevelPart;
use super::resample::{SourceSampler, VertexSource, blend, copy, skin};
use super::textures::PartTextures;
use super::vertex_cache::order_for_cache;
use crate::document::accessor::{Elements, Named};
use crate::error::Result;
use crate::surface::geometry::Geometry;
use crate::surface::part::{Part, is_motion};
use crate::surface::tangents::Corners;

/// Turns a level back into primitives, one for each part of the source. A part of which no
/// triangle is left is `None`, and so is one that was joined to another before it.
///
/// `textures` has one entry per part: a normal map that is made anew needs the tangents that it is made
/// for; others have tangents if the source has. `rounds` tells that positions are about to be rounded, `morph` where
/// wedges come to lie in the next level, if parts are to have that.
///
/// # Errors
/// [`Error::Internal`](crate::error::Error::Internal) if the level does not belong to the geometry.
pub(crate) fn level_parts(
    geometry: &Geometry,
    level: &Level,
    textures: &[PartTextures],
    rounds: bool,
    morph: Option<&Morph<'_>>,
) -> Result<Vec<Option<LevelPart>>> {
    let sampler = SourceSampler::new(geometry, level, rounds);
    let part = |(group, own): (usize, &PartTextures)| level_part(&sampler, group, *own, morph);
    let mut parts = textures.iter().enumerate().map(part).collect::<Result<Vec<_>>>()?;
    join_parts(&mut parts, textures);
    Ok(parts)
}

fn level_part(
    sampler: &SourceSampler<'_>,
    group: usize,
    textures: PartTextures,
    morph: Option<&Morph<'_>>,
) -> Result<Option<LevelPart>> {
    let SourceSampler { geometry, level, .. } = *sampler;
    let corners = Corners::of_group(&level.mesh, group as u32);
    if corners.triangles.is_empty() {
        return Ok(None);
    }
    let part = &geometry.parts[group];
    // What is joined has tangents only for a normal map of its own.
    let is_joined = textures.join.is_some();
    let has_tangents = part.primitive.accessor("TANGENT").is_some() && !is_joined;
    let set = textures.tangents.or(has_tangents.then_some(part.normal_uv));
    let mut tangents = match set {
        Some(set) => corners.tangents(&level.mesh, set)?,
        None => Vec::new(),
    };
    // A normal map that was made anew is made for MikkTSpace, the source's own for its own tangents.
    if textures.tangents.is_none() {
        tangents.iter_mut().flatten().for_each(|tangent| tangent.w *= part.tangent_sign);
    }
    if let Some(local) = &part.local {
        let back = |tangent: Vec4| local.frame.direction_back(tangent.truncate()).extend(tangent.w);
        tangents.iter_mut().flatten().for_each(|tangent| *tangent = back(*tangent));
    }
    let vertices = split_by_tangent(&corners, &tangents);
    let carries = !(part.carried.is_empty() && part.targets.is_empty());
    let wedges = if carries { &vertices.wedges[..] } else { &[] };
    let vertex_sources = sampler.vertex_sources(part, wedges);
    let carried: Vec<Named> = part
        .carried
        .iter()
        .filter(|(name, _)| !is_motion(name))
        .map(|(name, elements)| (name.clone(), copy(elements, &vertex_sources)))
        .chain(skin(part, &vertex_sources))
        .collect();
    let mut names: Vec<&str> =
        part.primitive.attributes.iter().map(|(name, _)| name.as_str()).collect();
    if is_joined {
        names.retain(|name| *name != "TANGENT");
    }
    // Those of a level that is simplified once more are of what it no longer is.
    names.retain(|name| !name.starts_with(PREFIX));
    if set.is_some() && !has_tangents {
        names.push("TANGENT");
    }
    if textures.is_repacked {
        names.retain(|name| !name.starts_with("TEXCOORD_"));
        names.push("TEXCOORD_0");
    }
    let made = |name: &str| (name.to_owned(), attribute(name, part, sampler, &vertices, &carried));
    let mut attributes: Vec<Named> = names.into_iter().map(made).collect();
    let mut targets: Vec<Vec<Named>> = (0..part.targets.len())
        .map(|index| target(part, index, &vertex_sources))
        .map(|own| own.into_iter().filter(|(name, _)| !(is_joined && name == "TANGENT")).collect())
        .collect();
    if let Some(morph) = morph {
        let own = (level, &vertices.wedges[..]);
        attributes.extend(morph.attributes(geometry, part, own));
        targets.extend(morph.target(geometry, part, own));
    }
    Ok(Some(LevelPart { attributes, targets, indices: vertices.indices }))
}

/// A morph target of a level's primitive.
fn target(part: &Part, index: usize, vertex_sources: &[VertexSource<'_>]) -> Vec<Named> {
    let moved = |(name, elements): &Named| {
        let deltas = if is_blended(name) {
            blend(elements, vertex_sources, |part| {
                let mut target = part.targets.get(index)?.iter();
                target.find(|(own, _)| own == name).map(|(_, elements)| elements)
            })
        } else {
            copy(elements, vertex_sources)
        };
        (name.clone(), deltas)
    };
    part.targets[index].iter().map(moved).collect()
}

/// Whether deltas of an attribute mean the same all over a surface: those of UVs do not across a seam.
fn is_blended(name: &str) -> bool {
    matches!(name, "POSITION" | "NORMAL" | "TANGENT") || name.starts_with("COLOR_")
}

/// The vertices of a primitive: a wedge, once for each tangent that its corners have.
struct LevelVertices {
    wedges: Vec<WedgeId>,
    tangents: Vec<Vec4>,
    indices: Vec<u32>,
}

fn split_by_tangent(corners: &Corners, tangents: &[[Vec4; 3]]) -> LevelVertices {
    let mut vertices =
        LevelVertices { wedges: Vec::new(), tangents: Vec::new(), indices: Vec::new() };
    let bits = |tangent: Vec4| tangent.to_array().map(f32::to_bits);
    // The first vertex of each wedge, which next to none has another beside.
    let mut firsts: Vec<Option<u32>> = vec![None; corners.wedges.len()];
    let mut others: FxHashMap<(u32, [u32; 4]), u32> = FxHashMap::default();
    for (triangle, local) in corners.triangles.iter().enumerate() {
        for (slot, &wedge) in local.iter().enumerate() {
            let tangent = tangents.get(triangle).map_or(Vec4::ZERO, |t| t[slot]);
            let add = |vertices: &mut LevelVertices| {
                vertices.add(corners.wedges[wedge as usize], tangent)
            };
            let first = *firsts[wedge as usize].get_or_insert_with(|| add(&mut vertices));
            let index = if bits(vertices.tangents[first as usize]) == bits(tangent) {
                first
            } else {
                *others.entry((wedge, bits(tangent))).or_insert_with(|| add(&mut vertices))
            };
            vertices.indices.push(index);
        }
    }
    vertices.ordered()
}

impl LevelVertices {
    fn add(&mut self, wedge: WedgeId, tangent: Vec4) -> u32 {
        self.wedges.push(wedge);
        self.tangents.push(tangent);
        self.wedges.len() as u32 - 1
    }

    /// Reorders triangles and vertices for vertex caches.
    fn ordered(mut self) -> Self {
        let order = order_for_cache(&mut self.indices, self.wedges.len());
        Self {
            wedges: order.iter().map(|&old| self.wedges[old]).collect(),
            tangents: order.iter().map(|&old| self.tangents[old]).collect(),
            indices: self.indices,
        }
    }
}

/// One attribute of a level's primitive.
fn attribute(
    name: &str,
    part: &Part,
    SourceSampler { geometry, level, rounds, .. }: &SourceSampler<'_>,
    vertices: &LevelVertices,
    carried: &[Named],
) -> Elements {
    let (mesh, layout) = (&level.mesh, level.mesh.layout);
    let rows = |offset: usize, components: usize| {
        let rows = vertices.wedges.iter().map(|wedge| mesh.row(*wedge));
        let values = rows.flat_map(|row| row[offset..offset + components].iter().copied());
        float_elements(components, values)
    };
    let uv_set = name.strip_prefix("TEXCOORD_").and_then(|set| set.parse::<usize>().ok());
    match (name, uv_set) {
        ("POSITION", _) => {
            let position = |&wedge: &WedgeId| geometry.position(level, wedge, *rounds).to_array();
            float_elements(3, vertices.wedges.iter().flat_map(position))
        }
        ("NORMAL", _) => {
            let normal = |&wedge: &WedgeId| geometry.normal(level, wedge).to_array();
            float_elements(3, vertices.wedges.iter().flat_map(normal))
        }
        ("TANGENT", _) => float_elements(4, vertices.tangents.iter().flat_map(Vec4::to_array)),
        ("COLOR_0", _) => color_elements(part, |components| {
            let rows = vertices.wedges.iter().map(|wedge| &mesh.row(*wedge)[layout.color()..]);
            rows.flat_map(move |row| row[..components].iter().copied())
        }),
        (_, Some(set)) if set < layout.uv_sets => rows(layout.uv(set), 2),
        _ => {
            let carried = carried.iter().find(|(own, _)| own == name);
            carried.expect("every attribute is made or carried").1.clone()
        }
    }
}
