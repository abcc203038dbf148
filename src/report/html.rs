//! A report as one HTML page that needs nothing but itself: no font, no network, no script but that of
//! the interactive view, without which it can be read as well.
//!
//! Guaranteed: the same report makes the same bytes; what a run costs (times and memory) is in the
//! one section `id="cost"`. Text from files is escaped.

use askama::Template;
use seamwise_texture::Role;

use super::chart::{COLORS, Chart};
use super::choices::choice_rows;
use super::columns::size;
use super::cost::{Bar, counted, machine, timing_bars};
use super::figures::{Measured, charts, file_name, series_of, short_names, solids};
use super::frame::{CHARTS, Frame};
use super::level_textures::TexturePictures;
use super::meshes::mesh_rows;
use super::pictures::{AtlasPicture, AtlasPictures, Gallery, Picture};
use super::table::{COLUMNS, header};
use super::threads::thread_charts;
use super::ticks::grouped;
use super::verdict::{FileSize, Verdict, verdicts};
use super::viewer::{self, Viewer};
use super::{BakeReport, CandidateReport, EvaluateReport};
use crate::error::{Error, Result};
use crate::evaluate::Metrics;
use crate::evaluate::heat::{WHITE, heat_color};
use crate::evaluate::scene::Mode;
use crate::warning::Warnings;

/// Additions to the page of a bake beyond its report.
#[derive(Default)]
pub struct Extras {
    /// The source and the levels, to be turned.
    pub viewer: Option<Viewer>,
    /// The source and the levels.
    pub gallery: Option<Gallery>,
    /// The atlases, if they were repaired.
    pub atlases: AtlasPictures,
    /// The textures of each level, if levels have any of their own.
    pub(crate) level_textures: Vec<TexturePictures>,
    /// The files that were written, with their bytes.
    pub(crate) files: Vec<FileSize>,
    /// The options of the bake in words.
    pub(crate) options: Vec<String>,
}

/// Most mip levels in the table of an atlas: what is read of smaller ones, little is seen of.
const MOST_MIPS: usize = 5;

#[derive(Template)]
#[template(path = "page.html")]
struct Page<'a> {
    frame: Frame,
    facts: Vec<String>,
    viewer: String,
    header: [String; COLUMNS],
    rows: Vec<Row>,
    verdicts: Vec<Verdict>,
    options: &'a [String],
    meshes: Vec<Vec<String>>,
    choices: Vec<Vec<String>>,
    notes: Vec<Note>,
    charts: Vec<Chart>,
    perfect: Vec<&'static str>,
    solids: Vec<[String; 5]>,
    columns: Vec<Column>,
    views: Vec<View<'a>>,
    legend: Vec<Stop>,
    atlases: Vec<AtlasBlock<'a>>,
    atlas_notes: Vec<String>,
    level_textures: &'a [TexturePictures],
    timings: Vec<Bar>,
    peak_memory: Option<String>,
    /// What it ran on, and when.
    machine: Vec<String>,
    threads: Vec<Chart>,
    thread_runs: usize,
}

/// A row of the table.
struct Row {
    cells: [String; COLUMNS],
    /// Color of its series in the charts, if they draw more than one.
    color: Option<usize>,
}

impl Row {
    /// A row of the text table, with its count of triangles set for reading.
    fn new(mut cells: [String; COLUMNS], color: Option<usize>) -> Self {
        if let Ok(triangles) = cells[1].parse() {
            cells[1] = grouped(triangles);
        }
        Self { cells, color: color.map(|color| color % COLORS) }
    }
}

/// A line below the table.
struct Note {
    is_warning: bool,
    text: String,
}

/// A scene in the contact sheets.
struct Column {
    name: String,
    detail: String,
}

/// A camera's pictures of all scenes.
struct View<'a> {
    number: usize,
    /// From the middle to its camera, as the interactive view reads it.
    direction: String,
    renders: Vec<&'a Picture>,
    differences: Vec<&'a Picture>,
    wireframes: Vec<&'a Picture>,
}

/// A color of the heat map, and the difference it stands for.
struct Stop {
    percent: f32,
    color: String,
    label: String,
}

/// An atlas with its figures.
struct AtlasBlock<'a> {
    title: String,
    detail: String,
    atlas: &'a AtlasPicture,
    mips: Vec<[String; 4]>,
}

