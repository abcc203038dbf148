//! Line charts as SVG: one figure against the number of triangles.
//!
//! The x axis is in octaves, since each level has about half the triangles of the one before; the y
//! axis is linear, or in decades where values span them. Colors are classes and variables of the page, so a chart follows its theme.

use std::fmt::Write;

use super::scale::Scale;
use super::ticks::{Ticks, doublings, grouped, short, superscript};

/// Width and height of a chart in its own units, a pixel each at full size.
const SIZE: [f64; 2] = [280.0, 190.0];
/// The plot's edges: left, top, right, bottom.
const PLOT: [f64; 4] = [40.0, 14.0, 274.0, 154.0];
/// Octaves kept free to the left and right of the points; a label stands to the right of its point.
const PAD: [f64; 2] = [0.25, 0.65];
/// Width of a digit of a label.
const DIGIT: f64 = 6.2;
/// Between two labels, beside each other.
const APART: f64 = 4.0;
/// Colors that the page has for series, `--series-0` and so on; more series share them.
pub(super) const COLORS: usize = 6;
/// Dashes that series of the same color have, one after the other.
pub(super) const DASHES: usize = 3;

/// With more series, values stand at their points on hover alone.
const MOST_LABELED: usize = 2;

/// One figure of all levels or candidates.
#[derive(Clone, Debug)]
pub(super) struct Chart {
    /// The name of the figure.
    pub(super) title: &'static str,
    /// Its unit.
    pub(super) unit: &'static str,
    /// The value of a perfect candidate.
    pub(super) ideal: f64,
    /// The name of the lying axis.
    pub(super) across: &'static str,
    /// Lines, or points alone.
    pub(super) series: Vec<Series>,
}

/// The name of a series, and its looks.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Key {
    pub(super) color: usize,
    pub(super) dash: usize,
    pub(super) name: String,
}

/// Points that belong together and are joined by a line.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Series {
    /// An index of the page's colors.
    pub(super) color: usize,
    /// From few triangles to many.
    pub(super) points: Vec<Point>,
}

/// A level or candidate.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Point {
    /// Number of its triangles, or of what else lies along the axis.
    pub(super) triangles: usize,
    /// The figure.
    pub(super) value: f64,
    /// The standard deviation of the figure, 0 where it was not measured several times.
    pub(super) deviation: f64,
    /// Its name.
    pub(super) name: String,
}

impl Chart {
    /// The unit as the page shows it, with the power of ten that the numbers on the axis are in.
    pub(super) fn unit_text(&self) -> String {
        let scale = match self.y_axis().unit() {
            0 => String::new(),
            unit => format!("× 10{} ", superscript(unit)),
        };
        format!("{scale}{}", self.unit).trim_end().to_owned()
    }

    /// The names of the series, by those of their first points.
    pub(super) fn keys(&self) -> Vec<Key> {
        let key = |series: &Series| {
            let name = series.points.first()?.name.clone();
            Some(Key { color: series.color % COLORS, dash: series.color / COLORS % DASHES, name })
        };
        self.series.iter().filter_map(key).collect()
    }

    /// Whether there is anything to draw.
    pub(super) fn is_empty(&self) -> bool {
        self.series.iter().all(|series| series.points.is_empty())
    }

    /// Whether all candidates are perfect, but for what nobody would see: a hundredth of a percent.
    pub(super) fn is_perfect(&self) -> bool {
        let room = (1e-4 * self.ideal.abs()).max(1e-12);
        self.points().all(|point| (point.value - self.ideal).abs() <= room)
    }

    fn points(&self) -> impl Iterator<Item = &Point> + Clone {
        self.series.iter().flat_map(|series| &series.points)
    }

    fn y_axis(&self) -> Scale {
        let values = || self.points().map(|point| point.value);
        if let Some(decades) = Scale::decades(values(), self.ideal) {
            return decades;
        }
        let low = values().fold(self.ideal, f64::min);
        let high = self.points().map(|own| own.value + own.deviation).fold(self.ideal, f64::max);
        // Less than that is rounding, and would take more digits than fit beside the axis.
        let differ = high - low > 1e-5 * low.abs().max(high.abs()) + 1e-30;
        Scale::Linear(match (differ, self.ideal == 0.0) {
            (true, true) => Ticks::over(low, high),
            // Room for a label below the lowest point.
            (true, false) => Ticks::over(low - 0.1 * (high - low), high),
            (false, true) => Ticks::over(0.0, 1.0),
            (false, false) => Ticks::over(low - 0.05, high),
        })
    }

    /// The chart as an SVG element.
    pub(super) fn to_svg(&self) -> String {
        let axes = Axes::new(self.points().map(|point| point.triangles), self.y_axis());
        let mut svg = format!(
            "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">",
            SIZE[0], SIZE[1], self.title
        );
        axes.draw(&mut svg, self.ideal, self.across);
        let lines: Vec<Vec<[f64; 2]>> =
            self.series.iter().map(|series| axes.places(series)).collect();
        let mut taken = obstacles(&lines);
        for (series, places) in self.series.iter().zip(&lines) {
            draw_series(&mut svg, series, places, &axes, self.across);
            if self.series.len() <= MOST_LABELED {
                draw_labels(&mut svg, series, places, &axes.scale, &mut taken);
            }
        }
        svg += "</svg>";
        svg
    }
}

