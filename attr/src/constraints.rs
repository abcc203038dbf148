//! Quadrics of points beside those of their wedges.

use crate::id::PointId;
use crate::quadric::PointQuadric;

/// No quadric.
const NONE: u32 = u32::MAX;

/// The planes of borders and seams, and what wedges that are gone have left: a sum for each point that has
/// any. Next to none within a surface do, so that a point takes 4 bytes instead of 80.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Constraints {
    /// Per point: the place of its sum.
    places: Vec<u32>,
    sums: Vec<PointQuadric>,
}

impl Constraints {
    /// None for any of so many points.
    pub(crate) fn new(points: usize) -> Self {
        Self { places: vec![NONE; points], sums: Vec::new() }
    }

    /// For no point, with room for so many.
    pub(crate) fn with_capacity(points: usize) -> Self {
        Self { places: Vec::with_capacity(points), sums: Vec::new() }
    }

    /// The sum of a point, if it has one.
    #[inline]
    pub(crate) fn get(&self, point: PointId) -> Option<&PointQuadric> {
        self.sums.get(self.places[point] as usize)
    }

    /// Adds the sum of a point to a quadric.
    #[inline]
    pub(crate) fn add_to(&self, quadric: &mut PointQuadric, point: PointId) {
        if let Some(own) = self.get(point) {
            quadric.add(own);
        }
    }

    /// Adds to the sum of a point.
    pub(crate) fn add(&mut self, point: PointId, quadric: &PointQuadric) {
        match self.sums.get_mut(self.places[point] as usize) {
            Some(own) => own.add(quadric),
            None => {
                self.places[point] = self.sums.len() as u32;
                self.sums.push(*quadric);
            }
        }
    }

    /// Adds a point with its sum.
    pub(crate) fn push(&mut self, sum: Option<&PointQuadric>) {
        self.places.push(sum.map_or(NONE, |_| self.sums.len() as u32));
        self.sums.extend(sum);
    }

    /// Forgets all but the first points.
    pub(crate) fn truncate(&mut self, points: usize) {
        self.places.truncate(points);
    }

    /// Forgets all sums.
    pub(crate) fn clear(&mut self) {
        self.places.fill(NONE);
        self.sums.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn what_is_added_to_a_point_is_its_sum_and_others_have_none() {
        let plane = PointQuadric::from_plane(DVec3::ZERO, DVec3::X, 2.0);
        let mut constraints = Constraints::new(3);
        constraints.add(PointId(1), &plane);
        constraints.add(PointId(1), &plane);
        constraints.push(Some(&plane));
        let (mut one, mut none) = (PointQuadric::default(), PointQuadric::default());
        constraints.add_to(&mut one, PointId(1));
        constraints.add_to(&mut none, PointId(2));
        assert_eq!((one.a[0], constraints.get(PointId(3))), (4.0, Some(&plane)));
        assert_eq!(none, PointQuadric::default());
        constraints.clear();
        assert_eq!(constraints, Constraints::new(4));
    }
}
