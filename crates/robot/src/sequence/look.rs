//! Pictures from the look-out poses, and from above a detection.

use std::time::Instant;

use nalgebra::{Isometry3, Vector3};
use sdg_kinematics::{IkOptions, IkSolution, KinematicsError, with_fingers_exchanged};

use super::held_part::shape_of;
use super::{SETTLE_SECS, Sequence, Steps, Stop, camera_looking_down};
use crate::arm::Arm;
use crate::error::RobotError;
use crate::grasp_target::GraspTarget;
use crate::lying_part::LyingPart;
use crate::perception::GraspStep;
use crate::surroundings::Destination;

/// Camera positions above the part: small shifts that keep it near the centre of the picture, m.
pub(super) const HOVER_SHIFTS_M: [[f64; 2]; 3] = [[0.0, 0.0], [-0.03, 0.03], [0.03, -0.03]];
/// Minimum score of an accepted detection.
pub const SURE: f64 = 0.5;
/// Minimum score of a detection that confirms the first one. The confirming detection must also be within
/// [`CONFIRMING_TOLERANCE`] (m, rad) of the first one.
pub const MIN_CONFIRMING_SCORE: f64 = 0.2;
pub(super) const CONFIRMING_TOLERANCE: (f64, f64) = (0.015, 0.26);
/// Distance from the place where a part is expected beyond which a detection is another part, m.
pub(super) const OTHER_PART_M: f64 = 0.03;
/// Additional age of a picture while the motion that depends on it is planned, s.
const MAX_PLANNING_SECS: f64 = 1.0;

impl<A: Arm> Sequence<'_, '_, A> {
    /// Takes pictures from one look-out pose after the other until the part is found.
    pub(super) fn look_around(&mut self) -> Steps<GraspTarget> {
        self.begin(GraspStep::Detect)?;
        let config = self.cell.config;
        let table_height_m = self.robot.limits().table_height_m;
        let mut looks = 0;
        for look_out in &config.look_outs {
            let q = match look_out.configuration(self.robot.geometry(), &self.cell.camera, table_height_m) {
                Ok(q) => q,
                Err(RobotError::Configuration { .. }) if looks > 0 => continue,
                Err(error) => return Err(error.into()),
            };
            let arrived = self.move_freely(&q, GraspStep::Detect);
            if !self.has_arrived(arrived, looks == 0)? {
                continue;
            }
            self.robot.wait(SETTLE_SECS)?;
            looks += 1;
            self.report.looks[0] = looks;
            let found = self.finder.find(self.robot.arm())?;
            let taken = self.finder.picture_time();
            if let Some(target) = self.keep(found.filter(|target| target.score >= SURE), taken)? {
                return Ok(target);
            }
        }
        Err(Stop::Failed(GraspStep::Detect, format!("the part was not found in {looks} looks")))
    }

    /// Takes pictures from above the first detection until one confirms it or gives a score of at least [`SURE`]:
    /// errors are smaller near the centre of the picture.
    pub(super) fn look_from_above(&mut self, first: &GraspTarget) -> Steps<GraspTarget> {
        self.begin(GraspStep::Hover)?;
        let mut looks = 0;
        for shift_m in HOVER_SHIFTS_M {
            let arrived = self.hover(&[first.base_from_tcp], shift_m, GraspStep::Hover);
            if !self.has_arrived(arrived, looks == 0)? {
                continue;
            }
            looks += 1;
            self.report.looks[1] = looks;
            if let Some(target) = self.find_again(first)? {
                return Ok(target);
            }
        }
        Err(Stop::Failed(GraspStep::Detect, format!("the part was not found in {looks} looks from above it")))
    }

