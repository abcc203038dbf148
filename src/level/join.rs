//! Parts of a level's mesh as one primitive.

use rustc_hash::FxHashMap;

use super::part::LevelPart;
use super::textures::PartTextures;
use crate::document::accessor::{Elements, Named};

/// Appends parts to the first of the same number that has triangles.
pub(crate) fn join_parts(parts: &mut [Option<LevelPart>], textures: &[PartTextures]) {
    let mut firsts: FxHashMap<usize, usize> = FxHashMap::default();
    for (index, own) in textures.iter().enumerate() {
        let Some(join) = own.join.filter(|_| parts[index].is_some()) else { continue };
        let first = *firsts.entry(join).or_insert(index);
        if first == index {
            continue;
        }
        if let (Some(mut own), Some(first)) = (parts[index].take(), parts[first].as_mut()) {
            append(first, &mut own);
        }
    }
}

fn append(first: &mut LevelPart, own: &mut LevelPart) {
    let [before, more] = [&*first, &*own].map(vertices);
    whiten(&mut first.attributes, &own.attributes, before);
    whiten(&mut own.attributes, &first.attributes, more);
    first.indices.extend(own.indices.iter().map(|index| index + before as u32));
    extend(&mut first.attributes, &own.attributes);
    for (first, own) in first.targets.iter_mut().zip(&own.targets) {
        extend(first, own);
    }
}

fn vertices(part: &LevelPart) -> usize {
    part.attributes.first().map_or(0, |(_, elements)| elements.count())
}

/// Adds white colors for so many vertices where only the other part has some.
fn whiten(attributes: &mut Vec<Named>, others: &[Named], count: usize) {
    for (name, other) in others {
        if !attributes.iter().any(|(own, _)| own == name) {
            let white = other.encode(std::iter::repeat_n(1.0, count * other.components));
            attributes.push((name.clone(), Elements { bytes: white, ..*other }));
        }
    }
}

fn extend(first: &mut [Named], own: &[Named]) {
    for (name, elements) in first {
        let more = own.iter().find(|(own, _)| own == name);
        elements.bytes.extend(more.into_iter().flat_map(|(_, more)| &more.bytes));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gltf::json::accessor::ComponentType;

    fn elements(bytes: &[u8], components: usize) -> Elements {
        let (bytes, component) = (bytes.to_vec(), ComponentType::U8);
        Elements { bytes, component, components, normalized: true }
    }

    fn part(attributes: &[(&str, Elements)]) -> Option<LevelPart> {
        let attributes = attributes.iter().map(|(name, own)| ((*name).to_owned(), own.clone()));
        let targets = vec![vec![("POSITION".to_owned(), elements(&[7, 8, 9], 3))]];
        Some(LevelPart { indices: vec![0, 0, 0], attributes: attributes.collect(), targets })
    }

    #[test]
    fn the_second_part_follows_the_first_with_its_attributes_by_name_and_white_where_it_lacks_colors()
     {
        let position = |value: u8| ("POSITION", elements(&[value; 3], 3));
        let color = ("COLOR_0", elements(&[1, 2, 3, 4], 4));
        let mut parts = [
            None,
            part(&[position(1), ("NORMAL", elements(&[2; 3], 3))]),
            part(&[position(5)]),
            part(&[("NORMAL", elements(&[4; 3], 3)), position(3), color]),
        ];
        let textures = [Some(0), Some(0), None, Some(0)]
            .map(|join| PartTextures { join, ..PartTextures::default() });
        join_parts(&mut parts, &textures);
        assert!(parts[0].is_none() && parts[2].is_some() && parts[3].is_none());
        let joined = parts[1].as_ref().unwrap();
        assert_eq!(joined.indices, [0, 0, 0, 1, 1, 1]);
        let bytes: Vec<&[u8]> = joined.attributes.iter().map(|(_, own)| &own.bytes[..]).collect();
        let expected: [&[u8]; 3] =
            [&[1, 1, 1, 3, 3, 3], &[2, 2, 2, 4, 4, 4], &[255, 255, 255, 255, 1, 2, 3, 4]];
        assert_eq!(bytes, expected);
        assert_eq!(joined.targets[0][0].1.bytes, [7, 8, 9, 7, 8, 9]);
    }
}
