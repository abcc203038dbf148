//! The repair of an OpenEXR file, a lightmap most often: all layers and channels.
//!
//! Channels are filled as the numbers they are, in linear f32, whatever they mean: light needs no
//! decoding. The channels R, G and B of a layer, or of a part of it that shares a prefix
//! (`diffuse.R`), are filled together: a texel with a NaN or an infinity in one of them is invalid
//! in all. Any other channel, alpha or depth, is filled on its own. Channels of integers, which
//! number things, are left as they are.
//!
//! Guaranteed: no NaN or infinity is left in a channel that has one valid sample; valid samples
//! keep their bits, f16 or f32.

use exr::prelude::{FlatSamples, Vec2, f16};
use image::DynamicImage;
use seamwise_texture::equalize::{Equalized, Options, Seam, equalize_plane};
use seamwise_texture::{Outcome, Plane, Role, TexelRole, Validity, agreeing_padding, fill_holes};

use super::channels::{group_picture, groups, is_integer, pictured};
use super::smaller::{scale_layer, scale_window};
use super::sources::Sources;
use super::{Job, WRAP, padding_note};
use crate::error::{Error, Result};
use crate::image_file::exr::{AnyLayer, Channel, LOSSLESS, decode, encode, loses};
use crate::report::repair::{ImageReport, RepairReport};

impl Job<'_> {
    pub(super) fn exr(&self, bytes: &[u8]) -> Result<(Vec<u8>, RepairReport)> {
        self.expect_extension("exr")?;
        if self.options.role == Some(Role::Normal) {
            let what = format!("{}: an EXR in the role of a normal map", self.input.display());
            return Err(Error::Unsupported { what });
        }
        self.expect_seams()?;
        let sources = Sources::read(self.options)?;
        let mut image = decode(bytes, self.options.reading.memory_limit)
            .map_err(|error| error.in_file(self.input))?;
        let (mut images, mut told) = (Vec::new(), false);
        for layer in &mut image.layer_data {
            let report = self.layer(layer, &sources, &mut told)?;
            images.push(report);
        }
        if !told {
            return Err(self.nothing_tells());
        }
        scale_window(&mut image, self.options.halvings);
        // What was read may still be more than the format allows: layers of one name, for one.
        let unwritable = |error: exr::error::Error| {
            let what = format!("it can't be written again: {error}");
            Error::invalid(self.input.display().to_string(), what)
        };
        let file = encode(image).map_err(unwritable)?;
        Ok((file, RepairReport { images, warnings: sources.warnings }))
    }

    /// Repairs a layer; `told` becomes true if something tells which of its texels are valid.
    fn layer(
        &self,
        layer: &mut AnyLayer,
        sources: &Sources,
        told: &mut bool,
    ) -> Result<ImageReport> {
        let name = match &layer.attributes.layer_name {
            Some(name) => name.to_string(),
            None => self.input.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        };
        let mut report = ImageReport { name, role: Some(Role::Data), ..ImageReport::default() };
        if loses(layer) {
            let [own, other] = [layer.encoding.compression, LOSSLESS];
            report.notes.push(format!("{own} would change valid samples: {other} is used instead"));
        }
        if layer.channel_data.list.iter().all(is_integer) {
            report.left_alone = Some("its channels are integers".to_owned());
            return Ok(report);
        }
        let Vec2(width, height) = layer.size;
        let found = picture(layer).and_then(|picture| sources.background(&picture, 0.0));
        let backdrop = found.as_ref().map(|found| found.charts.clone());
        report.notes.extend(found.into_iter().map(|found| found.note));
        let tested = sources.validity([width, height], backdrop)?;
        *told |= tested.is_some();
        let all = || Validity::from_flags(width, height, vec![true; width * height]);
        let mut validity = tested.unwrap_or_else(all);
        if validity.valid() == 0 {
            return Err(self.nothing_valid());
        }
        let padding = padding(layer, &validity, self.options.keep_padding);
        report.notes.extend(padding_note(padding.valid()));
        validity.union(&padding);
        if self.options.halvings > 0 {
            if layer.channel_data.list.iter().any(is_integer) {
                let what = format!("{}: scaling channels of integers", self.input.display());
                return Err(Error::Unsupported { what });
            }
            scale_layer(layer, &validity, self.options.halvings);
            let Vec2(width, height) = layer.size;
            validity = Validity::from_flags(width, height, vec![true; width * height]);
        }
        let (trusted, outcome) = fill_layer(layer, &validity);
        *told |= trusted.invalid() > 0;
        let reads = sources.reads(&trusted, self.options.footprint);
        report.add_outcome(&trusted, outcome, reads);
        if let Some((seams, options)) = sources.seams(self.options) {
            let (equalized, name) =
                equalize_layer(layer, &trusted, seams, options).map_err(|error| {
                    Error::invalid(self.input.display().to_string(), error.to_string())
                })?;
            report.equalized = Some(equalized);
            report.notes.push(format!("the steps across seams are those of {name}"));
        }
        if self.options.diff.is_some() || self.options.pyramid.is_some() {
            let groups = groups(&layer.channel_data.list);
            let shown = picture(layer).or_else(|| group_picture(layer, groups.first()?));
            if let Some(shown) = shown {
                report.diff = self.diff(&shown, &trusted)?;
                report.pyramid = self.pyramid(&shown, &trusted, Some(Role::Data))?;
            }
        }
        Ok(report)
    }
}

