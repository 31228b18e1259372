//! The work units of the axes, with their dependencies and files. `work.rs` runs them.

use anyhow::Result;
use sdg_grasp::{ModelKind, Preset, Verification};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::views::Axis;

use super::records::AxisRecord;
use super::selection::{GraspCondition, Selection};
use super::settings::{AttemptSettings, AxisSettings};
use crate::simulated::cell::{Cell, Marks, read_attempts};
use crate::simulated::records::AttemptRecord;
use crate::simulated::schedule::Task;
use crate::simulated::store::Store;

/// The models for grasps under errors: the one without a network, and the paper's best.
pub const GRASPING_MODELS: [ModelKind; 2] = [ModelKind::S, ModelKind::C];

/// A piece of work for one worker.
#[derive(Debug, Clone, Copy)]
pub(super) enum Unit<'a> {
    /// A network is taught on a part.
    Teach(Cell<'a>, Marks),
    /// All models search a part's pictures of an axis; each picture is rendered once.
    Pictures(&'a ObjectSpec, Axis),
    /// A model grasps a part under an error; each attempt is stored on its own.
    Grasps(Cell<'a>, &'a ObjectSpec, GraspCondition),
}

/// Models, parts, axes and errors, and the folder for the results.
pub struct AxesEvaluation<'a> {
    pub models: &'a [ModelKind],
    pub objects: &'a [ObjectSpec],
    /// Axes of pictures, and errors in grasps.
    pub selection: &'a Selection,
    /// Network, training and augmentation, as named in the settings of the store.
    pub preset: Preset,
    pub store: &'a Store,
    /// Number of pictures of each part and axis.
    pub axis_views: u32,
    /// Number of edge points that model S compares at each pose of its search; `None` for the taught number.
    pub search_points: Option<u32>,
    /// Number of parallel units.
    pub jobs: usize,
}

impl AxesEvaluation<'_> {
    /// Number of units that are not in the store yet.
    pub fn remaining(&self) -> Result<usize> {
        Ok(self.tasks()?.len())
    }

    /// The settings of the pictures' results.
    pub fn axis_settings(&self) -> AxisSettings {
        AxisSettings {
            axes: AxisSettings::version(self.axis_views),
            teaching: self.store.settings().teaching(),
            axis_views: self.axis_views,
            search_points: self.search_points,
        }
    }

    /// The settings of attempts under errors.
    pub fn grasp_settings(&self) -> AttemptSettings {
        AttemptSettings {
            errors: AttemptSettings::ERRORS,
            teaching: self.store.settings().teaching(),
            attempts: self.store.settings().attempts,
            search_points: self.search_points,
        }
    }

    /// A model's stored detections in a part's pictures of an axis.
    pub fn axis_record(&self, cell: Cell, axis: Axis) -> Result<Option<AxisRecord>> {
        self.store.read_made_with(&axis_file(cell, axis), &self.axis_settings())
    }

    /// The attempts so far of a model on a part under an error.
    pub fn grasps(&self, cell: Cell, condition: GraspCondition) -> Result<Vec<AttemptRecord>> {
        match self.is_in_protocol(condition) {
            true => cell.attempts(Verification::ByShape, self.store),
            false => read_attempts(self.store, &grasps_file(cell, condition), &self.grasp_settings()),
        }
    }

    /// Whether the attempts are those of the paper's protocol; they are then shared with the protocol.
    pub(super) fn is_in_protocol(&self, condition: GraspCondition) -> bool {
        condition == GraspCondition::NoError && self.search_points.is_none()
    }

    /// The requested models for grasps under errors.
    pub fn grasping_models(&self) -> impl Iterator<Item = ModelKind> {
        GRASPING_MODELS.into_iter().filter(|model| self.models.contains(model))
    }

    /// The remaining units, part by part, so that an interrupted run has results for complete parts.
    pub(super) fn tasks(&self) -> Result<Vec<Task<Unit<'_>>>> {
        let mut tasks = Vec::new();
        for object in self.objects {
            let mut list = TaskList { evaluation: self, object, teachings: Vec::new(), tasks: &mut tasks };
            for &axis in &self.selection.axes {
                list.add_pictures(axis)?;
            }
            for &condition in &self.selection.conditions {
                for model in self.grasping_models() {
                    list.add_grasps(model, condition)?;
                }
            }
        }
        Ok(tasks)
    }
}

/// The tasks of one part, while the list is made.
struct TaskList<'e, 't> {
    evaluation: &'e AxesEvaluation<'e>,
    object: &'e ObjectSpec,
    /// Networks to teach, each with the index of its task.
    teachings: Vec<(ModelKind, Marks, usize)>,
    tasks: &'t mut Vec<Task<Unit<'e>>>,
}

