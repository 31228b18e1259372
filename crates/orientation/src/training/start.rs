//! What teaching starts from, instead of from nothing: a trunk that was pretrained, and what makes the angle classes of a
//! part's own crops.
//!
//! Every class is scored by the mean of the features of the crops near its angle, see [`ClassImprint`].

use burn::module::Module;
use burn::tensor::{Tensor, TensorData};
use image::RgbImage;
use sdg_detection::imprint::ClassImprint;
use sdg_detection::initialization::Initializer;
use sdg_detection::state_dict::{self, StateDict, WeightTensor};

use super::augmented::LabelledCrop;
use crate::angle_classes::Labels;
use crate::error::{OrientationError, Result};
use crate::network::{OrientationCnn, crop_batch};

/// Crops near a class, in classes: the standard deviation of the bell by which they count.
const BELL: Labels = Labels::VonMises { sigma_classes: 4.0 };

/// Crops that go through the network at a time.
const BATCH: usize = 64;

/// Parameters by their names.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OrientationStart {
    /// The network's, but for its classes.
    pub parameters: StateDict,
    /// Those of the [`ClassImprint`].
    pub imprint: StateDict,
}

impl OrientationStart {
    /// The network with these parameters, and classes made from a part's crops.
    ///
    /// # Errors
    /// [`OrientationError::Start`] for parameters of another network.
    pub fn apply(&self, network: OrientationCnn, crops: &[LabelledCrop]) -> Result<OrientationCnn> {
        let (network, report) = state_dict::import(network, &self.parameters);
        let named = |missing: &Vec<String>| missing.iter().find(|name| !name.starts_with("classes.")).cloned();
        let wrong_shape = report.mismatched.first().map(|(name, ..)| name.clone());
        if let Some(name) = wrong_shape.or(named(&report.missing)).or(report.unused.first().cloned()) {
            return Err(OrientationError::Start { name });
        }
        let layers = self.classes(&network.valid(), crops)?;
        Ok(state_dict::import(network, &layers).0)
    }

    fn classes(&self, network: &OrientationCnn, crops: &[LabelledCrop]) -> Result<StateDict> {
        let (classes, device) = (network.config().classes, network.device());
        let hidden = network.config().hidden;
        let blank = ClassImprint::init(hidden, &mut Initializer::blank(&device));
        let (imprint, report) = state_dict::import(blank, &self.imprint);
        if !report.is_complete() {
            return Err(OrientationError::Start { name: "imprint".to_owned() });
        }
        let num_classes = classes.num_classes;
        let mut sums = Tensor::<2>::zeros([num_classes, hidden], &device);
        let mut totals = vec![0f32; num_classes];
        for batch in crops.chunks(BATCH) {
            let images: Vec<RgbImage> = batch.iter().map(|one| one.crop.clone()).collect();
            let features = network.features(crop_batch(&images, &device));
            // [crops, K], each row a bell around the crop's angle.
            let bells: Vec<f32> = batch.iter().flat_map(|one| classes.targets(one.angle, BELL)).collect();
            bells.chunks_exact(num_classes).for_each(|bell| totals.iter_mut().zip(bell).for_each(|(t, b)| *t += b));
            let bells = Tensor::<2>::from_data(TensorData::new(bells, [batch.len(), num_classes]), &device);
            sums = sums + bells.transpose().matmul(features);
        }
        let totals: Vec<f32> = totals.into_iter().map(|total| total.max(f32::MIN_POSITIVE)).collect();
        let means = sums / Tensor::<1>::from_floats(totals.as_slice(), &device).reshape([num_classes, 1]);
        let (weights, biases) = imprint.classifier(means);
        let tensor = |shape, values| WeightTensor { shape, values };
        let values = |data: TensorData| data.iter::<f32>().collect::<Vec<f32>>();
        Ok(StateDict::from([
            ("classes.weight".to_owned(), tensor(vec![num_classes, hidden], values(weights.into_data()))),
            ("classes.bias".to_owned(), tensor(vec![num_classes], values(biases.into_data()))),
        ]))
    }
}
