//! The images of the levels, layout by layout, so that each image of the source is decoded once.

use std::sync::atomic::AtomicUsize;

use image::{ColorType, DynamicImage, ImageDecoder};
use rayon::prelude::*;
use seamwise_attr::Mesh;
use seamwise_texture::transfer::{Job, Output, Pair, Picture, Reading, Transferred, transfer};
use seamwise_texture::{Role, Validity, repair};

use super::plan::{Charts, ImageUse, NewNormals, UvLayout, faces};
use super::{BakeNormals, Origin, Plan, TransferOptions};
use crate::asset::{EncodedImage, ImageFormat};
use crate::dress::{LevelTextures, NormalMap};
use crate::error::{Error, Result};
use crate::images::{Encoding, decode, encode, encode_anew, open};

/// Levels gain a normal map for a loss of shading from this RMS angle on, in degrees.
const LOST: f64 = 1.0;

/// A level as it is worn.
pub(super) struct Worn<'a> {
    /// One per surface.
    pub(super) meshes: Vec<&'a Mesh>,
    /// The same with their sources.
    pub(super) pairs: Vec<Pair<'a>>,
}

/// Makes images.
pub(super) struct Maker<'a> {
    pub(super) origin: Origin<'a>,
    pub(super) plan: &'a Plan,
    pub(super) options: TransferOptions,
}

/// An image of a layout, of the source.
struct Original<'a> {
    own: &'a ImageUse,
    color: ColorType,
    size: [usize; 2],
    picture: Picture,
}

/// What is made of one layout at one size.
struct Sheet<'a> {
    layout: &'a UvLayout,
    /// Of the source's images.
    size: [usize; 2],
    originals: Vec<&'a Original<'a>>,
    normals: Vec<&'a NewNormals>,
}

