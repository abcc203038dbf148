//! What a bake came to, in a sentence for each level, and what it was made with.

use super::BakeReport;
use super::LevelReport;
use super::columns::size;
use super::ticks::grouped;

/// A level, in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Verdict {
    /// Its name.
    pub(super) name: String,
    /// A sentence about it.
    pub(super) sentence: String,
}

/// A sentence for each level: its triangles and bytes, the size it may be shown at, how far it is off.
///
/// `bytes`: by the names of the files that were written.
pub(super) fn verdicts(report: &BakeReport, bytes: &[FileSize]) -> Vec<Verdict> {
    let levels = report.levels.iter().enumerate();
    let verdict = |(index, level): (usize, &LevelReport)| Verdict {
        name: format!("Level {}", index + 1),
        sentence: sentence(report.input.triangles, level, file_bytes(index + 1, bytes)),
    };
    levels.map(verdict).collect()
}

/// A file that was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FileSize {
    /// Its name.
    pub(crate) name: String,
    /// Its bytes.
    pub(crate) bytes: usize,
}

/// Bytes of the files of one level alone, if there are any.
fn file_bytes(level: usize, files: &[FileSize]) -> Option<usize> {
    let ending = format!("_lod{level}");
    let is_own = |file: &&FileSize| {
        file.name.rsplit_once('.').is_some_and(|(stem, _)| stem.ends_with(&ending))
    };
    let own: Vec<usize> = files.iter().filter(is_own).map(|file| file.bytes).collect();
    (!own.is_empty()).then(|| own.iter().sum())
}

fn sentence(source: usize, level: &LevelReport, bytes: Option<usize>) -> String {
    let share = 100.0 * level.triangles as f64 / source.max(1) as f64;
    let mut text = format!("{} triangles ({})", grouped(level.triangles), percent(share, 3));
    if let Some(bytes) = bytes {
        text += &format!(" in a file of {}", size(bytes as u64));
    }
    if level.texture_bytes > 0 {
        text += &format!(", {} of textures", size(level.texture_bytes as u64));
    }
    let Some(metrics) = &level.metrics else { return text + "; not measured." };
    text += &match level.largest_size_pixels.filter(|size| size.is_finite()) {
        Some(pixels) => format!(
            "; may be shown until the model spans {} pixels",
            grouped(pixels.floor().max(0.0) as usize)
        ),
        None => "; may be shown at any size".to_owned(),
    };
    text += &format!(
        "; {} of the diagonal off on the mean (RMS) and {} at most",
        percent(100.0 * metrics.distance_rms, 2),
        percent(100.0 * metrics.distance_max, 2)
    );
    let luminance = format!("; luminance {} off", percent(100.0 * metrics.rms_luminance_srgb, 2));
    text + &luminance + "."
}

/// A percentage of so many digits, or as many as are before the point.
fn percent(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return "0 %".to_owned();
    }
    let decimals = (digits - 1 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.decimals$}");
    let trimmed =
        if decimals > 0 { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{trimmed} %")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::Metrics;

    fn level() -> LevelReport {
        LevelReport {
            ratio: 0.25,
            target: 250,
            triangles: 250,
            points: 0,
            wedges: 0,
            vertices: 0,
            goal: None,
            error: 0.0,
            draw_calls: 1,
            texture_bytes: 480_000,
            texture_gpu_bytes: 5_592_404,
            textures: Vec::new(),
            bytes: 0,
            reached: true,
            why: None,
            largest_size_pixels: Some(1234.6),
            made_needless_by: None,
            farthest: None,
            metrics: Some(Metrics {
                distance_rms: 1.25e-4,
                distance_max: 0.013,
                rms_luminance_srgb: 0.0123,
                ..Metrics::default()
            }),
        }
    }

    #[test]
    fn a_level_is_told_in_a_sentence() {
        assert_eq!(
            sentence(1000, &level(), Some(1_260_000)),
            "250 triangles (25 %) in a file of 1.3 MB, 480 kB of textures; may be shown until the model \
             spans 1,234 pixels; 0.013 % of the diagonal off on the mean (RMS) and 1.3 % at most; \
             luminance 1.2 % off."
        );
        let unmeasured = LevelReport { metrics: None, texture_bytes: 0, ..level() };
        assert_eq!(sentence(1000, &unmeasured, None), "250 triangles (25 %); not measured.");
    }

    #[test]
    fn the_bytes_of_a_level_are_those_of_its_own_files() {
        let file = |name: &str, bytes| FileSize { name: name.to_owned(), bytes };
        let files = [
            file("x_lod1.gltf", 5),
            file("x_lod1.bin", 7),
            file("x_lod11.glb", 9),
            file("x.glb", 4),
        ];
        assert_eq!(file_bytes(1, &files), Some(12));
        assert_eq!(file_bytes(2, &files), None);
    }
}
