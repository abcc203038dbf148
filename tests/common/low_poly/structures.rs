//! What is built of walls and bars.

use std::f32::consts::FRAC_PI_2;

use glam::{Vec2, Vec3, vec2, vec3};

use super::forms::{Edges, Hole, ball, bar, block, lathe, on_circle, plate, prism, rod, tube};
use super::prop::{Finish, Prop};
use super::solid::Solid;

const STEEL: u32 = 0x7d838a;
const WOOD: u32 = 0x8f6238;
const STONE: u32 = 0x8c887e;

/// Points from one to another, both among them.
fn along(from: Vec3, to: Vec3, count: usize) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |at| from.lerp(to, at as f32 / (count - 1) as f32))
}

/// A lattice mast with red lamps at its corners and on its top.
pub(crate) fn radio_mast() -> Prop {
    let corner = |at: usize, level: usize| {
        let radius = 0.8 - 0.1 * level as f32;
        let [x, z] = on_circle(radius, at, 4).to_array();
        vec3(x, 1.2 * level as f32, z)
    };
    let mut bars = Vec::new();
    for (level, at) in (0..6).flat_map(|level| (0..4).map(move |at| (level, at))) {
        bars.push(bar(corner(at, level), corner(at, level + 1), 0.07));
        bars.push(bar(corner(at, level + 1), corner(at + 1, level + 1), 0.04));
        if level % 2 == 0 {
            bars.push(bar(corner(at, level), corner(at + 1, level + 1), 0.03));
        }
    }
    let whip = rod(0.05, 0.02, 2.0, 6).moved(0.0, 7.2, 0.0);
    let lamps = [2, 4].into_iter().flat_map(|level| (0..4).map(move |at| (at, level)));
    let lamps = lamps.map(|(at, level)| corner(at, level)).chain([vec3(0.0, 9.25, 0.0)]);
    let lamps = lamps.map(|p| ball(0.1, 6, 4).moved(p.x, p.y, p.z));
    Prop::new(Finish::Plain)
        .mesh("lattice", vec![(STEEL, Solid::of(bars)), (0xd8d8d8, whip)])
        .mesh("lamps", vec![(0xff1808, Solid::of(lamps))])
}

/// Walls with rows of small window holes, thick along the sides and single sheets at the ends,
/// under a roof; one mesh.
pub(crate) fn house() -> Prop {
    let window = |row: usize, hole: Hole| (row % 2 == 1).then_some(hole);
    let long = |turn: f32, z: f32| {
        let wall = plate([6.0, 3.0], 0.12, [10, 5], |_, row| window(row, Hole(0.5, 4)));
        wall.turned(Vec3::Y, turn).moved(0.0, 0.0, z)
    };
    let end = |turn: f32, x: f32| {
        let wall = plate([4.0, 3.0], 0.0, [6, 5], |_, row| window(row, Hole(0.45, 4)));
        wall.turned(Vec3::Y, turn).moved(x, 0.0, 0.0)
    };
    let gable = |x: f32| {
        prism(&[vec2(-2.1, 3.0), vec2(2.1, 3.0), vec2(0.0, 4.4)], 0.1)
            .turned(Vec3::Y, 90.0)
            .moved(x, 0.0, 0.0)
    };
    let roof = [-1.0, 1.0].map(|side| {
        let slope = block(6.6, 0.1, 2.9).turned(Vec3::X, side * 34.0);
        slope.moved(0.0, 3.65, side * 1.12)
    });
    let chimney = block(0.5, 1.6, 0.5).moved(1.6, 3.2, -0.6);
    let door = block(0.8, 1.6, 0.06).moved(-0.5, 0.0, 2.09);
    let walls = [long(0.0, 2.0), long(180.0, -2.0), end(90.0, 3.0), end(-90.0, -3.0)];
    Prop::single(
        Finish::TwoSided,
        vec![
            (0xd9cdb4, Solid::of(walls).with(gable(2.95)).with(gable(-2.95))),
            (0x8a3b2a, Solid::of(roof)),
            (0x7a5a4a, chimney),
            (0x3a5a40, door),
        ],
    )
}

