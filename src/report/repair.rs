//! Reports of a repair, as a table and as JSON.

use std::path::{Path, PathBuf};

use seamwise_texture::equalize::{Equalized, STEP_LEVELS};
use seamwise_texture::{MipReads, Outcome, Role, Validity};
use serde_json::{Value, json};

use super::table::align;
use crate::atlas::charts::Reads;
use crate::warning::Warnings;

/// The report of a repair, for each image of a file.
#[derive(Clone, Debug)]
pub struct RepairReport {
    /// The images of an asset or the layers of an EXR in their order, or the one picture.
    pub images: Vec<ImageReport>,
    /// Warnings: things left out, guessed or mended.
    pub warnings: Warnings,
}

/// The report of the repair of an image.
#[derive(Clone, Debug, Default)]
pub struct ImageReport {
    /// Its name.
    pub name: String,
    /// The meaning of its texels, if something uses them.
    pub role: Option<Role>,
    /// Its width and height in texels; `None` if it was not looked into.
    pub size: Option<[usize; 2]>,
    /// Texels that may be trusted.
    pub covered: usize,
    /// Texels that were filled, those of `hidden` among them.
    pub filled: usize,
    /// Texels of alpha 0 whose color was filled, while their alpha stayed.
    pub hidden: usize,
    /// Texels that may not be trusted and could not be filled.
    pub remaining: usize,
    /// The counts of texels that filtering inside the charts read before the repair; empty where no
    /// charts are known.
    pub reads: Reads,
    /// The equalization of seams, if it was asked for.
    pub equalized: Option<Equalized>,
    /// The reason why it was left alone, if it was.
    pub left_alone: Option<String>,
    /// Messages about changes beside texels that were filled.
    pub notes: Vec<String>,
    /// A PNG of what was filled, if it was asked for.
    pub diff: Option<Vec<u8>>,
    /// The levels of the fill, if they were asked for.
    pub pyramid: Vec<LevelPicture>,
}

/// A picture of a level of a fill.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LevelPicture {
    /// The name of its file without the extension; empty if it is of all levels.
    pub name: String,
    /// The picture as a PNG.
    pub png: Vec<u8>,
}

impl ImageReport {
    /// Enters the figures of a repair.
    pub(crate) fn add_outcome(&mut self, validity: &Validity, outcome: Outcome, reads: Reads) {
        self.size = Some([validity.width(), validity.height()]);
        self.covered = validity.valid() - outcome.hidden;
        self.filled = outcome.filled + outcome.hidden;
        self.hidden = outcome.hidden;
        self.remaining = outcome.remaining;
        self.reads = reads;
    }

    /// Reads of invalid texels after the repair, at a mip level that had so many before: a fill
    /// leaves none of them or all.
    fn reads_after(&self, before: usize) -> usize {
        if self.remaining == 0 { 0 } else { before }
    }

    /// The invalid reads of this image, which `alike` others share.
    fn reads_line(&self, alike: usize) -> String {
        let mips = self.reads.mips.iter();
        let before: Vec<String> =
            mips.clone().map(|mip| format!("{}/{}", mip.invalid, mip.read)).collect();
        let after: Vec<String> =
            mips.map(|mip| self.reads_after(mip.invalid).to_string()).collect();
        let [before, after] = [before, after].map(|figures| figures.join(" "));
        let alike = if alike == 0 { String::new() } else { format!(" and {alike} more") };
        let shared = self.reads.sharing();
        format!("{}{alike}: {before} → {after}; {shared}\n", self.name)
    }

    /// A line of text about an equalization.
    fn seams_line(&self, equalized: &Equalized) -> String {
        let steps =
            |steps: [f64; STEP_LEVELS]| steps.map(|step| format!("{:.2}", 1e3 * step)).join(" ");
        let Equalized { seams, before, after, texels, covered_texels, max_change } = *equalized;
        let name = &self.name;
        if seams == 0 {
            return format!("{name}: no seams\n");
        }
        format!(
            "{name}: {} → {}; {texels} texels changed, {covered_texels} of them in charts, by {:.1} at most\n",
            steps(before),
            steps(after),
            1e3 * max_change,
        )
    }

    fn reads_alike(&self, other: &Self) -> bool {
        self.reads == other.reads && (self.remaining == 0) == (other.remaining == 0)
    }
}

impl RepairReport {
    /// The pictures of what was filled, as files: `path` if there is one, otherwise each with the
    /// number of its image before the extension.
    pub fn diffs(&self, path: &Path) -> Vec<(PathBuf, Vec<u8>)> {
        let paths = self.paths(path, |image| image.diff.is_some());
        paths.filter_map(|(path, image)| Some((path, image.diff.clone()?))).collect()
    }

    /// The pictures of the levels of the fill, as files named alike, or in folders if they have names.
    pub fn pyramids(&self, path: &Path) -> Vec<(PathBuf, Vec<u8>)> {
        let file = |path: &Path, own: &LevelPicture| match own.name.as_str() {
            "" => path.to_owned(),
            name => path.join(format!("{name}.png")),
        };
        let paths = self.paths(path, |image| !image.pyramid.is_empty());
        let files = paths.flat_map(|(path, image)| {
            image.pyramid.iter().map(move |own| (file(&path, own), own.png.clone()))
        });
        files.collect()
    }

    /// The images with a picture, and the place of each: `path` if there is one.
    fn paths(
        &self,
        path: &Path,
        is_drawn: fn(&ImageReport) -> bool,
    ) -> impl Iterator<Item = (PathBuf, &ImageReport)> {
        let drawn = self.images.iter().enumerate().filter(move |(_, image)| is_drawn(image));
        let several = drawn.clone().count() > 1;
        let place = move |(index, image)| {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let ending =
                path.extension().map_or(String::new(), |own| format!(".{}", own.display()));
            let name = format!("{stem}_{index}{ending}");
            (if several { path.with_file_name(name) } else { path.to_owned() }, image)
        };
        drawn.map(place)
    }

