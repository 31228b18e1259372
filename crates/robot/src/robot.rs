//! An arm with its limits: every motion is planned and checked here.

use sdg_kinematics::dynamics::ArmDynamics;
use sdg_kinematics::{
    ArmGeometry, CartesianLimits, JointLimits, JointPath, JointVector, LineOptions, RoundedPath, Trajectory,
};

use crate::arm::{Arm, CompliantArm};
use crate::arm_state::{ArmMode, ArmState, ContactSensitivity, HandCommand, HandState, Load, MotionEnd};
use crate::error::{Result, RobotError};
use crate::safety::{FeltBelow, LimitsFrom, SafetyLimits, Violation};
use crate::touch::{TouchDown, Touched};
use crate::watch::Watch;

/// Largest distance of a motion's start from the controller's reference, rad; a distance this small is not visible.
const MAX_START_DISTANCE_RAD: f64 = 1e-3;
/// Maximum number of times that a motion is slowed down until joints and tcp keep their limits.
const MAX_SLOWDOWNS: usize = 8;
/// Factor of velocity, acceleration and jerk at each slowdown.
const SLOWDOWN: f64 = 0.8;
/// Largest distance of a hand below the limits from which [`Robot::plan_ascent`] plans, m: by this distance a compliant
/// descent may be lower than the limits.
const MAX_BELOW_M: f64 = 0.010;
/// Fraction of the joints' acceleration limits that straight motions of the tcp use, because the measured acceleration
/// exceeds the commanded one by up to 5 %.
const LINE_ACCELERATION: f64 = 0.9;

/// An arm, the limits of its motions, and whether it may move.
///
/// After an error in motion nothing moves any more, neither arm nor hand, until [`Robot::recover`] is called. A program
/// calls it only at a person's request.
#[derive(Debug)]
pub struct Robot<'a, A: Arm> {
    arm: &'a mut A,
    limits: SafetyLimits,
    watch: Watch,
    latched: Option<String>,
    /// The load of the hand with which motions are planned.
    load: Load,
    /// The last compliant descent, of this program or an earlier one, until the next motion has ended without an error.
    felt_below: Option<FeltBelow>,
}

impl<'a, A: Arm> Robot<'a, A> {
    /// Restricts an arm to motions within limits; `watch` receives every state and may stop the arm.
    pub fn new(arm: &'a mut A, limits: SafetyLimits, watch: Watch) -> Self {
        let watch = watch.of_arm(&arm.geometry().limits);
        Self { arm, limits, watch, latched: None, load: Load::NONE, felt_below: None }
    }

    /// The arm, for taking pictures and for reading its data. It must not be used for motions.
    pub fn arm(&mut self) -> &mut A {
        self.arm
    }

    /// The arm's geometry.
    pub fn geometry(&self) -> &ArmGeometry {
        self.arm.geometry()
    }

    /// The limits against which every motion is checked.
    pub fn limits(&self) -> &SafetyLimits {
        &self.limits
    }

    /// The checks of every state, with the states of the last second.
    pub fn watch(&self) -> &Watch {
        &self.watch
    }

    /// The reason why nothing moves, if there is one.
    pub fn latched(&self) -> Option<&str> {
        self.latched.as_deref()
    }

    /// The present state of the arm.
    ///
    /// # Errors
    /// As for [`Arm::state`].
    pub fn state(&mut self) -> Result<ArmState> {
        let state = self.arm.state();
        self.note_between_motions(state)
    }

    /// The controller's reference, rad: the start of the next motion.
    ///
    /// # Errors
    /// As for [`Arm::state`].
    pub fn commanded(&mut self) -> Result<JointVector> {
        Ok(self.state()?.q_commanded)
    }

    /// The straight motion in joint space to a configuration, as fast as `joints` and the tcp's limits allow.
    ///
    /// # Errors
    /// [`RobotError::Planning`], and the errors of [`Self::commanded`].
    pub fn plan_free(&mut self, q: &JointVector, joints: &JointLimits) -> Result<Trajectory> {
        let start = self.commanded()?;
        self.slowed(|share| {
            let slowed = joints.scaled(share, share, share)?;
            Ok(Trajectory::point_to_point(&start, q, &slowed)?)
        })
    }

    /// The motion along a path with rounded corners, as fast as `joints`, the tcp's limits and the torques allow, with
    /// the hand's load.
    pub(crate) fn plan_through(&self, way: &RoundedPath, joints: &JointLimits) -> Result<Trajectory> {
        // The fingers' opening shifts 0.12 kg by some centimetres, which changes no torque noticeably.
        let Load { mass_kg, center_in_flange_m } = self.load;
        let dynamics = ArmDynamics::new(self.geometry(), self.geometry().hand.opening_max_m)
            .with_load(mass_kg, center_in_flange_m);
        self.slowed(|share| {
            let slowed = joints.scaled(share, share, share)?;
            Ok(Trajectory::along_rounded_path(way.clone(), &slowed, &self.limits.cartesian, &dynamics)?)
        })
    }

