//! The quadrics of a surface's points as ellipsoids: how far each point may move, and in which direction,
//! at one cost (Garland, "Quadric-based polygonal surface simplification", thesis, CMU 1999, §4.1).
//!
//! They are plain sums of squared distances to planes, [`Cost::Classic`](seamwise_attr::Cost): what attributes add
//! is no matter of position alone. Where a surface is nearly flat the ellipsoid is a wide disc, at a tip it is
//! small and round, along an edge it is a needle; a point of a plane or of a straight edge has none.

pub mod glb;

use glam::{DAffine3, DMat4, DVec3};
use rayon::prelude::*;
use seamwise_attr::{Ellipsoid, Isosurface, PlaneQuadrics, PointQuadric, sum_planes};

use crate::document::asset::Asset;
use crate::document::nodes::mesh_worlds;
use crate::error::{Error, Result};
use crate::evaluate::isosurfaces::Solid;
use crate::evaluate::scene::{Material, Scene};
use crate::limit::MemoryLimit;
use crate::surface::group::weld_all;

/// By default half of the ellipsoids have a middle half axis above this share of the mean edge: then many stand
/// apart. At 0.4 they cover the sample whole.
const WIDTH: f64 = 0.25;
/// Ellipsoids that reach farther than this share of the diagonal, and than so many times the mean edge, are left
/// out: they would hide all others.
const REACH: f64 = 0.05;
const REACH_IN_EDGES: f64 = 3.0;
/// Colors, from flat to round, sRGB: ten steps of viridis (van der Walt and Smith), which is as clear in gray,
/// without the first two, in which no shape is seen.
pub const COLORS: [[u8; 3]; 8] = [
    [0x3e, 0x4a, 0x89],
    [0x31, 0x68, 0x8e],
    [0x26, 0x82, 0x8e],
    [0x1f, 0x9e, 0x89],
    [0x35, 0xb7, 0x79],
    [0x6d, 0xcd, 0x59],
    [0xb4, 0xde, 0x2c],
    [0xfd, 0xe7, 0x25],
];
/// The thickness over the width of an ellipsoid of the first color, or flatter.
const FLATTEST: f64 = 0.01;

/// The ellipsoids of a scene's points, over its surface.
#[derive(Debug)]
pub struct Quadrics {
    /// The surface, of one plain material.
    pub scene: Scene,
    /// The ellipsoids that are drawn.
    pub solids: Vec<Solid>,
    /// The value of the quadrics on them, in squared units of the scene.
    pub epsilon: f64,
    /// The counts of points.
    pub census: Census,
}

/// What became of the quadrics of a scene's points, each counted as often as it is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Census {
    /// Points of the surface.
    pub points: usize,
    /// Those with an ellipsoid in the picture.
    pub drawn: usize,
    /// Those whose quadric is not positive definite.
    pub open: usize,
    /// Those whose quadric is more than the value everywhere.
    pub empty: usize,
    /// Those whose ellipsoid is too wide for the picture.
    pub wide: usize,
}

impl std::fmt::Display for Census {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { points, drawn, open, empty, wide } = self;
        write!(f, "{points} points: {drawn} ellipsoids")?;
        for (count, what) in [
            (open, "not positive definite (flat, or along a straight edge)"),
            (wide, "too wide for the picture"),
            (empty, "above epsilon everywhere"),
        ] {
            if *count > 0 {
                write!(f, ", {count} {what}")?;
            }
        }
        Ok(())
    }
}

/// A point's quadric in the scene.
struct Placed {
    quadric: PointQuadric,
    edge: f64,
}

impl Quadrics {
    /// The quadrics of an asset's surface, simplified `level` times to half of its triangles, where they are
    /// `epsilon`, in squared units of the scene; by default where half of the ellipsoids are half as wide as their edges are long.
    ///
    /// # Errors
    /// [`Error::Invalid`] if a mesh or a node is malformed; [`Error::Options`] if there are no triangles, or
    /// `epsilon` is not above 0.
    pub fn of(asset: &Asset, level: u32, epsilon: Option<f64>, limit: MemoryLimit) -> Result<Self> {
        if epsilon.is_some_and(|own| !(own > 0.0 && own.is_finite())) {
            return Err(Error::Options { what: "epsilon must be above 0".into() });
        }
        let surfaces = weld_all(asset, limit)?;
        let worlds = mesh_worlds(asset)?;
        let sums = surfaces.par_iter().map(|own| {
            let mesh = &own.welded.mesh;
            let target = (mesh.triangles.len() >> level.min(60)).max(1);
            let sums = sum_planes(mesh, target)
                .map_err(|error| Error::Internal { what: error.to_string() })?;
            let worlds = worlds.get(&own.meshes[0]).filter(|own| !own.is_empty()).cloned();
            Ok((sums, worlds.unwrap_or_else(|| vec![DMat4::IDENTITY])))
        });
        let sums: Vec<(PlaneQuadrics, Vec<DMat4>)> = sums.collect::<Result<_>>()?;
        let shown =
            || sums.iter().flat_map(|(sums, worlds)| worlds.iter().map(move |world| (sums, world)));
        let (low, high) = bounds(shown());
        if !(low.is_finite() && high.is_finite()) {
            return Err(Error::Options { what: "there are no triangles to look at".into() });
        }
        let origin = (low + high) / 2.0;
        let mut scene = plain_scene(origin);
        let mut placed = Vec::new();
        for (sums, world) in shown() {
            add(sums, world, &mut scene, &mut placed);
        }
        let epsilon = epsilon.unwrap_or_else(|| touching(&placed));
        let edges: f64 = placed.iter().map(|own| own.edge).sum();
        let mean_edge = edges / placed.len().max(1) as f64;
        let reach = (REACH * (high - low).length()).max(REACH_IN_EDGES * mean_edge);
        let (solids, census) = solids(&placed, epsilon, reach);
        Ok(Self { scene, solids, epsilon, census })
    }
}

