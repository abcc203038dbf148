//! The size at which a candidate takes over: the largest at which it can't be told from its reference.
//!
//! Both must hold where the diagonal of the reference's bounding box spans S pixels:
//!
//! - its surface is off by at most the tolerance in pixels but for a thousandth of it: S ≤ tolerance / d,
//!   with d the 99.9th percentile of the distances over the diagonal;
//! - its picture differs by at most [`VISIBLE`] in every view.
//!
//! The second is found by rendering, in frames of a few sizes from 64 pixels to the screen's height,
//! from small to large; the size in between where the difference crosses the bound is guessed by its
//! powers, and looked at before it counts. Where all views of the rig's own frames, which are there
//! anyway, pass, smaller ones are not looked at. Small frames show all views, larger ones those that differ
//! most as the rig sees them, and frames larger than the rig's the worst alone. A candidate that passes
//! at the screen's height is held by its surface alone beyond it. For one that fails at 64 pixels a
//! smaller size is guessed and looked at.
//!
//! Guaranteed: at the size that is found the pictures were compared, and at each smaller one that was
//! looked at the difference is below the bound. Not guaranteed: sizes between those.

use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::camera::Rig;
use super::metrics::AtSwitch;
use super::render::render;
use super::scene::{Mode, Scene};
use super::views::{Seen, Views};
use super::visible::{Colors, VISIBLE};
use crate::screen::largest_size;

/// Least size in pixels that is looked at, if the candidate passes there.
const LEAST_PIXELS: f64 = 64.0;
/// Frames of at most this share of the rig's show all views.
const SMALL: f64 = 1.0 / 3.0;
/// Views that larger ones show, and of these those that tell between which sizes the bound is crossed.
const WORST_VIEWS: usize = 8;
const PROBED_VIEWS: usize = 3;
/// A small picture's difference goes about by this power of its size; of the levels in the note in
/// `visible` by 0.2 to 0.6.
const SMALL_POWER: f64 = 0.5;
/// Sizes that are looked at for the answer, each smaller than the one before.
const MOST_TRIES: usize = 6;
/// Share of a guessed size that is tried, and the largest share of a size that failed.
const CAUTION: f64 = 0.97;
const STEP: f64 = 0.88;

/// The reference's colors by view and resolution.
pub(super) type KnownColors = Mutex<FxHashMap<(usize, usize), Arc<Colors>>>;

/// A size that was looked at, in pixels of the diagonal, and the worst difference there.
#[derive(Clone, Copy, Debug)]
struct Look {
    pixels: f64,
    difference: f64,
}

/// What is looked at: no larger than `top` pixels, with the worst views; in frames larger than the rig's
/// with `view` alone.
struct At<'a> {
    top: f64,
    worst: &'a [usize],
    view: usize,
}

/// A reference as the rig sees it.
pub(super) struct Sight<'a> {
    pub(super) scene: &'a Scene,
    pub(super) mode: Mode,
    pub(super) rig: &'a Rig,
    pub(super) views: &'a Views,
    pub(super) colors: &'a KnownColors,
    /// Diagonal of its bounding box, in world units.
    pub(super) diagonal: f64,
    /// How many pixels a surface may be off.
    pub(super) pixel_tolerance: f64,
    /// Height of the screen in pixels, the largest size that is looked at; 0 to look at none.
    pub(super) screen_height: u32,
}

/// The search for one candidate.
pub(super) struct SwitchSearch<'a> {
    pub(super) reference: Sight<'a>,
    pub(super) candidate: &'a Scene,
    /// The candidate as the rig sees it, and how that differs, view by view.
    pub(super) views: &'a Views,
    pub(super) by_view: &'a [Seen],
}

