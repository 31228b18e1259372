//! Conversion of keypoints to heatmaps over a box, and back.
//!
//! A heatmap is a square of `S×S` cells stretched over a box. The target of a keypoint is the one cell that contains
//! it; in inference the position inside the box is computed from the values of the cells.

use sdg_geometry::Keypoint;

use crate::boxes::Corners;
use crate::config::{KeypointReadout, KeypointScore};

/// The cell `y·S + x` of a keypoint in a box, or `None` if the keypoint is unlabelled or outside the box.
///
/// `keypoint` and `roi` are in pixels of the resized image. A keypoint exactly on the right or
/// lower edge belongs to the last cell.
///
/// # Source
/// Detectron2's and torchvision's `keypoints_to_heatmap`.
pub fn encode(keypoint: &Keypoint, roi: &Corners, heatmap_size: usize) -> Option<usize> {
    if !keypoint.is_labelled() {
        return None;
    }
    let size = heatmap_size as f32;
    let cell = |value: f64, low: f32, high: f32| -> Option<usize> {
        let value = value as f32;
        if value == high {
            return Some(heatmap_size - 1);
        }
        let cell = ((value - low) * (size / (high - low))).floor();
        (cell >= 0.0 && cell < size).then_some(cell as usize)
    };
    let x = cell(keypoint.x, roi[0], roi[2])?;
    let y = cell(keypoint.y, roi[1], roi[3])?;
    Some(y * heatmap_size + x)
}

/// A keypoint computed from a heatmap: position in pixels of the resized image, and a score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReadKeypoint {
    /// Position in pixels, x right.
    pub x: f32,
    /// Position in pixels, y down.
    pub y: f32,
    /// Score; see [`KeypointScore`].
    pub score: f32,
}

/// Computes the keypoint from its heatmap (`S×S` logits, row by row) over a box.
pub fn decode(
    logits: &[f32],
    heatmap_size: usize,
    roi: &Corners,
    readout: KeypointReadout,
    score: KeypointScore,
) -> ReadKeypoint {
    assert_eq!(logits.len(), heatmap_size * heatmap_size, "expected a square heatmap");
    let width = (roi[2] - roi[0]).max(1.0);
    let height = (roi[3] - roi[1]).max(1.0);
    let (x, y, peak) = match readout {
        KeypointReadout::BicubicArgmax => {
            let (columns, rows) = (width.ceil() as usize, height.ceil() as usize);
            let resized = resize_bicubic(logits, heatmap_size, columns, rows);
            let best = argmax(&resized);
            let x = ((best % columns) as f32 + 0.5) * (width / columns as f32);
            let y = ((best / columns) as f32 + 0.5) * (height / rows as f32);
            (x, y, resized[best])
        }
        KeypointReadout::LocalMean { radius } => {
            let best = argmax(logits);
            let (column, row) = local_mean(logits, heatmap_size, best, radius);
            let cell = heatmap_size as f32;
            (column * width / cell, row * height / cell, logits[best])
        }
    };
    let score = match score {
        KeypointScore::Logit => peak,
        KeypointScore::NormalisedPeak => 1.0 / logits.iter().map(|l| (l - peak).exp()).sum::<f32>(),
    };
    ReadKeypoint { x: roi[0] + x, y: roi[1] + y, score }
}

fn argmax(values: &[f32]) -> usize {
    let mut best = 0;
    for (idx, value) in values.iter().enumerate() {
        if *value > values[best] {
            best = idx;
        }
    }
    best
}

/// Mean cell centre (column, row), weighted by the softmax of the cells around `best`.
fn local_mean(logits: &[f32], size: usize, best: usize, radius: usize) -> (f32, f32) {
    let (best_row, best_column) = (best / size, best % size);
    let span = |center: usize| center.saturating_sub(radius)..center.saturating_add(radius).saturating_add(1).min(size);
    let (mut sum, mut sum_x, mut sum_y) = (0.0, 0.0, 0.0);
    for row in span(best_row) {
        for column in span(best_column) {
            let weight = (logits[row * size + column] - logits[best]).exp();
            sum += weight;
            sum_x += weight * (column as f32 + 0.5);
            sum_y += weight * (row as f32 + 0.5);
        }
    }
    (sum_x / sum, sum_y / sum)
}

/// The parameter of the cubic convolution kernel: PyTorch's -0.75.
const CUBIC: f32 = -0.75;

/// Four cubic weights for a point between the second and the third sample, at the fraction `t` of their distance.
fn cubic_weights(t: f32) -> [f32; 4] {
    let near = |d: f32| ((CUBIC + 2.0) * d - (CUBIC + 3.0)) * d * d + 1.0;
    let far = |d: f32| ((CUBIC * d - 5.0 * CUBIC) * d + 8.0 * CUBIC) * d - 4.0 * CUBIC;
    [far(t + 1.0), near(t), near(1.0 - t), far(2.0 - t)]
}

