//! Colors of vertices, as these formats store them.

use seamwise_texture::color::srgb_to_linear;

/// A channel's greatest value where colors count to 255. The least above 1 that whole numbers reach, so
/// that what rounding left above 1 is not taken for them.
const FIRST_OF_BYTES: f32 = 2.0;

/// Colors to linear light, from sRGB of 0 to 1, or to 255 if any is that large, which is told. A negative
/// alpha stands for none.
pub(super) fn to_linear(colors: &mut [[f32; 4]]) -> bool {
    let greatest = colors.iter().flatten().copied().fold(0.0, f32::max);
    let is_of_bytes = greatest >= FIRST_OF_BYTES;
    let whole = if is_of_bytes { 255.0 } else { 1.0 };
    let share = |x: f32| if x.is_finite() { (x / whole).clamp(0.0, 1.0) } else { 1.0 };
    for [rgb @ .., alpha] in colors {
        *rgb = rgb.map(|x| srgb_to_linear(share(x)));
        *alpha = if *alpha < 0.0 { 1.0 } else { share(*alpha) };
    }
    is_of_bytes
}
