//! Franka Emika Robot, "Panda".
//!
//! # Source
//! Lengths and limits: Franka Control Interface documentation, "Robot and interface specifications". Franka publishes
//! no masses. The masses are those of the simulated arm (crates/simulation/assets/panda.xml), which are plausible but
//! were not identified from measurements.

use std::f64::consts::FRAC_PI_2;

use crate::capsule::Capsule;
use crate::geometry::{ArmGeometry, ArmPart, ClosedForm, DhJoint, HandGeometry};
use crate::inertia::LinkInertia;
use crate::joints::{JointVector, NUM_JOINTS, ready_pose};
use crate::limits::{CartesianLimits, JointLimits};

impl ArmGeometry {
    /// The Panda with Franka's hand, a small camera on it, and published limits.
    pub fn panda() -> Self {
        let dh = |a_m, d_m, alpha_rad| DhJoint { a_m, d_m, alpha_rad };
        let link = LinkInertia::new;
        Self {
            joints: [
                dh(0.0, 0.333, 0.0),
                dh(0.0, 0.0, -FRAC_PI_2),
                dh(0.0, 0.316, FRAC_PI_2),
                dh(0.0825, 0.0, FRAC_PI_2),
                dh(-0.0825, 0.384, -FRAC_PI_2),
                dh(0.0, 0.0, FRAC_PI_2),
                dh(0.088, 0.0, FRAC_PI_2),
            ],
            flange_offset_m: 0.107,
            limits: JointLimits::panda(),
            cartesian_limits: CartesianLimits::panda(),
            ready: ready_pose(),
            closed_form: Some(ClosedForm::Franka),
            hand: HandGeometry::franka(),
            capsules: capsules(),
            wide_capsules: wide_capsules(),
            self_pairs: SELF_PAIRS.to_vec(),
            balls: vec![(ArmPart::Wrist, 6, 0.075), (ArmPart::Wrist, 7, 0.075), (ArmPart::Elbow, 4, 0.09)],
            links: [
                link(2.8, [0.0, -0.03, -0.08], [0.017, 0.017, 0.006]),
                link(2.6, [0.0, -0.08, 0.03], [0.016, 0.006, 0.016]),
                link(2.7, [0.03, 0.02, -0.06], [0.013, 0.013, 0.007]),
                link(2.6, [-0.04, 0.04, 0.02], [0.012, 0.008, 0.013]),
                link(2.4, [0.0, 0.04, -0.12], [0.020, 0.018, 0.005]),
                link(1.5, [0.05, 0.01, 0.005], [0.003, 0.005, 0.005]),
                link(0.75, [0.01, 0.0, 0.07], [0.0010, 0.0010, 0.0008]),
            ],
            rotor_inertia: JointVector::repeat(0.1),
            damping: JointVector::repeat(0.5),
        }
    }
}

impl JointLimits {
    /// The limits that Franka publishes for the Panda.
    pub fn panda() -> Self {
        Self {
            position_min: [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973].into(),
            position_max: [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973].into(),
            velocity_max: [2.1750, 2.1750, 2.1750, 2.1750, 2.6100, 2.6100, 2.6100].into(),
            acceleration_max: [15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0].into(),
            jerk_max: [7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0].into(),
            torque_max: [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0].into(),
        }
    }
}

impl CartesianLimits {
    /// The limits that Franka publishes for the Panda.
    pub const fn panda() -> Self {
        Self {
            velocity_m_s: 1.7,
            acceleration_m_s2: 13.0,
            jerk_m_s3: 6500.0,
            angular_velocity_rad_s: 2.5,
            angular_acceleration_rad_s2: 25.0,
            angular_jerk_rad_s3: 12500.0,
        }
    }
}

/// Index of the hand among the bodies.
const HAND: usize = 8;
const HELD: usize = 9;
/// Pairs of bodies that can collide. The missing pairs are neighbours, pairs that the joints' ranges keep apart, and
/// the held part with the hand and links 6 and 7, which it may touch. A test in `simulation` compares the pairs with
/// MuJoCo.
const SELF_PAIRS: [(usize, usize); 23] = [
    (0, 5),
    (0, 6),
    (0, 7),
    (0, HAND),
    (1, 5),
    (1, 6),
    (1, 7),
    (1, HAND),
    (2, 5),
    (2, 6),
    (2, 7),
    (2, HAND),
    (3, 7),
    (3, HAND),
    (4, 7),
    (4, HAND),
    (5, HAND),
    (0, HELD),
    (1, HELD),
    (2, HELD),
    (3, HELD),
    (4, HELD),
    (5, HELD),
];

