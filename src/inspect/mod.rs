//! Inspection of an asset: its meshes, materials and images, and the reads by which its atlases
//! would bleed.

pub mod quadrics;

use rayon::prelude::*;
use seamwise_attr::Census;
use seamwise_texture::{Footprint, Role};
use serde::Serialize;
use serde_json::Value;

use crate::atlas::charts::Reads;
use crate::atlas::{Atlas, atlases};
use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::image_file::codec::decode;
use crate::limit::MemoryLimit;
use crate::surface::geometry::{Geometry, check_size};

/// The result of an inspection, in schema 1.
#[derive(Clone, Debug, Serialize)]
pub struct Inspection {
    /// Version of this layout.
    pub schema: u32,
    /// Sums over all meshes.
    pub total: MeshReport,
    /// The meshes that have triangles.
    pub meshes: Vec<MeshReport>,
    /// The images that a surface uses, but those that are missing.
    pub atlases: Vec<AtlasReport>,
    /// Materials in the document.
    pub materials: usize,
    /// Extensions used.
    pub extensions: Vec<String>,
}

/// One mesh, all its triangle primitives as one surface.
#[derive(Clone, Debug, Default, Serialize)]
pub struct MeshReport {
    /// Its name in the document.
    pub name: String,
    /// Triangles, without degenerate ones.
    pub triangles: usize,
    /// Triangles with two corners at one point.
    pub degenerate_triangles: usize,
    /// Positions after welding.
    pub points: usize,
    /// Attribute tuples after welding.
    pub wedges: usize,
    /// Edges whose sides differ in UV, color or material.
    pub seams: usize,
    /// Edges whose sides differ in their normals alone.
    pub creases: usize,
    /// Edges of one triangle.
    pub borders: usize,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Points with three wedges or more.
    pub junctions: usize,
    /// Connected UV islands.
    pub charts: usize,
    /// Connected pieces of surface.
    pub shells: usize,
}

/// One image as an atlas.
#[derive(Clone, Debug, Serialize)]
pub struct AtlasReport {
    /// Its index among the document's images.
    pub image: usize,
    /// The role of its texels: color, normal or data.
    pub role: &'static str,
    /// Width in texels.
    pub width: usize,
    /// Height in texels.
    pub height: usize,
    /// Share of the texels that charts cover, 0…1.
    pub coverage: f64,
    /// Reads by taps inside the charts, for each mip level.
    pub mips: Vec<MipReport>,
    /// The first mip level with a texel made from two charts, whose colors no repair keeps apart.
    pub charts_share_from: Option<usize>,
}

/// Reads at one mip level.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct MipReport {
    /// Distinct texels read.
    pub read: usize,
    /// Number of those that an uncovered texel went into.
    pub invalid: usize,
    /// Number of those that are left after a repair.
    pub invalid_after: usize,
}

/// Inspects an asset; decoding one of its images, and all its vertices, may each take as much
/// memory as `limit`. `footprint` is what counts as read.
///
/// # Errors
/// [`Error::Invalid`] or [`Error::Unsupported`] with the place in the document.
pub fn inspect(asset: &Asset, limit: MemoryLimit, footprint: Footprint) -> Result<Inspection> {
    check_size(asset, limit)?;
    let meshes: Vec<Option<MeshReport>> = (0..asset.count("meshes"))
        .into_par_iter()
        .map(|mesh| Ok(Geometry::read(asset, &[mesh])?.map(|g| inspect_mesh(asset, &g))))
        .collect::<Result<_>>()?;
    let meshes: Vec<MeshReport> = meshes.into_iter().flatten().collect();
    let extensions = asset.json.get("extensionsUsed").and_then(Value::as_array);
    Ok(Inspection {
        schema: 1,
        total: sum(&meshes),
        meshes,
        atlases: atlases(asset)?
            .par_iter()
            .filter(|atlas| !asset.images[atlas.image].is_missing())
            .map(|atlas| inspect_atlas(asset, atlas, limit, footprint))
            .collect::<Result<_>>()?,
        materials: asset.count("materials"),
        extensions: extensions
            .into_iter()
            .flatten()
            .filter_map(|name| name.as_str().map(str::to_owned))
            .collect(),
    })
}

