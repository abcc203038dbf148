//! The texels of a level, each sampled from the source surface itself.
//!
//! A level's UVs slide over its textures, and a repair fills with what is likely where they leave
//! the charts. A transfer makes it right instead: every texel of a level's charts, and of the gutter
//! around them, takes the place of the source that is nearest to it (`correspond`), and every image of
//! the source is read there ([`Picture`]), colors in linear light. Whatever no chart covers is left
//! to [`repair`](fn@crate::repair).
//!
//! A normal map takes the source's shading normal, its own normal map included, in the tangent space
//! of the level (MikkTSpace; Cignoni, Montani, Rocchini & Scopigno, "A general method for preserving
//! attribute values on simplified meshes", Visualization 1998; Cohen, Olano & Manocha,
//! "Appearance-preserving simplification", SIGGRAPH 1998): so it carries the shape that the level
//! has lost.
//!
//! A texel larger than the source's is the mean of up to 4² parts, each with a place of its own, so
//! that geometry finer than a texel is averaged too; what is larger still reads mip maps.
//!
//! Guaranteed: a level equal to its source, in an image of the same size, gets the texels that the
//! source has, but for rounding; a place of the source is of the same group, and faces the same way
//! wherever the group has such a place; the same at any thread count. Not guaranteed: that of two
//! sheets of one group that face the same way, nearer to each other than the level is to the source,
//! the right one is found.
//!
//! Where charts of the level overlap, a texel is the mean of what its places ask for, by the area of
//! each on the level; of normals in the tangent space of each place, so that both halves of a mirrored
//! face are served. Whether that does for all of them is told by [`errors`](fn@errors).

mod correspond;
mod errors;
mod level_face;
mod owners;
mod picture;
mod places;
mod row;
mod shading_mesh;

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Affine2, Vec2, Vec3, Vec4};
use image::{ColorType, DynamicImage};
use rayon::prelude::*;
use seamwise_attr::Mesh;

use crate::error::Result;
use crate::role::Role;
use crate::samples::with_buffer;
use crate::validity::Validity;
use crate::wrap::Wrap;
use level_face::LevelFace;
use owners::Owners;
use places::BLOCK;
use row::{Angles, Maker, Rows, write};

use correspond::LevelPoint;
pub use correspond::Source;
pub use errors::{ImageErrors, errors};
pub use picture::Picture;
pub use shading_mesh::ShadingMesh;

/// Places along each side of a texel, at most.
const MOST_PARTS: usize = 4;
/// The width of the gutter around charts where texels are made too, in texels: bilinear taps at the
/// rims of charts read no farther.
const GUTTER: f64 = 1.5;
/// The share of the angle from which on images are gained below which an estimate of it need not be
/// right: of one in 64 texels.
const SURELY: f64 = 0.75;
/// Rows that are made before they are written.
const ROWS: usize = 128;

/// A level of a source.
#[derive(Clone, Copy)]
pub struct Pair<'a> {
    /// The source of its texels.
    pub source: &'a Source<'a>,
    /// The level; its groups are the source's.
    pub level: ShadingMesh<'a>,
}

/// A triangle of a level in the atlas.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// Index of its pair.
    pub pair: u32,
    /// Its number in the level.
    pub triangle: u32,
    /// Index of its reading in each output's.
    pub reading: u32,
    /// Its corners in the atlas.
    pub uvs: [Vec2; 3],
}

/// The sampling of an image by triangles of the source.
#[derive(Clone, Copy, Debug)]
pub struct Reading<'a> {
    /// The image; none reads as white, or as a flat normal.
    pub picture: Option<&'a Picture>,
    /// Whether the colors of the source's vertices are read instead, in linear light.
    pub vertex_colors: bool,
    /// The UV set of the mesh.
    pub uv_set: usize,
    /// The transform from the mesh's UV to the image's.
    pub transform: Affine2,
    /// The wrap modes of UVs outside 0…1, for u and v.
    pub wrap: [Wrap; 2],
    /// Factor on x and y of a normal as the source reads it.
    pub normal_scale: f32,
    /// Factor on x and y of a normal as the level reads it.
    pub level_normal_scale: f32,
    /// Factor on each channel that is read, colors in linear light; normals have none.
    pub factor: Vec4,
    /// Offset added to each channel then.
    pub offset: Vec4,
}

impl Default for Reading<'_> {
    /// A reading of no image.
    fn default() -> Self {
        Self {
            picture: None,
            vertex_colors: false,
            uv_set: 0,
            transform: Affine2::IDENTITY,
            wrap: [Wrap::default(); 2],
            normal_scale: 1.0,
            level_normal_scale: 1.0,
            factor: Vec4::ONE,
            offset: Vec4::ZERO,
        }
    }
}

