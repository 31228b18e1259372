//! Functions of the header.

use std::ffi::c_char;
use std::ops::ControlFlow;
use std::sync::Arc;

use sdg_bindings::{Camera, Fault, FaultKind, Model, Record, Result};

use crate::border::{check_abi, copy_last_error, copy_text, null, path, status};
use crate::convert::{copy_rows, detection, picture, teaching, view, write};
use crate::handles::{self, Object};
use crate::types::*;

/// The library's SDG_ABI_VERSION.
#[unsafe(no_mangle)]
pub extern "C" fn sdg_abi_version() -> u32 {
    SDG_ABI_VERSION
}

/// To be called first with SDG_ABI_VERSION, the header's: SDG_ERROR_VERSION where the library has another.
#[unsafe(no_mangle)]
pub extern "C" fn sdg_check_abi(abi_version: u32) -> sdg_status {
    status(|| check_abi("a program", abi_version))
}

/// Copies the text of the calling thread's last error into buffer, in UTF-8, cut off where there is no room, always ended by a zero
/// byte. Gives the number of bytes of all of it with the zero byte. buffer may be NULL. The text stays until the thread's next error.
///
/// # Safety
/// `buffer` is null, or `num_bytes` may be written there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_last_error(buffer: *mut c_char, num_bytes: usize) -> usize {
    // SAFETY: the caller promises the same.
    unsafe { copy_last_error(buffer, num_bytes) }
}

/// Reads the file of a grasp model.
///
/// # Safety
/// `file` is null or ends with a zero byte; `model` is null, or a handle may be written there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_model_load(file: *const c_char, model: *mut sdg_handle) -> sdg_status {
    // SAFETY: the caller promises the same.
    status(|| unsafe { give(model, "model", || Ok(Object::Model(Arc::new(Model::read(path(file, "file")?)?)))) })
}

/// Writes a model's file, whole or not at all. It replaces a grasp model or nothing.
///
/// # Safety
/// `file` is null or ends with a zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_model_save(model: sdg_handle, file: *const c_char) -> sdg_status {
    // SAFETY: the caller promises the same.
    status(|| handles::model(model)?.write(unsafe { path(file, "file")? }))
}

/// Teaches a model as `sdg teach` does. It computes on all cores, for seconds or minutes.
///
/// # Safety
/// `from` is null or has pointers that are null or texts that end with a zero byte; `model` is null, or a handle may be written there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_teach(from: *const sdg_teaching, model: *mut sdg_handle) -> sdg_status {
    let taught = || {
        // SAFETY: the caller promises the same.
        let (from, options) = unsafe { teaching(from.as_ref().ok_or_else(|| null("from"))?)? };
        let model = sdg_bindings::teach(&from, options, &mut |_| ControlFlow::Continue(()))?;
        Ok(Object::Model(Arc::new(model)))
    };
    // SAFETY: the caller promises the same.
    status(|| unsafe { give(model, "model", taught) })
}

/// Reads the file of a calibrated camera with its pose over the table, as `sdg camera calibrate` and `sdg camera table` write it.
///
/// # Safety
/// `file` is null or ends with a zero byte; `camera` is null, or a handle may be written there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_camera_load(file: *const c_char, camera: *mut sdg_handle) -> sdg_status {
    // SAFETY: the caller promises the same.
    status(|| unsafe { give(camera, "camera", || Ok(Object::Camera(Camera::read(path(file, "file")?)?))) })
}

/// Finds the part in a picture, whose pixels are copied first. A picture without the part is no error here. options may be NULL.
///
/// # Safety
/// `picture` is null or has a picture, of whose `pixels` `num_bytes` may be read and are not written during the call; `options` is null
/// or has options; `detections` is null, or a handle may be written there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_detect(
    model: sdg_handle,
    picture: *const sdg_picture,
    options: *const sdg_options,
    detections: *mut sdg_handle,
) -> sdg_status {
    let detected = || {
        let model = handles::model(model)?;
        // SAFETY: the caller promises the same.
        let view = view(unsafe { options.as_ref() })?;
        // SAFETY: the caller promises the same.
        let pixels = unsafe { self::picture(picture.as_ref().ok_or_else(|| null("picture"))?)? };
        Ok(Object::Detections(Arc::new(model.detect(&pixels, &view)?)))
    };
    // SAFETY: the caller promises the same.
    status(|| unsafe { give(detections, "detections", detected) })
}

