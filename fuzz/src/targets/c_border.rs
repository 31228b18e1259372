//! Functions of the C library, called within the header's contract: pointers are valid for the stated sizes,
//! with any content.
#![allow(unsafe_code, reason = "they are called as C calls them")]

use std::ffi::{CString, c_char};
use std::os::unix::ffi::OsStrExt;
use std::path::PathBuf;
use std::ptr::null;
use std::sync::LazyLock;

use sdg_capi::{
    SDG_ABI_VERSION, SDG_OK, sdg_check_abi, sdg_detect, sdg_detections_best, sdg_detections_count, sdg_detections_get,
    sdg_detections_json, sdg_detections_keypoints, sdg_detections_polygon, sdg_free, sdg_handle, sdg_last_error,
    sdg_model_load, sdg_model_save, sdg_options, sdg_picture, sdg_teach, sdg_teaching,
};

use super::numbers::Numbers;
use crate::target::Target;

/// Bytes behind a picture's pointer.
const MAX_PIXEL_BYTES: usize = 64 * 64 * 3;

/// Structures, strings, sizes and handles, as a program in C may hand them over.
pub(super) const C_BORDER: Target = Target {
    name: "c_border",
    max_extra_bytes: 256 << 20,
    quick_executions: 300,
    dictionary: &[
        b"\x01\0\0\0",
        b"\x03\0\0\0",
        b"\x08\0\0\0",
        b"\xff\xff\xff\xff\xff\xff\xff\x7f",
        b"S\0",
        b"model_s.sdg\0",
    ],
    seeds: || {
        let numbers = |numbers: &[u32]| -> Vec<u8> { numbers.iter().flat_map(|number| number.to_le_bytes()).collect() };
        let sizes: Vec<u8> = [192_u64, 192 * 48].iter().flat_map(|size| size.to_le_bytes()).collect();
        let options = numbers(&[SDG_ABI_VERSION, 1, 0, 0, 1, 1, 2, 20, 10]);
        let detected =
            [&[0], numbers(&[SDG_ABI_VERSION, 64, 48, 3, 8, 1]).as_slice(), &sizes, &options, &[0, 16, 4, 77]].concat();
        // No heights, the default seed and steps.
        let taught = [&[2], numbers(&[SDG_ABI_VERSION, 2]).as_slice(), &[0; 32], b"a.png\0a.json\0S\0"].concat();
        vec![detected, b"\x01model_s.sdg\0b.sdg\0".to_vec(), taught]
    },
    run: |bytes| {
        let mut input = Numbers(bytes);
        match input.u8() % 3 {
            0 => detect(&mut input),
            1 => load_and_save(&mut input),
            _ => teach(&mut input),
        }
    },
};

/// Checks that the last error's text is terminated and stays within a buffer of size `room`.
fn check_last_error(room: usize) {
    let mut buffer = vec![c_char::MAX; room + 1];
    // SAFETY: `room` bytes may be written.
    unsafe { sdg_last_error(buffer.as_mut_ptr(), room) };
    assert_eq!(buffer[room], c_char::MAX, "expected nothing behind the buffer to be written");
    assert!(room == 0 || buffer[..room].contains(&0), "expected a text that ends within its buffer");
}

static MODEL: LazyLock<sdg_handle> = LazyLock::new(|| {
    let file = CString::new(corpus("model_s.sdg").as_os_str().as_bytes()).expect("a path without a zero byte");
    let mut model = 0;
    // SAFETY: a text with its end, and room for a handle.
    let status = unsafe { sdg_model_load(file.as_ptr(), &mut model) };
    assert_eq!(status, SDG_OK, "the corpus's own model");
    model
});

fn corpus(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("corpus").join(name)
}

