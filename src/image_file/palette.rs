//! Pictures of few colors: PNGs with a palette, and the colors that stand for those of a picture.
//!
//! Colors are chosen by splitting boxes at their mean along the channel of most variance, always the box
//! of most variance in all (after Wan, Wong & Prusinkiewicz, "An Algorithm for Multidimensional Data
//! Clustering", ACM Transactions on Mathematical Software 14.2, 1988), and moved to the means of the
//! texels nearest to them (Lloyd, "Least Squares Quantization in PCM", 1982). Distances are those of the
//! stored bytes. Texels are not dithered: noise would cost more bytes than a palette saves.

use image::{DynamicImage, RgbaImage};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Most colors of a palette.
const MAX_COLORS: usize = 256;
/// Rounds of Lloyd's; a fifth changed no level of a carton by 1 % in its error.
const ROUNDS: usize = 4;

/// Red, green, blue and alpha.
type Color = [u8; 4];

/// Whether a file is a PNG with a palette.
pub(crate) fn has_palette(png: &[u8]) -> bool {
    const INDEXED: u8 = 3;
    png.starts_with(b"\x89PNG") && png.get(25) == Some(&INDEXED)
}

/// A picture as a PNG with a palette, if it has eight bits a channel and no more than 256 colors.
pub(crate) fn write_indexed(image: &DynamicImage) -> Option<Vec<u8>> {
    let (colors, _) = count_colors(image).filter(|(colors, _)| colors.len() <= MAX_COLORS)?;
    let places: FxHashMap<Color, u8> = colors.iter().copied().zip(0..=u8::MAX).collect();
    let texels: Vec<u8> = image.to_rgba8().pixels().map(|texel| places[&texel.0]).collect();
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, image.width(), image.height());
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_filter(png::Filter::NoFilter);
    encoder.set_compression(png::Compression::High);
    encoder.set_palette(
        colors.iter().flat_map(|color| [color[0], color[1], color[2]]).collect::<Vec<u8>>(),
    );
    if colors.iter().any(|color| color[3] != u8::MAX) {
        encoder.set_trns(colors.iter().map(|color| color[3]).collect::<Vec<u8>>());
    }
    let mut writer = encoder.write_header().ok()?;
    writer.write_image_data(&texels).ok()?;
    writer.finish().ok()?;
    Some(file)
}

/// The picture in at most 256 colors; none if it has other than eight bits a channel.
pub(crate) fn reduce(image: &DynamicImage) -> Option<DynamicImage> {
    let (colors, counts) = count_colors(image)?;
    if colors.len() <= MAX_COLORS {
        return Some(image.clone());
    }
    let mut palette = split(&colors, &counts, MAX_COLORS);
    for _ in 0..ROUNDS {
        let nearest = nearest(&colors, &palette);
        let mut sums = vec![[0u64; 5]; palette.len()];
        for ((color, &count), &place) in colors.iter().zip(&counts).zip(&nearest) {
            let sum = &mut sums[place];
            sum[4] += count;
            (0..4).for_each(|channel| sum[channel] += count * u64::from(color[channel]));
        }
        for (own, sum) in palette.iter_mut().zip(&sums).filter(|(_, sum)| sum[4] > 0) {
            *own = [0, 1, 2, 3].map(|channel| ((sum[channel] + sum[4] / 2) / sum[4]) as u8);
        }
    }
    Some(with_nearest(image, &colors, &palette))
}

/// The picture in at most 256 colors, those of `kept` as they are: what it has beside them becomes the
/// nearest of them and of as many more as there is room for. None if `kept` has too many, or either other
/// than eight bits a channel.
pub(crate) fn reduce_beside(image: &DynamicImage, kept: &DynamicImage) -> Option<DynamicImage> {
    let (mut palette, _) = count_colors(kept).filter(|(own, _)| own.len() <= MAX_COLORS)?;
    let (colors, counts) = count_colors(image)?;
    let all = colors.into_iter().zip(counts);
    let (new, counts): (Vec<Color>, Vec<u64>) =
        all.filter(|(color, _)| palette.binary_search(color).is_err()).unzip();
    let room = MAX_COLORS - palette.len();
    if room > 0 && !new.is_empty() {
        palette.extend(split(&new, &counts, room));
    }
    Some(with_nearest(image, &new, &palette))
}

