//! A progressive file of an asset.

use std::sync::Arc;

use gltf::json::accessor::ComponentType;
use seamwise_attr::{Mesh, ProgressiveScene, TriangleId, WedgeId};
use serde_json::json;

use super::document::with_parts;
use super::encode::{error_of, write_splits};
use super::format::{EXTENSION, VERSION};
use super::header::{AttributeHeader, CodingHeader, Header, PartHeader, SurfaceHeader};
use super::parts::parts;
use super::source::Refined;
use super::values::Coding;
use super::whole::{WholePart, write_whole};
use crate::document::accessor::{Elements, Named};
use crate::document::asset::Asset;
use crate::document::extensions::name_extension;
use crate::error::{Error, Result};
use crate::export::glb::{container, join_buffers};
use crate::image_file::encoded::EncodedImage;
use crate::level::part::LevelPart;
use crate::surface::geometry::Geometry;
use crate::surface::part::Part;

/// Steps of values between levels, as a share of what they differ by along an edge of the source, but no
/// finer than a share of the surface's diagonal, or of a texture; and of normals and colors.
///
/// Lab note: a scan of popcorn at 40 %, 32 steps an edge: distance 1.96 of a level baked for that count, 256:
/// 1.07.
const STEPS_PER_EDGE: f64 = 256.0;
const STEPS_PER_DIAGONAL: f64 = 65_536.0;
const STEPS_PER_TEXTURE: f64 = 16_384.0;
const NORMAL_STEP: f32 = 1.0 / 512.0;
const COLOR_STEP: f32 = 1.0 / 512.0;

/// An asset as a progressive file. `scene` has one mesh per geometry.
///
/// # Errors
/// [`Error::Invalid`] if the asset's attributes can't be read.
pub(crate) fn progressive_glb(
    asset: &Asset,
    images: &[EncodedImage],
    geometries: &[Geometry],
    scene: &ProgressiveScene,
) -> Result<Vec<u8>> {
    let sources: Vec<Vec<Source>> = geometries
        .iter()
        .map(|geometry| geometry.parts.iter().map(|part| Source::read(asset, part)).collect())
        .collect::<Result<_>>()?;
    let surfaces = geometries.iter().zip(&sources).map(|(own, parts)| surface_header(own, parts));
    let mut header = Header {
        version: VERSION,
        buffer_view: 0,
        triangles: [0; 2],
        splits: scene.order().len() as u64,
        error: 0.0,
        surfaces: surfaces.collect(),
    };
    let (forms, columns) = header.forms();
    let mut refined: Vec<Refined<'_>> = Vec::new();
    for (at, ((geometry, mesh), form)) in
        geometries.iter().zip(scene.meshes()).zip(&forms).enumerate()
    {
        let carried = carried(geometry, &sources[at], &header.surfaces[at]);
        refined.push(Refined::new(mesh.clone(), &geometry.welded.mesh, form, carried));
    }
    let count = |refined: &[Refined<'_>]| -> u64 {
        refined.iter().map(|own| own.mesh.triangles() as u64).sum()
    };
    (header.triangles[0], header.error) = (count(&refined), error_of(&refined));
    let (mut blocks, coarsest) = {
        let mut coarsest = Vec::new();
        let blocks = write_splits(scene, &mut refined, columns, |surfaces| {
            let made = surfaces.iter().zip(&header.surfaces);
            coarsest = made.map(|(own, header)| parts(&own.surface, header, &[])).collect();
        })?;
        (blocks, coarsest)
    };
    header.triangles[1] = count(&refined);
    let mut whole = Vec::new();
    for (at, own) in refined.iter().enumerate() {
        let made = parts(&own.surface, &header.surfaces[at], &[]);
        whole.extend(wholes(&geometries[at], &sources[at], own, &made)?);
    }
    blocks.extend(write_whole(&whole).map_err(Error::internal)?);
    embed(&with_parts(asset, &header, &coarsest, images)?, header, &blocks)
}

