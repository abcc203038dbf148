//! How far the source's surface is from each level, vertex by vertex, for the view's colors.

use std::collections::BTreeMap;

use glam::{DMat4, DVec3, Vec3};
use rayon::prelude::*;
use seamwise_attr::Surface;
use serde_json::{Value, json};

use super::exhibit::Exhibit;
use crate::document::asset::Asset;
use crate::document::nodes::mesh_worlds;
use crate::document::primitive::Primitive;
use crate::error::Result;
use crate::evaluate::load::{TextureCache, center, load};
use crate::limit::MemoryLimit;

/// Most vertices of a source whose distances are found: about ten seconds on one core.
const MOST_VERTICES: usize = 1_000_000;
/// The share of all vertices whose distances the colors can tell apart; those beyond are the spikes that
/// would turn all others to the first color.
const TOLD_APART: f64 = 0.999;
/// Levels in one attribute.
const GROUP: usize = 4;

/// Distances from the source's vertices to the levels.
pub(super) struct SourceDistances {
    /// By mesh and primitive: for each group of four levels, one entry per vertex. Each is the root of
    /// the distance over `most`, so that small ones are told apart as well.
    rows: BTreeMap<[usize; 2], Vec<Vec<[u8; 4]>>>,
    /// What the last color stands for, over the diagonal of the source's bounding box.
    most: f64,
}

impl SourceDistances {
    /// The attributes of a primitive.
    pub(super) fn of(&self, primitive: [usize; 2]) -> &[Vec<[u8; 4]>] {
        self.rows.get(&primitive).map_or(&[], Vec::as_slice)
    }

    /// Where a level's distances are, counted from 0.
    pub(super) fn describe(&self, level: usize) -> Value {
        let attribute = format!("_DISTANCE_{}", level / GROUP);
        json!({"attribute": attribute, "component": level % GROUP, "most": self.most})
    }
}

/// Finds the distances; nothing if there is no level, or too much to do.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) if a model is malformed.
pub(super) fn source_distances(
    exhibits: &[Exhibit<'_>],
    limit: MemoryLimit,
) -> Result<Option<SourceDistances>> {
    let [source, levels @ ..] = exhibits else { return Ok(None) };
    let places = vertex_places(source.asset)?;
    let vertices: usize = places.values().map(|all| all.iter().map(Vec::len).sum::<usize>()).sum();
    if levels.is_empty() || vertices == 0 || vertices > MOST_VERTICES {
        return Ok(None);
    }
    let mut by_level = Vec::new();
    for level in levels {
        by_level.push(level_distances(&places, level.asset, limit)?);
    }
    let diagonal = diagonal(&places);
    let most = most(&by_level).max(1e-9 * diagonal);
    let encode =
        |distance: f32| (255.0 * (f64::from(distance) / most).min(1.0).sqrt()).round() as u8;
    let row = |primitive: &[usize; 2], vertex: usize, group: usize| {
        let level =
            |at: usize| by_level.get(GROUP * group + at).map_or(0.0, |own| own[primitive][vertex]);
        [0, 1, 2, 3].map(|at| encode(level(at)))
    };
    let rows = places.iter().map(|(primitive, all)| {
        let vertices = all.first().map_or(0, Vec::len);
        let groups = 0..levels.len().div_ceil(GROUP);
        let rows = groups.map(|group| (0..vertices).map(|at| row(primitive, at, group)).collect());
        (*primitive, rows.collect())
    });
    Ok(Some(SourceDistances { rows: rows.collect(), most: most / diagonal }))
}

/// The vertices of every primitive that is seen, in the world, once for each place it is shown at.
type Places = BTreeMap<[usize; 2], Vec<Vec<DVec3>>>;

fn vertex_places(asset: &Asset) -> Result<Places> {
    let mut places = Places::new();
    let center = center(asset);
    for (mesh, worlds) in mesh_worlds(asset)? {
        for primitive in Primitive::of_mesh(asset, mesh)?.iter().filter(|own| own.is_surface()) {
            let positions = primitive.positions(asset)?;
            let place = |world: &DMat4| {
                let to_world = |p: &Vec3| center + world.transform_point3(p.as_dvec3());
                positions.iter().map(to_world).collect()
            };
            places.insert([mesh, primitive.index], worlds.iter().map(place).collect());
        }
    }
    Ok(places)
}

/// Per primitive and vertex, the largest distance of its places to a level.
fn level_distances(
    places: &Places,
    level: &Asset,
    limit: MemoryLimit,
) -> Result<BTreeMap<[usize; 2], Vec<f32>>> {
    let scene = load(level, &mut TextureCache::with_limit(limit))?;
    let surface = Surface::new(&scene.positions, scene.triangles.iter().copied());
    let distance = |place: &DVec3| {
        let nearest = surface.closest_point((*place - scene.origin).as_vec3());
        nearest.map_or(0.0, |nearest| nearest.distance_squared.sqrt())
    };
    let farthest = |all: &Vec<Vec<DVec3>>| {
        let vertices = all.first().map_or(0, Vec::len);
        let of = |vertex: usize| all.iter().map(|own| distance(&own[vertex])).fold(0.0, f32::max);
        (0..vertices).into_par_iter().map(of).collect()
    };
    Ok(places.iter().map(|(primitive, all)| (*primitive, farthest(all))).collect())
}

/// The distance below which [`TOLD_APART`] of all vertices are, of the level that is off the most.
fn most(by_level: &[BTreeMap<[usize; 2], Vec<f32>>]) -> f64 {
    let of_level = |own: &BTreeMap<[usize; 2], Vec<f32>>| {
        let mut all: Vec<f32> = own.values().flatten().copied().collect();
        all.sort_unstable_by(f32::total_cmp);
        let at = (all.len() as f64 * TOLD_APART) as usize;
        all.get(at.min(all.len().saturating_sub(1))).map_or(0.0, |own| f64::from(*own))
    };
    by_level.iter().map(of_level).fold(0.0, f64::max)
}

fn diagonal(places: &Places) -> f64 {
    let all = || places.values().flatten().flatten();
    let low = all().fold(DVec3::INFINITY, |low, place| low.min(*place));
    let high = all().fold(DVec3::NEG_INFINITY, |high, place| high.max(*place));
    Some((high - low).length()).filter(|own| *own > 0.0 && own.is_finite()).unwrap_or(1.0)
}
