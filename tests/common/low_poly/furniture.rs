//! What stands in a room.

use std::f32::consts::PI;

use glam::{Vec2, Vec3, vec2, vec3};

use super::forms::{
    Edges, ball, bar, block, card, hollow_prism, lathe, loft, on_circle, prism, ring, rod, sheet,
};
use super::prop::{Finish, Prop};
use super::solid::Solid;

const WOOD: u32 = 0x9a6a3c;
const DARK_WOOD: u32 = 0x5e3d22;
const IRON: u32 = 0x4a4f55;

/// A round table with a vase on it, and four chairs that are one mesh.
pub(crate) fn table_and_chairs() -> Prop {
    let top = lathe(
        &[[0.0, 0.72], [0.58, 0.72], [0.6, 0.74], [0.58, 0.76], [0.0, 0.76]],
        24,
        Edges::Bands,
    );
    let foot = (0..4).map(|at| {
        let [x, z] = on_circle(0.42, at, 4).to_array();
        bar(vec3(0.0, 0.12, 0.0), vec3(x, 0.0, z), 0.05)
    });
    let column = rod(0.05, 0.04, 0.72, 8).with(Solid::of(foot));
    let vase = [[0.0, 0.0], [0.04, 0.0], [0.07, 0.06], [0.03, 0.14], [0.04, 0.17], [0.0, 0.15]];
    let vase = lathe(&vase, 12, Edges::Smooth).moved(0.1, 0.76, 0.05);
    let legs = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, z]| {
        let (at, height) = (0.18, if z < 0.0 { 0.9 } else { 0.45 });
        block(0.035, height, 0.035).moved(x * at, 0.0, z * at)
    });
    let slats = [0.55, 0.67, 0.79].map(|y| block(0.36, 0.07, 0.02).moved(0.0, y, -0.18));
    let seat = block(0.42, 0.04, 0.42).moved(0.0, 0.44, 0.0);
    let places = (0..4).map(|at| {
        let [x, z] = on_circle(0.75, 2 * at + 1, 8).to_array();
        ([x, 0.0, z], -90.0 * at as f32 - 135.0, 1.0)
    });
    Prop::new(Finish::Striped)
        .mesh("table", vec![(WOOD, top), (DARK_WOOD, column), (0x3a6ea5, vase)])
        .placed(
            "chair",
            places.collect(),
            vec![(WOOD, seat.with(Solid::of(slats))), (DARK_WOOD, Solid::of(legs))],
        )
}

/// A barrel of facets with three bands and a tap.
pub(crate) fn barrel() -> Prop {
    let radius = |y: f32| 0.32 + 0.1 * (y * PI).sin();
    let side = (0..=6).map(|at| at as f32 / 6.0).map(|y| [radius(y), y]);
    let ends = [[[0.0, 0.05], [0.28, 0.05]], [[0.28, 0.95], [0.0, 0.95]]];
    let profile: Vec<_> = ends[0].into_iter().chain(side).chain(ends[1]).collect();
    let staves = lathe(&profile, 18, Edges::Facets);
    let band = |y: f32| {
        let [low, high] = [y - 0.03, y + 0.03];
        let [inside, outside] = [radius(y) - 0.02, radius(y) + 0.015];
        let around =
            [[inside, low], [outside, low], [outside, high], [inside, high], [inside, low]];
        lathe(&around, 18, Edges::Bands)
    };
    let tap = rod(0.02, 0.02, 0.12, 8).turned(Vec3::X, 90.0).moved(0.0, 0.2, 0.36);
    let handle = block(0.1, 0.02, 0.02).moved(0.0, 0.21, 0.46);
    Prop::new(Finish::Striped)
        .mesh("staves", vec![(WOOD, staves)])
        .mesh("bands", vec![(IRON, Solid::of([0.15, 0.5, 0.85].map(band)))])
        .mesh("tap", vec![(0xc9a23c, tap.with(handle))])
}

/// A shelf of five boards with sixty books, every one a box of its own.
pub(crate) fn bookshelf() -> Prop {
    let sides = [-0.5, 0.5].map(|x| block(0.04, 1.8, 0.3).moved(x, 0.0, 0.0));
    let boards = (0..5).map(|at| block(0.96, 0.04, 0.3).moved(0.0, 0.05 + 0.42 * at as f32, 0.0));
    let back = block(0.96, 1.72, 0.02).moved(0.0, 0.05, -0.15);
    let mut pieces = vec![(DARK_WOOD, Solid::of(sides).with(Solid::of(boards)).with(back))];
    let colors = [0xa33b2e, 0x2e6ea3, 0x3f8f4f, 0xd9b44a, 0x6b4a8f];
    for shelf in 0..4 {
        for book in 0..15 {
            let kind = (7 * book + 5 * shelf) % 11;
            let (width, height) = (0.035 + 0.002 * kind as f32, 0.22 + 0.012 * kind as f32);
            let lean = if kind == 3 { 8.0 } else { 0.0 };
            let x = -0.44 + 0.062 * book as f32;
            let book = block(width, height, 0.2).turned(Vec3::Z, lean);
            let y = 0.095 + 0.42 * shelf as f32;
            pieces.push((colors[kind % 5], book.moved(x, y, -0.02)));
        }
    }
    Prop::single(Finish::Palette, pieces)
}

