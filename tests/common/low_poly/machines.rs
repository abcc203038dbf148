//! What rolls, floats, turns and sounds.

use glam::{Vec2, Vec3, vec3};

use super::forms::{
    Edges, ball, bar, block, hollow_prism, lathe, loft, on_circle, prism, ring, rod, tube,
};
use super::prop::{Finish, Prop};
use super::solid::Solid;

const STEEL: u32 = 0x8a9096;
const BLACK: u32 = 0x202226;

/// A box with two cones, each in rings, four screws, and a grid of feet.
pub(crate) fn speaker() -> Prop {
    let cone = |radius: f32, y: f32| {
        let profile =
            [[0.0, -0.12], [0.9, -0.04], [0.9, 0.05], [0.35, -0.06], [0.2, 0.0], [0.0, 0.02]];
        let cone = lathe(&profile.map(|[r, h]| [r * radius, h]), 16, Edges::Bands);
        cone.turned(Vec3::X, 90.0).moved(0.0, y, 0.28)
    };
    let rings = |radius: f32, y: f32| {
        let [outer, inner] = [ring(radius, 0.025, 16, 5), ring(0.7 * radius, 0.015, 12, 4)];
        outer.with(inner).turned(Vec3::X, 90.0).moved(0.0, y, 0.27)
    };
    let screws = [[-1.0, 0.1], [1.0, 0.1], [-1.0, 1.5], [1.0, 1.5]]
        .map(|[x, y]| ball(0.02, 6, 4).moved(0.35 * x, y, 0.26));
    let feet = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
        .map(|[x, z]| rod(0.04, 0.05, 0.06, 8).moved(0.32 * x, -0.06, 0.18 * z));
    Prop::new(Finish::Plain)
        .mesh("box", vec![(0x5a3a26, block(0.84, 1.6, 0.52)), (BLACK, Solid::of(feet))])
        .mesh("cones", vec![(BLACK, cone(0.3, 0.5).with(cone(0.18, 1.2)))])
        .mesh("rings", vec![(STEEL, rings(0.3, 0.5).with(rings(0.18, 1.2)))])
        .mesh("screws", vec![(0xd0d4d8, Solid::of(screws))])
}

/// A hull with a cabin and a funnel, and tyres hung along both sides; one mesh.
pub(crate) fn tugboat() -> Prop {
    let beam = |x: f32| if x > 0.0 { 0.55 * (1.0 - x * x / 4.2) } else { 0.55 - 0.01 * x * x };
    let section = |at: usize| -> Vec<Vec3> {
        let x = 2.0 - at as f32 * 0.4;
        let width = beam(x);
        let sheer = 0.08 * x * x * 0.5;
        let points = [[1.0, 0.45], [0.9, 0.1], [0.5, -0.25], [0.0, -0.35]];
        let right = points.map(|[z, y]| [z, if y > 0.2 { y + sheer } else { y }]);
        let left = right[..3].iter().rev().map(|&[z, y]| [-z, y]);
        let around: Vec<_> = right.into_iter().chain(left).collect();
        around.into_iter().rev().map(|[z, y]| vec3(x, y, width * z)).collect()
    };
    let hull = loft(&(0..=10).map(section).collect::<Vec<_>>(), Edges::Facets);
    let tyres = (0..5).flat_map(|at| {
        let x = -1.3 + 0.6 * at as f32;
        [-1.0, 1.0].map(|side| {
            let tyre = ring(0.16, 0.06, 10, 5).turned(Vec3::X, 90.0);
            tyre.moved(x, 0.22, side * (beam(x) + 0.03))
        })
    });
    let cabin = block(0.9, 0.55, 0.6)
        .moved(-0.1, 0.45, 0.0)
        .with(block(1.05, 0.06, 0.72).moved(-0.1, 1.0, 0.0));
    let windows = [-0.35, -0.1, 0.15]
        .into_iter()
        .flat_map(|x| [-1.0, 1.0].map(|side| block(0.16, 0.18, 0.02).moved(x, 0.72, 0.305 * side)));
    let funnel = rod(0.14, 0.12, 0.6, 10).moved(-0.85, 0.45, 0.0);
    let rail = tube(&[vec3(0.5, 0.65, 0.35), vec3(1.2, 0.75, 0.25), vec3(1.7, 0.85, 0.0)], 0.02, 5);
    Prop::single(
        Finish::Plain,
        vec![
            (0x2e4a6b, hull),
            (0xe6e0d0, cabin),
            (0xa8d0e0, Solid::of(windows)),
            (0xb03a2e, funnel),
            (BLACK, Solid::of(tyres)),
            (STEEL, rail),
        ],
    )
}

/// Twelve links of a chain, each a ring drawn long, by turns upright and flat, and a lock.
pub(crate) fn chain() -> Prop {
    let link = |at: usize| {
        let link = ring(0.16, 0.045, 12, 6).mapped(|p| p + vec3(p.x.signum() * 0.1, 0.0, 0.0));
        let droop = 0.03 * (at as f32 - 5.5).powi(2);
        link.turned(Vec3::X, 90.0 * (at % 2) as f32).moved(0.42 * at as f32, droop, 0.0)
    };
    let links = (0..12).map(|at| (STEEL - 0x101010 * (at % 3) as u32, link(at)));
    let lock = block(0.3, 0.36, 0.14).moved(-0.12, 0.53, 0.0);
    Prop::single(Finish::Palette, links.chain([(0xc0902c, lock)]).collect())
}

