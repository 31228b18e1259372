//! Mutated files: no panic, no hang, no memory use above twice the file's size plus 100 MB.
//!
//! A short run is part of the tests; `SDG_MUTATIONS=1000000 cargo test --release -p sdg-weights-conversion --test
//! mutations -- --nocapture` makes a long one, and `SDG_FIRST_MUTATION` sets its start. This binary has one test,
//! because it counts the memory of the whole process.
#![allow(clippy::unwrap_used)]

mod forged;

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use forged::{cat, zip};
use peak_alloc::PeakAlloc;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_weights_conversion::architecture::Backbone;
use sdg_weights_conversion::{Architecture, Checkpoint, Conversion, Source};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Of the short run; about two seconds.
const MUTATIONS: u64 = 5_000;
/// In addition to twice the file.
const MAX_EXTRA_BYTES: usize = 100_000_000;
/// A thousand times the time of the slowest file, for machines under load.
const MAX_TIME: Duration = Duration::from_secs(30);

/// A file before mutation.
struct Seed {
    name: &'static str,
    bytes: Vec<u8>,
    /// The range of a mutation: the pickle of a zip, whose checksum is then corrected.
    in_zip: Option<Vec<u8>>,
}

fn fixture(name: &str) -> Vec<u8> {
    fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)).unwrap()
}

/// The pickle and the first storage of torch's zip.
fn zip_parts() -> [Vec<u8>; 2] {
    let whole = fixture("tensors_zip.pth");
    let start = whole.windows(3).position(|bytes| bytes == b"\x80\x02}").unwrap();
    let end = start + whole[start..].windows(4).position(|bytes| bytes == b"PK\x07\x08").unwrap();
    [whole[start..end].to_vec(), vec![0; 8]]
}

fn safetensors() -> Vec<u8> {
    let header = br#"{"__metadata__":{"a":"b"},"conv1.weight":{"dtype":"F32","shape":[2,2],"data_offsets":[0,16]},"layer1.0.conv1.weight":{"dtype":"F16","shape":[1,2,2],"data_offsets":[16,24]}}"#;
    cat(&[&(header.len() as u64).to_le_bytes(), header, &[1; 24]])
}

fn seeds() -> Vec<Seed> {
    let plain = |name: &'static str| Seed { name, bytes: fixture(name), in_zip: None };
    let [pickle, storage] = zip_parts();
    vec![
        plain("arrays_protocol2.pkl"),
        plain("arrays_protocol4.pkl"),
        plain("arrays_protocol5.pkl"),
        plain("arrays_python2.pkl"),
        plain("tensors_zip.pth"),
        plain("tensors_legacy.pth"),
        plain("detectron2_keypoint.pkl"),
        Seed { name: "safetensors", bytes: safetensors(), in_zip: None },
        Seed { name: "pickle in a zip", bytes: pickle, in_zip: Some(storage) },
    ]
}

/// Bytes with a meaning: ends of number ranges, operations of pickles.
const TELLING_BYTES: &[u8] =
    b"\x00\x01\x7f\x80\xff\x85\x86\x87\x8a\x8b\x8c\x8d\x8e\x93\x94\x95\x96.()}]NRbdcehjqrstuaXBCGJKMQ\"[{:,0129-";

fn mutate(bytes: &mut Vec<u8>, other: &[u8], rng: &mut Pcg64Mcg) {
    for _ in 0..1 << rng.random_range(0..4) {
        if bytes.is_empty() {
            return;
        }
        let at = rng.random_range(0..bytes.len());
        let end = (at + rng.random_range(1..=32)).min(bytes.len());
        match rng.random_range(0..9) {
            0 => bytes[at] ^= 1 << rng.random_range(0..8),
            1 => bytes[at] = rng.random(),
            2 => bytes[at] = TELLING_BYTES[rng.random_range(0..TELLING_BYTES.len())],
            3 => bytes.truncate(at),
            4 => drop(bytes.drain(at..end)),
            5 => {
                let copy = bytes[at..end].repeat(1 << rng.random_range(0..8));
                bytes.splice(at..at, copy);
            }
            6 => {
                let from = rng.random_range(0..other.len());
                let piece = &other[from..(from + 64).min(other.len())];
                bytes.splice(at..end, piece.iter().copied());
            }
            // Lengths, counts and offsets: huge, or nearly right.
            7 => {
                let huge = [0x7fff_ffff_ffff_ffffu64, u64::MAX, 1 << 40, 1 << 31, 0xffff_ffff, 0];
                let value = huge[rng.random_range(0..huge.len())].to_le_bytes();
                let len = (bytes.len() - at).min([2, 4, 8][rng.random_range(0..3)]);
                bytes[at..at + len].copy_from_slice(&value[..len]);
            }
            _ => bytes[at] = bytes[at].wrapping_add(rng.random_range(0..3)).wrapping_sub(1),
        }
    }
}