fn detect(input: &mut Numbers<'_>) -> bool {
    let mut picture = sdg_picture {
        abi_version: input.u32(),
        width: input.u32(),
        height: input.u32(),
        channels: input.u32(),
        bits_per_channel: input.u32(),
        order: input.u32(),
        row_bytes: input.u64() as usize,
        num_bytes: input.u64() as usize,
        pixels: null(),
    };
    let options = sdg_options {
        abi_version: input.u32(),
        threads: input.u32() % 3,
        camera: input.u64(),
        region_kind: input.u32(),
        region: [input.u32(), input.u32(), input.u32(), input.u32()],
    };
    let [idx, room, max_points] = [input.u8(), input.u8(), input.u8()].map(usize::from);
    let pixels = vec![input.u8(); MAX_PIXEL_BYTES];
    // By the contract, `num_bytes` bytes must be readable.
    picture.num_bytes = picture.num_bytes.min(pixels.len());
    picture.pixels = if idx == 255 { null() } else { pixels.as_ptr() };
    let mut found = 0;
    _ = sdg_check_abi(picture.abi_version);
    // SAFETY: the structures live until the call ends, and `num_bytes` of the pixels may be read.
    let status = unsafe { sdg_detect(*MODEL, &picture, &options, &mut found) };
    check_last_error(room);
    if status != SDG_OK {
        return false;
    }
    let mut count = 0;
    let mut json = vec![c_char::MAX; room + 1];
    let mut numbers = vec![f64::MAX; 3 * max_points + 1];
    // SAFETY: every buffer has the size that is passed.
    unsafe {
        let mut detection = std::mem::zeroed();
        assert_eq!(sdg_detections_count(found, &mut count), SDG_OK);
        assert_eq!(sdg_detections_get(found, idx, &mut detection) == SDG_OK, idx < count);
        _ = sdg_detections_best(found, &mut detection);
        _ = sdg_detections_polygon(found, idx, numbers.as_mut_ptr(), max_points);
        _ = sdg_detections_keypoints(found, idx, numbers.as_mut_ptr(), max_points);
        assert_eq!(sdg_detections_json(found, json.as_mut_ptr(), room, &mut count), SDG_OK);
    }
    assert_eq!(json[room], c_char::MAX, "expected nothing behind the buffer to be written");
    assert_eq!(numbers[3 * max_points], f64::MAX, "expected nothing behind the numbers to be written");
    assert_eq!(sdg_free(found), SDG_OK);
    assert_ne!(sdg_free(found), SDG_OK, "expected a freed handle to be refused");
    true
}

/// A text of the input up to its zero byte, as a path inside `folder`, so that nothing is written elsewhere.
fn path_in(folder: &std::path::Path, input: &mut Numbers<'_>) -> CString {
    let end = input.0.iter().position(|byte| *byte == 0).unwrap_or(input.0.len());
    let mut name = input.bytes(end);
    _ = input.bytes(1);
    name.retain(|byte| *byte != b'/');
    let path = [folder.as_os_str().as_bytes(), b"/", &name].concat();
    // The text ended at its first zero byte, so there is none inside.
    CString::new(path).unwrap_or_default()
}

fn load_and_save(input: &mut Numbers<'_>) -> bool {
    let Ok(folder) = tempfile::tempdir() else { return false };
    let (from, to) = (path_in(&corpus(""), input), path_in(folder.path(), input));
    let mut model = 0;
    // SAFETY: texts with their ends, and room for a handle.
    let is_loaded = unsafe { sdg_model_load(from.as_ptr(), &mut model) } == SDG_OK;
    // SAFETY: a text with its end; an unknown handle is an error.
    let is_saved =
        unsafe { sdg_model_save(if is_loaded { model } else { input.u64() | 1 << 62 }, to.as_ptr()) } == SDG_OK;
    check_last_error(usize::from(input.u8()));
    _ = sdg_free(model);
    is_loaded && is_saved
}

/// Passes arguments of teaching; fails before anything is taught, because the photo does not exist.
fn teach(input: &mut Numbers<'_>) -> bool {
    let Ok(folder) = tempfile::tempdir() else { return false };
    let mut from = sdg_teaching {
        abi_version: input.u32(),
        symmetry: input.u32(),
        photo: null(),
        marks: null(),
        model: null(),
        camera: null(),
        mark_height_m: input.f64(),
        grasp_height_m: input.f64(),
        seed: input.u64(),
        steps: input.u64(),
    };
    let texts: Vec<CString> = (0..4).map(|_| path_in(folder.path(), input)).collect();
    let letter = texts[2].as_bytes().rsplit(|byte| *byte == b'/').next().unwrap_or_default();
    let letter = CString::new(letter).unwrap_or_default();
    from.photo = texts[0].as_ptr();
    from.marks = texts[1].as_ptr();
    from.model = letter.as_ptr();
    from.camera = if input.u8() % 2 == 1 { texts[3].as_ptr() } else { null() };
    let mut model = 0;
    // SAFETY: texts with their ends, and room for a handle.
    let status = unsafe { sdg_teach(&from, &mut model) };
    check_last_error(usize::from(input.u8()));
    assert_ne!(status, SDG_OK, "expected no photo, found one");
    // The photo is read after the numbers are checked, so a missing photo means that they were accepted.
    status == sdg_capi::SDG_ERROR_FILE
}
