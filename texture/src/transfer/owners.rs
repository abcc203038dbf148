//! The triangle of a level that each texel of an atlas belongs to.
//!
//! A texel whose center a triangle covers is that triangle's; if several cover it, as where both halves of
//! a face lie on each other, it is owned by all of them. Around the charts lies a gutter, which bilinear
//! taps at their rims read: there a texel belongs to the nearest triangle.

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::Face;
use crate::raster::{UvTriangle, Window, to_texels};
use crate::wrap::Wrap;

/// A center that is nearer to an edge, as a weight, may lie on it.
const ON_EDGE: f64 = 1e-6;
/// A place on the rim lies this share of the way to the triangle's middle inward.
const INWARD: f64 = 0.01;
/// A triangle over more repeats of the image than this owns nothing.
const MOST_REPEATS: f64 = 8.0;

/// The most owners of a texel.
pub(super) const MOST_OWNERS: usize = 8;

/// Set in the number of a first face that is not the only one.
const SHARED: u32 = 1 << 31;

/// The faces of each texel.
pub(super) struct Owners {
    width: usize,
    /// One per texel: 1 + its first face, or 0; with [`SHARED`] if it has others.
    faces: Vec<u32>,
    /// The other faces of texels that have several, in the order of texels.
    others: Vec<(u32, u32)>,
    /// Texels inside of more than one face.
    pub(super) overlaps: usize,
    /// Texels inside of a face.
    pub(super) covered: usize,
}

impl Owners {
    /// Finds the owners of the texels of an image of `size`, with a gutter of `reach` texels.
    pub(super) fn new(size: [usize; 2], wrap: [Wrap; 2], faces: &[Face], reach: f64) -> Self {
        let texels = size[0] * size[1];
        let mut map = Self {
            width: size[0],
            faces: vec![0; texels],
            others: Vec::new(),
            overlaps: 0,
            covered: 0,
        };
        let place = |face: &Face| at_home(face.uvs, wrap).map(|uv| to_texels(uv, size));
        let sound = |corners: &[DVec2; 3]| {
            let far = size.map(|side| side as f64 * MOST_REPEATS);
            corners.iter().all(|c| c.x.abs() <= far[0] && c.y.abs() <= far[1])
        };
        let triangles: Vec<Option<UvTriangle>> = faces
            .iter()
            .map(place)
            .map(|corners| sound(&corners).then(|| UvTriangle::new(corners)).flatten())
            .collect();
        map.cover(size, wrap, faces, &triangles);
        map.others.sort_unstable();
        map.others.dedup();
        map.extend(size, wrap, &triangles, reach);
        for (texel, _) in &map.others {
            map.faces[*texel as usize] |= SHARED;
        }
        map
    }

    fn cover(
        &mut self,
        size: [usize; 2],
        wrap: [Wrap; 2],
        faces: &[Face],
        triangles: &[Option<UvTriangle>],
    ) {
        let mut twice = vec![false; self.faces.len()];
        let window = window(size, wrap);
        for (own, triangle) in (1..).zip(triangles) {
            let Some(triangle) = triangle else { continue };
            triangle.texels(&window, |texel| {
                let at = wrapped([texel.x, texel.y], size, wrap);
                if self.faces[at] == 0 {
                    self.faces[at] = own;
                    self.covered += 1;
                } else if texel.barycentrics.iter().all(|&b| b > ON_EDGE) {
                    // The other may cover it in another repeat.
                    let other = faces[self.faces[at] as usize - 1].uvs;
                    let texel = [at % size[0], at / size[0]];
                    let [_, weights] = Placed::new(other, size, wrap).find(texel).weights;
                    let is_inside = weights.min_element() > ON_EDGE as f32;
                    if is_inside && self.faces[at] != own {
                        self.others.push((at as u32, own - 1));
                        self.overlaps += usize::from(!std::mem::replace(&mut twice[at], true));
                    }
                }
            });
        }
    }

    fn extend(
        &mut self,
        size: [usize; 2],
        wrap: [Wrap; 2],
        triangles: &[Option<UvTriangle>],
        reach: f64,
    ) {
        let inside: Vec<bool> = self.faces.iter().map(|&face| face != 0).collect();
        let mut nearest = vec![f32::INFINITY; self.faces.len()];
        let window = window(size, wrap);
        for (own, triangle) in (1..).zip(triangles) {
            let Some(triangle) = triangle else { continue };
            triangle.grown_by_filter(reach).spans(&window, |y, columns| {
                for x in columns {
                    let at = wrapped([x, y], size, wrap);
                    if inside[at] {
                        continue;
                    }
                    let center = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                    let distance = triangle.distance(center) as f32;
                    if distance < nearest[at] {
                        nearest[at] = distance;
                        self.faces[at] = own;
                    }
                }
            });
        }
    }

