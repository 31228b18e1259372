//! Height of a part from two lines of sight.
//!
//! ```text
//! height = where the lines of sight come nearest     sigma² = (places' sigmas / difference of the slopes)² + relief²
//! ```
//! A slope is the sideways distance of a line of sight per metre downwards: the slopes from two camera positions 0.12 m
//! apart and 0.27 m above the part differ by 0.44. The relief is the height of the visible edges above the marks. It
//! cannot be measured in a picture: walls, feet and rims also produce edges, so that a part appears slightly above or
//! below its marks, by the same distance each time.
//!
//! The sizes in both pictures are used only to match several parts between the pictures, because the errors of a height
//! from sizes are larger (docs/robot-evidence.md).

use super::sighting::Sighting;

/// Minimum sideways distance between the two camera positions, m.
pub const MIN_BASELINE_M: f64 = 0.080;
/// Minimum difference of the slopes of two lines of sight; with less they count as parallel. The value corresponds to
/// 80 mm at 0.8 m.
const MIN_SLOPE_DIFFERENCE: f64 = 0.1;
/// Largest distance between two lines of sight to one part, in standard deviations. At least [`MIN_MISS_ALLOWED_M`] is
/// allowed, the error of a hand-eye calibration.
const MAX_MISS_SIGMAS: f64 = 4.0;
const MIN_MISS_ALLOWED_M: f64 = 0.004;
/// Minimum distance of a part below the cameras, m.
const MIN_DISTANCE_M: f64 = 0.05;

/// Standard deviation of the height of the visible edges above the marks, m: fitted on the twelve shipped parts, which
/// the lines of sight place 3.2 mm below to 3.9 mm above their marks (`heights raw 4 101`).
pub const RELIEF_M: f64 = 2.3e-3;

/// A measured height, z of the base frame: of a part's marks, or of the surface beside the part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredHeight {
    /// Height, m.
    pub height_m: f64,
    /// Standard deviation of the height, m.
    pub sigma_m: f64,
}

/// Largest difference between two measurements of one object, in standard deviations.
const MAX_APART_SIGMAS: f64 = 4.0;

impl MeasuredHeight {
    /// The mean of two independent measurements, each weighted by the inverse of its variance; `None` if they
    /// contradict each other.
    pub fn mean(&self, other: &Self) -> Option<Self> {
        let apart_m = (self.height_m - other.height_m).abs();
        let [own, others] = [self.sigma_m, other.sigma_m].map(|sigma_m| sigma_m.powi(-2));
        (apart_m <= MAX_APART_SIGMAS * self.sigma_m.hypot(other.sigma_m)).then(|| Self {
            height_m: (self.height_m * own + other.height_m * others) / (own + others),
            sigma_m: (own + others).sqrt().recip(),
        })
    }
}

/// The reason why two pictures give no height.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum HeightError {
    /// The camera did not move far enough.
    #[error(
        "expected two pictures from places at least {:.0} mm apart sideways, found {:.1} mm",
        MIN_BASELINE_M * 1e3,
        .apart_m * 1e3
    )]
    SamePlace { apart_m: f64 },
    /// The two lines of sight have nearly the same direction.
    #[error("expected lines of sight whose slopes differ by {MIN_SLOPE_DIFFERENCE} or more, found {difference:.3}")]
    Parallel { difference: f64 },
    /// The lines of sight cross above a camera or too close below it, or the plane of a sighting is too high.
    #[error(
        "expected a part at least {:.0} mm below the camera, which is {:.0} mm high, found lines of sight that cross at {:.0} mm",
        MIN_DISTANCE_M * 1e3,
        .camera_m * 1e3,
        .height_m * 1e3
    )]
    BehindCamera { height_m: f64, camera_m: f64 },
    /// The lines of sight do not cross: they belong to two parts.
    #[error("expected lines of sight that pass each other within {:.1} mm, found {:.1} mm: two parts", .max_m * 1e3, .miss_m * 1e3)]
    OtherPart { miss_m: f64, max_m: f64 },
    /// The lines of sight cross, but not where the part was detected.
    #[error(
        "expected the part where it was detected, found an object {:.0} mm beside it with a score of {score:.2}",
        .beside_m * 1e3
    )]
    Elsewhere { beside_m: f64, score: f64 },
    /// A number that is not finite or not positive.
    #[error("expected finite places and sizes, and sigmas above 0")]
    NotFinite,
}

impl HeightError {
    /// The same error with heights above the table, whose z is `table_height_m`, instead of above the base.
    pub(crate) fn above_table(self, table_height_m: f64) -> Self {
        match self {
            Self::BehindCamera { height_m, camera_m } => {
                Self::BehindCamera { height_m: height_m - table_height_m, camera_m: camera_m - table_height_m }
            }
            error => error,
        }
    }
}

