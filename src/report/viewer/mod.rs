//! The interactive view of a source and its levels: the models as data of a page, and the code that
//! draws them there.
//!
//! The code is our own: JavaScript and WebGL 2 in the files beside this one, joined in the order of
//! `SCRIPTS`. It reads .glb like any other reader, and lights them like [`evaluate`](crate::evaluate),
//! which a test in a browser holds. What it can't read (compressed geometry and textures) is embedded
//! plain; what nobody sees (animations, morph targets, skins) is left out.
//!
//! Guaranteed: the same assets make the same bytes; nothing is read from outside the page. Not
//! guaranteed: textures as they are in the files, where they would make the page too large; models
//! beyond the bound of `MOST_GEOMETRY`, the source among them. Either is said in the page.

mod distances;
mod exhibit;
mod images;
mod model;

use std::io::Write;

use askama::Template;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::{Value, json};

use super::frame::Frame;
use crate::error::{Error, Result};
use crate::export::progressive::extract::Fineness;
use crate::export::progressive::timeline::Timeline;
use crate::limit::MemoryLimit;
use distances::{SourceDistances, source_distances};
pub use exhibit::Exhibit;
use images::ImagePool;
use model::plain_glb;

/// The script, file by file: each uses what stands before it.
const SCRIPTS: [&str; 18] = [
    include_str!("bytes.js"),
    include_str!("accessors.js"),
    include_str!("matrix.js"),
    include_str!("timeline.js"),
    include_str!("scene.js"),
    include_str!("surface.js"),
    include_str!("charts.js"),
    include_str!("material.js"),
    include_str!("program.js"),
    include_str!("targets.js"),
    include_str!("renderer.js"),
    include_str!("camera.js"),
    include_str!("models.js"),
    include_str!("progress.js"),
    include_str!("stage.js"),
    include_str!("controls.js"),
    include_str!("panel.js"),
    include_str!("main.js"),
];

/// The shaders by the names that the script knows them by.
const SHADERS: [Shader; 6] = [
    Shader { name: "surface.vert", source: include_str!("surface.vert.glsl") },
    Shader { name: "color", source: include_str!("color.glsl") },
    Shader { name: "light", source: include_str!("light.glsl") },
    Shader { name: "surface.frag", source: include_str!("surface.frag.glsl") },
    Shader { name: "composite.vert", source: include_str!("composite.vert.glsl") },
    Shader { name: "composite.frag", source: include_str!("composite.frag.glsl") },
];

/// The style of the view; it uses the colors of all pages.
pub(super) const STYLE: &str = include_str!("viewer.css");
const MARKUP: &str = include_str!("viewer.html");

/// Most bytes of geometry in a page: a browser takes some times as much memory.
const MOST_GEOMETRY: usize = 48 << 20;

/// A source and its levels, ready to be put into a page.
#[derive(Debug)]
pub struct Viewer {
    config: Value,
    parts: Vec<Part>,
}

struct Shader {
    name: &'static str,
    source: &'static str,
}

/// Bytes in the page.
#[derive(Debug)]
struct Part {
    id: String,
    base64: String,
}

#[derive(Template)]
#[template(
    source = r#"{{ markup|safe }}
<script type="application/json" id="viewer-config">{{ config|safe }}</script>
{%- for shader in shaders %}
<script type="text/plain" id="shader-{{ shader.name }}">
{{ shader.source|safe }}</script>
{%- endfor %}
{%- for part in parts %}
<script type="text/plain" id="{{ part.id }}">{{ part.base64|safe }}</script>
{%- endfor %}
<script type="module">
{%- for script in scripts %}
{{ script|safe }}
{%- endfor %}
</script>"#,
    ext = "html"
)]
struct Fragment<'a> {
    markup: &'static str,
    config: String,
    shaders: &'a [Shader],
    parts: &'a [Part],
    scripts: &'a [&'static str],
}

#[derive(Template)]
#[template(path = "viewer/page.html")]
struct ViewPage {
    frame: Frame,
    fragment: String,
}

impl Viewer {
    /// How far a progressive file is shown: about 320 bytes a triangle, half of which are in the page.
    pub const MOST_CONTINUOUS: Fineness = Fineness::Triangles(150_000);

