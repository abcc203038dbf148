//! A primitive of a glTF mesh, as the document describes it.

use gltf::json;
use serde_json::Value;

use glam::Vec3;

use super::accessor::{self, Elements};
use super::asset::Asset;
use crate::error::{Error, Result};

/// Attribute names and their accessors, in the order of the document.
pub type Attributes = Vec<(String, usize)>;

/// A primitive.
#[derive(Clone, Debug)]
pub struct Primitive {
    /// Its JSON pointer.
    pub at: String,
    /// Its mesh.
    pub mesh: usize,
    /// Its place among the primitives of its mesh.
    pub index: usize,
    /// Its attributes.
    pub attributes: Attributes,
    /// Its morph targets.
    pub targets: Vec<Attributes>,
    /// Its index accessor.
    pub indices: Option<usize>,
    /// Its material.
    pub material: Option<usize>,
    mode: u64,
}

impl Primitive {
    /// The primitives of a mesh.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the mesh or one of its references is malformed.
    pub fn of_mesh(asset: &Asset, mesh: usize) -> Result<Vec<Self>> {
        let at = format!("/meshes/{mesh}/primitives");
        let list = asset.json.pointer(&at).and_then(Value::as_array);
        let list = list.ok_or_else(|| Error::invalid(&at, "there are none"))?;
        (0..list.len()).map(|index| Self::parse(asset, &at, [mesh, index])).collect()
    }

    fn parse(asset: &Asset, list: &str, [mesh, index]: [usize; 2]) -> Result<Self> {
        let at = format!("{list}/{index}");
        let json = asset.json.pointer(&at).unwrap_or(&Value::Null);
        let targets = json.get("targets").and_then(Value::as_array).map_or(0, Vec::len);
        let mode = json.get("mode").map_or(Some(4), Value::as_u64).filter(|&mode| mode < 7);
        Ok(Self {
            mesh,
            index,
            attributes: attributes(asset, &format!("{at}/attributes"))?,
            targets: (0..targets)
                .map(|target| attributes(asset, &format!("{at}/targets/{target}")))
                .collect::<Result<_>>()?,
            indices: asset.reference(&at, "indices", "accessors")?,
            material: asset.reference(&at, "material", "materials")?,
            mode: mode.ok_or_else(|| Error::invalid(format!("{at}/mode"), "unknown mode"))?,
            at,
        })
    }

    /// Whether it is made of triangles; points and lines pass through untouched.
    pub fn is_surface(&self) -> bool {
        self.mode >= u64::from(json::mesh::TRIANGLES) && self.accessor("POSITION").is_some()
    }

    /// The accessor of an attribute.
    pub fn accessor(&self, name: &str) -> Option<usize> {
        self.attributes.iter().find(|(own, _)| own == name).map(|&(_, accessor)| accessor)
    }

    /// Reads an attribute, if it is there: as many elements as there are positions.
    ///
    /// # Errors
    /// [`Error::Invalid`] if its accessor is malformed or of another length.
    pub fn elements(&self, asset: &Asset, name: &str, count: usize) -> Result<Option<Elements>> {
        let Some(index) = self.accessor(name) else {
            return Ok(None);
        };
        read_checked(asset, index, &format!("{}/attributes/{name}", self.at), count).map(Some)
    }

    /// Reads an attribute as rows of `components` floats, if it is there.
    ///
    /// # Errors
    /// [`Error::Invalid`] if its accessor is malformed or of another shape or length.
    pub fn floats(
        &self,
        asset: &Asset,
        name: &str,
        components: usize,
        count: usize,
    ) -> Result<Option<Vec<f32>>> {
        let Some(elements) = self.elements(asset, name, count)? else {
            return Ok(None);
        };
        if elements.components != components {
            let what = format!("{} components, not {components}", elements.components);
            return Err(Error::invalid(format!("{}/attributes/{name}", self.at), what));
        }
        Ok(Some(elements.floats()))
    }

