//! Lowers the held part until a contact is measured, not to a given height, and checks the part's position with a
//! picture.
//!
//! ```text
//! held ─> carry ─> straight down, compliant at the end, until contact ─> open, up ─> look ─> within the limits
//!           ▲                                                                        └ outside: grasp again,
//!           └── aim with the part's pose in the hand ◄───────────────────────────────┘ a limited number of times
//! ```
//! The fingers do not fix a part along the marked line: some parts slide along this line when the fingers close. The
//! picture measures this offset, and the next placement compensates it.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use sdg_geometry::{Angle, RotationalSymmetry};

use super::carry::{Aim, BELOW_M};
use super::held_part::shape_of;
use super::look::{HOVER_SHIFTS_M, OTHER_PART_M};
use super::reach::{FINGERTIP_CLEARANCE_M, MAX_EARLY_M, above};
use super::{GraspConfig, GraspOutcome, GraspReport, SETTLE_SECS, SURE, Sequence, Steps, Stop};
use crate::arm::{Arm, CompliantArm};
use crate::arm_state::{HandCommand, Load};
use crate::camera_pose::CameraPose;
use crate::error::Result;
use crate::grasp_target::GraspTarget;
use crate::height::HeightReport;
use crate::lying_part::{LyingPart, LyingParts};
use crate::perception::{GraspStep, PartFinder, StepObserver};
use crate::place::{Place, PlaceGoal, PlaceOffset};
use crate::robot::Robot;
use crate::room::{release_opening_m, same_turns_rad};
use crate::touch::{TouchDown, Touched};

/// Speed at which the opening changes when the part is released, m/s.
const RELEASING_SPEED_M_S: f64 = 0.05;
/// Time that the arm stands still after the fingers have opened, s.
const RELEASED_SECS: f64 = 0.2;
/// The smallest sufficient ascent after the release if the arm cannot follow the whole ascent, m.
const MIN_RETREAT_M: f64 = 0.05;

/// Settings for putting a held part down.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacingConfig {
    /// The compliant descent at the end.
    pub touch_down: TouchDown,
    /// Rotational symmetry of the part.
    pub symmetry: RotationalSymmetry,
    /// Opening of the hand beyond the part for releasing it, both sides together, m.
    pub release_margin_m: f64,
    /// Height of the ascent after the release, m.
    pub retreat_m: f64,
    /// Largest allowed offset of the part from its place, m.
    pub tolerance_m: f64,
    /// Largest allowed angle between the part and its goal, rad.
    pub tolerance_rad: f64,
    /// A part with a larger offset (m) or angle (rad) is grasped again. These limits are below the tolerances, because
    /// the measurement by a picture is not exact.
    pub aim: (f64, f64),
    /// Maximum number of repeated grasps.
    pub max_corrections: usize,
}

impl Default for PlacingConfig {
    /// Tolerances of 3 mm and 3°; beyond 2 mm or 2° the part is grasped again, at most twice.
    fn default() -> Self {
        Self {
            touch_down: TouchDown::default(),
            symmetry: RotationalSymmetry::None,
            release_margin_m: 0.020,
            retreat_m: 0.15,
            tolerance_m: 0.003,
            tolerance_rad: 3_f64.to_radians(),
            aim: (0.002, 2_f64.to_radians()),
            max_corrections: 2,
        }
    }
}

/// The outcome of placing.
#[derive(Debug, Clone, PartialEq)]
pub enum PlacingOutcome {
    /// The part lies at its place.
    Placed,
    /// A step of the grasp or of placing failed.
    Failed {
        /// The failed step.
        step: GraspStep,
        /// The reason, in one sentence.
        why: String,
    },
}

/// The outcome of placing, with the measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacingReport {
    /// The first grasp.
    pub grasp: GraspReport,
    /// The outcome.
    pub outcome: PlacingOutcome,
    /// The results of all placements' descents, and of the compliant approaches of repeated grasps.
    pub touched: Vec<Touched>,
    /// The part's offset from its place (from a bin's centre), one for each picture in which the part was detected.
    pub errors: Vec<PlaceOffset>,
    /// The part's offset in the last picture of its place; `None` if it was not detected there, or if a repeated grasp
    /// began after that picture.
    pub last: Option<PlaceOffset>,
}

