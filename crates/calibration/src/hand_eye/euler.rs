//! Rotations that are decomposed into three angles and composed in another way.
//!
//! Legend: a rotation is composed as `R_k(a) · R_l(b) · R_m(c)`, where `k`, `l`, `m` are axes (0 is x). Rotations about
//! fixed axes are the same product read from the right, so the six orders of three axes cover intrinsic and extrinsic
//! angles. Angles are in radians.

use std::f64::consts::PI;

use nalgebra::{Rotation3, UnitQuaternion, Vector3};

/// The orders of three axes (Tait–Bryan), and of three angles.
pub(super) const ORDERS: [[usize; 3]; 6] = [[2, 1, 0], [0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1]];
/// Orders with equal first and last axes (proper Euler angles); ZYZ are the O, A, T angles of several robots.
const PROPER: [[usize; 3]; 6] = [[2, 1, 2], [2, 0, 2], [0, 1, 0], [0, 2, 0], [1, 0, 1], [1, 2, 1]];

/// Number of previous pictures that decide between the two possible rotations.
const NUM_BEFORE: usize = 2;

/// A rule that makes a rotation from three angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Composition {
    /// A product of rotations: the axes of the factors from left to right, and the index of each factor's angle.
    Product { axes: [usize; 3], angles: [usize; 3] },
    /// A rotation vector (axis times angle): the indices of the angles along x, y and z.
    RotationVector { angles: [usize; 3] },
}

impl Composition {
    /// The usual decomposition of a rotation: each factor takes the angle at its own position.
    pub(super) fn in_order(axes: [usize; 3]) -> Self {
        Self::Product { axes, angles: [0, 1, 2] }
    }

    /// The rotation that three angles describe.
    fn rotation(self, values: &[f64; 3]) -> UnitQuaternion<f64> {
        match self {
            Self::Product { axes, angles } => {
                let factor = |k: usize| {
                    let mut axis = Vector3::zeros();
                    axis[axes[k]] = values[angles[k]];
                    UnitQuaternion::from_scaled_axis(axis)
                };
                factor(0) * factor(1) * factor(2)
            }
            Self::RotationVector { angles } => {
                UnitQuaternion::from_scaled_axis(Vector3::from(angles.map(|angle| values[angle])))
            }
        }
    }

    /// Both sets of values of a rotation: angles with the middle angle within 90 degrees, and beyond; or the rotation
    /// vectors in both directions.
    fn angles(self, rotation: &UnitQuaternion<f64>) -> [[f64; 3]; 2] {
        match self {
            // Only products in order are decomposed.
            Self::Product { axes: [k, l, m], .. } => {
                let matrix: Rotation3<f64> = rotation.to_rotation_matrix();
                let sign = if (k + 1) % 3 == l { 1.0 } else { -1.0 };
                let a = (-sign * matrix[(l, m)]).atan2(matrix[(m, m)]);
                let b = (sign * matrix[(k, m)]).clamp(-1.0, 1.0).asin();
                let c = (-sign * matrix[(k, l)]).atan2(matrix[(k, k)]);
                [[a, b, c], [a + PI, PI - b, c + PI].map(wrapped)]
            }
            Self::RotationVector { .. } => {
                let vector = rotation.scaled_axis();
                let angle = vector.norm();
                // The same rotation, in the opposite direction by the rest of a full turn.
                let far = if angle > 0.0 { vector * (1.0 - 2.0 * PI / angle) } else { vector };
                [vector.into(), far.into()]
            }
        }
    }

    /// The formula, with the three angles named a, b and c.
    pub(super) fn formula(self) -> String {
        let name = |angle: usize| ["a", "b", "c"][angle];
        match self {
            Self::Product { axes, angles } => {
                let factors = axes.iter().zip(angles).map(|(axis, angle)| format!("R{}({})", AXES[*axis], name(angle)));
                factors.collect::<Vec<_>>().join("·")
            }
            Self::RotationVector { angles } => {
                format!("the rotation vector ({})", angles.map(name).join(", "))
            }
        }
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// A rotation whose angles were read with one composition but meant for another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Recomposition {
    pub(super) composed: Composition,
    pub(super) meant: Composition,
    /// Factor of the angles: 180 / π for radians that were read as degrees.
    pub(super) unit: f64,
}

impl Recomposition {
    /// The two rotations that may have been meant: a rotation has two sets of three angles.
    fn meant(&self, rotation: &UnitQuaternion<f64>) -> [UnitQuaternion<f64>; 2] {
        let of_both = self.composed.angles(rotation);
        of_both.map(|values| self.meant.rotation(&values.map(|value| self.unit * value)))
    }

