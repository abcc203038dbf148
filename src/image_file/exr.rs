//! OpenEXR files to layers and back.
//!
//! Guaranteed: names, types, attributes, tiles and lossless compression of channels stay. A layer
//! with samples that its compression would change is compressed losslessly (ZIP) instead.
//! Attributes are written in the order of their names, so that equal files have equal bytes. Not
//! done: files with mip levels, subsampled channels or deep samples, which are refused.

use std::io::Cursor;

use exr::error::Error as ExrError;
use exr::meta::BlockDescription;
use exr::meta::attribute::LevelMode;
use exr::prelude::{
    AnyChannel, AnyChannels, Compression, FlatImage, FlatSamples, Layer, LineOrder, MetaData,
    ReadChannels, ReadLayers, SampleType, Vec2, WritableImage, read,
};

use crate::error::{Error, Result};
use crate::limit::MemoryLimit;

/// A channel with its samples, row after row.
pub(crate) type Channel = AnyChannel<FlatSamples>;

/// A layer of such channels.
pub(crate) type AnyLayer = Layer<AnyChannels<FlatSamples>>;

/// The compression that replaces lossy ones.
pub(crate) const LOSSLESS: Compression = Compression::ZIP16;

/// Reads all layers of a file.
pub(crate) fn decode(bytes: &[u8], limit: MemoryLimit) -> Result<FlatImage> {
    let fault = |error| match error {
        ExrError::NotSupported(what) => Error::Unsupported { what: what.into_owned() },
        error => Error::invalid("the OpenEXR data", error.to_string()),
    };
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(fault)?;
    check(&meta, limit)?;
    let layers = read().no_deep_data().largest_resolution_level().all_channels().all_layers();
    layers.all_attributes().from_buffered(Cursor::new(bytes)).map_err(fault)
}

/// Refuses what would take all memory, or come out with something missing.
fn check(meta: &MetaData, limit: MemoryLimit) -> Result<()> {
    let refuse = |what: &str| Err(Error::Unsupported { what: what.to_owned() });
    let mut bytes = 0u64;
    for header in &meta.headers {
        let levels = match &header.blocks {
            BlockDescription::Tiles(tiles) => tiles.level_mode,
            BlockDescription::ScanLines => LevelMode::Singular,
        };
        if header.deep {
            return refuse("deep samples in an EXR");
        }
        if levels != LevelMode::Singular {
            return refuse("an EXR with mip levels");
        }
        if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
            return refuse("a subsampled channel in an EXR");
        }
        let texels = header.layer_size.0 as u64 * header.layer_size.1 as u64;
        bytes = bytes.saturating_add(texels.saturating_mul(header.channels.bytes_per_pixel as u64));
    }
    if bytes > limit.bytes() {
        let what =
            format!("its channels take {} MiB, {}", bytes.div_ceil(1 << 20), limit.exceeded());
        return Err(Error::invalid("the OpenEXR data", what));
    }
    Ok(())
}

/// Whether a layer's compression would change its samples once more.
pub(crate) fn loses(layer: &AnyLayer) -> bool {
    let compression = layer.encoding.compression;
    let exact = |channel: &Channel| compression.is_lossless_for(sample_type(channel));
    !layer.channel_data.list.iter().all(exact)
}

/// Writes all layers to a file.
pub(crate) fn encode(mut image: FlatImage) -> exr::error::Result<Vec<u8>> {
    for layer in &mut image.layer_data {
        if loses(layer) {
            layer.encoding.compression = LOSSLESS;
        }
        // Otherwise blocks would be written as threads finish them.
        if layer.encoding.line_order == LineOrder::Unspecified {
            layer.encoding.line_order = LineOrder::Increasing;
        }
    }
    let mut bytes = Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes)?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

/// Puts the attributes of each header in the order of their names; the exr crate writes those it
/// does not know in an order that differs from run to run. A header is a list of attributes (name,
/// 0, type, 0, size in four bytes, value) and a 0; a file of several layers has several headers,
/// and another 0. See "OpenEXR File Layout", Academy Software Foundation.
fn sort_attributes(file: &mut [u8]) -> Option<()> {
    let several_layers = file.get(5)? & 0x10 != 0;
    let mut start = 8;
    loop {
        let mut attributes: Vec<(Vec<u8>, Vec<u8>)> = Vec::new();
        let mut end = start;
        while *file.get(end)? != 0 {
            // No text is empty: the exr crate takes the first byte for a letter whatever it is.
            let text = |at: usize| Some(1 + file.get(at + 1..)?.iter().position(|&b| b == 0)?);
            let name = text(end)?;
            let size_at = end + name + 1 + text(end + name + 1)? + 1;
            let size = u32::from_le_bytes(file.get(size_at..size_at + 4)?.try_into().ok()?);
            let next = size_at + 4 + size as usize;
            attributes.push((file[end..end + name].to_vec(), file.get(end..next)?.to_vec()));
            end = next;
        }
        attributes.sort();
        let sorted: Vec<u8> = attributes.into_iter().flat_map(|(_, bytes)| bytes).collect();
        file[start..end].copy_from_slice(&sorted);
        start = end + 1;
        if !several_layers || *file.get(start)? == 0 {
            return Some(());
        }
    }
}

