//! The outermost ring of charts, and whether it is blended with the background.
//!
//! A program that draws charts with smooth outlines leaves texels there that are part chart and part
//! background: they lie on the line from the color further in to the background's. One that paints
//! whole texels leaves a rim that goes on as the chart does, and a repair has no reason to lose it.

use image::Rgba32FImage;

use super::regions::{BESIDE, neighbors};

/// A step towards the background is one by at least this share of the way…
const LEAST_STEP: f32 = 0.1;

/// …that leaves its direction by no more than this share of the step.
const ASTRAY: f32 = 0.25;

/// Rims are blended if the share of such steps onto them is larger by this than that of steps further
/// in. Of the sample asset's color and normal maps, whose outlines are hard, both shares are below
/// 0.001; of a disc with a smooth outline they are 0.88 and 0.23.
const LEAST_EXCESS: f32 = 0.1;

/// A background this near to a chart's color tells nothing.
const LEAST_CONTRAST: f32 = 0.1;

/// Whether the outermost texels of charts are blended with what is `unused`.
pub(super) fn are_blended(image: &Rgba32FImage, unused: &[bool]) -> bool {
    let width = image.width() as usize;
    let texel = |at: usize| {
        let start = 4 * at;
        [0, 1, 2, 3].map(|channel| image.as_raw()[start + channel])
    };
    let (mut rims, mut inner, mut all) = (0usize, 0usize, 0usize);
    for rim in (0..unused.len()).filter(|&texel| !unused[texel]) {
        for (step, outer) in BESIDE.iter().zip(neighbors(rim, width, unused.len(), &BESIDE)) {
            let Some(outer) = outer.filter(|&outer| unused[outer]) else { continue };
            let Some([second, third]) = inwards(rim, *step, width, unused) else { continue };
            let [outer, rim, second, third] = [outer, rim, second, third].map(texel);
            if distance_squared(outer, second) < LEAST_CONTRAST * LEAST_CONTRAST {
                continue;
            }
            all += 1;
            rims += usize::from(leads(second, rim, outer));
            inner += usize::from(leads(third, second, outer));
        }
    }
    let [rims, inner] = [rims, inner].map(|count| count as f32 / all.max(1) as f32);
    rims - inner > LEAST_EXCESS
}

/// The next two texels away from what lies at `step`, if they are of the chart.
fn inwards(rim: usize, [dx, dy]: [isize; 2], width: usize, unused: &[bool]) -> Option<[usize; 2]> {
    let back = [[-dx, -dy]];
    let next = |from: usize| {
        let mut next = neighbors(from, width, unused.len(), &back).flatten();
        next.next().filter(|&texel| !unused[texel])
    };
    let second = next(rim)?;
    Some([second, next(second)?])
}

/// Whether the step from one color to another leads towards a third.
fn leads(from: [f32; 4], to: [f32; 4], towards: [f32; 4]) -> bool {
    let difference =
        |a: [f32; 4], b: [f32; 4]| -> [f32; 4] { std::array::from_fn(|k| a[k] - b[k]) };
    let dot = |a: [f32; 4], b: [f32; 4]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
    let (step, way) = (difference(to, from), difference(towards, from));
    let share = dot(step, way) / dot(way, way);
    let astray = difference(step, way.map(|w| share * w));
    share >= LEAST_STEP && dot(astray, astray) <= ASTRAY * ASTRAY * dot(step, step)
}

fn distance_squared(a: [f32; 4], b: [f32; 4]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// The texels that are neither unused nor next to one that is, along rows, columns and diagonals.
pub(super) fn trimmed(unused: &[bool], [width, height]: [usize; 2]) -> Vec<bool> {
    let trimmed = (0..unused.len()).map(|texel| {
        let (x, y) = (texel % width, texel / width);
        let near = |at: usize, size: usize| at.saturating_sub(1)..(at + 2).min(size);
        near(y, height).all(|y| near(x, width).all(|x| !unused[y * width + x]))
    });
    trimmed.collect()
}
