//! Small numbers noted on ids, forgotten all at once.

/// A map from ids to `u32`, cleared in constant time: each entry carries the round it was written in.
pub(crate) struct Marks {
    entries: Vec<(u32, u32)>,
    round: u32,
}

impl Marks {
    /// An empty map with room for ids below `count`.
    pub(crate) fn new(count: usize) -> Self {
        Self { entries: vec![(0, 0); count], round: 1 }
    }

    /// Forgets all marks.
    pub(crate) fn clear(&mut self) {
        self.round = self.round.checked_add(1).unwrap_or_else(|| {
            self.entries.fill((0, 0));
            1
        });
    }

    /// The mark on `index`, if it has one since the last clear.
    #[inline]
    pub(crate) fn get(&self, index: usize) -> Option<u32> {
        let &(round, value) = self.entries.get(index)?;
        (round == self.round).then_some(value)
    }

    /// Puts a mark on `index`.
    #[inline]
    pub(crate) fn set(&mut self, index: usize, value: u32) {
        if index >= self.entries.len() {
            self.entries.resize((index + 1).next_power_of_two(), (0, 0));
        }
        self.entries[index] = (self.round, value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_gone_after_a_clear() {
        let mut marks = Marks::new(3);
        marks.set(1, 7);
        assert_eq!((marks.get(0), marks.get(1)), (None, Some(7)));
        marks.clear();
        assert_eq!(marks.get(1), None);
    }

    #[test]
    fn marks_survive_the_wrap_of_the_round() {
        let mut marks = Marks::new(2);
        marks.set(0, 1);
        marks.round = u32::MAX;
        marks.clear();
        assert_eq!(marks.get(0), None);
    }
}
