//! The subcommands. Each returns how many of its inputs failed.

mod bake;
mod bake_report;
mod bars;
mod console;
mod evaluate;
mod extract;
mod inspect;
mod quadrics;
mod refine;
mod repair;
mod report;
mod select;
mod shell;
mod view;

pub(crate) use bake::bake;
pub(crate) use evaluate::evaluate;
pub(crate) use extract::extract;
pub(crate) use inspect::inspect;
pub(crate) use quadrics::quadrics;
pub(crate) use refine::refine;
pub(crate) use repair::repair;
pub(crate) use report::report;
pub(crate) use select::select;
pub(crate) use shell::{completions, man};
pub(crate) use view::view;