/// Two rails on five posts with thirty bars between.
pub(crate) fn railing() -> Prop {
    let posts = along(vec3(-3.0, 0.0, 0.0), vec3(3.0, 0.0, 0.0), 5).map(|p| {
        block(0.1, 1.1, 0.1).with(ball(0.08, 8, 5).moved(0.0, 1.17, 0.0)).moved(p.x, 0.0, 0.0)
    });
    let bars = along(vec3(-2.85, 0.1, 0.0), vec3(2.85, 0.1, 0.0), 30)
        .enumerate()
        .filter(|(at, _)| at % 8 != 7)
        .map(|(_, p)| rod(0.02, 0.02, 0.9, 5).moved(p.x, p.y, 0.0));
    let hand =
        tube(&along(vec3(-3.2, 1.0, 0.0), vec3(3.2, 1.0, 0.0), 9).collect::<Vec<_>>(), 0.04, 6);
    let low = bar(vec3(-3.0, 0.12, 0.0), vec3(3.0, 0.12, 0.0), 0.05);
    Prop::new(Finish::Plain)
        .mesh("posts", vec![(0x2d3034, Solid::of(posts))])
        .mesh("rails", vec![(0x9a7b4f, hand), (STEEL, low)])
        .mesh("bars", vec![(STEEL, Solid::of(bars))])
}

/// Sixteen pointed pales on two rails, with a gate of the same, one mesh each.
pub(crate) fn picket_fence() -> Prop {
    let pale = [[-0.08, 0.0], [0.08, 0.0], [0.08, 1.0], [0.0, 1.15], [-0.08, 1.0]];
    let pale = prism(&pale.map(Vec2::from), 0.03);
    let row = |count: usize| {
        let pales = (0..count).map(|at| pale.clone().moved(0.24 * at as f32, 0.0, 0.0));
        let length = 0.24 * (count - 1) as f32;
        let rails =
            [0.25, 0.8].map(|y| block(length + 0.2, 0.09, 0.04).moved(length / 2.0, y, -0.035));
        Solid::of(pales).with(Solid::of(rails))
    };
    let brace = bar(vec3(0.0, 0.28, -0.04), vec3(0.72, 0.85, -0.04), 0.06);
    let knob = ball(0.05, 8, 5).moved(0.8, 0.6, 0.04);
    let posts = [-0.2, 3.82].map(|x| block(0.14, 1.3, 0.14).moved(x, 0.0, 0.0));
    Prop::new(Finish::Palette)
        .mesh("pales", vec![(0xf0ece0, row(16)), (WOOD, Solid::of(posts))])
        .placed(
            "gate",
            vec![([4.1, 0.0, 0.0], -35.0, 1.0)],
            vec![(0xf0ece0, row(4)), (0xd8d2c0, brace), (0x303030, knob)],
        )
}

/// A plate through which twenty-four round holes go, of one shell, on a frame.
pub(crate) fn grate() -> Prop {
    let holes = plate([3.0, 2.0], 0.1, [6, 4], |_, _| Some(Hole(0.5, 8)));
    let frame =
        [[-1.55, 1.0], [1.55, 1.0]].map(|[x, y]| block(0.1, 2.0, 0.2).moved(x, y - 1.0, 0.0));
    let feet = [[-1.5, 0.2], [1.5, 0.2], [-1.5, 1.8], [1.5, 1.8]]
        .map(|[x, y]| rod(0.06, 0.06, 0.3, 8).turned(Vec3::X, -90.0).moved(x, y, -0.1));
    Prop::single(
        Finish::Striped,
        vec![(STEEL, holes), (0x4a4f55, Solid::of(frame)), (0x202020, Solid::of(feet))],
    )
}

/// Ten steps of one extruded outline, in two halves, with a banister.
pub(crate) fn stairs() -> Prop {
    let steps = 10;
    let step = |at: usize| {
        let (x, y) = (0.28 * at as f32, 0.18 * (at + 1) as f32);
        let riser = prism(&[[0.0, 0.0], [0.28, 0.0], [0.28, y], [0.0, y]].map(Vec2::from), 1.2);
        let tread = block(0.32, 0.03, 1.3).moved(0.12, y, 0.0);
        (riser.moved(x, 0.0, 0.0), tread.moved(x, 0.0, 0.0))
    };
    let (risers, treads): (Vec<_>, Vec<_>) = (0..steps).map(step).unzip();
    let balusters = (0..steps).map(|at| {
        let (x, y) = (0.28 * at as f32 + 0.14, 0.18 * (at + 1) as f32 + 0.03);
        let profile = [[0.0, 0.0], [0.04, 0.0], [0.02, 0.3], [0.035, 0.5], [0.0, 0.8]];
        lathe(&profile, 6, Edges::Smooth).moved(x, y, 0.55)
    });
    let rail =
        tube(&[vec3(-0.2, 0.98, 0.55), vec3(2.8, 2.9, 0.55), vec3(3.1, 2.95, 0.55)], 0.04, 6);
    Prop::single(
        Finish::Palette,
        vec![
            (STONE, Solid::of(risers)),
            (WOOD, Solid::of(treads)),
            (0xe8e4da, Solid::of(balusters)),
            (0x5a3a20, rail),
        ],
    )
}

