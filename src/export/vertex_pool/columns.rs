//! The attributes of vertices as columns, and the keys that tell vertices apart.

use gltf::json::accessor::ComponentType;

use crate::document::accessor::{self, Elements, Named};
use crate::document::asset::Asset;
use crate::document::primitive::{Attributes, Primitive};
use crate::error::Result;
use crate::level::part::LevelPart;

/// Columns of vertex data: the attributes, and those of each morph target.
pub(super) struct Columns {
    pub(super) attributes: Vec<Named>,
    pub(super) targets: Vec<Vec<Named>>,
}

impl Columns {
    pub(super) fn of_source(asset: &Asset, primitive: &Primitive) -> Result<Self> {
        let read = |attributes: &Attributes| -> Result<Vec<Named>> {
            let read = |(name, accessor): &(String, usize)| {
                Ok((name.clone(), accessor::read(asset, *accessor, &primitive.at)?))
            };
            attributes.iter().map(read).collect()
        };
        let targets = primitive.targets.iter().map(read).collect::<Result<_>>()?;
        Ok(Self { attributes: read(&primitive.attributes)?, targets })
    }

    /// A level's, as the source stores them; none if it carries something else.
    pub(super) fn of_level(&self, part: &LevelPart) -> Option<Self> {
        let alike = |own: &[Named], other: &[Named]| -> Option<Vec<Named>> {
            let find = |(name, as_stored): &Named| {
                let (_, found) = other.iter().find(|(other, _)| other == name)?;
                Some((name.clone(), stored_as(found, as_stored)?))
            };
            (own.len() == other.len()).then(|| own.iter().map(find).collect())?
        };
        let targets = self.targets.iter().zip(&part.targets);
        let targets = targets.map(|(own, other)| alike(own, other)).collect::<Option<_>>()?;
        let own = Self { attributes: alike(&self.attributes, &part.attributes)?, targets };
        (self.targets.len() == part.targets.len()).then_some(own)
    }

    pub(super) fn all(&self) -> impl Iterator<Item = &Named> {
        self.attributes.iter().chain(self.targets.iter().flatten())
    }

    pub(super) fn count(&self) -> usize {
        self.attributes.first().map_or(0, |(_, elements)| elements.count())
    }

    /// Bytes of one vertex.
    pub(super) fn size(&self) -> usize {
        self.all().map(|(_, elements)| elements.size().next_multiple_of(4)).sum()
    }

    /// The key of a vertex: all its attributes but for normal and tangent.
    pub(super) fn key(&self, vertex: usize) -> Vec<u8> {
        let directions = ["NORMAL", "TANGENT"];
        let told = self.attributes.iter().filter(|(name, _)| !directions.contains(&name.as_str()));
        let mut key = Vec::new();
        for (_, elements) in told.chain(self.targets.iter().flatten()) {
            let element = elements.element(vertex);
            if elements.component == ComponentType::F32 {
                let words = element.as_chunks::<4>().0.iter();
                let plain = |&word: &[u8; 4]| if word == [0, 0, 0, 0x80] { [0; 4] } else { word };
                key.extend(words.flat_map(plain));
            } else {
                key.extend_from_slice(element);
            }
        }
        key
    }

    pub(super) fn row(&self, name: &str, vertex: usize) -> Option<Vec<f32>> {
        let (_, elements) = self.attributes.iter().find(|(own, _)| own == name)?;
        Some(elements.row(vertex))
    }

    pub(super) fn append(&mut self, other: &Self, vertex: usize) {
        let own = self.attributes.iter_mut().chain(self.targets.iter_mut().flatten());
        for ((_, elements), (_, added)) in own.zip(other.all()) {
            elements.bytes.extend_from_slice(added.element(vertex));
        }
    }

    pub(super) fn reordered(self, order: &[u32]) -> Self {
        let reorder = |named: Vec<Named>| -> Vec<Named> {
            let reorder = |(name, elements): Named| {
                let rows = order.iter().flat_map(|&old| elements.element(old as usize));
                let bytes = rows.copied().collect();
                (name, Elements { bytes, ..elements })
            };
            named.into_iter().map(reorder).collect()
        };
        let targets = self.targets.into_iter().map(reorder).collect();
        Self { attributes: reorder(self.attributes), targets }
    }
}

/// Elements in the type of others, if they have as many components.
fn stored_as(elements: &Elements, other: &Elements) -> Option<Elements> {
    if elements.shape() == other.shape() {
        return Some(elements.clone());
    }
    let mut own = Elements { bytes: Vec::new(), ..*other };
    own.bytes = own.encode(elements.floats());
    (elements.components == other.components).then_some(own)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn elements(component: ComponentType, values: &[f32], components: usize) -> Elements {
        let normalized = component != ComponentType::F32;
        let mut own = Elements { bytes: Vec::new(), component, components, normalized };
        own.bytes = own.encode(values.iter().copied());
        own
    }

    #[test]
    fn a_level_is_read_as_its_source_stores_it() {
        let floats = |values: &[f32], n| elements(ComponentType::F32, values, n);
        let named = |name: &str, own| (name.to_owned(), own);
        let source = Columns {
            attributes: vec![
                named("POSITION", floats(&[0.0, 1.0, 2.0], 3)),
                named("TEXCOORD_0", elements(ComponentType::U16, &[0.25, 1.0], 2)),
            ],
            targets: Vec::new(),
        };
        let part = |attributes| LevelPart { indices: vec![0; 3], attributes, targets: Vec::new() };
        let uv = source.attributes[1].1.floats();
        let own = part(vec![
            named("TEXCOORD_0", floats(&uv, 2)),
            named("POSITION", floats(&[-0.0, 1.0, 2.0], 3)),
        ]);
        let read = source.of_level(&own).expect("the same attributes");
        assert_eq!(read.attributes[1], source.attributes[1]);
        assert_eq!(read.key(0), source.key(0), "a zero has no sign");
        let short = part(vec![named("POSITION", floats(&[0.0, 1.0, 2.0], 3))]);
        assert!(source.of_level(&short).is_none(), "an attribute is missing");
        let mut more = own;
        more.targets.push(Vec::new());
        assert!(source.of_level(&more).is_none(), "a morph target too many");
    }
}
