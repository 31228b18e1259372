//! Detection with a slanted camera without calibration: the picture is rectified to a level view and searched, and the
//! detections are mapped back.
//!
//! ```text
//! level search ─ best places ─ their shortening ─ slant ─ rectified picture ─ search ─ better? ─ transformed back
//! ```
//! A place is a placed demonstration of the level search. All parts lie on one plane, so that a few sure places
//! determine the slant for all. A single shortened part does not show which of its sides is farther from the camera; of
//! the two possible slants, the one with the better agreement of the rectified place with the photo is used.

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_geometry::{Angle, PlanarGrasp, PlanarSimilarity, Polygon, Slant};
use sdg_shape::{PlanViewMap, parallel};

use crate::detection::{Found, GraspDetection};
use crate::facts::TurnSource;
use crate::same_part::are_outlines_of_same_part;
use crate::sighting::Sighting;
use crate::verification::{SearchedImage, Shot, agreement_in, foreshortening, usual_focal_px};

/// Maximum number of places used, best first. Chosen by hand to save time.
const NUM_SLANT_PLACES: usize = 4;
/// Minimum agreement of a used place. Chosen by hand to save time.
const MIN_AGREEMENT: f64 = 0.25;
/// Minimum fraction of a place's edge points on crests of the gradient; a place below it carries no information. Chosen
/// by hand.
const MIN_CONSENSUS: f64 = 0.3;
/// Standard deviation of a place's ln shortening about that of the slant. Chosen by hand.
const SHORTENING_NOISE: f64 = 0.12;
/// Minimum tilt in radians: a smaller one shortens by less than 3 % and is ignored.
const MIN_TILT: f64 = 0.24;
/// Minimum decrease of the cost from a level camera to a slant: a smaller decrease is noise of the fits. Chosen by hand
/// to save time, because the agreement of the places is checked afterwards.
const MIN_EXPLAINED: f64 = 0.1;
/// Minimum gain of agreement over the level view: first of the place with the largest gain, then of the sum over the
/// accepted detections. The largest gain of a place is 0.07 to 0.16 for a camera slanted by 30°, and at most 0.02 for a
/// level camera (tuned sets of datasets/split.toml).
const SLANT_GAIN: f64 = 0.03;
/// Minimum number of places on different parts for three unknowns: the tilt, its direction and the focal length. Each
/// place gives two equations.
const SURE_PLACES: usize = 3;
/// Further focal lengths, relative to the usual one; they are used if they make a slant certain ([`UNEXPLAINED`]). The
/// fields of view are 70°, as in most telephones, and 25°.
const OTHER_LENSES: [f64; 2] = [0.65, 2.0];
/// A slant is certain if its cost is at most this fraction of the level camera's cost. With three or more places the
/// fraction is 0.004 to 0.05 for the photographed clips at 20°, and at least 0.26 for a level camera (tuned sets).
const UNEXPLAINED: f64 = 0.12;
/// Minimum score in the rectified picture if nothing is accepted in the picture itself: the rectification can also make
/// another part, mainly a longer one, similar to the photo. Without this minimum, 7 instead of 3 of the tuned sets' 58
/// pictures without the part would have a false alarm.
const SURE: f64 = 0.9;
/// Maximum distance of the level picture's border from the mapped centre of the picture, in widths and heights of the
/// picture.
const MAX_REACH: f64 = 0.75;
/// Margin of the rectified area around a place, relative to the longer side of the place's box.
const MARGIN: f64 = 0.2;

/// Whether the accepted detections in the rectified picture agree clearly better, in sum, than those in the picture
/// itself; each list has a part at most once. Scores cannot decide this: a slightly wrong pose scores as high as the
/// right one.
pub(crate) fn explains_more(slanted: &[&GraspDetection], level: &[&GraspDetection]) -> bool {
    fn accepted<'a>(found: &[&'a GraspDetection]) -> impl Iterator<Item = &'a GraspDetection> {
        found.iter().copied().filter(|detection| detection.is_accepted())
    }
    let worth = |found: &[&GraspDetection]| accepted(found).filter_map(|detection| detection.agreement).sum::<f64>();
    let is_sure = accepted(level).next().is_some() || accepted(slanted).any(|detection| detection.score >= SURE);
    is_sure && worth(slanted) > worth(level) + SLANT_GAIN
}

