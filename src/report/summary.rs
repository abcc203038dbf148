//! A bake and an evaluation in a few lines for people: what was made, how it compares, what is wrong,
//! and what to do next.

use super::choices::{budget_line, choice_table};
use super::columns::{Column, fit, size, wrap};
use super::meshes::mesh_table;
use super::ticks::grouped;
use super::{BakeReport, CandidateReport, EvaluateReport, LevelReport, Seconds, TextureReport};
use crate::evaluate::Metrics;
use crate::evaluate::reference::ReferenceTextures;
use crate::transfer::MaterialTextures;

/// The share of a level's bytes from which on its textures are what is worth a change.
const MOSTLY: f64 = 0.75;
/// Textures of fewer bytes are not worth a hint.
const SMALL: usize = 300_000;
/// Seconds that an evaluation may take without a hint.
const PATIENCE: f64 = 10.0;

impl BakeReport {
    /// The report for people, in lines of at most `width` signs where that can be.
    pub fn to_text(&self, width: usize) -> String {
        let mut text = fit(self.columns(), width) + &mesh_table(&self.meshes, width);
        text += &choice_table(&self.materials, width);
        let lines = [
            self.cleaned(),
            self.misses(),
            self.goals(),
            self.needless(),
            self.far_off(),
            self.shared_textures(),
            self.apart(),
            self.kept_draw_calls(),
            self.made(),
            self.next_steps(),
            self.time(),
        ];
        text.extend(lines.concat().iter().map(|line| wrap(line, width)));
        text
    }

    fn columns(&self) -> Vec<Column> {
        let (input, levels) = (&self.input, &self.levels);
        let column = |head: &str, rank, source: String, of: &dyn Fn(&LevelReport) -> String| {
            Column::new(head, rank, std::iter::once(source).chain(levels.iter().map(of)).collect())
        };
        let figure = |head: &str, rank, of: fn(&Metrics) -> String| {
            column(head, rank, String::new(), &|level| {
                level.metrics.as_ref().map_or_else(String::new, of)
            })
        };
        let names = (1..).zip(levels).map(|(index, level)| {
            let percent = (level.ratio * 1e4).round() / 1e2;
            format!("{index}  {percent} %")
        });
        let textures = |bytes: usize| if bytes == 0 { String::new() } else { size(bytes as u64) };
        let calls = |calls: usize| grouped(calls);
        let on_gpu = |bytes: u64| if bytes == 0 { String::new() } else { size(bytes) };
        let mut textures_of_levels = levels.iter().flat_map(|level| &level.textures);
        let on_gpu = textures_of_levels.any(TextureReport::is_compressed).then(|| {
            column("on the GPU", 1, on_gpu(input.texture_gpu_bytes), &|level| {
                on_gpu(level.texture_gpu_bytes)
            })
        });
        let mut columns = vec![
            Column::new("level", 0, std::iter::once("source".to_owned()).chain(names).collect()),
            column("triangles", 0, grouped(input.triangles), &|level| grouped(level.triangles)),
            column("draws", 2, calls(input.draw_calls), &|level| calls(level.draw_calls)),
            column("textures", 1, textures(input.texture_bytes), &|level| {
                textures(level.texture_bytes)
            }),
            column("file", 0, size(input.bytes), &|level| size(level.bytes)),
            column("looks the same", 1, String::new(), &|level| self.looks_the_same(level)),
            figure("SSIM", 2, |m| seen(m.ssim, 4)),
            figure("distance", 3, |m| format!("{:.1e}", m.distance_rms)),
            figure("greatest", 4, |m| format!("{:.1e}", m.distance_max)),
            figure("normals", 4, |m| format!("{:.1}°", m.normal_degrees_rms)),
            figure("color", 5, |m| format!("{:.4}", m.color_rms)),
            figure("luminance", 5, |m| seen(m.rms_luminance_srgb, 5)),
            figure("silhouette", 6, |m| seen(m.silhouette_iou, 4)),
            figure("volume", 7, volume),
        ];
        columns.splice(4..4, on_gpu);
        columns
    }

    /// The size up to which a level looks like its source, in pixels along the diagonal.
    fn looks_the_same(&self, level: &LevelReport) -> String {
        let Some(metrics) = &level.metrics else { return String::new() };
        let screen = f64::from(self.screen.width).hypot(f64::from(self.screen.height));
        match level.largest_size_pixels.filter(|size| size.is_finite()) {
            _ if metrics.ssim.is_nan() => "not seen".to_owned(),
            None => "at any size".to_owned(),
            Some(size) if size >= screen => "full screen".to_owned(),
            Some(size) => format!("below {} px", grouped(size.floor() as usize)),
        }
    }

    /// A line that tells what levels are compared with, if that is not the source as it is.
    pub(super) fn cleaned(&self) -> Vec<String> {
        self.reference_textures.iter().filter_map(ReferenceTextures::line).collect()
    }

