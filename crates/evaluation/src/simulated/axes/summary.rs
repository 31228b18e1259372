//! Sums of the records of axes and of grasps under errors, for each model and group of parts.

use std::collections::BTreeMap;
use std::fmt;

use anyhow::Result;
use sdg_geometry::percentile;
use sdg_grasp::ModelKind;
use sdg_simulation::views::{Axis, axis_stratum};
use serde::Serialize;

use super::records::{Answer, AxisRecord};
use super::selection::GraspCondition;
use super::settings::{AttemptSettings, AxisSettings};
use super::units::{AxesEvaluation, marks_of};
use super::way::Way;
use crate::simulated::cell::{Cell, Marks};
use crate::simulated::groups::PartGroup;
use crate::simulated::records::{AttemptRecord, TeachingRecord};
use crate::statistics::{Share, wilson_interval};

/// All results. The remaining units are not part of the sums.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxesSummary {
    /// Settings of the pictures' results.
    pub axis_settings: AxisSettings,
    /// Settings of the grasps' results.
    pub grasp_settings: AttemptSettings,
    /// Number of remaining units.
    pub remaining: usize,
    /// Seconds that the workers spent on the results, including teaching.
    pub seconds: Seconds,
    /// The paper's parts, and separately the held-out parts; groups without parts are missing.
    pub groups: Vec<GroupSummary>,
}

/// Seconds that the workers spent, by kind of unit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// All successful teaching runs of the measured models.
    pub teaching: f64,
    /// Pictures: rendering and detection.
    pub pictures: f64,
    pub grasps: f64,
}

impl fmt::Display for Seconds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { teaching, pictures, grasps } = self;
        write!(f, "{:.0} (teaching {teaching:.0}, pictures {pictures:.0}, grasps {grasps:.0})", self.total())
    }
}

impl Seconds {
    /// The total.
    pub fn total(self) -> f64 {
        self.teaching + self.pictures + self.grasps
    }
}

/// The results of a group of parts: one row for each model, axis and way.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GroupSummary {
    pub group: PartGroup,
    pub objects: Vec<String>,
    /// Results in pictures with the part.
    pub axes: Vec<AxisFigures>,
    /// Results in pictures in which a look-alike replaces the part.
    pub look_alikes: Vec<LookAlikeFigures>,
    pub grasps: Vec<GraspFigures>,
}

/// The fraction of one part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartShare {
    pub object: String,
    pub share: Share,
}

/// Results of a model along an axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisFigures {
    pub axis: &'static str,
    pub model: ModelKind,
    /// With the check or without.
    pub way: Way,
    /// Instances of the part that were found within 10 mm and 10° (slants: 3 mm and 3°), of all in the pictures.
    pub found: Share,
    /// 95 % confidence interval (Wilson) of `found`.
    pub found_interval: [f64; 2],
    /// Number of accepted detections that found no instance.
    pub wrong: usize,
    /// Number of pictures.
    pub pictures: usize,
    /// Median and 90th percentile of the position errors of all accepted detections, in millimetres.
    pub distance_mm: Option<[f64; 2]>,
    /// Median and 90th percentile of the angle errors of all accepted detections, in degrees.
    pub turn_deg: Option<[f64; 2]>,
    /// The fraction found in the first, the middle and the last third of the axis' pictures, in the order of the
    /// parameter of the axis.
    pub thirds: [Third; 3],
    /// The fraction of each part.
    pub parts: Vec<PartShare>,
}

/// A third of the pictures of an axis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Third {
    /// Instances of the part that were found.
    pub found: Share,
    /// Range of the parameter of the axis; `None` without pictures.
    pub range: Option<[f64; 2]>,
}

/// The fraction of look-alikes that a model accepted as the part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LookAlikeFigures {
    /// The kind of look-alike, or one of the sums [`Self::SAME_SIZE`] and [`Self::SIZE_ALONE`].
    pub kind: String,
    pub model: ModelKind,
    /// With the check or without.
    pub way: Way,
    /// Pictures in which the look-alike was accepted.
    pub accepted: Share,
    /// 95 % confidence interval (Wilson) of `accepted`.
    pub accepted_interval: [f64; 2],
    /// The fraction of each part.
    pub parts: Vec<PartShare>,
}

impl LookAlikeFigures {
    /// The sum over look-alikes that are as large as the part.
    pub const SAME_SIZE: &str = "same size";
    /// The sum over look-alikes that differ only in size, which is not visible without a calibrated camera.
    pub const SIZE_ALONE: &str = "size alone";

    /// Whether the kind is one of the sums.
    pub fn is_sum(&self) -> bool {
        [Self::SAME_SIZE, Self::SIZE_ALONE].contains(&self.kind.as_str())
    }
}

