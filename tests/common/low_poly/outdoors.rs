//! What stands in a street or grows in a wood.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3, vec3};

use super::forms::{Edges, ball, block, card, lathe, on_circle, prism, ring, rod, sheet, tube};
use super::prop::{Finish, Prop};
use super::solid::Solid;

const GREEN: u32 = 0x4c8a3a;
const BARK: u32 = 0x6b4a2f;
const DARK: u32 = 0x26292c;

/// A ball on a floor of two triangles beside boxes of twelve.
pub(crate) fn ball_on_floor() -> Prop {
    let floor = card(8.0, 8.0).turned(Vec3::X, -90.0).moved(0.0, 0.0, 4.0);
    Prop::new(Finish::Striped)
        .mesh("floor", vec![(0xb0a898, floor)])
        .mesh("ball", vec![(0xd04030, ball(1.0, 32, 20).moved(0.0, 1.0, 0.0))])
        .mesh("low box", vec![(0x3060a0, block(1.4, 0.6, 1.0).moved(2.2, 0.0, 1.0))])
        .mesh("tall box", vec![(0x308050, block(0.8, 2.4, 0.8).moved(-2.4, 0.0, -1.2))])
}

/// A mast with an arm, and a box with hoods over three small lamps; one mesh.
pub(crate) fn traffic_light() -> Prop {
    let mast = rod(0.12, 0.08, 4.0, 10).with(rod(0.3, 0.25, 0.2, 10));
    let arm = tube(&[vec3(0.0, 3.6, 0.0), vec3(0.9, 3.95, 0.0), vec3(2.4, 4.0, 0.0)], 0.06, 6);
    let mut pieces = vec![(0x5b6065, mast.with(arm))];
    for [x, y] in [[0.0, 2.2], [2.4, 3.2]] {
        let case = block(0.4, 1.1, 0.25).moved(x, y, 0.2);
        pieces.push((DARK, case));
        for (at, color) in [0x20d040, 0xf0b020, 0xe02018].into_iter().enumerate() {
            let y = y + 0.2 + 0.35 * at as f32;
            pieces.push((color, ball(0.1, 8, 6).scaled(1.0, 1.0, 0.5).moved(x, y, 0.33)));
            let hood = block(0.26, 0.02, 0.2).moved(0.0, 0.12, 0.0).with(Solid::of(
                [-0.12, 0.12].map(|x| block(0.02, 0.16, 0.18).moved(x, -0.03, -0.01)),
            ));
            pieces.push((DARK, hood.moved(x, y, 0.42)));
        }
    }
    Prop::single(Finish::Palette, pieces)
}

/// A lamp on a bent mast, and four of a string of small colored ones.
pub(crate) fn street_lamp() -> Prop {
    let bend = |at: usize| {
        let t = at as f32 / 10.0;
        vec3(0.7 * (1.0 - (t * TAU / 4.0).cos()), 3.2 + 0.7 * (t * TAU / 4.0).sin(), 0.0)
    };
    let mast: Vec<_> = [vec3(0.0, 0.0, 0.0)].into_iter().chain((0..=10).map(bend)).collect();
    let foot = lathe(
        &[[0.0, 0.0], [0.3, 0.0], [0.3, 0.1], [0.15, 0.2], [0.1, 0.6], [0.0, 0.6]],
        8,
        Edges::Facets,
    );
    let shade = [[0.0, 0.1], [0.28, 0.0], [0.1, 0.3], [0.0, 0.32]];
    let shade = lathe(&shade, 12, Edges::Bands).moved(0.75, 3.7, 0.0);
    let bulb = ball(0.12, 10, 6).moved(0.75, 3.72, 0.0);
    let string = (0..4).map(|at| {
        let y = 1.2 + 0.5 * at as f32;
        let color = [0xe03030, 0x30b0e0, 0xf0d030, 0x50d050][at];
        (color, ball(0.06, 6, 4).moved(0.14, y, 0.0))
    });
    Prop::new(Finish::Plain)
        .mesh("mast", vec![(0x39434a, tube(&mast, 0.06, 8).with(foot))])
        .mesh("head", vec![(0x39434a, shade), (0xfff4c8, bulb)])
        .mesh("string", string.collect())
}

/// A hundred and fifty leaves that are single quads, on six bent stalks of crossed cards.
pub(crate) fn foliage() -> Prop {
    let mut leaves = Vec::new();
    for at in 0..150_u16 {
        let turn = 137.5 * f32::from(at);
        let height = 0.1 + 0.009 * f32::from(at);
        let reach = 0.75 - 0.35 * height;
        let leaf = card(0.22, 0.34).turned(Vec3::X, 20.0 + f32::from(at * 7 % 50));
        let leaf = leaf.moved(0.0, height, reach * f32::from(at * 5 % 9) / 9.0);
        leaves.push(leaf.turned(Vec3::Y, turn));
    }
    let stalks = (0..6).map(|at| {
        let cross = card(0.05, 1.2).with(card(0.05, 1.2).turned(Vec3::Y, 90.0));
        cross.turned(Vec3::X, 12.0).turned(Vec3::Y, 60.0 * at as f32)
    });
    Prop::single(Finish::Leaf, vec![(GREEN, Solid::of(leaves)), (BARK, Solid::of(stalks))])
}

