//! The page of many parts.

use image::RgbImage;
use image::imageops::{self, FilterType};
use sdg_report::{Cell, Column, Figure, GallerySize, KeyFigure, Report, Section, Table, Tone, contact_sheet};

use super::findings::Findings;
use super::part_store::PartOutcome;
use crate::footer::FOOTER;
use crate::machine::machine;

/// Maximum number of pairs with photos on the page; the table has all pairs.
const MAX_SHOWN: usize = 24;
/// Maximum number of parts with a photo on the page; more photos would make the page too large for browsers.
const MAX_PHOTOS: usize = 200;
/// Width of each of two photos side by side, in pixels.
const PHOTO_WIDTH: u32 = 360;

/// The page: look-alikes, parts that need another photo, and the results of each part. `photos` are those of the taught
/// parts, reduced or not.
pub fn page(findings: &Findings, photos: &[RgbImage], command: &str) -> Report {
    let taught = findings.taught.len();
    let mut report = Report::new(format!("{taught} parts taught"))
        .kicker("Teaching")
        .lead(
            "Each part was taught from its own photos, and each model was then run on every other part's photo. If a model \
             accepts the photo of another part, that part could be grasped by mistake.",
        )
        .key_figure(KeyFigure::new(taught.to_string(), "", format!("of {} parts have a model", findings.parts.len())))
        .key_figure(count(findings.look_alikes.len(), "pairs look alike"))
        .key_figure(count(findings.need_photo.len(), "parts need another photo"));
    report = report.section(look_alikes(findings, photos));
    let section = Section::new("Another photo");
    let reasons = |of: &str, listed: &[(String, String)]| {
        let table = Table::new(vec![Column::text(of), Column::text("why")]);
        let row = |(name, why): &(String, String)| vec![Cell::text(name.clone()), Cell::text(why.clone())];
        listed.iter().map(row).fold(table, Table::row)
    };
    report = report.section(if findings.need_photo.is_empty() {
        section.paragraph("No part needs one.")
    } else {
        section
            .lead(
                "Photograph the part under other light or in another place, on a plain background, and mark it as \
                   before.",
            )
            .table(reasons("part", &findings.need_photo))
    });
    if !findings.left_out.is_empty() {
        report = report.section(Section::new("Photos left out").table(reasons("photo", &findings.left_out)));
    }
    report
        .section(all_parts(findings, photos))
        .section(Section::new("This run").facts([("machine", machine())]).command(command))
        .footer(FOOTER)
}

/// A photo as large as the page shows it: the photos of all parts are in memory together.
pub(super) fn thumbnail(photo: &RgbImage) -> RgbImage {
    let (width, height) = photo.dimensions();
    if width <= PHOTO_WIDTH {
        return photo.clone();
    }
    let ratio = f64::from(PHOTO_WIDTH) / f64::from(width);
    let height = ((f64::from(height) * ratio).round() as u32).max(1);
    imageops::resize(photo, PHOTO_WIDTH, height, FilterType::Triangle)
}

fn count(count: usize, what: &str) -> KeyFigure {
    KeyFigure::new(count.to_string(), "", what).tone(if count == 0 { Tone::Good } else { Tone::Warning })
}

fn look_alikes(findings: &Findings, photos: &[RgbImage]) -> Section {
    let section = Section::new("Look-alikes");
    if findings.look_alikes.is_empty() {
        return section.paragraph("No model accepts another part's photo.");
    }
    let mut table = Table::new(vec![
        Column::text("part"),
        Column::text("and part"),
        Column::number("first model on second photo"),
        Column::number("second model on first photo"),
    ]);
    let mut figures = Vec::new();
    for pair in &findings.look_alikes {
        let [first, second] = findings.names(pair);
        let [there, back] = pair.scores;
        if figures.len() < MAX_SHOWN {
            let both = pair.parts.map(|part| photos[part].clone());
            let caption = format!("{first} and {second}: {there:.2}, {back:.2}");
            figures.push(Figure::photo(contact_sheet(&both, 2, PHOTO_WIDTH)).caption(caption));
        }
        table = table.row(vec![Cell::text(first), Cell::text(second), Cell::number(there, 2), Cell::number(back, 2)]);
    }
    let caption = match findings.look_alikes.len() {
        count if count > MAX_SHOWN => format!("The {MAX_SHOWN} most alike of {count} pairs; the table has all."),
        _ => "The most alike first.".to_owned(),
    };
    section
        .lead(
            "Scores from 0.5 on are accepted. Two parts may be the same part with two names, or may differ only in \
               a mark: include the mark in the photo, or keep each part in its own place.",
        )
        .captioned_gallery(GallerySize::Large, figures, caption)
        .table(table)
}

