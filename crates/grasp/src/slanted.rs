//! A camera without calibration that looks at the table at a slant: the picture made level, searched, and what was found there
//! brought back.
//!
//! ```text
//! level search ─ best places ─ how much they are shortened ─ slants ─ level picture of each ─ search ─ worth more? ─ brought back
//! ```
//! All parts lie on one plane, so the surest place says for all how it lies. From one shortened part alone both ends of the slant
//! can be the far one; both are tried.

use image::imageops::interpolate_bilinear;
use image::{Rgb, RgbImage};
use nalgebra::{Point2, Vector2};
use sdg_geometry::{Angle, PlanarGrasp, PlanarSimilarity, Polygon, Slant};

use crate::model::{Found, GraspDetection};
use crate::sighting::Sighting;
use crate::verification::{SearchedImage, Shot, foreshortening};

/// Places that are asked, the best first, and what they agree by at least. Chosen by hand, for time.
const NUM_ASKED: usize = 6;
const MIN_AGREEMENT: f64 = 0.25;
/// A place of which fewer edges lie on crests tells nothing. Chosen by hand.
const MIN_CONSENSUS: f64 = 0.3;
/// Spread of ln shortening about that of the slant. Chosen by hand.
const SHORTENING_NOISE: f64 = 0.12;
/// A smaller tilt shortens by less than 3 %: as good as none.
const MIN_TILT: f64 = 0.24;
/// Focal length of the camera in widths of the picture, where nothing tells it: 49° across, as a telephone's. Chosen by hand.
const FOCAL_WIDTHS: f64 = 1.1;
/// What a slant must explain of the shortening that a level camera leaves: less is the noise of the fits. Of 20 pictures of level
/// cameras 4 are searched again then, of 64 slanted by 20 to 30° 56 (tuned sets).
const MIN_EXPLAINED: f64 = 0.1;
/// What a slanted picture must be worth more than the level one. Chosen by hand.
const SLANT_GAIN: f64 = 0.03;
/// Where nothing is accepted in the level picture, a slant may as well make another part of the photo's, a longer one above all:
/// then one must be sure. Of the tuned sets' pictures without the part three more would have a false alarm otherwise.
const SURE: f64 = 0.9;
/// The level picture reaches so far from its middle at most, in sides of the picture.
const MAX_REACH: f64 = 0.9;

/// Whether what is found in the picture made level explains more than what is found in the picture itself. The scores do not tell:
/// they are as high for a pose that is a little off.
pub(crate) fn explains_more(slanted: &[Found], level: &[Found]) -> bool {
    fn accepted(found: &[Found]) -> impl Iterator<Item = &GraspDetection> {
        found.iter().map(|found| &found.detection).filter(|detection| detection.is_accepted())
    }
    let worth = |found: &[Found]| accepted(found).filter_map(|detection| detection.agreement).sum::<f64>();
    let is_sure = accepted(level).next().is_some() || accepted(slanted).any(|detection| detection.score >= SURE);
    is_sure && worth(slanted) > worth(level) + SLANT_GAIN
}

/// A place that is shortened: where, from the picture's middle; how, as a vector that half a turn leaves as it is; and how much
/// of it lies on edges.
struct Shortened {
    at: Vector2<f64>,
    shortening: Vector2<f64>,
    weight: f64,
}

fn shortening_vector(log_ratio: f64, direction: Angle) -> Vector2<f64> {
    let (sin, cos) = (2.0 * direction.radians()).sin_cos();
    log_ratio * Vector2::new(cos, sin)
}

