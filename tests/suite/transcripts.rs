//! What the tool says, word for word: help, summaries and messages are held to files in the folder
//! `transcripts` beside this one. `SEAMWISE_BLESS=1 cargo test --test suite transcripts` writes them anew;
//! then look at the difference.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::json;
use tempfile::TempDir;

use crate::common::assets::{picture, textured};
use crate::common::shapes;

/// Runs the tool in a folder with lines of so many signs, and writes down what was typed and said.
struct Session {
    folder: TempDir,
    width: usize,
    text: String,
}

impl Session {
    fn new(width: usize) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        Self { folder, width, text: String::new() }
    }

    fn put(&self, name: &str, bytes: &[u8]) {
        let path = self.folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, bytes).expect("a file");
    }

    /// Runs what was typed, which has no word with a space in it; returns what was said.
    fn run(&mut self, typed: &str) -> String {
        let mut command = Command::cargo_bin("seamwise").expect("the binary");
        let words = typed.split(' ').map(|word| if word == "''" { "" } else { word });
        command.current_dir(&self.folder).env("COLUMNS", self.width.to_string()).args(words);
        let output = command.output().expect("it runs");
        let said = |bytes| masked(std::str::from_utf8(bytes).expect("UTF-8"));
        let said = said(&output.stdout[..]) + &said(&output.stderr[..]);
        let code = output.status.code().expect("an exit code");
        writeln!(self.text, "$ seamwise {typed}\n{said}[{code}]\n").expect("a line");
        said
    }

    /// Holds all that was said to a file.
    fn assert_is(&self, name: &str) {
        let path = folder().join(name);
        if std::env::var_os("SEAMWISE_BLESS").is_some() {
            std::fs::create_dir_all(folder()).expect("a folder");
            std::fs::write(&path, &self.text).expect("a file");
        }
        let expected = std::fs::read_to_string(&path).unwrap_or_default();
        let first = expected.lines().zip(self.text.lines()).position(|(a, b)| a != b);
        assert!(
            expected == self.text,
            "{} differs from line {} on; what is said now:\n{}",
            path.display(),
            first.map_or(0, |line| line + 1),
            self.text
        );
    }

    fn assert_fits(&self) {
        let long = self.text.lines().filter(|line| !line.starts_with('$'));
        let long: Vec<&str> = long.filter(|line| line.chars().count() > self.width).collect();
        assert!(long.is_empty(), "longer than {} signs: {long:#?}", self.width);
    }
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/suite/transcripts")
}

/// The same without what differs from run to run: times and memory.
fn masked(text: &str) -> String {
    let mut is_time = false;
    let lines = text.lines().filter(|line| {
        // Times that are long wrap.
        let is_rest = is_time && line.starts_with("  ");
        is_time = line.starts_with("took ") || is_rest;
        !is_rest && !line.starts_with("measuring took")
    });
    let line = |line: &str| match line {
        _ if line.starts_with("took ") => "took …\n".to_owned(),
        _ if line.ends_with(" s") && line.contains("; ") => {
            format!("{}; … s\n", line.rsplit_once("; ").expect("a time").0)
        }
        _ => format!("{line}\n"),
    };
    lines.map(line).collect()
}

fn sphere() -> Vec<u8> {
    textured(&shapes::sphere(24, 12), &picture(32)).glb()
}

#[test]
fn help_fits_eighty_columns_and_its_short_form_one_screen() {
    let mut session = Session::new(80);
    session.run("-h");
    for subcommand in [
        "bake", "repair", "extract", "refine", "evaluate", "view", "quadrics", "report", "inspect",
        "select",
    ] {
        let short = session.run(&format!("{subcommand} -h"));
        assert!(short.lines().count() <= 50, "{subcommand}: {} lines", short.lines().count());
    }
    for subcommand in [
        "bake",
        "repair",
        "extract",
        "refine",
        "evaluate",
        "view",
        "quadrics",
        "report",
        "inspect",
        "select",
        "completions",
        "man",
    ] {
        let long = session.run(&format!("{subcommand} --help"));
        assert!(long.contains("--threads") && long.contains("--quiet"), "{long}");
    }
    session.assert_fits();
    session.assert_is("help.txt");
}

