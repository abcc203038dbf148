//! What is typed and what it does: options from files and presets, standard input and output, outputs of
//! an earlier bake, and forms that were typed before.

use std::path::Path;

use serde_json::{Value, json};

use crate::cli::{Stage, json_file, names, sphere};
use crate::common::assets::cube;
use crate::common::folder_files;

const FAST: [&str; 2] = ["--no-evaluate", "--no-polish"];

/// A stage with a model.
fn stage() -> Stage {
    let stage = Stage::new();
    stage.put("in/a.glb", &sphere());
    stage
}

fn bake(stage: &Stage, typed: &str) -> String {
    let words: Vec<&str> = typed.split(' ').collect();
    let ran = stage.run(&[&["bake"], &words[..], &FAST].concat());
    assert_eq!(ran.code, 0, "{typed}: {ran:?}");
    ran.stdout
}

#[test]
fn files_of_an_earlier_bake_that_this_one_does_not_make_are_removed() {
    let stage = stage();
    bake(&stage, "in/a.glb -o out --layout msft_lod --report");
    stage.put("out/a_lod9.glb", b"not listed").put("out/other.glb", b"a stranger's");
    let said = bake(&stage, "in/a.glb -o out --levels 2");
    assert!(
        said.contains("removed a_lod3.glb, a_lod4.glb, a.glb, a.html, of an earlier bake"),
        "{said}"
    );
    let left = ["a.json", "a_lod1.glb", "a_lod2.glb", "a_lod9.glb", "other.glb"];
    assert_eq!(names(&stage.path("out")), left);
    // In another form, with textures in a folder of their own; then without them.
    bake(&stage, "in/a.glb -o out --levels 1 --format gltf");
    assert_eq!(names(&stage.path("out/a_textures")), ["image0.png"]);
    bake(&stage, "in/a.glb -o out --levels 1 --resume");
    assert_eq!(names(&stage.path("out")), ["a.json", "a_lod1.glb", "a_lod9.glb", "other.glb"]);
}

#[test]
fn what_a_bake_is_made_from_is_never_removed() {
    let stage = stage();
    bake(&stage, "in/a.glb -o out --layout msft_lod --levels 2");
    let source = std::fs::read(stage.path("out/a.glb")).expect("a file");
    bake(&stage, "out/a.glb -o out --levels 1");
    assert!(std::fs::read(stage.path("out/a.glb")).expect("it stays") == source);
    assert!(!stage.path("out/a_lod2.glb").exists());
    // A report may come from anyone: it names files elsewhere in vain.
    let mut report = json_file(&stage.path("out/a.json"));
    report["files"] = json!(["../in/a.glb", "a/../../in/a.glb", "b.glb", stage.path("in/a.glb")]);
    stage.put("out/a.json", report.to_string().as_bytes()).put("out/b.glb", b"of b");
    bake(&stage, "in/a.glb -o out --levels 1");
    assert!(stage.path("in/a.glb").exists() && stage.path("out/b.glb").exists());
}

#[test]
fn a_resumed_batch_notices_outputs_that_are_cut_or_gone_with_their_level() {
    let stage = stage();
    stage.put("in/b.glb", &cube(4).glb());
    let resumed = |more: &str| {
        let said = bake(&stage, &format!("in -o out --resume{more}"));
        said.lines().last().expect("a summary").to_owned()
    };
    assert_eq!(resumed(""), "2 baked, 0 skipped, 0 failed");
    assert_eq!(resumed(""), "0 baked, 2 skipped, 0 failed");
    stage.put("out/a_lod3.glb", b"glTF");
    assert_eq!(resumed(""), "1 baked, 1 skipped, 0 failed");
    assert_eq!(resumed(" --levels 1"), "2 baked, 0 skipped, 0 failed");
    assert_eq!(names(&stage.path("out")), ["a.json", "a_lod1.glb", "b.json", "b_lod1.glb"]);
}

