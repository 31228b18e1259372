//! All compared works, their peers, and the desired ratios.

use crate::network::Network;

/// Software to compare with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peer {
    pub id: &'static str,
    pub title: &'static str,
    /// The desired ratio of the peer's seconds to ours.
    pub wanted: Option<f64>,
}

/// A computation that our program and the peers do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkSpec {
    /// Name for the workers.
    pub name: &'static str,
    /// Name in tables, with the computation and its size.
    pub title: &'static str,
    /// The network whose weights both sides load.
    pub network: Option<Network>,
    /// The peers; empty if only our own time is measured.
    pub peers: &'static [Peer],
    /// Whether the work takes minutes: it runs once, and with `--quick` only if `--only` names it.
    pub long: bool,
    /// Whether the work reads the grasp model that `teaching` writes.
    pub needs_model: bool,
}

const fn peer(id: &'static str, title: &'static str, wanted: f64) -> Peer {
    Peer { id, title, wanted: Some(wanted) }
}

/// A peer without a desired ratio.
const fn also(id: &'static str, title: &'static str) -> Peer {
    Peer { id, title, wanted: None }
}

const fn compared(
    name: &'static str,
    title: &'static str,
    network: Option<Network>,
    peers: &'static [Peer],
) -> WorkSpec {
    WorkSpec { name, title, network, peers, long: false, needs_model: false }
}

/// A matrix product; the highest speed of all sides is taken as the machine's peak.
pub const GEMM: WorkSpec = compared("gemm", "product of two 2048×2048 matrices", None, &[also("pytorch", "PyTorch")]);

const TORCHVISION: &[Peer] = &[peer("pytorch", "torchvision", 2.0)];
const TRAINING: &[Peer] = &[peer("pytorch", "PyTorch", 1.5)];

/// All works in the order in which they run, except `GEMM`, which runs first.
pub const WORKS: &[WorkSpec] = &[
    compared(
        "backbone",
        "R50-FPN backbone forward, 480×640",
        Some(Network::Faster),
        &[
            peer("pytorch", "PyTorch", 2.0),
            also("pytorch-channels_last", "PyTorch channels_last"),
            peer("onnxruntime", "ONNX Runtime", 1.3),
            peer("openvino", "OpenVINO", 1.3),
        ],
    ),
    compared("faster-inference", "Faster R-CNN R50 inference, 480×640", Some(Network::Faster), TORCHVISION),
    compared("mask-inference", "Mask R-CNN R50 inference, 480×640", Some(Network::Mask), TORCHVISION),
    compared("keypoint-inference", "Keypoint R-CNN R50 inference, 480×640", Some(Network::Keypoint), TORCHVISION),
    compared("faster-training-step", "Faster R-CNN R50 training step, 2 × 480×640", Some(Network::Faster), TRAINING),
    compared("mask-training-step", "Mask R-CNN R50 training step, 2 × 480×640", Some(Network::Mask), TRAINING),
    compared(
        "keypoint-training-step",
        "Keypoint R-CNN R50 training step, 2 × 480×640",
        Some(Network::Keypoint),
        TRAINING,
    ),
    compared(
        "edge-detection",
        "edge detection, 480×640 in, grasp out",
        Some(Network::Edge),
        &[also("pytorch", "PyTorch"), also("pytorch-channels_last", "PyTorch channels_last")],
    ),
    compared(
        "edge-training-step",
        "edge training step, 4 × 240×320",
        Some(Network::Edge),
        &[peer("pytorch", "PyTorch", 2.0), also("pytorch-channels_last", "PyTorch channels_last")],
    ),
    compared(
        "augmentation",
        "augmentation, one sample of 480×640",
        None,
        &[peer("albumentations", "albumentations", 3.0), also("albumentations-fused", "albumentations, one affine")],
    ),
    WorkSpec { long: true, ..compared("teaching", "teaching with edge, demonstration to validated model", None, &[]) },
    WorkSpec {
        needs_model: true,
        ..compared("edge-grasp", "edge detection with verification, 480×640 in, grasp out", None, &[])
    },
];

/// The software that does a work.
#[derive(Debug, Clone, Copy)]
pub enum Side {
    Ours,
    Peer(&'static Peer),
}

impl Side {
    /// Name in tables.
    pub fn title(&self) -> &'static str {
        match self {
            Self::Ours => "ours",
            Self::Peer(peer) => peer.title,
        }
    }

    /// Name in files.
    pub fn id(&self) -> &'static str {
        match self {
            Self::Ours => "ours",
            Self::Peer(peer) => peer.id,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique() {
        for (idx, work) in WORKS.iter().enumerate() {
            assert!(WORKS[..idx].iter().all(|other| other.name != work.name), "{}", work.name);
            for (idx, peer) in work.peers.iter().enumerate() {
                assert!(work.peers[..idx].iter().all(|other| other.id != peer.id), "{} {}", work.name, peer.id);
            }
        }
    }
}
