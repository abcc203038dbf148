//! Which channels of an OpenEXR layer belong together, and what they look like.

use exr::prelude::SampleType;
use image::{DynamicImage, Rgb32FImage};

use crate::image_file::exr::{AnyLayer, Channel, sample_type};

pub(crate) fn is_integer(channel: &Channel) -> bool {
    sample_type(channel) == SampleType::U32
}

/// Channels that are filled together, as indices into the layer's.
pub(crate) fn groups(channels: &[Channel]) -> Vec<Vec<usize>> {
    let mut groups: Vec<(Option<String>, Vec<usize>)> = Vec::new();
    for (index, channel) in channels.iter().enumerate().filter(|(_, channel)| !is_integer(channel))
    {
        let name = channel.name.to_string();
        let (prefix, own) = name.rsplit_once('.').unwrap_or(("", &name));
        let color = matches!(own, "R" | "G" | "B").then(|| prefix.to_owned());
        match groups.iter_mut().find(|(known, _)| color.is_some() && *known == color) {
            Some((_, group)) => group.push(index),
            None => groups.push((color, vec![index])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// Groups of three channels, and all other channels on their own.
pub(crate) fn pictured(channels: &[Channel]) -> Vec<Vec<usize>> {
    let split = |group: Vec<usize>| match group.len() {
        3 => vec![group],
        _ => group.into_iter().map(|channel| vec![channel]).collect(),
    };
    groups(channels).into_iter().flat_map(split).collect()
}

/// Channels as a picture: three colors, or the first of others thrice.
pub(crate) fn group_picture(layer: &AnyLayer, group: &[usize]) -> Option<DynamicImage> {
    let channels = &layer.channel_data.list;
    // Channels are in the order of their names: B, G, R.
    let [b, g, r] = group.try_into().unwrap_or([group[0]; 3]);
    let sample = |channel: usize, texel| channels[channel].sample_data.value_by_flat_index(texel);
    let texel = |texel| [r, g, b].map(|channel| sample(channel, texel).to_f32());
    let samples = (0..layer.size.area()).flat_map(texel).collect();
    let size = [layer.size.0, layer.size.1].map(|size| size as u32);
    Rgb32FImage::from_raw(size[0], size[1], samples).map(DynamicImage::ImageRgb32F)
}
