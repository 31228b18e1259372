//! The constants that are fitted one by one, and the tried values.

use crate::check_config::CheckConfig;

const SHAPE: &str = "crates/shape/src/config.rs";

/// A constant of the code that can be fitted.
pub(super) struct Constant {
    /// The constant's field of [`CheckConfig`].
    pub(super) name: &'static str,
    /// The file that contains the constant's value.
    pub(super) file: &'static str,
    /// The tried values in ascending order, including the present one.
    pub(super) grid: &'static [f64],
    field: fn(&mut CheckConfig) -> Field<'_>,
}

/// A value of a configuration, at its own precision.
enum Field<'a> {
    Double(&'a mut f64),
    Single(&'a mut f32),
    Count(&'a mut usize),
}

impl Constant {
    pub(super) fn get(&self, config: &CheckConfig) -> f64 {
        match (self.field)(&mut config.clone()) {
            Field::Double(value) => *value,
            Field::Single(value) => f64::from(*value),
            Field::Count(value) => *value as f64,
        }
    }

    pub(super) fn set(&self, config: &mut CheckConfig, to: f64) {
        match (self.field)(config) {
            Field::Double(value) => *value = to,
            Field::Single(value) => *value = to as f32,
            Field::Count(value) => *value = to as usize,
        }
    }
}

const fn searched(
    name: &'static str,
    file: &'static str,
    grid: &'static [f64],
    field: fn(&mut CheckConfig) -> Field<'_>,
) -> Constant {
    Constant { name, file, grid, field }
}

/// All constants.
pub(super) const CONSTANTS: &[Constant] = &[
    searched("search.shape.agreement.surface_share", SHAPE, &[0.0, 0.15, 0.3, 0.45, 0.6], |c| {
        Field::Double(&mut c.search.shape.agreement.surface_share)
    }),
    searched("search.shape.agreement.extent", SHAPE, &[32.0, 64.0, 128.0], |c| {
        Field::Double(&mut c.search.shape.agreement.extent)
    }),
    searched("search.shape.refinement.sure_agreement", SHAPE, &[0.55, 0.65, 0.75], |c| {
        Field::Double(&mut c.search.shape.refinement.sure_agreement)
    }),
    searched("search.shape.refinement.min_restart_agreement", SHAPE, &[0.25, 0.33, 0.41], |c| {
        Field::Double(&mut c.search.shape.refinement.min_restart_agreement)
    }),
    searched("search.shape.refinement.restart_px", SHAPE, &[5.0, 10.0, 20.0], |c| {
        Field::Double(&mut c.search.shape.refinement.restart_px)
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
    searched("search.shape.structure.num_regions", SHAPE, &[6.0, 12.0, 24.0], |c| {
        Field::Double(&mut c.search.shape.structure.num_regions)
    }),
    searched("search.shape.structure.visible_from", SHAPE, &[0.2, 0.4, 0.6], |c| {
        Field::Double(&mut c.search.shape.structure.visible_from)
    }),
    searched("search.shape.outline_weight", SHAPE, &[1.0, 2.0, 4.0], |c| {
        Field::Double(&mut c.search.shape.outline_weight)
    }),
];
