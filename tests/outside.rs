//! Assets that name files outside of their folder: refused in every format and by every job, unless
//! that is allowed.

mod common;

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use common::assets::{picture, textured};
use common::build::png;
use common::formats::{obj, ply};
use common::shapes::sphere;
use serde_json::json;
use tempfile::TempDir;

/// Files in `inner/` that name `../outer.*`, and what says so in each.
struct Stage {
    folder: TempDir,
    inputs: Vec<(PathBuf, &'static str)>,
}

impl Stage {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let inner = folder.path().join("inner");
        std::fs::create_dir(&inner).expect("a folder");
        let put = |name: &str, bytes: &[u8]| {
            let path = inner.join(name);
            std::fs::write(&path, bytes).expect("a file");
            path
        };
        put("../outer.png", &png(&picture(16)));
        put("../outer.mtl", b"newmtl one\nKd 1 0 0\n");
        put("inner.mtl", b"newmtl one\nmap_Kd ../outer.png\n");
        let shape = sphere(12, 6);
        let face = |library: &str| obj(&shape, "one").replace("shape.mtl", library);
        let mut build = textured(&shape, &picture(16));
        build.json["images"][0] = json!({"uri": "%2e%2e/outer.png"});
        let image = build.write_gltf(&inner, "image");
        let mut build = textured(&shape, &picture(16));
        put("../outer.bin", &build.bin);
        build.json["buffers"] = json!([{"uri": "../outer.bin", "byteLength": build.bin.len()}]);
        let buffer = put("buffer.gltf", build.json.to_string().as_bytes());
        let inputs = vec![
            (image, "/images/0/uri"),
            (buffer, "/buffers/0/uri"),
            (put("library.obj", face("../outer.mtl").as_bytes()), "line 2"),
            (put("map.obj", face("inner.mtl").as_bytes()), "inner.mtl, line 2"),
            (
                put("ply.ply", &ply(&shape, "ascii", "comment TextureFile ../outer.png\n")),
                "comment TextureFile",
            ),
        ];
        Self { folder, inputs }
    }

    /// Runs a job: whether it went well, and what it said.
    fn run(&self, arguments: &[&str]) -> (bool, String) {
        let mut command = Command::cargo_bin("seamwise").expect("the binary");
        let output = command.args(arguments).output().expect("a run");
        (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
    }
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a name")
}

#[test]
fn every_format_is_held_to_its_folder() {
    let stage = Stage::new();
    let out = stage.folder.path().join("out");
    for (input, place) in &stage.inputs {
        let bake = [
            "bake",
            text(input),
            "-o",
            text(&out),
            "--levels",
            "1",
            "--no-evaluate",
            "--no-polish",
        ];
        let (well, said) = stage.run(&bake);
        let told = said.contains(place) && said.contains("outer") && said.contains("outside");
        assert!(!well && told && said.contains("--allow-outside"), "{said}");
        assert!(!out.exists());
        let (well, said) = stage.run(&[&bake[..], &["--allow-outside"]].concat());
        assert!(well, "{said}");
        std::fs::remove_dir_all(&out).expect("outputs");
    }
}

#[test]
fn every_job_holds_assets_to_their_folder() {
    let stage = Stage::new();
    let input = text(&stage.inputs[1].0);
    let picture = stage.folder.path().join("inner/atlas.png");
    std::fs::copy(stage.folder.path().join("outer.png"), &picture).expect("a picture");
    let (glb, out) = (stage.folder.path().join("a.glb"), stage.folder.path().join("a.png"));
    let few = ["evaluate", input, input, "--views", "1", "--resolution", "64", "--samples", "1000"];
    let jobs = [
        vec!["inspect", input],
        few.to_vec(),
        vec!["repair", input, "-o", text(&glb)],
        vec!["repair", text(&picture), "-o", text(&out), "--mesh", input],
    ];
    for job in jobs {
        let (well, said) = stage.run(&job);
        assert!(
            !well && said.contains("buffer.gltf") && said.contains("--allow-outside"),
            "{said}"
        );
        let (well, said) = stage.run(&[&job[..], &["--allow-outside"]].concat());
        assert!(well, "{job:?}: {said}");
    }
}