impl<'e> TaskList<'e, '_> {
    fn cell(&self, model: ModelKind) -> Cell<'e> {
        Cell { model, object: &self.object.name }
    }

    /// Adds the pictures of an axis, unless all models have been run on them.
    fn add_pictures(&mut self, axis: Axis) -> Result<()> {
        let mut after = Vec::new();
        let mut is_missing = false;
        for &model in self.evaluation.models {
            let cell = self.cell(model);
            let is_usable = !cell.is_without_model(Marks::Shipped, self.evaluation.store)?;
            if is_usable && self.evaluation.axis_record(cell, axis)?.is_none() {
                is_missing = true;
                after.extend(self.teaching_of(cell, Marks::Shipped)?);
            }
        }
        if is_missing {
            self.tasks.push(Task { unit: Unit::Pictures(self.object, axis), after });
        }
        Ok(())
    }

    /// Adds missing attempts.
    fn add_grasps(&mut self, model: ModelKind, condition: GraspCondition) -> Result<()> {
        let (cell, marks) = (self.cell(model), marks_of(condition));
        let wanted = self.evaluation.store.settings().attempts as usize;
        let is_usable = !cell.is_without_model(marks, self.evaluation.store)?;
        if is_usable && self.evaluation.grasps(cell, condition)?.len() < wanted {
            let after = self.teaching_of(cell, marks)?.into_iter().collect();
            self.tasks.push(Task { unit: Unit::Grasps(cell, self.object, condition), after });
        }
        Ok(())
    }

    /// The task that teaches the network of a cell, added if necessary; `None` if the network exists.
    fn teaching_of(&mut self, cell: Cell<'e>, marks: Marks) -> Result<Option<usize>> {
        if cell.teaching_from(marks, self.evaluation.store)?.is_some() {
            return Ok(None);
        }
        let network = cell.network();
        let known = self.teachings.iter().find(|(model, from, _)| (*model, *from) == (network.model, marks));
        if let Some((.., task)) = known {
            return Ok(Some(*task));
        }
        let task = self.tasks.len();
        self.teachings.push((network.model, marks, task));
        self.tasks.push(Task { unit: Unit::Teach(network, marks), after: Vec::new() });
        Ok(Some(task))
    }
}

impl std::fmt::Display for Unit<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Teach(cell, Marks::Shipped) => write!(f, "teach {} {}", cell.model, cell.object),
            Self::Teach(cell, Marks::Jittered) => write!(f, "teach {} {} from jittered marks", cell.model, cell.object),
            Self::Teach(cell, Marks::InPlanView { .. }) => {
                write!(f, "teach {} {} in the plan view", cell.model, cell.object)
            }
            Self::Pictures(object, axis) => write!(f, "{axis} {}", object.name),
            Self::Grasps(cell, _, condition) => write!(f, "grasp {} {}, {}", cell.model, cell.object, condition.name()),
        }
    }
}

/// The file of a model's detections in the pictures of an axis.
pub(super) fn axis_file(cell: Cell, axis: Axis) -> String {
    format!("axes/{cell}.{}.json", axis.name())
}

pub(super) fn grasps_file(cell: Cell, condition: GraspCondition) -> String {
    format!("axes/{cell}.attempts-{}.json", condition.name())
}

