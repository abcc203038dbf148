//! Rows of a PLY's elements, with their properties under all the names in use.

use ply_rs_bw::ply::{ElementDef, Property, PropertyAccess, PropertyAccessResult};

/// A row of an element that is of no use here.
pub(super) struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}

pub(super) struct Vertex {
    pub(super) position: [f64; 3],
    pub(super) normal: [f64; 3],
    pub(super) uv: [f64; 2],
    /// As it is stored: from 0 to 1, or a float beyond; a negative alpha is none.
    pub(super) color: [f32; 4],
}

/// The list of a vertex or a face that a property is a number of, and its place there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slot {
    Position(usize),
    Normal(usize),
    Uv(usize),
    Color(usize),
}

impl Slot {
    fn of(property: &str) -> Option<Self> {
        Some(match property {
            "x" => Self::Position(0),
            "y" => Self::Position(1),
            "z" => Self::Position(2),
            "nx" | "normal_x" => Self::Normal(0),
            "ny" | "normal_y" => Self::Normal(1),
            "nz" | "normal_z" => Self::Normal(2),
            "s" | "u" | "tu" | "tx" | "texture_u" | "texture_s" | "texcoord_u" | "texcoord_s"
            | "tex_u" => Self::Uv(0),
            "t" | "v" | "tv" | "ty" | "texture_v" | "texture_t" | "texcoord_v" | "texcoord_t"
            | "tex_v" => Self::Uv(1),
            "red" | "r" | "diffuse_red" => Self::Color(0),
            "green" | "g" | "diffuse_green" => Self::Color(1),
            "blue" | "b" | "diffuse_blue" => Self::Color(2),
            "alpha" | "a" | "diffuse_alpha" => Self::Color(3),
            name if name.contains(|letter: char| letter.is_ascii_uppercase()) => {
                return Self::of(&name.to_ascii_lowercase());
            }
            _ => return None,
        })
    }
}

/// Which of the lists of a vertex an element has.
pub(super) struct Slots(Vec<Slot>);

impl Slots {
    pub(super) fn of(element: &ElementDef) -> Self {
        Self(element.properties.keys().filter_map(|name| Slot::of(name)).collect())
    }

    /// Whether there are the first so many numbers of a list.
    pub(super) fn has(&self, slot: fn(usize) -> Slot, count: usize) -> bool {
        (0..count).all(|at| self.0.contains(&slot(at)))
    }
}

/// The properties of vertices that are of no use here.
pub(super) fn unused_of_vertices(element: &ElementDef) -> Vec<&str> {
    let names = element.properties.keys().map(String::as_str);
    names.filter(|name| Slot::of(name).is_none()).collect()
}

fn number(property: &Property) -> Option<f64> {
    match property {
        Property::Double(number) => Some(*number),
        Property::Int(number) => Some(f64::from(*number)),
        Property::UInt(number) => Some(f64::from(*number)),
        property => property.to_f32_lossy().map(f64::from),
    }
}

/// A channel of a color: small integers as shares of the greatest.
fn channel(property: &Property, value: f64) -> f32 {
    let whole = match property {
        Property::UChar(_) => f64::from(u8::MAX),
        Property::UShort(_) => f64::from(u16::MAX),
        _ => 1.0,
    };
    (value / whole) as f32
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self { position: [0.0; 3], normal: [0.0; 3], uv: [0.0; 2], color: [1.0, 1.0, 1.0, -1.0] }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let (Some(slot), Some(value)) = (Slot::of(name), number(&property)) else {
            return PropertyAccessResult::Ignored;
        };
        match slot {
            Slot::Position(at) => self.position[at] = value,
            Slot::Normal(at) => self.normal[at] = value,
            Slot::Uv(at) => self.uv[at] = value,
            Slot::Color(at) => self.color[at] = channel(&property, value),
        }
        PropertyAccessResult::Set
    }
}

pub(super) struct Face {
    pub(super) corners: Vec<u32>,
    /// The UVs of its corners, if it has them.
    pub(super) uvs: Vec<f64>,
    /// The number of its picture; negative for none.
    pub(super) texture: i64,
    /// As that of a vertex.
    pub(super) color: [f32; 4],
}

