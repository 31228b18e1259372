//! Initial weights for teaching, instead of random values.

use std::collections::BTreeSet;

use burn::module::Module;
use burn::tensor::Device;
use sdg_comparison::{ComparisonConfig, ComparisonNetwork};
use sdg_detection::config::NormKind;
use sdg_detection::imprint::Imprint;
use sdg_detection::{GeneralizedRcnn, Target, TransformedImage};
use sdg_layers::initialization::Initializer;
use sdg_layers::state_dict::{self, ImportReport, StateDict, WeightTensor};

use sdg_training::orientation::OrientationStart;

use crate::error::{GraspError, Result};

/// Imported weights for the network of a preset.
///
/// Every parameter of the network has a value here or is listed as randomly initialised. Otherwise a parameter
/// omitted by mistake would silently start from random values.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseWeights {
    /// SHA-256 of the weights' file, in hexadecimal digits; stored in the taught model's file.
    pub sha256: String,
    /// Values by the parameters' names.
    pub parameters: StateDict,
    /// Parameters that keep their random initial values, such as predictors for other classes.
    pub reinitialized: BTreeSet<String>,
    /// Weights that compute last layers from a part's views; empty if there are none.
    pub imprint: StateDict,
    /// Parameters that are not computed from a part's views, because the user wants random values.
    pub not_imprinted: BTreeSet<String>,
    /// The comparison network, which is not taught; empty if there is none.
    pub comparison: StateDict,
    /// The initial weights of model A's orientation CNN; `None` if there are none.
    pub orientation: Option<OrientationStart>,
}

impl BaseWeights {
    /// Whether the weights have a keypoint head, which preset `edge` also uses for teaching models without keypoints.
    pub(crate) fn has_keypoint_head(&self) -> bool {
        self.parameters.keys().any(|name| name.starts_with("roi_heads.keypoint_head."))
    }

    /// Whether these are this project's base weights; others have no imprint.
    pub(crate) fn is_ours(&self) -> bool {
        !self.imprint.is_empty()
    }

    /// The network that compares a picture at a pose with the demonstration; `None` if the weights contain none.
    ///
    /// # Errors
    /// [`GraspError::BaseWeights`] if the values belong to another network.
    pub(crate) fn comparison(&self, device: &Device) -> Result<Option<ComparisonNetwork>> {
        if self.comparison.is_empty() {
            return Ok(None);
        }
        let (network, report) = state_dict::import(ComparisonConfig::edge().init_blank(device)?, &self.comparison);
        match first_misfit(&report) {
            None => Ok(Some(network)),
            Some(found) => Err(GraspError::BaseWeights { fitting: report.applied.len(), found }),
        }
    }

    /// The detector with last layers computed from views of the part; for weights with [`Self::is_ours`].
    ///
    /// # Errors
    /// Targets that do not fit the images; [`GraspError::BaseWeights`] if the imprint belongs to another network.
    pub(crate) fn imprint(
        &self,
        detector: GeneralizedRcnn,
        images: &[TransformedImage],
        targets: &[Target],
    ) -> Result<GeneralizedRcnn> {
        let heads = &detector.config().roi_heads;
        let channels = heads.keypoint_head.as_ref().and_then(|head| head.conv_channels.last().copied()).unwrap_or(1);
        let mut init = Initializer::blank(&Device::flex());
        let blank = Imprint::init(heads.box_head.fc_channels, channels, &mut init);
        let (imprint, report) = state_dict::import(blank, &self.imprint);
        if let Some(found) = first_misfit(&report) {
            return Err(GraspError::BaseWeights { fitting: report.applied.len(), found });
        }
        let mut layers = imprint.last_layers(&detector.valid(), images, targets)?;
        layers.retain(|name, _| !self.not_imprinted.contains(name));
        Ok(state_dict::import(detector, &layers).0)
    }

    /// Sets the network's parameters. Layers frozen by the preset stay frozen.
    ///
    /// Frozen norms are converted to a scale and a shift, with mean 0 and variance 1 − eps, which does not change the
    /// function. A grasp model is stored in half precision, where the variance of an inactive channel, 1e-10 or less,
    /// would be zero.
    ///
    /// # Errors
    /// [`GraspError::BaseWeights`] if a parameter has no value and is not listed as randomly initialised, or if a value
    /// has another shape or belongs to no parameter.
    pub(crate) fn apply(&self, network: GeneralizedRcnn) -> Result<GeneralizedRcnn> {
        let eps = match network.config().backbone.norm {
            NormKind::FrozenBatch { eps } => Some(eps),
            NormKind::Identity | NormKind::Group { .. } => None,
        };
        let (network, mut report) = state_dict::import(network, &self.parameters);
        report.missing.retain(|name| !self.reinitialized.contains(name));
        match first_misfit(&report) {
            None => Ok(state_dict::import(network, &self.folded_norms(eps)).0),
            Some(found) => Err(GraspError::BaseWeights { fitting: report.applied.len(), found }),
        }
    }

