//! Malicious files: each ends in an error with the reason.

use std::fs;
use std::path::Path;

use crate::forged::{array_pickle, cat, dict_with, legacy, text, zip};
use sdg_weights_conversion::{Checkpoint, Source, WeightsError};

fn read(bytes: impl AsRef<[u8]>) -> Result<Checkpoint, WeightsError> {
    Checkpoint::read(&mut Source::from_bytes(bytes.as_ref().to_vec()))
}

fn assert_refused(what: &str, bytes: impl AsRef<[u8]>, parts: &[&str]) {
    let refused = read(bytes).expect_err(what).to_string();
    assert_eq!(refused.lines().count(), 1, "{what}: {refused}");
    for part in parts {
        assert!(refused.contains(part), "{what}: expected \"{part}\" in: {refused}");
    }
}

fn fixture(name: &str) -> Vec<u8> {
    fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)).unwrap()
}

#[test]
fn code_is_refused_by_name_wherever_it_stands() {
    for (module, name) in [
        ("posix", "system"),
        ("builtins", "eval"),
        ("__builtin__", "getattr"),
        ("subprocess", "Popen"),
        ("numpy", "load"),
        ("numpy.core.multiarray", "fromfile"),
        ("torch", "load"),
        ("torch.storage", "_load_from_bytes"),
        ("collections", "defaultdict"),
        ("_codecs", "decode"),
    ] {
        let by_line = cat(&[b"c", module.as_bytes(), b"\n", name.as_bytes(), b"\n", &text("id"), b"\x85R"]);
        let by_stack = cat(&[&text(module), &text(name), b"\x93", &text("id"), b"\x85R"]);
        for call in [by_line, by_stack] {
            let pickle = dict_with("weight", &call);
            let full_name = format!("{module}.{name}");
            assert_refused("pickle", &pickle, &["refused", &full_name]);
            assert_refused("zip", zip(&[("a/data.pkl", &pickle)]), &["refused", &full_name]);
            assert_refused("legacy", legacy(&pickle, &[]), &["refused", &full_name]);
        }
    }
    // Unsupported operations: instances by class name, extension codes, external buffers, persistent ids and numbers as
    // text.
    for operation in [&b"(iposix\nsystem\n"[..], b"(cnumpy\ndtype\no", b"\x82\x01", b"\x97", b"Pid\n", b"I1\n", b"\x92"]
    {
        assert_refused("operation", dict_with("weight", operation), &["an operation that weights need"]);
    }
}

#[test]
fn sizes_are_checked_before_memory_is_taken() {
    let huge = 1u64 << 62;
    assert_refused("bytes", dict_with("w", &cat(&[b"\x8e", &huge.to_le_bytes()])), &["more bytes"]);
    assert_refused("text", dict_with("w", &cat(&[b"\x8d", &huge.to_le_bytes()])), &["more bytes"]);
    assert_refused("array", array_pickle(&[1 << 31, 1 << 31, 16], "f4", "<", &[0; 8]), &["fits into memory"]);
    assert_refused("array", array_pickle(&[1 << 30], "f4", "<", &[0; 8]), &["4294967296 bytes", "found 8 bytes"]);
    assert_refused("negative", array_pickle(&[-1], "f4", "<", &[0; 8]), &["sizes", "-1"]);
    assert_refused("axes", array_pickle(&[1; 9], "f4", "<", &[0; 4]), &["at most 8 sizes", "9 items"]);
    assert_refused("short", array_pickle(&[3], "f4", "<", &[0; 8]), &["12 bytes", "found 8 bytes"]);
    let tensor = |shape: &[u8], numel: i32| {
        let storage = cat(&[b"(", &text("storage"), b"ctorch\nFloatStorage\n", &text("0"), &text("cpu"), b"J"]);
        let storage = cat(&[&storage, &numel.to_le_bytes(), b"tQ"]);
        let rebuild = cat(&[b"ctorch._utils\n_rebuild_tensor_v2\n(", &storage, b"K\x00", shape, b"\x89NtR"]);
        zip(&[("a/data.pkl", &dict_with("w", &rebuild)), ("a/data/0", &[0; 16])])
    };
    read(tensor(b"K\x04\x85K\x01\x85", 4)).unwrap();
    // Tensors may share their bytes, but not so that a small file takes much memory.
    let shared = |count: usize| {
        let storage =
            cat(&[b"(", &text("storage"), b"ctorch\nFloatStorage\n", &text("0"), &text("cpu"), b"M\x00\x10tQ"]);
        let rebuild = cat(&[b"ctorch._utils\n_rebuild_tensor_v2\n(", &storage, b"K\x00M\x00\x10\x85K\x01\x85\x89NtR"]);
        let items: Vec<u8> = (0..count).flat_map(|idx| cat(&[&text(&format!("w{idx}")), &rebuild])).collect();
        zip(&[("a/data.pkl", &cat(&[b"\x80\x02}(", &items, b"u."])), ("a/data/0", &[0; 4 << 12])])
    };
    read(shared(2)).unwrap();
    assert_refused("shared", shared(4), &["bytes of all tensors", "found 65536"]);
    let called = cat(&[b"ccollections\nOrderedDict\n(", &b"N".repeat(17), b"tR"]);
    assert_refused("arguments", dict_with("w", &called), &["a few arguments", "17"]);
    assert_refused("too long", tensor(b"K\x05\x85K\x01\x85", 4), &["w", "a view of 4 elements"]);
    assert_refused("repeating", tensor(b"J\x7f\x7f\x7f\x7f\x85K\x00\x85", 4), &["each at most once"]);
    assert_refused("storage", tensor(b"K\x04\x85K\x01\x85", 1 << 30), &["4294967296 bytes", "16"]);
    assert_refused("no storage", zip(&[("a/data.pkl", &dict_with("w", b"N"))]), &["tensors by name"]);
}

