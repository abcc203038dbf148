//! Any bytes as an OBJ, with an MTL or without, a PLY or an OFF.
//!
//! The first byte chooses the format. An OBJ with materials is followed by a zero byte and its MTL,
//! which is written to a file in a folder of its own, where there is a picture `a.bmp` too.
//!
//! `SEAMWISE_CORPUS=fuzz/corpus cargo test --test suite seeds` makes inputs to start from; then
//! `cargo +nightly fuzz run models -- -max_total_time=600 -timeout=5 -rss_limit_mb=2048`

#![no_main]

mod reading;

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use reading::read_all;

static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = std::env::temp_dir().join(format!("seamwise-models-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    // One gray texel.
    let header = [b'B', b'M', 58, 0, 0, 0, 0, 0, 0, 0, 54, 0, 0, 0, 40, 0, 0, 0, 1, 0, 0, 0, 1];
    let mut bmp = [&header[..], &[0, 0, 0, 1, 0, 24], &[0; 25], &[128, 128, 128, 0]].concat();
    bmp.resize(58, 0);
    std::fs::write(folder.join("a.bmp"), bmp).expect("a picture");
    folder
});

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, text)) = bytes.split_first() else { return };
    match kind % 4 {
        0 => read_all(text, Path::new("/nowhere/a.obj")),
        1 => read_all(text, Path::new("/nowhere/a.ply")),
        2 => read_all(text, Path::new("/nowhere/a.off")),
        _ => {
            let end = text.iter().position(|&byte| byte == 0).unwrap_or(text.len());
            let (text, library) = (&text[..end], text.get(end + 1..).unwrap_or_default());
            std::fs::write(FOLDER.join("a.mtl"), library).expect("a file");
            let text = [b"mtllib a.mtl\n", text].concat();
            read_all(&text, &FOLDER.join("a.obj"));
        }
    }
});
