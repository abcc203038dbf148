//! What the document says of its splits: the extension as JSON.

use gltf::json::accessor::ComponentType;
use seamwise_attr::Layout;
use serde::{Deserialize, Serialize};

use super::format::{EXTENSION, VERSION};
use super::script::ROWS;
use super::values::{COLUMNS, Coding};
use crate::error::{Error, Result};

/// Most bytes of all that a vertex carries.
const MAX_CARRIED: usize = 1 << 16;

/// The extension of the document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Header {
    pub(super) version: u32,
    pub(super) buffer_view: usize,
    /// Triangles of the coarsest level and of the source, in meshes each once.
    pub(super) triangles: [u64; 2],
    /// Splits from there to the source.
    pub(super) splits: u64,
    /// The error of the coarsest level.
    pub(super) error: f32,
    pub(super) surfaces: Vec<SurfaceHeader>,
}

/// A surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SurfaceHeader {
    /// UV sets in a row, whether it has a normal, and channels of color.
    pub(super) uv_sets: usize,
    pub(super) normal: bool,
    pub(super) color: usize,
    /// Steps of positions and of each float of a row, and the grids of the source's; 0 for none.
    pub(super) position: CodingHeader,
    pub(super) row: Vec<CodingHeader>,
    pub(super) parts: Vec<PartHeader>,
}

/// The coding of a kind of values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct CodingHeader {
    pub(super) step: f32,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(super) grid: f32,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_zero(x: &f32) -> bool {
    *x == 0.0
}

/// A group of a surface: a primitive of the document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct PartHeader {
    pub(super) mesh: usize,
    pub(super) primitive: usize,
    pub(super) attributes: Vec<AttributeHeader>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) targets: Vec<Vec<AttributeHeader>>,
    /// The way from the surface to the mesh, where they are in two spaces: the columns of a matrix.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) matrix: Option<[f64; 16]>,
}

/// An attribute of a primitive.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct AttributeHeader {
    pub(super) name: String,
    pub(super) component_type: u32,
    pub(super) components: usize,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(super) normalized: bool,
}

/// The form of a surface's values.
#[derive(Clone, Debug)]
pub(super) struct Form {
    pub(super) layout: Layout,
    pub(super) position: Coding,
    pub(super) row: Vec<Coding>,
    /// Bytes that each vertex of a part carries, and the first of their columns.
    pub(super) strides: Vec<usize>,
    pub(super) carried: Vec<usize>,
}

impl Header {
    /// Forms of all surfaces, and the number of columns.
    pub(super) fn forms(&self) -> (Vec<Form>, usize) {
        let width = self.surfaces.iter().map(|own| own.row.len()).max().unwrap_or(0);
        let mut columns = ROWS + width * COLUMNS;
        let coding = |own: &CodingHeader| Coding { step: own.step, grid: own.grid };
        let forms = self.surfaces.iter().map(|own| {
            let strides: Vec<usize> = own.parts.iter().map(|part| part.carried(own)).collect();
            let carried = strides.iter().map(|stride| {
                columns += stride;
                columns - stride
            });
            Form {
                layout: own.layout(),
                position: coding(&own.position),
                row: own.row.iter().map(coding).collect(),
                carried: carried.collect(),
                strides,
            }
        });
        (forms.collect(), columns)
    }

    /// Makes sure that it makes sense.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the place in the document.
    pub(super) fn check(&self) -> Result<()> {
        let invalid = |at: &str, what: &str| {
            Err(Error::invalid(format!("/extensions/{EXTENSION}/{at}"), what))
        };
        if self.version != VERSION {
            let what = format!("splits of version {}, and {VERSION} is known", self.version);
            return Err(Error::Unsupported { what });
        }
        let mut carried = 0;
        for (index, own) in self.surfaces.iter().enumerate() {
            let at = format!("surfaces/{index}");
            let codings = own.row.iter().chain([&own.position]);
            let is_sound = |own: &CodingHeader| {
                own.step.is_finite() && own.step > 0.0 && own.grid.is_finite() && own.grid >= 0.0
            };
            if own.uv_sets > 8 || !matches!(own.color, 0 | 3 | 4) {
                return invalid(&at, "a row of attributes that can't be");
            }
            if own.row.len() != own.layout().len() || !codings.clone().all(is_sound) {
                return invalid(&at, "steps that do not fit the row");
            }
            for part in &own.parts {
                for attribute in part.all() {
                    let components = match attribute.name.as_str() {
                        _ if !own.is_made(&attribute.name) => attribute.components,
                        "POSITION" | "NORMAL" => 3,
                        "COLOR_0" => attribute.components.clamp(3, own.color.max(3)),
                        _ => 2,
                    };
                    if attribute.components != components {
                        return invalid(&at, "an attribute of an unknown shape");
                    }
                    if attribute.component().is_none() || !(1..=16).contains(&attribute.components)
                    {
                        return invalid(&at, "an attribute of an unknown type");
                    }
                }
                carried += part.carried(own);
            }
        }
        if carried > MAX_CARRIED {
            return invalid("surfaces", "too many attributes");
        }
        Ok(())
    }
}

impl SurfaceHeader {
    pub(super) fn layout(&self) -> Layout {
        Layout { uv_sets: self.uv_sets, normal: self.normal, color: self.color }
    }

    /// Whether an attribute is made of a row or a position.
    pub(super) fn is_made(&self, name: &str) -> bool {
        match name.strip_prefix("TEXCOORD_").map(str::parse::<usize>) {
            Some(Ok(set)) => set < self.uv_sets,
            _ => match name {
                "POSITION" => true,
                "NORMAL" => self.normal,
                "COLOR_0" => self.color > 0,
                _ => false,
            },
        }
    }
}

impl PartHeader {
    /// All attributes, those of morph targets last.
    pub(super) fn all(&self) -> impl Iterator<Item = &AttributeHeader> {
        self.attributes.iter().chain(self.targets.iter().flatten())
    }

    /// Those that vertices carry as they are.
    pub(super) fn carried_of<'a>(
        &'a self,
        surface: &'a SurfaceHeader,
    ) -> impl Iterator<Item = &'a AttributeHeader> {
        let own = self.attributes.iter().filter(|own| !surface.is_made(&own.name));
        own.chain(self.targets.iter().flatten())
    }

    fn carried(&self, surface: &SurfaceHeader) -> usize {
        self.carried_of(surface).map(AttributeHeader::size).sum()
    }
}

impl AttributeHeader {
    pub(super) fn component(&self) -> Option<ComponentType> {
        Some(match self.component_type {
            5120 => ComponentType::I8,
            5121 => ComponentType::U8,
            5122 => ComponentType::I16,
            5123 => ComponentType::U16,
            5125 => ComponentType::U32,
            5126 => ComponentType::F32,
            _ => return None,
        })
    }

    /// Bytes of an element.
    pub(super) fn size(&self) -> usize {
        self.components * self.component().map_or(0, |component| component.size())
    }
}
