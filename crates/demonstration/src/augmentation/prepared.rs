//! Data computed once per demonstration, so that a sample needs only warps and painting.

use image::imageops::{self, FilterType};
use nalgebra::Point2;
use sdg_geometry::{BoundingBox, Keypoint, Polygon};

use super::distance::signed_distance;
use super::homography::Homography;
use super::mutant::Mutant;
use super::random::{SampleRng, index_below};
use super::warp::LanePicture;
use crate::erase::fill;
use crate::raster::Raster;
use crate::{Demonstration, NUM_KEYPOINTS};

/// Resolution of the stored photo relative to the output, but at most the photo's own resolution. With this value a
/// part stays sharp when enlarged, and needs little averaging when reduced.
const OVERSAMPLING: f64 = 1.25;

/// Rasters are in *prepared* pixels, points in pixels of the demonstration's photo.
pub(crate) struct Prepared {
    /// Prepared pixels per photo pixel.
    pub prepared_from_photo: f64,
    /// Output pixels per photo pixel when the photo is scaled to fit the output.
    pub nominal_scale: f64,
    /// Width and height of the photo.
    pub photo_size: [f64; 2],
    /// The photo; the fourth float is the signed distance to the part's outline, in prepared pixels, positive inside.
    pub photo: Raster,
    /// The photo again, for warps of the whole photo in 8 bits.
    pub lanes: LanePicture,
    /// The photo without the part.
    pub background: Raster,
    /// The outline, or the box.
    pub region: Polygon,
    pub has_outline: bool,
    /// Whether the region reaches the outermost pixels of the prepared photo.
    touches_border: bool,
    /// The box, in photo pixels.
    pub drawn_box: BoundingBox,
    /// The centre of the region.
    pub center: Point2<f64>,
    /// Distance from the centre to the farthest vertex, in photo pixels.
    pub radius: f64,
    /// Points spread evenly over the region.
    pub area_points: Vec<Point2<f64>>,
    /// The keypoints on the grasp line; empty if no grasp is marked.
    pub keypoints: Vec<Keypoint>,
    /// Colours of the part.
    pub colors: Vec<[f32; 3]>,
    /// Ways to make distractors from the part's pieces.
    pub mutants: Vec<Mutant>,
}

impl Prepared {
    pub fn new(demonstration: &Demonstration, output: [u32; 2], rng: &mut SampleRng) -> Self {
        let mut prepared = Self::without_mutants(demonstration, output, rng);
        prepared.mutants = Mutant::bank(&prepared.region, prepared.center, &prepared.area_points, rng);
        prepared
    }

    /// Like [`Self::new`], without [`Self::mutants`], which take most of the time.
    pub fn without_mutants(demonstration: &Demonstration, output: [u32; 2], rng: &mut SampleRng) -> Self {
        let image = &demonstration.image;
        let photo_size = [f64::from(image.width()), f64::from(image.height())];
        let nominal_scale = (f64::from(output[0]) / photo_size[0]).min(f64::from(output[1]) / photo_size[1]);
        let wanted = (nominal_scale * OVERSAMPLING).min(1.0);
        let reduced = (wanted < 1.0).then(|| {
            let side = |length: f64| ((length * wanted).round() as u32).max(1);
            // The triangle filter widens with the reduction, so that fine structure is averaged and not skipped.
            imageops::resize(image, side(photo_size[0]), side(photo_size[1]), FilterType::Triangle)
        });
        let kept = reduced.as_ref().unwrap_or(image);
        let (lanes, mut photo) = (LanePicture::from_image(kept), Raster::from_image(kept));
        // One factor for both axes, that of the longer side: the rounding of the shorter side is then below half a
        // pixel over the whole photo.
        let longer = usize::from(photo_size[1] > photo_size[0]);
        let prepared_from_photo = [photo.width, photo.height][longer] as f64 / photo_size[longer];

        let annotation = &demonstration.annotation;
        let region = annotation.region();
        let prepared_region = region.scaled(prepared_from_photo, prepared_from_photo);
        let bounds = prepared_region.bounds();
        let [right, bottom] = [photo.width, photo.height].map(|side| side as f64 - 1.0);
        let touches_border = bounds.x1 < 1.0 || bounds.y1 < 1.0 || bounds.x2 > right || bounds.y2 > bottom;
        let distance = signed_distance(&prepared_region, photo.width, photo.height);
        for (pixel, &distance) in photo.pixels.iter_mut().zip(&distance) {
            pixel[3] = distance;
        }
        let area_points = spread(&region);
        let center = Point2::from(
            area_points.iter().fold(nalgebra::Vector2::zeros(), |sum, p| sum + p.coords) / area_points.len() as f64,
        );
        let radius = region.vertices.iter().map(|v| (v - center).norm()).fold(1.0, f64::max);

        // With a margin, because a drawn outline may lie inside the true one, and because the part casts a shadow.
        let margin = (0.06 * radius * prepared_from_photo).clamp(2.0, 12.0) as f32;
        let hole: Vec<bool> = distance.iter().map(|&d| d > -margin).collect();
        let background = fill(&photo, &hole);

        let colors = (0..24)
            .map(|_| {
                let p = area_points[index_below(rng, area_points.len())] * prepared_from_photo;
                let [r, g, b, _] = photo.nearest(p.x as f32, p.y as f32);
                [r, g, b]
            })
            .collect();
        let keypoints = annotation.grasp.as_ref().map(|line| line.keypoints(NUM_KEYPOINTS)).unwrap_or_default();
        Self {
            prepared_from_photo,
            nominal_scale,
            photo_size,
            photo,
            lanes,
            background,
            region,
            has_outline: annotation.outline.is_some(),
            touches_border,
            drawn_box: annotation.bbox,
            center,
            radius,
            area_points,
            keypoints,
            colors,
            mutants: Vec::new(),
        }
    }

