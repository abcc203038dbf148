//! Repacking: the charts of a surface laid out anew in one square atlas.
//!
//! For surfaces whose UVs tile, overlap or are mirrored onto each other, whose texels thus belong to
//! several places, and for merging materials into one atlas. In the new layout every texel belongs
//! to one place, all charts have the same texels per area of the surface, and no chart is mirrored.
//!
//! 1. *Kinds* (`faces`): the sign of each triangle's area in UV space; by position where there is
//!    none.
//! 2. *Charts* (`charts`, `overlap`): connected triangles of one kind, grown without overlap.
//! 3. *Shapes* (`shape`): each chart scaled by √(area in space / area in UV) and turned to its
//!    smallest rectangle; strips that are far longer than the atlas are cut (`strips`).
//! 4. *Packing* (`cells`, `board`, `pack`): the cells that each shape touches, first fit, at the
//!    largest scale that fits.
//! 5. *Proof* (`proof`): the result is rasterised; triangles that yet cover a texel of another one,
//!    by rounding, are cut off, and it is packed again.
//!
//! Guaranteed: no texel's centre lies in two triangles but on their outlines; charts have at least
//! the padding between them; every triangle comes out in its place in the list; the result depends
//! on the input alone. Not guaranteed: that charts are as few or the packing as tight as can be; a
//! chart's stretch is that of its UVs.

mod board;
mod cells;
mod charts;
mod faces;
mod overlap;
mod pack;
mod proof;
mod shape;
mod strips;
#[cfg(test)]
mod tests;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use self::charts::{Chart, grow_charts};
use self::faces::Faces;
use self::pack::{Packing, pack};
use self::proof::prove;
use self::shape::Shape;
use self::strips::cut_strips;
use crate::error::{Error, Result};

/// Texels along an atlas, at most: no graphics card takes more.
const MOST_TEXELS: usize = 16_384;

/// A surface and its old layout.
#[derive(Clone, Copy, Debug)]
pub struct UvMesh<'a> {
    /// One per vertex.
    pub positions: &'a [Vec3],
    /// One per vertex. They may tile, overlap and be mirrored; triangles whose UVs enclose no area
    /// or are not finite are laid out by position.
    pub uvs: &'a [Vec2],
    /// Indices of vertices, counter-clockwise from outside.
    pub triangles: &'a [[u32; 3]],
    /// One per triangle: no chart spans two groups, such as materials.
    pub groups: &'a [u32],
}

/// Options of a layout.
#[derive(Clone, Debug, PartialEq)]
pub struct RepackOptions {
    /// Texels along the atlas. Default 1024.
    pub size: usize,
    /// Texels between charts, and twice those to the atlas's edge. Default 4; see
    /// [`padding_for_mips`].
    pub padding: usize,
    /// One per group: factor on its texels per length; 1 for groups beyond the list. Default none.
    pub density: Vec<f64>,
}

impl Default for RepackOptions {
    fn default() -> Self {
        Self { size: 1024, padding: 4, density: Vec::new() }
    }
}

/// Texels of padding that keep charts apart at mip levels 0 to `mips`: a texel of the last one is
/// made from as many along each axis.
pub fn padding_for_mips(mips: u32) -> usize {
    1usize.checked_shl(mips).unwrap_or(usize::MAX)
}

/// A surface's new layout.
#[derive(Clone, Debug, PartialEq)]
pub struct Repacked {
    /// One per new vertex, 0…1.
    pub uvs: Vec<Vec2>,
    /// One per new vertex: the vertex that it came from.
    pub vertices: Vec<u32>,
    /// One per triangle of the mesh: indices of new vertices, corner for corner.
    pub triangles: Vec<[u32; 3]>,
    /// One per triangle: its chart.
    pub triangle_charts: Vec<u32>,
    /// Number of charts.
    pub charts: usize,
    /// Share of the texels whose centres lie in a chart.
    pub coverage: f64,
    /// Texels per unit of length on the surface, where density is 1.
    pub texels_per_unit: f64,
}