/// The layer as a picture, to look for its background: its first three color channels, or its only
/// one of floats thrice.
fn picture(layer: &AnyLayer) -> Option<DynamicImage> {
    let channels = &layer.channel_data.list;
    let groups = groups(channels);
    match (groups.iter().find(|group| group.len() == 3), groups.as_slice()) {
        (Some(group), _) | (None, [group]) => group_picture(layer, group),
        _ => None,
    }
}

/// The padding in up to `rings` rings around the valid texels that agrees with them in all
/// channels: R, G and B as light, others as numbers.
fn padding(layer: &AnyLayer, validity: &Validity, rings: usize) -> Validity {
    let none = || {
        Validity::from_flags(
            validity.width(),
            validity.height(),
            vec![false; validity.flags().len()],
        )
    };
    if rings == 0 {
        return none();
    }
    let of_group = |group: Vec<usize>| {
        let role = if group.len() == 3 { Role::Color } else { Role::Data };
        let picture = group_picture(layer, &group)?;
        agreeing_padding(&picture, role, validity, WRAP, rings).ok()
    };
    let each = pictured(&layer.channel_data.list)
        .into_iter()
        .map(|group| of_group(group).unwrap_or_else(none));
    each.reduce(|mut all, one| {
        all.intersect(&one);
        all
    })
    .unwrap_or_else(none)
}

/// Fills a layer; returns which texels were valid and finite in all channels of floats.
fn fill_layer(layer: &mut AnyLayer, validity: &Validity) -> (Validity, Outcome) {
    let size @ [width, height] = [validity.width(), validity.height()];
    let mut trusted = validity.flags().to_vec();
    let mut remaining = vec![false; trusted.len()];
    let channels = &mut layer.channel_data.list;
    for group in groups(channels) {
        let parts = parts(channels, &group, validity);
        let filled = fill_group(channels, &group, size, &parts);
        for (texel, _) in parts.iter().enumerate().filter(|(_, part)| **part == TexelRole::Hole) {
            trusted[texel] = false;
            remaining[texel] |= !filled;
        }
    }
    let remaining = remaining.into_iter().filter(|&remains| remains).count();
    let trusted = Validity::from_flags(width, height, trusted);
    let filled = trusted.invalid() - remaining;
    (trusted, Outcome { filled, remaining, hidden: 0 })
}

