//! Any progressive file: a level of it or an error, and no panic.
//!
//! A mutator of its own changes a column of a block and makes the block's checksum right again, since
//! checksums stop most other changes.
//!
//! `cargo +nightly fuzz run progressive -- -max_total_time=600 -timeout=5 -rss_limit_mb=2048`, from small files
//! that `SEAMWISE_CORPUS=fuzz/corpus cargo test --test suite seeds` makes.

#![no_main]

mod blocks;
mod mutation;

use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};
use mutation::Random;
use seamwise::import::options::ReadOptions;
use seamwise::limit::MemoryLimit;
use seamwise::export::progressive::extract::{Fineness, extract};

fuzz_target!(|bytes: &[u8]| {
    let memory_limit = MemoryLimit::of_bytes(64 << 20);
    let options = ReadOptions { memory_limit, ..ReadOptions::default() };
    for fineness in [Fineness::Source, Fineness::Triangles(100), Fineness::Error(0.01)] {
        let _ = extract(bytes, fineness, options);
    }
});

fuzz_mutator!(|data: &mut [u8], size: usize, most: usize, seed: u32| {
    let mut random = Random::new(seed);
    let changed = match random.below(8) {
        0 => None,
        1 => blocks::change_json(&data[..size], &mut random),
        _ => blocks::change_column(&data[..size], &mut random),
    };
    match changed.filter(|changed| changed.len() <= most) {
        Some(changed) => {
            data[..changed.len()].copy_from_slice(&changed);
            changed.len()
        }
        None => fuzzer_mutate(data, size, most),
    }
});
