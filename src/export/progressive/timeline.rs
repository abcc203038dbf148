//! All that a progressive file's surfaces are from the coarsest level to the source, laid out so that each of
//! its levels can be looked up at once, without the splits before it.
//!
//! Time is the number of splits done. A triangle is there from a time on; its corners name one wedge after the
//! other, and a wedge has one value after the other. So a level is found by looking up each corner alone, in any
//! order; and a triangle of a finer level is followed to a coarser one by the wedges that its own came from.

use std::collections::BTreeMap;

use super::decode::{Fineness, read_observed};
use super::extract::{Container, told};
use super::format::EXTENSION;
use super::history::History;
use super::part_timeline::PartTimeline;
use crate::error::{Error, Result};
use crate::import::options::ReadOptions;

/// The levels of a progressive file over time.
#[derive(Clone, Debug)]
pub struct Timeline {
    /// Triangles at each time, in meshes each once; never fewer than before.
    pub triangles: Vec<u32>,
    /// Triangles of the source on its surfaces.
    pub source: u64,
    /// The primitives of the document that the surfaces are of, by their meshes and numbers.
    parts: BTreeMap<[usize; 2], PartTimeline>,
    /// The reason why it does not go up to the source, if it does not.
    pub missed: Option<&'static str>,
}

impl Timeline {
    /// Reads a progressive file up to a level.
    ///
    /// # Errors
    /// As [`extract`](super::extract::extract).
    pub fn read(bytes: &[u8], fineness: Fineness, options: ReadOptions) -> Result<Self> {
        let Container { header, blocks, .. } = Container::read(bytes)?;
        let most = usize::try_from(options.memory_limit.bytes()).unwrap_or(usize::MAX) / 8;
        let mut history = History::new(&header);
        let read = read_observed(&header, blocks, fineness, most, &mut history)
            .map_err(|damage| Error::invalid(format!("/extensions/{EXTENSION}"), told(damage)))?;
        let all = header.surfaces.iter().zip(&read.surfaces).zip(&history.surfaces);
        let parts = all.flat_map(|((header, surface), lines)| {
            (0..).zip(&header.parts).map(move |(group, part)| {
                ([part.mesh, part.primitive], lines.part(group, part, (header, surface)))
            })
        });
        let (parts, missed) = (parts.collect(), read.damage.map(told));
        Ok(Self { triangles: history.triangles, source: header.triangles[1], parts, missed })
    }

    /// Triangles at the last time.
    pub fn finest(&self) -> u64 {
        self.triangles.last().map_or(0, |&last| last.into())
    }

    /// The part that a primitive is.
    pub(crate) fn part(&self, primitive: [usize; 2]) -> Option<&PartTimeline> {
        self.parts.get(&primitive)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::accessor::{Elements, Named};
    use crate::export::progressive::decode::read_splits;
    use crate::export::progressive::extract::tests::sample;
    use crate::export::progressive::history::NONE;
    use crate::export::progressive::parts::parts;
    use crate::level::part::LevelPart;

    fn words(elements: &Elements) -> Vec<u32> {
        elements.bytes.as_chunks().0.iter().map(|own| u32::from_le_bytes(*own)).collect()
    }

    /// The place of the last of an owner's times that is not after a time.
    fn last([starts, times]: &[Vec<u32>; 2], owner: u32, time: u32) -> usize {
        let own = starts[owner as usize] as usize..starts[owner as usize + 1] as usize;
        own.rev().find(|&at| times[at] <= time).unwrap()
    }

    /// Looks up each corner of a part, and compares it with the level that splits lead to.
    fn compare(part: &PartTimeline, expected: &LevelPart, time: u32) {
        let births = words(&part.births).into_iter().filter(|birth| *birth <= time);
        assert_eq!(births.count() * 3, expected.indices.len());
        let [corners, values] = [&part.corners, &part.values];
        let [corners, values] = [corners, values].map(|own| [&own.starts, &own.times].map(words));
        let (wedges, shares) = (words(&part.wedges), part.shares.floats());
        let moved = words(&part.share_times).iter().filter(|own| **own <= time).count();
        let share = moved.checked_sub(1).map_or(0.0, |at| shares[at]);
        for (name, own) in &expected.attributes {
            let find = |all: &[Named]| all.iter().find(|other| other.0 == *name).unwrap().1.clone();
            let [from, to] = [find(&part.attributes), find(&part.ends)];
            for (corner, &index) in (0..).zip(&expected.indices) {
                let value = last(&values, wedges[last(&corners, corner, time)], time);
                let shown = from.row(value).into_iter().zip(to.row(value));
                for ((from, to), own) in shown.zip(own.row(index as usize)) {
                    // A normal is of unit length once it is moved.
                    let most = if name == "NORMAL" { 0.1 } else { 1e-5 };
                    let shown = from + share * (to - from);
                    assert!((shown - own).abs() < most, "{name} {shown} {own} at {time}");
                }
            }
        }
    }

    #[test]
    fn each_level_that_is_looked_up_is_the_one_that_splits_lead_to() {
        let file = sample();
        let timeline = Timeline::read(&file, Fineness::Source, ReadOptions::default()).unwrap();
        assert_eq!(timeline.finest(), timeline.source);
        let Container { header, blocks, .. } = Container::read(&file).unwrap();
        let last = timeline.triangles.len() - 1;
        for time in [0, 1, 2, last / 7, last / 3, last / 2, last - 1, last] {
            let wanted = Fineness::Triangles(timeline.triangles[time].into());
            let read = read_splits(&header, blocks, wanted, 1 << 28).unwrap();
            // Of splits that bring no triangle all are done.
            let time = read.splits as u32;
            for (own, header) in read.surfaces.iter().zip(&header.surfaces) {
                for (part, expected) in header.parts.iter().zip(parts(&own.shown(), header, &[])) {
                    let part = timeline.part([part.mesh, part.primitive]).unwrap();
                    compare(part, &expected, time);
                }
            }
        }
    }

    #[test]
    fn what_comes_later_comes_from_what_was_there() {
        let timeline = Timeline::read(&sample(), Fineness::Source, ReadOptions::default()).unwrap();
        let part = timeline.parts.values().next().unwrap();
        let [parents, places] = [&part.parents, &part.places].map(words);
        let (starts, times) = (words(&part.values.starts), words(&part.values.times));
        let birth = |wedge: usize| times[starts[wedge] as usize];
        let mut from_nowhere = 0;
        for wedge in (0..parents.len()).filter(|&wedge| birth(wedge) > 0) {
            for before in [parents[wedge], places[wedge]].into_iter().filter(|own| *own != NONE) {
                assert!((before as usize) < wedge && birth(before as usize) <= birth(wedge));
            }
            from_nowhere += usize::from(places[wedge] == NONE);
        }
        assert!(from_nowhere * 20 < parents.len(), "{from_nowhere} of {}", parents.len());
    }
}
