//! Meshes of known shapes, and how far two surfaces are apart.

mod apart;

use std::f32::consts::TAU;

use glam::{Quat, Vec3};
use seamwise_attr::{Layout, Mesh, Vertices, weld};

pub(crate) use apart::{diagonal, farthest};

/// Random numbers that depend on a seed alone.
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A number in 0…1.
    pub(crate) fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    fn count(&mut self, low: usize, high: usize) -> usize {
        low + (self.unit() * (high - low + 1) as f32) as usize
    }

    fn place(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }

    fn turn(&mut self) -> Quat {
        let axis = (self.place() - 0.5).normalize_or(Vec3::X);
        Quat::from_axis_angle(axis, self.between(0.0, TAU))
    }
}

/// A kind of mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    Boxes,
    Torus,
    Holes,
    Sphere,
    Ribbons,
    Floor,
    Doubled,
    Cards,
}

pub(crate) const KINDS: [Kind; 8] = [
    Kind::Boxes,
    Kind::Torus,
    Kind::Holes,
    Kind::Sphere,
    Kind::Ribbons,
    Kind::Floor,
    Kind::Doubled,
    Kind::Cards,
];

/// A mesh of a kind, about 1 in size.
pub(crate) fn make(kind: Kind, noise: &mut Noise) -> Soup {
    let mut soup = Soup::default();
    match kind {
        Kind::Boxes => soup.boxes(noise),
        Kind::Torus => soup.torus(noise),
        Kind::Holes => soup.holes(noise),
        Kind::Sphere => {
            soup.ball(Vec3::ZERO, 0.5, noise.count(3, 20), noise.between(0.0, 0.1), noise);
        }
        Kind::Ribbons => (0..noise.count(1, 6)).for_each(|_| soup.ribbon(noise)),
        Kind::Floor => soup.floor(noise),
        Kind::Doubled => soup.doubled(noise),
        Kind::Cards => soup.cards(noise),
    }
    soup
}

/// Triangles as a file has them.
#[derive(Clone, Default)]
pub(crate) struct Soup {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Soup {
    /// As a mesh without attributes.
    pub(crate) fn mesh(&self) -> Mesh {
        let vertices = Vertices {
            layout: Layout { uv_sets: 0, normal: false, color: 0 },
            positions: self.positions.clone(),
            triangles: self.triangles.clone(),
            groups: vec![0; self.triangles.len()],
            ..Vertices::default()
        };
        weld(&vertices).expect("a sound mesh").mesh
    }

    /// Puts all positions elsewhere.
    pub(crate) fn map(&mut self, place: impl Fn(Vec3) -> Vec3) {
        self.positions.iter_mut().for_each(|p| *p = place(*p));
    }

