//! Grasp attempts with a model in the simulated workcell, and their results.
//!
//! The arm gets its grasps in the same way as a real arm ([`ModelFinder`]): from the picture, the camera's pose on the
//! flange, and the model's lengths. From the simulator it gets only facts that the owner of a workcell knows: the
//! intrinsics, the hand-eye calibration, the table's height, and the heights of marks and grasp.

use std::ops::ControlFlow;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use image::RgbImage;
use nalgebra::{Isometry3, Point2};
use sdg_cell::{CameraPose, ModelFinder, MountedCamera, footprints_on_table, part_shape};
use sdg_geometry::{PinholeCamera, PosedCamera};
use sdg_grasp::{GraspModel, Lengths, Verification};
use sdg_kinematics::ArmGeometry;
use sdg_kinematics::collision::Obstacle;
use sdg_report::AttemptSummary;
use sdg_robot::workcell::Workcell as WorkcellFile;
use sdg_robot::{GraspConfig, GraspOutcome, GraspStep, Load, Place, PlaceGoal, PlaceKind, PlacingConfig};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::{SceneVariation, VariationConfig};
use sdg_simulation::views::base_from_look_camera;
use sdg_simulation::{
    AttemptConfig, AttemptErrors, AttemptReport, RecordConfig, SimulationError, Workcell, WorkcellConfig,
};
use serde::{Deserialize, Serialize};

use crate::against_truth::grasp_error;
use crate::simulated_pictures::SimulatedPictures;

/// The settings of a rehearsal.
pub struct Rehearsal<'a> {
    /// The model.
    pub model: &'a GraspModel,
    /// The part on the table.
    pub object: &'a ObjectSpec,
    pub attempts: u32,
    /// Seed of the part's poses, the robot's starts, lights, table and distractors.
    pub seed: u64,
    /// Whether detections are checked against the demonstration.
    pub verification: Verification,
    /// Errors of the robot's settings and of the workcell.
    pub errors: RehearsalErrors,
    /// The wrist camera; `None` for that of the paper.
    pub camera: Option<PinholeCamera>,
    /// The place where the part is put down after each grasp; `None` for grasps only. With a place, the table has no
    /// distractors.
    pub place: Option<RehearsedPlace>,
}

/// A place of a rehearsal.
#[derive(Debug, Clone, PartialEq)]
pub struct RehearsedPlace {
    /// The place.
    pub place: Place,
    /// A single cell of the place to use; with `None`, all its cells are used one after another.
    pub cell: Option<u32>,
    /// All places of the workcell: parts that lie in one of them are not grasped, as by `sdg grasp`.
    pub places: Vec<Place>,
    /// Obstacles of the workcell.
    pub obstacles: Vec<Obstacle>,
    /// Extent of the part to all sides of its grasp, m.
    pub part_radius_m: f64,
    /// Force of each finger, N.
    pub grasp_force_n: f64,
    /// The load while the part is held, if the workcell states it.
    pub load: Option<Load>,
}

impl RehearsedPlace {
    /// A place of a workcell. `text` is `NAME`, or `NAME:CELL` for one cell of the place.
    ///
    /// # Errors
    /// The place or the cell is unknown.
    pub fn named(text: &str, workcell: WorkcellFile) -> sdg_robot::Result<Self> {
        let (name, cell) = text.split_once(':').map_or((text, None), |(name, cell)| (name, Some(cell)));
        let place = workcell.places.iter().find(|place| place.name == name).cloned();
        let takes_turns = cell.is_none() && place.as_ref().is_some_and(|place| place.num_cells() > 1);
        if !takes_turns {
            // Reports an invalid name or cell.
            workcell.place(text)?;
        }
        let cell = cell.and_then(|cell| cell.parse().ok());
        let place = place.expect("a name that the workcell knows");
        let GraspConfig { obstacles, part_radius_m, grasp_force_n, load, .. } = workcell.grasp_config();
        Ok(Self { place, cell, places: workcell.places, obstacles, part_radius_m, grasp_force_n, load })
    }

    /// The scenes: without distractors, and with the part beside obstacles and places.
    fn variation(&self) -> VariationConfig {
        let places = self.places.iter().map(Place::covered_area);
        let taken = footprints_on_table(&self.obstacles).into_iter().chain(places).collect();
        VariationConfig { distractors: 0..=0, taken, ..VariationConfig::default() }
    }

