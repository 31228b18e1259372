//! Standard errors of a grasp's position and angle.
//!
//! ```text
//! noise  = pixels · pixel · exp(by_disagreement (1 − agreement))
//! walls  = by_slant · mark height · slant (against the photo's)
//! shades = by_height · mark height
//! length = √(noise² + walls² + shades²);  position: length;  angle: length / diagonal of the part
//! ```
//! The noise is that of the picture's edges, in pixels of the picture. The walls are the sides of the part that are
//! visible to a camera beside it but not in the photo. If the height of the compared edges was measured, the walls of the
//! position are its standard deviation · slant. The shades are light and shadow, which cause different edges on
//! a high part in every picture.

use serde::{Deserialize, Serialize};

/// Errors of one standard deviation: the error of a grasp is smaller with a probability of 68 %.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Uncertainty {
    /// Radius around the position in the plane, in metres.
    pub position_m: f64,
    /// Rotation in the plane, in either direction, in radians.
    pub yaw_rad: f64,
}

/// The conditions that determine the errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circumstances {
    /// Size of a pixel of the camera's picture at the part, in metres.
    pub pixel_m: f64,
    /// Difference between the slants of the line of sight in the picture and in the photo, in the part's frame: the
    /// length of the difference of the tangents in x and y.
    pub slant: f64,
    /// Height of the marks above the table, in metres.
    pub mark_height_m: f64,
    /// Standard deviation of the measured height of the compared edges above the marks, in metres; `None` if the height
    /// was not measured.
    pub edge_sigma_m: Option<f64>,
    /// Diagonal of the part's box, in metres.
    pub diagonal_m: f64,
    /// Agreement with the demonstration, from 0 to 1; 0 if it was not computed.
    pub agreement: f64,
}

/// The length from which an error is computed; see the module's formulas.
///
/// The constants were fitted on generated parts, without the shipped ones, by `cargo run --release -p sdg-grasp
/// --example fit_uncertainty -- 160`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorLength {
    /// Error of a pose of full agreement, in pixels.
    pub pixels: f64,
    /// Growth of the noise's logarithm per unit of missing agreement.
    pub by_disagreement: f64,
    /// Error as a fraction of the marks' height times the slant.
    pub by_slant: f64,
    /// Error as a fraction of the marks' height.
    pub by_height: f64,
}

impl ErrorLength {
    /// The error of the position.
    pub const POSITION: Self = Self { pixels: 0.279, by_disagreement: 1.89, by_slant: 0.436, by_height: 0.039 };
    /// The error of the angle, as a length at the distance of the part's diagonal.
    pub const TURN: Self = Self { pixels: 0.133, by_disagreement: 3.85, by_slant: 0.325, by_height: 0.019 };

    /// The length in metres.
    pub fn metres(&self, circumstances: &Circumstances) -> f64 {
        self.metres_with_walls(circumstances, self.by_slant * circumstances.mark_height_m)
    }

    /// The length with this error of the edges' height, in metres.
    fn metres_with_walls(&self, circumstances: &Circumstances, walls_m: f64) -> f64 {
        let Circumstances { pixel_m, slant, mark_height_m, agreement, .. } = *circumstances;
        let noise_m = self.pixels * pixel_m * (self.by_disagreement * (1.0 - agreement)).exp();
        noise_m.hypot(walls_m * slant).hypot(self.by_height * mark_height_m)
    }
}

impl Circumstances {
    /// The expected errors.
    pub fn uncertainty(&self) -> Uncertainty {
        let position = ErrorLength::POSITION;
        let walls_m = self.edge_sigma_m.unwrap_or(position.by_slant * self.mark_height_m);
        Uncertainty {
            position_m: position.metres_with_walls(self, walls_m),
            yaw_rad: ErrorLength::TURN.metres(self) / self.diagonal_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_cause_adds_to_the_errors() {
        let clear = Circumstances {
            pixel_m: 0.001,
            slant: 0.0,
            mark_height_m: 0.0,
            edge_sigma_m: None,
            diagonal_m: 0.1,
            agreement: 1.0,
        };
        let error = |circumstances: Circumstances| circumstances.uncertainty();
        assert!((error(clear).position_m - 0.279e-3).abs() < 1e-12);
        assert!((error(clear).yaw_rad - 1.33e-3).abs() < 1e-12);
        // Half the agreement: e^0.945 times the noise.
        let half = error(Circumstances { agreement: 0.5, ..clear });
        assert!((half.position_m / 0.279e-3 - 0.945f64.exp()).abs() < 1e-9);
        let high = Circumstances { mark_height_m: 0.02, ..clear };
        assert!((error(high).position_m - 0.279e-3f64.hypot(0.78e-3)).abs() < 1e-12);
        let beside = Circumstances { slant: 0.3, ..high };
        assert!(error(beside).position_m > error(high).position_m && error(beside).yaw_rad > error(high).yaw_rad);
        // If the edges' height is known to 1 mm, they displace the position by 0.3 mm, and the angle as before.
        let measured = error(Circumstances { edge_sigma_m: Some(0.001), ..beside });
        assert!((measured.position_m - error(high).position_m.hypot(0.3e-3)).abs() < 1e-12);
        assert_eq!(measured.yaw_rad, error(beside).yaw_rad);
        // A larger part has a smaller error in angle for the same error of its edges.
        let larger = error(Circumstances { diagonal_m: 0.2, ..beside });
        assert!((larger.yaw_rad - 0.5 * error(beside).yaw_rad).abs() < 1e-12);
    }
}
