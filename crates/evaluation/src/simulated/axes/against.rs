//! Compares two runs on the same pictures: whether their models differ, and the number of cases needed to show a
//! difference.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use sdg_grasp::ModelKind;
use sdg_report::{Cell as TableCell, Column, Table};
use sdg_simulation::views::Axis;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use super::paired::PairedCounts;
use super::records::{AxisRecord, Case};
use super::settings::has_complete_rounds;
use super::summary::instances_in_picture;
use super::units::{AxesEvaluation, axis_file};
use super::way::Way;
use crate::simulated::cell::{Cell, Marks};
use crate::simulated::groups::PartGroup;
use crate::simulated::settings::difference;
use crate::simulated::store::read_stored;
use crate::simulated::tables::Titled;
use crate::statistics::Share;

/// Name of the sum over all axes with the part in the pictures.
pub const ALL_WITH_PART: &str = "all with the part";

/// A model in two runs on the same pictures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunDifference {
    pub group: PartGroup,
    /// The name of the axis, or [`ALL_WITH_PART`].
    pub axis: &'static str,
    pub model: ModelKind,
    /// With the check or without.
    pub way: Way,
    /// Numbers of cases solved by both runs, by one of them, or by neither; the first run is this one.
    pub counts: PairedCounts,
    /// This run's fraction minus the other's.
    pub difference: f64,
    /// 95 % confidence interval of the difference.
    pub interval: [f64; 2],
    /// Whether the interval excludes zero.
    pub differs: bool,
    /// Number of cases that would show a difference of this size; see [`PairedCounts::cases_needed`].
    pub cases_needed: Option<usize>,
}

/// The folder of another run.
pub struct Against {
    folder: PathBuf,
}