    /// The sequence's settings: those of the workcell, with the look-out poses of rehearsals.
    fn grasp_config(&self) -> GraspConfig {
        GraspConfig {
            obstacles: self.obstacles.clone(),
            part_radius_m: self.part_radius_m,
            grasp_force_n: self.grasp_force_n,
            load: self.load,
            ..GraspConfig::default()
        }
    }
}

/// Errors that are applied in a rehearsal; none by default.
#[derive(Debug, Clone, Copy, Default)]
pub struct RehearsalErrors {
    /// Error of the marks' height in the robot's settings, in metres: added in attempts with odd numbers, subtracted in
    /// attempts with even numbers.
    pub mark_height_m: f64,
    /// Errors of the workcell, as a function of the attempt's seed.
    pub of_workcell: Option<fn(u64) -> AttemptErrors>,
}

/// Results of a rehearsal.
pub struct Rehearsed {
    /// Number of requested attempts.
    pub planned: usize,
    /// The result of each attempt, in order.
    pub attempts: Vec<AttemptSummary>,
    /// External pictures of the first successful attempt, or of the last recorded one.
    pub film: Vec<RgbImage>,
    /// The wrist camera's last picture before the approach of each attempt, with the detection drawn; `None` if no
    /// picture was taken.
    pub views: Vec<Option<RgbImage>>,
    /// Kind of the place where parts were put down; `None` for grasps only.
    pub place: Option<PlaceKind>,
}

/// A failed attempt, as in the list of `--json` (docs/command-line.md).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    attempt: usize,
    step: &'static str,
    why: String,
}

impl Rehearsed {
    /// Whether parts were put down.
    pub fn is_placing(&self) -> bool {
        self.place.is_some()
    }

    /// Number of successful attempts: the part was held or, with a place, put down in it.
    pub fn successes(&self) -> usize {
        self.attempts.iter().filter(|attempt| attempt.success).count()
    }

    /// The interruption in words; `None` if all requested attempts were made.
    pub fn interruption(&self) -> Option<String> {
        let done = self.attempts.len();
        (done < self.planned).then(|| format!("interrupted after {done} of {} attempts", self.planned))
    }

    /// The failed attempts, and the reasons.
    pub fn failures(&self) -> Vec<Failure> {
        self.attempts
            .iter()
            .filter(|attempt| !attempt.success)
            .map(|attempt| Failure { attempt: attempt.number, step: step_name(attempt), why: attempt.why.clone() })
            .collect()
    }

    /// Whether every attempt failed because the part was not found.
    pub fn found_nothing(&self) -> bool {
        !self.attempts.is_empty() && self.attempts.iter().all(|attempt| attempt.not_found)
    }
}

/// Number of pictures that were searched in an attempt, until the part was found or no further camera pose remained.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Looks {
    /// Pictures from look-out poses.
    pub from_afar: usize,
    /// Pictures from above the detected part.
    pub from_above: usize,
}

/// An attempt with its pictures.
pub struct RehearsedAttempt {
    pub attempt: AttemptSummary,
    /// Number of searched pictures.
    pub looks: Looks,
    /// External pictures, if requested.
    pub frames: Vec<RgbImage>,
    /// The wrist camera's last picture before the approach, with the detection drawn.
    pub view: Option<RgbImage>,
}

