//! The end of a simplification before its target.

/// The reason why a simplification ended before its target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// Every edge left would break the surface or fold its texture.
    NoLegalCollapse,
    /// The next collapse would pass the error limit.
    ErrorLimit,
    /// Every collapse left would take the surface farther from the source, or more of its area, than is
    /// allowed, or is illegal.
    Deviation,
}

impl std::fmt::Display for Stop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::NoLegalCollapse => {
                "no edge is left that can collapse without breaking the surface or folding its texture"
            }
            Self::ErrorLimit => "the next collapse would pass the error limit",
            Self::Deviation => {
                "any further collapse would take the surface too far from the source, or too much of its area"
            }
        })
    }
}