#[test]
fn a_file_beside_the_input_and_a_preset_fill_what_is_not_typed() {
    let stage = stage();
    let levels = |typed: &str| bake(&stage, &format!("{typed} -o out --dry-run"));
    assert!(levels("in/a.glb").contains("4 levels each"));
    stage.put("in/seamwise.toml", b"levels = 3\nbudget-per = 'mesh'\nlock-material = ['a', 'b']\n");
    for typed in ["in/a.glb", "in", "in/a.glb --preset web"] {
        assert!(levels(typed).contains("3 levels each"), "{typed}");
    }
    assert!(
        levels("in --ratios 0.5").contains("1 levels each (50 %)"),
        "what is typed counts more"
    );
    assert!(levels("in --no-config").contains("4 levels each"));
    stage.put("other.toml", b"ratios = [0.5, 0.25]\npreset = 'archive'\njson = 'told.json'\n");
    let said = levels("in --config other.toml");
    assert!(said.contains("2 levels each (50 %, 25 %)") && said.contains("a_lod1.gltf"), "{said}");
    let said = bake(&stage, "in/a.glb --config other.toml -o out");
    assert!(said.contains("a_lod2.gltf") && stage.path("out/a.html").is_file(), "{said}");
    assert_eq!(json_file(&stage.path("told.json"))["baked"], 1);
}

#[test]
fn a_file_of_options_that_is_wrong_is_named_with_the_key() {
    let stage = stage();
    for (text, said) in [
        ("levls = 3", "in/seamwise.toml: levls: there is no such option"),
        ("max_error = 3", "did you mean max-error?"),
        ("levels = ", "in/seamwise.toml: line 1: "),
        ("levels = true", "levels: a value is needed"),
        ("levels = [1, 2]", "levels: one number or text is needed"),
        ("compress = 'yes'", "compress: true or false is needed"),
        ("levels = 99", "in/seamwise.toml: invalid value '99' for '--levels <N>'"),
        ("output = 'x'", "output: this is for the command line"),
        ("preset = 'fast'", "preset: fast is none of web, engine and archive"),
        // It may have come with the input.
        ("allow-outside = true", "allow-outside: a file that came with the input may not say this"),
        ("json = '/tmp/told.json'", "json: a file that came with"),
        ("report = 'told.html'", "report: a file that came with the input"),
    ] {
        stage.put("in/seamwise.toml", text.as_bytes());
        let ran = stage.run(&["bake", "in/a.glb", "-o", "out"]);
        assert_eq!(ran.code, 2, "{text}: {ran:?}");
        assert!(ran.stderr.contains(said), "{text}: {}", ran.stderr);
        assert!(!stage.path("out").exists());
    }
    stage.put("in/seamwise.toml", b"").put("two/a.glb", &sphere()).put("two/seamwise.toml", b"");
    let ran = stage.run(&["bake", "in", "two", "-o", "out"]);
    assert!(ran.code == 2 && ran.stderr.contains("both have options"), "{ran:?}");
}

#[test]
fn presets_bake() {
    let stage = stage();
    bake(&stage, "in/a.glb -o web --preset web --levels 1");
    bake(&stage, "in/a.glb -o engine --preset engine --levels 1");
    bake(&stage, "in/a.glb -o archive --preset archive --levels 1");
    let level =
        |folder: &str| std::fs::read(stage.path(&format!("{folder}/a_lod1.glb"))).expect("a file");
    let has =
        |bytes: &[u8], word: &str| bytes.windows(word.len()).any(|own| own == word.as_bytes());
    assert!(has(&level("web"), "EXT_meshopt_compression") && has(&level("web"), "image/jpeg"));
    assert!(!has(&level("engine"), "extensionsRequired"));
    let textures = folder_files(&stage.path("archive/a_textures"));
    let source = std::fs::read(stage.path("in/a.glb")).expect("a file");
    assert!(source.windows(textures[0].1.len()).any(|own| own == textures[0].1), "as it was");
}

#[test]
fn one_level_goes_to_a_file_and_through_pipes() {
    let stage = stage();
    let said = bake(&stage, "in/a.glb -o low/b.glb --ratios 0.25 --report low/page.html");
    assert!(said.contains("in/a.glb → low/b.glb"), "{said}");
    assert_eq!(names(&stage.path("low")), ["b.glb", "page.html"]);
    let file = std::fs::read(stage.path("low/b.glb")).expect("a file");
    let bake = ["bake", "-", "-o", "-", "--ratios", "0.25"];
    let ran = stage.run_with(&[&bake[..], &FAST].concat(), &sphere());
    assert_eq!(ran.status.code(), Some(0), "{}", String::from_utf8_lossy(&ran.stderr));
    assert!(ran.stdout == file, "the same bytes");
    let looked = stage.run_with(&["inspect", "-", "--json"], &file);
    let looked: Value = serde_json::from_slice(&looked.stdout).expect("JSON");
    assert_eq!(looked["total"]["triangles"], 132);
    let compared =
        ["evaluate", "in/a.glb", "-", "--views", "1", "--samples", "1000", "--json", "-"];
    let told: Value =
        serde_json::from_slice(&stage.run_with(&compared, &file).stdout).expect("JSON alone");
    assert_eq!(told["candidates"][0]["triangles"], 132);
}

