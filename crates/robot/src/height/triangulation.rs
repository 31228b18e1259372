//! Two lines of sight to one part, and the sizes that both pictures show it in, give its height.
//!
//! Legend: `z` the height of the marks, `d` how far below them the edges lie by which a picture places the part, `D` a camera's distance to the
//! plane of the marks, `D_photo` that of the photo.
//! ```text
//! crossing of the lines of sight:           z − d                    ± place sigmas / baseline · D
//! height at which a picture has the size:   z − d (1 − D / D_photo)  ± D · size sigma
//! known of d beforehand:                    d = share · mark height  ± spread
//! ```
//! From where the photo was taken the size shows no `d`, for the photo shows the same edges in the same size. The three are solved by least squares.

use nalgebra::{Matrix2, Vector2};

use super::sighting::Sighting;

/// The camera has to move so far sideways at least, m.
pub const MIN_BASELINE_M: f64 = 0.080;
/// Lines of sight whose slopes differ by less are as good as parallel: 80 mm at 0.8 m.
const MIN_SLOPE_DIFFERENCE: f64 = 0.1;
/// Lines of sight to one part pass each other within so many standard deviations, and within so much, m: hands and eyes are not calibrated better.
const MAX_MISS_SIGMAS: f64 = 4.0;
const MIN_MISS_ALLOWED_M: f64 = 0.004;
/// A part lies at least so far below the cameras, m.
const MIN_DISTANCE_M: f64 = 0.05;

/// How deep below its marks a part is seen: walls, feet and rims are edges, too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relief {
    /// Depth to expect, m.
    pub depth_m: f64,
    /// Its standard deviation, m.
    pub sigma_m: f64,
    /// Distance of the photo's camera to the plane of the marks, m; `None` where it is not known, and sizes say nothing.
    pub photo_distance_m: Option<f64>,
}

impl Relief {
    /// That of a part without walls.
    pub const NONE: Self = Self { depth_m: 0.0, sigma_m: 0.0, photo_distance_m: None };

    /// For marks so high over what the part lies on, m.
    pub fn of_marks(mark_height_m: f64) -> Self {
        Self { depth_m: DEPTH_SHARE * mark_height_m, sigma_m: DEPTH_SPREAD * mark_height_m, photo_distance_m: None }
    }
}

/// Shares of the height of the marks.
const DEPTH_SHARE: f64 = 0.0;
const DEPTH_SPREAD: f64 = 0.1;

/// The height of a part's marks, z of the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredHeight {
    /// Height, m.
    pub height_m: f64,
    /// Its standard deviation, m.
    pub sigma_m: f64,
}

/// Why two pictures give no height.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum HeightError {
    /// The camera did not move far enough.
    #[error(
        "expected two pictures from places at least {:.0} mm apart sideways, found {:.1} mm",
        MIN_BASELINE_M * 1e3,
        .apart_m * 1e3
    )]
    SamePlace { apart_m: f64 },
    /// Both lines of sight have nearly the same direction.
    #[error("expected lines of sight whose slopes differ by {MIN_SLOPE_DIFFERENCE} or more, found {difference:.3}")]
    Parallel { difference: f64 },
    /// They cross above a camera, or right below it.
    #[error(
        "expected a part at least {:.0} mm below the camera, which is {:.0} mm high, found lines of sight that cross at {:.0} mm",
        MIN_DISTANCE_M * 1e3,
        .camera_m * 1e3,
        .height_m * 1e3
    )]
    BehindCamera { height_m: f64, camera_m: f64 },
    /// They do not cross: two parts.
    #[error("expected lines of sight that pass each other within {:.1} mm, found {:.1} mm: two parts", .max_m * 1e3, .miss_m * 1e3)]
    OtherPart { miss_m: f64, max_m: f64 },
    /// A number that is none.
    #[error("expected finite places and sizes, and sigmas above 0")]
    NotFinite,
}