/// A document with its splits behind all else.
fn embed(asset: &Asset, mut header: Header, blocks: &[u8]) -> Result<Vec<u8>> {
    let mut joined = join_buffers(asset, None)?;
    if joined.buffers.is_empty() {
        joined.buffers.push(Arc::default());
    }
    let buffer = Arc::make_mut(&mut joined.buffers[0]);
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let start = buffer.len();
    buffer.extend_from_slice(blocks);
    joined.json["buffers"] = json!([{"byteLength": buffer.len()}]);
    header.buffer_view = joined.count("bufferViews");
    let view = json!({"buffer": 0, "byteOffset": start, "byteLength": blocks.len()});
    match joined.json["bufferViews"].as_array_mut() {
        Some(views) => views.push(view),
        None => joined.json["bufferViews"] = json!([view]),
    }
    let extension = serde_json::to_value(&header).map_err(Error::internal)?;
    if joined.json.get("extensions").is_none() {
        joined.json["extensions"] = json!({});
    }
    joined.json["extensions"][EXTENSION] = extension;
    name_extension(&mut joined.json, EXTENSION);
    container(&joined)
}

/// The attributes of a part as they come out, those of morph targets last.
struct Source {
    attributes: Vec<Named>,
    targets: Vec<Vec<Named>>,
    triangles: Vec<[u32; 3]>,
}

impl Source {
    fn read(asset: &Asset, part: &Part) -> Result<Self> {
        let (own, count) = (&part.primitive, part.vertices);
        let mut attributes = Vec::new();
        for (name, _) in &own.attributes {
            if let Some(elements) = own.elements(asset, name, count)? {
                attributes.push((name.clone(), elements));
            }
        }
        let triangles = own.triangles(asset, count)?;
        Ok(Self { attributes, targets: part.targets.clone(), triangles })
    }

    fn all(&self) -> impl Iterator<Item = &Named> {
        self.attributes.iter().chain(self.targets.iter().flatten())
    }
}

fn surface_header(geometry: &Geometry, sources: &[Source]) -> SurfaceHeader {
    let mesh = &geometry.welded.mesh;
    let layout = mesh.layout;
    let (edge, uv_edges) = edges(mesh);
    let coding = |coding: Coding| CodingHeader { step: coding.step, grid: coding.grid };
    let positions = mesh.positions.iter().flat_map(glam::Vec3::to_array);
    let position = coding(Coding::of(&positions, step(edge, diagonal(mesh) / STEPS_PER_DIAGONAL)));
    let row = (0..layout.len()).map(|at| {
        let values = mesh.attributes.iter().skip(at).step_by(layout.len()).copied();
        let own = match at {
            _ if at < layout.normal() => step(uv_edges[at / 2], 1.0 / STEPS_PER_TEXTURE),
            _ if at < layout.color() => NORMAL_STEP,
            _ => COLOR_STEP,
        };
        coding(Coding::of(&values, own))
    });
    let mut header = SurfaceHeader {
        uv_sets: layout.uv_sets,
        normal: layout.normal,
        color: layout.color,
        position,
        row: row.collect(),
        parts: Vec::new(),
    };
    let parts = geometry.parts.iter().zip(sources);
    header.parts = parts.map(|(part, source)| part_header(part, source, &header)).collect();
    header
}

/// The diagonal of the box around a mesh.
fn diagonal(mesh: &Mesh) -> f64 {
    let start = (glam::Vec3::INFINITY, glam::Vec3::NEG_INFINITY);
    let grow = |(low, high): (glam::Vec3, glam::Vec3), p: &glam::Vec3| (low.min(*p), high.max(*p));
    let (low, high) = mesh.positions.iter().fold(start, grow);
    f64::from(low.distance(high))
}

/// The largest power of two that is no more than a share of a length along an edge, or than `least` if
/// that is more.
fn step(edge: f64, least: f64) -> f32 {
    let step = (edge / STEPS_PER_EDGE).max(least).log2().floor().exp2() as f32;
    if step.is_finite() && step > 0.0 { step } else { f32::MIN_POSITIVE }
}

/// The mean length of an edge, and that of its UVs in each set.
fn edges(mesh: &Mesh) -> (f64, Vec<f64>) {
    let (mut edge, mut uvs) = (0.0, vec![0.0; mesh.layout.uv_sets]);
    for (triangle, wedges) in mesh.triangles.iter().enumerate() {
        let [a, b, _] = mesh.triangle_positions(triangle);
        edge += f64::from(a.distance(b));
        for (set, sum) in uvs.iter_mut().enumerate() {
            *sum += f64::from(mesh.uv(wedges[0], set).distance(mesh.uv(wedges[1], set)));
        }
    }
    let count = mesh.triangles.len().max(1) as f64;
    uvs.iter_mut().for_each(|sum| *sum /= count);
    (edge / count, uvs)
}

