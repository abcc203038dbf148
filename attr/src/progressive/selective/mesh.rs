//! A mesh of which each part is as fine as it is asked to be.

use super::bounds::{Bounds, Samples};
use super::forest::{Forest, NONE};
use super::front::Members;
use crate::id::TriangleId;
use crate::mesh::Mesh;
use crate::progressive::mesh::{Extracted, ProgressiveMesh};

/// A mesh whose collapses are done and undone where an eye asks for it.
///
/// Values are those of the descent, without a polish of levels.
///
/// ```
/// use std::sync::atomic::AtomicUsize;
/// use seamwise_attr::{Goal, Options, SelectiveMesh, Vertices, Camera, record_chain, weld};
/// use seamwise_attr::glam::Vec3;
///
/// # let at = |x: u32, z: u32| [x as f32, (0.3 * (x * z) as f32).sin(), z as f32];
/// # let positions: Vec<[f32; 3]> = (0..400).map(|i| at(i % 20, i / 20)).collect();
/// # let square = |a: u32| [a, a + 20, a + 1, a + 1, a + 20, a + 21];
/// # let squares = (0..380).filter(|a| a % 20 < 19).flat_map(square).collect::<Vec<_>>();
/// let hills = weld(&Vertices::new(&positions, &squares)?)?.mesh;
/// let recorded = record_chain(&hills, &[100], &Options::default(), &AtomicUsize::new(0))?;
/// let mut mesh = SelectiveMesh::new(recorded.scene.meshes()[0].clone());
/// let camera = Camera::new(Vec3::new(0.0, 3.0, -1.0), Vec3::new(9.0, 0.0, 9.0), 0.8, [1280, 720])?;
/// let refined = mesh.refine_for(&[camera], Goal { triangles: 300, ..Goal::default() });
/// assert!(mesh.triangles() <= 300 && refined.pixels > 0.0);
/// # Ok::<(), seamwise_attr::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct SelectiveMesh {
    pub(super) mesh: ProgressiveMesh,
    forest: Forest,
    bounds: Vec<Bounds>,
    done: Vec<bool>,
    /// Per collapse: how many that must be done before it are not, and how many after it are done.
    missing: Vec<u32>,
    following: Vec<u32>,
    /// Per triangle: the last collapse done that changed it; and per collapse, how many of those are there.
    owners: Vec<u32>,
    owned: Vec<u32>,
    /// Collapses that have triangles, and those that can be done next.
    pub(super) shown: Members,
    pub(super) ready: Members,
    triangles: usize,
    /// The least distance that counts.
    pub(super) near: f32,
}

/// The least distance that counts, as a share of the surface's diagonal.
const NEAR: f32 = 1e-4;

impl SelectiveMesh {
    /// A mesh at its coarsest; looks at all of its collapses, which takes a while.
    pub fn new(mut mesh: ProgressiveMesh) -> Self {
        mesh.seek(0);
        mesh.settles.clear();
        let mut samples = Samples::of(&mesh);
        let low = mesh.state().positions.iter().copied().reduce(glam::Vec3::min);
        let high = mesh.state().positions.iter().copied().reduce(glam::Vec3::max);
        let diagonal = (high.unwrap_or_default() - low.unwrap_or_default()).length();
        let forest = Forest::walk(&mut mesh, |mesh, _, touches, is_before| match is_before {
            true => samples.take(touches),
            false => samples.give(mesh, touches),
        });
        let count = mesh.collapses();
        let mut own = Self {
            bounds: samples.bounds,
            done: vec![true; count],
            missing: vec![0; count],
            following: (0..count as u32).map(|at| forest.after.get(at).len() as u32).collect(),
            owners: vec![NONE; mesh.state().triangles.len()],
            owned: vec![0; count],
            shown: Members::new(count),
            ready: Members::new(count),
            triangles: mesh.triangles_after(count),
            near: NEAR * diagonal,
            mesh,
            forest,
        };
        for at in 0..count as u32 {
            for touch in own.forest.touches.get(at) {
                own.owners[touch.triangle.index()] = at;
            }
        }
        for triangle in (0..own.owners.len()).map(TriangleId::new) {
            let owner = own.owners[triangle.index()];
            if owner != NONE && own.mesh.is_live(triangle) {
                own.owned[owner as usize] += 1;
                own.shown.insert(owner);
            }
        }
        own
    }

    /// Triangles now.
    pub fn triangles(&self) -> usize {
        self.triangles
    }

    /// Triangles of the source.
    pub fn source_triangles(&self) -> usize {
        self.owners.len()
    }

