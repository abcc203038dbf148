//! All tests from the outside but those of hostile files, in one binary: linking a binary for each
//! takes longer than most of them run. `cargo test --test suite rigs::` runs those of one file.

#[path = "../common/mod.rs"]
mod common;

mod as_written;
mod auto;
mod bake;
mod batch;
mod cli;
mod evaluate;
mod far_away;
mod formats;
mod free;
mod geomorph;
mod golden;
mod inputs;
mod joins;
mod ktx2;
mod lightmaps;
mod low_poly;
mod merging;
mod moves;
mod nearly_right;
mod needle;
mod output;
mod outside;
mod palettes;
mod pictures;
mod progressive;
mod repair;
mod repair_alone;
mod report;
mod required;
mod rigs;
mod rooms;
mod round_trip;
mod scenes;
mod seeds;
mod seen;
mod steering;
mod tangents;
mod teaching;
mod tiles;
mod transcripts;
mod transfer;
mod transfer_shape;
mod transfer_users;
mod typed;