impl Against {
    /// Checks that a folder contains an evaluation. The folder is only read: another process may be writing to it.
    ///
    /// # Errors
    /// The folder has no results of pictures of axes.
    pub fn open(folder: &Path) -> Result<Self> {
        // Every evaluation makes the folder axes, which also has attempts under errors.
        let is_record = |name: &str| Axis::ALL.iter().any(|axis| name.ends_with(&format!(".{}.json", axis.name())));
        let files = fs::read_dir(folder.join("axes"));
        if !files.into_iter().flatten().flatten().any(|file| is_record(&file.file_name().to_string_lossy())) {
            bail!("{}: expected the folder of another run over axes, found no results of pictures", folder.display());
        }
        Ok(Self { folder: folder.to_owned() })
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Compares each model with itself in the other run, in the cases that both runs have. Without a model, every
    /// instance counts as missed.
    ///
    /// # Errors
    /// Records cannot be read, or have other pictures.
    pub fn compare(&self, evaluation: &AxesEvaluation) -> Result<Vec<RunDifference>> {
        let mut comparisons = Vec::new();
        for group in PartGroup::ALL {
            for &model in evaluation.models {
                for way in Way::ALL.into_iter().filter(|way| way.is_of(model)) {
                    let mut with_part = PairedCounts::default();
                    for &axis in &evaluation.selection.axes {
                        let counts = self.counts(evaluation, group, model, way, axis)?;
                        if axis != Axis::LookAlikes {
                            with_part = with_part + counts;
                        }
                        comparisons.extend(RunDifference::new(group, axis.name(), model, way, counts));
                    }
                    comparisons.extend(RunDifference::new(group, ALL_WITH_PART, model, way, with_part));
                }
            }
        }
        Ok(comparisons)
    }

    fn counts(
        &self,
        evaluation: &AxesEvaluation,
        group: PartGroup,
        model: ModelKind,
        way: Way,
        axis: Axis,
    ) -> Result<PairedCounts> {
        let mut counts = PairedCounts::default();
        for object in evaluation.objects.iter().filter(|object| PartGroup::of(&object.name) == group) {
            let cell = Cell { model, object: &object.name };
            let this = match cell.is_without_model(Marks::Shipped, evaluation.store)? {
                true => Some(all_missed(axis, evaluation.axis_views)),
                false => evaluation.axis_record(cell, axis)?.map(|record| record.outcomes(axis, way)),
            };
            let (Some(this), Some(others)) = (this, self.outcomes(evaluation, cell, axis, way)?) else { continue };
            for (case, is_right) in this {
                if let Some((_, other_is_right)) = others.iter().find(|(other, _)| *other == case) {
                    counts.add(is_right, *other_is_right);
                }
            }
        }
        Ok(counts)
    }

    /// The outcomes of the other run's model; `None` if it was not measured.
    fn outcomes(
        &self,
        evaluation: &AxesEvaluation,
        cell: Cell,
        axis: Axis,
        way: Way,
    ) -> Result<Option<Vec<(Case, bool)>>> {
        // Only the settings that determine the pictures: those of teaching and search may differ between the runs.
        let settings = evaluation.axis_settings();
        let seed = settings.teaching.seed;
        let mut pictures = json!({ "axes": settings.axes, "seed": seed });
        if !has_complete_rounds(settings.axis_views) {
            pictures["axis_views"] = settings.axis_views.into();
        }
        // Other versions may describe a success in other words.
        let teaching: Option<Value> = self.record(&cell.teaching_file(Marks::Shipped), &json!({ "seed": seed }))?;
        if teaching.is_some_and(|teaching| teaching.get("failed").is_some()) {
            return Ok(Some(all_missed(axis, evaluation.axis_views)));
        }
        let record: Option<AxisRecord> = self.record(&axis_file(cell, axis), &pictures)?;
        Ok(record.map(|record| record.outcomes(axis, way)))
    }

    /// A record of the other run, after a check that its pictures are the same.
    fn record<T: DeserializeOwned>(&self, name: &str, pictures: &Value) -> Result<Option<T>> {
        let path = self.folder.join(name);
        let Some((made_with, record)) = read_stored(&path)? else { return Ok(None) };
        if let Some(difference) = difference(pictures, &made_with)? {
            bail!("{}: expected the same pictures, found others ({difference})", path.display());
        }
        let record =
            serde_json::from_value(record).with_context(|| format!("{}: expected a record", path.display()))?;
        Ok(Some(record))
    }
}

/// The outcomes of a model that could not be taught. There are none for look-alikes, because nothing can be accepted.
fn all_missed(axis: Axis, axis_views: u32) -> Vec<(Case, bool)> {
    let num_instances = if axis == Axis::LookAlikes { 0 } else { instances_in_picture(axis) };
    let of_picture = |number| (0..num_instances).map(move |instance| ((number, instance), false));
    (0..u64::from(axis_views)).flat_map(of_picture).collect()
}

impl RunDifference {
    /// The comparison; `None` if there are no cases.
    fn new(group: PartGroup, axis: &'static str, model: ModelKind, way: Way, counts: PairedCounts) -> Option<Self> {
        Some(Self {
            group,
            axis,
            model,
            way,
            counts,
            difference: counts.difference()?,
            interval: counts.difference_interval()?,
            differs: counts.differs(),
            cases_needed: counts.cases_needed(),
        })
    }
}

/// The comparisons as one table per group of parts.
pub fn difference_tables(comparisons: &[RunDifference], against: &str) -> Vec<Titled> {
    PartGroup::ALL
        .into_iter()
        .filter_map(|group| {
            let rows: Vec<&RunDifference> = comparisons.iter().filter(|comparison| comparison.group == group).collect();
            (!rows.is_empty()).then(|| Titled {
                title: format!("{}: against {against}", group.title()),
                lead: "Both runs on the same pictures; right is an instance found or a look-alike refused. The interval of \
                       the difference is Newcombe's for paired fractions (1998, method 10), 95 %: a difference is shown if it \
                       excludes zero. Cases needed: number of cases that shows a difference of this size with 80 % power at the 5 % \
                       level, two-sided, by McNemar's test (Connor, 1987). Instances of one picture are counted as if they \
                       were independent. Without a model, every instance counts as missed."
                    .to_owned(),
                table: rows.into_iter().fold(header(), |table, comparison| table.row(comparison.row())),
            })
        })
        .collect()
}

fn header() -> Table {
    Table::new(vec![
        Column::text("axis"),
        Column::text("model"),
        Column::text(""),
        Column::text("this run").group("right"),
        Column::text("the other").group("right"),
        Column::number("only this").group("right"),
        Column::number("only the other").group("right"),
        Column::number("difference").unit("points"),
        Column::text("95 % interval"),
        Column::text("differs"),
        Column::text("cases needed"),
    ])
}

impl RunDifference {
    fn row(&self) -> Vec<TableCell> {
        let share = |share: Share| TableCell::text(share.to_string());
        let [low, high] = self.interval.map(|bound| 100.0 * bound);
        vec![
            TableCell::text(self.axis),
            TableCell::text(self.model.letter()),
            TableCell::text(self.way.name()),
            share(self.counts.first()),
            share(self.counts.second()),
            TableCell::number(self.counts.first_only as f64, 0),
            TableCell::number(self.counts.second_only as f64, 0),
            TableCell::number(100.0 * self.difference, 1),
            TableCell::text(format!("{low:.1} to {high:.1}")),
            TableCell::text(if self.differs { "yes" } else { "no" }),
            TableCell::text(self.cases_needed.map_or("–".to_owned(), |cases| cases.to_string())),
        ]
    }
}

#[cfg(test)]
mod tests {
    use sdg_grasp::Preset;
    use sdg_simulation::objects::ObjectSpec;

