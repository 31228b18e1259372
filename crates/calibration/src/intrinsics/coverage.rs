//! Finds missing views of a calibration, the most useful first.

use std::fmt;

use nalgebra::Point2;
use sdg_geometry::{Polygon, convex_hull};

use super::bundle::Bundle;

/// A deficiency of the pictures.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Advice {
    /// The board faces the camera in all pictures.
    FaceOn {
        /// The largest tilt so far, in degrees.
        max_tilt_deg: f64,
    },
    /// The board is tilted, but about one axis only.
    OneAxis {
        /// The directions in which the board was not tilted.
        missing: &'static str,
    },
    /// The board is small in all pictures.
    TooFar {
        /// Largest fraction of the picture that the board fills.
        max_share: f64,
    },
    /// A part of the picture without corners, in which the lens is not determined.
    Empty {
        /// The part of the picture, as part of a sentence.
        part: &'static str,
    },
    /// There are few pictures.
    Few {
        /// Number of used pictures.
        found: usize,
    },
}

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FaceOn { max_tilt_deg } => write!(
                f,
                "all pictures show the board nearly face-on (at most {max_tilt_deg:.0} degrees): tilt it by 20 to 40 degrees"
            ),
            Self::OneAxis { missing } => {
                write!(f, "no picture shows the board tilted {missing}: tilt it that way by 20 to 40 degrees")
            }
            Self::TooFar { max_share } => {
                write!(
                    f,
                    "the board fills at most {:.0} % of the picture: move it nearer, to 30 % or more",
                    100.0 * max_share
                )
            }
            Self::Empty { part } => write!(f, "no picture shows the board {part} of the picture: hold it there"),
            Self::Few { found } => write!(f, "{found} pictures are few: 10 to 20 reduce the noise further"),
        }
    }
}

/// Minimum tilt of a board that is not face-on, in degrees.
const MIN_TILT_DEG: f64 = 15.0;
/// Minimum range of tilts about an axis, in degrees.
const MIN_SPREAD_DEG: f64 = 15.0;
/// Minimum fraction of the picture that the largest board fills.
const MIN_SHARE: f64 = 0.12;
const MIN_PICTURES: usize = 8;
/// The parts of the picture, three by three.
const PARTS: [[&str; 3]; 3] = [
    ["in the upper left corner", "at the upper border", "in the upper right corner"],
    ["at the left border", "in the middle", "at the right border"],
    ["in the lower left corner", "at the lower border", "in the lower right corner"],
];

/// The deficiencies, the most useful to correct first: without tilts the focal length is undetermined, and without
/// corners in all parts of the picture the lens is.
pub(super) fn advice(bundle: &Bundle<'_>, used: &[usize]) -> Vec<Advice> {
    let mut advice = Vec::new();
    let normals = bundle.normals();
    // The direction towards the camera is -z.
    let max_tilt = normals.iter().map(|normal| (-normal.z).clamp(-1.0, 1.0).acos()).fold(0.0, f64::max).to_degrees();
    let spread = |component: usize| {
        let angles = || normals.iter().map(|normal| normal[component].atan2(-normal.z).to_degrees());
        angles().fold(f64::NEG_INFINITY, f64::max) - angles().fold(f64::INFINITY, f64::min)
    };
    if max_tilt < MIN_TILT_DEG {
        advice.push(Advice::FaceOn { max_tilt_deg: max_tilt });
    } else if spread(0) < MIN_SPREAD_DEG {
        advice.push(Advice::OneAxis { missing: "to the left and to the right" });
    } else if spread(1) < MIN_SPREAD_DEG {
        advice.push(Advice::OneAxis { missing: "upwards and downwards" });
    }
    let (width, height) = (f64::from(bundle.camera.width), f64::from(bundle.camera.height));
    let shares = bundle.views.iter().map(|corners| {
        let places: Vec<Point2<f64>> = corners.iter().map(|seen| seen.pixel).collect();
        hull_area(places) / (width * height)
    });
    let max_share = shares.fold(0.0, f64::max);
    if max_share < MIN_SHARE {
        advice.push(Advice::TooFar { max_share });
    }
    let mut is_seen = [[false; 3]; 3];
    for seen in bundle.views.iter().flatten() {
        let [column, row] =
            [seen.pixel.x / width, seen.pixel.y / height].map(|share| (3.0 * share).clamp(0.0, 2.0) as usize);
        is_seen[row][column] = true;
    }
    // The picture's corners come first, because the lens's distortion is largest in them.
    for [row, column] in [[0, 0], [0, 2], [2, 0], [2, 2], [0, 1], [1, 0], [1, 2], [2, 1], [1, 1]] {
        if !is_seen[row][column] {
            advice.push(Advice::Empty { part: PARTS[row][column] });
        }
    }
    if used.len() < MIN_PICTURES {
        advice.push(Advice::Few { found: used.len() });
    }
    advice
}

/// The area of the convex hull.
fn hull_area(points: Vec<Point2<f64>>) -> f64 {
    Polygon { vertices: convex_hull(points) }.area()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_square_with_points_inside_is_the_square() {
        let points = [[0.0, 0.0], [2.0, 0.0], [1.0, 1.0], [2.0, 2.0], [0.0, 2.0], [1.0, 0.0]].map(Point2::from);
        assert!((hull_area(points.to_vec()) - 4.0).abs() < 1e-12);
    }
}
