//! Measures the height of the part with pictures from adjacent positions before the approach.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use sdg_geometry::Angle;

use super::look::{CONFIRMING_TOLERANCE, OTHER_PART_M, beside_m, is_accepted};
use super::{Sequence, Steps, Stop};
use crate::arm::Arm;
use crate::grasp_target::GraspTarget;
use crate::height::{
    HeightError, HeightMeasurement, HeightReport, HeightSource, MIN_BASELINE_M, MeasuredHeight, Sighting, settle,
    triangulate_nearest,
};
use crate::lying_part::LyingParts;
use crate::perception::GraspStep;

/// Minimum distance of the camera from the part, m: closer pictures show too little of it.
const MIN_DISTANCE_M: f64 = 0.18;

/// Sideways shift of the camera for a replacement of a picture that does not show the part, as a fraction of the usual
/// shift. The replacement is still far enough from the picture on the other side.
const REPLACEMENT_SHIFT_SHARE: f64 = 0.5;

/// Horizontal distance from the detected part within which lines of sight are preferred to all others, m: another part
/// beside it may fit better by chance.
const NEAR_M: f64 = 0.010;

impl<A: Arm> Sequence<'_, '_, A> {
    /// Measures the part's height, if that is configured; returns the grasp at that height.
    pub(super) fn measure_height(&mut self, seen: &GraspTarget) -> Steps<GraspTarget> {
        let Some(measurement) = self.cell.config.height else { return Ok(*seen) };
        self.begin(GraspStep::Detect)?;
        let mut report = HeightReport::default();
        let measured = self.look_from_two_places(seen, &measurement, &mut report);
        let measured = match measured {
            Ok(measured) => Ok(measured),
            // The arm stands still and may continue.
            Err(Stop::Failed(_, why)) if self.robot.latched().is_none() => Err(why),
            Err(stop) => return Err(stop),
        };
        report.measured = measured.as_ref().ok().map(|(height, _)| *height);
        report.why_not = measured.as_ref().err().cloned();
        let table_height_m = self.robot.limits().table_height_m;
        let settled = settle(measurement.told, report.measured, report.why_not.as_deref(), table_height_m);
        report.settled = settled.as_ref().ok().copied();
        let sightings = match measured {
            Ok((_, pair)) => pair.to_vec(),
            Err(_) => report.sightings.clone(),
        };
        self.report.height = Some(report);
        let settled = settled.map_err(|why| Stop::Failed(GraspStep::Detect, why))?;
        self.known.surface_m = Some(settled.height_m - measurement.mark_height_m);
        let target = match (settled.source, &sightings[..]) {
            (HeightSource::Measured, [..]) => between(seen, &sightings, settled.height_m),
            // Even a single picture was taken from closer to the part than the picture of its detection.
            (HeightSource::Told, [nearer]) => Some(nearer.at_height(settled.height_m).target),
            (HeightSource::Told, []) => None,
            (HeightSource::Told, several) => between(seen, several, settled.height_m),
        };
        let mut target = target.unwrap_or(*seen);
        target.base_from_tcp.translation.z = settled.height_m - measurement.marks_over_grasp_m();
        if beside_m(seen, &target) > CONFIRMING_TOLERANCE.0 {
            // The target is another part than the detected one, which must not be touched.
            self.note_lying(seen);
        }
        self.report.targets.push(Some(target));
        self.passed(GraspStep::Detect)?;
        Ok(target)
    }

