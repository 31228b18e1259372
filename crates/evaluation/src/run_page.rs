//! The page of a run: teaching, progress of training, detections and grasps.

use anyhow::Result;
use sdg_demonstration::Demonstration;
use sdg_geometry::median;
use sdg_grasp::{GraspModel, History};
use sdg_report::{
    Animation, AnimationOptions, AttemptSummary, Figure, GallerySize, KeyFigure, Report, Section, Tone, attempts_table,
    outcome_matrix,
};
use sdg_robot::{GraspStep, PlaceKind, PlacingConfig};
use sdg_simulation::RecordConfig;
use sdg_simulation::objects::ObjectSpec;

use crate::footer::FOOTER;
use crate::machine::machine;
use crate::rehearsal::Rehearsed;
use crate::teaching_page;
use crate::trial::{RIGHT_DEGREES, RIGHT_MM, Trial};

/// The inputs of every page.
pub struct RunPage<'a> {
    pub model: &'a GraspModel,
    pub object: &'a ObjectSpec,
    pub rehearsed: &'a Rehearsed,
    /// The command that repeats the run.
    pub command: &'a str,
}

/// Additional inputs for a run that also taught the model.
pub struct TaughtHere<'a> {
    /// The photo and its marks.
    pub demonstration: &'a Demonstration,
    /// Losses and validations of the detector; `None` for a model without a network.
    pub history: Option<&'a History>,
    /// Pictures with and without the part.
    pub trials: &'a [Trial],
    pub seed: u64,
}

/// Playback speed of the film relative to the robot.
const FILM_SPEED: f64 = 2.0;

/// The page of `sdg rehearse`.
pub fn rehearsal(page: &RunPage) -> Result<Report> {
    let action = if page.rehearsed.is_placing() { "grasp and place" } else { "grasp" };
    let title = format!("{}: {} {action} attempts", page.object.title, page.rehearsed.attempts.len());
    let report = Report::new(title).kicker("Rehearsal in simulation").lead(format!(
        "A grasp model taught from {} searched for the {} on the table, {}.",
        teaching_page::photos(page.model.demonstrations().len()),
        page.object.title.to_lowercase(),
        lifted(page)
    ));
    let report = with_film(with_key_figures(report, page), page)?;
    Ok(report
        .section(attempts(page.rehearsed))
        .section(last_looks(page.rehearsed))
        .section(this_run(page))
        .footer(FOOTER))
}