/// Height of the marks of a part from two pictures; `relief_m` is the standard deviation of the height of its visible
/// edges.
///
/// # Errors
/// [`HeightError`] for camera positions that are too close together, for lines of sight that are parallel, cross too
/// high or do not cross, and for invalid numbers.
pub fn triangulate(one: &Sighting, other: &Sighting, relief_m: f64) -> Result<MeasuredHeight, HeightError> {
    let is_sound = |sighting: &Sighting| {
        let finite = sighting.camera_m.iter().chain(sighting.middle_m.iter()).all(|value| value.is_finite());
        let size = sighting.size.is_none_or(|size| size.is_finite() && size > 0.0 && sighting.size_sigma > 0.0);
        finite && size && sighting.place_sigma_m > 0.0 && sighting.place_sigma_m.is_finite()
    };
    if !(is_sound(one) && is_sound(other)) {
        return Err(HeightError::NotFinite);
    }
    let lowest_camera_m = one.camera_m.z.min(other.camera_m.z);
    if let Some(behind) = [one, other].into_iter().find(|sighting| sighting.distance_m() < MIN_DISTANCE_M) {
        return Err(HeightError::BehindCamera { height_m: behind.middle_m.z, camera_m: behind.camera_m.z });
    }
    let apart_m = (one.camera_m - other.camera_m).xy().norm();
    if apart_m < MIN_BASELINE_M {
        return Err(HeightError::SamePlace { apart_m });
    }
    // At a height z, a line of sight is at x and y of a + b z.
    let [b_one, b_other] = [one, other].map(|sighting| -sighting.slope());
    let [a_one, a_other] =
        [(one, b_one), (other, b_other)].map(|(sighting, b)| sighting.middle_m.xy().coords - b * sighting.middle_m.z);
    let (a, b) = (a_one - a_other, b_one - b_other);
    let difference = b.norm();
    if difference < MIN_SLOPE_DIFFERENCE {
        return Err(HeightError::Parallel { difference });
    }
    let crossing_m = -b.dot(&a) / b.norm_squared();
    if crossing_m > lowest_camera_m - MIN_DISTANCE_M {
        return Err(HeightError::BehindCamera { height_m: crossing_m, camera_m: lowest_camera_m });
    }
    let [one, other] = [one, other].map(|sighting| sighting.at_height(crossing_m));
    let apart_sigma_m = one.place_sigma_m.hypot(other.place_sigma_m);
    let miss_m = (a + b * crossing_m).norm();
    let max_m = (MAX_MISS_SIGMAS * apart_sigma_m).max(MIN_MISS_ALLOWED_M);
    if miss_m > max_m {
        return Err(HeightError::OtherPart { miss_m, max_m });
    }
    Ok(MeasuredHeight { height_m: crossing_m, sigma_m: (apart_sigma_m / difference).hypot(relief_m) })
}

/// Height from two pictures that show several parts, in any order, and the pair of sightings that most likely shows one
/// and the same part; `None` if a picture shows nothing.
///
/// `is_near` receives each pair whose lines of sight cross, moved to the height of the crossing. Pairs for which it is
/// true are preferred to all others; a pair for which it is an error is left out.
///
/// # Errors
/// The error of the first pair if no pair gives a height.
pub fn triangulate_nearest(
    ones: &[Sighting],
    others: &[Sighting],
    relief_m: f64,
    is_near: impl Fn(&[Sighting; 2]) -> Result<bool, HeightError>,
) -> Option<Result<(MeasuredHeight, [Sighting; 2]), HeightError>> {
    let mut best: Option<((bool, f64), MeasuredHeight, [Sighting; 2])> = None;
    let mut error = None;
    for one in ones {
        for other in others {
            let ranked = triangulate(one, other, relief_m).and_then(|height| {
                let is_far = !is_near(&[one, other].map(|sighting| sighting.at_height(height.height_m)))?;
                Ok(((is_far, misfit(one, other, &height)), height))
            });
            match ranked {
                Ok((rank, height)) => {
                    if best.as_ref().is_none_or(|(least, ..)| rank < *least) {
                        best = Some((rank, height, [*one, *other]));
                    }
                }
                Err(found) => {
                    error.get_or_insert(found);
                }
            }
        }
    }
    match (best, error) {
        (Some((_, height, pair)), _) => Some(Ok((height, pair))),
        (None, error) => error.map(Err),
    }
}

/// Standard deviation added to each height from a size, m, for walls of unknown height.
const SIZE_LEEWAY_M: f64 = 0.004;

/// Squared misfit of a pair, in variances: the distance between the lines of sight, and the difference between the
/// height from sizes and the height of the crossing.
fn misfit(one: &Sighting, other: &Sighting, height: &MeasuredHeight) -> f64 {
    let [one, other] = [one, other].map(|sighting| sighting.at_height(height.height_m));
    let miss_m = (one.middle_m - other.middle_m).norm();
    let place = (miss_m / one.place_sigma_m.hypot(other.place_sigma_m)).powi(2);
    let sizes = [one, other].into_iter().filter_map(|sighting| {
        let beside_m = sighting.height_by_size_m()? - height.height_m;
        let sigma_m = (sighting.distance_m() * sighting.size_sigma).hypot(SIZE_LEEWAY_M);
        Some((beside_m / sigma_m).powi(2))
    });
    place + sizes.sum::<f64>()
}

#[cfg(test)]
mod tests;
