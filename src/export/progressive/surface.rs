//! A surface that is refined split by split.
//!
//! Points, wedges and triangles are numbered as they come. A split is told by symbols, which name what is
//! near the point that splits by its place there: see [`format`](super::format).

use glam::Vec3;
use seamwise_attr::Layout;

use super::blocks::{Damage, Result};
use super::script::{
    CENTER, CORNERS, GROUPS, MOVED, NEW_POINT, NEW_WEDGE, NUMBERED_POINT, NUMBERED_WEDGE, NUMBERS,
    POINTS, SPLIT_POINT, Symbols, TRIANGLES, WEDGES,
};
use super::told::{Known, Values, to_unit};

/// A surface as it is by now.
#[derive(Clone, Debug, Default)]
pub(super) struct Surface {
    pub(super) layout: Layout,
    pub(super) positions: Vec<Vec3>,
    pub(super) wedge_points: Vec<u32>,
    pub(super) wedge_groups: Vec<u32>,
    /// A row of the layout per wedge.
    pub(super) rows: Vec<f32>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Per group: what else its wedges carry; and per wedge, its place there.
    pub(super) carried: Vec<Vec<u8>>,
    pub(super) slots: Vec<u32>,
    /// Bytes of that per wedge of each group.
    pub(super) strides: Vec<usize>,
    /// Per point: its corners.
    corners: Vec<Vec<u32>>,
    known: Known,
    way: Way,
}

/// The way from a level to the one before it.
#[derive(Clone, Debug, Default)]
struct Way {
    /// What points and wedges moved by when the level was taken back.
    moves: Vec<Vec3>,
    row_moves: Vec<f32>,
    /// Per point and per wedge: the one of those that it came from.
    point_ends: Vec<Option<u32>>,
    wedge_ends: Vec<Option<u32>>,
    /// Splits until there, and how many are done.
    span: u32,
    done: u32,
}

/// What is near a point.
pub(super) struct Local {
    pub(super) center: Option<u32>,
    pub(super) corners: Vec<u32>,
    /// The wedges at the point, in the order of its corners.
    pub(super) moved: Vec<u32>,
    pub(super) ring_wedges: Vec<u32>,
    pub(super) ring_points: Vec<u32>,
    pub(super) first_point: u32,
    pub(super) first_wedge: u32,
}

/// What a split has changed.
#[derive(Debug)]
pub(super) struct Changes {
    pub(super) center: Option<u32>,
    pub(super) first_point: u32,
    pub(super) moved: Vec<u32>,
    pub(super) wedges: Vec<NewWedge>,
    /// Corners with their wedges after and before.
    pub(super) corners: Vec<[u32; 3]>,
    pub(super) first_triangle: usize,
}

/// A wedge that has come.
#[derive(Clone, Copy, Debug)]
pub(super) struct NewWedge {
    pub(super) wedge: u32,
    /// A wedge that it is like.
    pub(super) like: Option<u32>,
    /// Whether both were one before.
    pub(super) was_one: bool,
}

impl Surface {
    /// A surface without anything on it, of parts whose vertices carry so many bytes.
    pub(super) fn new(layout: Layout, strides: Vec<usize>) -> Self {
        Self { layout, carried: vec![Vec::new(); strides.len()], strides, ..Self::default() }
    }

    pub(super) fn row(&self, wedge: u32) -> &[f32] {
        let width = self.layout.len();
        &self.rows[wedge as usize * width..][..width]
    }

    /// What else a wedge carries.
    pub(super) fn carried(&self, wedge: u32) -> &[u8] {
        let group = self.wedge_groups[wedge as usize] as usize;
        let stride = self.strides[group];
        &self.carried[group][self.slots[wedge as usize] as usize * stride..][..stride]
    }

    fn corner(&self, corner: u32) -> u32 {
        self.triangles[corner as usize / 3][corner as usize % 3]
    }

