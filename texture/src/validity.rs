//! The texels of an image that may be trusted.
//!
//! With a mesh, a texel is valid when its centre lies in one of the mesh's UV triangles. Several
//! meshes may share an image: take the union. Without a mesh the background tells (see
//! [`Background`](crate::Background)), or a mask that somebody painted.
//!
//! A mask is binary, one byte a texel: a valid texel leaves a repair with the bits it came with,
//! any other is replaced as a whole; there is nothing between. Fractions arise only in the coarser
//! levels of a fill.

use glam::{DVec2, Vec2};
use image::DynamicImage;
use seamwise_attr::DisjointSets;

use crate::color_charts::color_charts;
use crate::coverage::Coverage;
use crate::error::{Error, Result};
use crate::plane::Plane;
use crate::raster::{UvTriangle, to_texels};
use crate::wrap::Wrap;

/// Places along each texel of a line whose reads are looked for.
const STEPS_PER_TEXEL: f64 = 4.0;
/// A line over more repeats of the image than this is followed in longer steps.
const MOST_REPEATS: f64 = 8.0;

/// A mask: for each texel of an image, whether its value may be trusted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Validity {
    width: usize,
    height: usize,
    mask: Vec<bool>,
}

impl Validity {
    /// From `width · height` flags, row after row from the top.
    ///
    /// # Panics
    /// If `mask` has another length.
    pub fn from_flags(width: usize, height: usize, mask: Vec<bool>) -> Self {
        assert_eq!(mask.len(), width * height, "flags and size of a validity mask differ");
        Self { width, height, mask }
    }

    /// The texels whose centres lie in a UV triangle, of either orientation, wrapped as the sampler
    /// wraps. `uvs` is what `triangles` index; one triangle with an index out of range is left out,
    /// as is one with a NaN or an infinity.
    ///
    /// A chart (triangles connected through the UVs they share) that covers no centre at all keeps
    /// the texels its corners lie in: they are all the color it has. One without area, see
    /// [`color_charts`](crate::color_charts), keeps all that a bilinear filter reads in it.
    ///
    /// Guaranteed: charts leave no gaps between their triangles. Not guaranteed: that a texel which
    /// a chart covers only in part is clean. A triangle over more than eight repeats of the image
    /// counts as all the columns of its bounding box, which errs on the side of keeping texels.
    pub fn from_charts(
        width: usize,
        height: usize,
        wrap: [Wrap; 2],
        uvs: &[Vec2],
        triangles: &[[u32; 3]],
    ) -> Self {
        if width == 0 || height == 0 {
            return Self { width, height, mask: Vec::new() };
        }
        let corners =
            |triangle: &[u32; 3]| triangle.map(|uv| to_texels(uvs[uv as usize], [width, height]));
        let mut charts = Charts::new(uvs.len());
        triangles.iter().filter(known(uvs)).for_each(|triangle| charts.join(triangle));
        let mut covered = vec![false; uvs.len()];
        let mut coverage = Coverage::new(width, height, wrap);
        for triangle in triangles.iter().filter(known(uvs)) {
            if UvTriangle::new(corners(triangle)).is_some_and(|uv| coverage.add(&uv)) {
                covered[charts.of(triangle[0])] = true;
            }
        }
        let mut mask = coverage.finish();
        let sound: Vec<&[u32; 3]> = triangles.iter().filter(known(uvs)).collect();
        let of_corners: Vec<[Vec2; 3]> =
            sound.iter().map(|triangle| triangle.map(|uv| uvs[uv as usize])).collect();
        let colors = color_charts([width, height], &of_corners);
        for (triangle, color) in sound.into_iter().zip(colors) {
            if color.is_some() {
                let taps = Taps { size: [width, height], wrap };
                taps.along(corners(triangle), |texel| mask[texel] = true);
                continue;
            }
            if covered[charts.of(triangle[0])] {
                continue;
            }
            for corner in corners(triangle).into_iter().filter(|corner| corner.is_finite()) {
                let x = wrap[0].texel(corner.x.floor() as i64, width);
                let y = wrap[1].texel(corner.y.floor() as i64, height);
                mask[y * width + x] = true;
            }
        }
        Self { width, height, mask }
    }

