//! The scale of the photo, given to a model that was taught without a camera.

use image::imageops::{self, FilterType};

use crate::error::Result;
use crate::lengths::Lengths;
use crate::model::GraspModel;
use crate::taught::TaughtDemonstration;

impl GraspModel {
    /// The model for calibrated cameras, as if its photos had been taken vertically from above at a large distance.
    /// `lengths` gives the pixels of the first photo per metre of the part's surface; finer photos are reduced to
    /// `max_pixels_per_m`, a resolution typical of cameras above a table. The part is assumed to have the same length
    /// in all photos.
    ///
    /// # Errors
    /// Impossible lengths, and a part that is too small in the reduced photo.
    pub fn with_lengths(self, lengths: Lengths, max_pixels_per_m: f64) -> Result<Self> {
        lengths.check()?;
        let pixels_per_m = lengths.pixels_per_m.min(max_pixels_per_m);
        let longest = |demonstration: &TaughtDemonstration| {
            let bounds = demonstration.marks.region().bounds();
            bounds.width().max(bounds.height())
        };
        let length_px = longest(&self.demonstrations[0]) * pixels_per_m / lengths.pixels_per_m;
        let demonstrations = self.demonstrations.into_iter().map(|demonstration| {
            let factor = length_px / longest(&demonstration);
            resized(demonstration, factor)
        });
        let demonstrations = demonstrations.collect::<Result<_>>()?;
        let mut facts = self.facts;
        facts.lengths = Some(Lengths { pixels_per_m, ..lengths });
        Ok(Self { demonstrations, facts, ..self })
    }
}

fn resized(demonstration: TaughtDemonstration, factor: f64) -> Result<TaughtDemonstration> {
    let check = demonstration.check().clone();
    let TaughtDemonstration { cutout, marks, .. } = demonstration;
    let side = |length: u32| ((f64::from(length) * factor).round() as u32).max(1);
    // Marks are scaled by the ratio of the whole numbers of pixels.
    let factor = f64::from(side(cutout.width())) / f64::from(cutout.width());
    let marks = marks.resized(factor);
    let cutout = imageops::resize(&cutout, side(cutout.width()), side(cutout.height()), FilterType::Triangle);
    TaughtDemonstration::with_config(cutout, marks, check)
}
