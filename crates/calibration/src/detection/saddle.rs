//! Saddle points of brightness: the points where four squares meet.
//!
//! Legend: `H` the second derivatives of the smoothed brightness. Near a corner, brightness is proportional to the
//! product of the signed distances to both edges: `det H < 0`, and the edges are the directions `d` with `dᵀ H d = 0`.

use nalgebra::{Matrix2, Point2, Vector2};

use super::luminance::Luminance;

/// A saddle point.
#[derive(Debug, Clone)]
pub(super) struct Saddle {
    /// Position, accurate to about a pixel.
    pub(super) place: Point2<f64>,
    pub(super) hessian: Matrix2<f64>,
    /// `-det H`, positive at a saddle.
    pub(super) strength: f64,
}

/// Standard deviation of the smoothing before derivatives, in pixels: it removes noise, and corners of squares of six
/// pixels stay separate.
const SIGMA: f64 = 1.5;
/// Minimum contrast between dark and light squares, in grey levels: a tenth of a board's contrast in dim light.
const MIN_CONTRAST: f64 = 10.0;
/// Largest ratio of the two curvatures; noisy edges have larger ratios. The ratio is 3 for squares seen at 70 degrees.
const MAX_CURVATURE_RATIO: f64 = 8.0;
/// Distance at which brightness is compared with the opposite side, in pixels: larger than the smoothing, and within
/// squares of six pixels.
const RING_PX: f64 = 4.0;
const RING_PLACES: usize = 24;
/// Maximum sum of the squared differences of opposite points on the ring, relative to the squared variation that they
/// have in common. The ratio is 0 where four squares meet, and 2 at the corner of a dark square on white, which is also
/// a saddle point.
const MAX_ASYMMETRY: f64 = 0.5;
/// Radius, in pixels, within which a saddle point must be the strongest.
const RADIUS: usize = 2;
/// Maximum number of saddle points, the strongest ones; no board has half as many corners.
const MAX_SADDLES: usize = 2000;

/// The saddle points of a picture, strongest first.
pub(super) fn find(picture: &Luminance) -> Vec<Saddle> {
    let smooth = picture.smoothed(SIGMA);
    let (width, height) = (smooth.width, smooth.height);
    let border = RADIUS + 1;
    if width <= 2 * border || height <= 2 * border {
        return Vec::new();
    }
    let mut strengths = vec![0.0_f32; width * height];
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            strengths[y * width + x] = -hessian(&smooth, x, y).determinant() as f32;
        }
    }
    // A smoothed corner of contrast c has the off-diagonal curvature c / (π σ²).
    let least = (MIN_CONTRAST / (std::f64::consts::PI * SIGMA * SIGMA)).powi(2) as f32;
    let mut found = Vec::new();
    for y in border..height - border {
        for x in border..width - border {
            let strength = strengths[y * width + x];
            if strength < least || !is_strongest(&strengths, width, x, y) {
                continue;
            }
            let hessian = hessian(&smooth, x, y);
            let [a, b]: [f64; 2] = hessian.symmetric_eigenvalues().into();
            let ratio = (a / b).abs();
            if !(1.0 / MAX_CURVATURE_RATIO..MAX_CURVATURE_RATIO).contains(&ratio) {
                continue;
            }
            let place = Point2::new(x as f64 + 0.5, y as f64 + 0.5) + newton_step(&smooth, &hessian, x, y);
            if is_symmetric(&smooth, &place) {
                found.push(Saddle { place, hessian, strength: f64::from(strength) });
            }
        }
    }
    found.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    found.truncate(MAX_SADDLES);
    found
}

impl Saddle {
    /// The directions of both edges.
    pub(super) fn edges(&self) -> [Vector2<f64>; 2] {
        // At the point s e + t f, where e and f are the eigenvectors, the quadratic form is a s² + b t² with a b < 0.
        // It is zero at t = ± s √(-a / b).
        let eigen = self.hessian.symmetric_eigen();
        let slope = (-eigen.eigenvalues[0] / eigen.eigenvalues[1]).max(0.0).sqrt();
        let (e, f) = (eigen.eigenvectors.column(0).into_owned(), eigen.eigenvectors.column(1).into_owned());
        [(e + f * slope).normalize(), (e - f * slope).normalize()]
    }

    /// Whether dark and light squares are exchanged between two corners, as for neighbours along an edge.
    pub(super) fn is_opposite(&self, other: &Self) -> bool {
        // The inner product of the normalised traceless parts of both Hessians: 1 for equal Hessians, -1 for Hessians
        // rotated by 90 degrees.
        let traceless = |m: &Matrix2<f64>| (m - Matrix2::identity() * (0.5 * m.trace())).normalize();
        traceless(&self.hessian).dot(&traceless(&other.hessian)) < 0.0
    }
}

fn hessian(smooth: &Luminance, x: usize, y: usize) -> Matrix2<f64> {
    let at = |dx: usize, dy: usize| f64::from(smooth.at(x + dx - 1, y + dy - 1));
    let middle = 2.0 * at(1, 1);
    let xy = 0.25 * (at(2, 2) - at(0, 2) - at(2, 0) + at(0, 0));
    Matrix2::new(at(2, 1) - middle + at(0, 1), xy, xy, at(1, 2) - middle + at(1, 0))
}

/// The step from a pixel's centre to the zero of the gradient, at most a pixel.
fn newton_step(smooth: &Luminance, hessian: &Matrix2<f64>, x: usize, y: usize) -> Vector2<f64> {
    let difference = |a: f32, b: f32| 0.5 * f64::from(a - b);
    let gradient = Vector2::new(
        difference(smooth.at(x + 1, y), smooth.at(x - 1, y)),
        difference(smooth.at(x, y + 1), smooth.at(x, y - 1)),
    );
    let step = hessian.try_inverse().map_or_else(Vector2::zeros, |inverse| -inverse * gradient);
    step * (1.0 / step.norm()).min(1.0)
}

/// Whether brightness around a point equals the brightness on the opposite side.
fn is_symmetric(smooth: &Luminance, place: &Point2<f64>) -> bool {
    let half = RING_PLACES / 2;
    let ring: Option<Vec<f64>> = (0..RING_PLACES)
        .map(|k| {
            let (sin, cos) = (std::f64::consts::PI * k as f64 / half as f64).sin_cos();
            smooth.sample(&(place + Vector2::new(cos, sin) * RING_PX))
        })
        .collect();
    let Some(ring) = ring else { return false };
    let mean = ring.iter().sum::<f64>() / RING_PLACES as f64;
    let (odd, even) = ring[..half]
        .iter()
        .zip(&ring[half..])
        .fold((0.0, 0.0), |(odd, even), (a, b)| (odd + (a - b).powi(2), even + (a + b - 2.0 * mean).powi(2)));
    odd < MAX_ASYMMETRY * even
}

fn is_strongest(strengths: &[f32], width: usize, x: usize, y: usize) -> bool {
    let strength = strengths[y * width + x];
    (y - RADIUS..=y + RADIUS).all(|row| {
        // Of two equal neighbours, the first in reading order is kept.
        (x - RADIUS..=x + RADIUS).all(|column| {
            let other = strengths[row * width + column];
            if (row, column) < (y, x) { other < strength } else { other <= strength }
        })
    })
}
