//! Plots: the data of line charts in this file; their drawing, matrices of counts and charts of fractions in
//! submodules.

mod frame;
mod matrix;
mod scale;
mod shares;
mod svg;

pub use matrix::Matrix;
pub use scale::Scale;
pub use shares::ShareChart;

/// An axis: its quantity, unit and scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub(crate) label: String,
    pub(crate) unit: Option<String>,
    pub(crate) scale: Scale,
    pub(crate) from_zero: bool,
}

impl Axis {
    /// A linear axis without unit.
    #[must_use]
    pub fn new(label: impl Into<String>) -> Self {
        Self { label: label.into(), unit: None, scale: Scale::Linear, from_zero: false }
    }

    /// Sets the unit, such as `mm`.
    #[must_use]
    pub fn unit(mut self, unit: impl Into<String>) -> Self {
        self.unit = Some(unit.into());
        self
    }

    /// Makes the scale logarithmic, for errors that decrease by orders of magnitude.
    #[must_use]
    pub fn logarithmic(mut self) -> Self {
        self.scale = Scale::Logarithmic;
        self
    }

    /// Starts a linear axis at zero, unless a value is below zero.
    #[must_use]
    pub fn from_zero(mut self) -> Self {
        self.from_zero = true;
        self
    }

    fn title(&self) -> String {
        match &self.unit {
            Some(unit) => format!("{} ({unit})", self.label),
            None => self.label.clone(),
        }
    }
}

/// A named curve. Points that are not finite leave a gap.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub(crate) name: String,
    pub(crate) points: Vec<(f64, f64)>,
    pub(crate) noisy: bool,
    pub(crate) markers: bool,
}

impl Series {
    /// A curve through points (x, y), in the given order.
    #[must_use]
    pub fn new(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, noisy: false, markers: false }
    }

    /// Draws the curve faintly, with a running mean on top: for the loss of each step.
    #[must_use]
    pub fn noisy(mut self) -> Self {
        self.noisy = true;
        self
    }

    /// Draws a dot at each point: for few measurements.
    #[must_use]
    pub fn with_markers(mut self) -> Self {
        self.markers = true;
        self
    }

    /// A centred running mean over about a twentieth of the curve; gaps are kept.
    fn smoothed(&self) -> Vec<(f64, f64)> {
        let reach = (self.points.len() / 40).max(1);
        (0..self.points.len())
            .map(|at| {
                let (x, y) = self.points[at];
                if !y.is_finite() {
                    return (x, y);
                }
                // Towards the ends, the window becomes narrower on both sides; otherwise the mean would be biased
                // inwards.
                let reach = reach.min(at).min(self.points.len() - 1 - at);
                let window = &self.points[at - reach..=at + reach];
                let (sum, count) = window
                    .iter()
                    .filter(|(_, y)| y.is_finite())
                    .fold((0.0, 0.0), |(sum, count), (_, y)| (sum + y, count + 1.0));
                (x, sum / count)
            })
            .collect()
    }
}

/// Curves with common axes, with an optional limit and an optional moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    pub(crate) title: String,
    pub(crate) caption: Option<String>,
    pub(crate) x_axis: Axis,
    pub(crate) y_axis: Axis,
    pub(crate) series: Vec<Series>,
    pub(crate) limit: Option<(f64, String)>,
    pub(crate) moment: Option<(f64, String)>,
}

impl Chart {
    /// An empty chart.
    #[must_use]
    pub fn new(title: impl Into<String>, x_axis: Axis, y_axis: Axis) -> Self {
        Self { title: title.into(), caption: None, x_axis, y_axis, series: Vec::new(), limit: None, moment: None }
    }

    /// Adds a curve. There are four colours; a chart with more curves should be divided.
    #[must_use]
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Draws a horizontal line at a value, such as the largest error with which a grasp succeeds.
    #[must_use]
    pub fn limit(mut self, y: f64, label: impl Into<String>) -> Self {
        self.limit = Some((y, label.into()));
        self
    }

    /// Draws a vertical line at a moment, such as the checkpoint that was kept.
    #[must_use]
    pub fn moment(mut self, x: f64, label: impl Into<String>) -> Self {
        self.moment = Some((x, label.into()));
        self
    }

    /// Sets the text below the chart.
    #[must_use]
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = Some(caption.into());
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_running_mean_keeps_a_straight_line_and_its_gaps() {
        let mut points: Vec<(f64, f64)> = (0..200).map(|k| (f64::from(k), 2.0 * f64::from(k))).collect();
        points[50].1 = f64::NAN;
        let smoothed = Series::new("line", points).smoothed();
        assert!(smoothed[50].1.is_nan());
        for &at in &[0, 1, 20, 100, 199] {
            assert!((smoothed[at].1 - 2.0 * at as f64).abs() < 1e-9, "{at}: {}", smoothed[at].1);
        }
    }
}
