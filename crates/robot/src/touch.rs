//! Descent with a compliant tcp until a contact is measured by its force.
//!
//! ```text
//! stand, to measure the forces in free air ─> down at a constant speed ─> contact: press with a force ─> report
//!      └ stiff, with integral action ────────────────┘                    └ soft along z
//! ```
//! The force is the robot's own estimate of the external force; the height is the measured one.

use nalgebra::{Isometry3, Vector6};
use sdg_kinematics::{ArmGeometry, JointVector};

use crate::arm_state::PERIOD_SECS;
use crate::error::{Result, check_not_negative, check_positive};
use crate::impedance::{Impedance, ImpedanceControl, TcpReference};

/// Time during which the arm stands still to measure the forces in free air, and over which force and height are
/// averaged at the end, s.
const STANDING_SECS: f64 = 0.2;
/// Time within which the reference reaches its speed, s.
const RAMP_SECS: f64 = 0.5;
/// Largest distance by which the reference may lead the tcp, which joint friction holds back, m: 15 N at 1000 N/m.
const MAX_LEAD_M: f64 = 0.015;
/// Speed of the reference per newton of deviation from the pressing force, m/(N s): the force settles within a few
/// tenths of a second.
const YIELDING_M_PER_NS: f64 = 0.02;
/// Largest speed of the reference while pressing, m/s.
const MAX_YIELDING_M_S: f64 = 0.015;

/// Number of consecutive cycles with the force of a contact after which it counts: a single estimate may be noise.
const CONTACT_CYCLES: u32 = 10;

/// Smallest force at the end of pressing that confirms a contact, as a fraction of the requested force: a momentary
/// force in free air is none.
const MIN_PRESSED_SHARE: f64 = 0.25;

/// Settings of a touch-down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchDown {
    /// Stiffness of the tcp during the descent.
    pub free_air: Impedance,
    /// Stiffness after the contact.
    pub contact: Impedance,
    /// Speed of the reference, m/s.
    pub speed_m_s: f64,
    /// Largest length of the descent, as measured, m.
    pub max_way_m: f64,
    /// Largest distance of the path below the given height of the table, m: the uncertainty of that height.
    pub below_table_m: f64,
    /// Change of the vertical force that counts as a contact, N.
    pub contact_n: f64,
    /// Pressing force after the contact, N.
    pub press_n: f64,
    /// Duration of pressing, s.
    pub press_secs: f64,
}

impl Default for TouchDown {
    /// 6 mm/s, at most 30 mm down and 10 mm below the given height of the table; 3 N count as a contact.
    fn default() -> Self {
        Self {
            free_air: Impedance::FREE_AIR,
            contact: Impedance::SOFT_DOWN,
            speed_m_s: 0.006,
            max_way_m: 0.030,
            below_table_m: 0.010,
            contact_n: 3.0,
            press_n: 4.0,
            press_secs: 1.0,
        }
    }
}

impl TouchDown {
    /// Maximum length of a descent, m.
    pub(crate) const MAX_WAY_M: f64 = 0.2;

    /// Checks every setting.
    ///
    /// # Errors
    /// [`RobotError::Configuration`](crate::RobotError::Configuration).
    pub(crate) fn validate(&self) -> Result<()> {
        /// Maximum speed: at higher speeds a contact is an impact.
        const MAX_SPEED_M_S: f64 = 0.05;
        /// Maximum uncertainty of the table's height; the check against the table is weaker by this distance.
        const MAX_BELOW_TABLE_M: f64 = 0.05;
        const MAX_FORCE_N: f64 = 15.0;
        check_positive("speed of the descent in m/s", self.speed_m_s, MAX_SPEED_M_S)?;
        check_positive("length of the descent in m", self.max_way_m, Self::MAX_WAY_M)?;
        check_not_negative("distance below the table in m", self.below_table_m, MAX_BELOW_TABLE_M)?;
        check_positive("force of a contact in N", self.contact_n, MAX_FORCE_N)?;
        check_positive("force of pressing in N", self.press_n, MAX_FORCE_N)?;
        check_positive("time of pressing in s", self.press_secs, 10.0)?;
        self.free_air.validate("in free air")?;
        self.contact.validate("after the contact")
    }
}

