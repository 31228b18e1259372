//! The loss functions, as sums; each caller divides by its own count.

use burn::tensor::{Int, Tensor, TensorData, activation};
use sdg_kernels::log_softmax;

use crate::config::RegressionLoss;

/// The losses of one batch, each a scalar `[1]`.
#[derive(Debug, Clone)]
pub struct Losses {
    /// Objectness of the anchors.
    pub rpn_cls: Tensor<1>,
    /// Box deltas of the anchors.
    pub rpn_loc: Tensor<1>,
    /// Classes of the proposals.
    pub cls: Tensor<1>,
    /// Box deltas of the proposals.
    pub box_reg: Tensor<1>,
    /// Heatmaps of the proposals, if the detector has a keypoint head.
    pub keypoint: Option<Tensor<1>>,
    /// Masks of the proposals, if the detector has a mask head.
    pub mask: Option<Tensor<1>>,
}

impl Losses {
    /// Sum of all losses.
    pub fn total(&self) -> Tensor<1> {
        let boxes = self.rpn_cls.clone() + self.rpn_loc.clone() + self.cls.clone() + self.box_reg.clone();
        [&self.keypoint, &self.mask].into_iter().flatten().fold(boxes, |sum, loss| sum + loss.clone())
    }

    /// Names and values, for display. Waits for the device.
    pub fn values(&self) -> Vec<(&'static str, f64)> {
        let value = |loss: &Tensor<1>| f64::from(loss.clone().into_scalar::<f32>());
        let mut values = vec![
            ("rpn_cls", value(&self.rpn_cls)),
            ("rpn_loc", value(&self.rpn_loc)),
            ("cls", value(&self.cls)),
            ("box_reg", value(&self.box_reg)),
        ];
        if let Some(keypoint) = &self.keypoint {
            values.push(("keypoint", value(keypoint)));
        }
        if let Some(mask) = &self.mask {
            values.push(("mask", value(mask)));
        }
        values
    }
}

/// Binary cross-entropy of logits, summed.
///
/// # Shapes
/// - `logits`, `targets`: `[S]`, targets from 0 to 1
pub fn binary_cross_entropy(logits: Tensor<1>, targets: &[f32]) -> Tensor<1> {
    binary_cross_entropies(logits, targets).sum()
}

/// Binary cross-entropy of logits, each with a weight, summed.
///
/// # Shapes
/// - `logits`, `targets`, `weights`: `[S]`, targets from 0 to 1
pub fn weighted_binary_cross_entropy(logits: Tensor<1>, targets: &[f32], weights: &[f32]) -> Tensor<1> {
    let weights = Tensor::from_floats(weights, &logits.device());
    (binary_cross_entropies(logits, targets) * weights).sum()
}

fn binary_cross_entropies(logits: Tensor<1>, targets: &[f32]) -> Tensor<1> {
    let targets = Tensor::from_floats(targets, &logits.device());
    // max(x, 0) - x·t + ln(1 + e^-|x|) never overflows.
    let log_term = (logits.clone().abs().neg()).exp().log1p();
    activation::relu(logits.clone()) - logits * targets + log_term
}

/// Cross-entropy of the softmax over the last axis, summed over rows that have a target.
///
/// # Shapes
/// - `logits`: `[S, K]`
/// - `targets`: `S` classes; `None` skips the row
pub fn cross_entropy(logits: Tensor<2>, targets: &[Option<usize>]) -> Tensor<1> {
    let [rows, _] = logits.dims();
    assert_eq!(rows, targets.len(), "expected one target per row");
    let device = logits.device();
    let idxs: Vec<i32> = targets.iter().map(|t| t.unwrap_or(0) as i32).collect();
    let idxs = Tensor::<2, Int>::from_data(TensorData::new(idxs, [rows, 1]), &device);
    let picked = log_softmax(logits).gather(1, idxs);
    let picked = if targets.iter().all(Option::is_some) {
        picked
    } else {
        let taken: Vec<f32> = targets.iter().map(|t| f32::from(u8::from(t.is_some()))).collect();
        picked * Tensor::<2>::from_data(TensorData::new(taken, [rows, 1]), &device)
    };
    picked.sum().neg()
}

/// Penalty on the difference of predicted and target deltas, summed.
///
/// # Shapes
/// - `predicted`: `[S, 4]`
/// - `targets`: `S` rows
pub fn regression(predicted: Tensor<2>, targets: &[[f32; 4]], loss: RegressionLoss) -> Tensor<1> {
    let device = predicted.device();
    let flat: Vec<f32> = targets.as_flattened().to_vec();
    let targets = Tensor::<2>::from_data(TensorData::new(flat, [targets.len(), 4]), &device);
    let distance = (predicted - targets).abs();
    match loss {
        RegressionLoss::L1 => distance.sum(),
        RegressionLoss::SmoothL1 { beta } => {
            // Below beta: d²/2β; above: β/2 + (d - β). With m = min(d, β): m²/2β + (d - m).
            let near = distance.clone().clamp_max(beta);
            (near.clone().square() / (2.0 * beta) + distance - near).sum()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::Device;

    fn value(loss: Tensor<1>) -> f32 {
        loss.into_scalar()
    }

    #[test]
    fn binary_cross_entropy_by_hand() {
        let logits = Tensor::from_floats([0.0, 3.0, -200.0], &Device::flex());
        // ln 2 + ln(1 + e^-3) + 200.
        let expected = 2f32.ln() + (1.0 + (-3f32).exp()).ln() + 200.0;
        assert!((value(binary_cross_entropy(logits, &[1.0, 1.0, 1.0])) - expected).abs() < 1e-4);
    }

    #[test]
    fn weights_multiply_each_cross_entropy() {
        let logits = || Tensor::from_floats([0.0, 3.0], &Device::flex());
        let expected = 4.0 * 2f32.ln() + (1.0 + (-3f32).exp()).ln();
        assert!((value(weighted_binary_cross_entropy(logits(), &[1.0, 1.0], &[4.0, 1.0])) - expected).abs() < 1e-5);
    }

    #[test]
    fn cross_entropy_by_hand_and_without_left_out_rows() {
        let logits = Tensor::<2>::from_floats([[1.0, 2.0], [0.0, 0.0], [5.0, 5.0]], &Device::flex());
        let first = (1f32.exp() + 2f32.exp()).ln() - 2.0;
        let loss = cross_entropy(logits, &[Some(1), Some(0), None]);
        assert!((value(loss) - first - 2f32.ln()).abs() < 1e-5);
    }

    #[test]
    fn smooth_l1_by_hand() {
        let predicted = Tensor::<2>::from_floats([[0.1, -2.0, 0.0, 0.5]], &Device::flex());
        let targets = [[0.0; 4]];
        assert!((value(regression(predicted.clone(), &targets, RegressionLoss::L1)) - 2.6).abs() < 1e-5);
        // 0.1²/(2·0.5) + (2 - 0.25) + 0 + 0.5²/(2·0.5).
        let loss = regression(predicted, &targets, RegressionLoss::SmoothL1 { beta: 0.5 });
        assert!((value(loss) - 0.01 - 1.75 - 0.25).abs() < 1e-5);
    }
}
