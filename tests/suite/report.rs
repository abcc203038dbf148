//! The page of a bake and of an evaluation: that it holds all it shows, and that a browser shows it.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::assets::{cube, picture, textured};
use crate::common::{Baked, measured, shapes};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use seamwise::bake::options::{BakeOptions, ReportOptions, Textures};
use seamwise::transfer::TransferOptions;

fn reported(threads: bool) -> BakeOptions {
    BakeOptions { report: Some(ReportOptions { threads }), ..measured() }
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
    for beyond in ["http:", "https:", "url(", "@import", "<script", "<iframe", "srcset"] {
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

/// Six views of the source and four levels, the differences, the wireframes; twice an atlas.
const PICTURES: usize = 6 * 5 + 6 * 4 + 5 + 2;

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
    assert!(page.contains("1 thread<") && page.contains("2 threads<") && page.contains("1.00 ×"));
    assert!(!page.contains("<svg"), "nothing was measured");
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
    assert_self_contained(&page, 6 * 4 + 6 * 3 + 4);
    assert!(!page.contains("<c>"), "a file's name is not escaped");
    assert!(page.contains("bad.glb could not be compared"));
    let dots = page.matches("class=\"dotted\"").count();
    assert_eq!(dots, 3, "one for each that the charts show");
    let charts = page.matches("<svg").count();
    assert_eq!(page.matches("class=\"line\"").count(), charts, "one line, of the two levels");
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
    let flags = "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run \
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
    assert!(!said.contains("CONSOLE"), "{said}");
}
