//! Our side of every work, through the crates' public interfaces.

mod args;
mod augmentation;
mod demonstration;
mod edge;
mod facts;
mod gemm;
mod r50;
mod teaching;

use anyhow::{Context, Result, bail};

pub use args::WorkArgs;
pub use demonstration::read_demonstration;

use crate::network::Network;
use crate::protocol::Work;

/// Builds the work with the name in `args`.
pub fn build(args: &WorkArgs) -> Result<Work> {
    let weights = || args.weights.as_deref().context("expected --weights FILE, found none");
    let demonstration = || args.demonstration.as_deref().context("expected --demonstration DIR, found none");
    let model = || args.model.as_deref().context("expected --model FILE, found none");
    match args.name.as_str() {
        "gemm" => Ok(gemm::product()),
        "backbone" => r50::backbone(weights()?),
        "faster-inference" => r50::inference(Network::Faster, weights()?),
        "mask-inference" => r50::inference(Network::Mask, weights()?),
        "keypoint-inference" => r50::inference(Network::Keypoint, weights()?),
        "faster-training-step" => r50::training_step(Network::Faster, weights()?),
        "mask-training-step" => r50::training_step(Network::Mask, weights()?),
        "keypoint-training-step" => r50::training_step(Network::Keypoint, weights()?),
        "edge-detection" => edge::detection(weights()?),
        "edge-training-step" => edge::training_step(weights()?),
        "augmentation" => augmentation::samples(demonstration()?, args.threads),
        "teaching" => teaching::teaching(demonstration()?, model()?),
        "edge-grasp" => teaching::grasp(demonstration()?, model()?),
        other => bail!("expected a work that `sdg-bench compare --help` lists, found {other}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::{GEMM, WORKS};

    #[test]
    fn every_registered_work_is_known_here() {
        for work in WORKS.iter().chain([&GEMM]) {
            let args =
                WorkArgs { name: work.name.to_owned(), weights: None, demonstration: None, model: None, threads: 2 };
            // If the files of a work are missing, the error is about the files and not about the name.
            let refused = build(&args).err().map(|error| error.to_string());
            assert!(refused.is_none_or(|error| !error.contains("expected a work")), "{}", work.name);
        }
    }
}