    /// A motion along a straight path, as fast as the limits allow.
    ///
    /// # Errors
    /// [`RobotError::Planning`].
    pub fn plan_along(&mut self, path: &JointPath, cartesian: &CartesianLimits) -> Result<Trajectory> {
        let joints = self.limits.joints.clone();
        self.slowed(|share| {
            let joints = joints.scaled(share, share * LINE_ACCELERATION, share)?;
            let cartesian = cartesian.scaled(share, share, share)?;
            Ok(Trajectory::along_path(path.clone(), &joints, &cartesian)?)
        })
    }

    /// As [`Self::plan_ascent`], without a comparison with obstacles.
    pub(crate) fn plan_ascent_within_limits(
        &mut self,
        up_m: f64,
        cartesian: &CartesianLimits,
    ) -> Result<Option<Trajectory>> {
        let start = self.commanded()?;
        let base_from_tcp = self.geometry().forward(&start);
        let tcp = base_from_tcp.translation.vector;
        if !self.limits.is_below(&start, tcp.z) {
            return Ok(None);
        }
        self.felt_below = Some(FeltBelow::new(&tcp, tcp.z, MAX_BELOW_M));
        let mut above = base_from_tcp;
        above.translation.z += up_m;
        let path = self.geometry().straight_path(&start, &above, &LineOptions::default())?;
        self.plan_safely_along(&path, cartesian).map(Some)
    }

    /// As [`Self::plan_along`], for a motion that satisfies all limits.
    ///
    /// # Errors
    /// In addition [`RobotError::Unsafe`].
    pub(crate) fn plan_safely_along(&mut self, path: &JointPath, cartesian: &CartesianLimits) -> Result<Trajectory> {
        let motion = self.plan_along(path, cartesian)?;
        self.limits_from(motion.start()).check(motion.clone())?;
        Ok(motion)
    }

    /// Plans with decreasing speeds and returns the first motion within the speed limits; if there is none, the
    /// slowest.
    ///
    /// This is necessary because a straight motion in joint space is planned without the tcp's limits, and because
    /// between the samples of a timed path a joint may slightly exceed its limit.
    fn slowed(&self, plan: impl Fn(f64) -> Result<Trajectory>) -> Result<Trajectory> {
        let mut share = 1.0;
        for _ in 0..MAX_SLOWDOWNS {
            let trajectory = plan(share)?;
            match self.limits_from(trajectory.start()).check(trajectory.clone()) {
                Err(Violation::Cartesian { .. }) => share *= SLOWDOWN,
                Err(Violation::Joint { quantity, .. }) if quantity != "position" => share *= SLOWDOWN,
                _ => return Ok(trajectory),
            }
        }
        plan(share)
    }