#[test]
fn a_summary_fits_where_it_is_shown() {
    for width in [80, 140] {
        let mut session = Session::new(width);
        session.put("ball.glb", &sphere());
        session.run("bake ball.glb -o out --views 6 --resolution 128 --samples 20000");
        session.run("bake ball.glb -o out --levels 2 --no-evaluate");
        session.run("bake ball.glb -o low.glb --ratios 0.1 --no-evaluate");
        session.run("evaluate ball.glb low.glb out/ball_lod1.glb --resolution 64 --samples 5000");
        session.assert_fits();
        session.assert_is(&format!("summary_{width}.txt"));
    }
}

#[test]
fn a_source_that_no_view_shows_is_not_said_to_look_the_same() {
    let mut build = textured(&shapes::sphere(24, 12), &picture(32));
    build.json["materials"][0]["alphaMode"] = json!("MASK");
    build.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([1, 1, 1, 0]);
    let mut session = Session::new(80);
    session.put("glass.glb", &build.glb());
    let said = session.run("bake glass.glb -o out --levels 1 --views 6 --resolution 128");
    assert!(said.contains("not seen") && said.contains("no view shows it"), "{said}");
    let report = std::fs::read(session.folder.path().join("out/glass.json")).expect("a report");
    let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
    assert!(report["levels"][0]["metrics"]["ssim"].is_null(), "{report}");
    session.assert_is("unseen.txt");
}

#[test]
fn what_can_not_be_done_is_said_with_what_to_do() {
    let mut session = Session::new(80);
    session.put("ball.glb", &sphere());
    for (name, bytes) in [
        ("hall.fbx", &b"Kaydara FBX Binary  \0\x1a\0"[..]),
        ("ship.blend", b"BLENDER-v405"),
        ("stage.usd", b"PXR-USDC"),
        ("part.stl", b"solid part"),
        ("wood.jpg", b"\xff\xd8\xff\xe0"),
        ("pictures/wood.jpg", b"\xff\xd8\xff\xe0"),
        ("models/hall.fbx", b"Kaydara FBX Binary  \0\x1a\0"),
        ("notes.txt", b"a list"),
        ("empty.glb", b""),
        ("file", b"a file"),
        ("taken/ball_lod1.glb/inside", b""),
    ] {
        session.put(name, bytes);
    }
    session.run("bake ball.glb -o out --levels 2 --no-evaluate -q");
    let others =
        ["hall.fbx", "ship.blend", "stage.usd", "part.stl", "wood.jpg", "pictures", "models"];
    let others = others.iter().chain(&["notes.txt", "empty.glb", "missing.glb"]);
    for other in others.clone() {
        session.run(&format!("bake {other} -o new"));
    }
    for other in others.chain(&["out/ball.json"]) {
        session.run(&format!("inspect {other}"));
    }
    for other in ["ball.glb", "out", "notes.txt", "missing.json"] {
        session.run(&format!("select {other} --pixels 100"));
    }
    session.run("evaluate hall.fbx ball.glb");
    session.run("evaluate ball.glb hall.fbx missing.glb");
    session.run("repair hall.fbx -o new.glb");
    for arguments in [
        "-o new",
        "'' -o new",
        "ball.glb -o file",
        "ball.glb -o file/new",
        "ball.glb -o new.glb",
        "ball.glb -o new.gltf --levels 1",
        "ball.glb ball.glb -o new.glb --levels 1",
        "ball.glb -o new.glb --levels 1 --report",
        "ball.glb -o -",
        "ball.glb -o taken",
        "ball.glb -o new --json file/new.json",
        "ball.glb -o new --ratios 50,25",
        "ball.glb -o new --ratios 50%",
        "ball.glb -o new --ratios 0.5 0.25",
        "ball.glb -o new --triangles 100 50",
        "ball.glb -o new --triangles 0.5",
        "ball.glb -o new --preset web --textures keep --atlas new",
    ] {
        session.run(&format!("bake {arguments}"));
    }
    assert!(!session.folder.path().join("new").exists());
    for word in ["os error", ".tmp", ".seamwise-"] {
        assert!(!session.text.contains(word), "{word}: {}", session.text);
    }
    session.assert_is("messages.txt");
}