    /// Puts models into a view: the source first, then its levels, the finest first.
    ///
    /// # Errors
    /// [`Error::Invalid`] if a model or an image in it is damaged or takes more memory than `limit`.
    pub fn new(exhibits: &[Exhibit<'_>], limit: MemoryLimit) -> Result<Self> {
        let distances = source_distances(exhibits, limit)?;
        let mut pool = ImagePool::new(limit);
        let mut view = Self { config: json!({}), parts: Vec::new() };
        let (mut models, mut notes) = (Vec::new(), Vec::new());
        let glbs = encode_all(exhibits, distances.as_ref())?;
        let shown = kept(&glbs);
        for (index, (exhibit, glb)) in exhibits.iter().zip(&glbs).enumerate() {
            let name = match (index, exhibit.timeline) {
                (0, _) => "Source".to_owned(),
                (_, Some(_)) => "Continuous".to_owned(),
                _ => format!("Level {index}"),
            };
            if !shown[index] {
                notes.push(left_out(&name, exhibit.file, glb.len()));
                continue;
            }
            notes.extend(exhibit.timeline.and_then(|own| cut_short(exhibit.file, own)));
            let id = format!("model-{index}");
            let is_measured = index > 0 && shown[0] && exhibit.timeline.is_none();
            let distances = distances.as_ref().filter(|_| is_measured);
            models.push(json!({
                "id": &id, "name": name, "file": exhibit.file, "is_level": index > 0,
                "images": pool.add_all(exhibit.asset)?,
                "certificate": exhibit.certificate(),
                "distances": distances.map(|distances| distances.describe(index - 1)),
            }));
            view.parts.push(Part { id, base64: STANDARD.encode(packed(glb)?) });
        }
        notes.extend(pool.fit()?);
        let images = pool.images().enumerate().map(|(index, image)| {
            let id = format!("image-{index}");
            view.parts
                .push(Part { id: id.clone(), base64: STANDARD.encode(image.bytes.as_slice()) });
            json!({"id": id, "mime": image.format.mime()})
        });
        let images: Vec<Value> = images.collect();
        view.config = json!({"models": models, "images": images, "notes": notes});
        Ok(view)
    }

    /// The view as a part of a page whose style has [`STYLE`].
    ///
    /// # Errors
    /// [`Error::Internal`] if the template fails.
    pub(super) fn to_html(&self) -> Result<String> {
        // No text in it may end the element that holds it.
        let config = self.config.to_string().replace('<', "\\u003c");
        let fragment = Fragment {
            markup: MARKUP,
            config,
            shaders: &SHADERS,
            parts: &self.parts,
            scripts: &SCRIPTS,
        };
        fragment.render().map_err(Error::internal)
    }

    /// A page of the view alone.
    ///
    /// # Errors
    /// [`Error::Internal`] if the template fails.
    pub fn to_page(&self, title: &str) -> Result<String> {
        let page = ViewPage { frame: Frame::new(title, &[STYLE]), fragment: self.to_html()? };
        page.render().map_err(Error::internal)
    }
}

/// The models as .glb, the source with its distances to the levels.
fn encode_all(
    exhibits: &[Exhibit<'_>],
    distances: Option<&SourceDistances>,
) -> Result<Vec<Vec<u8>>> {
    let encode = |(index, exhibit): (usize, &Exhibit<'_>)| {
        plain_glb(exhibit.asset, distances.filter(|_| index == 0), exhibit.timeline)
    };
    exhibits.iter().enumerate().map(encode).collect()
}

/// A model as gzip, which browsers unpack: tables of a progressive file take half of their bytes so.
fn packed(glb: &[u8]) -> Result<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(glb).and_then(|()| encoder.finish()).map_err(Error::internal)
}

/// Which models the page holds: the coarsest, and all finer ones for which there is room.
fn kept(glbs: &[Vec<u8>]) -> Vec<bool> {
    let mut room = MOST_GEOMETRY;
    let mut kept: Vec<bool> = vec![false; glbs.len()];
    for (index, glb) in glbs.iter().enumerate().rev() {
        let is_last = index + 1 == glbs.len();
        let left = room.checked_sub(glb.len()).or(is_last.then_some(0));
        let Some(left) = left else { break };
        (room, kept[index]) = (left, true);
    }
    kept
}

/// That a progressive file is not shown up to its source, if it is not.
fn cut_short(file: &str, timeline: &Timeline) -> Option<String> {
    let [shown, all] = [timeline.finest(), timeline.source];
    let reason = timeline.missed.unwrap_or("a page holds no more of them");
    (shown < all).then(|| format!("{file} is shown up to {shown} of {all} triangles: {reason}."))
}

fn left_out(name: &str, file: &str, bytes: usize) -> String {
    let megabytes = |bytes: usize| bytes.div_ceil(1 << 20);
    format!(
        "{name} ({file}) is left out: its geometry takes {} MiB, and a page holds {} MiB. What \
         follows is compared with the finest model that is here.",
        megabytes(bytes),
        megabytes(MOST_GEOMETRY)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_finest_models_are_left_out_if_there_is_no_room() {
        let glbs = |sizes: &[usize]| -> Vec<Vec<u8>> {
            sizes.iter().map(|mebibytes| vec![0; mebibytes << 20]).collect()
        };
        assert_eq!(kept(&glbs(&[40, 5, 2])), [true; 3]);
        assert_eq!(kept(&glbs(&[42, 5, 2])), [false, true, true]);
        assert_eq!(kept(&glbs(&[1, 60])), [false, true], "something is shown");
    }

    #[test]
    fn no_script_or_text_ends_the_element_that_holds_it() {
        let script = SCRIPTS.concat();
        assert!(!script.contains("</script") && !script.contains("<!--"));
        assert!(SHADERS.iter().all(|shader| !shader.source.contains("</script")));
        let view = Viewer { config: json!({"file": "</script><b>"}), parts: Vec::new() };
        assert!(!view.to_html().unwrap().contains("<b>"));
    }
}
