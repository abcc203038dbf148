//! The levels of a fill, to be looked at.

use crate::kernel::{Level, pull_level, push_level};
use crate::plane::Plane;
use crate::pyramid::TexelRole;
use crate::wrap::Wrap;

/// A level of pull and push: red, green, blue and the weight of each texel, row after row.
#[derive(Clone, Debug, PartialEq)]
pub struct PyramidLevel {
    /// Its texels along x.
    pub width: usize,
    /// Its texels along y.
    pub height: usize,
    /// The means of the finer level and how far they are to be trusted, after the pull.
    pub pulled: Vec<[f32; 4]>,
    /// The same with what coarser levels give where trust is lacking, after the push.
    pub pushed: Vec<[f32; 4]>,
}

/// The levels that [`fill_holes`](crate::fill_holes) goes through, from the image itself to one texel: empty
/// where it has no sources. `plane` has three channels; `parts`: one per texel, row after row.
///
/// # Panics
/// If `plane` has other channels, or `parts` has not one element per texel.
pub fn pyramid_levels(plane: &Plane, parts: &[TexelRole], wrap: [Wrap; 2]) -> Vec<PyramidLevel> {
    assert_eq!(plane.channels(), 3, "three channels");
    assert_eq!(parts.len(), plane.width() * plane.height(), "parts and texels differ in number");
    if !parts.contains(&TexelRole::Source) {
        return Vec::new();
    }
    let texels = plane.data().as_chunks::<3>().0.iter().zip(parts);
    let cells = texels.map(|(&[red, green, blue], part)| match part {
        TexelRole::Source => [red, green, blue, 1.0],
        TexelRole::Bystander | TexelRole::Hole => [0.0; 4],
    });
    let (width, height) = (plane.width(), plane.height());
    let mut levels = vec![Level::<4> { width, height, cells: cells.collect() }];
    while let Some(last) = levels.last()
        && (last.width > 1 || last.height > 1)
    {
        levels.push(pull_level(last, wrap));
    }
    let pulled: Vec<Vec<[f32; 4]>> = levels.iter().map(values).collect();
    for coarse in (1..levels.len()).rev() {
        let (finer, coarser) = levels.split_at_mut(coarse);
        push_level(&coarser[0], &mut finer[coarse - 1], wrap);
    }
    let level = |(own, pulled): (&Level<4>, _)| PyramidLevel {
        width: own.width,
        height: own.height,
        pulled,
        pushed: values(own),
    };
    levels.iter().zip(pulled).map(level).collect()
}

/// Values and weights of cells, which hold values times weights.
fn values(level: &Level<4>) -> Vec<[f32; 4]> {
    let value = |&[red, green, blue, weight]: &[f32; 4]| match weight > 0.0 {
        true => [red / weight, green / weight, blue / weight, weight],
        false => [0.0; 4],
    };
    level.cells.iter().map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::fill_holes;

    #[test]
    fn the_finest_level_is_the_fill_and_the_coarsest_one_texel() {
        let (width, height) = (13, 9);
        let data: Vec<f32> =
            (0..width * height * 3).map(|at| (at * 37 % 64) as f32 / 64.0).collect();
        let mut plane = Plane::from_vec(width, height, 3, data);
        let role = |texel: usize| {
            if texel.is_multiple_of(5) { TexelRole::Source } else { TexelRole::Hole }
        };
        let parts: Vec<TexelRole> = (0..width * height).map(role).collect();
        let levels = pyramid_levels(&plane, &parts, [Wrap::Clamp; 2]);
        let sizes: Vec<[usize; 2]> = levels.iter().map(|own| [own.width, own.height]).collect();
        assert_eq!(sizes, [[13, 9], [7, 5], [4, 3], [2, 2], [1, 1]]);
        assert!(fill_holes(&mut plane, &parts, [Wrap::Clamp; 2]));
        for (filled, own) in plane.data().as_chunks::<3>().0.iter().zip(&levels[0].pushed) {
            let off = (0..3).map(|k| (filled[k] - own[k]).abs()).fold(0.0, f32::max);
            assert!(off < 1e-5 && own[3] > 0.99, "{filled:?} {own:?}");
        }
        for (own, part) in levels[0].pulled.iter().zip(&parts) {
            assert_eq!(own[3] == 1.0, *part == TexelRole::Source);
        }
        let none = vec![TexelRole::Hole; width * height];
        assert!(pyramid_levels(&plane, &none, [Wrap::Clamp; 2]).is_empty());
    }
}