/// A shortened place: the position relative to the picture's centre, half of the longer side of its box, the shortening
/// as a vector that a rotation by 180° does not change, and a weight. The weight is the excess of the fraction of edge
/// points on crests over [`MIN_CONSENSUS`].
struct Shortened {
    at: Vector2<f64>,
    reach: f64,
    shortening: Vector2<f64>,
    weight: f64,
}

fn shortening_vector(log_ratio: f64, direction: Angle) -> Vector2<f64> {
    let (sin, cos) = (2.0 * direction.radians()).sin_cos();
    log_ratio * Vector2::new(cos, sin)
}

/// The slant at which the best places would look as in the photo; `None` if the camera may be level. `shot` assumes a
/// level camera.
pub(crate) fn suggested_slant(
    picture: &RgbImage,
    shot: &Shot,
    sightings: &[Sighting<'_>],
    searched: &SearchedImage<'_>,
) -> Option<Slant> {
    let best = best_places(sightings);
    let shortened = parallel::map(&best, |sighting| {
        let fit = foreshortening(searched, &sighting.placed)?;
        let bounds = sighting.placed.outline().bounds();
        Some(Shortened {
            at: bounds.center() - shot.below_camera,
            reach: 0.5 * bounds.width().max(bounds.height()),
            shortening: shortening_vector(fit.log_ratio, fit.direction),
            weight: (fit.consensus - MIN_CONSENSUS).max(0.0),
        })
    });
    let shortened: Vec<Shortened> = shortened.into_iter().flatten().collect();
    let level_cost = cost(&Slant::level(usual_focal_px(shot.size)), &shortened)?;
    if level_cost < MIN_EXPLAINED {
        // Costs are at least 0, so that no slant decreases the cost by `MIN_EXPLAINED`.
        return None;
    }
    let usual_px = usual_focal_px(shot.size);
    let mut candidates = likely_slants(usual_px, &shortened, level_cost - MIN_EXPLAINED);
    let is_sure = num_parts(&shortened) >= SURE_PLACES;
    if is_sure {
        let other = |lens| likely_slants(lens * usual_px, &shortened, UNEXPLAINED * level_cost);
        candidates.extend(OTHER_LENSES.into_iter().flat_map(other));
    }
    let least_cost = candidates.iter().map(|(cost, _)| *cost).min_by(f64::total_cmp)?;
    // Rectifying a few places is fast, rectifying the whole picture is not.
    let gains = |slant: &Slant| -> Vec<f64> {
        let gains = best.iter().filter_map(|sighting| {
            let placed = &sighting.placed;
            let window = LevelImage::about(picture, shot, slant, &placed.outline().vertices)?;
            let seen = agreement_in(searched, placed, &window.image, |point| window.level_point(point))?;
            Some(seen - placed.agreement)
        });
        gains.collect()
    };
    let best_gain = |gains: &[f64]| gains.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // A place that lost agreement may show another object.
    let worth = |gains: &[f64]| match is_sure {
        true => gains.iter().map(|gain| gain.max(0.0)).sum(),
        false => best_gain(gains),
    };
    let (gains, slant) = candidates
        .into_iter()
        .map(|(_, slant)| (gains(&slant), slant))
        .max_by(|(a, _), (b, _)| worth(a).total_cmp(&worth(b)))?;
    let required = if is_sure { required_gain(level_cost, least_cost) } else { SLANT_GAIN };
    (best_gain(&gains) >= required).then_some(slant)
}

/// The sightings of best agreement. Of a part found more than once (by network and search, with two photos, or at two
/// sizes), only the best one: it takes one place, so that other parts also count. Matches of one search are apart.
fn best_places<'s, 'a>(sightings: &'s [Sighting<'a>]) -> Vec<&'s Sighting<'a>> {
    let search = |sighting: &Sighting<'_>| {
        let is_searched = sighting.turn_source == TurnSource::Search;
        is_searched.then_some((sighting.placed.demonstration_idx, sighting.placed.range_idx))
    };
    let is_same = |one: &Sighting<'_>, other: &Sighting<'_>| {
        !(search(one).is_some() && search(one) == search(other))
            && are_outlines_of_same_part(&one.placed.outline(), &other.placed.outline())
    };
    let mut likely: Vec<_> = sightings.iter().filter(|sighting| sighting.placed.agreement >= MIN_AGREEMENT).collect();
    likely.sort_by(|a, b| b.placed.agreement.total_cmp(&a.placed.agreement));
    let mut best: Vec<&Sighting<'_>> = Vec::with_capacity(NUM_SLANT_PLACES);
    for sighting in likely {
        if best.len() < NUM_SLANT_PLACES && !best.iter().any(|better| is_same(better, sighting)) {
            best.push(sighting);
        }
    }
    best
}

