//! Any document and any buffer, read, welded and loaded as a bake does before its descent: an error
//! or an asset, within 16 MB of what the file claims, soon, and no panic.
//!
//! An input is a whole .glb; or a document, a zero byte, and its binary chunk, so that the lengths in
//! the container are always right and what changes is the document. A mutator of its own changes
//! values of the JSON where there is one.
//!
//! `SEAMWISE_CORPUS=fuzz/corpus cargo test --test suite seeds` makes inputs to start from, out of the
//! tests' assets and those in ../shared/assets, made small; then
//! `cargo +nightly fuzz run document -- -max_total_time=600 -timeout=5 -rss_limit_mb=2048`

#![no_main]

mod mutation;
mod reading;

use std::path::Path;

use libfuzzer_sys::{fuzz_mutator, fuzz_target};
use reading::{glb, read_all};

fuzz_target!(|bytes: &[u8]| {
    let whole = Path::new("/nowhere/a.glb");
    match bytes.iter().position(|&byte| byte == 0) {
        Some(end) if !bytes.starts_with(b"glTF") => {
            read_all(&glb(&bytes[..end], &bytes[end + 1..]), whole);
        }
        _ => read_all(bytes, whole),
    }
});

fuzz_mutator!(|data: &mut [u8], size: usize, most: usize, seed: u32| {
    mutation::mutate(data, size, most, seed)
});
