//! Putting new accessors, buffer views and images into a document.
//!
//! Indices of accessors and buffer views never change, so a reference from an extension that we do
//! not know stays true. A slot that an edit sets free is used for the next new object; what is left
//! over is cut off at the end of its list, or becomes a few zero bytes.

use std::borrow::Cow;
use std::collections::BTreeSet;

use gltf::json::accessor::ComponentType;
use serde_json::{Value, json};

use super::accessor::Elements;
use super::asset::Asset;
use super::quantization;
use super::references::used_views;
use crate::image_file::encoded::EncodedImage;

/// The target of a buffer view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// `ARRAY_BUFFER`.
    Vertices,
    /// `ELEMENT_ARRAY_BUFFER`.
    Indices,
}

/// An asset that is being changed. New bytes are gathered in a buffer of their own until
/// [`Packer::finish`].
pub(crate) struct Packer {
    asset: Asset,
    free_accessors: Vec<usize>,
    free_views: Vec<usize>,
    bytes: Vec<u8>,
}

impl Packer {
    /// Starts to change a copy of `asset`, of which the given accessors are about to be replaced.
    pub(crate) fn new(asset: &Asset, replaced: &[usize]) -> Self {
        let mut asset = asset.clone();
        let mut free_accessors: Vec<usize> = replaced.to_vec();
        free_accessors.sort_unstable_by(|a, b| b.cmp(a));
        free_accessors.dedup();
        let before = used_views(&asset.json);
        for &accessor in &free_accessors {
            asset.json["accessors"][accessor] = empty_accessor();
        }
        let mut free_views = freed(&asset, &before);
        free_views.reverse();
        Self { asset, free_accessors, free_views, bytes: Vec::new() }
    }

    /// The document, to change.
    pub(crate) fn json(&mut self) -> &mut Value {
        &mut self.asset.json
    }

    /// The asset as it is by now.
    pub(crate) fn asset(&self) -> &Asset {
        &self.asset
    }

    /// Adds an image.
    pub(crate) fn add_image(&mut self, image: EncodedImage) -> usize {
        self.asset.images.push(image);
        put(&mut self.asset.json, "images", None, json!({}))
    }

    /// Replaces an image.
    pub(crate) fn set_image(&mut self, index: usize, image: EncodedImage) {
        self.asset.images[index] = image;
    }

    /// Takes images out of the document, and their buffer views if nothing else refers to those. Those
    /// behind them move up.
    pub(crate) fn drop_images(&mut self, images: &BTreeSet<usize>) {
        let before = used_views(&self.asset.json);
        drop_from(&mut self.asset.json, "images", images);
        let mut index = 0..;
        self.asset.images.retain(|_| index.next().is_some_and(|index| !images.contains(&index)));
        self.free_views.extend(freed(&self.asset, &before));
    }

    /// Adds vertex data. Elements are padded to four bytes, as glTF 2.0 §3.6.2.4 asks.
    pub(crate) fn add_vertices(&mut self, elements: &Elements, bounds: bool) -> usize {
        let (bytes, stride) = aligned(elements);
        let view = self.add_view(&bytes, Target::Vertices, stride);
        self.add_elements(view, elements, bounds)
    }

    /// Adds the bytes of vertex data for several accessors: such a view has to name its stride.
    pub(crate) fn add_shared_view(&mut self, elements: &Elements) -> usize {
        let (bytes, stride) = aligned(elements);
        self.add_view(&bytes, Target::Vertices, stride.or(Some(elements.size())))
    }

    /// Adds the elements at the start of a view.
    pub(crate) fn add_elements(&mut self, view: usize, elements: &Elements, bounds: bool) -> usize {
        let mut accessor = json!({
            "bufferView": view,
            "componentType": elements.component.as_gl_enum(),
            "count": elements.count(),
            "type": type_name(elements.components),
        });
        if elements.normalized {
            accessor["normalized"] = json!(true);
        }
        if bounds {
            let (low, high) = self::bounds(elements);
            let is_float = elements.component == ComponentType::F32;
            let told = |bound: Vec<f32>| match is_float {
                true => json!(bound),
                false => bound.into_iter().map(|x| x as i64).collect(),
            };
            accessor["min"] = told(low);
            accessor["max"] = told(high);
        }
        self.add_accessor(accessor)
    }

