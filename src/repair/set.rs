//! Maps of one set: pictures of one atlas, of which what one can't tell another may.
//!
//! Flat normals are the color of a normal map's background, black is that of a metalness map's: each
//! alone would lose charts. So of a set, background is what every map that shows one has for
//! background. Codecs stain, and smaller maps have coarser outlines: where two maps are clean they tell
//! alone, as do two of those of the full size; and each map goes by its own background as far as the
//! outlines may be off.

use std::path::Path;

use seamwise_texture::Validity;

use super::background::{Found, tolerance};
use super::options::RepairOptions;
use crate::error::{Error, Result};
use crate::image_file::codec::detect_format;
use crate::image_file::picture::Picture;

/// Texels beyond its rims that a codec is taken to stain. One that halves its chroma stains more, but
/// each of these costs charts a texel where they have the color of their map's background.
const STAIN: usize = 2;

/// A map that shows a background.
struct Map {
    name: String,
    /// The texels that are none of it.
    shown: Validity,
    /// Whether its rims are stained.
    is_blended: bool,
}

impl Map {
    /// The size of a picture, and the map if it shows a background; `None` if it can't be read.
    fn read(path: &Path, options: &RepairOptions) -> Option<([usize; 2], Option<Self>)> {
        let limit = options.reading.memory_limit;
        let bytes = limit.read_file(path).ok()?;
        let format = detect_format(&bytes)?;
        let texels = Picture::decode(&bytes, format, limit).ok()?.texels;
        let size = [texels.width() as usize, texels.height() as usize];
        let role = options.role.unwrap_or_default();
        let found = Found::of(&texels, &options.background, tolerance(format), role);
        let map = found.map(|found| Self {
            name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            shown: found.shown(&texels),
            is_blended: found.is_blended,
        });
        Some((size, map.filter(|map| map.shown.invalid() > 0)))
    }
}

/// The background that maps share.
#[derive(Clone, Debug)]
pub(super) struct Shared {
    /// The texels that some map takes for charts, at the size of the largest.
    charts: Validity,
    /// Texels of the largest that its outlines may be off.
    astray: usize,
    /// A note for people of the maps that show a background.
    pub(super) note: String,
}

impl Shared {
    /// The background of these pictures; `None` if none of them shows one. Those that can't be read
    /// say nothing, and fail as their turn comes; so do those of another shape than the first.
    pub(super) fn of(maps: &[&Path], options: &RepairOptions) -> Option<Self> {
        let mut shape: Option<[usize; 2]> = None;
        let mut largest = [0, 0];
        let mut found: Vec<Map> = Vec::new();
        for path in maps {
            let Some((size, map)) = Map::read(path, options) else { continue };
            if is_alike(*shape.get_or_insert(size), size) {
                largest = if size[0] > largest[0] { size } else { largest };
                found.extend(map);
            }
        }
        let count = |test: &dyn Fn(&Map) -> bool| found.iter().filter(|map| test(map)).count();
        let is_clean = |map: &Map| !map.is_blended;
        let is_exact = |map: &Map| is_clean(map) && map.shown.width() == largest[0];
        if count(&is_exact) > 1 {
            found.retain(is_exact);
        } else if count(&is_clean) > 1 {
            found.retain(is_clean);
        }
        let steps = found.iter().map(|map| largest[0].div_ceil(map.shown.width().max(1))).max();
        let stain = if found.iter().any(|map| map.is_blended) { STAIN } else { 0 };
        let astray = steps.filter(|steps| *steps > 1).unwrap_or(0) + stain;
        let names: Vec<&str> = found.iter().map(|map| map.name.as_str()).collect();
        let names = names.join(", ");
        let charts = found.iter().map(|map| magnified(&map.shown, largest));
        let charts = charts.reduce(|mut all, own| {
            all.union(&own);
            all
        })?;
        let share = 100.0 * charts.invalid() as f64 / charts.flags().len().max(1) as f64;
        let note = format!("background: {share:.1} % of it, as told by {names} of its set");
        Some(Self { charts, astray, note })
    }

    /// The texels that may be trusted of a map of this size: those of which charts cover half or more,
    /// and next to the others none of its own background, of whose shape `own` tells.
    ///
    /// # Errors
    /// [`Error::Options`] if it has not the shape of the set.
    pub(super) fn validity(&self, size: [usize; 2], own: Option<&Found>) -> Result<Validity> {
        let whole = [self.charts.width(), self.charts.height()];
        if !is_alike(whole, size) {
            let [[w, h], [width, height]] = [whole, size];
            let what = format!(
                "it has {width}×{height} texels, and its set {w}×{h}: maps of one set have one shape; \
                 repair it apart, under a name of its own"
            );
            return Err(Error::Options { what });
        }
        let charts = if size == whole { self.charts.clone() } else { minified(&self.charts, size) };
        let Some(own) = own else { return Ok(charts) };
        let steps = (self.astray * size[0]).div_ceil(whole[0].max(1));
        let charts = (0..steps).fold(charts, |charts, _| {
            let mut inner = charts.without_rims();
            inner.union(&own.charts);
            inner.intersect(&charts);
            inner
        });
        Ok(if own.is_blended { charts.without_rims() } else { charts })
    }
}

/// Whether two sizes have the same proportions.
fn is_alike(a: [usize; 2], b: [usize; 2]) -> bool {
    a[0] * b[1] == a[1] * b[0]
}

/// A mask at a larger size, texel for block.
fn magnified(mask: &Validity, [width, height]: [usize; 2]) -> Validity {
    let at = |to: usize, from: usize, texel: usize| (texel * from / to.max(1)).min(from - 1);
    let flags = (0..width * height).map(|texel| {
        let (x, y) = (texel % width, texel / width);
        mask.is_valid(at(width, mask.width(), x), at(height, mask.height(), y))
    });
    Validity::from_flags(width, height, flags.collect())
}

/// A mask at a smaller size: valid where half of what lies under a texel is, and more.
fn minified(mask: &Validity, [width, height]: [usize; 2]) -> Validity {
    let range = |to: usize, from: usize, texel: usize| {
        let start = texel * from / to;
        start..((texel + 1) * from).div_ceil(to).max(start + 1).min(from)
    };
    let flags = (0..width * height).map(|texel| {
        let (x, y) = (texel % width, texel / width);
        let (rows, columns) = (range(height, mask.height(), y), range(width, mask.width(), x));
        let all = rows.len() * columns.len();
        let valid = rows.flat_map(|y| columns.clone().map(move |x| mask.is_valid(x, y)));
        2 * valid.filter(|&valid| valid).count() >= all
    });
    Validity::from_flags(width, height, flags.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_goes_up_by_blocks_and_down_by_halves() {
        let mask = |size: [usize; 2], drawn: &str| {
            Validity::from_flags(size[0], size[1], drawn.chars().map(|c| c == '#').collect())
        };
        let small = mask([2, 1], "#.");
        assert_eq!(magnified(&small, [4, 2]), mask([4, 2], "##..##.."));
        assert_eq!(magnified(&small, [2, 1]), small);
        let large = mask([4, 2], "##.##...");
        assert_eq!(minified(&large, [2, 1]), mask([2, 1], "#."));
        let fine = mask([4, 2], "##..####");
        assert_eq!(minified(&fine, [2, 1]), mask([2, 1], "##"));
        assert_eq!(minified(&fine, [1, 1]), mask([1, 1], "#"));
        assert!(is_alike([4, 2], [2, 1]) && !is_alike([4, 2], [2, 2]));
    }
}
