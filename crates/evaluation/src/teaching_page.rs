//! The page of a teaching run: demonstrations, samples, losses and validation.

use anyhow::Result;
use image::RgbImage;
use sdg_cell::drawing;
use sdg_demonstration::{AugmentationConfig, Augmenter, Demonstration};
use sdg_geometry::PlanarGrasp;
use sdg_grasp::{
    GraspModel, HIT_DEGREES, HIT_PX, History, LossValues, Taught, TaughtDemonstration, ValidationRecord,
    without_unmarked_parts,
};
use sdg_report::{
    Axis, Chart, Color, Figure, GallerySize, KeyFigure, Pen, Report, Section, Series, Tone, draw_box,
    draw_demonstration, draw_line,
};

use crate::footer::FOOTER;
use crate::held_back::{HeldBackFigures, HeldBackSamples};
use crate::machine::machine;

/// Number of augmented samples on the page.
const SHEET: u64 = 24;
/// Number of samples in which the detections of the finished model are shown.
const TRIED: u64 = 6;

/// The page of `sdg teach`.
pub struct TeachingPage<'a> {
    /// The model and the history of its training.
    pub taught: &'a Taught,
    /// Results of the finished model on held-out samples.
    pub figures: &'a HeldBackFigures,
    /// The photos and their marks.
    pub demonstrations: &'a [Demonstration],
    pub seed: u64,
    /// The user's waiting time, in seconds: from the start of the program to the tested model.
    pub seconds: f64,
    /// The command that makes the same model again.
    pub command: &'a str,
}

/// A number of photos in words.
pub(crate) fn photos(count: usize) -> String {
    match count {
        1 => "one photo".to_owned(),
        several => format!("{several} photos"),
    }
}

impl TeachingPage<'_> {
    /// The page: photos and marks, samples, curves, and detections in held-out samples.
    ///
    /// # Errors
    /// Samples cannot be made, or detection fails.
    pub fn report(&self) -> Result<Report> {
        let model = &self.taught.model;
        let name = model.object().replace('_', " ");
        let photos = photos(self.demonstrations.len());
        let mut report = Report::new(format!("{name}, taught from {photos}"))
            .kicker("Teaching")
            .lead(format!(
                "Model {} was taught from {photos} with marked grasps. The page shows the training data, and the \
                 model's results on unseen samples.",
                model.kind()
            ))
            .key_figure(KeyFigure::new(
                format!("{:.1}", self.seconds),
                "s",
                format!("to teach from {photos} and to test the model"),
            ));
        let (found, false_alarms) = (self.figures.found(), self.figures.false_alarms());
        let tone = match found.percent() {
            Some(percent) if percent >= 80.0 => Tone::Good,
            Some(percent) if percent < 50.0 => Tone::Bad,
            _ => Tone::Warning,
        };
        let bad_if = |is_bad: bool| if is_bad { Tone::Bad } else { Tone::Good };
        report = report
            .key_figure(
                KeyFigure::new(found.count.to_string(), format!("of {}", found.of), "held-out parts found").tone(tone),
            )
            .key_figure(
                KeyFigure::new(self.figures.wrong().to_string(), "", "wrong detections")
                    .tone(bad_if(self.figures.wrong() > 0)),
            )
            .key_figure(
                KeyFigure::new(
                    false_alarms.count.to_string(),
                    format!("of {}", false_alarms.of),
                    "false alarms without the part",
                )
                .tone(bad_if(false_alarms.count > 0)),
            );
        if let Some(((off, unit), [_, deg])) = self.figures.median_distance().zip(self.figures.median_errors()) {
            report = report
                .key_figure(KeyFigure::new(format!("{off:.1}"), unit, "median position error"))
                .key_figure(KeyFigure::new(format!("{deg:.1}"), "°", "median angle error"));
        }
        let mut report = report.section(demonstration(model, self.demonstrations, self.seed)?);
        if let Some(history) = &self.taught.history {
            report = report.section(teaching(history));
        }
        Ok(report.section(self.tried()?).section(self.this_run()).footer(FOOTER))
    }

    fn tried(&self) -> Result<Section> {
        // The part may be anywhere in a sample.
        let model = self.taught.model.clone().with_region(None)?;
        // Samples of the test, in which the part's size is in the searched range.
        let (alone, _) = without_unmarked_parts(&model, self.demonstrations)?;
        let samples = HeldBackSamples::new(&alone, &model.held_out_sizes(), self.seed)?;
        let mut figures = Vec::new();
        for number in 0..TRIED {
            let sample = samples.sample(number);
            let detections = samples.detect(&model, &sample)?;
            let best = detections.iter().map(|detection| detection.score).fold(0.0, f64::max);
            let there = if sample.objects.is_empty() { "without the part" } else { "with the part" };
            let figure = Figure::photo(drawing::with_detections(&sample.image, &detections));
            figures.push(figure.caption(format!("{there}; score {best:.2}")));
        }
        Ok(Section::new("Tried")
            .lead(
                "Samples that the model was not taught from, with its scores; detections with at least 0.5 are \
                   accepted.",
            )
            .gallery(GallerySize::Medium, figures))
    }

    fn this_run(&self) -> Section {
        let model = &self.taught.model;
        let facts = model.facts();
        Section::new("This run")
            .lead("Settings for making the same model again.")
            .facts([
                ("object", model.object().to_owned()),
                ("grasp model", format!("{}, preset {}", model.kind(), model.preset())),
                ("taught with", format!("seed {}, {} samples, {} steps", facts.seed, facts.samples, facts.steps)),
                ("base weights", facts.base_weights_sha256.clone().unwrap_or_else(|| "none".to_owned())),
                ("machine", machine()),
                ("version", format!("sdg {}", env!("CARGO_PKG_VERSION"))),
            ])
            .command(self.command)
    }
}