impl SwitchSearch<'_> {
    /// The largest size, and how the candidate looks there. `off`: the 99.9th percentile of its
    /// distances, over the diagonal.
    pub(super) fn run(&self, off: f64) -> AtSwitch {
        let most = largest_size(self.reference.pixel_tolerance, off);
        let differs = self.by_view.iter().any(|seen| seen.difference.rms() > 0.0);
        let top = f64::from(self.reference.screen_height);
        if top <= 0.0 || (most == f64::INFINITY && !differs) {
            let all: Vec<usize> = (0..self.by_view.len()).collect();
            return self.by_rig(&all, most, 0.0);
        }
        let by_difference = self.views_by_difference();
        let worst: Vec<usize> = by_difference.iter().map(|(_, view)| *view).collect();
        let ([low, high], view) = self.bracket(&worst, by_difference[0].0, most, top);
        let size = match (low, high) {
            (_, None) => most,
            (Some(low), Some(high)) => most.min(crossing(low, high) * CAUTION),
            (None, Some(high)) => {
                most.min(high.pixels * (VISIBLE / high.difference).powf(1.0 / SMALL_POWER))
            }
        };
        if let (Some(low), true) = (low, size >= top) {
            // It was looked at there.
            let resolution = self.resolution(top);
            return AtSwitch { resolution, ..self.by_rig(&worst, size, low.difference) };
        }
        self.settle(size, low, &At { top, worst: &worst, view })
    }

    /// The largest size that passes and the least that fails, of a few; and the worst view of the last.
    /// `difference`: the worst as the rig sees them. Where that passes nothing smaller is looked at.
    fn bracket(
        &self,
        worst: &[usize],
        difference: f64,
        most: f64,
        top: f64,
    ) -> ([Option<Look>; 2], usize) {
        let own = self.pixels(self.reference.rig.resolution);
        let base = own.min(top);
        let passes = own <= top && difference <= VISIBLE;
        let mut low = passes.then_some(Look { pixels: own, difference });
        let mut sizes = Vec::new();
        if !passes {
            sizes.extend([0.125, 0.25, 0.5].map(|share| base * share));
            sizes.retain(|size| *size >= LEAST_PIXELS);
            sizes.push(base);
        }
        sizes.extend((top > own).then_some(top));
        let mut view = worst[0];
        for pixels in sizes {
            if low.is_some_and(|low| low.pixels >= most) {
                break;
            }
            let views = if pixels > own {
                vec![view]
            } else if self.is_small(self.resolution(pixels)) {
                (0..self.by_view.len()).collect()
            } else {
                worst[..worst.len().min(PROBED_VIEWS)].to_vec()
            };
            let (difference, worst_view) = self.look(&views, pixels);
            view = worst_view;
            let look = Some(Look { pixels, difference });
            if difference > VISIBLE {
                return ([low, look], view);
            }
            low = look;
        }
        ([low, None], view)
    }

    /// Whether frames are so small that all views are looked at.
    fn is_small(&self, resolution: usize) -> bool {
        resolution as f64 <= SMALL * self.reference.rig.resolution as f64
    }

    /// Looks at a size, and at smaller ones until it passes. `low`: a size that passed.
    fn settle(&self, mut size: f64, low: Option<Look>, at: &At<'_>) -> AtSwitch {
        let mut found = self.at(size, at);
        for _ in 1..MOST_TRIES {
            if found.visible_difference <= VISIBLE || found.resolution <= 1 {
                break;
            }
            let high = Look { pixels: size.min(at.top), difference: found.visible_difference };
            let low = low.filter(|low| low.pixels < high.pixels);
            let guess = low.map_or(f64::INFINITY, |low| crossing(low, high) * CAUTION);
            size = guess.min(high.pixels * STEP);
            found = self.at(size, at);
        }
        found
    }

    /// How the candidate looks at a size, or at the largest that is looked at.
    fn at(&self, size: f64, at: &At<'_>) -> AtSwitch {
        let resolution = self.resolution(size.min(at.top));
        if resolution >= self.reference.rig.resolution {
            let (visible, _) = self.look(&[at.view], size.min(at.top));
            return AtSwitch { resolution, ..self.by_rig(at.worst, size, visible) };
        }
        let Sight { rig, scene, mode, .. } = self.reference;
        let mut rig = rig.at_resolution(resolution);
        if !self.is_small(resolution) {
            rig = rig.with_views(at.worst);
        }
        let [reference, candidate] =
            [scene, self.candidate].map(|scene| Views::new(scene, &rig, mode));
        let visible = reference.visible_difference(&candidate);
        let seen = Seen::pool(&reference.compare(&candidate));
        AtSwitch::new(size, resolution, &seen, visible)
    }

    /// The figures of the rig's own frames.
    fn by_rig(&self, worst: &[usize], pixels: f64, visible: f64) -> AtSwitch {
        let seen: Vec<Seen> = worst.iter().map(|view| self.by_view[*view]).collect();
        AtSwitch::new(pixels, self.reference.rig.resolution, &Seen::pool(&seen), visible)
    }

    /// The views that differ most to an eye as the rig sees them, the worst first, and by how much.
    fn views_by_difference(&self) -> Vec<(f64, usize)> {
        let resolution = self.reference.rig.resolution;
        let of_view = |view: usize| (self.difference(view, resolution), view);
        let mut views: Vec<(f64, usize)> =
            (0..self.by_view.len()).into_par_iter().map(of_view).collect();
        views.sort_by(|a, b| b.0.total_cmp(&a.0));
        views.truncate(WORST_VIEWS);
        views
    }

    /// The worst difference of some views at a size, and the view.
    fn look(&self, views: &[usize], pixels: f64) -> (f64, usize) {
        let resolution = self.resolution(pixels);
        let of_view = |view: &usize| (self.difference(*view, resolution), *view);
        let all: Vec<(f64, usize)> = views.par_iter().map(of_view).collect();
        all.into_iter()
            .fold((0.0, views[0]), |worst, own| if own.0 > worst.0 { own } else { worst })
    }

    /// The difference in a view of so many pixels.
    fn difference(&self, view: usize, resolution: usize) -> f64 {
        let Sight { rig, mode, .. } = self.reference;
        let colors = if resolution == rig.resolution {
            Colors::of(&self.views.images[view])
        } else {
            Colors::of(&render(self.candidate, &rig.cameras[view], resolution, mode))
        };
        self.reference.colors_of(view, resolution).difference(&colors)
    }

    fn pixels(&self, resolution: usize) -> f64 {
        let Sight { rig, .. } = self.reference;
        rig.pixels(self.reference.diagonal) * resolution as f64 / rig.resolution as f64
    }

    fn resolution(&self, pixels: f64) -> usize {
        // Of a scene without an extent this is no number; a frame is never much larger than the screen.
        let most = self.reference.rig.resolution.max(2 * self.reference.screen_height as usize);
        let share = pixels / self.pixels(1);
        if share.is_finite() { (share.round() as usize).clamp(1, most) } else { 1 }
    }
}

