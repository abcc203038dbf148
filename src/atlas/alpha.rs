//! The use of an atlas's alpha, and a note on its coverage.

use seamwise_texture::KeptCoverage;

use crate::document::material::AlphaUse;

/// The use of an image's alpha in all materials that have it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Alpha {
    /// Whether some of them hide what has alpha 0: it is the base color of a `MASK` or `BLEND`.
    pub hides: bool,
    /// Whether others show it regardless.
    pub shows: bool,
    /// The least alpha that the first `MASK` among them shows.
    pub cutoff: Option<f32>,
}

impl Alpha {
    pub(super) fn add(&mut self, alpha: AlphaUse) {
        match alpha {
            AlphaUse::CutsAt(cutoff) => {
                self.hides = true;
                self.cutoff = self.cutoff.or(Some(cutoff));
            }
            AlphaUse::Blends => self.hides = true,
            AlphaUse::Shows => self.shows = true,
        }
    }
}

/// A note on an alpha that was scaled with its image, for people.
pub(crate) fn coverage_note(coverage: &KeptCoverage) -> String {
    let KeptCoverage { cutoff, before, scaled, after } = coverage;
    let [before, scaled, after] = [before, scaled, after].map(|share| 100.0 * share);
    format!(
        "alpha is scaled so that {after:.1} % of it pass {cutoff} as {before:.1} % did, not {scaled:.1} %"
    )
}
