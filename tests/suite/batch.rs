//! Many inputs through the real binary: failures, a kill and its resumption, shards.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant, SystemTime};

use crate::common::assets::{picture, textured};
use crate::common::shapes::{patch, sphere};
use serde_json::{Value, json};
use tempfile::TempDir;

/// A file and its bytes.
type File = (String, Vec<u8>);

fn seamwise(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_seamwise"));
    command.current_dir(folder).args(["bake", "--no-evaluate", "--levels", "2"]).args(arguments);
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    seamwise(folder, arguments).output().expect("it runs")
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

/// A small asset that no other number gives.
fn good(number: usize) -> Vec<u8> {
    let shape = if number.is_multiple_of(2) { sphere(8, 5) } else { patch(6) };
    textured(&shape.scaled(1.0 + number as f32), &picture(8)).glb()
}

/// An asset whose document was changed.
fn changed(change: impl FnOnce(&mut Value)) -> Vec<u8> {
    let mut build = textured(&patch(4), &picture(8));
    change(&mut build.json);
    build.glb()
}

/// Files that can't be baked, each for a reason of its own, with a part of what is said of it.
fn broken() -> Vec<(&'static str, Vec<u8>, &'static str)> {
    let cut = |bytes: Vec<u8>| bytes[..bytes.len() / 2].to_vec();
    let away = |list: &str| {
        json!({
            "asset": {"version": "2.0"}, "accessors": [{"bufferView": 0}],
            "bufferViews": [{"buffer": 0, "byteLength": 4}],
            "materials": [{"normalTexture": {"index": 0}}], "textures": [{"source": 0}],
            list: [{"byteLength": 4, "uri": "away.x"}],
        })
    };
    let huge = |json: &mut Value| json["accessors"][0]["count"] = json!(u32::MAX);
    let alien = |json: &mut Value| json["extensionsRequired"] = json!(["EXT_of_tomorrow"]);
    let beyond = |json: &mut Value| json["meshes"][0]["primitives"][0]["indices"] = json!(99);
    let picture = |json: &mut Value| json["images"][0]["bufferView"] = json!(1);
    vec![
        ("empty.glb", Vec::new(), "empty file"),
        ("noise.glb", b"no glTF at all".to_vec(), "no glTF"),
        ("cut.glb", cut(good(0)), "GLB"),
        ("json.gltf", b"{\"asset\": ".to_vec(), "JSON"),
        ("buffer.gltf", away("buffers").to_string().into_bytes(), "away.x"),
        ("image.gltf", away("images").to_string().into_bytes(), "away.x"),
        ("old.gltf", b"{\"asset\": {\"version\": \"1.0\"}}".to_vec(), "glTF version 1.0"),
        ("count.glb", changed(huge), "/accessors/0"),
        ("extension.glb", changed(alien), "EXT_of_tomorrow"),
        ("index.glb", changed(beyond), "/indices"),
        ("picture.glb", changed(picture), "/images/0"),
    ]
}

/// A folder with assets in `in`, in two folders.
fn stage(goods: usize, broken: &[(&str, Vec<u8>, &str)]) -> TempDir {
    let stage = tempfile::tempdir().expect("a temporary folder");
    for (number, below) in
        ["in", "in/deep", "in/deep/down"].into_iter().cycle().take(goods).enumerate()
    {
        std::fs::create_dir_all(stage.path().join(below)).expect("a folder");
        let path = stage.path().join(below).join(format!("a{number:02}.glb"));
        std::fs::write(path, good(number)).expect("a file");
    }
    for (name, bytes, _) in broken {
        std::fs::write(stage.path().join("in/deep").join(name), bytes).expect("a file");
    }
    stage
}

/// Every file below a folder by its place there, but those that a killed run leaves unnamed.
fn files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let named = paths.filter(|path| {
        !path.file_name().expect("a name").to_string_lossy().starts_with(".seamwise-")
    });
    let below = |path: PathBuf| if path.is_dir() { files(&path) } else { vec![path] };
    let mut all: Vec<PathBuf> = named.flat_map(below).collect();
    all.sort();
    all
}

/// The outputs below a folder, reports without what differs from run to run.
fn outputs(folder: &Path) -> Vec<File> {
    let read = |path: PathBuf| {
        let place = path.strip_prefix(folder).expect("a place").to_string_lossy().into_owned();
        let bytes = std::fs::read(&path).expect("a file");
        if path.extension().is_some_and(|extension| extension == "json") {
            let mut report: Value = serde_json::from_slice(&bytes).expect("JSON");
            let report = report.as_object_mut().expect("an object");
            report.retain(|key, _| !["seconds", "peak_memory_bytes"].contains(&key.as_str()));
            return (place, serde_json::to_vec(&report).expect("JSON"));
        }
        (place, bytes)
    };
    files(folder).into_iter().map(read).collect()
}

fn times(paths: &[PathBuf]) -> BTreeMap<PathBuf, SystemTime> {
    let time = |path: &PathBuf| path.metadata().and_then(|data| data.modified()).expect("a time");
    paths.iter().map(|path| (path.clone(), time(path))).collect()
}

