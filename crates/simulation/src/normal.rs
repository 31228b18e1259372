//! Samples of the standard normal distribution (Box and Muller, 1958).

use std::f64::consts::TAU;

use rand::Rng;
use rand_pcg::Pcg64Mcg;

/// Radius and angle (rad) of a random point of the plane, whose coordinates are two independent samples.
fn polar(rng: &mut Pcg64Mcg) -> (f64, f64) {
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    (radius, TAU * rng.random::<f64>())
}

/// One sample; the second one of the pair is not used.
pub(crate) fn normal(rng: &mut Pcg64Mcg) -> f64 {
    let (radius, angle_rad) = polar(rng);
    radius * angle_rad.cos()
}

/// Samples, two at a time.
#[derive(Default)]
pub(crate) struct Normal {
    spare: Option<f64>,
}

impl Normal {
    pub(crate) fn sample(&mut self, rng: &mut Pcg64Mcg) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let (radius, angle_rad) = polar(rng);
        let (sin, cos) = angle_rad.sin_cos();
        self.spare = Some(radius * sin);
        radius * cos
    }
}
