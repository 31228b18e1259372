//! Every writer's files of the same arrays are read alike. The files come from
//! `fixtures/make_fixtures.py`.

use std::path::{Path, PathBuf};

use sdg_weights_conversion::{Checkpoint, ElementType, FileFormat, Source};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

/// 0, 0.25, 0.5, …
fn counted(count: usize) -> Vec<f32> {
    (0..count).map(|i| i as f32 * 0.25).collect()
}

fn assert_tensor(file: &str, name: &str, shape: &[usize], element: ElementType, values: &[f32]) {
    let mut source = Source::open(&fixture(file)).unwrap();
    let checkpoint = Checkpoint::read(&mut source).unwrap();
    let tensor = &checkpoint.tensors[name];
    assert_eq!(tensor.shape(), shape, "{file}: {name}");
    assert_eq!(tensor.element(), element, "{file}: {name}");
    assert_eq!(tensor.values(&mut source).unwrap(), values, "{file}: {name}");
}

fn assert_common_arrays(file: &str) {
    assert_tensor(file, "dense", &[2, 3], ElementType::F32, &counted(6));
    assert_tensor(file, "half", &[4], ElementType::F16, &counted(4));
    assert_tensor(file, "double", &[2, 2], ElementType::F64, &counted(4));
    // Stored with another axis innermost, read in the usual order.
    assert_tensor(file, "columns", &[2, 3, 2, 2], ElementType::F32, &counted(24));
    assert_tensor(file, "large", &[40, 40], ElementType::F32, &counted(1600));
    let checkpoint = Checkpoint::read(&mut Source::open(&fixture(file)).unwrap()).unwrap();
    let counter = &checkpoint.tensors["counter"];
    assert_eq!((counter.shape(), counter.element()), (&[][..], ElementType::I64));
    assert!(counter.values(&mut Source::open(&fixture(file)).unwrap()).is_err(), "an integer is no weight");
}

#[test]
fn numpy_arrays_of_every_protocol_numpy_and_python() {
    for file in [
        "arrays_protocol2.pkl",
        "arrays_protocol3.pkl",
        "arrays_protocol4.pkl",
        "arrays_protocol5.pkl",
        "arrays_numpy1.pkl",
        "arrays_python2.pkl",
    ] {
        assert_common_arrays(file);
        let checkpoint = Checkpoint::read(&mut Source::open(&fixture(file)).unwrap()).unwrap();
        assert_eq!(checkpoint.format, FileFormat::NumpyPickle);
        assert_eq!(checkpoint.tensors.len(), 6, "{file}");
    }
    let checkpoint = Checkpoint::read(&mut Source::open(&fixture("arrays_protocol4.pkl")).unwrap()).unwrap();
    assert_eq!(checkpoint.author.as_deref(), Some("fixture"));
}

#[test]
fn torch_tensors_of_both_formats() {
    for (file, format) in [("tensors_zip.pth", FileFormat::TorchZip), ("tensors_legacy.pth", FileFormat::TorchLegacy)] {
        assert_common_arrays(file);
        assert_tensor(file, "bfloat", &[3], ElementType::Bf16, &counted(3));
        assert_tensor(file, "parameter", &[5], ElementType::F32, &counted(5));
        // Elements 2 to 7 of its storage as two rows of three, transposed.
        assert_tensor(file, "view", &[3, 2], ElementType::F32, &[0.5, 1.25, 0.75, 1.5, 1.0, 1.75]);
        assert_tensor(file, "running_var", &[2], ElementType::F32, &[1.0, 1.0]);
        let checkpoint = Checkpoint::read(&mut Source::open(&fixture(file)).unwrap()).unwrap();
        assert_eq!(checkpoint.format, format);
        assert_eq!(checkpoint.tensors.len(), 14);
    }
}

#[test]
fn a_header_length_that_begins_like_a_pickle_is_no_pickle() {
    // The lengths' first bytes are 0x80 and 2 to 5, as in pickles of these protocols.
    for header_len in [640, 896, 1152, 1408, 640 + (1 << 16)] {
        let mut header = br#"{"w":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}}"#.to_vec();
        header.resize(header_len, b' ');
        let bytes = [(header_len as u64).to_le_bytes().as_slice(), &header, &0.5f32.to_le_bytes()].concat();
        let mut source = Source::from_bytes(bytes);
        let checkpoint = Checkpoint::read(&mut source).unwrap();
        assert_eq!(checkpoint.format, FileFormat::Safetensors);
        assert_eq!(checkpoint.tensors["w"].values(&mut source).unwrap(), [0.5]);
    }
}

#[test]
fn what_is_no_checkpoint_is_named() {
    for (bytes, name) in [
        (&b""[..], "an empty file"),
        (b"\x89PNG\r\n\x1a\n", "a PNG image"),
        (b"version https://git-lfs.github.com/spec/v1\n", "Git LFS"),
        (b"\x80\x01}.", "protocol 1"),
        (b"{\"a\": 1}", "JSON"),
        (b"\x1f\x8b\x08", "gzip"),
    ] {
        let refused = Checkpoint::read(&mut Source::from_bytes(bytes)).unwrap_err().to_string();
        assert!(refused.contains(name), "{refused}");
    }
    let folder = Source::open(Path::new(env!("CARGO_MANIFEST_DIR"))).err().unwrap().to_string();
    assert!(folder.contains("a folder"), "{folder}");
}
