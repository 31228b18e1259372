//! Compares two runs on the same pictures: whether their models differ, and the number of cases needed to show a
//! difference.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use sdg_grasp::ModelKind;
use sdg_report::{Cell as TableCell, Column, Table};
use sdg_simulation::views::Axis;
use serde::Serialize;

use super::paired::PairedCounts;
use super::records::AxisRecord;
use super::settings::AxisSettings;
use super::units::{AxesEvaluation, axis_file};
use super::way::Way;
use crate::simulated::cell::Cell;
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
    /// The folder has no results of axes.
    pub fn open(folder: &Path) -> Result<Self> {
        if !folder.join("axes").is_dir() {
            bail!("{}: expected the folder of another run over axes, found none", folder.display());
        }
        Ok(Self { folder: folder.to_owned() })
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Compares each model with itself in the other run, in the cases that both runs have.
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
            let (Some(this), Some(other)) =
                (evaluation.axis_record(cell, axis)?, self.record(cell, axis, &evaluation.axis_settings())?)
            else {
                continue;
            };
            let others = other.outcomes(axis, way);
            for (case, is_right) in this.outcomes(axis, way) {
                if let Some((_, other_is_right)) = others.iter().find(|(other, _)| *other == case) {
                    counts.add(is_right, *other_is_right);
                }
            }
        }
        Ok(counts)
    }

    /// The detections of the other run's model, after a check that the pictures are the same.
    fn record(&self, cell: Cell, axis: Axis, settings: &AxisSettings) -> Result<Option<AxisRecord>> {
        /// The settings that determine the pictures. The settings of teaching and search may differ between the runs.
        #[derive(Serialize)]
        struct PictureSettings {
            axes: u32,
            seed: u64,
        }
        let path = self.folder.join(axis_file(cell, axis));
        let Some((made_with, record)) = read_stored(&path)? else { return Ok(None) };
        let pictures = PictureSettings { axes: settings.axes, seed: settings.teaching.seed };
        if let Some(difference) = difference(&pictures, &made_with)? {
            bail!("{}: expected the same pictures, found others ({difference})", path.display());
        }
        let record =
            serde_json::from_value(record).with_context(|| format!("{}: expected a record", path.display()))?;
        Ok(Some(record))
    }
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
                       were independent."
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
