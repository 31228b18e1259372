//! Whether marks fit a photo as they are, or in another reading: at half or twice the size, with x and y exchanged, or
//! as percentages.
//!
//! Only pixels can decide, because half of a coordinate is also a coordinate. An outline fits if colours change across
//! its border and differ inside from those around it. A box contains background, and the part touches its border only
//! at some points. So for a box only the colours inside and around it are compared, not those across its border.

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_geometry::{BoundingBox, Polygon};

use crate::Annotation;

/// Factor by which another reading must fit better than the marks as they are. At 1.1, none of 62 labelled photos (with
/// the shipped demonstrations) is refused, neither with outlines nor with boxes alone. At 3, 56 of 57 intentionally
/// wrong outlines and 126 of 144 wrong boxes are refused.
const MIN_GAIN: f64 = 3.0;
/// Minimum colour difference of marks around a part. It is smaller where the inside and the outside have the same
/// mixture of colours, such as on a plain background. The smallest difference in these 62 photos is 0.99 for an outline
/// and 0.29 for a box.
const MIN_DIFFERENCE: f64 = 0.15;
/// Minimum contrast at the border, in grey values, of marks that may be right although their colour difference is
/// small: they may follow elements of a pattern. The value is above a camera's noise.
const MIN_CONTRAST: f64 = 20.0;
/// Dark photos and those of low contrast have one mixture of colours everywhere: the first and the ninety-ninth
/// percentile of their grey values differ by less than this. A photo at 30 % of its brightness has at most 76.
const MIN_RANGE: f64 = 100.0;
/// Marks on more of the photo than this belong to a crop: their surroundings carry no information. Chosen by hand.
const MAX_COVER: f64 = 0.5;
/// Scales the fit of a box to that of an outline, in case a file has both.
const BOX_CONTRAST: f64 = 100.0;
/// Number of samples across and down, over the region and its surroundings, or over the photo.
const GRID: u32 = 64;
/// Maximum number of positions compared along a border, besides one for each side; only a hostile outline has more
/// pixels of length.
const MAX_BORDER_SAMPLES: f64 = 100_000.0;
/// Width of the surroundings, as a fraction of the region's mean side.
const SURROUNDINGS: f64 = 0.25;
/// Steps of a colour channel in a histogram.
const STEPS: usize = 8;

/// The probable meaning of marks that do not fit the photo as they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum MarksReading {
    /// They were made on the photo at half its width and height.
    HalfSize,
    /// They were made on the photo at twice its width and height.
    DoubleSize,
    /// y comes before x.
    Exchanged,
    /// Hundredths of the photo's width and height.
    Percent,
    /// No reading fits: the photo has one colour at the marks.
    OtherPhoto,
}

impl MarksReading {
    /// In words, after "found marks that".
    pub fn in_words(self) -> &'static str {
        match self {
            Self::HalfSize => "seem to be at half scale: made on a photo of half the width and height",
            Self::DoubleSize => "seem to be at double scale: made on a photo of twice the width and height",
            Self::Exchanged => "seem to have x and y exchanged",
            Self::Percent => "seem to be percentages of the photo's width and height",
            Self::OtherPhoto => "lie where the photo has one colour: they seem to be of another photo",
        }
    }

    fn pixels(self, point: Point2<f64>, image: &RgbImage) -> Point2<f64> {
        match self {
            Self::HalfSize => 2.0 * point,
            Self::DoubleSize => 0.5 * point,
            Self::Exchanged => Point2::new(point.y, point.x),
            Self::Percent => {
                Point2::new(point.x * f64::from(image.width()) / 100.0, point.y * f64::from(image.height()) / 100.0)
            }
            Self::OtherPhoto => point,
        }
    }
}

/// The reading in which the marks fit the photo far better than unchanged, or [`MarksReading::OtherPhoto`]. `None` if
/// the marks may be right, if one part covers most of the photo, or if there are no marks.
pub fn other_reading(image: &RgbImage, marked: &[&Annotation]) -> Option<MarksReading> {
    let pixels = f64::from(image.width()) * f64::from(image.height());
    let is_crop = |annotation: &&Annotation| annotation.region().area() > MAX_COVER * pixels;
    if marked.is_empty() || marked.iter().any(is_crop) {
        return None;
    }
    let fit_of = |reading: Option<MarksReading>| {
        let fits = marked.iter().map(|annotation| {
            let mut region = annotation.region();
            if let Some(reading) = reading {
                region.vertices.iter_mut().for_each(|vertex| *vertex = reading.pixels(*vertex, image));
            }
            region_fit(image, &region, annotation.outline.is_some())
        });
        fits.sum::<f64>()
    };
    let as_they_stand = fit_of(None);
    let readings = [MarksReading::HalfSize, MarksReading::DoubleSize, MarksReading::Exchanged, MarksReading::Percent];
    let better = readings.map(|reading| (reading, fit_of(Some(reading))));
    let best = better.into_iter().max_by(|(_, a), (_, b)| a.total_cmp(b));
    match best {
        Some((reading, fit)) if fit > MIN_GAIN * as_they_stand => Some(reading),
        _ => {
            let differs = |region: Polygon| {
                let bounds = region.bounds();
                color_difference(image, &region, &bounds) >= MIN_DIFFERENCE
                    || border_contrast(image, &region, &bounds) >= MIN_CONTRAST
            };
            let is_any_right = marked.iter().any(|annotation| differs(annotation.region()));
            (!is_any_right && grey_range(image) >= MIN_RANGE).then_some(MarksReading::OtherPhoto)
        }
    }
}