    /// The intended rotations. Each picture has two candidates; `first` (0 or 1) is the candidate of the first picture.
    /// For each further picture, the rotations of both candidates since the two previous pictures are compared with the
    /// board's, and the better candidate is taken. `turns` returns the board's rotation between two pictures.
    pub(super) fn apply(
        &self,
        rotations: &[UnitQuaternion<f64>],
        first: usize,
        turns: &dyn Fn(usize, usize) -> f64,
    ) -> Vec<UnitQuaternion<f64>> {
        let mut meant: Vec<UnitQuaternion<f64>> = Vec::with_capacity(rotations.len());
        for (k, rotation) in rotations.iter().enumerate() {
            let both = self.meant(rotation);
            let off = |candidate: &UnitQuaternion<f64>| -> f64 {
                let before = k.saturating_sub(NUM_BEFORE)..k;
                before.map(|j| (candidate.angle_to(&meant[j]) - turns(k, j)).powi(2)).sum()
            };
            let is_second = if k == 0 { first == 1 } else { off(&both[1]) < off(&both[0]) };
            meant.push(both[usize::from(is_second)]);
        }
        meant
    }

    /// All combinations that are tried for one unit of angles, the more likely ones first: other orders of the
    /// rotations about x, y and z; rotation vectors; angles that belong to other axes; proper Euler angles.
    pub(super) fn all(unit: f64) -> Vec<Self> {
        let mut all = Vec::new();
        let mut add = |composed, meant| all.push(Self { composed, meant, unit });
        let composed = ORDERS.map(|axes| (axes, Composition::in_order(axes)));
        // An angle's index is the index of its axis in the order of composition.
        let place = |order: [usize; 3], axis: usize| order.iter().position(|of| *of == axis).unwrap_or_default();
        for (order, from) in composed {
            for axes in ORDERS {
                let angles = axes.map(|axis| place(order, axis));
                add(from, Composition::Product { axes, angles });
            }
        }
        let vector = Composition::RotationVector { angles: [0, 1, 2] };
        for (order, from) in composed {
            let angles = [0, 1, 2].map(|axis| place(order, axis));
            add(from, Composition::RotationVector { angles });
            let axes = order;
            add(vector, Composition::Product { axes, angles: axes });
        }
        for (order, from) in composed {
            for axes in ORDERS {
                let own = axes.map(|axis| place(order, axis));
                for angles in ORDERS.into_iter().filter(|angles| *angles != own) {
                    add(from, Composition::Product { axes, angles });
                }
            }
        }
        for (_, from) in composed {
            for axes in PROPER {
                for angles in ORDERS {
                    add(from, Composition::Product { axes, angles });
                }
            }
        }
        all
    }
}

/// The angle, wrapped to within π of 0.
fn wrapped(angle: f64) -> f64 {
    angle - 2.0 * PI * (angle / (2.0 * PI)).round()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    const ANGLES: [f64; 3] = [0.4, -0.9, 2.5];

    #[test]
    fn angles_of_both_branches_make_the_rotation() {
        for axes in ORDERS {
            let composition = Composition::in_order(axes);
            let rotation = composition.rotation(&ANGLES);
            let [near, far] = composition.angles(&rotation);
            assert!(near.iter().zip(ANGLES).all(|(a, b)| (a - b).abs() < 1e-12), "{axes:?}: {near:?}");
            assert!(composition.rotation(&far).angle_to(&rotation) < 1e-7 && far[1].abs() > FRAC_PI_2);
        }
        let vector = Composition::RotationVector { angles: [0, 1, 2] };
        let rotation = vector.rotation(&ANGLES);
        assert!(vector.angles(&rotation).iter().all(|angles| vector.rotation(angles).angle_to(&rotation) < 1e-7));
    }

    #[test]
    fn turns_about_x_then_y_then_z_of_the_fixed_frame_are_the_product_from_the_right() {
        // Rz(90°)·Rx(90°) first maps y to z, which the rotation about z does not change.
        let composition = Composition::Product { axes: [2, 1, 0], angles: [2, 1, 0] };
        let turned = composition.rotation(&[FRAC_PI_2, 0.0, FRAC_PI_2]) * Vector3::y();
        assert!((turned - Vector3::z()).norm() < 1e-12);
        assert_eq!(composition.formula(), "Rz(c)·Ry(b)·Rx(a)");
    }

    #[test]
    fn a_tool_that_points_down_is_recomposed_although_the_angle_about_x_is_beyond_a_quarter_turn() {
        // Read as Ry·Rx·Rz, whose middle angle is about x; meant as Rz·Ry·Rx.
        let about = [3.0, 0.2, 0.7];
        let composed = Composition::in_order([1, 0, 2]).rotation(&[about[1], about[0], about[2]]);
        let meant = Composition::in_order([2, 1, 0]).rotation(&[about[2], about[1], about[0]]);
        let recomposition = Recomposition {
            composed: Composition::in_order([1, 0, 2]),
            meant: Composition::Product { axes: [2, 1, 0], angles: [2, 0, 1] },
            unit: 1.0,
        };
        let off = recomposition.meant(&composed).map(|found| found.angle_to(&meant));
        assert!(off[0] > 0.1 && off[1] < 1e-7, "{off:?}");
        // The candidate of the first picture is given; that of the second follows from the board's rotation, here 0.
        let turns = |_: usize, _: usize| 0.0;
        let found = recomposition.apply(&[composed; 2], 1, &turns);
        assert!(found.iter().all(|found| found.angle_to(&meant) < 1e-7));
        assert!(Recomposition::all(1.0).contains(&recomposition));
    }
}