/// Results of a model's grasps under an error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GraspFigures {
    pub condition: GraspCondition,
    pub model: ModelKind,
    /// Attempts that held the part, of all attempts.
    pub held: Share,
    /// 95 % confidence interval (Wilson) of `held`.
    pub held_interval: [f64; 2],
    /// Attempts that held the part after one picture from afar and one from above, of all attempts.
    pub held_at_first_look: Share,
    /// Attempts that held the part after further pictures, of all attempts.
    pub held_after_further_looks: Share,
    /// Failed attempts by the step at which they ended.
    pub failures_by_step: BTreeMap<String, usize>,
    /// Median and 90th percentile of the position errors of the last detections, in millimetres.
    pub distance_mm: Option<[f64; 2]>,
    /// The fraction of each part.
    pub parts: Vec<PartShare>,
}

/// The part with the smallest fraction.
pub fn lowest(parts: &[PartShare]) -> Option<&PartShare> {
    parts.iter().min_by(|a, b| {
        let percent = |part: &PartShare| part.share.percent().unwrap_or(f64::INFINITY);
        percent(a).total_cmp(&percent(b))
    })
}

/// The median and the 90th percentile.
fn spread(values: &[f64]) -> Option<[f64; 2]> {
    Some([percentile(values.iter().copied(), 50.0)?, percentile(values.iter().copied(), 90.0)?])
}

impl AxesSummary {
    /// Sums the results in the store.
    ///
    /// # Errors
    /// Records cannot be read.
    pub fn collect(evaluation: &AxesEvaluation) -> Result<Self> {
        let mut groups = Vec::new();
        let mut seconds = Seconds::default();
        for group in PartGroup::ALL {
            let objects: Vec<&str> = evaluation
                .objects
                .iter()
                .map(|object| object.name.as_str())
                .filter(|object| PartGroup::of(object) == group)
                .collect();
            if !objects.is_empty() {
                groups.push(GroupSummary {
                    group,
                    objects: objects.iter().map(|object| (*object).to_owned()).collect(),
                    axes: axes(evaluation, &objects, &mut seconds)?,
                    look_alikes: look_alikes(evaluation, &objects, &mut seconds)?,
                    grasps: grasps(evaluation, &objects, &mut seconds)?,
                });
                seconds.teaching += teaching_secs(evaluation, &objects)?;
            }
        }
        Ok(Self {
            axis_settings: evaluation.axis_settings(),
            grasp_settings: evaluation.grasp_settings(),
            remaining: evaluation.remaining()?,
            seconds,
            groups,
        })
    }
}

fn axes(evaluation: &AxesEvaluation, objects: &[&str], seconds: &mut Seconds) -> Result<Vec<AxisFigures>> {
    let mut figures = Vec::new();
    for &axis in evaluation.selection.axes.iter().filter(|axis| **axis != Axis::LookAlikes) {
        for &model in evaluation.models {
            let records = records(evaluation, objects, model, axis)?;
            seconds.pictures += records.iter().filter_map(|(_, record)| Some(record.as_ref()?.seconds)).sum::<f64>();
            for way in Way::ALL.into_iter().filter(|way| way.is_of(model)) {
                figures.push(axis_figures(axis, model, way, &records, evaluation.axis_views as usize));
            }
        }
    }
    Ok(figures)
}

/// The records of each part: `None` if teaching gave no model; no entry if the part was not measured yet.
fn records<'o>(
    evaluation: &AxesEvaluation,
    objects: &[&'o str],
    model: ModelKind,
    axis: Axis,
) -> Result<Vec<(&'o str, Option<AxisRecord>)>> {
    let mut records = Vec::new();
    for &object in objects {
        let cell = Cell { model, object };
        if cell.is_without_model(Marks::Shipped, evaluation.store)? {
            records.push((object, None));
        } else if let Some(record) = evaluation.axis_record(cell, axis)? {
            records.push((object, Some(record)));
        }
    }
    Ok(records)
}

/// Number of instances of the part in each picture of an axis, except for look-alikes.
pub(in crate::simulated) fn instances_in_picture(axis: Axis) -> usize {
    if axis == Axis::Instances { 3 } else { 1 }
}

