//! The network: computes logits of angle classes from a batch of crops, and angles from the logits.
//!
//! Shapes: N crops, C channels, S the input's side, M the last map's side, K angle classes.
//!
//! The last map is flattened, not averaged, because the position of a feature in the crop determines the angle.

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData, activation, read_sync};
use image::RgbImage;
use image::imageops::{rotate90, rotate180, rotate270};
use sdg_layers::state_dict::{self, ImportReport, StateDict};
use sdg_layers::{ConvNormRelu, Distribution, Initializer, Linear, Stage};
use sdg_picture::OUTSIDE;

use crate::angle_classes::AngleReading;
use crate::config::OrientationConfig;
use crate::error::{OrientationError, Result};

/// Grey values per unit of the network's input: about the standard deviation of photos.
const GREY_VALUES_PER_UNIT: f32 = 58.0;

/// Stages of convolutions that each halve the map, and two fully connected layers: logits of the angle classes.
#[derive(Module, Debug)]
pub struct OrientationCnn {
    /// From the crop to the last map.
    pub stages: Vec<Stage>,
    /// Fully connected layer, from the flattened last map.
    pub hidden: Linear,
    /// Fully connected layer, to the logits.
    pub classes: Linear,
    #[module(skip)]
    config: OrientationConfig,
}

impl OrientationConfig {
    /// Builds the network with random parameters from a seed.
    ///
    /// For training the device must carry autodiff (`device.autodiff()`; crate `training` has the feature).
    ///
    /// # Errors
    /// The errors of [`OrientationConfig::validate`].
    pub fn init(&self, device: &Device, seed: u64) -> Result<OrientationCnn> {
        self.build(Initializer::new(device, seed))
    }

    /// Builds the network on `device` without initial values, for a caller that then sets all parameters.
    ///
    /// # Errors
    /// As for [`Self::init`].
    pub fn init_blank(&self, device: &Device) -> Result<OrientationCnn> {
        self.build(Initializer::blank(device))
    }

    fn build(&self, mut init: Initializer) -> Result<OrientationCnn> {
        self.validate()?;
        let mut in_channels = 3;
        let mut stages = Vec::with_capacity(self.stage_channels.len());
        for (stage, (&channels, &num_convs)) in self.stage_channels.iter().zip(&self.stage_convs).enumerate() {
            let convs = (0..num_convs)
                .map(|conv| {
                    let kernel = if stage == 0 && conv == 0 { self.stem_kernel } else { 3 };
                    let stride = if conv == 0 { 2 } else { 1 };
                    let shape = [channels, in_channels, kernel, kernel];
                    in_channels = channels;
                    ConvNormRelu::init(shape, stride, self.norm_groups, &mut init)
                })
                .collect();
            stages.push(Stage { convs });
        }
        let flat = in_channels * self.last_map_px().pow(2);
        let hidden = Linear::init(flat, self.hidden, Distribution::he_normal(flat), &mut init);
        // Small initial weights, so that all angles are about equally likely at first.
        let classes =
            Linear::init(self.hidden, self.classes.num_classes, Distribution::Normal { std: 0.01 }, &mut init);
        Ok(OrientationCnn { stages, hidden, classes, config: self.clone() })
    }
}

impl OrientationCnn {
    /// The configuration of the network.
    pub fn config(&self) -> &OrientationConfig {
        &self.config
    }

    /// The device of the parameters, including autodiff.
    pub fn device(&self) -> Device {
        self.classes.weight.val().device()
    }

    /// Returns the logits of a batch from [`crop_batch`].
    ///
    /// # Shapes
    /// - `crops`: `[N, 3, S, S]`
    /// - output: `[N, K]`
    pub fn forward(&self, crops: Tensor<4>) -> Tensor<2> {
        self.classes.forward(self.features(crops))
    }

