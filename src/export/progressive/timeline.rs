//! All that a progressive file's surfaces are from the coarsest level to the source, laid out so that each of
//! its levels can be looked up at once, without the splits before it.
//!
//! Time is the number of splits done. A triangle is there from a time on; its corners name one wedge after the
//! other, and a wedge has one value after the other. So a level is found by looking up each corner alone, in any
//! order; and a triangle of a finer level is followed to a coarser one by the wedges that its own came from.

use glam::Vec3;
use gltf::json::accessor::ComponentType;

use super::decode::{Fineness, read_observed};
use super::extract::{Container, told};
use super::format::EXTENSION;
use super::header::{AttributeHeader, Header, PartHeader, SurfaceHeader};
use super::observer::Observer;
use super::parts::{made, typed};
use super::surface::{Changes, Surface};
use crate::document::accessor::{Elements, Named};
use crate::error::{Error, Result};
use crate::import::options::ReadOptions;

/// No wedge.
const NONE: u32 = u32::MAX;

/// The levels of a progressive file over time.
#[derive(Clone, Debug)]
pub struct Timeline {
    /// Triangles at each time, in meshes each once; never fewer than before.
    pub triangles: Vec<u32>,
    /// Triangles of the source on its surfaces.
    pub source: u64,
    /// The primitives of the document that the surfaces are of.
    pub(crate) parts: Vec<PartTimeline>,
    /// The reason why it does not go up to the source, if it does not.
    pub missed: Option<&'static str>,
}

/// A primitive over time. Lists by corner and by wedge are one after the other; where each starts is told apart,
/// with one number more than there are. A wedge that is not there is `u32::MAX`.
#[derive(Clone, Debug)]
pub(crate) struct PartTimeline {
    pub(crate) mesh: usize,
    pub(crate) primitive: usize,
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
            let group = move |(group, part)| lines.part(group as u32, part, (header, surface));
            header.parts.iter().enumerate().map(group)
        });
        let (parts, missed) = (parts.collect(), read.damage.map(told));
        Ok(Self { triangles: history.triangles, source: header.triangles[1], parts, missed })
    }

    /// Triangles at the last time.
    pub fn finest(&self) -> u64 {
        self.triangles.last().map_or(0, |&last| last.into())
    }

    /// The part that a primitive is.
    pub(crate) fn part(&self, [mesh, primitive]: [usize; 2]) -> Option<&PartTimeline> {
        self.parts.iter().find(|own| [own.mesh, own.primitive] == [mesh, primitive])
    }
}

/// What has happened to all surfaces so far.
struct History {
    triangles: Vec<u32>,
    surfaces: Vec<Lines>,
}

/// What has happened to a surface.
#[derive(Clone, Default)]
struct Lines {
    /// Per triangle.
    births: Vec<u32>,
    /// Corners with the times from which on they have wedges.
    corners: Vec<[u32; 3]>,
    /// Wedges with the times of their values, and these: each is a wedge of a surface of its own, twice.
    wedges: Vec<[u32; 2]>,
    values: Surface,
    ends: Surface,
    carried: Vec<Vec<u8>>,
    /// Per wedge.
    parents: Vec<u32>,
    places: Vec<u32>,
    shares: Vec<(u32, f32)>,
}

impl History {
    fn new(header: &Header) -> Self {
        let surfaces = vec![Lines::default(); header.surfaces.len()];
        Self { triangles: vec![0], surfaces }
    }

    fn time(&self) -> u32 {
        self.triangles.len() as u32 - 1
    }
}

impl Observer for History {
    fn begun(&mut self, index: usize, surface: &Surface) {
        let lines = &mut self.surfaces[index];
        lines.values.layout = surface.layout;
        lines.ends.layout = surface.layout;
        lines.add_triangles(surface, 0);
        lines.add_all(surface, 0);
        lines.descend(surface, None);
        self.triangles[0] += surface.triangles.len() as u32;
    }

