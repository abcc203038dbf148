//! Several models on one page: the curves of all in the plots of Hedin ("Evaluation of an
//! appearance-preserving mesh simplification scheme", Linköping 2018), and a table with links.
//!
//! Models are read from the reports of their bakes, so that any number of runs can be put together later.

use std::collections::BTreeMap;
use std::path::Path;

use askama::Template;
use serde_json::Value;

use super::chart::{COLORS, Chart, DASHES, Point, Series};
use super::figures::short_names;
use super::frame::{CHARTS, Frame};
use super::ticks::grouped;
use crate::error::{Error, Result};

/// A bake of a model, by its report.
#[derive(Clone, Debug)]
pub struct Model {
    /// Its name on the page.
    name: String,
    /// The path of its source, and that of its report.
    files: [String; 2],
    /// Where its own page is, as a link; none if it has none.
    page: Option<String>,
    report: Value,
}

/// A figure of levels: its title, unit and ideal, and its key in the metrics.
const FIGURES: [(&str, &str, f64, &str); 4] = [
    ("RMS luminance", "sRGB, 0…1", 0.0, "rms_luminance_srgb"),
    ("Geometric error", "RMS, of the diagonal", 0.0, "distance_rms"),
    ("Color error", "RMS, sRGB", 0.0, "color_rms"),
    ("Volume", "over the source’s", 1.0, "volume_ratio"),
];

/// The stages that make levels, as `seconds` names them.
const STAGES: [&str; 7] = ["read", "weld", "simplify", "polish", "repair", "transfer", "write"];

#[derive(Template)]
#[template(path = "several.html")]
struct Page<'a> {
    frame: Frame,
    models: Vec<Row<'a>>,
    charts: Vec<Chart>,
    /// What the times are of.
    timed: String,
}

/// A model in the table.
struct Row<'a> {
    name: &'a str,
    page: Option<&'a str>,
    color: usize,
    dash: &'static str,
    levels: Vec<[Cell; 7]>,
}

/// A cell of the table: what it says, and what it is sorted by.
struct Cell {
    text: String,
    value: f64,
}

impl Model {
    /// A model by the JSON of its bake, which is in the file `report`, and whose page is where `page` says.
    ///
    /// # Errors
    /// [`Error::Invalid`] if it is not the report of a bake.
    pub fn new(json: &[u8], report: &Path, page: Option<String>) -> Result<Self> {
        let path = report.to_string_lossy().into_owned();
        let wrong = || {
            let what = "it is not the report of a bake: that is the <stem>.json beside its levels";
            Error::invalid("/", what)
        };
        let report: Value = serde_json::from_slice(json).map_err(|_| wrong())?;
        let is_report = report["levels"].is_array() && report["input"]["triangles"].is_u64();
        let file = report["input"]["file"].as_str().filter(|_| is_report).ok_or_else(wrong)?;
        Ok(Self { name: String::new(), files: [file.to_owned(), path], page, report })
    }

    fn levels(&self) -> &[Value] {
        self.report["levels"].as_array().map_or(&[], Vec::as_slice)
    }

    /// Seconds to make its levels, without what was measured and drawn.
    fn seconds(&self) -> f64 {
        STAGES.iter().filter_map(|stage| self.report["seconds"][stage].as_f64()).sum()
    }

    fn points(&self, key: &str) -> Vec<Point> {
        let point = |level: &Value| {
            let value = level["metrics"][key].as_f64().filter(|own| own.abs() < 1e12)?;
            Some(self.point(count(&level["triangles"]), value, 0.0))
        };
        let mut points: Vec<Point> = self.levels().iter().filter_map(point).collect();
        points.sort_by_key(|own| own.triangles);
        points
    }

    fn point(&self, at: usize, value: f64, deviation: f64) -> Point {
        Point { triangles: at, value, deviation, name: self.name.clone() }
    }

    /// The time on each number of threads, if that was measured.
    fn thread_points(&self) -> Vec<Point> {
        let times = self.report["threads"].as_array().map_or(&[][..], Vec::as_slice);
        let point = |own: &Value| {
            let (mean, deviation) = (&own["total"]["mean"], &own["total"]["deviation"]);
            Some(self.point(count(&own["threads"]), mean.as_f64()?, deviation.as_f64()?))
        };
        times.iter().filter_map(point).collect()
    }

    fn row(&self, series: usize) -> Row<'_> {
        let source = count(&self.report["input"]["triangles"]).max(1);
        let seconds = self.seconds();
        let level = |(at, level): (usize, &Value)| {
            let triangles = count(&level["triangles"]);
            let figure = |key: &str, digits: usize| {
                let value = level["metrics"][key].as_f64();
                let text = value.map_or("–".to_owned(), |own| match own.abs() {
                    small if small > 0.0 && small < 1e-3 => format!("{own:.1e}"),
                    _ => format!("{own:.digits$}"),
                });
                Cell { text, value: value.unwrap_or(f64::MAX) }
            };
            let percent = 100.0 * triangles as f64 / source as f64;
            let text = format!("{} ({} %)", at + 1, (percent * 100.0).round() / 100.0);
            [
                Cell { text, value: percent },
                Cell { text: grouped(triangles), value: triangles as f64 },
                figure(FIGURES[0].3, 4),
                figure(FIGURES[1].3, 4),
                figure(FIGURES[2].3, 4),
                figure(FIGURES[3].3, 4),
                Cell { text: format!("{seconds:.2}"), value: seconds },
            ]
        };
        Row {
            name: &self.name,
            page: self.page.as_deref(),
            color: series % COLORS,
            dash: ["solid", "dashed", "dotted"][series / COLORS % DASHES],
            levels: self.levels().iter().enumerate().map(level).collect(),
        }
    }
}

