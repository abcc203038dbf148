//! Parts of a mesh that become one primitive: those that use one merged material, and whose
//! vertices have the same attributes. Colors are white where a part has none.

use std::collections::BTreeSet;

use gltf::json::accessor::ComponentType;
use serde_json::Value;

use super::layout::UvLayout;
use crate::document::accessor::Elements;
use crate::document::asset::Asset;
use crate::surface::geometry::Geometry;
use crate::surface::part::Part;

/// The parts of surfaces that become one primitive.
#[derive(Clone, Debug, Default)]
pub(crate) struct Joins {
    /// One entry per surface and part: parts of the same number become one.
    pub(crate) numbers: Vec<Vec<Option<usize>>>,
    /// Merged materials with a part that finds no match in its mesh, where others do.
    pub(crate) rest: BTreeSet<usize>,
}

/// Name, type and number of components of an attribute.
type Shape = (String, ComponentType, usize, bool);

/// The properties that parts must have in common.
#[derive(Clone, Debug, PartialEq)]
struct Kind {
    layout: usize,
    mesh: usize,
    has_normals: bool,
    carried: Vec<Shape>,
    targets: Vec<Vec<Shape>>,
    /// Extensions, extras and what else the primitive says.
    rest: Value,
}

impl Joins {
    /// Finds the parts that the merged materials of layouts join.
    pub(super) fn new(asset: &Asset, surfaces: &[Geometry], layouts: &[UvLayout]) -> Self {
        let none = |surface: &Geometry| vec![None; surface.parts.len()];
        let mut joins =
            Self { numbers: surfaces.iter().map(none).collect(), rest: BTreeSet::new() };
        let mut kinds: Vec<(Kind, Option<(usize, ComponentType)>)> = Vec::new();
        let merged = layouts.iter().enumerate();
        for (at, layout, merge_group) in
            merged.filter_map(|(at, l)| Some((at, l, l.merge_group.as_ref()?)))
        {
            for (charts, &material) in layout.charts.iter().zip(&merge_group.chart_materials) {
                let part = &surfaces[charts.surface].parts[charts.group as usize];
                let kind = Kind::new(asset, part, at);
                let fits = |(own, color): &(Kind, Option<_>)| {
                    *own == kind
                        && (color.is_none() || part.color.is_none() || *color == part.color)
                };
                let number = kinds.iter().position(fits).unwrap_or_else(|| {
                    if kinds.iter().any(|(own, _)| (own.layout, own.mesh) == (at, kind.mesh)) {
                        joins.rest.insert(material);
                    }
                    kinds.push((kind, None));
                    kinds.len() - 1
                });
                kinds[number].1 = kinds[number].1.or(part.color);
                joins.numbers[charts.surface][charts.group as usize] = Some(number);
            }
        }
        joins
    }
}

impl Kind {
    fn new(asset: &Asset, part: &Part, layout: usize) -> Self {
        let shape = |(name, own): &(String, Elements)| {
            let (component, components, normalized) = own.shape();
            (name.clone(), component, components, normalized)
        };
        let shapes = |named: &[(String, Elements)], left: &str| -> Vec<Shape> {
            let mut shapes: Vec<Shape> =
                named.iter().filter(|(name, _)| !name.starts_with(left)).map(shape).collect();
            shapes.sort_by(|a, b| a.0.cmp(&b.0));
            shapes
        };
        let mut rest = asset.json.pointer(&part.primitive.at).cloned().unwrap_or_default();
        for key in ["attributes", "indices", "targets", "material", "mode"] {
            rest.as_object_mut().map(|own| own.shift_remove(key));
        }
        crate::document::extensions::remove_extension(&mut rest, "KHR_draco_mesh_compression");
        Self {
            layout,
            mesh: part.primitive.mesh,
            has_normals: part.primitive.accessor("NORMAL").is_some(),
            carried: shapes(&part.carried, "TEXCOORD_"),
            targets: part.targets.iter().map(|target| shapes(target, "TANGENT")).collect(),
            rest,
        }
    }
}
