//! Every detection, accepted or refused, and its class by the ground truth, as JSON lines, for studying which
//! detections are accepted.

use anyhow::Result;
use sdg_grasp::{DetectionRecord, GraspDetection, ModelKind};
use serde::Serialize;

use super::file::Side;
use super::run::{Measured, SetRun, kind_of};
use crate::labelled_pictures::{HitError, Tested, judge};

/// Maximum distance between a detection and an instance, in diagonals of the instance, for the detection to be on the
/// part. Chosen by hand: no part extends farther from the centre of its grasp than a diagonal, and few extend half as
/// far.
const MAX_ON_PART_DIAGONALS: f64 = 0.5;

/// The class of a detection relative to the nearest instance. The instance may be optional, and may also be hit by
/// another detection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Place {
    /// Within the distance and the angle of a hit.
    Right,
    /// Within the distance of a hit, but not within the angle.
    WrongTurn,
    /// On the part, but not within the distance of a hit.
    Misplaced,
    /// Not on the part.
    Wrong,
}

/// The kind of the instance that a detection takes. Detections with lower scores cannot take that instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Hit {
    Part,
    Optional,
}

/// One line of the output.
#[derive(Serialize)]
struct Candidate<'a> {
    set: &'a str,
    side: Side,
    model: ModelKind,
    seed: u64,
    image: String,
    kind: &'a str,
    place: Place,
    /// The hit, matched one to one in order of decreasing score; null also for a second detection on the same instance.
    hit: Option<Hit>,
    /// Distance from the nearest instance, in percent of its diagonal; null in pictures without an instance.
    distance_percent: Option<f64>,
    turn_deg: Option<f64>,
    #[serde(flatten)]
    detection: DetectionRecord,
}

/// The lines of all detections of a model.
///
/// # Errors
/// No error occurs in practice: every record can be serialised.
pub fn candidates(measured: &Measured) -> Result<String> {
    let mut lines = String::new();
    for run in &measured.runs {
        for tested in &run.tested {
            for candidate in of_picture(measured.model, run, tested) {
                lines += &(serde_json::to_string(&candidate)? + "\n");
            }
        }
    }
    Ok(lines)
}

fn of_picture<'a>(model: ModelKind, run: &'a SetRun, tested: &'a Tested) -> impl Iterator<Item = Candidate<'a>> {
    // All detections count: a lower minimum score only makes the list of hits longer.
    let hits = judge(tested, 0.0).hits;
    tested.detections.iter().zip(hits).map(move |(detection, hit)| {
        let nearest = nearest(tested, detection);
        Candidate {
            set: &run.set.name,
            side: run.set.side,
            model,
            seed: run.seed,
            image: tested.picture.name(),
            kind: kind_of(tested),
            place: nearest.as_ref().map_or(Place::Wrong, place),
            hit: hit.map(|hit| if tested.truths[hit.instance_idx].optional { Hit::Optional } else { Hit::Part }),
            distance_percent: nearest.map(|error| error.percent),
            turn_deg: nearest.map(|error| error.deg),
            detection: DetectionRecord::new(detection, model),
        }
    })
}

fn nearest(tested: &Tested, detection: &GraspDetection) -> Option<HitError> {
    let errors = tested.truths.iter().filter_map(|truth| Some(truth.grasp?.error_of(&detection.grasp)));
    errors.min_by(|one, other| one.percent.total_cmp(&other.percent))
}

fn place(error: &HitError) -> Place {
    match error {
        error if error.is_hit() => Place::Right,
        error if error.is_in_place() => Place::WrongTurn,
        error if error.percent <= 100.0 * MAX_ON_PART_DIAGONALS => Place::Misplaced,
        _ => Place::Wrong,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_judged_by_distance_and_turn() {
        for (percent, deg, expected) in [
            (3.9, 9.0, Place::Right),
            (3.9, 11.0, Place::WrongTurn),
            (4.1, 0.0, Place::Misplaced),
            (49.0, 180.0, Place::Misplaced),
            (51.0, 0.0, Place::Wrong),
        ] {
            assert_eq!(place(&HitError { px: 0.0, mm: None, percent, deg }), expected, "{percent} %, {deg} deg");
        }
    }
}
