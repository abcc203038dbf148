//! Levels of detail of a program's own arrays, in one call.

use std::cmp::Reverse;
use std::sync::atomic::AtomicUsize;

use rustc_hash::FxHashMap;

use crate::chain::{Level, polish_chain, simplify_chain};
use crate::error::{Error, Result};
use crate::options::Options;
use crate::polish::Polish;
use crate::settings::Settings;
use crate::simplify::Stop;
use crate::vertices::Vertices;
use crate::weld::{Welded, weld};

/// The size of a level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// A share of the source's triangles, above 0 and up to 1.
    Ratio(f64),
    /// A number of triangles, 1 at least.
    Triangles(usize),
}

impl From<f64> for Target {
    fn from(ratio: f64) -> Self {
        Self::Ratio(ratio)
    }
}

impl From<usize> for Target {
    fn from(triangles: usize) -> Self {
        Self::Triangles(triangles)
    }
}

impl Target {
    /// The triangles of a level of a source of so many, 1 at least.
    fn of(self, source: usize) -> Result<usize> {
        match self {
            Self::Ratio(ratio) if ratio > 0.0 && ratio <= 1.0 => {
                Ok(((source as f64 * ratio).round() as usize).max(1))
            }
            Self::Triangles(triangles) if triangles > 0 => Ok(triangles),
            _ => Err(Error::Options {
                what: format!(
                    "{self:?} is no size: a ratio lies above 0 and up to 1, a count is 1 at least"
                ),
            }),
        }
    }
}

/// A level of detail of [`Vertices`].
#[derive(Clone, Debug, PartialEq)]
pub struct Simplified {
    /// The level in the layout of the source; no motion and no rest.
    pub vertices: Vertices,
    /// One per vertex: the vertex of the source that it stands for, for attributes of your own. Its
    /// attributes are fitted anew; to take all from there, place merged points at
    /// [`Placement::Ends`](crate::Placement::Ends).
    pub sources: Vec<u32>,
    /// Triangles asked for.
    pub target: usize,
    /// Root of the largest area-weighted cost of any collapse, in the units of the positions: see
    /// [`Level::error`].
    pub error: f64,
    /// Why the target was not reached, if it was not.
    pub stopped: Option<Stop>,
}

/// Simplifies `vertices` to levels of detail as the command line tool does by default, one for each
/// target and in their order.
///
/// Seams, groups and borders are kept, attributes slide as little as may be, and no level is farther from
/// its source than 2.5 % of the diagonal of its bounding box: see [`Simplifier`] to ask for other things.
/// The result is the same at any number of threads.
///
/// ```
/// use seamwise_attr::{Vertices, simplify};
///
/// // A gentle hill of 32 × 32 squares, with its own plan as UVs.
/// let plan = (0..33 * 33).map(|at| [(at % 33) as f32 / 32.0, (at / 33) as f32 / 32.0]);
/// let uvs: Vec<[f32; 2]> = plan.collect();
/// let hill: Vec<[f32; 3]> = uvs.iter().map(|&[x, y]| [x, y, 0.1 * (3.0 * x).sin()]).collect();
/// let corners = (0..32 * 32).map(|at| at / 32 * 33 + at % 32);
/// let indices: Vec<u32> = corners.flat_map(|a| [a, a + 1, a + 34, a, a + 34, a + 33]).collect();
///
/// let vertices = Vertices::new(&hill, &indices)?.with_uvs(&uvs)?;
/// let levels = simplify(&vertices, &[0.5, 0.1])?;
/// assert!(levels[1].vertices.triangles.len() <= 205);
/// assert_eq!(levels[1].sources.len(), levels[1].vertices.positions.len());
/// # Ok::<(), seamwise_attr::Error>(())
/// ```
///
/// # Errors
/// [`Error::Invalid`] if an index or a list does not fit or a used value is not finite;
/// [`Error::Options`] if a target is no size.
pub fn simplify(
    vertices: &Vertices,
    targets: &[impl Into<Target> + Copy],
) -> Result<Vec<Simplified>> {
    Simplifier::new(vertices).run(targets)
}

/// [`simplify`] with settings, and locks and importance per vertex.
///
/// ```
/// use seamwise_attr::{Settings, Simplifier, Target, Vertices};
///
/// let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// let strip = Vertices::new(&positions, &[0, 1, 4, 1, 3, 4, 1, 2, 3])?;
/// let locked = [false, true, false, false, false];
/// let level = Simplifier::new(&strip)
///     .settings(Settings { keep_volume: true, ..Settings::for_diagonal(2.2) })
///     .locked(&locked)
///     .run(&[Target::Triangles(1)])?
///     .remove(0);
/// assert!(level.sources.contains(&1), "it would go at no cost, were it not locked");
/// # Ok::<(), seamwise_attr::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Simplifier<'a> {
    vertices: &'a Vertices,
    settings: Settings,
    polish: Option<Polish>,
    locked: &'a [bool],
    importance: &'a [f32],
    done: Option<&'a AtomicUsize>,
}