/// The page of a bake.
///
/// # Errors
/// [`Error::Internal`] if the template fails.
pub fn bake_page(report: &BakeReport, extras: &Extras) -> Result<String> {
    let input = &report.input;
    let levels = || report.levels.iter().enumerate();
    let measured = levels().filter_map(|(index, level)| {
        let name = format!("level {}", index + 1);
        Some((name, level.triangles, level.metrics.as_ref()?, 0))
    });
    let measured: Vec<_> = measured.collect();
    let names = std::iter::once(("source".to_owned(), input.triangles))
        .chain(levels().map(|(index, level)| (format!("level {}", index + 1), level.triangles)));
    let viewer = extras.viewer.as_ref().map(Viewer::to_html).transpose()?;
    render(&Page {
        frame: frame(&input.file, viewer.is_some()),
        viewer: viewer.unwrap_or_default(),
        facts: vec![
            format!("{} triangles", grouped(input.triangles)),
            counted(report.levels.len(), "level"),
            counted(input.meshes, "mesh"),
            match input.texture_bytes {
                0 => format!("a file of {}", size(input.bytes)),
                bytes => {
                    format!("a file of {}, {} of textures", size(input.bytes), size(bytes as u64))
                }
            },
        ],
        rows: report.rows().into_iter().map(|cells| Row::new(cells, None)).collect(),
        header: header("level"),
        notes: notes(
            &report.warnings,
            [
                report.cleaned(),
                report.misses(),
                report.goals(),
                report.needless(),
                report.far_off(),
            ]
            .concat(),
        ),
        charts: imperfect(&measured),
        perfect: perfect(&measured),
        solids: solids(&measured),
        verdicts: verdicts(report, &extras.files),
        options: &extras.options,
        meshes: mesh_rows(&report.meshes),
        choices: choice_rows(&report.materials),
        atlases: extras.atlases.shown.iter().map(atlas_block).collect(),
        atlas_notes: atlas_notes(&extras.atlases),
        level_textures: &extras.level_textures,
        timings: timing_bars(&report.seconds),
        peak_memory: report.peak_memory_bytes.map(|bytes| format!("{:.0} MB", bytes as f64 / 1e6)),
        machine: machine(),
        threads: thread_charts(&report.threads),
        thread_runs: report.threads.first().map_or(0, |own| own.runs),
        ..Page::of(extras.gallery.as_ref(), names)
    })
}

/// The page of an evaluation; `gallery` has a scene for each candidate that could be compared.
///
/// # Errors
/// [`Error::Internal`] if the template fails.
pub fn evaluate_page(report: &EvaluateReport, gallery: &Gallery) -> Result<String> {
    let reference = &report.reference;
    let files: Vec<&str> =
        report.candidates.iter().map(|candidate| candidate.file.as_str()).collect();
    let colors = series_of(&files);
    let all: Vec<&str> = std::iter::once(reference.file.as_str()).chain(files).collect();
    let short = short_names(&all);
    let named = || report.candidates.iter().zip(&short[1..]);
    let compared = named().filter(|(candidate, _)| candidate.metrics.is_some());
    let names = std::iter::once((short[0].clone(), reference.triangles))
        .chain(compared.map(|(candidate, name)| (name.clone(), candidate.triangles)));
    let charted = named().zip(&colors).filter_map(|((candidate, name), &color)| {
        Some((name.clone(), candidate.triangles, charted_metrics(candidate)?, color))
    });
    let charted: Vec<_> = charted.collect();
    let several = charted.iter().any(|(.., color)| *color != charted[0].3);
    let own_color = |(candidate, &color): (&CandidateReport, &usize)| {
        charted_metrics(candidate).filter(|_| several).map(|_| color)
    };
    let own_colors =
        std::iter::once(None).chain(report.candidates.iter().zip(&colors).map(own_color));
    let row = |((mut cells, name), color): (([String; COLUMNS], &String), _)| {
        cells[0].clone_from(name);
        Row::new(cells, color)
    };
    let mut facts = vec![
        format!("{} triangles", grouped(reference.triangles)),
        counted(report.candidates.len(), "candidate"),
    ];
    if report.mode == Mode::Unlit {
        facts.push("base color alone, without light".to_owned());
    }
    render(&Page {
        frame: frame(&reference.file, false),
        facts,
        rows: report.rows().into_iter().zip(&short).zip(own_colors).map(row).collect(),
        header: header("file"),
        notes: notes(&report.warnings, report.complaints()),
        charts: imperfect(&charted),
        perfect: perfect(&charted),
        solids: solids(&charted),
        ..Page::of(Some(gallery), names)
    })
}

/// The figures that the charts show: of a doubtful candidate none, since in other units it would
/// press all others to the axis.
fn charted_metrics(candidate: &CandidateReport) -> Option<&Metrics> {
    candidate.metrics.as_ref().filter(|_| candidate.warning.is_none())
}

