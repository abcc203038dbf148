//! Bakes of files and of bytes.

use std::path::{Path, PathBuf};
use std::time::Duration;

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use seamwise::bake::options::{BudgetPer, ReportOptions, Targets, TextureFiles, Textures};
use seamwise::bake::{Input, bake as bake_to, bake_in_memory};
use seamwise::batch::{Job, Shard, parse_manifest};
use seamwise::export::files::{Format, Geomorph, Layout, OutputOptions};
use seamwise::import::options::ReadOptions;
use seamwise::transfer::{TextureFormat, TransferOptions};
use seamwise::{BakeOptions, Error};

use crate::errors::raise;
use crate::evaluate::{Looks, Source};
use crate::progress::Watch;

/// The number of KTX2 among the formats of textures.
const KTX2: usize = 5;

/// The options of a bake under the names of the command line; `None` stands for the tool's default.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Keywords {
    ratios: Option<Vec<f64>>,
    triangles: Option<Vec<usize>>,
    textures: Option<String>,
    texture_format: Option<String>,
    texture_quality: Option<u8>,
    png: Option<String>,
    budget_per: Option<String>,
    layout: Option<String>,
    format: Option<String>,
    polish: bool,
    evaluate: bool,
    report: bool,
    compress: bool,
    progressive: bool,
    geomorph: Option<String>,
    reach_target: bool,
    keep_volume: bool,
    max_error: Option<f64>,
    join_distance: Option<f64>,
    allow_missing: bool,
    allow_outside: bool,
    strict: bool,
    time_limit: Option<f64>,
    memory_limit: Option<String>,
    resume: bool,
}

/// Bakes: the report as JSON, or nothing if all of it was in the folder already, and a dictionary of names
/// and bytes, which is empty if there is a folder to write to.
#[pyfunction]
#[allow(clippy::needless_pass_by_value, reason = "arguments of Python are extracted by value")]
pub(crate) fn bake<'py>(
    py: Python<'py>,
    source: Source,
    name: &str,
    folder: Option<PathBuf>,
    keywords: Keywords,
    looks: Looks,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Option<String>, Bound<'py, PyDict>)> {
    let path = source.path().map(Path::to_owned);
    let fail = |error: &Error| raise(py, error, path.as_deref());
    let options = keywords.resolve(looks).map_err(|error| fail(&error))?;
    let input = source.input(name);
    let watch = Watch::new(progress);
    let run = || match &folder {
        Some(folder) if keywords.resume && is_done(&source, name, folder, &options) => {
            Ok((None, Vec::new()))
        }
        Some(folder) => {
            let report = bake_to(input, folder, &options, &watch.progress())?;
            Ok((Some(report.to_json()?), Vec::new()))
        }
        None => {
            let baked = bake_in_memory(input, &options, &watch.progress())?;
            Ok((Some(baked.report.to_json()?), baked.files))
        }
    };
    let done = py.detach(run);
    if let Some(ended) = watch.take() {
        return Err(ended);
    }
    let (report, files) = done.map_err(|error| fail(&error))?;
    let own = PyDict::new(py);
    for file in files {
        own.set_item(file.name, PyBytes::new(py, &file.bytes))?;
    }
    Ok((report, own))
}

/// The inputs that the text of a list names, or one part of them, like `2/8`.
#[pyfunction]
pub(crate) fn manifest(py: Python<'_>, text: &str, shard: Option<&str>) -> PyResult<Vec<PathBuf>> {
    let mut inputs = parse_manifest(text);
    let Some(shard) = shard else { return Ok(inputs) };
    // As the tool does before it splits them.
    inputs.sort();
    let shard: Result<Shard, String> = shard.parse();
    let shard = shard.map_err(|what| raise(py, &Error::Options { what }, None))?;
    Ok(shard.take(inputs))
}

/// Whether the outputs of a file are in a folder already.
fn is_done(source: &Source, name: &str, folder: &Path, options: &BakeOptions) -> bool {
    let job = |input: &Path| Job {
        folder: folder.to_owned(),
        input: input.to_owned(),
        name: name.to_owned(),
    };
    source.path().is_some_and(|input| job(input).is_done(options))
}

impl Source {
    fn input<'a>(&'a self, name: &'a str) -> Input<'a> {
        match self {
            Self::Bytes(bytes) => Input::Bytes(bytes, name),
            Self::Path(path) => Input::FileAs(path, name),
        }
    }
}

