//! Attributes that a level takes over from its source, as the metric does not see them.
//!
//! Attributes that move a vertex are blended at its origin, the nearest point of the source: deltas
//! of morph targets by barycentrics (but for those of UVs, which mean something else across a
//! seam), joints and weights as `skin` does it. A vertex that stands on a source point, or between
//! points that agree, takes their bytes as they are. All else cannot be blended without knowing
//! what it means, and is that of the source vertex which the wedge stands for.
//!
//! Lab note (`cargo test --test suite rigs -- --nocapture`): RMS distance between the surfaces as they
//! move, over that of levels with the joints and deltas of one source vertex each, at 50, 25, 12.5 and
//! 6.25 %: a fox in its animations 0.98, 0.98, 0.98, 0.99; a head with turned joints 0.79, 0.88, 0.87,
//! 0.94, its 82 morph targets 0.92, 0.96, 0.99, 0.99. Most of the rest is what
//! the levels are off by when still.

use glam::DVec3;
use rustc_hash::FxHashMap;
use seamwise_attr::{Influences, Level, Origin, WedgeId, find_origins, fit_influences};

use super::skin::Sets;
use crate::document::accessor::{Elements, Named};
use crate::surface::geometry::Geometry;
use crate::surface::part::{Part, is_motion};

/// A sampler of the source for the vertices of a level.
pub(crate) struct SourceSampler<'a> {
    pub(crate) geometry: &'a Geometry,
    pub(crate) level: &'a Level,
    /// Whether positions are about to be rounded.
    pub(crate) rounds: bool,
    /// One per wedge of the level; none at all if nothing moves.
    origins: Vec<Origin>,
    /// One per point of the level: its fitted weights of joints, if they are.
    fitted: Vec<Influences>,
}

/// The place on the source of one vertex of a level.
pub(crate) struct VertexSource<'a> {
    /// The vertex of its own part that it stands for.
    own: usize,
    /// The source vertices that it is blended of, the largest share first.
    corners: Vec<Corner<'a>>,
    /// The weights of joints that were fitted instead, if any.
    fitted: Influences,
}

/// A source vertex and its share.
struct Corner<'a> {
    part: &'a Part,
    /// Its number in the part.
    vertex: usize,
    /// Above 0; those of a vertex sum to 1.
    share: f64,
}

impl<'a> SourceSampler<'a> {
    pub(crate) fn new(geometry: &'a Geometry, level: &'a Level, rounds: bool) -> Self {
        let moves = |part: &Part| !part.targets.is_empty() || !motion(part).is_empty();
        let kinds = kinds(&geometry.parts);
        let origins = if geometry.parts.iter().any(moves) {
            find_origins(&geometry.welded.mesh, level, &kinds)
        } else {
            Vec::new()
        };
        let fitted = match influences(geometry) {
            Some(all) => fit_influences(&geometry.welded.mesh, level, &kinds, &origins, &all),
            None => Vec::new(),
        };
        Self { geometry, level, rounds, origins, fitted }
    }

    /// The sources of wedges of the level, all of one part.
    pub(crate) fn vertex_sources(&self, part: &Part, wedges: &[WedgeId]) -> Vec<VertexSource<'a>> {
        let of = |&wedge: &WedgeId| {
            let own = self.geometry.welded.wedge_vertices[self.level.wedge_sources[wedge].index()];
            let origin = self.origins.get(wedge.index());
            let point = self.level.mesh.wedge_points[wedge].index();
            VertexSource {
                fitted: self.fitted.get(point).cloned().unwrap_or_default(),
                own: (own - part.first) as usize,
                corners: origin.map_or(Vec::new(), |origin| self.corners(origin)),
            }
        };
        wedges.iter().map(of).collect()
    }

    fn corners(&self, origin: &Origin) -> Vec<Corner<'a>> {
        let shares: [f64; 3] = DVec3::to_array(&origin.barycentrics);
        let mut corners: Vec<Corner<'a>> = origin
            .wedges
            .iter()
            .zip(shares)
            .filter(|&(_, share)| share > 0.0)
            .map(|(wedge, share)| {
                let vertex = self.geometry.welded.wedge_vertices[wedge.index()];
                let part = self.geometry.part_of(vertex);
                Corner { part, vertex: (vertex - part.first) as usize, share }
            })
            .collect();
        corners.sort_by(|a, b| b.share.total_cmp(&a.share));
        corners
    }
}

/// One per wedge of a surface: the joints that it follows. `None` if some part has no joints that can be
/// blended.
fn influences(geometry: &Geometry) -> Option<Vec<Influences>> {
    let parts: Vec<(Vec<&Named>, Sets)> = geometry
        .parts
        .iter()
        .map(|part| {
            let attributes = motion(part);
            let sets = Sets::find(&attributes)?;
            Some((attributes, sets))
        })
        .collect::<Option<_>>()?;
    let own = |&vertex: &u32| {
        let part = geometry.parts.partition_point(|part| part.first <= vertex) - 1;
        let (attributes, sets) = &parts[part];
        let all = sets.influences(attributes, (vertex - geometry.parts[part].first) as usize);
        let all: Influences = all.into_iter().filter(|&(_, w)| w > 0.0 && w.is_finite()).collect();
        let whole: f64 = all.iter().map(|&(_, weight)| weight).sum();
        all.into_iter().map(|(joint, weight)| (joint, weight / whole)).collect()
    };
    Some(geometry.welded.wedge_vertices.iter().map(own).collect())
}