    /// A sheet of squares bent to `shape` over 0…1 × 0…1, without those that `is_hole` names.
    pub(crate) fn sheet(
        &mut self,
        [columns, rows]: [usize; 2],
        shape: impl Fn(f32, f32) -> Vec3,
        is_hole: impl Fn(usize, usize) -> bool,
    ) {
        let first = self.positions.len() as u32;
        for row in 0..=rows {
            let across = |column| shape(column as f32 / columns as f32, row as f32 / rows as f32);
            self.positions.extend((0..=columns).map(across));
        }
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |c| (row, c))) {
            if !is_hole(column, row) {
                let a = first + (row * (columns + 1) + column) as u32;
                let above = a + columns as u32 + 1;
                self.triangles.extend([[a, a + 1, above + 1], [a, above + 1, above]]);
            }
        }
    }

    /// A box of `n` squares a side, of unit size before `place` puts it where it belongs.
    fn cuboid(&mut self, n: usize, place: impl Fn(Vec3) -> Vec3) {
        for axis in 0..3 {
            for side in [0.0, 1.0] {
                let face = |x: f32, y: f32| {
                    let (x, y) = if side == 0.0 { (y, x) } else { (x, y) };
                    let p = [x, y, side];
                    place(Vec3::new(p[(3 - axis) % 3], p[(4 - axis) % 3], p[(5 - axis) % 3]))
                };
                self.sheet([n, n], face, |_, _| false);
            }
        }
    }

    fn boxes(&mut self, noise: &mut Noise) {
        for _ in 0..noise.count(1, 12) {
            let (size, at, turn) = (noise.place() * 0.4 + 0.01, noise.place(), noise.turn());
            self.cuboid(noise.count(1, 5), |p| at + turn * (p * size));
        }
    }

    fn torus(&mut self, noise: &mut Noise) {
        let (tube, steps) = (noise.between(0.02, 0.2), [noise.count(4, 48), noise.count(3, 16)]);
        self.sheet(steps, |u, v| on_torus(u, v, tube), |_, _| false);
    }

    fn holes(&mut self, noise: &mut Noise) {
        let (n, share, bend) =
            (noise.count(4, 20), noise.between(0.02, 0.3), noise.between(0.0, 0.2));
        let holes: Vec<bool> = (0..n * n).map(|_| noise.unit() < share).collect();
        let shape = |x: f32, y: f32| Vec3::new(x, y, bend * (5.0 * x).sin() * (4.0 * y).cos());
        self.sheet([n, n], shape, |column, row| holes[row * n + column]);
    }

    /// A ball of `n` rows, its radius off by up to the share `rough`.
    pub(crate) fn ball(&mut self, at: Vec3, radius: f32, n: usize, rough: f32, noise: &mut Noise) {
        let bumps: Vec<f32> = (0..2 * n * (n + 1)).map(|_| 1.0 + rough * noise.unit()).collect();
        let shape = |u: f32, v: f32| {
            let (column, row) =
                ((u * 2.0 * n as f32).round() as usize, (v * n as f32).round() as usize);
            let is_pole = row == 0 || row == n;
            let column = if is_pole { 0 } else { column % (2 * n) };
            let (turn, ring) = (
                column as f32 / n as f32 * TAU / 2.0,
                if is_pole { 0.0 } else { (v * TAU / 2.0).sin() },
            );
            let way = Vec3::new(ring * turn.cos(), ring * turn.sin(), (v * TAU / 2.0).cos());
            at + way * radius * bumps[row * 2 * n + column]
        };
        self.sheet([2 * n, n], shape, |_, _| false);
    }

    fn ribbon(&mut self, noise: &mut Noise) {
        let (at, turn, twist) = (noise.place(), noise.turn(), noise.between(0.0, 6.0));
        let (width, wave) = (noise.between(0.002, 0.1), noise.between(0.0, 0.1));
        let shape = |x: f32, y: f32| {
            let (sin, cos) = (twist * x).sin_cos();
            at + turn
                * (Vec3::new(x, wave * (9.0 * x).sin(), 0.0)
                    + Vec3::new(0.0, cos, sin) * (y - 0.5) * width)
        };
        self.sheet([noise.count(4, 60), noise.count(1, 2)], shape, |_, _| false);
    }

    fn floor(&mut self, noise: &mut Noise) {
        self.sheet([1, 1], |x, y| Vec3::new(x, y, 0.0), |_, _| false);
        for _ in 0..noise.count(1, 3) {
            let (at, radius) = (noise.place(), noise.between(0.01, 0.2));
            self.ball(at, radius, noise.count(4, 14), 0.0, noise);
        }
    }

    fn doubled(&mut self, noise: &mut Noise) {
        let (n, bend) = ([noise.count(1, 14), noise.count(1, 14)], noise.between(0.0, 0.3));
        self.sheet(n, |x, y| Vec3::new(x, y, bend * (3.0 * x).sin()), |_, _| false);
        let back: Vec<[u32; 3]> = self.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
        self.triangles.extend(back);
    }

    /// Rows of thin cards, open or with a thickness.
    fn cards(&mut self, noise: &mut Noise) {
        let (count, gap, n) = (noise.count(2, 30), noise.between(0.005, 0.05), noise.count(1, 3));
        let (solid, size) = (
            noise.unit() < 0.5,
            Vec3::new(0.2 * gap, noise.between(0.02, 0.5), noise.between(0.02, 0.5)),
        );
        for card in 0..count {
            let at = Vec3::X * (card as f32 * gap);
            if solid {
                self.cuboid(n, |p| at + p * size);
            } else {
                self.sheet([n, n], |x, y| at + Vec3::new(0.0, x, y) * size, |_, _| false);
            }
        }
    }
}

fn on_torus(u: f32, v: f32, tube: f32) -> Vec3 {
    let closed = |x: f32| if x == 1.0 { 0.0 } else { x * TAU };
    let ((sin, cos), (up, out)) = (closed(u).sin_cos(), closed(v).sin_cos());
    let radius = 0.4 + tube * out;
    Vec3::new(radius * cos, radius * sin, tube * up)
}
