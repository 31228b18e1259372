//! The network of each model, and the conversion of its output to a pose of the demonstration.
//!
//! | model | network | position | orientation |
//! |---|---|---|---|
//! | A ([`orientation`]) | Faster R-CNN, orientation CNN | box ([`placing`]) | class of the box's crop |
//! | B ([`keypoints`]) | Keypoint R-CNN | box ([`placing`]) | line through the keypoints |
//! | C ([`keypoints`]) | Keypoint R-CNN | keypoints | keypoints |
//! | D ([`mask`]) | Mask R-CNN | texture or outline of the masked area | likewise |
//! | S | none | search for the demonstration in the whole image | likewise |

pub(crate) mod candidate;
mod comparison;
mod consistency;
mod keypoints;
pub(crate) mod mask;
mod orientation;
mod placing;

use burn::module::Module;
use burn::tensor::Device;
#[cfg(feature = "teach")]
use burn::tensor::read_sync;
use image::RgbImage;
use sdg_comparison::ComparisonNetwork;
#[cfg(any(feature = "teach", test))]
use sdg_detection::presets::RcnnKind;
use sdg_detection::{Detections, GeneralizedRcnn, RcnnConfig};
#[cfg(feature = "teach")]
use sdg_layers::state_dict;
use sdg_orientation::OrientationCnn;

pub(crate) use self::candidate::{PoseCandidate, Proposals};
use self::comparison::Comparer;
use self::mask::MaskMatcher;
use self::placing::PoseReading;
use crate::NUM_KEYPOINTS;
use crate::error::{GraspError, Result};
use crate::facts::ModelKind;
use crate::taught::TaughtDemonstration;

/// Maximum number of candidates used in one image, best first; the verification of each takes time, and the search
/// finds the other parts. Chosen by hand, not measured.
const MAX_CANDIDATES: usize = 16;
/// Boxes of a lower score are dropped: Detectron2's threshold at test time.
const MIN_NETWORK_SCORE: f64 = 0.05;

/// A model's networks. Model S has none.
#[derive(Debug, Clone)]
pub(crate) struct Network {
    pub(crate) detector: GeneralizedRcnn,
    pub(crate) reading: Reading,
    /// Compares the image under a pose with the demonstration; `None` if the base weights contained none.
    pub(crate) comparison: Option<ComparisonNetwork>,
}

/// How a detection is converted to a pose of the demonstration.
#[derive(Debug, Clone)]
pub(crate) enum Reading {
    /// Model A.
    BoxAndCrop(Box<OrientationCnn>),
    /// Model B.
    BoxAndKeypoints,
    /// Model C.
    Keypoints,
    /// Model D.
    Mask(MaskMatcher),
}

/// The kind of a model's detector; `None` for model S.
#[cfg(any(feature = "teach", test))]
pub(crate) fn rcnn_kind(kind: ModelKind) -> Option<RcnnKind> {
    match kind {
        ModelKind::A => Some(RcnnKind::Faster { num_classes: 1 }),
        ModelKind::B | ModelKind::C => Some(RcnnKind::Keypoint { num_keypoints: NUM_KEYPOINTS }),
        ModelKind::D => Some(RcnnKind::Mask { num_classes: 1 }),
        ModelKind::S => None,
    }
}

impl Network {
    /// The kind of the model.
    pub(crate) fn kind(&self) -> ModelKind {
        match self.reading {
            Reading::BoxAndCrop(_) => ModelKind::A,
            Reading::BoxAndKeypoints => ModelKind::B,
            Reading::Keypoints => ModelKind::C,
            Reading::Mask(_) => ModelKind::D,
        }
    }

    /// The usual threshold of the scores of networks of this kind, in log-odds; `None` without a comparison network.
    #[cfg(feature = "teach")]
    pub(crate) fn usual_threshold(&self) -> Option<f64> {
        self.comparison.as_ref().map(|_| consistency::USUAL_THRESHOLD)
    }

