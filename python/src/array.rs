//! Converts numpy arrays to pictures through the dictionary `__array_interface__`: Python's buffer protocol is not in
//! its stable interface before 3.11.

use image::RgbImage;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sdg_bindings::{Fault, FaultKind, PixelOrder, PixelShape};

use crate::errors::exception;

/// Copies an array of bytes with any strides; the GIL must be held.
///
/// # Errors
/// An array that is not a `numpy.ndarray`, has another element type or shape, or unknown channels.
pub fn picture(array: &Bound<'_, PyAny>, channels: &str) -> PyResult<RgbImage> {
    let py = array.py();
    let fault = |kind, text: String| exception(py, Fault::new(kind, text));
    let order = match channels {
        "rgb" => PixelOrder::Rgb,
        "bgr" => PixelOrder::Bgr,
        _ => {
            let text = format!("expected channels=\"rgb\" or \"bgr\" (OpenCV's arrays), found \"{channels}\"");
            return Err(fault(FaultKind::Argument, text));
        }
    };
    // Only this class: a subclass could return another address.
    let class = array.get_type();
    if !class.is(&py.import("numpy")?.getattr("ndarray")?) {
        let text = format!("expected a numpy.ndarray, found {}", class.name()?);
        return Err(fault(FaultKind::Picture, text));
    }
    let interface = array.getattr("__array_interface__")?.cast_into::<PyDict>()?;
    let entry = |name: &str| interface.as_any().get_item(name);
    if entry("typestr")?.extract::<String>()? != "|u1" {
        let found = array.getattr("dtype")?.str()?;
        return Err(fault(FaultKind::Picture, format!("expected an array of dtype uint8, found {found}")));
    }
    let shape: Vec<usize> = entry("shape")?.extract()?;
    let checked = PixelShape::new(&shape).map_err(|error| exception(py, error))?;
    let strides: Vec<isize> = array.getattr("strides")?.extract()?;
    let (address, _is_read_only): (usize, bool) = entry("data")?.extract()?;
    let first = address as *const u8;
    let stride_of = |axis: usize| strides.get(axis).copied().unwrap_or(0);
    let [down, right, deeper] = [stride_of(0), stride_of(1), stride_of(2)];
    Ok(checked.copy(order, |row, column, channel| {
        // Inside the array, so inside its memory, whose size fits isize.
        let offset = row as isize * down + column as isize * right + channel as isize * deeper;
        // SAFETY: numpy gives the address of the first element and the strides of an array of bytes, whose elements
        // exist at every index within its shape; row, column and channel are within it. `array` keeps the memory alive,
        // and while the GIL is held no Python code resizes it.
        unsafe { first.offset(offset).read() }
    }))
}