/// Grasps the part and puts it down; repeats both if the part's offset is too large, see
/// [`PlacingConfig::max_corrections`]. A cell of a tray must have room for the part and for the fingers that release
/// it, with parts assumed in all neighbouring cells. This is checked before anything moves if [`GraspConfig::part`] is
/// given, otherwise after the part was found.
///
/// # Errors
/// As for [`super::grasp`]; [`crate::RobotError::Configuration`] if [`GraspConfig::part`] has no room, or for
/// impossible values of [`PlacingConfig::touch_down`].
pub fn grasp_and_place<A: CompliantArm>(
    robot: &mut Robot<'_, A>,
    finder: &mut dyn PartFinder<A>,
    observer: &mut dyn StepObserver<A>,
    camera: CameraPose,
    config: &GraspConfig,
    goal: &PlaceGoal,
    placing: &PlacingConfig,
) -> Result<PlacingReport> {
    placing.touch_down.validate()?;
    if let Some(part) = &config.part {
        goal.check_room(part, placing.symmetry, placing.release_margin_m, &robot.geometry().hand)?;
    }
    let mut sequence = Sequence::yielding(robot, finder, observer, camera, config);
    let outcome = sequence.grasp(|sequence, target| sequence.prepare(target, goal, placing))?;
    let grasp = sequence.grasp_report(outcome);
    let mut report = PlacingReport::of(grasp);
    let placed = match report.grasp.outcome.clone() {
        GraspOutcome::Failed { step, why } => Err(Stop::Failed(step, why)),
        GraspOutcome::Held => sequence.place(goal, placing, &mut report),
    };
    match placed {
        Ok(()) => {}
        Err(Stop::Failed(step, why)) => report.outcome = PlacingOutcome::Failed { step, why },
        Err(Stop::Error(error)) => return Err(error),
    }
    report.touched = std::mem::take(&mut sequence.report.touched);
    Ok(report)
}

impl PlacingReport {
    /// The report after the first grasp, before a step failed.
    fn of(grasp: GraspReport) -> Self {
        Self { grasp, outcome: PlacingOutcome::Placed, touched: Vec::new(), errors: Vec::new(), last: None }
    }
}

impl PlacingOutcome {
    /// Whether the part lies at its place.
    pub fn is_placed(&self) -> bool {
        *self == Self::Placed
    }
}

impl<A: Arm> Sequence<'_, '_, A> {
    /// Fails if the place has no room for the part or, unless it is a bin, already contains a part. Adds the parts that
    /// may lie around the place as obstacles.
    fn prepare(&mut self, target: &GraspTarget, goal: &PlaceGoal, placing: &PlacingConfig) -> Steps<()> {
        let table_height_m = self.surface_height_m();
        let Some(part) = shape_of(target, table_height_m, self.cell.config) else { return Ok(()) };
        goal.check_room(&part, placing.symmetry, placing.release_margin_m, &self.robot.geometry().hand)
            .map_err(|error| Stop::Failed(GraspStep::Detect, error.to_string()))?;
        let taken = LyingPart { base_from_part: target.base_from_tcp, shape: part.clone() };
        self.known.lying.take(&target.base_from_tcp);
        let there = |base_from_part| LyingPart { base_from_part, shape: part.clone() };
        let height_m = goal.surface_m + part.grasp_height_m();
        let placed = there(goal.base_from_part(height_m, 0.0));
        if goal.bin_m.is_none()
            && let Some(other) = self.known.lying.all().iter().find(|other| other.overlaps(&placed))
        {
            let p = other.base_from_part.translation;
            let why = format!("\"{}\" already contains a part, at ({:.3}, {:.3}) m", goal.name, p.x, p.y);
            return Err(Stop::Failed(GraspStep::Detect, why));
        }
        // A part that was taken from a neighbouring cell leaves that cell empty.
        for neighbour in goal.neighbours_in_base(height_m).map(there).filter(|part| !part.overlaps(&taken)) {
            self.known.lying.suppose(neighbour);
        }
        Ok(())
    }

