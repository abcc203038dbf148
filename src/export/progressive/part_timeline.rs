//! A primitive over time, in tables.

use glam::DMat4;
use gltf::json::accessor::ComponentType;

use super::header::{AttributeHeader, PartHeader, SurfaceHeader};
use super::history::{Lines, NONE};
use super::parts::{made, typed};
use super::surface::Surface;
use crate::document::accessor::{Elements, Named};

/// A primitive over time. Lists by corner and by wedge are one after the other; where each starts is told apart,
/// with one number more than there are. A wedge that is not there is `u32::MAX`.
#[derive(Clone, Debug)]
pub(crate) struct PartTimeline {
    /// Per triangle, in their order: the time it comes.
    pub(crate) births: Elements,
    /// The wedges of corners, with the times from which on they are theirs.
    pub(crate) corners: Keys,
    pub(crate) wedges: Elements,
    /// The times of the values of wedges.
    pub(crate) values: Keys,
    /// Each attribute at these times, and moved to the coarser of the two levels around.
    pub(crate) attributes: Vec<Named>,
    pub(crate) ends: Vec<Named>,
    /// Per wedge: the one that was one with it before it came, and one that was where it came from.
    pub(crate) parents: Elements,
    pub(crate) places: Elements,
    /// The share of the way to the coarser level by which all is moved, from times on.
    pub(crate) share_times: Elements,
    pub(crate) shares: Elements,
}

/// Times in lists.
#[derive(Clone, Debug)]
pub(crate) struct Keys {
    pub(crate) starts: Elements,
    pub(crate) times: Elements,
}

impl Lines {
    /// The primitive of a group.
    pub(super) fn part(
        &self,
        group: u32,
        part: &PartHeader,
        (header, surface): (&SurfaceHeader, &Surface),
    ) -> PartTimeline {
        let is_own = |wedge: u32| surface.wedge_groups[wedge as usize] == group;
        let wedges = Numbers::of(surface.wedge_points.len(), is_own);
        let triangles =
            Numbers::of(surface.triangles.len(), |own| is_own(surface.triangles[own as usize][0]));
        let number = |wedge: &u32| wedges.new.get(*wedge as usize).copied().unwrap_or(NONE);
        let own =
            |all: &[u32]| -> Vec<u32> { wedges.old.iter().map(|&at| all[at as usize]).collect() };
        let births = triangles.old.iter().map(|&own| self.births[own as usize]);
        // Of the values of one time the last counts; the sorting keeps the order that they came in.
        let corners = self.corners.iter().enumerate().filter_map(|(at, &[corner, time, _])| {
            let triangle = triangles.new[corner as usize / 3];
            (triangle != NONE).then(|| ([triangle * 3 + corner % 3, time], at as u32))
        });
        let (corners, chosen) = keys(corners.collect(), 3 * triangles.old.len());
        let corner_wedges = chosen.iter().map(|&at| number(&self.corners[at as usize][2]));
        let values = self.wedges.iter().enumerate().filter_map(|(at, &[wedge, time])| {
            let wedge = number(&wedge);
            (wedge != NONE).then_some(([wedge, time], at as u32))
        });
        let (values, chosen) = keys(values.collect(), wedges.old.len());
        let [attributes, ends] =
            [&self.values, &self.ends].map(|from| self.attributes(&chosen, from, part, header));
        PartTimeline {
            births: numbers(births),
            wedges: numbers(corner_wedges),
            corners,
            values,
            ends: if attributes == ends { Vec::new() } else { ends },
            attributes,
            parents: numbers(own(&self.parents).iter().map(number)),
            places: numbers(own(&self.places).iter().map(number)),
            share_times: numbers(self.shares.iter().map(|own| own.0)),
            shares: floats(self.shares.iter().map(|own| own.1)),
        }
    }

    /// The attributes of values.
    fn attributes(
        &self,
        chosen: &[u32],
        from: &Surface,
        part: &PartHeader,
        header: &SurfaceHeader,
    ) -> Vec<Named> {
        let matrix = part.matrix.map(|columns| DMat4::from_cols_array(&columns));
        let mut at = 0;
        let elements = |own: &AttributeHeader| {
            let elements = if header.is_made(&own.name) {
                made(from, chosen, own, matrix.as_ref())
            } else {
                at += own.size();
                let place = at - own.size()..at;
                let bytes =
                    chosen.iter().flat_map(|&row| &self.carried[row as usize][place.clone()]);
                typed(own, bytes.copied().collect())
            };
            (own.name.clone(), elements)
        };
        part.attributes.iter().map(elements).collect()
    }
}

/// Some of many things, numbered anew.
struct Numbers {
    old: Vec<u32>,
    /// Per thing: its new number.
    new: Vec<u32>,
}

impl Numbers {
    fn of(count: usize, is_own: impl Fn(u32) -> bool) -> Self {
        let old: Vec<u32> = (0..count as u32).filter(|&own| is_own(own)).collect();
        let mut new = vec![NONE; count];
        for (number, &own) in (0..).zip(&old) {
            new[own as usize] = number;
        }
        Self { old, new }
    }
}

/// Lists by owner from owners with times and what is there then; and that, in the order of the lists.
fn keys(mut all: Vec<([u32; 2], u32)>, owners: usize) -> (Keys, Vec<u32>) {
    all.sort_by_key(|own| own.0);
    // From the end, since of one time the last is kept.
    all.reverse();
    all.dedup_by_key(|own| own.0);
    all.reverse();
    let mut starts = vec![0; owners + 1];
    all.iter().for_each(|([owner, _], _)| starts[*owner as usize + 1] += 1);
    for owner in 0..owners {
        starts[owner + 1] += starts[owner];
    }
    let times = numbers(all.iter().map(|own| own.0[1]));
    (Keys { starts: numbers(starts), times }, all.into_iter().map(|own| own.1).collect())
}

fn numbers(values: impl IntoIterator<Item = u32>) -> Elements {
    scalars(ComponentType::U32, values.into_iter().flat_map(u32::to_le_bytes).collect())
}

fn floats(values: impl Iterator<Item = f32>) -> Elements {
    scalars(ComponentType::F32, values.flat_map(f32::to_le_bytes).collect())
}

fn scalars(component: ComponentType, bytes: Vec<u8>) -> Elements {
    Elements { bytes, component, components: 1, normalized: false }
}
