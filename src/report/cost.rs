//! What a bake cost, and on which machine: what differs from run to run of the same bake.

use super::Seconds;
use super::ticks::grouped;

/// A named length.
pub(super) struct Bar {
    pub(super) name: String,
    pub(super) percent: f64,
    pub(super) text: String,
}

/// The wall time of each stage that ran.
pub(super) fn timing_bars(seconds: &Seconds) -> Vec<Bar> {
    let stages = [
        ("read", seconds.read),
        ("weld", seconds.weld),
        ("simplify", seconds.simplify),
        ("polish", seconds.polish),
        ("repair", seconds.repair),
        ("transfer", seconds.transfer),
        ("evaluate", seconds.evaluate),
        ("write", seconds.write),
        ("report", seconds.report),
    ];
    let longest = stages.iter().map(|(_, time)| *time).fold(f64::MIN_POSITIVE, f64::max);
    let bar = |(name, time): (&str, f64)| Bar {
        name: name.to_owned(),
        percent: 100.0 * time / longest,
        text: format!("{time:.2} s"),
    };
    stages.into_iter().filter(|(_, time)| *time > 0.0).map(bar).collect()
}

/// The machine of this process, and the day.
pub(super) fn machine() -> Vec<String> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let (threads, system) = (rayon::current_num_threads(), std::env::consts::OS);
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    vec![
        format!(
            "{}, {}, on {system} ({}).",
            counted(threads, "thread"),
            counted(cores, "core"),
            std::env::consts::ARCH
        ),
        format!("Made on {}.", date(now.map_or(0, |since| since.as_secs()))),
    ]
}

/// The day of a time in seconds since 1970, in universal time.
fn date(seconds: u64) -> String {
    // Days of a calendar that begins in March of the year 0, where leap days end the years (Hinnant,
    // "chrono-compatible low-level date algorithms").
    let days = seconds / 86_400 + 719_468;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let (month, next) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    format!("{:04}-{month:02}-{day:02}", era * 400 + year + next)
}

/// A count with its noun.
pub(super) fn counted(count: usize, what: &str) -> String {
    let plural = match (count, what) {
        (1, _) => "",
        (_, "mesh") => "es",
        _ => "s",
    };
    format!("{} {what}{plural}", grouped(count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_are_told_as_a_day() {
        let days = [0, 951_782_400, 1_709_164_799, 1_709_251_200, 4_102_444_799].map(date);
        assert_eq!(days, ["1970-01-01", "2000-02-29", "2024-02-28", "2024-03-01", "2099-12-31"]);
    }

    #[test]
    fn bars_are_shares_of_the_longest() {
        let bars = timing_bars(&Seconds { read: 1.0, simplify: 4.0, ..Seconds::default() });
        let bars: Vec<_> = bars.iter().map(|bar| (bar.name.as_str(), bar.percent)).collect();
        assert_eq!(bars, [("read", 25.0), ("simplify", 100.0)]);
    }
}