    fn placed(&mut self, index: usize, surface: &Surface, changes: &Changes, _: f32) {
        let time = self.time() + 1;
        let lines = &mut self.surfaces[index];
        let new = surface.triangles.len() - lines.births.len();
        lines
            .corners
            .extend(changes.corners.iter().map(|&[corner, wedge, _]| [corner, time, wedge]));
        lines.add_triangles(surface, time);
        let wedges = changes.wedges.iter().map(|new| new.wedge);
        for wedge in changes.moved.iter().copied().chain(wedges) {
            lines.add_value(surface, wedge, time);
        }
        lines.descend(surface, Some(changes));
        lines.shares.push((time, surface.share()));
        self.triangles.push(self.triangles[time as usize - 1] + new as u32);
    }

    fn unsettled(&mut self, index: usize, surface: &Surface) {
        // It is the level still until the next split.
        let time = self.time() + 1;
        self.surfaces[index].add_all(surface, time);
    }
}

impl Lines {
    fn add_triangles(&mut self, surface: &Surface, time: u32) {
        for triangle in self.births.len()..surface.triangles.len() {
            self.births.push(time);
            let corners = (0..).zip(surface.triangles[triangle]);
            self.corners.extend(corners.map(|(at, wedge)| [triangle as u32 * 3 + at, time, wedge]));
        }
    }

    fn add_all(&mut self, surface: &Surface, time: u32) {
        for wedge in 0..surface.wedge_points.len() as u32 {
            self.add_value(surface, wedge, time);
        }
    }

    fn add_value(&mut self, surface: &Surface, wedge: u32, time: u32) {
        self.wedges.push([wedge, time]);
        let position = surface.positions[surface.wedge_points[wedge as usize] as usize];
        self.values.add_alone(position, surface.row(wedge));
        let (position, row) = surface.end(wedge);
        self.ends.add_alone(position, &row);
        self.carried.push(surface.carried(wedge).to_vec());
    }

    /// Tells where wedges come from that have none yet.
    fn descend(&mut self, surface: &Surface, changes: Option<&Changes>) {
        self.parents.resize(surface.wedge_points.len(), NONE);
        self.places.resize(surface.wedge_points.len(), NONE);
        let Some(changes) = changes else { return };
        let group = |wedge: u32| surface.wedge_groups[wedge as usize];
        for new in &changes.wedges {
            let parent = new.like.filter(|_| new.was_one);
            let is_new_point = surface.wedge_points[new.wedge as usize] >= changes.first_point;
            let at_center = || {
                let mut own = changes.moved.iter().filter(|own| group(**own) == group(new.wedge));
                own.next().copied()
            };
            let place = parent.or_else(|| surface.elder(new.wedge).filter(|_| !is_new_point));
            self.parents[new.wedge as usize] = parent.unwrap_or(NONE);
            self.places[new.wedge as usize] = place.or_else(at_center).unwrap_or(NONE);
        }
    }

    /// The primitive of a group.
    fn part(
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
            mesh: part.mesh,
            primitive: part.primitive,
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
        let matrix = part.matrix.map(|columns| glam::DMat4::from_cols_array(&columns));
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

impl Surface {
    /// Adds a wedge at a point of its own.
    fn add_alone(&mut self, position: Vec3, row: &[f32]) {
        self.wedge_points.push(self.positions.len() as u32);
        self.positions.push(position);
        self.rows.extend(row);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::progressive::decode::read_splits;
    use crate::export::progressive::extract::tests::sample;
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
            let all = read.surfaces.iter().zip(&header.surfaces);
            let expected = all.flat_map(|(own, header)| parts(&own.shown(), header, &[]));
            for (part, expected) in timeline.parts.iter().zip(expected) {
                compare(part, &expected, time);
            }
        }
    }

    #[test]
    fn what_comes_later_comes_from_what_was_there() {
        let timeline = Timeline::read(&sample(), Fineness::Source, ReadOptions::default()).unwrap();
        let part = &timeline.parts[0];
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
