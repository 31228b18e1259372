//! The position of the marks in a picture if they are higher or lower than the outline.
//!
//! A higher point appears shifted away from the point vertically below the camera, by a fraction of its distance from
//! that point. For a camera that points vertically down, the point below it is the centre of the picture:
//! ```text
//! shift = η · ((position − centre) in the picture − (position − centre) in the photo)
//!     η = height / (distance − height)
//! ```
//! η is unknown. The marks' surroundings, as edges and colours, are compared with the picture at the shifts of all
//! possible η, which form a line. Since no camera points exactly down, shifts beside this line are also compared. A
//! shift is accepted if its agreement is clearly better than that of the outline's pose. Fitted on the tuned sets of
//! datasets/split.toml and base-weights/physical/split.toml: the marks of 304 of 312 parts lie within 4 % of the
//! diagonal; without a shift, those of 268 parts (docs/decisions/027-heights-and-slants.md).

use image::RgbImage;
use image::imageops::interpolate_bilinear;
use nalgebra::{Point2, Vector2};
use sdg_geometry::{CompassSearch, PlanarSimilarity, Polygon};
use sdg_shape::{Picture, ShapeConfig, ShapeTemplate, Surface};

use crate::taught_marks::TaughtMarks;

/// Radius of the surroundings about the centre of the grasp line, in lengths of the line: points farther away are at
/// another height. With 0.8 lengths the edges of 11 of 32 flanges determine the shift, with 0.6 those of 30.
const SURROUNDINGS: f64 = 0.6;
/// Minimum length of the line in the calculation of this radius, as a fraction of the diagonal.
const MIN_LINE_SHARE: f64 = 0.2;
/// Smallest and largest η: a mark 40 mm high under a camera 300 mm above the table has 0.15. Chosen from that.
const HEIGHT_SHARES: (f64, f64) = (-0.04, 0.18);
/// Search range across the line, and along it if the part is near the picture's centre; in diagonals.
const MAX_ASIDE: f64 = 0.04;
/// Largest shift along the line, in diagonals: reached at 278 diagonals from the photo's or the picture's centre. Chosen
/// to limit the time with a model whose photo is not the part's.
const MAX_ALONG: f64 = 50.0;
/// First step of the search, in diagonals. Chosen to save time.
const STEP: f64 = 0.01;
/// Last step of the search, in diagonals. Chosen to save time.
const LAST_STEP: f64 = 0.0025;
/// Penalty per diagonal of shift along the line, in agreement of edges and surface together, in `[0, 2]`. Fitted like
/// the next two (see above). With half or twice these values, the number of parts within 4 % (304) changes by at most
/// 3.
const COST_ALONG: f64 = 3.0;
/// Penalty per diagonal of shift across the line.
const COST_ACROSS: f64 = 5.0;
/// Minimum gain of agreement by a shift.
const MIN_GAIN: f64 = 0.2;
/// Radius at which the raised area meets the outline's plane, in radii of the surroundings. With 2.0 the holes of a
/// flange beside its boss move with the boss.
const FOOT: f64 = 1.3;
/// Extent of the picture kept around the part, in lengths of its box: the range of a close look.
const MARGIN: f64 = 0.35;

/// The surroundings of a demonstration's marks.
#[derive(Debug)]
pub(crate) struct MarksShift {
    edges: ShapeTemplate,
    surface: Surface,
    /// Centre of the grasp line, in pixels of the cut-out.
    middle: Point2<f64>,
    /// Radius of the surroundings, in pixels of the cut-out.
    reach: f64,
    /// Centre of the photo, in pixels of the cut-out.
    photo_middle: Point2<f64>,
    /// Diagonal of the outline's box, in pixels of the cut-out.
    diagonal: f64,
}

impl MarksShift {
    /// `marks` are in pixels of `cutout`. `None` if there are too few edges around them.
    pub(crate) fn new(cutout: &RgbImage, marks: &TaughtMarks, config: &ShapeConfig) -> Option<Self> {
        let bounds = marks.region().bounds();
        let diagonal = bounds.width().hypot(bounds.height());
        let middle = marks.grasp.center();
        let reach = SURROUNDINGS * marks.grasp.length().max(MIN_LINE_SHARE * diagonal);
        let surroundings = circle(middle, reach);
        // The outline gets no special weight in the marks' surroundings.
        let mut config = config.clone();
        config.outline_weight = 1.0;
        Some(Self {
            edges: ShapeTemplate::new(cutout, &surroundings, &config).ok()?,
            surface: Surface::new(cutout, &surroundings, &config.surface),
            middle,
            reach,
            photo_middle: marks.photo_middle.map_or(middle, Point2::from),
            diagonal,
        })
    }

