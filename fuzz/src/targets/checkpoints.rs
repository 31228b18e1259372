//! Checkpoints of other projects: pickles, torch's files, safetensors.

use std::sync::LazyLock;

use sdg_weights_conversion::architecture::Backbone;
use sdg_weights_conversion::{Architecture, Checkpoint, Conversion, Source};

use super::bytes::file;
use crate::target::Target;

const FIXTURES: &str = "weights-conversion/tests/fixtures";
/// Maximum number of values of a tensor that are read: the reader treats each value in the same way.
const MAX_VALUES: usize = 1 << 16;

static RESNET_18: LazyLock<Architecture> = LazyLock::new(|| {
    let backbone = Backbone::resnet(18).expect("a depth that the crate lists");
    Architecture { backbone, heads: None }
});

fn safetensors() -> Vec<u8> {
    let header = br#"{"__metadata__":{"a":"b"},"conv1.weight":{"dtype":"F32","shape":[2,2],"data_offsets":[0,16]}}"#;
    [&(header.len() as u64).to_le_bytes(), header.as_slice(), &[1; 16]].concat()
}

/// Prefix of inputs that are the pickle of torch's zip; the zip is built around the pickle with correct checksums.
const IN_ZIP: &[u8] = b"in a zip:";
/// End of the pickle's name in the zip.
const PICKLE: &str = "data.pkl";

/// Names and bytes of the entries of torch's zip; the entries are not compressed.
static ZIP_ENTRIES: LazyLock<Vec<(String, Vec<u8>)>> = LazyLock::new(|| {
    let whole = file(&format!("{FIXTURES}/tensors_zip.pth"));
    let number = |at: usize, size: usize| (0..size).fold(0, |sum, k| sum | usize::from(whole[at + k]) << (8 * k));
    let entries = whole.windows(4).enumerate().filter(|(_, bytes)| bytes == b"PK\x01\x02").map(|(at, _)| {
        let name = String::from_utf8_lossy(&whole[at + 46..at + 46 + number(at + 28, 2)]).into_owned();
        let header = number(at + 42, 4);
        let start = header + 30 + number(header + 26, 2) + number(header + 28, 2);
        (name, whole[start..start + number(at + 20, 4)].to_vec())
    });
    entries.collect()
});

/// Torch's zip with a different pickle and correct checksums.
fn zip_of(pickle: &[u8]) -> Vec<u8> {
    let (mut zip, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in ZIP_ENTRIES.iter() {
        let content = if name.ends_with(PICKLE) { pickle } else { content };
        let header_at = (zip.len() as u32).to_le_bytes();
        let name_length = (name.len() as u16).to_le_bytes();
        let size = (content.len() as u32).to_le_bytes();
        let sums = [crc32fast::hash(content).to_le_bytes(), size, size].concat();
        let header = [b"PK\x03\x04\x14\0\0\0\0\0\0\0\0\0", sums.as_slice(), &name_length, &[0; 2], name.as_bytes()];
        zip.extend([header.concat().as_slice(), content].concat());
        let fields = [b"PK\x01\x02\x14\0\x14\0\0\0\0\0\0\0\0\0", sums.as_slice(), &name_length, &[0; 12], &header_at];
        directory.extend([fields.concat().as_slice(), name.as_bytes()].concat());
    }
    let count = (ZIP_ENTRIES.len() as u16).to_le_bytes();
    let place = [(directory.len() as u32).to_le_bytes(), (zip.len() as u32).to_le_bytes()].concat();
    [zip.as_slice(), &directory, b"PK\x05\x06\0\0\0\0", &count, &count, &place, &[0; 2]].concat()
}

/// Pickles of one megabyte that repeat one operation, to find the operation that takes the most memory.
pub fn costliest_pickles() -> Vec<Vec<u8>> {
    let operations: [&[u8]; 9] =
        [b"]", b"}", b"N", b"(", b"\x8c\x00", b"\x8c\x01x\x94", b"K\x01\x85", b"N\x94", b"C\x00\x94"];
    let file =
        |operation: &&[u8]| [b"\x80\x04}", operation.repeat(1_000_000 / operation.len()).as_slice(), b"."].concat();
    operations.iter().map(file).collect()
}

/// Checkpoints: pickle, torch's zip and its older form, safetensors.
pub(super) const CHECKPOINT: Target = Target {
    name: "checkpoint",
    max_extra_bytes: 100_000_000,
    quick_executions: 5_000,
    dictionary: &[
        b"\x80\x02}",
        b"PK\x03\x04",
        b"PK\x01\x02",
        b"PK\x05\x06",
        b"cnumpy\n",
        b"\x8c\x05numpy",
        b"R",
        b"b.",
        b"q\x01",
        b"\"F32\"",
        b"\"shape\":[",
        b"\x85",
        b"\x86",
        b"\x87",
        b"\x8a\x08",
        b"\x93",
        b"\x94",
        b"\x95",
        b"\x96",
        b"(",
        b"]",
        b"}",
        b"N",
        b"K\x01",
    ],
    seeds: || {
        let names = [
            "arrays_protocol2.pkl",
            "arrays_protocol4.pkl",
            "arrays_protocol5.pkl",
            "arrays_python2.pkl",
            "tensors_zip.pth",
            "tensors_legacy.pth",
        ];
        let mut seeds: Vec<_> = names.iter().map(|name| file(&format!("{FIXTURES}/{name}"))).collect();
        seeds.extend([file("fuzz/corpus/detectron2.pkl"), safetensors()]);
        let pickles = ZIP_ENTRIES.iter().filter(|(name, _)| name.ends_with(PICKLE));
        seeds.extend(pickles.map(|(_, pickle)| [IN_ZIP, pickle].concat()));
        seeds
    },
    run: |bytes| {
        let file = match bytes.strip_prefix(IN_ZIP) {
            Some(pickle) => zip_of(pickle),
            None => bytes.to_vec(),
        };
        let mut source = Source::from_bytes(file);
        let Ok(checkpoint) = Checkpoint::read(&mut source) else { return false };
        for tensor in checkpoint.tensors.values().filter(|tensor| tensor.len() <= MAX_VALUES).take(8) {
            if let Ok(values) = tensor.values(&mut source) {
                assert_eq!(values.len(), tensor.len(), "a tensor's values and its shape");
            }
        }
        let _ = Conversion::plan(&checkpoint, &RESNET_18, &[]);
        true
    },
};