/// The axes of a plot, from numbers to places.
struct Axes {
    /// log₂ of the triangles at the left and right edge of the plot.
    octaves: [f64; 2],
    doublings: Vec<u64>,
    scale: Scale,
}

impl Axes {
    fn new(triangles: impl Iterator<Item = usize> + Clone, scale: Scale) -> Self {
        let low = triangles.clone().min().unwrap_or(1).max(1);
        let high = triangles.max().unwrap_or(1).max(1);
        let mut octaves = [(low as f64).log2() - PAD[0], (high as f64).log2() + PAD[1]];
        // A single point, or points close together, still get a tick or two.
        let lacking = (2.0 - (octaves[1] - octaves[0])).max(0.0) / 2.0;
        octaves = [octaves[0] - lacking, octaves[1] + lacking];
        Self { octaves, doublings: doublings(octaves), scale }
    }

    fn x(&self, triangles: f64) -> f64 {
        let [low, high] = self.octaves;
        PLOT[0] + (triangles.max(1.0).log2() - low) / (high - low) * (PLOT[2] - PLOT[0])
    }

    fn y(&self, value: f64) -> f64 {
        PLOT[3] - self.scale.share(value) * (PLOT[3] - PLOT[1])
    }

    fn places(&self, series: &Series) -> Vec<[f64; 2]> {
        let place = |point: &Point| [self.x(point.triangles as f64), self.y(point.value)];
        series.points.iter().map(place).collect()
    }

    fn draw(&self, svg: &mut String, ideal: f64, across: &str) {
        let [left, _, right, bottom] = PLOT;
        let is_linear = matches!(self.scale, Scale::Linear(_));
        for mark in self.scale.marks() {
            let y = self.y(mark.value);
            let class = if is_linear && mark.value == ideal { "ideal" } else { "grid" };
            let (text, base) = (mark.label, y + 3.5);
            put(
                svg,
                format_args!(
                    "<path class=\"{class}\" d=\"M{left:.1} {y:.1}H{right:.1}\"/>\
                 <text class=\"end\" x=\"{:.1}\" y=\"{base:.1}\">{text}</text>",
                    left - 6.0
                ),
            );
        }
        for &count in &self.doublings {
            let (x, text) = (self.x(count as f64), short(count));
            put(
                svg,
                format_args!(
                    "<path class=\"tick\" d=\"M{x:.1} {bottom:.1}v4\"/>\
                 <text class=\"mid\" x=\"{x:.1}\" y=\"{:.1}\">{text}</text>",
                    bottom + 16.0
                ),
            );
        }
        put(
            svg,
            format_args!(
                "<text class=\"end\" x=\"{right:.1}\" y=\"{:.1}\">{across}</text>",
                bottom + 31.0
            ),
        );
    }
}

/// Appends; a string takes all that is written.
fn put(svg: &mut String, what: std::fmt::Arguments<'_>) {
    let _ = svg.write_fmt(what);
}

/// A line through the points, and the points with their values on hover.
fn draw_series(svg: &mut String, series: &Series, places: &[[f64; 2]], axes: &Axes, across: &str) {
    let (color, dash) = (series.color % COLORS, series.color / COLORS % DASHES);
    put(svg, format_args!("<g style=\"--own:var(--series-{color})\">"));
    if let [[x, y], rest @ ..] = places
        && !rest.is_empty()
    {
        put(svg, format_args!("<path class=\"line dash-{dash}\" d=\"M{x:.1} {y:.1}"));
        rest.iter().for_each(|[x, y]| put(svg, format_args!("L{x:.1} {y:.1}")));
        svg.push_str("\"/>");
    }
    for (point, [x, y]) in series.points.iter().zip(places) {
        let (name, scale) = (escape(&point.name), &axes.scale);
        let mut value = scale.full_text(point.value);
        if point.deviation > 0.0 {
            let [low, high] = [-1.0, 1.0].map(|sign| axes.y(point.value + sign * point.deviation));
            put(
                svg,
                format_args!(
                    "<path class=\"line error\" d=\"M{x:.1} {low:.1}V{high:.1}M{:.1} {low:.1}h6M{:.1} {high:.1}h6\"/>",
                    x - 3.0,
                    x - 3.0
                ),
            );
            value = format!("{value} ± {}", scale.full_text(point.deviation));
        }
        let triangles = grouped(point.triangles);
        put(
            svg,
            format_args!(
                "<g class=\"point\"><title>{name}: {triangles} {across}, {value}</title>\
                 <circle class=\"reach\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"11\"/>\
                 <circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.2\"/></g>"
            ),
        );
    }
    svg.push_str("</g>");
}

