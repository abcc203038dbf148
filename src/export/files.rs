//! Documents as files: what each is called, and in which form it is written.

use std::collections::BTreeMap;
use std::sync::Arc;

use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::glb::{container, join_buffers, json_bytes, to_glb, uri_stem};
pub use super::lod_nodes::Layout;
use crate::compression::squeeze;
use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::image_file::encoded::ImageFormat;

/// The form of documents.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// Each document as one self-contained file.
    #[default]
    Glb,
    /// Each document as a .gltf with a .bin beside it, and their images in a folder.
    Gltf,
}

/// Options of the output of a bake.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputOptions {
    /// Whether vertices become small integers (`KHR_mesh_quantization`), unless they are shared, and
    /// geometry is compressed (`EXT_meshopt_compression`).
    pub compress: bool,
    /// The form of the files.
    pub format: Format,
    /// The layout of the file of all levels.
    pub layout: Layout,
    /// Whether the file of all levels stores vertices once that levels have in common with the source.
    /// That makes it smaller if levels keep vertices of the source, as they do with
    /// [`Placement::Ends`](seamwise_attr::Placement::Ends); else they have next to none in common.
    pub share_vertices: bool,
    /// Whether a further file holds all levels between the coarsest and the source: see
    /// [`progressive`](crate::export::progressive).
    pub progressive: bool,
    /// Whether vertices say where they come to lie in the next coarser level.
    pub geomorph: Geomorph,
}

/// The way in which levels say where their vertices come to lie in the next coarser one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Geomorph {
    /// They do not.
    #[default]
    None,
    /// As attributes: `_GEOMORPH_POSITION`, `_GEOMORPH_NORMAL`, `_GEOMORPH_TEXCOORD_0` and so on.
    Attributes,
    /// As attributes, and as a morph target of positions and normals, which any viewer plays.
    Target,
}

/// The characters that are escaped in a URI.
const PLAIN: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'/');

impl OutputOptions {
    /// Makes sure that they can be had together.
    ///
    /// # Errors
    /// [`Error::Options`] if not.
    pub(crate) fn check(&self) -> Result<()> {
        if self.geomorph != Geomorph::None && (self.compress || self.share_vertices) {
            let what = "a geomorph needs vertices of each level's own as floats: leave out --compress and \
                        --share-vertices, or the geomorph";
            return Err(Error::Options { what: what.into() });
        }
        let needs_glb = self.share_vertices || self.format != Format::Glb;
        if self.layout == Layout::Needle && (needs_glb || self.geomorph != Geomorph::None) {
            let what = "the layout needle has each level of each mesh as a .glb of its own: leave out --format gltf, \
                        --share-vertices and --geomorph, or choose another layout";
            return Err(Error::Options { what: what.into() });
        }
        Ok(())
    }

    /// Whether the collapses that lead to levels are kept on record.
    pub(crate) fn records(&self) -> bool {
        self.progressive || self.geomorph != Geomorph::None
    }

    /// Whether vertices become small integers: not if they are to be the source's, nor if one node is to show
    /// all levels, each of which would have a grid of its own.
    pub(crate) fn quantizes(&self) -> bool {
        self.compress && !self.share_vertices && self.layout != Layout::Needle
    }

    /// The names of documents: `<stem>_lod1` and so on, then `<stem>` if there is to be one of all
    /// levels.
    pub(crate) fn names(&self, stem: &str, levels: usize) -> Vec<String> {
        let names = (1..=levels).map(|level| format!("{stem}_lod{level}"));
        let all = (self.layout != Layout::None).then(|| stem.to_owned());
        names.chain(all).collect()
    }

    /// The name of the progressive file, if there is to be one.
    pub(crate) fn progressive_file(&self, stem: &str) -> Option<String> {
        self.progressive.then(|| format!("{stem}_progressive.glb"))
    }

    /// The files of documents of these names, but for images, which may be in a folder beside them.
    pub(crate) fn files(&self, names: &[String]) -> Vec<String> {
        let endings: &[&str] = match self.format {
            Format::Glb => &["glb"],
            Format::Gltf => &["gltf", "bin"],
        };
        let pairs = names.iter().flat_map(|name| endings.iter().map(move |ending| (name, ending)));
        pairs.map(|(name, ending)| format!("{name}.{ending}")).collect()
    }

    /// Documents as files, with their paths in the folder of the bake, those of
    /// [`OutputOptions::files`] first.
    pub(crate) fn encode(
        &self,
        stem: &str,
        documents: Vec<(String, Asset)>,
    ) -> Result<Vec<(String, Vec<u8>)>> {
        let mut images = Images { folder: format!("{stem}_textures"), files: BTreeMap::new() };
        let uris: Vec<Option<Vec<String>>> = documents
            .iter()
            .map(|(_, asset)| (self.format == Format::Gltf).then(|| images.add(asset)))
            .collect();
        let files: Vec<Vec<(String, Vec<u8>)>> = documents
            .into_par_iter()
            .zip(&uris)
            .map(|((name, asset), uris)| self.document_files(&name, &asset, uris.as_deref()))
            .collect::<Result<_>>()?;
        let images = images.files.into_values();
        let images = images.map(|(path, bytes)| (path, bytes.to_vec()));
        Ok(files.into_iter().flatten().chain(images).collect())
    }

