//! An angle, wrapped into (-π, π] by its constructors.

use std::f64::consts::{PI, TAU};
use std::ops::{Add, Neg, Sub};

use serde::{Deserialize, Serialize};

/// An angle in radians. The constructors wrap it into (-π, π]; deserialisation takes any number.
///
/// In an image, where y points down, a positive angle is clockwise.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Angle(f64);

impl Angle {
    /// The zero angle.
    pub const ZERO: Self = Self(0.0);

    /// Wraps `radians` into (-π, π].
    pub fn from_radians(radians: f64) -> Self {
        let wrapped = radians - TAU * (radians / TAU).round();
        // `round` sends odd multiples of π to either end; the interval keeps the upper one.
        Self(if wrapped <= -PI { PI } else { wrapped })
    }

    /// Wraps `degrees` into (-180, 180].
    pub fn from_degrees(degrees: f64) -> Self {
        Self::from_radians(degrees.to_radians())
    }

    /// The direction of the vector (dx, dy).
    pub fn from_direction(dx: f64, dy: f64) -> Self {
        Self::from_radians(dy.atan2(dx))
    }

    /// Radians in (-π, π].
    pub fn radians(self) -> f64 {
        self.0
    }

    /// Degrees in (-180, 180].
    pub fn degrees(self) -> f64 {
        self.0.to_degrees()
    }

    /// The class of `num_classes` equal bins whose centre is nearest; class 0 is centred on angle zero.
    pub fn class_of(self, num_classes: usize) -> usize {
        let bin = TAU / num_classes as f64;
        (self.0.rem_euclid(TAU) / bin).round() as usize % num_classes
    }

    /// The centre of class `class` of `num_classes`.
    pub fn from_class(class: usize, num_classes: usize) -> Self {
        Self::from_radians(class as f64 * TAU / num_classes as f64)
    }

    /// The smallest angle between `self` and `other`, in radians, in `[0, π]`.
    pub fn distance(self, other: Self) -> f64 {
        (self - other).0.abs()
    }

    /// Like [`distance`](Self::distance), for directions that a rotation by π does not change (lines, two-finger
    /// grippers): in `[0, π/2]`.
    pub fn distance_modulo_half_turn(self, other: Self) -> f64 {
        let distance = self.distance(other);
        distance.min(PI - distance)
    }
}

impl Add for Angle {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::from_radians(self.0 + other.0)
    }
}

impl Sub for Angle {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::from_radians(self.0 - other.0)
    }
}

impl Neg for Angle {
    type Output = Self;
    fn neg(self) -> Self {
        Self::from_radians(-self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn wraps_at_the_half_turn() {
        assert_eq!(Angle::from_degrees(180.0).degrees(), 180.0);
        assert_eq!(Angle::from_degrees(-180.0).degrees(), 180.0);
        assert!((Angle::from_degrees(359.0).degrees() + 1.0).abs() < 1e-9);
        assert!((Angle::from_degrees(541.0).degrees() + 179.0).abs() < 1e-9);
    }

    #[test]
    fn one_and_359_degrees_are_two_apart() {
        let distance = Angle::from_degrees(1.0).distance(Angle::from_degrees(359.0));
        assert!((distance.to_degrees() - 2.0).abs() < 1e-9);
    }

    #[test]
    fn opposite_directions_are_one_line() {
        let distance = Angle::from_degrees(10.0).distance_modulo_half_turn(Angle::from_degrees(-165.0));
        assert!((distance.to_degrees() - 5.0).abs() < 1e-9);
    }

    #[test]
    fn class_359_6_is_class_0() {
        assert_eq!(Angle::from_degrees(359.6).class_of(360), 0);
        assert_eq!(Angle::from_degrees(359.4).class_of(360), 359);
        assert_eq!(Angle::from_degrees(-90.0).class_of(360), 270);
    }

    proptest! {
        #[test]
        fn always_in_the_interval(radians in -1e4f64..1e4) {
            let angle = Angle::from_radians(radians).radians();
            prop_assert!(angle > -PI && angle <= PI);
            prop_assert!(((angle - radians).cos() - 1.0).abs() < 1e-9);
        }

        #[test]
        fn class_round_trip(class in 0usize..360) {
            prop_assert_eq!(Angle::from_class(class, 360).class_of(360), class);
        }
    }
}