fn inspect_mesh(asset: &Asset, geometry: &Geometry) -> MeshReport {
    let (welded, index) = (&geometry.welded, geometry.meshes[0]);
    let name = asset.json.pointer(&format!("/meshes/{index}/name")).and_then(Value::as_str);
    let census = Census::new(&welded.mesh);
    MeshReport {
        name: name.map_or_else(|| format!("mesh {index}"), str::to_owned),
        triangles: welded.mesh.triangles.len(),
        degenerate_triangles: welded.degenerate,
        points: welded.mesh.positions.len(),
        wedges: welded.mesh.wedge_points.len(),
        seams: census.seams,
        creases: census.creases,
        borders: census.borders,
        non_manifold_edges: census.complex,
        junctions: census.junctions,
        charts: census.charts,
        shells: census.shells,
    }
}

fn sum(meshes: &[MeshReport]) -> MeshReport {
    let total = |of: fn(&MeshReport) -> usize| meshes.iter().map(of).sum();
    MeshReport {
        name: "total".to_owned(),
        triangles: total(|m| m.triangles),
        degenerate_triangles: total(|m| m.degenerate_triangles),
        points: total(|m| m.points),
        wedges: total(|m| m.wedges),
        seams: total(|m| m.seams),
        creases: total(|m| m.creases),
        borders: total(|m| m.borders),
        non_manifold_edges: total(|m| m.non_manifold_edges),
        junctions: total(|m| m.junctions),
        charts: total(|m| m.charts),
        shells: total(|m| m.shells),
    }
}

fn inspect_atlas(
    asset: &Asset,
    atlas: &Atlas,
    limit: MemoryLimit,
    footprint: Footprint,
) -> Result<AtlasReport> {
    let at = format!("/images/{}", atlas.image);
    let texels = decode(&asset.images[atlas.image], &at, limit)?;
    let (width, height) = (texels.width() as usize, texels.height() as usize);
    let validity = atlas.validity(width, height);
    let Reads { mips, shared_from } = atlas.charts.reads(&validity, atlas.wrap, footprint);
    // A repair leaves no invalid texel where there is a valid one and a chart tells all that is read.
    let repaired = validity.valid() > 0 && !atlas.beyond_charts;
    let mips = mips.into_iter().map(|mip| MipReport {
        read: mip.read,
        invalid: mip.invalid,
        invalid_after: if repaired { 0 } else { mip.invalid },
    });
    Ok(AtlasReport {
        image: atlas.image,
        role: match atlas.role {
            Role::Color => "color",
            Role::Normal => "normal",
            Role::Data => "data",
        },
        width,
        height,
        coverage: validity.valid() as f64 / (width * height).max(1) as f64,
        mips: mips.collect(),
        charts_share_from: shared_from,
    })
}

impl Inspection {
    /// The findings as JSON.
    ///
    /// # Errors
    /// [`Error::Internal`] if they can't be written so.
    pub fn to_json(&self) -> Result<String> {
        let text = serde_json::to_string_pretty(self);
        Ok(text.map_err(Error::internal)? + "\n")
    }

    /// The findings for people.
    pub fn to_text(&self) -> String {
        let t = &self.total;
        let mut text = format!(
            "{} meshes, {} materials\n\
             {} triangles ({} degenerate left out), {} points, {} wedges\n\
             {} seams, {} creases, {} borders, {} non-manifold edges, {} junctions\n\
             {} charts, {} shells\n",
            self.meshes.len(),
            self.materials,
            t.triangles,
            t.degenerate_triangles,
            t.points,
            t.wedges,
            t.seams,
            t.creases,
            t.borders,
            t.non_manifold_edges,
            t.junctions,
            t.charts,
            t.shells,
        );
        for atlas in &self.atlases {
            let list = |figure: fn(&MipReport) -> usize| {
                atlas.mips.iter().map(|mip| figure(mip).to_string()).collect::<Vec<_>>().join(" ")
            };
            let shared_from = atlas.charts_share_from;
            text += &format!(
                "image {} ({}, {}×{}): {:.1} % covered; invalid reads per mip {}, after a repair {}; \
                 {}\n",
                atlas.image,
                atlas.role,
                atlas.width,
                atlas.height,
                atlas.coverage * 100.0,
                list(|mip| mip.invalid),
                list(|mip| mip.invalid_after),
                Reads { shared_from, ..Reads::default() }.sharing(),
            );
        }
        if !self.extensions.is_empty() {
            text += &format!("extensions {}\n", self.extensions.join(" "));
        }
        text
    }
}