    /// The files of one document, its images in it unless they have URIs.
    fn document_files(
        &self,
        name: &str,
        asset: &Asset,
        uris: Option<&[String]>,
    ) -> Result<Vec<(String, Vec<u8>)>> {
        if uris.is_none() && !self.compress {
            return Ok(vec![(format!("{name}.glb"), to_glb(asset)?)]);
        }
        let joined = join_buffers(asset, uris)?;
        let mut joined = if self.compress { squeeze(&joined)? } else { joined };
        if uris.is_none() {
            return Ok(vec![(format!("{name}.glb"), container(&joined)?)]);
        }
        let bin = format!("{name}.bin");
        if let Some(buffer) = joined.json.pointer_mut("/buffers/0") {
            buffer["uri"] = json!(uri(&bin));
        }
        let document = (format!("{name}.gltf"), json_bytes(&joined.json)?);
        let buffer = joined.buffers.into_iter().next().map(Arc::unwrap_or_clone);
        Ok(vec![document, (bin, buffer.unwrap_or_default())])
    }
}

pub(super) fn uri(path: &str) -> String {
    utf8_percent_encode(path, PLAIN).to_string()
}

/// Image files of all documents of a bake, in a folder of their own, since names that a source gives
/// are no reason to write over anything else.
struct Images {
    folder: String,
    /// Files by path in small letters, as some file systems do not tell them apart.
    files: BTreeMap<String, (String, Arc<Vec<u8>>)>,
}

impl Images {
    /// Adds the images of a document; equal ones of one name are one file. One URI per image: those of
    /// missing images stay.
    fn add(&mut self, asset: &Asset) -> Vec<String> {
        let images = asset.images.iter().enumerate();
        images
            .map(|(index, image)| {
                let json = &asset.json["images"][index];
                if image.is_missing() {
                    return json["uri"].as_str().unwrap_or_default().to_owned();
                }
                let base = base_name(json).unwrap_or_else(|| format!("image{index}"));
                uri(&self.place(&base, image.format, &image.bytes))
            })
            .collect()
    }

    /// Finds a path for an image: its own name, or with a number if another one has that.
    fn place(&mut self, base: &str, format: ImageFormat, bytes: &Arc<Vec<u8>>) -> String {
        let mut number = 1;
        loop {
            let suffix = if number == 1 { String::new() } else { format!("_{number}") };
            let path = format!("{}/{base}{suffix}.{}", self.folder, format.ending());
            let entry = self.files.entry(path.to_lowercase());
            let (own, known) = entry.or_insert_with(|| (path, bytes.clone()));
            if known == bytes {
                return own.clone();
            }
            number += 1;
        }
    }
}

/// The name that a document has for an image, of its file if it had one; without what file systems
/// object to.
fn base_name(image: &Value) -> Option<String> {
    let file = image.get("uri").and_then(Value::as_str).and_then(uri_stem);
    let name = file.or_else(|| image.get("name").and_then(Value::as_str).map(str::to_owned))?;
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.' | ' ');
    let name: String = name.chars().map(|c| if is_plain(c) { c } else { '_' }).collect();
    let name = name.trim_matches(['.', ' ']);
    (!name.is_empty()).then(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image_file::encoded::EncodedImage;

    fn document(images: &[(Value, &[u8])]) -> Asset {
        let image =
            |bytes: &[u8]| EncodedImage { bytes: bytes.to_vec().into(), format: ImageFormat::Png };
        Asset {
            json: json!({"images": images.iter().map(|own| own.0.clone()).collect::<Vec<_>>()}),
            buffers: Vec::new(),
            images: images.iter().map(|own| image(own.1)).collect(),
            ..Asset::default()
        }
    }

    #[test]
    fn images_keep_their_names_in_a_folder_and_equal_ones_are_one_file() {
        let mut images = Images { folder: "a b_textures".into(), files: BTreeMap::new() };
        let first = document(&[
            (json!({"uri": "../textures/base%20color.jpg"}), b"1"),
            (json!({"name": "../../etc/passwd"}), b"2"),
            (json!({"uri": "data:image/png;base64,AA=="}), b"3"),
            (json!({"uri": "gone.png"}), b""),
        ]);
        let names = [
            "a%20b_textures/base%20color.png",
            "a%20b_textures/_.._etc_passwd.png",
            "a%20b_textures/image2.png",
            "gone.png",
        ];
        assert_eq!(images.add(&first), names);
        assert_eq!(images.add(&first), names, "they are there already");
        let second = document(&[(json!({"name": "Base Color"}), b"other")]);
        assert_eq!(images.add(&second), ["a%20b_textures/Base%20Color_2.png"]);
        assert_eq!(images.files.len(), 4);
    }

    #[test]
    fn a_gltf_names_its_binary_and_its_images() {
        let mut asset = document(&[(json!({"bufferView": 0}), b"texels")]);
        asset.json["bufferViews"] =
            json!([{"buffer": 0, "byteLength": 6}, {"buffer": 0, "byteLength": 2}]);
        asset.buffers = vec![b"texels".to_vec().into()];
        let options = OutputOptions { format: Format::Gltf, ..OutputOptions::default() };
        let files = options.encode("ship", vec![("ship_lod1".into(), asset)]).unwrap();
        let names: Vec<&str> = files.iter().map(|(path, _)| path.as_str()).collect();
        assert_eq!(names, ["ship_lod1.gltf", "ship_lod1.bin", "ship_textures/image0.png"]);
        assert_eq!(files[2].1, b"texels");
        let json: Value = serde_json::from_slice(&files[0].1).unwrap();
        assert_eq!(json["buffers"], json!([{"byteLength": 6, "uri": "ship_lod1.bin"}]));
        let image = json!({"uri": "ship_textures/image0.png", "mimeType": "image/png"});
        assert_eq!(json["images"], json!([image]));
    }
}