impl Rehearsal<'_> {
    /// Runs the attempts in order. `observe` is called after each one and may end the rehearsal. An attempt whose
    /// physics fails is a failed attempt.
    ///
    /// # Errors
    /// The other errors of [`Self::attempt`].
    pub fn run(&self, observe: &mut dyn FnMut(&AttemptSummary) -> ControlFlow<()>) -> Result<Rehearsed> {
        let mut rehearsed = Rehearsed {
            planned: self.attempts as usize,
            attempts: Vec::new(),
            film: Vec::new(),
            views: Vec::new(),
            place: self.place.as_ref().map(|of_cell| of_cell.place.kind),
        };
        let mut filmed_success = false;
        for number in 1..=self.attempts as usize {
            let started = Instant::now();
            let attempted = self.attempt(number, (!filmed_success).then(RecordConfig::default));
            let RehearsedAttempt { attempt, frames, view, .. } = match attempted {
                Err(error) if is_of_physics(&error) => {
                    let (why, duration_secs) = (error.root_cause().to_string(), started.elapsed().as_secs_f64());
                    let attempt = AttemptSummary { step: None, why, duration_secs, ..self.begun(number, None) };
                    RehearsedAttempt { attempt, looks: Looks::default(), frames: Vec::new(), view: None }
                }
                attempted => attempted?,
            };
            if !frames.is_empty() {
                rehearsed.film = frames;
                filmed_success = attempt.success;
            }
            rehearsed.views.push(view);
            let observed = observe(&attempt);
            rehearsed.attempts.push(attempt);
            if observed.is_break() {
                break;
            }
        }
        Ok(rehearsed)
    }

    /// Rejects places that leave no room for the part's start, and a place whose cells have too little room for the
    /// part or for the opening fingers.
    ///
    /// # Errors
    /// There is no free start; or a cell is too small: the error names the first one and a sufficient pitch.
    pub fn check_room(&self) -> Result<()> {
        self.check_starts()?;
        let Some(part) = part_shape(&self.told_model(1)?) else { return Ok(()) };
        // The simulator's arm.
        let hand = ArmGeometry::panda().hand;
        for number in 1..=self.attempts as usize {
            if let Some((goal, placing)) = self.placing(number)? {
                goal.check_room(&part, placing.symmetry, placing.release_margin_m, &hand)?;
            }
        }
        Ok(())
    }

    /// Rejects places and obstacles that leave no room for the part's start: the part would lie in a place, where it is
    /// not grasped.
    fn check_starts(&self) -> Result<()> {
        let Some(place) = &self.place else { return Ok(()) };
        // Without the light and the table, which do not change the part's pose.
        let variation = VariationConfig { appearance: false, ..place.variation() };
        for number in 1..=self.attempts as usize {
            let scene = SceneVariation::sample(Some(self.object), &variation, attempt_seed(self.seed, number));
            if scene.object.is_some_and(|object| !variation.has_room_for(&object)) {
                let [x, y] = [&variation.object_x_m, &variation.object_y_m]
                    .map(|range| format!("{:.0} to {:.0}", 1e3 * range.start, 1e3 * range.end));
                bail!(
                    "the places and obstacles leave no room for the part: expected a free start at x from {x} mm and y \
                     from {y} mm, found none for attempt {number}"
                );
            }
        }
        Ok(())
    }

    /// Runs one attempt. Its scene and start depend only on the rehearsal and the number.
    ///
    /// A grasp that cannot be executed (wider than the hand, off the table) is a failed attempt.
    ///
    /// # Errors
    /// The simulation fails, or the model's lengths or the place are invalid.
    pub fn attempt(&self, number: usize, record: Option<RecordConfig>) -> Result<RehearsedAttempt> {
        let seed = attempt_seed(self.seed, number);
        let variation = self.place.as_ref().map(RehearsedPlace::variation).unwrap_or_default();
        let scene = SceneVariation::sample(Some(self.object), &variation, seed);
        let base_from_object = scene.object.as_ref().map(|object| object.base_from_object);
        let errors = self.errors.of_workcell.map(|errors| errors(seed)).unwrap_or_default();
        // As with a real arm, shape and symmetry of the part are those of the model.
        let model = self.told_model(number)?;
        let of_cell = self.place.as_ref().map(RehearsedPlace::grasp_config).unwrap_or_default();
        let grasp = GraspConfig { part: part_shape(&model), ..of_cell };
        let mut workcell = Workcell::new(&WorkcellConfig {
            errors,
            wrist_camera: self.camera,
            obstacles: grasp.obstacles.clone(),
            ..WorkcellConfig::new(scene)
        })?;
        let camera = MountedCamera {
            intrinsics: self.camera.unwrap_or(PinholeCamera::WRIST),
            pose: CameraPose::OnFlange(workcell.told_flange_from_camera()),
            table_height_m: 0.0,
        };
        let mut finder = ModelFinder::new(model, camera, SimulatedPictures).with_verification(self.verification);
        if let Some(place) = &self.place {
            finder.places.clone_from(&place.places);
        }
        let config = AttemptConfig { grasp, record, placing: self.placing(number)?, ..AttemptConfig::default() };
        let started = Instant::now();
        let (attempt, looks, frames) = match workcell.run_attempt(&mut finder, &config, seed) {
            Ok(mut report) => (self.record(number, &report), looks_of(&report), std::mem::take(&mut report.frames)),
            Err(SimulationError::Perception(why)) => {
                let duration_secs = started.elapsed().as_secs_f64();
                let failed = AttemptSummary { why, duration_secs, ..self.begun(number, base_from_object) };
                (failed, Looks::default(), Vec::new())
            }
            Err(error) => return Err(error).with_context(|| format!("attempt {number}")),
        };
        let view = finder.last().map(|(picture, found)| {
            let detections: Vec<_> = found.iter().map(|found| found.detection.clone()).collect();
            sdg_cell::drawing::with_detections(picture, &detections)
        });
        Ok(RehearsedAttempt { attempt, looks, frames, view })
    }

    /// The place and the settings with which an attempt puts the part down.
    fn placing(&self, number: usize) -> Result<Option<(PlaceGoal, PlacingConfig)>> {
        let Some(RehearsedPlace { place, cell, .. }) = &self.place else { return Ok(None) };
        let in_turn = (number as u32 - 1) % place.num_cells() + 1;
        let goal = place.goal(cell.unwrap_or(in_turn))?;
        Ok(Some((goal, PlacingConfig { symmetry: self.model.facts().symmetry, ..PlacingConfig::default() })))
    }

    /// The model with the lengths that the robot uses in an attempt, including the error of the marks' height. It has
    /// no region, because a region refers to the user's camera, not to the simulated one.
    ///
    /// # Errors
    /// Invalid lengths.
    fn told_model(&self, number: usize) -> Result<GraspModel> {
        let sign = if number.is_multiple_of(2) { -1.0 } else { 1.0 };
        let known = &self.model.facts().lengths;
        let mut lengths = known.clone().map_or_else(|| self.lengths_of_demonstration(), Ok)?;
        lengths.mark_height_m += sign * self.errors.mark_height_m;
        let model = self.model.clone().with_region(None)?;
        if known.as_ref() == Some(&lengths) {
            return Ok(model);
        }
        Ok(model.with_lengths(lengths, f64::INFINITY)?)
    }

    /// The lengths of a model that was taught from a shipped photo without a plan view. They follow from the camera of
    /// the photo: it looked vertically down, so the pixel size is uniform in the marks' plane.
    fn lengths_of_demonstration(&self) -> Result<Lengths> {
        let camera = PosedCamera { intrinsics: PinholeCamera::WRIST, world_from_camera: base_from_look_camera() };
        let ObjectSpec { mark_height_m, grasp_height_m, .. } = *self.object;
        let middle = Point2::new(f64::from(camera.intrinsics.width), f64::from(camera.intrinsics.height)) / 2.0;
        let metres_per_pixel =
            camera.metres_per_pixel(&middle, mark_height_m).context("the marks lie above the camera")?;
        Ok(Lengths::of_level_photos(1.0 / metres_per_pixel, mark_height_m, grasp_height_m))
    }

    fn record(&self, number: usize, report: &AttemptReport) -> AttemptSummary {
        let (step, why) = match &report.outcome {
            GraspOutcome::Held if self.place.is_some() => (GraspStep::Check, String::new()),
            GraspOutcome::Held => (GraspStep::Hold, String::new()),
            GraspOutcome::Failed { step, why } => (*step, why.clone()),
        };
        // The last detection determines the hand's pose.
        let last_target = report.targets.iter().rev().flatten().next();
        let detection_error = report
            .base_from_object
            .zip(last_target)
            .map(|(base_from_object, target)| grasp_error(self.object, &base_from_object, &target.base_from_tcp));
        AttemptSummary {
            detection_error,
            step: Some(step as usize),
            not_found: report.found_nothing,
            success: report.outcome.is_held(),
            why,
            duration_secs: report.wall_secs,
            ..self.begun(number, report.base_from_object)
        }
    }

    /// The facts of an attempt that are known before it begins: the part's pose.
    fn begun(&self, number: usize, base_from_object: Option<Isometry3<f64>>) -> AttemptSummary {
        let grasp = base_from_object.map(|base_from_object| self.object.grasp_in_base(&base_from_object));
        let (object_mm, object_angle_deg) = match grasp {
            Some((tcp, direction_rad)) => ([tcp.x * 1e3, tcp.y * 1e3], direction_rad.to_degrees()),
            None => ([f64::NAN; 2], f64::NAN),
        };
        AttemptSummary {
            number,
            object_mm,
            object_angle_deg,
            detection_error: None,
            step: Some(GraspStep::Detect as usize),
            not_found: false,
            success: false,
            why: String::new(),
            duration_secs: 0.0,
        }
    }
}

