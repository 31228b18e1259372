//! Franka's hand with a small camera on it.
//!
//! # Source
//! Franka Hand, product manual; masses as in the simulated arm (crates/simulation/assets/panda.xml).

use nalgebra::{UnitQuaternion, Vector3};

use crate::capsule::Capsule;
use crate::geometry::{FingerCapsule, FingerGeometry, HandGeometry};
use crate::inertia::LinkInertia;

/// Distance from flange to tcp along z, m.
pub const TCP_OFFSET_M: f64 = 0.1034;
/// Largest opening between the fingers, m.
pub const HAND_OPENING_MAX_M: f64 = 0.08;
/// Half the width of a finger across its motion, m.
pub const FINGER_HALF_WIDTH_M: f64 = 0.011;
/// Thickness of a fingertip along its motion, m.
const FINGER_THICKNESS_M: f64 = 0.015;
/// Thickness of a finger's root along its motion, m.
const FINGER_ROOT_THICKNESS_M: f64 = 0.026;
/// Height above the tcp at which the root starts, m.
const FINGER_ROOT_ABOVE_TCP_M: f64 = 0.015;

/// Maximum thickness of a finger along its motion up to a height above the tcp; both in m.
pub fn finger_thickness_m(above_tcp_m: f64) -> f64 {
    if above_tcp_m <= FINGER_ROOT_ABOVE_TCP_M { FINGER_THICKNESS_M } else { FINGER_ROOT_THICKNESS_M }
}

impl HandGeometry {
    /// Franka's hand with a small camera on it.
    pub fn franka() -> Self {
        let c = Capsule::new;
        Self {
            flange_from_hand: UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -std::f64::consts::FRAC_PI_4),
            tcp_offset_m: TCP_OFFSET_M,
            opening_max_m: HAND_OPENING_MAX_M,
            half_width_m: 0.102,
            half_depth_m: 0.033,
            length_m: 0.066,
            capsules: vec![
                // Body: four bars along y.
                c([0.016, -0.0925, 0.0165], [0.016, 0.0925, 0.0165], 0.0245),
                c([-0.016, -0.0925, 0.0165], [-0.016, 0.0925, 0.0165], 0.0245),
                c([0.016, -0.0925, 0.0495], [0.016, 0.0925, 0.0495], 0.0245),
                c([-0.016, -0.0925, 0.0495], [-0.016, 0.0925, 0.0495], 0.0245),
                // Camera and its arm.
                c([0.072, -0.035, 0.0365], [0.072, 0.035, 0.0365], 0.0175),
                c([0.030, 0.0, 0.030], [0.062, 0.0, 0.030], 0.0155),
            ],
            wide_capsules: vec![
                c([0.0, -0.07, 0.038], [0.0, 0.07, 0.038], 0.053),
                c([0.055, -0.03, 0.036], [0.055, 0.03, 0.036], 0.036),
                c([0.0, -0.045, 0.083], [0.0, 0.045, 0.083], 0.036),
            ],
            finger: FingerGeometry {
                half_width_m: FINGER_HALF_WIDTH_M,
                thickness_m: FINGER_THICKNESS_M,
                middle_m: 0.013,
                capsules: vec![
                    FingerCapsule { inward_m: 0.0, z_m: [0.060, 0.078], radius_m: 0.018 },
                    FingerCapsule { inward_m: 0.007, z_m: [0.075, 0.0985], radius_m: 0.0145 },
                ],
                mass_kg: 0.06,
                center_m: [0.010, 0.0784],
                inertia: [1.5e-5, 1.5e-5, 5e-6],
            },
            inertia: LinkInertia::new(0.85, [0.01, 0.0, 0.035], [0.0027, 0.0010, 0.0030]),
        }
    }
}
