//! Samples made from the marks as they are now, to see what a model will learn from.

use std::sync::{Arc, Mutex, PoisonError};

use sdg_demonstration::{AugmentationConfig, Augmenter, Demonstration};
use sdg_geometry::{GraspLine, PlanarGrasp};
use sdg_report::{Color, Pen, draw_grasp_jaws, draw_polygon};

use crate::error::{Error, Result};
use crate::gripper::Gripper;
use crate::marks::Marks;
use crate::picture::jpeg;
use crate::session::Session;

/// Longer side of a sample on the sheet.
const SAMPLE_PX: f64 = 400.0;
/// Line width of the marks on a sample.
const PEN_PX: f64 = 1.6;

/// The augmenter of the marks that were asked for last: preparing it costs more than a sample.
#[derive(Default)]
pub struct Previews(Mutex<Option<Arc<Prepared>>>);

struct Prepared {
    image_id: usize,
    marks: Marks,
    seed: u64,
    jaw_width: f64,
    augmenter: Augmenter,
}

/// Sample `index` of `seed` of a marked picture, with the grasp drawn where the marks went, as JPEG.
///
/// # Errors
/// No such picture, marks that cannot be taught.
pub fn sample(session: &Session, image_id: usize, seed: u64, index: u64) -> Result<Vec<u8>> {
    let prepared = prepared(session, image_id, seed)?;
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

fn prepared(session: &Session, image_id: usize, seed: u64) -> Result<Arc<Prepared>> {
    let mut kept = session.previews.0.lock().unwrap_or_else(PoisonError::into_inner);
    let marks = session.marks(image_id)?;
    if let Some(kept) = kept.as_ref().filter(|k| k.image_id == image_id && k.seed == seed && k.marks == marks) {
        return Ok(Arc::clone(kept));
    }
    let demonstration = session.demonstration(image_id)?;
    let jaw_width = jaw_width(&demonstration);
    let (width, height) = demonstration.image.dimensions();
    let scale = (SAMPLE_PX / f64::from(width.max(height))).min(1.0);
    let scaled = |side: u32| (f64::from(side) * scale).round().max(1.0) as u32;
    let config = AugmentationConfig::default().with_output_size(scaled(width), scaled(height));
    let name = || format!("sample of picture {image_id}");
    let augmenter = Augmenter::new(&[demonstration], config, seed)
        .map_err(|source| Error::Demonstration { name: name(), source })?;
    let prepared = Arc::new(Prepared { image_id, marks, seed, jaw_width, augmenter });
    *kept = Some(Arc::clone(&prepared));
    Ok(prepared)
}

fn jaw_width(demonstration: &Demonstration) -> f64 {
    let annotation = &demonstration.annotation;
    let fitting = |line| Gripper { line, jaw_width: 0.0 }.least_jaw_width(&annotation.region());
    annotation.jaw_width.or_else(|| annotation.grasp.map(fitting)).unwrap_or_default()
}