/// A gear with a bore and a keyed hub.
pub(crate) fn gear() -> Prop {
    let (teeth, points) = (24, 96);
    let outer: Vec<Vec2> = (0..points)
        .map(|at| {
            let radius = if matches!(at % 4, 1 | 2) { 1.0 } else { 0.84 };
            on_circle(radius, at, points)
        })
        .collect();
    assert_eq!(outer.len(), 4 * teeth, "four points for each tooth");
    let bore: Vec<Vec2> = (0..points).map(|at| on_circle(0.3, at, points)).collect();
    let hub = (0..24).map(|at| on_circle(0.45, at, 24)).collect::<Vec<_>>();
    let hole = (0..24).map(|at| on_circle(0.29, at, 24)).collect::<Vec<_>>();
    let pins = (0..5).map(|at| {
        let [x, y] = on_circle(0.63, at, 5).to_array();
        rod(0.06, 0.06, 0.34, 8).turned(Vec3::X, 90.0).moved(x, y, -0.17)
    });
    Prop::single(
        Finish::Plain,
        vec![
            (STEEL, hollow_prism(&outer, &bore, 0.2)),
            (0x6a7076, hollow_prism(&hub, &hole, 0.4)),
            (0xc08a3a, Solid::of(pins)),
        ],
    )
}

/// A tyre, a rim, a hub and eighteen spokes.
pub(crate) fn bicycle_wheel() -> Prop {
    let flat = |solid: Solid| solid.turned(Vec3::X, 90.0);
    let rim = [[0.86, -0.03], [0.92, -0.03], [0.92, 0.03], [0.86, 0.03], [0.86, -0.03]];
    let spokes = (0..18).map(|at| {
        let side = if at % 2 == 0 { 0.06 } else { -0.06 };
        let (from, to) = (on_circle(0.06, at + 2, 18), on_circle(0.87, at, 18));
        bar(from.extend(side), to.extend(0.0), 0.012)
    });
    let hub = flat(rod(0.07, 0.07, 0.16, 10)).moved(0.0, 0.0, -0.08);
    let axle = flat(rod(0.02, 0.02, 0.3, 6)).moved(0.0, 0.0, -0.15);
    Prop::single(
        Finish::Plain,
        vec![
            (BLACK, flat(ring(0.97, 0.05, 32, 6))),
            (STEEL, flat(lathe(&rim, 32, Edges::Bands))),
            (0xb0b4b8, Solid::of(spokes)),
            (0x50565c, hub.with(axle)),
        ],
    )
}

/// A car of boxes with round wheels, headlights, and a number plate.
pub(crate) fn car() -> Prop {
    let side = [
        [-2.0, 0.35],
        [2.0, 0.35],
        [2.05, 0.75],
        [1.2, 0.9],
        [0.6, 1.35],
        [-1.0, 1.4],
        [-1.7, 0.95],
        [-2.05, 0.9],
    ];
    let body = prism(&side.map(Vec2::from), 1.6);
    let [glass, screen] = [
        block(1.4, 0.32, 1.62).moved(-0.25, 0.98, 0.0),
        block(0.04, 0.5, 1.3).turned(Vec3::Z, 52.0).moved(1.12, 0.9, 0.0),
    ];
    let lights = |x: f32, radius: f32| {
        Solid::of([-0.6, 0.6].map(|z| ball(radius, 8, 5).scaled(0.5, 1.0, 1.0).moved(x, 0.68, z)))
    };
    let bumpers = [-2.08, 2.08].map(|x| block(0.12, 0.16, 1.66).moved(x, 0.36, 0.0));
    let plates = [-2.15, 2.15].map(|x| block(0.02, 0.12, 0.4).moved(x, 0.4, 0.0));
    let mirrors = [-0.88, 0.88].map(|z| block(0.1, 0.12, 0.16).moved(0.7, 0.98, z));
    let places = [[1.25, 0.75], [1.25, -0.75], [-1.25, 0.75], [-1.25, -0.75]]
        .map(|[x, z]| ([x, 0.36, z], if z > 0.0 { 0.0 } else { 180.0 }, 1.0));
    let tyre =
        [[0.2, -0.12], [0.34, -0.12], [0.36, -0.08], [0.36, 0.08], [0.34, 0.12], [0.2, 0.12]];
    let tyre = tyre.into_iter().chain([[0.2, -0.12]]).collect::<Vec<_>>();
    let tyre = lathe(&tyre, 16, Edges::Bands).turned(Vec3::X, 90.0);
    let cap = rod(0.21, 0.15, 0.1, 10).turned(Vec3::X, 90.0).moved(0.0, 0.0, 0.02);
    Prop::new(Finish::Plain)
        .mesh(
            "body",
            vec![
                (0xb02a24, body),
                (0x303840, glass.with(screen)),
                (STEEL, Solid::of(bumpers).with(Solid::of(mirrors))),
            ],
        )
        .mesh("lights", vec![(0xfff0b0, lights(2.05, 0.11)), (0xff2010, lights(-2.06, 0.08))])
        .mesh("plates", vec![(0xf0f0f0, Solid::of(plates))])
        .placed("wheel", places.to_vec(), vec![(BLACK, tyre), (STEEL, cap)])
}
