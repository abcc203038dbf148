//! Which points of two surfaces belong together.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::id::TriangleId;
use crate::mesh::Mesh;
use crate::sample::{Sample, sample_surface};
use crate::surface::Surface;
use crate::triangle::area_vector;

/// Points whose normals differ by more than this cosine lie on two sheets.
const SAME_SIDE: f64 = 0.2;
/// Seed of the samples; any would do, but it must stay.
const SEED: u64 = 2;

/// A surface that is sampled and searched.
pub(crate) struct Sampled<'a> {
    pub(super) mesh: &'a Mesh,
    surface: Surface,
    /// One per triangle: its unit normal, zero if it has no area.
    pub(super) normals: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

/// A point of one surface and its counterpart on the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) sample: Sample,
    pub(super) foot: Sample,
    /// From the sample to the foot.
    pub(super) offset: DVec3,
}

impl<'a> Sampled<'a> {
    pub(crate) fn new(mesh: &'a Mesh) -> Self {
        let triangles: Vec<[u32; 3]> =
            (0..mesh.triangles.len()).map(|t| mesh.triangle_points(t).map(|p| p.0)).collect();
        Self {
            surface: Surface::new(&mesh.positions, triangles.iter().copied()),
            normals: (0..triangles.len())
                .map(|t| area_vector(mesh.triangle_positions(t)).normalize_or_zero())
                .collect(),
            triangles,
            mesh,
        }
    }

    /// `count` points spread over this surface.
    pub(super) fn sample(&self, count: usize) -> Vec<Sample> {
        sample_surface(&self.mesh.positions, &self.triangles, count, SEED)
    }

    fn point(&self, sample: &Sample) -> DVec3 {
        let corners = self.mesh.triangle_positions(sample.triangle.index()).map(Vec3::as_dvec3);
        let b = sample.barycentrics;
        corners[0] * b.x + corners[1] * b.y + corners[2] * b.z
    }

    /// For each sample the nearest point of `other` on the same side, if there is one.
    pub(super) fn pair(
        &self,
        samples: &[Sample],
        other: &Self,
        also: impl Fn(TriangleId, TriangleId) -> bool + Sync,
    ) -> Vec<Pair> {
        let pairs: Vec<Option<Pair>> = samples
            .par_iter()
            .with_min_len(256)
            .map(|sample| {
                let (point, normal) = (self.point(sample), self.normals[sample.triangle]);
                let same = |t: TriangleId| {
                    other.normals[t].dot(normal) > SAME_SIDE && also(sample.triangle, t)
                };
                let foot = other.surface.closest_foot(point, f64::INFINITY, same)?;
                Some(Pair {
                    sample: *sample,
                    foot: Sample { triangle: foot.triangle, barycentrics: foot.barycentrics },
                    offset: foot.point - point,
                })
            })
            .collect();
        pairs.into_iter().flatten().collect()
    }
}
