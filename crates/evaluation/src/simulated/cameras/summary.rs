//! Summary of detection rates and errors.

use anyhow::Result;
use sdg_geometry::percentile;
use sdg_grasp::ModelKind;
use serde::Serialize;

use super::records::{CameraPicture, MetricAnswer};
use super::sets::PictureSet;
use super::units::CamerasEvaluation;
use crate::simulated::cell::Cell;
use crate::statistics::Share;

/// A part is high if its marks are more than this height above the table, in metres: its walls are then visible from
/// the side.
pub(super) const HIGH_M: f64 = 0.010;

/// Errors of found instances.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorFigures {
    /// Median position error in the marks' plane, in millimetres.
    pub median_mm: f64,
    /// 95th percentile of the position errors, in millimetres.
    pub p95_mm: f64,
    /// Median angle error, in degrees, modulo the part's symmetry; without parts whose angle is not visible.
    pub median_deg: Option<f64>,
    /// 95th percentile of the angle errors, in degrees.
    pub p95_deg: Option<f64>,
    /// Position errors within the radius that the detections give for 68 %.
    pub within_sigma_mm: Share,
    /// Angle errors within the bound that the detections give for 68 %.
    pub within_sigma_deg: Share,
}

/// Results of a model on a set of pictures, for all parts or some of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetFigures {
    pub model: ModelKind,
    pub set: &'static str,
    pub parts: String,
    /// Instances found, of all in the pictures. Without a model, every instance counts as missed.
    pub found: Share,
    /// Pictures without the part in which a detection was accepted, of all without the part that a model searched.
    pub accepted: Share,
    /// Number of accepted detections that found no instance, in pictures with the part.
    pub wrong: usize,
    /// Errors of the found instances.
    pub errors: Option<ErrorFigures>,
}

/// All results.
#[derive(Debug, Clone, Serialize)]
pub struct CamerasSummary {
    /// Number of photos from which each part was taught.
    pub photos: u32,
    /// Results of each model and set, over all parts.
    pub sets: Vec<SetFigures>,
    /// Results of each model and set, for low and high parts separately.
    pub by_height: Vec<SetFigures>,
    /// Results of each model and part, for the three cameras together.
    pub by_part: Vec<SetFigures>,
    /// Seconds that the workers spent on the pictures.
    pub seconds: f64,
    /// Number of remaining units.
    pub remaining: usize,
}

/// The pictures of a part in a set, with a model's detections.
struct Shown<'a> {
    object: &'a str,
    is_high: bool,
    has_turn: bool,
    model: ModelKind,
    set: PictureSet,
    pictures: Vec<CameraPicture>,
    /// Number of instances in pictures that were not searched, because teaching gave no model.
    num_missed: usize,
}

impl CamerasSummary {
    /// Reads all results in the store.
    ///
    /// # Errors
    /// The errors of the store.
    pub fn collect(evaluation: &CamerasEvaluation) -> Result<Self> {
        let mut shown = Vec::new();
        let mut seconds = 0.0;
        for &model in evaluation.models {
            for object in evaluation.objects {
                for &set in evaluation.sets {
                    let cell = Cell { model, object: &object.name };
                    let (mut pictures, mut num_missed) = (Vec::new(), 0);
                    if evaluation.is_without_model(cell)? {
                        num_missed = evaluation.views as usize * set.num_instances();
                    } else if let Some(record) = evaluation.record(cell, set)? {
                        seconds += record.seconds;
                        pictures = record.pictures;
                    }
                    if pictures.is_empty() && num_missed == 0 {
                        continue;
                    }
                    shown.push(Shown {
                        object: &object.name,
                        is_high: object.mark_height_m > HIGH_M,
                        has_turn: object.symmetry != sdg_geometry::RotationalSymmetry::Full,
                        model,
                        set,
                        pictures,
                        num_missed,
                    });
                }
            }
        }
        let of = |model: ModelKind, set: &'static str, parts: &str, chosen: &dyn Fn(&Shown) -> bool| {
            let chosen: Vec<&Shown> = shown.iter().filter(|shown| shown.model == model && chosen(shown)).collect();
            (!chosen.is_empty()).then(|| figures(model, set, parts, &chosen))
        };
        let (mut sets, mut by_height, mut by_part) = (Vec::new(), Vec::new(), Vec::new());
        for &model in evaluation.models {
            for &set in evaluation.sets {
                let of_set = |shown: &Shown| shown.set == set;
                sets.extend(of(model, set.name(), "all", &of_set));
                for (is_high, parts) in [(false, "low"), (true, "high")] {
                    by_height.extend(of(model, set.name(), parts, &|shown| of_set(shown) && shown.is_high == is_high));
                }
            }
            let is_camera = |shown: &Shown| matches!(shown.set, PictureSet::Camera(_));
            for object in evaluation.objects {
                let of_part = |shown: &Shown| is_camera(shown) && shown.object == object.name;
                by_part.extend(of(model, "three cameras", &object.name, &of_part));
            }
        }
        Ok(Self { photos: evaluation.photos, sets, by_height, by_part, seconds, remaining: evaluation.remaining()? })
    }
}