fn parts(channels: &[Channel], group: &[usize], validity: &Validity) -> Vec<TexelRole> {
    let finite = |texel: usize| {
        group.iter().all(|&channel| match &channels[channel].sample_data {
            FlatSamples::F16(samples) => samples[texel].is_finite(),
            FlatSamples::F32(samples) => samples[texel].is_finite(),
            FlatSamples::U32(_) => true,
        })
    };
    let part = |(texel, &valid): (usize, &bool)| {
        if valid && finite(texel) { TexelRole::Source } else { TexelRole::Hole }
    };
    validity.flags().iter().enumerate().map(part).collect()
}

/// Equalizes the seams of every group of channels; returns what it did to the first group, and the
/// names of its channels.
fn equalize_layer(
    layer: &mut AnyLayer,
    validity: &Validity,
    seams: &[Seam],
    options: Options,
) -> seamwise_texture::Result<(Equalized, String)> {
    let channels = &mut layer.channel_data.list;
    let mut first = None;
    for group in groups(channels) {
        let mut plane = read_group(channels, &group, validity);
        let before = plane.clone();
        let equalized = equalize_plane(&mut plane, validity, WRAP, seams, options)?;
        let texels =
            plane.data().chunks_exact(group.len()).zip(before.data().chunks_exact(group.len()));
        for (texel, (after, before)) in texels.enumerate() {
            for (&channel, (after, before)) in group.iter().zip(after.iter().zip(before)) {
                if after != before {
                    write_sample(&mut channels[channel], texel, *after);
                }
            }
        }
        let names = || group.iter().map(|&channel| channels[channel].name.to_string());
        first.get_or_insert_with(|| (equalized, names().collect::<Vec<_>>().join(", ")));
    }
    Ok(first.unwrap_or_default())
}

/// The channels of a group, all texels as they are.
fn read_group(channels: &[Channel], group: &[usize], validity: &Validity) -> Plane {
    let mut plane = Plane::new(validity.width(), validity.height(), group.len());
    for (texel, values) in plane.data_mut().chunks_exact_mut(group.len()).enumerate() {
        for (value, &channel) in values.iter_mut().zip(group) {
            *value = channels[channel].sample_data.value_by_flat_index(texel).to_f32();
        }
    }
    plane
}

fn write_sample(channel: &mut Channel, texel: usize, value: f32) {
    match &mut channel.sample_data {
        FlatSamples::F16(samples) => samples[texel] = f16::from_f32(value),
        FlatSamples::F32(samples) => samples[texel] = value,
        FlatSamples::U32(_) => {}
    }
}