/// The results of a model along an axis. Without a model, every instance counts as missed.
fn axis_figures(
    axis: Axis,
    model: ModelKind,
    way: Way,
    records: &[(&str, Option<AxisRecord>)],
    axis_views: usize,
) -> AxisFigures {
    let instances_each = instances_in_picture(axis);
    let part = |(object, record): &(&str, Option<AxisRecord>)| PartShare {
        object: (*object).to_owned(),
        share: match record {
            Some(record) => Share::of(record.outcomes(axis, way), |(_, is_right)| *is_right),
            None => Share { count: 0, of: axis_views * instances_each },
        },
    };
    let parts: Vec<PartShare> = records.iter().map(part).collect();
    let found: Share = parts.iter().map(|part| part.share).sum();
    let answers: Vec<&Answer> =
        records.iter().filter_map(|(_, record)| record.as_ref()).flat_map(|record| record.answers(way)).collect();
    let accepted = || answers.iter().flat_map(|answer| &answer.detections).filter(|detection| detection.is_accepted());
    let third_of = thirds(axis_views);
    AxisFigures {
        axis: axis.name(),
        model,
        way,
        found,
        found_interval: wilson_interval(found),
        wrong: answers.iter().map(|answer| answer.num_wrong()).sum(),
        pictures: records.iter().map(|(_, record)| record.as_ref().map_or(axis_views, |r| r.pictures.len())).sum(),
        distance_mm: spread(&accepted().filter_map(|detection| detection.error_mm).collect::<Vec<_>>()),
        turn_deg: spread(&accepted().filter_map(|detection| detection.error_deg).collect::<Vec<_>>()),
        thirds: [0, 1, 2].map(|third| of_third(third, axis, way, records, &third_of)),
        parts,
    }
}

/// The third of each picture of an axis in the order of the strata: 0, 1 or 2.
fn thirds(axis_views: usize) -> Vec<usize> {
    let mut numbers: Vec<usize> = (0..axis_views).collect();
    numbers.sort_by_key(|&number| axis_stratum(number as u64, axis_views as u64));
    let mut third_of = vec![0; axis_views];
    for (rank, &number) in numbers.iter().enumerate() {
        third_of[number] = rank * 3 / axis_views;
    }
    third_of
}

/// A third of the pictures, over all parts. Without a model, every instance counts as missed.
fn of_third(third: usize, axis: Axis, way: Way, records: &[(&str, Option<AxisRecord>)], third_of: &[usize]) -> Third {
    let mut sum = Third::default();
    let is_in_third = |number: u64| third_of.get(number as usize) == Some(&third);
    for (_, record) in records {
        let Some(record) = record else {
            let num_pictures = third_of.iter().filter(|of| **of == third).count();
            sum.found = sum.found + Share { count: 0, of: num_pictures * instances_in_picture(axis) };
            continue;
        };
        let outcomes = record.outcomes(axis, way).into_iter().filter(|((number, _), _)| is_in_third(*number));
        sum.found = sum.found + Share::of(outcomes, |(_, is_right)| *is_right);
        for picture in record.pictures.iter().filter(|picture| is_in_third(picture.number)) {
            let [low, high] = sum.range.unwrap_or([picture.parameter; 2]);
            sum.range = Some([low.min(picture.parameter), high.max(picture.parameter)]);
        }
    }
    sum
}

/// The results by kind of look-alike, followed by the two sums. A part on which the model could not be taught is left
/// out, because nothing can be accepted.
fn look_alikes(evaluation: &AxesEvaluation, objects: &[&str], seconds: &mut Seconds) -> Result<Vec<LookAlikeFigures>> {
    let mut figures = Vec::new();
    if !evaluation.selection.axes.contains(&Axis::LookAlikes) {
        return Ok(figures);
    }
    for &model in evaluation.models {
        let records = records(evaluation, objects, model, Axis::LookAlikes)?;
        seconds.pictures += records.iter().filter_map(|(_, record)| Some(record.as_ref()?.seconds)).sum::<f64>();
        let mut kinds: Vec<String> = Vec::new();
        for picture in records.iter().filter_map(|(_, record)| record.as_ref()).flat_map(|record| &record.pictures) {
            if let Some(look_alike) = &picture.look_alike
                && !kinds.contains(&look_alike.kind)
            {
                kinds.push(look_alike.kind.clone());
            }
        }
        kinds.extend([LookAlikeFigures::SAME_SIZE, LookAlikeFigures::SIZE_ALONE].map(str::to_owned));
        for way in Way::ALL.into_iter().filter(|way| way.is_of(model)) {
            figures.extend(kinds.iter().map(|kind| look_alike_figures(kind, model, way, &records)));
        }
    }
    Ok(figures)
}

