//! What base weights are worth: model C taught from them for a few steps on parts that nobody has seen, check off.
//!
//! Each part is taught from its photo and then shown pictures with it, pictures with other parts alone, and pictures with
//! its mirror image or itself with one feature moved. The network alone answers.

use std::fs::OpenOptions;
use std::io::{BufRead, BufReader, Write};
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use image::RgbImage;
use sdg_demonstration::Demonstration;
use sdg_geometry::{Angle, PlanarGrasp, PlanarSimilarity};
use sdg_grasp::{BaseWeights, GraspError, GraspModel, ModelKind, TeachOptions, Verification, teach};
use sdg_part_generator::{LookAlike, OtherKind, Part, PhotoConfig, Sample, SceneConfig, Scenes};
use serde::{Deserialize, Serialize};

use crate::pictures::FIRST_PART_SEED;

/// A detection farther from the truth is another thing: 10 mm at the paper's camera, which has 0.92 px a millimetre in
/// 640 px of width; pictures here have 320.
const MAX_ERROR_PX: f64 = 4.6;
const MAX_ERROR_DEGREES: f64 = 10.0;

/// Pictures of each kind a part.
const PICTURES: [usize; 3] = [10, 10, 5];

/// What becomes of one teaching.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The name of the weights.
    pub weights: String,
    /// Seed of the part.
    pub part: u64,
    /// Steps of teaching.
    pub steps: usize,
    /// Seed of teaching.
    pub seed: u64,
    /// Pictures with the part, and those in which the surest accepted detection is right, and in which it is wrong.
    pub with: usize,
    /// Right.
    pub found: usize,
    /// Accepted at a wrong place.
    pub wrong: usize,
    /// Pictures with other parts alone, and those with an accepted detection.
    pub without: usize,
    /// False alarms.
    pub alarms: usize,
    /// Pictures with look-alikes alone, and those with an accepted detection.
    pub look_alikes: usize,
    /// Look-alikes taken for the part.
    pub look_alike_alarms: usize,
    /// Pictures with the part in which the surest detection, accepted or not, is right.
    pub placed: usize,
    /// Median error of what is right, in pixels of the photo.
    pub error_px: Option<f64>,
    /// Processor time of teaching, seconds.
    pub cpu_secs: f64,
    /// Steps done: an early stop makes them fewer.
    pub steps_done: usize,
    /// Why there is no model; pictures then count as neither found nor alarms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
}

/// One part to measure on: its photo and its pictures.
pub struct Trial {
    part: Part,
    demonstration: Demonstration,
    with: Vec<Sample>,
    without: Vec<Sample>,
    look_alikes: Vec<Sample>,
}

/// Pictures as the wrist camera takes them: from the height of the photo, with a little of everything.
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

impl Trial {
    /// Draws the part of a seed, below [`FIRST_PART_SEED`], and its pictures.
    ///
    /// # Errors
    /// A scene configuration that the generator refuses.
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
        // The part itself in another size is the part nearer to the camera: nobody can tell.
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

    /// The photo and the pictures, each with a name; to look at.
    pub fn pictures(&self) -> Vec<(String, &RgbImage)> {
        let kinds = [("with", &self.with), ("without", &self.without), ("look-alikes", &self.look_alikes)];
        let of_kind = kinds.into_iter().flat_map(|(kind, samples)| {
            samples.iter().enumerate().map(move |(i, sample)| (format!("{kind}-{i}"), &sample.image))
        });
        std::iter::once(("photo".to_owned(), &self.demonstration.image)).chain(of_kind).collect()
    }

