//! Round numbers for axes, and numbers as text.

/// Round numbers over a range: multiples of 1, 2 or 5 times a power of ten.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ticks {
    /// The step is `digit` · 10^`power`.
    digit: i64,
    power: i32,
    /// The first and last tick in steps.
    pub(super) first: i64,
    /// See `first`.
    pub(super) last: i64,
    /// The numbers shown are in units of 10^`unit`.
    pub(super) unit: i32,
}

impl Ticks {
    /// The finest such ticks that enclose `low` to `high`, which must be the greater, with at most
    /// six of them.
    pub(super) fn over(low: f64, high: f64) -> Self {
        let start = ((high - low).log10().floor() as i32).saturating_sub(1);
        let steps = (start..).flat_map(|power| [1, 2, 5].map(|digit| (digit, power)));
        let of = |(digit, power): (i64, i32)| {
            let step = scaled(digit as f64, power);
            // Ends that are ticks but for rounding stay the ends.
            let first = (low / step + 1e-9).floor() as i64;
            let last = (high / step - 1e-9).ceil() as i64;
            Self { digit, power, first, last, unit: 0 }
        };
        let mut ticks = steps.map(of).find(|ticks| ticks.last - ticks.first <= 5).unwrap_or(
            // Not reached: steps grow without end.
            Self { digit: 1, power: 0, first: 0, last: 1, unit: 0 },
        );
        let most = ticks.value(ticks.last).abs().max(ticks.value(ticks.first).abs());
        let magnitude = (most * 1.000_000_1).log10().floor() as i32;
        if !(-2..4).contains(&magnitude) {
            ticks.unit = magnitude;
        }
        ticks
    }

    /// The number at a tick.
    pub(super) fn value(&self, tick: i64) -> f64 {
        scaled((tick * self.digit) as f64, self.power)
    }

    /// A tick's number in the unit of the axis.
    pub(super) fn label(&self, tick: i64) -> String {
        let decimals = (self.unit - self.power).max(0) as usize;
        format!("{:.decimals$}", scaled((tick * self.digit) as f64, self.power - self.unit))
    }

    /// A value in the unit of the axis, with a digit more than its ticks.
    pub(super) fn value_text(&self, value: f64) -> String {
        let decimals = (self.unit - self.power + 1).max(0) as usize;
        format!("{:.decimals$}", scaled(value, -self.unit))
    }

    /// A value with its power of ten.
    pub(super) fn full_text(&self, value: f64) -> String {
        let decimals = (self.unit - self.power + 2).max(0) as usize;
        let number = format!("{:.decimals$}", scaled(value, -self.unit));
        match self.unit {
            0 => number,
            unit => format!("{number} × 10{}", superscript(unit)),
        }
    }
}

/// A number times a power of ten, divided where that is exact.
fn scaled(number: f64, power: i32) -> f64 {
    if power < 0 { number / 10f64.powi(-power) } else { number * 10f64.powi(power) }
}

/// A power as it is written above the line.
pub(super) fn superscript(power: i32) -> String {
    let raised = |digit| match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        other => char::from_u32('⁰' as u32 + (other as u32 - '0' as u32)).unwrap_or(other),
    };
    power.to_string().chars().map(raised).collect()
}

/// Round counts near the powers of two within a range of log₂, at most six: 1, 2, … 64, 125, 250,
/// 500, then the same in thousands, and so on.
pub(super) fn doublings([low, high]: [f64; 2]) -> Vec<u64> {
    const IN_A_THOUSAND: [u64; 10] = [1, 2, 4, 8, 16, 32, 64, 125, 250, 500];
    let all = (0..60).map(|k| 1000u64.pow(k / 10) * IN_A_THOUSAND[k as usize % 10]);
    let inside: Vec<u64> =
        all.filter(|&count| (low..=high).contains(&(count as f64).log2())).collect();
    let step = inside.len().div_ceil(6).max(1);
    inside.into_iter().step_by(step).collect()
}

/// A round count in as few characters as it takes.
pub(super) fn short(count: u64) -> String {
    match count {
        1_000_000.. => format!("{}M", count / 1_000_000),
        1000.. => format!("{}k", count / 1000),
        _ => count.to_string(),
    }
}

/// A count with its thousands set apart.
pub(super) fn grouped(count: usize) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64) -> (Vec<String>, i32) {
        let ticks = Ticks::over(low, high);
        ((ticks.first..=ticks.last).map(|tick| ticks.label(tick)).collect(), ticks.unit)
    }

    #[test]
    fn ticks_are_round_and_enclose_the_range() {
        assert_eq!(labels(0.0, 0.077).0, ["0.00", "0.02", "0.04", "0.06", "0.08"]);
        assert_eq!(labels(0.0, 1.0).0, ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(0.973, 1.0).0, ["0.97", "0.98", "0.99", "1.00"]);
        assert_eq!(
            labels(0.0, 2.3e-4),
            (["0.0", "0.5", "1.0", "1.5", "2.0", "2.5"].map(String::from).to_vec(), -4)
        );
        assert_eq!(labels(0.0, 41.0).0, ["0", "10", "20", "30", "40", "50"]);
        assert_eq!(labels(-3.0, 1.0).0, ["-3", "-2", "-1", "0", "1"]);
    }

    #[test]
    fn values_have_a_digit_more_than_their_axis() {
        let ticks = Ticks::over(0.0, 2.3e-4);
        assert_eq!(ticks.value_text(2.3e-4), "2.30");
        assert_eq!(ticks.full_text(2.3e-4), "2.300 × 10⁻⁴");
        assert_eq!(Ticks::over(0.0, 0.077).value_text(0.0468), "0.047");
        assert_eq!(superscript(-10), "⁻¹⁰");
    }

    #[test]
    fn triangles_are_told_in_doublings() {
        assert_eq!(doublings([10.0, 14.2]), [2000, 4000, 8000, 16_000]);
        assert_eq!(doublings([0.0, 3.0]), [1, 2, 4, 8]);
        assert_eq!(doublings([0.0, 20.0]), [1, 16, 250, 4000, 64_000, 1_000_000]);
        assert_eq!([64, 16_000, 2_000_000].map(short), ["64", "16k", "2M"]);
        assert_eq!([7, 999, 1000, 1_234_567].map(grouped), ["7", "999", "1,000", "1,234,567"]);
    }
}