impl Keywords {
    fn resolve(&self, looks: Looks) -> Result<BakeOptions, Error> {
        let base = BakeOptions::default();
        let mut steering = base.steering;
        steering.max_error = self.max_error;
        steering.join_distance = self.join_distance;
        steering.keep_volume = self.keep_volume;
        steering.max_deviation = steering.max_deviation.filter(|_| !self.reach_target);
        steering.check()?;
        let mut screen = base.screen;
        screen.pixel_tolerance = looks.options().pixel_tolerance;
        let limit = self.time_limit.map(Duration::try_from_secs_f64).transpose();
        let bad = |_| Error::Options { what: "the time limit is a number of seconds".into() };
        Ok(BakeOptions {
            targets: self.targets()?,
            budget_per: match choice("budget_per", self.budget_per.as_ref(), &["scene", "mesh"])? {
                0 => BudgetPer::Scene,
                _ => BudgetPer::Mesh,
            },
            steering,
            polish: base.polish.filter(|_| self.polish),
            textures: self.textures()?,
            texture_files: self.texture_files()?,
            evaluate: self.evaluate.then(|| looks.options()),
            screen,
            report: self.report.then(ReportOptions::default),
            reading: ReadOptions {
                allow_missing: self.allow_missing,
                allow_outside: self.allow_outside,
                strict: self.strict,
                memory_limit: match &self.memory_limit {
                    Some(text) => text.parse()?,
                    None => base.reading.memory_limit,
                },
                ..base.reading
            },
            time_limit: limit.map_err(bad)?,
            output: self.output()?,
            ..base
        })
    }

    fn targets(&self) -> Result<Targets, Error> {
        match (&self.ratios, &self.triangles) {
            (Some(ratios), None) => Targets::ratios(ratios.clone()),
            (None, Some(counts)) => Targets::triangles(counts.clone()),
            (None, None) => Ok(Targets::default()),
            (Some(_), Some(_)) => {
                Err(Error::Options { what: "give ratios or triangles, not both".into() })
            }
        }
    }

    fn textures(&self) -> Result<Textures, Error> {
        let Some(name) = &self.textures else {
            let shares = Textures::are_shared_by_default(None, self.output()?);
            return Ok(if shares { Textures::Repair } else { self.chosen()? });
        };
        Ok(match choice("textures", Some(name), &["auto", "repair", "transfer", "keep"])? {
            0 => self.chosen()?,
            1 => Textures::Repair,
            2 => Textures::Transfer(self.transfer()?),
            _ => Textures::Keep,
        })
    }

    fn geomorph(&self) -> Result<Geomorph, Error> {
        let all = [Geomorph::None, Geomorph::Attributes, Geomorph::Target];
        let names = ["none", "attributes", "target"];
        choice("geomorph", self.geomorph.as_ref(), &names).map(|own| all[own])
    }

    fn chosen(&self) -> Result<Textures, Error> {
        Ok(Textures::Transfer(TransferOptions { chooses: true, ..self.transfer()? }))
    }

    fn transfer(&self) -> Result<TransferOptions, Error> {
        let base = TransferOptions::default();
        let quality = self.texture_quality.unwrap_or(base.quality);
        if !(1..=100).contains(&quality) {
            let what = format!("texture_quality is {quality}: it is one of 1 to 100");
            return Err(Error::Options { what });
        }
        let format = match self.texture_format()? {
            0 => TextureFormat::Keep,
            2 => TextureFormat::Jpeg,
            3 => TextureFormat::WebP,
            4 => TextureFormat::LossyWebP,
            // KTX2 is made of what was stored without loss.
            _ => TextureFormat::Png,
        };
        Ok(TransferOptions { format, quality, ..base })
    }

    fn texture_files(&self) -> Result<TextureFiles, Error> {
        let format = self.texture_format()?;
        let has_own = matches!(self.textures()?, Textures::Transfer(_));
        if !has_own && (self.texture_quality.is_some() || !matches!(format, 0 | KTX2)) {
            let what = "texture_format and texture_quality need textures=\"auto\" or \"transfer\"";
            return Err(Error::Options { what: what.into() });
        }
        let smallest_png = choice("png", self.png.as_ref(), &["fast", "smallest"])? == 1;
        Ok(TextureFiles { ktx2: format == KTX2, smallest_png })
    }

    /// The number of the format among those that there are.
    fn texture_format(&self) -> Result<usize, Error> {
        let formats = ["keep", "png", "jpeg", "webp", "webp-lossy", "ktx2"];
        choice("texture_format", self.texture_format.as_ref(), &formats)
    }

    fn output(&self) -> Result<OutputOptions, Error> {
        let layouts = [Layout::None, Layout::MsftLod, Layout::Names, Layout::Needle];
        let formats = [Format::Glb, Format::Gltf];
        let names = ["none", "msft_lod", "names", "needle"];
        let layout = choice("layout", self.layout.as_ref(), &names)?;
        let format = choice("format", self.format.as_ref(), &["glb", "gltf"])?;
        Ok(OutputOptions {
            compress: self.compress,
            format: formats[format],
            layout: layouts[layout],
            share_vertices: false,
            progressive: self.progressive,
            geomorph: self.geomorph()?,
        })
    }
}

/// The number of a name among those that there are, 0 for none.
fn choice(what: &str, name: Option<&String>, names: &[&str]) -> Result<usize, Error> {
    let Some(name) = name else { return Ok(0) };
    names.iter().position(|own| own == name).ok_or_else(|| {
        let what = format!("{name:?} is no {what}: it is one of {}", names.join(", "));
        Error::Options { what }
    })
}