    /// A line for each level that missed its target, with the reason.
    pub(super) fn misses(&self) -> Vec<String> {
        let miss = |(index, level): (usize, &LevelReport)| {
            let why = level.why.as_ref()?;
            Some(format!("level {} missed its {} triangles: {why}", index + 1, level.target))
        };
        self.levels.iter().enumerate().filter_map(miss).collect()
    }

    /// A line for each level that was found by a bound.
    pub(super) fn goals(&self) -> Vec<String> {
        let levels = self.levels.iter().enumerate();
        levels.filter_map(|(index, level)| Some(level.goal?.line(index + 1))).collect()
    }

    /// A line for each level that a coarser one makes needless.
    pub(super) fn needless(&self) -> Vec<String> {
        let line = |(index, level): (usize, &LevelReport)| {
            let coarser = level.made_needless_by?;
            Some(format!(
                "level {} is needless: at every size at which it looks like the source, level {coarser} \
                 does too",
                index + 1
            ))
        };
        self.levels.iter().enumerate().filter_map(line).collect()
    }

    /// A line for each level that is far off the source somewhere, with the part that is.
    pub(super) fn far_off(&self) -> Vec<String> {
        let levels = self.levels.iter().enumerate();
        let line = |(index, level): (usize, &LevelReport)| {
            level.farthest.as_ref()?.line(index + 1, level.metrics.as_ref()?)
        };
        levels.filter_map(line).collect()
    }

    /// A line for each material with a texture that levels share, with the reason.
    fn shared_textures(&self) -> Vec<String> {
        let line = |own: &MaterialTextures| {
            // The choices have a table.
            let told = own.textures.iter().filter(|texture| texture.choices.is_empty());
            let why = told.filter_map(|texture| texture.why.as_ref()).next()?;
            Some(format!("material {} shares textures with its source: {why}", own.called()))
        };
        self.materials.iter().filter_map(line).collect()
    }

    /// A line for each material that is not merged, or not with all others, with the reason.
    fn apart(&self) -> Vec<String> {
        let line = |own: &MaterialTextures| {
            let why = own.apart.as_ref()?;
            Some(match own.merged.is_empty() {
                true => format!("material {} is not merged: {why}", own.called()),
                false => format!("a primitive of material {} is not joined: {why}", own.called()),
            })
        };
        self.materials.iter().filter_map(line).collect()
    }

    /// A line on draw calls that merged materials leave, as each mesh is drawn on its own.
    fn kept_draw_calls(&self) -> Vec<String> {
        let are_merged = self.materials.iter().any(|own| own.merged.len() > 1);
        let calls = self.levels.iter().map(|level| level.draw_calls).max().unwrap_or(0);
        let meshes = self.input.meshes;
        if !are_merged || meshes < 2 || calls < 2 {
            return Vec::new();
        }
        vec![format!(
            "merged materials leave {calls} draw calls: {meshes} meshes hang on nodes of their own; join \
             those that never move in the source to draw them at once"
        )]
    }

    /// The files that were written and removed.
    fn made(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if !self.files.is_empty() {
            let bytes: u64 = self.file_bytes.iter().sum();
            lines.push(format!("wrote {}: {}", listed(&self.files), size(bytes)));
        }
        if !self.removed.is_empty() {
            lines.push(format!("removed {}, of an earlier bake", listed(&self.removed)));
        }
        lines
    }

    /// What would help most.
    fn next_steps(&self) -> Vec<String> {
        let mut steps: Vec<String> = budget_line(&self.materials).into_iter().collect();
        if let Some((last, level)) = self.levels.iter().enumerate().next_back() {
            let share = level.texture_bytes as f64 / level.bytes.max(1) as f64;
            if self.materials.is_empty() && share >= MOSTLY && level.texture_bytes > SMALL {
                steps.push(format!(
                    "textures are {:.0} % of level {}: --textures transfer fits them to the size that it \
                     is shown at",
                    100.0 * share,
                    last + 1,
                ));
            }
        }
        let (measuring, all) = (self.seconds.evaluate, self.seconds.total());
        if measuring > PATIENCE && measuring > 0.5 * all {
            let share = 100.0 * measuring / all;
            steps.push(format!(
                "measuring took {share:.0} % of the time: --no-evaluate leaves it out"
            ));
        }
        steps
    }

    /// Where the time went, and the memory.
    fn time(&self) -> Vec<String> {
        let total = self.seconds.total();
        let mut stages: Vec<(&str, f64)> = self.seconds.stages().to_vec();
        stages.retain(|(_, seconds)| *seconds >= 0.05 * total);
        stages.sort_by(|a, b| b.1.total_cmp(&a.1));
        let stages: Vec<String> = stages
            .iter()
            .map(|(name, own)| format!("{name} {:.0} %", 100.0 * own / total))
            .collect();
        let memory = self
            .peak_memory_bytes
            .map_or_else(String::new, |bytes| format!("; {} of memory", size(bytes)));
        vec![format!("took {total:.1} s: {}{memory}", stages.join(", "))]
    }
}

