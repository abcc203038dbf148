//! The rival's groups as levels like ours.

use seamwise_attr::{Level, Mesh, Vertices, Welded, weld};

use crate::rival::{Group, simplify};

/// The rival's chain for `mesh`: a level per share of its triangles.
pub(crate) fn chain(mesh: &Mesh, shares: &[f64]) -> Vec<Level> {
    simplify(Group::split(mesh), shares).iter().map(|groups| level(mesh, groups)).collect()
}

/// The groups as they stand, as one level.
fn level(source: &Mesh, groups: &[Group]) -> Level {
    let mut vertices = Vertices { layout: source.layout, ..Vertices::default() };
    let mut wedges = Vec::new();
    for group in groups {
        let first = vertices.positions.len() as u32;
        vertices.positions.extend(group.positions.iter().map(|&p| glam::Vec3::from(p)));
        vertices.attributes.extend_from_slice(&group.attributes);
        wedges.extend_from_slice(&group.wedges);
        for corners in group.indices.chunks_exact(3) {
            vertices.triangles.push([corners[0], corners[1], corners[2]].map(|v| v + first));
            vertices.groups.push(group.id);
        }
    }
    normalize(&mut vertices);
    let Welded { mesh, wedge_vertices, .. } = weld(&vertices).expect("the rival's own output");
    let wedge_sources: Vec<_> =
        wedge_vertices.iter().map(|&v| seamwise_attr::WedgeId(wedges[v as usize])).collect();
    let mut point_sources = vec![seamwise_attr::PointId(0); mesh.positions.len()];
    for (&point, &wedge) in mesh.wedge_points.iter().zip(&wedge_sources) {
        point_sources[point.index()] = source.wedge_points[wedge.index()];
    }
    let target = mesh.triangles.len();
    Level { mesh, point_sources, wedge_sources, target, error: 0.0, stopped: None }
}

/// Unit normals and colors in 0…1, as gltfpack leaves them.
fn normalize(vertices: &mut Vertices) {
    let layout = vertices.layout;
    if layout.is_empty() {
        return;
    }
    for row in vertices.attributes.chunks_exact_mut(layout.len()) {
        if layout.normal {
            let normal = &mut row[layout.normal()..][..3];
            let unit = glam::Vec3::from_slice(normal).normalize_or(glam::Vec3::Z);
            normal.copy_from_slice(&unit.to_array());
        }
        row[layout.color()..].iter_mut().for_each(|x| *x = x.clamp(0.0, 1.0));
    }
}
