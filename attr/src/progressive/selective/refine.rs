//! The refinement for a picture, from that of the one before.
//!
//! All that is there and all that could be is looked at once for a picture, so that the time of one grows with the
//! triangles shown and with what changes, and not with those of the source. [`Goal::steps`] bounds the second part.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rustc_hash::FxHashMap;

use super::camera::Camera;
use super::mesh::SelectiveMesh;

/// How fine meshes are to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Most triangles, of all meshes together.
    pub triangles: usize,
    /// The error in pixels that is small enough: of the shape, and of shading, of which a patch that is off by a
    /// half of the light counts as a fifth of its width.
    pub pixels: f32,
    /// Most collapses that are done and undone. Where that is too few, the largest errors are dealt with first, and
    /// the next refinement goes on with what is left: the meshes are sound, [`Refined::pixels`] tells how far off
    /// they are, and they have no more triangles than `triangles` or than before. An eye that stands still has what
    /// it asked for after some refinements.
    pub steps: usize,
}

impl Default for Goal {
    /// As fine as the source.
    fn default() -> Self {
        Self { triangles: usize::MAX, pixels: 0.0, steps: usize::MAX }
    }
}

/// Meshes after a refinement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// The largest error of a triangle in pixels, as it counts: a tenth where it is not seen.
    pub pixels: f32,
    /// Collapses that were undone.
    pub splits: usize,
    /// Collapses that were done.
    pub collapses: usize,
}

/// A part gives way to another only if its error is this share of it, so that two do not swap for ever.
const SWAP: f32 = 0.8;

/// A collapse of a mesh.
type Item = (u32, u32);

/// Errors in the order of floats, that are not negative.
type Key = (u32, Item);

/// Refines meshes where their cameras see more than the goal allows, and coarsens them elsewhere. All cameras of a
/// mesh count what they see most closely. What is fine already for the picture before stays, so small moves cost
/// little. `cameras` has a list for each mesh, in its space.
pub fn refine_together(
    meshes: &mut [SelectiveMesh],
    cameras: &[Vec<Camera>],
    goal: Goal,
) -> Refined {
    let cameras: Vec<&[Camera]> = cameras.iter().map(Vec::as_slice).collect();
    Work::new(meshes, &cameras, goal).finish()
}

impl SelectiveMesh {
    /// Refines one mesh: see [`refine_together`].
    pub fn refine_for(&mut self, cameras: &[Camera], goal: Goal) -> Refined {
        Work::new(std::slice::from_mut(self), &[cameras], goal).finish()
    }

    fn pixels_of(&self, collapse: u32, cameras: &[Camera]) -> f32 {
        let bounds = self.bounds_of(collapse);
        cameras.iter().map(|camera| camera.error(bounds, self.near)).fold(0.0, f32::max)
    }
}

/// A refinement at work.
struct Work<'a> {
    meshes: &'a mut [SelectiveMesh],
    cameras: &'a [&'a [Camera]],
    goal: Goal,
    triangles: usize,
    /// The collapses that were done and undone: true are the done. Each goes one way in a picture.
    changed: FxHashMap<Item, bool>,
    /// The largest errors, to be undone; the smallest, to be done. What no longer can be is passed over.
    splits: BinaryHeap<Key>,
    collapses: BinaryHeap<Reverse<Key>>,
    /// The largest error of what was looked at and could not be undone.
    left: Vec<Key>,
}

