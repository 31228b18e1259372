//! The page of the evaluation: totals, the effect of the minimum score, and every picture with its marks and
//! detections, worst first.

use anyhow::Result;
use image::RgbImage;
use nalgebra::Point2;
use sdg_geometry::{Keypoint, Polygon};
use sdg_grasp::{GraspDetection, Verification};
use sdg_report::{
    Axis, Cell, Chart, Color, Column, Figure, GallerySize, KeyFigure, Pen, Report, Section, Series, ShareChart, Table,
    Tone, draw_box, draw_grasp_jaws, draw_keypoints, draw_label, draw_line, draw_polygon,
};

use super::label_offset::{LabelOffset, label_offset};
use super::records::Evaluated;
use super::score::{HitError, Judged, Outcome, Tested, Totals, sweep};
use crate::footer::FOOTER;
use crate::machine::machine;
use crate::statistics::{Share, wilson_interval};

/// Maximum number of pictures drawn on the page, the worst ones.
const MAX_DRAWN: usize = 200;
/// Height of a tag's capitals in line widths; small, because a picture may have many tags.
const TAG_WIDTHS: f64 = 3.4;

/// Makes the page. Pictures are read again from their files.
///
/// # Errors
/// A picture cannot be read.
pub fn page(evaluated: &Evaluated, command: &str) -> Result<Report> {
    let judged = evaluated.judged();
    let totals = Totals::of(&judged);
    let mut order: Vec<usize> = (0..judged.len()).collect();
    order.sort_by_key(|&at| std::cmp::Reverse(num_errors(&judged[at])));
    let object = evaluated.model.object().replace('_', " ");
    let check = match evaluated.verification {
        Verification::ByShape => "with the check against the demonstration",
        Verification::Off => "without the check against the demonstration",
    };
    let mut report = Report::new(format!("{object}: found and missed on labelled pictures"))
        .kicker("Evaluation on labelled pictures")
        .lead(format!(
            "Model {} on {} pictures of {}, {check}. Detections that score at least {} count. A hit lies within 4 % of the \
             part's diagonal and 10° of the marks.",
            evaluated.model.kind(),
            judged.len(),
            evaluated.folder.file_name().map_or_else(|| ".".into(), |name| name.to_string_lossy()),
            evaluated.min_score,
        ));
    for key_figure in key_figures(&totals) {
        report = report.key_figure(key_figure);
    }
    report = report
        .section(at_a_glance(&totals, label_offset(&evaluated.tested, evaluated.min_score).as_ref()))
        .section(
            Section::new("The minimum score")
                .lead("The same detections, counted at other minimum scores.")
                .charts(vec![min_score_chart(evaluated)]),
        )
        .section(Section::new("By picture").lead("Worst first.").table(table(evaluated, &judged, &order)));
    for (title, lead, outcomes) in [
        (
            "Missed or wrong",
            "Missed marks are red and dashed; detections without a hit are red.",
            &[Outcome::Wrong, Outcome::Missed][..],
        ),
        ("False alarms", "The part is not in these pictures.", &[Outcome::FalseAlarm]),
        (
            "Right",
            "All parts were found, and no detection is wrong: marks are white, detections green with their scores, \
             grasps orange.",
            &[Outcome::Right],
        ),
        ("Quiet", "Pictures without the part in which nothing was detected.", &[Outcome::Quiet]),
    ] {
        let here = order.iter().take(MAX_DRAWN).filter(|&&at| outcomes.contains(&judged[at].outcome()));
        let figures = here.map(|&at| figure(&evaluated.tested[at], &judged[at])).collect::<Result<Vec<_>>>()?;
        if !figures.is_empty() {
            report = report.section(Section::new(title).lead(lead).gallery(GallerySize::Large, figures));
        }
    }
    Ok(report.section(this_run(evaluated, command)).footer(FOOTER))
}

/// The number of all errors, and of wrong detections in pictures with the part; the worst picture has the most.
fn num_errors(judged: &Judged) -> (usize, usize) {
    let all = judged.wrong() + judged.missed() + if judged.is_false_alarm() { judged.hits.len() } else { 0 };
    (all, judged.wrong())
}

fn key_figures(totals: &Totals) -> Vec<KeyFigure> {
    let good_from = |share: Share, percent: f64| match share.percent() {
        Some(found) if found >= percent => Tone::Good,
        _ => Tone::Warning,
    };
    let none = |count: usize| if count == 0 { Tone::Good } else { Tone::Warning };
    let of = |share: Share| format!("of {}", share.of);
    let mut figures = Vec::new();
    if totals.found.of > 0 {
        let found = KeyFigure::new(totals.found.count.to_string(), of(totals.found), "parts found");
        figures.push(found.tone(good_from(totals.found, 95.0)));
        let wrong = KeyFigure::new(totals.wrong.to_string(), "", "wrong detections");
        figures.push(wrong.tone(none(totals.wrong)));
        let clean = KeyFigure::new(totals.clean.count.to_string(), of(totals.clean), "pictures clean");
        figures.push(clean.tone(good_from(totals.clean, 95.0)));
    }
    if totals.false_alarms.of > 0 {
        let alarms = totals.false_alarms;
        let alarms = KeyFigure::new(alarms.count.to_string(), of(alarms), "pictures without the part: false alarms");
        figures.push(alarms.tone(none(totals.false_alarms.count)));
    }
    if let Some(errors) = totals.errors {
        let label = format!("median position error: {:.1} % of the diagonal", errors.median_percent);
        figures.push(KeyFigure::new(format!("{:.1}", errors.median_px), "px", label));
        figures.push(KeyFigure::new(format!("{:.1}", errors.median_deg), "°", "median angle error"));
    }
    figures
}