impl Sight<'_> {
    /// Its colors in a view of so many pixels, kept for the next candidate.
    fn colors_of(&self, view: usize, resolution: usize) -> Arc<Colors> {
        let known = || self.colors.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(colors) = known().get(&(view, resolution)) {
            return colors.clone();
        }
        let colors = Arc::new(if resolution == self.rig.resolution {
            Colors::of(&self.views.images[view])
        } else {
            Colors::of(&render(self.scene, &self.rig.cameras[view], resolution, self.mode))
        });
        let mut known = known();
        // Of frames larger than the rig's one at most is kept.
        let is_large = |resolution: usize| resolution > self.rig.resolution;
        known.retain(|(_, other), _| !is_large(resolution) || !is_large(*other));
        known.insert((view, resolution), colors.clone());
        colors
    }
}

/// The size between two at which the difference is at the bound, if it goes by a power of the size.
fn crossing(low: Look, high: Look) -> f64 {
    let share = (VISIBLE / low.difference).ln() / (high.difference / low.difference).ln();
    let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 1.0 };
    low.pixels * (high.pixels / low.pixels).powf(share)
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, Vec4};

    use super::super::scene::Material;
    use super::super::{Metrics, Options, Reference};
    use super::*;

    /// A white dome over the square −1…1, seen from both sides, of `n`² cells.
    fn dome(n: u16, height: f32) -> Scene {
        let white = Material { metallic: 0.0, double_sided: true, ..Material::default() };
        let mut scene = Scene { materials: vec![white], ..Scene::default() };
        for (row, column) in (0..=n).flat_map(|row| (0..=n).map(move |column| (row, column))) {
            let [x, y] = [column, row].map(|at| f32::from(at) / f32::from(n) * 2.0 - 1.0);
            scene.positions.push(Vec3::new(x, y, height * (1.0 - x * x) * (1.0 - y * y)));
            let slope = Vec3::new(x * (1.0 - y * y), y * (1.0 - x * x), 0.0) * (2.0 * height);
            scene.normals.push((Vec3::Z + slope).normalize());
            scene.colors.push(Vec4::ONE);
        }
        for cell in 0..u32::from(n) * u32::from(n) {
            let (side, row) = (u32::from(n), u32::from(n) + 1);
            let a = cell / side * row + cell % side;
            scene.triangles.extend([[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]);
        }
        scene.tangents = vec![[Vec4::ZERO; 3]; scene.triangles.len()];
        scene.triangle_materials = vec![0; scene.triangles.len()];
        scene
    }

    fn compare(reference: &Scene, candidate: &Scene, options: Options) -> Metrics {
        Reference::new(reference, options).unwrap().compare(candidate).unwrap()
    }

    const OPTIONS: Options = Options {
        views: 4,
        resolution: 128,
        samples: 4000,
        pixel_tolerance: 1e9,
        screen_height: 400,
    };

    #[test]
    fn what_is_seen_to_differ_is_shown_below_that_size_however_near_its_surface_is() {
        let (fine, coarse) = (dome(32, 0.5), dome(3, 0.5));
        let metrics = compare(&fine, &coarse, OPTIONS);
        let found = metrics.at_switch;
        assert!(found.pixels > 4.0 && found.pixels < 400.0, "{found:?}");
        assert!(found.visible_difference <= VISIBLE && found.visible_difference > 0.0, "{found:?}");
        // The same by hand, in frames of that size and three times as large.
        let worst = |pixels: f64| {
            let reference = Reference::new(&fine, OPTIONS).unwrap();
            let share = pixels / reference.rig.pixels(reference.diagonal());
            let resolution = (share * 128.0).round() as usize;
            let rig = reference.rig.at_resolution(resolution);
            let [a, b] = [&fine, &coarse].map(|scene| Views::new(scene, &rig, reference.mode));
            a.visible_difference(&b)
        };
        assert!(worst(found.pixels) <= VISIBLE);
        assert!(worst(3.0 * found.pixels) > VISIBLE, "{}", worst(3.0 * found.pixels));
    }

    #[test]
    fn what_no_picture_tells_apart_is_bound_by_its_surface() {
        let (fine, near) = (dome(32, 0.5), dome(31, 0.5));
        let one_pixel = Options { pixel_tolerance: 1.0, ..OPTIONS };
        let metrics = compare(&fine, &near, one_pixel);
        assert_eq!(metrics.at_switch.pixels, 1.0 / metrics.distance_p999);
        assert!(metrics.distance_p999 > metrics.distance_rms);
        assert!(metrics.distance_p999 <= metrics.distance_max);
        // Beyond the screen nothing is drawn: what is looked at is as high as that.
        assert!(metrics.at_switch.pixels > 400.0 && metrics.at_switch.resolution > 128);
    }

    #[test]
    fn finer_levels_are_shown_larger() {
        let fine = dome(32, 0.5);
        let size = |n| compare(&fine, &dome(n, 0.5), OPTIONS).at_switch.pixels;
        let sizes = [8, 5, 3, 2].map(size);
        assert!(sizes.windows(2).all(|pair| pair[0] > pair[1]), "{sizes:?}");
    }

    #[test]
    fn the_same_may_be_shown_at_any_size() {
        let found = compare(&dome(4, 0.5), &dome(4, 0.5), OPTIONS).at_switch;
        assert_eq!((found.pixels, found.visible_difference), (f64::INFINITY, 0.0));
        assert_eq!(found.resolution, 128);
    }

    #[test]
    fn another_color_on_the_same_surface_bounds_the_size() {
        let (white, mut gray) = (dome(4, 0.5), dome(4, 0.5));
        gray.colors.fill(Vec4::new(0.5, 0.5, 0.5, 1.0));
        let found = compare(&white, &gray, OPTIONS).at_switch;
        assert!(found.pixels < LEAST_PIXELS, "{found:?}");
    }
}
