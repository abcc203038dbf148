//! Crowds of small open shells, as the leaves of a tree: as some go, the others grow.
//!
//! A card that vanishes takes its area with it, and no other part of the surface can stand for it: simplified
//! like anything else a tree goes bald. So each card that is gone leaves its area to the nearest that is
//! left, which is scaled about its middle (Cook, Halstead, Planck & Ryu, "Stochastic simplification of
//! aggregate detail", SIGGRAPH 2007). The area of each neighborhood stays, up to the largest scale.

use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;

use crate::chain::Level;
use crate::id::PointId;
use crate::mesh::Mesh;
use crate::sets::DisjointSets;
use crate::simplify::MAX_CARD_SCALE;
use crate::surface::Surface;
use crate::triangle::area_vector;

/// A shell that is a card.
struct Card {
    group: u32,
    points: Vec<PointId>,
    middle: DVec3,
    area: f64,
}

/// Grows the cards of a level by the area of those of the source that are gone. `cards`: one per point of the
/// source, whether it is of a card.
pub fn grow_cards(source: &Mesh, level: &mut Level, cards: &[bool]) {
    if level.mesh.triangles.len() == source.triangles.len() {
        return;
    }
    let before = find_cards(source, |point| cards[point.index()]);
    let left = find_cards(&level.mesh, |point| cards[level.point_sources[point].index()]);
    let mut areas = vec![0.0; left.len()];
    let mut groups: FxHashMap<u32, (Surface, Vec<usize>)> = FxHashMap::default();
    for card in &before {
        let (middles, own) = groups.entry(card.group).or_insert_with(|| middles(&left, card.group));
        if let Some(nearest) = middles.closest_point(card.middle.as_vec3()) {
            areas[own[nearest.triangle.index()]] += card.area;
        }
    }
    for (card, area) in left.iter().zip(areas) {
        let scale = if card.area > 0.0 { (area / card.area).sqrt() } else { 1.0 };
        let scale = scale.clamp(1.0, MAX_CARD_SCALE);
        for &point in &card.points {
            let p = &mut level.mesh.positions[point];
            *p = (card.middle + (p.as_dvec3() - card.middle) * scale).as_vec3();
        }
    }
}

/// The middles of the cards of a group, as what is nearest can be found, and their numbers.
fn middles(cards: &[Card], group: u32) -> (Surface, Vec<usize>) {
    let own: Vec<usize> = (0..cards.len()).filter(|&at| cards[at].group == group).collect();
    let places: Vec<Vec3> = own.iter().map(|&at| cards[at].middle.as_vec3()).collect();
    (Surface::new(&places, (0..places.len() as u32).map(|at| [at; 3])), own)
}