fn part_header(part: &Part, source: &Source, surface: &SurfaceHeader) -> PartHeader {
    let header = |(name, elements): &Named| {
        let is_float = surface.is_made(name) && name != "COLOR_0";
        let component = if is_float { ComponentType::F32 } else { elements.component };
        AttributeHeader {
            name: name.clone(),
            component_type: component.as_gl_enum(),
            components: elements.components,
            normalized: elements.normalized && !is_float,
        }
    };
    let matrix = part.local.as_ref().map(|local| local.frame.back().to_cols_array());
    PartHeader {
        mesh: part.primitive.mesh,
        primitive: part.primitive.index,
        attributes: source.attributes.iter().map(header).collect(),
        targets: source.targets.iter().map(|own| own.iter().map(header).collect()).collect(),
        matrix,
    }
}

/// What else each wedge carries: the bytes of the vertex that it was made from.
fn carried<'a>(
    geometry: &'a Geometry,
    sources: &'a [Source],
    surface: &SurfaceHeader,
) -> Box<dyn Fn(WedgeId) -> Vec<u8> + 'a> {
    let made: Vec<Vec<bool>> = surface
        .parts
        .iter()
        .map(|part| part.attributes.iter().map(|own| surface.is_made(&own.name)).collect())
        .collect();
    Box::new(move |wedge| {
        let vertex = geometry.welded.wedge_vertices[wedge.index()];
        let at = geometry.parts.partition_point(|part| part.first <= vertex) - 1;
        let vertex = (vertex - geometry.parts[at].first) as usize;
        let own = sources[at].attributes.iter().zip(&made[at]);
        let own = own.filter(|(_, made)| !**made).map(|(named, _)| named);
        let all = own.chain(sources[at].targets.iter().flatten());
        all.flat_map(|(_, elements)| elements.element(vertex)).copied().collect()
    })
}

/// What each part has beyond its surface.
fn wholes(
    geometry: &Geometry,
    sources: &[Source],
    refined: &Refined<'_>,
    made: &[LevelPart],
) -> Result<Vec<WholePart>> {
    // Triangles of the surface are those of the parts in order, without those that have no area.
    let mut vertices: Vec<[u32; 3]> = Vec::new();
    let mut further: Vec<Vec<u32>> = Vec::new();
    for (part, source) in geometry.parts.iter().zip(sources) {
        let mut own = Vec::new();
        for &triangle in &source.triangles {
            match is_degenerate(part, source, triangle) {
                true => own.extend(triangle),
                false => vertices.push(triangle),
            }
        }
        further.push(own);
    }
    if vertices.len() != geometry.welded.mesh.triangles.len() {
        return Err(Error::internal("triangles of a surface that are not those of its parts"));
    }
    let groups = &geometry.welded.mesh.groups;
    let mut corners = vec![Vec::new(); sources.len()];
    for &triangle in &refined.triangles {
        let triangle: TriangleId = triangle;
        corners[groups[triangle] as usize].extend(vertices[triangle.index()]);
    }
    let all = made.iter().zip(sources).zip(corners.iter().zip(&further));
    Ok(all
        .map(|((made, source), (corners, further))| {
            let elements: Vec<Elements> = made_elements(made, source);
            let corners = if corners.is_empty() { &[][..] } else { corners };
            WholePart::of(made, &elements, corners, further)
        })
        .collect())
}

/// Whether two corners of a triangle are one point.
fn is_degenerate(part: &Part, source: &Source, triangle: [u32; 3]) -> bool {
    let positions = source.attributes.iter().find(|(name, _)| name == "POSITION");
    let key = |vertex: u32| {
        let position = positions.map(|(_, elements)| elements.row(vertex as usize));
        let bits = position.into_iter().flatten().map(|x| (x + 0.0).to_bits()).collect::<Vec<_>>();
        (bits, part.motion(vertex as usize))
    };
    let [a, b, c] = triangle.map(key);
    a == b || b == c || c == a
}

/// The elements of the source in the types that they come out in.
fn made_elements(made: &LevelPart, source: &Source) -> Vec<Elements> {
    let types = made.attributes.iter().chain(made.targets.iter().flatten());
    types
        .zip(source.all())
        .map(|((_, made), (_, own))| {
            if made.shape() == own.shape() {
                return own.clone();
            }
            let bytes = own.floats().into_iter().flat_map(f32::to_le_bytes).collect();
            Elements { bytes, ..made.clone() }
        })
        .collect()
}