/// Capsules placed by hand around the shapes of crates/simulation/assets/panda.xml. A test in
/// crates/simulation/src/extent.rs checks that they contain all visible shapes and do not extend too far beyond them.
fn capsules() -> [Vec<Capsule>; NUM_JOINTS + 1] {
    let c = Capsule::new;
    [
        vec![
            // The column, then the foot: low at both sides, in front and behind, and higher up.
            c([0.0, 0.0, 0.06], [0.0, 0.0, 0.12], 0.062),
            c([-0.115, 0.055, 0.012], [0.036, 0.055, 0.012], 0.050),
            c([-0.115, -0.055, 0.012], [0.036, -0.055, 0.012], 0.050),
            c([0.036, -0.03, 0.012], [0.036, 0.03, 0.012], 0.050),
            c([-0.118, -0.03, 0.03], [-0.118, 0.03, 0.03], 0.050),
            c([-0.115, 0.03, 0.064], [0.015, 0.03, 0.064], 0.056),
            c([-0.115, -0.03, 0.064], [0.015, -0.03, 0.064], 0.056),
        ],
        vec![c([0.0, 0.0, -0.25], [0.0, 0.0, 0.0], 0.0605), c([0.0, -0.0865, 0.0], [0.0, -0.02, 0.0], 0.061)],
        vec![c([0.0, 0.0, 0.02], [0.0, 0.0, 0.0865], 0.061), c([0.0, 0.0, 0.0], [0.0, -0.172, 0.0], 0.0615)],
        vec![
            c([0.0, 0.0, -0.145], [0.0, 0.0, -0.07], 0.0605),
            c([0.0, 0.0, -0.085], [0.012, 0.0, -0.055], 0.0575),
            c([0.012, 0.0, -0.055], [0.0825, 0.0, 0.0], 0.0575),
            c([0.0825, 0.0, 0.0], [0.0825, 0.060, 0.0], 0.061),
        ],
        vec![
            c([0.0, 0.0, 0.0], [0.0, 0.0, 0.060], 0.061),
            c([0.0, 0.0, 0.0], [-0.07, 0.055, 0.0], 0.0575),
            c([-0.07, 0.055, 0.0], [-0.0825, 0.085, 0.0], 0.0585),
            c([-0.0825, 0.085, 0.0], [-0.0825, 0.107, 0.0], 0.0605),
        ],
        vec![
            c([0.0, 0.0, -0.31], [0.0, 0.0, -0.21], 0.0605),
            c([0.0, 0.0, -0.205], [0.0, 0.012, -0.18], 0.0575),
            c([0.0, 0.016, -0.185], [0.0, 0.045, -0.095], 0.051),
            c([0.0, 0.040, -0.12], [0.0, 0.062, -0.02], 0.0455),
            c([0.0, 0.050, -0.20], [0.0, 0.060, -0.05], 0.0455),
            c([0.0, 0.028, 0.0], [0.0, 0.070, 0.0], 0.054),
        ],
        vec![
            c([0.0, 0.0, -0.02], [0.0, 0.0, 0.012], 0.0505),
            c([0.0, 0.0, 0.005], [0.088, 0.004, 0.002], 0.048),
            c([0.088, -0.026, 0.0], [0.088, 0.018, 0.0], 0.052),
        ],
        vec![
            c([0.0, 0.0, -0.06], [0.0, 0.0, 0.06], 0.0405),
            c([0.0, 0.0, 0.06], [0.0, 0.0, 0.085], 0.0475),
            c([0.02, 0.0, 0.076], [0.055, 0.0, 0.077], 0.030),
        ],
    ]
}

/// Fewer and wider capsules. A test in crates/simulation/src/extent.rs checks that they contain all visible shapes.
fn wide_capsules() -> [Vec<Capsule>; NUM_JOINTS + 1] {
    let c = Capsule::new;
    [
        vec![c([-0.09, 0.0, 0.05], [0.02, 0.0, 0.05], 0.120)],
        vec![c([0.0, 0.0, -0.18], [0.0, 0.0, 0.0], 0.062), c([0.0, -0.07, 0.0], [0.0, 0.0, 0.0], 0.076)],
        vec![c([0.0, 0.0, 0.0], [0.0, 0.0, 0.07], 0.076), c([0.0, 0.0, 0.0], [0.0, -0.18, 0.0], 0.062)],
        vec![
            c([0.0, 0.0, -0.115], [0.012, 0.0, -0.05], 0.066),
            c([0.012, 0.0, -0.055], [0.0825, 0.0, 0.0], 0.058),
            c([0.0825, 0.0, 0.0], [0.0825, 0.04, 0.0], 0.070),
        ],
        vec![
            c([0.0, 0.0, 0.0], [0.0, 0.0, 0.04], 0.070),
            c([0.0, 0.0, 0.0], [-0.07, 0.055, 0.0], 0.058),
            c([-0.07, 0.05, 0.0], [-0.0825, 0.115, 0.0], 0.066),
        ],
        vec![
            c([0.0, 0.0, -0.25], [0.0, 0.012, -0.18], 0.066),
            c([0.0, 0.016, -0.185], [0.0, 0.045, -0.095], 0.052),
            c([0.0, 0.040, -0.12], [0.0, 0.062, -0.02], 0.046),
            c([0.0, 0.040, 0.0], [0.0, 0.060, 0.0], 0.062),
        ],
        vec![
            c([0.0, 0.0, -0.02], [0.0, 0.0, 0.015], 0.050),
            c([0.0, 0.0, 0.005], [0.088, 0.004, 0.002], 0.049),
            c([0.088, -0.02, 0.0], [0.088, 0.015, 0.0], 0.058),
        ],
        vec![c([0.0, 0.0, 0.06], [0.0, 0.0, 0.09], 0.050), c([0.02, 0.0, 0.078], [0.05, 0.0, 0.08], 0.037)],
    ]
}
