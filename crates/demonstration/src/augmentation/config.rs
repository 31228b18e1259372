//! The configuration of the augmentation.

use std::ops::RangeInclusive;

use crate::{Error, Result};

/// Minimum width and height of a sample, in pixels.
pub const MIN_SAMPLE_SIDE_PX: u32 = 16;
/// Width and height that a sample may have, in pixels.
const SIDES: RangeInclusive<u32> = MIN_SAMPLE_SIDE_PX..=8192;
/// Photos of up to this many pixels give samples of their own size: phones usually take photos of 4032 × 3024 pixels.
const MAX_OWN_PIXELS: f64 = 4096.0 * 3072.0;
/// Maximum number of pixels of a sample of a larger photo. Derived from a limit of 2 GB: the 48 samples on which a
/// network is validated take 0.9 GB, a prepared photo takes 0.4 GB (40 bytes for each of 1.56 times as many pixels), and
/// a sample in the making 0.1 GB. With [`MAX_OWN_PIXELS`] it would be 3 GB.
const MAX_REDUCED_PIXELS: f64 = 0.5 * MAX_OWN_PIXELS;

/// Settings of an [`Augmenter`](crate::Augmenter).
#[derive(Debug, Clone, PartialEq)]
pub struct AugmentationConfig {
    /// Width and height of the samples in pixels; `None` for the first demonstration's own size, reduced if its photo
    /// has more than 12.6 megapixels or a side above 8192 pixels. Demonstrations of other sizes are scaled to fit.
    pub output_size: Option<[u32; 2]>,
    /// The kind of scenes.
    pub style: AugmentationStyle,
}

/// The two families of samples.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum AugmentationStyle {
    /// The paper's: the photo rotated, tinted, shifted and scaled.
    Paper(PaperStyle),
    /// Composed scenes, with and without the part.
    Scenes(SceneStyle),
}

/// The paper's augmentation, in the order of the fields, as in the published code.
///
/// # Source
/// OpenDR, `control/single_demo_grasp`: imgaug's `Affine(rotate)`, `Multiply(per_channel=0.99)`,
/// `Affine(translate_px)`, `Affine(scale)`, each cropped to the image and filled with black.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperStyle {
    /// Turned by a whole number of degrees in `[-max, max]`.
    pub max_rotation_deg: i32,
    /// Colour channels are multiplied by a number in this range.
    pub channel_gain: [f32; 2],
    /// Probability that each channel has its own factor instead of a common one.
    pub per_channel_probability: f32,
    /// Shifted by a whole number of the photo's pixels in `[-max, max]` along each axis.
    pub max_shift_px: i32,
    /// Scaled about the centre by a number in this range.
    pub scale: [f32; 2],
}

impl Default for PaperStyle {
    fn default() -> Self {
        Self {
            max_rotation_deg: 180,
            channel_gain: [0.4, 1.5],
            per_channel_probability: 0.99,
            max_shift_px: 30,
            scale: [0.75, 1.3],
        }
    }
}

/// The composed scenes; probabilities are per sample.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneStyle {
    /// Fraction of scenes with the part.
    pub positive_share: f32,
    /// Fraction of the scenes with the part that keep the photo's own background.
    pub photo_background_share: f32,
    /// Range of the part's size relative to its size in the photo (fitted to the output).
    pub scale: [f32; 2],
    /// Largest foreshortening, as for an inclined camera; 0.08 corresponds to 23 degrees.
    pub max_foreshortening: f32,
    /// Largest change of scale across the part by perspective.
    pub max_perspective: f32,
    /// Minimum fraction of the part inside the image.
    pub min_inside: f32,
    /// Maximum number of distractors in a scene (half as many around the part on the photo's own background); scenes
    /// without the part have at least one.
    pub max_distractors: usize,
    /// Fraction of the distractors made from pieces of the part itself.
    pub mutant_share: f32,
    /// Fraction of the remaining distractors that are other parts, if the augmenter was given any.
    pub other_part_share: f32,
    /// Probability that an object covers some of the part.
    pub occlusion_probability: f32,
    /// Largest covered fraction of the part.
    pub max_occluded: f32,
    /// Probability of a blurred image.
    pub blur_probability: f32,
    /// Largest standard deviation of sensor noise, in grey values of 255.
    pub max_noise: f32,
    /// Probability of compression artefacts.
    pub jpeg_probability: f32,
}

impl Default for SceneStyle {
    fn default() -> Self {
        Self {
            positive_share: 0.75,
            photo_background_share: 0.5,
            scale: [0.83, 1.2],
            max_foreshortening: 0.08,
            max_perspective: 0.06,
            min_inside: 0.75,
            max_distractors: 5,
            mutant_share: 0.3,
            other_part_share: 0.6,
            occlusion_probability: 0.3,
            max_occluded: 0.25,
            blur_probability: 0.45,
            max_noise: 7.0,
            jpeg_probability: 0.12,
        }
    }
}

impl Default for AugmentationConfig {
    /// Composed scenes in the first demonstration's own size.
    fn default() -> Self {
        Self { output_size: None, style: AugmentationStyle::Scenes(SceneStyle::default()) }
    }
}

impl AugmentationConfig {
    /// The paper's augmentation in the first demonstration's own size.
    pub fn paper() -> Self {
        Self { output_size: None, style: AugmentationStyle::Paper(PaperStyle::default()) }
    }

    /// These settings with samples of `width` × `height` pixels.
    pub fn with_output_size(self, width: u32, height: u32) -> Self {
        Self { output_size: Some([width, height]), ..self }
    }