/// The photos, the marked photos, and samples made from them.
pub fn demonstration(model: &GraspModel, demonstrations: &[Demonstration], seed: u64) -> Result<Section> {
    let as_seen = match &model.facts().lengths {
        None => "As taken by the camera.",
        Some(_) => "The picture in the plan view: x of the camera's frame points to the right.",
    };
    let mut pictures = Vec::new();
    for (at, Demonstration { image, annotation }) in demonstrations.iter().enumerate() {
        let mut marked = image.clone();
        let grasp = annotation.grasp.map(|line| PlanarGrasp::from_line(&line, jaw_width_px(model, at)));
        draw_demonstration(
            &mut marked,
            &annotation.bbox,
            annotation.outline.as_ref(),
            annotation.grasp.as_ref(),
            grasp.as_ref(),
        );
        pictures.push(Figure::photo(image.clone()).caption(as_seen));
        pictures.push(Figure::photo(marked).caption(
            "As marked: box (blue), outline (yellow), grasp line (dashed), and the jaws computed from them (orange).",
        ));
    }
    Ok(Section::new("Demonstration")
        .lead("The complete human input: a photo, a box, an outline, and a line along which to grasp.")
        .gallery(GallerySize::Large, pictures)
        .captioned_gallery(
            GallerySize::Small,
            sheet(demonstrations, seed)?.into_iter().map(Figure::photo).collect(),
            if model.kind().has_network() {
                "Samples from which the network was trained, all made from that photo: other backgrounds, light, \
                 blur, noise, objects in front. Scenes without a box lack the part, so that the model learns to reject."
            } else {
                "Samples from which a network would be trained, all made from that photo: other backgrounds, light, \
                 blur, noise, objects in front. Model S has no network; it searches directly for the part in the photo."
            },
        ))
}

fn jaw_width_px(model: &GraspModel, at: usize) -> f64 {
    model.demonstrations().get(at).map_or(0.0, |TaughtDemonstration { marks, .. }| marks.width_px)
}

