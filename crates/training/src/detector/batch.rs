//! The batches of a detector: samples resized for the network, with ground truth.

use sdg_demonstration::{Sample, SampleObject};
use sdg_detection::config::{ImageTransformConfig, ResizeRule};
use sdg_detection::{ImageTransform, ObjectMask, Target, TransformedImage};
use sdg_geometry::Polygon;

use crate::error::TrainingError;
use crate::prefetch::BatchRequest;

/// The source of samples. Each sample depends only on its index.
#[derive(Clone, Copy)]
pub struct SampleSource<'a> {
    /// Whole frames, as in detection.
    pub frames: &'a (dyn Fn(u64) -> Sample + Sync),
    /// Windows of frames at the same scale, with most of the part if the scene has it; see [`crate::WindowPhase`].
    pub windows: &'a (dyn Fn(u64) -> Sample + Sync),
}

/// The kind of samples of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum View {
    Frame,
    Window,
}

/// The number of samples of a step, and their view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BatchKind {
    pub(crate) view: View,
    pub(crate) size: usize,
}

/// The images of one step and their targets.
pub(crate) struct Batch {
    pub(crate) images: Vec<TransformedImage>,
    pub(crate) targets: Vec<Target>,
}

/// Makes a batch: samples `step · size` to `step · size + size - 1` of its view.
pub(super) fn prepare(
    request: BatchRequest<BatchKind>,
    transform: &ImageTransformConfig,
    source: &SampleSource<'_>,
) -> Result<Batch, TrainingError> {
    let BatchRequest { step, kind: BatchKind { view, size } } = request;
    let mut batch = Batch { images: Vec::with_capacity(size), targets: Vec::with_capacity(size) };
    for i in (step * size)..(step + 1) * size {
        let sample = match view {
            View::Frame => (source.frames)(i as u64),
            View::Window => (source.windows)(i as u64),
        };
        let transform = match view {
            View::Frame => ImageTransform::new(transform),
            // A window already has its scale: it is not enlarged to the size of a frame.
            View::Window => ImageTransform::new(&ImageTransformConfig {
                resize: ResizeRule::FitWithin { width_px: sample.image.width(), height_px: sample.image.height() },
                ..transform.clone()
            }),
        };
        batch.images.push(transform.apply(&sample.image)?);
        batch.targets.push(target(&sample));
    }
    Ok(batch)
}

/// The first windows of a source and their targets.
///
/// # Errors
/// A window that the network rejects.
pub fn first_windows(
    count: usize,
    transform: &ImageTransformConfig,
    source: &SampleSource<'_>,
) -> Result<(Vec<TransformedImage>, Vec<Target>), TrainingError> {
    let windows = BatchRequest { step: 0, kind: BatchKind { view: View::Window, size: count } };
    let Batch { images, targets } = prepare(windows, transform, source)?;
    Ok((images, targets))
}

/// The ground truth of a sample, in pixels of its image, with a single class.
fn target(sample: &Sample) -> Target {
    Target {
        boxes: sample.objects.iter().map(|object| object.bbox).collect(),
        labels: vec![0; sample.objects.len()],
        keypoints: sample.objects.iter().map(|object| object.keypoints.clone()).collect(),
        masks: sample.objects.iter().map(|object| ObjectMask::from(outline(object))).collect(),
    }
}

/// The outline, or the box if none was drawn.
fn outline(object: &SampleObject) -> Polygon {
    object.outline.clone().unwrap_or_else(|| Polygon::from_box(&object.bbox))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prefetch::with_batches;
    use image::{Rgb, RgbImage};
    use sdg_detection::presets;

    fn sample(width: u32, index: u64) -> Sample {
        Sample { image: RgbImage::from_pixel(width, 32, Rgb([index as u8; 3])), objects: Vec::new() }
    }

    fn first_pixels(requests: &[BatchRequest<BatchKind>]) -> Vec<(usize, f32)> {
        let source = SampleSource { frames: &|i| sample(320, i), windows: &|i| sample(64, 100 + i) };
        let transform = presets::edge(12).input;
        with_batches(
            |request| prepare(request, &transform, &source),
            |batches| {
                requests
                    .iter()
                    .map(|request| batches.next(*request).unwrap())
                    .map(|b| (b.images[0].width, b.images[0].pixels[0]))
                    .collect()
            },
        )
    }

    #[test]
    fn what_was_prepared_ahead_for_another_view_is_thrown_away() {
        let window = |step| BatchRequest { step, kind: BatchKind { view: View::Window, size: 3 } };
        let frame = |step| BatchRequest { step, kind: BatchKind { view: View::Frame, size: 2 } };
        let mixed = first_pixels(&[window(0), window(1), frame(2), frame(3)]);
        let apart = [first_pixels(&[window(0), window(1)]), first_pixels(&[frame(2), frame(3)])].concat();
        assert_eq!(mixed, apart);
        // Windows keep their scale, frames fill the network's input.
        assert_eq!(mixed.iter().map(|(width, _)| *width).collect::<Vec<_>>(), [64, 64, 320, 320]);
    }
}
