//! The scale of the photo, given to a model that was taught without a camera.

use image::imageops::{self, FilterType};

use crate::error::Result;
use crate::lengths::Lengths;
use crate::model::GraspModel;
use crate::taught::TaughtDemonstration;

impl GraspModel {
    /// The same model for calibrated cameras, as if its photos had been taken from straight above and far away. `lengths` say how
    /// many pixels of the first photo a metre of the part's surface has; finer photos are made as coarse as `max_pixels_per_m`,
    /// with which cameras over a table are served better. Of several photos each is taken to show the part as long as the first.
    ///
    /// # Errors
    /// Lengths that no part has, and a part of which the coarser photo shows too little.
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
    // Marks go with the pixels, of which there is a whole number.
    let factor = f64::from(side(cutout.width())) / f64::from(cutout.width());
    let marks = marks.resized(factor);
    let cutout = imageops::resize(&cutout, side(cutout.width()), side(cutout.height()), FilterType::Triangle);
    TaughtDemonstration::with_config(cutout, marks, check)
}
