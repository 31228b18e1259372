//! A chart as inline SVG.
//!
//! Each chart is drawn in three widths, and the page's style shows the one that fits: scaling a single drawing would
//! make its text too small on a phone or too large on a desktop. Colours are variables of the page, so that the chart
//! follows the theme.

use super::frame::framed;
use super::scale::FittedScale;
use super::{Axis, Chart, Scale};
use crate::html::{escape, format_number};

/// Width and height of a drawing, and the class by which the style sheet selects it.
const SIZES: [(f64, f64, &str); 3] = [(320.0, 220.0, "narrow"), (430.0, 260.0, "medium"), (680.0, 330.0, "wide")];
const TOP: f64 = 30.0;
const BOTTOM: f64 = 38.0;
const RIGHT: f64 = 14.0;
/// Width of a digit in tick labels, in pixels.
const DIGIT_WIDTH: f64 = 7.0;
/// Mean width of a letter in notes, in pixels.
const LETTER_WIDTH: f64 = 6.2;
/// Number of colours for curves in the style sheet.
const NUM_COLORS: usize = 4;

impl Chart {
    /// The complete figure: title, legend, drawings, caption.
    pub(crate) fn to_html(&self) -> String {
        // A single curve has a legend as well, so that the plots of neighbouring charts are aligned.
        let entries = self.series.iter().enumerate().map(|(order, series)| {
            let color = order % NUM_COLORS + 1;
            format!("<li><i class=\"swatch s{color}\"></i>{}</li>", escape(&series.name))
        });
        let legend = match self.series.len() {
            0 => String::new(),
            _ => format!("<ul class=\"legend\">{}</ul>", entries.collect::<String>()),
        };
        let drawings = SIZES.into_iter().map(|(width, height, class)| self.to_svg(width, height, class));
        framed("chart", &self.title, &legend, drawings, self.caption.as_deref())
    }

    fn to_svg(&self, width: f64, height: f64, class: &str) -> String {
        let points = || self.series.iter().flat_map(|series| &series.points);
        // A point affects the axes only if both coordinates are finite.
        let both = || points().filter(|(x, y)| x.is_finite() && y.is_finite());
        let x_scale = FittedScale::fit(
            self.x_axis.scale,
            both().map(|p| p.0).chain(self.moment.as_ref().map(|m| m.0)),
            self.x_axis.from_zero,
            true,
        );
        let y_scale = FittedScale::fit(
            self.y_axis.scale,
            both().map(|p| p.1).chain(self.limit.as_ref().map(|l| l.0)),
            self.y_axis.from_zero,
            false,
        );
        let y_labels = tick_labels(&y_scale.ticks, &self.y_axis);
        let widest = y_labels.iter().map(|label| label.chars().count()).max().unwrap_or(1);
        let left = 14.0 + DIGIT_WIDTH * widest as f64;
        let plot = Plot { left, right: width - RIGHT, top: TOP, bottom: height - BOTTOM, x_scale, y_scale };

        let mut svg = format!(
            "<svg class=\"{class}\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">",
            escape(&self.description())
        );
        svg += &self.axes(&plot, &y_labels, width, height);
        if both().next().is_none() {
            svg += &format!(
                "<text class=\"empty\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">no data</text>",
                (plot.left + plot.right) / 2.0,
                (plot.top + plot.bottom) / 2.0
            );
        }
        svg += &self.references(&plot);
        for (order, series) in self.series.iter().enumerate() {
            let color = order % NUM_COLORS + 1;
            if series.noisy {
                svg += &plot.curve(&series.points, &format!("line raw s{color}"));
                svg += &plot.curve(&series.smoothed(), &format!("line s{color}"));
            } else {
                svg += &plot.curve(&series.points, &format!("line s{color}"));
            }
            if series.markers {
                svg += &plot.dots(&series.points, color);
            }
        }
        svg + "</svg>"
    }

    /// The chart in words, for screen readers.
    fn description(&self) -> String {
        let mut text = format!("{}: {} over {}.", self.title, self.y_axis.title(), self.x_axis.title());
        for series in &self.series {
            let finite = || series.points.iter().filter(|(_, y)| y.is_finite());
            if let (Some(first), Some(last)) = (finite().next(), finite().next_back()) {
                text += &format!(" {} from {} to {}.", series.name, plain(first.1), plain(last.1));
            }
        }
        text
    }

