//! Smoothing groups: normals of an OBJ that has none.
//!
//! Faces of one group that meet at a position share its normal: the mean of theirs, each by its angle
//! there (Thürmer & Wüthrich, "Computing vertex normals from polygonal facets", Journal of Graphics
//! Tools 1998). Faces of no group are flat, which is what glTF makes of none at all.

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::finite::{corner_normals, unit};
use super::text::lines;

/// The normals of all groups so far.
#[derive(Debug, Default)]
pub(super) struct Smoothing {
    /// The group that faces are in now.
    pub(super) group: Option<u32>,
    sums: Vec<DVec3>,
    /// By group and position.
    numbers: FxHashMap<(u32, u32), u32>,
}

impl Smoothing {
    /// None for a text that has normals, or no groups.
    pub(super) fn of(text: &str) -> Option<Self> {
        let mut has_groups = false;
        for line in lines(text) {
            match line.split() {
                ("vn", _) => return None,
                ("s", name) => has_groups |= group(name).is_some(),
                _ => {}
            }
        }
        has_groups.then(Self::default)
    }

    /// The number of the normal at a position in the group of now.
    pub(super) fn number(&mut self, position: u32) -> Option<u32> {
        let number = self.numbers.entry((self.group?, position)).or_insert_with(|| {
            self.sums.push(DVec3::ZERO);
            self.sums.len() as u32 - 1
        });
        Some(*number)
    }

    /// Adds a triangle to the normals of these numbers.
    pub(super) fn add(&mut self, numbers: [u32; 3], corners: [[f64; 3]; 3]) {
        let normals = corner_normals(corners.map(DVec3::from_array));
        for (number, normal) in numbers.into_iter().zip(normals) {
            self.sums[number as usize] += normal;
        }
    }

    /// All normals, by their numbers.
    pub(super) fn finish(&self) -> Vec<[f32; 3]> {
        self.sums.iter().map(|sum| unit(sum.to_array())).collect()
    }
}

/// The group of a name; none for `off` and `0`.
pub(super) fn group(name: &str) -> Option<u32> {
    let name = name.split_whitespace().next().unwrap_or("off");
    let is_off = name.eq_ignore_ascii_case("off") || name == "0";
    (!is_off).then(|| name.parse().unwrap_or(1))
}