/// Number of places with different parts. Searches with two photos or for two sizes can find the same part at slightly
/// different poses, which are no independent evidence.
fn num_parts(places: &[Shortened]) -> usize {
    let is_first = |(idx, place): &(usize, &Shortened)| {
        places[..*idx].iter().all(|other| (place.at - other.at).norm() > place.reach.max(other.reach))
    };
    places.iter().enumerate().filter(is_first).count()
}

/// The slant with the least cost, and the likeliest slant towards the opposite side, each with its cost; empty if the
/// least cost exceeds `most` or the tilt is too small.
fn likely_slants(focal_px: f64, shortened: &[Shortened], most: f64) -> Vec<(f64, Slant)> {
    let costs: Vec<(f64, Slant)> =
        slants(focal_px).filter_map(|slant| Some((cost(&slant, shortened)?, slant))).collect();
    let least = |all: &mut dyn Iterator<Item = &(f64, Slant)>| all.min_by(|a, b| a.0.total_cmp(&b.0)).copied();
    let Some(likeliest) = least(&mut costs.iter()) else { return Vec::new() };
    if likeliest.1.tilt_rad < MIN_TILT || likeliest.0 > most {
        return Vec::new();
    }
    let is_opposite =
        |slant: &Slant| slant.tilt_rad >= MIN_TILT && slant.away.distance(likeliest.1.away).to_degrees() > 90.0;
    let opposite = least(&mut costs.iter().filter(|(_, slant)| is_opposite(slant)));
    std::iter::once(likeliest).chain(opposite).collect()
}

/// The minimum gain of agreement of the best place for a slant, if there are enough places. No gain is required if the
/// slant is certain, because the places with the best agreement are the least shortened ones and gain little.
fn required_gain(level_cost: f64, least_cost: f64) -> f64 {
    if least_cost <= UNEXPLAINED * level_cost { 0.0 } else { SLANT_GAIN }
}

/// All tried slants: tilts up to 50° in steps of 2°, directions in steps of 10°.
fn slants(focal_px: f64) -> impl Iterator<Item = Slant> {
    (0..=25).flat_map(move |tilt| {
        (0..if tilt == 0 { 1 } else { 36 }).map(move |direction| Slant {
            tilt_rad: f64::from(2 * tilt).to_radians(),
            away: Angle::from_degrees(f64::from(10 * direction)),
            focal_px,
        })
    })
}

/// The residual of a slant for the shortened places; the contribution of each place is bounded.
fn cost(slant: &Slant, shortened: &[Shortened]) -> Option<f64> {
    let terms = shortened.iter().map(|place| {
        let (log_ratio, direction) = slant.shortening_at(place.at)?;
        let off = (place.shortening - shortening_vector(log_ratio, direction)).norm() / SHORTENING_NOISE;
        Some(place.weight * (off * off).min(1.0))
    });
    terms.sum()
}

/// The picture that a camera vertically above the table would have taken.
pub(crate) struct LevelImage {
    pub(crate) image: RgbImage,
    slant: Slant,
    /// Width and height of the picture, which may be a window of a larger one.
    size: [u32; 2],
    /// The shot of the picture, computed as for a level camera.
    taken: Shot,
    /// The position of the centre of the camera's picture, in pixels of the level picture.
    middle: Vector2<f64>,
}

