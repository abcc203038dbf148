//! The frame that a mesh is shown in, up to a turn, a move and a scale.
//!
//! A node that is scaled along some axes more than along others shows an error along these at more than one
//! along those. So costs are measured in the space in which lengths are what they are in the scene: with L the
//! linear part of a world transform, that of M = LᵀL, whose root brings the mesh there. Of several instances
//! the largest scale counts along each axis: the least M that none of theirs is above, two at a time by the
//! axes that make both diagonal, as metrics are intersected for anisotropic meshes (Alauzet & Frey, INRIA
//! report 4759, 2003).

use glam::{DMat3, DMat4, DVec3, Vec3};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use seamwise_attr::{Level, Mesh, PointId, ProgressiveMesh};

/// Scales that differ by less than this share are one: then costs are measured in the mesh's own space.
const SAME_SCALE: f64 = 1e-3;

/// Along an axis that nodes flatten a mesh is as large as this share of the longest.
const LEAST_SCALE: f64 = 1e-6;

/// The scales of a mesh along three axes at right angles, the largest of which is 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ShownFrame {
    scale: DMat3,
    back: DMat3,
}

impl ShownFrame {
    /// The frame of a mesh that is shown by `worlds`; none if that is its own.
    pub(super) fn of(worlds: &[DMat4]) -> Option<Self> {
        let metrics = worlds.iter().map(metric).filter(|own| own.norm() > 0.0);
        let mut metrics: Vec<Matrix3<f64>> =
            metrics.filter(|own| own.iter().all(|x| x.is_finite())).collect();
        metrics.sort_by(|a, b| b.trace().total_cmp(&a.trace()));
        // Of any size: squares of large scales may be beyond all numbers.
        let size = metrics.first().map(Matrix3::trace).filter(|size| size.is_finite())?;
        metrics.iter_mut().for_each(|metric| *metric /= size);
        let (first, others) = metrics.split_first()?;
        let metric = others.iter().fold(above_least(first), join);
        let eigen = SymmetricEigen::new(metric);
        let longest = eigen.eigenvalues.max();
        let scales = eigen.eigenvalues.map(|x| (x / longest).sqrt());
        if scales.min() > 1.0 - SAME_SCALE {
            return None;
        }
        let axes = eigen.eigenvectors;
        let along =
            |scales: Vector3<f64>| axes * Matrix3::from_diagonal(&scales) * axes.transpose();
        let [scale, back] = [scales, scales.map(f64::recip)].map(|s| to_glam(&along(s)));
        Some(Self { scale, back })
    }

    /// World transforms of the mesh as those of what it is in this frame.
    pub(super) fn worlds(&self, worlds: &[DMat4]) -> Vec<DMat4> {
        worlds.iter().map(|world| *world * DMat4::from_mat3(self.back)).collect()
    }

    /// A difference of places as it is in this frame.
    pub(super) fn shift(&self, by: Vec3) -> Vec3 {
        (self.scale * by.as_dvec3()).as_vec3()
    }

    /// A mesh as it is in this frame.
    pub(crate) fn show(&self, mesh: &Mesh) -> Mesh {
        let mut shown = mesh.clone();
        shown.positions.iter_mut().for_each(|p| *p = (self.scale * p.as_dvec3()).as_vec3());
        for normal in normals(&mut shown) {
            turn(normal, self.back);
        }
        shown
    }

    /// Brings a level of `shown` back to the space of `source`: what has not moved stands where it stood, to
    /// the bit.
    pub(crate) fn bring_back(&self, level: &mut Level, source: &Mesh, shown: &Mesh) {
        let place = |(position, &stood): (&mut Vec3, &PointId)| {
            let stays = *position == shown.positions[stood];
            let moved = || (self.back * position.as_dvec3()).as_vec3();
            *position = if stays { source.positions[stood] } else { moved() };
        };
        level.mesh.positions.iter_mut().zip(&level.point_sources).for_each(place);
        let at = source.layout.normal();
        for (normal, &wedge) in normals(&mut level.mesh).zip(&level.wedge_sources) {
            if *normal == shown.row(wedge)[at..at + 3] {
                normal.copy_from_slice(&source.row(wedge)[at..at + 3]);
            } else {
                turn(normal, self.scale);
            }
        }
    }

    /// Brings a record of `shown` back to the space of `source`.
    ///
    /// # Errors
    /// As [`ProgressiveMesh::remap`].
    pub(crate) fn bring_record_back(
        &self,
        record: &mut ProgressiveMesh,
        source: &Mesh,
        shown: &Mesh,
    ) -> seamwise_attr::Result<()> {
        let layout = source.layout;
        let position = |stood: PointId, position: Vec3| match position == shown.positions[stood] {
            true => source.positions[stood],
            false => (self.back * position.as_dvec3()).as_vec3(),
        };
        record.remap(source, position, |wedge, row| {
            if layout.normal {
                let at = layout.normal();
                let normal = &mut row[at..at + 3];
                if *normal == shown.row(wedge)[at..at + 3] {
                    normal.copy_from_slice(&source.row(wedge)[at..at + 3]);
                } else {
                    turn(normal, self.scale);
                }
            }
        })
    }
}

/// The normals of a mesh, wedge by wedge; none at all if it has none.
fn normals(mesh: &mut Mesh) -> impl Iterator<Item = &mut [f32]> {
    let (len, at) = (mesh.layout.len().max(1), mesh.layout.normal());
    let has = mesh.layout.normal;
    mesh.attributes.chunks_exact_mut(len).filter(move |_| has).map(move |row| &mut row[at..at + 3])
}

