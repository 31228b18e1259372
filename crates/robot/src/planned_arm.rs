//! An arm that does not move and only records the commands of a sequence.

use crate::arm::{Arm, CompliantArm};
use crate::arm_state::{ArmMode, ArmState, ContactSensitivity, HandCommand, HandState, Load, MotionEnd, PERIOD_SECS};
use crate::error::Result;
use crate::safety::CheckedMotion;
use crate::touch::{TouchDown, Touched};
use crate::watch::Watch;
use sdg_kinematics::{ArmGeometry, JointVector, LineOptions};

/// An action of a planned arm.
#[derive(Debug, Clone)]
pub enum PlannedAction {
    /// A motion, checked as for a real arm.
    Motion(Box<CheckedMotion>),
    /// Standing still, s.
    Wait(f64),
    /// A command of the hand.
    Hand(HandCommand),
    /// A compliant descent: of a held part until the contact with its place, or of an open hand to the grasp.
    Down {
        /// Joint positions at the end, rad.
        end: JointVector,
        /// Duration of the descent, s.
        duration_secs: f64,
    },
}

/// An arm that follows every motion exactly, holds the part after every grasp, and records the commands.
#[derive(Debug, Clone)]
pub struct PlannedArm {
    geometry: ArmGeometry,
    state: ArmState,
    hand: HandState,
    actions: Vec<PlannedAction>,
}

impl PlannedArm {
    /// Starts at the real arm's position with the real hand's opening.
    pub fn new(geometry: ArmGeometry, q: JointVector, opening_m: f64) -> Self {
        let zero = JointVector::zeros();
        Self {
            geometry,
            state: ArmState { time_secs: 0.0, q, dq: zero, q_commanded: q, tau_external_nm: zero, mode: ArmMode::Idle },
            hand: HandState { opening_m, is_grasping: false, force_n: None },
            actions: Vec::new(),
        }
    }

    /// Starts with this state of the hand.
    pub fn with_hand(self, hand: HandState) -> Self {
        Self { hand, ..self }
    }

    /// The recorded commands, in order.
    pub fn actions(&self) -> &[PlannedAction] {
        &self.actions
    }

    /// Duration of the recorded sequence, s; motions of the hand take no time.
    pub fn duration_secs(&self) -> f64 {
        self.state.time_secs
    }

    /// Joint positions (rad) and opening of the hand (m) at regular times from the start, and once more at the end.
    pub fn frames(
        start: &JointVector,
        opening_m: f64,
        actions: &[PlannedAction],
        period_secs: f64,
    ) -> Vec<(JointVector, f64)> {
        let mut frames = vec![(*start, opening_m)];
        let (mut q, mut opening_m) = (*start, opening_m);
        let mut rest_secs = period_secs;
        for action in actions {
            let (duration_secs, motion) = match action {
                PlannedAction::Motion(motion) => (motion.duration_secs(), Some(motion)),
                PlannedAction::Wait(duration_secs) => (*duration_secs, None),
                PlannedAction::Down { end, duration_secs } => {
                    q = *end;
                    (*duration_secs, None)
                }
                PlannedAction::Hand(HandCommand::Move { opening_m: told_m, .. }) => {
                    opening_m = *told_m;
                    continue;
                }
                PlannedAction::Hand(HandCommand::Grasp { width_m, .. }) => {
                    opening_m = *width_m;
                    continue;
                }
            };
            let mut at_secs = rest_secs;
            while at_secs <= duration_secs {
                let here = motion.map_or(q, |motion| motion.sample(at_secs).0);
                frames.push((here, opening_m));
                at_secs += period_secs;
            }
            rest_secs = at_secs - duration_secs;
            q = motion.map_or(q, |motion| *motion.end());
        }
        frames.push((q, opening_m));
        frames
    }
}

impl Arm for PlannedArm {
    fn geometry(&self) -> &ArmGeometry {
        &self.geometry
    }

    fn state(&mut self) -> Result<ArmState> {
        Ok(self.state)
    }

    fn follow(&mut self, motion: &CheckedMotion, _watch: &mut Watch) -> Result<MotionEnd> {
        self.state.time_secs += (motion.duration_secs() / PERIOD_SECS).ceil() * PERIOD_SECS;
        (self.state.q, self.state.q_commanded) = (*motion.end(), *motion.end());
        self.actions.push(PlannedAction::Motion(Box::new(motion.clone())));
        Ok(MotionEnd::Arrived)
    }

    fn wait(&mut self, duration_secs: f64, _watch: &mut Watch) -> Result<()> {
        self.state.time_secs += duration_secs;
        self.actions.push(PlannedAction::Wait(duration_secs));
        Ok(())
    }

    fn hand(&mut self) -> Result<HandState> {
        Ok(self.hand)
    }

    fn start_hand(&mut self, command: HandCommand) -> Result<()> {
        self.hand = match command {
            HandCommand::Move { opening_m, .. } => HandState { opening_m, is_grasping: false, force_n: None },
            HandCommand::Grasp { width_m, force_n, .. } => {
                HandState { opening_m: width_m, is_grasping: true, force_n: Some(force_n) }
            }
        };
        self.actions.push(PlannedAction::Hand(command));
        Ok(())
    }

    fn finish_hand(&mut self, _watch: &mut Watch) -> Result<HandState> {
        Ok(self.hand)
    }

