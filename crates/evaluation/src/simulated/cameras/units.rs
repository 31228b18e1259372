//! The work units of the cameras, and their implementation.

use std::time::Instant;

use anyhow::Result;
use sdg_cell::{Found, Perception};
use sdg_grasp::{CameraOverTable, ModelKind, Preset, Verification};
use sdg_report::DetectionError;
use sdg_simulation::objects::ObjectSpec;
use serde::{Deserialize, Serialize};

use super::records::{CameraPicture, CameraRecord, MetricAnswer};
use super::sets::{PictureSet, Shown};
use crate::against_truth::grasp_error;
use crate::progress::Progress;
use crate::simulated::axes::{TOLERANCE, has_complete_rounds, match_one_to_one};
use crate::simulated::cell::{Cell, Marks};
use crate::simulated::one_unit::{NO_MODEL, do_unit};
use crate::simulated::schedule::{Task, run_all};
use crate::simulated::settings::TeachingSettings;
use crate::simulated::store::Store;
use crate::simulated::teaching::Teaching;

/// A piece of work that is stored completely or not at all.
#[derive(Debug, Clone, Copy)]
enum Unit<'a> {
    /// A network is taught on a part in the plan view.
    Teach(Cell<'a>),
    /// A model searches a part's pictures of a set.
    Pictures(Cell<'a>, &'a ObjectSpec, PictureSet),
}

/// Models, parts and sets of pictures, and the folder for the results.
pub struct CamerasEvaluation<'a> {
    pub models: &'a [ModelKind],
    pub objects: &'a [ObjectSpec],
    pub sets: &'a [PictureSet],
    /// Network, training and augmentation, as named in the settings of the store.
    pub preset: Preset,
    pub store: &'a Store,
    /// Number of pictures of each part and set.
    pub views: u32,
    /// Number of photos from which parts are taught, from 1 to [`MAX_PHOTOS`](super::MAX_PHOTOS).
    pub photos: u32,
    /// Number of parallel units.
    pub jobs: usize,
}

/// The settings that determine the results of a set, besides set, model and part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct CameraSettings {
    /// Version of rendering and scoring; raised when either changes.
    cameras: u32,
    #[serde(flatten)]
    teaching: TeachingSettings,
    views: u32,
    photos: u32,
}

