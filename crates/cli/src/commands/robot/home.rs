//! `sdg robot home`.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::Args;
use sdg_kinematics::collision::Capsule;
use sdg_kinematics::{Trajectory, ready_pose};
use sdg_robot::workcell::Workcell;
use sdg_robot::{
    Arm, ContactSensitivity, DEFAULT_SPEED, Destination, FREE_CLEARANCE_M, FrankaArm, Load, Pace, Robot, RobotError,
    SafetyLimits, Surroundings,
};

use super::arm_args::ArmArgs;
use super::hand::move_fingers;
use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::robots::{self, Consent, check_states, confirm, write_states};

/// Length of the straight motion up with which an arm that is lower than the limits allow begins, m.
const ASCENT_M: f64 = 0.030;

/// `sdg robot home`
#[derive(Debug, Args)]
pub struct HomeArgs {
    #[command(flatten)]
    arm: ArmArgs,
    /// Home the fingers: move them through their range, once after the hand was switched on; the arm does not move
    #[arg(long)]
    hand: bool,
    /// Do not ask for confirmation; for programs
    #[arg(long)]
    yes: bool,
    /// Fraction of the joints' velocity limits, above 0 and at most 0.6
    #[arg(long, value_name = "SHARE", default_value_t = DEFAULT_SPEED)]
    speed: f64,
    /// Drive an arm on the network from a thread without real-time priority; for simulated arms
    #[arg(long)]
    no_realtime: bool,
    /// File for the arm's last second of states after an error, as CSV
    #[arg(long, value_name = "FILE", default_value = "robot-states.csv")]
    states: PathBuf,
}

pub(super) fn run(args: &HomeArgs) -> Result<Outcome> {
    if args.hand {
        check_states(&args.states)?;
        let (mut arm, address) = args.arm.connect()?;
        if confirm(&format!("Move the fingers of the hand at {address}?"), args.yes)? == Consent::Given {
            move_fingers(&args.states, |watch| arm.home_hand(watch))?;
            // The hand no longer holds an object.
            arm.set_load(Load::NONE)?;
        }
        return Ok(Outcome::Done);
    }
    let Some(path) = &args.arm.workcell else {
        return Err(Usage("expected --workcell FILE, which states where the arm may be".to_owned()).into());
    };
    let pace = robots::pace(args.speed)?;
    let (workcell, _) = sdg_inputs::read_workcell(path)?;
    check_states(&args.states)?;
    let address = args.arm.address()?;
    let mut arm = FrankaArm::connect(&address, robots::scheduling(args.no_realtime))?;
    arm.check_model(workcell.robot)?;
    let interrupt = Interrupt::watch();
    let mut robot = Robot::new(&mut arm, workcell.safety_limits(), robots::watch(&interrupt));
    let is_holding = robot.hand()?.is_grasping;
    if let Some(ascent) = plan_ascent(&mut robot, &workcell, &pace, is_holding)? {
        let (secs, up_mm) = (ascent.duration_secs(), ASCENT_M * 1e3);
        let question = format!(
            "The arm at {address} is lower than the limits allow: first move it {up_mm:.0} mm straight up, in {secs:.1} s?"
        );
        if confirm(&question, args.yes)? == Consent::Refused {
            return Ok(Outcome::Done);
        }
        eprintln!("moving straight up, {secs:.1} s; Ctrl-C stops the arm");
        move_along(&mut robot, load(&workcell, is_holding), vec![ascent], &args.states)?;
    }
    let is_holding = robot.hand()?.is_grasping;
    let motions = plan(&mut robot, &workcell, &pace, is_holding)?;
    if motions.iter().all(|motion| motion.duration_secs() <= 0.0) {
        println!("the arm at {address} is at home");
        return Ok(Outcome::Done);
    }
    let secs: f64 = motions.iter().map(Trajectory::duration_secs).sum();
    if confirm(&format!("Move the arm at {address} home, in {secs:.1} s?"), args.yes)? == Consent::Refused {
        return Ok(Outcome::Done);
    }
    eprintln!("moving home, {secs:.1} s; Ctrl-C stops the arm");
    move_along(&mut robot, load(&workcell, is_holding), motions, &args.states)?;
    Ok(Outcome::Done)
}

