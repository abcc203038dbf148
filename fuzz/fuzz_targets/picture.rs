//! Any bytes as a picture file: an error or a file that reads back, within 64 MB, and no panic.
//!
//! `SEAMWISE_CORPUS=fuzz/corpus/picture cargo test --test hostile seeds` makes small valid
//! files to start from; then
//! `cargo +nightly fuzz run picture -- -max_total_time=600 -timeout=10 -rss_limit_mb=2048`

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use seamwise::import::options::ReadOptions;
use seamwise::limit::MemoryLimit;
use seamwise::repair::options::{Background, RepairOptions};
use seamwise::repair::repair_bytes;

/// What a picture may become.
const OUTPUTS: [&str; 5] = ["a.png", "a.jpg", "a.webp", "a.tif", "a.hdr"];

fuzz_target!(|bytes: &[u8]| {
    let memory_limit = MemoryLimit::of_bytes(64 << 20);
    let options = RepairOptions {
        // Nearly no texel has this color, so that nearly all are valid and a file is written.
        background: Background::Colors(vec![[0.987; 4]]),
        reading: ReadOptions { memory_limit, ..ReadOptions::default() },
        ..RepairOptions::default()
    };
    let is_exr = bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]);
    let output = if is_exr { "a.exr" } else { OUTPUTS[bytes.len() % OUTPUTS.len()] };
    let repair = |bytes: &[u8]| repair_bytes(bytes, Path::new("in"), Path::new(output), &options);
    if let Ok((file, _)) = repair(bytes) {
        let again = repair(&file);
        assert!(again.is_ok() || file.len() > 1 << 20, "{output}: {}", again.unwrap_err());
    }
});
