//! Tests the hash, the size and the metadata of the shipped weights, and that every model with a network can start from
//! them.

use std::path::Path;

use sdg_grasp::{BaseWeightsFile, ModelKind, Preset, TeachOptions};
use sha2::{Digest, Sha256};

/// Maximum size of the file in the repository.
const MAX_BYTES: usize = 12_000_000;

#[test]
fn the_file_is_whole_small_and_says_how_it_was_made() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/grasp/weights");
    let bytes = std::fs::read(folder.join("edge.safetensors")).unwrap();
    assert!(bytes.len() <= MAX_BYTES, "{}", bytes.len());
    let sha256: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(std::fs::read_to_string(folder.join("edge.sha256")).unwrap(), sha256);

    let file = BaseWeightsFile::from_bytes(&bytes).unwrap();
    for name in ["commit", "licence", "detector", "orientation", "comparison"] {
        assert!(file.origin.get(name).is_some_and(|value| !value.is_empty()), "{name}: {:?}", file.origin);
    }
    assert!(file.origin["detector"].contains("seed") && file.origin["detector"].contains("steps"), "{:?}", file.origin);
    for kind in [ModelKind::A, ModelKind::B, ModelKind::C, ModelKind::D] {
        let mut options = TeachOptions::new(1);
        options.kind = kind;
        let network = options.taught_network().unwrap();
        let weights = file.for_network(Preset::Edge.name(), &network, sha256.clone()).unwrap();
        let is_whole = !weights.imprint.is_empty() && weights.orientation.is_some() && !weights.comparison.is_empty();
        assert!(is_whole, "{kind}");
        // Teaching initialises no parameters but the class scores, and computes those from the
        // part's views.
        assert!(weights.reinitialized.iter().all(|name| name.contains("cls_score")), "{:?}", weights.reinitialized);
    }
}
