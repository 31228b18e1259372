//! The sequence with an arm that does not move and a part that is visible in some pictures only.

use std::time::{Duration, Instant};

use nalgebra::UnitQuaternion;
use sdg_kinematics::{ArmGeometry, ready_pose};

use super::*;
use crate::camera_pose::CameraPose;
use crate::height::GivenHeight;
use crate::known_target::KnownTarget;
use crate::perception::PartFinder;
use crate::planned_arm::{PlannedAction, PlannedArm};
use crate::robot::Robot;
use crate::safety::SafetyLimits;
use crate::sequence::{GraspConfig, GraspOutcome, GraspReport, grasp};
use crate::watch::Watch;

/// A part whose detections assume a wrong height; by its lines of sight it lies at `known`.
struct Shown {
    known: KnownTarget,
    seen: GraspTarget,
    /// Whether each picture for the height shows the part; the last entry applies to all further ones.
    shows: Vec<bool>,
    num_sights: usize,
    sees_surface: bool,
    /// Angle by which every second picture for the height shows the part turned, as an equivalent orientation, rad.
    turned_rad: f64,
}

impl PartFinder<PlannedArm> for Shown {
    fn find(&mut self, _arm: &mut PlannedArm) -> crate::Result<Option<GraspTarget>> {
        Ok(Some(self.seen))
    }

    fn sight(&mut self, arm: &mut PlannedArm, expected: &GraspTarget) -> crate::Result<Vec<Sighting>> {
        let is_shown = self.shows.get(self.num_sights).or(self.shows.last()).copied().unwrap_or(true);
        self.num_sights += 1;
        let mut shown = if is_shown { self.known.sight(arm, expected)? } else { Vec::new() };
        if self.num_sights.is_multiple_of(2) {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.turned_rad);
            shown.iter_mut().for_each(|shown| {
                let pose = &mut shown.target.base_from_tcp;
                pose.rotation = turn * pose.rotation;
            });
        }
        Ok(shown)
    }

    fn surface_beside(
        &mut self,
        pair: &[Sighting; 2],
        expected: &MeasuredHeight,
    ) -> crate::Result<Option<MeasuredHeight>> {
        let surface = self.known.surface_beside(pair, expected)?;
        Ok(surface.filter(|_| self.sees_surface))
    }
}

/// Heights of marks and grasp above the surface under the part, m.
const HEIGHTS_M: [f64; 2] = [0.016, 0.009];

fn tcp_from_camera() -> Isometry3<f64> {
    Isometry3::translation(0.072, 0.0, -0.0534)
}

fn camera() -> CameraPose {
    CameraPose::OnFlange(ArmGeometry::panda().flange_from_tcp() * tcp_from_camera())
}

fn config(told: Option<GivenHeight>) -> GraspConfig {
    let height = HeightMeasurement { told, ..HeightMeasurement::new(HEIGHTS_M[0], HEIGHTS_M[1]) };
    GraspConfig { height: Some(height), ..GraspConfig::default() }
}

/// A part on an object `higher_m` above the table.
fn part(higher_m: f64) -> GraspTarget {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let base_from_tcp = Isometry3::from_parts(Vector3::new(0.5, 0.05, higher_m + HEIGHTS_M[1]).into(), down);
    GraspTarget { base_from_tcp, jaw_width_m: 0.02, score: 0.9 }
}

/// Grasps a part that lies 20 mm higher than the table and is detected 5 mm too high; returns also the camera's
/// positions for the height, and their number.
fn grasped(config: &GraspConfig, shows: &[bool], sees_surface: bool) -> (GraspReport, Vec<Vector3<f64>>, usize) {
    grasped_turned(config, shows, sees_surface, 0.0)
}

fn grasped_turned(
    config: &GraspConfig,
    shows: &[bool],
    sees_surface: bool,
    turned_rad: f64,
) -> (GraspReport, Vec<Vector3<f64>>, usize) {
    let mut arm = PlannedArm::new(ArmGeometry::panda(), ready_pose(), 0.08);
    let mut robot = Robot::new(&mut arm, SafetyLimits::default(), Watch::default());
    let known = KnownTarget::new(Some(part(0.020)), camera(), config);
    let mut finder = Shown { known, seen: part(0.025), shows: shows.to_vec(), num_sights: 0, sees_surface, turned_rad };
    let report = grasp(&mut robot, &mut finder, &mut (), camera(), config).unwrap();
    let num_sights = finder.num_sights;
    let places = arm.actions().iter().filter_map(|action| match action {
        PlannedAction::Motion(motion) => {
            Some((ArmGeometry::panda().forward(motion.end()) * tcp_from_camera()).translation.vector)
        }
        _ => None,
    });
    // The pictures from the look-out pose and from above come first.
    let places: Vec<Vector3<f64>> = places.skip(2).take(num_sights).collect();
    (report, places, num_sights)
}

