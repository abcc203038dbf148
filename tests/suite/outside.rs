//! Files that an asset names outside its own folder: refused, unless the user allows them.

use std::path::{Path, PathBuf};

use crate::common;
use crate::common::assets::{picture, textured};
use crate::common::build::png;
use crate::common::formats::{obj, ply};
use crate::common::shapes::sphere;
use assert_cmd::Command;
use seamwise::import::options::ReadOptions;
use seamwise::import::read_with;
use serde_json::{Value, json};
use tempfile::TempDir;

/// A folder with an asset's own in it, and a picture and a buffer outside of that.
struct Stage(TempDir);

impl Stage {
    fn new() -> Self {
        let stage = Self(tempfile::tempdir().expect("a folder"));
        std::fs::create_dir(stage.0.path().join("own")).expect("a folder");
        stage.put("secret.png", png(&picture(16)));
        stage
    }

    fn put(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).expect("a file");
        path
    }

    fn secret(&self) -> String {
        self.0.path().join("secret.png").display().to_string()
    }

    /// A .gltf with an image at `uri`.
    fn gltf(&self, uri: &str) -> PathBuf {
        let mut build = textured(&sphere(8, 4), &picture(4));
        build.json["images"][0] = json!({"uri": uri});
        build.write_gltf(&self.0.path().join("own"), "a")
    }
}

fn error(path: &Path) -> String {
    read_with(path, ReadOptions::default()).expect_err("an error").to_string()
}

const ALLOWED: ReadOptions = ReadOptions {
    allow_unknown: false,
    memory_limit: seamwise::limit::MemoryLimit::of_bytes(1 << 26),
    allow_missing: false,
    strict: false,
    smooth_normals: None,
    allow_outside: true,
};

#[test]
fn an_image_outside_is_refused_with_its_place_and_the_option() {
    let stage = Stage::new();
    let secret = stage.secret();
    let file = format!("file://{secret}");
    for uri in ["../secret.png", "%2e%2e/secret.png", "%2E%2E%2Fsecret.png", &secret, &file] {
        let path = stage.gltf(uri);
        let error = error(&path);
        assert!(error.starts_with("/images/0/uri: "), "{error}");
        assert!(error.contains("secret.png") && error.contains("--allow-outside"), "{error}");
        let asset = read_with(&path, ALLOWED).unwrap_or_else(|error| panic!("{uri}: {error}"));
        assert_eq!(*asset.images[0].bytes, png(&picture(16)));
    }
    for uri in ["..\\secret.png", "C:\\secret.png", "\\\\host\\secret.png", "FILE:///secret.png"] {
        let error = error(&stage.gltf(uri));
        assert!(
            error.starts_with("/images/0/uri: ") && error.contains("--allow-outside"),
            "{error}"
        );
    }
    stage.put("own/b.png", png(&picture(8)));
    for uri in ["b.png", "./b.png", "none/../b.png"] {
        assert!(read_with(&stage.gltf(uri), ReadOptions::default()).is_ok(), "{uri}");
    }
}

#[test]
fn a_buffer_outside_is_refused_and_never_opened() {
    let stage = Stage::new();
    let path = stage.gltf("x");
    let mut json: Value =
        serde_json::from_slice(&std::fs::read(&path).expect("a file")).expect("JSON");
    // A bake hashes what an asset names before it reads it: this would never end.
    json["buffers"][0]["uri"] = json!("/dev/zero");
    std::fs::write(&path, json.to_string()).expect("a file");
    assert!(error(&path).starts_with("/buffers/0/uri: /dev/zero is outside"));
    let (input, out) = (seamwise::bake::Input::File(&path), stage.0.path().join("out"));
    let progress = seamwise::progress::Progress::hidden();
    let result = seamwise::bake::bake(input, &out, &common::unmeasured(), &progress);
    assert!(result.is_err_and(|error| error.to_string().starts_with("/buffers/0/uri")));
    assert!(!out.exists());
}