/// The property of a face that a name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FaceSlot {
    Corners,
    Uvs,
    Texture,
    Color(usize),
}

impl FaceSlot {
    fn of(property: &str) -> Option<Self> {
        Some(match property {
            "vertex_indices" | "vertex_index" | "vertex_indexes" | "indices" => Self::Corners,
            "texcoord"
            | "texcoords"
            | "texture_coordinates"
            | "tcoord"
            | "tcoords"
            | "uv"
            | "uvs"
            | "st"
            | "t" => Self::Uvs,
            "texnumber" | "texture_number" => Self::Texture,
            name => match Slot::of(name)? {
                Slot::Color(at) => Self::Color(at),
                _ => return None,
            },
        })
    }
}

/// The properties of faces that are of no use here.
pub(super) fn unused_of_faces(element: &ElementDef) -> Vec<&str> {
    let names = element.properties.keys().map(String::as_str);
    names.filter(|name| FaceSlot::of(name).is_none()).collect()
}

impl PropertyAccess for Face {
    fn new() -> Self {
        let color = [1.0, 1.0, 1.0, -1.0];
        Self { corners: Vec::new(), uvs: Vec::new(), texture: 0, color }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match (FaceSlot::of(name), property) {
            // A negative one is out of range as well.
            (Some(FaceSlot::Corners), Property::ListInt(corners)) => {
                self.corners = corners.into_iter().map(i32::cast_unsigned).collect();
            }
            (Some(FaceSlot::Corners), list) => match list.to_u32_list() {
                Some(corners) => self.corners = corners,
                None => return PropertyAccessResult::UnsupportedType,
            },
            (Some(FaceSlot::Uvs), Property::ListFloat(uvs)) => {
                self.uvs = uvs.into_iter().map(f64::from).collect();
            }
            (Some(FaceSlot::Uvs), Property::ListDouble(uvs)) => self.uvs = uvs,
            (Some(FaceSlot::Texture), property) => {
                self.texture = number(&property).unwrap_or_default() as i64;
            }
            (Some(FaceSlot::Color(at)), property) => match number(&property) {
                Some(value) => self.color[at] = channel(&property, value),
                None => return PropertyAccessResult::Ignored,
            },
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

impl Face {
    /// The triangles of strips of vertices, which −1 ends.
    pub(super) fn of_strips(strips: Vec<Self>) -> Vec<Self> {
        let corners =
            strips.into_iter().flat_map(|strip| strip.corners.into_iter().chain([u32::MAX]));
        let corners: Vec<u32> = corners.collect();
        let strips = corners.split(|&corner| corner == u32::MAX);
        let triangle = |(at, corners): (usize, &[u32])| {
            let [a, b, c] = [corners[0], corners[1], corners[2]];
            let corners = if at % 2 == 0 { vec![a, b, c] } else { vec![b, a, c] };
            Self { corners, ..Self::new() }
        };
        // Strips turn by repeating a vertex.
        let has_area = |face: &Self| {
            let [a, b, c] = [face.corners[0], face.corners[1], face.corners[2]];
            a != b && b != c && c != a
        };
        strips
            .flat_map(|strip| strip.windows(3).enumerate().map(triangle))
            .filter(has_area)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_winds_alike_and_ends_where_it_says() {
        let strip = Face { corners: vec![0, 1, 2, 3, u32::MAX, 4, 5, 6, 6, 7], ..Face::new() };
        let faces = Face::of_strips(vec![strip]);
        let corners: Vec<&[u32]> = faces.iter().map(|face| &face.corners[..]).collect();
        assert_eq!(corners, [[0, 1, 2], [2, 1, 3], [4, 5, 6]]);
    }

    #[test]
    fn names_are_known_in_any_case() {
        assert_eq!(Slot::of("Red"), Some(Slot::Color(0)));
        assert_eq!(Slot::of("Texture_V"), Some(Slot::Uv(1)));
        assert_eq!((Slot::of("quality"), FaceSlot::of("s")), (None, None));
        assert_eq!(FaceSlot::of("GREEN"), Some(FaceSlot::Color(1)));
    }
}