impl<'a> Work<'a> {
    fn new(meshes: &'a mut [SelectiveMesh], cameras: &'a [&'a [Camera]], goal: Goal) -> Self {
        let triangles = meshes.iter().map(SelectiveMesh::triangles).sum();
        let (splits, collapses) = (BinaryHeap::new(), BinaryHeap::new());
        let (changed, left) = (FxHashMap::default(), Vec::new());
        let mut own = Self { meshes, cameras, goal, triangles, changed, splits, collapses, left };
        let (mut splits, mut collapses) = (Vec::new(), Vec::new());
        for (at, mesh) in (0..).zip(&*own.meshes) {
            splits.extend(mesh.shown.all().iter().map(|&shown| own.key((at, shown))));
            collapses.extend(mesh.ready.all().iter().map(|&ready| Reverse(own.key((at, ready)))));
        }
        (own.splits, own.collapses) = (splits.into(), collapses.into());
        own
    }

    fn finish(mut self) -> Refined {
        self.coarsen_to_budget();
        self.refine();
        self.coarsen_below_goal();
        let done = self.changed.values().filter(|done| **done).count();
        let splits = self.changed.len() - done;
        Refined { pixels: self.pixels(), splits, collapses: done }
    }

    /// The largest error of what is there.
    fn pixels(&mut self) -> f32 {
        let shows = |(_, (at, own)): &Key| self.meshes[*at as usize].shown.has(*own);
        while self.splits.peek().is_some_and(|key| !shows(key)) {
            self.splits.pop();
        }
        let left = self.left.iter().filter(|key| shows(key)).chain(self.splits.peek());
        left.max().map_or(0.0, |(error, _)| f32::from_bits(*error))
    }

    fn mesh(&self, (at, _): Item) -> &SelectiveMesh {
        &self.meshes[at as usize]
    }

    fn key(&self, item: Item) -> Key {
        let error = self.mesh(item).pixels_of(item.1, self.cameras[item.0 as usize]);
        (error.to_bits(), item)
    }

    fn may_step(&self) -> bool {
        self.changed.len() < self.goal.steps
    }

    fn collapse(&mut self, item: Item) {
        self.meshes[item.0 as usize].collapse(item.1);
        self.triangles -= self.mesh(item).taken(item.1);
        self.changed.insert(item, true);
        self.splits.push(self.key(item));
        let mut next = std::mem::take(&mut self.collapses);
        let after = self.mesh(item).after(item.1);
        after.for_each(|after| next.push(Reverse(self.key((item.0, after)))));
        self.collapses = next;
    }

    fn split(&mut self, item: Item) {
        self.meshes[item.0 as usize].split(item.1);
        self.triangles += self.mesh(item).taken(item.1);
        self.changed.insert(item, false);
        let mut next = std::mem::take(&mut self.splits);
        let before = self.mesh(item).before(item.1);
        before.for_each(|before| next.push(self.key((item.0, before))));
        self.splits = next;
        self.collapses.push(Reverse(self.key(item)));
    }

    /// The collapse that leaves the smallest error, if it is below a limit and was not just undone.
    fn next_collapse(&mut self, limit: f32) -> Option<Item> {
        while let Some(&Reverse((error, item))) = self.collapses.peek() {
            if f32::from_bits(error) > limit || !self.may_step() {
                return None;
            }
            self.collapses.pop();
            if self.mesh(item).ready.has(item.1) && self.changed.get(&item) != Some(&false) {
                return Some(item);
            }
        }
        None
    }

    fn coarsen_to_budget(&mut self) {
        while self.triangles > self.goal.triangles {
            let Some(item) = self.next_collapse(f32::INFINITY) else { return };
            self.collapse(item);
        }
    }

    fn coarsen_below_goal(&mut self) {
        while let Some(item) = self.next_collapse(self.goal.pixels) {
            self.collapse(item);
        }
    }

    fn refine(&mut self) {
        while let Some(key) = self.splits.pop() {
            let (error, item) = (f32::from_bits(key.0), key.1);
            if !self.mesh(item).is_done(item.1) || !self.mesh(item).shown.has(item.1) {
                continue;
            }
            self.left.push(key);
            if error <= self.goal.pixels || !self.may_step() {
                return;
            }
            let may = |own: u32| self.changed.get(&(item.0, own)) != Some(&true);
            let mesh = self.mesh(item);
            let Some(held) = mesh.held_by(item.1, may) else { continue };
            let more: usize = held.iter().map(|&own| mesh.taken(own)).sum();
            if !self.make_room(more, (item.0, &held), error) {
                return;
            }
            for own in held {
                if !self.may_step() {
                    return;
                }
                self.split((item.0, own));
            }
        }
    }

    /// Coarsens elsewhere until there is room for so many triangles more.
    fn make_room(&mut self, more: usize, (at, held): (u32, &[u32]), error: f32) -> bool {
        let mut passed = Vec::new();
        while self.triangles.saturating_add(more) > self.goal.triangles {
            let Some(next) = self.next_collapse(SWAP * error) else {
                self.collapses.extend(passed);
                return false;
            };
            let waits = |own: &u32| self.mesh(next).waits(next.1, *own);
            if next.0 == at && held.iter().any(waits) {
                passed.push(Reverse(self.key(next)));
            } else {
                self.collapse(next);
            }
        }
        self.collapses.extend(passed);
        true
    }
}