/// The type of a channel's samples.
pub(crate) fn sample_type(channel: &Channel) -> SampleType {
    match channel.sample_data {
        FlatSamples::F16(_) => SampleType::F16,
        FlatSamples::F32(_) => SampleType::F32,
        FlatSamples::U32(_) => SampleType::U32,
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use exr::prelude::{AttributeValue, Encoding, ImageAttributes, LayerAttributes, Text, f16};

    pub(crate) const SIZE: usize = 12;

    fn channel(name: &str, samples: FlatSamples) -> Channel {
        let sampling = Vec2(1, 1);
        AnyChannel { name: name.into(), sample_data: samples, quantize_linearly: false, sampling }
    }

    /// Two layers: RGB in f16 and f32 with alpha, of another compression each, and a layer of
    /// depth and numbers. Texel 50 of `G` is NaN, texel 51 of `Z` infinite.
    pub(crate) fn sample() -> FlatImage {
        let half = |k: usize| {
            let value = |i| if (i, k) == (50, 1) { f32::NAN } else { (i * (k + 1)) as f32 / 7.0 };
            FlatSamples::F16((0..SIZE * SIZE).map(|i| f16::from_f32(value(i))).collect())
        };
        let single = |offset: f32| {
            let value = |i| if i == 51 { f32::INFINITY } else { offset + i as f32 / 3.0 };
            FlatSamples::F32((0..SIZE * SIZE).map(value).collect())
        };
        let numbers = FlatSamples::U32((0..SIZE * SIZE).map(|i| i as u32).collect());
        let layer = |name: &str, compression, channels: Vec<Channel>| {
            let mut attributes = LayerAttributes::named(name);
            for name in ["zeta", "alpha", "mu"] {
                let value = AttributeValue::Text(Text::from(name));
                attributes.other.insert(Text::from(name), value);
            }
            let encoding = Encoding { compression, ..Encoding::SMALL_LOSSLESS };
            let channels = AnyChannels::sort(channels.into_iter().collect());
            Layer::new((SIZE, SIZE), attributes, encoding, channels)
        };
        let light = vec![
            channel("R", half(0)),
            channel("G", half(1)),
            channel("B", half(2)),
            channel("A", FlatSamples::F32(vec![1.0; SIZE * SIZE])),
        ];
        let depth = vec![channel("Z", single(0.5)), channel("id", numbers)];
        let layers =
            [layer("light", Compression::PIZ, light), layer("depth", Compression::PXR24, depth)];
        FlatImage {
            attributes: ImageAttributes::with_size((SIZE, SIZE)),
            layer_data: layers.into_iter().collect(),
        }
    }

    #[test]
    fn equal_files_have_equal_bytes() {
        // Each set of unknown attributes is written in an order of its own.
        let files: Vec<Vec<u8>> = (0..6).map(|_| encode(sample()).unwrap()).collect();
        assert!(files.iter().all(|file| *file == files[0]));
        assert_eq!(decode(&files[0], MemoryLimit::default()).unwrap().layer_data.len(), 2);
    }

    #[test]
    fn a_type_that_begins_with_a_zero_does_not_mix_the_header_up() {
        let mut image = sample();
        let odd = AttributeValue::Custom { kind: Text::from("\0x"), bytes: vec![1, 2].into() };
        image.layer_data[0].attributes.other.insert(Text::from("odd"), odd);
        let file = encode(image.clone()).unwrap();
        let back = decode(&file, MemoryLimit::default()).unwrap();
        assert_eq!(back.layer_data[0].attributes, image.layer_data[0].attributes);
    }

    #[test]
    fn a_damaged_file_is_an_error() {
        let file = encode(sample()).unwrap();
        for length in (0..file.len()).step_by(7) {
            decode(&file[..length], MemoryLimit::default()).unwrap_err();
        }
    }
}