    /// Takes a picture of the part of the first detection. If its best detection is beside that part, it may be another
    /// one: a second picture shows whether there is a nearer one.
    fn find_again(&mut self, first: &GraspTarget) -> Steps<Option<GraspTarget>> {
        let (mut found, mut taken) = (self.finder.find(self.robot.arm())?, self.finder.picture_time());
        if found.is_some_and(|best| best.score >= SURE && beside_m(first, &best) > CONFIRMING_TOLERANCE.0)
            && let Some(nearest) = self.finder.find_nearest(self.robot.arm(), &first.base_from_tcp)?
        {
            (found, taken) = (Some(nearest), self.finder.picture_time());
        }
        let is_same = |target: &GraspTarget| is_accepted(first, target) && beside_m(first, target) <= OTHER_PART_M;
        self.keep(found.filter(is_same), taken)
    }

    /// Whether the arm has arrived at a place for a picture. An unreachable place is skipped unless it is the first;
    /// an error, such as a stop by a person, ends the sequence.
    pub(super) fn has_arrived(&self, arrived: Steps<()>, is_first: bool) -> Steps<bool> {
        match arrived {
            Ok(()) => Ok(true),
            Err(Stop::Failed(..)) if !is_first && self.robot.latched().is_none() => Ok(false),
            Err(stop) => Err(stop),
        }
    }

    /// Stores and returns the accepted detection of a picture that was `taken` at this time; a target that is not
    /// finite is a failure.
    fn keep(&mut self, target: Option<GraspTarget>, taken: Option<Instant>) -> Steps<Option<GraspTarget>> {
        self.note_others();
        self.known.picture_time = taken;
        self.report.targets.push(target);
        target.as_ref().map_or(Ok(()), check_is_finite)?;
        Ok(target)
    }

    /// Fails for a target that the hand cannot grasp. A width in a picture is known only with the part's height.
    pub(super) fn check_target(&self, target: &GraspTarget) -> Steps<()> {
        check_is_finite(target)?;
        let opening_max_m = self.robot.geometry().hand.opening_max_m;
        if target.jaw_width_m <= opening_max_m {
            return Ok(());
        }
        let [width_mm, opening_mm] = [target.jaw_width_m, opening_max_m].map(|length_m| length_m * 1e3);
        let why = format!("the part is {width_mm:.0} mm wide, the hand opens {opening_mm:.0} mm");
        Err(Stop::Failed(GraspStep::Detect, why))
    }

    /// Stores the positions of the other parts in the last picture.
    pub(super) fn note_others(&mut self) {
        for other in self.finder.others() {
            self.note_lying(&other);
        }
    }

    /// Stores the position of a part that must not be touched.
    pub(super) fn note_lying(&mut self, part: &GraspTarget) {
        if let Some(shape) = shape_of(part, self.robot.limits().table_height_m, self.cell.config) {
            self.known.lying.put(LyingPart { base_from_part: part.base_from_tcp, shape });
        }
    }

    /// Fails if the picture on which the next motion depends is too old; called before this motion is planned.
    pub(super) fn check_age(&self) -> Steps<()> {
        self.check_age_with(0.0)
    }

    /// As [`Self::check_age`], called after the motion was planned: planning may take some time. Later motions may depend
    /// on the same picture.
    pub(super) fn check_age_as_planned(&mut self) -> Steps<()> {
        self.check_age_with(MAX_PLANNING_SECS)?;
        self.known.picture_time = None;
        Ok(())
    }

    fn check_age_with(&self, more_secs: f64) -> Steps<()> {
        let Some(taken) = self.known.picture_time else { return Ok(()) };
        let max_secs = self.cell.config.max_detection_age_secs + more_secs;
        let age_secs = taken.elapsed().as_secs_f64();
        if age_secs <= max_secs {
            return Ok(());
        }
        Err(Stop::Failed(
            GraspStep::Detect,
            format!(
                "the detection is {age_secs:.1} s old when the arm should move, at most {max_secs:.1} s are allowed"
            ),
        ))
    }

    /// Moves the camera to above a grasp, shifted by `shift_m`. All grasps have the same position; the hand gets the
    /// orientation of one of them, possibly with exchanged fingers.
    pub(super) fn hover(&mut self, grasps: &[Isometry3<f64>], shift_m: [f64; 2], step: GraspStep) -> Steps<()> {
        self.look_down(grasps, shift_m, self.cell.config.hover_height_m, step)
    }

