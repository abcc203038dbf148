//! Sets of collapses that a refinement looks at.

/// A set of numbers, to be changed and walked fast.
#[derive(Clone, Debug)]
pub(crate) struct Members {
    all: Vec<u32>,
    places: Vec<u32>,
}

const OUT: u32 = u32::MAX;

impl Members {
    /// An empty set of numbers below `count`.
    pub(crate) fn new(count: usize) -> Self {
        Self { all: Vec::new(), places: vec![OUT; count] }
    }

    pub(crate) fn has(&self, own: u32) -> bool {
        self.places[own as usize] != OUT
    }

    pub(crate) fn all(&self) -> &[u32] {
        &self.all
    }

    pub(crate) fn insert(&mut self, own: u32) {
        if !self.has(own) {
            self.places[own as usize] = self.all.len() as u32;
            self.all.push(own);
        }
    }

    pub(crate) fn remove(&mut self, own: u32) {
        let place = std::mem::replace(&mut self.places[own as usize], OUT);
        if place != OUT {
            self.all.swap_remove(place as usize);
            if let Some(&moved) = self.all.get(place as usize) {
                self.places[moved as usize] = place;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_come_and_go() {
        let mut own = Members::new(4);
        [2, 0, 3, 0].into_iter().for_each(|member| own.insert(member));
        own.remove(2);
        own.remove(2);
        assert_eq!((own.all(), own.has(0), own.has(2)), (&[3, 0][..], true, false));
        own.remove(0);
        own.remove(3);
        assert!(own.all().is_empty());
    }
}