#[test]
fn a_picture_is_repaired_through_pipes() {
    let stage = Stage::new();
    let atlas = crate::common::assets::cube_atlas();
    let mut png = std::io::Cursor::new(Vec::new());
    atlas.write_to(&mut png, image::ImageFormat::Png).expect("a PNG");
    stage.put("atlas.png", png.get_ref());
    let file = ["repair", "atlas.png", "-o", "out.png", "--background", "#ff00ff"];
    assert_eq!(stage.run(&file).code, 0);
    let piped =
        stage.run_with(&["repair", "-", "-o", "-", "--background", "#ff00ff"], png.get_ref());
    assert_eq!(piped.status.code(), Some(0), "{}", String::from_utf8_lossy(&piped.stderr));
    assert!(piped.stdout == std::fs::read(stage.path("out.png")).expect("a file"));
}

#[test]
fn a_dry_run_tells_what_would_be_written_and_writes_nothing() {
    let stage = stage();
    stage.put("in/deep/b.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let said = bake(&stage, "in -o out --dry-run --levels 1 --report");
    let files = ["out/a_lod1.glb", "out/a.html", "out/a.json", "out/deep/b_lod1.glb"];
    assert!(files.iter().all(|file| said.contains(file)), "{said}");
    assert!(
        said.ends_with("would bake 2 of 2 inputs, 1 levels each (50 %); nothing was written\n")
    );
    assert!(!stage.path("out").exists());
    bake(&stage, "in/a.glb -o out --levels 1 --report");
    let said = bake(&stage, "in -o out --dry-run --levels 1 --report --resume");
    assert!(said.contains("in/a.glb: there already\n") && said.contains("bake 1 of 2"), "{said}");
}

#[test]
fn forms_that_were_typed_before_mean_what_they_did() {
    let stage = stage();
    bake(&stage, "--report in/a.glb -o out --levels 1");
    assert!(stage.path("out/a.html").is_file());
    let before = stage.run(&["inspect", "--json", "in/a.glb"]);
    let after = stage.run(&["inspect", "in/a.glb", "--json"]);
    assert_eq!((before.code, &before.stdout), (0, &after.stdout));
    let ran = stage.run(&["inspect", "in/a.glb", "--json", "told.json"]);
    assert_eq!((ran.code, ran.stdout.as_str()), (0, ""));
    assert_eq!(std::fs::read_to_string(stage.path("told.json")).expect("a file"), after.stdout);
}

#[test]
fn json_of_a_bake_lists_its_files() {
    let stage = stage();
    let told: Value = serde_json::from_str(&bake(&stage, "in/a.glb -o out --levels 1 --json -"))
        .expect("JSON alone");
    assert_eq!(told["inputs"][0]["files"], json!(["out/a_lod1.glb", "out/a.json"]));
    let report = json_file(&stage.path("out/a.json"));
    let bytes = std::fs::metadata(stage.path("out/a_lod1.glb")).expect("a file").len();
    assert_eq!(report["file_bytes"], json!([bytes]));
    assert_eq!(
        (&report["levels"][0]["bytes"], &report["input"]["draw_calls"]),
        (&json!(bytes), &json!(1))
    );
    assert_eq!(report["input"]["bytes"], sphere().len());
}

#[test]
fn shells_complete_and_man_has_a_page_for_each_subcommand() {
    let stage = Stage::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let ran = stage.run(&["completions", shell]);
        assert!(ran.code == 0 && ran.stdout.contains("merge-materials"), "{shell}");
    }
    assert_eq!(stage.run(&["man", "-o", "man1"]).code, 0);
    let pages = names(&stage.path("man1"));
    assert!(
        pages.contains(&"seamwise.1".to_owned()) && pages.contains(&"seamwise-bake.1".to_owned())
    );
    let page = std::fs::read_to_string(stage.path("man1/seamwise-bake.1")).expect("a page");
    assert!(page.starts_with(".ie") && page.contains("share"), "{page}");
    assert!(Path::new(&pages[0]).extension().is_some_and(|own| own == "1"));
}
