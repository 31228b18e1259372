//! Batches, prepared on another thread while the network is busy with the one before.

use std::sync::mpsc;

use sdg_demonstration::{Sample, SampleObject};
use sdg_detection::{ImageTransform, ObjectMask, Target, TransformedImage};
use sdg_geometry::Polygon;

use crate::error::TrainingError;

/// The images of one step and what is in them.
pub(crate) struct Batch {
    pub(crate) images: Vec<TransformedImage>,
    pub(crate) targets: Vec<Target>,
}

/// Batches that wait ready: one in use, one ready, one in the making.
const READY: usize = 2;

/// Makes the batch of a step: samples `step · size` to `step · size + size - 1`.
fn prepare(
    step: usize,
    size: usize,
    transform: &ImageTransform,
    sample: &(dyn Fn(u64) -> Sample + Sync),
) -> Result<Batch, TrainingError> {
    let mut batch = Batch { images: Vec::with_capacity(size), targets: Vec::with_capacity(size) };
    for i in 0..size {
        let sample = sample((step * size + i) as u64);
        batch.images.push(transform.apply(&sample.image)?);
        batch.targets.push(target(&sample));
    }
    Ok(batch)
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

/// Runs `consume` while another thread prepares batches in the order of their steps. The thread ends with `consume`.
pub(crate) fn with_batches<T>(
    size: usize,
    transform: &ImageTransform,
    sample: &(dyn Fn(u64) -> Sample + Sync),
    consume: impl FnOnce(&mut dyn FnMut() -> Result<Batch, TrainingError>) -> T,
) -> T {
    std::thread::scope(|scope| {
        let (sender, receiver) = mpsc::sync_channel(READY);
        scope.spawn(move || {
            for step in 0.. {
                let batch = prepare(step, size, transform, sample);
                let failed = batch.is_err();
                // An error here means that nobody waits any more.
                if sender.send(batch).is_err() || failed {
                    return;
                }
            }
        });
        let mut next = || match receiver.recv() {
            Ok(batch) => batch,
            // The thread ends early only after an error that was passed on, or by a panic, which the scope raises again.
            Err(mpsc::RecvError) => panic!("the thread that prepares batches ended"),
        };
        let result = consume(&mut next);
        drop(receiver);
        result
    })
}
