//! Meshes made from bytes, and what must hold for any level of any mesh. Property tests and the fuzz
//! target share both.

use std::collections::HashMap;
use std::sync::atomic::AtomicUsize;

use arbitrary::{Result, Unstructured};
use glam::{Vec2, Vec3};
use seamwise_attr::{
    Cost, Layout, Level, Mesh, Options, Placement, Polish, Settings, Stop, Vertices, polish_chain,
    simplify_chain, weld,
};

/// Most squares along a side of the sheet.
const SIDE: usize = 12;

/// A sheet of squares, open or glued to a tube or a torus, with heights, groups, holes, seams,
/// doubled triangles and triangles between any of its points.
pub(crate) struct Recipe {
    columns: usize,
    rows: usize,
    glued: [bool; 2],
    uvs: bool,
    normals: bool,
    colors: bool,
    soup: bool,
    mirrored: [bool; 4],
    scale: f32,
    seed: u64,
    height: f32,
    holes: u8,
    groups: u8,
    extra: Vec<[u16; 3]>,
    /// Shares of the triangles, the largest first.
    pub(crate) shares: Vec<f64>,
    wishes: Wishes,
}

/// What is asked of the descent.
#[derive(Debug)]
struct Wishes {
    cost: Cost,
    placement: Placement,
    max_rotation: f64,
    /// In sides of the sheet.
    join_distance: Option<f64>,
    keep_volume: bool,
    keep_area: bool,
    /// In sides of the sheet.
    max_deviation: Option<f64>,
    max_lost_area: f64,
    /// Whether points have colors of noise as they are seen.
    seen: bool,
    /// Whether points count by noise, and whether some are locked.
    weighed: bool,
    locked: bool,
}

impl Wishes {
    fn read(u: &mut Unstructured<'_>) -> Result<Self> {
        let joins: bool = u.arbitrary()?;
        let placement = u.choose(&[Placement::Best, Placement::Ends, Placement::Middle]);
        let placement = placement.copied().unwrap_or_default();
        Ok(Self {
            cost: if u.ratio(1, 4)? { Cost::EdgeLength } else { Cost::Quadric },
            placement,
            max_rotation: 90.0 - f64::from(u.int_in_range(0..=89)?),
            join_distance: joins
                .then(|| Ok(f64::from(u.arbitrary::<u8>()?) / 512.0))
                .transpose()?,
            keep_volume: u.arbitrary::<bool>()? && placement == Placement::Best,
            weighed: u.arbitrary()?,
            locked: u.arbitrary()?,
            // From a ten thousandth to ten, or nothing.
            max_deviation: match u.int_in_range(0..=7)? {
                0..=2 => None,
                3 => Some(0.0),
                _ => Some(10f64.powf(f64::from(u.arbitrary::<u8>()?) / 51.0 - 4.0)),
            },
            max_lost_area: 1.0 - f64::from(u.arbitrary::<u8>()?) / 255.0,
            seen: u.arbitrary()?,
            keep_area: u.arbitrary::<bool>()? && placement == Placement::Best,
        })
    }
}

impl Recipe {
    /// Reads a recipe. Bytes that are missing count as zeros.
    pub(crate) fn read(u: &mut Unstructured<'_>) -> Result<Self> {
        let extra = u.int_in_range(0..=12)?;
        let mut shares: Vec<f64> =
            (0..4).map(|_| Ok(f64::from(u.arbitrary::<u8>()?) / 255.0)).collect::<Result<_>>()?;
        shares.sort_by(|a, b| b.total_cmp(a));
        Ok(Self {
            columns: u.int_in_range(1..=SIDE)?,
            rows: u.int_in_range(1..=SIDE)?,
            glued: u.arbitrary()?,
            uvs: u.arbitrary()?,
            normals: u.arbitrary()?,
            colors: u.arbitrary()?,
            soup: u.ratio(1, 8)?,
            mirrored: u.arbitrary()?,
            scale: 10f32.powi(u.int_in_range(-12..=12)?),
            seed: u.arbitrary()?,
            height: f32::from(u.arbitrary::<u8>()?) / 64.0,
            holes: u.arbitrary()?,
            groups: u.int_in_range(0..=3)?,
            extra: (0..extra).map(|_| u.arbitrary()).collect::<Result<_>>()?,
            shares,
            wishes: Wishes::read(u)?,
        })
    }