impl CamerasEvaluation<'_> {
    /// Runs the remaining units until `is_interrupted` is true.
    ///
    /// # Errors
    /// The first error of a unit; or the store cannot be read. A teaching run without a model is not an error.
    pub fn run(&self, is_interrupted: &(dyn Fn() -> bool + Sync), progress: &dyn Progress) -> Result<()> {
        let tasks = self.tasks()?;
        progress.expect(tasks.len());
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let work = |unit: &Unit| do_unit(unit, is_interrupted, progress, || self.work(*unit, is_interrupted));
        run_all(&tasks, self.jobs, (cores / self.jobs.max(1)).max(1), &work)
    }

    /// Number of units that are not in the store yet.
    pub fn remaining(&self) -> Result<usize> {
        Ok(self.tasks()?.len())
    }

    /// A model's stored detections in a part's pictures of a set.
    pub fn record(&self, cell: Cell, set: PictureSet) -> Result<Option<CameraRecord>> {
        // Earlier versions did not write the number of photos if it was one.
        self.store.read_made_with_defaults(&file(cell, set), &self.settings(), &[("photos", 1.into())])
    }

    /// Whether teaching for a cell gave no model.
    pub(super) fn is_without_model(&self, cell: Cell) -> Result<bool> {
        cell.is_without_model(self.marks(), self.store)
    }

    fn marks(&self) -> Marks {
        Marks::InPlanView { photos: self.photos }
    }

    fn settings(&self) -> CameraSettings {
        // Version 1 had other pictures if the last round of an axis is incomplete, or 7 divides their number.
        let is_as_version_1 = has_complete_rounds(self.views) && !self.views.is_multiple_of(7);
        CameraSettings {
            cameras: if is_as_version_1 { 1 } else { 2 },
            teaching: self.store.settings().teaching(),
            views: self.views,
            photos: self.photos,
        }
    }

    fn tasks(&self) -> Result<Vec<Task<Unit<'_>>>> {
        let mut tasks = Vec::new();
        for object in self.objects {
            // Networks to teach, each with the index of its task: models may use the same network.
            let mut teachings: Vec<(ModelKind, usize)> = Vec::new();
            for &model in self.models {
                let cell = Cell { model, object: &object.name };
                if self.is_without_model(cell)? {
                    continue;
                }
                let mut after = Vec::new();
                for &set in self.sets {
                    if self.record(cell, set)?.is_some() {
                        continue;
                    }
                    if after.is_empty() && cell.teaching_from(self.marks(), self.store)?.is_none() {
                        let network = cell.network();
                        let known = teachings.iter().find(|(model, _)| *model == network.model);
                        after.push(known.map(|(_, task)| *task).unwrap_or_else(|| {
                            teachings.push((network.model, tasks.len()));
                            tasks.push(Task { unit: Unit::Teach(network), after: Vec::new() });
                            tasks.len() - 1
                        }));
                    }
                    tasks.push(Task { unit: Unit::Pictures(cell, object, set), after: after.clone() });
                }
            }
        }
        Ok(tasks)
    }

    fn work(&self, unit: Unit, is_interrupted: &(dyn Fn() -> bool + Sync)) -> Result<Option<String>> {
        match unit {
            Unit::Teach(cell) => {
                let teaching = Teaching { store: self.store, preset: self.preset, jobs: self.jobs };
                teaching.teach(cell, self.marks(), is_interrupted)
            }
            Unit::Pictures(cell, object, set) => self.detect_in_pictures(cell, object, set, is_interrupted),
        }
    }

    fn detect_in_pictures(
        &self,
        cell: Cell,
        object: &ObjectSpec,
        set: PictureSet,
        is_interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<String>> {
        let Some(model) = cell.read_model(self.marks(), self.store)? else {
            return Ok(Some(NO_MODEL.to_owned()));
        };
        let started = Instant::now();
        let mut perception = Perception::of_any_camera(model);
        let mut pictures = Vec::new();
        for number in 0..u64::from(self.views) {
            if is_interrupted() {
                return Ok(None);
            }
            let shown = set.draw(object, number, u64::from(self.views), self.store.settings().seed)?;
            let camera = CameraOverTable { camera: shown.view.camera, table_height_m: 0.0, workspace: None };
            perception.move_to(&camera)?;
            let found = perception.detect(&shown.view.image, Verification::ByShape)?;
            pictures.push(judged(object, number, &shown, &found));
        }
        let record = CameraRecord { pictures, seconds: started.elapsed().as_secs_f64() };
        self.store.write_made_with(&file(cell, set), &self.settings(), &record)?;
        let answers = || record.pictures.iter().flat_map(|picture| &picture.answers);
        let found = answers().filter(|answer| answer.found.is_some()).count();
        Ok(Some(format!("found {found}, {} wrong", answers().count() - found)))
    }
}