/// Resizes a square map to `columns × rows` by cubic convolution, edges repeated.
///
/// # Source
/// `torch.nn.functional.interpolate(mode="bicubic", align_corners=False)`.
fn resize_bicubic(map: &[f32], size: usize, columns: usize, rows: usize) -> Vec<f32> {
    let taps = |output: usize| -> Vec<([usize; 4], [f32; 4])> {
        let scale = size as f32 / output as f32;
        (0..output)
            .map(|i| {
                let at = (i as f32 + 0.5) * scale - 0.5;
                let first = at.floor();
                let idxs = [-1, 0, 1, 2].map(|d| (first as isize + d).clamp(0, size as isize - 1) as usize);
                (idxs, cubic_weights(at - first))
            })
            .collect()
    };
    let along_x = taps(columns);
    let mut stretched = vec![0f32; size * columns];
    for (out, row) in stretched.chunks_exact_mut(columns).zip(map.chunks_exact(size)) {
        for (value, (idxs, weights)) in out.iter_mut().zip(&along_x) {
            *value = idxs.iter().zip(weights).map(|(i, w)| row[*i] * w).sum();
        }
    }
    let mut resized = vec![0f32; rows * columns];
    for (out, (idxs, weights)) in resized.chunks_exact_mut(columns).zip(&taps(rows)) {
        for (idx, weight) in idxs.iter().zip(weights) {
            let row = &stretched[idx * columns..][..columns];
            for (value, source) in out.iter_mut().zip(row) {
                *value += source * weight;
            }
        }
    }
    resized
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sdg_geometry::Visibility;

    const ROI: Corners = [10.0, 20.0, 66.0, 132.0];

    fn keypoint(x: f64, y: f64) -> Keypoint {
        Keypoint { x, y, visibility: Visibility::Visible }
    }

    #[test]
    fn cells_by_hand() {
        // 56 cells over 56x112 px: one pixel and two pixels per cell.
        assert_eq!(encode(&keypoint(10.5, 23.0), &ROI, 56), Some(56));
        assert_eq!(encode(&keypoint(66.0, 132.0), &ROI, 56), Some(56 * 56 - 1));
        assert_eq!(encode(&keypoint(9.9, 30.0), &ROI, 56), None);
        assert_eq!(encode(&keypoint(30.0, 132.1), &ROI, 56), None);
        let unlabelled = Keypoint { visibility: Visibility::Unlabelled, ..keypoint(30.0, 30.0) };
        assert_eq!(encode(&unlabelled, &ROI, 56), None);
    }

    #[test]
    fn cubic_weights_sum_to_one_and_hit_samples() {
        assert_eq!(cubic_weights(0.0), [0.0, 1.0, 0.0, 0.0]);
        assert!((cubic_weights(0.3).iter().sum::<f32>() - 1.0).abs() < 1e-6);
        // Halfway: -0.09375, 0.59375, 0.59375, -0.09375 for a = -0.75.
        assert!((cubic_weights(0.5)[0] + 0.09375).abs() < 1e-6);
    }

    #[test]
    fn the_score_is_the_peak_of_the_softmax() {
        let mut logits = vec![0f32; 16];
        logits[5] = 3.0;
        let read = |score| decode(&logits, 4, &[0.0, 0.0, 4.0, 4.0], KeypointReadout::BicubicArgmax, score);
        assert_eq!(read(KeypointScore::Logit).score, 3.0);
        let expected = 3f32.exp() / (3f32.exp() + 15.0);
        assert!((read(KeypointScore::NormalisedPeak).score - expected).abs() < 1e-6);
    }

    #[test]
    fn two_equal_neighbours_are_read_between() {
        let mut logits = vec![-20f32; 56 * 56];
        logits[10 * 56 + 20] = 1.0;
        logits[10 * 56 + 21] = 1.0;
        let readout = KeypointReadout::LocalMean { radius: 2 };
        let read = decode(&logits, 56, &[0.0, 0.0, 56.0, 56.0], readout, KeypointScore::Logit);
        assert!((read.x - 21.0).abs() < 1e-4 && (read.y - 10.5).abs() < 1e-4, "{read:?}");
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: proptest::test_runner::RngSeed::Fixed(3), failure_persistence: None, ..Default::default() })]
        #[test]
        fn decoding_finds_the_encoded_cell(
            fx in 0.001f64..0.999, fy in 0.001f64..0.999,
            w in 20f32..200.0, h in 20f32..200.0, cubic in proptest::bool::ANY,
        ) {
            let roi = [30.0, 40.0, 30.0 + w, 40.0 + h];
            let point = keypoint(30.0 + fx * f64::from(w), 40.0 + fy * f64::from(h));
            // A hill around the target cell, because resizing to fewer pixels than cells has no antialiasing and would
            // miss a single high cell.
            let cell = encode(&point, &roi, 56).unwrap();
            let (row, column) = ((cell / 56) as f32, (cell % 56) as f32);
            let logits: Vec<f32> = (0..56 * 56)
                .map(|i| -((i / 56) as f32 - row).powi(2) - ((i % 56) as f32 - column).powi(2))
                .collect();
            let readout = if cubic { KeypointReadout::BicubicArgmax } else { KeypointReadout::LocalMean { radius: 2 } };
            let read = decode(&logits, 56, &roi, readout, KeypointScore::NormalisedPeak);
            // Encoding has an error of up to half a cell, and the resized map of up to half a pixel.
            let (tx, ty) = (w / 112.0 + 0.51, h / 112.0 + 0.51);
            prop_assert!((f64::from(read.x) - point.x).abs() <= f64::from(tx), "{read:?} {point:?}");
            prop_assert!((f64::from(read.y) - point.y).abs() <= f64::from(ty), "{read:?} {point:?}");
        }
    }
}