    /// A number in 0…1 that only depends on the recipe and on `at`.
    fn noise(&self, at: usize) -> f32 {
        let mut z = self.seed ^ (at as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    fn place(&self, column: usize, row: usize) -> Vec3 {
        let (x, y) = (column % self.width(0), row % self.width(1));
        let height = self.height * self.noise(y * (SIDE + 1) + x);
        let (u, v) = (x as f32 / self.columns as f32, y as f32 / self.rows as f32);
        let at = match self.glued {
            [false, false] => Vec3::new(u, v, height),
            [true, false] => around(u, 0.3 + height / 8.0).extend(v).to_array().into(),
            [false, true] => around(v, 0.3 + height / 8.0).extend(u).to_array().into(),
            [true, true] => {
                let ring = around(v, 0.2 + height / 16.0);
                (around(u, 1.0 + ring.x)).extend(ring.y)
            }
        };
        at * self.scale
    }

    /// Points along a side.
    fn width(&self, side: usize) -> usize {
        let squares = [self.columns, self.rows][side];
        if self.glued[side] { squares.max(3) } else { squares + 1 }
    }

    /// The vertices and triangles of the recipe.
    pub(crate) fn vertices(&self) -> Vertices {
        let layout = Layout {
            uv_sets: usize::from(self.uvs),
            normal: self.normals,
            color: if self.colors { 4 } else { 0 },
        };
        let mut made = Made {
            recipe: self,
            layout,
            out: Vertices { layout, ..Vertices::default() },
            known: HashMap::new(),
        };
        let squares =
            |side: usize| if self.glued[side] { self.width(side) } else { self.width(side) - 1 };
        for row in 0..squares(1) {
            for column in 0..squares(0) {
                let at = row * SIDE + column;
                if self.noise(at + 1000) * 255.0 < f32::from(self.holes) / 4.0 {
                    continue;
                }
                let group = (self.noise(at + 2000) * f32::from(self.groups + 1)) as u32;
                let corner = |x: usize, y: usize| (column + x, row + y);
                let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                made.add([a, b, c], group);
                made.add([a, c, d], group);
            }
        }
        let points = self.width(0) * self.width(1);
        for corners in &self.extra {
            let at = corners.map(|c| usize::from(c) % points);
            made.add(at.map(|p| (p % self.width(0), p / self.width(0))), 4);
        }
        made.out
    }
}

fn around(turn: f32, radius: f32) -> Vec2 {
    Vec2::from_angle(turn * std::f32::consts::TAU) * radius
}

/// What has been made of a recipe.
struct Made<'a> {
    recipe: &'a Recipe,
    layout: Layout,
    out: Vertices,
    known: HashMap<((usize, usize), u32), u32>,
}

impl Made<'_> {
    fn add(&mut self, corners: [(usize, usize); 3], group: u32) {
        let triangle = corners.map(|at| {
            let known = self.known.get(&(at, group)).copied().filter(|_| !self.recipe.soup);
            known.unwrap_or_else(|| self.vertex(at, group))
        });
        self.out.triangles.push(triangle);
        self.out.groups.push(group);
    }

    fn vertex(&mut self, at: (usize, usize), group: u32) -> u32 {
        let recipe = self.recipe;
        let vertex = self.out.positions.len() as u32;
        self.out.positions.push(recipe.place(at.0, at.1));
        if self.layout.uv_sets > 0 {
            let mirror = if recipe.mirrored[group as usize % 4] { -1.0 } else { 1.0 };
            self.out.attributes.extend([mirror * at.0 as f32 / 16.0, at.1 as f32 / 16.0]);
        }
        let key = at.1 * 64 + at.0;
        if self.layout.normal {
            let tilt = Vec3::new(recipe.noise(key), recipe.noise(key + 1), 1.0).normalize();
            self.out.attributes.extend(tilt.to_array());
        }
        for channel in 0..self.layout.color {
            self.out.attributes.push(recipe.noise(key * 4 + channel));
        }
        self.known.insert((at, group), vertex);
        vertex
    }
}

/// The welded mesh of a recipe and its levels, as the descent leaves them and polished; `None` if
/// the recipe makes no triangle.
pub(crate) fn chains(recipe: &Recipe) -> Option<(Mesh, [Vec<Level>; 2])> {
    with_options(recipe, |mesh, targets, options| {
        let done = AtomicUsize::new(0);
        let levels = simplify_chain(mesh, targets, options, &done).expect("levels");
        let mut polished = levels.clone();
        let polish = Polish::default();
        polish_chain(mesh, &mut polished, options, &polish, &done).expect("polished levels");
        assert!(
            options.settings.max_deviation.is_some()
                || levels.iter().all(|level| level.stopped != Some(Stop::Deviation)),
            "stopped by a limit that nobody gave"
        );
        [levels, polished]
    })
}

