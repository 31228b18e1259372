//! Measures how much base weights help: model C is taught from them for a few steps on parts unseen in pretraining,
//! without verification.
//!
//! Each part is taught from its photo. The model then gets pictures with the part, pictures with other parts only, and
//! pictures with the part's mirror image or with a copy in which one feature is moved. Only the network decides.

use std::fs::OpenOptions;
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use image::RgbImage;
use sdg_demonstration::Demonstration;
use sdg_geometry::{Angle, PlanarGrasp, PlanarSimilarity};
use sdg_grasp::{BaseWeights, FineTuning, GraspError, GraspModel, ModelKind, Start, TeachOptions, Verification, teach};
use sdg_part_generator::{LookAlike, OtherKind, Part, PhotoConfig, Sample, SceneConfig, Scenes};

use crate::outcome::{Outcome, outcomes};
use crate::pictures::FIRST_PART_SEED;

/// Maximum error of a correct detection. It corresponds to 10 mm at the camera of the paper SingleDemoGrasp, which has
/// 0.92 px per millimetre at a width of 640 px; the pictures of this comparison are 320 px wide.
const MAX_ERROR_PX: f64 = 4.6;
/// Maximum angle error of a correct detection.
const MAX_ERROR_DEGREES: f64 = 10.0;

/// Number of pictures per part: with the part, without it, with look-alikes.
const PICTURES: [usize; 3] = [10, 10, 5];

/// A part to measure on: its photo and its pictures.
pub struct Trial {
    part: Part,
    demonstration: Demonstration,
    with: Vec<Sample>,
    without: Vec<Sample>,
    look_alikes: Vec<Sample>,
}

/// Pictures as the wrist camera takes them: from about the height of the photo, with small variations.
fn scene_config() -> SceneConfig {
    SceneConfig {
        photo: PhotoConfig { fill: [0.14, 0.42], ..PhotoConfig::default() },
        instances: [1, 1],
        others: [0, 3],
        distance: [0.92, 1.08],
        tilt_rad: [0.0, 0.12],
        cover_probability: 0.0,
        dark_probability: 0.03,
        blur_probability: 0.05,
        motion_probability: 0.05,
        look_alike_share: 0.0,
        min_inside_share: 0.95,
        ..SceneConfig::default()
    }
}

/// The detection with the highest score in a picture, and its error in pixels of the photo if it is correct.
struct Best {
    is_accepted: bool,
    score: f64,
    error: Option<f64>,
}

impl Trial {
    /// Generates the part with seed `part_seed` modulo [`FIRST_PART_SEED`], and its pictures.
    ///
    /// # Errors
    /// A scene configuration that the generator rejects.
    pub fn new(part_seed: u64) -> Result<Self> {
        let seed = part_seed % FIRST_PART_SEED;
        let part = Part::generate(seed);
        let scenes =
            |config: SceneConfig, purpose: u64| Scenes::new(std::slice::from_ref(&part), config, seed * 10 + purpose);
        let with = scenes(SceneConfig { absent_share: 0.0, ..scene_config() }, 1)?;
        let absent = SceneConfig { absent_share: 1.0, others: [1, 5], ..scene_config() };
        let without = scenes(absent.clone(), 2)?;
        let look_alikes = scenes(SceneConfig { look_alike_share: 1.0, others: [1, 2], ..absent }, 3)?;
        let draw = |scenes: &Scenes, count| (0..count as u64).map(|i| scenes.sample(i)).collect();
        // A copy of the part in another size looks like the part at another distance from the camera, so it is left
        // out.
        let is_another = |sample: &Sample| {
            let other =
                |kind: &OtherKind| matches!(kind, OtherKind::LookAlike(LookAlike::Mirrored | LookAlike::FeatureMoved));
            !sample.others.is_empty() && sample.others.iter().all(|object| other(&object.kind))
        };
        let alike = (0..20 * PICTURES[2] as u64).map(|i| look_alikes.sample(i)).filter(is_another).take(PICTURES[2]);
        Ok(Self {
            demonstration: with.photo(0).demonstration.clone(),
            with: draw(&with, PICTURES[0]),
            without: draw(&without, PICTURES[1]),
            look_alikes: alike.collect(),
            part,
        })
    }

    /// The photo and the pictures, each with a name, for inspection.
    pub fn pictures(&self) -> Vec<(String, &RgbImage)> {
        let kinds = [("with", &self.with), ("without", &self.without), ("look-alikes", &self.look_alikes)];
        let of_kind = kinds.into_iter().flat_map(|(kind, samples)| {
            samples.iter().enumerate().map(move |(i, sample)| (format!("{kind}-{i}"), &sample.image))
        });
        std::iter::once(("photo".to_owned(), &self.demonstration.image)).chain(of_kind).collect()
    }