fn at_a_glance(totals: &Totals, offset: Option<&LabelOffset>) -> Section {
    let quiet = Share { count: totals.false_alarms.of - totals.false_alarms.count, of: totals.false_alarms.of };
    let rows = [("parts found", totals.found), ("pictures clean", totals.clean), ("quiet without the part", quiet)];
    let mut chart = ShareChart::new("Found, clean and quiet");
    for (label, share) in rows {
        if let Some(percent) = share.percent() {
            chart = chart.row(label, percent, wilson_interval(share).map(|bound| 100.0 * bound), None);
        }
    }
    let mut section = Section::new("At a glance")
        .lead(
            "A picture is clean if it has a correct detection and no wrong one; a picture with optional instances only \
             needs no detection.",
        )
        .shares(chart);
    if let Some(offset) = offset {
        let words = offset.in_words();
        section = section.notice(Tone::Warning, format!("T{}.", &words[1..]));
    }
    if totals.optional.of > 0 {
        section = section
            .paragraph(format!("Optional instances, which are neither missed nor wrong: {} found.", totals.optional));
    }
    if let Some(errors) = totals.errors {
        section = section.facts([
            (
                "position error, median",
                format!("{:.2} px, {:.2} % of the diagonal", errors.median_px, errors.median_percent),
            ),
            (
                "position error, 95 % within",
                format!("{:.2} px, {:.2} % of the diagonal", errors.p95_px, errors.p95_percent),
            ),
            ("angle error, median", format!("{:.2}°", errors.median_deg)),
            ("angle error, 95 % within", format!("{:.2}°", errors.p95_deg)),
        ]);
    }
    section
}

fn min_score_chart(evaluated: &Evaluated) -> Chart {
    let swept = sweep(&evaluated.tested.iter().collect::<Vec<_>>());
    let curve = |share: fn(&Totals) -> Share| -> Vec<(f64, f64)> {
        swept.iter().filter_map(|(min_score, totals)| Some((*min_score, share(totals).percent()?))).collect()
    };
    let mut chart =
        Chart::new("Found and false alarms", Axis::new("minimum score"), Axis::new("fraction").unit("%").from_zero())
            .moment(evaluated.min_score, "counted from here");
    for (name, points) in [
        ("parts found", curve(|totals| totals.found)),
        ("pictures with the part: clean", curve(|totals| totals.clean)),
        ("pictures without: false alarm", curve(|totals| totals.false_alarms)),
    ] {
        if !points.is_empty() {
            chart = chart.series(Series::new(name, points));
        }
    }
    chart.caption(
        "Towards the left, more parts are found and more detections are wrong. Scores are calibrated so that 0.5 \
         separates correct detections from wrong ones.",
    )
}

fn table(evaluated: &Evaluated, judged: &[Judged], order: &[usize]) -> Table {
    let mut table = Table::new(vec![
        Column::text("picture"),
        Column::text("outcome"),
        Column::number("parts"),
        Column::number("found"),
        Column::number("wrong"),
        Column::number("best score"),
        Column::number("position").unit("px").group("largest error"),
        Column::number("position").unit("%").group("largest error"),
        Column::number("angle").unit("°").group("largest error"),
        Column::number("time").unit("s"),
    ]);
    for &at in order {
        let (tested, judged) = (&evaluated.tested[at], &judged[at]);
        let parts = judged.parts();
        let count = |count: usize| Cell::number(count as f64, 0);
        let largest = |read: fn(&HitError) -> f64, decimals: usize| {
            let largest = judged.errors().map(read).fold(f64::NAN, f64::max);
            Cell::number(largest, decimals)
        };
        let best = tested.detections.first().map_or(f64::NAN, |best| best.score);
        table = table.row(vec![
            Cell::text(tested.picture.name()),
            outcome(judged),
            if judged.has_part() { count(parts.of) } else { Cell::missing() },
            if judged.has_part() { count(parts.count) } else { Cell::missing() },
            count(if judged.has_part() { judged.wrong() } else { judged.hits.len() }),
            Cell::number(best, 2),
            largest(|error| error.px, 1),
            largest(|error| error.percent, 1),
            largest(|error| error.deg, 1),
            Cell::number(tested.seconds, 2),
        ]);
    }
    table
}