    /// From a painted mask: valid where its first channel is above one half.
    pub fn from_mask(mask: &Plane) -> Self {
        let texels = mask.data().chunks_exact(mask.channels().max(1));
        let mask_flags = texels.map(|texel| texel[0] > 0.5).collect();
        Self { width: mask.width(), height: mask.height(), mask: mask_flags }
    }

    /// Adds what is valid in another mask: of a second mesh that uses the same image, or of
    /// padding that is known to be good.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn union(&mut self, other: &Self) {
        assert_eq!((self.width, self.height), (other.width, other.height), "sizes of masks differ");
        for (mine, theirs) in self.mask.iter_mut().zip(&other.mask) {
            *mine |= theirs;
        }
    }

    /// Keeps only what is valid in another mask too.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn intersect(&mut self, other: &Self) {
        assert_eq!((self.width, self.height), (other.width, other.height), "sizes of masks differ");
        for (mine, theirs) in self.mask.iter_mut().zip(&other.mask) {
            *mine &= theirs;
        }
    }

    /// Checks that the mask has the size of an image.
    pub(crate) fn expect_size_of(&self, image: &DynamicImage) -> Result<()> {
        self.expect_size([image.width() as usize, image.height() as usize])
    }

    /// Checks that the mask has this width and height.
    pub(crate) fn expect_size(&self, [width, height]: [usize; 2]) -> Result<()> {
        if [width, height] == [self.width, self.height] {
            return Ok(());
        }
        let [w, h] = [self.width, self.height];
        let what = format!("the image has {width}×{height} texels, its validity mask {w}×{h}");
        Err(Error::Invalid { what })
    }

    /// Width in texels.
    #[inline]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in texels.
    #[inline]
    pub fn height(&self) -> usize {
        self.height
    }

    /// One flag per texel, row after row from the top.
    #[inline]
    pub fn flags(&self) -> &[bool] {
        &self.mask
    }

    /// Whether the texel in column `x` and row `y` may be trusted.
    #[inline]
    pub fn is_valid(&self, x: usize, y: usize) -> bool {
        self.mask[y * self.width + x]
    }

    /// Number of texels that may be trusted.
    pub fn valid(&self) -> usize {
        self.mask.iter().filter(|&&valid| valid).count()
    }

    /// Number of texels that may not be trusted.
    pub fn invalid(&self) -> usize {
        self.mask.len() - self.valid()
    }
}

/// Whether all corners of a triangle are there.
pub(crate) fn known(uvs: &[Vec2]) -> impl Fn(&&[u32; 3]) -> bool {
    let count = uvs.len();
    move |triangle| triangle.iter().all(|&uv| (uv as usize) < count)
}

/// The texels that a bilinear filter reads in an image.
struct Taps {
    size: [usize; 2],
    wrap: [Wrap; 2],
}

impl Taps {
    /// Visits those along the edges of a triangle, whose corners are in texels.
    fn along(&self, corners: [DVec2; 3], mut visit: impl FnMut(usize)) {
        if !corners.iter().all(|corner| corner.is_finite()) {
            return;
        }
        let most = MOST_REPEATS * (self.size[0] + self.size[1]) as f64;
        for (from, to) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a], corners[b])) {
            let steps = ((to - from).abs().max_element() * STEPS_PER_TEXEL).ceil().min(most);
            for step in 0..=steps as usize {
                self.at(from.lerp(to, step as f64 / steps.max(1.0)), &mut visit);
            }
        }
    }

    fn at(&self, place: DVec2, visit: &mut impl FnMut(usize)) {
        let low = place - 0.5;
        let ends = [low.floor(), low.ceil()];
        for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let column = self.wrap[0].texel(ends[x].x as i64, self.size[0]);
            let row = self.wrap[1].texel(ends[y].y as i64, self.size[1]);
            visit(row * self.size[0] + column);
        }
    }
}