    pub(super) fn local(&self, center: Option<u32>) -> Local {
        let corners = center.map_or(Vec::new(), |point| self.corners[point as usize].clone());
        let push = |list: &mut Vec<u32>, new: u32| {
            if !list.contains(&new) {
                list.push(new);
            }
        };
        let mut local = Local {
            center,
            moved: Vec::new(),
            ring_wedges: Vec::new(),
            ring_points: Vec::new(),
            first_point: self.positions.len() as u32,
            first_wedge: self.wedge_points.len() as u32,
            corners,
        };
        for &corner in &local.corners {
            push(&mut local.moved, self.corner(corner));
            let [triangle, slot] = [corner / 3 * 3, corner % 3];
            for other in [1, 2].map(|step| self.corner(triangle + (slot + step) % 3)) {
                push(&mut local.ring_wedges, other);
                push(&mut local.ring_points, self.wedge_points[other as usize]);
            }
        }
        local
    }

    /// Splits a point as symbols tell; values are as they were.
    pub(super) fn split(&mut self, from: &mut impl Symbols) -> Result<Changes> {
        let count = from.next(TRIANGLES)?;
        let center = from.next(CENTER)?.checked_sub(1);
        if center.is_some_and(|point| point as usize >= self.positions.len()) {
            return Err(Damage::Changed);
        }
        let local = self.local(center);
        for &wedge in &local.moved {
            self.wedge_points[wedge as usize] = self.point(from, MOVED, &local)?;
        }
        let (mut wedges, mut corners) = (Vec::new(), Vec::new());
        for &corner in &local.corners {
            let symbol = from.next(CORNERS)?;
            let own = self.corner(corner);
            let wedge = match symbol {
                0 => continue,
                1 => {
                    let group = self.wedge_groups[own as usize];
                    let point = self.point(from, POINTS, &local)?;
                    let wedge = self.add_wedge(point, group);
                    wedges.push(NewWedge { wedge, like: Some(own), was_one: true });
                    wedge
                }
                known => self.wedge(local.first_wedge.checked_add(known - 2))?,
            };
            if self.wedge_groups[wedge as usize] != self.wedge_groups[own as usize] {
                return Err(Damage::Changed);
            }
            self.triangles[corner as usize / 3][corner as usize % 3] = wedge;
            corners.push([corner, wedge, own]);
        }
        let first = self.triangles.len();
        for _ in 0..count {
            let triangle = self.triangle(from, &local, &mut wedges)?;
            self.triangles.push(triangle);
        }
        if let Some(center) = center {
            self.corners[center as usize].clear();
        }
        let new = (first * 3..self.triangles.len() * 3).map(|corner| corner as u32);
        for corner in local.corners.iter().copied().chain(new) {
            let point = self.wedge_points[self.corner(corner) as usize];
            self.corners[point as usize].push(corner);
        }
        let (moved, first_point) = (local.moved, local.first_point);
        Ok(Changes { center, first_point, moved, wedges, corners, first_triangle: first })
    }

    fn triangle(
        &mut self,
        from: &mut impl Symbols,
        local: &Local,
        wedges: &mut Vec<NewWedge>,
    ) -> Result<[u32; 3]> {
        let group = from.next(GROUPS)?;
        if group as usize >= self.strides.len() {
            return Err(Damage::Changed);
        }
        let mut like = local.moved.first().copied();
        let mut triangle = [0; 3];
        for corner in &mut triangle {
            let symbol = from.next(WEDGES)?;
            let wedge = match symbol {
                NEW_WEDGE => {
                    let point = self.point(from, POINTS, local)?;
                    let wedge = self.add_wedge(point, group);
                    let is_own = |like: &u32| self.wedge_groups[*like as usize] == group;
                    wedges.push(NewWedge { wedge, like: like.filter(is_own), was_one: false });
                    wedge
                }
                NUMBERED_WEDGE => self.wedge(Some(from.next(NUMBERS)?))?,
                _ => {
                    let (list, at) = ((symbol - 2) % 3, (symbol - 2) / 3);
                    match list {
                        0 => *local.moved.get(at as usize).ok_or(Damage::Changed)?,
                        1 => self.wedge(local.first_wedge.checked_add(at))?,
                        _ => *local.ring_wedges.get(at as usize).ok_or(Damage::Changed)?,
                    }
                }
            };
            if self.wedge_groups[wedge as usize] != group {
                return Err(Damage::Changed);
            }
            (*corner, like) = (wedge, Some(wedge));
        }
        Ok(triangle)
    }

