//! Any progressive file: a level of it or an error, and no panic.
//!
//! Checksums stop most changes; a test of the file's module changes what they protect.
//!
//! `cargo +nightly fuzz run progressive -- -max_total_time=600 -timeout=5 -rss_limit_mb=2048`, with files of
//! `seamwise bake --progressive` in fuzz/corpus/progressive to start from.

#![no_main]

use libfuzzer_sys::fuzz_target;
use seamwise::import::options::ReadOptions;
use seamwise::limit::MemoryLimit;
use seamwise::progressive::extract::{Fineness, extract};

fuzz_target!(|bytes: &[u8]| {
    let memory_limit = MemoryLimit::of_bytes(64 << 20);
    let options = ReadOptions { memory_limit, ..ReadOptions::default() };
    for fineness in [Fineness::Source, Fineness::Triangles(100), Fineness::Error(0.01)] {
        let _ = extract(bytes, fineness, options);
    }
});