/// The fit of marks to a photo, for comparison with other photos or other marks.
pub fn marks_fit(image: &RgbImage, annotation: &Annotation) -> f64 {
    region_fit(image, &annotation.region(), annotation.outline.is_some())
}

/// Difference between the brightest and the darkest hundredth of a photo, in grey values.
fn grey_range(image: &RgbImage) -> f64 {
    let along = |at: u32, length: u32| ((f64::from(at) + 0.5) / f64::from(GRID) * f64::from(length)) as u32;
    let place = |at: u32| (along(at % GRID, image.width()), along(at / GRID, image.height()));
    let mut greys: Vec<u16> = (0..GRID * GRID)
        .filter_map(|at| image.get_pixel_checked(place(at).0, place(at).1))
        .map(|pixel| pixel.0.iter().map(|value| u16::from(*value)).sum())
        .collect();
    greys.sort_unstable();
    let rank = |share: f64| greys.get((share * greys.len() as f64) as usize).map_or(0.0, |sum| f64::from(*sum) / 3.0);
    rank(0.99) - rank(0.01)
}

fn region_fit(image: &RgbImage, region: &Polygon, is_outline: bool) -> f64 {
    let bounds = region.bounds();
    let is_inside = bounds.x1 >= -1.0
        && bounds.y1 >= -1.0
        && bounds.x2 <= f64::from(image.width()) + 1.0
        && bounds.y2 <= f64::from(image.height()) + 1.0;
    if !is_inside {
        return 0.0;
    }
    let difference = color_difference(image, region, &bounds);
    if difference < MIN_DIFFERENCE {
        return 0.0;
    }
    if is_outline { border_contrast(image, region, &bounds) * difference } else { BOX_CONTRAST * difference.powi(3) }
}

/// Change of colours across the border of a region, in grey values: larger if the border is the part's.
fn border_contrast(image: &RgbImage, region: &Polygon, bounds: &BoundingBox) -> f64 {
    let reach = (0.01 * (bounds.width() + bounds.height())).max(2.0);
    let color = |at: Point2<f64>| {
        let inside = |value: f64, end: u32| (value.max(0.0) as u32).min(end - 1);
        image.get_pixel(inside(at.x, image.width()), inside(at.y, image.height())).0.map(f64::from)
    };
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for (at, normal) in border_samples(&region.vertices) {
        let across = normal * reach;
        let (one, other) = (color(at + across), color(at - across));
        sum += (0..3).map(|channel| (one[channel] - other[channel]).abs()).sum::<f64>() / 3.0;
        count += 1.0;
    }
    sum / count.max(1.0)
}

/// Positions along a closed border, a pixel apart if these are not too many, and the border's unit normals there.
fn border_samples(corners: &[Point2<f64>]) -> impl Iterator<Item = (Point2<f64>, Vector2<f64>)> {
    let sides = || corners.iter().zip(corners.iter().cycle().skip(1)).map(|(start, end)| (start, end - start));
    let step_px = (sides().map(|(_, side)| side.norm()).sum::<f64>() / MAX_BORDER_SAMPLES).max(1.0);
    sides().flat_map(move |(start, side)| {
        let normal = Vector2::new(-side.y, side.x).try_normalize(f64::EPSILON).unwrap_or_default();
        let num_steps = (side.norm() / step_px).ceil() as u32;
        (0..num_steps).map(move |step| (start + side * (f64::from(step) / f64::from(num_steps)), normal))
    })
}