    /// The limits of a motion from a configuration: a hand that descended to a contact below the limits may move
    /// straight up.
    pub(crate) fn limits_from(&self, start: &JointVector) -> LimitsFrom<'_> {
        self.limits.starting_at(start, self.felt_below.as_ref())
    }

    /// Checks a motion and follows it to its end.
    ///
    /// # Errors
    /// Before anything moves: [`RobotError::Latched`] or [`RobotError::Stopped`] if the arm may not move now,
    /// [`RobotError::Unsafe`], and as for [`Arm::state`]. Later: the error that ended the motion, after which nothing
    /// moves.
    pub fn follow(&mut self, trajectory: Trajectory) -> Result<()> {
        let state = self.ready()?;
        Violation::check_start(trajectory.start(), &state.q_commanded, MAX_START_DISTANCE_RAD)?;
        let motion = self.limits_from(trajectory.start()).check(trajectory)?;
        self.watch.begin();
        let ended = match self.arm.follow(&motion, &mut self.watch) {
            Ok(MotionEnd::Arrived) => Ok(()),
            Ok(MotionEnd::Blocked(by)) => Err(RobotError::Blocked(by)),
            Err(error) => Err(error),
        };
        if ended.is_ok() {
            // The hand has left the contact: the limits apply again.
            self.felt_below = None;
        }
        self.note(ended)
    }

    /// Stands still for `duration_secs`.
    ///
    /// # Errors
    /// As for [`Arm::wait`].
    pub fn wait(&mut self, duration_secs: f64) -> Result<()> {
        self.watch.begin();
        let waited = self.arm.wait(duration_secs, &mut self.watch);
        self.note(waited)
    }

    /// Starts a motion of the hand.
    ///
    /// # Errors
    /// [`RobotError::Latched`] or [`RobotError::Stopped`] if the arm may not move now; the errors of
    /// [`Arm::start_hand`].
    pub fn start_hand(&mut self, command: HandCommand) -> Result<()> {
        self.ready()?;
        let started = self.arm.start_hand(command);
        self.note_between_motions(started)
    }

    /// Waits for the hand.
    ///
    /// # Errors
    /// As for [`Arm::finish_hand`].
    pub fn finish_hand(&mut self) -> Result<HandState> {
        self.watch.begin();
        let finished = self.arm.finish_hand(&mut self.watch);
        self.note(finished)
    }

    /// The present state of the hand.
    ///
    /// # Errors
    /// As for [`Arm::hand`].
    pub fn hand(&mut self) -> Result<HandState> {
        let hand = self.arm.hand();
        self.note_between_motions(hand)
    }

    /// As [`Arm::set_contact_sensitivity`].
    ///
    /// # Errors
    /// Errors reported by the arm.
    pub fn set_contact_sensitivity(&mut self, sensitivity: ContactSensitivity) -> Result<()> {
        let set = self.arm.set_contact_sensitivity(sensitivity);
        self.note_between_motions(set)
    }

    /// As [`Arm::set_load`].
    ///
    /// # Errors
    /// Errors reported by the arm.
    pub fn set_load(&mut self, load: Load) -> Result<()> {
        let set = self.arm.set_load(load);
        self.note_between_motions(set)?;
        self.load = load;
        Ok(())
    }

    /// Plans further motions with this load of the hand, which the arm does not get yet: see [`Self::set_load`].
    pub fn plan_with_load(&mut self, load: Load) {
        self.load = load;
    }

    /// Recovers the arm and allows motions again, after a person has checked it.
    ///
    /// # Errors
    /// The error, if it persists; nothing moves then.
    pub fn recover(&mut self) -> Result<()> {
        self.arm.recover()?;
        self.latched = None;
        Ok(())
    }

    /// The state, if the arm may move now.
    pub(crate) fn ready(&mut self) -> Result<ArmState> {
        if let Some(why) = &self.latched {
            return Err(RobotError::Latched(why.clone()));
        }
        if let Some(reason) = self.watch.is_stop_requested() {
            return self.note_between_motions(Err(RobotError::Stopped(reason)));
        }
        let state = self.state()?;
        match state.mode {
            ArmMode::Idle | ArmMode::Moving => Ok(state),
            mode => Err(self.with_hand_stopped(RobotError::in_mode(mode))),
        }
    }

    /// As [`Self::note`], for an error while the arm is at rest. The arm's own motions stop the fingers after an error;
    /// here fingers that were started before may still move.
    fn note_between_motions<T>(&mut self, result: Result<T>) -> Result<T> {
        let result = match result {
            Err(error) if error.latches() && self.latched.is_none() => Err(self.with_hand_stopped(error)),
            result => result,
        };
        self.note(result)
    }

    /// Stops moving fingers after an error; the error says if that fails.
    fn with_hand_stopped(&mut self, error: RobotError) -> RobotError {
        match (error, self.arm.stop()) {
            // A lost arm cannot be stopped; its own control does that.
            (error @ RobotError::Lost { .. }, _) | (error, Ok(())) => error,
            (error, Err(not_stopped)) => RobotError::Device(format!("{error}; {not_stopped}").into()),
        }
    }

    /// Stores an error after which nothing moves.
    fn note<T>(&mut self, result: Result<T>) -> Result<T> {
        if let Err(error) = &result
            && error.latches()
            && self.latched.is_none()
        {
            self.latched = Some(error.to_string());
        }
        result
    }
}

/// Fractions of the tcp's limits at which the descent is checked; the actual descent is slower.
const TOUCH_SHARES: [f64; 3] = [0.05, 0.05, 0.02];

impl<A: CompliantArm> Robot<'_, A> {
    /// Moves straight down from the arm's position until a contact, or to the end of the path. The whole path is
    /// checked first, with table and workspace lowered by [`TouchDown::below_table_m`].
    ///
    /// # Errors
    /// As for [`Robot::follow`]; [`RobotError::Configuration`] for a setting of `touch_down` that is outside its
    /// range; [`RobotError::Planning`] if there is no straight path.
    pub fn touch_down(&mut self, touch_down: &TouchDown) -> Result<Touched> {
        touch_down.validate()?;
        let start = self.ready()?.q_commanded;
        let base_from_tcp = self.geometry().forward(&start);
        let mut lowest = base_from_tcp;
        lowest.translation.z -= touch_down.max_way_m;
        let path = self.geometry().straight_path(&start, &lowest, &LineOptions::default())?;
        let [velocity, acceleration, jerk] = TOUCH_SHARES;
        let slow = self.geometry().cartesian_limits.scaled(velocity, acceleration, jerk)?;
        let way = Trajectory::along_path(path, &self.limits.joints, &slow)?;
        let below_m = touch_down.below_table_m;
        self.limits.lowered(below_m, below_m).check(way)?;
        self.watch.begin();
        let touched = self.arm.touch_down(touch_down, &mut self.watch);
        // After an error the hand may be anywhere on the checked path.
        let lowest_m = touched.as_ref().map_or(lowest.translation.z, |touched| touched.tcp_height_m);
        self.felt_below = Some(FeltBelow::new(&base_from_tcp.translation.vector, lowest_m, below_m));
        self.note(touched)
    }
}