/// The result of a touch-down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touched {
    /// Whether there was a contact before the path's end, and at least a quarter of the requested force at the end.
    pub is_contact: bool,
    /// Measured height of the tcp in the base frame at the end, m.
    pub tcp_height_m: f64,
    /// The pressing force at the end, N.
    pub force_n: f64,
    /// The largest force during the whole touch-down, N.
    pub peak_n: f64,
    /// Largest deviation of the tcp from its reference in free air, m and rad.
    pub free_air_error: [f64; 2],
}

/// The phase of a touch-down.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Standing,
    Down,
    Pressing,
}

/// The torques of a touch-down, cycle by cycle: for arms that accept torques.
#[derive(Debug)]
pub struct Descent {
    touch_down: TouchDown,
    control: ImpedanceControl,
    start: Isometry3<f64>,
    phase: Phase,
    phase_cycles: u32,
    /// Distance of the reference below the start, m.
    down_m: f64,
    speed_m_s: f64,
    free_air_n: f64,
    num_contact_cycles: u32,
    is_contact: bool,
    peak_n: f64,
    force_sum_n: f64,
    height_sum_m: f64,
    num_summed: u32,
    free_air_error: [f64; 2],
}

impl Descent {
    /// Starts at the arm's joint positions `q` (rad), after a last `torque` (N·m, without gravity).
    pub fn new(touch_down: TouchDown, arm: &ArmGeometry, q: JointVector, torque: JointVector) -> Self {
        Self {
            touch_down,
            control: ImpedanceControl::new(touch_down.free_air, q, torque),
            start: arm.forward(&q),
            phase: Phase::Standing,
            phase_cycles: 0,
            down_m: 0.0,
            speed_m_s: 0.0,
            free_air_n: 0.0,
            num_contact_cycles: 0,
            is_contact: false,
            peak_n: 0.0,
            force_sum_n: 0.0,
            height_sum_m: 0.0,
            num_summed: 0,
            free_air_error: [0.0; 2],
        }
    }

    /// The torques of the next cycle (N·m), and whether they are the last.
    ///
    /// `force_n` is the vertical external force, upwards, as the robot estimates it. Only its change from free air
    /// counts, so that the result depends neither on the weight of a held part nor on the sign of the estimate.
    pub fn next(&mut self, arm: &ArmGeometry, q: &JointVector, dq: &JointVector, force_n: f64) -> (JointVector, bool) {
        let pressed_n = (force_n - self.free_air_n).abs();
        let base_from_tcp = arm.forward(q);
        let height_m = base_from_tcp.translation.z;
        let way_m = self.start.translation.z - height_m;
        self.phase_cycles += 1;
        let phase_secs = f64::from(self.phase_cycles) * PERIOD_SECS;
        let mut is_last = false;
        match self.phase {
            Phase::Standing => {
                self.force_sum_n += force_n;
                if phase_secs >= STANDING_SECS {
                    self.free_air_n = self.force_sum_n / f64::from(self.phase_cycles);
                    self.enter(Phase::Down);
                }
            }
            Phase::Down => {
                self.speed_m_s = self.touch_down.speed_m_s * (phase_secs / RAMP_SECS).min(1.0);
                self.peak_n = self.peak_n.max(pressed_n);
                let is_touching = pressed_n >= self.touch_down.contact_n;
                self.num_contact_cycles = if is_touching { self.num_contact_cycles + 1 } else { 0 };
                self.is_contact = self.num_contact_cycles >= CONTACT_CYCLES;
                let is_at_end = way_m >= self.touch_down.max_way_m || self.down_m - way_m >= MAX_LEAD_M;
                if self.is_contact || is_at_end {
                    self.enter(Phase::Pressing);
                    self.control.change(self.touch_down.contact);
                    // The softer spring exerts the same force as the stiff one did; at the path's end the tcp stays in
                    // place.
                    let [before, now] = [self.touch_down.free_air, self.touch_down.contact].map(|one| one.stiffness.z);
                    self.down_m = if is_at_end { way_m } else { way_m + (self.down_m - way_m) * (before / now) };
                } else {
                    let mut wanted = self.start;
                    wanted.translation.z -= self.down_m;
                    let [beside_m, beside_rad] = &mut self.free_air_error;
                    let apart = wanted.inverse() * base_from_tcp;
                    *beside_m = beside_m.max(apart.translation.vector.norm());
                    *beside_rad = beside_rad.max(apart.rotation.angle());
                }
            }
            Phase::Pressing => {
                self.peak_n = self.peak_n.max(pressed_n);
                self.speed_m_s = match self.is_contact {
                    // The path was checked only to its end.
                    true if way_m >= self.touch_down.max_way_m => self.yielding(pressed_n).min(0.0),
                    true => self.yielding(pressed_n),
                    false => 0.0,
                };
                if phase_secs > self.touch_down.press_secs - STANDING_SECS {
                    self.force_sum_n += pressed_n;
                    self.height_sum_m += height_m;
                    self.num_summed += 1;
                }
                is_last = phase_secs >= self.touch_down.press_secs.max(STANDING_SECS);
            }
        }
        self.down_m += self.speed_m_s * PERIOD_SECS;
        let mut base_from_wanted = self.start;
        base_from_wanted.translation.z -= self.down_m;
        let twist = Vector6::new(0.0, 0.0, -self.speed_m_s, 0.0, 0.0, 0.0);
        let reference = TcpReference { base_from_tcp: base_from_wanted, twist };
        (self.control.torque(arm, q, dq, &reference, &JointVector::zeros()), is_last)
    }

