//! A surface as primitives.

use glam::{DMat4, DVec3, Vec3};
use gltf::json::accessor::ComponentType;

use super::header::{AttributeHeader, PartHeader, SurfaceHeader};
use super::surface::Surface;
use super::whole::WholePart;
use crate::document::accessor::{Elements, Named};
use crate::level::part::LevelPart;

/// The primitives of a surface as it is, one per part. `whole` is what they are beyond it if it is the
/// source, or empty. A part without a triangle has one without area, since the primitive stays.
pub(super) fn parts(
    surface: &Surface,
    header: &SurfaceHeader,
    whole: &[WholePart],
) -> Vec<LevelPart> {
    let mut drawn: Vec<Drawn> = header.parts.iter().map(|_| Drawn::default()).collect();
    let mut vertices = vec![u32::MAX; surface.wedge_points.len()];
    for triangle in &surface.triangles {
        let own = &mut drawn[surface.wedge_groups[triangle[0] as usize] as usize];
        for &wedge in triangle {
            let vertex = &mut vertices[wedge as usize];
            if *vertex == u32::MAX {
                *vertex = own.wedges.len() as u32;
                own.wedges.push(wedge);
            }
            own.indices.push(*vertex);
        }
    }
    let all = header.parts.iter().zip(drawn).enumerate();
    all.map(|(group, (part, own))| {
        let whole = whole.get(group);
        let made = own.make(surface, (header, part), whole);
        if made.indices.is_empty() { placeholder(surface, (header, part)) } else { made }
    })
    .collect()
}

/// The wedges and triangles of a part.
#[derive(Default)]
struct Drawn {
    wedges: Vec<u32>,
    indices: Vec<u32>,
}

impl Drawn {
    fn make(
        self,
        surface: &Surface,
        (header, part): (&SurfaceHeader, &PartHeader),
        whole: Option<&WholePart>,
    ) -> LevelPart {
        let Self { wedges, mut indices } = self;
        let matrix = part.matrix.map(|columns| DMat4::from_cols_array(&columns));
        let mut at = 0;
        let mut elements = |own: &AttributeHeader, is_made: bool| {
            let mut elements = if is_made {
                made(surface, &wedges, own, matrix.as_ref())
            } else {
                let bytes = wedges.iter().flat_map(|&w| &surface.carried(w)[at..at + own.size()]);
                let bytes = bytes.copied().collect();
                at += own.size();
                typed(own, bytes)
            };
            (own.name.clone(), {
                elements.bytes.shrink_to_fit();
                elements
            })
        };
        let attributes = part.attributes.iter();
        let attributes = attributes.map(|own| elements(own, header.is_made(&own.name)));
        let attributes: Vec<Named> = attributes.collect();
        let target = |own: &Vec<AttributeHeader>| own.iter().map(|a| elements(a, false)).collect();
        let targets: Vec<Vec<Named>> = part.targets.iter().map(target).collect();
        let mut made = LevelPart { indices: Vec::new(), attributes, targets };
        if let Some(whole) = whole {
            whole.apply(&mut made, &mut indices, wedges.len());
        }
        made.indices = indices;
        made
    }
}

/// A triangle without area on the surface.
fn placeholder(surface: &Surface, (header, part): (&SurfaceHeader, &PartHeader)) -> LevelPart {
    let place = surface.positions.first().copied().unwrap_or_default();
    let elements = |own: &AttributeHeader| {
        let values = match own.name.as_str() {
            "POSITION" => place.to_array().to_vec(),
            "NORMAL" => vec![0.0, 0.0, 1.0],
            "TANGENT" => vec![1.0, 0.0, 0.0, 1.0],
            _ => vec![0.0; own.components],
        };
        let one = if header.is_made(&own.name) && own.name != "COLOR_0" {
            floats(3.max(values.len()).min(values.len()), values.into_iter())
        } else {
            let empty = typed(own, Vec::new());
            Elements { bytes: empty.encode(values), ..empty }
        };
        (own.name.clone(), Elements { bytes: one.bytes.repeat(3), ..one })
    };
    LevelPart {
        indices: vec![0, 1, 2],
        attributes: part.attributes.iter().map(elements).collect(),
        targets: part
            .targets
            .iter()
            .map(|target| {
                let zero =
                    |own: &AttributeHeader| (own.name.clone(), typed(own, vec![0; 3 * own.size()]));
                target.iter().map(zero).collect()
            })
            .collect(),
    }
}

/// An attribute that is made of positions and rows.
pub(super) fn made(
    surface: &Surface,
    wedges: &[u32],
    own: &AttributeHeader,
    matrix: Option<&DMat4>,
) -> Elements {
    let layout = surface.layout;
    let rows = |start: usize, count: usize| {
        wedges.iter().flat_map(move |&wedge| surface.row(wedge)[start..start + count].to_vec())
    };
    match own.name.as_str() {
        "POSITION" => {
            let position = |&wedge: &u32| {
                let own = surface.positions[surface.wedge_points[wedge as usize] as usize];
                let moved = |m: &DMat4| m.transform_point3(own.as_dvec3()).as_vec3();
                matrix.map_or(own, moved).to_array()
            };
            floats(3, wedges.iter().flat_map(position))
        }
        "NORMAL" => {
            let turned = |normal: &[f32]| {
                let own = Vec3::from_slice(normal);
                let turned = |m: &DMat4| {
                    let turned = m.transform_vector3(own.as_dvec3());
                    turned.normalize_or(DVec3::Z).as_vec3()
                };
                matrix.map_or(own, turned).to_array()
            };
            let start = layout.normal();
            let normal = |&wedge: &u32| turned(&surface.row(wedge)[start..start + 3]);
            floats(3, wedges.iter().flat_map(normal))
        }
        "COLOR_0" => {
            let empty = typed(own, Vec::new());
            let values = rows(layout.color(), own.components.min(layout.color));
            Elements { bytes: empty.encode(values), ..empty }
        }
        name => {
            let set = name.strip_prefix("TEXCOORD_").and_then(|set| set.parse().ok()).unwrap_or(0);
            floats(2, rows(layout.uv(set), 2))
        }
    }
}

/// Elements of an attribute's own type.
pub(super) fn typed(own: &AttributeHeader, bytes: Vec<u8>) -> Elements {
    let component = own.component().unwrap_or(ComponentType::F32);
    Elements { bytes, component, components: own.components, normalized: own.normalized }
}

fn floats(components: usize, values: impl Iterator<Item = f32>) -> Elements {
    Elements {
        bytes: values.flat_map(f32::to_le_bytes).collect(),
        component: ComponentType::F32,
        components,
        normalized: false,
    }
}