/// Lays the charts of a surface out anew.
///
/// # Errors
/// [`Error::Mesh`] if lengths do not agree, an index is out of range or a density is not positive
/// and finite; [`Error::Invalid`] if the atlas has more than 16,384 texels a side; [`Error::Full`]
/// if there are more charts than it holds.
pub fn repack(mesh: &UvMesh<'_>, options: &RepackOptions) -> Result<Repacked> {
    check(mesh, options)?;
    let faces = Faces::new(mesh);
    let mut charts = grow_charts(mesh, &faces);
    loop {
        let shapes = lay_out(mesh, &faces, &mut charts, options);
        let packing = pack(&shapes, options).ok_or(Error::Full {
            charts: charts.len(),
            size: options.size,
            padding: options.padding,
        })?;
        let mut layout = assemble(mesh, &charts, &shapes, &packing, options.size);
        match prove(&layout, options.size) {
            Ok(covered) => {
                layout.coverage = covered as f64 / (options.size * options.size) as f64;
                return Ok(layout);
            }
            Err(crossing) => proof::cut_off(&mut charts, &crossing),
        }
    }
}

/// Charts as shapes, with strips cut.
fn lay_out(
    mesh: &UvMesh<'_>,
    faces: &Faces<'_>,
    charts: &mut Vec<Chart>,
    options: &RepackOptions,
) -> Vec<Shape> {
    let shape = |chart: &Chart| {
        let group = mesh.groups[chart.triangles[0] as usize] as usize;
        Shape::new(mesh, faces, chart, options.density.get(group).copied().unwrap_or(1.0))
    };
    let shapes = charts.par_iter().map(shape).collect();
    cut_strips(charts, shapes, shape)
}

fn assemble(
    mesh: &UvMesh<'_>,
    charts: &[Chart],
    shapes: &[Shape],
    packing: &Packing,
    size: usize,
) -> Repacked {
    let mut layout = Repacked {
        uvs: Vec::new(),
        vertices: Vec::new(),
        triangles: vec![[0; 3]; mesh.triangles.len()],
        triangle_charts: vec![0; mesh.triangles.len()],
        charts: charts.len(),
        coverage: 0.0,
        texels_per_unit: packing.texels_per_unit(),
    };
    for (at, (chart, shape)) in charts.iter().zip(shapes).enumerate() {
        let first = layout.vertices.len() as u32;
        for (&triangle, corners) in chart.triangles.iter().zip(&shape.triangles) {
            layout.triangles[triangle as usize] = corners.map(|corner| corner + first);
            layout.triangle_charts[triangle as usize] = at as u32;
        }
        layout.vertices.extend(&shape.vertices);
        let texels = shape.places.iter().map(|&p| packing.texels(at, shape.size, p));
        layout.uvs.extend(texels.map(|p| (p / size as f64).as_vec2().clamp(Vec2::ZERO, Vec2::ONE)));
    }
    layout
}

fn check(mesh: &UvMesh<'_>, options: &RepackOptions) -> Result<()> {
    if options.size > MOST_TEXELS {
        let what =
            format!("an atlas has at most {MOST_TEXELS} texels a side, not {}", options.size);
        return Err(Error::Invalid { what });
    }
    let fault = |what: String| Err(Error::Mesh { what });
    let [positions, uvs] = [mesh.positions.len(), mesh.uvs.len()];
    if positions != uvs {
        return fault(format!("there are {positions} positions and {uvs} UVs"));
    }
    let [triangles, groups] = [mesh.triangles.len(), mesh.groups.len()];
    if triangles != groups {
        return fault(format!("there are {triangles} triangles and {groups} groups of them"));
    }
    if let Some(&index) = mesh.triangles.as_flattened().iter().find(|&&v| v as usize >= positions) {
        return fault(format!("a triangle has vertex {index}, and there are {positions}"));
    }
    if let Some(bad) = options.density.iter().find(|d| !(d.is_finite() && **d > 0.0)) {
        return fault(format!("a density of texels must be positive, not {bad}"));
    }
    Ok(())
}
