//! The space that costs are measured in.
//!
//! Positions are moved to the box's centre and scaled to unit extent, so the numbers are the same
//! for a model in microns and one in light years. Attributes are brought to the same unit: a UV
//! by √(surface area / UV area) of its group, so that a UV error is the distance that the texture
//! slides over the surface; normals and colors by a plain weight. An error in any of them is then
//! a length, and weights say how much one length counts beside another.

use glam::{DVec2, DVec3, Vec3};
use rustc_hash::FxHashMap;

use crate::facing::Facing;
use crate::id::PointId;
use crate::mesh::{Layout, Mesh};
use crate::options::Options;
use crate::quadric::MAX_ATTRIBUTES;
use crate::settings::{Cost, Placement, Weights};

/// An attribute that is to count for nothing still gets this scale: far below any error that matters,
/// and its row can be read back.
const LEAST_SCALE: f64 = 1e-6;

/// The scale of UVs that are points, over the root of the surface: nowhere do they change within a
/// triangle, but each jump from one to another is a seam.
const POINTS: f64 = 1e3;

/// A triangle whose area in an atlas is a smaller share of its longest side's square is a line there.
const LINE: f64 = 1e-3;
/// That share of a triangle of three equal sides.
const EQUILATERAL: f64 = 0.433;

/// An importance beyond is taken as these: the quadrics must stay far from rounding.
const RANGE: (f64, f64) = (1e-6, 1e6);

/// The space of a mesh's costs: units, scales and importance.
pub(crate) struct Space {
    /// Length of one unit, in the units of the mesh.
    pub(crate) unit: f64,
    pub(crate) center: DVec3,
    pub(crate) layout: Layout,
    /// Factors of the entries of attribute rows: one row of factors per group.
    scales: FxHashMap<u32, [f64; MAX_ATTRIBUTES]>,
    pub(crate) weights: Weights,
    /// The cosine of the largest angle that a collapse may rotate a triangle by.
    pub(crate) rotation_cosine: f64,
    pub(crate) keep_volume: bool,
    pub(crate) keep_area: bool,
    /// Points of two shells nearer than this may meet; 0 if they may not.
    pub(crate) join_distance: f64,
    /// Whether points of one shell may merge so as well.
    pub(crate) join_own_shell: bool,
    pub(crate) cost: Cost,
    pub(crate) placement: Placement,
    /// Whether collapses are kept on record.
    pub(crate) records: bool,
    /// Per point of the mesh: what the costs around it are multiplied by. Empty if all count alike.
    importance: Vec<f32>,
    /// Per point of the mesh: its color, sRGB in 0…1. Empty if none are given.
    colors: Vec<[f32; 3]>,
    /// Per point of the mesh: where it moves to, so many entries each; and what a length along the normal
    /// there moves by beside it. Empty if nothing moves.
    motion: [Vec<f64>; 2],
    pub(crate) motion_width: usize,
    /// The largest factor that motion may come to count by, 1 at least.
    pub(crate) motion_growth: f64,
    /// The directions that shells of the mesh face, and go on to face.
    pub(crate) facing: Facing,
    /// Per point of the mesh: whether it is of a card. Empty if none is.
    cards: Vec<bool>,
    /// Per point of the mesh: whether the user locked it. Empty if none is.
    locked: Vec<bool>,
}

impl Space {
    #[cfg(test)]
    pub(crate) fn new(mesh: &Mesh, weights: Weights) -> Self {
        let settings = crate::settings::Settings { weights, ..Default::default() };
        Self::of(mesh, &settings.into())
    }

    /// The space of a mesh, and what the user asks of its points.
    pub(crate) fn of(mesh: &Mesh, options: &Options<'_>) -> Self {
        let (center, unit) = frame(mesh);
        let weights = match options.settings.cost {
            Cost::Classic => Weights::NONE,
            Cost::Quadric | Cost::EdgeLength => options.settings.weights,
        };
        let scales = scales(mesh, weights, unit);
        let motion = options.motion.filter(|_| weights.motion > 0.0);
        Self {
            unit,
            center,
            layout: mesh.layout,
            scales,
            weights,
            rotation_cosine: options.settings.rotation_cosine(),
            keep_volume: options.settings.keep_volume,
            keep_area: options.settings.keep_area,
            join_distance: options.settings.join_distance.unwrap_or(0.0) / unit,
            join_own_shell: options.settings.join_own_shell,
            cost: options.settings.cost,
            placement: options.settings.placement,
            records: false,
            importance: options.importance.to_vec(),
            colors: options.colors.to_vec(),
            motion: motion.map_or([Vec::new(), Vec::new()], |motion| {
                let [rows, normals] = motion.rows();
                let scaled = |rows: &[f32], scale: f64| {
                    rows.iter().map(|&x| f64::from(x) * scale).collect::<Vec<_>>()
                };
                [scaled(rows, weights.motion / unit), scaled(normals, weights.motion)]
            }),
            motion_width: motion.map_or(0, |motion| motion.width),
            motion_growth: motion.map_or(1.0, |motion| motion.growth.max(1.0)),
            facing: Facing::of(mesh),
            cards: options.cards.to_vec(),
            locked: options.locked.to_vec(),
        }
    }

