//! Files that are not read, told by their first bytes or their names, each with what to do instead.

use std::ffi::OsStr;
use std::path::Path;

use serde_json::Value;

use crate::error::{Error, Result};

/// A kind of file that is not read.
struct Kind {
    name: &'static str,
    /// Extensions in small letters.
    extensions: &'static [&'static str],
    /// The first bytes, where these tell.
    begins: &'static [&'static [u8]],
    advice: &'static str,
}

const BLENDER: &str = "Blender reads it (File > Import) and writes .glb (File > Export > glTF 2.0)";
const CAD: &str = "a CAD program or FreeCAD makes a mesh of it, and writes .glb or .obj";
/// What pictures are called.
pub(crate) const PICTURE: &str = "picture";
const OF_PICTURES: &str = "name the model that uses it; `seamwise repair` fills what no chart covers in \
                           pictures";

/// What people have beside glTF. Where two share their first bytes, the name tells.
const KINDS: [Kind; 18] = [
    kind("an FBX file", &["fbx"], &[b"Kaydara FBX Binary", b"; FBX"], BLENDER),
    kind(
        "a Blender file",
        &["blend"],
        &[b"BLENDER"],
        "open it in Blender and write a .glb (File > Export > glTF 2.0)",
    ),
    kind("a USD file", &["usd", "usda", "usdc", "usdz"], &[b"#usda", b"PXR-USDC"], BLENDER),
    kind("an STL file", &["stl"], &[b"solid "], BLENDER),
    kind("a COLLADA file", &["dae"], &[], BLENDER),
    kind("an Alembic file", &["abc"], &[b"Ogawa"], BLENDER),
    kind("an X3D or VRML file", &["wrl", "x3d", "x3dv"], &[b"#VRML"], BLENDER),
    kind(
        "a 3ds Max file",
        &["3ds", "max"],
        &[],
        "3ds Max writes .glb (File > Export, or the Babylon.js exporter)",
    ),
    kind(
        "a Maya file",
        &["ma", "mb"],
        &[b"//Maya"],
        "Maya writes .fbx, which Blender makes a .glb",
    ),
    kind("a Cinema 4D file", &["c4d"], &[], "Cinema 4D writes .glb (File > Export > glTF)"),
    kind("a CAD file", &["iges", "igs", "step", "stp"], &[b"ISO-10303-21"], CAD),
    kind(
        "a point cloud",
        &["e57", "las", "laz", "pcd", "xyz"],
        &[b"LASF"],
        "make a mesh of it first (MeshLab, CloudCompare), and write .ply or .obj",
    ),
    kind(
        "an archive",
        &["7z", "rar", "tar", "tgz", "zip"],
        &[b"PK\x03\x04", b"7z\xbc\xaf", b"Rar!"],
        "unpack it, and name the .gltf or .glb in it",
    ),
    kind(
        "a picture",
        &[
            "bmp", "exr", "gif", "hdr", "jpeg", "jpg", "ktx2", "png", "psd", "tga", "tif", "tiff",
            "webp",
        ],
        &[b"\x89PNG", b"\xff\xd8\xff", b"GIF8", b"II*\0", b"MM\0*", b"\xabKTX"],
        OF_PICTURES,
    ),
    kind("a PLY file by another name", &[], &[b"ply\n", b"ply\r"], "let its name end in .ply"),
    kind(
        "an OFF file by another name",
        &[],
        &[b"OFF\n", b"COFF", b"OFF\r"],
        "let its name end in .off",
    ),
    kind(
        "a file of materials",
        &["mtl"],
        &[],
        "name the .obj, which finds it by the name it gives it",
    ),
    kind("a binary of a .gltf", &["bin"], &[], "name the .gltf, which finds it"),
];

const fn kind(
    name: &'static str,
    extensions: &'static [&'static str],
    begins: &'static [&'static [u8]],
    advice: &'static str,
) -> Kind {
    Kind { name, extensions, begins, advice }
}

/// Refuses a file that is of a kind that is not read, with advice. One that begins as glTF does is
/// glTF, whatever its name.
///
/// # Errors
/// [`Error::Kind`].
pub(crate) fn refuse_foreign(path: &Path, bytes: &[u8]) -> Result<()> {
    if begins_as_gltf(bytes) {
        return Ok(());
    }
    let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default().to_lowercase();
    let by_bytes = |kind: &&Kind| kind.begins.iter().any(|first| bytes.starts_with(first));
    let by_name = |kind: &&Kind| kind.extensions.contains(&extension.as_str());
    // A USDZ is a ZIP, so that the name counts for more.
    match KINDS.iter().find(by_name).or_else(|| KINDS.iter().find(by_bytes)) {
        Some(Kind { name, advice, .. }) => {
            Err(Error::Kind { what: format!("{name}, which is not read: {advice}") })
        }
        None if bytes.is_empty() => Err(Error::Kind { what: "an empty file".into() }),
        None => Ok(()),
    }
}

/// The kind of a file that is not read, by its name, without an article.
pub(crate) fn foreign_name(path: &Path) -> Option<&'static str> {
    let extension = path.extension().and_then(OsStr::to_str)?.to_lowercase();
    let kind = KINDS.iter().find(|kind| kind.extensions.contains(&extension.as_str()))?;
    Some(kind.name.trim_start_matches("an ").trim_start_matches("a "))
}

/// Whether bytes begin as those of a .glb or a .gltf.
pub(super) fn begins_as_gltf(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    bytes.starts_with(b"glTF") || text.trim_ascii_start().starts_with(b"{")
}

/// Refuses JSON that is something else: the report of a bake.
///
/// # Errors
/// [`Error::Kind`].
pub(super) fn refuse_report(json: &Value) -> Result<()> {
    if json.get("asset").is_some() || !json["levels"].is_array() || !json["digest"].is_string() {
        return Ok(());
    }
    let what = "the report of a bake, not a model: name one of the files that it lists, or give it to \
                `seamwise select`";
    Err(Error::Kind { what: what.into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(name: &str, bytes: &[u8]) -> String {
        refuse_foreign(Path::new(name), bytes).map_or_else(|e| e.to_string(), |()| String::new())
    }

    #[test]
    fn a_file_of_another_kind_is_told_by_its_name_or_its_first_bytes() {
        assert!(
            said("a.FBX", b"x").starts_with("an FBX file, which is not read: Blender reads it")
        );
        assert!(said("a", b"Kaydara FBX Binary  \0").starts_with("an FBX file"));
        assert!(said("a.usdz", b"PK\x03\x04").starts_with("a USD file"));
        assert!(said("a.glb", b"PK\x03\x04").starts_with("an archive"));
        assert!(said("a.glb", b"ply\nformat ascii 1.0").contains("end in .ply"));
        assert!(said("a.glb", b"").starts_with("an empty file"));
        assert!(said("a.png", b"\x89PNG").contains("`seamwise repair`"));
        assert_eq!(said("a.glb", b"garbage"), "");
    }

    #[test]
    fn gltf_is_read_whatever_its_name() {
        for bytes in [&b"glTF\x02"[..], b" \n{}", b"\xef\xbb\xbf{}"] {
            assert_eq!(said("a.vrm.zip", bytes), "");
        }
    }
}