/// An image to be made.
#[derive(Clone, Debug)]
pub struct Output<'a> {
    /// The meaning of its texels.
    pub role: Role,
    /// The format that they are stored in.
    pub color: ColorType,
    /// The sources of its texels, one for each reading that a face names; `None` for faces that do
    /// not have it.
    pub readings: Vec<Option<Reading<'a>>>,
}

/// An atlas to be made anew.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// The surfaces.
    pub pairs: &'a [Pair<'a>],
    /// Their triangles.
    pub faces: &'a [Face],
    /// Width and height of all images.
    pub size: [usize; 2],
    /// The wrap modes with which the level reads them beyond their edges.
    pub wrap: [Wrap; 2],
    /// Whether the level's charts lie where the source's do. Then what lies around those is taken over:
    /// a level equal to its source reads the same up to its rims.
    pub is_in_place: bool,
    /// The images.
    pub outputs: &'a [Output<'a>],
    /// The images among them that are not always wanted.
    pub gained: Option<Gained>,
}

/// Images that a level gains where it has lost shape.
#[derive(Clone, Copy, Debug)]
pub struct Gained {
    /// The first of them: all after it are gained too.
    pub first: usize,
    /// The RMS angle between the shading normals of the source and the level's own, in degrees, below
    /// which they are not wanted. They may be made all the same.
    pub least_degrees: f64,
}

/// The result of a transfer.
#[derive(Clone, Debug)]
pub struct Transferred {
    /// One per output, with the texels that were made, others hold nothing; fewer if those that are gained
    /// are not wanted.
    pub images: Vec<(DynamicImage, Validity)>,
    /// RMS angle between the shading normals of the source and the level's own, in degrees; estimated from
    /// some texels if what is gained was not made.
    pub normal_degrees_rms: f64,
}

/// Makes the images of an atlas. `rows` counts those that are done.
///
/// # Errors
/// [`Error::Invalid`](crate::Error::Invalid) if an output's kind of image is none that
/// [`repair`](fn@crate::repair) knows.
pub fn transfer(job: &Job<'_>, rows: &AtomicUsize) -> Result<Transferred> {
    let [width, height] = job.size;
    let parts = job.parts();
    let fine = job.size.map(|side| side * parts);
    let owners = Owners::new(fine, job.wrap, job.faces, GUTTER * parts as f64);
    let blank = |output: &Output<'_>| DynamicImage::new(width as u32, height as u32, output.color);
    let (lods, texels) = (job.lods(fine), job.texels());
    let faces = job.faces.iter().map(|face| LevelFace::new(job, face, fine)).collect();
    let maker = Maker { job, owners: &owners, parts, faces, lods, texels };
    let estimate = job.gained.map(|gained| (gained, maker.degrees_of_some()));
    let unwanted = estimate.filter(|(own, degrees)| *degrees < SURELY * own.least_degrees);
    let outputs = &job.outputs[..unwanted.map_or(job.outputs.len(), |(own, _)| own.first)];
    let mut images: Vec<DynamicImage> = outputs.iter().map(blank).collect();
    let mut made = vec![Vec::with_capacity(width * height); outputs.len()];
    let mut angles = Angles::default();
    for first in (0..height).step_by(ROWS) {
        let blocks: Vec<Rows> = (first..(first + ROWS).min(height))
            .into_par_iter()
            .step_by(BLOCK)
            .map(|top| {
                let made = maker.rows(top, outputs.len());
                rows.fetch_add(BLOCK.min(height - top), Ordering::Relaxed);
                made
            })
            .collect();
        blocks.iter().for_each(|rows| angles.add(rows.angles));
        for (index, (image, output)) in images.iter_mut().zip(outputs).enumerate() {
            let own = |rows: &Rows| {
                let count = rows.made.len() / outputs.len();
                index * count..(index + 1) * count
            };
            let values: Vec<&[Vec4]> =
                blocks.iter().flat_map(|rows| rows.values[own(rows)].chunks(width)).collect();
            with_buffer!(image, buffer => write(buffer, output.role, first, &values))?;
            blocks.iter().for_each(|rows| made[index].extend_from_slice(&rows.made[own(rows)]));
        }
    }
    let validity = |made| Validity::from_flags(width, height, made);
    Ok(Transferred {
        images: images.into_iter().zip(made.into_iter().map(validity)).collect(),
        normal_degrees_rms: unwanted.map_or(angles.degrees_rms(), |(_, degrees)| degrees),
    })
}