/// Name of the step of an attempt whose simulation failed.
pub(crate) const SIMULATION: &str = "simulation";

/// Name of the step at which an attempt ended.
pub fn step_name(attempt: &AttemptSummary) -> &'static str {
    attempt.step.map_or(SIMULATION, |step| GraspStep::WITH_PLACING[step].name())
}

/// Whether the physics failed (not files, OpenGL or settings); then only this attempt fails.
pub(crate) fn is_of_physics(error: &anyhow::Error) -> bool {
    matches!(
        error.downcast_ref::<SimulationError>(),
        Some(
            SimulationError::Unstable { .. } | SimulationError::TooManyContacts { .. } | SimulationError::MuJoCo { .. }
        )
    )
}

fn looks_of(report: &AttemptReport) -> Looks {
    let [from_afar, from_above] = report.looks;
    Looks { from_afar, from_above }
}

/// A separate seed for every attempt of every rehearsal.
fn attempt_seed(seed: u64, number: usize) -> u64 {
    seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(number as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shipped;
    use sdg_grasp::{ModelKind, SearchRegion, TeachOptions, teach};

    /// Model S of the pendulum, with a region.
    fn taught() -> GraspModel {
        let mut options = TeachOptions::new(1);
        options.kind = ModelKind::S;
        options.region = Some(SearchRegion { x: 200, y: 100, width: 300, height: 300, picture: None });
        let demonstration = shipped::demonstration("pendulum").unwrap();
        teach(&[demonstration], &options, &mut |_| ControlFlow::Continue(())).unwrap().model
    }

    fn rehearsal<'a>(model: &'a GraspModel, object: &'a ObjectSpec) -> Rehearsal<'a> {
        Rehearsal {
            model,
            object,
            attempts: 2,
            seed: 1,
            verification: Verification::ByShape,
            errors: RehearsalErrors::default(),
            camera: None,
            place: None,
        }
    }

    #[test]
    fn the_region_of_a_model_is_ignored() {
        let (model, object) = (taught(), ObjectSpec::by_name("pendulum").unwrap());
        assert!(model.region().is_some());
        assert_eq!(rehearsal(&model, &object).told_model(1).unwrap().region(), None);
    }

    /// A part whose 110 boxes have more contacts with the table than a scene may have.
    fn part_with_too_many_contacts() -> ObjectSpec {
        let boxes: String = (0..110)
            .map(|k| {
                let (x, y) = (0.005 * f64::from(k % 11), 0.005 * f64::from(k / 11));
                format!("<geom type=\"box\" pos=\"{x} {y} 0.0045\" size=\"0.002 0.002 0.005\" mass=\"0.001\"/>")
            })
            .collect();
        let folder = tempfile::tempdir().unwrap();
        let body = format!("<body name=\"object\"><freejoint name=\"object_joint\"/>{boxes}</body>");
        let mjcf = format!("<mujoco><worldbody>{body}</worldbody></mujoco>");
        std::fs::write(folder.path().join("object.xml"), mjcf).unwrap();
        let metadata = r#"{"format": 1, "name": "brush", "title": "Brush", "description": "a brush", "mass_kg": 0.11,
            "friction": 0.6, "grasp_start": [0, 0.02, 0.01], "grasp_end": [0.05, 0.02, 0.01], "jaw_width_m": 0.05,
            "grasp_height_m": 0.006, "mark_height_m": 0.01, "rest_height_m": 0.0, "symmetry": "none",
            "footprint": [[0, 0], [0.05, 0], [0.05, 0.045], [0, 0.045]], "mjcf": "object.xml"}"#;
        std::fs::write(folder.path().join("object.json"), metadata).unwrap();
        ObjectSpec::from_folder(folder.path()).unwrap()
    }

    #[test]
    fn failing_physics_fail_an_attempt_and_not_the_rehearsal() {
        let (model, object) = (taught(), part_with_too_many_contacts());
        let rehearsed = rehearsal(&model, &object).run(&mut |_| ControlFlow::Continue(())).unwrap();
        assert_eq!((rehearsed.attempts.len(), rehearsed.successes(), rehearsed.views.len()), (2, 0, 2));
        assert!(rehearsed.failures().iter().all(|failure| failure.step == "simulation"), "{:?}", rehearsed.failures());
        assert!(rehearsed.attempts[1].why.starts_with("too many contacts for this part"), "{:?}", rehearsed.attempts);
        assert!(!rehearsed.found_nothing());
    }

    #[test]
    fn attempts_of_neighbouring_seeds_differ() {
        let seeds = |seed| (1..=50).map(move |number| attempt_seed(seed, number));
        assert!(seeds(1).all(|one| seeds(2).all(|other| one != other)));
    }

    #[test]
    fn no_part_starts_in_a_place() {
        let sections = "\n[[bin]]\nname = \"bin\"\nat_mm = [450, 0]\nsize_mm = [150, 150]\n\
                        [[place]]\nname = \"shelf\"\nat_mm = [550, 120]\n";
        let text = include_str!("../../../datasets/workcell/workcell.toml").to_owned() + sections;
        let place = RehearsedPlace::named("bin", WorkcellFile::from_toml(&text).unwrap()).unwrap();
        let object = ObjectSpec::by_name("rod_end").unwrap();
        let is_placed = |variation: &VariationConfig, seed: u64| {
            let scene = SceneVariation::sample(Some(&object), variation, seed);
            let (grasp, _) = object.grasp_in_base(&scene.object.unwrap().base_from_object);
            place.places.iter().any(|place| place.covers([grasp.x, grasp.y]))
        };
        assert!((0..50).any(|seed| is_placed(&VariationConfig::default(), seed)));
        assert!((0..50).all(|seed| !is_placed(&place.variation(), seed)));
    }

    #[test]
    fn places_that_cover_all_starts_are_refused() {
        let (model, object) = (taught(), ObjectSpec::by_name("pendulum").unwrap());
        let checked = |size_mm: [u32; 2]| {
            let bin = format!("\n[[bin]]\nname = \"bin\"\nat_mm = [500, 0]\nsize_mm = {size_mm:?}\n");
            let text = include_str!("../../../datasets/workcell/workcell.toml").to_owned() + &bin;
            let place = RehearsedPlace::named("bin", WorkcellFile::from_toml(&text).unwrap()).unwrap();
            Rehearsal { place: Some(place), ..rehearsal(&model, &object) }.check_starts()
        };
        assert!(checked([100, 100]).is_ok());
        let refused = checked([500, 700]).unwrap_err().to_string();
        assert!(refused.contains("at x from 370 to 620 mm and y from -200 to 200 mm"), "{refused}");
    }

    #[test]
    fn a_rehearsed_place_keeps_the_tool_of_its_workcell() {
        let tray = "\n[[tray]]\nname = \"tray\"\nfirst_mm = [350, 320]\ncolumns = 2\nrows = 2\npitch_mm = [180, 80]\n";
        let text = include_str!("../../../datasets/workcell/workcell.toml").to_owned() + tray;
        let grasp_of = |text: &str| {
            let workcell = WorkcellFile::from_toml(text).unwrap();
            RehearsedPlace::named("tray", workcell).unwrap().grasp_config()
        };
        assert_eq!(grasp_of(&text), GraspConfig::default());
        let tool = "grasp_force_n = 20\npart_radius_mm = 120\npart_mass_kg = 0.5";
        let grasp = grasp_of(&text.replace("grasp_force_n = 40.0", tool));
        assert_eq!((grasp.part_radius_m, grasp.grasp_force_n), (0.12, 20.0));
        assert_eq!(grasp.load.unwrap().mass_kg, 0.5);
    }
}
