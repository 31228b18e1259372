//! Box deltas: a box relative to a reference box, as numbers suitable for regression.
//!
//! `dx = wx·(gx - ax)/aw`, `dy = wy·(gy - ay)/ah`, `dw = ww·ln(gw/aw)`, `dh = wh·ln(gh/ah)`, where `a` is the reference
//! box (anchor or proposal), `g` the target box, and x and y are centres.

use crate::boxes::Corners;
use crate::config::BoxCoderConfig;

/// Deltas `[dx, dy, dw, dh]`.
pub type Deltas = [f32; 4];

/// Bound on the decoded `dw`, `dh`: `ln(1000/16)`, so that a box grows by at most a factor of 62.5.
pub const SCALE_CLAMP: f32 = 4.135_166_6;

/// Encodes boxes relative to reference boxes, and back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxCoder {
    weights: [f32; 4],
}

impl BoxCoder {
    /// A coder with the configured weights.
    pub fn new(config: &BoxCoderConfig) -> Self {
        Self { weights: config.weights.map(|w| w as f32) }
    }

    /// Returns the deltas from `reference` to `target`.
    pub fn encode(&self, reference: &Corners, target: &Corners) -> Deltas {
        let [aw, ah] = [reference[2] - reference[0], reference[3] - reference[1]];
        let [gw, gh] = [target[2] - target[0], target[3] - target[1]];
        let [ax, ay] = [reference[0] + 0.5 * aw, reference[1] + 0.5 * ah];
        let [gx, gy] = [target[0] + 0.5 * gw, target[1] + 0.5 * gh];
        let [wx, wy, ww, wh] = self.weights;
        [wx * (gx - ax) / aw, wy * (gy - ay) / ah, ww * (gw / aw).ln(), wh * (gh / ah).ln()]
    }

    /// Returns the box at `deltas` from `reference`.
    pub fn decode(&self, reference: &Corners, deltas: &Deltas) -> Corners {
        let [aw, ah] = [reference[2] - reference[0], reference[3] - reference[1]];
        let [ax, ay] = [reference[0] + 0.5 * aw, reference[1] + 0.5 * ah];
        let [wx, wy, ww, wh] = self.weights;
        let width = (deltas[2] / ww).min(SCALE_CLAMP).exp() * aw;
        let height = (deltas[3] / wh).min(SCALE_CLAMP).exp() * ah;
        let x = deltas[0] / wx * aw + ax;
        let y = deltas[1] / wy * ah + ay;
        [x - 0.5 * width, y - 0.5 * height, x + 0.5 * width, y + 0.5 * height]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ROI: BoxCoderConfig = BoxCoderConfig { weights: [10.0, 10.0, 5.0, 5.0] };

    #[test]
    fn encodes_by_hand() {
        // Centre moves from (5, 10) to (10, 10), width 10 to 20: dx = 10·5/10, dw = 5·ln 2.
        let deltas = BoxCoder::new(&ROI).encode(&[0.0, 0.0, 10.0, 20.0], &[0.0, 0.0, 20.0, 20.0]);
        let expected = [5.0, 0.0, 5.0 * std::f32::consts::LN_2, 0.0];
        for (d, e) in deltas.iter().zip(expected) {
            assert!((d - e).abs() < 1e-6);
        }
    }

    #[test]
    fn growth_is_clamped() {
        let decoded = BoxCoder::new(&ROI).decode(&[0.0, 0.0, 16.0, 16.0], &[0.0, 0.0, 1e4, 0.0]);
        assert!((decoded[2] - decoded[0] - 1000.0).abs() < 0.01, "{decoded:?}");
        assert_eq!(decoded[3] - decoded[1], 16.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: proptest::test_runner::RngSeed::Fixed(2), failure_persistence: None, ..Default::default() })]
        #[test]
        fn decode_undoes_encode(
            a in (0f32..300.0, 0f32..300.0, 2f32..100.0, 2f32..100.0),
            g in (0f32..300.0, 0f32..300.0, 2f32..100.0, 2f32..100.0),
        ) {
            let reference = [a.0, a.1, a.0 + a.2, a.1 + a.3];
            let target = [g.0, g.1, g.0 + g.2, g.1 + g.3];
            let coder = BoxCoder::new(&ROI);
            let back = coder.decode(&reference, &coder.encode(&reference, &target));
            for (b, t) in back.iter().zip(target) {
                // Rounding error of single precision at coordinates of a few hundred pixels.
                prop_assert!((b - t).abs() < 2e-3, "{back:?} {target:?}");
            }
        }
    }
}
