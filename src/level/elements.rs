//! Values of a level in the types of files.

use gltf::json::accessor::ComponentType;

use crate::document::accessor::Elements;
use crate::surface::part::Part;

/// Colors in the type of a part's own, from their values for so many components.
pub(super) fn color_elements<I: Iterator<Item = f32>>(
    part: &Part,
    values: impl FnOnce(usize) -> I,
) -> Elements {
    let (components, component) = part.color.unwrap_or((4, ComponentType::F32));
    quantize(float_elements(components, values(components)), component)
}

/// Floats, so many to an element.
pub(super) fn float_elements(components: usize, values: impl Iterator<Item = f32>) -> Elements {
    let mut bytes = Vec::with_capacity(4 * values.size_hint().0);
    values.for_each(|x| bytes.extend_from_slice(&x.to_le_bytes()));
    Elements { bytes, component: ComponentType::F32, components, normalized: false }
}

/// Brings 0…1 floats into the type that the file had them in.
fn quantize(floats: Elements, component: ComponentType) -> Elements {
    if !matches!(component, ComponentType::U8 | ComponentType::U16) {
        return floats;
    }
    let mut quantized = Elements { bytes: Vec::new(), component, normalized: true, ..floats };
    quantized.bytes = quantized.encode(floats.floats());
    quantized
}
