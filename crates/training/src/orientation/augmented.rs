//! Crops with their true angle, made from demonstrations.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_demonstration::{Augmenter, Demonstration, Sample};
use sdg_geometry::Angle;

use super::config::CropStyle;
use super::labelled_crop::LabelledCrop;
use crate::error::TrainingError;

/// Makes crops from augmented scenes: scene *i* of a seed always gives the same crops.
pub struct AugmentedCrops {
    augmenter: Augmenter,
    style: CropStyle,
    size_px: u32,
    seed: u64,
}

/// Separate streams of one seed.
#[derive(Clone, Copy)]
enum Stream {
    Training = 0x6f72_6965,
    HeldOut = 0x6865_6c64,
}

impl AugmentedCrops {
    /// Prepares the demonstrations for crops of `size_px` pixels per side.
    ///
    /// # Errors
    /// No demonstration, or one that lacks a grasp line or does not lie on its image.
    pub fn new(
        demonstrations: &[Demonstration],
        style: &CropStyle,
        size_px: u32,
        seed: u64,
    ) -> Result<Self, TrainingError> {
        for demonstration in demonstrations {
            demonstration.annotation.require_grasp()?;
        }
        let augmenter = Augmenter::new(demonstrations, style.augmentation.clone(), seed)?;
        Ok(Self { augmenter, style: style.clone(), size_px, seed })
    }

    /// The crops of a scene of the training stream; none if the part is not visible.
    pub fn scene(&self, scene_idx: u64) -> Vec<LabelledCrop> {
        let scene_idx = self.style.distinct_scenes.map_or(scene_idx, |distinct| scene_idx % distinct);
        let mut rng = self.rng(Stream::Training, scene_idx);
        let sample = self.augmenter.sample(scene_idx);
        (0..self.style.crops_per_scene).filter_map(|_| self.crop(&sample, &mut rng)).collect()
    }

    /// A crop of a held-out scene, which [`scene`](Self::scene) never uses; `None` if the part is not visible.
    pub fn held_out(&self, scene_idx: u64) -> Option<LabelledCrop> {
        self.crop(&self.augmenter.held_out(scene_idx), &mut self.rng(Stream::HeldOut, scene_idx))
    }

    fn rng(&self, stream: Stream, scene_idx: u64) -> Pcg64Mcg {
        let address = self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ ((stream as u64) << 32);
        Pcg64Mcg::seed_from_u64(address.wrapping_add(scene_idx))
    }

    fn crop(&self, sample: &Sample, rng: &mut Pcg64Mcg) -> Option<LabelledCrop> {
        let object = sample.objects.first()?;
        // Without an outline, the part's box in a rotated window is unknown.
        let turned = self.style.turned && object.outline.is_some();
        let turn = Angle::from_degrees(if turned { rng.random_range(-180.0..180.0) } else { 0.0 });
        LabelledCrop::of(object, &sample.image, turn, &self.style.jitter, self.size_px, rng)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orientation::{BoxJitter, OrientationTraining};
    use image::{Rgb, RgbImage};
    use sdg_demonstration::Annotation;
    use sdg_geometry::{BoundingBox, GraspLine, Polygon};

    /// Tolerance between the marked direction and the direction measured on a small crop.
    const DIRECTION_TOLERANCE_DEGREES: f64 = 8.0;

    /// A bar from red to green on dark grey, its grasp line from the red end to the green one.
    fn bar() -> Demonstration {
        let image = RgbImage::from_fn(320, 240, |x, y| {
            let inside = (110..210).contains(&x) && (105..135).contains(&y);
            Rgb(match (inside, x < 160) {
                (true, true) => [230, 20, 20],
                (true, false) => [20, 230, 20],
                (false, _) => [40, 40, 40],
            })
        });
        let bbox = BoundingBox { x1: 110.0, y1: 105.0, x2: 210.0, y2: 135.0 };
        let grasp = Some(GraspLine::new([120.0, 120.0].into(), [200.0, 120.0].into()));
        let annotation =
            Annotation { label: "bar".into(), bbox, grasp, jaw_width: None, outline: Some(Polygon::from_box(&bbox)) };
        Demonstration { image, annotation }
    }

    /// The direction from the mean position of the red pixels to that of the green pixels.
    fn measured_direction(crop: &RgbImage) -> Angle {
        let center = |wanted: usize, other: usize| {
            let (mut x_sum, mut y_sum, mut weight_sum) = (0.0, 0.0, 0.0);
            for (x, y, pixel) in crop.enumerate_pixels() {
                let (this, that) = (f64::from(pixel[wanted]), f64::from(pixel[other]));
                let weight = if this > 2.5 * that + 25.0 { 1.0 } else { 0.0 };
                x_sum += weight * f64::from(x);
                y_sum += weight * f64::from(y);
                weight_sum += weight;
            }
            (x_sum / weight_sum, y_sum / weight_sum)
        };
        let ((red_x, red_y), (green_x, green_y)) = (center(0, 1), center(1, 0));
        Angle::from_direction(green_x - red_x, green_y - red_y)
    }

    #[test]
    fn the_label_is_what_the_crop_shows() {
        let mut style = OrientationTraining::edge(1).crops;
        // The part on its own table with at most one distractor, so that little else in the picture is red or green.
        if let sdg_demonstration::AugmentationStyle::Scenes(scenes) = &mut style.augmentation.style {
            scenes.photo_background_share = 1.0;
            scenes.max_distractors = 1;
            scenes.occlusion_probability = 0.0;
            scenes.max_noise = 0.0;
        }
        let crops = AugmentedCrops::new(&[bar()], &style, 48, 11).unwrap();
        let mut errors: Vec<f64> = (0..12)
            .flat_map(|scene| crops.scene(scene))
            .map(|one| measured_direction(&one.crop).distance(one.angle).to_degrees())
            .collect();
        assert_eq!(errors.len(), 48);
        // A distractor may also be red, or a colour cast may hide the colours, but not in most scenes.
        errors.sort_by(f64::total_cmp);
        assert!(errors[36] < DIRECTION_TOLERANCE_DEGREES, "{errors:?}");
    }

    #[test]
    fn scenes_repeat_and_held_out_ones_differ() {
        let style = CropStyle { distinct_scenes: Some(3), ..OrientationTraining::edge(1).crops };
        let crops = AugmentedCrops::new(&[bar()], &style, 32, 11).unwrap();
        assert_eq!(crops.scene(1), crops.scene(4));
        let [one, two, ..] = &crops.scene(1)[..] else { panic!("four crops a scene") };
        assert_ne!(one.angle, two.angle);
        assert_ne!(crops.held_out(1).as_ref(), Some(one));
    }

    #[test]
    fn without_an_outline_windows_stay_straight() {
        let mut plain = bar();
        plain.annotation.outline = None;
        let style = CropStyle { jitter: BoxJitter::NONE, ..OrientationTraining::edge(1).crops };
        let crops = AugmentedCrops::new(&[plain], &style, 32, 11).unwrap().scene(0);
        assert!(crops.iter().all(|crop| crop == &crops[0]));
    }

    #[test]
    fn a_demonstration_without_a_grasp_line_is_an_error() {
        let mut unmarked = bar();
        unmarked.annotation.grasp = None;
        assert!(AugmentedCrops::new(&[unmarked], &OrientationTraining::edge(1).crops, 32, 1).is_err());
    }
}
