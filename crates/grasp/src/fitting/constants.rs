//! The constants that are fitted, and the values that are tried.

use crate::check_config::CheckConfig;

const SHAPE: &str = "crates/shape/src/config.rs";
const CHECK: &str = "crates/grasp/src/check_config.rs";

/// One constant.
pub(super) struct Constant {
    /// Its field of [`CheckConfig`].
    pub(super) name: &'static str,
    /// Where its value stands.
    pub(super) file: &'static str,
    /// Whether pictures are searched again when it changes.
    pub(super) needs_search: bool,
    /// What is tried, upwards; today's value among them.
    pub(super) grid: &'static [f64],
    field: fn(&mut CheckConfig) -> Field<'_>,
}

/// A value in a configuration, in its own precision.
enum Field<'a> {
    Double(&'a mut f64),
    Single(&'a mut f32),
    Count(&'a mut usize),
    /// Least and largest scale of the search, as the ln scale that both are from 1.
    LogRange(&'a mut std::ops::RangeInclusive<f64>),
}

impl Constant {
    pub(super) fn get(&self, config: &CheckConfig) -> f64 {
        match (self.field)(&mut config.clone()) {
            Field::Double(value) => *value,
            Field::Single(value) => f64::from(*value),
            Field::Count(value) => *value as f64,
            Field::LogRange(range) => (range.end().ln() * 1e3).round() / 1e3,
        }
    }

    pub(super) fn set(&self, config: &mut CheckConfig, to: f64) {
        if self.get(config) == to {
            // Exactly what it is: a range need not be symmetric.
            return;
        }
        match (self.field)(config) {
            Field::Double(value) => *value = to,
            Field::Single(value) => *value = to as f32,
            Field::Count(value) => *value = to as usize,
            Field::LogRange(range) => *range = (-to).exp()..=to.exp(),
        }
    }

    /// Sets the value of the grid with the least loss, and returns that loss. Of equal ones the nearest to the present value
    /// stays, so that a constant on which nothing depends is not moved.
    pub(super) fn descend(&self, config: &mut CheckConfig, loss: &mut dyn FnMut(&CheckConfig) -> f64) -> f64 {
        let present = self.get(config);
        let mut values = self.grid.to_vec();
        values.sort_by(|a, b| (a - present).abs().total_cmp(&(b - present).abs()));
        let mut best = (f64::INFINITY, present);
        for value in values {
            let mut tried = config.clone();
            self.set(&mut tried, value);
            if tried.check().is_err() {
                continue;
            }
            let found = loss(&tried);
            if found < best.0 - MIN_GAIN {
                best = (found, value);
            }
        }
        self.set(config, best.1);
        best.0
    }
}

/// Gains below this are rounding.
const MIN_GAIN: f64 = 1e-9;

const fn searched(
    name: &'static str,
    file: &'static str,
    grid: &'static [f64],
    field: fn(&mut CheckConfig) -> Field<'_>,
) -> Constant {
    Constant { name, file, needs_search: true, grid, field }
}

const fn checked(name: &'static str, grid: &'static [f64], field: fn(&mut CheckConfig) -> Field<'_>) -> Constant {
    Constant { name, file: CHECK, needs_search: false, grid, field }
}

/// The threshold's margin above the negatives' mean.
pub(super) const MARGIN: Constant = checked(
    "threshold.above_negatives",
    &[0.05, 0.075, 0.1, 0.125, 0.15, 0.175, 0.2, 0.225, 0.25, 0.275, 0.3, 0.35],
    |c| Field::Double(&mut c.threshold.above_negatives),
);

/// All of them: those that need no search, then those of the search.
pub(super) const CONSTANTS: &[Constant] = &[
    checked("size.free_log", &[0.0, 0.03, 0.06, 0.1, 0.15, 0.25], |c| Field::Double(&mut c.size.free_log)),
    checked("size.cost_per_log", &[0.0, 0.25, 0.5, 1.0, 2.0, 4.0], |c| Field::Double(&mut c.size.cost_per_log)),
    MARGIN,
    checked("threshold.bounds.0", &[0.3, 0.34, 0.38, 0.42, 0.44, 0.46, 0.5], |c| {
        Field::Double(&mut c.threshold.bounds[0])
    }),
    checked("threshold.bounds.1", &[0.48, 0.52, 0.56, 0.6, 0.64, 0.7], |c| Field::Double(&mut c.threshold.bounds[1])),
    checked("threshold.without_negatives", &[0.35, 0.4, 0.45, 0.5, 0.55, 0.6], |c| {
        Field::Double(&mut c.threshold.without_negatives)
    }),
    checked("threshold.slope", &[5.0, 10.0, 15.0, 20.0, 25.0, 35.0, 50.0], |c| Field::Double(&mut c.threshold.slope)),
    searched("search.shape.agreement.surface_share", SHAPE, &[0.0, 0.15, 0.3, 0.45, 0.6], |c| {
        Field::Double(&mut c.search.shape.agreement.surface_share)
    }),
    searched("search.shape.agreement.extent", SHAPE, &[32.0, 64.0, 128.0], |c| {
        Field::Double(&mut c.search.shape.agreement.extent)
    }),
    // The ln of the larger end: today 0.88 to 1.14, then 0.78 to 1.28 and 0.67 to 1.49.
    searched("search.scales", CHECK, &[0.131, 0.25, 0.4], |c| Field::LogRange(&mut c.search.scales)),
    searched("search.shape.settling.sure_agreement", SHAPE, &[0.55, 0.65, 0.75], |c| {
        Field::Double(&mut c.search.shape.settling.sure_agreement)
    }),
    searched("search.shape.settling.min_restart_agreement", SHAPE, &[0.25, 0.33, 0.41], |c| {
        Field::Double(&mut c.search.shape.settling.min_restart_agreement)
    }),
    searched("search.shape.settling.restart_px", SHAPE, &[5.0, 10.0, 20.0], |c| {
        Field::Double(&mut c.search.shape.settling.restart_px)
    }),
    searched("search.shape.surface.cells_share", SHAPE, &[0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0], |c| {
        Field::Double(&mut c.search.shape.surface.cells_share)
    }),
    searched("search.shape.surface.noise_in_cell", SHAPE, &[3.0, 6.0, 12.0], |c| {
        Field::Double(&mut c.search.shape.surface.noise_in_cell)
    }),
    searched("search.shape.gradient.noise_factor", SHAPE, &[1.0, 3.0, 6.0], |c| {
        Field::Single(&mut c.search.shape.gradient.noise_factor)
    }),
    searched("search.num_points", "crates/shape/src/search/mod.rs", &[32.0, 64.0, 128.0], |c| {
        Field::Count(&mut c.search.num_points)
    }),
    searched("search.shape.surface.noise", SHAPE, &[4.0, 8.0, 16.0], |c| {
        Field::Double(&mut c.search.shape.surface.noise)
    }),
    searched("search.shape.gradient.min_gradient", SHAPE, &[0.75, 1.5, 3.0], |c| {
        Field::Single(&mut c.search.shape.gradient.min_gradient)
    }),
    searched("search.shape.surface.num_cells", SHAPE, &[3.0, 6.0, 12.0], |c| {
        Field::Double(&mut c.search.shape.surface.num_cells)
    }),
    searched("search.shape.outline_weight", SHAPE, &[1.0, 2.0, 4.0], |c| {
        Field::Double(&mut c.search.shape.outline_weight)
    }),
];
