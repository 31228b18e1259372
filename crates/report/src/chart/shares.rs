//! Fractions with their confidence intervals, one below the other.

use super::frame::framed;
use crate::html::{escape, format_number};

/// Widths of the drawings, each with the class by which the style selects it.
const SIZES: [(f64, &str); 3] = [(320.0, "narrow"), (440.0, "medium"), (720.0, "wide")];
const ROW_HEIGHT: f64 = 34.0;
const TOP: f64 = 8.0;
const BOTTOM: f64 = 24.0;
/// Space for the number at the right, in pixels.
const RIGHT: f64 = 64.0;
const LETTER_WIDTH: f64 = 6.6;
/// Possible starts of the axis, in percent: the largest one that is not above any drawn value is used.
const STARTS: [f64; 4] = [0.0, 50.0, 80.0, 90.0];

#[derive(Debug, Clone, PartialEq)]
struct ShareRow {
    label: String,
    percent: f64,
    interval: [f64; 2],
    reference: Option<f64>,
}

/// Fractions in percent as dots with whiskers, each with an optional reference value.
#[derive(Debug, Clone, PartialEq)]
pub struct ShareChart {
    title: String,
    rows: Vec<ShareRow>,
    reference_name: Option<String>,
    caption: Option<String>,
}

impl ShareChart {
    /// A chart without rows.
    #[must_use]
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), rows: Vec::new(), reference_name: None, caption: None }
    }

    /// Sets the name of the reference in the legend.
    #[must_use]
    pub fn reference_name(mut self, name: impl Into<String>) -> Self {
        self.reference_name = Some(name.into());
        self
    }

    /// Adds a fraction, its interval and its reference, all in percent. A row whose fraction or interval is not finite
    /// is left out, and so is a reference that is not finite.
    #[must_use]
    pub fn row(mut self, label: impl Into<String>, percent: f64, interval: [f64; 2], reference: Option<f64>) -> Self {
        if percent.is_finite() && interval.iter().all(|bound| bound.is_finite()) {
            let reference = reference.filter(|value| value.is_finite());
            self.rows.push(ShareRow { label: label.into(), percent, interval, reference });
        }
        self
    }

    /// Sets the text below the chart.
    #[must_use]
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = Some(caption.into());
        self
    }

    pub(crate) fn to_html(&self) -> String {
        let legend = self.reference_name.as_ref().map_or_else(String::new, |name| {
            format!(
                "<ul class=\"legend\"><li><i class=\"swatch s3\"></i>measured, with 95 % interval</li>\
                 <li><i class=\"swatch hollow\"></i>{}</li></ul>",
                escape(name)
            )
        });
        let drawings = SIZES.into_iter().map(|(width, class)| self.to_svg(width, class));
        framed("chart", &self.title, &legend, drawings, self.caption.as_deref())
    }

    fn to_svg(&self, width: f64, class: &str) -> String {
        let longest = self.rows.iter().map(|row| row.label.chars().count()).max().unwrap_or(0);
        let left = LETTER_WIDTH * longest as f64 + 14.0;
        let lowest = self.rows.iter().map(|row| row.interval[0].min(row.reference.unwrap_or(100.0)));
        let lowest = lowest.fold(100.0, f64::min);
        let start = STARTS.into_iter().rfind(|start| *start <= lowest).unwrap_or(0.0);
        let right = width - RIGHT;
        let place = |percent: f64| left + (right - left) * (percent.clamp(start, 100.0) - start) / (100.0 - start);
        let bottom = TOP + ROW_HEIGHT * self.rows.len() as f64;

        let mut svg = format!(
            "<svg class=\"{class}\" viewBox=\"0 0 {width} {:.1}\" role=\"img\" aria-label=\"{}\">",
            bottom + BOTTOM,
            escape(&self.description())
        );
        for quarter in 0..=4 {
            let percent = start + (100.0 - start) * f64::from(quarter) / 4.0;
            let x = place(percent);
            let label = format_number(percent, usize::from(percent.fract() != 0.0));
            svg += &format!(
                "<path class=\"grid\" d=\"M{x:.1} {TOP:.1}V{bottom:.1}\"/>\
                 <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}{}</text>",
                bottom + 17.0,
                if quarter == 4 { " %" } else { "" }
            );
        }
        for (at, row) in self.rows.iter().enumerate() {
            let y = TOP + ROW_HEIGHT * (at as f64 + 0.5);
            svg += &format!(
                "<text class=\"name\" x=\"0\" y=\"{:.1}\">{}</text><path class=\"line s3\" d=\"M{:.1} {y:.1}H{:.1}\"/>",
                y + 4.0,
                escape(&row.label),
                place(row.interval[0]),
                place(row.interval[1])
            );
            if let Some(reference) = row.reference {
                let x = place(reference);
                svg += &format!("<circle class=\"hollow\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\"/>");
            }
            svg += &format!(
                "<circle class=\"mark s3\" cx=\"{:.1}\" cy=\"{y:.1}\" r=\"6\"/>\
                 <text class=\"name\" x=\"{width}\" y=\"{:.1}\" text-anchor=\"end\">{} %</text>",
                place(row.percent),
                y + 4.0,
                format_number(row.percent, 1)
            );
        }
        svg + "</svg>"
    }

    /// The fractions in words, for screen readers.
    fn description(&self) -> String {
        let mut text = format!("{}.", self.title);
        for ShareRow { label, percent, interval: [low, high], reference } in &self.rows {
            let [percent, low, high] = [percent, low, high].map(|value| format_number(*value, 1));
            text += &format!(" {label}: {percent} percent, between {low} and {high}");
            if let (Some(reference), Some(name)) = (reference, &self.reference_name) {
                text += &format!("; {name} {}", format_number(*reference, 1));
            }
            text += ".";
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::html_checker::assert_well_formed;

    #[test]
    fn dots_stand_where_their_shares_are() {
        let chart = ShareChart::new("Held").row("C", 75.0, [65.0, 85.0], None);
        let svg = chart.to_svg(720.0, "wide");
        // For one letter: the axis from 50 to 100 % runs from x 20.6 to 656; 75 % is its middle.
        assert!(svg.contains("class=\"mark s3\" cx=\"338.3\""), "{svg}");
        assert!(svg.contains("aria-label=\"Held. C: 75.0 percent, between 65.0 and 85.0.\""), "{svg}");
    }

    #[test]
    fn what_is_not_finite_is_left_out_and_names_are_escaped() {
        let html = ShareChart::new("<Held>")
            .reference_name("<paper>")
            .row("<A>", 97.5, [91.3, 99.3], Some(91.3))
            .row("B", f64::NAN, [0.0, 1.0], None)
            .row("C", 50.0, [0.0, f64::INFINITY], Some(f64::NAN))
            .caption("<c>")
            .to_html();
        assert_well_formed(&html);
        assert_eq!(html.matches("class=\"mark").count(), 3, "one row in three sizes");
        assert_well_formed(&ShareChart::new("none").to_html());
    }
}