/// The charts that show anything.
fn imperfect(measured: &[Measured<'_>]) -> Vec<Chart> {
    charts(measured).into_iter().filter(|chart| !chart.is_perfect()).collect()
}

/// The names of the figures in which all are perfect: their charts would be empty.
fn perfect(measured: &[Measured<'_>]) -> Vec<&'static str> {
    let all = charts(measured).into_iter().filter(Chart::is_perfect);
    all.map(|chart| chart.title).collect()
}

/// The frame of the page of a file, with or without the interactive view.
fn frame(file: &str, has_viewer: bool) -> Frame {
    let viewer_style = if has_viewer { viewer::STYLE } else { "" };
    Frame::new(file_name(file), &[viewer_style, CHARTS])
}

fn render(page: &Page<'_>) -> Result<String> {
    page.render().map_err(Error::internal)
}

impl<'a> Page<'a> {
    /// The pictures of scenes with these names and triangles, and nothing else.
    fn of(gallery: Option<&'a Gallery>, names: impl Iterator<Item = (String, usize)>) -> Self {
        let scenes = gallery.map_or(&[][..], |gallery| &gallery.scenes);
        let columns = scenes
            .iter()
            .zip(names)
            .map(|(_, (name, triangles))| Column { name, detail: grouped(triangles) });
        let views = scenes.first().map_or(0, |scene| scene.renders.len());
        let view = |view: usize| View {
            number: view + 1,
            direction: gallery.map_or(String::new(), |gallery| gallery.direction(view)),
            renders: scenes.iter().map(|scene| &scene.renders[view]).collect(),
            wireframes: scenes.iter().map(|scene| &scene.wireframes[view]).collect(),
            differences: scenes.iter().filter_map(|scene| scene.differences.get(view)).collect(),
        };
        Self {
            frame: Frame::new("", &[]),
            facts: Vec::new(),
            viewer: String::new(),
            header: header(""),
            rows: Vec::new(),
            verdicts: Vec::new(),
            options: &[],
            meshes: Vec::new(),
            choices: Vec::new(),
            notes: Vec::new(),
            charts: Vec::new(),
            perfect: Vec::new(),
            solids: Vec::new(),
            columns: columns.collect(),
            views: (0..views).map(view).collect(),
            legend: legend(),
            atlases: Vec::new(),
            atlas_notes: Vec::new(),
            level_textures: &[],
            timings: Vec::new(),
            peak_memory: None,
            machine: Vec::new(),
            threads: Vec::new(),
            thread_runs: 0,
        }
    }
}

/// Warnings, then lines of the summary, as sentences.
fn notes(warnings: &Warnings, lines: Vec<String>) -> Vec<Note> {
    let warning = |text: &str| Note { is_warning: true, text: sentence(text) };
    let line = |line: String| match line.strip_prefix("warning: ") {
        Some(text) => warning(text),
        None => Note { is_warning: false, text: sentence(&line) },
    };
    let first = warnings.iter().map(|own| warning(&own.to_string()));
    first.chain(lines.into_iter().map(line)).collect()
}

/// A line with a capital at its beginning, unless that is a name, and a stop at its end.
fn sentence(line: &str) -> String {
    let mut text = line.to_owned();
    let first = line.split(' ').next().unwrap_or_default();
    if first.bytes().all(|byte| byte.is_ascii_lowercase())
        && let Some(head) = text.get_mut(..1)
    {
        head.make_ascii_uppercase();
    }
    if !text.ends_with(['?', '.']) {
        text.push('.');
    }
    text
}

/// The colors of the heat map at its corners, with what they mean.
fn legend() -> Vec<Stop> {
    let stop = |third: u8| {
        let difference = WHITE * f32::from(third) / 3.0;
        let [red, green, blue] = heat_color(difference).0;
        let least = if third == 3 { "≥ " } else { "" };
        Stop {
            percent: 100.0 * f32::from(third) / 3.0,
            color: format!("rgb({red} {green} {blue})"),
            label: format!("{least}{:.1} %", 100.0 * difference),
        }
    };
    (0..=3).map(stop).collect()
}

fn atlas_block(atlas: &AtlasPicture) -> AtlasBlock<'_> {
    let role = match atlas.role {
        Some(Role::Color) => ", color",
        Some(Role::Normal) => ", normals",
        Some(Role::Data) => ", data",
        None => "",
    };
    let name = atlas.name.clone().unwrap_or_else(|| format!("Image {}", atlas.image));
    let [width, height] = atlas.size;
    let share = 100.0 * atlas.covered as f64 / (width * height).max(1) as f64;
    let (covered, filled) = (grouped(atlas.covered), grouped(atlas.filled));
    let mut detail = format!("{covered} of its texels ({share:.1} %) are covered, {filled} filled");
    if atlas.remaining > 0 {
        detail += &format!(", {} could not be", grouped(atlas.remaining));
    }
    let mips = atlas.reads.iter().take(MOST_MIPS).map(|mip| {
        [
            format!("{} × {}", mip.width, mip.height),
            grouped(mip.read),
            grouped(mip.invalid),
            grouped(atlas.reads_after(mip.invalid)),
        ]
    });
    AtlasBlock {
        title: format!("{name}{role}, {width} × {height}"),
        detail,
        mips: mips.collect(),
        atlas,
    }
}

fn atlas_notes(atlases: &AtlasPictures) -> Vec<String> {
    let alone = atlases
        .left_alone
        .iter()
        .map(|(image, why)| format!("Image {image} was left alone: {why}."));
    let more = (atlases.more > 0).then(|| format!("{} more were repaired.", atlases.more));
    more.into_iter().chain(alone).collect()
}

#[cfg(test)]
mod tests;