/// The slants under which the best places would look as in the photo: the likeliest, and the likeliest that recedes to the other
/// side. None where the camera may as well be level.
pub(crate) fn suggested_slants(sightings: &[Sighting<'_>], searched: &SearchedImage<'_>, shot: &Shot) -> Vec<Slant> {
    let mut best: Vec<_> = sightings.iter().filter(|sighting| sighting.placed.agreement >= MIN_AGREEMENT).collect();
    best.sort_by(|a, b| b.placed.agreement.total_cmp(&a.placed.agreement));
    best.truncate(NUM_ASKED);
    let middle = Vector2::from(shot.size.map(|side| 0.5 * f64::from(side)));
    let shortened: Vec<Shortened> = best
        .iter()
        .filter_map(|sighting| {
            let fit = foreshortening(searched, &sighting.placed)?;
            Some(Shortened {
                at: sighting.placed.outline().bounds().center().coords - middle,
                shortening: shortening_vector(fit.log_ratio, fit.direction),
                weight: (fit.consensus - MIN_CONSENSUS).max(0.0),
            })
        })
        .collect();
    let focal_px = FOCAL_WIDTHS * f64::from(shot.size[0].max(shot.size[1]));
    let costs: Vec<(f64, Slant)> =
        slants(focal_px).filter_map(|slant| Some((cost(&slant, &shortened)?, slant))).collect();
    let least = |all: &mut dyn Iterator<Item = &(f64, Slant)>| all.min_by(|a, b| a.0.total_cmp(&b.0)).copied();
    let (Some((level_cost, _)), Some((least_cost, likeliest))) = (costs.first(), least(&mut costs.iter())) else {
        return Vec::new();
    };
    if likeliest.tilt_rad < MIN_TILT || level_cost - least_cost < MIN_EXPLAINED {
        return Vec::new();
    }
    let is_opposite =
        |slant: &Slant| slant.tilt_rad >= MIN_TILT && slant.away.distance(likeliest.away).to_degrees() > 90.0;
    let other = least(&mut costs.iter().filter(|(_, slant)| is_opposite(slant))).map(|(_, slant)| slant);
    std::iter::once(likeliest).chain(other).collect()
}

/// All that are tried: to 50°, every 2° of tilt and 10° of direction.
fn slants(focal_px: f64) -> impl Iterator<Item = Slant> {
    (0..=25).flat_map(move |tilt| {
        (0..if tilt == 0 { 1 } else { 36 }).map(move |direction| Slant {
            tilt_rad: f64::from(2 * tilt).to_radians(),
            away: Angle::from_degrees(f64::from(10 * direction)),
            focal_px,
        })
    })
}

/// How badly a slant explains the shortened places; one that it cannot explain counts no more than a bound.
fn cost(slant: &Slant, shortened: &[Shortened]) -> Option<f64> {
    let terms = shortened.iter().map(|place| {
        let (log_ratio, direction) = slant.shortening_at(place.at)?;
        let off = (place.shortening - shortening_vector(log_ratio, direction)).norm() / SHORTENING_NOISE;
        Some(place.weight * (off * off).min(1.0))
    });
    terms.sum()
}

/// The picture as a camera straight above the table would have taken it.
pub(crate) struct LevelImage {
    pub(crate) image: RgbImage,
    slant: Slant,
    /// Width and height of the picture.
    size: [u32; 2],
    /// Where the picture's middle is, in pixels of the level one.
    middle: Vector2<f64>,
}

impl LevelImage {
    /// `None` where the picture shows the horizon.
    pub(crate) fn new(picture: &RgbImage, slant: &Slant) -> Option<Self> {
        let (width, height) = picture.dimensions();
        let half = Vector2::new(0.5 * f64::from(width), 0.5 * f64::from(height));
        let reach = 2.0 * MAX_REACH * half;
        let (mut least, mut largest) = (reach, -reach);
        for corner in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
            let level = slant.level_from_picture(half.component_mul(&Vector2::from(corner)))?;
            least = least.inf(&level);
            largest = largest.sup(&level);
        }
        let (least, largest) = (least.sup(&-reach), largest.inf(&reach));
        let [columns, rows] = [largest.x - least.x, largest.y - least.y].map(|side| side.ceil().max(1.0) as u32);
        let image = RgbImage::from_fn(columns, rows, |x, y| {
            let level = least + Vector2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let Some(seen) = slant.picture_from_level(level) else { return Rgb([0; 3]) };
            // Beyond the picture's border its last pixels are repeated: an edge there would be none of the table's.
            let [x, y] = [(seen.x, half.x), (seen.y, half.y)]
                .map(|(at, half)| (at + half - 0.5).clamp(0.0, 2.0 * half - 1.0) as f32);
            interpolate_bilinear(picture, x, y).unwrap_or(Rgb([0; 3]))
        });
        Some(Self { image, slant: *slant, size: [width, height], middle: -least })
    }

    pub(crate) fn shot(&self) -> Shot {
        Shot { size: self.size, below_camera: self.slant.below_camera() + self.middle }
    }

    fn point(&self, level: &Point2<f64>) -> Option<Point2<f64>> {
        let [width, height] = self.size.map(f64::from);
        let seen = self.slant.picture_from_level(level.coords - self.middle)?;
        Some(Point2::new(0.5 * width, 0.5 * height) + seen)
    }

    /// A detection of the level picture, in the slanted one; `None` where it lies outside.
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
        // What tracking goes on from is the nearest pose that is not shortened.
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

/// Share of a detection's box that lies in the picture.
const MIN_INSIDE: f64 = 0.6;