impl Seconds {
    fn stages(&self) -> [(&'static str, f64); 9] {
        [
            ("reading", self.read),
            ("welding", self.weld),
            ("simplifying", self.simplify),
            ("polishing", self.polish),
            ("repairing", self.repair),
            ("textures", self.transfer),
            ("writing", self.write),
            ("measuring", self.evaluate),
            ("drawing", self.report),
        ]
    }

    fn total(&self) -> f64 {
        self.stages().iter().map(|(_, seconds)| seconds).sum()
    }
}

/// A figure of what is seen, or a dash where nothing is.
pub(super) fn seen(figure: f64, digits: usize) -> String {
    if figure.is_nan() { "–".to_owned() } else { format!("{figure:.digits$}") }
}

fn volume(metrics: &Metrics) -> String {
    match metrics.volume_ratio {
        None => "–".to_owned(),
        Some(ratio) if ratio.abs() < 1000.0 => format!("{ratio:.4}"),
        Some(ratio) => format!("{ratio:.1e}"),
    }
}

/// Names of files: those that differ in a number alone as the first and the last, those in a folder
/// counted.
fn listed(files: &[String]) -> String {
    let mut groups: Vec<(String, Vec<&str>)> = Vec::new();
    for file in files {
        let key = group_of(file);
        match groups.iter_mut().find(|(own, _)| *own == key) {
            Some((_, group)) => group.push(file),
            None => groups.push((key, vec![file])),
        }
    }
    let names = groups.iter().map(|(key, group)| match group[..] {
        [one] => one.to_owned(),
        _ if key.ends_with('/') => format!("{} files in {key}", group.len()),
        [one, other] => format!("{one}, {other}"),
        _ => format!("{} … {}", group[0], group[group.len() - 1]),
    });
    names.collect::<Vec<_>>().join(", ")
}

/// What a file is listed with: the folder that it is in, or its name without a level's number.
fn group_of(file: &str) -> String {
    if let Some((folder, _)) = file.split_once('/') {
        return format!("{folder}/");
    }
    let Some((stem, rest)) = file.rsplit_once("_lod") else { return file.to_owned() };
    format!("{stem}_lod{}", rest.trim_start_matches(|c: char| c.is_ascii_digit()))
}

impl EvaluateReport {
    /// The report for people, in lines of at most `width` signs where that can be.
    pub fn to_text(&self, width: usize) -> String {
        let candidates = &self.candidates;
        let column = |head: &str, rank, source: String, of: &dyn Fn(&CandidateReport) -> String| {
            let cells = std::iter::once(source).chain(candidates.iter().map(of));
            Column::new(head, rank, cells.collect())
        };
        let figure = |head: &str, rank, of: fn(&Metrics) -> String| {
            column(head, rank, String::new(), &|own| {
                own.metrics.as_ref().map_or_else(String::new, of)
            })
        };
        let columns = vec![
            column("file", 0, self.reference.file.clone(), &|own| own.file.clone()),
            column("triangles", 0, grouped(self.reference.triangles), &|own| {
                own.metrics.map_or_else(String::new, |_| grouped(own.triangles))
            }),
            figure("SSIM", 1, |m| seen(m.ssim, 4)),
            figure("luminance", 1, |m| seen(m.rms_luminance_srgb, 5)),
            figure("distance", 1, |m| format!("{:.1e}", m.distance_rms)),
            figure("color", 2, |m| format!("{:.4}", m.color_rms)),
            figure("normals", 2, |m| format!("{:.2}°", m.normal_degrees_rms)),
            figure("greatest", 3, |m| format!("{:.1e}", m.distance_max)),
            figure("silhouette", 4, |m| seen(m.silhouette_iou, 4)),
            figure("volume", 5, volume),
            figure("linear", 6, |m| seen(m.rms_luminance, 5)),
            figure("at switch", 7, |m| match m.at_switch.pixels {
                pixels if pixels.is_finite() => {
                    format!("{} @ {pixels:.0}", seen(m.at_switch.rms_luminance_srgb, 5))
                }
                _ => "at any size".to_owned(),
            }),
        ];
        let mut text = fit(columns, width);
        let lines = self.reference.textures.line().into_iter().chain(self.complaints());
        text.extend(lines.map(|line| wrap(&line, width)));
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_belong_together_are_named_by_the_first_and_the_last_or_by_their_folder() {
        let files =
            |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let levels = ["a_lod1.gltf", "a_lod1.bin", "a_lod2.gltf", "a_lod2.bin", "a_lod3.gltf"];
        let said = listed(&files(&levels));
        assert_eq!(said, "a_lod1.gltf … a_lod3.gltf, a_lod1.bin, a_lod2.bin");
        let said =
            listed(&files(&["a_lod1.glb", "a_textures/x.png", "a_textures/y.png", "a.html"]));
        assert_eq!(said, "a_lod1.glb, 2 files in a_textures/, a.html");
        assert_eq!(listed(&files(&["x_lodge.glb"])), "x_lodge.glb");
    }
}
