//! Repairs of images in memory, and of files.

use std::path::PathBuf;

use numpy::{Element, PyArray1, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use seamwise::glam::Vec2;
use seamwise::image::{DynamicImage, ImageBuffer, Pixel};
use seamwise::repair::options::{MeshOptions, RepairOptions};
use seamwise::repair::repair_file as repair_to;
use seamwise::texture::{Background, Repair, Role, Validity, Wrap};

use crate::arrays::{rows, table};
use crate::errors::{raise, refuse};

/// The texels of an image, of shape (height, width, channels).
#[derive(FromPyObject)]
pub(crate) enum Texels<'py> {
    U8(PyReadonlyArray3<'py, u8>),
    U16(PyReadonlyArray3<'py, u16>),
    F32(PyReadonlyArray3<'py, f32>),
}

/// What tells which texels are valid.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Charts<'py> {
    uvs: Option<PyReadonlyArray2<'py, f32>>,
    triangles: Option<PyReadonlyArray2<'py, u32>>,
    mask: Option<PyReadonlyArray2<'py, bool>>,
}

/// The meaning of texels, and how they are read.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Keywords {
    role: Option<String>,
    wrap: Option<String>,
    keep_padding: usize,
}

/// Fills the texels that are not valid. Those that are, by UVs, by a mask, by both or, without either, by
/// the background, are to the bit what they were.
#[pyfunction]
#[allow(clippy::needless_pass_by_value, reason = "arguments of Python are extracted by value")]
pub(crate) fn repair<'py>(
    py: Python<'py>,
    texels: Texels<'py>,
    charts: Charts<'py>,
    keywords: Keywords,
) -> PyResult<Bound<'py, PyDict>> {
    let bad = |what: String| refuse(py, "OptionsError", what);
    let mut image = texels
        .image()
        .ok_or_else(|| bad("images have 1 to 4 channels, of 32-bit floats 3 or 4".to_owned()))?;
    let role = keywords.role().map_err(bad)?.unwrap_or_default();
    let wrap = [keywords.wrap().map_err(bad)?; 2];
    let mut validity = charts.validity(py, &image, wrap)?;
    let run = || {
        let repair = Repair::new(role).wrap(wrap).keep_padding(keywords.keep_padding);
        repair.run(&mut image, &mut validity)
    };
    let done = py.detach(run).map_err(|error| refuse(py, "InvalidError", error))?;
    let own = PyDict::new(py);
    own.set_item("image", array(py, image)?)?;
    let width = validity.width();
    own.set_item("valid", table(py, validity.flags().to_vec(), width)?)?;
    own.set_item("filled", done.outcome.filled)?;
    own.set_item("remaining", done.outcome.remaining)?;
    own.set_item("padding", done.padding)?;
    Ok(own)
}

/// Repairs a file: an asset or a picture. The report comes as JSON.
#[pyfunction]
#[allow(clippy::needless_pass_by_value, reason = "arguments of Python are extracted by value")]
pub(crate) fn repair_file(
    py: Python<'_>,
    input: PathBuf,
    output: PathBuf,
    mesh: Option<PathBuf>,
    mask: Option<PathBuf>,
    background: &str,
    keywords: Keywords,
) -> PyResult<String> {
    let fail = |error| raise(py, &error, Some(&input));
    let options = RepairOptions {
        mesh: mesh.map(|file| MeshOptions { file, uv_set: 0, name: None }),
        mask,
        background: background.parse().map_err(fail)?,
        role: keywords.role().map_err(|what| refuse(py, "OptionsError", what))?,
        keep_padding: keywords.keep_padding,
        ..RepairOptions::default()
    };
    let report = py.detach(|| repair_to(&input, &output, &options)).map_err(fail)?;
    Ok(report.to_json())
}

impl Keywords {
    fn role(&self) -> Result<Option<Role>, String> {
        Ok(Some(match self.role.as_deref() {
            None => return Ok(None),
            Some("color") => Role::Color,
            Some("normal") => Role::Normal,
            Some("data") => Role::Data,
            Some(other) => {
                return Err(format!("{other:?} is no role: \"color\", \"normal\" or \"data\""));
            }
        }))
    }

    fn wrap(&self) -> Result<Wrap, String> {
        match self.wrap.as_deref() {
            None | Some("repeat") => Ok(Wrap::Repeat),
            Some("mirror") => Ok(Wrap::Mirror),
            Some("clamp") => Ok(Wrap::Clamp),
            Some(other) => {
                Err(format!("{other:?} is no wrap: \"repeat\", \"mirror\" or \"clamp\""))
            }
        }
    }
}