fn figures(model: ModelKind, set: &'static str, parts: &str, shown: &[&Shown]) -> SetFigures {
    let pictures = || shown.iter().flat_map(|shown| &shown.pictures);
    let found = |has_turn: Option<bool>| {
        let chosen = shown.iter().filter(move |shown| has_turn.is_none_or(|has| shown.has_turn == has));
        chosen.flat_map(|shown| &shown.pictures).flat_map(|picture| &picture.answers).filter(|a| a.found.is_some())
    };
    let num_missed: usize = shown.iter().map(|shown| shown.num_missed).sum();
    let instances = num_missed + pictures().map(|picture| picture.instances).sum::<usize>();
    let without = || pictures().filter(|picture| picture.instances == 0);
    SetFigures {
        model,
        set,
        parts: parts.to_owned(),
        found: Share { count: found(None).count(), of: instances },
        accepted: Share::of(without(), |picture| !picture.answers.is_empty()),
        wrong: pictures()
            .filter(|picture| picture.instances > 0)
            .flat_map(|picture| &picture.answers)
            .filter(|answer| answer.found.is_none())
            .count(),
        errors: errors(found(None).collect(), found(Some(true)).collect()),
    }
}

fn errors(found: Vec<&MetricAnswer>, with_turn: Vec<&MetricAnswer>) -> Option<ErrorFigures> {
    let mm = |percent| percentile(found.iter().filter_map(|answer| answer.error_mm), percent);
    let deg = |percent| percentile(with_turn.iter().filter_map(|answer| answer.error_deg), percent);
    Some(ErrorFigures {
        median_mm: mm(50.0)?,
        p95_mm: mm(95.0)?,
        median_deg: deg(50.0),
        p95_deg: deg(95.0),
        within_sigma_mm: Share::of(&found, |answer| answer.error_mm.is_some_and(|error| error <= answer.sigma_mm)),
        within_sigma_deg: Share::of(&with_turn, |answer| {
            answer.error_deg.is_some_and(|error| error <= answer.sigma_deg)
        }),
    })
}

#[cfg(test)]
mod tests {
    use sdg_grasp::Preset;
    use sdg_simulation::objects::ObjectSpec;
    use sdg_simulation::views::Axis;

    use super::*;
    use crate::Settings;
    use crate::simulated::records::TeachingRecord;
    use crate::simulated::store::Store;

    #[test]
    fn a_part_whose_teaching_failed_counts_as_missed() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), &Settings::for_test(1, 2, 1)).unwrap();
        let failed = TeachingRecord::Failed { why: "nothing learnt".into() };
        store.write_made_with("cells/C-key.teaching-plan-view.json", &store.settings().teaching(), &failed).unwrap();
        let evaluation = CamerasEvaluation {
            models: &[ModelKind::C],
            objects: &[ObjectSpec::by_name("key").unwrap()],
            sets: &[PictureSet::Camera(0), PictureSet::Axis(Axis::Instances), PictureSet::OtherSizes],
            preset: Preset::Edge,
            store: &store,
            views: 4,
            photos: 1,
            jobs: 1,
        };
        let summary = CamerasSummary::collect(&evaluation).unwrap();
        let found = |rows: &[SetFigures]| rows.iter().map(|row| row.found).collect::<Vec<_>>();
        // Parts of other sizes must not be found: without a model, there is nothing to count.
        assert_eq!(found(&summary.sets), [4, 12].map(|of| Share { count: 0, of }));
        assert_eq!(found(&summary.by_part), [Share { count: 0, of: 4 }]);
        assert_eq!(summary.remaining, 0);
    }
}