impl Maker<'_> {
    /// The textures of all levels. `rows` counts the rows of texels that are made.
    pub(super) fn run(
        &self,
        levels: &[Worn<'_>],
        rows: &AtomicUsize,
    ) -> Result<Vec<LevelTextures>> {
        let images = self.origin.images.to_vec();
        let mut made = vec![LevelTextures { images, ..LevelTextures::default() }; levels.len()];
        for layout in &self.plan.layouts {
            let originals: Vec<Original<'_>> =
                layout.images.par_iter().map(|own| self.original(own)).collect::<Result<_>>()?;
            for sheet in self.sheets(layout, &originals) {
                for (level, (worn, textures)) in levels.iter().zip(&mut made).enumerate() {
                    let size = self.options.size(sheet.size, level);
                    self.make(&sheet, size, worn, textures, rows)?;
                }
            }
        }
        for textures in &mut made {
            let like: Vec<&String> = textures.normals.iter().map(|own| &own.like).collect();
            let has = |own: &NewNormals| like.contains(&&own.like);
            textures.sets = self.plan.normal_sets(self.origin.surfaces, has);
        }
        Ok(made)
    }

    /// How many rows of texels there are to make for so many levels.
    pub(super) fn rows(&self, levels: usize) -> Result<usize> {
        let mut rows = 0;
        for layout in &self.plan.layouts {
            let mut sizes = Vec::new();
            for own in &layout.images {
                let size = self.header_size(own.image)?;
                if !sizes.contains(&size) {
                    sizes.push(size);
                    rows +=
                        (0..levels).map(|level| self.options.size(size, level)[1]).sum::<usize>();
                }
            }
        }
        Ok(rows)
    }

    fn header_size(&self, image: usize) -> Result<[usize; 2]> {
        let encoded = &self.origin.asset.images[image];
        let decoder = open(&encoded.bytes, encoded.format.into(), self.origin.limit);
        let (width, height) = decoder
            .map_err(|e| Error::invalid(format!("/images/{image}"), e.to_string()))?
            .dimensions();
        Ok([width as usize, height as usize])
    }

    fn original<'a>(&self, own: &'a ImageUse) -> Result<Original<'a>> {
        let (image, role) = (own.image, own.role);
        let at = format!("/images/{image}");
        let decoded;
        let texels = match &self.origin.repairs[image].result {
            Ok(repaired) => &repaired.texels,
            Err(_) => {
                decoded = decode(&self.origin.asset.images[image], &at, self.origin.limit)?;
                &decoded
            }
        };
        let picture =
            Picture::new(texels, role).map_err(|error| Error::invalid(&at, error.to_string()))?;
        let size = [texels.width() as usize, texels.height() as usize];
        Ok(Original { own, color: texels.color(), size, picture })
    }

    /// The images of a layout by their sizes, with the normal maps that take their size.
    fn sheets<'a>(&'a self, layout: &'a UvLayout, originals: &'a [Original<'a>]) -> Vec<Sheet<'a>> {
        let mut sheets: Vec<Sheet<'a>> = Vec::new();
        for original in originals {
            let known = sheets.iter().position(|sheet| sheet.size == original.size);
            let at = known.unwrap_or_else(|| {
                let (size, originals, normals) = (original.size, Vec::new(), Vec::new());
                sheets.push(Sheet { layout, size, originals, normals });
                sheets.len() - 1
            });
            sheets[at].originals.push(original);
            if self.options.bake_normals != BakeNormals::Off {
                let own = self.plan.normals.iter().filter(|own| own.image == original.own.image);
                sheets[at].normals.extend(own);
            }
        }
        sheets
    }

    /// Makes the images of a sheet for one level.
    fn make(
        &self,
        sheet: &Sheet<'_>,
        size: [usize; 2],
        worn: &Worn<'_>,
        textures: &mut LevelTextures,
        rows: &AtomicUsize,
    ) -> Result<()> {
        let (charts, wrap) = (&sheet.layout.charts, sheet.layout.wrap);
        let outputs = sheet.outputs();
        let faces = faces(charts, &worn.meshes);
        let job = Job {
            pairs: &worn.pairs,
            faces: &faces,
            size,
            wrap,
            is_in_place: true,
            outputs: &outputs,
        };
        let internal = |error: seamwise_texture::Error| Error::Internal { what: error.to_string() };
        let Transferred { images, normal_degrees_rms } = transfer(&job, rows).map_err(internal)?;
        let fill = |((mut image, validity), output): ((DynamicImage, Validity), &Output<'_>)| {
            repair(&mut image, output.role, &validity, wrap).map_err(internal)?;
            Ok(image)
        };
        let filled = images.into_par_iter().zip(&outputs).map(fill).collect::<Result<Vec<_>>>()?;
        let (old, new) = filled.split_at(sheet.originals.len());
        let finish = |(original, image): (&&Original<'_>, &DynamicImage)| {
            let before = &self.origin.asset.images[original.own.image];
            Ok((original.own.image, encode_anew(image, before, Encoding::default())?))
        };
        let finished = sheet.originals.par_iter().zip(old).map(finish);
        for (index, image) in finished.collect::<Result<Vec<(usize, EncodedImage)>>>()? {
            textures.images[index] = image;
        }
        let is_lost = self.options.bake_normals == BakeNormals::On || normal_degrees_rms >= LOST;
        for (normals, image) in sheet.normals.iter().zip(new).filter(|_| is_lost) {
            textures.normals.push(NormalMap {
                image: encode(image, ImageFormat::Png)?,
                materials: normals.materials.clone(),
                like: normals.like.clone(),
            });
        }
        Ok(())
    }
}

impl Sheet<'_> {
    /// The source's images, then the new normal maps.
    fn outputs(&self) -> Vec<Output<'_>> {
        let charts = &self.layout.charts;
        let old = self.originals.iter().map(|original| {
            let reading = |(charts, &scale): (&Charts, &f32)| {
                Some(self.reading(charts, Some(&original.picture), scale))
            };
            let readings = charts.iter().zip(&original.own.normal_scales).map(reading).collect();
            Output { role: original.own.role, color: original.color, readings }
        });
        let new = self.normals.iter().map(|normals| {
            let reading = |charts: &Charts| {
                normals.charts.contains(charts).then(|| self.reading(charts, None, 1.0))
            };
            let readings = charts.iter().map(reading).collect();
            Output { role: Role::Normal, color: ColorType::Rgb8, readings }
        });
        old.chain(new).collect()
    }

    fn reading<'a>(
        &self,
        charts: &Charts,
        picture: Option<&'a Picture>,
        normal_scale: f32,
    ) -> Reading<'a> {
        let Charts { uv_set, transform, .. } = *charts;
        let wrap = self.layout.wrap;
        let level_normal_scale = normal_scale;
        Reading { picture, uv_set, transform, wrap, normal_scale, level_normal_scale }
    }
}

impl TransferOptions {
    /// The size of a level's image, where the source's is of `size`; level 0 is the first.
    fn size(&self, size: [usize; 2], level: usize) -> [usize; 2] {
        let factor = self.scale.powi(level as i32 + 1);
        size.map(|side| ((side as f64 * factor).round() as usize).clamp(1, side))
    }
}
