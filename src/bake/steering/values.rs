//! The names of an asset's materials and vertex attributes, and the values of the attributes.

use seamwise_attr::{Mesh, PointId};

use crate::document::accessor::Elements;
use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::surface::geometry::Geometry;
use crate::surface::part::Part;

/// The materials of a name.
pub(super) fn material(asset: &Asset, name: &str) -> Result<Vec<usize>> {
    let names: Vec<Option<&str>> = (0..asset.count("materials"))
        .map(|index| asset.json["materials"][index]["name"].as_str())
        .collect();
    let found: Vec<usize> = (0..names.len()).filter(|&i| names[i] == Some(name)).collect();
    if found.is_empty() {
        let what = format!("no material is named {name}; {}", there_are(names.iter().flatten()));
        return Err(Error::Options { what });
    }
    Ok(found)
}

/// Makes sure that some vertices carry an attribute.
pub(super) fn check_attribute(geometries: &[Geometry], name: &str) -> Result<()> {
    let parts = || geometries.iter().flat_map(|geometry| &geometry.parts);
    if parts().any(|part| part.carried.iter().any(|(own, _)| own == name)) {
        return Ok(());
    }
    let names = parts().flat_map(|part| &part.carried).map(|(name, _)| name);
    Err(Error::Options { what: format!("no vertex carries {name}; {}", there_are(names)) })
}

fn there_are(names: impl Iterator<Item = impl AsRef<str> + Ord>) -> String {
    let mut names: Vec<_> = names.collect();
    names.sort_unstable();
    names.dedup();
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    if names.is_empty() {
        "there are none".into()
    } else {
        format!("there are {}", names.join(", "))
    }
}

/// The points of a group's triangles, some more than once.
pub(super) fn points_of(mesh: &Mesh, group: u32) -> impl Iterator<Item = usize> + '_ {
    let triangles = (0..mesh.triangles.len()).filter(move |&t| mesh.groups[t] == group);
    triangles.flat_map(|t| mesh.triangle_points(t)).map(PointId::index)
}

/// The values of the attribute `name` with their points. A point has one for each of its wedges.
pub(super) fn point_values(geometry: &Geometry, name: &str) -> Result<Vec<(usize, f32)>> {
    let mut values = Vec::new();
    for part in &geometry.parts {
        let Some((_, elements)) = part.carried.iter().find(|(own, _)| own == name) else {
            continue;
        };
        let floats = scalars(part, name, elements)?;
        for (&vertex, point) in geometry.welded.wedge_vertices.iter().zip(wedge_points(geometry)) {
            let own = vertex.checked_sub(part.first).and_then(|own| floats.get(own as usize));
            values.extend(own.map(|&value| (point, value)));
        }
    }
    Ok(values)
}

fn wedge_points(geometry: &Geometry) -> impl Iterator<Item = usize> + '_ {
    geometry.welded.mesh.wedge_points.iter().map(|point| point.index())
}

/// The elements of an attribute that must have one component.
fn scalars(part: &Part, name: &str, elements: &Elements) -> Result<Vec<f32>> {
    if elements.components != 1 {
        let what = format!("{} components, not one", elements.components);
        return Err(Error::invalid(format!("{}/attributes/{name}", part.primitive.at), what));
    }
    Ok(elements.floats())
}