/// The share of the texels covered by triangles that several of them cover, in an image of `size`.
pub fn overlap(faces: &[Face], size: [usize; 2], wrap: [Wrap; 2]) -> f64 {
    let owners = Owners::new(size, wrap, faces, 0.0);
    owners.overlaps as f64 / owners.covered.max(1) as f64
}

impl Face {
    /// The UV at weights of the corners.
    fn uv(&self, weights: Vec3) -> Vec2 {
        let [a, b, c] = self.uvs;
        a * weights.x + b * weights.y + c * weights.z
    }
}

impl Job<'_> {
    /// Number of places that are read along each side of a texel: about as many as texels of the
    /// source lie there, in the largest image.
    fn parts(&self) -> usize {
        let ratio = |output: usize| {
            let areas = self.faces.iter().map(|face| self.texel_areas(face, output, self.size));
            let [source, own] =
                areas.fold([0.0; 2], |sum, area| [sum[0] + area[0], sum[1] + area[1]]);
            if own > 0.0 { (source / own).sqrt() } else { 1.0 }
        };
        let most = (0..self.outputs.len()).map(ratio).fold(1.0, f64::max);
        (most.round() as usize).clamp(1, MOST_PARTS)
    }

    /// One per face and output: the level of detail at which its image is read, for texels of an
    /// image of this size.
    fn lods(&self, size: [usize; 2]) -> Vec<f32> {
        let lod = |face: &Face, output: usize| {
            let [source, own] = self.texel_areas(face, output, size);
            if own > 0.0 && source > 0.0 { (0.5 * (source / own).log2()) as f32 } else { 0.0 }
        };
        let outputs = 0..self.outputs.len();
        self.faces.iter().flat_map(|face| outputs.clone().map(move |at| lod(face, at))).collect()
    }

    /// One per face: the side of a texel on the level, in the units of its mesh.
    fn texels(&self) -> Vec<f32> {
        let size = Vec2::new(self.size[0] as f32, self.size[1] as f32);
        let side = |face: &Face| {
            let [a, b, c] = face.uvs.map(|uv| (uv * size).as_dvec2());
            let texels = (b - a).perp_dot(c - a).abs();
            let level = self.pairs[face.pair as usize].level.mesh;
            let area = 2.0 * surface_area(level, face.triangle as usize);
            if texels > 0.0 { (area / texels).sqrt() as f32 } else { 0.0 }
        };
        self.faces.iter().map(side).collect()
    }

    /// The area of a face in texels of the source's image, and in those of an atlas of this size.
    fn texel_areas(&self, face: &Face, output: usize, size: [usize; 2]) -> [f64; 2] {
        let area = |corners: [Vec2; 3], size: Vec2| {
            let [a, b, c] = corners.map(|uv| (uv * size).as_dvec2());
            0.5 * (b - a).perp_dot(c - a).abs()
        };
        let own = area(face.uvs, Vec2::new(size[0] as f32, size[1] as f32));
        let reading = &self.outputs[output].readings[face.reading as usize];
        let Some((reading, picture)) = reading.and_then(|r| Some((r, r.picture?))) else {
            return [own; 2];
        };
        let Pair { source, level } = &self.pairs[face.pair as usize];
        let read = |mesh: &Mesh, triangle: usize| {
            let wedges = mesh.triangles[triangle];
            wedges.map(|w| reading.transform.transform_point2(mesh.uv(w, reading.uv_set)))
        };
        let triangle = face.triangle as usize;
        if reading.uv_set < level.mesh.layout.uv_sets {
            return [area(read(level.mesh, triangle), picture.size()), own];
        }
        // A level without the source's UVs shows what lies there: as many texels for an area as the triangles
        // of the source have at four places.
        let [mut there, mut shown] = [0.0; 2];
        let points = LevelPoint::of_triangle(level, triangle);
        for place in points.iter().filter_map(|point| source.find(point, None)) {
            there += area(read(source.side.mesh, place.triangle), picture.size());
            shown += surface_area(source.side.mesh, place.triangle);
        }
        let density = if shown > 0.0 { there / shown } else { 0.0 };
        [density * surface_area(level.mesh, triangle), own]
    }
}

/// The area of a triangle in space.
fn surface_area(mesh: &Mesh, triangle: usize) -> f64 {
    let [a, b, c] = mesh.triangle_positions(triangle).map(Vec3::as_dvec3);
    0.5 * (b - a).cross(c - a).length()
}
