//! The real binary in a temporary folder: exit codes, messages, files.

use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::assets::{cube, picture, textured};
use crate::common::build::Build;
use crate::common::{folder_files, shapes};
use assert_cmd::Command;
use serde_json::{Value, json};
use tempfile::TempDir;

/// A folder with a few inputs.
pub(crate) struct Stage {
    pub(crate) folder: TempDir,
}

impl Stage {
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a temporary folder") }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn put(&self, name: &str, bytes: &[u8]) -> &Self {
        std::fs::create_dir_all(self.path(name).parent().expect("a folder")).expect("a folder");
        std::fs::write(self.path(name), bytes).expect("a file is written");
        self
    }

    /// Runs the tool in the folder.
    pub(crate) fn run(&self, arguments: &[&str]) -> Ran {
        Ran::new(self.run_with(arguments, b""))
    }

    /// Runs it with something on standard input.
    pub(crate) fn run_with(&self, arguments: &[&str], input: &[u8]) -> Output {
        let mut command = Command::cargo_bin("seamwise").expect("the binary");
        let command = command.current_dir(&self.folder).args(arguments).write_stdin(input);
        command.output().expect("it runs")
    }
}

/// How a run ended.
#[derive(Debug)]
pub(crate) struct Ran {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Ran {
    fn new(output: Output) -> Self {
        Self {
            code: output.status.code().expect("an exit code"),
            stdout: String::from_utf8(output.stdout).expect("UTF-8"),
            stderr: String::from_utf8(output.stderr).expect("UTF-8"),
        }
    }
}

pub(crate) fn names(folder: &Path) -> Vec<String> {
    folder_files(folder).into_iter().map(|(name, _)| name).collect()
}

pub(crate) fn json_file(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("a file")).expect("JSON")
}

pub(crate) fn sphere() -> Vec<u8> {
    textured(&shapes::sphere(24, 12), &picture(32)).glb()
}

#[test]
fn help_has_an_example_for_each_subcommand() {
    let stage = Stage::new();
    for subcommand in ["bake", "evaluate"] {
        let help = stage.run(&[subcommand, "--help"]);
        assert_eq!((help.code, help.stderr.as_str()), (0, ""));
        let example = format!("seamwise {subcommand} ");
        let examples = help.stdout.split("Example").nth(1).unwrap_or_default();
        assert!(examples.contains(&example), "{}", help.stdout);
        for option in ["--threads", "--quiet"] {
            assert!(help.stdout.contains(option), "{subcommand} {option}");
        }
        assert!(stage.run(&["--help"]).stdout.contains(subcommand));
    }
    assert!(stage.run(&["--version"]).stdout.contains(env!("CARGO_PKG_VERSION")));
}

#[test]
fn the_options_of_the_design_are_there() {
    let stage = Stage::new();
    let help = stage.run(&["bake", "--help"]).stdout;
    for option in [
        "-o",
        "--levels",
        "--ratios",
        "--triangles",
        "--budget-per",
        "--max-error",
        "--max-rotation",
        "--fast",
        "--join-distance",
        "--keep-volume",
        "--importance-map",
        "--view-from",
        "--no-polish",
        "--textures",
        "--merge-materials",
        "--compress",
        "--format",
        "--layout",
        "--share-vertices",
        "--no-evaluate",
        "--report",
    ] {
        assert!(help.contains(option), "bake {option}");
    }
    let help = stage.run(&["evaluate", "--help"]).stdout;
    for option in ["--views", "--resolution", "--samples", "--json", "--report"] {
        assert!(help.contains(option), "evaluate {option}");
    }
    let help = stage.run(&["repair", "--help"]).stdout;
    for option in [
        "--mesh",
        "--mask",
        "--background",
        "--keep-padding",
        "--diff",
        "--scale",
        "--blocks",
        "--anisotropy",
        "--equalize-seams",
        "--json",
        "--quality",
        "--png",
        "--memory-limit",
    ] {
        assert!(help.contains(option), "repair {option}");
    }
}