    /// The frozen norms of the backbone as scale and shift, for each norm of which these weights have all four parts.
    fn folded_norms(&self, eps: Option<f64>) -> StateDict {
        const PARTS: [&str; 4] = ["weight", "bias", "running_mean", "running_var"];
        let mut norms = StateDict::new();
        let Some(eps) = eps else { return norms };
        for name in self.parameters.keys().filter(|name| name.starts_with("backbone.bottom_up.")) {
            let Some(norm) = name.strip_suffix(PARTS[3]) else { continue };
            let names = PARTS.map(|part| format!("{norm}{part}"));
            if let [Some(weight), Some(bias), Some(mean), Some(variance)] =
                names.each_ref().map(|name| self.parameters.get(name))
            {
                norms.extend(names.into_iter().zip(folded([weight, bias, mean, variance], eps)));
            }
        }
        norms
    }
}

/// `(x - mean) / sqrt(variance + eps) * weight + bias` as `x * scale + shift`, under the same four names.
fn folded(norm: [&WeightTensor; 4], eps: f64) -> [WeightTensor; 4] {
    let [weight, bias, mean, variance] = norm;
    let count = weight.values.len();
    let mut folded = [weight.clone(), bias.clone(), mean.clone(), variance.clone()];
    for i in 0..count {
        let scale = f64::from(weight.values[i]) / (f64::from(variance.values[i]) + eps).sqrt();
        folded[0].values[i] = scale as f32;
        folded[1].values[i] = (f64::from(bias.values[i]) - f64::from(mean.values[i]) * scale) as f32;
        folded[2].values[i] = 0.0;
        folded[3].values[i] = (1.0 - eps) as f32;
    }
    folded
}