#[test]
fn two_pictures_below_300_mm_give_the_height() {
    let (report, places, num_sights) = grasped(&config(None), &[], true);
    assert_eq!((&report.outcome, num_sights), (&GraspOutcome::Held, 2));
    let height = report.height.unwrap();
    assert!((height.settled.unwrap().height_m - 0.036).abs() < 1e-6, "{height:?}");
    assert_eq!(height.settled.unwrap().source, HeightSource::Measured);
    assert!(places.iter().all(|place| place.z <= 0.30 + 1e-4), "{places:?}");
    assert!((places[0] - places[1]).xy().norm() >= 0.080, "{places:?}");
    let target = report.targets.last().unwrap().unwrap().base_from_tcp.translation;
    assert!((target.vector - part(0.020).base_from_tcp.translation.vector).norm() < 1e-6, "{target}");
}

#[test]
fn a_picture_of_an_equivalent_orientation_does_not_turn_the_grasp() {
    for turned_rad in [std::f64::consts::PI, std::f64::consts::FRAC_PI_2] {
        let (report, ..) = grasped_turned(&config(None), &[], true, turned_rad);
        assert_eq!(report.outcome, GraspOutcome::Held);
        let target = report.targets.last().unwrap().unwrap().base_from_tcp;
        assert!(target.rotation.angle_to(&part(0.020).base_from_tcp.rotation) < 1e-6, "{target}");
    }
}

#[test]
fn where_nothing_is_seen_of_the_surface_the_other_direction_is_tried() {
    let (report, places, num_sights) = grasped(&config(None), &[], false);
    assert_eq!((&report.outcome, num_sights, places.len()), (&GraspOutcome::Held, 4, 4));
    let measured = report.height.unwrap().measured.unwrap();
    // The height is that of the part itself, with the uncertainty of its relief.
    assert!((measured.height_m - 0.036).abs() < 1e-6 && measured.sigma_m > 2e-3, "{measured:?}");
}

#[test]
fn a_picture_that_does_not_show_the_part_is_the_reason() {
    let (report, _, num_sights) = grasped(&config(None), &[true, false], true);
    let GraspOutcome::Failed { step: GraspStep::Detect, why } = report.outcome else { panic!("{report:?}") };
    assert!(why.ends_with("none was given: the second picture does not show the part"), "{why}");
    assert_eq!(num_sights, 5);
    let (report, ..) = grasped(&config(None), &[false], true);
    let GraspOutcome::Failed { why, .. } = report.outcome else { panic!("{report:?}") };
    assert!(why.ends_with("the first picture does not show the part"), "{why}");
    // A third picture, less far to the side, can replace the first or second; so can a fourth along the marked line.
    for shows in [&[true, false, true][..], &[false, true, true], &[true, false, false, true]] {
        let (report, places, num_sights) = grasped(&config(None), shows, true);
        assert_eq!((report.outcome, num_sights), (GraspOutcome::Held, shows.len()));
        let [.., last] = &places[..] else { panic!("{places:?}") };
        let first = places[usize::from(!shows[0])];
        assert!((first - last).xy().norm() >= 0.080, "{places:?}");
    }
}

#[test]
fn a_told_height_is_used_where_there_is_no_other_and_refused_where_it_contradicts() {
    let told = |height_m: f64| Some(GivenHeight { height_m, sigma_m: 0.001 });
    let (report, ..) = grasped(&config(told(0.030)), &[false], true);
    assert_eq!(report.outcome, GraspOutcome::Held);
    let settled = report.height.unwrap().settled.unwrap();
    assert_eq!((settled.source, settled.height_m), (HeightSource::Told, 0.030));
    let z_m = report.targets.last().unwrap().unwrap().base_from_tcp.translation.z;
    assert!((z_m - 0.023).abs() < 1e-9, "{z_m}");

    let (report, ..) = grasped(&config(told(0.030)), &[], true);
    let GraspOutcome::Failed { step: GraspStep::Detect, why } = report.outcome else { panic!("{report:?}") };
    assert!(why.starts_with("expected marks at the given height of 30.0 ± 1.0 mm, measured 36.0"), "{why}");
    let (report, ..) = grasped(&config(told(0.0355)), &[], true);
    assert_eq!(report.height.unwrap().settled.unwrap().source, HeightSource::Measured);
}