#[test]
fn element_types_that_are_no_numbers_are_refused() {
    for code in ["O8", "V16", "U5", "f16", "c8", "M8[ns]", "S4"] {
        assert_refused(code, array_pickle(&[1], code, "<", &[0; 16]), &["an element type", code]);
    }
    assert_refused("order", array_pickle(&[1], "f4", ">", &[0; 4]), &["little-endian"]);
    assert_refused("order", array_pickle(&[1], "f4", "?", &[0; 4]), &["a byte order"]);
}

#[test]
fn what_training_saves_names_the_way_out() {
    let ema = cat(&[b"\x80\x04}(", &text("epoch"), b"K\x01", &text("model_ema"), b"}u."]);
    assert_refused(
        "ema",
        ema,
        &["`epoch`, `model_ema`", "torch.save(torch.load(\"FILE\", weights_only=False)[\"model_ema\"]"],
    );
    assert_refused("plain", dict_with("backbone.w", b"N"), &["`backbone.w`", "without the numbers of its tensors"]);
    let namespace = cat(&[b"\x80\x02}", b"cargparse\nNamespace\n", b"."]);
    // A whole model has no items, and the dict that a training saves has no method `state_dict`.
    let way_out = "torch.save(torch.load(\"FILE\", weights_only=False).state_dict(), \"NEW.pth\") for a whole model, \
                   and with [\"model\"] or [\"state_dict\"] instead of .state_dict() for a training checkpoint";
    assert_refused("namespace", namespace, &["argparse.Namespace", way_out]);
}

#[test]
fn nesting_and_loops_end() {
    // A hundred thousand nested lists: no function here is recursive.
    let deep = cat(&[b"\x80\x02", &[b']'; 100_000], &[b'a'; 99_999], b"."]);
    assert_refused("deep", deep, &["a dict of names"]);
    let deeper = cat(&[b"\x80\x02", &[b'('; 1_000_000], &[b't'; 1_000_000], b"."]);
    assert_refused("deeper", deeper, &["operations of a pickle", "at most 400000"]);
    // A dict that is its own state dict, and a list that is its own shape.
    let own_model = cat(&[b"\x80\x04}q\x00", &text("model"), b"h\x00s."]);
    assert_refused("own model", own_model, &["tensors by name", "none"]);
    let own_shape = b"cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nK\x00\x85C\x01b\x87R(K\x01]q\x00h\x00ah\x00\x89h\x00tb";
    assert_refused("own shape", dict_with("w", own_shape), &["sizes", "a tuple or list"]);
    // A long list from which a dict is made repeatedly: only five times, so that accepting it would take little memory.
    let pair = cat(&[&text("k"), b"N\x86q\x01"]);
    let list = cat(&[&pair, b"]q\x00(", &b"h\x01".repeat(100_000), b"e"]);
    let copies = b"ccollections\nOrderedDict\nh\x00\x85R".repeat(5);
    assert_refused("copies", dict_with("w", &cat(&[&list, &copies])), &["operations of a pickle"]);
}

#[test]
fn broken_stacks_end_in_errors() {
    for operations in
        [&b""[..], b"0", b"a", b"s", b"u", b"t", b"R", b"b", b"Q", b"\x85", b"\x93", b"h\x07", b"2", b"(a", b"(0"]
    {
        let pickle = cat(&[b"\x80\x02", operations, b"."]);
        assert!(read(&pickle).is_err(), "{operations:?}");
    }
    assert_refused("odd", b"\x80\x02}(NNNu.", &["keys and values in turn"]);
    assert_refused("call", b"\x80\x02NN\x85R.", &["a class or function to call"]);
    assert_refused("behind the end", cat(&[&fixture("arrays_protocol2.pkl"), b"x"]), &["no bytes after its end"]);
}

#[test]
fn every_file_cut_anywhere_is_an_error() {
    for name in ["arrays_protocol2.pkl", "arrays_protocol5.pkl", "tensors_zip.pth", "tensors_legacy.pth"] {
        let whole = fixture(name);
        for len in (0..whole.len()).step_by(7).chain([whole.len() - 1]) {
            assert!(read(&whole[..len]).is_err(), "{name}: {len} of {} bytes", whole.len());
        }
    }
}

#[test]
fn a_flipped_bit_in_a_torch_zip_is_noticed() {
    // Entries have a checksum; the bytes between them (padding, dates) do not affect the weights.
    let whole = fixture("tensors_zip.pth");
    let pickle_at = whole.windows(3).position(|bytes| bytes == b"\x80\x02}").unwrap();
    let pickle_end = pickle_at + whole[pickle_at..].windows(4).position(|bytes| bytes == b"PK\x07\x08").unwrap();
    assert!(pickle_end - pickle_at > 1000);
    for at in pickle_at..pickle_end {
        let mut flipped = whole.clone();
        flipped[at] ^= 1 << (at % 8);
        assert_refused("flipped", &flipped, &["checksum", "altered"]);
    }
}

#[test]
fn names_that_climb_out_of_a_folder_are_refused() {
    let pickle = dict_with("w", b"N");
    for name in ["../data.pkl", "/a/data.pkl", "a/../../data.pkl", "a\\..\\data.pkl"] {
        assert_refused(name, zip(&[(name, &pickle)]), &["names inside a folder"]);
    }
    assert_refused("twice", zip(&[("a/data.pkl", &pickle), ("b/data.pkl", &pickle)]), &["one entry", "several"]);
    assert_refused("none", zip(&[("a/model.bin", &pickle)]), &["not a torch checkpoint"]);
}