    /// The same, with collapses kept on record or not.
    pub(crate) fn recording(mut self, records: bool) -> Self {
        self.records = records;
        self
    }

    /// Adds the user's locks to those of points that stand for `sources`. Either may be empty.
    pub(crate) fn lock(&self, sources: &[PointId], locked: &mut Vec<bool>) {
        if self.locked.is_empty() {
            return;
        }
        locked.resize(sources.len(), false);
        for (locked, &source) in locked.iter_mut().zip(sources) {
            *locked |= self.locked[source];
        }
    }

    /// Whether a point of the mesh is of a card.
    pub(crate) fn is_card(&self, source: PointId) -> bool {
        self.cards.get(source.index()) == Some(&true)
    }

    /// The factor of the costs around a point of the mesh.
    pub(crate) fn importance(&self, source: PointId) -> f64 {
        self.importance.get(source.index()).map_or(1.0, |&x| f64::from(x).clamp(RANGE.0, RANGE.1))
    }

    /// The entries of a row that tell where a point of the mesh moves to.
    pub(crate) fn motion(&self, source: PointId) -> &[f64] {
        &self.motion[0][source.index() * self.motion_width..][..self.motion_width]
    }

    /// By how much more than the point itself, in each of those entries, a length along the normal there
    /// moves.
    pub(crate) fn turn(&self, source: PointId, entry: usize) -> f64 {
        self.motion[1][source.index() * self.motion_width + entry]
    }

    /// The colors of points that stand for `sources`; empty if none are given.
    pub(crate) fn colors_of(&self, sources: &[PointId]) -> Vec<[f32; 3]> {
        let own = sources.iter().map_while(|&source| self.colors.get(source.index()));
        own.copied().collect()
    }

    /// A position of the mesh here.
    pub(crate) fn place(&self, position: Vec3) -> DVec3 {
        (position.as_dvec3() - self.center) / self.unit
    }

    /// A position back in the units of the mesh.
    pub(crate) fn unplace(&self, position: DVec3) -> Vec3 {
        (position * self.unit + self.center).as_vec3()
    }

    /// The factors of the entries of a group's rows.
    pub(crate) fn scales(&self, group: u32) -> &[f64; MAX_ATTRIBUTES] {
        &self.scales[&group]
    }
}

/// The centre of the box around a mesh and the longest of its sides.
fn frame(mesh: &Mesh) -> (DVec3, f64) {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for p in &mesh.positions {
        low = low.min(p.as_dvec3());
        high = high.max(p.as_dvec3());
    }
    let extent = (high - low).max_element();
    if extent > 0.0 { ((low + high) / 2.0, extent) } else { (DVec3::ZERO, 1.0) }
}

/// The area of a triangle in an atlas. One that is but a line there, down a gradient say, counts as
/// one of three equal sides: by what roundings leave of its area UVs would outweigh all else.
fn uv_area([a, b, c]: [DVec2; 3]) -> f64 {
    let area = (b - a).perp_dot(c - a).abs() / 2.0;
    let longest = (b - a).length_squared().max((c - b).length_squared());
    let longest = longest.max((a - c).length_squared());
    if area < LINE * longest { EQUILATERAL * longest } else { area }
}

/// The factors of the entries of rows, for each group.
fn scales(mesh: &Mesh, weights: Weights, unit: f64) -> FxHashMap<u32, [f64; MAX_ATTRIBUTES]> {
    let layout = mesh.layout;
    let mut areas: FxHashMap<u32, (f64, [f64; MAX_ATTRIBUTES / 2])> = FxHashMap::default();
    for (triangle, (wedges, group)) in mesh.triangles.iter().zip(&mesh.groups).enumerate() {
        let p = mesh.triangle_positions(triangle).map(|p| p.as_dvec3() / unit);
        let (surface, uv) = areas.entry(*group).or_default();
        *surface += (p[1] - p[0]).cross(p[2] - p[0]).length() / 2.0;
        for (set, area) in uv.iter_mut().enumerate().take(layout.uv_sets) {
            let t = wedges.map(|wedge| mesh.uv(wedge, set).as_dvec2());
            *area += uv_area(t);
        }
    }
    let row = |(surface, uv): (f64, [f64; MAX_ATTRIBUTES / 2])| {
        let mut row = [0.0; MAX_ATTRIBUTES];
        for set in 0..layout.uv_sets {
            let per_uv =
                if uv[set] > 0.0 { (surface / uv[set]).sqrt() } else { POINTS * surface.sqrt() };
            row[layout.uv(set)..][..2].fill(weights.uv * per_uv);
        }
        if layout.normal {
            row[layout.normal()..][..3].fill(weights.normal);
        }
        row[layout.color()..][..layout.color].fill(weights.color);
        row.map(|scale| scale.max(LEAST_SCALE))
    };
    areas.into_iter().map(|(group, areas)| (group, row(areas))).collect()
}
