//! The page of a run: what was taught, how it went, what was found, what was grasped.

use anyhow::Result;
use image::RgbImage;
use sdg_demonstration::{AugmentationConfig, Augmenter, Demonstration};
use sdg_geometry::PlanarGrasp;
use sdg_grasp::{GraspModel, History, TaughtDemonstration, ValidationRecord};
use sdg_report::{
    Animation, AnimationOptions, Axis, Chart, Color, Figure, GallerySize, KeyFigure, Pen, Report, Section, Series,
    Tone, attempts_table, draw_box, draw_demonstration, draw_line, median,
};
use sdg_simulation::RecordConfig;
use sdg_simulation::objects::ObjectSpec;

use crate::machine::machine;
use crate::rehearsal::Rehearsed;
use crate::trial::{RIGHT_DEGREES, RIGHT_MM, Trial};

/// What every page is made from.
pub struct RunPage<'a> {
    /// The model.
    pub model: &'a GraspModel,
    /// The part.
    pub object: &'a ObjectSpec,
    /// The attempts.
    pub rehearsed: &'a Rehearsed,
    /// The command that makes the same run again.
    pub command: &'a str,
}

/// What a run that also taught has beside it.
pub struct TaughtHere<'a> {
    /// The photo and its marks.
    pub demonstration: &'a Demonstration,
    /// Losses and validations of the detector; `None` for a model without.
    pub history: Option<&'a History>,
    /// Pictures with and without the part.
    pub trials: &'a [Trial],
    /// Decides the augmentation.
    pub seed: u64,
}

/// The film runs at twice the robot's speed.
const FILM_SPEED: f64 = 2.0;
/// Augmented samples shown.
const SHEET: u64 = 24;

/// The page of `sdg rehearse`.
pub fn rehearsal(page: &RunPage) -> Result<Report> {
    let title = format!("{}: {} grasp attempts", page.object.title, page.rehearsed.attempts.len());
    let report = Report::new(title).kicker("Rehearsal in simulation").lead(format!(
        "A grasp model taught from one photo looks for the {} on the table, goes to it and lifts it.",
        page.object.title.to_lowercase()
    ));
    let report = with_film(with_key_figures(report, page), page)?;
    Ok(report.section(attempts(page)).section(last_looks(page)).section(this_run(page)).footer(FOOTER))
}

/// The page of `sdg demo`.
pub fn demo(page: &RunPage, taught: &TaughtHere) -> Result<Report> {
    let facts = page.model.facts();
    let report = Report::new(format!("{}, taught from one photo", page.object.title))
        .kicker("Demonstration to grasp, in simulation")
        .lead(format!(
            "One photo, one marked grasp, {:.0} seconds of teaching. The robot then looked for the part, went to it \
             and lifted it, {} times, from poses it had not seen.",
            facts.seconds,
            page.rehearsed.attempts.len()
        ))
        .key_figure(KeyFigure::new(format!("{:.0}", facts.seconds), "s", "to teach, from one photo"));
    let mut report = with_key_figures(report, page);
    let (with_part, without): (Vec<&Trial>, Vec<&Trial>) = taught.trials.iter().partition(|trial| trial.present);
    if !without.is_empty() {
        let false_alarms = without.iter().filter(|trial| trial.is_false_alarm()).count();
        let tone = if false_alarms == 0 { Tone::Good } else { Tone::Bad };
        report = report.key_figure(
            KeyFigure::new(false_alarms.to_string(), format!("of {}", without.len()), "false alarms without the part")
                .tone(tone),
        );
    }
    let mut report = with_film(report, page)?.section(demonstration(page, taught)?);
    if let Some(history) = taught.history {
        report = report.section(teaching(history));
    }
    Ok(report.section(detections(&with_part, &without)).section(attempts(page)).section(this_run(page)).footer(FOOTER))
}

const FOOTER: &str = "Made by sdg. This page is one file: it fetches nothing and runs no script.";

fn with_key_figures(report: Report, page: &RunPage) -> Report {
    let attempts = &page.rehearsed.attempts;
    let successes = page.rehearsed.successes();
    let tone = if successes * 10 >= attempts.len() * 9 { Tone::Good } else { Tone::Warning };
    let report = report.key_figure(
        KeyFigure::new(successes.to_string(), format!("of {}", attempts.len()), "grasped and held").tone(tone),
    );
    match median(attempts.iter().filter_map(|a| a.detection_error.map(|e| e.distance_mm))) {
        Some(mm) => report.key_figure(KeyFigure::new(format!("{mm:.1}"), "mm", "median error where it closed")),
        None => report,
    }
}