    fn set_contact_sensitivity(&mut self, _sensitivity: ContactSensitivity) -> Result<()> {
        Ok(())
    }

    fn set_load(&mut self, _load: Load) -> Result<()> {
        Ok(())
    }

    fn stop(&mut self) -> Result<()> {
        Ok(())
    }

    fn recover(&mut self) -> Result<()> {
        Ok(())
    }
}

impl CompliantArm for PlannedArm {
    /// Assumes that a held part touches its place at the expected height, [`TouchDown::below_table_m`] above the end of
    /// the path, and that an open hand touches nothing.
    fn touch_down(&mut self, touch_down: &TouchDown, _watch: &mut Watch) -> Result<Touched> {
        let is_contact = self.hand.is_grasping;
        let after_contact_m = if is_contact { touch_down.below_table_m } else { 0.0 };
        let way_m = (touch_down.max_way_m - after_contact_m).max(0.0);
        let mut base_from_tcp = self.geometry.forward(&self.state.q);
        base_from_tcp.translation.z -= way_m;
        let end = *self.geometry.straight_path(&self.state.q, &base_from_tcp, &LineOptions::default())?.end();
        let duration_secs = way_m / touch_down.speed_m_s + touch_down.press_secs;
        self.state.time_secs += duration_secs;
        (self.state.q, self.state.q_commanded) = (end, end);
        self.actions.push(PlannedAction::Down { end, duration_secs });
        let (tcp_height_m, force_n) = (base_from_tcp.translation.z, touch_down.press_n);
        Ok(Touched { is_contact, tcp_height_m, force_n, peak_n: force_n, free_air_error: [0.0; 2] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera_pose::CameraPose;
    use crate::grasp_target::GraspTarget;
    use crate::perception::PartFinder;
    use crate::robot::Robot;
    use crate::safety::SafetyLimits;
    use crate::sequence::{GraspConfig, GraspOutcome, grasp};
    use nalgebra::{Isometry3, UnitQuaternion, Vector3};
    use sdg_kinematics::{ArmGeometry, ready_pose};

    struct FixedTarget(Option<GraspTarget>);

    impl PartFinder<PlannedArm> for FixedTarget {
        fn find(&mut self, _arm: &mut PlannedArm) -> Result<Option<GraspTarget>> {
            Ok(self.0)
        }
    }

    fn target() -> GraspTarget {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let base_from_tcp = Isometry3::from_parts(Vector3::new(0.5, 0.1, 0.01).into(), down);
        GraspTarget { base_from_tcp, jaw_width_m: 0.02, score: 0.9 }
    }

    fn config() -> GraspConfig {
        let look_outs = vec![crate::sequence::LookOut::Joints(ready_pose())];
        GraspConfig { look_outs, pace: crate::pace::Pace::at_speed(0.1).unwrap(), ..GraspConfig::default() }
    }

    #[test]
    fn a_whole_grasp_is_planned_without_an_arm() {
        let mut start = ready_pose();
        start[0] = 0.6;
        let mut arm = PlannedArm::new(ArmGeometry::panda(), start, 0.08);
        let mut robot = Robot::new(&mut arm, SafetyLimits::default(), Watch::default());
        let report = grasp(
            &mut robot,
            &mut FixedTarget(Some(target())),
            &mut (),
            CameraPose::InBase(Isometry3::identity()),
            &config(),
        )
        .unwrap();
        assert_eq!(report.outcome, GraspOutcome::Held);
        let motions: Vec<_> = arm
            .actions()
            .iter()
            .filter_map(|action| match action {
                PlannedAction::Motion(motion) => Some(motion),
                _ => None,
            })
            .collect();
        // Motions to the look-out pose, above the part, down, and up.
        assert_eq!(motions.len(), 4);
        assert!(motions.windows(2).all(|pair| (pair[0].end() - pair[1].start()).amax() < 1e-9));
        let tcp = ArmGeometry::panda().forward(motions[2].end()).translation.vector;
        assert!((tcp - target().base_from_tcp.translation.vector).norm() < 1e-6, "{tcp}");

        let frames = PlannedArm::frames(&start, 0.08, arm.actions(), 0.25);
        let expected = arm.duration_secs() / 0.25;
        assert!((frames.len() as f64 - expected).abs() <= 3.0, "{} of {expected}", frames.len());
        assert_eq!((frames[0].0, frames[frames.len() - 1].0), (start, *motions[3].end()));
        // At speed 0.1, no joint is faster than a tenth of Franka's 2.61 rad/s.
        assert!(frames.windows(2).all(|pair| (pair[1].0 - pair[0].0).amax() <= 0.261 * 0.25 + 1e-9));
        assert_eq!(frames[frames.len() - 1].1, 0.02);
    }

    #[test]
    fn a_part_that_is_not_seen_ends_the_plan_at_the_look_out() {
        let mut arm = PlannedArm::new(ArmGeometry::panda(), ready_pose(), 0.08);
        let mut robot = Robot::new(&mut arm, SafetyLimits::default(), Watch::default());
        let report =
            grasp(&mut robot, &mut FixedTarget(None), &mut (), CameraPose::InBase(Isometry3::identity()), &config())
                .unwrap();
        assert!(matches!(report.outcome, GraspOutcome::Failed { step: crate::GraspStep::Detect, .. }));
    }
}