#[test]
fn a_bake_writes_its_files_and_a_table() {
    let stage = Stage::new();
    stage.put("a.glb", &sphere());
    let ran = stage.run(&["bake", "a.glb", "-o", "out/deep", "--no-evaluate"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{ran:?}");
    let written = names(&stage.path("out/deep"));
    assert_eq!(written, ["a.json", "a_lod1.glb", "a_lod2.glb", "a_lod3.glb", "a_lod4.glb"]);
    let report = json_file(&stage.path("out/deep/a.json"));
    for level in report["levels"].as_array().expect("levels") {
        let triangles = level["triangles"].to_string();
        assert!(ran.stdout.contains(&triangles), "{triangles} is not in {}", ran.stdout);
    }
    assert!(ran.stdout.contains("source") && ran.stdout.contains("528"), "{}", ran.stdout);
}

#[test]
fn the_report_of_a_bake_has_its_keys() {
    let stage = Stage::new();
    stage.put("a.glb", &sphere());
    let few = ["--views", "2", "--resolution", "64"];
    let bake = ["bake", "a.glb", "-o", "out", "--ratios", "0.4,0.1"];
    assert_eq!(stage.run(&[&bake[..], &few].concat()).code, 0);
    let report = json_file(&stage.path("out/a.json"));
    assert_eq!(report["schema"], 1);
    assert_eq!(report["input"]["triangles"], 528);
    assert_eq!(report["input"]["file"], "a.glb");
    let levels = report["levels"].as_array().expect("levels");
    assert_eq!(
        levels.iter().map(|level| &level["ratio"]).collect::<Vec<_>>(),
        [&json!(0.4), &json!(0.1)]
    );
    for level in levels {
        for key in ["ratio", "triangles", "points", "wedges", "error"] {
            assert!(level[key].is_number(), "{key}: {level}");
        }
        assert!(level["reached"].is_boolean() && level.get("why").is_some(), "{level}");
        assert_metrics(&level["metrics"]);
    }
    for stage in ["read", "weld", "simplify", "polish", "repair", "transfer", "write", "evaluate"] {
        assert!(report["seconds"][stage].is_number(), "{stage}");
    }
    assert!(report.get("peak_memory_bytes").is_some());
}

fn assert_metrics(metrics: &Value) {
    let keys = [
        "rms_luminance",
        "rms_luminance_srgb",
        "ssim",
        "distance_rms",
        "distance_max",
        "color_rms",
        "normal_degrees_rms",
        "volume_ratio",
    ];
    for key in keys {
        assert!(metrics[key].is_number(), "{key}: {metrics}");
    }
    for way in ["forward", "backward"] {
        assert!(metrics[way]["distance_rms"].is_number(), "{way}: {metrics}");
        assert!(metrics[way]["distance_max"].is_number(), "{way}: {metrics}");
    }
    let seen = &metrics["at_switch"];
    for key in ["resolution", "rms_luminance", "rms_luminance_srgb", "ssim", "visible_difference"] {
        assert!(seen[key].is_number(), "{key}: {metrics}");
    }
    // Without any difference there is no largest size.
    assert!(seen["pixels"].is_number() || metrics["distance_max"] == 0.0, "{metrics}");
}

#[test]
fn without_evaluation_there_are_no_metrics() {
    let stage = Stage::new();
    stage.put("a.glb", &sphere());
    assert_eq!(
        stage.run(&["bake", "a.glb", "-o", "out", "--no-evaluate", "--levels", "2"]).code,
        0
    );
    let report = json_file(&stage.path("out/a.json"));
    assert_eq!(report["levels"].as_array().map(Vec::len), Some(2));
    assert_eq!(report["levels"][0]["metrics"], Value::Null);
    assert_eq!(report["seconds"]["evaluate"].as_f64().map(|s| s < 0.01), Some(true));
}

#[test]
fn a_polished_level_is_nearer_than_one_that_is_not() {
    let stage = Stage::new();
    stage.put("a.glb", &sphere());
    let ran = |out: &str, more: &[&str]| {
        let bake =
            ["bake", "a.glb", "-o", out, "--levels", "2", "--views", "1", "--resolution", "16"];
        let run = stage.run(&[&bake, more].concat());
        assert_eq!(run.code, 0, "{run:?}");
        let report = json_file(&stage.path(&format!("{out}/a.json")));
        let distance = report["levels"][1]["metrics"]["distance_rms"].as_f64();
        (distance.expect("a distance"), report["seconds"]["polish"].as_f64().expect("a time"))
    };
    let (polished, seconds) = ran("polished", &[]);
    let (plain, none) = ran("plain", &["--no-polish"]);
    assert!(polished < 0.95 * plain, "{polished} of {plain}");
    assert!(seconds > none, "{seconds} s beside {none} s");
    let (fast, _) = ran("fast", &["--fast"]);
    assert!(polished < fast && fast < plain, "{fast} is not between {polished} and {plain}");
}

#[test]
fn quiet_says_nothing_but_errors() {
    let stage = Stage::new();
    stage.put("a.glb", &sphere()).put("bad.glb", b"no glTF at all");
    let ran = stage.run(&["bake", "--quiet", "a.glb", "-o", "out", "--no-evaluate"]);
    assert_eq!((ran.code, ran.stdout.as_str(), ran.stderr.as_str()), (0, "", ""));
    let ran = stage.run(&["-q", "bake", "a.glb", "bad.glb", "-o", "out", "--no-evaluate"]);
    assert_eq!((ran.code, ran.stdout.as_str()), (1, ""));
    assert!(ran.stderr.contains("bad.glb"), "{ran:?}");
}

#[test]
fn one_bad_input_does_not_stop_the_others() {
    let stage = Stage::new();
    stage
        .put("good.glb", &sphere())
        .put("bad.glb", b"glTF but not really")
        .put("last.glb", &cube(4).glb());
    let ran = stage.run(&[
        "bake",
        "bad.glb",
        "good.glb",
        "missing.glb",
        "last.glb",
        "-o",
        "out",
        "--no-evaluate",
    ]);
    assert_eq!(ran.code, 1, "{ran:?}");
    let named: Vec<bool> =
        ["bad.glb", "missing.glb", "good.glb", "last.glb"].map(|n| ran.stderr.contains(n)).to_vec();
    assert_eq!(named, [true, true, false, false], "{}", ran.stderr);
    assert!(ran.stderr.lines().all(|line| line.starts_with("seamwise: ")), "{}", ran.stderr);
    assert!(!ran.stdout.contains("bad") && ran.stdout.contains("good"), "{}", ran.stdout);
    let written = names(&stage.path("out"));
    assert_eq!(written.len(), 10, "{written:?}");
    assert!(written.iter().all(|name| name.starts_with("good") || name.starts_with("last")));
}

#[test]
fn nothing_is_written_when_nothing_could_be_baked() {
    let stage = Stage::new();
    stage.put("bad.glb", b"glTF").put("empty.gltf", br#"{"asset": {"version": "2.0"}}"#);
    for input in ["bad.glb", "empty.gltf", "missing.glb"] {
        let ran = stage.run(&["bake", input, "-o", "out"]);
        assert_eq!((ran.code, ran.stdout.as_str()), (2, ""), "{input}: {ran:?}");
        assert!(ran.stderr.contains(input), "{input}: {ran:?}");
        assert!(!stage.path("out").exists(), "{input}");
    }
}

#[test]
fn a_later_failure_leaves_nothing_behind() {
    // Well until the textures are looked at.
    let mut build = cube(4);
    let view = build.json["images"][0]["bufferView"].as_u64().expect("a view") as usize;
    let start = build.json["bufferViews"][view]["byteOffset"].as_u64().expect("an offset") as usize;
    build.bin[start + 40..start + 60].fill(0);
    let stage = Stage::new();
    stage.put("torn.glb", &build.glb());
    let ran = stage.run(&["bake", "torn.glb", "-o", "out"]);
    assert_eq!(ran.code, 2, "{ran:?}");
    assert!(ran.stderr.contains("/images/0"), "{ran:?}");
    assert!(!stage.path("out").exists() || names(&stage.path("out")).is_empty());
}

#[test]
fn a_command_that_makes_no_sense_exits_with_2() {
    let stage = Stage::new();
    stage.put("a.glb", &sphere());
    for arguments in [
        "",
        "fly",
        "bake a.glb",
        "evaluate a.glb",
        "evaluate a.glb a.glb --views 0",
        "evaluate a.glb a.glb --pixel-tolerance 0",
        "evaluate a.glb a.glb --pixel-tolerance nan",
        "evaluate missing.glb a.glb",
        "bake a.glb -o out --ratios 0.1,0.5",
        "bake a.glb -o out --ratios 0",
        "bake a.glb -o out --ratios nan",
        "bake a.glb -o out --triangles 0",
        "bake a.glb -o out --levels 0",
        "bake a.glb -o out --levels 3 --ratios 0.5",
        "bake a.glb -o out --textures paint",
        "bake a.glb -o out --max-error=-1",
        "bake a.glb -o out --max-error nan",
        "bake a.glb -o out --max-rotation 0",
        "bake a.glb -o out --max-turn 120",
        "bake a.glb -o out --view-from 1,2",
        "bake a.glb -o out --view-from 1,2,3 --view-cosine 2",
        "bake a.glb -o out --view-from 1,2,3 --view-along 1,2,3",
        "bake a.glb -o out --curvature-weight=-1",
        "bake a.glb -o out --join-distance=-1",
        "bake a.glb -o out --keep-volume --placement ends",
        "bake a.glb -o out --keep-area --placement middle",
        "bake a.glb -o out --lock-border=left",
        "bake a.glb -o out --lock-border=0,0,0,1,1",
        "bake a.glb -o out --lock-border=1,0,0,0,1,1",
        "bake a.glb -o out --share-vertices --layout none",
        "bake a.glb -o out --share-vertices --placement best",
        "bake a.glb -o out --share-vertices --textures transfer --atlas new",
        "bake a.glb -o out --no-such-option",
    ] {
        let ran = stage.run(&arguments.split_whitespace().collect::<Vec<_>>());
        assert_eq!((ran.code, ran.stdout.as_str()), (2, ""), "{arguments}: {ran:?}");
        assert!(!ran.stderr.is_empty(), "{arguments}");
        assert!(!stage.path("out").exists(), "{arguments}");
    }
}

#[test]
fn an_input_is_not_overwritten() {
    let stage = Stage::new();
    stage.put("a.glb", &sphere());
    let ran = stage.run(&["bake", "a.glb", "-o", ".", "--layout", "msft_lod"]);
    assert_eq!(ran.code, 2, "{ran:?}");
    assert!(ran.stderr.contains("overwritten"), "{ran:?}");
    assert_eq!(folder_files(stage.folder.path()), [("a.glb".to_owned(), sphere())]);
}

#[test]
fn no_input_of_a_batch_is_overwritten_by_the_levels_of_another() {
    let stage = Stage::new();
    std::fs::create_dir(stage.path("out")).expect("a folder");
    stage.put("a.glb", &sphere()).put("out/a_lod1.glb", &cube(4).glb());
    let ran = stage.run(&["bake", "a.glb", "out/a_lod1.glb", "-o", "out", "--no-evaluate"]);
    assert_ne!(ran.code, 0, "{ran:?}");
    assert!(std::fs::read(stage.path("out/a_lod1.glb")).expect("a file") == cube(4).glb());
}

#[test]
fn two_inputs_of_one_stem_are_named_apart_and_none_is_written_over_another() {
    let stage = Stage::new();
    std::fs::create_dir(stage.path("b")).expect("a folder");
    stage.put("a.glb", &sphere()).put("b/a.glb", &cube(4).glb()).put("a_lod2.glb", &sphere());
    let ran = stage.run(&["bake", "a.glb", "b/a.glb", "-o", "out", "--no-evaluate"]);
    assert_eq!(ran.code, 0, "{ran:?}");
    assert!(ran.stderr.contains("warning: b/a.glb") && ran.stderr.contains("a.glb"), "{ran:?}");
    assert!(stage.path("out/a_lod1.glb").exists() && stage.path("out/a.glb_lod1.glb").exists());
    let layout = ["--layout", "msft_lod", "--no-evaluate"];
    let ran = stage.run(&[&["bake", "a.glb", "a_lod2.glb", "-o", "two"], &layout[..]].concat());
    assert!(ran.code == 2 || stage.path("two/a_lod2.glb_lod1.glb").exists(), "{ran:?}");
}

#[test]
fn the_files_do_not_depend_on_the_number_of_threads() {
    let stage = Stage::new();
    stage.put("a.glb", &sphere());
    let with = |threads: &str| {
        let ran =
            stage.run(&["bake", "a.glb", "-o", threads, "--threads", threads, "--no-evaluate"]);
        assert_eq!(ran.code, 0, "{ran:?}");
        let mut files = folder_files(&stage.path(threads));
        let (_, report) = files.remove(0);
        let report: Value = serde_json::from_slice(&report).expect("JSON");
        assert_eq!(files.len(), 4);
        (files, report["levels"].clone())
    };
    assert!(with("1") == with("2"));
}

#[test]
fn the_sample_is_baked_when_it_is_asked_for() {
    let stage = Stage::new();
    let ran = stage.run(&["bake", "--sample", "-o", "out", "--no-evaluate", "--textures", "keep"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{ran:?}");
    assert!(stage.path("out/sample_lod4.glb").is_file() && stage.path("out/sample.json").is_file());
}

#[test]
fn no_input_is_an_error_and_never_the_sample() {
    let stage = Stage::new();
    for arguments in [&["bake", "-o", "out"][..], &["bake", "", "-o", "out"]] {
        let ran = stage.run(arguments);
        assert_eq!((ran.code, ran.stdout.as_str()), (2, ""), "{ran:?}");
        assert!(!ran.stderr.is_empty() && !stage.path("out").exists(), "{ran:?}");
    }
}

#[test]
fn an_evaluation_writes_a_table_and_json() {
    let stage = Stage::new();
    stage.put("a.glb", &sphere()).put("b.glb", &Build::of(&shapes::sphere(12, 6)).glb());
    let fast = ["--views", "2", "--resolution", "32", "--samples", "1000", "--json", "r.json"];
    let ran = stage.run(&[&["evaluate", "a.glb", "a.glb", "b.glb"], fast.as_slice()].concat());
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{ran:?}");
    assert!(
        ["a.glb", "b.glb", "528", "120"].iter().all(|word| ran.stdout.contains(word)),
        "{}",
        ran.stdout
    );
    let report = json_file(&stage.path("r.json"));
    assert_eq!((&report["schema"], &report["reference"]["file"]), (&json!(1), &json!("a.glb")));
    let candidates = report["candidates"].as_array().expect("candidates");
    let triangles: Vec<&Value> = candidates.iter().map(|c| &c["triangles"]).collect();
    assert_eq!(triangles, [&json!(528), &json!(120)]);
    candidates.iter().for_each(|candidate| assert_metrics(&candidate["metrics"]));
    assert_eq!(candidates[0]["metrics"]["distance_rms"], 0.0);
    for candidate in candidates {
        let views = candidate["views"].as_array().expect("a list");
        assert_eq!(views.len(), report["views"].as_array().map_or(0, Vec::len));
        let squares = views.iter().filter_map(|view| Some(view["rms_luminance"].as_f64()?.powi(2)));
        let pooled = (squares.sum::<f64>() / views.len() as f64).sqrt();
        let all = candidate["metrics"]["rms_luminance"].as_f64().expect("a figure");
        assert!((pooled - all).abs() < 1e-12, "{pooled} {all}");
    }
    assert!(candidates[1]["metrics"]["distance_rms"].as_f64() > Some(0.001));
}

#[test]
fn candidates_that_cannot_be_compared_are_named_and_the_others_are() {
    let mut points = Build::new();
    let positions = points.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    points.mesh(vec![json!({"mode": 0, "attributes": {"POSITION": positions}})]);
    let mut broken = shapes::sphere(12, 6);
    broken.positions[20][1] = f32::NAN;
    let mut broken = Build::of(&broken);
    // NaN is no JSON number: the bounds would be null.
    broken.json["accessors"][0]["min"] = json!([-1, -1, -1]);
    broken.json["accessors"][0]["max"] = json!([1, 1, 1]);
    let stage = Stage::new();
    stage.put("a.glb", &sphere()).put("points.glb", &points.glb()).put("nan.glb", &broken.glb());
    let fast = ["--views", "2", "--resolution", "32", "--samples", "1000", "--json", "r.json"];
    let files =
        ["evaluate", "a.glb", "points.glb", "nan.glb", "missing.glb", "a.glb", "--reference-as-is"];
    let ran = stage.run(&[files.as_slice(), fast.as_slice()].concat());
    assert_eq!(ran.code, 1, "{ran:?}");
    let report = json_file(&stage.path("r.json"));
    let candidates = report["candidates"].as_array().expect("candidates");
    assert_eq!(candidates.len(), 4);
    for (candidate, name) in candidates.iter().zip(["points.glb", "nan.glb", "missing.glb"]) {
        assert!(ran.stderr.contains(name), "{}", ran.stderr);
        assert_eq!((&candidate["file"], &candidate["metrics"]), (&json!(name), &Value::Null));
        assert!(candidate["failure"].as_str().is_some_and(|why| !why.is_empty()), "{candidate}");
    }
    assert_metrics(&candidates[3]["metrics"]);
    assert_eq!(candidates[3]["metrics"]["rms_luminance"], 0.0);
}

#[test]
fn what_is_wrong_with_a_candidate_is_said_of_it_alone() {
    let sized = |scale| textured(&shapes::sphere(24, 12).scaled(scale), &picture(32)).glb();
    // Its image is a file that is not there.
    let mut build = textured(&shapes::sphere(24, 12), &picture(32));
    build.json["images"][0] = json!({"uri": "gone.png"});
    // A material that names a texture that is not there.
    let mut astray = textured(&shapes::sphere(24, 12), &picture(32));
    astray.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = json!(7);
    let stage = Stage::new();
    stage.put("a.glb", &sphere()).put("mm.glb", &sized(1000.0)).put("km.glb", &sized(0.001));
    stage.put("gone.glb", &build.glb()).put("astray.glb", &astray.glb());
    let fast = ["--views", "2", "--resolution", "32", "--samples", "1000", "--json", "r.json"];
    let files = [
        "evaluate",
        "a.glb",
        "mm.glb",
        "gone.glb",
        "km.glb",
        "astray.glb",
        "a.glb",
        "--reference-as-is",
    ];
    let ran = stage.run(&[files.as_slice(), fast.as_slice()].concat());
    assert_eq!(ran.code, 1, "{ran:?}");
    let report = json_file(&stage.path("r.json"));
    let candidates = report["candidates"].as_array().expect("candidates");
    let text = |at: usize, key: &str| candidates[at][key].as_str().unwrap_or_default();
    for (at, file, times) in
        [(0, "mm.glb", "1000 times larger"), (2, "km.glb", "1000 times smaller")]
    {
        assert!(text(at, "warning").contains(times), "{}", candidates[at]);
        assert!(ran.stderr.contains(file) && ran.stderr.contains(times), "{}", ran.stderr);
        assert!(ran.stdout.contains(times), "{}", ran.stdout);
        assert_metrics(&candidates[at]["metrics"]);
    }
    assert!(text(1, "failure").contains("gone.png"), "{}", candidates[1]);
    assert!(text(3, "failure").contains("/materials/0"), "{}", candidates[3]);
    assert_eq!(candidates[4]["metrics"]["ssim"], 1.0);
    assert_eq!(
        (&candidates[4]["failure"], &candidates[4]["warning"]),
        (&Value::Null, &Value::Null)
    );
    // Alone it is compared all the same.
    assert_eq!(stage.run(&[&["evaluate", "a.glb", "mm.glb"], &fast[..6]].concat()).code, 1);
}

#[test]
fn an_evaluation_with_nothing_to_compare_exits_with_2() {
    let stage = Stage::new();
    stage.put("a.glb", &sphere());
    let ran = stage.run(&[
        "evaluate",
        "a.glb",
        "missing.glb",
        "--views",
        "1",
        "--resolution",
        "16",
        "--samples",
        "1000",
    ]);
    assert_eq!(ran.code, 2, "{ran:?}");
    assert!(ran.stderr.contains("missing.glb"), "{ran:?}");
}
