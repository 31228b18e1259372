//! Samples made from the current marks: a preview of the training data.

use std::sync::{Arc, Mutex, PoisonError};

use sdg_demonstration::{AugmentationConfig, Augmenter, Demonstration, sample_size};
use sdg_geometry::{GraspLine, PlanarGrasp};
use sdg_report::{Color, Pen, draw_grasp_jaws, draw_polygon};

use crate::error::{Error, Result};
use crate::gripper::Gripper;
use crate::marks::Marks;
use crate::picture::jpeg;

/// Longer side of a sample on the sheet; the shorter one has the least side of a sample or more.
const SAMPLE_PX: f64 = 400.0;
/// Line width of the marks on a sample.
const PEN_PX: f64 = 1.6;

/// The augmenter of the last requested marks: preparing it takes longer than making a sample.
#[derive(Default)]
pub struct Previews(Mutex<Option<Arc<Prepared>>>);

/// The inputs of a sample besides the picture.
#[derive(PartialEq)]
pub struct SampleKey {
    pub image_id: usize,
    pub marks: Marks,
    pub seed: u64,
}

struct Prepared {
    key: SampleKey,
    jaw_width: f64,
    augmenter: Augmenter,
}

impl Previews {
    /// Sample `index` of `key` as JPEG, with the transformed grasp drawn on it. `demonstration` is called only if the
    /// key differs from the last one.
    ///
    /// # Errors
    /// The errors of `demonstration`; the marks are unsuitable for teaching.
    pub fn sample(
        &self,
        key: SampleKey,
        demonstration: impl FnOnce() -> Result<Demonstration>,
        index: u64,
    ) -> Result<Vec<u8>> {
        let prepared = self.prepare(key, demonstration)?;
        let mut sample = prepared.augmenter.sample(index);
        for object in &sample.objects {
            if let Some(outline) = &object.outline {
                draw_polygon(&mut sample.image, outline, &Pen::new(Color::OUTLINE).width(PEN_PX));
            }
            if let [first, .., last] = object.keypoints[..]
                && first.is_labelled()
                && last.is_labelled()
            {
                let line = GraspLine::new(first.point(), last.point());
                let scale = object.image_from_demonstration.scale;
                let grasp = PlanarGrasp::from_line(&line, prepared.jaw_width * scale);
                draw_grasp_jaws(&mut sample.image, &grasp, &Pen::new(Color::GRASP).width(PEN_PX));
            }
        }
        Ok(jpeg(&sample.image))
    }

    fn prepare(&self, key: SampleKey, demonstration: impl FnOnce() -> Result<Demonstration>) -> Result<Arc<Prepared>> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kept) = kept.as_ref().filter(|kept| kept.key == key) {
            return Ok(Arc::clone(kept));
        }
        let demonstration = demonstration()?;
        let jaw_width = jaw_width(&demonstration);
        let (width, height) = demonstration.image.dimensions();
        let shape = f64::from(width.min(height)) / f64::from(width.max(height));
        let [width, height] = sample_size([width, height], SAMPLE_PX * SAMPLE_PX * shape);
        let config = AugmentationConfig::default().with_output_size(width, height);
        let name = || format!("sample of picture {}", key.image_id);
        let augmenter = Augmenter::new(&[demonstration], config, key.seed)
            .map_err(|source| Error::Demonstration { name: name(), source })?;
        let prepared = Arc::new(Prepared { key, jaw_width, augmenter });
        *kept = Some(Arc::clone(&prepared));
        Ok(prepared)
    }
}

fn jaw_width(demonstration: &Demonstration) -> f64 {
    let annotation = &demonstration.annotation;
    let fitting = |line| Gripper { line, jaw_width: 0.0 }.min_jaw_width(&annotation.region());
    annotation.jaw_width.or_else(|| annotation.grasp.map(fitting)).unwrap_or_default()
}
