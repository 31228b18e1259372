//! The functions in the header.

use std::ffi::c_char;
use std::ops::ControlFlow;
use std::sync::Arc;

use sdg_bindings::{Camera, DEFAULT_MIN_SCORE, Fault, FaultKind, Model, Record, Result};

use crate::border::{check_abi, copy_last_error, copy_text, null, path, status};
use crate::convert::{copy_rows, detection, picture, teaching, view, write};
use crate::handles::{self, Object};
use crate::types::*;

/// The library's SDG_ABI_VERSION.
#[unsafe(no_mangle)]
pub extern "C" fn sdg_abi_version() -> u32 {
    SDG_ABI_VERSION
}

/// Call this first, with SDG_ABI_VERSION of the header: SDG_ERROR_VERSION if the library has another version.
#[unsafe(no_mangle)]
pub extern "C" fn sdg_check_abi(abi_version: u32) -> sdg_status {
    status(|| check_abi("a program", abi_version))
}

/// Copies the text of the calling thread's last error to buffer, in UTF-8, truncated if necessary and always
/// zero-terminated. Returns the size of the complete text with its zero byte. buffer may be NULL. The library
/// keeps the text until the thread's next error.
///
/// # Safety
/// `buffer` is null or writable for `num_bytes`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_last_error(buffer: *mut c_char, num_bytes: usize) -> usize {
    // SAFETY: the caller meets the conditions of `# Safety`.
    unsafe { copy_last_error(buffer, num_bytes) }
}

/// Reads the file of a grasp model.
///
/// # Safety
/// `file` is null or zero-terminated; `model` is null or writable for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_model_load(file: *const c_char, model: *mut sdg_handle) -> sdg_status {
    // SAFETY: the caller meets the conditions of `# Safety`.
    status(|| unsafe { give(model, "model", || Ok(Object::Model(Arc::new(Model::read(path(file, "file")?)?)))) })
}

/// Writes a model's file atomically. An existing file is replaced only if it is a grasp model.
///
/// # Safety
/// `file` is null or zero-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_model_save(model: sdg_handle, file: *const c_char) -> sdg_status {
    // SAFETY: the caller meets the conditions of `# Safety`.
    status(|| handles::model(model)?.write(unsafe { path(file, "file")? }))
}

/// Teaches a model like `sdg teach`, on all cores, which takes seconds or minutes.
///
/// # Safety
/// `from` is null, or each pointer in it is null or points to a zero-terminated string; `model` is null or writable for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_teach(from: *const sdg_teaching, model: *mut sdg_handle) -> sdg_status {
    let taught = || {
        // SAFETY: the caller meets the conditions of `# Safety`.
        let (from, options) = unsafe { teaching(from.as_ref().ok_or_else(|| null("from"))?)? };
        // No pictures without the part are given.
        let (model, _) = sdg_bindings::teach(&from, options, &mut |_| ControlFlow::Continue(()))?;
        Ok(Object::Model(Arc::new(model)))
    };
    // SAFETY: the caller meets the conditions of `# Safety`.
    status(|| unsafe { give(model, "model", taught) })
}

/// Reads the file of a calibrated camera with its pose over the table, as written by `sdg camera calibrate` and `sdg
/// camera table`.
///
/// # Safety
/// `file` is null or zero-terminated; `camera` is null or writable for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_camera_load(file: *const c_char, camera: *mut sdg_handle) -> sdg_status {
    // SAFETY: the caller meets the conditions of `# Safety`.
    status(|| unsafe { give(camera, "camera", || Ok(Object::Camera(Camera::read(path(file, "file")?)?))) })
}

/// Detects the part in a picture; its pixels are copied first. A picture without the part is not an error. options may
/// be NULL.
///
/// # Safety
/// `picture` is null or has a picture whose `pixels` are readable for `num_bytes` and not changed during the call;
/// `options` is null or has options; `detections` is null or writable for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_detect(
    model: sdg_handle,
    picture: *const sdg_picture,
    options: *const sdg_options,
    detections: *mut sdg_handle,
) -> sdg_status {
    let detected = || {
        let model = handles::model(model)?;
        // SAFETY: the caller meets the conditions of `# Safety`.
        let view = view(unsafe { options.as_ref() })?;
        // SAFETY: the caller meets the conditions of `# Safety`.
        let pixels = unsafe { self::picture(picture.as_ref().ok_or_else(|| null("picture"))?)? };
        Ok(Object::Detections(Arc::new(model.detect(&pixels, &view, DEFAULT_MIN_SCORE)?)))
    };
    // SAFETY: the caller meets the conditions of `# Safety`.
    status(|| unsafe { give(detections, "detections", detected) })
}