fn look_alike_figures(
    kind: &str,
    model: ModelKind,
    way: Way,
    records: &[(&str, Option<AxisRecord>)],
) -> LookAlikeFigures {
    let parts: Vec<PartShare> = records
        .iter()
        .filter_map(|(object, record)| {
            let record = record.as_ref()?;
            let of_kind = record.pictures.iter().zip(record.answers(way)).filter(|(picture, _)| {
                picture.look_alike.as_ref().is_some_and(|look_alike| match kind {
                    LookAlikeFigures::SAME_SIZE => !look_alike.differs_in_size_alone,
                    LookAlikeFigures::SIZE_ALONE => look_alike.differs_in_size_alone,
                    kind => look_alike.kind == kind,
                })
            });
            let share = Share::of(of_kind, |(_, answer)| answer.is_accepted());
            (share.of > 0).then(|| PartShare { object: (*object).to_owned(), share })
        })
        .collect();
    let accepted: Share = parts.iter().map(|part| part.share).sum();
    LookAlikeFigures {
        kind: kind.to_owned(),
        model,
        way,
        accepted,
        accepted_interval: wilson_interval(accepted),
        parts,
    }
}

fn grasps(evaluation: &AxesEvaluation, objects: &[&str], seconds: &mut Seconds) -> Result<Vec<GraspFigures>> {
    let mut figures = Vec::new();
    for &condition in &evaluation.selection.conditions {
        for model in evaluation.grasping_models() {
            let mut by_part: Vec<(&str, Vec<AttemptRecord>)> = Vec::new();
            for &object in objects {
                let cell = Cell { model, object };
                by_part.push((
                    object,
                    match cell.teaching_from(marks_of(condition), evaluation.store)? {
                        Some(TeachingRecord::Failed { why }) => (1..=evaluation.store.settings().attempts as usize)
                            .map(|number| AttemptRecord::failed(number, AttemptRecord::TEACH, why.clone()))
                            .collect(),
                        _ => evaluation.grasps(cell, condition)?,
                    },
                ));
            }
            seconds.grasps += by_part.iter().flat_map(|(_, attempts)| attempts).map(|a| a.seconds).sum::<f64>();
            figures.push(grasp_figures(condition, model, &by_part));
        }
    }
    Ok(figures)
}

fn grasp_figures(condition: GraspCondition, model: ModelKind, by_part: &[(&str, Vec<AttemptRecord>)]) -> GraspFigures {
    let attempts: Vec<&AttemptRecord> = by_part.iter().flat_map(|(_, attempts)| attempts).collect();
    let held = Share::of(&attempts, |attempt| attempt.success);
    let held_at_first_look = Share::of(&attempts, |attempt| attempt.is_held_at_first_look());
    let mut failures_by_step = BTreeMap::new();
    for attempt in attempts.iter().filter(|attempt| !attempt.success) {
        *failures_by_step.entry(attempt.step.clone()).or_default() += 1;
    }
    let part = |(object, attempts): &(&str, Vec<AttemptRecord>)| PartShare {
        object: (*object).to_owned(),
        share: Share::of(attempts, |attempt| attempt.success),
    };
    GraspFigures {
        condition,
        model,
        held,
        held_interval: wilson_interval(held),
        held_at_first_look,
        held_after_further_looks: Share { count: held.count - held_at_first_look.count, of: held.of },
        failures_by_step,
        distance_mm: spread(&attempts.iter().filter_map(|attempt| attempt.error_mm).collect::<Vec<_>>()),
        parts: by_part.iter().map(part).filter(|part| part.share.of > 0).collect(),
    }
}

/// The time of the successful teaching runs of the measured models, each counted once.
fn teaching_secs(evaluation: &AxesEvaluation, objects: &[&str]) -> Result<f64> {
    let mut taught: Vec<(ModelKind, Marks)> =
        evaluation.models.iter().map(|model| (model.taught_as(), Marks::Shipped)).collect();
    if evaluation.selection.conditions.contains(&GraspCondition::Marks) {
        taught.extend(evaluation.grasping_models().map(|model| (model.taught_as(), Marks::Jittered)));
    }
    taught.sort_by_key(|(model, marks)| (model.letter(), *marks == Marks::Jittered));
    taught.dedup();
    let mut seconds = 0.0;
    for &object in objects {
        for &(model, marks) in &taught {
            if let Some(TeachingRecord::Taught { facts, .. }) =
                (Cell { model, object }).teaching_from(marks, evaluation.store)?
            {
                seconds += facts.seconds;
            }
        }
    }
    Ok(seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirds_are_in_the_order_of_the_parameter() {
        assert_eq!(thirds(2), [0, 1]);
        assert_eq!(thirds(6), [0, 0, 1, 1, 2, 2]);
        let of_25 = thirds(25);
        // The strata of the last five pictures are 2, 6, 10, 14 and 18.
        assert_eq!(of_25[20..], [0, 0, 1, 2, 2]);
        assert_eq!([of_25[0], of_25[10], of_25[19]], [0, 1, 2]);
    }
}
