//! Triangles of each mesh.

use seamwise_attr::Mesh;
use serde::Serialize;

use super::columns::{Column, fit};
use super::ticks::grouped;
use crate::document::asset::Asset;
use crate::level::lods::Lods;
use crate::surface::geometry::Geometry;

/// Meshes that the table has room for; all of them are in the JSON.
const MOST_ROWS: usize = 24;

/// A mesh of the source.
#[derive(Clone, Debug, Serialize)]
pub struct MeshReport {
    /// Its index in the document.
    pub mesh: usize,
    /// Its name, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Its triangles, without degenerate ones.
    pub triangles: usize,
    /// The triangles that it has in each level, the finest first.
    pub levels: Vec<usize>,
}

/// Every mesh with triangles, in order. None if it is but one.
pub(crate) fn mesh_reports(asset: &Asset, geometries: &[Geometry], lods: &Lods) -> Vec<MeshReport> {
    let of_surface = |(surface, geometry): (usize, &Geometry)| {
        let source = mesh_triangles(geometry, &geometry.welded.mesh);
        let levels: Vec<Vec<usize>> =
            lods.of_surface(surface).map(|level| mesh_triangles(geometry, &level.mesh)).collect();
        let report = |(at, &mesh): (usize, &usize)| MeshReport {
            mesh,
            name: asset.json["meshes"][mesh]["name"].as_str().map(str::to_owned),
            triangles: source[at],
            levels: levels.iter().map(|level| level[at]).collect(),
        };
        geometry.meshes.iter().enumerate().map(report).collect::<Vec<_>>()
    };
    let mut reports: Vec<MeshReport> = geometries.iter().enumerate().flat_map(of_surface).collect();
    reports.sort_by_key(|report| report.mesh);
    if reports.len() > 1 { reports } else { Vec::new() }
}

/// Triangles of each mesh of a surface.
fn mesh_triangles(geometry: &Geometry, surface: &Mesh) -> Vec<usize> {
    let mut of_part = vec![0; geometry.parts.len()];
    for &group in &surface.groups {
        of_part[group as usize] += 1;
    }
    let of_mesh = |mesh: &usize| {
        let parts = geometry.parts.iter().zip(&of_part);
        parts.filter(|(part, _)| part.primitive.mesh == *mesh).map(|(_, count)| count).sum()
    };
    geometry.meshes.iter().map(of_mesh).collect()
}

/// The meshes as a table for people, in lines of at most `width` signs where that can be: nothing if
/// there are none, those with the most triangles if they are many.
pub(super) fn mesh_table(meshes: &[MeshReport], width: usize) -> String {
    let Some(first) = meshes.first() else { return String::new() };
    let mut shown: Vec<&MeshReport> = meshes.iter().collect();
    shown.sort_by_key(|mesh| std::cmp::Reverse(mesh.triangles));
    shown.truncate(MOST_ROWS);
    shown.sort_by_key(|mesh| mesh.mesh);
    let column = |head: String, of: &dyn Fn(&MeshReport) -> String| {
        Column::new(head, 0, shown.iter().map(|mesh| of(mesh)).collect())
    };
    let name = |mesh: &MeshReport| mesh.name.clone().unwrap_or_else(|| mesh.mesh.to_string());
    let mut columns = vec![
        column("triangles of mesh".into(), &name),
        column("source".into(), &|mesh| grouped(mesh.triangles)),
    ];
    let levels = 0..first.levels.len();
    columns.extend(
        levels.map(|level| {
            column(format!("level {}", level + 1), &|mesh| grouped(mesh.levels[level]))
        }),
    );
    let mut text = fit(columns, width);
    if meshes.len() > MOST_ROWS {
        text += &format!("and {} smaller meshes\n", meshes.len() - MOST_ROWS);
    }
    text
}

/// The meshes as rows of a table on the page, a header first: nothing if there are none, those with the
/// most triangles if they are many.
pub(super) fn mesh_rows(meshes: &[MeshReport]) -> Vec<Vec<String>> {
    let Some(first) = meshes.first() else { return Vec::new() };
    let levels = (1..=first.levels.len()).map(|level| format!("level {level}"));
    let mut rows = vec![
        ["mesh".to_owned(), "source".to_owned()].into_iter().chain(levels).collect::<Vec<_>>(),
    ];
    let mut shown: Vec<&MeshReport> = meshes.iter().collect();
    shown.sort_by_key(|mesh| std::cmp::Reverse(mesh.triangles));
    shown.truncate(MOST_ROWS);
    shown.sort_by_key(|mesh| mesh.mesh);
    rows.extend(shown.iter().map(|mesh| {
        let name = mesh.name.clone().unwrap_or_else(|| mesh.mesh.to_string());
        let counts = std::iter::once(mesh.triangles).chain(mesh.levels.iter().copied());
        std::iter::once(name).chain(counts.map(grouped)).collect()
    }));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_the_largest_meshes_in_their_order() {
        let mesh = |mesh: usize| MeshReport {
            mesh,
            name: (mesh == 1).then(|| "hull".to_owned()),
            triangles: 100 + mesh,
            levels: vec![50 + mesh],
        };
        assert_eq!(mesh_table(&[], 80), "");
        let two = "triangles of mesh  source  level 1\n0                     100       50\n\
            hull                  101       51\n";
        assert_eq!(mesh_table(&[mesh(0), mesh(1)], 80), two);
        let many: Vec<MeshReport> = (0..30).map(mesh).collect();
        let text = mesh_table(&many, 80);
        assert_eq!(text.lines().count(), 1 + MOST_ROWS + 1);
        assert!(text.contains("\n6 ") && !text.contains("\n5 "), "{text}");
        assert!(text.ends_with("and 6 smaller meshes\n"));
    }
}
