//! Numbers of things that are equal, found by their hashes.

/// End of a run of slots: nothing is there.
const FREE: u32 = u32::MAX;
/// Slots at first.
const FIRST: usize = 16;

/// Numbers by the hashes of what they stand for, which the caller holds: so a slot takes 8 bytes whatever
/// that is, and nothing is allocated for a key. Numbers are below `u32::MAX`.
pub(crate) struct Table {
    /// A hash and a number each, twice as many as numbers at least.
    slots: Vec<[u32; 2]>,
    used: usize,
}

impl Table {
    /// An empty table.
    pub(crate) fn new() -> Self {
        Self { slots: vec![[0, FREE]; FIRST], used: 0 }
    }

    /// The number with this hash that `is_same` is true of, or one that `make` gives.
    pub(crate) fn find_or(
        &mut self,
        hash: u32,
        is_same: impl Fn(u32) -> bool,
        make: impl FnOnce() -> u32,
    ) -> u32 {
        let mask = self.slots.len() - 1;
        let mut at = hash as usize & mask;
        loop {
            match self.slots[at] {
                [_, FREE] => break,
                [own, number] if own == hash && is_same(number) => return number,
                _ => at = (at + 1) & mask,
            }
        }
        let number = make();
        self.slots[at] = [hash, number];
        self.used += 1;
        if 2 * self.used > self.slots.len() {
            self.grow();
        }
        number
    }

    fn grow(&mut self) {
        let len = 2 * self.slots.len();
        let old = std::mem::replace(&mut self.slots, vec![[0, FREE]; len]);
        for slot in old.into_iter().filter(|slot| slot[1] != FREE) {
            let mut at = slot[0] as usize & (len - 1);
            while self.slots[at][1] != FREE {
                at = (at + 1) & (len - 1);
            }
            self.slots[at] = slot;
        }
    }
}

/// A hash of words whose lower bits depend on all of them.
pub(crate) fn hash_words(words: impl Iterator<Item = u32>) -> u32 {
    let mut hash = 0x9e37_79b9_7f4a_7c15u64;
    for word in words {
        hash = (hash ^ u64::from(word)).wrapping_mul(0xd6e8_feb8_6659_fd93);
        hash ^= hash >> 32;
    }
    hash as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_things_have_one_number_and_others_their_own_even_under_one_hash() {
        let names: Vec<u32> = (0..2000).map(|at| at % 700).collect();
        for hash in [|name: u32| hash_words([name].into_iter()), |name: u32| name % 3] {
            let (mut table, mut known) = (Table::new(), Vec::new());
            for &name in &names {
                let next = known.len() as u32;
                let is_same = |number: u32| known[number as usize] == name;
                let number = table.find_or(hash(name), is_same, || next);
                if number == next {
                    known.push(name);
                }
                assert_eq!(number, name, "numbers are given in the order of first mention");
            }
            assert_eq!(known.len(), 700);
        }
    }

    #[test]
    fn floats_that_differ_in_their_upper_bits_alone_spread_over_the_slots() {
        let hashes = (0..1024u32).map(|at| hash_words([(at as f32).to_bits(), 0, 0].into_iter()));
        let mut slots: Vec<u32> = hashes.map(|hash| hash & 1023).collect();
        slots.sort_unstable();
        slots.dedup();
        assert!(slots.len() > 550, "{}", slots.len());
    }
}
