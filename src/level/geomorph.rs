//! The attributes by which a level changes to the next coarser one without a jump: for each vertex what it has
//! once it has come to lie where [`MorphEnd`] says.
//!
//! A renderer blends `POSITION` with `_GEOMORPH_POSITION` and so on by one number t. At t = 0 the level is what it
//! is, at t = 1 it is the next one, both to the bit. Tangents are not blended.

use glam::Vec3;
use seamwise_attr::{Level, MorphEnd, PointId, ProgressiveMesh, ProgressiveScene, WedgeId};

use super::elements::{color_elements, float_elements};
use super::lods::Lods;
use crate::document::accessor::Named;
use crate::document::asset::Asset;
use crate::document::primitive::Primitive;
use crate::error::Result;
use crate::surface::geometry::Geometry;
use crate::surface::part::Part;

/// The start of the names of all attributes of geomorphs.
pub(crate) const PREFIX: &str = "_GEOMORPH_";

/// The way of a level to the next coarser one.
#[derive(Clone, Debug)]
pub(crate) struct Morph<'a> {
    coarse: &'a Level,
    /// One per wedge of the level.
    ends: Vec<MorphEnd>,
    kinds: Kinds,
}

/// The things that are told of ends.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Kinds {
    /// Whether UVs are: not if each level has textures of its own.
    pub(crate) has_uvs: bool,
    /// Whether there is a morph target too, where a mesh can have one more.
    pub(crate) has_target: bool,
}

/// The way of a primitive of the source to the first level.
#[derive(Clone, Debug)]
pub(crate) struct SourceMorph {
    pub(crate) mesh: usize,
    pub(crate) primitive: usize,
    pub(crate) attributes: Vec<Named>,
    pub(crate) target: Option<Vec<Named>>,
}

/// The ways of all surfaces from each level to the next; the last of each, and one that stays as it is, has none.
#[derive(Clone, Debug, Default)]
pub(crate) struct Morphs<'a> {
    /// One entry per level, the source first, each with one per surface.
    levels: Vec<Vec<Option<Morph<'a>>>>,
}

impl<'a> Morphs<'a> {
    /// Follows all wedges through the collapses on record.
    pub(crate) fn find(
        asset: &Asset,
        geometries: &[Geometry],
        lods: &'a Lods,
        scene: &mut ProgressiveScene,
        kinds: Kinds,
    ) -> Self {
        let mut levels: Vec<Vec<Option<Morph<'a>>>> = vec![Vec::new(); lods.count() + 1];
        let find = |(at, record): (usize, &mut ProgressiveMesh)| {
            let kinds = Kinds {
                has_target: kinds.has_target && takes_target(asset, &geometries[at]),
                ..kinds
            };
            let source = source_level(&geometries[at]);
            let all: Vec<&Level> = [&source].into_iter().chain(lods.of_surface(at)).collect();
            let places: Vec<usize> = [0].into_iter().chain(record.levels().to_vec()).collect();
            for (index, own) in levels.iter_mut().enumerate() {
                let (from, to) = (places.get(index), places.get(index + 1));
                let coarse = lods.of_surface(at).nth(index);
                own.push(match (from, to, coarse) {
                    (Some(&from), Some(&to), Some(coarse)) if from < to => {
                        let ends = record.morph(all[index], coarse, from..to);
                        Some(Morph { coarse, ends, kinds })
                    }
                    _ => None,
                });
            }
            Ok::<_, std::convert::Infallible>(())
        };
        let Ok(()) = scene.map_meshes(find);
        Self { levels }
    }

    /// The way of a surface from a level on; 0 is the source.
    pub(crate) fn get(&self, level: usize, surface: usize) -> Option<&Morph<'a>> {
        self.levels.get(level)?.get(surface)?.as_ref()
    }

    /// The ways of the source's primitives, for a document that has them with the levels.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if the source can't be read.
    pub(crate) fn of_source(
        &self,
        asset: &Asset,
        geometries: &[Geometry],
    ) -> Result<Vec<SourceMorph>> {
        let mut all = Vec::new();
        for (surface, geometry) in geometries.iter().enumerate() {
            let Some(morph) = self.get(0, surface) else { continue };
            let Some(wedges) = source_wedges(asset, geometry)? else { continue };
            let source = source_level(geometry);
            for (part, wedges) in geometry.parts.iter().zip(&wedges) {
                let Primitive { mesh, index, .. } = part.primitive;
                all.push(SourceMorph {
                    mesh,
                    primitive: index,
                    attributes: morph.attributes(geometry, part, (&source, wedges)),
                    target: morph.target(geometry, part, (&source, wedges)),
                });
            }
        }
        Ok(all)
    }
}