    fn axes(&self, plot: &Plot, y_labels: &[String], width: f64, height: f64) -> String {
        let mut svg = String::new();
        for (&tick, label) in plot.y_scale.ticks.iter().zip(y_labels) {
            let Some(y) = plot.y(tick) else { continue };
            svg += &format!(
                "<path class=\"grid\" d=\"M{:.1} {y:.1}H{:.1}\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                plot.left,
                plot.right,
                plot.left - 8.0,
                y + 4.0
            );
        }
        svg += &format!("<path class=\"axis\" d=\"M{:.1} {:.1}H{:.1}\"/>", plot.left, plot.bottom, plot.right);
        let x_labels = tick_labels(&plot.x_scale.ticks, &self.x_axis);
        for (&tick, label) in plot.x_scale.ticks.iter().zip(&x_labels) {
            let Some(x) = plot.x(tick) else { continue };
            // A label that would extend beyond the right edge is moved inside.
            let half = 0.5 * DIGIT_WIDTH * label.chars().count() as f64;
            let text_x = x.min(width - half - 1.0);
            svg += &format!(
                "<path class=\"axis\" d=\"M{x:.1} {:.1}v4\"/><text x=\"{text_x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
                plot.bottom,
                plot.bottom + 17.0
            );
        }
        svg += &format!(
            "<text class=\"title\" x=\"0\" y=\"12\">{}</text>\
             <text class=\"title\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            escape(&self.y_axis.title()),
            plot.right,
            height - 5.0,
            escape(&self.x_axis.title())
        );
        svg
    }

    fn references(&self, plot: &Plot) -> String {
        let mut svg = String::new();
        if let Some((y, label)) = self.limit.as_ref().and_then(|(y, label)| Some((plot.y(*y)?, label))) {
            // The label is at the right end, or left of the moment's line if it would overlap this line and fits there.
            let label_width = LETTER_WIDTH * label.chars().count() as f64;
            let moment = self.moment.as_ref().and_then(|(x, _)| plot.x(*x));
            let right = match moment {
                Some(x) if x > plot.right - label_width - 6.0 && x - 6.0 - label_width > plot.left => x - 6.0,
                _ => plot.right,
            };
            svg += &format!(
                "<path class=\"limit\" d=\"M{:.1} {y:.1}H{:.1}\"/>\
                 <text class=\"note\" x=\"{right:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                plot.left,
                plot.right,
                y - 6.0,
                escape(label)
            );
        }
        if let Some((x, label)) = self.moment.as_ref().and_then(|(x, label)| Some((plot.x(*x)?, label))) {
            let (anchor, shift) = if x > (plot.left + plot.right) / 2.0 { ("end", -6.0) } else { ("start", 6.0) };
            svg += &format!(
                "<path class=\"moment\" d=\"M{x:.1} {:.1}V{:.1}\"/>\
                 <text class=\"note\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{}</text>",
                plot.top - 4.0,
                plot.bottom,
                x + shift,
                plot.top + 6.0,
                escape(label)
            );
        }
        svg
    }
}

/// The drawing area of the curves.
struct Plot {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    x_scale: FittedScale,
    y_scale: FittedScale,
}

impl Plot {
    fn x(&self, value: f64) -> Option<f64> {
        Some(self.left + (self.right - self.left) * self.x_scale.place(value)?)
    }

    fn y(&self, value: f64) -> Option<f64> {
        Some(self.bottom - (self.bottom - self.top) * self.y_scale.place(value)?)
    }

    fn place(&self, point: &(f64, f64)) -> Option<(f64, f64)> {
        Some((self.x(point.0)?, self.y(point.1)?))
    }

    /// A path through the points, interrupted at points that cannot be drawn; an isolated point is a dot.
    fn curve(&self, points: &[(f64, f64)], class: &str) -> String {
        let mut path = String::new();
        let mut lone = String::new();
        let places: Vec<Option<(f64, f64)>> = points.iter().map(|point| self.place(point)).collect();
        for run in places.split(Option::is_none) {
            let run: Vec<(f64, f64)> = thin_out(run.iter().copied().flatten());
            match run.as_slice() {
                [] => {}
                &[(x, y)] => lone += &format!("M{x:.1} {y:.1}h0"),
                [first, rest @ ..] => {
                    path += &format!("M{:.1} {:.1}L", first.0, first.1);
                    let rest: Vec<String> = rest.iter().map(|(x, y)| format!("{x:.1} {y:.1}")).collect();
                    path += &rest.join(" ");
                }
            }
        }
        let mut svg = String::new();
        if !path.is_empty() {
            svg += &format!("<path class=\"{class}\" d=\"{path}\"/>");
        }
        if !lone.is_empty() {
            svg += &format!("<path class=\"{class} dot\" d=\"{lone}\"/>");
        }
        svg
    }

    fn dots(&self, points: &[(f64, f64)], color: usize) -> String {
        points
            .iter()
            .filter_map(|point| self.place(point))
            .map(|(x, y)| format!("<circle class=\"mark s{color}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\"/>"))
            .collect()
    }
}

/// Keeps the lowest and the highest point in each column of half a pixel; the drawing looks nearly the same.
fn thin_out(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = Vec::new();
    let mut column: Vec<(f64, f64)> = Vec::new();
    let flush = |column: &mut Vec<(f64, f64)>, kept: &mut Vec<(f64, f64)>| {
        let order = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let lowest = column.iter().position(|p| Some(p) == column.iter().min_by(order));
        let highest = column.iter().position(|p| Some(p) == column.iter().max_by(order));
        let (Some(a), Some(b)) = (lowest, highest) else { return };
        kept.push(column[a.min(b)]);
        if a != b {
            kept.push(column[a.max(b)]);
        }
        column.clear();
    };
    for point in points {
        if column.first().is_some_and(|first| (2.0 * first.0).floor() != (2.0 * point.0).floor()) {
            flush(&mut column, &mut kept);
        }
        column.push(point);
    }
    flush(&mut column, &mut kept);
    kept
}

