//! Connected texels, and which of a background's colors are background.

use image::Rgba32FImage;

/// Background that does not reach the image's border has at least this many texels.
const LEAST_GAP: usize = 64;

/// Along rows and columns.
pub(super) const BESIDE: [[isize; 2]; 4] = [[-1, 0], [1, 0], [0, -1], [0, 1]];

/// Along rows, columns and diagonals.
pub(super) const AROUND: [[isize; 2]; 8] =
    [[-1, 0], [1, 0], [0, -1], [0, 1], [-1, -1], [1, -1], [-1, 1], [1, 1]];

/// The label of a texel that has none of the colors.
pub(super) const NONE: u8 = u8::MAX;

/// Whether no channel is farther than `tolerance` from the color's.
pub(super) fn is_near(texel: &[f32; 4], color: &[f32; 4], tolerance: f32) -> bool {
    texel.iter().zip(color).all(|(texel, color)| (texel - color).abs() <= tolerance)
}

/// The index of the first color that each texel is near to, or [`NONE`].
pub(super) fn labels(image: &Rgba32FImage, colors: &[[f32; 4]], tolerance: f32) -> Vec<u8> {
    let label = |texel: &[f32; 4]| {
        let found = colors.iter().zip(0..NONE).find(|(color, _)| is_near(texel, color, tolerance));
        found.map_or(NONE, |(_, label)| label)
    };
    image.pixels().map(|texel| label(&texel.0)).collect()
}

/// One flag per texel: whether it is background of these colors. In an image of floats, what is no
/// number is background where background is around it.
pub(super) fn unused_texels(
    image: &Rgba32FImage,
    colors: &[[f32; 4]],
    tolerance: f32,
) -> Vec<bool> {
    let is_lost = |texel: &[f32; 4]| !texel.iter().all(|v| v.is_finite());
    let labels = labels(image, colors, tolerance);
    let mut candidates: Vec<bool> = image
        .pixels()
        .zip(labels)
        .map(|(texel, label)| label != NONE || is_lost(&texel.0))
        .collect();
    let width = image.width() as usize;
    let mut unused = vec![false; candidates.len()];
    let mut region = Vec::new();
    for seed in 0..candidates.len() {
        if std::mem::take(&mut candidates[seed]) {
            let at_border = collect_region(&mut candidates, width, seed, &BESIDE, &mut region);
            if at_border || region.len() >= LEAST_GAP {
                region.iter().for_each(|&texel| unused[texel] = true);
            }
        }
    }
    unused
}

/// Moves the candidates connected to `seed` into `region`; tells whether it reaches the border.
pub(super) fn collect_region(
    candidates: &mut [bool],
    width: usize,
    seed: usize,
    steps: &[[isize; 2]],
    region: &mut Vec<usize>,
) -> bool {
    region.clear();
    region.push(seed);
    let mut at_border = false;
    let mut next = 0;
    while let Some(&texel) = region.get(next) {
        next += 1;
        for neighbor in neighbors(texel, width, candidates.len(), steps) {
            at_border |= neighbor.is_none();
            if let Some(neighbor) = neighbor.filter(|&n| std::mem::take(&mut candidates[n])) {
                region.push(neighbor);
            }
        }
    }
    at_border
}

/// The texels next to one of an image of so many; `None` beyond its border.
pub(super) fn neighbors(
    texel: usize,
    width: usize,
    texels: usize,
    steps: &[[isize; 2]],
) -> impl Iterator<Item = Option<usize>> {
    let (x, y) = (texel % width, texel / width);
    steps.iter().map(move |&[dx, dy]| {
        let row = y.checked_add_signed(dy).filter(|y| y * width < texels);
        let column = x.checked_add_signed(dx).filter(|x| *x < width);
        row.zip(column).map(|(y, x)| y * width + x)
    })
}

/// Of the outline of what is not `around`, in sides of texels, the share on the image's border; 0 if
/// it has none.
pub(super) fn outline_on_border(around: &[bool], [width, _]: [usize; 2]) -> f64 {
    let (mut on_border, mut all) = (0usize, 0usize);
    for texel in (0..around.len()).filter(|&texel| !around[texel]) {
        for neighbor in neighbors(texel, width, around.len(), &BESIDE) {
            on_border += usize::from(neighbor.is_none());
            all += usize::from(neighbor.is_none_or(|neighbor| around[neighbor]));
        }
    }
    on_border as f64 / all.max(1) as f64
}