    /// The only face of a texel; none if it has several, or none.
    #[inline]
    pub(super) fn only(&self, x: usize, y: usize) -> Option<usize> {
        let first = self.faces[y * self.width + x];
        if first & SHARED == 0 { (first as usize).checked_sub(1) } else { None }
    }

    /// The faces of a texel.
    pub(super) fn of(&self, x: usize, y: usize) -> impl Iterator<Item = usize> {
        let texel = y * self.width + x;
        let first = self.faces[texel];
        let from = match first & SHARED == 0 {
            true => self.others.len(),
            false => self.others.partition_point(|other| (other.0 as usize) < texel),
        };
        let others = self.others[from..].iter().take_while(move |other| other.0 as usize == texel);
        let others = others.map(|other| other.1 as usize).take(MOST_OWNERS - 1);
        let first = ((first & !SHARED) as usize).checked_sub(1);
        first.into_iter().chain(others)
    }
}

/// A face in the texels of an image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    /// None if it has no area.
    triangle: Option<UvTriangle>,
    middle: DVec2,
    size: [usize; 2],
    wrap: [Wrap; 2],
}

impl Placed {
    pub(super) fn new(uvs: [Vec2; 3], size: [usize; 2], wrap: [Wrap; 2]) -> Self {
        let corners = uvs.map(|uv| to_texels(uv, size));
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        Self { triangle: UvTriangle::new(corners), middle, size, wrap }
    }

    /// The place of a texel's center.
    #[inline]
    pub(super) fn find(&self, [x, y]: [usize; 2]) -> Spot {
        let center = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        match self.triangle.as_ref().and_then(|triangle| triangle.weights_inside(center)) {
            Some(weights) => {
                let weights = DVec3::from_array(weights).as_vec3();
                Spot { weights: [weights; 2], center }
            }
            None => self.find_outside([x, y]),
        }
    }

    #[cold]
    fn find_outside(&self, [x, y]: [usize; 2]) -> Spot {
        let Self { size, wrap, middle, .. } = *self;
        let Some(triangle) = &self.triangle else {
            return Spot { weights: [Vec3::splat(1.0 / 3.0); 2], center: middle };
        };
        let columns = copies(x, size[0], wrap[0], middle.x);
        let rows = copies(y, size[1], wrap[1], middle.y);
        let centers = columns.iter().flat_map(|&x| rows.iter().map(move |&y| DVec2::new(x, y)));
        // The copy that lies in the triangle, or else nearest to it.
        let center = centers.min_by(|a, b| triangle.distance(*a).total_cmp(&triangle.distance(*b)));
        let center = center.unwrap_or(middle);
        let mut inside = triangle.nearest(center);
        if inside != center {
            // Off the seam, where it is not told on which side of it a place lies.
            inside = inside.lerp(middle, INWARD);
        }
        Spot { weights: [self.weights_at(inside), self.weights_at(center)], center }
    }

    /// Weights of the corners at a place in texels, some below 0 outside.
    pub(super) fn weights_at(&self, place: DVec2) -> Vec3 {
        let weights = self.triangle.as_ref().map(|triangle| triangle.barycentrics(place));
        weights.map_or(Vec3::splat(1.0 / 3.0), |weights| DVec3::from_array(weights).as_vec3())
    }
}

/// The place of a texel's center in a face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// Weights of the face's corners at the nearest place inside, and at the center itself, some below 0
    /// in the gutter.
    pub(super) weights: [Vec3; 2],
    /// The center, or its copy that lies nearest to the face, in texels.
    pub(super) center: DVec2,
}

/// The centers, along an axis, of a texel's two copies nearest to `middle`.
fn copies(texel: usize, size: usize, wrap: Wrap, middle: f64) -> [f64; 2] {
    let (center, size) = (texel as f64 + 0.5, size as f64);
    let nearest = |center: f64, period: f64| center + ((middle - center) / period).round() * period;
    match wrap {
        Wrap::Clamp => [center; 2],
        Wrap::Repeat => {
            let below = center + ((middle - center) / size).floor() * size;
            [below, below + size]
        }
        Wrap::Mirror => [nearest(center, 2.0 * size), nearest(-center, 2.0 * size)],
    }
}

/// A face moved by whole periods to where the image lies: far from it stands the same.
fn at_home(uvs: [Vec2; 3], wrap: [Wrap; 2]) -> [Vec2; 3] {
    let low = uvs[0].min(uvs[1]).min(uvs[2]);
    let whole = |axis: usize| match wrap[axis] {
        Wrap::Clamp => 0.0,
        Wrap::Repeat => low[axis].floor(),
        Wrap::Mirror => 2.0 * (0.5 * low[axis]).floor(),
    };
    let by = Vec2::new(whole(0), whole(1));
    uvs.map(|uv| uv - by)
}

