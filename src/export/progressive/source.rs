//! A surface of the source as the writer of splits knows it, step by step.

use seamwise_attr::{Collapse, Mesh, PointId, ProgressiveMesh, TriangleId, WedgeId};

use super::blocks::{Columns, Damage, Result};
use super::header::Form;
use super::script::{
    CENTER, CORNERS, GROUPS, MOVED, NEW_POINT, NEW_WEDGE, NUMBERED_POINT, NUMBERED_WEDGE, NUMBERS,
    POINTS, SPAN, SPLIT_POINT, Script, TRIANGLES, WEDGES,
};
use super::splits::WriteValues;
use super::surface::{Local, Surface};

/// A surface on its way from the coarsest level to the source.
pub(super) struct Refined<'a> {
    pub(super) mesh: ProgressiveMesh,
    source: &'a Mesh,
    form: &'a Form,
    /// What else a wedge carries.
    carried: Box<dyn Fn(WedgeId) -> Vec<u8> + 'a>,
    /// What a reader has by now.
    pub(super) surface: Surface,
    /// Names in the source by numbers in the file, and the other way.
    points: Vec<PointId>,
    wedges: Vec<WedgeId>,
    pub(super) triangles: Vec<TriangleId>,
    point_numbers: Vec<Option<u32>>,
    wedge_numbers: Vec<Option<u32>>,
}

impl<'a> Refined<'a> {
    /// A surface at its coarsest, nothing of which is told yet.
    pub(super) fn new(
        mut mesh: ProgressiveMesh,
        source: &'a Mesh,
        form: &'a Form,
        carried: Box<dyn Fn(WedgeId) -> Vec<u8> + 'a>,
    ) -> Self {
        mesh.seek(mesh.collapses());
        Self {
            mesh,
            form,
            carried,
            surface: Surface::new(form.layout, form.strides.clone()),
            points: Vec::new(),
            wedges: Vec::new(),
            triangles: Vec::new(),
            point_numbers: vec![None; source.positions.len()],
            wedge_numbers: vec![None; source.wedge_points.len()],
            source,
        }
    }

    /// Tells the coarsest level.
    pub(super) fn write_coarsest(&mut self, out: &mut Columns) -> Result<()> {
        let all = (0..self.source.triangles.len()).map(TriangleId::new);
        let live: Vec<TriangleId> = all.filter(|&own| self.mesh.is_live(own)).collect();
        self.write(None, &live, out)
    }

    /// Tells that the surface is taken back from a level, if it is at one.
    pub(super) fn write_unsettled(&mut self, out: &mut Columns) -> Result<bool> {
        let Some(own) = self.mesh.unsettled() else { return Ok(false) };
        out.number(SPAN, own.collapses as u32);
        let mut mesh = self.mesh.state().clone();
        for (&point, &position) in own.points.iter().zip(own.positions) {
            mesh.positions[point] = position;
        }
        let width = mesh.layout.len();
        for (wedge, row) in own.wedges.iter().zip(own.rows.chunks_exact(width.max(1))) {
            mesh.attributes[wedge.index() * width..][..width].copy_from_slice(row);
        }
        let mut values = WriteValues {
            out,
            form: self.form,
            mesh: &mesh,
            source: self.source,
            points: &self.points,
            wedges: &self.wedges,
            carried: &*self.carried,
        };
        self.surface.unsettle(own.collapses as u32, &mut values)?;
        Ok(true)
    }

    /// Undoes the last collapse, and tells it.
    pub(super) fn write_split(&mut self, out: &mut Columns) -> Result<()> {
        self.mesh.refine(1);
        let Collapse { points, triangles, .. } = self.mesh.collapse(self.mesh.applied());
        let center = points.first().and_then(|&point| self.point_numbers[point]);
        let triangles = triangles.to_vec();
        self.write(center, &triangles, out)
    }