    /// Downward speed of the reference while pressing, m/s; negative (upward) if the force is too large.
    fn yielding(&self, pressed_n: f64) -> f64 {
        let too_little_n = self.touch_down.press_n - pressed_n;
        (YIELDING_M_PER_NS * too_little_n).clamp(-MAX_YIELDING_M_S, MAX_YIELDING_M_S)
    }

    fn enter(&mut self, phase: Phase) {
        (self.phase, self.phase_cycles, self.force_sum_n, self.speed_m_s) = (phase, 0, 0.0, 0.0);
    }

    /// The torques of the last cycle, N·m.
    pub fn last_torque(&self) -> &JointVector {
        self.control.last_torque()
    }

    /// The result, after the last torques were sent.
    pub fn touched(&self) -> Touched {
        let num = f64::from(self.num_summed.max(1));
        let force_n = self.force_sum_n / num;
        Touched {
            is_contact: self.is_contact && force_n >= MIN_PRESSED_SHARE * self.touch_down.press_n,
            tcp_height_m: self.height_sum_m / num,
            force_n,
            peak_n: self.peak_n,
            free_air_error: self.free_air_error,
        }
    }
}

#[cfg(test)]
mod tests {
    use sdg_kinematics::ready_pose;

    use super::*;

    /// The external force that the robot reports in free air, N.
    const FREE_AIR_N: f64 = 2.0;
    const MAX_CYCLES: usize = 10_000;

    /// Descends with an arm that is held in place. Once the reference moves, the external force exceeds [`FREE_AIR_N`]
    /// by `pressed_n(f)` for the force `f` of the spring, both in N.
    fn descend(touch_down: TouchDown, pressed_n: impl Fn(f64) -> f64) -> Touched {
        descended(touch_down, pressed_n).touched()
    }

    /// As [`descend`], with the state at the end.
    fn descended(touch_down: TouchDown, pressed_n: impl Fn(f64) -> f64) -> Descent {
        let (arm, q, still) = (ArmGeometry::panda(), ready_pose(), JointVector::zeros());
        let mut descent = Descent::new(touch_down, &arm, q, still);
        for _ in 0..MAX_CYCLES {
            let pressed_n = match descent.phase {
                Phase::Standing => 0.0,
                Phase::Down => pressed_n(touch_down.free_air.stiffness.z * descent.down_m),
                Phase::Pressing => pressed_n(touch_down.contact.stiffness.z * descent.down_m),
            };
            if descent.next(&arm, &q, &still, FREE_AIR_N + pressed_n).1 {
                return descent;
            }
        }
        panic!("it does not end");
    }

    #[test]
    fn a_force_just_below_the_one_of_a_contact_is_none_and_one_just_above_is() {
        let touch_down = TouchDown::default();
        for (pressed_n, is_contact) in [(0.99, false), (1.01, true)] {
            let touched = descend(touch_down, |_| pressed_n * touch_down.contact_n);
            assert_eq!(touched.is_contact, is_contact, "{pressed_n}");
        }
    }

