//! What is seen decides: the reference that levels are compared with, the sizes at which they take over,
//! and levels that are found by what they reach.

use std::path::Path;

use crate::common::build::Build;
use crate::common::shapes;
use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

/// A folder with the sample, and the binary run in it.
struct Stage(TempDir);

impl Stage {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/sample.glb");
        std::fs::copy(sample, folder.path().join("sample.glb")).expect("the sample");
        let ball = Build::of(&shapes::sphere(96, 48)).glb();
        std::fs::write(folder.path().join("ball.glb"), ball).expect("a ball");
        Self(folder)
    }

    /// Standard output and standard error of a run, and whether it went well.
    fn run(&self, arguments: &str) -> (String, String, bool) {
        let mut command = Command::cargo_bin("seamwise").expect("the binary");
        let done = command.current_dir(&self.0).args(arguments.split(' ')).output().expect("a run");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (text(&done.stdout), text(&done.stderr), done.status.success())
    }

    fn json(&self, name: &str) -> Value {
        let text = std::fs::read_to_string(self.0.path().join(name)).expect("a report");
        serde_json::from_str(&text).expect("JSON")
    }

    fn size(&self, name: &str) -> u64 {
        std::fs::metadata(self.0.path().join(name)).expect("a file").len()
    }
}

/// What of a bake's measuring these need.
const FEW: &str = "--views 6 --resolution 128 --samples 20000 --screen 160x90";
const FAST: &str = "--views 2 --resolution 64 --samples 1000 --screen-height 128";

#[test]
fn a_source_that_bleeds_is_compared_as_if_it_did_not_and_the_output_says_so() {
    let stage = Stage::new();
    let (table, _, well) =
        stage.run(&format!("evaluate sample.glb sample.glb {FAST} --json filled.json"));
    assert!(well && table.contains("the source's atlas bleeds"), "{table}");
    let report = stage.json("filled.json");
    let textures = &report["reference"]["textures"];
    assert_eq!((&textures["cleaned"], &textures["images"][0]), (&true.into(), &0.into()));
    assert!(textures["bleeding_rms_luminance_srgb"].as_f64() > Some(1e-4), "{textures}");
    let off = |report: &Value| report["candidates"][0]["metrics"]["rms_luminance"].as_f64();
    assert!(off(&report) > Some(0.0), "what bleeds is a difference");
    let (table, _, well) = stage
        .run(&format!("evaluate sample.glb sample.glb {FAST} --json as_is.json --reference-as-is"));
    assert!(well && !table.contains("bleeds"), "{table}");
    let report = stage.json("as_is.json");
    assert_eq!(report["reference"]["textures"]["cleaned"], false);
    assert_eq!(off(&report), Some(0.0));
    // Older scripts still run.
    assert!(stage.run(&format!("evaluate ball.glb ball.glb {FAST} --clean-reference")).2);
}

#[test]
fn a_level_is_chosen_by_sizes_that_fall_and_each_was_looked_at() {
    let stage = Stage::new();
    let (table, _, well) = stage.run(&format!("bake sample.glb -o out --ratios 0.25,0.03 {FEW}"));
    assert!(well && table.contains("the source's atlas bleeds"), "{table}");
    let report = stage.json("out/sample.json");
    assert_eq!(report["reference_textures"]["cleaned"], true);
    let levels = report["levels"].as_array().expect("levels");
    let size = |level: &Value| level["largest_size_pixels"].as_f64().expect("a size");
    assert!(size(&levels[0]) > size(&levels[1]), "{report}");
    for level in levels {
        let seen = &level["metrics"]["at_switch"];
        assert_eq!(seen["pixels"].as_f64(), Some(size(level)));
        assert!(seen["visible_difference"].as_f64() <= Some(0.06), "{seen}");
        let off = level["metrics"]["distance_p999"].as_f64().expect("a distance");
        assert!(off * size(level) <= 1.0 + 1e-9, "{off}");
    }
    for (level, wanted) in levels.iter().zip(["1\n", "2\n"]) {
        let asked = format!("select out/sample.json --pixels {}", size(level) - 0.5);
        assert_eq!(stage.run(&asked).0, wanted);
    }
}

#[test]
fn levels_are_as_large_as_their_bytes_and_vertices_allow() {
    let stage = Stage::new();
    let (_, said, well) = stage.run("bake ball.glb -o out --max-bytes 60KB,20KB --no-evaluate");
    assert!(well, "{said}");
    for (name, most) in [("out/ball_lod1.glb", 60_000.0), ("out/ball_lod2.glb", 20_000.0)] {
        let share = stage.size(name) as f64 / most;
        assert!(share <= 1.0 && share > 0.98, "{name}: {share}");
    }
    let report = stage.json("out/ball.json");
    let goal = &report["levels"][0]["goal"];
    assert_eq!(goal["measure"], "bytes");
    assert_eq!(goal["value"].as_f64(), Some(stage.size("out/ball_lod1.glb") as f64));
    let (_, said, well) = stage.run("bake ball.glb -o few --vertices 500,80 --no-evaluate");
    assert!(well, "{said}");
    let report = stage.json("few/ball.json");
    for (level, most) in [(0, 500), (1, 80)] {
        let vertices = report["levels"][level]["vertices"].as_u64().expect("a count");
        assert!(vertices <= most && vertices + 8 >= most, "{vertices} of {most}");
    }
    let (_, said, well) = stage.run("bake sample.glb -o none --max-bytes 20KB --no-evaluate");
    assert!(!well && said.contains("are textures"), "{said}");
    assert!(!stage.0.path().join("none").exists());
}

#[test]
fn levels_are_as_coarse_as_what_is_seen_of_them_allows() {
    let stage = Stage::new();
    let (table, said, well) =
        stage.run(&format!("bake ball.glb -o out --quality 0.995,0.97 --at-pixels 96 {FEW}"));
    assert!(well && table.contains("similarity 0.99"), "{table}{said}");
    let report = stage.json("out/ball.json");
    for (level, least) in [(0, 0.995), (1, 0.97)] {
        let goal = &report["levels"][level]["goal"];
        let value = goal["value"].as_f64().expect("a value");
        assert!(value >= least && value < least + 0.01, "{goal}");
        assert_eq!(goal["pixels"], 96);
    }
    let (_, said, well) =
        stage.run(&format!("bake ball.glb -o near --max-pixels-off 1,4 --at-pixels 400 {FEW}"));
    assert!(well, "{said}");
    let report = stage.json("near/ball.json");
    for (level, most) in [(0, 1.0), (1, 4.0)] {
        let off = report["levels"][level]["metrics"]["distance_p999"].as_f64().expect("a figure");
        let share = 400.0 * off / most;
        assert!(share <= 1.0 && share > 0.8, "level {level}: {share} of the bound");
    }
}

#[test]
fn goals_that_make_no_sense_are_refused_with_advice() {
    let stage = Stage::new();
    for (arguments, advice) in [
        ("--quality 95", "--texture-quality"),
        ("--quality 0.9,0.99", "from fine to coarse"),
        ("--quality 0.9 --vertices 100", "one goal"),
        ("--vertices 100 --levels 2", "cannot be used with"),
        ("--max-bytes 1MB --textures transfer --texture-scale 0.5", "--texture-scale"),
    ] {
        let (_, said, well) = stage.run(&format!("bake ball.glb -o out {arguments}"));
        assert!(!well && said.contains(advice), "{arguments}: {said}");
    }
}