    fn write(&mut self, center: Option<u32>, new: &[TriangleId], out: &mut Columns) -> Result<()> {
        let local = self.surface.local(center);
        let mut script = self.script(&local, new)?;
        script.write(out);
        let changes = self.surface.split(&mut script)?;
        let mut values = WriteValues {
            out,
            form: self.form,
            mesh: self.mesh.state(),
            source: self.source,
            points: &self.points,
            wedges: &self.wedges,
            carried: &*self.carried,
        };
        self.surface.place(&changes, &mut values)
    }

    /// The symbols of a split to the mesh as it is now.
    fn script(&mut self, local: &Local, new: &[TriangleId]) -> Result<Script> {
        let mut script = Script::default();
        script.put(TRIANGLES, new.len() as u32);
        script.put(CENTER, local.center.map_or(0, |center| center + 1));
        for &wedge in &local.moved {
            let point = self.mesh.state().wedge_points[self.wedges[wedge as usize]];
            self.put_point(&mut script, MOVED, local, point);
        }
        for &corner in &local.corners {
            let (triangle, slot) = (corner as usize / 3, corner as usize % 3);
            let wedge = self.mesh.state().triangles[self.triangles[triangle]][slot];
            let known = self.wedge_numbers[wedge];
            if known == Some(self.surface.triangles[triangle][slot]) {
                script.put(CORNERS, 0);
                continue;
            }
            match known {
                None => {
                    script.put(CORNERS, 1);
                    self.put_new_wedge(&mut script, local, wedge);
                }
                Some(known) => {
                    let at = known.checked_sub(local.first_wedge).ok_or(Damage::Changed)?;
                    script.put(CORNERS, 2 + at);
                }
            }
        }
        for &triangle in new {
            script.put(GROUPS, self.source.groups[triangle]);
            let wedges = self.mesh.state().triangles[triangle];
            wedges.into_iter().for_each(|wedge| self.put_wedge(&mut script, local, wedge));
            self.triangles.push(triangle);
        }
        Ok(script)
    }

    fn put_wedge(&mut self, script: &mut Script, local: &Local, wedge: WedgeId) {
        let Some(number) = self.wedge_numbers[wedge] else {
            script.put(WEDGES, NEW_WEDGE);
            return self.put_new_wedge(script, local, wedge);
        };
        let place = |list: &[u32]| list.iter().position(|&own| own == number);
        if let Some(at) = number.checked_sub(local.first_wedge) {
            script.put(WEDGES, 3 + 3 * at);
        } else if let Some(at) = place(&local.moved) {
            script.put(WEDGES, 2 + 3 * at as u32);
        } else if let Some(at) = place(&local.ring_wedges) {
            script.put(WEDGES, 4 + 3 * at as u32);
        } else {
            script.put(WEDGES, NUMBERED_WEDGE);
            script.put(NUMBERS, number);
        }
    }

    fn put_new_wedge(&mut self, script: &mut Script, local: &Local, wedge: WedgeId) {
        self.wedge_numbers[wedge] = Some(self.wedges.len() as u32);
        self.wedges.push(wedge);
        let point = self.mesh.state().wedge_points[wedge];
        self.put_point(script, POINTS, local, point);
    }

    fn put_point(&mut self, script: &mut Script, column: usize, local: &Local, point: PointId) {
        let Some(number) = self.point_numbers[point] else {
            script.put(column, NEW_POINT);
            self.point_numbers[point] = Some(self.points.len() as u32);
            self.points.push(point);
            return;
        };
        if Some(number) == local.center {
            script.put(column, SPLIT_POINT);
        } else if let Some(at) = number.checked_sub(local.first_point) {
            script.put(column, 3 + 2 * at);
        } else if let Some(at) = local.ring_points.iter().position(|&own| own == number) {
            script.put(column, 4 + 2 * at as u32);
        } else {
            script.put(column, NUMBERED_POINT);
            script.put(NUMBERS, number);
        }
    }
}
