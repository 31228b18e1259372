//! Model S: no network. The demonstration is looked for in the whole image; the other models ask this for a second
//! opinion.

use sdg_shape::Match;

use crate::taught::TaughtDemonstration;
use crate::verification::{Overlay, Scene, usual_scale};

/// Every place in the image where a demonstration agrees well enough to be mentioned.
pub(crate) fn search<'a>(demonstrations: &'a [TaughtDemonstration], scene: &Scene<'_>) -> Vec<Overlay<'a>> {
    let mut found = Vec::new();
    for demonstration in demonstrations {
        let usual = usual_scale(demonstration, scene);
        let matches = demonstration.search(scene.image, &scene.field);
        found.extend(matches.into_iter().map(|Match { image_from_demonstration, agreement, .. }| Overlay {
            demonstration,
            image_from_cutout: image_from_demonstration,
            agreement_at_any_size: agreement,
            agreement: demonstration.check().size.apply(agreement, image_from_demonstration.scale / usual),
        }));
    }
    found
}
