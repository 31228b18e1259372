//! Converts faults to the exceptions in sdg/_errors.py.

use pyo3::prelude::*;
use pyo3::types::PyType;
use sdg_bindings::{Fault, FaultKind};

/// The exception of a fault.
pub fn exception(py: Python<'_>, fault: Fault) -> PyErr {
    let class = class_of(fault.kind);
    let found = py.import("sdg._errors").and_then(|module| module.getattr(class));
    match found.and_then(|class| Ok(class.cast_into::<PyType>()?)) {
        Ok(class) => PyErr::from_type(class, fault.text),
        Err(error) => error,
    }
}

fn class_of(kind: FaultKind) -> &'static str {
    match kind {
        FaultKind::Argument => "ArgumentError",
        FaultKind::File => "FileError",
        FaultKind::ModelFile => "ModelFileError",
        FaultKind::Picture => "PictureError",
        FaultKind::Camera => "CameraError",
        FaultKind::Region => "RegionError",
        FaultKind::Teaching => "TeachingError",
        FaultKind::NothingToGrasp => "NothingToGrasp",
        FaultKind::Closed => "ClosedError",
        FaultKind::Version => "VersionError",
        FaultKind::Forked => "ForkedError",
        FaultKind::Internal => "SdgError",
    }
}