/// The page of `sdg demo`.
pub fn demo(page: &RunPage, taught: &TaughtHere) -> Result<Report> {
    let facts = page.model.facts();
    let report = Report::new(format!("{}, taught from one photo", page.object.title))
        .kicker("Demonstration to grasp, in simulation")
        .lead(format!(
            "One photo, one marked grasp, {:.0} seconds of teaching. The robot then searched for the part in unseen \
             poses, {}.",
            facts.seconds,
            lifted(page)
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
    let mut report = with_film(report, page)?.section(teaching_page::demonstration(
        page.model,
        std::slice::from_ref(taught.demonstration),
        taught.seed,
    )?);
    if let Some(history) = taught.history {
        report = report.section(teaching_page::teaching(history));
    }
    Ok(report
        .section(detections(&with_part, &without))
        .section(attempts(page.rehearsed))
        .section(this_run(page))
        .footer(FOOTER))
}

/// The results of the attempts, as the end of a sentence.
fn lifted(page: &RunPage) -> String {
    let did = if page.rehearsed.is_placing() { "put it down in its place" } else { "lifted it" };
    let end = page.rehearsed.interruption().map(|told| format!("; it was {told}")).unwrap_or_default();
    match (page.rehearsed.successes(), page.rehearsed.attempts.len()) {
        (0, of) => format!("and {did} in none of {of} attempts{end}"),
        (successes, of) => format!("and {did} in {successes} of {of} attempts{end}"),
    }
}

fn with_key_figures(report: Report, page: &RunPage) -> Report {
    let attempts = &page.rehearsed.attempts;
    let successes = page.rehearsed.successes();
    let tone = if successes * 10 >= attempts.len() * 9 { Tone::Good } else { Tone::Warning };
    let what = if page.rehearsed.is_placing() { "grasped and put down" } else { "grasped and held" };
    let report =
        report.key_figure(KeyFigure::new(successes.to_string(), format!("of {}", attempts.len()), what).tone(tone));
    match median_error_at_closing(attempts) {
        Some(mm) => report.key_figure(KeyFigure::new(format!("{mm:.1}"), "mm", "median error at closing")),
        None => report,
    }
}

/// The median position error of the attempts whose fingers closed, in millimetres.
fn median_error_at_closing(attempts: &[AttemptSummary]) -> Option<f64> {
    let has_closed = |attempt: &&AttemptSummary| attempt.step.is_some_and(|step| step >= GraspStep::Close as usize);
    median(attempts.iter().filter(has_closed).filter_map(|attempt| Some(attempt.detection_error?.distance_mm)))
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
    let caption = match (page.rehearsed.successes(), page.rehearsed.is_placing()) {
        (0, _) => "An attempt that failed, at twice its speed.",
        (_, false) => "One attempt, at twice its speed: look, hover, approach, close, lift, hold.",
        (_, true) => {
            "One attempt, at twice its speed: look, hover, approach, close, lift, hold, carry, put down, release."
        }
    };
    let film = Figure::animation(film).alt("The robot's attempt, seen from beside the table.").caption(caption);
    Ok(report.cover(film))
}

fn detections(with_part: &[&Trial], without: &[&Trial]) -> Section {
    let right = with_part.iter().filter(|trial| trial.is_right()).count();
    let figure = |trial: &&Trial| {
        let verdict = match (trial.present, trial.error) {
            (true, Some(e)) => format!("{:.1} mm and {:.1}° off", e.distance_mm, e.angle_deg),
            (true, None) => "the part is in the picture and was not found".to_owned(),
            (false, _) if trial.is_false_alarm() => "no part in the picture: a false alarm".to_owned(),
            (false, _) if trial.best_score > 0.0 => "no part in the picture: the network's proposal was \
                                                     refused"
                .to_owned(),
            (false, _) => "no part in the picture, nothing found".to_owned(),
        };
        Figure::photo(trial.drawn.clone()).caption(format!("{verdict}; score {:.2}", trial.best_score))
    };
    let shown = with_part.iter().take(6).chain(without.iter().take(3));
    Section::new("Detections")
        .lead(format!(
            "On pictures of the simulator with other light, tables and objects. Correct, which means within \
             {RIGHT_MM:.0} mm and {RIGHT_DEGREES:.0}°: {right} of {}. False alarms without the part: {} of {}.",
            with_part.len(),
            without.iter().filter(|trial| trial.is_false_alarm()).count(),
            without.len()
        ))
        .gallery(GallerySize::Medium, shown.map(figure).collect())
}

fn attempts(rehearsed: &Rehearsed) -> Section {
    let attempts = &rehearsed.attempts;
    let steps: Vec<&str> = match rehearsed.is_placing() {
        true => GraspStep::WITH_PLACING.map(GraspStep::name).to_vec(),
        false => GraspStep::ALL.map(GraspStep::name).to_vec(),
    };
    let (done, varied) = match rehearsed.is_placing() {
        true => ("placed", "light and tables"),
        false => ("held", "light, tables and other objects"),
    };
    let meaning = match rehearsed.place {
        None => "at least 10 cm above the table between both fingers, one second after lifting".to_owned(),
        Some(PlaceKind::Bin { .. }) => {
            "inside the bin, by its true pose and, if the last picture shows it, by this picture".to_owned()
        }
        Some(PlaceKind::Pose | PlaceKind::Tray { .. }) => {
            let PlacingConfig { tolerance_m, tolerance_rad, .. } = PlacingConfig::default();
            let (max_mm, max_deg) = (tolerance_m * 1e3, tolerance_rad.to_degrees());
            format!("within {max_mm:.0} mm and {max_deg:.0}° of its place, by the last picture and by its true pose")
        }
    };
    Section::new("Attempts")
        .lead(format!("Random poses of the part, robot starts, {varied}. A part is {done} if it is {meaning}."))
        .matrix(outcome_matrix(&steps, done, attempts, RIGHT_MM, RIGHT_DEGREES))
        .table(attempts_table(&steps, done, attempts).caption(
            "The part's position is in the robot's base frame. Errors are those of the last detection before the hand \
             went down, mostly from above the part.",
        ))
}

fn last_looks(rehearsed: &Rehearsed) -> Section {
    let figures = rehearsed.views.iter().zip(&rehearsed.attempts).filter_map(|(view, attempt)| {
        Some(Figure::photo(view.clone()?).caption(format!("Attempt {}", attempt.number)))
    });
    Section::new("Last looks")
        .lead("The wrist camera's pictures before the hand went down.")
        .gallery(GallerySize::Medium, figures.take(12).collect())
}

fn this_run(page: &RunPage) -> Section {
    let facts = page.model.facts();
    Section::new("This run")
        .lead("Settings for reproducing the numbers.")
        .facts([
            ("object", page.object.name.clone()),
            ("part", page.object.description.clone()),
            ("grasp model", format!("{}, preset {}", page.model.kind(), page.model.preset())),
            ("taught with", format!("seed {}, {} samples, {} steps", facts.seed, facts.samples, facts.steps)),
            (
                "held-out samples",
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

#[cfg(test)]
mod tests {
    use image::RgbImage;
    use sdg_report::DetectionError;

    use super::*;

    fn attempt(number: usize) -> AttemptSummary {
        AttemptSummary {
            number,
            object_mm: [0.0; 2],
            object_angle_deg: 0.0,
            detection_error: None,
            step: Some(0),
            not_found: false,
            success: false,
            why: String::new(),
            duration_secs: 0.0,
        }
    }

    #[test]
    fn only_attempts_that_closed_have_an_error_at_closing() {
        let with_error = |step: GraspStep, distance_mm: f64| AttemptSummary {
            detection_error: Some(DetectionError { distance_mm, angle_deg: 0.0 }),
            step: Some(step as usize),
            ..attempt(1)
        };
        let attempts = [(GraspStep::Hover, 90.0), (GraspStep::Close, 2.0), (GraspStep::Hold, 4.0)];
        assert_eq!(median_error_at_closing(&attempts.map(|(step, mm)| with_error(step, mm))), Some(3.0));
        assert_eq!(median_error_at_closing(&[with_error(GraspStep::Approach, 1.0), attempt(2)]), None);
    }

    #[test]
    fn a_picture_has_the_number_of_its_attempt() {
        let mut rehearsed = Rehearsed {
            planned: 5,
            attempts: vec![attempt(1), attempt(2)],
            film: Vec::new(),
            views: vec![None, Some(RgbImage::new(8, 8))],
            place: None,
        };
        let page = Report::new("rehearsal").section(last_looks(&rehearsed)).to_html().unwrap();
        assert!(page.contains("Attempt 2") && !page.contains("Attempt 1"), "{page}");
        assert_eq!(rehearsed.interruption().unwrap(), "interrupted after 2 of 5 attempts");
        rehearsed.planned = 2;
        assert_eq!(rehearsed.interruption(), None);

        let mut told = |place| {
            rehearsed.place = place;
            Report::new("rehearsal").section(attempts(&rehearsed)).to_html().unwrap()
        };
        assert!(told(None).contains("light, tables and other objects. A part is held"));
        let pose = told(Some(PlaceKind::Pose));
        assert!(pose.contains("light and tables. A part is placed if it is within 3 mm and 3° of its place"), "{pose}");
        assert!(told(Some(PlaceKind::Bin { size_m: [0.1; 2] })).contains("if it is inside the bin"));
    }
}