    /// The report for people.
    pub fn to_table(&self) -> String {
        let header = ["image", "role", "size", "covered", "filled", "remaining", ""];
        let mut rows = vec![header.map(str::to_owned)];
        rows.extend(self.images.iter().map(row));
        let mut text = align(&rows);
        let reads = self.reads();
        if !reads.is_empty() {
            text +=
                "\ntexels that filtering reads, mip by mip: invalid/all before → invalid after\n";
            text += &reads;
        }
        let seams =
            self.images.iter().filter_map(|image| Some(image.seams_line(&image.equalized?)));
        let seams: String = seams.collect();
        if !seams.is_empty() {
            text += "\nRMS step across seams, in thousandths of the range, mip by mip: before → after\n";
            text += &seams;
        }
        for image in &self.images {
            let name = &image.name;
            text.extend(image.notes.iter().map(|note| format!("{name}: {note}\n")));
        }
        text
    }

    /// The report for programs.
    pub fn to_json(&self) -> String {
        format!("{:#}\n", self.to_value())
    }

    /// The same, to be put into another.
    pub fn to_value(&self) -> Value {
        let images: Vec<Value> = self.images.iter().map(to_json).collect();
        json!({"schema": 1, "images": images, "warnings": self.warnings})
    }

    /// The lines about reads: one for all images that lie in the same charts.
    fn reads(&self) -> String {
        let images: Vec<_> =
            self.images.iter().filter(|image| !image.reads.mips.is_empty()).collect();
        let mut lines = String::new();
        for (index, image) in images.iter().enumerate() {
            if !images[..index].iter().any(|earlier| earlier.reads_alike(image)) {
                let alike = images[index + 1..].iter().filter(|later| later.reads_alike(image));
                lines += &image.reads_line(alike.count());
            }
        }
        lines
    }
}

fn role_name(role: Role) -> &'static str {
    match role {
        Role::Color => "color",
        Role::Normal => "normal",
        Role::Data => "data",
    }
}

fn to_json(image: &ImageReport) -> Value {
    let reads = |mip: &MipReads| {
        let MipReads { width, height, read, invalid } = *mip;
        let invalid_after = image.reads_after(invalid);
        json!({"width": width, "height": height, "read": read, "invalid_before": invalid,
            "invalid_after": invalid_after})
    };
    let seams = |equalized: &Equalized| {
        let Equalized { seams, before, after, texels, covered_texels, max_change } = equalized;
        json!({"seams": seams, "rms_step_before": before, "rms_step_after": after,
            "changed_texels": texels, "changed_covered_texels": covered_texels,
            "max_change": max_change})
    };
    json!({
        "name": image.name,
        "role": image.role.map(role_name),
        "size": image.size,
        "covered": image.covered,
        "filled": image.filled,
        "hidden": image.hidden,
        "remaining": image.remaining,
        "reads": image.reads.mips.iter().map(reads).collect::<Vec<_>>(),
        "seams": image.equalized.as_ref().map(seams),
        "left_alone": image.left_alone,
        "notes": image.notes,
    })
}

fn row(image: &ImageReport) -> [String; 7] {
    let figure = |n: usize| if image.left_alone.is_some() { String::new() } else { n.to_string() };
    let role = image.role.map_or("", role_name);
    [
        image.name.clone(),
        role.to_owned(),
        image.size.map_or(String::new(), |[width, height]| format!("{width}×{height}")),
        figure(image.covered),
        figure(image.filled),
        figure(image.remaining),
        image.left_alone.as_ref().map_or(String::new(), |why| format!("left alone: {why}")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_steps_across_seams_are_told() {
        let equalized = Equalized {
            seams: 2,
            before: [0.04, 0.03, 0.02, 0.01],
            after: [0.001; 4],
            texels: 9,
            covered_texels: 4,
            max_change: 0.5,
        };
        let image =
            ImageReport { name: "a".into(), equalized: Some(equalized), ..ImageReport::default() };
        let report = RepairReport { images: vec![image], warnings: Warnings::default() };
        let line = "a: 40.00 30.00 20.00 10.00 → 1.00 1.00 1.00 1.00; 9 texels changed, 4 of them \
                    in charts, by 500.0 at most\n";
        assert!(report.to_table().ends_with(line), "{}", report.to_table());
        let json: Value = serde_json::from_str(&report.to_json()).unwrap();
        assert_eq!(json.pointer("/images/0/seams/rms_step_before/1").unwrap(), 0.03);
    }

    #[test]
    fn reads_are_shown_once_for_images_that_share_them() {
        let mip = |read, invalid| MipReads { width: read, height: 1, read, invalid };
        let reads = Reads { mips: vec![mip(2, 1), mip(1, 1)], shared_from: Some(1) };
        let image = |name: &str, remaining| ImageReport {
            name: name.into(),
            reads: reads.clone(),
            remaining,
            ..ImageReport::default()
        };
        let none = ImageReport { reads: Reads::default(), ..image("d", 0) };
        let images = vec![image("a", 0), image("b", 1), none, image("c", 0)];
        let shared = "charts share texels from mip 1 on";
        let expected =
            format!("a and 1 more: 1/2 1/1 → 0 0; {shared}\nb: 1/2 1/1 → 1 1; {shared}\n");
        assert_eq!(RepairReport { images, warnings: Warnings::default() }.reads(), expected);
    }
}
