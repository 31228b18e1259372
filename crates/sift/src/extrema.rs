//! Extrema of the difference of Gaussians, fitted to a fraction of a pixel and of a scale.
//!
//! ```text
//! differences of one row ─► largest and smallest of 3 × 3 per level ─► of 3 × 3 × 3 ─► extremum? ─► quadratic fit
//!                                                                                     ─► contrast ─► edge
//! ```

use nalgebra::{Matrix3, Vector3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::SiftConfig;
use crate::scale_space::{BORDER, Octave};

/// Number of rows that a core processes at a time.
const BAND: usize = 32;
/// Maximum number of steps to neighbouring samples in a fit.
const MAX_STEPS: usize = 5;
/// Minimum contrast of a sample for a fit, as a fraction of the contrast threshold: the fit seldom doubles the
/// contrast.
const CANDIDATE_CONTRAST: f64 = 0.5;

/// An extremum of one octave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extremum {
    /// Column in pixels of the octave; whole numbers are pixel centres.
    pub x: f64,
    /// Row in pixels of the octave; whole numbers are pixel centres.
    pub y: f64,
    /// Level, with a fractional part.
    pub level: f64,
    /// |D| at the extremum, times the number of intervals.
    pub contrast: f64,
}

/// The extrema of an octave, from the top row down.
pub(crate) fn find(octave: &Octave, config: &SiftConfig) -> Vec<Extremum> {
    let (width, height) = (octave.width(), octave.height());
    if width.min(height) <= 2 * BORDER {
        return Vec::new();
    }
    let threshold = (CANDIDATE_CONTRAST * config.contrast_threshold / config.intervals as f64) as f32;
    let arch = Arch::new();
    let bands: Vec<usize> = (BORDER..height - BORDER).step_by(BAND).collect();
    let found: Vec<Vec<Sample>> = bands
        .par_iter()
        .map(|&first| {
            let rows = first..(first + BAND).min(height - BORDER);
            let candidates = arch.dispatch(ScanBand { octave, rows, threshold });
            candidates.into_iter().filter_map(|at| refine_extremum(octave, at, config.intervals)).collect()
        })
        .collect();
    // Neighbouring candidates can converge to the same sample.
    let mut samples: Vec<Sample> = found.into_iter().flatten().collect();
    samples.sort_unstable_by_key(|at| (at.y, at.x, at.level));
    samples.dedup();
    samples.into_iter().filter_map(|at| fit(octave, at, config)).collect()
}

/// A sample of the difference of Gaussians: between levels `level` and `level` + 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Sample {
    x: usize,
    y: usize,
    level: usize,
}

/// Searches for samples that are at least as large, or as small, as their 26 neighbours.
struct ScanBand<'a> {
    octave: &'a Octave,
    rows: std::ops::Range<usize>,
    threshold: f32,
}

impl WithSimd for ScanBand<'_> {
    type Output = Vec<Sample>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<Sample> {
        let width = self.octave.width();
        let num_differences = self.octave.levels.len() - 1;
        // Row y of the differences is stored at y % 3.
        let mut differences: [Vec<Vec<f32>>; 3] = std::array::from_fn(|_| vec![vec![0.0; width]; num_differences]);
        let mut largest = vec![vec![0.0f32; width]; num_differences];
        let mut smallest = vec![vec![0.0f32; width]; num_differences];
        let mut column_max = vec![0.0f32; width];
        let mut column_min = vec![0.0f32; width];
        let mut is_extremum = vec![0u8; width];
        let mut found = Vec::new();

        for y in self.rows.start - 1..=self.rows.end {
            for (s, row) in differences[y % 3].iter_mut().enumerate() {
                let (low, high) = (self.octave.levels[s].row(y), self.octave.levels[s + 1].row(y));
                for ((d, &low), &high) in row.iter_mut().zip(low).zip(high) {
                    *d = high - low;
                }
            }
            if y <= self.rows.start {
                continue;
            }
            let center = y - 1;
            for s in 0..num_differences {
                let [above, at, below] = [center - 1, center, center + 1].map(|y| &differences[y % 3][s][..width]);
                for x in 0..width {
                    let (a, b, c) = (above[x], at[x], below[x]);
                    column_max[x] = larger(larger(a, b), c);
                    column_min[x] = smaller(smaller(a, b), c);
                }
                spread(&column_max, &mut largest[s], larger);
                spread(&column_min, &mut smallest[s], smaller);
            }
            for (s, value) in differences[center % 3].iter().enumerate().take(num_differences - 1).skip(1) {
                let value = &value[..width];
                let high = [s - 1, s, s + 1].map(|s| &largest[s][..width]);
                let low = [s - 1, s, s + 1].map(|s| &smallest[s][..width]);
                let flags = &mut is_extremum[..width];
                for x in 0..width {
                    let v = value[x];
                    let highest = larger(larger(high[0][x], high[1][x]), high[2][x]);
                    let lowest = smaller(smaller(low[0][x], low[1][x]), low[2][x]);
                    let peak = (v > self.threshold) & (v >= highest);
                    let pit = (v < -self.threshold) & (v <= lowest);
                    flags[x] = u8::from(peak | pit);
                }
                let inside = &flags[BORDER..width - BORDER];
                for (block, chunk) in inside.chunks(64).enumerate() {
                    if chunk.iter().fold(0, |any, &flag| any | flag) == 0 {
                        continue;
                    }
                    let hits = chunk.iter().enumerate().filter(|&(_, &flag)| flag != 0);
                    found.extend(hits.map(|(i, _)| Sample { x: BORDER + 64 * block + i, y: center, level: s }));
                }
            }
        }
        found
    }
}