/// Difference between the colours inside a region and around it: 0 for the same colours in the same proportions, 2 for
/// no common ones.
fn color_difference(image: &RgbImage, region: &Polygon, bounds: &BoundingBox) -> f64 {
    let margin = SURROUNDINGS * 0.5 * (bounds.width() + bounds.height());
    let mut shares = [vec![0.0; STEPS * STEPS * STEPS], vec![0.0; STEPS * STEPS * STEPS]];
    let mut counts = [0.0_f64; 2];
    for (row, column) in (0..GRID).flat_map(|row| (0..GRID).map(move |column| (row, column))) {
        let along = |at: u32, length: f64| (length + 2.0 * margin) * (f64::from(at) + 0.5) / f64::from(GRID) - margin;
        let point = Point2::new(bounds.x1 + along(column, bounds.width()), bounds.y1 + along(row, bounds.height()));
        if point.x < 0.0 || point.y < 0.0 {
            continue;
        }
        let Some(pixel) = image.get_pixel_checked(point.x as u32, point.y as u32) else { continue };
        let [r, g, b] = pixel.0.map(|value| usize::from(value) * STEPS / 256);
        let side = usize::from(region.contains(&point));
        shares[side][(r * STEPS + g) * STEPS + b] += 1.0;
        counts[side] += 1.0;
    }
    let share = |side: usize, color: usize| shares[side][color] / counts[side].max(1.0);
    (0..STEPS * STEPS * STEPS).map(|color| (share(0, color) - share(1, color)).abs()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    /// A bar of 60×24 pixels at (150, 40) on a background with some noise.
    fn photo() -> RgbImage {
        RgbImage::from_fn(320, 240, |x, y| {
            let noise = ((x * 31 + y * 17) % 9) as u8;
            let is_bar = (150..210).contains(&x) && (40..64).contains(&y);
            if is_bar { Rgb([190 + noise, 60, 40]) } else { Rgb([90 + noise, 95 + noise, 100]) }
        })
    }

    fn marked([x1, y1, x2, y2]: [f64; 4], has_outline: bool) -> Annotation {
        let bbox = BoundingBox { x1, y1, x2, y2 };
        let outline = has_outline.then(|| Polygon::from_box(&bbox));
        Annotation { label: "bar".into(), bbox, grasp: None, jaw_width: None, outline }
    }

    #[test]
    fn marks_that_were_meant_otherwise_are_told() {
        const RIGHT: [f64; 4] = [150.0, 40.0, 210.0, 64.0];
        let cases = [
            (RIGHT, None),
            // The margin of a hand-drawn box.
            ([144.0, 35.0, 217.0, 70.0], None),
            ([75.0, 20.0, 105.0, 32.0], Some(MarksReading::HalfSize)),
            ([40.0, 150.0, 64.0, 210.0], Some(MarksReading::Exchanged)),
            ([46.9, 16.7, 65.6, 26.7], Some(MarksReading::Percent)),
        ];
        for (corners, expected) in cases {
            for has_outline in [false, true] {
                let marked = marked(corners, has_outline);
                assert_eq!(other_reading(&photo(), &[&marked]), expected, "{corners:?}, outline: {has_outline}");
            }
        }
        assert_eq!(other_reading(&photo(), &[]), None);
    }

    #[test]
    fn a_border_has_a_sample_per_pixel_but_only_a_limited_number() {
        let square = Polygon::from_box(&BoundingBox { x1: 0.0, y1: 0.0, x2: 30.0, y2: 20.0 });
        assert_eq!(border_samples(&square.vertices).count(), 100);
        // 1,000 teeth of 4,000 pixels.
        let comb: Vec<Point2<f64>> =
            (0..1000).map(|idx| Point2::new(f64::from(idx), f64::from(idx % 2) * 4000.0)).collect();
        let count = border_samples(&comb).count();
        assert!((100_000..=101_000).contains(&count), "{count}");
    }

    #[test]
    fn marks_around_nothing_are_of_another_photo() {
        let noise = |x: u32, y: u32| 90 + (x * x * 31 + y * y * 17 + x * y) as u8 % 25;
        let is_sheet = |x: u32, y: u32| x < 50 && y < 30;
        let ground = RgbImage::from_fn(320, 240, |x, y| Rgb([if is_sheet(x, y) { 240 } else { noise(x, y) }; 3]));
        for corners in [[150.0, 40.0, 210.0, 64.0], [111.0, 92.0, 227.0, 169.0]] {
            for has_outline in [false, true] {
                let marked = marked(corners, has_outline);
                assert_eq!(other_reading(&ground, &[&marked]), Some(MarksReading::OtherPhoto), "{corners:?}");
            }
        }
        let marked = marked([150.0, 40.0, 210.0, 64.0], true);
        let plain = RgbImage::from_pixel(320, 240, Rgb([90, 95, 100]));
        assert!(marks_fit(&photo(), &marked) > 10.0 * marks_fit(&plain, &marked));
    }

    #[test]
    fn dark_photos_faint_ones_and_crops_are_not_of_another_photo() {
        let (bright, right) = (photo(), [150.0, 40.0, 210.0, 64.0]);
        let changed = |change: fn(f64) -> f64| {
            let mut image = bright.clone();
            image.pixels_mut().for_each(|pixel| pixel.0 = pixel.0.map(|value| change(f64::from(value)) as u8));
            image
        };
        for image in [changed(|value| 0.15 * value), changed(|value| 100.0 + 0.12 * value)] {
            for has_outline in [false, true] {
                assert_eq!(other_reading(&image, &[&marked(right, has_outline)]), None);
            }
        }
        let crop = image::imageops::crop_imm(&bright, 142, 32, 76, 40).to_image();
        assert_eq!(other_reading(&crop, &[&marked([8.0, 8.0, 68.0, 32.0], false)]), None);
    }
}
