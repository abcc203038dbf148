//! The rival: meshoptimizer's attribute-aware simplifier with vertex update, as its users call it.
//!
//! Each group (primitive) is simplified alone, as gltfpack does, and each level starts from the one
//! before. Weights: normals 0.5, UVs 1/√(mean UV area of a triangle), colors 1; no error limit.

use meshopt::{SimplifyOptions, simplify_with_update};
use seamwise_attr::Mesh;

/// The rival's calls: the groups as they are after each.
pub(crate) fn simplify(mut groups: Vec<Group>, shares: &[f64]) -> Vec<Vec<Group>> {
    let step = |share: &f64| {
        groups.iter_mut().for_each(|group| group.simplify(*share));
        groups.clone()
    };
    shares.iter().map(step).collect()
}

/// One primitive, its vertices being the wedges of the source.
#[derive(Clone)]
pub(crate) struct Group {
    pub(crate) id: u32,
    pub(crate) indices: Vec<u32>,
    triangles: usize,
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) attributes: Vec<f32>,
    weights: Vec<f32>,
    /// One per vertex: the wedge of the source it was.
    pub(crate) wedges: Vec<u32>,
}

impl Group {
    /// The primitives of a mesh, each with vertices of its own.
    pub(crate) fn split(mesh: &Mesh) -> Vec<Self> {
        let mut ids: Vec<u32> = mesh.groups.clone();
        ids.sort_unstable();
        ids.dedup();
        ids.into_iter().map(|id| Self::new(mesh, id)).collect()
    }

    fn new(mesh: &Mesh, id: u32) -> Self {
        let layout = mesh.layout;
        let mut own = vec![u32::MAX; mesh.wedge_points.len()];
        let mut group = Self {
            id,
            indices: Vec::new(),
            triangles: 0,
            positions: Vec::new(),
            attributes: Vec::new(),
            weights: vec![0.0; layout.len()],
            wedges: Vec::new(),
        };
        let mut uv_areas = vec![0.0f64; layout.uv_sets];
        for (wedges, _) in mesh.triangles.iter().zip(&mesh.groups).filter(|&(_, &g)| g == id) {
            for (set, area) in uv_areas.iter_mut().enumerate() {
                let [a, b, c] = wedges.map(|wedge| mesh.uv(wedge, set).as_dvec2());
                *area += (b - a).perp_dot(c - a).abs() / 2.0;
            }
            for &wedge in wedges {
                if own[wedge] == u32::MAX {
                    own[wedge] = group.wedges.len() as u32;
                    group.wedges.push(wedge.0);
                    group.positions.push(mesh.positions[mesh.wedge_points[wedge]].to_array());
                    group.attributes.extend_from_slice(mesh.row(wedge));
                }
                group.indices.push(own[wedge]);
            }
        }
        group.triangles = group.indices.len() / 3;
        for (set, area) in uv_areas.into_iter().enumerate() {
            let mean = area / group.triangles as f64;
            let weight = if mean > 0.0 { 1.0 / mean.sqrt() } else { 0.0 };
            group.weights[layout.uv(set)..][..2].fill(weight as f32);
        }
        if layout.normal {
            group.weights[layout.normal()..][..3].fill(0.5);
        }
        group.weights[layout.color()..].fill(1.0);
        group
    }

    /// Goes on down to a share of the group's triangles in the source.
    fn simplify(&mut self, share: f64) {
        let target = ((self.triangles as f64 * share).round() as usize).max(1) * 3;
        if self.indices.len() <= target {
            return;
        }
        let mut rest = [0.0f32; 1];
        let has_none = self.attributes.is_empty();
        let count = simplify_with_update(
            &mut self.indices,
            &mut self.positions,
            if has_none { &mut rest[..0] } else { &mut self.attributes },
            &self.weights,
            size_of::<f32>() * self.weights.len(),
            None,
            target,
            f32::MAX,
            SimplifyOptions::None,
            None,
        );
        self.indices.truncate(count);
    }
}