fn first_misfit(report: &ImportReport) -> Option<String> {
    if let Some((name, expected, found)) = report.mismatched.first() {
        return Some(format!("{name} with shape {found:?} instead of {expected:?}"));
    }
    if let Some(name) = report.missing.first() {
        return Some(format!("no {name} ({} missing)", report.missing.len()));
    }
    report.unused.first().map(|name| format!("{name}, which the network does not have"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::grad_clipping::GradientClippingConfig;
    use burn::optim::{AdamWConfig, GradientsParams};
    use image::{Rgb, RgbImage};
    use sdg_detection::RcnnConfig;

    /// torchvision's numerics and freezing on a small, fast network.
    fn narrow() -> RcnnConfig {
        let changes = r#"{"kind": "keypoint", "numerics": "torchvision", "keypoints": 12, "min_size_test": 64,
            "max_size_test": 64, "stem_out_channels": 8, "res2_out_channels": 8, "width_per_group": 4,
            "num_blocks": [1, 1, 1, 1], "fpn_channels": 8, "box_head_fc": 8, "keypoint_convs": 8}"#;
        RcnnConfig::from_json(changes).unwrap()
    }

    fn base(config: &RcnnConfig) -> BaseWeights {
        let network = config.init(&Device::flex(), 7).unwrap();
        let parameters = state_dict::export(&network);
        BaseWeights {
            sha256: "0".repeat(64),
            parameters,
            reinitialized: BTreeSet::new(),
            imprint: StateDict::new(),
            not_imprinted: BTreeSet::new(),
            comparison: StateDict::new(),
            orientation: None,
        }
    }

    /// A picture of 64 × 64 pixels and a part on it.
    fn view() -> (RgbImage, Target) {
        let image = RgbImage::from_fn(64, 64, |x, y| Rgb([(x * 4) as u8, (y * 4) as u8, 90]));
        let bbox = sdg_geometry::BoundingBox { x1: 10.0, y1: 12.0, x2: 50.0, y2: 44.0 };
        let point = |i: usize| nalgebra::Point2::new(12.0 + 3.0 * i as f64, 15.0 + 2.0 * i as f64);
        let keypoints = (0..crate::NUM_KEYPOINTS).map(|i| sdg_geometry::Keypoint::visible(point(i))).collect();
        (image, Target { boxes: vec![bbox], labels: vec![0], keypoints: vec![keypoints], masks: Vec::new() })
    }

    #[test]
    fn a_step_moves_what_the_preset_trains_and_nothing_else() {
        let config = narrow();
        let base = base(&config);
        let mut network = base.apply(config.init(&Device::flex().autodiff(), 1).unwrap()).unwrap();
        assert_eq!(state_dict::export(&network), base.parameters);

        let (image, target) = view();
        let images = [network.image_transform().apply(&image).unwrap()];
        let clipping = Some(GradientClippingConfig::Norm(10.0));
        let mut optimizer = AdamWConfig::new().with_grad_clipping(clipping).init();
        for step in 0..2 {
            let total = network.losses(&images, std::slice::from_ref(&target), step).unwrap().total();
            let gradients = GradientsParams::from_grads(total.backward(), &network);
            network = optimizer.step(1e-3, network.clone(), gradients);
        }
        let trained = state_dict::export(&network.valid());
        for (name, before) in &base.parameters {
            let is_frozen = name.contains("stem.") || name.contains("res2.") || name.contains(".norm.");
            assert_eq!(trained[name] == *before, is_frozen, "{name}");
        }
    }

    #[test]
    fn a_part_that_the_user_initialises_randomly_is_not_imprinted() {
        let config = narrow();
        let mut base = base(&config);
        base.imprint = state_dict::export(&Imprint::init(8, 8, &mut Initializer::new(&Device::flex(), 6)));
        let network = config.init(&Device::flex().autodiff(), 1).unwrap();
        let before = state_dict::export(&network);
        let (image, target) = view();
        let images = [network.image_transform().apply(&image).unwrap()];
        let changed = |base: &BaseWeights| -> BTreeSet<String> {
            let imprinted = base.imprint(network.clone(), &images, std::slice::from_ref(&target)).unwrap();
            let after = state_dict::export(&imprinted);
            after.into_iter().filter(|(name, value)| before[name] != *value).map(|(name, _)| name).collect()
        };
        let scores = "roi_heads.box_predictor.cls_score.weight";
        assert!(changed(&base).contains(scores));
        base.not_imprinted.insert(scores.to_owned());
        assert!(!changed(&base).contains(scores));
    }

    #[test]
    fn a_folded_norm_is_the_same_function() {
        let tensor = |values: [f32; 2]| WeightTensor { shape: vec![2], values: values.to_vec() };
        let norm = [tensor([3.0, 1e-8]), tensor([0.5, 0.0]), tensor([2.0, 1e-6]), tensor([4.0 - 1e-5, 1e-12])];
        let [scale, shift, mean, variance] = folded(norm.each_ref(), 1e-5);
        // (x - 2) / 2 * 3 + 0.5 = 1.5 x - 2.5
        assert!((scale.values[0] - 1.5).abs() < 1e-6 && (shift.values[0] + 2.5).abs() < 1e-6);
        // The scale of an inactive channel is kept, although half precision could not hold the channel's variance.
        assert!((scale.values[1] / 3.162e-6 - 1.0).abs() < 1e-3, "{}", scale.values[1]);
        assert_eq!((mean.values, variance.values), (vec![0.0; 2], vec![1.0 - 1e-5; 2]));
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let config = narrow();
        let whole = base(&config);
        let refused = |base: &BaseWeights| {
            let network = config.init(&Device::flex(), 1).unwrap();
            base.apply(network).unwrap_err().to_string()
        };
        let bias = "roi_heads.keypoint_head.score_lowres.bias";

        let mut missing = whole.clone();
        missing.parameters.remove(bias);
        assert!(refused(&missing).contains(&format!("no {bias} (1 missing)")), "{}", refused(&missing));
        missing.reinitialized.insert(bias.to_owned());
        assert!(missing.apply(config.init(&Device::flex(), 1).unwrap()).is_ok());

        let mut mismatched = whole.clone();
        mismatched.parameters.get_mut(bias).unwrap().shape = vec![12, 1];
        assert!(refused(&mismatched).contains("shape [12, 1] instead of [12]"), "{}", refused(&mismatched));

        let mut unused = whole;
        let value = unused.parameters[bias].clone();
        unused.parameters.insert("roi_heads.mask_head.deconv.bias".to_owned(), value);
        assert!(refused(&unused).contains("which the network does not have"), "{}", refused(&unused));
    }
}
