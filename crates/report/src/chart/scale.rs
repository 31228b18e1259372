//! Maps data to positions on an axis, and selects the ticks.

/// The scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// Linear.
    #[default]
    Linear,
    /// Logarithmic; values that are not positive are left out.
    Logarithmic,
}

/// An axis with a fixed range.
#[derive(Debug, Clone)]
pub(super) struct FittedScale {
    scale: Scale,
    low: f64,
    high: f64,
    pub(super) ticks: Vec<f64>,
}

impl FittedScale {
    /// Fits the axis to the finite values. With `from_zero`, a linear axis starts at zero unless a value is below zero;
    /// with `tight`, it ends at the values instead of at ticks.
    pub(super) fn fit(scale: Scale, values: impl Iterator<Item = f64>, from_zero: bool, tight: bool) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|&value| is_drawable(scale, value)) {
            low = low.min(value);
            high = high.max(value);
        }
        if low > high {
            (low, high) = match scale {
                Scale::Linear => (0.0, 1.0),
                Scale::Logarithmic => (1.0, 10.0),
            };
        }
        match scale {
            Scale::Linear => Self::linear(low, high, from_zero, tight),
            Scale::Logarithmic => Self::logarithmic(low, high),
        }
    }

    fn linear(mut low: f64, mut high: f64, from_zero: bool, tight: bool) -> Self {
        if from_zero && low > 0.0 {
            low = 0.0;
        }
        // A span that is zero or tiny relative to the values cannot be divided into readable ticks.
        if high - low <= 1e-9 * low.abs().max(high.abs()).max(1e-300) {
            let room = if high == 0.0 { 1.0 } else { 0.5 * high.abs() };
            (low, high) = (low - room, high + room);
        }
        // Divided before the subtraction, because the difference of two huge values may overflow.
        let step = round_step((high / 5.0 - low / 5.0).abs());
        if !step.is_finite() || step <= 0.0 {
            return Self { scale: Scale::Linear, low, high, ticks: Vec::new() };
        }
        if !tight {
            low = (low / step + 1e-9).floor() * step;
            high = (high / step - 1e-9).ceil() * step;
        }
        let first = (low / step - 1e-9).ceil();
        let ticks = (0..20).map(|k| (first + f64::from(k)) * step).take_while(|&t| t <= high + 1e-9 * step).collect();
        Self { scale: Scale::Linear, low, high, ticks }
    }

    fn logarithmic(low: f64, high: f64) -> Self {
        let ratio = high / low;
        let (low, high) = if ratio < 1.0 + 1e-9 { (low / 2.0, high * 2.0) } else { (low, high) };
        // Up to three decades, there are ticks at 1, 2 and 5 of each; with more, at every decade or every few decades.
        let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
        let factors: &[f64] = if last - first <= 3 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let stride = ((last - first) / 6).max(1) as usize;
        let candidates: Vec<f64> = (first..=last)
            .step_by(stride)
            .flat_map(|decade| factors.iter().map(move |factor| factor * 10f64.powi(decade)))
            .collect();
        let low = candidates.iter().copied().filter(|&t| t <= low * (1.0 + 1e-9)).fold(low, |_, t| t);
        let high = candidates.iter().copied().find(|&t| t >= high * (1.0 - 1e-9)).unwrap_or(high);
        let ticks = candidates.into_iter().filter(|&t| t >= low * 0.999 && t <= high * 1.001).collect();
        Self { scale: Scale::Logarithmic, low, high, ticks }
    }

    /// Position of a value, from 0 at the start of the axis to 1 at its end; `None` if the value cannot be drawn.
    pub(super) fn place(&self, value: f64) -> Option<f64> {
        if !is_drawable(self.scale, value) {
            return None;
        }
        let share = match self.scale {
            Scale::Linear => (value / 2.0 - self.low / 2.0) / (self.high / 2.0 - self.low / 2.0),
            Scale::Logarithmic => (value / self.low).ln() / (self.high / self.low).ln(),
        };
        share.is_finite().then_some(share)
    }
}

fn is_drawable(scale: Scale, value: f64) -> bool {
    value.is_finite() && (scale == Scale::Linear || value > 0.0)
}

/// The smallest of 1, 2, 2.5 and 5 times a power of ten that is at least `least`, within 0.1 %.
fn round_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().map(|factor| factor * power).find(|&s| s >= least * 0.999).unwrap_or(power)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use proptest::prelude::*;

    fn linear(values: &[f64], from_zero: bool) -> FittedScale {
        FittedScale::fit(Scale::Linear, values.iter().copied(), from_zero, false)
    }

    #[test]
    fn linear_ticks_are_round_and_span_the_data() {
        let axis = linear(&[0.3, 9.7], true);
        assert_eq!(axis.ticks, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(axis.place(5.0), Some(0.5));
        assert_eq!(linear(&[-3.0, 4.0], true).ticks, [-4.0, -2.0, 0.0, 2.0, 4.0]);
    }

    #[test]
    fn logarithmic_ticks_are_one_two_five_or_decades() {
        let axis = FittedScale::fit(Scale::Logarithmic, [0.8, 30.0].into_iter(), false, false);
        assert_eq!(axis.ticks, [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0]);
        let axis = FittedScale::fit(Scale::Logarithmic, [1e-4, 1e3].into_iter(), false, false);
        assert_eq!(axis.ticks.len(), 8);
        assert!((axis.place(10f64.powf(-0.5)).unwrap() - 0.5).abs() < 1e-12);
        assert_eq!(axis.place(0.0), None);
    }

    #[test]
    fn nothing_one_value_and_not_a_number_still_make_an_axis() {
        for scale in [Scale::Linear, Scale::Logarithmic] {
            for values in [vec![], vec![f64::NAN], vec![3.0], vec![0.0], vec![3.0, 3.0, f64::INFINITY]] {
                let axis = FittedScale::fit(scale, values.iter().copied(), false, false);
                assert!(axis.ticks.len() >= 2, "{scale:?} of {values:?}: {axis:?}");
                assert_eq!(axis.place(f64::NAN), None);
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]
        #[test]
        fn every_value_lies_on_the_axis(
            values in proptest::collection::vec(prop_oneof![-1e300..1e300f64, -5.0..5.0f64, 1e-300..1e-290f64], 1..6),
            from_zero: bool,
            tight: bool,
        ) {
            for scale in [Scale::Linear, Scale::Logarithmic] {
                let axis = FittedScale::fit(scale, values.iter().copied(), from_zero, tight);
                prop_assert!(axis.ticks.len() <= 21);
                for &value in &values {
                    if let Some(place) = axis.place(value) {
                        prop_assert!((-1e-6..=1.0 + 1e-6).contains(&place), "{value} at {place} of {axis:?}");
                    }
                }
            }
        }
    }
}
