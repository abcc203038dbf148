//! What a repair did, as a table.

use std::path::{Path, PathBuf};

use seamwise_texture::{Outcome, Role, Validity};

use crate::atlas::Reads;
use crate::report::align;

/// What a repair did to each image of a file.
#[derive(Clone, Debug)]
pub struct RepairReport {
    /// The images of an asset or the layers of an EXR in their order, or the one picture.
    pub images: Vec<ImageReport>,
}

/// What a repair did to an image.
#[derive(Clone, Debug, Default)]
pub struct ImageReport {
    /// Its name.
    pub name: String,
    /// What its texels mean, if something uses them.
    pub role: Option<Role>,
    /// Its width and height in texels; `None` if it was not looked into.
    pub size: Option<[usize; 2]>,
    /// Texels that may be trusted.
    pub covered: usize,
    /// Texels that were filled.
    pub filled: usize,
    /// Texels that may not be trusted and could not be filled.
    pub remaining: usize,
    /// What filtering inside the charts read before the repair; empty where no charts are known.
    pub reads: Reads,
    /// Why it was left alone, if it was.
    pub left_alone: Option<String>,
    /// What changed beside texels that were filled.
    pub notes: Vec<String>,
    /// A PNG of what was filled, if it was asked for.
    pub diff: Option<Vec<u8>>,
}

impl ImageReport {
    /// Enters the figures of a repair.
    pub(super) fn add_outcome(&mut self, validity: &Validity, outcome: Outcome, reads: Reads) {
        self.size = Some([validity.width(), validity.height()]);
        self.covered = validity.valid();
        self.filled = outcome.filled;
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

    fn reads_alike(&self, other: &Self) -> bool {
        self.reads == other.reads && (self.remaining == 0) == (other.remaining == 0)
    }
}

impl RepairReport {
    /// The pictures of what was filled, as files: `path` if there is one, otherwise each with the
    /// number of its image before the extension.
    pub fn diffs(&self, path: &Path) -> Vec<(PathBuf, Vec<u8>)> {
        let drawn = |image: &ImageReport| image.diff.clone();
        let drawn: Vec<_> = self.images.iter().map(drawn).enumerate().collect();
        let several = drawn.iter().filter(|(_, png)| png.is_some()).count() > 1;
        let name = |index: usize| {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let name = format!("{stem}_{index}.png");
            if several { path.with_file_name(name) } else { path.to_owned() }
        };
        drawn.into_iter().filter_map(|(index, png)| Some((name(index), png?))).collect()
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
        for image in &self.images {
            let name = &image.name;
            text.extend(image.notes.iter().map(|note| format!("{name}: {note}\n")));
        }
        text
    }

    /// One line for all images that lie in the same charts.
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

fn row(image: &ImageReport) -> [String; 7] {
    let figure = |n: usize| if image.left_alone.is_some() { String::new() } else { n.to_string() };
    let role = image.role.map_or("", |role| match role {
        Role::Color => "color",
        Role::Normal => "normal",
        Role::Data => "data",
    });
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
    use seamwise_texture::MipReads;

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
        assert_eq!(RepairReport { images }.reads(), expected);
    }
}