impl Morph<'_> {
    /// Whether it comes as a morph target too.
    pub(crate) fn has_target(&self) -> bool {
        self.kinds.has_target
    }

    fn position(&self, geometry: &Geometry, part: &Part, (fine, wedge): (&Level, WedgeId)) -> Vec3 {
        match (self.ends[wedge.index()], &part.local) {
            (MorphEnd::Wedge(end), _) => geometry.position(self.coarse, end, false),
            (MorphEnd::Place(place), Some(local)) => local.frame.point_back(place),
            (MorphEnd::Place(place), None) => {
                // Of a point that has not moved what the vertex has.
                let own = fine.mesh.positions[fine.mesh.wedge_points[wedge]];
                if own == place { geometry.position(fine, wedge, false) } else { place }
            }
        }
    }

    fn normal(&self, geometry: &Geometry, (fine, wedge): (&Level, WedgeId)) -> Vec3 {
        match self.ends[wedge.index()] {
            MorphEnd::Wedge(end) => geometry.normal(self.coarse, end),
            MorphEnd::Place(_) => geometry.normal(fine, wedge),
        }
    }

    fn row<'b>(&'b self, fine: &'b Level, wedge: WedgeId) -> &'b [f32] {
        match self.ends[wedge.index()] {
            MorphEnd::Wedge(end) => self.coarse.mesh.row(end),
            MorphEnd::Place(_) => fine.mesh.row(wedge),
        }
    }

    /// The attributes of a part whose vertices are these wedges of a level.
    pub(crate) fn attributes(
        &self,
        geometry: &Geometry,
        part: &Part,
        (fine, wedges): (&Level, &[WedgeId]),
    ) -> Vec<Named> {
        let layout = fine.mesh.layout;
        let rows = |start: usize, count: usize| {
            wedges
                .iter()
                .flat_map(move |&wedge| self.row(fine, wedge)[start..start + count].to_vec())
        };
        let mut all = Vec::new();
        for (name, _) in &part.primitive.attributes {
            let set = name.strip_prefix("TEXCOORD_").and_then(|set| set.parse::<usize>().ok());
            let elements = match (name.as_str(), set) {
                ("POSITION", _) => {
                    let position = |&wedge: &WedgeId| self.position(geometry, part, (fine, wedge));
                    float_elements(3, wedges.iter().map(position).flat_map(|own| own.to_array()))
                }
                ("NORMAL", _) => {
                    let normal = |&wedge: &WedgeId| self.normal(geometry, (fine, wedge));
                    float_elements(3, wedges.iter().map(normal).flat_map(|own| own.to_array()))
                }
                ("COLOR_0", _) => color_elements(part, |count| rows(layout.color(), count)),
                (_, Some(set)) if self.kinds.has_uvs && set < layout.uv_sets => {
                    float_elements(2, rows(layout.uv(set), 2))
                }
                _ => continue,
            };
            all.push((format!("{PREFIX}{name}"), elements));
        }
        all
    }

    /// The same as a morph target of positions and normals, if there is to be one. Where a difference of floats can't
    /// tell it, the end is off by a rounding.
    pub(crate) fn target(
        &self,
        geometry: &Geometry,
        part: &Part,
        (fine, wedges): (&Level, &[WedgeId]),
    ) -> Option<Vec<Named>> {
        self.kinds.has_target.then(|| {
            let position = |&wedge: &WedgeId| {
                let own = geometry.position(fine, wedge, false);
                difference(own, self.position(geometry, part, (fine, wedge)))
            };
            let mut all =
                vec![("POSITION".to_owned(), float_elements(3, wedges.iter().flat_map(position)))];
            if part.primitive.accessor("NORMAL").is_some() {
                let normal = |&wedge: &WedgeId| {
                    let own = geometry.normal(fine, wedge);
                    difference(own, self.normal(geometry, (fine, wedge)))
                };
                all.push(("NORMAL".to_owned(), float_elements(3, wedges.iter().flat_map(normal))));
            }
            all
        })
    }
}

/// What leads from one vector to another when it is added, to the bit where that can be.
fn difference(from: Vec3, to: Vec3) -> [f32; 3] {
    [0, 1, 2].map(|axis| {
        let (from, to) = (from[axis], to[axis]);
        let by = to - from;
        let near = [by, by.next_up(), by.next_down()];
        near.into_iter().find(|by| from + by == to).unwrap_or(by)
    })
}

/// Whether all primitives of a surface's meshes can have a morph target more: they are parts of it, and have
/// none of their own, which animations count.
pub(crate) fn takes_target(asset: &Asset, geometry: &Geometry) -> bool {
    let primitives =
        |&mesh: &usize| asset.json["meshes"][mesh]["primitives"].as_array().map_or(0, Vec::len);
    let all: usize = geometry.meshes.iter().map(primitives).sum();
    all == geometry.parts.len() && geometry.parts.iter().all(|part| part.targets.is_empty())
}

/// The source as a level.
fn source_level(geometry: &Geometry) -> Level {
    let mesh = geometry.welded.mesh.clone();
    Level {
        point_sources: (0..mesh.positions.len()).map(PointId::new).collect(),
        wedge_sources: (0..mesh.wedge_points.len()).map(WedgeId::new).collect(),
        target: mesh.triangles.len(),
        error: 0.0,
        stopped: None,
        mesh,
    }
}

/// The wedges of all vertices of each part; a vertex that no triangle names has the first one. None if
/// triangles and those of the surface can't be told to be the same.
fn source_wedges(asset: &Asset, geometry: &Geometry) -> Result<Option<Vec<Vec<WedgeId>>>> {
    let (welded, mut next) = (&geometry.welded, 0);
    let mut all = Vec::new();
    for part in &geometry.parts {
        let positions = part.primitive.positions(asset)?;
        let mut wedges = vec![WedgeId::new(0); part.vertices];
        for triangle in part.primitive.triangles(asset, part.vertices)? {
            // Triangles of the surface are those of the parts in order, without those that have no area.
            let Some(own) = welded.mesh.triangles.get(next) else { break };
            let is_same = |(&vertex, &wedge): (&u32, &WedgeId)| {
                positions[vertex as usize] == geometry.source_position(wedge)
            };
            if triangle.iter().zip(own).all(is_same) {
                triangle.iter().zip(own).for_each(|(&at, &wedge)| wedges[at as usize] = wedge);
                next += 1;
            }
        }
        all.push(wedges);
    }
    Ok((next == welded.mesh.triangles.len()).then_some(all))
}