    use super::super::records::AxisPicture;
    use super::super::selection::Selection;
    use super::*;
    use crate::Settings;
    use crate::simulated::records::TeachingRecord;
    use crate::simulated::store::Store;

    /// Calls `with` with an evaluation of model C in the tilted pictures of two parts.
    fn with_evaluation<T>(folder: &Path, with: impl FnOnce(&AxesEvaluation) -> T) -> T {
        with(&AxesEvaluation {
            models: &[ModelKind::C],
            objects: &["pendulum", "key"].map(|name| ObjectSpec::by_name(name).unwrap()),
            selection: &Selection::parse(&["tilt".to_owned()]).unwrap(),
            preset: Preset::Edge,
            store: &Store::open(folder, &Settings::for_test(1, 2, 1)).unwrap(),
            axis_views: 2,
            search_points: None,
            jobs: 1,
        })
    }

    /// Stores the detections on one part, and that teaching on the other part failed.
    fn fill(folder: &Path, object: &str, found: [bool; 2], failed: &str) {
        with_evaluation(folder, |evaluation| {
            let pictures = [0, 1].map(|number| AxisPicture::for_test(number, found[number as usize])).to_vec();
            let file = axis_file(Cell { model: ModelKind::C, object }, Axis::Tilt);
            let record = AxisRecord { pictures, seconds: 1.0 };
            evaluation.store.write_made_with(&file, &evaluation.axis_settings(), &record).unwrap();
            let failed = Cell { model: ModelKind::C, object: failed }.teaching_file(Marks::Shipped);
            let record = TeachingRecord::Failed { why: "nothing learnt".into() };
            evaluation.store.write_made_with(&failed, &evaluation.store.settings().teaching(), &record).unwrap();
        });
    }

    #[test]
    fn a_part_whose_teaching_failed_in_one_run_counts_as_missed() {
        let [this, other] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        fill(this.path(), "pendulum", [true, false], "key");
        fill(other.path(), "key", [true, true], "pendulum");
        let against = Against::open(other.path()).unwrap();
        let compared = with_evaluation(this.path(), |evaluation| against.compare(evaluation).unwrap());
        let counts = |group: PartGroup| {
            let is_chosen =
                |run: &&RunDifference| (run.group, run.axis, run.way) == (group, Axis::Tilt.name(), Way::WithCheck);
            compared.iter().find(is_chosen).unwrap().counts
        };
        let none = PairedCounts::default();
        assert_eq!(counts(PartGroup::Paper), PairedCounts { first_only: 1, neither: 1, ..none });
        assert_eq!(counts(PartGroup::HeldOut), PairedCounts { second_only: 2, ..none });
        assert!(all_missed(Axis::LookAlikes, 2).is_empty());
    }

    #[test]
    fn a_run_without_pictures_of_axes_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        // The folder of attempts under an error.
        with_evaluation(folder.path(), |evaluation| {
            evaluation.store.write("axes/C-key.attempts-shake.json", &0).unwrap()
        });
        let refused = Against::open(folder.path()).err().unwrap().to_string();
        assert!(refused.contains("expected the folder of another run over axes, found no results"), "{refused}");
        fill(folder.path(), "key", [true, true], "pendulum");
        assert!(Against::open(folder.path()).is_ok());
    }
}