/// The picture with no more than 256 colors where it is not valid; none if it has no more there, or other
/// than eight bits a channel.
pub(crate) fn reduce_fill(image: &DynamicImage, valid: &[bool]) -> Option<DynamicImage> {
    if !has_bytes(image) {
        return None;
    }
    let mut reduced = image.to_rgba8();
    let filled = reduced.pixels().zip(valid).filter(|(_, is_valid)| !**is_valid);
    let (colors, counts) = count(filled.map(|(texel, _)| texel.0));
    if colors.len() <= MAX_COLORS {
        return None;
    }
    let palette = split(&colors, &counts, MAX_COLORS);
    let places = nearest(&colors, &palette);
    let become_: FxHashMap<Color, Color> =
        colors.iter().zip(places).map(|(own, place)| (*own, palette[place])).collect();
    for (texel, _) in reduced.pixels_mut().zip(valid).filter(|(_, is_valid)| !**is_valid) {
        texel.0 = become_[&texel.0];
    }
    Some(as_before(reduced, image))
}

/// A picture with the nearest of a palette in the place of each of these colors.
fn with_nearest(image: &DynamicImage, colors: &[Color], palette: &[Color]) -> DynamicImage {
    let places = nearest(colors, palette);
    let become_: FxHashMap<Color, Color> =
        colors.iter().zip(places).map(|(own, place)| (*own, palette[place])).collect();
    let mut reduced = image.to_rgba8();
    let change = |color: &mut Color| become_.get(color).into_iter().for_each(|new| *color = *new);
    reduced.pixels_mut().for_each(|texel| change(&mut texel.0));
    as_before(reduced, image)
}

/// Texels with alpha only where a picture has it.
fn as_before(texels: RgbaImage, before: &DynamicImage) -> DynamicImage {
    let texels = DynamicImage::from(texels);
    if before.color().has_alpha() { texels } else { texels.to_rgb8().into() }
}

fn has_bytes(image: &DynamicImage) -> bool {
    image.color().bytes_per_pixel() == image.color().channel_count()
}

/// The colors of a picture in order, and how many texels have each.
fn count_colors(image: &DynamicImage) -> Option<(Vec<Color>, Vec<u64>)> {
    has_bytes(image).then(|| count(image.to_rgba8().pixels().map(|texel| texel.0)))
}

fn count(texels: impl Iterator<Item = Color>) -> (Vec<Color>, Vec<u64>) {
    let mut counts: FxHashMap<Color, u64> = FxHashMap::default();
    texels.for_each(|texel| *counts.entry(texel).or_default() += 1);
    let mut colors: Vec<(Color, u64)> = counts.into_iter().collect();
    colors.sort_unstable();
    colors.into_iter().unzip()
}

/// The place in the palette that is nearest to each color, the first of equal ones.
fn nearest(colors: &[Color], palette: &[Color]) -> Vec<usize> {
    let distance = |a: &Color, b: &Color| -> u32 {
        a.iter().zip(b).map(|(&a, &b)| u32::from(a.abs_diff(b)).pow(2)).sum()
    };
    let nearest = |color: &Color| {
        let all = palette.iter().enumerate();
        all.min_by_key(|(_, own)| distance(color, own)).map_or(0, |(place, _)| place)
    };
    colors.par_iter().map(nearest).collect()
}

/// Colors with their counts, and how they spread.
struct Cluster {
    colors: Vec<(Color, u64)>,
    mean: [f64; 4],
    /// Variance of each channel, times the number of texels.
    spread: [f64; 4],
}

impl Cluster {
    fn new(colors: Vec<(Color, u64)>) -> Self {
        let count: f64 = colors.iter().map(|(_, count)| *count as f64).sum();
        let moment = |value: &dyn Fn(u8) -> f64, channel: usize| -> f64 {
            colors.iter().map(|(color, count)| *count as f64 * value(color[channel])).sum()
        };
        let mean = [0, 1, 2, 3].map(|channel| moment(&f64::from, channel) / count);
        let spread = [0, 1, 2, 3]
            .map(|channel| moment(&|value| (f64::from(value) - mean[channel]).powi(2), channel));
        Self { colors, mean, spread }
    }

    fn widest(&self) -> usize {
        (1..4).fold(0, |best, next| if self.spread[next] > self.spread[best] { next } else { best })
    }

    fn split(self) -> [Self; 2] {
        let (channel, mean) = (self.widest(), self.mean);
        let (low, high) = self
            .colors
            .into_iter()
            .partition(|(color, _)| f64::from(color[channel]) <= mean[channel]);
        [Self::new(low), Self::new(high)]
    }
}