    /// Fills the last two fields of the report, `errors` and `last`.
    fn place(&mut self, goal: &PlaceGoal, placing: &PlacingConfig, report: &mut PlacingReport) -> Steps<()> {
        let is_height_measured = report.grasp.height.as_ref().is_some_and(HeightReport::is_measured);
        let (mut num_corrections, mut slid) = (0, Isometry3::identity());
        loop {
            let aim = self.carry(goal, placing.symmetry, self.release_opening_m(placing), &slid)?;
            let raised_m = self.put_down(&aim, goal, placing)?;
            // The contact measures the difference between the place and the surface under the first grasp. If that
            // surface was not measured, its height may be the wrong one, and the place's may be right.
            let place_raised_m = if is_height_measured { raised_m } else { 0.0 };
            let base_from_placed = above(&aim.base_from_part, place_raised_m);
            let q = self.robot.state()?.q;
            let base_from_tcp = self.robot.geometry().forward(&q);
            let shape = self.known.held.as_ref().and_then(|held| held.shape.clone());
            let part_from_tcp = self.release(placing)?;
            let older = self.known.lying.clone();
            let lies = shape.map(|shape| LyingPart { base_from_part: base_from_placed, shape });
            lies.into_iter().for_each(|part| self.known.lying.put(part));
            let found = match (self.look_at(goal, &base_from_placed, &older, placing)?, goal.bin_m) {
                (Some(found), _) => found,
                // In a bin a part may lie in any pose, also under other parts.
                (None, Some(_)) => return Ok(()),
                (None, None) => return Err(fails("the part is not seen where it was put down".to_owned())),
            };
            let error = beside(&aim.base_from_part, &found.base_from_tcp, placing.symmetry);
            report.errors.push(error);
            report.last = Some(error);
            if let Some(outside_m) = outside_bin_m(goal, &found) {
                return match outside_m > 0.0 {
                    true => Err(fails(format!("the part lies beside the bin, {} from its centre", told(&error)))),
                    false => Ok(()),
                };
            }
            let is_within = |(distance_m, angle_rad): (f64, f64)| {
                error.distance_m() <= distance_m && error.angle_rad.abs() <= angle_rad
            };
            let is_allowed = is_within((placing.tolerance_m, placing.tolerance_rad));
            let is_last = num_corrections == placing.max_corrections;
            if is_allowed && (is_last || is_within(placing.aim)) {
                return Ok(());
            }
            if is_last {
                let (allowed_mm, allowed_deg) = (placing.tolerance_m * 1e3, placing.tolerance_rad.to_degrees());
                return Err(fails(format!(
                    "the part lies {} beside its place, at most {allowed_mm:.1} mm and {allowed_deg:.1}° are allowed",
                    told(&error)
                )));
            }
            num_corrections += 1;
            report.last = None;
            self.known.lying.take(&aim.base_from_part);
            slid = slip(&aim.base_from_part, &found.base_from_tcp, &base_from_tcp, &part_from_tcp, &error);
            // The hand keeps the orientation in which it released the part, because the fingers had room in that
            // orientation.
            let mut target =
                GraspTarget { base_from_tcp: as_aimed(&aim.base_from_part, &found.base_from_tcp, &error), ..found };
            // The hand grasps the part at the height of its release. The neighbouring parts lie as high as this one; the
            // next placement again expects all of them at the given height.
            target.base_from_tcp.translation.z = aim.base_from_part.translation.z + raised_m;
            self.known.surface_m = Some(goal.surface_m + raised_m);
            self.set_neighbours_height(goal, &target.base_from_tcp);
            // Other parts may lie next to the part: the hand opens no wider than for releasing.
            self.known.opening_margin_m = placing.release_margin_m;
            self.take(&target, goal.surface_m)?;
            self.set_neighbours_height(goal, &aim.base_from_part);
        }
    }

    /// Sets the height of the parts known or assumed in the neighbouring cells to that of a part.
    fn set_neighbours_height(&mut self, goal: &PlaceGoal, base_from_part: &Isometry3<f64>) {
        for neighbour in goal.neighbours_in_base(base_from_part.translation.z) {
            self.known.lying.set_height(&neighbour);
        }
    }

    /// Descends compliantly until contact with the place; returns the height of the contact above the expected one, m.
    /// It is 0 in a bin, where the part may lie on others, and if the contact is no farther from the expected one than
    /// the finger tips remain from a surface: a part may be tilted in the hand.
    fn put_down(&mut self, aim: &Aim, goal: &PlaceGoal, placing: &PlacingConfig) -> Steps<f64> {
        let touch_down = TouchDown { max_way_m: aim.soft_m + BELOW_M, ..placing.touch_down };
        let Some(touched) = self.touch_down(&touch_down, GraspStep::PutDown)? else {
            let why =
                "this arm is not compliant, so it cannot put a part down by contact; the part is still held".to_owned();
            return Err(Stop::Failed(GraspStep::PutDown, why));
        };
        let hand = self.robot.hand()?;
        self.judge(GraspStep::PutDown, &hand)?;
        let above_m = touched.tcp_height_m - (aim.base_from_tcp.translation.z - aim.soft_m);
        let [above_mm, max_mm] = [above_m, MAX_EARLY_M].map(|height_m| height_m * 1e3);
        let why = match touched.is_contact {
            true if goal.bin_m.is_some() || above_m.abs() <= FINGERTIP_CLEARANCE_M => return Ok(0.0),
            true if above_m <= MAX_EARLY_M => return Ok(above_m),
            true => format!("the contact was {above_mm:.0} mm above the place, at most {max_mm:.0} mm are allowed"),
            false if above_mm >= 0.5 => format!("a contact {above_mm:.0} mm above the place did not last"),
            false => format!("no contact was measured down to {:.0} mm below the place", -above_mm),
        };
        Err(Stop::Failed(GraspStep::PutDown, format!("{why}; the part is still held")))
    }