/// Follows motions, and writes the arm's last second of states after an error.
fn move_along<A: Arm>(
    robot: &mut Robot<'_, A>,
    load: Option<Load>,
    motions: Vec<Trajectory>,
    states: &Path,
) -> Result<()> {
    let moved = follow(robot, load, motions);
    if moved.is_err() {
        write_states(states, robot.watch());
    }
    Ok(moved?)
}

/// The load of the hand; `None` if the hand holds a part of unknown mass.
fn load(workcell: &Workcell, is_holding: bool) -> Option<Load> {
    if is_holding { workcell.grasp_config().load } else { Some(Load::NONE) }
}

/// A ball that contains the held part, whose pose in the hand is not known.
fn part(workcell: &Workcell, is_holding: bool) -> Vec<Capsule> {
    if is_holding { vec![Capsule::new([0.0; 3], [0.0; 3], workcell.part_radius_m)] } else { Vec::new() }
}

fn surroundings<'s>(workcell: &'s Workcell, part: &'s [Capsule]) -> Surroundings<'s> {
    Surroundings {
        obstacles: &workcell.obstacles,
        held: part,
        may_start_near: true,
        table_clearance_m: FREE_CLEARANCE_M,
        ..Surroundings::default()
    }
}

/// The motion up of an arm that is lower than the limits allow, checked before the question is asked.
fn plan_ascent<A: Arm>(
    robot: &mut Robot<'_, A>,
    workcell: &Workcell,
    pace: &Pace,
    is_holding: bool,
) -> sdg_robot::Result<Option<Trajectory>> {
    let (part, limits) = (part(workcell, is_holding), pace.approach_limits(robot.geometry()));
    robot.plan_ascent(&surroundings(workcell, &part), ASCENT_M, &limits)
}

/// The motions home, which are checked before the question is asked. The torques are computed with the load of a held
/// part.
fn plan<A: Arm>(
    robot: &mut Robot<'_, A>,
    workcell: &Workcell,
    pace: &Pace,
    is_holding: bool,
) -> Result<Vec<Trajectory>> {
    let home = workcell.home().unwrap_or_else(ready_pose);
    if let Some(load) = load(workcell, is_holding) {
        robot.plan_with_load(load);
    }
    let joints = match is_holding {
        true => pace.carry_limits(robot.geometry()),
        false => pace.free_limits(robot.geometry()),
    };
    if workcell.obstacles.is_empty() {
        let motion = robot.plan_free(&home, &joints)?;
        robot.limits().check(motion.clone()).map_err(RobotError::from)?;
        check_height(&motion, robot.limits(), if is_holding { workcell.part_radius_m } else { 0.0 })?;
        return Ok(vec![motion]);
    }
    let part = part(workcell, is_holding);
    Ok(robot.plan_around(&surroundings(workcell, &part), &Destination::Configuration(&home), &joints)?.motions)
}

/// Fails if a motion from above the minimum height of free motions passes below it. From a lower start, for example
/// after a stop near the table, only the limits apply, because the arm must be able to leave it. A held part extends
/// `held_m` below the fingers.
fn check_height(motion: &Trajectory, limits: &SafetyLimits, held_m: f64) -> Result<()> {
    let (arm, table_height_m) = (&limits.geometry, limits.table_height_m);
    let [start_m, end_m] = [motion.start(), motion.end()].map(|q| arm.clearance(q, table_height_m).lowest_m);
    let (lowest_m, free_m) = (motion.clearance(arm, table_height_m).lowest_m, FREE_CLEARANCE_M + held_m);
    // The path may be lower only if its destination is.
    let min_m = free_m.min(end_m - 1e-3);
    if start_m >= free_m && lowest_m < min_m {
        let [lowest_mm, min_mm] = [lowest_m, min_m].map(|height_m| height_m * 1e3);
        bail!("the path home passes {lowest_mm:.0} mm above the table, expected at least {min_mm:.0} mm");
    }
    Ok(())
}