/// The means of `most` clusters.
fn split(colors: &[Color], counts: &[u64], most: usize) -> Vec<Color> {
    let all = colors.iter().copied().zip(counts.iter().copied()).collect();
    let mut clusters = vec![Cluster::new(all)];
    while clusters.len() < most {
        let total = |cluster: &Cluster| cluster.spread.iter().sum::<f64>();
        let widest = (1..clusters.len()).fold(0, |best, next| {
            if total(&clusters[next]) > total(&clusters[best]) { next } else { best }
        });
        if total(&clusters[widest]) <= 0.0 {
            break;
        }
        let [low, high] = clusters.swap_remove(widest).split();
        clusters.extend([low, high]);
    }
    clusters.iter().map(|cluster| cluster.mean.map(|mean| mean.round() as u8)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, RgbImage, Rgba, RgbaImage};

    fn gradient() -> DynamicImage {
        RgbImage::from_fn(64, 64, |x, y| Rgb([(x * 4) as u8, (y * 4) as u8, 90])).into()
    }

    #[test]
    fn few_colors_come_back_from_a_palette_as_they_were() {
        let image: DynamicImage =
            RgbaImage::from_fn(20, 10, |x, y| Rgba([x as u8, 7, y as u8, 255 - x as u8])).into();
        let file = write_indexed(&image).expect("200 colors");
        assert!(has_palette(&file));
        let back = image::load_from_memory(&file).expect("a picture");
        assert_eq!(back.to_rgba8(), image.to_rgba8());
        assert_eq!(write_indexed(&gradient()), None, "too many colors");
        assert_eq!(write_indexed(&DynamicImage::new_rgb16(2, 2)), None, "too deep");
    }

    #[test]
    fn many_colors_become_256_that_are_near() {
        let reduced = reduce(&gradient()).expect("eight bits");
        assert_eq!(reduced.color(), image::ColorType::Rgb8);
        let (colors, _) = count_colors(&reduced).expect("eight bits");
        assert!(colors.len() <= MAX_COLORS && colors.len() > 200, "{}", colors.len());
        let off = |(own, other): (&u8, &u8)| f64::from(own.abs_diff(*other)).powi(2);
        let sum: f64 = gradient().as_bytes().iter().zip(reduced.as_bytes()).map(off).sum::<f64>();
        // 256 clusters of 4×4 colors, four apart: a variance of 20 along each of two channels.
        let mean = sum / (64.0 * 64.0);
        assert!(mean < 60.0, "{mean}");
        assert!(write_indexed(&reduced).is_some());
        assert_eq!(reduce(&reduced), Some(reduced));
    }

    #[test]
    fn a_fill_takes_few_colors_and_valid_texels_stay() {
        let image: DynamicImage = image::RgbImage::from_fn(64, 64, |x, y| {
            image::Rgb([(4 * x) as u8, (4 * y) as u8, (x * y / 16) as u8])
        })
        .into();
        let valid: Vec<bool> = (0..64 * 64).map(|texel| texel % 64 < 20).collect();
        let reduced = reduce_fill(&image, &valid).expect("many colors");
        let (before, after) = (image.to_rgb8(), reduced.to_rgb8());
        let texels = before.pixels().zip(after.pixels()).zip(&valid);
        assert!(texels.clone().all(|((a, b), valid)| !valid || a == b));
        let filled = texels.filter(|(_, valid)| !**valid).map(|((_, b), _)| b.0);
        assert!(filled.collect::<std::collections::HashSet<_>>().len() <= MAX_COLORS);
        assert!(reduce_fill(&image, &[true; 64 * 64]).is_none());
    }

    #[test]
    fn colors_beside_a_palette_become_near_ones_and_its_own_stay() {
        let plain = |x, y| Rgb([(x / 8 * 32) as u8, (y / 8 * 32) as u8, 90]);
        let kept: DynamicImage = RgbImage::from_fn(64, 64, plain).into();
        let right =
            |x, y| if x < 32 { plain(x, y) } else { Rgb([(x * 4) as u8, (y * 4) as u8, 90]) };
        let image: DynamicImage = RgbImage::from_fn(64, 64, right).into();
        let reduced = reduce_beside(&image, &kept).expect("64 colors");
        assert!(write_indexed(&reduced).is_some());
        for (x, y, texel) in reduced.to_rgb8().enumerate_pixels() {
            let off = texel.0.iter().zip(right(x, y).0).map(|(a, b)| a.abs_diff(b)).max();
            assert!(off <= Some(if x < 32 { 0 } else { 16 }), "{off:?} at {x}, {y}");
        }
        assert_eq!(reduce_beside(&image, &gradient()), None, "too many colors to keep");
    }
}