    /// Returns the output of the hidden layer, `[N, hidden]`, from which the classes are computed.
    ///
    /// # Shapes
    /// - `crops`: `[N, 3, S, S]`
    pub fn features(&self, crops: Tensor<4>) -> Tensor<2> {
        let [n, channels, height, width] = crops.dims();
        let side = self.config.input_px as usize;
        assert_eq!([channels, height, width], [3, side, side], "expected crops of [N, 3, S, S]");
        let convs = self.stages.iter().flat_map(|stage| &stage.convs);
        let map = convs.fold(crops, |x, conv| conv.forward(x));
        let flat: Tensor<2> = map.reshape([n as i64, -1]);
        activation::relu(self.hidden.forward(flat))
    }

    /// Estimates the angle of the part on a crop.
    ///
    /// # Units and frames
    /// The direction of the marked grasp line in the crop, `atan2(dy, dx)` with y down; within the part's symmetry.
    /// Crops of detected boxes are not rotated, so the angle is also the direction in the image.
    ///
    /// # Errors
    /// [`OrientationError::CropSize`] for a crop whose size is not [`OrientationConfig::input_px`].
    pub fn predict(&self, crop: &RgbImage) -> Result<AngleReading> {
        read_sync(self.predict_async(crop))
    }

    /// [`Self::predict`], asynchronous, for browsers, which give access to a graphics card's results only in this way.
    ///
    /// # Errors
    /// The errors of [`Self::predict`].
    pub async fn predict_async(&self, crop: &RgbImage) -> Result<AngleReading> {
        let expected = self.config.input_px;
        if crop.dimensions() != (expected, expected) {
            let (width, height) = crop.dimensions();
            return Err(OrientationError::CropSize { expected, width, height });
        }
        let readout = self.config.readout;
        let logits = if readout.quarter_turns {
            let turned = [crop.clone(), rotate90(crop), rotate180(crop), rotate270(crop)];
            self.log_probabilities(&turned).await
        } else {
            self.log_probabilities(std::slice::from_ref(crop)).await
        };
        Ok(self.config.classes.read(&self.combined(&logits), readout.window_classes))
    }

    /// Logarithms of the classes' probabilities for each crop.
    async fn log_probabilities(&self, crops: &[RgbImage]) -> Vec<Vec<f32>> {
        let logits = self.forward(crop_batch(crops, &self.device()));
        let read = activation::log_softmax(logits, 1).into_data_async().await;
        let values: Vec<f32> = read.expect("expected readable results of the device").iter::<f32>().collect();
        values.chunks_exact(self.config.classes.num_classes).map(<[f32]>::to_vec).collect()
    }

    /// Combines the distributions of a crop at equally spaced rotations (clockwise as seen, which adds to the angle) by
    /// the normalised geometric mean: a class that is improbable at one rotation stays improbable.
    fn combined(&self, log_probabilities: &[Vec<f32>]) -> Vec<f64> {
        let (k, turns) = (self.config.classes.num_classes, log_probabilities.len());
        let mean_log: Vec<f64> = (0..k)
            .map(|class| {
                let of_turn = |(turn, row): (usize, &Vec<f32>)| {
                    f64::from(row[(class + turn * self.config.classes.symmetry * k / turns) % k])
                };
                log_probabilities.iter().enumerate().map(of_turn).sum::<f64>() / turns as f64
            })
            .collect();
        let highest = mean_log.iter().copied().fold(f64::MIN, f64::max);
        let weights: Vec<f64> = mean_log.iter().map(|log| (log - highest).exp()).collect();
        let sum: f64 = weights.iter().sum();
        weights.into_iter().map(|weight| weight / sum).collect()
    }

    /// Copies every parameter to the host, by name.
    pub fn state_dict(&self) -> StateDict {
        state_dict::export(self)
    }

    /// Sets every parameter for which `dict` has an entry of the correct shape, and reports the rest.
    pub fn with_state_dict(self, dict: &StateDict) -> (Self, ImportReport) {
        state_dict::import(self, dict)
    }
}

