//! The known extensions, by whether they describe data that a bake changes.
//!
//! | what it describes | if it is required |
//! |---|---|
//! | nothing that is changed: nodes, lights, materials, metadata | it passes through |
//! | geometry or textures, in a way that is read here | it is kept true, or made plain |
//! | geometry that changes, or textures that can't be read | it is refused by its name |
//! | nobody knows | it is refused by its name, unless the user allows it |
//!
//! An extension that describes changed geometry and is not required is left out of what changes.

/// The kind of data that an extension describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Describes {
    /// Neither geometry nor textures: whatever it says stays true.
    Neither,
    /// Geometry or textures, in a way that is read, and kept true or made plain.
    Read,
    /// The triangles or vertices of a primitive, in a way that is lost where these change.
    Geometry,
    /// Textures of a kind that can't be read.
    Textures,
}

/// An extension that is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    name: &'static str,
    pub(crate) describes: Describes,
    /// Whether it may refer to materials, textures or images in a way that is not followed where these
    /// move up to close a gap.
    pub(crate) holds_indices: bool,
}

use Describes::{Geometry, Neither, Read, Textures};

/// All of them but those of materials, by name.
#[rustfmt::skip]
const TABLE: &[Known] = &[
    row("AGI_articulations", Neither, false),
    row("AGI_stk_metadata", Neither, false),
    row("CESIUM_RTC", Neither, false),
    row("CESIUM_primitive_outline", Geometry, false),
    row("EXT_instance_features", Neither, false),
    row("EXT_lights_ies", Neither, false),
    row("EXT_lights_image_based", Neither, true),
    row("EXT_mesh_features", Read, true),
    row("EXT_mesh_gpu_instancing", Read, false),
    row("EXT_mesh_manifold", Geometry, false),
    row("EXT_mesh_polygon", Geometry, false),
    row("EXT_mesh_primitive_edge_visibility", Geometry, false),
    row("EXT_meshopt_compression", Read, false),
    row("EXT_structural_metadata", Read, true),
    row("EXT_texture_astc", Textures, true),
    row("EXT_texture_avif", Textures, true),
    row("EXT_texture_webp", Read, false),
    row("FB_ngon_encoding", Geometry, false),
    row("KHR_animation_pointer", Read, true),
    row("KHR_audio_emitter", Neither, false),
    row("KHR_draco_mesh_compression", DRACO, false),
    row("KHR_implicit_shapes", Neither, false),
    row("KHR_interactivity", Neither, true),
    row("KHR_lights_punctual", Neither, false),
    row("KHR_mesh_quantization", Read, false),
    row("KHR_meshopt_compression", Read, false),
    row("KHR_node_hoverability", Neither, false),
    row("KHR_node_selectability", Neither, false),
    row("KHR_node_visibility", Neither, false),
    row("KHR_physics_rigid_bodies", Neither, false),
    row("KHR_texture_basisu", Read, false),
    row("KHR_texture_procedurals", Textures, true),
    row("KHR_texture_transform", Read, false),
    row("KHR_xmp", Neither, false),
    row("KHR_xmp_json_ld", Neither, false),
    row("MSFT_lod", Read, false),
    row("MSFT_packing_normalRoughnessMetallic", Neither, true),
    row("MSFT_packing_occlusionRoughnessMetallic", Neither, true),
    row("MSFT_texture_dds", Textures, true),
    row("VRMC_node_constraint", Neither, false),
    row("VRMC_springBone", Neither, false),
    row("VRMC_vrm", Neither, true),
];

/// Without its decoder a stream is all there is of the geometry.
const DRACO: Describes = if cfg!(feature = "draco") { Read } else { Geometry };

/// The extensions of materials. They leave geometry as it is, and their textures are found by the names
/// that these have.
const MATERIALS: Known = row("KHR_materials_", Neither, false);

const fn row(name: &'static str, describes: Describes, holds_indices: bool) -> Known {
    Known { name, describes, holds_indices }
}

/// The entry of an extension in the table, if it is known.
pub(crate) fn known(name: &str) -> Option<Known> {
    if name.starts_with(MATERIALS.name) {
        return Some(MATERIALS);
    }
    TABLE.binary_search_by_key(&name, |known| known.name).ok().map(|at| TABLE[at])
}

/// The extensions of primitives that say what is no longer true of changed geometry.
pub(crate) fn lost_with_geometry() -> impl Iterator<Item = &'static str> {
    TABLE.iter().filter(|known| known.describes == Geometry).map(|known| known.name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_sorted_and_every_name_is_found() {
        assert!(TABLE.is_sorted_by(|a, b| a.name < b.name));
        for own in TABLE {
            assert_eq!(known(own.name).unwrap().describes, own.describes, "{}", own.name);
        }
        assert_eq!(known("KHR_materials_volume").unwrap().describes, Neither);
        assert!(known("EXT_of_tomorrow").is_none());
    }
}
