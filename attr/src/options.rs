//! Options of a simplification: its settings, and lists of one entry per point.

use crate::error::{Error, Result};
use crate::id::PointId;
use crate::mesh::Mesh;
use crate::motion::Motion;
use crate::settings::{Placement, Settings};

/// Options of a simplification.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options<'a> {
    /// The figures, which hold for the whole surface.
    pub settings: Settings,
    /// One per point, or empty if all count alike: what the costs around it are multiplied by, 0 or more.
    /// See [`view_importance`](crate::view_importance) and
    /// [`curvature_importance`](crate::curvature_importance).
    pub importance: &'a [f32],
    /// One per point, or empty: its color as it is seen, sRGB in 0…1. A small shell that is removed costs its
    /// contrast to what lies behind, so that eyes and lamps stay longer; only with `max_deviation`.
    pub colors: &'a [[f32; 3]],
    /// One per point, or empty if all are free: a locked point keeps its position and the
    /// attributes of its wedges to the bit, and no edge at it collapses.
    pub locked: &'a [bool],
    /// One per point, or empty if none is: whether it is of a card, a small open shell of a crowd. Cards go
    /// whole, in no order, and without regard to the limits on deviation: see
    /// [`grow_cards`](crate::grow_cards).
    pub cards: &'a [bool],
    /// The ways in which the surface moves, if it does: places that move unlike their surroundings are
    /// kept, however flat they are at rest.
    pub motion: Option<&'a Motion>,
}

impl From<Settings> for Options<'_> {
    fn from(settings: Settings) -> Self {
        Self { settings, ..Self::default() }
    }
}

impl Options<'_> {
    /// One per point of a level that stands for `sources`: whether it is locked. Empty if none is.
    pub(crate) fn locked_of(&self, sources: &[PointId]) -> Vec<bool> {
        if self.settings.placement == Placement::Ends {
            return vec![true; sources.len()];
        }
        if self.locked.is_empty() {
            return Vec::new();
        }
        sources.iter().map(|&source| self.locked[source]).collect()
    }

    /// Checks that every figure makes sense and every list fits `mesh`.
    pub(crate) fn check(&self, mesh: &Mesh) -> Result<()> {
        self.settings.check()?;
        if self.importance.iter().any(|x| !x.is_finite() || *x < 0.0) {
            let what = "importances must be finite and not negative".into();
            return Err(Error::Options { what });
        }
        let points = mesh.positions.len();
        let lists = [
            (self.locked.len(), "locks"),
            (self.importance.len(), "importances"),
            (self.colors.len(), "colors"),
            (self.cards.len(), "marks of cards"),
            (self.motion.map_or(0, Motion::points), "motions"),
        ];
        for (count, what) in lists {
            if count != 0 && count != points {
                let what = format!("{count} {what} for {points} points");
                return Err(Error::Options { what });
            }
        }
        Ok(())
    }
}