    fn wedge(&self, wedge: Option<u32>) -> Result<u32> {
        wedge.filter(|&wedge| (wedge as usize) < self.wedge_points.len()).ok_or(Damage::Changed)
    }

    fn point(&mut self, from: &mut impl Symbols, column: usize, local: &Local) -> Result<u32> {
        let known = |point: Option<u32>, all: &[Vec3]| {
            point.filter(|&point| (point as usize) < all.len()).ok_or(Damage::Changed)
        };
        match from.next(column)? {
            SPLIT_POINT => local.center.ok_or(Damage::Changed),
            NEW_POINT => {
                self.positions.push(Vec3::ZERO);
                self.known.add_point();
                self.corners.push(Vec::new());
                self.way
                    .point_ends
                    .push(local.center.and_then(|point| self.way.point_ends[point as usize]));
                Ok(self.positions.len() as u32 - 1)
            }
            NUMBERED_POINT => known(Some(from.next(NUMBERS)?), &self.positions),
            symbol => match ((symbol - 3) % 2, (symbol - 3) / 2) {
                (0, at) => known(local.first_point.checked_add(at), &self.positions),
                (_, at) => local.ring_points.get(at as usize).copied().ok_or(Damage::Changed),
            },
        }
    }

    fn add_wedge(&mut self, point: u32, group: u32) -> u32 {
        let (slots, width) = (&self.carried[group as usize], self.layout.len());
        let slot = slots.len().checked_div(self.strides[group as usize]).unwrap_or(0);
        self.slots.push(slot as u32);
        self.carried[group as usize].extend(vec![0; self.strides[group as usize]]);
        self.wedge_points.push(point);
        self.wedge_groups.push(group);
        self.rows.resize(self.wedge_points.len() * width, 0.0);
        self.known.add_wedge();
        self.way.wedge_ends.push(None);
        self.wedge_points.len() as u32 - 1
    }

    /// Gives what a split has changed its values.
    pub(super) fn place(&mut self, changes: &Changes, from: &mut impl Values) -> Result<()> {
        let before = changes.center.map(|point| self.positions[point as usize]);
        let mut expected = before.unwrap_or_default();
        if let (Some(point), Some(before)) = (changes.center, before) {
            let position = self.place_point(point, before, from)?;
            expected = 2.0 * before - position;
        }
        for point in changes.first_point..self.positions.len() as u32 {
            let position = self.place_point(point, expected, from)?;
            expected = before.unwrap_or(position);
        }
        let width = self.layout.len();
        let mut was: Vec<(u32, Vec<f32>)> = Vec::new();
        for &wedge in &changes.moved {
            let mut row = self.row(wedge).to_vec();
            was.push((wedge, row.clone()));
            self.place_row(wedge, &mut row, from)?;
        }
        for new in &changes.wedges {
            let mut row = new.like.map_or(vec![0.0; width], |like| self.row(like).to_vec());
            let before = was.iter().find(|(wedge, _)| new.was_one && Some(*wedge) == new.like);
            if let Some((_, before)) = before {
                row.iter_mut().zip(before).for_each(|(x, before)| *x = 2.0 * before - *x);
            }
            self.place_row(new.wedge, &mut row, from)?;
            let group = self.wedge_groups[new.wedge as usize];
            let mut bytes = new.like.map_or_else(
                || vec![0; self.strides[group as usize]],
                |like| self.carried(like).to_vec(),
            );
            from.carried(new.wedge, group, &mut bytes)?;
            let at = self.slots[new.wedge as usize] as usize * bytes.len();
            self.carried[group as usize][at..at + bytes.len()].copy_from_slice(&bytes);
            if new.was_one {
                let end = new.like.and_then(|like| self.way.wedge_ends[like as usize]);
                self.way.wedge_ends[new.wedge as usize] = end;
            }
        }
        self.way.done += 1;
        Ok(())
    }