    /// Teaches the part and runs the model on its pictures.
    ///
    /// # Errors
    /// All errors of teaching except [`GraspError::NotLearnt`], which becomes an outcome.
    pub fn run(&self, weights: &str, part_seed: u64, options: &TeachOptions) -> Result<Outcome> {
        let (wall, cpu) = (Instant::now(), cpu_seconds());
        let taught = teach(std::slice::from_ref(&self.demonstration), options, &mut |_| ControlFlow::Continue(()));
        let cpu_secs = cpu_seconds().zip(cpu).map_or(wall.elapsed().as_secs_f64(), |(now, before)| now - before);
        let mut outcome = Outcome {
            weights: weights.to_owned(),
            part: part_seed,
            steps: options.steps.unwrap_or(0),
            seed: options.seed,
            with: self.with.len(),
            found: 0,
            wrong: 0,
            without: self.without.len(),
            alarms: 0,
            look_alikes: self.look_alikes.len(),
            look_alike_alarms: 0,
            placed: 0,
            separated: 0,
            error_px: None,
            cpu_secs: (cpu_secs * 10.0).round() / 10.0,
            steps_done: 0,
            failed: None,
        };
        let model = match taught {
            Ok(taught) => {
                outcome.steps_done = taught.history.map_or(0, |history| history.steps.len());
                taught.model
            }
            Err(error @ GraspError::NotLearnt { .. }) => {
                outcome.failed = Some(error.to_string());
                return Ok(outcome);
            }
            Err(error) => return Err(error.into()),
        };
        let best_of = |samples: &[Sample]| -> Result<Vec<Option<Best>>> {
            samples.iter().map(|sample| self.best(&model, sample)).collect()
        };
        let [with, without, look_alikes] = [best_of(&self.with)?, best_of(&self.without)?, best_of(&self.look_alikes)?];
        let accepted = |best: &[Option<Best>]| best.iter().flatten().filter(|best| best.is_accepted).count();
        (outcome.alarms, outcome.look_alike_alarms) = (accepted(&without), accepted(&look_alikes));
        let mut absent: Vec<f64> = without.iter().map(|best| best.as_ref().map_or(0.0, |best| best.score)).collect();
        absent.sort_by(|one, other| other.total_cmp(one));
        let all_but_one = absent.get(1).copied().unwrap_or(0.0);
        let mut errors = Vec::new();
        for best in with.into_iter().flatten() {
            match best.error {
                Some(error) => {
                    outcome.placed += 1;
                    outcome.separated += usize::from(best.score > all_but_one);
                    outcome.found += usize::from(best.is_accepted);
                    errors.extend(best.is_accepted.then_some(error));
                }
                None => outcome.wrong += usize::from(best.is_accepted),
            }
        }
        outcome.error_px = sdg_geometry::median(errors).map(|error| (error * 100.0).round() / 100.0);
        Ok(outcome)
    }

    /// The detection with the highest score.
    fn best(&self, model: &GraspModel, sample: &Sample) -> Result<Option<Best>> {
        let found = model.detect(&sample.image, Verification::Off)?;
        Ok(found.first().map(|best| Best {
            is_accepted: best.is_accepted(),
            score: best.network_score,
            error: sample.instances.first().and_then(|instance| {
                self.error(&best.grasp, &instance.grasp.start, &instance.grasp.end, &instance.image_from_demonstration)
            }),
        }))
    }

    /// The distance to the ground truth, in pixels of the photo; `None` if the distance or the angle is too large. A
    /// rotation by the part's symmetry counts as no error.
    fn error(
        &self,
        grasp: &PlanarGrasp,
        start: &nalgebra::Point2<f64>,
        end: &nalgebra::Point2<f64>,
        image_from_photo: &PlanarSimilarity,
    ) -> Option<f64> {
        let along = end - start;
        let center = start + along * 0.5;
        let turn = grasp.angle - Angle::from_radians(along.y.atan2(along.x));
        let hidden = turn - self.part.symmetry().visible(turn);
        let about = image_from_photo.apply(&self.demonstration.annotation.region().centroid());
        let moved = PlanarSimilarity::about(about, about, -hidden, 1.0).apply(&grasp.center());
        let error = (moved - center).norm() / image_from_photo.scale;
        let degrees = Angle::distance(turn, hidden).to_degrees();
        (error <= MAX_ERROR_PX && degrees <= MAX_ERROR_DEGREES).then_some(error)
    }
}

/// Processor time of this process so far, in seconds; `None` where the system does not report it.
fn cpu_seconds() -> Option<f64> {
    // The program's name may contain blanks. After it, fields 14 and 15 are user and system time in ticks of 10 ms.
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    let ticks = |idx: usize| fields.get(idx)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / 100.0)
}