    /// Teaches the part and shows the model its pictures.
    ///
    /// # Errors
    /// What teaching refuses, but for a part that was not learnt, which is an outcome.
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
        let mut errors = Vec::new();
        for sample in &self.with {
            let Some((accepted, error)) = self.best(&model, sample)? else { continue };
            outcome.placed += usize::from(error.is_some());
            match error {
                Some(error) if accepted => {
                    outcome.found += 1;
                    errors.push(error);
                }
                None if accepted => outcome.wrong += 1,
                _ => {}
            }
        }
        let alarms = |samples: &[Sample]| -> Result<usize> {
            samples
                .iter()
                .map(|sample| Ok(usize::from(self.best(&model, sample)?.is_some_and(|(accepted, _)| accepted))))
                .sum()
        };
        outcome.alarms = alarms(&self.without)?;
        outcome.look_alike_alarms = alarms(&self.look_alikes)?;
        outcome.error_px = sdg_training::median(&mut errors).map(|error| (error * 100.0).round() / 100.0);
        Ok(outcome)
    }

    /// The surest detection: whether it is accepted, and its error in pixels of the photo where it is right.
    fn best(&self, model: &GraspModel, sample: &Sample) -> Result<Option<(bool, Option<f64>)>> {
        let found = model.detect(&sample.image, Verification::Off)?;
        let Some(best) = found.first() else { return Ok(None) };
        let error = sample.instances.first().and_then(|instance| {
            self.error(&best.grasp, &instance.grasp.start, &instance.grasp.end, &instance.image_from_demonstration)
        });
        Ok(Some((best.is_accepted(), error)))
    }

    /// The distance to the truth, where distance and turn are small enough; turns that look the same are none.
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

/// Processor time of this process so far, in seconds; `None` where the system does not say.
fn cpu_seconds() -> Option<f64> {
    // Behind the program's name, which may hold blanks: fields 14 and 15 are user and system time in ticks of 10 ms.
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    let ticks = |idx: usize| fields.get(idx)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / 100.0)
}

/// Which parts are taught, how, and where outcomes go.
pub struct Comparison<'a> {
    /// The name of the weights in the outcomes.
    pub name: &'a str,
    /// The weights; `None` to teach from nothing.
    pub weights: Option<BaseWeights>,
    /// Seeds of the parts.
    pub parts: std::ops::Range<u64>,
    /// Steps of teaching, one model each.
    pub steps: &'a [usize],
    /// Seed of teaching.
    pub seed: u64,
    /// JSON lines; what stands there already is not measured again.
    pub out: &'a Path,
    /// What to change in each teaching.
    pub adapt: &'a dyn Fn(&mut TeachOptions, usize),
}

impl Comparison<'_> {
    /// Measures what is not in the file yet.
    ///
    /// # Errors
    /// Files that cannot be read or written, and what teaching refuses.
    pub fn run(&self, observe: &mut dyn FnMut(&Outcome)) -> Result<()> {
        let named = || self.out.display().to_string();
        let mut done = Vec::new();
        if self.out.exists() {
            for line in BufReader::new(std::fs::File::open(self.out).with_context(named)?).lines() {
                // A line that was cut off when the program was stopped is measured again.
                done.extend(serde_json::from_str::<Outcome>(&line.with_context(named)?).ok());
            }
        }
        let is_done = |part: u64, steps: usize| {
            let same =
                |o: &&Outcome| (o.weights.as_str(), o.part, o.steps, o.seed) == (self.name, part, steps, self.seed);
            done.iter().any(|outcome| same(&outcome))
        };
        let mut out = OpenOptions::new().create(true).append(true).open(self.out).with_context(named)?;
        for part in self.parts.clone() {
            let missing: Vec<usize> = self.steps.iter().copied().filter(|steps| !is_done(part, *steps)).collect();
            if missing.is_empty() {
                continue;
            }
            let trial = Trial::new(part)?;
            for steps in missing {
                let mut options = TeachOptions {
                    kind: ModelKind::C,
                    symmetry: trial.part.symmetry(),
                    base_weights: self.weights.clone(),
                    ..TeachOptions::new(self.seed)
                };
                (self.adapt)(&mut options, steps);
                options.steps = Some(steps);
                let outcome = trial.run(self.name, part, &options)?;
                observe(&outcome);
                writeln!(out, "{}", serde_json::to_string(&outcome)?).with_context(named)?;
            }
        }
        Ok(())
    }
}