fn with_film(report: Report, page: &RunPage) -> Result<Report> {
    if page.rehearsed.film.is_empty() {
        return Ok(report);
    }
    let options = AnimationOptions {
        source_fps: 1.0 / RecordConfig::default().period_secs,
        speed: FILM_SPEED,
        ..AnimationOptions::default()
    };
    let film = Animation::encode(&page.rehearsed.film, &options)?;
    Ok(report.cover(
        Figure::animation(film)
            .alt("The robot looks, moves over the part, comes down, closes its jaws and lifts the part.")
            .caption("One attempt, at twice its speed: look, hover, approach, close, lift, hold."),
    ))
}

fn demonstration(page: &RunPage, taught: &TaughtHere) -> Result<Section> {
    let annotation = &taught.demonstration.annotation;
    let mut marked = taught.demonstration.image.clone();
    let grasp = annotation.grasp.map(|line| PlanarGrasp::from_line(&line, jaw_width_px(page.model)));
    draw_demonstration(
        &mut marked,
        &annotation.bbox,
        annotation.outline.as_ref(),
        annotation.grasp.as_ref(),
        grasp.as_ref(),
    );
    Ok(Section::new("Demonstration")
        .lead("All that a person gave: a photo, a box, an outline, and a line along which to grasp.")
        .gallery(
            GallerySize::Large,
            vec![
                Figure::photo(taught.demonstration.image.clone()).caption("As the wrist camera saw it."),
                Figure::photo(marked).caption(
                    "As marked: box (blue), outline (yellow), grasp line (dashed), and the jaws that follow (orange).",
                ),
            ],
        )
        .captioned_gallery(
            GallerySize::Small,
            sheet(taught.demonstration, taught.seed)?.into_iter().map(Figure::photo).collect(),
            "Samples that the network learnt from, all made from that photo: other backgrounds, light, blur, noise, \
             things in the way. Scenes without a box lack the part, so that the model learns to say no.",
        ))
}

fn jaw_width_px(model: &GraspModel) -> f64 {
    model.demonstrations().first().map_or(0.0, |TaughtDemonstration { marks, .. }| marks.width_px)
}

/// The first training samples with their marks.
fn sheet(demonstration: &Demonstration, seed: u64) -> Result<Vec<RgbImage>> {
    let config = AugmentationConfig::default().with_output_size(320, 240);
    let augmenter = Augmenter::new(std::slice::from_ref(demonstration), config, seed)?;
    Ok((0..SHEET)
        .map(|i| {
            let sample = augmenter.sample(i);
            let mut drawn = sample.image;
            for object in &sample.objects {
                draw_box(&mut drawn, &object.bbox, &Pen::new(Color::BOX));
                if let (Some(start), Some(end)) = (object.keypoints.first(), object.keypoints.last()) {
                    draw_line(&mut drawn, start.point(), end.point(), &Pen::new(Color::GRASP).width(3.0));
                }
            }
            drawn
        })
        .collect())
}