    /// The distance to the outline at a prepared pixel, positive inside, from that of the nearest pixel of the photo: a
    /// part at the photo's border ends there, instead of continuing with the border's pixels.
    #[inline(always)]
    pub fn ended_at_border(&self, distance: f32, u: f32, v: f32) -> f32 {
        if !self.touches_border {
            return distance;
        }
        let from_border = u.min(self.photo.width as f32 - u).min(v).min(self.photo.height as f32 - v);
        distance.min(from_border)
    }

    /// The map from output pixels to prepared pixels, for the warp of the rasters.
    pub fn prepared_from_image(&self, image_from_photo: &Homography) -> Homography {
        Homography::scaling(self.prepared_from_photo).compose(&image_from_photo.inverse())
    }
}

/// About 200 points distributed evenly over the inside of a polygon.
fn spread(region: &Polygon) -> Vec<Point2<f64>> {
    const WANTED: f64 = 200.0;
    let bounds = region.bounds();
    let mut step = (region.area() / WANTED).sqrt();
    loop {
        let mut points = Vec::new();
        let mut y = bounds.y1 + 0.5 * step;
        while y < bounds.y2 {
            let mut x = bounds.x1 + 0.5 * step;
            while x < bounds.x2 {
                let point = Point2::new(x, y);
                if region.contains(&point) {
                    points.push(point);
                }
                x += step;
            }
            y += step;
        }
        // A narrow polygon may contain no grid point.
        if points.len() >= 20 {
            return points;
        }
        if step < 1e-3 {
            return region.vertices.clone();
        }
        step *= 0.5;
    }
}

#[cfg(test)]
mod tests {
    use image::{Rgb, RgbImage};

    use super::super::random::{Stream, sample_rng};
    use super::*;
    use crate::Annotation;

    #[test]
    fn marks_at_the_bottom_of_a_tall_photo_stay_on_their_pixels() {
        // A white square about (150, 2900).
        let dot = Point2::new(150.0, 2900.0);
        let is_dot = |x: u32, y: u32| (130..170).contains(&x) && (2880..2920).contains(&y);
        let image = RgbImage::from_fn(300, 3000, |x, y| Rgb([if is_dot(x, y) { 255 } else { 0 }; 3]));
        let bbox = BoundingBox { x1: 60.0, y1: 2700.0, x2: 240.0, y2: 2960.0 };
        let outline = Some(Polygon::from_box(&bbox));
        let annotation = Annotation { label: "part".into(), bbox, grasp: None, jaw_width: None, outline };
        let mut rng = sample_rng(1, Stream::Preparation, 0);
        // 31.4 × 313.75 pixels, rounded to 31 × 314.
        let part = Prepared::without_mutants(&Demonstration { image, annotation }, [100, 251], &mut rng);
        let width = part.photo.width;
        assert_eq!((width, part.photo.height), (31, 314));
        let (mut sum, mut weight) = (nalgebra::Vector2::<f64>::zeros(), 0.0);
        for (at, pixel) in part.photo.pixels.iter().enumerate() {
            let red = f64::from(pixel[0]);
            sum += red * nalgebra::Vector2::new((at % width) as f64 + 0.5, (at / width) as f64 + 0.5);
            weight += red;
        }
        let seen = Point2::from(sum / weight);
        assert!((seen - dot * part.prepared_from_photo).norm() < 0.5, "{seen}");
    }

    #[test]
    fn points_are_spread_over_a_thin_sliver_too() {
        let corners = [(10.0, 10.0), (200.0, 30.0), (200.0, 31.0)];
        let sliver = Polygon::new(corners.map(|(x, y)| Point2::new(x, y)).to_vec()).unwrap();
        let points = spread(&sliver);
        assert!(points.len() >= 20 && points.iter().all(|p| sliver.contains(p)));
        let square =
            Polygon::new([(0.0, 0.0), (9.0, 0.0), (9.0, 9.0), (0.0, 9.0)].map(|(x, y)| Point2::new(x, y)).to_vec());
        assert!((150..250).contains(&spread(&square.unwrap()).len()));
    }
}