    /// Reads the positions; empty if there are none.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the accessor is malformed or a position is not finite.
    pub fn positions(&self, asset: &Asset) -> Result<Vec<Vec3>> {
        let Some(index) = self.accessor("POSITION") else {
            return Ok(Vec::new());
        };
        let at = format!("{}/attributes/POSITION", self.at);
        let elements = accessor::read(asset, index, &at)?;
        if elements.components != 3 {
            return Err(Error::invalid(at, "positions must have three components"));
        }
        let positions: Vec<Vec3> =
            elements.floats().as_chunks().0.iter().map(|&p| Vec3::from_array(p)).collect();
        match positions.iter().position(|p| !p.is_finite()) {
            Some(vertex) => Err(Error::invalid(at, format!("vertex {vertex} is not finite"))),
            None => Ok(positions),
        }
    }

    /// Reads the triangles, strips and fans unrolled; triangles of a strip that name a vertex
    /// twice, as its joints do, are left out.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the indices are malformed or name a vertex past the end.
    pub fn triangles(&self, asset: &Asset, vertices: usize) -> Result<Vec<[u32; 3]>> {
        let at = format!("{}/indices", self.at);
        let indices = match self.indices {
            Some(index) => accessor::read(asset, index, &at)?.indices(&at)?,
            None => (0..vertices as u32).collect(),
        };
        if let Some(index) = indices.iter().find(|&&index| index as usize >= vertices) {
            return Err(Error::invalid(at, format!("index {index} of {vertices} vertices")));
        }
        let distinct = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
        Ok(match u32::try_from(self.mode).unwrap_or_default() {
            json::mesh::TRIANGLE_STRIP => indices
                .windows(3)
                .enumerate()
                .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] })
                .filter(distinct)
                .collect(),
            json::mesh::TRIANGLE_FAN => indices
                .windows(2)
                .skip(1)
                .map(|w| [w[0], w[1], indices[0]])
                .filter(distinct)
                .collect(),
            _ => indices.as_chunks().0.to_vec(),
        })
    }
}

fn attributes(asset: &Asset, at: &str) -> Result<Attributes> {
    let Some(json) = asset.json.pointer(at) else {
        return Ok(Vec::new());
    };
    let names = json.as_object().ok_or_else(|| Error::invalid(at, "not an object"))?;
    names
        .keys()
        .map(|name| {
            let accessor = asset.reference(at, name, "accessors")?;
            accessor
                .map(|accessor| (name.clone(), accessor))
                .ok_or_else(|| Error::invalid(format!("{at}/{name}"), "no accessor"))
        })
        .collect()
}

/// Reads an accessor that must hold `count` elements.
///
/// # Errors
/// [`Error::Invalid`] if it is malformed or of another length.
pub fn read_checked(asset: &Asset, index: usize, at: &str, count: usize) -> Result<Elements> {
    let elements = accessor::read(asset, index, at)?;
    if elements.count() != count {
        let what = format!("{} elements for {count} vertices", elements.count());
        return Err(Error::invalid(at, what));
    }
    Ok(elements)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn triangles(mode: u32, indices: &[u8]) -> Result<Vec<[u32; 3]>> {
        let asset = Asset {
            json: json!({
                "meshes": [{"primitives": [{"attributes": {}, "indices": 0, "mode": mode}]}],
                "accessors": [{"bufferView": 0, "componentType": 5121, "count": indices.len(),
                    "type": "SCALAR"}],
                "bufferViews": [{"buffer": 0, "byteLength": indices.len()}],
            }),
            buffers: vec![indices.to_vec().into()],
            ..Asset::default()
        };
        Primitive::of_mesh(&asset, 0)?[0].triangles(&asset, 5)
    }

    #[test]
    fn strips_and_fans_unroll_with_their_winding() {
        assert_eq!(triangles(4, &[0, 1, 2, 2, 1, 3]).unwrap(), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(triangles(5, &[0, 1, 2, 3]).unwrap(), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(triangles(6, &[0, 1, 2, 3]).unwrap(), [[1, 2, 0], [2, 3, 0]]);
    }

    #[test]
    fn the_joint_of_two_strips_leaves_nothing() {
        assert_eq!(triangles(5, &[0, 1, 2, 2, 3, 3, 4, 0]).unwrap(), [[0, 1, 2], [4, 3, 0]]);
    }

    #[test]
    fn a_wrong_index_or_mode_is_named() {
        let error = triangles(4, &[0, 1, 5]).unwrap_err().to_string();
        assert!(error.starts_with("/meshes/0/primitives/0/indices"), "{error}");
        assert!(triangles(9, &[0, 1, 2]).is_err());
    }
}
