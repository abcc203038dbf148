//! Makes `data/sample.glb`, the asset that a fresh checkout bakes: a glazed ewer in the manner of
//! Iznik, with gilt mounts.
//!
//! It shows what the tool is for: one atlas of many charts with garish paint between them, one
//! chart mirrored, fine lines that run across seams, two materials that meet along shared points,
//! and a closed surface with handles. It is computed in f64 from formulas and hash noise and
//! rounded at the end, so every run writes the same bytes.
//!
//! `cargo run --release --example make_sample -- data/sample.glb`

mod atlas;
mod decor;
mod drawing;
mod maps;
mod model;
mod motif;
mod noise;
mod paint;
mod profile;
mod script;
mod ship;
mod tube;
mod tulips;
mod turned;
mod write;

use anyhow::Context;

use atlas::Atlas;
use decor::Decor;
use maps::Painter;
use model::Model;
use profile::Profile;

/// The ewer's mesh.
fn make_model() -> Model {
    let mut model = Model::default();
    let [spout, upper, lower] = turned::add_turned(&mut model, &Profile::new());
    tube::add_spout(&mut model, &spout);
    tube::add_handle(&mut model, &upper, &lower);
    model.prune();
    model
}

/// The bytes of `data/sample.glb`.
fn make_sample() -> anyhow::Result<Vec<u8>> {
    let model = make_model();
    let atlas = Atlas::new(&model);
    let painter =
        Painter { model: &model, atlas: &atlas, decor: &Decor::new(), hollows: &model.hollows() };
    let maps = painter.paint()?;
    write::glb(&model, &atlas, &maps)
}

fn main() -> anyhow::Result<()> {
    let path = std::env::args_os().nth(1).context("usage: make_sample OUTPUT.glb")?;
    let bytes = make_sample()?;
    std::fs::write(&path, &bytes).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use glam::{DVec2, DVec3};

    use super::*;
    use crate::atlas::{SIZE, touched};
    use crate::model::CHARTS;

    /// Texels that must lie free between two charts at full size.
    const GAP: usize = 7;

    fn made() -> (Model, Atlas) {
        let model = make_model();
        let atlas = Atlas::new(&model);
        (model, atlas)
    }

    /// The points as the file holds them, welded bitwise; one index per corner.
    fn welded(model: &Model) -> Vec<[usize; 3]> {
        let mut known = BTreeMap::new();
        let mut weld = |position: DVec3| {
            let bits = (position.as_vec3() + 0.0).to_array().map(f32::to_bits);
            let next = known.len();
            *known.entry(bits).or_insert(next)
        };
        model.triangles.iter().map(|t| model.positions(t).map(&mut weld)).collect()
    }

    #[test]
    fn the_committed_file_is_what_the_program_makes() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/sample.glb");
        let committed = std::fs::read(path).unwrap();
        let made = make_sample().unwrap();
        assert!(committed == made, "run `cargo run --release --example make_sample -- {path}`");
        assert!(made.len() < 3_000_000);
        gltf::Gltf::from_slice(&made).unwrap();
    }

    #[test]
    fn the_surface_is_closed_and_manifold_with_one_handle() {
        let (model, _) = made();
        let triangles = welded(&model);
        let mut edges = BTreeMap::<(usize, usize), usize>::new();
        for [a, b, c] in &triangles {
            for edge in [(*a, *b), (*b, *c), (*c, *a)] {
                *edges.entry(edge).or_default() += 1;
            }
        }
        assert!(edges.iter().all(|(&(a, b), &n)| n == 1 && edges.get(&(b, a)) == Some(&1)));
        // Around each point the triangles form one fan: following them from one comes back to it
        // only after all.
        let mut fans = vec![BTreeMap::new(); model.points.len()];
        for &[a, b, c] in &triangles {
            for (center, from, to) in [(a, b, c), (b, c, a), (c, a, b)] {
                fans[center].insert(from, to);
            }
        }
        for fan in &fans {
            let start = *fan.keys().next().unwrap();
            let (mut at, mut count) = (fan[&start], 1);
            while at != start {
                (at, count) = (fan[&at], count + 1);
            }
            assert_eq!(count, fan.len());
        }
        assert_eq!(fans.len() + triangles.len(), edges.len() / 2, "Euler number 0: a torus");
        let volume: f64 = model.triangles.iter().map(|t| model.positions(t)).map(volume_to).sum();
        assert!(volume > 0.0, "the faces look out");
    }

    /// Six times the signed volume between a triangle and the origin.
    fn volume_to([a, b, c]: [DVec3; 3]) -> f64 {
        a.dot(b.cross(c))
    }

    #[test]
    fn no_triangle_is_degenerate() {
        let (model, atlas) = made();
        for (triangle, uvs) in model.triangles.iter().zip(&atlas.uvs) {
            let [a, b, c] = model.positions(triangle).map(DVec3::as_vec3);
            let area = 0.5 * (b - a).cross(c - a).length();
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            assert!(2.0 * area / (longest * longest) > 0.02, "a sliver in {:?}", triangle.part);
            let texels = 0.5 * twice_area(uvs.map(|uv| uv * SIZE as f64)).abs();
            assert!(texels > 0.05, "no texture in {:?}", triangle.part);
        }
    }

    fn twice_area([a, b, c]: [DVec2; 3]) -> f64 {
        (b - a).perp_dot(c - a)
    }

    #[test]
    fn charts_keep_their_distance_and_wind_one_way() {
        let (model, atlas) = made();
        let mut owner = vec![None; SIZE * SIZE];
        for (triangle, uvs) in model.triangles.iter().zip(&atlas.uvs) {
            // v points down, so an outside that is not mirrored winds clockwise in numbers.
            assert_eq!(twice_area(*uvs) > 0.0, CHARTS[triangle.chart].mirrored);
            for (x, y) in touched(uvs.map(|uv| uv * SIZE as f64)) {
                let old = owner[y * SIZE + x].replace(triangle.chart);
                assert!(old.is_none_or(|old| old == triangle.chart), "two charts at {x}, {y}");
            }
        }
        assert!(CHARTS.iter().any(|chart| chart.mirrored));
        for (at, chart) in owner.iter().enumerate().filter(|(_, chart)| chart.is_some()) {
            let (x, y) = (at % SIZE, at / SIZE);
            for ny in y..(y + GAP + 1).min(SIZE) {
                for nx in x.saturating_sub(GAP)..(x + GAP + 1).min(SIZE) {
                    let near = owner[ny * SIZE + nx];
                    assert!(near.is_none() || near == *chart, "too near at {x}, {y}");
                }
            }
        }
    }

    #[test]
    fn no_chart_overlaps_itself() {
        let (_, atlas) = made();
        // Two samples a texel, off every likely edge.
        let side = 2 * SIZE;
        let mut seen = vec![false; side * side];
        for uvs in &atlas.uvs {
            let corners = uvs.map(|uv| uv * side as f64);
            let whole = twice_area(corners);
            let [a, b, c] = corners;
            for (x, y) in touched(corners) {
                let sample = DVec2::new(x as f64 + 0.5123, y as f64 + 0.4877);
                let parts = [[sample, b, c], [a, sample, c], [a, b, sample]];
                if parts.iter().all(|part| twice_area(*part) / whole > 1e-9) {
                    assert!(
                        !std::mem::replace(&mut seen[y * side + x], true),
                        "overlap at {x}, {y}"
                    );
                }
            }
        }
    }
}