/// Gives the number of detections, including refused ones.
///
/// # Safety
/// `count` is null or writable for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_detections_count(detections: sdg_handle, count: *mut usize) -> sdg_status {
    // SAFETY: the caller meets the conditions of `# Safety`.
    status(|| unsafe { write(count, "count", handles::detections(detections)?.len()) })
}

/// Gives the detection with an index, from 0, in order of decreasing score.
///
/// # Safety
/// `found` is null or writable for a detection.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_detections_get(
    detections: sdg_handle,
    idx: usize,
    found: *mut sdg_detection,
) -> sdg_status {
    // SAFETY: the caller meets the conditions of `# Safety`.
    status(|| with_record(detections, idx, |record| unsafe { write(found, "found", detection(record)) }))
}

/// Gives the best accepted detection; SDG_ERROR_NOTHING_TO_GRASP if there is none.
///
/// # Safety
/// `found` is null or writable for a detection.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_detections_best(detections: sdg_handle, found: *mut sdg_detection) -> sdg_status {
    // SAFETY: the caller meets the conditions of `# Safety`.
    status(|| unsafe { write(found, "found", detection(handles::detections(detections)?.best()?)) })
}

/// Copies x and y of the outline's corners in pixels, at most max_points of the detection's num_polygon. numbers may be
/// NULL if nothing is copied.
///
/// # Safety
/// `numbers` is null or writable for `2 * max_points` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_detections_polygon(
    detections: sdg_handle,
    idx: usize,
    numbers: *mut f64,
    max_points: usize,
) -> sdg_status {
    status(|| {
        with_record(detections, idx, |record| {
            let polygon = record.found.detection.polygon.as_deref().unwrap_or_default();
            // SAFETY: the caller meets the conditions of `# Safety`.
            unsafe { copy_rows(polygon, numbers, max_points) }
        })
    })
}

/// Copies x and y in pixels and the network's score of each keypoint, at most max_points of the detection's
/// num_keypoints. numbers may be NULL if nothing is copied.
///
/// # Safety
/// `numbers` is null or writable for `3 * max_points` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_detections_keypoints(
    detections: sdg_handle,
    idx: usize,
    numbers: *mut f64,
    max_points: usize,
) -> sdg_status {
    status(|| {
        // SAFETY: the caller meets the conditions of `# Safety`.
        with_record(detections, idx, |record| unsafe {
            copy_rows(&record.found.detection.keypoints, numbers, max_points)
        })
    })
}

/// Copies all detections to buffer, in the same way as sdg_last_error: the array of `sdg detect --json`, with unrounded
/// numbers. The size of the complete text with its zero byte is written to needed, unless that is NULL.
///
/// # Safety
/// `buffer` is null or writable for `num_bytes`; `needed` is null or writable for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_detections_json(
    detections: sdg_handle,
    buffer: *mut c_char,
    num_bytes: usize,
    needed: *mut usize,
) -> sdg_status {
    status(|| {
        let json = handles::detections(detections)?.to_json();
        // SAFETY: the caller meets the conditions of `# Safety`.
        let all = unsafe { copy_text(&json, buffer, num_bytes) };
        if !needed.is_null() {
            // SAFETY: not null, and the caller promises the rest.
            unsafe { needed.write(all) };
        }
        Ok(())
    })
}

/// Frees a model, a camera or detections. The handle is invalid from then on; calls in other threads that began before
/// complete normally.
#[unsafe(no_mangle)]
pub extern "C" fn sdg_free(handle: sdg_handle) -> sdg_status {
    status(|| handles::free(handle))
}

/// Creates an object and writes its handle.
///
/// # Safety
/// `out` is null or writable for a handle.
unsafe fn give(out: *mut sdg_handle, name: &str, make: impl FnOnce() -> Result<Object>) -> Result<()> {
    // Checked first: an object whose handle cannot be written would never be freed.
    if out.is_null() {
        return Err(null(name));
    }
    let handle = make()?.keep();
    // SAFETY: the caller meets the conditions of `# Safety`.
    unsafe { write(out, name, handle) }
}

fn with_record(detections: sdg_handle, idx: usize, work: impl FnOnce(&Record) -> Result<()>) -> Result<()> {
    let found = handles::detections(detections)?;
    let Some(record) = found.get(idx) else {
        let text = format!("expected idx below {}, the number of detections, found {idx}", found.len());
        return Err(Fault::new(FaultKind::Argument, text));
    };
    work(record)
}