/// A conversion without writing to the disk; true if the file is accepted.
fn digest(file: Vec<u8>, target: &Architecture) -> bool {
    let mut source = Source::from_bytes(file);
    let Ok(checkpoint) = Checkpoint::read(&mut source) else {
        return false;
    };
    if let Ok(conversion) = Conversion::plan(&checkpoint, target, &[]) {
        assert!(!conversion.report().to_string().is_empty());
    }
    for tensor in checkpoint.tensors.values() {
        if let Ok(values) = tensor.values(&mut source) {
            assert_eq!(values.len(), tensor.len());
        }
    }
    true
}

#[test]
fn a_mutated_file_is_an_error_or_a_checkpoint_and_nothing_else() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let count = number("SDG_MUTATIONS").unwrap_or(MUTATIONS);
    let first = number("SDG_FIRST_MUTATION").unwrap_or(0);
    let target = Architecture { backbone: Backbone::resnet(18).unwrap(), heads: None };
    let seeds = seeds();
    let (mut accepted, mut max_extra, mut slowest) = (0, 0, Duration::ZERO);
    for i in first..first + count {
        if i > first && i % 20_000 == 0 {
            println!("{} done: {accepted} accepted, {max_extra} bytes beyond, slowest {slowest:?}", i - first);
        }
        let mut rng = Pcg64Mcg::seed_from_u64(i);
        let seed = &seeds[i as usize % seeds.len()];
        let mut file = seed.bytes.clone();
        mutate(&mut file, &seeds[rng.random_range(0..seeds.len())].bytes, &mut rng);
        if let Some(storage) = &seed.in_zip {
            let names: Vec<String> = (0..16).map(|key| format!("a/data/{key}")).collect();
            let storages = names.iter().map(|name| (name.as_str(), storage.as_slice()));
            file = zip(&[("a/data.pkl", file.as_slice())].into_iter().chain(storages).collect::<Vec<_>>());
        }
        let len = file.len();
        let before = ALLOCATOR.current_usage() - len;
        ALLOCATOR.reset_peak_usage();
        let start = Instant::now();
        let ended = std::panic::catch_unwind(|| digest(file, &target));
        let (elapsed, peak) = (start.elapsed(), ALLOCATOR.peak_usage());
        // The file itself is in memory here; a conversion leaves it on the disk.
        let extra = peak.saturating_sub(before).saturating_sub(3 * len);
        let file = format!("mutation {i} of {}", seed.name);
        assert!(extra <= MAX_EXTRA_BYTES, "{file}: {peak} bytes at most for a file of {len}");
        assert!(elapsed <= MAX_TIME, "{file}: {elapsed:?}");
        accepted += u64::from(ended.unwrap_or_else(|_| panic!("{file}: panicked")));
        (max_extra, slowest) = (max_extra.max(extra), slowest.max(elapsed));
    }
    println!("{count} files: {accepted} accepted, at most {max_extra} bytes beyond twice a file, slowest {slowest:?}");
    // Mutations that always fail at the first bytes would test nothing.
    assert!(accepted > count / 20 && accepted < count, "{accepted} of {count}");
    the_costliest_operations_stay_within_bounds(&target);
}

/// Files that repeat one operation: each operation adds as much as it can.
fn the_costliest_operations_stay_within_bounds(target: &Architecture) {
    let operations: [&[u8]; 9] =
        [b"]", b"}", b"N", b"(", b"\x8c\x00", b"\x8c\x01x\x94", b"K\x01\x85", b"N\x94", b"C\x00\x94"];
    for operation in operations {
        let mut file = cat(&[b"\x80\x04}", &operation.repeat(1_000_000 / operation.len())]);
        file.push(b'.');
        let len = file.len();
        let before = ALLOCATOR.current_usage() - len;
        ALLOCATOR.reset_peak_usage();
        digest(file, target);
        let extra = ALLOCATOR.peak_usage().saturating_sub(before).saturating_sub(3 * len);
        println!("{operation:02x?}: {extra} bytes beyond twice the file");
        assert!(extra <= MAX_EXTRA_BYTES, "{operation:02x?}: {extra} bytes");
    }
}
