//! Layers of an OpenEXR file scaled down with what is valid in them.

use exr::prelude::{FlatImage, FlatSamples, Vec2, f16};
use seamwise_texture::{Role, Validity, scale_down};

use super::channels::{group_picture, pictured};
use crate::image_file::exr::AnyLayer;

/// Scales a layer down by 2 to the power of `halvings`; texels into which nothing valid went become
/// NaN, channel by channel or color by color. Channels are of floats.
pub(super) fn scale_layer(layer: &mut AnyLayer, validity: &Validity, halvings: u32) {
    let mut size = layer.size;
    for group in pictured(&layer.channel_data.list) {
        // Floats are averaged as they are, whatever they mean.
        let scaled = group_picture(layer, &group)
            .and_then(|picture| scale_down(&picture, Role::Data, validity, halvings).ok());
        let Some((picture, valid)) = scaled else {
            continue;
        };
        let (texels, last) = (picture.to_rgb32f(), group.len() - 1);
        size = Vec2(valid.width(), valid.height());
        for (place, &channel) in group.iter().enumerate() {
            let texels = texels.pixels().zip(valid.flags());
            let value = |(texel, valid): (&image::Rgb<f32>, &bool)| {
                if *valid { texel.0[last - place] } else { f32::NAN }
            };
            let samples = &mut layer.channel_data.list[channel].sample_data;
            *samples = match samples {
                FlatSamples::F16(_) => {
                    FlatSamples::F16(texels.map(value).map(f16::from_f32).collect())
                }
                _ => FlatSamples::F32(texels.map(value).collect()),
            };
        }
    }
    layer.size = size;
    let position = &mut layer.attributes.layer_position;
    *position = Vec2(halved(position.0, halvings), halved(position.1, halvings));
}

/// Scales the window that a file's layers are shown in.
pub(super) fn scale_window(image: &mut FlatImage, halvings: u32) {
    let window = &mut image.attributes.display_window;
    let side = |side: usize| side.checked_shr(halvings).unwrap_or(0).max(1);
    window.position =
        Vec2(halved(window.position.0, halvings), halved(window.position.1, halvings));
    window.size = Vec2(side(window.size.0), side(window.size.1));
}

fn halved(place: i32, halvings: u32) -> i32 {
    place >> halvings.min(31)
}