/// A trunk with branches under crowns of crossed cards, in three meshes.
pub(crate) fn tree() -> Prop {
    let profile = [[0.0, 0.0], [0.4, 0.0], [0.22, 0.5], [0.18, 2.0], [0.08, 3.4], [0.0, 3.4]];
    let trunk = lathe(&profile, 9, Edges::Smooth);
    let branches = (0..5).map(|at| {
        let y = 1.6 + 0.3 * at as f32;
        let tip = on_circle(0.9, 2 * at, 5);
        let path = [
            vec3(0.0, y, 0.0),
            vec3(0.4 * tip.x, y + 0.15, 0.4 * tip.y),
            vec3(tip.x, y + 0.7, tip.y),
        ];
        tube(&path, 0.06, 5)
    });
    let crown = |count: usize, spread: f32| {
        Solid::of((0..count).map(|at| {
            let size = 0.7 + 0.05 * (at % 5) as f32;
            let card = card(size, size).turned(Vec3::X, -25.0 + 9.0 * (at % 6) as f32);
            let y = 1.9 + spread * (at * 7 % count) as f32 / count as f32;
            card.moved(0.0, y, 0.15 + 0.12 * (at % 7) as f32).turned(Vec3::Y, 137.5 * at as f32)
        }))
    };
    Prop::new(Finish::TwoSided)
        .mesh("trunk", vec![(BARK, trunk.with(Solid::of(branches)))])
        .mesh("crown", vec![(GREEN, crown(90, 2.0))])
        .mesh("blossoms", vec![(0xe8a0b8, crown(24, 1.8).scaled(1.1, 1.02, 1.1))])
}

/// A post with five pointing boards and a lantern.
pub(crate) fn signpost() -> Prop {
    let post = rod(0.1, 0.08, 3.0, 8).with(ball(0.13, 8, 6).moved(0.0, 3.05, 0.0));
    let board = |at: usize| {
        let arrow = [[0.0, 0.0], [1.0, 0.0], [1.2, 0.15], [1.0, 0.3], [0.0, 0.3], [-0.1, 0.15]];
        let board = prism(&arrow.map(Vec2::from), 0.06);
        let letters = (0..4)
            .map(|letter| block(0.12, 0.14, 0.02).moved(0.25 + 0.18 * letter as f32, 0.08, 0.035));
        let turned = |solid: Solid| {
            solid.moved(0.1, 1.2 + 0.36 * at as f32, 0.0).turned(Vec3::Y, 75.0 * at as f32)
        };
        (turned(board), turned(Solid::of(letters)))
    };
    let (boards, letters): (Vec<_>, Vec<_>) = (0..5).map(board).unzip();
    let lantern = lathe(&[[0.0, 0.0], [0.1, 0.0], [0.14, 0.22], [0.0, 0.32]], 6, Edges::Facets);
    let lantern = lantern.with(ring(0.05, 0.01, 10, 4).turned(Vec3::X, 90.0).moved(0.0, 0.36, 0.0));
    Prop::new(Finish::Striped)
        .mesh("post", vec![(0x7a5230, post)])
        .mesh("boards", vec![(0xc8a878, Solid::of(boards)), (0x2a2018, Solid::of(letters))])
        .placed("lantern", vec![([-0.3, 2.2, 0.0], 15.0, 1.2)], vec![(0xd0902a, lantern)])
}

/// Three mushrooms with spots, eyes and pupils, each a shell of its own; one mesh.
pub(crate) fn mushrooms() -> Prop {
    let mut pieces = Vec::new();
    for [x, z, size, turn] in
        [[0.0, 0.0, 1.0, 10.0], [0.9, 0.4, 0.6, -25.0], [-0.7, 0.5, 0.45, 40.0]]
    {
        let cap = [[0.0, 0.62], [0.5, 0.6], [0.56, 0.7], [0.45, 0.95], [0.25, 1.12], [0.0, 1.18]];
        let stem = [[0.0, 0.0], [0.22, 0.0], [0.18, 0.3], [0.15, 0.64], [0.0, 0.64]];
        let spots = (0..5).map(|at| {
            let spot = ball(0.09, 6, 4).scaled(1.0, 0.5, 1.0).moved(0.36, 1.0, 0.0);
            spot.turned(Vec3::Y, 72.0 * at as f32)
        });
        let eyes = |radius: f32, forward: f32| {
            Solid::of([-0.08, 0.08].map(|x| ball(radius, 6, 4).moved(x, 0.42, forward)))
        };
        let place =
            |solid: Solid| solid.turned(Vec3::Y, turn).scaled(size, size, size).moved(x, 0.0, z);
        pieces.extend([
            (0xc03028, place(lathe(&cap, 14, Edges::Bands))),
            (0xefe4cf, place(lathe(&stem, 10, Edges::Smooth))),
            (0xfaf6ea, place(Solid::of(spots))),
            (0xffffff, place(eyes(0.05, 0.16))),
            (0x101010, place(eyes(0.025, 0.2))),
        ]);
    }
    Prop::single(Finish::Palette, pieces)
}

/// A hung cloth, its two sides one upon the other, between two poles.
pub(crate) fn doubled_sheet() -> Prop {
    let cloth = sheet(24, 16, Edges::Smooth, |column, row| {
        let [u, v] = [column as f32 / 24.0, row as f32 / 16.0];
        let wave = 0.12 * (3.0 * TAU * u).sin() * (1.0 - 0.6 * v);
        vec3(2.0 * u - 1.0, 0.5 + 1.4 * v - 0.1 * (TAU * u / 2.0).sin(), wave)
    });
    let back = cloth.clone().flipped();
    let poles = [-1.05, 1.05].map(|x| rod(0.04, 0.03, 2.1, 8).moved(x, 0.0, 0.0));
    Prop::single(Finish::Striped, vec![(0x4a7ab0, cloth.with(back)), (0x8a6a40, Solid::of(poles))])
}
