//! Batches, prepared on another thread while the network is busy with the one before.

use std::collections::VecDeque;
use std::sync::mpsc;

use sdg_demonstration::{Sample, SampleObject};
use sdg_detection::config::{ImageTransformConfig, ResizeRule};
use sdg_detection::{ImageTransform, ObjectMask, Target, TransformedImage};
use sdg_geometry::Polygon;

use crate::error::TrainingError;

/// Where samples come from: each a function of its index alone.
#[derive(Clone, Copy)]
pub struct SampleSource<'a> {
    /// Whole frames, as the detector will see them.
    pub frames: &'a (dyn Fn(u64) -> Sample + Sync),
    /// Windows of frames at the same scale, with most of the part in each; see [`crate::WindowPhase`].
    pub windows: &'a (dyn Fn(u64) -> Sample + Sync),
}

/// What the samples of a step are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum View {
    Frame,
    Window,
}

/// A batch that is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BatchRequest {
    pub(crate) step: usize,
    pub(crate) view: View,
    pub(crate) size: usize,
}

/// The images of one step and what is in them.
pub(crate) struct Batch {
    pub(crate) images: Vec<TransformedImage>,
    pub(crate) targets: Vec<Target>,
}

/// Batches asked for ahead: one in use, one ready, one in the making.
const AHEAD: usize = 2;

/// Makes a batch: samples `step · size` to `step · size + size - 1` of its view.
fn prepare(
    request: BatchRequest,
    transform: &ImageTransformConfig,
    source: &SampleSource<'_>,
) -> Result<Batch, TrainingError> {
    let BatchRequest { step, view, size } = request;
    let mut batch = Batch { images: Vec::with_capacity(size), targets: Vec::with_capacity(size) };
    for i in (step * size)..(step + 1) * size {
        let sample = match view {
            View::Frame => (source.frames)(i as u64),
            View::Window => (source.windows)(i as u64),
        };
        let transform = match view {
            View::Frame => ImageTransform::new(transform),
            // A window has its scale already: it is not enlarged to the size of a frame.
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

/// The first windows of a source and what is in them.
///
/// # Errors
/// A window that the network refuses.
pub fn first_windows(
    count: usize,
    transform: &ImageTransformConfig,
    source: &SampleSource<'_>,
) -> Result<(Vec<TransformedImage>, Vec<Target>), TrainingError> {
    let Batch { images, targets } =
        prepare(BatchRequest { step: 0, view: View::Window, size: count }, transform, source)?;
    Ok((images, targets))
}

/// The truth of a sample, in pixels of its image; one class.
fn target(sample: &Sample) -> Target {
    Target {
        boxes: sample.objects.iter().map(|object| object.bbox).collect(),
        labels: vec![0; sample.objects.len()],
        keypoints: sample.objects.iter().map(|object| object.keypoints.clone()).collect(),
        masks: sample.objects.iter().map(|object| ObjectMask::from(outline(object))).collect(),
    }
}

/// The outline, or the box where none was drawn.
fn outline(object: &SampleObject) -> Polygon {
    object.outline.clone().unwrap_or_else(|| Polygon::from_box(&object.bbox))
}

/// Batches in the order of their steps, prepared ahead on another thread.
pub(crate) struct Batches {
    requests: mpsc::Sender<BatchRequest>,
    batches: mpsc::Receiver<Result<Batch, TrainingError>>,
    pending: VecDeque<BatchRequest>,
}

impl Batches {
    /// The batch that is wanted. The ones after it are asked for as if nothing changed; when something did, they are
    /// thrown away, so that what is trained on depends on the requests alone and not on which thread was faster.
    pub(crate) fn next(&mut self, wanted: BatchRequest) -> Result<Batch, TrainingError> {
        if self.pending.front().is_some_and(|first| *first != wanted) {
            while self.pending.pop_front().is_some() {
                let _ = self.receive();
            }
        }
        for step in wanted.step + self.pending.len()..=wanted.step + AHEAD {
            let request = BatchRequest { step, ..wanted };
            self.pending.push_back(request);
            // Fails only when the thread has ended, which receiving then tells.
            let _ = self.requests.send(request);
        }
        self.pending.pop_front();
        self.receive()
    }

    fn receive(&mut self) -> Result<Batch, TrainingError> {
        match self.batches.recv() {
            Ok(batch) => batch,
            // The thread ends early only by a panic, which the scope raises again.
            Err(mpsc::RecvError) => panic!("the thread that prepares batches ended"),
        }
    }
}

/// Runs `consume` while another thread prepares the batches that it asks for. The thread ends with `consume`.
pub(crate) fn with_batches<T>(
    transform: &ImageTransformConfig,
    source: SampleSource<'_>,
    consume: impl FnOnce(&mut Batches) -> T,
) -> T {
    std::thread::scope(|scope| {
        let (requests, asked) = mpsc::channel::<BatchRequest>();
        let (sender, batches) = mpsc::channel();
        scope.spawn(move || {
            for request in asked {
                // An error here means that nobody waits any more.
                if sender.send(prepare(request, transform, &source)).is_err() {
                    return;
                }
            }
        });
        consume(&mut Batches { requests, batches, pending: VecDeque::new() })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, RgbImage};
    use sdg_detection::presets;

    fn sample(width: u32, index: u64) -> Sample {
        Sample { image: RgbImage::from_pixel(width, 32, Rgb([index as u8; 3])), objects: Vec::new() }
    }

    fn first_pixels(requests: &[BatchRequest]) -> Vec<(usize, f32)> {
        let source = SampleSource { frames: &|i| sample(320, i), windows: &|i| sample(64, 100 + i) };
        with_batches(&presets::edge(12).input, source, |batches| {
            requests
                .iter()
                .map(|request| batches.next(*request).unwrap())
                .map(|b| (b.images[0].width, b.images[0].pixels[0]))
                .collect()
        })
    }

    #[test]
    fn what_was_prepared_ahead_for_another_view_is_thrown_away() {
        let window = |step| BatchRequest { step, view: View::Window, size: 3 };
        let frame = |step| BatchRequest { step, view: View::Frame, size: 2 };
        let mixed = first_pixels(&[window(0), window(1), frame(2), frame(3)]);
        let apart = [first_pixels(&[window(0), window(1)]), first_pixels(&[frame(2), frame(3)])].concat();
        assert_eq!(mixed, apart);
        // Windows keep their scale, frames fill the network's input.
        assert_eq!(mixed.iter().map(|(width, _)| *width).collect::<Vec<_>>(), [64, 64, 320, 320]);
    }
}
