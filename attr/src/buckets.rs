//! Entries by a number that each has.

/// Entries by their number: for each number below a count the entries that have it, in their order.
pub(crate) struct Buckets {
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Buckets {
    /// Sorts entries by their `keys`, all below `count`.
    pub(crate) fn new(keys: impl Iterator<Item = u32> + Clone, count: usize) -> Self {
        let mut starts = vec![0u32; count + 1];
        keys.clone().for_each(|key| starts[key as usize + 1] += 1);
        for at in 0..count {
            starts[at + 1] += starts[at];
        }
        let mut next = starts.clone();
        let mut entries = vec![0u32; starts[count] as usize];
        for (entry, key) in (0..).zip(keys) {
            let at = &mut next[key as usize];
            entries[*at as usize] = entry;
            *at += 1;
        }
        Self { starts, entries }
    }

    /// The entries of a key.
    pub(crate) fn of(&self, key: usize) -> &[u32] {
        &self.entries[self.starts[key] as usize..self.starts[key + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_lie_under_their_keys_in_order() {
        let buckets = Buckets::new([2, 0, 2, 3, 2].into_iter(), 5);
        let all: Vec<&[u32]> = (0..5).map(|key| buckets.of(key)).collect();
        assert_eq!(all, [&[1][..], &[], &[0, 2, 4], &[3], &[]]);
    }
}
