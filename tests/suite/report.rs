//! The page of a bake and of an evaluation: that it holds all it shows, and that a browser shows it.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::assets::{cube, picture, textured};
use crate::common::output::Output;
use crate::common::{Baked, measured, shapes};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use seamwise::bake::options::{BakeOptions, ReportOptions, Textures};
use seamwise::transfer::TransferOptions;

fn reported(threads: bool) -> BakeOptions {
    BakeOptions {
        report: Some(ReportOptions { threads, thread_runs: 2, apart: false }),
        ..measured()
    }
}

/// The page of a bake of the seam cube, whose atlas is repaired.
fn bake_cube(name: &str) -> (Baked, String) {
    let baked = Baked::bytes(name, &cube(6).glb(), &reported(false));
    let page = std::fs::read_to_string(page_path(&baked)).expect("a page");
    (baked, page)
}

fn page_path(baked: &Baked) -> PathBuf {
    baked.folder.path().join(format!("{}.html", baked.stem))
}

/// The values of an attribute, in order.
fn attributes<'a>(page: &'a str, name: &str) -> Vec<&'a str> {
    let opening = format!(" {name}=\"");
    page.split(&opening).skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

/// Fails if the page reads anything but itself, or a picture in it is none.
fn assert_self_contained(page: &str, pictures: usize) {
    for beyond in
        ["http:", "https:", "url(", "@import", "<script src", "<iframe", "srcset", "import("]
    {
        assert!(!page.contains(beyond), "{beyond}");
    }
    assert_eq!(attributes(page, "href"), ["data:,"]);
    let sources = attributes(page, "src");
    assert_eq!(sources.len(), pictures);
    for source in sources {
        let (kind, bytes) = source.split_once(";base64,").expect("base64");
        assert!(["data:image/png", "data:image/jpeg"].contains(&kind), "{kind}");
        let bytes = STANDARD.decode(bytes).expect("base64");
        let image = image::load_from_memory(&bytes).expect("an image");
        assert!(image.width() > 0 && image.height() > 0);
    }
}

/// Six views of the source and four levels, the differences, the wireframes; three of an atlas.
const PICTURES: usize = 6 * 5 + 6 * 4 + 6 * 5 + 3;

#[test]
fn the_page_of_a_bake_holds_all_it_shows() {
    let (baked, page) = bake_cube("cube");
    assert_self_contained(&page, PICTURES);
    assert!(page.len() < 6_000_000, "{}", page.len());
    for level in &baked.report.levels {
        assert!(page.contains(&format!(">{}<", level.triangles)), "{}", level.triangles);
        let metrics = level.metrics.expect("figures");
        assert!(page.contains(&format!("{:.5}", metrics.rms_luminance_srgb)));
    }
    for part in ["<svg", "RMS distance", "Silhouette overlap", "Atlases", "simplify"] {
        assert!(page.contains(part), "{part}");
    }
}

/// The bytes of an element that holds them in base64.
fn embedded(page: &str, id: &str) -> Vec<u8> {
    let opening = format!("<script type=\"text/plain\" id=\"{id}\">");
    let (_, rest) = page.split_once(&opening).expect("the element");
    STANDARD.decode(rest.split('<').next().expect("its text")).expect("base64")
}

/// A model of the view.
fn model_of(page: &str, index: usize) -> Vec<u8> {
    let packed = embedded(page, &format!("model-{index}"));
    let mut glb = Vec::new();
    flate2::read::GzDecoder::new(&packed[..]).read_to_end(&mut glb).expect("gzip");
    glb
}

/// What the page tells its interactive view.
fn view_config(page: &str) -> serde_json::Value {
    let opening = "<script type=\"application/json\" id=\"viewer-config\">";
    let (_, rest) = page.split_once(opening).expect("the element");
    serde_json::from_str(rest.split('<').next().expect("its text")).expect("JSON")
}