/// The texels that a face may own, before they are wrapped.
fn window(size: [usize; 2], wrap: [Wrap; 2]) -> Window {
    let side = |axis: usize| {
        let size = size[axis] as i64;
        let far = size * MOST_REPEATS as i64;
        if wrap[axis] == Wrap::Clamp { 0..size } else { -far..far }
    };
    Window { x: side(0), y: side(1) }
}

/// The place of a texel in an image's rows.
fn wrapped([x, y]: [i64; 2], size: [usize; 2], wrap: [Wrap; 2]) -> usize {
    wrap[1].texel(y, size[1]) * size[0] + wrap[0].texel(x, size[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn face(uvs: [[f32; 2]; 3]) -> Face {
        Face { pair: 0, triangle: 0, reading: 0, uvs: uvs.map(Vec2::from) }
    }

    fn drawn(map: &Owners, size: [usize; 2]) -> Vec<String> {
        let sign = |x, y| map.of(x, y).next().map_or('.', |face| (b'0' + face as u8) as char);
        (0..size[1]).map(|y| (0..size[0]).map(|x| sign(x, y)).collect()).collect()
    }

    #[test]
    fn texels_belong_to_the_triangle_that_covers_them_and_gutters_to_the_nearest() {
        let lower = face([[0.25, 0.25], [0.25, 0.75], [0.75, 0.75]]);
        let upper = face([[0.25, 0.25], [0.75, 0.75], [0.75, 0.25]]);
        let map = Owners::new([8, 8], [Wrap::Clamp; 2], &[lower, upper], 1.0);
        let expected = [
            "........", ".111111.", ".001111.", ".000111.", ".000011.", ".000001.", ".000001.",
            "........",
        ];
        let drawn = drawn(&map, [8, 8]);
        assert_eq!(drawn[2..6], expected[2..6]);
        assert_eq!((map.covered, map.overlaps), (16, 0));
    }

    #[test]
    fn overlapping_faces_are_counted_once_a_texel() {
        let square = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let faces = [face(square), face(square), face(square)];
        let map = Owners::new([8, 8], [Wrap::Clamp; 2], &faces, 1.0);
        assert!(map.overlaps > 20 && map.overlaps <= map.covered, "{}", map.overlaps);
        assert!(map.of(1, 1).eq([0, 1, 2]) && map.of(7, 7).next().is_none());
    }

    #[test]
    fn a_face_far_from_the_image_owns_what_it_would_near_it() {
        let triangle = [[0.25, 0.125], [1.25, 0.125], [0.25, 0.875]];
        for (wrap, by) in [(Wrap::Repeat, 31.0), (Wrap::Repeat, -20.0), (Wrap::Mirror, 30.0)] {
            let owners = |by: f32| {
                let faces = [face(triangle.map(|[u, v]| [u + by, v - by]))];
                drawn(&Owners::new([8, 8], [wrap; 2], &faces, 1.0), [8, 8])
            };
            assert_eq!(owners(by), owners(0.0), "{wrap:?} {by}");
        }
    }

    #[test]
    fn faces_overlap_in_different_repeats_too() {
        let square = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        for (wrap, by, overlaps) in
            [(Wrap::Repeat, 3.0, true), (Wrap::Mirror, 2.0, true), (Wrap::Clamp, 3.0, false)]
        {
            let faces = [face(square), face(square.map(|[u, v]| [u + by, v]))];
            let map = Owners::new([8, 8], [wrap; 2], &faces, 0.0);
            assert_eq!(map.overlaps > 20, overlaps, "{wrap:?}: {}", map.overlaps);
        }
    }

    #[test]
    fn a_face_across_the_edge_is_found_again_on_the_other_side() {
        for (wrap, uvs) in [
            (Wrap::Repeat, [[0.75, 0.25], [1.25, 0.25], [0.75, 1.25]]),
            (Wrap::Mirror, [[0.75, 0.25], [1.25, 0.25], [0.75, 1.25]]),
        ] {
            let size = [8, 8];
            let face = face(uvs);
            let map = Owners::new(size, [wrap; 2], std::slice::from_ref(&face), 1.0);
            let mut inside = 0;
            for at in 0..64 {
                let texel = [at % 8, at / 8];
                if map.of(texel[0], texel[1]).next().is_some() {
                    let [_, weights] = Placed::new(face.uvs, size, [wrap; 2]).find(texel).weights;
                    let uv = (0..3).map(|i| face.uvs[i] * weights[i]).sum::<Vec2>();
                    let found = [0, 1].map(|axis| wrap.texel((uv[axis] * 8.0).floor() as i64, 8));
                    assert_eq!(found, texel);
                    inside += usize::from(weights.min_element() >= 0.0);
                }
            }
            assert!(inside >= 8, "{inside}");
        }
    }
}