    /// `image_from_cutout`, shifted to the position of the marks' surroundings if they are displaced. Deterministic.
    ///
    /// # Units and frames
    /// Pixels of the picture; `below_camera` is the point of the table vertically below the camera.
    pub(crate) fn placed(
        &self,
        picture: &Picture<'_>,
        below_camera: Point2<f64>,
        image_from_cutout: &PlanarSimilarity,
    ) -> PlanarSimilarity {
        let diagonal = self.diagonal * image_from_cutout.scale;
        // Distances are in diagonals.
        let away = (image_from_cutout.apply(&self.photo_middle) - below_camera) / diagonal;
        let line = away.try_normalize(f64::EPSILON).unwrap_or(Vector2::x());
        let along_bounds = [
            (HEIGHT_SHARES.0 * away.norm()).clamp(-MAX_ALONG, -MAX_ASIDE),
            (HEIGHT_SHARES.1 * away.norm()).clamp(MAX_ASIDE, MAX_ALONG),
        ];
        let shifted = |[along, across]: [f64; 2]| {
            let shift = diagonal * (along * line + across * Vector2::new(-line.y, line.x));
            image_from_cutout.shifted(shift)
        };
        let edges = |at: [f64; 2]| {
            let cost = COST_ALONG * at[0].abs() + COST_ACROSS * at[1].abs();
            self.edges.agreement(picture.field, &shifted(at)) - cost
        };
        let value = |at: [f64; 2]| edges(at) + self.surface.agreement(picture.image, &shifted(at));

        let unshifted = value([0.0; 2]);
        let mut best = ([0.0; 2], unshifted);
        for at in grid(along_bounds) {
            // The agreement of the surface, which takes most of the time, is at most 1.
            if edges(at) + 1.0 > best.1 {
                let found = value(at);
                if found > best.1 {
                    best = (at, found);
                }
            }
        }
        if best.1 < unshifted + MIN_GAIN {
            return *image_from_cutout;
        }
        let search = CompassSearch {
            steps: (0.5 * STEP, LAST_STEP),
            min_gain: 0.0,
            max_rounds: usize::MAX,
            max_evaluations: 100,
        };
        let neighbour = |at: &[f64; 2], coordinate: usize, step: f64| {
            let mut next = *at;
            *next.get_mut(coordinate)? += step;
            Some(next)
        };
        shifted(search.climb(best.0, neighbour, |at| value(*at)).0)
    }
}

/// A piece of a picture in which the raised surroundings of the marks are moved to the position that they would have in
/// the outline's plane.
pub(crate) struct Straightened {
    pub(crate) image: RgbImage,
    /// The upper left corner in the picture.
    pub(crate) corner: [u32; 2],
}

impl MarksShift {
    /// The picture around the part, with the marks' surroundings moved from `image_from_marks` back to the outline's
    /// pose. The flanks of the raised area are moved by a shift that decreases from its top to its foot.
    ///
    /// # Units and frames
    /// Pixels of the picture; the corner lies at multiples of `coarsest_pixel`, so that the pyramid of the result has
    /// the same pixels as the picture's pyramid.
    pub(crate) fn straightened(
        &self,
        image: &RgbImage,
        outline: &Polygon,
        image_from_cutout: &PlanarSimilarity,
        image_from_marks: &PlanarSimilarity,
        coarsest_pixel: u32,
    ) -> Straightened {
        let (width, height) = image.dimensions();
        let bounds = outline.bounds();
        let margin = MARGIN * bounds.width().max(bounds.height());
        let first =
            |from: f64, size: u32| (((from - margin).max(0.0) as u32).min(size - 1)) / coarsest_pixel * coarsest_pixel;
        let last = |to: f64, size: u32| ((to + margin).ceil().max(1.0) as u32).min(size);
        let corner = [first(bounds.x1, width), first(bounds.y1, height)];
        let end = [last(bounds.x2, width), last(bounds.y2, height)];
        let [columns, rows] = [0, 1].map(|k| end[k].saturating_sub(corner[k]).max(1));
        let center = image_from_cutout.apply(&self.middle);
        let shift =
            Vector2::new(image_from_marks.tx - image_from_cutout.tx, image_from_marks.ty - image_from_cutout.ty);
        let reach = self.reach * image_from_cutout.scale;
        let straightened = RgbImage::from_fn(columns, rows, |x, y| {
            let at = Point2::new(f64::from(corner[0] + x) + 0.5, f64::from(corner[1] + y) + 0.5);
            let share = ((FOOT - (at - center).norm() / reach) / (FOOT - 1.0)).clamp(0.0, 1.0);
            let from = at + share * shift;
            let sampled = || interpolate_bilinear(image, (from.x - 0.5) as f32, (from.y - 0.5) as f32);
            let own = || *image.get_pixel(corner[0] + x, corner[1] + y);
            if share > 0.0 { sampled().unwrap_or_else(own) } else { own() }
        });
        Straightened { image: straightened, corner }
    }
}

/// Shifts along the line and across it, in diagonals.
fn grid([least, largest]: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    let steps = |least: f64, largest: f64| (least / STEP).round() as i32..=(largest / STEP).round() as i32;
    let across = steps(-MAX_ASIDE, MAX_ASIDE);
    steps(least, largest)
        .flat_map(move |along| across.clone().map(move |across| [along, across].map(|k| STEP * f64::from(k))))
}