/// The number of detections, the refused ones with them.
///
/// # Safety
/// `count` is null, or a number may be written there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_detections_count(detections: sdg_handle, count: *mut usize) -> sdg_status {
    // SAFETY: the caller promises the same.
    status(|| unsafe { write(count, "count", handles::detections(detections)?.len()) })
}

/// A detection by its number, from 0; the best score first.
///
/// # Safety
/// `found` is null, or a detection may be written there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_detections_get(
    detections: sdg_handle,
    idx: usize,
    found: *mut sdg_detection,
) -> sdg_status {
    // SAFETY: the caller promises the same.
    status(|| with_record(detections, idx, |record| unsafe { write(found, "found", detection(record)) }))
}

/// The best of the accepted detections; SDG_ERROR_NOTHING_TO_GRASP where there is none.
///
/// # Safety
/// `found` is null, or a detection may be written there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_detections_best(detections: sdg_handle, found: *mut sdg_detection) -> sdg_status {
    // SAFETY: the caller promises the same.
    status(|| unsafe { write(found, "found", detection(handles::detections(detections)?.best()?)) })
}

/// Copies x and y of the outline's corners in pixels, at most max_points of the num_polygon that a detection has.
///
/// # Safety
/// `numbers` is null, or `2 * max_points` numbers may be written there.
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
            // SAFETY: the caller promises the same.
            unsafe { copy_rows(polygon, numbers, max_points) }
        })
    })
}

/// Copies x and y in pixels and the network's score of the keypoints, at most max_points of the num_keypoints that a detection has.
///
/// # Safety
/// `numbers` is null, or `3 * max_points` numbers may be written there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_detections_keypoints(
    detections: sdg_handle,
    idx: usize,
    numbers: *mut f64,
    max_points: usize,
) -> sdg_status {
    status(|| {
        // SAFETY: the caller promises the same.
        with_record(detections, idx, |record| unsafe {
            copy_rows(&record.found.detection.keypoints, numbers, max_points)
        })
    })
}

/// Copies all detections as the array of `sdg detect --json`, with every digit, into buffer as sdg_last_error does. The number of bytes of
/// all of it with the zero byte is written to needed, unless that is NULL.
///
/// # Safety
/// `buffer` is null, or `num_bytes` may be written there; `needed` is null, or a number may be written there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdg_detections_json(
    detections: sdg_handle,
    buffer: *mut c_char,
    num_bytes: usize,
    needed: *mut usize,
) -> sdg_status {
    status(|| {
        let json = handles::detections(detections)?.to_json();
        // SAFETY: the caller promises the same.
        let all = unsafe { copy_text(&json, buffer, num_bytes) };
        if !needed.is_null() {
            // SAFETY: not null, and the caller promises the rest.
            unsafe { needed.write(all) };
        }
        Ok(())
    })
}

/// Frees a model, a camera or detections. The handle is an error from then on; calls in other threads that began before still end well.
#[unsafe(no_mangle)]
pub extern "C" fn sdg_free(handle: sdg_handle) -> sdg_status {
    status(|| handles::free(handle))
}

/// Makes an object and writes its handle.
///
/// # Safety
/// `out` is null, or a handle may be written there.
unsafe fn give(out: *mut sdg_handle, name: &str, make: impl FnOnce() -> Result<Object>) -> Result<()> {
    // First: nothing would free an object whose handle cannot be written.
    if out.is_null() {
        return Err(null(name));
    }
    let handle = make()?.keep();
    // SAFETY: the caller promises the same.
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
