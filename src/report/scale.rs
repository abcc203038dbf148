//! The upright axis of a chart: linear from a perfect match on, or in decades where values span them.

use super::ticks::{Ticks, superscript};

/// From this ratio of the greatest to the least value on, the least would lie on the axis of a linear
/// scale: less than a tenth of its height.
const SPAN: f64 = 12.0;

/// The way from values to heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Scale {
    /// Even steps.
    Linear(Ticks),
    /// Even factors, over whole decades.
    Decades {
        /// The power of ten at the foot.
        first: i32,
        /// The power of ten at the top.
        last: i32,
    },
}

/// A line across the plot.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mark {
    pub(super) value: f64,
    /// The number beside it; empty between decades.
    pub(super) label: String,
}

impl Scale {
    /// Decades for values above 0 that span one, where 0 is what they should be.
    pub(super) fn decades(values: impl Iterator<Item = f64> + Clone, ideal: f64) -> Option<Self> {
        let low = values.clone().fold(f64::INFINITY, f64::min);
        let high = values.fold(0.0, f64::max);
        if ideal != 0.0 || low <= 0.0 || high / low < SPAN || !high.is_finite() {
            return None;
        }
        // Ends that are decades but for rounding stay the ends.
        let first = (low.log10() + 1e-9).floor() as i32;
        let last = (high.log10() - 1e-9).ceil() as i32;
        Some(Self::Decades { first, last })
    }

    /// The height of a value, from 0 at the foot to 1 at the top.
    pub(super) fn share(&self, value: f64) -> f64 {
        let [low, high, at] = match self {
            Self::Linear(ticks) => [ticks.value(ticks.first), ticks.value(ticks.last), value],
            Self::Decades { first, last } => {
                [f64::from(*first), f64::from(*last), value.log10().max(f64::from(*first))]
            }
        };
        (at - low) / (high - low)
    }

    /// The lines across.
    pub(super) fn marks(&self) -> Vec<Mark> {
        match self {
            Self::Linear(ticks) => (ticks.first..=ticks.last)
                .map(|tick| Mark { value: ticks.value(tick), label: ticks.label(tick) })
                .collect(),
            Self::Decades { first, last } => (*first..=*last)
                .flat_map(|power| {
                    let between = if power < *last { &[2.0, 5.0][..] } else { &[] };
                    let mark = |digit: f64, label| Mark { value: digit * 10f64.powi(power), label };
                    let decade = mark(1.0, format!("10{}", superscript(power)));
                    let between = between.iter().map(move |&digit| mark(digit, String::new()));
                    std::iter::once(decade).chain(between).collect::<Vec<_>>()
                })
                .collect(),
        }
    }

    /// A value beside its point.
    pub(super) fn value_text(&self, value: f64) -> String {
        match self {
            Self::Linear(ticks) => ticks.value_text(value),
            Self::Decades { .. } => scientific(value, 1),
        }
    }

    /// A value with its power of ten.
    pub(super) fn full_text(&self, value: f64) -> String {
        match self {
            Self::Linear(ticks) => ticks.full_text(value),
            Self::Decades { .. } => scientific(value, 2),
        }
    }

    /// The power of ten that the numbers on the axis are in.
    pub(super) fn unit(&self) -> i32 {
        match self {
            Self::Linear(ticks) => ticks.unit,
            Self::Decades { .. } => 0,
        }
    }
}

/// A value with so many decimals: plain from a hundredth on, with a power of ten below.
fn scientific(value: f64, decimals: usize) -> String {
    let magnitude = value.log10().floor() as i32;
    if (-2..3).contains(&magnitude) {
        let decimals = (decimals as i32 - magnitude).max(0) as usize;
        return format!("{value:.decimals$}");
    }
    format!("{:.decimals$}·10{}", value / 10f64.powi(magnitude), superscript(magnitude))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_that_span_a_decade_go_by_decades() {
        let scale = |values: &[f64]| Scale::decades(values.iter().copied(), 0.0);
        assert_eq!(scale(&[1.3e-4, 2.1e-3]), Some(Scale::Decades { first: -4, last: -2 }));
        assert_eq!(scale(&[1.0, 10.0]), None);
        assert_eq!(scale(&[0.0, 1.0]), None, "nothing is 0 times another");
        assert_eq!(Scale::decades([0.01, 0.9].into_iter(), 1.0), None);
        assert_eq!(scale(&[0.001, 1.0]), Some(Scale::Decades { first: -3, last: 0 }));
    }

    #[test]
    fn even_factors_are_even_steps() {
        let scale = Scale::Decades { first: -4, last: -2 };
        let shares = [1e-4, 1e-3, 1e-2, 0.0].map(|value| scale.share(value));
        for (share, expected) in shares.into_iter().zip([0.0, 0.5, 1.0, 0.0]) {
            assert!((share - expected).abs() < 1e-12, "{shares:?}");
        }
        let labels: Vec<String> = scale.marks().into_iter().map(|mark| mark.label).collect();
        assert_eq!(labels, ["10⁻⁴", "", "", "10⁻³", "", "", "10⁻²"]);
        assert_eq!(scale.value_text(1.34e-4), "1.3·10⁻⁴");
        assert_eq!(scale.full_text(0.0234), "0.0234");
    }
}
