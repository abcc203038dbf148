//! The levels of a whole asset, as a descent leaves them.

use seamwise_attr::{Level, Mesh};

use crate::error::{Error, Result};

/// Levels of all surfaces of an asset, level by level.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lods {
    /// One per level, the finest first, each with one per surface in the asset's order.
    levels: Vec<Vec<Level>>,
}

impl Lods {
    /// The surfaces of each level, as many in each.
    pub(crate) fn new(levels: Vec<Vec<Level>>) -> Self {
        Self { levels }
    }

    /// The levels of each surface, `count` of them.
    ///
    /// # Errors
    /// [`Error::Internal`] if a surface has another number of levels.
    pub(crate) fn from_chains(chains: Vec<Vec<Level>>, count: usize) -> Result<Self> {
        let mut levels: Vec<Vec<Level>> = (0..count).map(|_| Vec::new()).collect();
        for chain in chains {
            if chain.len() != count {
                return Err(Error::internal("a surface lacks a level"));
            }
            levels.iter_mut().zip(chain).for_each(|(level, own)| level.push(own));
        }
        Ok(Self { levels })
    }

    /// Number of levels.
    pub(crate) fn count(&self) -> usize {
        self.levels.len()
    }

    /// The surfaces of one level.
    pub(crate) fn level(&self, index: usize) -> &[Level] {
        &self.levels[index]
    }

    /// The surfaces of each level, to be changed.
    pub(crate) fn levels_mut(&mut self) -> impl Iterator<Item = &mut [Level]> {
        self.levels.iter_mut().map(Vec::as_mut_slice)
    }

    /// The surfaces of each level.
    pub(crate) fn levels(&self) -> impl ExactSizeIterator<Item = &[Level]> {
        self.levels.iter().map(Vec::as_slice)
    }

    /// The meshes of each level, one per surface.
    pub(crate) fn meshes(&self) -> Vec<Vec<&Mesh>> {
        self.levels().map(|level| level.iter().map(|surface| &surface.mesh).collect()).collect()
    }

    /// The levels of one surface.
    pub(crate) fn of_surface(&self, surface: usize) -> impl Iterator<Item = &Level> {
        self.levels.iter().map(move |level| &level[surface])
    }
}