/// The welded mesh of a recipe, and what `run` makes of it, its targets and its options; `None` if the recipe
/// makes no triangle.
pub(crate) fn with_options<T>(
    recipe: &Recipe,
    run: impl FnOnce(&Mesh, &[usize], &Options<'_>) -> T,
) -> Option<(Mesh, T)> {
    let mesh = weld(&recipe.vertices()).expect("a mesh").mesh;
    if mesh.triangles.is_empty() {
        return None;
    }
    let count = mesh.triangles.len() as f64;
    let targets: Vec<usize> = recipe.shares.iter().map(|s| (s * count) as usize).collect();
    let (wishes, points) = (&recipe.wishes, 0..mesh.positions.len());
    let importance: Vec<f32> = points.clone().map(|point| 8.0 * recipe.noise(point)).collect();
    let colors: Vec<[f32; 3]> =
        points.clone().map(|point| [0, 1, 2].map(|at| recipe.noise(3 * point + at))).collect();
    let locked: Vec<bool> = points.map(|point| recipe.noise(point) < 0.1).collect();
    let settings = Settings {
        cost: wishes.cost,
        placement: wishes.placement,
        max_rotation: wishes.max_rotation,
        join_distance: wishes.join_distance.map(|share| share * f64::from(recipe.scale)),
        keep_volume: wishes.keep_volume,
        keep_area: wishes.keep_area,
        max_deviation: wishes.max_deviation.map(|share| share * f64::from(recipe.scale)),
        max_lost_area: wishes.max_lost_area,
        ..Settings::default()
    };
    let options = Options {
        settings,
        colors: if wishes.seen { &colors } else { &[] },
        importance: if wishes.weighed { &importance } else { &[] },
        locked: if wishes.locked { &locked } else { &[] },
        ..Options::default()
    };
    let made = run(&mesh, &targets, &options);
    Some((mesh, made))
}

/// Whatever the mesh: each level is a mesh, not larger than the one before, at its target or with a
/// reason; there are no more edges of an odd number of triangles or of more than two, and no more
/// borders if no triangle lay on another; groups keep the side of their UVs.
///
/// # Panics
/// If one of these does not hold.
pub(crate) fn check(mesh: &Mesh, levels: &[Level]) {
    let source = Edges::new(mesh);
    let sides = uv_sides(mesh);
    let mut before = mesh.triangles.len();
    for level in levels {
        level.mesh.validate().expect("a sound level");
        let triangles = level.mesh.triangles.len();
        assert!(triangles <= before, "{triangles} after {before}");
        assert!(triangles > 0, "nothing is left");
        before = triangles;
        assert!(
            triangles <= level.target || level.stopped.is_some(),
            "{triangles} of {}",
            level.target
        );
        let edges = Edges::new(&level.mesh);
        assert!(edges.odd <= source.odd, "{edges:?} of {source:?}");
        assert!(edges.complex <= source.complex, "{edges:?} of {source:?}");
        assert!(source.doubled || edges.borders <= source.borders, "{edges:?} of {source:?}");
        assert_eq!(level.mesh.layout, mesh.layout);
        for (group, side) in uv_sides(&level.mesh) {
            let was = sides.get(&group).expect("a group of the source");
            assert!(
                was.both() || (!side.left || was.left) && (!side.right || was.right),
                "group {group} folds"
            );
        }
    }
}

/// How many edges there are of each kind.
#[derive(Debug, Default)]
struct Edges {
    /// Of one triangle.
    borders: usize,
    /// Of an odd number of triangles. Where a triangle lies on another, a border may hide in an edge
    /// of three until one of the two goes.
    odd: usize,
    /// Of more than two triangles.
    complex: usize,
    /// Whether two triangles have the same points.
    doubled: bool,
}

impl Edges {
    fn new(mesh: &Mesh) -> Self {
        let mut triangles: HashMap<[u32; 2], usize> = HashMap::new();
        let mut same: HashMap<[u32; 3], usize> = HashMap::new();
        for triangle in 0..mesh.triangles.len() {
            let mut points = mesh.triangle_points(triangle).map(|point| point.0);
            points.sort_unstable();
            let [a, b, c] = points;
            *same.entry(points).or_default() += 1;
            for edge in [[a, b], [b, c], [a, c]] {
                *triangles.entry(edge).or_default() += 1;
            }
        }
        let count = |is: fn(usize) -> bool| triangles.values().filter(|&&n| is(n)).count();
        Self {
            borders: count(|n| n == 1),
            odd: count(|n| n % 2 == 1),
            complex: count(|n| n > 2),
            doubled: same.values().any(|&n| n > 1),
        }
    }
}

/// Which sides the triangles of a group show in UV set 0.
#[derive(Clone, Copy, Default)]
struct Sides {
    left: bool,
    right: bool,
    flat: bool,
}

impl Sides {
    /// A triangle without area may turn to either side.
    fn both(self) -> bool {
        self.flat || self.left && self.right
    }
}

fn uv_sides(mesh: &Mesh) -> HashMap<u32, Sides> {
    let mut sides: HashMap<u32, Sides> = HashMap::new();
    for (wedges, group) in mesh.triangles.iter().zip(&mesh.groups) {
        let side = sides.entry(*group).or_default();
        if mesh.layout.uv_sets == 0 {
            continue;
        }
        let [a, b, c] = wedges.map(|wedge| mesh.uv(wedge, 0).as_dvec2());
        let (area, longest) =
            ((b - a).perp_dot(c - a), a.distance(b).max(b.distance(c)).max(c.distance(a)));
        // Sides of what is thinner than f32 can tell are rounding.
        let least = 1e-5 * longest.max(1e-2) * longest.max(1e-2);
        side.left |= area > least;
        side.right |= area < -least;
        side.flat |= area.abs() <= least;
    }
    sides
}