#[test]
fn the_view_holds_the_source_and_the_levels_with_their_sizes_and_each_image_once() {
    let (baked, page) = bake_cube("cube");
    let config = view_config(&page);
    let models = config["models"].as_array().expect("models");
    assert_eq!(models.len(), 5);
    let triangles = std::iter::once(baked.report.input.triangles)
        .chain(baked.report.levels.iter().map(|level| level.triangles));
    for ((index, model), triangles) in models.iter().enumerate().zip(triangles) {
        let glb = model_of(&page, index);
        let gltf = gltf::Gltf::from_slice_without_validation(&glb).expect("a .glb");
        let primitives = gltf.meshes().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>());
        let corners: usize = primitives.map(|own| own.indices().expect("indices").count()).sum();
        assert_eq!(corners, 3 * triangles, "level {index}");
        assert_eq!(gltf.skins().count() + gltf.animations().count(), 0);
        let size = &model["certificate"]["largest_size_pixels"];
        assert_eq!(
            size.as_f64(),
            index.checked_sub(1).and_then(|at| { baked.report.levels[at].largest_size_pixels })
        );
    }
    // The source's image, and the repaired one that all levels share.
    assert_eq!(config["images"].as_array().map(Vec::len), Some(2));
    assert_eq!(models[1]["images"], models[4]["images"]);
    let first = &models[0]["images"][0];
    let source = Output::from_bytes(&cube(6).glb(), "cube");
    assert_eq!(embedded(&page, &format!("image-{first}")), source.image_bytes(0));
}

#[test]
fn the_view_colors_the_source_by_its_distance_to_each_level() {
    let (_, page) = bake_cube("cube");
    let config = view_config(&page);
    let glb = model_of(&page, 0);
    let gltf = gltf::Gltf::from_slice_without_validation(&glb).expect("a .glb");
    let primitive = gltf.meshes().next().and_then(|mesh| mesh.primitives().next()).expect("one");
    let names: Vec<String> = primitive
        .attributes()
        .filter_map(|(semantic, accessor)| {
            assert!(accessor.count() > 0);
            matches!(semantic, gltf::Semantic::Extras(_)).then(|| semantic.to_string())
        })
        .collect();
    assert_eq!(names, ["_DISTANCE_0"]);
    for (index, model) in config["models"].as_array().expect("models").iter().enumerate().skip(1) {
        assert_eq!(model["distances"]["component"], index - 1);
        assert!(model["distances"]["most"].as_f64().is_some_and(|most| most > 0.0 && most < 1.0));
    }
}

#[test]
fn the_page_shows_the_textures_that_each_level_has_of_its_own() {
    let transfer = Textures::Transfer(TransferOptions::default());
    let options = BakeOptions { textures: transfer, ..reported(false) };
    let baked = Baked::bytes("cube", &cube(6).glb(), &options);
    let page = std::fs::read_to_string(page_path(&baked)).expect("a page");
    let levels: Vec<_> = (1..=4).map(|level| baked.level(level)).collect();
    let images: usize = levels.iter().map(|level| level.gltf.images().len()).sum();
    assert!(images >= 4);
    assert_self_contained(&page, PICTURES + images);
    for level in &levels {
        let bytes = level.image_bytes(0).len();
        assert!(page.contains(&format!(", {} kB", bytes.div_ceil(1000))), "{bytes}");
    }
}

#[test]
fn two_bakes_write_the_same_page_but_for_what_they_cost() {
    let pages = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let page = pool.install(|| bake_cube("cube").1);
        let (before, cost) = page.split_once("<section id=\"cost\">").expect("a cost");
        let after = cost.split_once("</section>").expect("its end").1;
        format!("{before}{after}")
    });
    assert!(pages[0] == pages[1]);
}

#[test]
fn the_time_on_each_number_of_threads_is_shown_if_asked_for() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
    let glb = textured(&shapes::sphere(16, 8), &picture(16)).glb();
    let options = BakeOptions { evaluate: None, ..reported(true) };
    let page = pool.install(|| {
        let baked = Baked::bytes("sphere", &glb, &options);
        std::fs::read_to_string(page_path(&baked)).expect("a page")
    });
    assert!(page.contains("1 threads, ") && page.contains("2 threads, "));
    assert!(page.contains("Mean of 2 runs") && page.contains("line error"));
    assert_eq!(page.matches("<svg").count(), 1, "nothing was measured but time");
}