    /// Takes pictures from positions across the marked line, then along it, until two of them give a height from the
    /// surface beside the part: on wood grain only one of the two directions does. Without such a pair, the height of
    /// the part itself is used.
    fn look_from_two_places(
        &mut self,
        seen: &GraspTarget,
        measurement: &HeightMeasurement,
        report: &mut HeightReport,
    ) -> Steps<(MeasuredHeight, [Sighting; 2])> {
        let table_height_m = self.robot.limits().table_height_m;
        let camera_m = table_height_m + measurement.camera_height_m;
        let marks_m = seen.base_from_tcp.translation.z + measurement.marks_over_grasp_m();
        if camera_m - marks_m < MIN_DISTANCE_M {
            let [distance_mm, min_mm, camera_mm] =
                [camera_m - marks_m, MIN_DISTANCE_M, measurement.camera_height_m].map(|length| length * 1e3);
            return Err(fails(format!(
                "from {camera_mm:.0} mm above the table the part is {distance_mm:.0} mm away, expected at least {min_mm:.0} mm"
            )));
        }
        let half_m = 0.5 * measurement.baseline_m;
        let (mut pictures, mut why): (Vec<Vec<Sighting>>, Option<String>) = (Vec::new(), None);
        let mut by_part: Option<(MeasuredHeight, [Sighting; 2])> = None;
        // If one of the first two pictures does not show the part, the next one is taken less far to the side: long
        // parts fill the picture, and reflections move.
        let nearer_m = REPLACEMENT_SHIFT_SHARE * half_m;
        let mut shown_at_m = None;
        for [across_m, along_m] in
            [[half_m, 0.0], [-half_m, 0.0], [nearer_m, 0.0], [-nearer_m, 0.0], [0.0, half_m], [0.0, -half_m]]
        {
            let is_nearer = across_m.abs() == nearer_m;
            if is_nearer && (pictures.len() != 1 || shown_at_m.is_some_and(|shown_m: f64| shown_m * across_m > 0.0)) {
                continue;
            }
            if let Err(stop) = self.go_beside(seen, [along_m, across_m], measurement.camera_height_m) {
                match stop {
                    Stop::Failed(_, because) if self.robot.latched().is_none() => {
                        why.get_or_insert(because);
                        continue;
                    }
                    stop => return Err(stop),
                }
            }
            let shown = self.finder.sight(self.robot.arm(), seen)?;
            self.known.picture_time = self.finder.picture_time();
            if shown.is_empty() {
                let which = if pictures.is_empty() { "first" } else { "second" };
                why.get_or_insert(format!("the {which} picture does not show the part"));
                continue;
            }
            for earlier in &pictures {
                let lying = &self.known.lying;
                let near = |pair: &[Sighting; 2]| is_near(seen, pair, lying);
                match triangulate_nearest(earlier, &shown, measurement.relief_m, near) {
                    Some(Ok((height, pair))) => {
                        let surface_m = height.height_m - measurement.mark_height_m;
                        let expected = MeasuredHeight { height_m: surface_m, ..height };
                        let surface = self.finder.surface_beside(&pair, &expected)?;
                        let (first, _) = by_part.get_or_insert((height, pair));
                        report.by_part = Some(*first);
                        if let Some(surface) = surface {
                            report.sightings.extend(pair);
                            return Ok((measurement.combined(&height, &surface), pair));
                        }
                    }
                    // One picture across the line and one along it may be too close together.
                    Some(Err(error @ HeightError::SamePlace { .. })) => why = why.or(Some(error.to_string())),
                    Some(Err(error)) => why = Some(error.above_table(table_height_m).to_string()),
                    None => {}
                }
            }
            pictures.push(shown);
            shown_at_m.get_or_insert(across_m);
        }
        if let Some((height, pair)) = by_part {
            report.sightings.extend(pair);
            return Ok((height, pair));
        }
        let told_m = measurement.told.map_or(marks_m, |told| told.height_m);
        report.sightings.extend(pictures.iter().filter_map(|shown| nearest(seen, shown, told_m)));
        let min_mm = MIN_BASELINE_M * 1e3;
        Err(fails(why.unwrap_or_else(|| format!("no two pictures from places {min_mm:.0} mm apart show the part"))))
    }

    /// Moves the camera to a position beside a part (m along and across its marked line), looking down, with the hand
    /// in the orientation of the grasp.
    fn go_beside(&mut self, seen: &GraspTarget, [along_m, across_m]: [f64; 2], height_m: f64) -> Steps<()> {
        let beside = seen.base_from_tcp.rotation * Vector3::new(along_m, across_m, 0.0);
        self.look_down(&[seen.base_from_tcp], [beside.x, beside.y], height_m, GraspStep::Hover)
    }
}