fn outcome(judged: &Judged) -> Cell {
    let (tone, text) = match judged.outcome() {
        Outcome::Right => (Tone::Good, "right"),
        Outcome::Quiet => (Tone::Good, "quiet, no part"),
        Outcome::Missed => (Tone::Warning, "missed"),
        Outcome::Wrong => (Tone::Bad, "wrong"),
        Outcome::FalseAlarm => (Tone::Bad, "false alarm"),
    };
    Cell::Verdict { tone, text: text.to_owned(), note: None }
}

/// A picture with marks and detections, and its result in words.
fn figure(tested: &Tested, judged: &Judged) -> Result<Figure> {
    let mut image = sdg_inputs::read_image(&tested.picture.path)?;
    draw(&mut image, tested, judged);
    Ok(Figure::photo(image).caption(format!("{}: {}", tested.picture.name(), in_words(tested, judged))))
}

/// The result of a picture in words.
pub fn in_words(tested: &Tested, judged: &Judged) -> String {
    if !judged.has_part() {
        let best = tested.detections.first().map_or(0.0, |best| best.score);
        return match judged.hits.len() {
            0 => format!("no part, and none detected (best score {best:.2})"),
            several => format!("false alarm: no part, {several} detected (best score {best:.2})"),
        };
    }
    let parts = judged.parts();
    let mut words = if parts.of == 0 { "no part that must be found".to_owned() } else { format!("{parts} found") };
    let wrong = judged.wrong();
    if wrong > 0 {
        let scores = tested.detections.iter().zip(&judged.hits).filter(|(_, hit)| hit.is_none());
        let scores: Vec<String> = scores.map(|(detection, _)| format!("{:.2}", detection.score)).collect();
        words += &format!(", {wrong} wrong (score {})", scores.join(", "));
    }
    let optional = judged.optional();
    if optional.of > 0 {
        words += &format!(", {optional} optional ones found");
    }
    words
}

/// Draws the marks, and the detections on top.
fn draw(image: &mut RgbImage, tested: &Tested, judged: &Judged) {
    // Three pixels at a width of 640, so that marks are visible when a row of the page has two pictures.
    let width = (f64::from(image.width().max(image.height())) / 213.0).clamp(1.0, 8.0);
    for (instance_idx, instance) in tested.picture.instances.iter().enumerate() {
        let missed = !judged.is_found(instance_idx) && !instance.optional;
        let color = if missed { Color::REFUSED } else { Color::NEUTRAL };
        let pen = Pen::new(color).width(if missed { width } else { 0.5 * width });
        let dashed = Pen::new(color).width(pen.width).dashed(3.0 * width, 2.5 * width);
        draw_box(image, &instance.bbox, if missed || instance.optional { &dashed } else { &pen });
        if let Some(grasp) = instance.grasp {
            draw_line(image, grasp.start, grasp.end, &pen);
            draw_keypoints(image, &[Keypoint::visible(grasp.start)], &Pen::new(color).width(width));
        }
        if missed || instance.optional {
            let text = if missed { "missed" } else { "optional" };
            draw_label(image, Point2::new(instance.bbox.x1, instance.bbox.y1), text, color, TAG_WIDTHS * width);
        }
    }
    for (detection, hit) in tested.detections.iter().zip(&judged.hits).rev() {
        draw_found(image, detection, hit.is_some(), width);
    }
}

fn draw_found(image: &mut RgbImage, detection: &GraspDetection, is_hit: bool, width: f64) {
    let color = if is_hit { Color::VERIFIED } else { Color::REFUSED };
    let outline = detection.outline.clone().unwrap_or_else(|| Polygon::from_box(&detection.bbox));
    draw_polygon(image, &outline, &Pen::new(color).width(0.7 * width));
    draw_grasp_jaws(image, &detection.grasp, &Pen::new(Color::GRASP).width(0.8 * width));
    let text = format!("{:.2}{}", detection.score, if is_hit { "" } else { " wrong" });
    let bounds = outline.bounds();
    draw_label(image, Point2::new(bounds.x1, bounds.y2 + 2.0 * TAG_WIDTHS * width), &text, color, TAG_WIDTHS * width);
}

fn this_run(evaluated: &Evaluated, command: &str) -> Section {
    let model = evaluated.model;
    let mut facts = vec![
        ("object", model.object().to_owned()),
        ("grasp model", format!("{}, preset {}, seed {}", model.kind(), model.preset(), model.facts().seed)),
        ("machine", machine()),
        ("version", format!("sdg {}", env!("CARGO_PKG_VERSION"))),
    ];
    if evaluated.others > 0 {
        facts.push(("instances of other labels", evaluated.others.to_string()));
    }
    for left_out in &evaluated.left_out {
        facts.push(("left out", format!("{}: {}", left_out.file, left_out.why)));
    }
    if evaluated.tested.len() > MAX_DRAWN {
        facts.push(("drawn", format!("the worst {MAX_DRAWN} of {} pictures", evaluated.tested.len())));
    }
    Section::new("This run").lead("Settings for reproducing the numbers.").facts(facts).command(command)
}