/// One per part: parts whose vertices move by the same attributes, stored alike, have one number.
fn kinds(parts: &[Part]) -> Vec<u32> {
    let shape = |(name, elements): &Named| {
        let (component, components, normalized) = elements.shape();
        (name.clone(), component.as_gl_enum(), components, normalized)
    };
    let mut known = FxHashMap::default();
    let kind = |part: &Part| {
        let targets = part.targets.iter().map(|target| {
            target.iter().filter(|(name, _)| name == "POSITION").map(shape).collect::<Vec<_>>()
        });
        let skin = motion(part).into_iter().map(shape).collect::<Vec<_>>();
        let next = known.len() as u32;
        *known.entry((skin, targets.collect::<Vec<_>>())).or_insert(next)
    };
    parts.iter().map(kind).collect()
}

/// The attributes of a part that bind it to joints.
fn motion(part: &Part) -> Vec<&Named> {
    part.carried.iter().filter(|(name, _)| is_motion(name)).collect()
}

/// An attribute as the source vertices have it that `vertex_sources` stand for.
pub(crate) fn copy(elements: &Elements, vertex_sources: &[VertexSource<'_>]) -> Elements {
    let bytes = vertex_sources.iter().flat_map(|source| elements.element(source.own));
    Elements { bytes: bytes.copied().collect(), ..*elements }
}

/// An attribute blended by shares. `find` gives it for a part; a source with a part that does not
/// have it keeps what its own vertex has.
pub(crate) fn blend(
    elements: &Elements,
    vertex_sources: &[VertexSource<'_>],
    find: impl for<'a> Fn(&'a Part) -> Option<&'a Elements>,
) -> Elements {
    let element = |source: &VertexSource<'_>| {
        let found: Option<Vec<(&Elements, &Corner<'_>)>> = source
            .corners
            .iter()
            .map(|corner| {
                let own = find(corner.part).filter(|own| own.shape() == elements.shape())?;
                Some((own, corner))
            })
            .collect();
        let Some([(first, corner), rest @ ..]) = found.as_deref() else {
            return elements.element(source.own).to_vec();
        };
        let bytes = first.element(corner.vertex);
        if rest.iter().all(|(own, corner)| own.element(corner.vertex) == bytes) {
            return bytes.to_vec();
        }
        let mut sums = vec![0.0; elements.components];
        for (own, corner) in found.iter().flatten() {
            for (sum, x) in sums.iter_mut().zip(own.row(corner.vertex)) {
                *sum += f64::from(x) * corner.share;
            }
        }
        elements.encode(sums.into_iter().map(|sum| sum as f32))
    };
    Elements { bytes: vertex_sources.iter().flat_map(element).collect(), ..*elements }
}

/// The joints and weights of a part's vertices, blended. What is not a whole set of both is that of
/// the corner with the largest share.
pub(crate) fn skin(part: &Part, vertex_sources: &[VertexSource<'_>]) -> Vec<Named> {
    let attributes = motion(part);
    let sets = Sets::find(&attributes);
    let mut out: Vec<Named> = attributes
        .iter()
        .map(|(name, elements)| (name.clone(), Elements { bytes: Vec::new(), ..*elements }))
        .collect();
    for source in vertex_sources {
        let corners: Vec<(Vec<&Named>, usize, f64)> =
            source.corners.iter().map(|c| (motion(c.part), c.vertex, c.share)).collect();
        let corners: Vec<(&[&Named], usize, f64)> =
            corners.iter().map(|(own, vertex, share)| (own.as_slice(), *vertex, *share)).collect();
        let bytes = |(own, vertex, _): &(&[&Named], usize, f64)| -> Vec<Vec<u8>> {
            own.iter().map(|(_, elements)| elements.element(*vertex).to_vec()).collect()
        };
        let Some((first, rest)) = corners.split_first() else { continue };
        let mut row = bytes(first);
        let is_blend = rest.iter().any(|next| bytes(next) != row);
        let blended = sets.as_ref().filter(|_| is_blend).and_then(|sets| {
            let fitted = || sets.encode(source.fitted.clone(), first.0);
            (!source.fitted.is_empty()).then(fitted).flatten().or_else(|| sets.blend(&corners))
        });
        for (place, bytes) in blended.into_iter().flatten() {
            row[place] = bytes;
        }
        for ((_, elements), bytes) in out.iter_mut().zip(row) {
            elements.bytes.extend(bytes);
        }
    }
    out
}
