//! R50-FPN from imported weights, for a computer with two cores.

use sdg_demonstration::MIN_SAMPLE_SIDE_PX;
use sdg_detection::RcnnConfig;
use sdg_detection::config::{ResizeRule, SizeRounding};
use sdg_detection::image_transform::resized_size;
use sdg_training::{OneCycle, TrainingConfig, ValidationConfig, WindowPhase};

/// Short side of the images in teaching and detection with an R50. Chosen by hand to save time; its effect on accuracy
/// was not measured.
const SHORT_SIDE_PX: u32 = 480;
/// Long side of the largest samples: that of the largest images in detection.
const MAX_LONG_SIDE_PX: u32 = 1333;

/// Width and height of the samples of a photo. They have the photo's shape: the size of an R50's input depends on the
/// image's shape, and the network must learn the part at the scale at which it detects it.
pub(super) fn sample_size([width, height]: [u32; 2]) -> [u32; 2] {
    let rule = ResizeRule::ShortSide {
        short_px: SHORT_SIDE_PX,
        max_long_px: MAX_LONG_SIDE_PX,
        rounding: SizeRounding::Nearest,
    };
    let (width, height) = resized_size(rule, width, height);
    [width, height].map(|side| (side as u32).max(MIN_SAMPLE_SIDE_PX))
}

/// An R50 with the numerics of its weights, except for two changes that save minutes on such a computer. Images are not
/// enlarged to 800 pixels, which adds no detail to a photo 480 pixels high. COCO images show dozens of objects, but
/// demonstrations show one, so that fewer regions go through the heads; the keypoint head takes 7 GFLOP for each. The
/// numbers were chosen by hand to save time; their effect on accuracy was not measured.
pub(super) fn on_two_cores(mut config: RcnnConfig) -> RcnnConfig {
    const MAX_PROPOSALS: usize = 100;
    const MAX_DETECTIONS: usize = 5;
    const ROIS_PER_IMAGE: usize = 128;
    const MAX_KEYPOINT_OR_MASK_ROIS: usize = 2;
    if let ResizeRule::ShortSide { short_px, .. } = &mut config.input.resize {
        *short_px = SHORT_SIDE_PX;
    }
    config.rpn.post_nms_top_n.test = MAX_PROPOSALS;
    config.roi_heads.sampler.batch_size_per_image = ROIS_PER_IMAGE;
    config.roi_heads.box_head.detections_per_image = MAX_DETECTIONS;
    if let Some(head) = &mut config.roi_heads.keypoint_head {
        head.max_train_rois_per_image = Some(MAX_KEYPOINT_OR_MASK_ROIS);
    }
    if let Some(head) = &mut config.roi_heads.mask_head {
        head.max_train_rois_per_image = Some(MAX_KEYPOINT_OR_MASK_ROIS);
    }
    config
}

/// Training with a lower learning rate, to preserve the imported weights, and with fewer steps, because each takes
/// longer. Chosen by hand, not measured.
pub(super) fn fine_tuning(seed: u64) -> TrainingConfig {
    TrainingConfig {
        steps: 200,
        batch_size: 2,
        windows: Some(WindowPhase { share: 0.7, batch_size: 6 }),
        schedule: OneCycle { peak: 2e-4, warm_up: 0.2 },
        validation: ValidationConfig { every: 40, first: 80, samples: 24 },
        ..TrainingConfig::edge(seed)
    }
}
