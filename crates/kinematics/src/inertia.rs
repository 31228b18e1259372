//! Mass, centre and inertia of a rigid body.

use nalgebra::{Isometry3, Matrix3, Vector3};

/// A rigid body in the frame of the link to which it belongs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkInertia {
    /// Mass, kg.
    mass_kg: f64,
    /// Centre of mass, m.
    center_m: Vector3<f64>,
    /// Inertia about the centre of mass, in the link's axes, kg·m².
    inertia: Matrix3<f64>,
}

impl LinkInertia {
    /// A body whose inertia (kg·m², about its centre) is diagonal in the link's axes.
    pub fn new(mass_kg: f64, center_m: [f64; 3], diagonal: [f64; 3]) -> Self {
        Self { mass_kg, center_m: center_m.into(), inertia: Matrix3::from_diagonal(&diagonal.into()) }
    }

    /// Adds another body that is fixed to this one.
    pub(crate) fn add(&mut self, other: &Self, self_from_other: &Isometry3<f64>) {
        let turn = self_from_other.rotation.to_rotation_matrix();
        let center_m = (self_from_other * nalgebra::Point3::from(other.center_m)).coords;
        let turned = turn.matrix() * other.inertia * turn.matrix().transpose();
        let mass_kg = self.mass_kg + other.mass_kg;
        if mass_kg == 0.0 {
            return;
        }
        let middle = (self.center_m * self.mass_kg + center_m * other.mass_kg) / mass_kg;
        self.inertia = self.inertia
            + point_inertia(self.mass_kg, &(self.center_m - middle))
            + turned
            + point_inertia(other.mass_kg, &(center_m - middle));
        (self.mass_kg, self.center_m) = (mass_kg, middle);
    }

    /// Force (N) and torque about the link's origin (N·m) for a motion of the body. The motion is the origin's
    /// acceleration, the angular velocity and its rate, all in the link's axes.
    pub(crate) fn force_and_torque(
        &self,
        acceleration: &Vector3<f64>,
        turning: &Vector3<f64>,
        turning_rate: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let center = &self.center_m;
        let force = (acceleration + turning_rate.cross(center) + turning.cross(&turning.cross(center))) * self.mass_kg;
        let torque = self.inertia * turning_rate + turning.cross(&(self.inertia * turning)) + center.cross(&force);
        (force, torque)
    }
}

/// Inertia of a point mass at this distance from an origin.
fn point_inertia(mass_kg: f64, away_m: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * away_m.norm_squared() - away_m * away_m.transpose()) * mass_kg
}