fn teaching(history: &History) -> Section {
    let loss = |pick: fn(&sdg_grasp::LossValues) -> f64| -> Vec<(f64, f64)> {
        history.steps.iter().map(|record| (record.step as f64, pick(&record.losses))).collect()
    };
    let losses = Chart::new("Training loss", Axis::new("step"), Axis::new("loss").logarithmic())
        .series(Series::new("keypoints", loss(|l| l.keypoint)).noisy())
        .series(Series::new("class and box", loss(|l| l.cls + l.box_reg)).noisy())
        .series(Series::new("proposals", loss(|l| l.rpn_cls + l.rpn_loc)).noisy())
        .caption("Each step, and its running mean.");
    let curve = |pick: fn(&ValidationRecord) -> f64| -> Vec<(f64, f64)> {
        history.validations.iter().map(|record| (record.steps_done as f64, pick(record))).collect()
    };
    let kept = history.best.steps_done as f64;
    let place = Chart::new("Held-back samples: place", Axis::new("step"), Axis::new("error").unit("px").from_zero())
        .series(Series::new("median", curve(|r| r.validation.median_error_px)).with_markers())
        .moment(kept, "kept")
        .caption("The network alone, in pixels of the photo; before the demonstration is laid over.");
    let angle = Chart::new("Held-back samples: angle", Axis::new("step"), Axis::new("error").unit("°").from_zero())
        .series(Series::new("median", curve(|r| r.validation.median_error_degrees)).with_markers())
        .moment(kept, "kept");
    let found = Chart::new("Held-back samples: found", Axis::new("step"), Axis::new("share").unit("%").from_zero())
        .series(Series::new("within 10 mm and 10°", curve(|r| 100.0 * r.validation.hit_rate())).with_markers())
        .series(
            Series::new(
                "false alarms",
                curve(|r| 100.0 * r.validation.false_alarms as f64 / r.validation.negatives.max(1) as f64),
            )
            .with_markers(),
        )
        .caption("The network alone: what is left of its false alarms, the demonstration refuses.");
    Section::new("Teaching")
        .lead(format!(
            "{} steps in {:.0} s; the network with the best validation was kept.",
            history.steps.len(),
            history.elapsed_secs
        ))
        .charts(vec![losses, place, angle, found])
}

fn detections(with_part: &[&Trial], without: &[&Trial]) -> Section {
    let right = with_part.iter().filter(|trial| trial.is_right()).count();
    let figure = |trial: &&Trial| {
        let said = match (trial.present, trial.error) {
            (true, Some(e)) => format!("{:.1} mm and {:.1}° off", e.distance_mm, e.angle_deg),
            (true, None) => "the part is here and was not found".to_owned(),
            (false, _) if trial.is_false_alarm() => "no part here: a false alarm".to_owned(),
            (false, _) if trial.best_score > 0.0 => "no part here: the network's proposal was refused".to_owned(),
            (false, _) => "no part here, nothing found".to_owned(),
        };
        Figure::photo(trial.drawn.clone()).caption(format!("{said}; score {:.2}", trial.best_score))
    };
    let shown = with_part.iter().take(6).chain(without.iter().take(3));
    Section::new("Detections")
        .lead(format!(
            "On pictures of the simulator with other light, tables and things lying about. Right, that is within \
             {RIGHT_MM:.0} mm and {RIGHT_DEGREES:.0}°: {right} of {}. False alarms without the part: {} of {}.",
            with_part.len(),
            without.iter().filter(|trial| trial.is_false_alarm()).count(),
            without.len()
        ))
        .gallery(GallerySize::Medium, shown.map(figure).collect())
}

fn attempts(page: &RunPage) -> Section {
    Section::new("Attempts")
        .lead(
            "Random poses of the part, of the robot at the start, of light, table and things lying about. Held means: \
             at least 10 cm above the table between both fingers, one second after lifting.",
        )
        .table(attempts_table(&page.rehearsed.attempts).caption(
            "Where the part lay is in the robot's base frame. Errors are those of the second look, from above the part.",
        ))
}

fn last_looks(page: &RunPage) -> Section {
    let figures = page
        .rehearsed
        .views
        .iter()
        .zip(&page.rehearsed.attempts)
        .take(12)
        .map(|(view, attempt)| Figure::photo(view.clone()).caption(format!("Attempt {}", attempt.number)));
    Section::new("Last looks")
        .lead("What the wrist camera saw before the hand went down.")
        .gallery(GallerySize::Medium, figures.collect())
}

fn this_run(page: &RunPage) -> Section {
    let facts = page.model.facts();
    Section::new("This run")
        .lead("Everything needed to see the same numbers again.")
        .facts([
            ("object", page.object.name.clone()),
            ("grasp model", format!("{}, preset {}", page.model.kind(), page.model.preset())),
            ("taught with", format!("seed {}, {} samples, {} steps", facts.seed, facts.samples, facts.steps)),
            (
                "held-back samples",
                facts.validation.map_or("none".to_owned(), |held_back| {
                    format!(
                        "median {:.1} px and {:.1}° after verification",
                        held_back.error_px, held_back.error_degrees
                    )
                }),
            ),
            ("machine", machine()),
            ("version", format!("sdg {}", env!("CARGO_PKG_VERSION"))),
        ])
        .command(page.command)
}