/// Multiplies a normal with the inverse of what positions are multiplied with, which is symmetric.
fn turn(normal: &mut [f32], by: DMat3) {
    let own = Vec3::from_slice(normal);
    let turned = (by * own.as_dvec3()).normalize_or(DVec3::ZERO) * f64::from(own.length());
    normal.copy_from_slice(&turned.as_vec3().to_array());
}

/// The squares of lengths in the world by vectors of the mesh.
fn metric(world: &DMat4) -> Matrix3<f64> {
    let columns = [world.x_axis, world.y_axis, world.z_axis];
    let linear = Matrix3::from_columns(&columns.map(|c| Vector3::new(c.x, c.y, c.z)));
    linear.transpose() * linear
}

/// The least metric that neither of two is above.
fn join(own: Matrix3<f64>, other: &Matrix3<f64>) -> Matrix3<f64> {
    let eigen = SymmetricEigen::new(own);
    let axes = eigen.eigenvectors;
    let power = |by: f64| {
        let scales = eigen.eigenvalues.map(|x| x.powf(by));
        axes * Matrix3::from_diagonal(&scales) * axes.transpose()
    };
    let (root, inverse) = (power(0.5), power(-0.5));
    let relative = SymmetricEigen::new(inverse * other * inverse);
    if relative.eigenvalues.max() <= 1.0 + SAME_SCALE {
        return own;
    }
    let scales = relative.eigenvalues.map(|x| x.max(1.0));
    let axes = root * relative.eigenvectors;
    axes * Matrix3::from_diagonal(&scales) * axes.transpose()
}

/// A metric that can be inverted.
fn above_least(metric: &Matrix3<f64>) -> Matrix3<f64> {
    let eigen = SymmetricEigen::new(*metric);
    let least = eigen.eigenvalues.max() * LEAST_SCALE * LEAST_SCALE;
    let scales = eigen.eigenvalues.map(|x| x.max(least));
    eigen.eigenvectors * Matrix3::from_diagonal(&scales) * eigen.eigenvectors.transpose()
}

fn to_glam(matrix: &Matrix3<f64>) -> DMat3 {
    DMat3::from_cols_slice(matrix.as_slice())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;
    use seamwise_attr::{Layout, Vertices, WedgeId, weld};

    fn scaled(scale: [f64; 3], turn: f64) -> DMat4 {
        let axis = DVec3::new(1.0, -2.0, 0.5).normalize();
        DMat4::from_quat(DQuat::from_axis_angle(axis, turn)) * DMat4::from_scale(scale.into())
    }

    fn along_axes(worlds: &[DMat4]) -> DVec3 {
        let frame = ShownFrame::of(worlds).expect("a frame");
        DVec3::new(frame.scale.x_axis.x, frame.scale.y_axis.y, frame.scale.z_axis.z)
    }

    #[test]
    fn the_frame_has_the_scales_of_a_node_without_its_turn_and_the_largest_of_several() {
        let near = |a: DVec3, b: [f64; 3]| assert!(a.distance(b.into()) < 1e-9, "{a} {b:?}");
        near(along_axes(&[scaled([1.0, 1.0, 0.01], 0.7)]), [1.0, 1.0, 0.01]);
        near(along_axes(&[scaled([3.0, -6.0, 1.5], 2.0)]), [0.5, 1.0, 0.25]);
        let several = [scaled([1.0, 0.2, 0.1], 0.3), scaled([0.1, 0.5, 0.1], 1.0)];
        near(along_axes(&several), [1.0, 0.5, 0.1]);
        assert_eq!(ShownFrame::of(&[scaled([2.0; 3], 0.4), scaled([0.1, 1.0, 0.5], 0.2)]), None);
        assert_eq!(ShownFrame::of(&[]), None);
        near(along_axes(&[scaled([1.0, 1.0, 0.0], 0.0)]), [1.0, 1.0, LEAST_SCALE]);
    }

    #[test]
    fn what_has_not_moved_comes_back_to_the_bit_and_the_rest_nearly() {
        let layout = Layout { uv_sets: 0, normal: true, color: 0 };
        let positions = [[0.1, 0.2, 30.3], [1.7, -0.3, 12.9], [0.4, 1.9, -7.1]].map(Vec3::from);
        let normal = (positions[1] - positions[0]).cross(positions[2] - positions[0]).normalize();
        let vertices = Vertices {
            positions: positions.to_vec(),
            layout,
            attributes: [normal.to_array(); 3].concat(),
            triangles: vec![[0, 1, 2]],
            groups: vec![0],
            ..Vertices::default()
        };
        let source = weld(&vertices).unwrap().mesh;
        let frame = ShownFrame::of(&[scaled([1.0, 1.0, 0.01], 0.7)]).unwrap();
        let shown = frame.show(&source);
        let normal_there = Vec3::from_slice(shown.row(WedgeId::new(0)));
        let [a, b, c] = [0, 1, 2].map(|at| shown.positions[at]);
        assert!((b - a).cross(c - a).normalize().distance(normal_there) < 1e-5);
        let mut level = Level {
            mesh: shown.clone(),
            point_sources: (0..3).map(PointId::new).collect(),
            wedge_sources: (0..3).map(WedgeId::new).collect(),
            target: 1,
            error: 0.0,
            stopped: None,
        };
        let by = Vec3::new(0.0, 0.0, 0.01);
        level.mesh.positions[2] += by;
        frame.bring_back(&mut level, &source, &shown);
        assert_eq!(level.mesh.positions[..2], source.positions[..2]);
        assert_eq!(level.mesh.attributes, source.attributes);
        let moved = level.mesh.positions[2] - source.positions[2];
        assert!(moved.distance(by * 100.0) < 1e-4, "{moved}");
    }
}