/// The outcome for a part that has these widths at the height that its detections assume and at the measured one, and
/// the number of motions.
fn grasped_of_width(assumed_m: f64, measured_m: f64) -> (GraspOutcome, usize) {
    let config = config(None);
    let mut arm = PlannedArm::new(ArmGeometry::panda(), ready_pose(), 0.08);
    let mut robot = Robot::new(&mut arm, SafetyLimits::default(), Watch::default());
    let of_width = |higher_m: f64, jaw_width_m: f64| GraspTarget { jaw_width_m, ..part(higher_m) };
    let known = KnownTarget::new(Some(of_width(0.020, measured_m)), camera(), &config);
    let seen = of_width(0.025, assumed_m);
    let mut finder = Shown { known, seen, shows: Vec::new(), num_sights: 0, sees_surface: true, turned_rad: 0.0 };
    let outcome = grasp(&mut robot, &mut finder, &mut (), camera(), &config).unwrap().outcome;
    (outcome, arm.actions().iter().filter(is_motion).count())
}

fn is_motion(action: &&PlannedAction) -> bool {
    matches!(action, PlannedAction::Motion(_))
}

#[test]
fn the_width_at_the_measured_height_decides() {
    let (outcome, num_motions) = grasped_of_width(0.079, 0.082);
    let GraspOutcome::Failed { step: GraspStep::Detect, why } = outcome else { panic!("{outcome:?}") };
    assert_eq!(why, "the part is 82 mm wide, the hand opens 80 mm");
    // The motions to the look-out pose, to above the part and to both sides of it, but none down to it.
    assert_eq!(num_motions, 4);
    assert_eq!(grasped_of_width(0.082, 0.079).0, GraspOutcome::Held);
}

/// Finds the part; the picture from above it is a minute old.
struct Late {
    num_pictures: usize,
}

impl PartFinder<PlannedArm> for Late {
    fn find(&mut self, _arm: &mut PlannedArm) -> crate::Result<Option<GraspTarget>> {
        self.num_pictures += 1;
        Ok(Some(part(0.020)))
    }

    fn picture_time(&self) -> Option<Instant> {
        if self.num_pictures < 2 { None } else { Instant::now().checked_sub(Duration::from_secs(60)) }
    }
}

#[test]
fn an_old_picture_starts_no_motion_to_any_position_beside_the_part() {
    let mut arm = PlannedArm::new(ArmGeometry::panda(), ready_pose(), 0.08);
    let mut robot = Robot::new(&mut arm, SafetyLimits::default(), Watch::default());
    let report = grasp(&mut robot, &mut Late { num_pictures: 0 }, &mut (), camera(), &config(None)).unwrap();
    let GraspOutcome::Failed { step: GraspStep::Detect, why } = report.outcome else { panic!("{report:?}") };
    assert!(why.contains("the detection is "), "{why}");
    // Only the motions to the look-out pose and to above the part.
    assert_eq!(arm.actions().iter().filter(is_motion).count(), 2);
}

#[test]
fn parts_near_the_camera_are_told() {
    let high = HeightMeasurement::new(0.14, 0.009);
    let (report, ..) = grasped(&GraspConfig { height: Some(high), ..GraspConfig::default() }, &[], true);
    let GraspOutcome::Failed { why, .. } = report.outcome else { panic!("{report:?}") };
    assert!(why.ends_with("from 300 mm above the table the part is 135 mm away, expected at least 180 mm"), "{why}");
}

#[test]
fn a_camera_beside_the_robot_measures_nothing() {
    let mut arm = PlannedArm::new(ArmGeometry::panda(), ready_pose(), 0.08);
    let mut robot = Robot::new(&mut arm, SafetyLimits::default(), Watch::default());
    let look_outs = vec![crate::LookOut::Joints(ready_pose())];
    let config = GraspConfig { look_outs, ..config(None) };
    let mut known = KnownTarget::new(Some(part(0.020)), CameraPose::InBase(Isometry3::identity()), &config);
    let report = grasp(&mut robot, &mut known, &mut (), CameraPose::InBase(Isometry3::identity()), &config).unwrap();
    assert_eq!((report.outcome, report.height), (GraspOutcome::Held, None));
}

/// Shows parts beside each other. The lines of sight to the first one, which is detected, pass each other 1 mm apart;
/// those to the others cross exactly.
struct Beside {
    parts: Vec<KnownTarget>,
    is_first_shown: bool,
    shift_m: f64,
}