fn follow<A: Arm>(robot: &mut Robot<'_, A>, load: Option<Load>, motions: Vec<Trajectory>) -> sdg_robot::Result<()> {
    // An earlier program may have ended before it reset the load.
    load.map_or(Ok(()), |load| robot.set_load(load))?;
    // After a stop during a descent, the controller has the higher thresholds of contacts.
    robot.set_contact_sensitivity(ContactSensitivity::Free)?;
    motions.into_iter().try_for_each(|motion| robot.follow(motion))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
    use sdg_kinematics::collision::{Obstacle, Shape};
    use sdg_kinematics::{ArmGeometry, IkOptions, JointLimits, JointVector};
    use sdg_robot::{
        ArmState, CheckedMotion, HandCommand, HandState, LookOut, MotionEnd, PlannedAction, PlannedArm, StopReason,
        Watch,
    };

    use super::*;

    /// A planned arm after a stop during a descent.
    struct Stopped {
        arm: PlannedArm,
        sensitivity: ContactSensitivity,
        load_kg: Option<f64>,
        /// Whether a person stops the arm at the start of a motion.
        is_interrupted: bool,
    }

    impl Arm for Stopped {
        fn geometry(&self) -> &ArmGeometry {
            self.arm.geometry()
        }
        fn state(&mut self) -> sdg_robot::Result<ArmState> {
            self.arm.state()
        }
        fn follow(&mut self, motion: &CheckedMotion, watch: &mut Watch) -> sdg_robot::Result<MotionEnd> {
            assert_eq!(self.sensitivity, ContactSensitivity::Free);
            if self.is_interrupted {
                watch.observe(&self.arm.state()?);
                return Err(RobotError::Stopped(StopReason::Interrupted));
            }
            self.arm.follow(motion, watch)
        }
        fn wait(&mut self, duration_secs: f64, watch: &mut Watch) -> sdg_robot::Result<()> {
            self.arm.wait(duration_secs, watch)
        }
        fn hand(&mut self) -> sdg_robot::Result<HandState> {
            self.arm.hand()
        }
        fn start_hand(&mut self, command: HandCommand) -> sdg_robot::Result<()> {
            self.arm.start_hand(command)
        }
        fn finish_hand(&mut self, watch: &mut Watch) -> sdg_robot::Result<HandState> {
            self.arm.finish_hand(watch)
        }
        fn set_contact_sensitivity(&mut self, sensitivity: ContactSensitivity) -> sdg_robot::Result<()> {
            self.sensitivity = sensitivity;
            Ok(())
        }
        fn set_load(&mut self, load: Load) -> sdg_robot::Result<()> {
            self.load_kg = Some(load.mass_kg);
            self.arm.set_load(load)
        }
        fn stop(&mut self) -> sdg_robot::Result<()> {
            self.arm.stop()
        }
        fn recover(&mut self) -> sdg_robot::Result<()> {
            self.arm.recover()
        }
    }

    /// The shipped workcell with a home that has joint 1 at 0.5 rad.
    fn workcell() -> Workcell {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/workcell/workcell.toml");
        let mut home = ready_pose();
        home[0] = 0.5;
        let (workcell, _) = sdg_inputs::read_workcell(&path).unwrap();
        Workcell { look_outs: vec![LookOut::Joints(home)], ..workcell }
    }

    /// The arm at a position.
    fn stopped_at(q: &JointVector, is_grasping: bool) -> Stopped {
        let hand = HandState { opening_m: 0.02, is_grasping, force_n: None };
        let arm = PlannedArm::new(ArmGeometry::panda(), *q, hand.opening_m).with_hand(hand);
        Stopped { arm, sensitivity: ContactSensitivity::Contact, load_kg: None, is_interrupted: false }
    }

    /// Moves home; returns the arm.
    fn go_home_from(q: &JointVector, workcell: &Workcell, is_grasping: bool) -> Result<Stopped> {
        let mut arm = stopped_at(q, is_grasping);
        let mut robot = Robot::new(&mut arm, workcell.safety_limits(), Watch::default());
        let pace = Pace::at_speed(0.1).unwrap();
        if let Some(ascent) = plan_ascent(&mut robot, workcell, &pace, is_grasping)? {
            follow(&mut robot, load(workcell, is_grasping), vec![ascent])?;
        }
        let load_kg = robot.arm().load_kg;
        let motions = plan(&mut robot, workcell, &pace, is_grasping)?;
        // Nothing changes before a person agrees.
        assert_eq!(robot.arm().load_kg, load_kg);
        follow(&mut robot, load(workcell, is_grasping), motions)?;
        Ok(arm)
    }

    /// Moves home from the ready pose.
    fn go_home(workcell: &Workcell, is_grasping: bool) -> Result<Stopped> {
        go_home_from(&ready_pose(), workcell, is_grasping)
    }

    #[test]
    fn states_that_cannot_be_written_do_not_replace_the_error_of_the_arm() {
        let workcell = workcell();
        let mut arm = Stopped { is_interrupted: true, ..stopped_at(&ready_pose(), false) };
        let mut robot = Robot::new(&mut arm, workcell.safety_limits(), Watch::default());
        let motions = plan(&mut robot, &workcell, &Pace::at_speed(0.1).unwrap(), false).unwrap();
        let states = Path::new("/nowhere/states.csv");
        let error = move_along(&mut robot, Some(Load::NONE), motions, states).unwrap_err();
        assert_eq!(robot.watch().states().len(), 1);
        assert!(matches!(error.downcast_ref(), Some(RobotError::Stopped(StopReason::Interrupted))), "{error:#}");
    }

    #[test]
    fn the_thresholds_are_those_of_free_motions() {
        let arm = go_home(&workcell(), false).unwrap();
        // The motion home alone.
        assert_eq!(arm.arm.actions().len(), 1);
    }

    #[test]
    fn a_hand_below_the_limits_first_moves_straight_up() {
        let workcell = workcell();
        let limits = workcell.safety_limits();
        let lowest_m = limits.table_height_m + limits.fingertip_beyond_tcp_m + limits.min_table_clearance_m;
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let panda = ArmGeometry::panda();
        let from = |below_m: f64, workcell: &Workcell| {
            let base_from_tcp = Isometry3::from_parts(Translation3::new(0.45, 0.10, lowest_m - below_m), down);
            let q = panda.inverse(&base_from_tcp, &ready_pose(), &IkOptions::default()).unwrap().q;
            go_home_from(&q, workcell, false)
        };
        let arm = from(0.005, &workcell).unwrap().arm;
        let [PlannedAction::Motion(ascent), PlannedAction::Motion(home)] = arm.actions() else {
            panic!("{:?}", arm.actions())
        };
        let [start, end] = [ascent.start(), ascent.end()].map(|q| panda.forward(q).translation.vector);
        assert!((end - start - Vector3::z() * ASCENT_M).norm() < 1e-4, "{start} {end}");
        assert!((home.end() - workcell.home().unwrap()).amax() < 1e-9);
        let error = from(0.015, &workcell).err().unwrap().to_string();
        assert!(error.starts_with("the motion was not started: "), "{error}");
        // The top of the hand's body is 111 mm above the tcp, and the hand is 204 mm wide along y.
        let with_lamp = |above_m: f64| {
            let at = Translation3::new(0.45, 0.185, lowest_m - 0.005 + 0.111 + above_m + 0.01);
            let (name, shape) = ("lamp".to_owned(), Shape::Box { half_m: [0.02, 0.01, 0.01] });
            Workcell { obstacles: vec![Obstacle { name, shape, base_from_obstacle: at.into() }], ..workcell.clone() }
        };
        let error = from(0.005, &with_lamp(0.015)).err().unwrap().to_string();
        assert!(error.contains("of the straight path up can be followed: ") && error.contains("lamp"), "{error}");
        // The lamp touches the hand from below, 29 mm above the tcp, and the motion leads away from it.
        let arm = from(0.005, &with_lamp(0.029 - 0.111 - 0.019)).unwrap().arm;
        assert!(arm.actions().len() >= 2, "{:?}", arm.actions());
    }

    #[test]
    fn the_load_is_that_of_a_held_part() {
        let workcell = Workcell { part_mass_kg: Some(3.0), ..workcell() };
        assert_eq!(go_home(&workcell, true).unwrap().load_kg, Some(3.0));
        // A load that an earlier program left is reset.
        assert_eq!(go_home(&workcell, false).unwrap().load_kg, Some(0.0));
        let unknown = Workcell { part_mass_kg: None, ..workcell };
        assert_eq!(go_home(&unknown, true).unwrap().load_kg, None);
    }

    #[test]
    fn a_held_part_keeps_away_from_obstacles() {
        // At the start the shelf is 40 mm below the tcp. The direct way turns joint 1 by 0.5 rad, and its middle passes
        // 50 mm above the post. The part's radius is 60 mm.
        const SHELF_M: f64 = 0.040;
        const POST_M: f64 = 0.050;
        let panda = ArmGeometry::panda();
        let tcp = panda.forward(&ready_pose()).translation.vector;
        let below = |name: &str, angle_rad: f64, below_m: f64| {
            let at = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle_rad) * tcp;
            Obstacle {
                name: name.to_owned(),
                shape: Shape::Box { half_m: [0.02; 3] },
                base_from_obstacle: Isometry3::translation(at.x, at.y, at.z - below_m - 0.02),
            }
        };
        let obstacles = vec![below("shelf", 0.0, SHELF_M), below("post", 0.25, POST_M)];
        let workcell = Workcell { obstacles, ..workcell() };
        // The smallest distances of the tcp from shelf and post.
        let nearest_m = |is_grasping: bool| {
            let arm = go_home(&workcell, is_grasping).unwrap().arm;
            let mut nearest_m = [f64::INFINITY; 2];
            for action in arm.actions() {
                let PlannedAction::Motion(motion) = action else { panic!("{action:?}") };
                for step in 0..=500 {
                    let (q, ..) = motion.sample(motion.duration_secs() * f64::from(step) / 500.0);
                    let tcp = Point3::from(panda.forward(&q).translation.vector);
                    for (least_m, obstacle) in nearest_m.iter_mut().zip(&workcell.obstacles) {
                        let p_in_obstacle = obstacle.base_from_obstacle.inverse() * tcp;
                        *least_m = least_m.min(obstacle.shape.signed_distance_m(&p_in_obstacle));
                    }
                }
            }
            nearest_m
        };
        let [_, post_m] = nearest_m(false);
        assert!((post_m - POST_M).abs() < 1e-3, "{post_m}");
        // A part that is near an obstacle can be moved away from it, and is kept away from the others.
        let [shelf_m, post_m] = nearest_m(true);
        assert!(shelf_m > SHELF_M - 0.005 - 1e-6, "{shelf_m}");
        assert!(post_m > workcell.part_radius_m - 1e-6, "{post_m}");
    }

    #[test]
    fn only_a_motion_from_a_high_start_is_refused_near_the_table() {
        // Without a tilt, the hand points down and the tcp is 40 mm above the table.
        let tilted = |by_rad: f64| {
            JointVector::from([0.0, 0.726, 0.0, -1.796, 0.0, 2.522 + by_rad, std::f64::consts::FRAC_PI_4])
        };
        let limits = SafetyLimits::default();
        let motion = |from: &JointVector, to: &JointVector| {
            Trajectory::point_to_point(from, to, &JointLimits::panda().scaled(0.1, 0.1, 0.1).unwrap()).unwrap()
        };
        let error = check_height(&motion(&tilted(-1.45), &tilted(1.15)), &limits, 0.0).unwrap_err().to_string();
        assert!(error.starts_with("the path home passes "), "{error}");
        check_height(&motion(&tilted(0.0), &tilted(1.15)), &limits, 0.0).unwrap();
    }
}