#[test]
fn materials_and_pictures_of_other_formats_keep_inside_too() {
    let stage = Stage::new();
    let shape = sphere(6, 4);
    let text = obj(&shape, "one");
    let with = |library: &str| text.replace("shape.mtl", library);
    stage.put("shape.mtl", "newmtl one\nmap_Kd secret.png\n");
    let path = stage.put("own/a.obj", with("../shape.mtl"));
    let said = error(&path);
    assert!(said.starts_with("line 2: ../shape.mtl is outside"), "{said}");
    // The pictures that it names are looked for beside it, and then beside the OBJ.
    assert_eq!(*read_with(&path, ALLOWED).expect("an asset").images[0].bytes, png(&picture(16)));
    for name in ["../secret.png", &stage.secret(), "..\\secret.png"] {
        stage.put("own/shape.mtl", format!("newmtl one\n\nmap_Kd {name}\n"));
        let path = stage.put("own/a.obj", &text);
        let said = error(&path);
        assert!(
            said.starts_with("shape.mtl, line 3: ") && said.contains("--allow-outside"),
            "{said}"
        );
        assert_eq!(
            *read_with(&path, ALLOWED).expect("an asset").images[0].bytes,
            png(&picture(16))
        );
        let path =
            stage.put("own/a.ply", ply(&shape, "ascii", &format!("comment TextureFile {name}\n")));
        let said = error(&path);
        assert!(
            said.starts_with("comment TextureFile: ") && said.contains("--allow-outside"),
            "{said}"
        );
        assert!(read_with(&path, ALLOWED).is_ok());
    }
    // A path of another machine stands for the file of its last part, if that is here.
    stage.put("own/shape.mtl", "newmtl one\nmap_Kd D:\\textures\\b.png\n");
    stage.put("own/b.png", png(&picture(8)));
    let asset = read_with(&stage.put("own/a.obj", &text), ReadOptions::default());
    assert_eq!(*asset.expect("an asset").images[0].bytes, png(&picture(8)));
}

#[test]
fn every_command_that_reads_keeps_inside_unless_told() {
    let stage = Stage::new();
    let input = stage.gltf("../secret.png");
    let own = stage.put("own/a.png", png(&picture(16)));
    stage.put("own/shape.mtl", "newmtl one\nmap_Kd ../secret.png\n");
    let mesh = stage.put("own/a.obj", obj(&sphere(8, 4), "one"));
    let [out, glb, again] = ["out", "out.glb", "out.png"].map(|name| stage.0.path().join(name));
    let paths = [&input, &own, &mesh, &out, &glb, &again];
    let [input, own, mesh, out, glb, again] = paths.map(|path| path.to_str().expect("a name"));
    let few = ["--views", "1", "--resolution", "64", "--samples", "1000"];
    let evaluate = [&["evaluate", input, input], &few[..]].concat();
    let jobs: [&[&str]; 5] = [
        &["bake", input, "-o", out, "--levels", "1", "--no-evaluate", "--textures", "keep"],
        &["inspect", input],
        &evaluate,
        &["repair", input, "-o", glb],
        &["repair", own, "-o", again, "--mesh", mesh],
    ];
    for job in jobs {
        let run = |arguments: &[&str]| {
            let mut command = Command::cargo_bin("seamwise").expect("the binary");
            let output = command.args(arguments).output().expect("a run");
            (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
        };
        let (code, said) = run(job);
        assert_eq!(code, Some(2), "{job:?}: {said}");
        let names = said.contains("../secret.png") && said.contains("--allow-outside");
        assert!(names && said.contains("own/a."), "{job:?}: {said}");
        let (code, said) = run(&[job, &["--allow-outside"]].concat());
        assert_eq!(code, Some(0), "{job:?}: {said}");
    }
}

#[cfg(unix)]
#[test]
fn a_link_inside_is_followed() {
    let stage = Stage::new();
    let link = stage.0.path().join("own/link.png");
    std::os::unix::fs::symlink(stage.secret(), link).expect("a link");
    assert!(read_with(&stage.gltf("link.png"), ReadOptions::default()).is_ok());
}
