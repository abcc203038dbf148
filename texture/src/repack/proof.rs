//! A test that every texel of a layout belongs to one triangle, and the remedy where one does not.

use crate::raster::{UvTriangle, Window, to_texels};

use super::Repacked;
use super::charts::Chart;

/// No triangle.
const NONE: u32 = u32::MAX;

/// Number of texels whose centres the layout covers.
///
/// # Errors
/// Triangles that cover a centre which an earlier triangle covers too, unless it lies on the
/// outline of both.
pub(super) fn prove(layout: &Repacked, size: usize) -> Result<usize, Vec<u32>> {
    let shape = |triangle: u32| {
        let corners = layout.triangles[triangle as usize];
        UvTriangle::new(corners.map(|v| to_texels(layout.uvs[v as usize], [size; 2])))
    };
    let mut owners = vec![NONE; size * size];
    let mut covered = 0;
    let mut crossing = Vec::new();
    for triangle in 0..layout.triangles.len() as u32 {
        let Some(own) = shape(triangle) else { continue };
        let mut crosses = false;
        own.texels(&Window::image(size, size), |texel| {
            let owner = &mut owners[texel.y as usize * size + texel.x as usize];
            if *owner == NONE {
                *owner = triangle;
                covered += 1;
                return;
            }
            let centre = glam::DVec2::new(texel.x as f64 + 0.5, texel.y as f64 + 0.5);
            let theirs = shape(*owner).map(|other| other.barycentrics(centre));
            let inside = |weights: [f64; 3]| weights.iter().all(|&weight| weight != 0.0);
            crosses |= inside(texel.barycentrics) || theirs.is_some_and(inside);
        });
        if crosses {
            crossing.push(triangle);
        }
    }
    if crossing.is_empty() { Ok(covered) } else { Err(crossing) }
}

/// Makes each of these triangles (ascending) a chart of its own.
pub(super) fn cut_off(charts: &mut Vec<Chart>, crossing: &[u32]) {
    let crosses = |triangle: &u32| crossing.binary_search(triangle).is_ok();
    let mut single = Vec::new();
    for chart in charts.iter_mut() {
        let (off, on) = chart.triangles.iter().partition(|t| crosses(t));
        chart.triangles = on;
        let off: Vec<u32> = off;
        single.extend(off.into_iter().map(|t| Chart { kind: chart.kind, triangles: vec![t] }));
    }
    charts.retain(|chart| !chart.triangles.is_empty());
    charts.append(&mut single);
}