/// Height of the marks of a part that two pictures show.
///
/// # Errors
/// [`HeightError`]: pictures from one place, lines of sight that are parallel, cross above a camera or pass each other.
pub fn triangulate(one: &Sighting, other: &Sighting, relief: &Relief) -> Result<MeasuredHeight, HeightError> {
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
    // A line of sight is at a + b z for a height z.
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
    let mut rows = vec![Row { of_depth: -1.0, height_m: crossing_m, sigma_m: apart_sigma_m / difference }];
    if let Some(photo_m) = relief.photo_distance_m {
        rows.extend([one, other].iter().filter_map(|sighting| {
            let distance_m = sighting.distance_m();
            Some(Row {
                of_depth: distance_m / photo_m - 1.0,
                height_m: sighting.height_by_size_m()?,
                sigma_m: distance_m * sighting.size_sigma,
            })
        }));
    }
    Ok(solve(&rows, relief))
}

/// A measurement `height = z + of_depth · d ± sigma`.
struct Row {
    of_depth: f64,
    height_m: f64,
    sigma_m: f64,
}

/// Least squares for `z` and `d`.
fn solve(rows: &[Row], relief: &Relief) -> MeasuredHeight {
    // A depth that is known exactly is one that is known to a nanometre.
    let weight_of_depth = 1.0 / relief.sigma_m.max(1e-9).powi(2);
    let mut normal = Matrix2::new(0.0, 0.0, 0.0, weight_of_depth);
    let mut right = Vector2::new(0.0, weight_of_depth * relief.depth_m);
    for Row { of_depth, height_m, sigma_m } in rows {
        let weight = 1.0 / sigma_m.powi(2);
        let by = Vector2::new(1.0, *of_depth);
        normal += by * by.transpose() * weight;
        right += by * (*height_m * weight);
    }
    let determinant = normal.determinant();
    let height_m = (normal[(1, 1)] * right[0] - normal[(0, 1)] * right[1]) / determinant;
    MeasuredHeight { height_m, sigma_m: (normal[(1, 1)] / determinant).sqrt() }
}

/// The same where each picture shows several parts: of all pairs the one that is most likely one part. Their order says nothing.
///
/// # Errors
/// That of the best pair where none gives a height.
pub fn triangulate_nearest(
    ones: &[Sighting],
    others: &[Sighting],
    relief: &Relief,
) -> Option<Result<(MeasuredHeight, [Sighting; 2]), HeightError>> {
    let mut best: Option<(f64, MeasuredHeight, [Sighting; 2])> = None;
    let mut error = None;
    for one in ones {
        for other in others {
            match triangulate(one, other, relief) {
                Ok(height) => {
                    let misfit = misfit(one, other, &height, relief);
                    if best.as_ref().is_none_or(|(least, ..)| misfit < *least) {
                        best = Some((misfit, height, [*one, *other]));
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

/// Standard deviation that is added to each height by size, m: what it does not know of walls.
const SIZE_LEEWAY_M: f64 = 0.004;

/// By how many variances a pair contradicts itself: in the miss of the lines of sight, and where sizes say another height than their crossing.
fn misfit(one: &Sighting, other: &Sighting, height: &MeasuredHeight, relief: &Relief) -> f64 {
    let [one, other] = [one, other].map(|sighting| sighting.at_height(height.height_m));
    let miss_m = (one.middle_m - other.middle_m).norm();
    let place = (miss_m / one.place_sigma_m.hypot(other.place_sigma_m)).powi(2);
    let sizes = [one, other].into_iter().filter_map(|sighting| {
        let beside_m = sighting.height_by_size_m()? - height.height_m;
        let sigma_m = (sighting.distance_m() * sighting.size_sigma).hypot(SIZE_LEEWAY_M).hypot(relief.sigma_m);
        Some((beside_m / sigma_m).powi(2))
    });
    place + sizes.sum::<f64>()
}

#[cfg(test)]
mod tests;
