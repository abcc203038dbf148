//! Sources of the valid texels of a picture: a mesh, a mask, a background.

use std::path::PathBuf;

use glam::Affine2;
use image::DynamicImage;
use seamwise_texture::equalize::{self, Seam};
use seamwise_texture::{Footprint, Plane, Role, Validity};
use serde_json::Value;

use super::WRAP;
use super::background::Found;
use super::options::{Background, MeshOptions, RepairOptions};
use crate::atlas::charts::{Charts, Reads};
use crate::atlas::seams::Surface;
use crate::document::asset::Asset;
use crate::document::primitive::Primitive;
use crate::error::{Error, Result};
use crate::image_file::picture::Picture;
use crate::import::options::ReadOptions;
use crate::import::read_geometry;
use crate::surface::geometry::check_size;
use crate::warning::Warnings;

/// The mesh, the mask and the background, read.
pub(super) struct Sources {
    mesh: Option<MeshSource>,
    mask: Option<(PathBuf, Validity)>,
    background: Background,
    /// The role that was given.
    role: Role,
    /// Of all files.
    pub(super) warnings: Warnings,
}

/// A mesh that uses the picture.
struct MeshSource {
    charts: Charts,
    /// If they are to be equalized.
    seams: Vec<Seam>,
    warnings: Warnings,
}

impl Sources {
    /// Reads the files that the options name.
    pub(super) fn read(options: &RepairOptions) -> Result<Self> {
        let mesh = options.mesh.as_ref().map(|mesh| {
            let vectors = options.role == Some(Role::Normal);
            let equalize = options.equalize.map(|_| vectors);
            MeshSource::read(mesh, equalize, options.reading)
                .map_err(|error| error.in_file(&mesh.file))
        });
        let mask = options.mask.as_ref().map(|path| {
            let luma = Picture::read(path, options.reading.memory_limit)?.texels.to_luma32f();
            let [width, height] = [luma.width() as usize, luma.height() as usize];
            let plane = Plane::from_vec(width, height, 1, luma.into_raw());
            Ok::<_, Error>((path.clone(), Validity::from_mask(&plane)))
        });
        let mask = mask.transpose()?;
        let background = options.background.clone();
        let role = options.role.unwrap_or_default();
        let mut mesh = mesh.transpose()?;
        let warnings = mesh.as_mut().map(|mesh| std::mem::take(&mut mesh.warnings));
        let warnings = warnings.unwrap_or_default();
        Ok(Self { mesh, mask, background, role, warnings })
    }

    /// The background of a picture, found or given; `tolerance` is how far its channels may be from
    /// a color.
    pub(super) fn background(&self, texels: &DynamicImage, tolerance: f32) -> Option<Found> {
        Found::of(texels, &self.background, tolerance, self.role)
    }

    /// The texels of a picture of `width` × `height` that pass all tests; `None` if there is no test.
    /// `backdrop` are those that its background leaves.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the mask has another size.
    pub(super) fn validity(
        &self,
        [width, height]: [usize; 2],
        backdrop: Option<Validity>,
    ) -> Result<Option<Validity>> {
        let mut tests = Vec::new();
        if let Some((path, mask)) = &self.mask {
            if [width, height] != [mask.width(), mask.height()] {
                let [w, h] = [mask.width(), mask.height()];
                let what = format!("a mask of {w}×{h} texels for {width}×{height}");
                return Err(Error::invalid(path.display().to_string(), what));
            }
            tests.push(mask.clone());
        }
        if let Some(MeshSource { charts: Charts { uvs, triangles }, .. }) = &self.mesh {
            tests.push(Validity::from_charts(width, height, WRAP, uvs, triangles));
        }
        tests.extend(backdrop);
        Ok(tests.into_iter().reduce(|mut all, test| {
            all.intersect(&test);
            all
        }))
    }

    /// The mesh's seams and how to equalize them, if that is asked for.
    pub(super) fn seams(&self, options: &RepairOptions) -> Option<(&[Seam], equalize::Options)> {
        Some((self.mesh.as_ref().map_or(&[], |mesh| &mesh.seams), options.equalize?))
    }

    /// Counts of the texels that filtering inside the mesh's charts reads; empty without a mesh.
    pub(super) fn reads(&self, validity: &Validity, footprint: Footprint) -> Reads {
        let count = |mesh: &MeshSource| mesh.charts.reads(validity, WRAP, footprint);
        self.mesh.as_ref().map_or(Reads::default(), count)
    }
}