/// Small augmented samples and their marks.
fn sheet(demonstrations: &[Demonstration], seed: u64) -> Result<Vec<RgbImage>> {
    let config = AugmentationConfig::default().with_output_size(320, 240);
    let augmenter = Augmenter::new(demonstrations, config, seed)?;
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

/// The losses and the validation by step.
pub fn teaching(history: &History) -> Section {
    let parts = |l: &LossValues| [l.keypoint, l.mask, l.cls + l.box_reg, l.rpn_cls + l.rpn_loc];
    let mut losses = Chart::new("Training loss", Axis::new("step"), Axis::new("loss").logarithmic())
        .caption("Each step, and its running mean.");
    for (idx, name) in ["keypoints", "masks", "class and box", "proposals"].into_iter().enumerate() {
        let points: Vec<(f64, f64)> =
            history.steps.iter().map(|record| (record.step as f64, parts(&record.losses)[idx])).collect();
        // The loss of a head that the detector lacks is zero, which a logarithmic axis cannot show.
        if points.iter().any(|(_, loss)| *loss > 0.0) {
            losses = losses.series(Series::new(name, points).noisy());
        }
    }
    let curve = |pick: fn(&ValidationRecord) -> f64| -> Vec<(f64, f64)> {
        history.validations.iter().map(|record| (record.steps_done as f64, pick(record))).collect()
    };
    let kept = history.best.steps_done as f64;
    let place = Chart::new("Held-out samples: position", Axis::new("step"), Axis::new("error").unit("px").from_zero())
        .series(Series::new("median", curve(|r| r.validation.median_error_px)).with_markers())
        .moment(kept, "kept")
        .caption("The network alone, in pixels of the photo; before the check against the demonstration.");
    let angle = Chart::new("Held-out samples: angle", Axis::new("step"), Axis::new("error").unit("°").from_zero())
        .series(Series::new("median", curve(|r| r.validation.median_error_degrees)).with_markers())
        .moment(kept, "kept");
    let found = Chart::new("Held-out samples: found", Axis::new("step"), Axis::new("fraction").unit("%").from_zero())
        .series(
            Series::new(format!("within {HIT_PX} px and {HIT_DEGREES}°"), curve(|r| 100.0 * r.validation.hit_rate()))
                .with_markers(),
        )
        .series(
            Series::new(
                "false alarms",
                curve(|r| 100.0 * r.validation.false_alarms as f64 / r.validation.negatives.max(1) as f64),
            )
            .with_markers(),
        )
        .caption("The network alone; the check against the demonstration refuses its remaining false alarms.");
    Section::new("Teaching")
        .lead(format!(
            "{} steps in {:.0} s; the network with the best validation was kept.",
            history.steps.len(),
            history.elapsed_secs
        ))
        .charts(vec![losses, place, angle, found])
}

#[cfg(test)]
mod tests {
    use sdg_grasp::{Ending, StepRecord, Validation};

    use super::*;

    #[test]
    fn the_chart_has_the_losses_of_the_heads_that_were_taught() {
        let validation = Validation {
            positives: 3,
            hits: 3,
            median_error_px: 1.0,
            median_error_degrees: 1.0,
            negatives: 1,
            false_alarms: 0,
        };
        let best = ValidationRecord { steps_done: 1, elapsed_secs: 1.0, validation };
        let names = |keypoint: f64, mask: f64| {
            let losses = LossValues { rpn_cls: 0.3, rpn_loc: 0.2, cls: 0.4, box_reg: 0.1, keypoint, mask };
            let step = StepRecord { step: 0, samples: 4, learning_rate: 1e-3, losses };
            let ending = Ending::Completed;
            let history = History { steps: vec![step], validations: vec![best], best, ending, elapsed_secs: 1.0 };
            let page = format!("{:?}", teaching(&history));
            ["keypoints", "masks", "class and box", "proposals"].map(|name| page.contains(&format!("name: \"{name}\"")))
        };
        assert_eq!(names(0.0, 0.5), [false, true, true, true]);
        assert_eq!(names(2.0, 0.0), [true, false, true, true]);
        assert_eq!(names(2.0, 0.5), [true; 4]);
    }
}