/// Whether a pair of sightings, moved to the height at which their lines of sight cross, shows the part where it was
/// detected; an error if it shows another object.
fn is_near(seen: &GraspTarget, pair: &[Sighting; 2], lying: &LyingParts) -> Result<bool, HeightError> {
    let targets = pair.map(|sighting| sighting.target);
    let apart_m = targets.iter().map(|target| beside_m(seen, target)).fold(0.0, f64::max);
    let is_known = |target: &GraspTarget| lying.all().iter().any(|part| part.is_at(&target.base_from_tcp));
    let is_other = apart_m > OTHER_PART_M || (apart_m > NEAR_M && targets.iter().any(is_known));
    if is_other || !targets.iter().all(|target| shows(seen, target)) {
        let score = targets.iter().map(|target| target.score).fold(f64::INFINITY, f64::min);
        return Err(HeightError::Elsewhere { beside_m: apart_m, score });
    }
    Ok(apart_m <= NEAR_M)
}

/// Whether a detection may be the detected part, whose height is not known yet: it is sure or confirms it.
fn shows(seen: &GraspTarget, found: &GraspTarget) -> bool {
    let mut level = *found;
    level.base_from_tcp.translation.z = seen.base_from_tcp.translation.z;
    is_accepted(seen, &level)
}

/// The sighting in a picture that is nearest to the detected part, with the marks at a height.
fn nearest(seen: &GraspTarget, shown: &[Sighting], height_m: f64) -> Option<Sighting> {
    let beside = |sighting: &Sighting| beside_m(seen, &sighting.at_height(height_m).target);
    let is_there = |sighting: &&Sighting| {
        beside(sighting) <= CONFIRMING_TOLERANCE.0 && shows(seen, &sighting.at_height(height_m).target)
    };
    shown.iter().filter(is_there).min_by(|a, b| beside(a).total_cmp(&beside(b))).copied()
}

/// The mean grasp of several sightings of one part, with its marks at a height; `None` without sightings.
///
/// A symmetric part may be detected in any of its equivalent orientations, whose mean is none of them. Only the
/// sighting whose orientation is nearest to that of the detected part, and those that confirm it, therefore count.
fn between(seen: &GraspTarget, sightings: &[Sighting], height_m: f64) -> Option<GraspTarget> {
    let mut targets: Vec<GraspTarget> = sightings.iter().map(|sighting| sighting.at_height(height_m).target).collect();
    let yaw = |target: &GraspTarget| {
        let along = target.base_from_tcp.rotation * Vector3::x();
        Angle::from_direction(along.x, along.y)
    };
    let apart_rad = |one: &GraspTarget, other: &GraspTarget| (yaw(one) - yaw(other)).radians().abs();
    let first = targets.iter().min_by(|a, b| apart_rad(a, seen).total_cmp(&apart_rad(b, seen))).copied()?;
    targets.retain(|target| apart_rad(target, &first) <= CONFIRMING_TOLERANCE.1);
    let share = 1.0 / targets.len() as f64;
    let (mut middle, mut turn_rad, mut width_m, mut score) = (Vector3::zeros(), 0.0, 0.0, f64::INFINITY);
    for target in &targets {
        middle += target.base_from_tcp.translation.vector * share;
        turn_rad += (yaw(target) - yaw(&first)).radians() * share;
        width_m += target.jaw_width_m * share;
        score = target.score.min(score);
    }
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn_rad);
    let base_from_tcp = Isometry3::from_parts(Point3::from(middle).into(), turn * first.base_from_tcp.rotation);
    Some(GraspTarget { base_from_tcp, jaw_width_m: width_m, score })
}

fn fails(why: String) -> Stop {
    Stop::Failed(GraspStep::Detect, why)
}

#[cfg(test)]
mod tests;
