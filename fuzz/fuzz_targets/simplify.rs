//! Any mesh through weld, descent and polish: levels must be sound, and nothing may panic.
//!
//! `cargo +nightly fuzz run simplify -- -max_total_time=600 -timeout=5 -rss_limit_mb=2048`

#![no_main]

#[path = "../../attr/tests/sound/mod.rs"]
mod sound;

use arbitrary::Unstructured;
use libfuzzer_sys::fuzz_target;
use sound::{Recipe, chains, check};

fuzz_target!(|bytes: &[u8]| {
    let Ok(recipe) = Recipe::read(&mut Unstructured::new(bytes)) else { return };
    if let Some((mesh, levels)) = chains(&recipe) {
        levels.iter().for_each(|levels| check(&mesh, levels));
    }
});