/// The value of each point, to the right above or below it, where there is room.
fn draw_labels(
    svg: &mut String,
    series: &Series,
    places: &[[f64; 2]],
    scale: &Scale,
    taken: &mut Vec<[f64; 4]>,
) {
    for (point, [x, y]) in series.points.iter().zip(places) {
        let text = scale.value_text(point.value);
        let width = text.chars().count() as f64 * DIGIT;
        for base in [y - 6.0, y + 14.0] {
            let space = [x + 6.0, base - 9.0, x + 6.0 + width, base + 2.0];
            let is_inside = space[2] <= SIZE[0] && base <= PLOT[3] + 1.0;
            if is_inside && taken.iter().all(|other| apart(&space, other)) {
                taken.push([space[0] - APART, space[1], space[2] + APART, space[3]]);
                let x = space[0];
                put(
                    svg,
                    format_args!(
                        "<text class=\"label\" x=\"{x:.1}\" y=\"{base:.1}\">{text}</text>"
                    ),
                );
                break;
            }
        }
    }
}

/// Boxes that no label may lie on: along the lines, and around the points.
fn obstacles(lines: &[Vec<[f64; 2]>]) -> Vec<[f64; 4]> {
    const STEPS: u32 = 48;
    let around = |[x, y]: [f64; 2], reach: f64| [x - reach, y - reach, x + reach, y + reach];
    let mut boxes = Vec::new();
    for line in lines {
        boxes.extend(line.iter().map(|place| around(*place, 3.5)));
        for pair in line.windows(2) {
            let at = |step: u32| {
                let t = f64::from(step) / f64::from(STEPS);
                [0, 1].map(|axis| pair[0][axis] + (pair[1][axis] - pair[0][axis]) * t)
            };
            boxes.extend((0..=STEPS).map(|step| around(at(step), 1.0)));
        }
    }
    boxes
}

fn apart(a: &[f64; 4], b: &[f64; 4]) -> bool {
    a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1]
}

/// Text that means itself in XML.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(triangles: usize, value: f64) -> Point {
        Point { triangles, value, deviation: 0.0, name: "a<b".to_owned() }
    }

    fn chart(points: Vec<Point>) -> Chart {
        let series = vec![Series { color: 0, points }];
        Chart { title: "RMS", unit: "of 1", ideal: 0.0, across: "triangles", series }
    }

    #[test]
    fn points_lie_where_the_axes_say() {
        let scale = Scale::Linear(Ticks::over(0.0, 1.0));
        let axes = Axes::new([1024, 4096].into_iter(), scale);
        // From 9.75 to 12.65 octaves over 234 units.
        assert_eq!(format!("{:.3}", axes.x(1024.0)), format!("{:.3}", 40.0 + 0.25 / 2.9 * 234.0));
        assert_eq!([axes.y(0.0), axes.y(0.5), axes.y(1.0)], [154.0, 84.0, 14.0]);
    }

    #[test]
    fn a_line_joins_its_points_and_names_are_escaped() {
        let svg = chart(vec![point(1024, 1.0), point(4096, 0.5)]).to_svg();
        let line = "<path class=\"line dash-0\" d=\"M60.2 14.0L221.6 84.0\"/>";
        assert!(svg.contains(line), "{svg}");
        assert!(svg.contains("<title>a&lt;b: 4,096 triangles, 0.500</title>"), "{svg}");
        assert_eq!(svg.matches("class=\"label\"").count(), 2);
        let alone = chart(vec![point(1024, 1.0)]).to_svg();
        assert!(!alone.contains("class=\"line"), "{alone}");
    }

    #[test]
    fn labels_lie_neither_on_each_other_nor_on_lines() {
        let svg = chart(vec![point(1024, 1.0), point(1030, 0.99)]).to_svg();
        assert_eq!(svg.matches("class=\"label\"").count(), 2, "{svg}");
        let svg = chart((0..5).map(|k| point(1024 + k, 1.0)).collect()).to_svg();
        assert_eq!(svg.matches("class=\"label\"").count(), 2, "{svg}");
        // The label of the first would lie on the line upward, and goes below.
        let svg = chart(vec![point(1024, 0.5), point(2048, 0.6)]).to_svg();
        let axes = Axes::new([1024, 2048].into_iter(), Scale::Linear(Ticks::over(0.0, 0.6)));
        assert!(svg.contains(&format!("y=\"{:.1}\">0.50</text>", axes.y(0.5) + 14.0)), "{svg}");
    }

    #[test]
    fn a_deviation_is_a_bar_that_the_axis_has_room_for() {
        let mut points = vec![point(1, 3.0), point(2, 1.5)];
        points[0].deviation = 1.0;
        let own = Chart { across: "threads", ..chart(points) };
        let svg = own.to_svg();
        assert_eq!(svg.matches("class=\"line error\"").count(), 1, "{svg}");
        assert!(svg.contains("a&lt;b: 1 threads, 3.00 ± 1.00"), "{svg}");
        let Scale::Linear(ticks) = own.y_axis() else { panic!("linear") };
        assert!(ticks.value(ticks.last) >= 4.0);
    }

    #[test]
    fn a_perfect_candidate_has_a_chart_too() {
        assert!(chart(vec![point(12, 0.0)]).to_svg().contains("cy=\"154.0\""));
        let one = Chart { ideal: 1.0, ..chart(vec![point(12, 1.0)]) };
        assert!(one.to_svg().contains("cy=\"14.0\""));
    }
}
