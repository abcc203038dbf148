//! The refinement for a picture, from that of the one before.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rustc_hash::FxHashMap;

use super::camera::Camera;
use super::mesh::SelectiveMesh;

/// How fine a mesh is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Most triangles; `usize::MAX` for as many as it takes.
    pub triangles: usize,
    /// The error in pixels that is small enough: of the shape, and of shading, of which a patch that is off by a
    /// half of the light counts as a quarter of its width.
    pub pixels: f32,
}

/// A mesh after a refinement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// The largest error of a triangle in pixels, as it counts: twice on silhouettes, a tenth where it is not seen.
    pub pixels: f32,
    /// Collapses that were undone and done.
    pub splits: usize,
    /// Those done.
    pub collapses: usize,
}

/// A part gives way to another only if its error is this share of it, so that two do not swap for ever.
const SWAP: f32 = 0.8;

/// Errors in the order of floats, that are not negative.
type Key = (u32, u32);

/// A refinement at work.
struct Work<'a> {
    mesh: &'a mut SelectiveMesh,
    cameras: &'a [Camera],
    /// The collapses that were done and undone: true are the done. Each goes one way in a picture.
    changed: FxHashMap<u32, bool>,
    /// The largest errors, to be undone; the smallest, to be done. What no longer can be is passed over.
    splits: BinaryHeap<Key>,
    collapses: BinaryHeap<Reverse<Key>>,
}

impl SelectiveMesh {
    /// Refines where the cameras see more than the goal allows, and coarsens elsewhere. All count what they see
    /// most closely. What is fine already for the picture before stays, so small moves cost little.
    pub fn refine_for(&mut self, cameras: &[Camera], goal: Goal) -> Refined {
        let (splits, collapses) = (BinaryHeap::new(), BinaryHeap::new());
        let mut work =
            Work { mesh: self, cameras, changed: FxHashMap::default(), splits, collapses };
        work.fill();
        work.coarsen_to(goal.triangles);
        work.refine(goal);
        work.coarsen_below(goal.pixels);
        let done = work.changed.values().filter(|done| **done).count();
        let splits = work.changed.len() - done;
        Refined { pixels: self.pixels(cameras), splits, collapses: done }
    }

    /// The largest error of a triangle in pixels, as it counts.
    pub fn pixels(&self, cameras: &[Camera]) -> f32 {
        let shown = self.shown.all().iter();
        shown.map(|&collapse| self.pixels_of(collapse, cameras)).fold(0.0, f32::max)
    }

    fn pixels_of(&self, collapse: u32, cameras: &[Camera]) -> f32 {
        let bounds = self.bounds_of(collapse);
        cameras.iter().map(|camera| camera.error(bounds, self.near)).fold(0.0, f32::max)
    }
}

impl Work<'_> {
    fn key(&self, collapse: u32) -> Key {
        (self.mesh.pixels_of(collapse, self.cameras).to_bits(), collapse)
    }

    fn fill(&mut self) {
        let shown = self.mesh.shown.all().iter().map(|&own| self.key(own)).collect::<Vec<_>>();
        let ready = self.mesh.ready.all().iter().map(|&own| Reverse(self.key(own)));
        self.collapses = ready.collect::<Vec<_>>().into();
        self.splits = shown.into();
    }

    fn collapse(&mut self, collapse: u32) {
        self.mesh.collapse(collapse);
        self.changed.insert(collapse, true);
        self.splits.push(self.key(collapse));
        let mut next = std::mem::take(&mut self.collapses);
        self.mesh.after(collapse).for_each(|after| next.push(Reverse(self.key(after))));
        self.collapses = next;
    }

    fn split(&mut self, collapse: u32) {
        self.mesh.split(collapse);
        self.changed.insert(collapse, false);
        let mut next = std::mem::take(&mut self.splits);
        self.mesh.before(collapse).for_each(|before| next.push(self.key(before)));
        self.splits = next;
        self.collapses.push(Reverse(self.key(collapse)));
    }

    /// The collapse that leaves the smallest error, if it is below a limit and was not just undone.
    fn next_collapse(&mut self, limit: f32) -> Option<u32> {
        while let Some(&Reverse((error, collapse))) = self.collapses.peek() {
            if f32::from_bits(error) > limit {
                return None;
            }
            self.collapses.pop();
            if self.mesh.ready.has(collapse) && self.changed.get(&collapse) != Some(&false) {
                return Some(collapse);
            }
        }
        None
    }

    fn coarsen_to(&mut self, triangles: usize) {
        while self.mesh.triangles() > triangles {
            let Some(collapse) = self.next_collapse(f32::INFINITY) else { return };
            self.collapse(collapse);
        }
    }

    fn coarsen_below(&mut self, pixels: f32) {
        while let Some(collapse) = self.next_collapse(pixels) {
            self.collapse(collapse);
        }
    }

    fn refine(&mut self, goal: Goal) {
        while let Some((error, collapse)) = self.splits.pop() {
            let error = f32::from_bits(error);
            if error <= goal.pixels {
                return;
            }
            if !self.mesh.is_done(collapse) || !self.mesh.shown.has(collapse) {
                continue;
            }
            let may = |own: u32| self.changed.get(&own) != Some(&true);
            let Some(held) = self.mesh.held_by(collapse, may) else { continue };
            let more: usize = held.iter().map(|&own| self.mesh.taken(own)).sum();
            if !self.make_room(more, (&held, error), goal.triangles) {
                return;
            }
            held.into_iter().for_each(|own| self.split(own));
        }
    }

    /// Coarsens elsewhere until there is room for so many triangles more.
    fn make_room(&mut self, more: usize, (held, error): (&[u32], f32), most: usize) -> bool {
        let mut passed = Vec::new();
        while self.mesh.triangles() + more > most {
            let Some(next) = self.next_collapse(SWAP * error) else {
                passed.into_iter().for_each(|own| self.collapses.push(own));
                return false;
            };
            if held.iter().any(|&own| self.mesh.waits(next, own)) {
                passed.push(Reverse(self.key(next)));
            } else {
                self.collapse(next);
            }
        }
        passed.into_iter().for_each(|own| self.collapses.push(own));
        true
    }
}