/// The color of an ellipsoid, an index of [`COLORS`].
fn color(ellipsoid: &Ellipsoid) -> usize {
    let share = 1.0 - ellipsoid.thickness().max(FLATTEST).log10() / FLATTEST.log10();
    ((share * COLORS.len() as f64) as usize).min(COLORS.len() - 1)
}

fn plain_scene(origin: DVec3) -> Scene {
    let clay = Material { metallic: 0.0, double_sided: true, ..Material::default() };
    Scene { origin, materials: vec![clay], ..Scene::default() }
}

fn bounds<'a>(shown: impl Iterator<Item = (&'a PlaneQuadrics, &'a DMat4)>) -> (DVec3, DVec3) {
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    shown.fold(empty, |bounds, (sums, world)| {
        sums.positions.iter().fold(bounds, |(low, high), position| {
            let p = world.transform_point3(position.as_dvec3());
            (low.min(p), high.max(p))
        })
    })
}

/// Adds a surface where a node shows it. Under a map that can't be undone it has no quadrics.
fn add(sums: &PlaneQuadrics, world: &DMat4, scene: &mut Scene, placed: &mut Vec<Placed>) {
    let first = scene.positions.len() as u32;
    let place = |p: &glam::Vec3| world.transform_point3(p.as_dvec3()) - scene.origin;
    let positions: Vec<DVec3> = sums.positions.iter().map(place).collect();
    let map = DAffine3::from_translation(-scene.origin)
        * DAffine3::from_mat4(*world)
        * DAffine3::from_translation(sums.origin);
    // A squared length of the mesh is so many of the scene.
    let square = map.matrix3.determinant().abs().powf(2.0 / 3.0);
    let (mut lengths, mut counts) = (vec![0.0; positions.len()], vec![0.0; positions.len()]);
    for corners in &sums.triangles {
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let [from, to] = [from, to].map(|at| corners[at] as usize);
            lengths[from] += positions[from].distance(positions[to]);
            counts[from] += 1.0;
        }
    }
    let quadrics = sums.quadrics.iter().zip(lengths.iter().zip(&counts));
    placed.extend(quadrics.map(|(quadric, (length, count))| Placed {
        quadric: quadric.transformed(&map).unwrap_or_default().scaled(square),
        edge: if *count > 0.0 { length / count } else { 0.0 },
    }));
    scene.positions.extend(positions.iter().map(|p| p.as_vec3()));
    let corners = |own: &[u32; 3]| own.map(|at| first + at);
    scene.triangles.extend(sums.triangles.iter().map(corners));
    scene.triangle_materials.resize(scene.triangles.len(), 0);
    scene.triangle_meshes.resize(scene.triangles.len(), 0);
}

/// The value at which half of the ellipsoids are half as wide as their edges are long.
fn touching(placed: &[Placed]) -> f64 {
    let value = |own: &Placed| {
        // Where the minimum is not 0, what lies above it makes the ellipsoid; at 1 that of the shape alone.
        let of = |value| match own.quadric.isosurface(value) {
            Isosurface::Ellipsoid(own) => Some(own),
            Isosurface::Open | Isosurface::Empty => None,
        };
        let one = of(1.0)?;
        let least = own.quadric.evaluate(one.center);
        let bend = (1.0 - least) / (one.half_axes.y * one.half_axes.y);
        let width = WIDTH * own.edge;
        Some(least + bend * width * width)
    };
    let mut values: Vec<f64> = placed.par_iter().filter_map(value).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().filter(|own| *own > 0.0).unwrap_or(1.0)
}

/// The ellipsoids of quadrics, but for those that reach farther than `reach`.
fn solids(placed: &[Placed], epsilon: f64, reach: f64) -> (Vec<Solid>, Census) {
    let mut census = Census { points: placed.len(), ..Census::default() };
    let mut solids = Vec::new();
    for own in placed {
        match own.quadric.isosurface(epsilon) {
            Isosurface::Open => census.open += 1,
            Isosurface::Empty => census.empty += 1,
            Isosurface::Ellipsoid(own) if own.half_axes.z > reach => census.wide += 1,
            Isosurface::Ellipsoid(ellipsoid) => {
                census.drawn += 1;
                let color = color(&ellipsoid);
                solids.push(Solid { quadric: own.quadric, value: epsilon, ellipsoid, color });
            }
        }
    }
    (solids, census)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_go_from_flat_to_round() {
        let of = |x: f64| {
            let ellipsoid = Ellipsoid {
                center: DVec3::ZERO,
                map: glam::DMat3::IDENTITY,
                half_axes: DVec3::new(x, 1.0, 1.0),
                directions: glam::DMat3::IDENTITY,
            };
            color(&ellipsoid)
        };
        assert_eq!([0.001, 0.012, 0.1, 0.9, 1.0].map(of), [0, 0, 4, 7, 7]);
    }
}
