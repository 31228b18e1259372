//! Samples by index.

use sdg_geometry::BoundingBox;

use super::background::NoiseBank;
use super::config::{AugmentationConfig, AugmentationStyle, check_output_size, output_size_of};
use super::homography::Homography;
use super::noise::NormalTable;
use super::paper::PaperDraw;
use super::prepared::Prepared;
use super::random::{Stream, index_below, sample_rng};
use super::sample::{Sample, SampleObject};
use super::scene::Studio;
use crate::{Demonstration, Error, Result};

/// Width and height of a window relative to the part's largest diameter. In smaller windows the part fits only at some
/// angles.
const WINDOW_OVER_PART: [f64; 2] = [1.3, 1.05];
/// Minimum width and height of a part's box in the paper's samples, in pixels; readers of annotations refuse smaller
/// boxes.
const MIN_SHOWN_PX: f64 = 1.0;

/// Makes samples from demonstrations: sample *i* of seed *s* is always the same, in any order of calls.
///
/// Everything that does not depend on the sample is computed by [`new`](Self::new); a sample then needs only
/// `&self`, so that any number of threads may call it.
pub struct Augmenter {
    parts: Vec<Prepared>,
    others: Vec<Prepared>,
    config: AugmentationConfig,
    /// Width and height of the samples.
    frame: [u32; 2],
    seed: u64,
    noises: NoiseBank,
    normal: NormalTable,
}

impl Augmenter {
    /// Prepares the demonstrations.
    ///
    /// # Errors
    /// No demonstration, invalid settings, or an annotation that does not lie on its image.
    pub fn new(demonstrations: &[Demonstration], config: AugmentationConfig, seed: u64) -> Result<Self> {
        config.check()?;
        let Some(first) = demonstrations.first() else {
            return Err(Error::Setting {
                setting: "demonstrations",
                expected: "at least one".into(),
                found: "none".into(),
            });
        };
        demonstrations.iter().try_for_each(Demonstration::check)?;
        let frame = config.output_size.unwrap_or_else(|| output_size_of(first.image.dimensions().into()));
        check_output_size(frame)?;
        let mut rng = sample_rng(seed, Stream::Preparation, 0);
        let parts = demonstrations.iter().map(|one| Prepared::new(one, frame, &mut rng)).collect();
        let (noises, normal) = (NoiseBank::new(&mut rng), NormalTable::new(&mut rng));
        Ok(Self { parts, others: Vec::new(), config, frame, seed, noises, normal })
    }

    /// Adds other parts to the distractors: they are cut out of their photos along their outlines. Their other marks
    /// are not used.
    ///
    /// # Errors
    /// An annotation that does not lie on its image, or has no outline for cutting out the part.
    pub fn with_other_parts(mut self, others: &[Demonstration]) -> Result<Self> {
        let mut rng = sample_rng(self.seed, Stream::OtherParts, 0);
        for other in others {
            other.check()?;
            other.annotation.require_outline()?;
            self.others.push(Prepared::without_mutants(other, self.frame, &mut rng));
        }
        Ok(self)
    }

    /// Only windows of the frame, just large enough for the part at any angle and size, so that most of a network's
    /// computation concerns the part. Scale, tables and light are those of whole frames; distractors are fewer. Sides
    /// are multiples of `multiple` pixels, or the frame's sides if those are smaller; the paper's samples stay whole.
    pub fn windows(&self, multiple: u32) -> Windows<'_> {
        let mut size = self.frame;
        if let AugmentationStyle::Scenes(style) = &self.config.style {
            let max_scale = f64::from(style.scale[1]);
            let diameter = self.parts.iter().map(|p| 2.0 * p.radius * p.nominal_scale * max_scale).fold(0.0, f64::max);
            let side = |share: f64, frame: u32| {
                let least = (share * diameter).ceil().min(f64::from(frame)) as u32;
                (least.div_ceil(multiple) * multiple).min(frame)
            };
            // Slightly wider than high, like frames.
            let [width, height] = self.frame;
            size = [side(WINDOW_OVER_PART[0], width), side(WINDOW_OVER_PART[1], height)];
        }
        Windows { augmenter: self, size }
    }

    /// Sample `index` of the training stream.
    pub fn sample(&self, index: u64) -> Sample {
        self.draw(Stream::Training, index, self.frame)
    }

    /// Sample `index` of a stream separate from that of [`sample`](Self::sample), for validation.
    pub fn held_out(&self, index: u64) -> Sample {
        self.draw(Stream::HeldOut, index, self.frame)
    }

    /// Width and height of the samples, in pixels.
    pub fn output_size(&self) -> [u32; 2] {
        self.frame
    }

    /// The settings.
    pub fn config(&self) -> &AugmentationConfig {
        &self.config
    }

    fn draw(&self, stream: Stream, index: u64, size: [u32; 2]) -> Sample {
        let mut rng = sample_rng(self.seed, stream, index);
        match &self.config.style {
            AugmentationStyle::Paper(style) => {
                let demonstration_idx = index_below(&mut rng, self.parts.len());
                let part = &self.parts[demonstration_idx];
                let draw = PaperDraw::draw(style, &mut rng);
                let [width, height] = size;
                let pose = draw.image_from_photo(part, width, height);
                let object = SampleObject {
                    image_from_demonstration: pose,
                    ..SampleObject::new(part, &Homography::from_similarity(&pose), size, demonstration_idx)
                };
                // OpenDR's boxes are hulls of the rotated box, independent of the outline.
                let hull = BoundingBox::around(part.drawn_box.corners().iter().map(|corner| pose.apply(corner)));
                let bbox = hull.map_or(object.bbox, |hull| hull.clip(f64::from(width), f64::from(height)));
                // The paper's shifts and turns may move a part near the photo's border out of the sample.
                let is_shown = bbox.width() >= MIN_SHOWN_PX && bbox.height() >= MIN_SHOWN_PX;
                let objects = if is_shown { vec![SampleObject { bbox, ..object }] } else { Vec::new() };
                Sample { image: draw.paint(part, width, height), objects }
            }
            AugmentationStyle::Scenes(style) => {
                let studio = Studio {
                    parts: &self.parts,
                    others: &self.others,
                    style,
                    noises: &self.noises,
                    normal: &self.normal,
                    size,
                    frame: self.frame,
                };
                studio.compose(&mut rng)
            }
        }
    }
}

/// An [`Augmenter`]'s samples, cropped to windows.
pub struct Windows<'a> {
    augmenter: &'a Augmenter,
    size: [u32; 2],
}

impl Windows<'_> {
    /// Sample `index` of the training stream.
    pub fn sample(&self, index: u64) -> Sample {
        self.augmenter.draw(Stream::Training, index, self.size)
    }

    /// Width and height of the windows, in pixels.
    pub fn output_size(&self) -> [u32; 2] {
        self.size
    }
}