    /// Gives a point its position.
    fn place_point(&mut self, point: u32, expected: Vec3, from: &mut impl Values) -> Result<Vec3> {
        let position = self.known.position(point, expected, from)?;
        self.positions[point as usize] = position;
        Ok(position)
    }

    /// Gives a wedge its row, in the place of what is expected.
    fn place_row(&mut self, wedge: u32, row: &mut [f32], from: &mut impl Values) -> Result<()> {
        self.known.row(wedge, row, from)?;
        self.rows[wedge as usize * row.len()..][..row.len()].copy_from_slice(row);
        Ok(())
    }

    /// Takes the surface back from a level: all points and wedges get other values. So many splits lead on
    /// to the level before.
    pub(super) fn unsettle(&mut self, span: u32, from: &mut impl Values) -> Result<()> {
        let (points, wedges) = (self.positions.len() as u32, self.wedge_points.len() as u32);
        let mut way = Way { span, ..Way::default() };
        for point in 0..points {
            let settled = self.positions[point as usize];
            way.moves.push(settled - self.place_point(point, settled, from)?);
        }
        for wedge in 0..wedges {
            let settled = self.row(wedge).to_vec();
            let mut row = settled.clone();
            self.place_row(wedge, &mut row, from)?;
            way.row_moves.extend(settled.iter().zip(&row).map(|(settled, own)| settled - own));
        }
        way.point_ends = (0..points).map(Some).collect();
        way.wedge_ends = (0..wedges).map(Some).collect();
        self.way = way;
        Ok(())
    }

    /// The share of the way to the coarser of two levels by which the surface is moved as it is shown.
    pub(super) fn share(&self) -> f32 {
        let Way { span, done, .. } = self.way;
        if done == 0 || done >= span { 0.0 } else { (span - done) as f32 / span as f32 }
    }

    /// What a point moves by on the whole way, if it goes on there.
    fn point_move(&self, point: usize) -> Option<Vec3> {
        self.way.point_ends.get(point)?.map(|end| self.way.moves[end as usize])
    }

    /// What the row of a wedge changes by on the whole way, if it goes on there.
    fn row_move(&self, wedge: usize) -> Option<&[f32]> {
        let (end, width) = ((*self.way.wedge_ends.get(wedge)?)?, self.layout.len());
        Some(&self.way.row_moves[end as usize * width..][..width])
    }

    /// The position and the row of a wedge at the coarser end of the way.
    pub(super) fn end(&self, wedge: u32) -> (Vec3, Vec<f32>) {
        let point = self.wedge_points[wedge as usize] as usize;
        let position = self.positions[point] + self.point_move(point).unwrap_or_default();
        let mut row = self.row(wedge).to_vec();
        let moves = self.row_move(wedge as usize).unwrap_or_default();
        row.iter_mut().zip(moves).for_each(|(x, by)| *x += by);
        (position, row)
    }

    /// The surface as it is shown: between two levels it is moved towards the coarser one by the share of
    /// the way to there.
    pub(super) fn shown(&self) -> Self {
        let (mut shown, share) = (self.clone(), self.share());
        if share == 0.0 {
            return shown;
        }
        for (point, position) in shown.positions.iter_mut().enumerate() {
            *position += share * self.point_move(point).unwrap_or_default();
        }
        let layout = self.layout;
        for wedge in 0..self.wedge_points.len() {
            let Some(moves) = self.row_move(wedge) else { continue };
            let row = &mut shown.rows[wedge * layout.len()..][..layout.len()];
            row.iter_mut().zip(moves).for_each(|(x, by)| *x += share * by);
            to_unit(layout, row);
        }
        shown
    }

    /// A wedge of the same point and group that came before.
    pub(super) fn elder(&self, wedge: u32) -> Option<u32> {
        let [point, group] =
            [&self.wedge_points, &self.wedge_groups].map(|all| all[wedge as usize]);
        let at_point = self.corners[point as usize].iter().map(|&corner| self.corner(corner));
        let elders = at_point.filter(|&own| own < wedge);
        elders.filter(|&own| self.wedge_groups[own as usize] == group).min()
    }
}