impl LevelImage {
    /// `None` if the picture shows the horizon.
    pub(crate) fn new(picture: &RgbImage, taken: &Shot, slant: &Slant) -> Option<Self> {
        let (width, height) = picture.dimensions();
        let (width, height) = (f64::from(width), f64::from(height));
        let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]].map(Point2::from);
        let bounds = level_bounds(taken, slant, &corners)?;
        let reach = MAX_REACH * Vector2::from(taken.size.map(f64::from));
        Some(Self::of(picture, taken, slant, [bounds[0].sup(&-reach), bounds[1].inf(&reach)]))
    }

    /// The level image of the area around some points of the picture; `None` if a point is near the horizon or beyond.
    pub(crate) fn about(picture: &RgbImage, taken: &Shot, slant: &Slant, points: &[Point2<f64>]) -> Option<Self> {
        let [least, largest] = level_bounds(taken, slant, points)?;
        let margin = Vector2::repeat(MARGIN * (largest - least).amax());
        Some(Self::of(picture, taken, slant, [least - margin, largest + margin]))
    }

    fn of(picture: &RgbImage, taken: &Shot, slant: &Slant, [least, largest]: [Vector2<f64>; 2]) -> Self {
        let size = [picture.width(), picture.height()];
        let level_size = [largest.x - least.x, largest.y - least.y].map(|side| side.ceil().max(1.0) as u32);
        let made = Self { image: RgbImage::default(), slant: *slant, size, taken: *taken, middle: -least };
        let image = PlanViewMap::of(level_size, |level| made.point(&level)).resample(picture);
        Self { image, ..made }
    }

    /// The position of a point of the picture in the level image.
    pub(crate) fn level_point(&self, seen: &Point2<f64>) -> Option<Point2<f64>> {
        let level = self.slant.level_from_picture(seen - self.taken.below_camera)?;
        Some(Point2::from(level + self.middle))
    }

    pub(crate) fn shot(&self) -> Shot {
        Shot {
            size: self.taken.size,
            below_camera: self.slant.below_camera() + self.middle,
            camera_height_px: self.slant.camera_height_px(),
        }
    }

    fn point(&self, level: &Point2<f64>) -> Option<Point2<f64>> {
        let seen = self.slant.picture_from_level(level.coords - self.middle)?;
        Some(self.taken.below_camera + seen)
    }

    /// Maps a detection of the level picture to the slanted one; `None` if too little of the detection's box lies in
    /// the picture, or if one of its points cannot be mapped.
    pub(crate) fn seen(&self, found: Found) -> Option<Found> {
        let Found { detection, placement } = found;
        let points = |all: &[Point2<f64>]| all.iter().map(|point| self.point(point)).collect::<Option<Vec<_>>>();
        let level_outline = detection.outline.as_ref()?;
        let outline = Polygon { vertices: points(&level_outline.vertices)? };
        let bbox = outline.bounds();
        let [width, height] = self.size.map(f64::from);
        let inside = bbox.clip(width, height);
        if inside.area() < MIN_INSIDE * bbox.area() {
            return None;
        }
        let grasp = detection.grasp;
        let center = grasp.center();
        let (sin, cos) = grasp.angle.radians().sin_cos();
        let ahead = Vector2::new(cos, sin);
        let [from, to] = [self.point(&(center - ahead))?, self.point(&(center + ahead))?];
        let [one, other] = grasp.jaws().map(|jaw| self.point(&jaw));
        let seen_center = self.point(&center)?;
        let grasp = PlanarGrasp {
            x: seen_center.x,
            y: seen_center.y,
            angle: Angle::from_direction(to.x - from.x, to.y - from.y),
            width: (one? - other?).norm(),
        };
        let keypoints: Option<Vec<_>> =
            detection.keypoints.iter().map(|(point, score)| Some((self.point(point)?, *score))).collect();
        // Tracking continues from the similarity that fits the shortened outline best.
        let picture_from_level = PlanarSimilarity::fit(&level_outline.vertices, &outline.vertices)?;
        let placement = placement.map(|mut placement| {
            placement.image_from_cutout = picture_from_level.compose(&placement.image_from_cutout);
            placement.image_from_marks = picture_from_level.compose(&placement.image_from_marks);
            placement
        });
        let detection = GraspDetection { bbox, keypoints: keypoints?, outline: Some(outline), grasp, ..detection };
        Some(Found { detection, placement })
    }
}