fn circle(center: Point2<f64>, radius: f64) -> Polygon {
    let corner = |k: u32| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 24.0).sin_cos();
        center + radius * Vector2::new(cos, sin)
    };
    Polygon { vertices: (0..24).map(corner).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use sdg_geometry::{Angle, GraspLine};
    use sdg_shape::{GradientField, TableColors};

    const SIZE: [u32; 2] = [480, 360];
    const RADIUS: f64 = 50.0;

    /// A disc with six holes about `middle`, and on the disc a boss with a bore. The boss is displaced outwards by
    /// `eta` times its distance from the picture's centre.
    fn disc(middle: Point2<f64>, eta: f64) -> RgbImage {
        let picture_middle = Point2::new(f64::from(SIZE[0]), f64::from(SIZE[1])) / 2.0;
        let boss = middle + eta * (middle - picture_middle);
        let color = |at: Point2<f64>| {
            let hole = |k: u32| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 6.0).sin_cos();
                (at - middle - 38.0 * Vector2::new(cos, sin)).norm() < 5.0
            };
            match () {
                () if (at - boss).norm() < 8.0 => 20.0,
                () if (at - boss).norm() < 18.0 => 210.0,
                () if (0..6).any(hole) => 40.0,
                () if (at - middle).norm() < RADIUS => 120.0,
                () => 170.0,
            }
        };
        RgbImage::from_fn(SIZE[0], SIZE[1], |x, y| {
            let samples = (0..16).map(|k| {
                let [right, down] = [k % 4, k / 4].map(|k| f64::from(k) / 4.0 + 0.125);
                color(Point2::new(f64::from(x) + right, f64::from(y) + down))
            });
            Rgb([(samples.sum::<f64>() / 16.0) as u8; 3])
        })
    }

    /// The surroundings taught in the centre of a photo, where nothing is shifted.
    fn taught() -> MarksShift {
        let middle = Point2::new(240.0, 180.0);
        let outline = circle(middle, RADIUS);
        let marks = TaughtMarks {
            label: "flange".to_owned(),
            bbox: outline.bounds(),
            grasp: GraspLine::new(middle - Vector2::new(18.0, 0.0), middle + Vector2::new(18.0, 0.0)),
            outline: Some(outline),
            width_px: 36.0,
            photo_size: Some(SIZE),
            photo_middle: Some([240.0, 180.0]),
        };
        MarksShift::new(&disc(middle, 0.0), &marks, &ShapeConfig::DEFAULT).unwrap()
    }

    fn placed(image: &RgbImage, pose: &PlanarSimilarity) -> PlanarSimilarity {
        let (field, table) = (GradientField::new(image), TableColors::new(image));
        taught().placed(&Picture { image, field: &field, table: &table }, Point2::new(240.0, 180.0), pose)
    }

    fn to(middle: Point2<f64>) -> PlanarSimilarity {
        PlanarSimilarity::about(Point2::new(240.0, 180.0), middle, Angle::ZERO, 1.0)
    }

    #[test]
    fn marks_on_a_boss_go_where_the_camera_sees_it() {
        let middle = Point2::new(390.0, 90.0);
        for eta in [0.03, 0.06, 0.1] {
            let pose = to(middle);
            let marks = placed(&disc(middle, eta), &pose);
            let shift = Vector2::new(marks.tx - pose.tx, marks.ty - pose.ty);
            let expected = eta * Vector2::new(150.0, -90.0);
            assert!((shift - expected).norm() < 1.5, "{eta}: {shift} instead of {expected}");
        }
    }

    #[test]
    fn flat_marks_stay() {
        let middle = Point2::new(390.0, 90.0);
        assert_eq!(placed(&disc(middle, 0.0), &to(middle)), to(middle));
    }

    #[test]
    fn straightened_is_the_picture_of_the_flat_part() {
        let (middle, shift) = (Point2::new(390.0, 90.0), taught());
        let (raised, flat) = (disc(middle, 0.06), disc(middle, 0.0));
        let pose = to(middle);
        let outline = circle(middle, RADIUS);
        let marks = placed(&raised, &pose);
        let Straightened { image, corner: [left, top] } = shift.straightened(&raised, &outline, &pose, &marks, 2);
        assert!(left % 2 == 0 && top % 2 == 0);
        let flat = image::imageops::crop_imm(&flat, left, top, image.width(), image.height()).to_image();
        let difference =
            |one: &RgbImage| one.pixels().zip(flat.pixels()).map(|(a, b)| f64::from(a[0].abs_diff(b[0]))).sum::<f64>();
        let before = image::imageops::crop_imm(&raised, left, top, image.width(), image.height()).to_image();
        assert!(difference(&image) < 0.35 * difference(&before), "{} of {}", difference(&image), difference(&before));
    }
}