/// Four crates with frames and crosses, one mesh.
pub(crate) fn crate_stack() -> Prop {
    let core = block(0.9, 0.9, 0.9).moved(0.0, 0.05, 0.0);
    let ends = [-0.46, 0.46];
    let mut frame = Vec::new();
    for (a, b) in ends.into_iter().flat_map(|a| ends.map(|b| (a, b))) {
        let middle = |t: f32| t + 0.5;
        frame.push(bar(vec3(a, 0.0, b), vec3(a, 1.0, b), 0.1));
        frame.push(bar(vec3(-0.41, middle(a), b), vec3(0.41, middle(a), b), 0.09));
        frame.push(bar(vec3(a, middle(b), -0.41), vec3(a, middle(b), 0.41), 0.09));
    }
    let crosses = [0.0, 90.0, 180.0, 270.0].map(|turn| {
        let cross = bar(vec3(-0.38, 0.12, 0.45), vec3(0.38, 0.88, 0.45), 0.07);
        cross.turned(Vec3::Y, turn)
    });
    let places = vec![
        ([-0.55, 0.0, 0.0], 3.0, 1.0),
        ([0.55, 0.0, 0.05], -8.0, 1.0),
        ([0.0, 1.0, 0.0], 20.0, 1.0),
        ([-0.3, 0.0, 1.0], 40.0, 0.6),
    ];
    let frame = Solid::of(frame).with(Solid::of(crosses));
    Prop::new(Finish::Plain).placed("crate", places, vec![(WOOD, core), (DARK_WOOD, frame)])
}

/// Quads around the cup, and its radii and heights from the foot out, over the rim and down inside.
const CUP_SIDES: usize = 16;
const CUP: [[f32; 2]; 11] = [
    [0.0, 0.0],
    [0.22, 0.0],
    [0.3, 0.12],
    [0.36, 0.26],
    [0.38, 0.4],
    [0.4, 0.52],
    [0.37, 0.52],
    [0.34, 0.4],
    [0.27, 0.14],
    [0.2, 0.05],
    [0.0, 0.05],
];

/// The corners of a quad of the cup.
fn cup_quad(column: usize, row: usize) -> [Vec3; 4] {
    [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[c, r]| {
        let [radius, y] = CUP[row + r];
        let [x, z] = on_circle(radius, column + c, CUP_SIDES).to_array();
        vec3(x, y, -z)
    })
}

/// A tube from one quad of the cup's outside to another below, whose corners it shares.
fn cup_handle(high: [Vec3; 4], low: [Vec3; 4]) -> Solid {
    let middle = |corners: [Vec3; 4]| corners.iter().sum::<Vec3>() / 4.0;
    let (from, to) = (middle(high), middle(low));
    let out = to.with_y(0.0).normalize();
    // What is up in the upper quad is out where the handle hangs, and down in the lower.
    let pairs = [[3, 0], [2, 1], [1, 2], [0, 3]].map(|[h, l]| (high[h], low[l]));
    let outline = |step: usize| {
        let t = step as f32 / 8.0;
        let bend = (t * PI).sin();
        pairs.map(|(h, l)| match step {
            0 => h,
            8 => l,
            _ => {
                let slim = 1.0 - 0.5 * bend;
                let across = (h - from).lerp(l - to, t) * slim;
                let up = (h - from).y * (1.0 - t) - (l - to).y * t;
                let turned = across.with_y(slim * up * (t * PI).cos()) + bend * slim * up * out;
                from.lerp(to, t) + 0.26 * bend * out + turned
            }
        })
    };
    let outlines: Vec<_> = (0..=8).map(outline).collect();
    sheet(4, 8, Edges::Smooth, |column, row| outlines[row][(4 - column) % 4])
}