/// Smallest and largest coordinates of some points of the picture after their mapping to the level picture, relative to
/// the picture's centre; `None` if a point is near the horizon or beyond.
fn level_bounds(taken: &Shot, slant: &Slant, points: &[Point2<f64>]) -> Option<[Vector2<f64>; 2]> {
    let mut bounds = [Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY)];
    for point in points {
        let level = slant.level_from_picture(point - taken.below_camera)?;
        bounds = [bounds[0].inf(&level), bounds[1].sup(&level)];
    }
    Some(bounds)
}

/// Minimum fraction of a detection's box in the picture.
const MIN_INSIDE: f64 = 0.6;

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    #[cfg(feature = "teach")]
    use nalgebra::{Isometry2, Rotation2};

    const SIZE: [u32; 2] = [480, 360];

    fn half(size: [u32; 2]) -> Vector2<f64> {
        Vector2::from(size.map(|side| 0.5 * f64::from(side)))
    }

    /// Brightness of the table or of a dark, rotated plate of 110 × 60 pixels with two holes and a printed stripe.
    /// `level` is relative to the plate's centre.
    fn color(level: Vector2<f64>) -> f64 {
        let (sin, cos) = 0.6f64.sin_cos();
        let [u, v] = [cos * level.x + sin * level.y, cos * level.y - sin * level.x];
        match () {
            () if (u - 30.0).hypot(v - 8.0) < 9.0 || (u + 38.0).hypot(v + 12.0) < 6.0 => 205.0,
            () if (-12.0..2.0).contains(&u) && v.abs() < 22.0 => 150.0,
            () if u.abs() < 55.0 && v.abs() < 30.0 => 60.0,
            () => 200.0,
        }
    }

    fn picture(level_from_seen: impl Fn(Vector2<f64>) -> Option<Vector2<f64>>) -> RgbImage {
        RgbImage::from_fn(SIZE[0], SIZE[1], |x, y| {
            let samples = (0..16).map(|k| {
                let [right, down] = [k % 4, k / 4].map(|k| f64::from(k) / 4.0 + 0.125);
                let seen = Vector2::new(f64::from(x) + right, f64::from(y) + down) - half(SIZE);
                level_from_seen(seen).map_or(0.0, color)
            });
            Rgb([(samples.sum::<f64>() / 16.0) as u8; 3])
        })
    }

    fn slant(degrees: f64) -> Slant {
        Slant { tilt_rad: degrees.to_radians(), away: Angle::from_degrees(200.0), focal_px: 1.1 * f64::from(SIZE[0]) }
    }

    #[test]
    fn a_slanted_picture_made_level_is_the_level_picture() {
        let slant = slant(30.0);
        let seen = picture(|seen| slant.level_from_picture(seen));
        let made = LevelImage::new(&seen, &Shot::level(&seen), &slant).unwrap();
        let level = picture(Some);
        // Compares the plate and its surroundings; the image made from the slanted picture has its centre elsewhere.
        let mut sum = 0.0;
        for (y, x) in (100..260).flat_map(|y| (160..320).map(move |x| (y, x))) {
            let at = Vector2::new(f64::from(x), f64::from(y)) - half(SIZE) + made.middle;
            let pixel = made.image.get_pixel(at.x as u32, at.y as u32);
            sum += (f64::from(pixel[0]) - f64::from(level.get_pixel(x, y)[0])).abs();
        }
        assert!(sum / (160.0 * 160.0) < 4.0, "{}", sum / (160.0 * 160.0));
        let point = Point2::new(210.0, 150.0);
        assert!((made.point(&made.level_point(&point).unwrap()).unwrap() - point).norm() < 1e-9);
    }

    #[test]
    fn the_camera_of_a_level_image_is_as_high_as_its_lens_and_slant_tell() {
        let slant = Slant { focal_px: 300.0, ..slant(60.0) };
        let image = RgbImage::new(SIZE[0], SIZE[1]);
        let window = [Point2::new(230.0, 170.0), Point2::new(250.0, 190.0)];
        let made = LevelImage::about(&image, &Shot::level(&image), &slant, &window).unwrap();
        assert!((made.shot().camera_height_px - 150.0).abs() < 1e-9, "{:?}", made.shot());
    }

    #[cfg(feature = "teach")]
    fn plate_model() -> crate::GraspModel {
        use crate::{ModelKind, TeachOptions, teach};
        use sdg_demonstration::{Annotation, Demonstration};
        use sdg_geometry::GraspLine;
        use std::ops::ControlFlow;

        let on_plate = |u: f64, v: f64| Point2::from(half(SIZE) + Rotation2::new(0.6) * Vector2::new(u, v));
        let corners = [[-55.0, -30.0], [55.0, -30.0], [55.0, 30.0], [-55.0, 30.0]];
        let outline = Polygon { vertices: corners.map(|[u, v]| on_plate(u, v)).to_vec() };
        let annotation = Annotation {
            label: "plate".to_owned(),
            bbox: outline.bounds(),
            grasp: Some(GraspLine::new(on_plate(-20.0, 0.0), on_plate(20.0, 0.0))),
            jaw_width: None,
            outline: Some(outline),
        };
        let options = TeachOptions { kind: ModelKind::S, ..TeachOptions::new(1) };
        let demonstration = Demonstration { image: picture(Some), annotation };
        teach(&[demonstration], &options, &mut |_| ControlFlow::Continue(())).unwrap().model
    }

    /// Whether a detection is accepted and differs by less than `tolerance` (pixels and degrees) from the plate, which
    /// `plate` moves and rotates on the table.
    #[cfg(feature = "teach")]
    fn is_plate(detection: &GraspDetection, slant: &Slant, plate: &Isometry2<f64>, tolerance: f64) -> bool {
        let seen = |u: f64| {
            let on_plate = Rotation2::new(0.6) * Point2::new(u, 0.0);
            Point2::from(half(SIZE) + slant.picture_from_level((plate * on_plate).coords).unwrap())
        };
        let [from, to] = [-20.0, 20.0].map(seen);
        let angle = Angle::from_direction(to.x - from.x, to.y - from.y);
        let off_px = (detection.grasp.center() - seen(0.0)).norm();
        let off_deg = detection.grasp.angle.distance(angle).to_degrees();
        detection.is_accepted() && off_px < tolerance && off_deg < tolerance
    }

    #[cfg(feature = "teach")]
    #[test]
    fn a_plate_is_found_under_a_slanted_camera_where_it_is_seen() {
        let model = plate_model();
        for degrees in [0.0, 20.0, 30.0] {
            let slant = slant(degrees);
            let seen = picture(|seen| slant.level_from_picture(seen));
            let found = model.detect(&seen, crate::Verification::ByShape).unwrap();
            assert!(is_plate(&found[0], &slant, &Isometry2::identity(), 2.0), "{degrees}°: {:?}", found[0]);
        }
    }

    /// A similarity does not describe the shortened plate, so that only the search has its outline and its grasp.
    #[cfg(feature = "teach")]
    #[test]
    fn a_tracked_plate_at_rest_stays_where_the_search_has_it() {
        use crate::tracking::{Tracker, TrackerConfig};
        use std::{sync::Arc, time::Duration};

        let slant = slant(30.0);
        let seen = Arc::new(picture(|seen| slant.level_from_picture(seen)));
        let mut tracker = Tracker::new(plate_model().into(), TrackerConfig::default());
        tracker.frame(Arc::clone(&seen), Duration::ZERO);
        let search = tracker.search_before_answer().unwrap();
        let found = tracker.answer(search.run()).unwrap().swap_remove(0).detection;
        assert!(is_plate(&found, &slant, &Isometry2::identity(), 2.0), "{found:?}");
        for number in 1..4 {
            let parts = tracker.frame(Arc::clone(&seen), Duration::from_millis(100 * number));
            assert!(tracker.search_before_answer().is_none(), "the frame continues the one before");
            let followed = &parts[0].detection;
            assert_eq!((followed.grasp, &followed.outline), (found.grasp, &found.outline), "frame {number}");
        }
    }

    #[test]
    fn places_far_apart_tell_the_lens() {
        let usual_px = 700.0;
        let seen = Slant { tilt_rad: 30f64.to_radians(), away: Angle::from_degrees(40.0), focal_px: 0.65 * usual_px };
        let shortened = [[-210.0, -150.0], [200.0, -160.0], [10.0, 170.0], [220.0, 140.0]].map(|at| {
            let at = Vector2::from(at);
            let (log_ratio, direction) = seen.shortening_at(at).unwrap();
            Shortened { at, reach: 40.0, shortening: shortening_vector(log_ratio, direction), weight: 0.5 }
        });
        let level_cost = cost(&Slant::level(usual_px), &shortened).unwrap();
        let likely = |lens: f64| likely_slants(lens * usual_px, &shortened, UNEXPLAINED * level_cost);
        assert!(likely(1.0).is_empty() && likely(2.0).is_empty());
        let (cost, slant) = likely(0.65)[0];
        assert!(cost < 1e-9 && slant.away.distance(seen.away) < 1e-9, "{cost} {slant:?}");
        assert!((slant.tilt_rad - seen.tilt_rad).abs() < 1e-9, "{slant:?}");
    }

    #[test]
    fn places_that_one_slant_explains_need_no_gain() {
        // As measured for the photographed clips at 20°, and for a level picture without the part.
        assert!(required_gain(0.711, 0.035) < 0.019);
        assert!(required_gain(0.265, 0.097) > 0.024);
    }

    #[test]
    fn one_part_found_twice_is_one() {
        let at =
            |x: f64| Shortened { at: Vector2::new(x, 5.0), reach: 40.0, shortening: Vector2::zeros(), weight: 0.5 };
        assert_eq!(num_parts(&[at(0.0), at(3.0), at(100.0), at(-2.0)]), 2);
    }

    #[cfg(feature = "teach")]
    #[test]
    fn a_part_found_by_two_searches_or_by_network_and_search_takes_one_place() {
        use crate::colors::Colors;
        use crate::taught::TaughtDemonstration;
        use crate::verification::PlacedDemonstration;
        use sdg_shape::Evidence;

        let taught = TaughtDemonstration::new(&crate::teach::tests::demonstration()).unwrap();
        let sighting = |x: f64, agreement: f64, (turn_source, demonstration_idx, range_idx)| {
            let pose = PlanarSimilarity::translation(x, 0.0);
            let placed = PlacedDemonstration {
                demonstration: &taught,
                demonstration_idx,
                range_idx,
                image_from_cutout: pose,
                image_from_marks: pose,
                colors: Colors::There,
                agreement,
                evidence: Evidence {
                    edges: agreement,
                    surface: None,
                    hue_shift: 0.0,
                    visible: 1.0,
                    outside: 0.0,
                    close: None,
                },
                light: 1.0,
            };
            Sighting { placed, network_score: 0.0, keypoint_scores: Vec::new(), turn_source }
        };
        let places = |sightings: &[Sighting<'_>]| -> Vec<f64> {
            best_places(sightings).iter().map(|sighting| sighting.placed.image_from_cutout.tx).collect()
        };
        let five = |first: (TurnSource, usize, usize)| {
            let twice = |k: i32| {
                let (x, agreement) = (200.0 * f64::from(k), 0.9 - 0.1 * f64::from(k));
                [sighting(x, agreement, first), sighting(x + 2.0, agreement - 0.01, (TurnSource::Search, 0, 0))]
            };
            (0..5).flat_map(twice).collect::<Vec<_>>()
        };
        // By the network; by a search with another photo, and for another range of sizes.
        for first in [(TurnSource::Keypoints, 0, 0), (TurnSource::Search, 1, 0), (TurnSource::Search, 0, 1)] {
            assert_eq!(places(&five(first)), [0.0, 200.0, 400.0, 600.0], "{first:?}");
        }
        // A search has already decided which of its matches are apart.
        assert_eq!(places(&five((TurnSource::Search, 0, 0))), [0.0, 2.0, 200.0, 202.0]);
    }
}