impl Beside {
    /// The detected part, and another one beside it along the marked line.
    fn new(beside_m: f64, score: f64, config: &GraspConfig) -> Self {
        let other = GraspTarget { score, ..at_beside(beside_m) };
        let parts = [part(0.020), other].map(|part| KnownTarget::new(Some(part), camera(), config));
        Self { parts: parts.to_vec(), is_first_shown: true, shift_m: 0.0005 }
    }
}

/// A part that lies beside the detected one, along the marked line.
fn at_beside(beside_m: f64) -> GraspTarget {
    let mut other = part(0.020);
    other.base_from_tcp.translation.x += beside_m;
    other
}

impl PartFinder<PlannedArm> for Beside {
    fn find(&mut self, _arm: &mut PlannedArm) -> crate::Result<Option<GraspTarget>> {
        Ok(Some(part(0.020)))
    }

    fn sight(&mut self, arm: &mut PlannedArm, expected: &GraspTarget) -> crate::Result<Vec<Sighting>> {
        self.shift_m = -self.shift_m;
        let mut shown = Vec::new();
        for (index, known) in self.parts.iter_mut().enumerate().skip(usize::from(!self.is_first_shown)) {
            for mut sighting in known.sight(arm, expected)? {
                sighting.middle_m.x += if index == 0 { self.shift_m } else { 0.0 };
                shown.push(sighting);
            }
        }
        Ok(shown)
    }
}

#[test]
fn of_two_parts_beside_each_other_the_detected_one_is_the_target() {
    // A part 25 mm away may be the target if no other one is shown, and one 35 mm away may not.
    for (beside_m, score) in [(0.025, 0.9), (0.025, 0.3), (0.035, 0.9), (0.035, 0.3)] {
        let config = config(None);
        let mut arm = PlannedArm::new(ArmGeometry::panda(), ready_pose(), 0.08);
        let mut robot = Robot::new(&mut arm, SafetyLimits::default(), Watch::default());
        let mut finder = Beside::new(beside_m, score, &config);
        let report = grasp(&mut robot, &mut finder, &mut (), camera(), &config).unwrap();
        assert_eq!(report.outcome, GraspOutcome::Held);
        let target = report.targets.last().unwrap().unwrap();
        assert!(beside_m_of(&target) < 1e-3, "{beside_m} m, {score}: {target:?}");
    }
}

fn beside_m_of(target: &GraspTarget) -> f64 {
    beside_m(target, &part(0.020))
}

/// The target, or the reason why there is none, if only the other part is shown; with the parts not to be touched.
fn measured_beside(beside_m: f64, score: f64, told: Option<GivenHeight>) -> (Result<GraspTarget, String>, LyingParts) {
    let config = config(told);
    let mut arm = PlannedArm::new(ArmGeometry::panda(), ready_pose(), 0.08);
    let mut robot = Robot::new(&mut arm, SafetyLimits::default(), Watch::default());
    let mut finder = Beside { is_first_shown: false, ..Beside::new(beside_m, score, &config) };
    let mut observer = ();
    let mut sequence = Sequence::new(&mut robot, &mut finder, &mut observer, camera(), &config);
    let target = sequence.measure_height(&part(0.020)).map_err(|stop| match stop {
        Stop::Failed(_, why) => why,
        Stop::Error(error) => error.to_string(),
    });
    (target, sequence.known.lying.clone())
}

#[test]
fn another_part_is_the_target_only_if_it_is_sure_and_near() {
    let (target, lying) = measured_beside(0.025, 0.9, None);
    assert!((beside_m_of(&target.unwrap()) - 0.025).abs() < 1e-3);
    // The detected part must not be touched.
    assert_eq!(lying.all().iter().map(|part| part.base_from_part).collect::<Vec<_>>(), [part(0.020).base_from_tcp]);
    for (beside_m, score, found) in [(0.025, 0.3, "25 mm beside it with a score of 0.30"), (0.035, 0.9, "35 mm")] {
        let (target, lying) = measured_beside(beside_m, score, None);
        let why = target.unwrap_err();
        assert!(why.contains("where it was detected, found an object") && why.contains(found), "{why}");
        assert!(lying.all().is_empty());
        // With a given height, the target is where the part was detected.
        let told = GivenHeight { height_m: 0.036, sigma_m: 0.001 };
        let target = measured_beside(beside_m, score, Some(told)).0.unwrap();
        assert!(beside_m_of(&target) < 1e-9, "{target:?}");
    }
}
