//! Pretrained initial parameters for training: a trunk, and a network that computes the angle classes from a part's own
//! crops.
//!
//! The score of every class uses the mean of the features of the crops near its angle, see [`ClassImprint`].

use burn::module::Module;
use burn::tensor::{Tensor, TensorData};
use image::RgbImage;
use sdg_detection::imprint::ClassImprint;
use sdg_layers::initialization::Initializer;
use sdg_layers::state_dict::{self, StateDict, WeightTensor};
use sdg_orientation::{Labels, OrientationCnn, crop_batch};

use super::labelled_crop::LabelledCrop;
use crate::error::TrainingError;

/// The bell by which crops near a class are weighted, with its standard deviation in classes.
const BELL: Labels = Labels::VonMises { sigma_classes: 4.0 };

/// Number of crops evaluated at a time.
const BATCH: usize = 64;

/// Parameters by their names.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OrientationStart {
    /// The parameters of the network, except its classes.
    pub parameters: StateDict,
    /// Parameters of the [`ClassImprint`], by their names.
    pub imprint: StateDict,
}

impl OrientationStart {
    /// The network with these parameters, and classes computed from a part's crops.
    ///
    /// # Errors
    /// [`TrainingError::Start`] for parameters of another network.
    pub fn apply(&self, network: OrientationCnn, crops: &[LabelledCrop]) -> Result<OrientationCnn, TrainingError> {
        let (network, report) = state_dict::import(network, &self.parameters);
        let named = |missing: &Vec<String>| missing.iter().find(|name| !name.starts_with("classes.")).cloned();
        let wrong_shape = report.mismatched.first().map(|(name, ..)| name.clone());
        if let Some(name) = wrong_shape.or(named(&report.missing)).or(report.unused.first().cloned()) {
            return Err(TrainingError::Start { name });
        }
        let layers = self.classes(&network.valid(), crops)?;
        Ok(state_dict::import(network, &layers).0)
    }

    fn classes(&self, network: &OrientationCnn, crops: &[LabelledCrop]) -> Result<StateDict, TrainingError> {
        let (classes, device) = (network.config().classes, network.device());
        let hidden = network.config().hidden;
        let blank = ClassImprint::init(hidden, &mut Initializer::blank(&device));
        let (imprint, report) = state_dict::import(blank, &self.imprint);
        if !report.is_complete() {
            return Err(TrainingError::Start { name: "imprint".to_owned() });
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

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use sdg_geometry::Angle;
    use sdg_orientation::OrientationConfig;

    fn config() -> OrientationConfig {
        OrientationConfig {
            input_px: 32,
            stage_channels: vec![8, 16],
            stage_convs: vec![1, 1],
            hidden: 32,
            ..OrientationConfig::edge()
        }
    }

    /// A bar from red to green at an angle.
    fn crop(degrees: f64) -> LabelledCrop {
        let angle = Angle::from_degrees(degrees);
        let crop = RgbImage::from_fn(32, 32, |x, y| {
            let (x, y) = (f64::from(x) - 15.5, f64::from(y) - 15.5);
            let (sin, cos) = angle.radians().sin_cos();
            let (along, across) = (x * cos + y * sin, y * cos - x * sin);
            Rgb(match (along.abs() < 13.0 && across.abs() < 4.0, along < 0.0) {
                (true, true) => [230, 20, 20],
                (true, false) => [20, 230, 20],
                _ => [40, 40, 40],
            })
        });
        LabelledCrop { crop, angle }
    }

    fn start() -> OrientationStart {
        let mut parameters = state_dict::export(&config().init(&burn::tensor::Device::flex(), 3).unwrap());
        parameters.retain(|name, _| !name.starts_with("classes."));
        let mut init = Initializer::new(&burn::tensor::Device::flex(), 5);
        OrientationStart { parameters, imprint: state_dict::export(&ClassImprint::init(32, &mut init)) }
    }

    #[test]
    fn classes_of_crops_read_the_angle_before_anything_is_taught() {
        // Even the features of an untrained network differ from angle to angle.
        let crops: Vec<LabelledCrop> = (0..240).map(|i| crop(1.5 * f64::from(i))).collect();
        let fresh = config().init(&burn::tensor::Device::flex(), 9).unwrap();
        let untaught = fresh.predict(&crops[10].crop).unwrap();
        let network = start().apply(fresh, &crops).unwrap();
        for degrees in [3.0, 50.0, 161.0, -100.0] {
            let read = network.predict(&crop(degrees).crop).unwrap().angle;
            let error = read.distance(Angle::from_degrees(degrees)).to_degrees();
            assert!(error < 15.0, "{degrees}: {read:?}, untaught {untaught:?}");
        }
    }

    #[test]
    fn parameters_of_another_network_are_refused_by_name() {
        let mut other = start();
        other.parameters.remove("hidden.bias");
        let fresh = config().init(&burn::tensor::Device::flex(), 9).unwrap();
        let error = other.apply(fresh.clone(), &[crop(0.0)]).unwrap_err().to_string();
        assert!(error.contains("hidden.bias"), "{error}");
        let mut other = start();
        other.imprint.clear();
        assert!(other.apply(fresh, &[crop(0.0)]).unwrap_err().to_string().contains("imprint"));
    }
}