impl Charts<'_> {
    fn validity(
        &self,
        py: Python<'_>,
        image: &DynamicImage,
        wrap: [Wrap; 2],
    ) -> PyResult<Validity> {
        let bad = |what: String| refuse(py, "OptionsError", what);
        let (width, height) = (image.width() as usize, image.height() as usize);
        let mask = self.mask.as_ref().map(|mask| {
            let (rows, columns) = mask.as_array().dim();
            if (rows, columns) != (height, width) {
                let what = format!("a mask of {rows}×{columns} for an image of {height}×{width}");
                return Err(bad(what));
            }
            let flags = mask.as_slice().map_err(PyErr::from)?.to_vec();
            Ok(Validity::from_flags(width, height, flags))
        });
        let mask = mask.transpose()?;
        let covered = match (&self.uvs, &self.triangles) {
            (Some(uvs), Some(triangles)) => {
                let uvs = rows::<f32, 2>(uvs, "uvs")?;
                let triangles = rows::<u32, 3>(triangles, "triangles")?;
                if let Some(wrong) =
                    triangles.as_flattened().iter().find(|&&at| at as usize >= uvs.len())
                {
                    return Err(bad(format!("a triangle has vertex {wrong} of {}", uvs.len())));
                }
                let uvs: Vec<Vec2> = uvs.iter().map(|&uv| uv.into()).collect();
                Some(Validity::from_charts(width, height, wrap, &uvs, triangles))
            }
            (None, None) => None,
            _ => return Err(bad("give UVs and triangles, or neither".into())),
        };
        match (covered, mask) {
            (Some(mut covered), Some(mask)) => {
                covered.intersect(&mask);
                Ok(covered)
            }
            (Some(one), None) | (None, Some(one)) => Ok(one),
            (None, None) => Background::detect(image, 0.0)
                .map(|background| background.validity())
                .ok_or_else(|| bad("the image has no background: give UVs or a mask".into())),
        }
    }
}

impl Texels<'_> {
    /// The image, if it has as many channels as images may.
    fn image(&self) -> Option<DynamicImage> {
        use DynamicImage as D;
        Some(match self {
            Self::U8(own) => match own.as_array().dim().2 {
                1 => D::ImageLuma8(buffer(own)?),
                2 => D::ImageLumaA8(buffer(own)?),
                3 => D::ImageRgb8(buffer(own)?),
                4 => D::ImageRgba8(buffer(own)?),
                _ => return None,
            },
            Self::U16(own) => match own.as_array().dim().2 {
                1 => D::ImageLuma16(buffer(own)?),
                2 => D::ImageLumaA16(buffer(own)?),
                3 => D::ImageRgb16(buffer(own)?),
                4 => D::ImageRgba16(buffer(own)?),
                _ => return None,
            },
            Self::F32(own) => match own.as_array().dim().2 {
                3 => D::ImageRgb32F(buffer(own)?),
                4 => D::ImageRgba32F(buffer(own)?),
                _ => return None,
            },
        })
    }
}

fn buffer<P: Pixel>(
    texels: &PyReadonlyArray3<'_, P::Subpixel>,
) -> Option<ImageBuffer<P, Vec<P::Subpixel>>>
where
    P::Subpixel: Element,
{
    let (height, width, _) = texels.as_array().dim();
    let values = texels.as_slice().ok()?.to_vec();
    ImageBuffer::from_raw(u32::try_from(width).ok()?, u32::try_from(height).ok()?, values)
}

/// The texels of an image of the same kind as the one that came.
fn array(py: Python<'_>, image: DynamicImage) -> PyResult<Bound<'_, PyAny>> {
    let size = [image.height() as usize, image.width() as usize];
    let channels = usize::from(image.color().channel_count());
    fn shaped<T: Element>(
        py: Python<'_>,
        values: Vec<T>,
        shape: [usize; 3],
    ) -> PyResult<Bound<'_, PyAny>> {
        Ok(PyArray1::from_vec(py, values).reshape(shape)?.into_any())
    }
    let shape = [size[0], size[1], channels];
    match image {
        DynamicImage::ImageLuma8(own) => shaped(py, own.into_raw(), shape),
        DynamicImage::ImageLumaA8(own) => shaped(py, own.into_raw(), shape),
        DynamicImage::ImageRgb8(own) => shaped(py, own.into_raw(), shape),
        DynamicImage::ImageRgba8(own) => shaped(py, own.into_raw(), shape),
        DynamicImage::ImageLuma16(own) => shaped(py, own.into_raw(), shape),
        DynamicImage::ImageLumaA16(own) => shaped(py, own.into_raw(), shape),
        DynamicImage::ImageRgb16(own) => shaped(py, own.into_raw(), shape),
        DynamicImage::ImageRgba16(own) => shaped(py, own.into_raw(), shape),
        DynamicImage::ImageRgb32F(own) => shaped(py, own.into_raw(), shape),
        DynamicImage::ImageRgba32F(own) => shaped(py, own.into_raw(), shape),
        _ => Err(refuse(py, "InternalError", "an image of another kind came back")),
    }
}
