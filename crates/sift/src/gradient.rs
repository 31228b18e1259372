//! Gradients of a level of the scale space, computed for many pixels at a time.

/// Gradients of consecutive pixels of a row; the vectors grow to the longest requested row.
#[derive(Default)]
pub(crate) struct GradientRow {
    /// Length of the gradient.
    pub magnitude: Vec<f32>,
    /// Direction of the gradient in radians, from 0 to 2π, y pointing down.
    pub direction: Vec<f32>,
}

impl GradientRow {
    /// Reads pixels `first..=last` of the row `at`; `above` and `below` are the rows next to it. The pixel before
    /// `first` and the one after `last` must exist.
    #[inline(always)]
    pub(crate) fn read(&mut self, above: &[f32], at: &[f32], below: &[f32], first: usize, last: usize) {
        let n = last + 1 - first;
        if self.magnitude.len() < n {
            self.magnitude.resize(n, 0.0);
            self.direction.resize(n, 0.0);
        }
        let (left, right) = (&at[first - 1..first - 1 + n], &at[first + 1..first + 1 + n]);
        let (up, down) = (&above[first..first + n], &below[first..first + n]);
        let (magnitude, direction) = (&mut self.magnitude[..n], &mut self.direction[..n]);
        for i in 0..n {
            let (dx, dy) = (right[i] - left[i], down[i] - up[i]);
            magnitude[i] = (dx * dx + dy * dy).sqrt();
            direction[i] = direction_of(dx, dy);
        }
    }
}

/// The direction of (dx, dy) in `[0, 2π]`, within 2e-5; zero for a zero vector. It has no branch, so that many
/// directions are computed at a time.
///
/// # Source
/// An odd polynomial of degree 11 for the arctangent on [0, 1], with coefficients of a minimax fit.
#[inline(always)]
pub(crate) fn direction_of(dx: f32, dy: f32) -> f32 {
    use std::f32::consts::{FRAC_PI_2, PI, TAU};
    let (width, height) = (dx.abs(), dy.abs());
    let (short, long) = if width < height { (width, height) } else { (height, width) };
    // The smallest normal number avoids 0 / 0 and has no effect in any other sum.
    let t = short / (long + f32::MIN_POSITIVE);
    let s = t * t;
    let tail = 0.193_543_46 + s * (-0.116_432_87 + s * (0.052_653_32 + s * -0.011_721_2));
    let octant = t * (0.999_977_26 + s * (-0.332_623_47 + s * tail));
    let quadrant = if width < height { FRAC_PI_2 - octant } else { octant };
    let half = if dx < 0.0 { PI - quadrant } else { quadrant };
    if dy < 0.0 { TAU - half } else { half }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_agree_with_atan2() {
        for i in 0..3600 {
            let angle = (f64::from(i) / 10.0).to_radians();
            for length in [1e-30, 1e-3, 1.0, 1e6] {
                let found = f64::from(direction_of((length * angle.cos()) as f32, (length * angle.sin()) as f32));
                let error =
                    (found - angle + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
                assert!(error.abs() < 2e-5, "{found} for {angle} at length {length}");
            }
        }
        assert_eq!(direction_of(0.0, 0.0), 0.0);
    }

    #[test]
    fn a_ramp_points_uphill() {
        let row = |y: f32| (0..9).map(|x| 0.3 * x as f32 + 0.4 * y).collect::<Vec<f32>>();
        let mut gradients = GradientRow::default();
        gradients.read(&row(0.0), &row(1.0), &row(2.0), 1, 7);
        assert_eq!(gradients.magnitude.len(), 7);
        for (magnitude, direction) in gradients.magnitude.iter().zip(&gradients.direction) {
            assert!((magnitude - 1.0).abs() < 1e-6);
            assert!((direction - 0.8f32.atan2(0.6)).abs() < 1e-4);
        }
    }
}
