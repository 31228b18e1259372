//! The evaluation as a page.

use anyhow::Result;
use sdg_report::{Figure, GallerySize, KeyFigure, Report, Section, Tone};

use super::cell::Cell;
use super::store::Store;
use super::summary::Summary;
use super::tables::{Titled, notice, tables};

/// The tables, success at a glance, and a picture of every cell.
pub fn page(summary: &Summary, store: &Store, facts: &[(&str, String)], command: &str) -> Result<Report> {
    let parts = summary.cells.len() / summary.models.len().max(1);
    let mut report = Report::new("Every model on every part").kicker("Evaluation in simulation").lead(format!(
        "Models: {}. Parts: {parts}. Each model was taught each part from one photo, and then looked for it and grasped it \
         in poses that it had not seen.",
        summary.models.iter().map(|model| model.model.letter()).collect::<Vec<_>>().join(", ")
    ));
    for model in &summary.models {
        let Some(percent) = model.verified.held.percent() else { continue };
        let tone = if percent >= 95.0 { Tone::Good } else { Tone::Warning };
        let label = format!("held by model {}, {}", model.model, model.verified.held);
        report = report.key_figure(KeyFigure::new(format!("{percent:.0}"), "%", label).tone(tone));
    }
    let mut notice = notice(summary);
    for Titled { title, lead, table } in tables(summary) {
        let mut section = Section::new(title).lead(lead);
        if let Some(notice) = notice.take() {
            section = section.notice(Tone::Warning, notice);
        }
        report = report.section(section.table(table));
    }
    let figures = pictures(summary, store)?;
    if !figures.is_empty() {
        report = report.section(
            Section::new("What they see")
                .lead("The first unseen picture of each part, with what each model says of it.")
                .gallery(GallerySize::Small, figures),
        );
    }
    Ok(report
        .section(
            Section::new("This run")
                .lead("Everything needed to see the same numbers again.")
                .facts(facts.iter().map(|(name, value)| (*name, value.clone())))
                .command(command),
        )
        .footer("Made by sdg. This page is one file: it fetches nothing and runs no script."))
}

fn pictures(summary: &Summary, store: &Store) -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    for summary in &summary.cells {
        let cell = Cell { model: summary.model, object: &summary.object };
        let path = store.path(&cell.picture_file());
        if path.exists() {
            let caption = format!("{}, {}", summary.model, summary.object.replace('_', " "));
            figures.push(Figure::photo(crate::files::read_image(&path)?).caption(caption));
        }
    }
    Ok(figures)
}