#[test]
fn an_evaluation_writes_a_page_of_what_could_be_compared() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes);
    for (name, n) in [("a.glb", 24), ("b_lod1.glb", 16), ("b_lod2.glb", 10), ("<c>.glb", 12)] {
        let glb = textured(&shapes::sphere(n, n / 2), &picture(32)).glb();
        write(name, &glb).expect("a file is written");
    }
    write("bad.glb", b"glTF").expect("a file is written");
    let files = ["a.glb", "b_lod1.glb", "b_lod2.glb", "<c>.glb", "bad.glb"];
    let quick = ["--views", "2", "--resolution", "32", "--samples", "1000"];
    assert_cmd::Command::cargo_bin("seamwise")
        .expect("the binary")
        .current_dir(&folder)
        .arg("evaluate")
        .args(files)
        .args(quick)
        .args(["--report", "page.html"])
        .assert()
        .code(1);
    let page = std::fs::read_to_string(folder.path().join("page.html")).expect("a page");
    assert_self_contained(&page, 6 * 4 + 6 * 3 + 6 * 4);
    assert!(!page.contains("<c>"), "a file's name is not escaped");
    assert!(page.contains("bad.glb could not be compared"));
    let dots = page.matches("class=\"dotted\"").count();
    assert_eq!(dots, 3, "one for each that the charts show");
    let charts = page.matches("<svg").count();
    assert_eq!(page.matches("class=\"line ").count(), charts, "one line, of the two levels");
}

fn view(folder: &Path, args: &[&str]) -> assert_cmd::assert::Assert {
    assert_cmd::Command::cargo_bin("seamwise")
        .expect("the binary")
        .current_dir(folder)
        .arg("view")
        .args(args)
        .assert()
}

#[test]
fn a_view_is_written_of_files_of_any_kind_and_never_over_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.path().join(name), bytes).expect("a file is written");
    };
    write("a<b>.glb", &cube(6).glb());
    write("b.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    view(folder.path(), &["a<b>.glb", "b.obj", "-o", "page.html"]).success();
    let page = std::fs::read_to_string(folder.path().join("page.html")).expect("a page");
    assert_self_contained(&page, 0);
    assert!(!page.contains("<b>"), "a file's name is not escaped");
    let config = view_config(&page);
    assert_eq!(config["models"][1]["file"], "b.obj");
    assert!(config["models"][1]["certificate"].is_null());
    view(folder.path(), &["b.obj", "-o", "b.obj"]).code(2);
    let missing = view(folder.path(), &["b.obj", "none.glb", "-o", "other.html"]).code(2);
    let said = String::from_utf8_lossy(&missing.get_output().stderr).into_owned();
    assert!(said.contains("none.glb"), "{said}");
    assert!(!folder.path().join("other.html").exists());
}

/// What the page tells of itself in the browser, as an attribute of its body.
const PROBE: &str = r#"<script>
const errors = [];
addEventListener("error", event => errors.push(event.message || "a resource"), true);
addEventListener("load", () => {
  const all = [...document.images];
  const shown = all.filter(image => image.complete && image.naturalWidth > 0);
  const wide = document.documentElement.scrollWidth > innerWidth ? 1 : 0;
  document.body.dataset.probe = `${shown.length}/${all.length} errors=${errors.length} wide=${wide}`;
});
</script>"#;

/// The page as a browser leaves it, and what the browser says; nothing where there is none.
fn browse(page: &Path) -> Option<[String; 2]> {
    let profile = tempfile::tempdir().expect("a temporary folder");
    let flags = "--headless --no-sandbox --enable-unsafe-swiftshader --disable-quic --no-first-run \
                 --disable-background-networking --disable-component-update --disable-sync \
                 --window-size=1280,900 --virtual-time-budget=10000 --enable-logging=stderr \
                 --dump-dom";
    let run = Command::new("chromium")
        .args(flags.split_whitespace())
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("file://{}", page.display()))
        .output();
    match run {
        Ok(run) => Some([run.stdout, run.stderr].map(|text| String::from_utf8_lossy(&text).into())),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            println!("skipped: chromium is absent");
            None
        }
        Err(error) => panic!("chromium: {error}"),
    }
}

#[test]
fn a_browser_shows_every_picture_without_an_error() {
    let (baked, page) = bake_cube("cube");
    let probed = baked.folder.path().join("probed.html");
    // First in the head, so that it sees all errors.
    let with_probe = page.replacen("<head>", &format!("<head>{PROBE}"), 1);
    std::fs::write(&probed, with_probe).expect("a page is written");
    let Some([dom, said]) = browse(&probed) else { return };
    let expected = format!("data-probe=\"{PICTURES}/{PICTURES} errors=0 wide=0\"");
    let found = dom.split("<body").nth(1).map(|body| body.split('>').next());
    assert!(dom.contains(&expected), "{found:?}");
    // But for what drawing without a graphics processor says of itself.
    let complaint =
        said.lines().find(|line| line.contains("CONSOLE") && !line.contains("GPU stall"));
    assert_eq!(complaint, None);
    let triangles = format!("data-triangles=\"{} ", baked.report.input.triangles);
    assert!(dom.contains(&triangles), "the view shows the source beside a level");
}