impl MeshSource {
    /// Reads the charts of all triangle primitives that have the UV set, and their seams if
    /// `equalize`, which then tells whether they are those of a normal map.
    fn read(options: &MeshOptions, equalize: Option<bool>, reading: ReadOptions) -> Result<Self> {
        let asset = read_geometry(&options.file, reading)?;
        check_size(&asset, reading.memory_limit)?;
        let mut charts = Charts::default();
        let mut seams = Vec::new();
        for mesh in chosen_meshes(&asset, options.name.as_deref())? {
            let mut surface = Surface::default();
            for primitive in Primitive::of_mesh(&asset, mesh)?.iter().filter(|p| p.is_surface()) {
                if let Some(vectors) = equalize {
                    surface.add(&asset, primitive, options.uv_set, Affine2::IDENTITY, vectors)?;
                }
                let own = Charts::read(&asset, primitive, options.uv_set, Affine2::IDENTITY)?;
                own.into_iter().for_each(|own| charts.append(own));
            }
            seams.extend(surface.seams());
        }
        if charts.triangles.is_empty() {
            return Err(Error::Options {
                what: format!("no triangle has UV set {}", options.uv_set),
            });
        }
        let warnings = asset.warnings.in_file(&options.file);
        Ok(Self { charts, seams, warnings })
    }
}

/// The meshes of that name, or that nodes of that name use; all if there is none.
fn chosen_meshes(asset: &Asset, name: Option<&str>) -> Result<Vec<usize>> {
    let meshes = 0..asset.count("meshes");
    let Some(name) = name else {
        return Ok(meshes.collect());
    };
    let list = |key: &str| asset.json.get(key).and_then(Value::as_array).into_iter().flatten();
    let is_called = |object: &Value| object["name"].as_str() == Some(name);
    let mut chosen: Vec<bool> = list("meshes").map(is_called).collect();
    for (node, _) in list("nodes").enumerate().filter(|(_, node)| is_called(node)) {
        if let Some(mesh) = asset.reference(&format!("/nodes/{node}"), "mesh", "meshes")? {
            chosen[mesh] = true;
        }
    }
    if !chosen.contains(&true) {
        let known: Vec<&str> = list("meshes").filter_map(|mesh| mesh["name"].as_str()).collect();
        let what = format!("no mesh is called {name}; there are: {}", known.join(", "));
        return Err(Error::Options { what });
    }
    Ok(meshes.filter(|&mesh| chosen[mesh]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_mesh_is_chosen_by_its_name_or_its_nodes() {
        let asset = Asset {
            json: json!({
                "meshes": [{"name": "a"}, {"name": "b"}, {}],
                "nodes": [{"mesh": 2, "name": "b"}, {"name": "a"}],
            }),
            buffers: Vec::new(),
            ..Asset::default()
        };
        let chosen = |name| chosen_meshes(&asset, name);
        assert_eq!(chosen(None).unwrap(), [0, 1, 2]);
        assert_eq!(chosen(Some("a")).unwrap(), [0]);
        assert_eq!(chosen(Some("b")).unwrap(), [1, 2]);
        assert!(chosen(Some("c")).unwrap_err().to_string().ends_with("a, b"));
    }

    #[test]
    fn a_texel_must_pass_every_test() {
        let is_black = |x: u32, y: u32| x < 4 || y == 0 || y == 7 || x == 15;
        let luma = |x, y| image::Luma([if is_black(x, y) { 0 } else { (16 * y + x) as u8 }]);
        let black = DynamicImage::ImageLuma8(image::GrayImage::from_fn(16, 8, luma));
        let mask = Validity::from_flags(16, 8, (0..128).map(|texel| texel % 16 < 10).collect());
        let mut sources = Sources {
            mesh: None,
            mask: None,
            background: Background::Auto,
            role: Role::Color,
            warnings: Warnings::default(),
        };
        let valid = |sources: &Sources| {
            let found = sources.background(&black, 0.0).map(|found| found.charts);
            sources.validity([16, 8], found).unwrap().map(|validity| validity.valid())
        };
        assert_eq!(valid(&sources), Some(11 * 6));
        sources.mask = Some((PathBuf::from("mask.png"), mask));
        assert_eq!(valid(&sources), Some(6 * 6));
        sources.background = Background::None;
        assert_eq!(valid(&sources), Some(10 * 8));
        let error = sources.validity([8, 8], None).unwrap_err().to_string();
        assert!(error.starts_with("mask.png"), "{error}");
        sources.mask = None;
        assert_eq!(valid(&sources), None);
    }
}
