//! Importance of points: by attribute, map, view and curvature.

use std::path::{Path, PathBuf};

use glam::{DMat4, Vec2};
use seamwise_attr::{View, WedgeId, curvature_importance, view_importance};

use super::values::point_values;
use crate::error::{Error, Result};
use crate::image_file::picture::Picture;
use crate::limit::MemoryLimit;
use crate::surface::geometry::Geometry;

/// White on a map counts so many times as much as middle gray, which counts as without a map, and black
/// as little.
const GAIN: f32 = 10.0;

/// Sources of importance. Each of these gives a factor to every point; they are multiplied.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Importance {
    /// A vertex attribute of one component, 0 or more: the factor itself.
    pub attribute: Option<String>,
    /// A picture over the first UV set: white counts ten times, middle gray once, black a tenth.
    pub map: Option<PathBuf>,
    /// A view in the units of the scene, for which what faces it counts more.
    pub view: Option<View>,
    /// The power of the curvature, see [`curvature_importance`].
    pub curvature: f64,
}

impl Importance {
    /// Checks that the figures make sense.
    pub(super) fn check(&self) -> Result<()> {
        let refuse = |what: &str| Err(Error::Options { what: what.into() });
        if !(0.0..=10.0).contains(&self.curvature) {
            return refuse("the weight of curvature must lie in 0…10");
        }
        if let Some(view) = self.view {
            if !(view.weight > 0.0 && view.weight.is_finite()) {
                return refuse("the weight of what a view sees must be above 0");
            }
            if !(-1.0..=1.0).contains(&view.cosine) {
                return refuse("the cosine of what a view sees must lie in -1…1");
            }
        }
        Ok(())
    }

    /// One per point: its factor. Empty if there are no factors. `worlds` are the transforms by
    /// which the mesh is shown: a point that counts in one of them counts.
    pub(super) fn of_points(
        &self,
        geometry: &Geometry,
        map: Option<&Map>,
        worlds: &[DMat4],
    ) -> Result<Vec<f32>> {
        let mesh = &geometry.welded.mesh;
        let mut factors = Vec::new();
        if let Some(name) = &self.attribute {
            let values = point_values(geometry, name)?;
            if let Some((_, value)) = values.iter().find(|(_, x)| !x.is_finite() || *x < 0.0) {
                let what = format!("{name} is {value} somewhere: an importance must be 0 or more");
                return Err(Error::Options { what });
            }
            multiply(&mut factors, &greatest(mesh.positions.len(), values.into_iter()));
        }
        if let Some(map) = map.filter(|_| mesh.layout.uv_sets > 0) {
            let wedges = (0..mesh.wedge_points.len()).map(WedgeId::new);
            let values = wedges.map(|w| (mesh.wedge_points[w].index(), map.factor(mesh.uv(w, 0))));
            multiply(&mut factors, &greatest(mesh.positions.len(), values));
        }
        if let Some(view) = &self.view {
            let seen = worlds
                .iter()
                .flat_map(|world| view_importance(mesh, world, view).into_iter().enumerate());
            multiply(&mut factors, &greatest(mesh.positions.len(), seen));
        }
        if self.curvature > 0.0 {
            multiply(&mut factors, &curvature_importance(mesh, self.curvature));
        }
        Ok(factors)
    }
}

/// Multiplies factors, of which an empty list is all ones.
fn multiply(factors: &mut Vec<f32>, by: &[f32]) {
    if factors.is_empty() {
        factors.extend_from_slice(by);
    } else {
        factors.iter_mut().zip(by).for_each(|(factor, by)| *factor *= by);
    }
}

/// Per point the greatest of its values, 1 where it has none.
fn greatest(points: usize, values: impl Iterator<Item = (usize, f32)>) -> Vec<f32> {
    let mut greatest = vec![None; points];
    for (point, value) in values {
        let own = greatest[point].get_or_insert(value);
        *own = own.max(value);
    }
    greatest.into_iter().map(|value| value.unwrap_or(1.0)).collect()
}

/// A painted map.
pub(super) struct Map {
    size: [usize; 2],
    /// Luma in 0…1, as stored.
    luma: Vec<f32>,
}

impl Map {
    /// Reads a picture.
    pub(super) fn read(path: &Path, limit: MemoryLimit) -> Result<Self> {
        let luma = Picture::read(path, limit)?.texels.to_luma32f();
        let size = [luma.width() as usize, luma.height() as usize];
        if luma.iter().any(|x| !x.is_finite()) {
            let what = "a map of importance must be finite";
            return Err(Error::invalid(path.display().to_string(), what));
        }
        Ok(Self { size, luma: luma.into_raw() })
    }

    /// The factor at a UV, of the nearest texel of the repeated picture.
    fn factor(&self, uv: Vec2) -> f32 {
        let texel = |x: f32, size: usize| {
            let at = x.rem_euclid(1.0) * size as f32;
            (at as usize).min(size - 1)
        };
        let [width, height] = self.size;
        let value = self.luma[texel(uv.y, height) * width + texel(uv.x, width)];
        GAIN.powf(2.0 * value.clamp(0.0, 1.0) - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_repeats_and_goes_from_a_tenth_to_ten() {
        let map = Map { size: [2, 2], luma: vec![0.0, 0.5, 1.0, 0.0] };
        let factor = |x: f32, y: f32| map.factor(Vec2::new(x, y));
        assert_eq!((factor(0.2, 0.2), factor(0.7, -0.9), factor(3.1, 0.99)), (0.1, 1.0, 10.0));
        assert_eq!(factor(f32::NAN, 0.0), 0.1);
    }

    #[test]
    fn factors_are_multiplied_and_a_point_takes_the_greatest() {
        let mut factors = Vec::new();
        multiply(&mut factors, &greatest(3, [(0, 2.0), (2, 0.5), (0, 1.0)].into_iter()));
        assert_eq!(factors, [2.0, 1.0, 0.5]);
        multiply(&mut factors, &[1.0, 3.0, 4.0]);
        assert_eq!(factors, [2.0, 3.0, 2.0]);
    }
}
