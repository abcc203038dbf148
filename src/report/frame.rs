//! What all pages have in common: `layout.html`, which their templates extend.

/// The colors and fonts of all pages.
const BASE: &str = include_str!("base.css");
/// The style of charts and tables.
pub(super) const CHARTS: &str = include_str!("chart.css");

/// The head and the foot of a page.
pub(super) struct Frame {
    /// Its title, which heads it.
    pub(super) title: String,
    /// The version of this crate.
    pub(super) version: &'static str,
    /// Its style sheet.
    pub(super) style: String,
}

impl Frame {
    /// The frame of a page with such a title, and with further styles.
    pub(super) fn new(title: impl Into<String>, styles: &[&str]) -> Self {
        let style = std::iter::once(BASE).chain(styles.iter().copied()).collect();
        Self { title: title.into(), version: env!("CARGO_PKG_VERSION"), style }
    }
}