/// The parts that are taught, how they are taught, and where the outcomes are written.
pub struct Trials<'a> {
    /// The name of the weights in the outcomes.
    pub name: &'a str,
    /// The weights; `None` to teach from random parameters.
    pub weights: Option<BaseWeights>,
    /// Seeds of the parts.
    pub parts: std::ops::Range<u64>,
    /// Numbers of teaching steps; one model is taught for each.
    pub steps: &'a [usize],
    /// Seed of teaching.
    pub seed: u64,
    /// Output file, as JSON lines; trials that it already contains are not measured again.
    pub out: &'a Path,
    /// How the weights are fine-tuned; `None` trains them like random parameters.
    pub fine_tuning: Option<FineTuning>,
}

impl Trials<'_> {
    /// The file's text; empty if the file does not exist yet.
    fn text(&self) -> Result<String> {
        if !self.out.exists() {
            return Ok(String::new());
        }
        std::fs::read_to_string(self.out).with_context(|| self.out.display().to_string())
    }

    /// Measures the trials that are not in the file yet.
    ///
    /// # Errors
    /// Files that cannot be read or written, and errors of teaching.
    pub fn run(&self, observe: &mut dyn FnMut(&Outcome)) -> Result<()> {
        let named = || self.out.display().to_string();
        let text = self.text()?;
        let done = outcomes(&text);
        let is_done = |part: u64, steps: usize| {
            let same =
                |o: &&Outcome| (o.weights.as_str(), o.part, o.steps, o.seed) == (self.name, part, steps, self.seed);
            done.iter().any(|outcome| same(&outcome))
        };
        let mut out = OpenOptions::new().create(true).append(true).open(self.out).with_context(named)?;
        if !text.is_empty() && !text.ends_with('\n') {
            writeln!(out).with_context(named)?;
        }
        for part in self.parts.clone() {
            let missing: Vec<usize> = self.steps.iter().copied().filter(|steps| !is_done(part, *steps)).collect();
            if missing.is_empty() {
                continue;
            }
            let trial = Trial::new(part)?;
            for steps in missing {
                let mut options = TeachOptions::new(self.seed);
                options.kind = ModelKind::C;
                options.symmetry = trial.part.symmetry();
                options.start = self.weights.clone().map_or(Start::Nothing, Start::Weights);
                options.steps = Some(steps);
                options.fine_tuning = self.fine_tuning.clone();
                let outcome = trial.run(self.name, part, &options)?;
                observe(&outcome);
                writeln!(out, "{}", serde_json::to_string(&outcome)?).with_context(named)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_geometry::RotationalSymmetry;

    #[test]
    fn the_truth_is_right_and_what_is_turned_or_moved_is_not() {
        let trial = Trial::new(9001).unwrap();
        assert_eq!(trial.part.symmetry(), RotationalSymmetry::None);
        assert_eq!([trial.with.len(), trial.without.len(), trial.look_alikes.len()], PICTURES);
        assert!(trial.without.iter().chain(&trial.look_alikes).all(|sample| sample.instances.is_empty()));
        for sample in &trial.with {
            let instance = &sample.instances[0];
            let (start, end, pose) = (instance.grasp.start, instance.grasp.end, instance.image_from_demonstration);
            let truth = PlanarGrasp::from_line(&instance.grasp, 10.0);
            let error = |grasp: &PlanarGrasp| trial.error(grasp, &start, &end, &pose);
            assert!(error(&truth).is_some_and(|error| error < 1e-6));
            let turned = PlanarGrasp { angle: truth.angle + Angle::from_degrees(12.0), ..truth };
            let moved = PlanarGrasp { x: truth.x + 5.0 * pose.scale, ..truth };
            let near = PlanarGrasp { x: truth.x + 4.0 * pose.scale, ..truth };
            assert!(error(&turned).is_none() && error(&moved).is_none());
            assert!(error(&near).is_some_and(|error| (error - 4.0).abs() < 1e-6));
        }
    }

    #[test]
    fn what_was_measured_is_not_measured_again_and_a_torn_line_is() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("outcomes.jsonl");
        let outcome = Outcome {
            weights: "some".into(),
            part: 1,
            steps: 15,
            seed: 2,
            with: 10,
            found: 7,
            wrong: 1,
            without: 10,
            alarms: 1,
            look_alikes: 5,
            look_alike_alarms: 2,
            placed: 8,
            separated: 7,
            error_px: None,
            cpu_secs: 4.0,
            steps_done: 15,
            failed: None,
        };
        let line = serde_json::to_string(&outcome).unwrap();
        std::fs::write(&out, format!("{line}\n{}", &line[..20])).unwrap();
        let comparison = |part: u64| Trials {
            name: "some",
            weights: None,
            parts: part..part + 1,
            steps: &[15],
            seed: 2,
            out: &out,
            fine_tuning: None,
        };
        comparison(1).run(&mut |outcome| panic!("measured again: {outcome:?}")).unwrap();
        // The text after a torn line begins on a line of its own.
        let text = std::fs::read_to_string(&out).unwrap();
        assert_eq!(outcomes(&format!("{text}{line}\n")), [outcome.clone(), outcome]);
    }
}