/// Combines each element with its two neighbours by `pick`; the outermost elements are not used later and stay
/// unchanged.
#[inline(always)]
fn spread(from: &[f32], to: &mut [f32], pick: impl Fn(f32, f32) -> f32) {
    let inner = from.len() - 2;
    let (left, mid, right) = (&from[..inner], &from[1..=inner], &from[2..]);
    for (i, to) in to[1..=inner].iter_mut().enumerate() {
        *to = pick(pick(left[i], mid[i]), right[i]);
    }
}

/// `f32::max` without its handling of NaN, which does not occur here; this is one instruction.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Moves to the sample nearest to the fitted extremum until the extremum is within half a sample. `None` if this does
/// not converge.
fn refine_extremum(octave: &Octave, mut at: Sample, intervals: usize) -> Option<Sample> {
    for _ in 0..MAX_STEPS {
        let offset = Derivatives::at(octave, at).offset()?;
        if offset.amax() <= 0.5 {
            return Some(at);
        }
        let step = |index: usize, offset: f64, low: usize, high: usize| {
            // An offset of many pixels means a saddle or a flat area, not an extremum.
            let moved = index as f64 + offset.round();
            (moved >= low as f64 && moved < high as f64).then_some(moved as usize)
        };
        at = Sample {
            x: step(at.x, offset.x, BORDER, octave.width() - BORDER)?,
            y: step(at.y, offset.y, BORDER, octave.height() - BORDER)?,
            level: step(at.level, offset.z, 1, intervals + 1)?,
        };
    }
    None
}

/// The extremum near a sample; `None` if it is too weak or an edge.
///
/// # Source
/// Lowe 2004, sections 4 and 4.1.
fn fit(octave: &Octave, at: Sample, config: &SiftConfig) -> Option<Extremum> {
    let derivatives = Derivatives::at(octave, at);
    let offset = derivatives.offset()?;
    let value = derivatives.value + 0.5 * derivatives.gradient.dot(&offset);
    let contrast = value.abs() * config.intervals as f64;
    if contrast < config.contrast_threshold || derivatives.is_edge(config.edge_ratio) {
        return None;
    }
    let [x, y, level] = [at.x as f64 + offset.x, at.y as f64 + offset.y, at.level as f64 + offset.z];
    Some(Extremum { x, y, level, contrast })
}

/// Value, gradient and Hessian over (x, y, level), from central differences.
struct Derivatives {
    value: f64,
    gradient: Vector3<f64>,
    hessian: Matrix3<f64>,
}

impl Derivatives {
    fn at(octave: &Octave, at: Sample) -> Self {
        let d = |dx: isize, dy: isize, ds: isize| {
            let level = at.level.wrapping_add_signed(ds);
            f64::from(octave.difference(level, at.x.wrapping_add_signed(dx), at.y.wrapping_add_signed(dy)))
        };
        let value = d(0, 0, 0);
        let (left, right) = (d(-1, 0, 0), d(1, 0, 0));
        let (up, down) = (d(0, -1, 0), d(0, 1, 0));
        let (finer, coarser) = (d(0, 0, -1), d(0, 0, 1));
        let xy = 0.25 * (d(1, 1, 0) - d(-1, 1, 0) - d(1, -1, 0) + d(-1, -1, 0));
        let xs = 0.25 * (d(1, 0, 1) - d(-1, 0, 1) - d(1, 0, -1) + d(-1, 0, -1));
        let ys = 0.25 * (d(0, 1, 1) - d(0, -1, 1) - d(0, 1, -1) + d(0, -1, -1));
        let (xx, yy) = (left + right - 2.0 * value, up + down - 2.0 * value);
        let ss = finer + coarser - 2.0 * value;
        Self {
            value,
            gradient: 0.5 * Vector3::new(right - left, down - up, coarser - finer),
            hessian: Matrix3::new(xx, xy, xs, xy, yy, ys, xs, ys, ss),
        }
    }