/// A cube of twelve bars, with joints.
pub(crate) fn wire_cube() -> Prop {
    let corner = |at: usize| {
        vec3((at & 1) as f32, (at >> 1 & 1) as f32, (at >> 2 & 1) as f32) * 2.0 - Vec3::ONE
    };
    let edges = (0..8).flat_map(|at| [1, 2, 4].map(|bit| (at, at | bit)));
    let bars = edges.filter(|(a, b)| a != b).map(|(a, b)| bar(corner(a), corner(b), 0.08));
    let joints = (0..8).map(|at| {
        let at = corner(at);
        ball(0.13, 8, 5).moved(at.x, at.y, at.z)
    });
    Prop::single(Finish::Plain, vec![(0xc8a020, Solid::of(bars)), (0x303438, Solid::of(joints))])
}

/// A ladder of two rails and fourteen round rungs, leaning on a wall.
pub(crate) fn ladder() -> Prop {
    let rails = [-0.25, 0.25].map(|x| block(0.06, 4.2, 0.1).moved(x, 0.0, 0.0));
    let rungs = (0..14).map(|at| {
        let rung = rod(0.025, 0.025, 0.5, 6).turned(Vec3::Z, -90.0);
        rung.moved(-0.25, 0.25 + 0.28 * at as f32, 0.0)
    });
    let shoes = [-0.25, 0.25].map(|x| block(0.1, 0.06, 0.16).moved(x, -0.06, 0.0));
    Prop::single(
        Finish::Striped,
        vec![(WOOD, Solid::of(rails).with(Solid::of(rungs))), (0x202020, Solid::of(shoes))],
    )
    .mesh("wall", vec![(STONE, block(1.6, 4.4, 0.2).moved(0.0, -0.06, -0.3))])
}

/// A round tower with crenels, slits that are boxes, a door, and a flag.
pub(crate) fn castle_tower() -> Prop {
    let profile = [
        [0.0, 0.0],
        [1.25, 0.0],
        [1.0, 0.6],
        [0.95, 3.6],
        [1.15, 3.9],
        [1.15, 4.3],
        [0.9, 4.3],
        [0.9, 4.0],
        [0.0, 4.0],
    ];
    let tower = lathe(&profile, 20, Edges::Bands);
    let crenels = (0..10).map(|at| {
        let crenel = block(0.26, 0.35, 0.34).moved(1.03, 4.3, 0.0);
        crenel.turned(Vec3::Y, 36.0 * at as f32)
    });
    let slits = (0..9).map(|at| {
        let slit = block(0.1, 0.5, 0.1).moved(0.95, 1.0 + 0.8 * (at % 3) as f32, 0.0);
        slit.turned(Vec3::Y, 40.0 * at as f32)
    });
    let arch = (0..=8).map(|at| {
        let angle = FRAC_PI_2 * at as f32 / 4.0;
        vec2(0.3 * angle.cos(), 0.7 + 0.3 * angle.sin())
    });
    let door: Vec<Vec2> = [vec2(-0.3, 0.0), vec2(0.3, 0.0)].into_iter().chain(arch).collect();
    let door = prism(&door, 0.3).moved(0.0, 0.0, 1.1);
    let pole = rod(0.03, 0.02, 1.6, 6).moved(0.0, 4.0, 0.0);
    let flag = block(0.7, 0.4, 0.01).moved(0.36, 5.15, 0.0);
    Prop::new(Finish::Striped)
        .mesh("tower", vec![(STONE, tower.with(Solid::of(crenels)))])
        .mesh("openings", vec![(0x181818, Solid::of(slits)), (0x5a3a20, door)])
        .mesh("flag", vec![(0x606060, pole), (0xc02020, flag)])
}
