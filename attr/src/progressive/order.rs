//! Surfaces that go up and down together.

use crate::progressive::log::side_by_side;
use crate::progressive::mesh::ProgressiveMesh;

/// Surfaces with one order of all their collapses.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgressiveScene {
    meshes: Vec<ProgressiveMesh>,
    /// The surface of each collapse.
    order: Vec<u32>,
    applied: usize,
    /// Triangles of all after so many collapses.
    counts: Vec<usize>,
}

impl ProgressiveScene {
    /// Surfaces at their finest. Between two `phases`, numbers of collapses of each surface that belong
    /// together, each goes down in proportion to what it has to lose there.
    pub(super) fn new(meshes: Vec<ProgressiveMesh>, phases: &[&[usize]]) -> Self {
        let count = phases.iter().map(|own| own.len()).min().unwrap_or(0);
        let mut done = vec![0; meshes.len()];
        let mut order = Vec::new();
        let all = || meshes.iter().map(ProgressiveMesh::collapses).collect::<Vec<_>>();
        let ends = |phase: usize| phases.iter().map(|own| own[phase]).collect::<Vec<_>>();
        for ends in (0..count).map(ends).chain([all()]) {
            let own: Vec<usize> = ends.iter().zip(&done).map(|(end, done)| end - done).collect();
            order.extend(side_by_side(&own));
            done = ends;
        }
        Self::with_order(meshes, order)
    }

    /// Surfaces side by side, a phase from one level of each to the next.
    pub fn side_by_side(meshes: Vec<ProgressiveMesh>) -> Self {
        let levels: Vec<Vec<usize>> = meshes.iter().map(|mesh| mesh.levels().to_vec()).collect();
        Self::new(meshes, &levels.iter().map(Vec::as_slice).collect::<Vec<_>>())
    }

    fn with_order(meshes: Vec<ProgressiveMesh>, order: Vec<u32>) -> Self {
        let mut counts = Vec::with_capacity(order.len() + 1);
        let mut left: usize = meshes.iter().map(|mesh| mesh.triangles_after(0)).sum();
        let mut done = vec![0; meshes.len()];
        counts.push(left);
        for &surface in &order {
            let (mesh, at) = (&meshes[surface as usize], &mut done[surface as usize]);
            left -= mesh.triangles_after(*at) - mesh.triangles_after(*at + 1);
            *at += 1;
            counts.push(left);
        }
        let applied = 0;
        Self { meshes, order, applied, counts }
    }

    /// The surfaces, each as it is now.
    pub fn meshes(&self) -> &[ProgressiveMesh] {
        &self.meshes
    }

    /// The surfaces alone.
    pub fn into_meshes(self) -> Vec<ProgressiveMesh> {
        self.meshes
    }

    /// Brings the surfaces into another frame; their collapses stay.
    ///
    /// # Errors
    /// The first that `map` fails with.
    pub fn map_meshes<E>(
        &mut self,
        map: impl FnMut((usize, &mut ProgressiveMesh)) -> Result<(), E>,
    ) -> Result<(), E> {
        let applied = self.applied;
        self.seek(0);
        self.meshes.iter_mut().enumerate().try_for_each(map)?;
        self.meshes.iter_mut().for_each(|mesh| mesh.seek(0));
        self.seek(applied);
        Ok(())
    }

    /// The surface of each collapse, in the order of the simplification.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Number of collapses that are done now: 0 is the source.
    pub fn applied(&self) -> usize {
        self.applied
    }

    /// Triangles now.
    pub fn triangles(&self) -> usize {
        self.counts[self.applied]
    }

    /// Triangles after so many collapses.
    pub fn triangles_after(&self, collapses: usize) -> usize {
        self.counts[collapses.min(self.order.len())]
    }

    /// Refines or coarsens until so many collapses are done, or all there are.
    pub fn seek(&mut self, collapses: usize) {
        let collapses = collapses.min(self.order.len());
        while self.applied > collapses {
            self.applied -= 1;
            self.meshes[self.order[self.applied] as usize].refine(1);
        }
        while self.applied < collapses {
            self.meshes[self.order[self.applied] as usize].coarsen(1);
            self.applied += 1;
        }
    }

    /// The least number of collapses that leave at most `triangles`, or all of them.
    pub fn collapses_to(&self, triangles: usize) -> usize {
        self.counts.partition_point(|&left| left > triangles).min(self.order.len())
    }
}
