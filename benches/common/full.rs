//! Small inputs by default, so that each bench is done within two minutes; those of the tables with `--full`.

use criterion::Criterion;

/// Whether the bench was asked for the inputs of the tables.
pub(crate) fn is_full() -> bool {
    std::env::args().any(|argument| argument == "--full")
}

/// Criterion with the arguments of the command line, of which it does not know that one.
pub(crate) fn criterion() -> Criterion {
    if is_full() { Criterion::default() } else { Criterion::default().configure_from_args() }
}