impl<'a> Simplifier<'a> {
    /// A simplifier of `vertices` with the settings of the command line tool:
    /// [`Settings::for_diagonal`] of their bounding box, and a polish.
    pub fn new(vertices: &'a Vertices) -> Self {
        Self {
            vertices,
            settings: Settings::for_diagonal(vertices.diagonal()),
            polish: Some(Polish::default()),
            locked: &[],
            importance: &[],
            done: None,
        }
    }

    /// Takes other settings; lengths are in the units of the positions.
    #[must_use]
    pub fn settings(mut self, settings: Settings) -> Self {
        self.settings = settings;
        self
    }

    /// Takes another polish, or none: half the time, and levels less near to the source.
    #[must_use]
    pub fn polish(mut self, polish: Option<Polish>) -> Self {
        self.polish = polish;
        self
    }

    /// Locks vertices, one entry for each: they keep their positions and attributes to the bit. Those at
    /// one position are locked together.
    #[must_use]
    pub fn locked(mut self, locked: &'a [bool]) -> Self {
        self.locked = locked;
        self
    }

    /// Weighs vertices, one entry for each, 1 by default: costs around it are multiplied by that. Of
    /// those at one position the largest counts.
    #[must_use]
    pub fn importance(mut self, importance: &'a [f32]) -> Self {
        self.importance = importance;
        self
    }

    /// Counts triangles as they go, and levels as they are polished, for a progress bar.
    #[must_use]
    pub fn progress(mut self, done: &'a AtomicUsize) -> Self {
        self.done = Some(done);
        self
    }

    /// Makes a level for each target, in their order.
    ///
    /// # Errors
    /// As [`simplify`], and [`Error::Options`] if a setting or a list makes no sense.
    pub fn run(&self, targets: &[impl Into<Target> + Copy]) -> Result<Vec<Simplified>> {
        let count = self.vertices.positions.len();
        for (list, what) in [(self.locked.len(), "locks"), (self.importance.len(), "importances")] {
            if list != 0 && list != count {
                return Err(Error::Options { what: format!("{list} {what} for {count} vertices") });
            }
        }
        let welded = weld(self.vertices)?;
        let locked = self.per_point(&welded, self.locked, |a, b| a | b);
        let importance = self.per_point(&welded, self.importance, f32::max);
        let options = Options { importance: &importance, locked: &locked, ..self.settings.into() };
        let source = welded.mesh.triangles.len();
        let targets = targets.iter().map(|&target| target.into().of(source));
        let targets: Vec<usize> = targets.collect::<Result<_>>()?;
        let mut order: Vec<usize> = (0..targets.len()).collect();
        order.sort_by_key(|&at| Reverse(targets[at]));
        let sorted: Vec<usize> = order.iter().map(|&at| targets[at]).collect();
        let (own, done) = (AtomicUsize::new(0), self.done);
        let done = done.unwrap_or(&own);
        let mut levels = simplify_chain(&welded.mesh, &sorted, &options, done)?;
        if let Some(polish) = &self.polish {
            polish_chain(&welded.mesh, &mut levels, &options, polish, done)?;
        }
        let mut levels: Vec<(usize, Level)> = order.into_iter().zip(levels).collect();
        levels.sort_by_key(|(at, _)| *at);
        Ok(levels.into_iter().map(|(_, level)| simplified(level, &welded)).collect())
    }

    /// The values of vertices as values of points: of those at one position all are joined.
    fn per_point<T: Copy>(
        &self,
        welded: &Welded,
        values: &[T],
        join: impl Fn(T, T) -> T,
    ) -> Vec<T> {
        if values.is_empty() {
            return Vec::new();
        }
        let key = |vertex: usize| {
            let motion = self.vertices.motion.get(vertex).copied();
            (self.vertices.positions[vertex].to_array().map(|x| (x + 0.0).to_bits()), motion)
        };
        let mut joined: FxHashMap<_, T> = FxHashMap::default();
        for (vertex, &value) in values.iter().enumerate() {
            joined.entry(key(vertex)).and_modify(|old| *old = join(*old, value)).or_insert(value);
        }
        let mut points: Vec<Option<T>> = vec![None; welded.mesh.positions.len()];
        for (&point, &vertex) in welded.mesh.wedge_points.iter().zip(&welded.wedge_vertices) {
            let own = joined[&key(vertex as usize)];
            points[point] = Some(points[point].map_or(own, |other| join(other, own)));
        }
        points.into_iter().map(|value| value.unwrap_or(values[0])).collect()
    }
}