/// Crops as the network's input, `[N, 3, S, S]`: the colour of [`OUTSIDE`] becomes zero.
///
/// # Panics
/// Without a crop, or with crops of several sizes.
pub fn crop_batch(crops: &[RgbImage], device: &Device) -> Tensor<4> {
    let (width, height) = crops.first().expect("expected at least one crop").dimensions();
    let num_pixels = (width * height) as usize;
    let mut values = vec![0f32; crops.len() * 3 * num_pixels];
    for (crop, planes) in crops.iter().zip(values.chunks_exact_mut(3 * num_pixels)) {
        assert_eq!(crop.dimensions(), (width, height), "expected crops of one size");
        for (channel, plane) in planes.chunks_exact_mut(num_pixels).enumerate() {
            let mean = f32::from(OUTSIDE[channel]);
            for (value, rgb) in plane.iter_mut().zip(crop.as_raw().chunks_exact(3)) {
                *value = (f32::from(rgb[channel]) - mean) / GREY_VALUES_PER_UNIT;
            }
        }
    }
    Tensor::from_data(TensorData::new(values, [crops.len(), 3, height as usize, width as usize]), device)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Readout;
    use image::Rgb;
    use sdg_geometry::Angle;

    /// Size in bytes of the paper's orientation CNN, which ours must not exceed.
    const PAPER_BYTES: usize = 8_000_000;

    fn tiny(quarter_turns: bool) -> OrientationCnn {
        let config = OrientationConfig {
            input_px: 32,
            stage_channels: vec![8, 16],
            stage_convs: vec![1, 1],
            hidden: 32,
            readout: Readout { window_classes: 16, quarter_turns },
            ..OrientationConfig::edge()
        };
        config.init(&Device::flex(), 5).unwrap()
    }

    fn pattern() -> RgbImage {
        RgbImage::from_fn(32, 32, |x, y| Rgb([(x * 8) as u8, (y * 7) as u8, ((x * y) % 251) as u8]))
    }

    fn half_precision_bytes(config: &OrientationConfig) -> usize {
        let network = config.init(&Device::flex(), 1).unwrap();
        network.state_dict().values().map(|tensor| 2 * tensor.values.len()).sum()
    }

    #[test]
    fn logits_have_a_row_a_crop() {
        let network = tiny(false);
        let logits = network.forward(crop_batch(&[pattern(), pattern(), pattern()], &Device::flex()));
        assert_eq!(logits.dims(), [3, 360]);
    }

    #[test]
    fn sizes_stay_below_the_papers() {
        let paper = half_precision_bytes(&OrientationConfig::paper());
        assert!((5_000_000..=PAPER_BYTES).contains(&paper), "{paper}");
        let edge = half_precision_bytes(&OrientationConfig::edge());
        assert!(edge < 2_000_000, "{edge}");
    }

    #[test]
    fn four_quarter_turns_make_the_reading_turn_with_the_crop() {
        // An untrained network gives arbitrary angles, but a crop rotated by 90° is evaluated at the same four
        // rotations.
        let network = tiny(true);
        let straight = network.predict(&pattern()).unwrap().angle;
        let clockwise = network.predict(&rotate90(&pattern())).unwrap().angle;
        let turn = (clockwise - straight).distance(Angle::from_degrees(90.0));
        assert!(turn.to_degrees() < 1e-3, "{straight:?} {clockwise:?}");
    }

    #[test]
    fn parameters_go_out_and_come_back_by_name() {
        let network = tiny(false);
        let dict = network.state_dict();
        assert_eq!(dict["stages.0.convs.0.weight"].shape, [8, 3, 5, 5]);
        assert_eq!(dict["classes.bias"].shape, [360]);
        let other = OrientationConfig { ..network.config().clone() }.init(&Device::flex(), 99).unwrap();
        let before = other.predict(&pattern()).unwrap();
        let (same, report) = other.with_state_dict(&dict);
        assert!(report.is_complete(), "{report:?}");
        let expected = network.predict(&pattern()).unwrap();
        assert_eq!(same.predict(&pattern()).unwrap(), expected);
        assert_ne!(before, expected);

        let mut lacking = dict.clone();
        lacking.remove("hidden.bias");
        let (_, report) = same.with_state_dict(&lacking);
        assert_eq!(report.missing, ["hidden.bias"]);
    }

    #[test]
    fn a_crop_of_another_size_is_an_error() {
        let error = tiny(false).predict(&RgbImage::new(32, 31)).unwrap_err().to_string();
        assert_eq!(error, "the orientation CNN reads crops of 32x32 pixels, found 32x31");
    }
}