/// Compares accepted detections with the ground truth.
fn judged(object: &ObjectSpec, number: u64, shown: &Shown, found: &[Found]) -> CameraPicture {
    let num_counted = if shown.instances.len() <= 1 { 1 } else { usize::MAX };
    let accepted: Vec<_> = found
        .iter()
        .take_while(|found| found.detection.is_accepted())
        .take(num_counted)
        .filter_map(|found| Some((found.detection.score, found.pose?)))
        .collect();
    let errors: Vec<Vec<Option<DetectionError>>> = accepted
        .iter()
        .map(|(_, pose)| {
            let base_from_tcp = pose.frame_from_tcp();
            shown.instances.iter().map(|instance| Some(grasp_error(object, instance, &base_from_tcp))).collect()
        })
        .collect();
    let matched = match_one_to_one(&errors, &vec![true; accepted.len()], TOLERANCE);
    let answers = accepted.iter().zip(&errors).zip(matched).map(|(((score, pose), errors), instance)| {
        let nearest = || errors.iter().flatten().min_by(|a, b| a.distance_mm.total_cmp(&b.distance_mm)).copied();
        let error = instance.map_or_else(nearest, |instance| errors[instance]);
        MetricAnswer {
            score: *score,
            error_mm: error.map(|error| error.distance_mm),
            error_deg: error.map(|error| error.angle_deg),
            sigma_mm: 1e3 * pose.uncertainty.position_m,
            sigma_deg: pose.uncertainty.yaw_rad.to_degrees(),
            found: instance,
        }
    });
    let answers = answers.collect();
    let (height_m, tilt_deg) = shown.height_and_tilt();
    CameraPicture { number, height_m, tilt_deg, instances: shown.instances.len(), answers }
}

fn file(cell: Cell, set: PictureSet) -> String {
    format!("cameras/{cell}.{}.json", set.name())
}

impl std::fmt::Display for Unit<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Teach(cell) => write!(f, "teach {} {} in the plan view", cell.model, cell.object),
            Self::Pictures(cell, _, set) => write!(f, "{} {} {}", cell.model, set.name(), cell.object),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Settings;

    fn evaluation<'a>(models: &'a [ModelKind], objects: &'a [ObjectSpec], store: &'a Store) -> CamerasEvaluation<'a> {
        let sets = &[PictureSet::Camera(0)];
        CamerasEvaluation { models, objects, sets, preset: Preset::Edge, store, views: 2, photos: 1, jobs: 2 }
    }

    #[test]
    fn figures_of_several_photos_are_not_those_of_one() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), &Settings::for_test(1, 2, 1)).unwrap();
        let of = |photos| CamerasEvaluation { photos, ..evaluation(&[], &[], &store) };
        let (cell, set) = (Cell { model: ModelKind::S, object: "pendulum" }, PictureSet::Camera(0));
        let refused = |photos| of(photos).record(cell, set).unwrap_err().to_string();
        let record = CameraRecord { pictures: Vec::new(), seconds: 0.0 };
        store.write_made_with(&file(cell, set), &of(2).settings(), &record).unwrap();
        assert_eq!(of(2).record(cell, set).unwrap().as_ref(), Some(&record));
        assert!(refused(1).contains("made with other settings (photos: expected 1, found 2)"), "{}", refused(1));

        // A record of one photo by a version that did not write the number.
        let mut settings = serde_json::to_value(of(1).settings()).unwrap();
        settings.as_object_mut().unwrap().remove("photos").unwrap();
        store.write_made_with(&file(cell, set), &settings, &record).unwrap();
        assert_eq!(of(1).record(cell, set).unwrap(), Some(record));
        assert!(refused(2).contains("photos: expected 2, found 1"), "{}", refused(2));
    }

    #[test]
    fn models_with_the_same_network_are_taught_once() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), &Settings::for_test(1, 2, 1)).unwrap();
        let objects = ["pendulum", "key"].map(|name| ObjectSpec::by_name(name).unwrap());
        let evaluation = evaluation(&[ModelKind::B, ModelKind::C], &objects, &store);
        let tasks: Vec<String> =
            evaluation.tasks().unwrap().iter().map(|task| format!("{} {:?}", task.unit, task.after)).collect();
        assert_eq!(
            tasks,
            [
                "teach C pendulum in the plan view []",
                "B webcam pendulum [0]",
                "C webcam pendulum [0]",
                "teach C key in the plan view []",
                "B webcam key [3]",
                "C webcam key [3]"
            ]
        );
    }
}