fn all_parts(findings: &Findings, photos: &[RgbImage]) -> Section {
    let mut table = Table::new(vec![
        Column::text("part"),
        Column::number("teaching").unit("s"),
        Column::text("found").group("held-out samples"),
        Column::number("wrong").group("held-out samples"),
        Column::text("false alarms").group("held-out samples"),
        Column::number("median").unit("px").group("held-out samples"),
        Column::number("median").unit("°").group("held-out samples"),
        Column::number("own photo").group("score"),
        Column::number("most alike").group("score"),
        Column::text("which"),
    ]);
    for (name, outcome) in &findings.parts {
        let mut row = vec![Cell::text(name.clone())];
        match outcome {
            PartOutcome::Failed { .. } => {
                row.push(Cell::text("not taught"));
                row.extend((0..8).map(|_| Cell::missing()));
            }
            PartOutcome::Taught { seconds, found, parts, wrong, false_alarms, without_part, median, .. } => {
                let of_median = |at: usize| median.map_or(Cell::missing(), |median| Cell::number(median[at], 1));
                row.extend([
                    Cell::number(*seconds, 1),
                    Cell::text(format!("{found} of {parts}")),
                    Cell::number(*wrong as f64, 0),
                    Cell::text(format!("{false_alarms} of {without_part}")),
                    of_median(0),
                    of_median(1),
                ]);
                row.extend(scores(findings, name));
            }
        }
        table = table.row(row);
    }
    Section::new("Every part")
        .lead(
            "On held-out samples of the part's photos. The most similar photo is the other part's photo on which \
               the model has its best score.",
        )
        .table(table)
        .gallery(GallerySize::Small, photos_of_parts(findings, photos))
}

/// The photo that each part was taught from, with its name and its model's result.
fn photos_of_parts(findings: &Findings, photos: &[RgbImage]) -> Vec<Figure> {
    let figure = |(name, photo): (&String, &RgbImage)| {
        let outcome = findings.parts.iter().find(|(known, _)| known == name).map(|(_, outcome)| outcome);
        let figures = match outcome {
            Some(PartOutcome::Taught { found, parts, .. }) => format!("{name}: {found} of {parts} found"),
            _ => name.clone(),
        };
        Figure::photo(contact_sheet(std::slice::from_ref(photo), 1, PHOTO_WIDTH)).caption(figures)
    };
    findings.taught.iter().zip(photos).take(MAX_PHOTOS).map(figure).collect()
}

/// A model's score on its own photo, its best score on another photo, and the name of that photo.
fn scores(findings: &Findings, name: &str) -> [Cell; 3] {
    let Some(own) = findings.taught.iter().position(|known| known == name) else {
        return [Cell::missing(), Cell::missing(), Cell::missing()];
    };
    let row = &findings.check.scores[own];
    let others = row.iter().enumerate().filter(|(other, _)| *other != own);
    let best = others.max_by(|(_, a), (_, b)| a.total_cmp(b)).filter(|(_, score)| **score > 0.0);
    [
        Cell::number(row[own], 2),
        best.map_or(Cell::missing(), |(_, score)| Cell::number(*score, 2)),
        best.map_or(Cell::missing(), |(other, _)| Cell::text(findings.taught[other].clone())),
    ]
}