/// Fills the holes of a group; false if it has no sources.
fn fill_group(
    channels: &mut [Channel],
    group: &[usize],
    [width, height]: [usize; 2],
    parts: &[TexelRole],
) -> bool {
    let mut plane = Plane::new(width, height, group.len());
    for (&channel, offset) in group.iter().zip(0..) {
        let texels = plane.data_mut().chunks_exact_mut(group.len()).zip(parts).enumerate();
        for (texel, (values, _)) in texels.filter(|(_, (_, part))| **part == TexelRole::Source) {
            values[offset] = channels[channel].sample_data.value_by_flat_index(texel).to_f32();
        }
    }
    if !fill_holes(&mut plane, parts, WRAP) {
        return false;
    }
    for (&channel, offset) in group.iter().zip(0..) {
        let texels = plane.data().chunks_exact(group.len()).zip(parts).enumerate();
        for (texel, (values, _)) in texels.filter(|(_, (_, part))| **part == TexelRole::Hole) {
            write_sample(&mut channels[channel], texel, values[offset]);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image_file::exr::sample_type;
    use crate::image_file::exr::tests::{SIZE, sample};
    use crate::limit::MemoryLimit;
    use crate::repair::options::{Background, RepairOptions};
    use crate::repair::repair_file;
    use exr::prelude::{Compression, FlatImage};
    use std::path::Path;

    fn repair(image: FlatImage, options: &RepairOptions, folder: &Path) -> Result<Vec<u8>> {
        let [input, output] = ["in.exr", "out.exr"].map(|name| folder.join(name));
        let bytes = encode(image).unwrap();
        std::fs::write(&input, bytes).unwrap();
        repair_file(&input, &output, options)?;
        Ok(std::fs::read(output).unwrap())
    }

    fn masked(folder: &Path, size: u32) -> RepairOptions {
        let mask = folder.join("mask.png");
        // Texels of columns 0 and 11 are invalid.
        let luma = |x| image::Luma([if x % 11 == 0 { 0u8 } else { 255 }]);
        image::GrayImage::from_fn(size, size, |x, _| luma(x)).save(&mask).unwrap();
        RepairOptions { mask: Some(mask), background: Background::None, ..Default::default() }
    }

    fn bits(channel: &Channel) -> Vec<u32> {
        match &channel.sample_data {
            FlatSamples::F16(samples) => samples.iter().map(|s| s.to_bits().into()).collect(),
            FlatSamples::F32(samples) => samples.iter().map(|s| s.to_bits()).collect(),
            FlatSamples::U32(samples) => samples.clone(),
        }
    }

    #[test]
    fn valid_samples_keep_their_bits_and_all_others_become_finite() {
        let folder = tempfile::tempdir().unwrap();
        let before = sample();
        let file =
            repair(before.clone(), &masked(folder.path(), SIZE as u32), folder.path()).unwrap();
        let after = decode(&file, MemoryLimit::default()).unwrap();
        for (before, after) in before.layer_data.iter().zip(&after.layer_data) {
            assert_eq!(before.attributes, after.attributes);
            for (before, after) in before.channel_data.list.iter().zip(&after.channel_data.list) {
                assert_eq!((&before.name, sample_type(before)), (&after.name, sample_type(after)));
                assert!(after.sample_data.values_as_f32().all(f32::is_finite), "{}", after.name);
                let name = before.name.to_string();
                for (texel, (before, after)) in bits(before).iter().zip(bits(after)).enumerate() {
                    let invalid = [0, 11].contains(&(texel % SIZE))
                        || (texel == 50 && ["R", "G", "B"].contains(&name.as_str()))
                        || (texel == 51 && name == "Z");
                    assert!(name == "id" || invalid == (*before != after) || name == "A");
                    assert!(name != "id" || *before == after);
                }
            }
        }
        let compression = |layer: usize| after.layer_data[layer].encoding.compression;
        assert_eq!([compression(0), compression(1)], [Compression::PIZ, Compression::ZIP16]);
    }

    #[test]
    fn without_a_mask_what_is_no_number_is_filled() {
        let folder = tempfile::tempdir().unwrap();
        let none = RepairOptions { background: Background::None, ..Default::default() };
        let mut before = sample();
        for channel in &mut before.layer_data[1].channel_data.list {
            // Nothing to repair in one layer is no reason to leave the other.
            channel.sample_data = FlatSamples::F32(vec![2.0; SIZE * SIZE]);
        }
        let file = repair(before, &none, folder.path()).unwrap();
        let after = decode(&file, MemoryLimit::default()).unwrap();
        let filled = &after.layer_data[0].channel_data.list[2];
        let value = filled.sample_data.value_by_flat_index(50).to_f32();
        assert!((value - 100.0 / 7.0).abs() < 0.5, "{}: {value}", filled.name);
        let error = repair(after, &none, folder.path()).unwrap_err();
        assert!(matches!(error, Error::Options { .. }), "{error}");
    }

    #[test]
    fn what_does_not_fit_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let other = masked(folder.path(), SIZE as u32 + 1);
        let error = repair(sample(), &other, folder.path()).unwrap_err().to_string();
        assert!(error.contains("mask.png"), "{error}");
        let normal = RepairOptions { role: Some(Role::Normal), ..other };
        assert!(repair(sample(), &normal, folder.path()).is_err());
    }
}
