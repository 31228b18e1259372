//! The scale of the photo, given to a model that was taught without a camera.

use image::imageops::{self, FilterType};

use crate::error::Result;
use crate::lengths::Lengths;
use crate::model::GraspModel;
use crate::search_window::extents;
use crate::taught::TaughtDemonstration;
use crate::taught_marks::whole_size;

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
        // The diameter does not depend on the part's rotation. Photos by a calibrated camera have one scale.
        let length = |demonstration: &TaughtDemonstration| match self.facts.lengths {
            Some(_) => 1.0,
            None => extents(&demonstration.marks.region())[0],
        };
        let length_px = length(&self.demonstrations[0]) * pixels_per_m / lengths.pixels_per_m;
        let resized =
            |demonstration: &TaughtDemonstration| resized(demonstration.clone(), length_px / length(demonstration));
        let demonstrations = self.demonstrations.iter().map(resized).collect::<Result<Vec<_>>>()?;
        let network = self.network.map(|network| network.with_demonstrations(&demonstrations)).transpose()?;
        let mut facts = self.facts;
        facts.lengths = Some(Lengths { pixels_per_m, ..lengths });
        Ok(Self { demonstrations, network, facts, ..self })
    }
}

fn resized(demonstration: TaughtDemonstration, factor: f64) -> Result<TaughtDemonstration> {
    let check = demonstration.check().clone();
    let TaughtDemonstration { cutout, marks, .. } = demonstration;
    let own = [cutout.width(), cutout.height()];
    let [width, height] = whole_size(own, factor);
    let marks = marks.resized(own, [width, height]);
    let cutout = imageops::resize(&cutout, width, height, FilterType::Triangle);
    TaughtDemonstration::with_config(cutout, marks, check)
}

#[cfg(all(test, feature = "teach"))]
mod tests {
    use super::*;
    use crate::drawn_part::{at, demonstration, demonstration_at, taught};

    #[test]
    fn a_part_that_is_rotated_in_another_photo_has_the_same_size() {
        const SIZE: [u32; 2] = [320, 240];
        let model = taught(&[demonstration(SIZE), demonstration_at(SIZE, &at(150.0, 110.0, 40.0))]);
        let scaled = model.with_lengths(Lengths::of_level_photos(1000.0, 0.01, 0.005), 700.0).unwrap();
        let [first, second] = scaled.demonstrations() else { panic!("two photos") };
        assert!((first.marks.grasp.length() - 0.7 * 30.0).abs() < 0.5, "{:?}", first.marks.grasp);
        assert!(
            (first.marks.grasp.length() / second.marks.grasp.length()).ln().abs() < 0.03,
            "{:?}",
            second.marks.grasp
        );
    }
}