/// The shells of points that are of cards.
fn find_cards(mesh: &Mesh, is_card: impl Fn(PointId) -> bool) -> Vec<Card> {
    let mut sets = DisjointSets::new(mesh.positions.len());
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.triangle_points(triangle).map(|point| point.0);
        sets.join(a, b);
        sets.join(b, c);
    }
    let mut numbers: FxHashMap<u32, usize> = FxHashMap::default();
    let mut cards: Vec<Card> = Vec::new();
    for triangle in 0..mesh.triangles.len() {
        let points = mesh.triangle_points(triangle);
        if !is_card(points[0]) {
            continue;
        }
        let at = *numbers.entry(sets.root(points[0].0)).or_insert_with(|| {
            let group = mesh.groups[triangle];
            cards.push(Card { group, points: Vec::new(), middle: DVec3::ZERO, area: 0.0 });
            cards.len() - 1
        });
        let corners = mesh.triangle_positions(triangle);
        let (card, area) = (&mut cards[at], area_vector(corners).length() / 2.0);
        card.points.extend(points);
        card.area += area;
        card.middle += (corners[0] + corners[1] + corners[2]).as_dvec3() * (area / 3.0);
    }
    for card in &mut cards {
        card.points.sort_unstable();
        card.points.dedup();
        card.middle /= card.area.max(f64::MIN_POSITIVE);
    }
    cards
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;
    use crate::chain::simplify_chain;
    use crate::options::Options;
    use crate::settings::Settings;
    use crate::vertices::Vertices;
    use crate::weld::weld;

    /// Leaves of 2 × 1 squares, of sizes and turns of their own, `side` by `side` over 0…1.
    fn leaves(side: u32) -> Mesh {
        let (mut positions, mut indices) = (Vec::new(), Vec::new());
        for at in 0..side * side {
            let middle = Vec3::new((at % side) as f32, (at / side) as f32, 0.0) / side as f32;
            let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, at as f32, 2.7 * at as f32, 0.3);
            let size = (0.2 + 0.1 * (1.3 * at as f32).sin()) / side as f32;
            let first = positions.len() as u32;
            for row in 0..2u8 {
                for column in 0..3u8 {
                    let p = Vec3::new(f32::from(column) - 1.0, f32::from(row) - 0.5, 0.0);
                    positions.push(middle + turn * p * size);
                }
            }
            for [a, b, c, d] in [[0, 1, 4, 3], [1, 2, 5, 4]] {
                indices.extend([a, b, c, a, c, d].map(|corner: u32| first + corner));
            }
        }
        weld(&Vertices::new(&positions, &indices).unwrap()).unwrap().mesh
    }

    fn area(mesh: &Mesh, keep: impl Fn(Vec3) -> bool) -> f64 {
        let own = (0..mesh.triangles.len()).map(|t| mesh.triangle_positions(t));
        own.filter(|p| keep((p[0] + p[1] + p[2]) / 3.0)).map(|p| area_vector(p).length()).sum()
    }

    #[test]
    fn what_stays_has_the_area_of_all_in_each_quarter() {
        let source = leaves(20);
        let cards = vec![true; source.positions.len()];
        let options = Options { cards: &cards, ..Settings::for_diagonal(1.5).into() };
        let count = source.triangles.len();
        let targets = [count / 2, count / 8];
        let mut levels = simplify_chain(&source, &targets, &options, &AtomicUsize::new(0)).unwrap();
        for (level, target) in levels.iter_mut().zip(targets) {
            assert!(level.mesh.triangles.len() <= target, "{:?}", level.stopped);
            grow_cards(&source, level, &cards);
            for quarter in 0..4u8 {
                let is_in = |p: Vec3| {
                    (p.x > 0.5) == (quarter % 2 == 1) && (p.y > 0.5) == (quarter / 2 == 1)
                };
                let share = area(&level.mesh, is_in) / area(&source, is_in);
                assert!((0.75..1.3).contains(&share), "{share} of quarter {quarter}");
            }
            let whole = area(&level.mesh, |_| true) / area(&source, |_| true);
            assert!((0.95..1.01).contains(&whole), "{whole}");
        }
    }

    #[test]
    fn as_many_stay_as_can_grow_to_the_area_of_all() {
        let source = leaves(6);
        let cards = vec![true; source.positions.len()];
        let options = Options { cards: &cards, ..Settings::for_diagonal(1.5).into() };
        let mut levels = simplify_chain(&source, &[2], &options, &AtomicUsize::new(0)).unwrap();
        assert!(levels[0].stopped.is_some(), "one leaf of 36 can't stand for all");
        grow_cards(&source, &mut levels[0], &cards);
        let share = area(&levels[0].mesh, |_| true) / area(&source, |_| true);
        assert!((0.9..1.01).contains(&share), "{share}");
    }

    #[test]
    fn without_cards_leaves_are_held_by_the_limits() {
        let source = leaves(12);
        let options = Settings::for_diagonal(1.5).into();
        let level = simplify_chain(&source, &[60], &options, &AtomicUsize::new(0)).unwrap();
        assert!(level[0].stopped.is_some());
    }
}