    /// Opens the hand and moves up; returns `part_from_tcp`, the tcp's pose in the part's frame according to the
    /// detection.
    fn release(&mut self, placing: &PlacingConfig) -> Steps<Isometry3<f64>> {
        self.begin(GraspStep::Release)?;
        let opening_m = self.release_opening_m(placing);
        self.robot.start_hand(HandCommand::Move { opening_m, speed_m_s: RELEASING_SPEED_M_S })?;
        self.robot.finish_hand()?;
        let part_from_tcp = self.known.held.take().map_or_else(Isometry3::identity, |held| held.part_from_tcp);
        if self.cell.config.load.is_some() {
            self.robot.set_load(Load::NONE)?;
        }
        self.robot.wait(RELEASED_SECS)?;
        self.passed(GraspStep::Release)?;
        let limits = self.cell.config.pace.approach_limits(self.robot.geometry());
        // The ascent retraces the descent. It is not compared with lying parts, because the contact may be lower than
        // expected, and parts in a bin may lie anywhere.
        let lying = std::mem::take(&mut self.known.lying);
        let planned = self.plan_up([MIN_RETREAT_M, placing.retreat_m], &limits, GraspStep::Release);
        self.known.lying = lying;
        self.follow(planned?, GraspStep::Release)?;
        Ok(part_from_tcp)
    }

    /// Opening of the hand that releases the held part, m.
    fn release_opening_m(&self, placing: &PlacingConfig) -> f64 {
        let width_m = self.known.closed.map_or(0.0, |hand| hand.opening_m);
        release_opening_m(width_m, placing.release_margin_m, &self.robot.geometry().hand)
    }

    /// Measures with a picture where the part lies, among parts that were known before it was released.
    fn look_at(
        &mut self,
        goal: &PlaceGoal,
        base_from_part: &Isometry3<f64>,
        older: &LyingParts,
        placing: &PlacingConfig,
    ) -> Steps<Option<GraspTarget>> {
        self.begin(GraspStep::Check)?;
        let turns_rad = same_turns_rad(placing.symmetry);
        let num_skipped = turns_rad.len().div_ceil(MAX_VIEW_TURNS);
        let grasps: Vec<Isometry3<f64>> = turns_rad
            .into_iter()
            .step_by(num_skipped)
            .map(|turn_rad| base_from_part * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn_rad))
            .collect();
        self.known.picture_time = None;
        let table_height_m = self.robot.limits().table_height_m;
        for (look, shift_m) in HOVER_SHIFTS_M.into_iter().enumerate() {
            let arrived = match (&self.cell.camera, self.cell.config.look_outs.first()) {
                (CameraPose::OnFlange(_), _) => self.hover(&grasps, shift_m, GraspStep::Check),
                (CameraPose::InBase(_), Some(look_out)) if look == 0 => {
                    let q = look_out.configuration(self.robot.geometry(), &self.cell.camera, table_height_m)?;
                    self.move_freely(&q, GraspStep::Check)?;
                    Ok(self.robot.wait(SETTLE_SECS)?)
                }
                (CameraPose::InBase(_), _) => break,
            };
            if !self.has_arrived(arrived, look == 0)? {
                continue;
            }
            let nearest = self.finder.find_nearest(self.robot.arm(), base_from_part)?;
            let nearest = nearest.filter(|found| found.score >= SURE);
            self.note_others();
            let found = match goal.bin_m {
                Some(_) => {
                    let shown = nearest.into_iter().chain(self.finder.others());
                    put_into_bin(goal, base_from_part, shown, older, &self.cell.config.places)
                }
                None => nearest.filter(|found| apart_m(base_from_part, found) <= max_offset_m(goal)),
            };
            if let Some(found) = found {
                self.known.picture_time = self.finder.picture_time();
                return Ok(Some(found));
            }
        }
        Ok(None)
    }
}

/// Maximum number of orientations, equivalent by the part's symmetry, that are tried for a picture: the orientation in
/// which the hand released the part may be out of reach at the height of the picture.
const MAX_VIEW_TURNS: usize = 4;
/// Largest distance of the part from the walls of a bin beside which it fell, m; a detection farther away is another
/// part.
const MAX_BESIDE_BIN_M: f64 = 0.04;