fn count(value: &Value) -> usize {
    value.as_u64().and_then(|own| usize::try_from(own).ok()).unwrap_or(0)
}

/// Names models by their sources; several of one source by their reports, too.
fn name_models(models: &mut [Model]) {
    let [sources, reports] = [0, 1].map(|at| {
        let files: Vec<&str> = models.iter().map(|own| own.files[at].as_str()).collect();
        short_names(&files)
    });
    let mut counts = BTreeMap::<&str, usize>::new();
    sources.iter().for_each(|source| *counts.entry(source).or_default() += 1);
    for ((model, source), report) in models.iter_mut().zip(&sources).zip(&reports) {
        let is_only = counts[source.as_str()] == 1;
        model.name = if is_only { source.clone() } else { format!("{source} ({report})") };
    }
}

/// The page of several models.
///
/// # Errors
/// [`Error::Internal`] if the template fails.
pub fn several_page(mut models: Vec<Model>) -> Result<String> {
    name_models(&mut models);
    let lines = |points: &dyn Fn(&Model) -> Vec<Point>| -> Vec<Series> {
        models
            .iter()
            .enumerate()
            .map(|(color, own)| Series { color, points: points(own) })
            .collect()
    };
    let figure = |&(title, unit, ideal, key): &(&'static str, &'static str, f64, &str)| {
        let series = lines(&|own| own.points(key));
        Chart { title, unit, ideal, across: "triangles", series }
    };
    let mut charts: Vec<Chart> = FIGURES.iter().map(figure).collect();
    let by_threads = lines(&Model::thread_points);
    let is_timed = by_threads.iter().any(|own| !own.points.is_empty());
    let (across, series) = if is_timed {
        ("threads", by_threads)
    } else {
        let whole = |own: &Model| {
            let triangles = count(&own.report["input"]["triangles"]);
            vec![own.point(triangles, own.seconds(), 0.0)]
        };
        ("triangles", lines(&whole))
    };
    charts.push(Chart { title: "Execution time", unit: "seconds", ideal: 0.0, across, series });
    charts.retain(|chart| !chart.is_empty());
    let timed = match is_timed {
        true => "by the number of threads, mean of several runs with the standard deviation of one",
        false => {
            "over the source’s triangles; --threads-report measures it by the number of threads"
        }
    };
    let levels: usize = models.iter().map(|own| own.levels().len()).sum();
    let page = Page {
        frame: Frame::new(format!("{} models, {levels} levels", models.len()), &[CHARTS]),
        models: models.iter().enumerate().map(|(at, own)| own.row(at)).collect(),
        charts,
        timed: timed.to_owned(),
    };
    page.render().map_err(Error::internal)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn model(name: &str, threads: bool) -> Model {
        model_of(&format!("in/{name}"), &format!("out/{name}.json"), threads)
    }

    fn model_of(file: &str, json: &str, threads: bool) -> Model {
        let metrics = json!({"rms_luminance_srgb": 0.01, "distance_rms": 2e-4, "color_rms": 0.02,
            "volume_ratio": null});
        let spread = json!({"mean": 2.5, "deviation": 0.25});
        let times = json!([{"threads": 1, "total": spread}, {"threads": 2, "total": spread}]);
        let report = json!({
            "input": {"file": file, "triangles": 4000},
            "levels": [{"triangles": 2000, "metrics": metrics}, {"triangles": 1000, "metrics": metrics}],
            "seconds": {"read": 1.0, "simplify": 2.0, "evaluate": 50.0},
            "threads": if threads { times } else { json!([]) },
        });
        Model::new(report.to_string().as_bytes(), Path::new(json), Some("a b.html".into())).unwrap()
    }

    #[test]
    fn every_model_has_a_curve_in_each_plot_a_row_for_each_level_and_a_link() {
        let page = several_page(vec![model("a.glb", true), model("<b>.glb", true)]).unwrap();
        assert!(!page.contains("<b>.glb"), "escaped");
        let titles = ["RMS luminance", "Geometric error", "Color error", "Execution time"];
        for title in titles {
            assert!(page.contains(&format!("<figcaption>{title}")), "{title}");
        }
        assert!(!page.contains("<figcaption>Volume"), "no model has one");
        assert_eq!(
            page.matches("class=\"line error\"").count(),
            4,
            "two models, two numbers of threads"
        );
        assert_eq!(page.matches("a.glb: 2,000 triangles").count(), 3);
        assert!(page.contains("href=\"a b.html\"") && page.matches("<tr").count() == 5);
    }

    #[test]
    fn without_threads_time_is_that_of_the_stages_that_make_levels() {
        let page = several_page(vec![model("a.glb", false)]).unwrap();
        assert!(page.contains("4,000 triangles, 3.00"), "{page}");
        let new = |json: &[u8]| Model::new(json, Path::new("a.json"), None);
        assert!(new(b"{}").is_err() && new(b"x").is_err());
    }

    #[test]
    fn models_of_one_name_are_told_apart_by_their_folders_and_of_one_source_by_their_reports() {
        let model = |[file, json]: [&str; 2]| model_of(file, json, false);
        let files = [
            ["in/new/a.glb", "x/a.json"],
            ["in/old/a.glb", "y/a.json"],
            ["in/old/a.glb", "z/a.json"],
            ["in/b.glb", "x/b.json"],
        ];
        let page = several_page(files.map(model).into()).unwrap();
        for name in ["new/a.glb", "old/a.glb (y/a.json)", "old/a.glb (z/a.json)", "b.glb"] {
            assert!(page.contains(&format!(">{name}</li>")), "{name}");
            assert_eq!(page.matches(&format!("<title>{name}:")).count(), 7, "{name} in {page}");
        }
    }
}