/// The marks from which a model is taught for attempts under an error.
pub(super) fn marks_of(condition: GraspCondition) -> Marks {
    if condition == GraspCondition::Marks { Marks::Jittered } else { Marks::Shipped }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated::records::{AttemptsRecord, TeachingRecord};
    use crate::statistics::Share;
    use crate::{PartGroup, Settings};

    use super::super::records::AxisPicture;
    use super::super::summary::AxesSummary;
    use super::super::way::Way;

    fn listed(evaluation: &AxesEvaluation) -> Vec<String> {
        evaluation.tasks().unwrap().iter().map(|task| format!("{} {:?}", task.unit, task.after)).collect()
    }

    #[test]
    fn teachings_are_shared_and_what_is_there_is_not_done_again() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), &Settings::for_test(1, 2, 1)).unwrap();
        let objects = ["pendulum", "key"].map(|name| ObjectSpec::by_name(name).unwrap());
        let selection = Selection {
            axes: vec![Axis::Tilt],
            conditions: vec![GraspCondition::NoError, GraspCondition::Marks, GraspCondition::Shake],
        };
        let evaluation = AxesEvaluation {
            models: &[ModelKind::B, ModelKind::C],
            objects: &objects,
            selection: &selection,
            preset: Preset::Edge,
            store: &store,
            axis_views: 2,
            search_points: None,
            jobs: 1,
        };
        // B uses C's network; B does not grasp under errors; jittered marks need their own teaching.
        assert_eq!(
            listed(&evaluation)[..6],
            [
                "teach C pendulum []",
                "tilt pendulum [0, 0]",
                "grasp C pendulum, no-error [0]",
                "teach C pendulum from jittered marks []",
                "grasp C pendulum, marks [3]",
                "grasp C pendulum, shake [0]"
            ]
        );
        assert_eq!(listed(&evaluation)[6..8], ["teach C key []", "tilt key [6, 6]"]);

        // The control consists of the attempts of the protocol, and a part whose teaching failed needs no further work.
        let attempt = |number| AttemptRecord::failed(number, "detect", "not found".into());
        let done = AttemptsRecord::new(vec![attempt(1), attempt(2)]);
        store.write("cells/C-pendulum.attempts-verified.json", &done).unwrap();
        let failed = TeachingRecord::Failed { why: "nothing learnt".into() };
        for file in ["cells/C-key.teaching.json", "cells/C-key.teaching-jittered-marks.json"] {
            store.write_made_with(file, &store.settings().teaching(), &failed).unwrap();
        }
        for (model, found) in [(ModelKind::B, [true, false]), (ModelKind::C, [true, true])] {
            let pictures = (0..2).map(|number| AxisPicture::for_test(number, found[number as usize])).collect();
            let record = AxisRecord { pictures, seconds: 2.0 };
            let file = axis_file(Cell { model, object: "pendulum" }, Axis::Tilt);
            store.write_made_with(&file, &evaluation.axis_settings(), &record).unwrap();
        }
        assert_eq!(
            listed(&evaluation),
            [
                "teach C pendulum from jittered marks []",
                "grasp C pendulum, marks [0]",
                "teach C pendulum []",
                "grasp C pendulum, shake [2]"
            ]
        );

        let summary = AxesSummary::collect(&evaluation).unwrap();
        assert_eq!((summary.remaining, summary.seconds.pictures), (4, 4.0));
        let [paper, held_out] = &summary.groups[..] else { panic!("{:?}", summary.groups) };
        assert_eq!((paper.group, held_out.group), (PartGroup::Paper, PartGroup::HeldOut));
        let found = |group: &super::super::summary::GroupSummary, model| {
            let figures = group.axes.iter().find(|f| f.model == model && f.way == Way::NetworkAlone).unwrap();
            (figures.found, figures.wrong)
        };
        assert_eq!(found(paper, ModelKind::B), (Share { count: 1, of: 2 }, 1));
        assert_eq!(found(paper, ModelKind::C), (Share { count: 2, of: 2 }, 0));
        // Without a model, every part counts as missed and every attempt as failed.
        assert_eq!(found(held_out, ModelKind::C), (Share { count: 0, of: 2 }, 0));
        assert_eq!(held_out.axes[0].thirds.map(|third| third.found.of), [1, 1, 0]);
        assert_eq!(held_out.grasps[1].failures_by_step[AttemptRecord::TEACH], 2);
        assert_eq!(paper.grasps[0].held, Share { count: 0, of: 2 });
    }

    #[test]
    fn other_pictures_are_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), &Settings::for_test(1, 2, 1)).unwrap();
        let cell = Cell { model: ModelKind::S, object: "pendulum" };
        let selection = Selection::parse(&["tilt".to_owned()]).unwrap();
        let evaluation = |axis_views, search_points| AxesEvaluation {
            models: &[ModelKind::S],
            objects: &[],
            selection: &selection,
            preset: Preset::Edge,
            store: &store,
            axis_views,
            search_points,
            jobs: 1,
        };
        let record = AxisRecord { pictures: Vec::new(), seconds: 0.0 };
        store.write_made_with(&axis_file(cell, Axis::Tilt), &evaluation(20, None).axis_settings(), &record).unwrap();
        assert_eq!(evaluation(20, None).axis_record(cell, Axis::Tilt).unwrap(), Some(record));
        let refused = |evaluation: AxesEvaluation| evaluation.axis_record(cell, Axis::Tilt).unwrap_err().to_string();
        assert!(refused(evaluation(30, None)).contains("axis_views: expected 30, found 20"));
        assert!(refused(evaluation(20, Some(32))).contains("search_points: expected 32, found none"));
    }
}
