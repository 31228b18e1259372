//! The page of the axes and the grasps under errors.

use sdg_grasp::ModelKind;
use sdg_report::{KeyFigure, Report, Section, ShareChart, Tone};

use super::summary::{AxesSummary, AxisFigures, GroupSummary};
use super::tables::{notice, tables};
use super::way::Way;
use crate::footer::FOOTER;
use crate::simulated::tables::{Titled, this_run};

/// The page: charts of the fractions, then all tables; `more` are additional tables.
pub fn page(summary: &AxesSummary, more: Vec<Titled>, facts: &[(&str, String)], command: &str) -> Report {
    let mut report = Report::new("Axes and grasps under errors").kicker("Evaluation in simulation").lead(
        "Detections of the models in pictures with one difficulty at a time, and grasps with one error in the robot's settings. \
         The paper's parts and the held-out ones are listed separately.",
    );
    for group in &summary.groups {
        for (model, figures) in worst_axes(group) {
            let Some(percent) = figures.found.percent() else { continue };
            let label = format!("{}: model {model} on its worst axis, {}", group.group.title(), figures.axis);
            let tone = if percent >= 80.0 { Tone::Plain } else { Tone::Warning };
            report = report.key_figure(KeyFigure::new(format!("{percent:.0}"), "%", label).tone(tone));
        }
    }
    // The notice is in the first section of the page.
    let mut notice = notice(summary);
    let mut begun = |section: Section| match notice.take() {
        Some(notice) => section.notice(Tone::Warning, notice),
        None => section,
    };
    for group in &summary.groups {
        report = report.section(plots(group, begun(Section::new(format!("{} at a glance", group.group.title())))));
    }
    for Titled { title, lead, table } in tables(summary).into_iter().chain(more) {
        report = report.section(begun(Section::new(title).lead(lead)).table(table));
    }
    report.section(this_run(facts, command)).footer(FOOTER)
}

/// For each model, the axis with the smallest fraction found, with the check.
fn worst_axes(group: &GroupSummary) -> Vec<(ModelKind, &AxisFigures)> {
    let mut worst: Vec<(ModelKind, &AxisFigures)> = Vec::new();
    for figures in group.axes.iter().filter(|figures| figures.way == Way::WithCheck && figures.found.of > 0) {
        match worst.iter_mut().find(|(model, _)| *model == figures.model) {
            Some((_, least)) if figures.found.percent() < least.found.percent() => *least = figures,
            Some(_) => {}
            None => worst.push((figures.model, figures)),
        }
    }
    worst
}

/// One chart for each axis, and one for the grasps under all errors.
fn plots(group: &GroupSummary, mut section: Section) -> Section {
    let percent = |interval: [f64; 2]| interval.map(|share| 100.0 * share);
    let mut axes: Vec<&str> = group.axes.iter().map(|figures| figures.axis).collect();
    axes.dedup();
    for axis in axes {
        let of_axis = || group.axes.iter().filter(|figures| figures.axis == axis);
        let mut chart = ShareChart::new(format!("Found: {axis}")).reference_name("network alone");
        for figures in of_axis().filter(|figures| figures.way == Way::WithCheck) {
            let Some(found) = figures.found.percent() else { continue };
            let alone = of_axis().find(|other| other.way == Way::NetworkAlone && other.model == figures.model);
            let reference = alone.and_then(|alone| alone.found.percent());
            chart = chart.row(figures.model.letter(), found, percent(figures.found_interval), reference);
        }
        section = section.shares(chart);
    }
    let mut grasps = ShareChart::new("Held").reference_name("at the first look");
    for figures in &group.grasps {
        let Some(held) = figures.held.percent() else { continue };
        let label = format!("{}, {}", figures.condition.name(), figures.model);
        grasps = grasps.row(label, held, percent(figures.held_interval), figures.held_at_first_look.percent());
    }
    if group.grasps.is_empty() { section } else { section.shares(grasps) }
}