    /// Adds indices, in 16 bits where they fit; 65,535 itself restarts a primitive.
    pub(crate) fn add_indices(&mut self, indices: &[u32]) -> usize {
        let most = indices.iter().copied().max().unwrap_or_default();
        let size = index_size(most);
        let mut bytes = Vec::with_capacity(size * indices.len());
        let write = |index: &u32| bytes.extend_from_slice(&index.to_le_bytes()[..size]);
        indices.iter().for_each(write);
        let component = if size == 2 { ComponentType::U16 } else { ComponentType::U32 };
        let view = self.add_view(&bytes, Target::Indices, None);
        self.add_accessor(json!({
            "bufferView": view,
            "componentType": component.as_gl_enum(),
            "count": indices.len(),
            "type": "SCALAR",
        }))
    }

    fn add_accessor(&mut self, accessor: Value) -> usize {
        put(&mut self.asset.json, "accessors", self.free_accessors.pop(), accessor)
    }

    fn add_view(&mut self, bytes: &[u8], target: Target, stride: Option<usize>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({
            "buffer": self.asset.buffers.len(),
            "byteOffset": self.bytes.len(),
            "byteLength": bytes.len(),
        });
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        view["target"] = json!(match target {
            Target::Vertices => 34962,
            Target::Indices => 34963,
        });
        self.bytes.extend_from_slice(bytes);
        put(&mut self.asset.json, "bufferViews", self.free_views.pop(), view)
    }

    /// The changed asset, with the new bytes as its last buffer.
    pub(crate) fn finish(mut self) -> Asset {
        trim(&mut self.asset.json, "accessors", &mut self.free_accessors);
        trim(&mut self.asset.json, "bufferViews", &mut self.free_views);
        for slot in self.free_views {
            let start = self.bytes.len().next_multiple_of(4);
            self.bytes.resize(start + 4, 0);
            self.asset.json["bufferViews"][slot] = json!({
                "buffer": self.asset.buffers.len(), "byteOffset": start, "byteLength": 4,
            });
        }
        if !self.bytes.is_empty() {
            let length = self.bytes.len();
            put(&mut self.asset.json, "buffers", None, json!({"byteLength": length}));
            self.asset.buffers.push(self.bytes.into());
        }
        quantization::list_if_needed(&mut self.asset.json);
        self.asset
    }
}

/// Bytes of each index where this is the greatest.
pub(crate) fn index_size(most: u32) -> usize {
    if most < 65_535 { 2 } else { 4 }
}

/// Vertex data as it is stored, elements padded to four bytes; with the stride if there is one.
pub(crate) fn aligned(elements: &Elements) -> (Cow<'_, [u8]>, Option<usize>) {
    let size = elements.size();
    let stride = size.next_multiple_of(4);
    if stride == size {
        return (Cow::Borrowed(&elements.bytes), None);
    }
    let pad = |element: &[u8]| [element, &[0; 3][..stride - size]].concat();
    (elements.bytes.chunks_exact(size).flat_map(pad).collect(), Some(stride))
}

/// The buffer views that are there, were used and are not any more.
fn freed(asset: &Asset, before: &BTreeSet<usize>) -> Vec<usize> {
    let count = asset.count("bufferViews");
    before.difference(&used_views(&asset.json)).copied().filter(|&view| view < count).collect()
}

/// An accessor that needs no bytes.
fn empty_accessor() -> Value {
    json!({"componentType": 5121, "count": 1, "type": "SCALAR"})
}

/// Puts an object into a free slot of a list, or at its end.
pub(crate) fn put(json: &mut Value, list: &str, slot: Option<usize>, object: Value) -> usize {
    let list = &mut json[list];
    if list.is_null() {
        *list = json!([]);
    }
    let list = list.as_array_mut().expect("the lists of a document that was read are lists");
    match slot {
        Some(slot) => {
            list[slot] = object;
            slot
        }
        None => {
            list.push(object);
            list.len() - 1
        }
    }
}

/// Cuts free slots off the end of a list.
fn trim(json: &mut Value, name: &str, free: &mut Vec<usize>) {
    let Some(list) = json.get_mut(name).and_then(Value::as_array_mut) else {
        return;
    };
    while let Some(position) = free.iter().position(|&slot| slot + 1 == list.len()) {
        free.remove(position);
        list.pop();
    }
    if list.is_empty()
        && let Some(document) = json.as_object_mut()
    {
        document.shift_remove(name);
    }
}

fn type_name(components: usize) -> &'static str {
    ["SCALAR", "VEC2", "VEC3", "VEC4"][components - 1]
}