    #[test]
    fn a_force_that_does_not_last_is_no_contact() {
        let at_first = |spring_n: f64| if spring_n > 0.0 { 0.0 } else { 3.1 };
        let touched = descend(TouchDown::default(), at_first);
        assert!(!touched.is_contact && touched.peak_n > TouchDown::default().contact_n, "{touched:?}");
        // A single estimate is none, either.
        let mut descent = Descent::new(TouchDown::default(), &ArmGeometry::panda(), ready_pose(), JointVector::zeros());
        descent.enter(Phase::Down);
        for force_n in [3.1, 3.1, 0.0] {
            descent.next(&ArmGeometry::panda(), &ready_pose(), &JointVector::zeros(), force_n);
        }
        assert!(descent.phase == Phase::Down && !descent.is_contact, "{descent:?}");
        // The arm is held at the end of the checked path: the reference stays there.
        let at_end = TouchDown { max_way_m: 0.0, ..TouchDown::default() };
        let mut descent = Descent::new(at_end, &ArmGeometry::panda(), ready_pose(), JointVector::zeros());
        descent.enter(Phase::Pressing);
        descent.is_contact = true;
        descent.next(&ArmGeometry::panda(), &ready_pose(), &JointVector::zeros(), 0.0);
        assert!(descent.down_m <= 0.0, "{descent:?}");
    }

    /// The reference moves until the measured force is the requested one.
    #[test]
    fn it_presses_with_the_force_that_is_told() {
        for press_n in [4.0, 8.0] {
            let touch_down = TouchDown { press_n, press_secs: 5.0, ..TouchDown::default() };
            let touched = descend(touch_down, |spring_n| spring_n);
            assert!(touched.is_contact && (touched.force_n - press_n).abs() < 0.05 * press_n, "{touched:?}");
            assert!(touched.peak_n < 1.5 * press_n.max(touch_down.contact_n), "{touched:?}");
        }
    }

    /// A table height lowered by NaN would never be violated, and a negative stiffness pushes away from the reference.
    #[test]
    fn each_setting_out_of_its_range_is_named() {
        type Change = fn(&mut TouchDown, f64);
        let settings: [(&str, Change, &[f64]); 7] = [
            ("distance below the table in m", |it, value| it.below_table_m = value, &[0.051, -0.001]),
            ("stiffness along z in free air in N/m", |it, value| it.free_air.stiffness.z = value, &[1001.0, 0.0, -1.0]),
            (
                "stiffness about x after the contact in N·m/rad",
                |it, value| it.contact.stiffness.w = value,
                &[101.0, 0.0],
            ),
            ("mass along y in free air in kg", |it, value| it.free_air.mass.y = value, &[21.0, 0.0, -1.0]),
            (
                "integral about z after the contact in 1/s",
                |it, value| it.contact.integral_per_sec.b = value,
                &[11.0, -1.0],
            ),
            (
                "stiffness of the elbow in free air in N·m/rad",
                |it, value| it.free_air.null_stiffness = value,
                &[101.0, -1.0],
            ),
            (
                "change of torque per cycle after the contact in N·m",
                |it, value| it.contact.max_torque_step_nm = value,
                &[1.1, 0.0],
            ),
        ];
        TouchDown { below_table_m: 0.0, free_air: Impedance::SOFT, ..TouchDown::default() }.validate().unwrap();
        for (name, change, wrong) in settings {
            for value in wrong.iter().copied().chain([f64::NAN, f64::INFINITY]) {
                let mut touch_down = TouchDown::default();
                change(&mut touch_down, value);
                let found = touch_down.validate().unwrap_err().to_string();
                assert!(found.starts_with(&format!("{name}: expected ")), "{found}");
                assert!(found.ends_with(&format!("found {value}")), "{found}");
            }
        }
    }

    #[test]
    fn forces_that_would_be_a_blow_are_refused() {
        let told = |contact_n, press_n| TouchDown { contact_n, press_n, ..TouchDown::default() }.validate();
        told(15.0, 15.0).unwrap();
        for (contact_n, press_n) in [(15.1, 4.0), (3.0, 15.1), (0.0, 4.0), (3.0, 0.0), (f64::NAN, 4.0)] {
            let found = told(contact_n, press_n).unwrap_err().to_string();
            assert!(found.contains("at most 15"), "{found}");
        }
    }
}