/// A cup of one shell with its handle grown to it, a saucer, and two lumps of sugar.
pub(crate) fn cup() -> Prop {
    let mut shell = Solid::default();
    let group = shell.group();
    let rows = CUP.len() - 1;
    for (row, column) in (0..rows).flat_map(|row| (0..CUP_SIDES).map(move |c| (row, c))) {
        // The handle ends in the quads that are left out.
        if column != 0 || (row != 1 && row != 4) {
            let uvs = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[c, r]| {
                let u = (column + c) as f32 / CUP_SIDES as f32;
                vec2(u, 1.0 - (row + r) as f32 / rows as f32)
            });
            shell.quad_at(group, cup_quad(column, row), uvs);
        }
    }
    let handle = cup_handle(cup_quad(0, 4), cup_quad(0, 1));
    let saucer =
        [[0.0, -0.06], [0.3, -0.06], [0.55, 0.0], [0.54, 0.02], [0.28, -0.03], [0.0, -0.03]];
    let saucer = lathe(&saucer, 20, Edges::Bands);
    let sugar = [[0.42, 12.0], [-0.43, 40.0]]
        .map(|[x, turn]| block(0.07, 0.07, 0.07).turned(Vec3::Y, turn).moved(x, 0.02, 0.1));
    Prop::new(Finish::Plain)
        .mesh("cup", vec![(0xd8d2c4, shell.with(handle))])
        .mesh("saucer", vec![(0x7a9e9f, saucer)])
        .mesh("sugar", vec![(0xffffff, Solid::of(sugar))])
}

/// A frame of moldings around a picture, with a stay behind.
pub(crate) fn picture_frame() -> Prop {
    let outline = |x: f32, y: f32| -> Vec<Vec2> {
        let corners = [[-x, -y], [x, -y], [x, y], [-x, y]].map(Vec2::from);
        let side = |at: usize| {
            let (from, to) = (corners[at], corners[(at + 1) % 4]);
            (0..6).map(move |step| from.lerp(to, step as f32 / 6.0))
        };
        (0..4).flat_map(side).collect()
    };
    let outer = hollow_prism(&outline(0.5, 0.65), &outline(0.42, 0.57), 0.06);
    let inner =
        hollow_prism(&outline(0.43, 0.58), &outline(0.38, 0.53), 0.03).moved(0.0, 0.0, 0.02);
    let beads = (0..4).map(|at| {
        let (x, y) = if at < 2 { (0.46, 0.61) } else { (-0.46, -0.61) };
        let y = if at % 2 == 0 { y } else { -y };
        ball(0.03, 8, 4).moved(x, y, 0.035)
    });
    let picture = card(0.8, 1.1).moved(0.0, -0.55, 0.01);
    let stay =
        prism(&[vec2(-0.1, -0.65), vec2(0.1, -0.65), vec2(0.04, 0.2), vec2(-0.04, 0.2)], 0.01);
    let stay = stay.turned(Vec3::X, 18.0).moved(0.0, 0.0, -0.23);
    Prop::new(Finish::Striped)
        .mesh("frame", vec![(0xb8923a, outer), (0x6b4f1d, inner), (0xb8923a, Solid::of(beads))])
        .mesh("picture", vec![(0x88b0d0, picture)])
        .mesh("stay", vec![(0x40301c, stay)])
}

/// A spoon of one smooth shell, on a folded napkin.
pub(crate) fn spoon() -> Prop {
    let outline = |at: usize| -> Vec<Vec3> {
        let t = at as f32 / 22.0;
        let bowl = ((t - 0.66) / 0.34).clamp(0.0, 1.0);
        let width = if bowl > 0.0 {
            0.03 + 0.14 * (bowl * PI).sin().max(0.0).sqrt() * (1.0 - 0.2 * bowl)
        } else {
            0.03 + 0.03 * (1.0 - t / 0.66).powi(2)
        };
        let dip = 0.09 * (bowl * PI).sin();
        let lift = 0.12 + 0.05 * (t * PI).sin() - 0.06 * t;
        let point = |side: usize| {
            let [across, up] = on_circle(1.0, side, 12).to_array();
            let hollow = dip * (1.0 - across * across);
            vec3(1.6 * t, lift - hollow + 0.012 * up, -width * across)
        };
        (0..12).map(point).collect()
    };
    let spoon = loft(&(0..=22).map(outline).collect::<Vec<_>>(), Edges::Smooth);
    let napkin = [0.0, 0.02, 0.04]
        .map(|y| block(0.7 - y, 0.015, 0.9).turned(Vec3::Y, 40.0 * y).moved(0.8, y, 0.0));
    let clasp = ring(0.09, 0.012, 16, 6).turned(Vec3::Z, 90.0).scaled(1.0, 0.6, 1.0);
    Prop::new(Finish::Plain)
        .mesh("spoon", vec![(0xb8bcc2, spoon)])
        .mesh("napkin", vec![(0xc25b4e, Solid::of(napkin))])
        .mesh("clasp", vec![(0xd0a030, clasp.moved(0.45, 0.13, 0.0))])
}
