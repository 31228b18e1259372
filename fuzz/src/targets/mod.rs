//! All targets, grouped by the kind of input.

mod borders;
mod c_border;
mod cameras;
mod fci_server;
mod marks;
mod models;
mod numbers;
mod page;
mod pictures;
mod places;
mod robots;
mod ros;

use std::path::Path;

pub use models::costliest_pickles;

use crate::target::Target;

/// All targets.
pub const TARGETS: &[Target] = &[
    models::CHECKPOINT,
    models::MODEL,
    models::DETECTOR_CONFIG,
    marks::COCO,
    marks::LABELME,
    marks::YOLO,
    marks::DATA_YAML,
    marks::OPENDR,
    pictures::PNG,
    pictures::PNG_CHUNKS,
    pictures::JPEG,
    pictures::TIFF,
    pictures::OTHERS,
    places::CAMERA_FILE,
    places::ROBOT_POSES,
    places::WORKCELL,
    robots::FRANKA,
    fci_server::FCI_SERVER,
    ros::CDR,
    cameras::HTTP_CAMERA,
    cameras::LIVE_PAGE,
    page::PAGE,
    page::START_PAGE,
    borders::WEB,
    borders::BINDINGS,
    c_border::C_BORDER,
];

/// The port in the seeds; the server's real port replaces it.
const SEED_PORT: &[u8] = b"4000";

/// Reads a file of the repository.
fn file(path: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn contains(bytes: &[u8], wanted: &[u8]) -> bool {
    bytes.windows(wanted.len()).any(|window| window == wanted)
}

/// The bytes with every `from` replaced by `to`.
fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(bytes.len());
    let mut rest = bytes;
    while let Some((first, tail)) = rest.split_first() {
        match rest.strip_prefix(from) {
            Some(behind) => {
                out.extend_from_slice(to);
                rest = behind;
            }
            None => {
                out.push(*first);
                rest = tail;
            }
        }
    }
    out
}

/// Splits the bytes at each `mark`.
fn split_at_marks(bytes: &[u8], mark: &[u8]) -> Vec<Vec<u8>> {
    let mut pieces = Vec::new();
    let mut rest = bytes;
    while let Some(at) = rest.windows(mark.len()).position(|window| window == mark) {
        pieces.push(rest[..at].to_vec());
        rest = &rest[at + mark.len()..];
    }
    pieces.push(rest.to_vec());
    pieces
}
