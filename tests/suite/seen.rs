//! What is seen decides: the reference that levels are compared with, and the sizes at which they take
//! over.

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
}

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
    let (table, _, well) = stage.run("bake sample.glb -o out --screen 320x180 --ratios 0.25,0.03");
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