/// Charts as disjoint sets of UV indices.
pub(crate) struct Charts {
    sets: DisjointSets,
}

impl Charts {
    /// Each UV on its own.
    pub(crate) fn new(uvs: usize) -> Self {
        Self { sets: DisjointSets::new(uvs) }
    }

    /// The index that names the chart of a UV.
    pub(crate) fn of(&mut self, uv: u32) -> usize {
        self.sets.root(uv) as usize
    }

    /// Unites the charts of three UVs.
    pub(crate) fn join(&mut self, &[a, b, c]: &[u32; 3]) {
        self.sets.join(a, b);
        self.sets.join(b, c);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REPEAT: [Wrap; 2] = [Wrap::Repeat; 2];

    fn drawn(validity: &Validity) -> Vec<String> {
        let sign = |&valid: &bool| if valid { '#' } else { '.' };
        validity
            .flags()
            .chunks(validity.width())
            .map(|row| row.iter().map(sign).collect())
            .collect()
    }

    #[test]
    fn a_quad_covers_the_texels_whose_centres_it_holds() {
        let uvs = [[0.25, 0.2], [0.75, 0.2], [0.75, 0.7], [0.25, 0.7]].map(Vec2::from);
        let validity = Validity::from_charts(4, 4, REPEAT, &uvs, &[[0, 1, 2], [2, 3, 0]]);
        assert_eq!(drawn(&validity), ["....", ".##.", ".##.", "...."]);
        assert_eq!((validity.valid(), validity.invalid()), (4, 12));
        assert!(validity.is_valid(1, 2) && !validity.is_valid(0, 0));
    }

    #[test]
    fn a_chart_without_area_keeps_all_that_it_reads() {
        let uvs = [[0.51, 0.51], [0.6, 0.51], [0.51, 0.6]].map(Vec2::from);
        let validity = Validity::from_charts(4, 4, REPEAT, &uvs, &[[0, 1, 2]]);
        assert_eq!(drawn(&validity), ["....", ".##.", ".##.", "...."]);
        let line = [[0.375, 0.125], [0.375, 0.875], [0.375, 0.125]].map(Vec2::from);
        let validity = Validity::from_charts(4, 4, REPEAT, &line, &[[0, 1, 2]]);
        assert_eq!(drawn(&validity), [".#..", ".#..", ".#..", ".#.."]);
        // A corner of a chart that covers other texels adds nothing.
        let uvs = [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.51, 0.0]].map(Vec2::from);
        let validity = Validity::from_charts(4, 4, REPEAT, &uvs, &[[0, 1, 2], [1, 3, 2]]);
        assert_eq!(drawn(&validity), ["##..", "#...", "....", "...."]);
    }

    #[test]
    fn bad_triangles_are_left_out() {
        let uvs = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::NAN, Vec2::splat(1e38)];
        let triangles = [[0, 1, 9], [3, 3, 3], [4, 4, 4], [0, 1, 4]];
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            Validity::from_charts(5, 3, [wrap; 2], &uvs, &triangles);
        }
        assert_eq!(Validity::from_charts(4, 4, REPEAT, &uvs, &triangles[..2]).valid(), 0);
        assert_eq!(Validity::from_charts(0, 4, REPEAT, &uvs, &triangles).valid(), 0);
    }

    #[test]
    fn union_keeps_what_either_mask_has_and_intersection_what_both_have() {
        let mut one = Validity::from_flags(3, 1, vec![true, false, false]);
        one.union(&Validity::from_flags(3, 1, vec![false, false, true]));
        assert_eq!(drawn(&one), ["#.#"]);
        one.intersect(&Validity::from_flags(3, 1, vec![true, true, false]));
        assert_eq!(drawn(&one), ["#.."]);
    }

    #[test]
    fn a_painted_mask_is_valid_above_one_half() {
        let painted = Plane::from_vec(4, 1, 1, vec![0.5, 0.51, 1.0, f32::NAN]);
        assert_eq!(drawn(&Validity::from_mask(&painted)), [".##."]);
    }
}