/// Largest distance of a detection from its place, m: in a tray, a part that is nearer to another cell is that cell's.
fn max_offset_m(goal: &PlaceGoal) -> f64 {
    // A tray of one row has no cell to which its pitch across the row leads.
    let half_pitches_m = goal.tray.iter().flat_map(|tray| {
        let has_neighbour = |axis: usize| tray.neighbours.iter().any(|steps| steps[axis] != 0);
        [0, 1].map(|axis| if has_neighbour(axis) { 0.5 * tray.pitch_m[axis] } else { f64::INFINITY })
    });
    half_pitches_m.fold(OTHER_PART_M, f64::min)
}

/// The part that was put into a bin, of all parts in a picture: preferably one that was not known before, in the bin or
/// else beside it. A part in another one of the `places` is not beside the bin.
fn put_into_bin(
    goal: &PlaceGoal,
    base_from_part: &Isometry3<f64>,
    shown: impl Iterator<Item = GraspTarget>,
    older: &LyingParts,
    places: &[Place],
) -> Option<GraspTarget> {
    let is_older = |found: &GraspTarget| older.all().iter().any(|part| part.is_at(&found.base_from_tcp));
    let is_inside = |found: &GraspTarget| outside_bin_m(goal, found) == Some(0.0);
    let is_beside = |found: &GraspTarget| {
        let p = found.base_from_tcp.translation;
        outside_bin_m(goal, found).is_some_and(|outside_m| outside_m <= MAX_BESIDE_BIN_M)
            && !places.iter().any(|place| place.covers([p.x, p.y]))
    };
    let is_here = |found: &GraspTarget| is_inside(found) || (!is_older(found) && is_beside(found));
    let distance_m = |found: &GraspTarget| apart_m(base_from_part, found);
    let nearest = |a: &GraspTarget, b: &GraspTarget| distance_m(a).total_cmp(&distance_m(b));
    let rank = |found: &GraspTarget| (is_older(found), !is_inside(found));
    shown.filter(is_here).min_by(|a, b| rank(a).cmp(&rank(b)).then_with(|| nearest(a, b)))
}

/// Horizontal distance of a detection from a place, m.
fn apart_m(place: &Isometry3<f64>, found: &GraspTarget) -> f64 {
    (found.base_from_tcp.translation.vector - place.translation.vector).xy().norm()
}

/// As [`PlaceGoal::outside_bin_m`], of a detection.
fn outside_bin_m(goal: &PlaceGoal, found: &GraspTarget) -> Option<f64> {
    let p = found.base_from_tcp.translation;
    goal.outside_bin_m([p.x, p.y])
}

fn fails(why: String) -> Stop {
    Stop::Failed(GraspStep::Check, why)
}

fn told(error: &PlaceOffset) -> String {
    format!("{:.1} mm and {:.1}°", error.distance_m() * 1e3, error.angle_rad.abs().to_degrees())
}

fn yaw(base_from_tcp: &Isometry3<f64>) -> Angle {
    let along = base_from_tcp.rotation * Vector3::x();
    Angle::from_direction(along.x, along.y)
}

/// Offset of a part from its place.
fn beside(place: &Isometry3<f64>, found: &Isometry3<f64>, symmetry: RotationalSymmetry) -> PlaceOffset {
    let apart = place.inverse() * Point3::from(found.translation.vector);
    PlaceOffset { beside_m: [apart.x, apart.y], angle_rad: symmetry.visible(yaw(found) - yaw(place)).radians() }
}

/// The found pose, rotated by the angle of the part's symmetry that brings it closest to the intended one.
fn as_aimed(place: &Isometry3<f64>, found: &Isometry3<f64>, error: &PlaceOffset) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), error.angle_rad);
    Isometry3::from_parts(found.translation, turn * place.rotation)
}

/// Slip of the part when the hand closed, in the part's frame: the actual `part_from_tcp` at the release times the
/// inverse of the detected one, reduced to x, y and the rotation about z.
fn slip(
    place: &Isometry3<f64>,
    found: &Isometry3<f64>,
    base_from_tcp: &Isometry3<f64>,
    part_from_tcp: &Isometry3<f64>,
    error: &PlaceOffset,
) -> Isometry3<f64> {
    let moved = as_aimed(place, found, error).inverse() * base_from_tcp * part_from_tcp.inverse();
    let along = moved.rotation * Vector3::x();
    Isometry3::from_parts(
        Translation3::new(moved.translation.x, moved.translation.y, 0.0),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), along.y.atan2(along.x)),
    )
}

#[cfg(test)]
mod tests;