    /// The mesh now, and what its elements are in the source.
    pub fn extract(&self) -> Extracted {
        self.mesh.extract_recorded()
    }

    /// The lists as they are now, numbered as in the source: see [`ProgressiveMesh::state`].
    pub fn state(&self) -> &Mesh {
        self.mesh.state()
    }

    /// Whether a triangle is there now.
    pub fn is_live(&self, triangle: TriangleId) -> bool {
        self.mesh.is_live(triangle)
    }

    /// How far points of the source are off from a triangle at most, in the units of the mesh, so that one of
    /// them is no farther from the mesh now.
    pub fn error_at(&self, triangle: TriangleId) -> f32 {
        self.bounds.get(self.owners[triangle.index()] as usize).map_or(0.0, |own| own.error)
    }

    pub(super) fn bounds_of(&self, collapse: u32) -> &Bounds {
        &self.bounds[collapse as usize]
    }

    pub(super) fn is_done(&self, collapse: u32) -> bool {
        self.done[collapse as usize]
    }

    /// Whether one collapse waits for another.
    pub(super) fn waits(&self, collapse: u32, before: u32) -> bool {
        self.forest.before.get(collapse).binary_search(&before).is_ok()
    }

    /// The collapses that a collapse waits for, and those that wait for it and are ready.
    pub(super) fn before(&self, collapse: u32) -> impl Iterator<Item = u32> + '_ {
        self.forest.before.get(collapse).iter().copied().filter(|&own| self.shown.has(own))
    }

    pub(super) fn after(&self, collapse: u32) -> impl Iterator<Item = u32> + '_ {
        self.forest.after.get(collapse).iter().copied().filter(|&own| self.ready.has(own))
    }

    /// Triangles that a collapse takes away.
    pub(super) fn taken(&self, collapse: u32) -> usize {
        self.mesh.collapse(collapse as usize).triangles.len()
    }

    /// A collapse and all that wait for it and are done, the last first; only if `may` all of them.
    pub(super) fn held_by(&self, collapse: u32, may: impl Fn(u32) -> bool) -> Option<Vec<u32>> {
        let (mut all, mut next) = (vec![collapse], 0);
        while let Some(&own) = all.get(next) {
            if !may(own) {
                return None;
            }
            // Most have few: a search in a list is faster than a set.
            for &after in self.forest.after.get(own) {
                if self.is_done(after) && !all.contains(&after) {
                    all.push(after);
                }
            }
            next += 1;
        }
        all.sort_unstable_by(|a, b| b.cmp(a));
        Some(all)
    }

    /// Does a collapse that is ready.
    pub(super) fn collapse(&mut self, collapse: u32) {
        debug_assert!(self.ready.has(collapse));
        self.mesh.apply(collapse as usize);
        self.done[collapse as usize] = true;
        self.ready.remove(collapse);
        self.triangles -= self.taken(collapse);
        for at in 0..self.forest.touches.get(collapse).len() {
            let touch = self.forest.touches.get(collapse)[at];
            self.owners[touch.triangle.index()] = collapse;
            self.give_up(touch.before);
            if touch.stays {
                self.take_up(collapse);
            }
        }
        for &before in self.forest.before.get(collapse) {
            self.following[before as usize] += 1;
        }
        for &after in self.forest.after.get(collapse) {
            self.missing[after as usize] -= 1;
            if self.missing[after as usize] == 0 {
                self.ready.insert(after);
            }
        }
    }

    /// Undoes a collapse for which none that is done waits.
    pub(super) fn split(&mut self, collapse: u32) {
        debug_assert!(self.is_done(collapse) && self.following[collapse as usize] == 0);
        self.mesh.undo(collapse as usize);
        self.done[collapse as usize] = false;
        self.triangles += self.taken(collapse);
        for at in 0..self.forest.touches.get(collapse).len() {
            let touch = self.forest.touches.get(collapse)[at];
            self.owners[touch.triangle.index()] = touch.before;
            if touch.stays {
                self.give_up(collapse);
            }
            self.take_up(touch.before);
        }
        for &before in self.forest.before.get(collapse) {
            self.following[before as usize] -= 1;
        }
        for &after in self.forest.after.get(collapse) {
            self.missing[after as usize] += 1;
            self.ready.remove(after);
        }
        self.ready.insert(collapse);
    }

    fn take_up(&mut self, owner: u32) {
        if owner != NONE {
            self.owned[owner as usize] += 1;
            self.shown.insert(owner);
        }
    }

    fn give_up(&mut self, owner: u32) {
        if owner != NONE {
            self.owned[owner as usize] -= 1;
            if self.owned[owner as usize] == 0 {
                self.shown.remove(owner);
            }
        }
    }
}