/// Labels with the decimals of the ticks' step; [`plain`] labels for a logarithmic axis and for huge or tiny ticks.
fn tick_labels(ticks: &[f64], axis: &Axis) -> Vec<String> {
    let largest = ticks.iter().fold(0.0f64, |m, t| m.max(t.abs()));
    if axis.scale == Scale::Logarithmic || largest >= 1e6 || (largest > 0.0 && largest < 1e-3) {
        return ticks.iter().map(|&tick| plain(tick)).collect();
    }
    let step = ticks.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    let decimals = (0..=6)
        .find(|&d| {
            let scaled = step * 10f64.powi(d);
            (scaled - scaled.round()).abs() < 1e-6 * scaled.max(1.0)
        })
        .unwrap_or(3);
    ticks.iter().map(|&tick| format_number(tick, decimals as usize)).collect()
}

/// A short number: without trailing zeros after the point, and with an exponent if it is huge or tiny.
fn plain(value: f64) -> String {
    if !value.is_finite() || value == 0.0 {
        return format_number(value, 0);
    }
    let magnitude = value.abs().log10().floor() as i32;
    if !(-3..6).contains(&magnitude) {
        return format!("{value:.0e}").replace('-', "\u{2212}");
    }
    let formatted = format_number(value, (2 - magnitude).clamp(0, 6) as usize);
    if formatted.contains('.') {
        return formatted.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    formatted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::Series;
    use crate::html_checker::assert_well_formed;

    fn chart(points: Vec<(f64, f64)>) -> Chart {
        Chart::new("Error", Axis::new("step"), Axis::new("error").unit("mm").from_zero())
            .series(Series::new("median", points).with_markers())
    }

    #[test]
    fn nothing_one_point_and_not_a_number_do_not_panic() {
        let nan = f64::NAN;
        let cases = [
            vec![],
            vec![(1.0, 2.0)],
            vec![(nan, nan)],
            vec![(0.0, 1.0), (1.0, nan), (2.0, 3.0)],
            vec![(0.0, f64::INFINITY), (1.0, 1.0)],
            vec![(5.0, 5.0); 4],
            vec![(0.0, -1e308), (1.0, 1e308)],
        ];
        for points in cases {
            for axis in [Axis::new("y"), Axis::new("y").logarithmic()] {
                let mut chart = chart(points.clone());
                chart.y_axis = axis;
                chart.series.push(Series::new("again", points.clone()).noisy());
                let html = chart.limit(nan, "limit").moment(f64::INFINITY, "best").to_html();
                assert_well_formed(&html);
                assert!(!html.contains("NaN") && !html.contains("inf"), "{points:?} gave {html}");
            }
        }
    }

    #[test]
    fn an_empty_chart_says_so_and_a_lone_point_is_a_dot() {
        assert!(chart(vec![]).to_html().contains("no data"));
        let html = chart(vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0), (3.0, 4.0)]).to_html();
        assert!(html.contains("line s1 dot") && !html.contains("no data"));
    }

    #[test]
    fn a_curve_starts_and_ends_at_the_corners_of_its_plot() {
        let svg = chart(vec![(0.0, 0.0), (10.0, 10.0)]).to_svg(320.0, 220.0, "narrow");
        // The longest label has two digits: the plot is from x 28 to 306, y 182 to 30.
        assert!(svg.contains("d=\"M28.0 182.0L306.0 30.0\""), "{svg}");
    }

    #[test]
    fn a_long_curve_keeps_its_peaks_and_stays_small() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|k| (f64::from(k), 1.0)).collect();
        points[54_321].1 = 7.0;
        let thinned = thin_out(points.iter().map(|&(x, y)| (x / 300.0, y)));
        assert!(thinned.len() < 1500, "{} points", thinned.len());
        assert!(thinned.iter().any(|p| p.1 == 7.0));
    }

    #[test]
    fn numbers_are_short() {
        let labels = |ticks: &[f64]| tick_labels(ticks, &Axis::new("y"));
        assert_eq!(labels(&[0.0, 0.25, 0.5]), ["0.00", "0.25", "0.50"]);
        assert_eq!(labels(&[-20.0, 0.0, 20.0]), ["\u{2212}20", "0", "20"]);
        assert_eq!(plain(0.0123), "0.0123");
        assert_eq!(plain(50.0), "50");
        assert_eq!(plain(2e7), "2e7");
    }

    #[test]
    fn names_are_escaped() {
        let html = Chart::new("<b>", Axis::new("<x>"), Axis::new("<y>"))
            .series(Series::new("<s>", vec![(0.0, 1.0)]))
            .series(Series::new("b", vec![]))
            .limit(1.0, "<l>")
            .moment(0.0, "<m>")
            .caption("<c>")
            .to_html();
        for name in ["b", "x", "y", "s", "l", "m", "c"] {
            assert!(!html.contains(&format!("<{name}>")), "{name}");
            assert!(html.contains(&format!("&lt;{name}&gt;")), "{name}");
        }
    }
}