    /// The offset from the sample to the extremum of the quadratic.
    fn offset(&self) -> Option<Vector3<f64>> {
        let offset = -(self.hessian.try_inverse()? * self.gradient);
        offset.iter().all(|v| v.is_finite()).then_some(offset)
    }

    /// Whether the principal curvatures in the image differ by a factor of at least `ratio`, or in sign.
    fn is_edge(&self, ratio: f64) -> bool {
        let h = &self.hessian;
        let (trace, determinant) = (h.m11 + h.m22, h.m11 * h.m22 - h.m12 * h.m12);
        determinant <= 0.0 || trace * trace * ratio >= (ratio + 1.0).powi(2) * determinant
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Plane;
    use crate::scale_space::{PlanePool, build};

    /// Gaussian blobs of (x, y, sigma, height) on mid grey.
    fn blobs(blobs: &[(f64, f64, f64, f64)]) -> Plane {
        Plane::from_fn(160, 120, |col, row| {
            let value: f64 = blobs
                .iter()
                .map(|&(x, y, sigma, height)| {
                    let (dx, dy) = (f64::from(col) + 0.5 - x, f64::from(row) + 0.5 - y);
                    height * (-(dx * dx + dy * dy) / (2.0 * sigma * sigma)).exp()
                })
                .sum();
            (0.5 + value) as f32
        })
    }

    /// (x, y, sigma) of every extremum, in pixels of the image.
    fn extrema(image: &Plane, config: &SiftConfig) -> Vec<(f64, f64, f64)> {
        let octaves = build(image, config, &mut PlanePool::default());
        let in_image = |octave: &Octave, e: Extremum| {
            let sigma = octave.pixel_size * config.sigma_of_level(e.level);
            (octave.to_image(e.x), octave.to_image(e.y), sigma)
        };
        octaves.iter().flat_map(|o| find(o, config).into_iter().map(move |e| in_image(o, e))).collect()
    }

    #[test]
    fn blobs_are_found_where_they_are_at_their_size() {
        // Away from the border and from each other, bright and dark, at fractional positions.
        let truth = [(40.3, 30.7, 4.0, 0.4), (110.8, 80.2, 7.0, -0.4), (45.5, 88.1, 2.5, -0.3)];
        for double_first_octave in [true, false] {
            let config = SiftConfig { double_first_octave, ..SiftConfig::default() };
            let found = extrema(&blobs(&truth), &config);
            assert_eq!(found.len(), truth.len(), "{found:?}");
            for (x, y, sigma, _) in truth {
                let (fx, fy, fs) = found
                    .iter()
                    .copied()
                    .min_by(|a, b| (a.0 - x).hypot(a.1 - y).total_cmp(&(b.0 - x).hypot(b.1 - y)))
                    .unwrap();
                // Levels at σ and kσ differ most on a blob of variance t where k (t + σ²) = t + k²σ², so σ² = t / k;
                // the camera's assumed blur of 0.5 is subtracted from the blob's, and k is 2^(1/3).
                let level_sigma = (sigma * sigma - 0.25).sqrt() / 2f64.powf(1.0 / 6.0);
                assert!((fx - x).hypot(fy - y) < 0.03, "({fx}, {fy}) for ({x}, {y})");
                assert!((fs / level_sigma - 1.0).abs() < 0.05, "{fs} for {level_sigma}");
            }
        }
    }

    #[test]
    fn edges_and_weak_blobs_are_refused() {
        let step = Plane::from_fn(100, 100, |x, _| if x < 50 { 0.2 } else { 0.8 });
        assert_eq!(extrema(&step, &SiftConfig::default()), []);
        let weak = blobs(&[(80.0, 60.0, 4.0, 0.02)]);
        assert_eq!(extrema(&weak, &SiftConfig::default()), []);
        let sensitive = SiftConfig { contrast_threshold: 0.001, ..SiftConfig::default() };
        assert!(!extrema(&weak, &sensitive).is_empty());
    }

    #[test]
    fn flat_and_tiny_images_have_none() {
        let eager = SiftConfig { contrast_threshold: 0.0, ..SiftConfig::default() };
        for (width, height) in [(0, 0), (1, 1), (1, 40), (3, 2), (11, 11), (64, 48)] {
            let flat = Plane::from_fn(width, height, |_, _| 0.5);
            assert_eq!(extrema(&flat, &eager), [], "{width} × {height}");
        }
    }
}
