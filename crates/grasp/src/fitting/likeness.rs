//! The training data of the network that compares photo and picture: the poses that the search finds.

use sdg_shape::{Likeness, Pair};

use super::observation::{error_of, is_right};
use super::pictures::{FitPart, FitPicture};
use crate::error::Result;
use crate::taught::TaughtDemonstration;
use crate::teach::symmetry::HiddenTurns;
use crate::verification::{PlacedDemonstration, SearchedImage, search};

/// Maximum number of wrong poses used per picture, in descending agreement.
const WRONG_A_PICTURE: usize = 3;

/// Maximum distance of a nearly correct pose from an instance, as a fraction of the instance's diagonal and in radians.
/// A nearly correct pose counts as neither correct nor wrong, because the part's height may have displaced it.
const NEARLY: (f64, f64) = (0.15, 0.3);

/// A photo and an aligned picture.
#[derive(Debug, Clone, PartialEq)]
pub struct LikenessExample {
    /// Index among the part's pictures.
    pub picture_idx: usize,
    /// The network's input.
    pub pair: Pair,
    /// Whether the picture shows the part at the pose of the alignment.
    pub is_right: bool,
}

/// The best correct pose of every instance, and up to three of the best wrong poses of every picture, by agreement.
///
/// # Errors
/// A part that cannot be taught.
pub fn likeness_examples(part: &FitPart) -> Result<Vec<LikenessExample>> {
    let taught = TaughtDemonstration::new(&part.demonstration)?;
    let likeness = Likeness::new(&taught.cutout, &taught.marks.region());
    let turns = HiddenTurns::new(std::slice::from_ref(&part.demonstration), part.symmetry);
    let mut examples = Vec::new();
    for (picture_idx, picture) in part.pictures.iter().enumerate() {
        let mut example = |placed: &PlacedDemonstration<'_>, is_right| {
            let pair = likeness.pair(&picture.image, &placed.image_from_cutout);
            examples.push(LikenessExample { picture_idx, pair, is_right });
        };
        let mut found = search(&SearchedImage::new(&picture.image, std::slice::from_ref(&taught)));
        found.sort_by(|a, b| b.agreement.total_cmp(&a.agreement));
        let mut is_instance_seen = vec![false; picture.instances.len()];
        let mut num_wrong = 0;
        for placed in &found {
            match instance_of(placed, picture, part, &turns) {
                Some(idx) if !is_instance_seen[idx] => {
                    is_instance_seen[idx] = true;
                    example(placed, true);
                }
                None if num_wrong < WRONG_A_PICTURE
                    && !picture.is_undecided(placed)
                    && !is_nearly_right(placed, picture, part, &turns) =>
                {
                    num_wrong += 1;
                    example(placed, false);
                }
                _ => {}
            }
        }
    }
    Ok(examples)
}

fn instance_of(
    placed: &PlacedDemonstration<'_>,
    picture: &FitPicture,
    part: &FitPart,
    turns: &HiddenTurns,
) -> Option<usize> {
    picture.instances.iter().position(|instance| is_right(placed, instance, part, turns))
}

fn is_nearly_right(
    placed: &PlacedDemonstration<'_>,
    picture: &FitPicture,
    part: &FitPart,
    turns: &HiddenTurns,
) -> bool {
    picture.instances.iter().any(|instance| {
        let (share, turn) = error_of(placed, instance, part, turns);
        share <= NEARLY.0 && turn <= NEARLY.1
    })
}
