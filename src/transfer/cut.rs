//! The order in which images of levels' own are cut to a budget.

use super::sheet::Made;

/// An image of a level's own, and what it is worth.
pub(super) struct Priced {
    pub(super) sheet: usize,
    pub(super) level: usize,
    /// Its number among the choices.
    pub(super) output: usize,
    pub(super) bytes: usize,
    per_byte: f64,
}

/// The images of levels' own, those of the least worth per byte first.
pub(super) fn by_worth(made: &[Vec<Made>]) -> Vec<Priced> {
    let mut priced = Vec::new();
    for (sheet, levels) in made.iter().enumerate() {
        for (level, made) in levels.iter().enumerate() {
            let own = made.choices.iter().enumerate().filter(|(_, (_, choice))| choice.own);
            priced.extend(own.map(|(output, (_, choice))| {
                let bytes = choice.own_bytes;
                Priced { sheet, level, output, bytes, per_byte: choice.worth / bytes.max(1) as f64 }
            }));
        }
    }
    priced.sort_by(|a, b| a.per_byte.total_cmp(&b.per_byte));
    priced
}