/// Kills a run as soon as it has finished so many inputs.
fn kill_after(mut child: Child, folder: &Path, finished: usize) -> Vec<PathBuf> {
    let is_report = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "json");
    let start = Instant::now();
    loop {
        let reports: Vec<PathBuf> = files(folder).into_iter().filter(is_report).collect();
        if reports.len() >= finished {
            child.kill().expect("it can be killed");
            child.wait().expect("it ends");
            return files(folder).into_iter().filter(is_report).collect();
        }
        assert!(start.elapsed() < Duration::from_secs(120), "{} reports", reports.len());
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_batch_bakes_what_it_can_and_is_resumed_where_it_was_killed() {
    let broken = &broken()[1..];
    let stage = stage(90, broken);
    let folder = stage.path();
    let ran = run(folder, &["in", "-o", "one", "--jobs", "1", "--json", "batch.json"]);
    let said = stderr(&ran);
    assert_eq!(ran.status.code(), Some(1), "{said}");
    assert!(said.starts_with("seamwise: 10 of 100 inputs failed:\n"), "{said}");
    assert_eq!(said.lines().count(), 11, "{said}");
    for (name, _, reason) in broken {
        let line = said.lines().find(|line| line.contains(name)).expect("a line for each");
        assert!(line.contains(reason), "{line} does not say {reason}");
    }
    let told = String::from_utf8(ran.stdout).expect("UTF-8");
    assert!(told.ends_with("90 baked, 0 skipped, 10 failed\n"), "{told}");
    let report: Value =
        serde_json::from_slice(&std::fs::read(folder.join("batch.json")).expect("a file"))
            .expect("JSON");
    assert_eq!((&report["baked"], &report["failed"]), (&json!(90), &json!(10)));
    assert_eq!(report["inputs"].as_array().map(Vec::len), Some(100));
    let one = outputs(&folder.join("one"));
    assert_eq!(one.len(), 90 * 3);
    assert!(one.iter().any(|(place, _)| place == "deep/down/a02_lod1.glb"));

    let two = folder.join("two");
    let mut killed = seamwise(folder, &["in", "-o", "two", "--jobs", "3", "--quiet"]);
    let killed = killed.stderr(Stdio::null()).spawn().expect("it runs");
    let finished = kill_after(killed, &two, 10);
    assert!(finished.len() < 90, "it was killed too late");
    let stems: BTreeSet<PathBuf> = finished.iter().map(|path| path.with_extension("")).collect();
    let is_finished = |path: &PathBuf| {
        let name = path.to_string_lossy();
        let stem = name.split("_lod").next().expect("a part").trim_end_matches(".glb");
        stems.contains(Path::new(stem.trim_end_matches(".json")))
    };
    let done: Vec<PathBuf> = files(&two).into_iter().filter(is_finished).collect();
    assert_eq!(done.len(), 3 * finished.len(), "a report is there only if all is");
    let before = times(&done);
    let resumed = run(folder, &["in", "-o", "two", "--jobs", "3", "--resume"]);
    assert_eq!(resumed.status.code(), Some(1));
    let told = String::from_utf8(resumed.stdout).expect("UTF-8");
    let (skipped, baked) = (finished.len(), 90 - finished.len());
    assert!(told.ends_with(&format!("{baked} baked, {skipped} skipped, 10 failed\n")), "{told}");
    assert_eq!(times(&done), before, "nothing is done twice");
    assert!(outputs(&two) == one, "the files are those of one run, three jobs or one");
}

#[test]
fn shards_add_up_to_the_whole() {
    let stage = stage(10, &[]);
    let folder = stage.path();
    assert_eq!(run(folder, &["in", "-o", "one"]).status.code(), Some(0));
    for shard in ["1/3", "2/3", "3/3"] {
        let ran = run(folder, &["in", "-o", "three", "--shard", shard]);
        assert_eq!((ran.status.code(), stderr(&ran)), (Some(0), String::new()));
    }
    assert!(outputs(&folder.join("one")) == outputs(&folder.join("three")));
    let ran = run(folder, &["in", "-o", "three", "--resume", "--shard", "11/11"]);
    assert_eq!(ran.stdout, b"0 baked, 0 skipped, 0 failed\n", "an empty part is no failure");
    assert_eq!(ran.status.code(), Some(0));
}

#[test]
fn a_list_names_inputs_as_if_they_were_typed_and_shards_split_it() {
    let stage = stage(6, &broken()[..1]);
    let folder = stage.path();
    assert_eq!(run(folder, &["in", "-o", "one"]).status.code(), Some(1));
    let list = "# all of them\r\nin/a00.glb\n\n  in/a03.glb\nin/deep/empty.glb\nin/deep/a01.glb\nin/deep/a04.glb\n";
    std::fs::write(folder.join("list.txt"), list).expect("a file");
    for shard in ["1/2", "2/2"] {
        let ran = run(
            folder,
            &["in/deep/down/a02.glb", "--manifest", "list.txt", "-o", "out", "--shard", shard],
        );
        let told = String::from_utf8(ran.stdout).expect("UTF-8");
        let expected = if shard == "1/2" {
            "3 baked, 0 skipped, 0 failed"
        } else {
            "2 baked, 0 skipped, 1 failed"
        };
        assert_eq!(told.lines().last(), Some(expected));
    }
    let one = outputs(&folder.join("one")).into_iter().filter(|(name, _)| !name.contains("a05"));
    let base = |(name, bytes): File| (name.rsplit('/').next().expect("a name").to_owned(), bytes);
    let mut one: Vec<File> = one.map(base).collect();
    one.sort();
    assert!(outputs(&folder.join("out")) == one);
    std::fs::write(folder.join("none.txt"), "# nothing\n").expect("a file");
    for (list, reason) in [("none.txt", "names no input"), ("away.txt", "away.txt")] {
        let ran = run(folder, &["--manifest", list, "-o", "out"]);
        assert_eq!(ran.status.code(), Some(2));
        assert!(stderr(&ran).contains(reason), "{}", stderr(&ran));
    }
    let mut piped = seamwise(folder, &["--manifest", "-", "-o", "piped"]);
    let piped = piped.stdin(Stdio::piped()).stdout(Stdio::null()).spawn();
    let mut piped = piped.expect("it runs");
    let mut stdin = piped.stdin.take().expect("a pipe");
    std::io::Write::write_all(&mut stdin, b"in/a00.glb\nin/a03.glb\n").expect("it reads");
    drop(stdin);
    assert!(piped.wait().expect("it ends").success());
    assert_eq!(files(&folder.join("piped")).len(), 6);
}

#[test]
fn what_has_changed_is_baked_again() {
    let stage = stage(3, &[]);
    let folder = stage.path();
    let again = |more: &[&str]| {
        let ran = run(folder, &[&["in", "-o", "out", "--resume"], more].concat());
        assert_eq!(ran.status.code(), Some(0), "{}", stderr(&ran));
        let told = String::from_utf8(ran.stdout).expect("UTF-8");
        told.lines().last().expect("a summary").to_owned()
    };
    assert_eq!(again(&[]), "3 baked, 0 skipped, 0 failed");
    assert_eq!(again(&["--jobs", "2", "--memory-limit", "1GB"]), "0 baked, 3 skipped, 0 failed");
    std::fs::write(folder.join("in/a00.glb"), good(50)).expect("a file");
    assert_eq!(again(&[]), "1 baked, 2 skipped, 0 failed");
    std::fs::remove_file(folder.join("out/deep/a01_lod2.glb")).expect("it was there");
    assert_eq!(again(&[]), "1 baked, 2 skipped, 0 failed");
    assert_eq!(again(&["--no-polish"]), "3 baked, 0 skipped, 0 failed");
}

#[test]
fn a_batch_that_can_do_nothing_ends_with_two() {
    let stage = stage(2, &broken()[..2]);
    let folder = stage.path();
    std::fs::create_dir(folder.join("none")).expect("a folder");
    let ran = run(folder, &["in/deep/empty.glb", "in/deep/noise.glb", "-o", "out"]);
    assert_eq!(ran.status.code(), Some(2), "{}", stderr(&ran));
    assert!(stderr(&ran).contains("2 of 2 inputs failed"), "{}", stderr(&ran));
    for (inputs, output, reason) in [
        (["none"].as_slice(), "out", "no .glb"),
        (&["in"], "in", "among the inputs"),
        (&["in", "in/a00.glb"], "out", "both write"),
    ] {
        let ran = run(folder, &[inputs, &["-o", output]].concat());
        assert_eq!(ran.status.code(), Some(2));
        assert!(stderr(&ran).contains(reason), "{}", stderr(&ran));
    }
    assert!(!folder.join("out").exists());
    for bad in [["--shard", "4/3"], ["--jobs", "0"]] {
        assert_eq!(
            run(folder, &[&["in", "-o", "out"], bad.as_slice()].concat()).status.code(),
            Some(2)
        );
    }
}

#[test]
fn a_resumed_run_bakes_again_what_lost_a_texture() {
    let stage = stage(2, &[]);
    let arguments = ["in", "-o", "out", "--resume", "--format", "gltf"];
    let skipped = |folder: &Path| {
        let output = run(folder, &arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        String::from_utf8(output.stdout).expect("UTF-8").lines().last().expect("a line").to_owned()
    };
    assert!(skipped(stage.path()).starts_with("2 baked"));
    assert!(skipped(stage.path()).starts_with("0 baked, 2 skipped"));
    let is_png = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "png");
    let all = files(&stage.path().join("out"));
    let texture = all.iter().find(|path| is_png(path)).expect("a texture");
    std::fs::remove_file(texture).expect("it goes");
    // What a run leaves that was killed as it wrote it.
    let left = texture.with_file_name(".seamwise-a1B2c3.tmp");
    let old = SystemTime::now() - Duration::from_secs(3600);
    std::fs::File::create(&left).and_then(|file| file.set_modified(old)).expect("a file");
    assert!(skipped(stage.path()).starts_with("1 baked, 1 skipped"));
    assert_eq!(files(&stage.path().join("out")), all);
    assert!(!left.exists());
}
