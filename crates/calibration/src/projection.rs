//! Projects a point in front of the camera to its pixel, with derivatives.
//!
//! Legend: `p` a point in the camera's frame, `(x, y) = (p.x, p.y) / p.z`, `(x', y')` its position through the lens
//! (geometry's `PlumbBob`); `u = fx x' + cx`, `v = fy y' + cy`. Intrinsics are in the order fx, fy, cx, cy, k1, k2, p1,
//! p2, k3.

use nalgebra::{Matrix2x3, Matrix3, Matrix3x6, Point2, Point3, SMatrix, SVector, Vector2, Vector3};
use sdg_geometry::{PinholeCamera, PlumbBob};

/// Number of intrinsics of a camera: two focal lengths, the principal point and five lens coefficients.
pub(crate) const NUM_INTRINSICS: usize = 9;

/// A pixel and its derivatives.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Projected {
    pub(crate) pixel: Point2<f64>,
    pub(crate) by_intrinsics: SMatrix<f64, 2, NUM_INTRINSICS>,
    pub(crate) by_point: Matrix2x3<f64>,
}

/// Projects a point; `None` for a point at or behind the camera. Beyond the radius at which the lens's polynomial
/// decreases again, the polynomial is evaluated anyway: an optimiser must be able to return from there.
pub(crate) fn project(camera: &PinholeCamera, p: &Point3<f64>) -> Option<Projected> {
    if p.z <= f64::EPSILON {
        return None;
    }
    let PinholeCamera { fx, fy, cx, cy, lens, .. } = *camera;
    let place = Point2::new(p.x / p.z, p.y / p.z);
    let bent = lens.polynomial(&place);
    let (x, y, r2) = (place.x, place.y, place.coords.norm_squared());
    let (r4, r6) = (r2 * r2, r2 * r2 * r2);
    let by_lens = [
        [x * r2, y * r2],
        [x * r4, y * r4],
        [2.0 * x * y, r2 + 2.0 * y * y],
        [r2 + 2.0 * x * x, 2.0 * x * y],
        [x * r6, y * r6],
    ];
    let mut by_intrinsics = SMatrix::<f64, 2, NUM_INTRINSICS>::zeros();
    by_intrinsics[(0, 0)] = bent.x;
    by_intrinsics[(1, 1)] = bent.y;
    by_intrinsics[(0, 2)] = 1.0;
    by_intrinsics[(1, 3)] = 1.0;
    for (k, [by_x, by_y]) in by_lens.into_iter().enumerate() {
        by_intrinsics[(0, 4 + k)] = fx * by_x;
        by_intrinsics[(1, 4 + k)] = fy * by_y;
    }
    let by_place = lens.jacobian(&place);
    let perspective = Matrix2x3::new(1.0, 0.0, -x, 0.0, 1.0, -y) / p.z;
    let mut by_point = by_place * perspective;
    by_point.row_mut(0).scale_mut(fx);
    by_point.row_mut(1).scale_mut(fy);
    Some(Projected { pixel: Point2::new(fx * bent.x + cx, fy * bent.y + cy), by_intrinsics, by_point })
}

/// The camera with its intrinsics changed by `delta`.
pub(crate) fn stepped(camera: &PinholeCamera, delta: &SVector<f64, NUM_INTRINSICS>) -> PinholeCamera {
    let mut coefficients = camera.lens.to_array();
    for (coefficient, step) in coefficients.iter_mut().zip(delta.iter().skip(4)) {
        *coefficient += step;
    }
    PinholeCamera {
        fx: camera.fx + delta[0],
        fy: camera.fy + delta[1],
        cx: camera.cx + delta[2],
        cy: camera.cy + delta[3],
        lens: PlumbBob::from_array(coefficients),
        ..*camera
    }
}

/// The derivative of a point by a small twist `(t, ω)` that is applied last: `δp = t + ω × p`.
pub(crate) fn by_twist(p: &Point3<f64>) -> Matrix3x6<f64> {
    let mut matrix = Matrix3x6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
    matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&-p.coords.cross_matrix());
    matrix
}

/// The small motion of a twist.
pub(crate) fn motion(twist: &nalgebra::Vector6<f64>) -> nalgebra::Isometry3<f64> {
    let part = |k: usize| Vector3::new(twist[k], twist[k + 1], twist[k + 2]);
    nalgebra::Isometry3::new(part(0), part(3))
}

/// The residual: computed pixel (`found`) minus measured pixel (`expected`).
pub(crate) fn off(found: &Point2<f64>, expected: &Point2<f64>) -> Vector2<f64> {
    found - expected
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Vector6};
    use proptest::prelude::*;

    const CAMERA: PinholeCamera = PinholeCamera {
        width: 640,
        height: 480,
        fx: 612.0,
        fy: 609.0,
        cx: 318.0,
        cy: 244.0,
        lens: PlumbBob { k1: -0.28, k2: 0.11, p1: 0.0013, p2: -0.0007, k3: -0.02 },
    };
    /// Step of the central differences, and their tolerance in pixels per unit, which covers the third derivative.
    const STEP: f64 = 1e-6;
    const MAX_OFF: f64 = 1e-4;

    proptest! {
        #[test]
        fn derivatives_are_those_of_finite_differences(x in -0.3..0.3f64, y in -0.2..0.2f64, z in 0.4..0.9f64) {
            let p = Point3::new(x, y, z);
            let at = project(&CAMERA, &p).unwrap();
            prop_assert!((at.pixel - CAMERA.project(&p).unwrap()).norm() < 1e-9);
            for k in 0..NUM_INTRINSICS {
                let pixel = |step: f64| {
                    let mut delta = SVector::<f64, NUM_INTRINSICS>::zeros();
                    delta[k] = step;
                    project(&stepped(&CAMERA, &delta), &p).unwrap().pixel
                };
                let slope = (pixel(STEP) - pixel(-STEP)) / (2.0 * STEP);
                prop_assert!((slope - at.by_intrinsics.column(k)).norm() < MAX_OFF, "{k}: {slope}");
            }
            let by_motion = at.by_point * by_twist(&p);
            for k in 0..6 {
                let pixel = |step: f64| {
                    let mut twist = Vector6::zeros();
                    twist[k] = step;
                    let moved: Isometry3<f64> = motion(&twist);
                    project(&CAMERA, &(moved * p)).unwrap().pixel
                };
                let slope = (pixel(STEP) - pixel(-STEP)) / (2.0 * STEP);
                prop_assert!((slope - by_motion.column(k)).norm() < MAX_OFF, "{k}: {slope}");
            }
        }
    }
}