    /// As [`Self::hover`], at another height above the table.
    pub(super) fn look_down(
        &mut self,
        grasps: &[Isometry3<f64>],
        shift_m: [f64; 2],
        height_m: f64,
        step: GraspStep,
    ) -> Steps<()> {
        self.check_age()?;
        let seed = self.robot.commanded()?;
        let grasp = grasps.first().map_or_else(Vector3::zeros, |grasp| grasp.translation.vector);
        let [x, y] = [grasp.x + shift_m[0], grasp.y + shift_m[1]];
        let height_m = self.robot.limits().table_height_m + height_m;
        let both_ways = grasps.iter().flat_map(|grasp| [*grasp, with_fingers_exchanged(grasp)]);
        let poses: Vec<Isometry3<f64>> = both_ways
            .map(|base_from_grasp| {
                // The picture's up direction is the hand's x.
                let up = base_from_grasp.rotation * Vector3::x();
                let base_from_camera = camera_looking_down(x, y, height_m, up.y.atan2(up.x));
                self.cell.camera.base_from_tcp(self.robot.geometry(), &base_from_camera)
            })
            .collect();
        let unreachable = |why: String| {
            let why = format!("the camera cannot be moved above the part at ({:.2}, {:.2}) m: {why}", grasp.x, grasp.y);
            Stop::Failed(step, why)
        };
        if self.is_surrounded() {
            let way = self.way_to(&Destination::Poses(&poses));
            let way =
                way.map_err(|error| if error.latches() { error.into() } else { unreachable(error.to_string()) })?;
            self.check_age_as_planned()?;
            self.travel(way, step)?;
            return Ok(self.robot.wait(SETTLE_SECS)?);
        }
        let mut best: Option<IkSolution> = None;
        let mut first_error = None;
        for base_from_tcp in poses {
            match self.robot.geometry().inverse(&base_from_tcp, &seed, &IkOptions::default()) {
                Ok(solution) if best.as_ref().is_none_or(|best| solution.cost < best.cost) => best = Some(solution),
                Ok(_) => {}
                Err(error) => {
                    first_error.get_or_insert(error);
                }
            }
        }
        let solution = best.ok_or_else(|| {
            unreachable(first_error.map_or_else(String::new, |error: KinematicsError| error.to_string()))
        })?;
        self.check_age_as_planned()?;
        self.move_freely(&solution.q, step)?;
        Ok(self.robot.wait(SETTLE_SECS)?)
    }
}

fn check_is_finite(target: &GraspTarget) -> Steps<()> {
    let p = target.base_from_tcp.translation.vector;
    if p.iter().all(|value| value.is_finite()) && target.jaw_width_m.is_finite() {
        return Ok(());
    }
    Err(Stop::Failed(GraspStep::Detect, "the grasp that was found is not finite".to_owned()))
}

/// Horizontal distance between two detections, m.
pub(super) fn beside_m(one: &GraspTarget, other: &GraspTarget) -> f64 {
    (one.base_from_tcp.translation.vector - other.base_from_tcp.translation.vector).xy().norm()
}

/// Whether a second detection counts: it is sure or confirms the first one.
pub(super) fn is_accepted(first: &GraspTarget, second: &GraspTarget) -> bool {
    second.score >= SURE || confirms(first, second)
}

/// Whether a second detection confirms the first one.
fn confirms(first: &GraspTarget, second: &GraspTarget) -> bool {
    let apart = first.base_from_tcp.inverse() * second.base_from_tcp;
    second.score >= MIN_CONFIRMING_SCORE
        && apart.translation.vector.norm() <= CONFIRMING_TOLERANCE.0
        && apart.rotation.angle() <= CONFIRMING_TOLERANCE.1
}

#[cfg(test)]
mod tests;
