//! The page of the evaluation.

use anyhow::Result;
use sdg_report::{Axis, Chart, Figure, GallerySize, KeyFigure, Matrix, Report, Section, Series, ShareChart, Tone};

use super::cell::Cell;
use super::groups::PartGroup;
use super::paper;
use super::records::{AttemptRecord, LOSS_STEPS, TeachingRecord};
use super::store::Store;
use super::summary::{Figures, ModelSummary, Summary};
use super::tables::{Titled, notice, tables, this_run};
use crate::footer::FOOTER;

/// The page: charts of the success, the tables, and a picture of every cell, for each group.
pub fn page(summaries: &[Summary], store: &Store, facts: &[(&str, String)], command: &str) -> Result<Report> {
    let parts: usize = summaries.iter().map(|summary| summary.cells.len() / summary.models.len().max(1)).sum();
    let letters = summaries.first().into_iter().flat_map(|summary| &summary.models).map(|model| model.model.letter());
    let mut report = Report::new("Every model on every part").kicker("Evaluation in simulation").lead(format!(
        "Models: {}. Parts: {parts}. Each model was taught each part from one photo, and then searched for it and \
         grasped it in unseen poses.",
        letters.collect::<Vec<_>>().join(", ")
    ));
    for summary in summaries {
        for model in &summary.models {
            let Some(percent) = model.verified.held.percent() else { continue };
            let tone = if percent >= 95.0 { Tone::Good } else { Tone::Warning };
            let of = if summary.group == PartGroup::HeldOut { " (held-out parts)" } else { "" };
            let label = format!("held by model {}, {}{of}", model.model, model.verified.held);
            report = report.key_figure(KeyFigure::new(format!("{percent:.0}"), "%", label).tone(tone));
        }
    }
    // The notice is in the first section of the page.
    let mut notice = summaries.first().and_then(notice);
    let mut begun = |section: Section| match notice.take() {
        Some(notice) => section.notice(Tone::Warning, notice),
        None => section,
    };
    for summary in summaries {
        let titled = |title: &str| match summary.group {
            PartGroup::Paper => title.to_owned(),
            PartGroup::HeldOut => format!("{}: {}", summary.group.title(), title.to_lowercase()),
        };
        if summary.cells.iter().any(|cell| cell.verified.held.of > 0) {
            report = report.section(plots(summary, begun(Section::new(titled("At a glance")))));
        }
        for Titled { title, lead, table } in tables(summary) {
            report = report.section(begun(Section::new(title).lead(lead)).table(table));
        }
        if let Some(losses) = losses(summary) {
            report = report.section(
                Section::new(titled("Training loss"))
                    .lead("Models B and C are two readings of one network.")
                    .charts(vec![losses]),
            );
        }
        let figures = pictures(summary, store)?;
        if !figures.is_empty() {
            report = report.section(
                Section::new(titled("Detections"))
                    .lead("The first unseen picture of each part, with each model's detections.")
                    .gallery(GallerySize::Small, figures),
            );
        }
    }
    Ok(report.section(this_run(facts, command)).footer(FOOTER))
}

/// The success compared with the paper's, and the steps at which attempts ended, by model and by part.
fn plots(summary: &Summary, section: Section) -> Section {
    let mut shares = ShareChart::new("Attempts that held the part").reference_name("the paper");
    let mut by_model = outcomes("Where attempts end, by model");
    for model in &summary.models {
        let Some(percent) = model.verified.held.percent() else { continue };
        let reference = paper::row(model.model).map(|row| row.success_percent);
        let interval = model.verified.held_interval.map(|share| 100.0 * share);
        shares = shares.row(model.model.letter(), percent, interval, reference);
        by_model = by_model.row(model.model.letter(), counts([&model.verified]));
    }
    let mut objects: Vec<&str> = summary.cells.iter().map(|cell| cell.object.as_str()).collect();
    objects.sort_unstable();
    objects.dedup();
    let by_part = objects.into_iter().fold(outcomes("Where attempts end, by part"), |matrix, object| {
        let cells = summary.cells.iter().filter(|cell| cell.object == object);
        matrix.row(object.replace('_', " "), counts(cells.map(|cell| &cell.verified)))
    });
    section
        .lead("With the check against the demonstration; the tables below also have the numbers without it.")
        .shares(shares)
        .matrix(by_model)
        .matrix(by_part)
}

fn outcomes(title: &str) -> Matrix {
    let columns = AttemptRecord::steps().chain(["held"]);
    Matrix::new(title, columns).good_column(AttemptRecord::steps().count())
}

/// Number of attempts that ended at each step, and number of held parts.
fn counts<'a>(figures: impl IntoIterator<Item = &'a Figures>) -> Vec<usize> {
    let mut counts = vec![0; AttemptRecord::steps().count() + 1];
    for figures in figures {
        for (count, step) in counts.iter_mut().zip(AttemptRecord::steps()) {
            *count += figures.failures_by_step.get(step).copied().unwrap_or(0);
        }
        counts[AttemptRecord::steps().count()] += figures.held.count;
    }
    counts
}

/// The loss of each network, averaged over the parts; `None` if no loss was stored.
fn losses(summary: &Summary) -> Option<Chart> {
    let mut chart = Chart::new("Training loss", Axis::new("step"), Axis::new("loss").logarithmic())
        .caption(format!("Mean of the parts and of {LOSS_STEPS} steps each."));
    let mut drawn = Vec::new();
    for ModelSummary { model, network, .. } in &summary.models {
        let cells = summary.cells.iter().filter(|cell| cell.model == *model);
        let curves = cells.filter_map(|cell| match &cell.teaching {
            Some(TeachingRecord::Taught { losses, .. }) if !losses.is_empty() => Some(losses),
            _ => None,
        });
        let curves: Vec<_> = curves.collect();
        let shortest = curves.iter().map(|losses| losses.len()).min().unwrap_or(0);
        if shortest == 0 || drawn.contains(network) {
            continue;
        }
        let mean = |at: usize| curves.iter().map(|losses| losses[at]).sum::<f64>() / curves.len() as f64;
        let points = (0..shortest).map(|at| (((at + 1) * LOSS_STEPS) as f64, mean(at))).collect();
        chart = chart.series(Series::new(format!("network of model {network}"), points));
        drawn.push(*network);
    }
    (!drawn.is_empty()).then_some(chart)
}

fn pictures(summary: &Summary, store: &Store) -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    for summary in &summary.cells {
        let cell = Cell { model: summary.model, object: &summary.object };
        let path = store.path(&cell.picture_file());
        if path.exists() {
            let caption = format!("{}, {}", summary.model, summary.object.replace('_', " "));
            figures.push(Figure::photo(sdg_inputs::read_image(&path)?).caption(caption));
        }
    }
    Ok(figures)
}