    /// Refuses invalid settings.
    pub(crate) fn check(&self) -> Result<()> {
        match &self.style {
            AugmentationStyle::Paper(paper) => {
                check_share("per_channel_probability", paper.per_channel_probability)?;
                check_range("channel_gain", paper.channel_gain, [0.0, 10.0])?;
                check_range("scale", paper.scale, [0.1, 10.0])?;
                check_value("max_rotation_deg", paper.max_rotation_deg as f32, [0.0, 180.0])?;
                check_value("max_shift_px", paper.max_shift_px as f32, [0.0, 10_000.0])
            }
            AugmentationStyle::Scenes(scenes) => {
                let shares = [
                    ("positive_share", scenes.positive_share),
                    ("photo_background_share", scenes.photo_background_share),
                    ("min_inside", scenes.min_inside),
                    ("mutant_share", scenes.mutant_share),
                    ("other_part_share", scenes.other_part_share),
                    ("occlusion_probability", scenes.occlusion_probability),
                    ("max_occluded", scenes.max_occluded),
                    ("blur_probability", scenes.blur_probability),
                    ("jpeg_probability", scenes.jpeg_probability),
                ];
                shares.into_iter().try_for_each(|(name, value)| check_share(name, value))?;
                check_range("scale", scenes.scale, [0.1, 10.0])?;
                check_value("max_foreshortening", scenes.max_foreshortening, [0.0, 0.5])?;
                check_value("max_perspective", scenes.max_perspective, [0.0, 0.5])?;
                check_value("max_noise", scenes.max_noise, [0.0, 100.0])?;
                check_value("max_distractors", scenes.max_distractors as f32, [1.0, 50.0])
            }
        }
    }
}

/// Width and height of the samples of a photo if the settings give none: those of the photo, reduced if it is large.
pub fn output_size_of(photo: [u32; 2]) -> [u32; 2] {
    let is_large = pixels(photo) > MAX_OWN_PIXELS;
    sample_size(photo, if is_large { MAX_REDUCED_PIXELS } else { MAX_OWN_PIXELS })
}

/// Width and height of samples of the photo's shape, with at most `max_pixels` and with sides that a sample may have:
/// those of the photo if possible.
pub fn sample_size(photo: [u32; 2], max_pixels: f64) -> [u32; 2] {
    let by_side = f64::from(*SIDES.end()) / f64::from(photo[0].max(photo[1]));
    let shrink = (max_pixels / pixels(photo)).sqrt().min(by_side);
    if shrink >= 1.0 {
        return photo;
    }
    photo.map(|side| ((f64::from(side) * shrink).round() as u32).max(MIN_SAMPLE_SIDE_PX))
}

fn pixels([width, height]: [u32; 2]) -> f64 {
    f64::from(width) * f64::from(height)
}

/// Refuses impossible sizes of samples, from the settings or from the photo.
pub(crate) fn check_output_size([width, height]: [u32; 2]) -> Result<()> {
    if SIDES.contains(&width) && SIDES.contains(&height) {
        Ok(())
    } else {
        refuse(
            "output_size",
            "16 to 8192 pixels a side (set one where the photo has none)",
            format!("{width}×{height}"),
        )
    }
}

fn refuse(setting: &'static str, expected: impl Into<String>, found: String) -> Result<()> {
    Err(Error::Setting { setting, expected: expected.into(), found })
}

fn check_share(setting: &'static str, value: f32) -> Result<()> {
    check_value(setting, value, [0.0, 1.0])
}

fn check_value(setting: &'static str, value: f32, [low, high]: [f32; 2]) -> Result<()> {
    if (low..=high).contains(&value) { Ok(()) } else { refuse(setting, format!("{low} to {high}"), value.to_string()) }
}

fn check_range(setting: &'static str, range: [f32; 2], [low, high]: [f32; 2]) -> Result<()> {
    if low <= range[0] && range[0] <= range[1] && range[1] <= high && range[1] > 0.0 {
        Ok(())
    } else {
        refuse(setting, format!("two rising numbers between {low} and {high}"), format!("{range:?}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_without_sense_are_named() {
        assert!(AugmentationConfig::default().check().is_ok() && AugmentationConfig::paper().check().is_ok());
        let bad = AugmentationConfig {
            style: AugmentationStyle::Scenes(SceneStyle { positive_share: f32::NAN, ..SceneStyle::default() }),
            ..AugmentationConfig::default()
        };
        assert!(bad.check().unwrap_err().to_string().contains("positive_share: expected 0 to 1, found NaN"));
        assert!(check_output_size([0, 240]).is_err() && check_output_size([320, 240]).is_ok());
        assert!(check_output_size([30_000, 100]).unwrap_err().to_string().contains("30000×100"));
    }

    #[test]
    fn samples_of_a_large_photo_are_smaller() {
        for own in [[640, 480], [10, 10], [4032, 3024], [3072, 4096], [8192, 64]] {
            assert_eq!(output_size_of(own), own);
        }
        // √(6,291,456 / 63,000,000) = 0.316.
        assert_eq!(output_size_of([9000, 7000]), [2844, 2212]);
        // 8192 / 9000 = 0.910.
        assert_eq!(output_size_of([9000, 64]), [8192, 58]);
        assert_eq!(output_size_of([64, 9000]), [58, 8192]);
        assert_eq!(sample_size([1280, 960], 640.0 * 480.0), [640, 480]);
        // 13 to 200 megapixels: all samples can be made, and none has more pixels than that.
        for large in [[4160, 3120], [16_384, 12_288], [200_000, 1000], [1_000_000, 20]] {
            let size = output_size_of(large);
            assert!(check_output_size(size).is_ok(), "{large:?}: {size:?}");
            assert!(pixels(size) < 1.01 * MAX_REDUCED_PIXELS, "{large:?}: {size:?}");
        }
    }
}