    /// The same detector used for another kind of model that is taught in the same way; `None` for other kinds.
    pub(crate) fn read_as(self, kind: ModelKind) -> Option<Self> {
        let reading = match (self.reading, kind) {
            (Reading::BoxAndKeypoints | Reading::Keypoints, ModelKind::B) => Reading::BoxAndKeypoints,
            (Reading::BoxAndKeypoints | Reading::Keypoints, ModelKind::C) => Reading::Keypoints,
            _ => return None,
        };
        Some(Self { reading, ..self })
    }

    /// The network for resized demonstrations.
    ///
    /// # Errors
    /// A demonstration with too few features for model D.
    pub(crate) fn with_demonstrations(self, demonstrations: &[TaughtDemonstration]) -> Result<Self> {
        let reading = match self.reading {
            Reading::Mask(_) => Reading::Mask(MaskMatcher::new(demonstrations)?),
            other => other,
        };
        Ok(Self { reading, ..self })
    }

    /// The network as stored in a file: every weight rounded to half precision.
    #[cfg(feature = "teach")]
    pub(crate) fn rounded(self) -> Self {
        fn round<M: Module>(module: M) -> M {
            let mut weights = state_dict::export(&module);
            for value in weights.values_mut().flat_map(|weight| &mut weight.values) {
                *value = half::f16::from_f32(*value).to_f32();
            }
            state_dict::import(module, &weights).0
        }
        let reading = match self.reading {
            Reading::BoxAndCrop(orientation) => Reading::BoxAndCrop(Box::new(round(*orientation))),
            other => other,
        };
        Self { detector: round(self.detector), reading, comparison: self.comparison.map(round) }
    }

    pub(crate) fn moved_to(self, device: &Device) -> Self {
        let reading = match self.reading {
            Reading::BoxAndCrop(orientation) => Reading::BoxAndCrop(Box::new(orientation.to_device(device))),
            other => other,
        };
        let comparison = self.comparison.map(|network| network.to_device(device));
        Self { detector: self.detector.to_device(device), reading, comparison }
    }

    /// The network's candidates, best first, and all its boxes. Boxes that give no pose (coincident keypoints, a mask
    /// without an orientation) have no candidate.
    ///
    /// # Errors
    /// An image that is invalid for the network.
    #[cfg(feature = "teach")]
    pub(crate) fn proposals(&self, image: &RgbImage, demonstrations: &[TaughtDemonstration]) -> Result<Proposals> {
        read_sync(self.proposals_async(image, image.dimensions().into(), demonstrations))
    }

    /// [`Self::proposals`], asynchronous, in a region of a picture of size `whole`; the network gets the region's
    /// pixels at the scale used for the whole picture, and the part's possible sizes are those in the whole picture.
    ///
    /// # Errors
    /// As for [`Self::proposals`].
    pub(crate) async fn proposals_async(
        &self,
        image: &RgbImage,
        whole: [u32; 2],
        demonstrations: &[TaughtDemonstration],
    ) -> Result<Proposals> {
        let transformed = self.detector.image_transform().apply_part(image, whole)?;
        let detections = self.detector.detect_async(&[transformed]).await.pop().unwrap_or_default();
        let proposed = (0..detections.scores.len()).filter(|&i| detections.scores[i] >= MIN_NETWORK_SCORE);
        let mut read = Vec::new();
        for i in proposed.clone().take(MAX_CANDIDATES) {
            read.extend(self.read(image, &detections, i, demonstrations).await?);
        }
        let scored = read.into_iter().map(|one| {
            let demonstration = &demonstrations[one.demonstration_idx];
            let pose = one.image_from_cutout;
            one.in_pose(demonstration, pose, whole, None)
        });
        let mut candidates: Vec<PoseCandidate> = scored.collect();
        comparison::best_first(&mut candidates, |one| one);
        if let Some(network) = &self.comparison {
            candidates = Comparer::new(network, image, whole, demonstrations).compare(candidates).await;
        }
        let mut proposals = Proposals::default();
        let unread = |i: usize| (detections.boxes[i], consistency::score(detections.scores[i], 0.0, None));
        proposals.boxes.extend(proposed.map(unread));
        proposals.boxes.extend(candidates.iter().map(|candidate| (candidate.bbox, candidate.network_score)));
        proposals.candidates = candidates;
        Ok(proposals)
    }