/// Least and greatest value of each component, of floats as they are stored.
pub(crate) fn bounds(elements: &Elements) -> (Vec<f32>, Vec<f32>) {
    let mut low = vec![f32::INFINITY; elements.components];
    let mut high = vec![f32::NEG_INFINITY; elements.components];
    for element in elements.stored_floats().chunks_exact(elements.components) {
        for (component, &x) in element.iter().enumerate() {
            low[component] = low[component].min(x);
            high[component] = high[component].max(x);
        }
    }
    (low, high)
}

/// Drops entries of a list, and a list that is empty then.
pub(crate) fn drop_from(json: &mut Value, name: &str, gone: &BTreeSet<usize>) {
    let Some(list) = json.get_mut(name).and_then(Value::as_array_mut) else { return };
    let mut index = 0..;
    list.retain(|_| index.next().is_some_and(|index| !gone.contains(&index)));
    if list.is_empty()
        && let Some(document) = json.as_object_mut()
    {
        document.shift_remove(name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::accessor;
    use crate::export::glb::join_buffers;
    use crate::image_file::encoded::ImageFormat;

    fn floats(values: &[f32], components: usize) -> Elements {
        Elements {
            bytes: values.iter().flat_map(|x| x.to_le_bytes()).collect(),
            component: ComponentType::F32,
            components,
            normalized: false,
        }
    }

    fn asset() -> Asset {
        Asset {
            json: json!({
                "accessors": [
                    {"bufferView": 0, "componentType": 5121, "count": 2, "type": "SCALAR"},
                    {"bufferView": 1, "componentType": 5121, "count": 2, "type": "SCALAR"},
                ],
                "bufferViews": [
                    {"buffer": 0, "byteLength": 2},
                    {"buffer": 0, "byteLength": 2, "byteOffset": 2},
                ],
                "buffers": [{"byteLength": 4}],
                "images": [{"uri": "a.png"}],
            }),
            buffers: vec![vec![1, 2, 3, 4].into()],
            images: vec![EncodedImage { bytes: vec![9].into(), format: ImageFormat::Png }],
            ..Asset::default()
        }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let mut packer = Packer::new(&asset(), &[0]);
        let positions = floats(&[0.0, 1.0, 2.0, -3.0, 4.0, 5.0], 3);
        let first = packer.add_vertices(&positions, true);
        let second = packer.add_indices(&[0, 70_000]);
        assert_eq!((first, second), (0, 2), "the free slot first, then the end");
        let joined = join_buffers(&packer.finish(), None).unwrap();
        assert_eq!(accessor::read(&joined, 0, "").unwrap(), positions);
        assert_eq!(joined.json["accessors"][0]["min"], json!([-3.0, 1.0, 2.0]));
        assert_eq!(accessor::read(&joined, 1, "").unwrap().bytes, [3, 4], "untouched");
        assert_eq!(accessor::read(&joined, 2, "").unwrap().indices("").unwrap(), [0, 70_000]);
        assert_eq!(joined.buffers.len(), 1);
        assert!(joined.json["images"][0].get("uri").is_none());
    }

    #[test]
    fn small_indices_take_two_bytes_and_small_elements_are_padded() {
        let mut packer = Packer::new(&asset(), &[]);
        let indices = packer.add_indices(&[0, 65_534]);
        let color = Elements {
            bytes: vec![1, 2, 3, 4, 5, 6],
            component: ComponentType::U8,
            components: 3,
            normalized: true,
        };
        let colors = packer.add_vertices(&color, false);
        let joined = join_buffers(&packer.finish(), None).unwrap();
        assert_eq!(joined.json["accessors"][indices]["componentType"], 5123);
        assert_eq!(accessor::read(&joined, colors, "").unwrap(), color);
        let view = joined.json["accessors"][colors]["bufferView"].as_u64().unwrap() as usize;
        assert_eq!(joined.json["bufferViews"][view]["byteStride"], 4);
    }

    #[test]
    fn a_view_that_is_not_there_is_no_slot() {
        let mut asset = asset();
        asset.json["accessors"][0]["bufferView"] = json!(90);
        let mut packer = Packer::new(&asset, &[0]);
        packer.add_indices(&[0, 1, 2]);
        assert_eq!(packer.finish().count("bufferViews"), 3);
    }

    #[test]
    fn slots_left_over_are_cut_off_or_emptied() {
        let cut = Packer::new(&asset(), &[1]).finish();
        assert_eq!((cut.count("accessors"), cut.count("bufferViews")), (1, 1));
        let emptied = Packer::new(&asset(), &[0]).finish();
        assert_eq!(emptied.json["accessors"][0].get("bufferView"), None);
        assert_eq!(join_buffers(&emptied, None).unwrap().buffers[0].len(), 4 + 4 + 4 - 3 - 4 + 4);
    }
}
