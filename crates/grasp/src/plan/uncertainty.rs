//! How far a grasp may lie beside the truth: what is known of it before the truth is.
//!
//! ```text
//! noise  = pixel · exp(BY_DISAGREEMENT (1 − agreement))          walls = mark height · slant
//! place  = √((POSITION_PX noise)² + (POSITION_BY_WALLS walls)²)
//! turn   = √((YAW_PX noise)² + (YAW_BY_WALLS walls)²) / diagonal
//! ```
//! The noise is that of the picture's edges, counted in its pixels; the walls are what a camera beside the part sees of it and
//! the photo did not show. The constants were fitted on generated parts by `cargo run --release -p sdg-grasp --example
//! fit_uncertainty`.

use serde::{Deserialize, Serialize};

/// Within which a grasp lies with a probability of 68 %, as errors of one standard deviation do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Uncertainty {
    /// Radius around the position in the plane, in metres.
    pub position_m: f64,
    /// Turn to either side.
    pub yaw_rad: f64,
}

/// What the errors depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circumstances {
    /// What a pixel of the camera's picture covers at the part, in metres.
    pub pixel_m: f64,
    /// Tangent of the angle between the line of sight to the part and the vertical.
    pub slant: f64,
    /// Height of the marks over the table, in metres.
    pub mark_height_m: f64,
    /// Diagonal of the part's box, in metres.
    pub diagonal_m: f64,
    /// Agreement with the demonstration, from 0 to 1; 0 where it was not asked.
    pub agreement: f64,
    /// Share of the part's outline that agrees, from 0 to 1.
    pub visible: f64,
}

/// The constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UncertaintyConfig {
    /// Position, in pixels at full agreement.
    pub position_px: f64,
    /// How the logarithm of the error grows with what the agreement lacks.
    pub by_disagreement: f64,
    /// Position, of the height times the slant.
    pub position_by_walls: f64,
    /// Turn, in pixels over the diagonal.
    pub yaw_px: f64,
    /// Turn, of the height times the slant over the diagonal.
    pub yaw_by_walls: f64,
}

impl Default for UncertaintyConfig {
    fn default() -> Self {
        Self { position_px: 0.3, by_disagreement: 2.0, position_by_walls: 0.2, yaw_px: 0.6, yaw_by_walls: 0.2 }
    }
}

impl Circumstances {
    /// The errors to expect.
    pub fn uncertainty(&self, config: &UncertaintyConfig) -> Uncertainty {
        let Self { pixel_m, slant, mark_height_m, diagonal_m, agreement, .. } = *self;
        let noise_m = pixel_m * (config.by_disagreement * (1.0 - agreement)).exp();
        let walls_m = mark_height_m * slant;
        Uncertainty {
            position_m: (config.position_px * noise_m).hypot(config.position_by_walls * walls_m),
            yaw_rad: (config.yaw_px * noise_m).hypot(config.yaw_by_walls * walls_m) / diagonal_m,
        }
    }
}