    async fn read(
        &self,
        image: &RgbImage,
        detections: &Detections,
        i: usize,
        demonstrations: &[TaughtDemonstration],
    ) -> Result<Option<PoseCandidate>> {
        let bbox = &detections.boxes[i];
        let keypoints = keypoints::scored(detections, i);
        let pose = match &self.reading {
            Reading::BoxAndCrop(network) => orientation::box_and_crop(network, image, bbox, demonstrations).await?,
            Reading::BoxAndKeypoints => keypoints::box_and_turn(&keypoints, bbox, demonstrations),
            Reading::Keypoints => keypoints::on_line(&keypoints, bbox, demonstrations),
            Reading::Mask(matcher) => matcher.place(image, &detections.masks[i], bbox, demonstrations)?,
        };
        Ok(pose.and_then(|PoseReading { demonstration_idx, image_from_cutout, turn_source }| {
            let demonstration = &demonstrations[demonstration_idx];
            let grasp = match self.reading {
                Reading::Keypoints => {
                    keypoints::grasp(&keypoints, demonstration.marks.width_px * image_from_cutout.scale)?
                }
                _ => demonstration.grasp(&image_from_cutout),
            };
            Some(PoseCandidate {
                class_probability: detections.scores[i],
                network_score: detections.scores[i],
                bbox: *bbox,
                keypoints,
                grasp,
                demonstration_idx,
                image_from_cutout,
                turn_source,
            })
        }))
    }
}

/// Rejects a detector whose kind differs from the model's, as in a forged file.
///
/// # Errors
/// [`GraspError::Damaged`] names the expected heads.
pub(crate) fn check_heads(kind: ModelKind, config: &RcnnConfig) -> Result<()> {
    let heads = &config.roi_heads;
    let keypoints = heads.keypoint_head.as_ref().map(|head| head.num_keypoints);
    let (expected_keypoints, expected_masks) = match kind {
        ModelKind::A | ModelKind::S => (None, false),
        ModelKind::B | ModelKind::C => (Some(NUM_KEYPOINTS), false),
        ModelKind::D => (None, true),
    };
    if keypoints == expected_keypoints && heads.mask_head.is_some() == expected_masks && heads.num_classes == 1 {
        return Ok(());
    }
    let describe = |keypoints: Option<usize>, masks: bool, classes: usize| {
        let masks = if masks { "masks" } else { "no masks" };
        format!("a network of {classes} class with {} keypoints and {masks}", keypoints.unwrap_or(0))
    };
    Err(GraspError::Damaged {
        expected: describe(expected_keypoints, expected_masks, 1),
        found: describe(keypoints, heads.mask_head.is_some(), heads.num_classes),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::teach::tests::demonstration;
    use image::imageops::crop_imm;
    use sdg_detection::presets::edge_of;

    #[test]
    fn the_possible_sizes_in_a_region_are_those_in_the_whole_picture() {
        let demonstration = demonstration();
        let demonstrations = [TaughtDemonstration::new(&demonstration).unwrap()];
        let detector = edge_of(rcnn_kind(ModelKind::B).unwrap()).init(&Device::flex(), 1).unwrap();
        let network = Network { detector, reading: Reading::BoxAndKeypoints, comparison: None };
        let whole: [u32; 2] = demonstration.image.dimensions().into();
        let region = crop_imm(&demonstration.image, 48, 24, 96, 96).to_image();
        let proposals = read_sync(network.proposals_async(&region, whole, &demonstrations)).unwrap();
        let score = |one: &PoseCandidate, picture_size: [u32; 2]| {
            let filled = consistency::filled(&demonstrations[0], &one.image_from_cutout, &one.bbox, picture_size);
            consistency::score(one.class_probability, filled, None)
        };
        // An untaught network has boxes of many sizes, some of which the part could have only in a picture as small as
        // the region.
        let in_region = |one: &PoseCandidate| score(one, region.dimensions().into());
        assert!(proposals.candidates.iter().any(|one| in_region(one) != score(one, whole)), "{proposals:?}");
        for one in &proposals.candidates {
            assert_eq!(one.network_score, score(one, whole), "{one:?}");
        }
    }
}