/// A level as vertices, one for each wedge.
fn simplified(level: Level, welded: &Welded) -> Simplified {
    let Level { mesh, wedge_sources, target, error, stopped, .. } = level;
    let position = |wedge: usize| {
        let (source, own) = (wedge_sources[wedge], mesh.positions[mesh.wedge_points[wedge]]);
        let point = welded.mesh.positions[welded.mesh.wedge_points[source]];
        if own == point { welded.vertex_position(source) } else { own }
    };
    let vertices = Vertices {
        positions: (0..wedge_sources.len()).map(position).collect(),
        layout: mesh.layout,
        attributes: mesh.attributes,
        triangles: mesh.triangles.iter().map(|wedges| wedges.map(|wedge| wedge.0)).collect(),
        groups: mesh.groups,
        ..Vertices::default()
    };
    let sources = wedge_sources.iter().map(|wedge| welded.wedge_vertices[wedge.index()]).collect();
    Simplified { vertices, sources, target, error, stopped }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// A hill over n × n squares, with its plan as UVs and a seam down its middle.
    fn hill(n: u32) -> Vertices {
        let columns: Vec<(u32, f32)> = (0..=n)
            .flat_map(|x| if 2 * x == n { vec![(x, 0.0), (x, 1.0)] } else { vec![(x, 0.0)] })
            .collect();
        let width = columns.len() as u32;
        let (mut positions, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new());
        for y in 0..=n {
            for &(x, shift) in &columns {
                let [u, v] = [x, y].map(|at| at as f32 / n as f32);
                positions.push(Vec3::new(u, v, 0.2 * (4.0 * u).sin() * (3.0 * v).cos()));
                uvs.push([u + shift, v]);
            }
        }
        for y in 0..n {
            for (at, pair) in
                columns.windows(2).enumerate().filter(|(_, pair)| pair[0].0 < pair[1].0)
            {
                let (a, _) = (y * width + at as u32, pair);
                indices.extend([a, a + 1, a + width + 1, a, a + width + 1, a + width]);
            }
        }
        Vertices::new(&positions, &indices).and_then(|v| v.with_uvs(&uvs)).expect("a hill")
    }

    #[test]
    fn levels_come_in_the_order_they_were_asked_for() {
        let hill = hill(20);
        let levels =
            simplify(&hill, &[Target::Ratio(0.1), Target::Triangles(400), 1.0.into()]).unwrap();
        let counts: Vec<usize> =
            levels.iter().map(|level| level.vertices.triangles.len()).collect();
        assert!(counts[0] <= 80 && counts[1] <= 400 && counts[2] == 800, "{counts:?}");
        assert!(counts[0] > 60 && counts[1] > 390, "{counts:?}");
        assert_eq!(levels.iter().map(|level| level.target).collect::<Vec<_>>(), [80, 400, 800]);
    }

    #[test]
    fn sources_are_vertices_on_the_same_side_of_a_seam() {
        let hill = hill(20);
        let settings = Settings {
            placement: crate::Placement::Ends,
            ..Settings::for_diagonal(hill.diagonal())
        };
        let level = Simplifier::new(&hill).settings(settings).run(&[0.2]).unwrap().remove(0);
        let uvs: Vec<_> = hill.uvs(0).collect();
        for (uv, &source) in level.vertices.uvs(0).zip(&level.sources) {
            assert_eq!(uv, uvs[source as usize]);
        }
        for (p, &source) in level.vertices.positions.iter().zip(&level.sources) {
            assert_eq!(*p, hill.positions[source as usize]);
        }
    }

    #[test]
    fn a_lock_on_one_side_of_a_seam_holds_the_point_and_importance_keeps_triangles() {
        let hill = hill(20);
        let locked: Vec<bool> = hill.uvs(0).map(|uv| uv.x == 0.5).collect();
        let level = Simplifier::new(&hill).locked(&locked).run(&[0.1]).unwrap().remove(0);
        let seam = |positions: &[Vec3]| {
            let mut ys: Vec<u32> =
                positions.iter().filter(|p| p.x == 0.5).map(|p| p.y.to_bits()).collect();
            ys.sort_unstable();
            ys.dedup();
            ys
        };
        assert_eq!(seam(&level.vertices.positions), seam(&hill.positions));
        let importance: Vec<f32> =
            hill.positions.iter().map(|p| if p.y > 0.5 { 100.0 } else { 1.0 }).collect();
        let level = Simplifier::new(&hill).importance(&importance).run(&[0.2]).unwrap().remove(0);
        let upper = level.vertices.positions.iter().filter(|p| p.y > 0.5).count();
        assert!(3 * upper > 2 * level.vertices.positions.len(), "{upper}");
    }

    #[test]
    fn sizes_and_lists_that_make_no_sense_are_refused() {
        let hill = hill(2);
        for target in
            [Target::Ratio(0.0), Target::Ratio(f64::NAN), Target::Ratio(1.5), Target::Triangles(0)]
        {
            assert!(simplify(&hill, &[target]).unwrap_err().to_string().contains("is no size"));
        }
        let short = Simplifier::new(&hill).locked(&[true]).run(&[0.5]).unwrap_err().to_string();
        assert!(short.contains("1 locks for 12 vertices"), "{short}");
    }
}
