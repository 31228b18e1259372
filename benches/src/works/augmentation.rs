//! The augmentation of the paper SingleDemoGrasp: samples of one photo, with their boxes and keypoints.

use std::path::Path;

use anyhow::Result;
use sdg_demonstration::{AugmentationConfig, Augmenter};

use crate::protocol::Work;
use crate::works::demonstration::read_demonstration;
use crate::works::facts::facts;

/// Samples per run, as in `peers/augmentation.py`, if the threads divide their number.
const SAMPLES: usize = 64;

pub fn samples(demonstration: &Path, threads: usize) -> Result<Work> {
    let demonstration = read_demonstration(demonstration)?;
    let size =
        facts([("width", f64::from(demonstration.image.width())), ("height", f64::from(demonstration.image.height()))]);
    let augmenter = Augmenter::new(&[demonstration], AugmentationConfig::paper(), 1)?;
    let mut first = 0;
    let per_thread = (SAMPLES / threads).max(1);
    let pieces = per_thread * threads;
    let run = move || {
        std::thread::scope(|scope| {
            for thread in 0..threads {
                let (augmenter, from) = (&augmenter, first + (thread * per_thread) as u64);
                scope.spawn(move || {
                    for index in from..from + per_thread as u64 {
                        std::hint::black_box(augmenter.sample(index));
                    }
                });
            }
        });
        first += pieces as u64;
        Ok(())
    };
    Ok(Work { pieces, ..Work::new(size, run) })
}
