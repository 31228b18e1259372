//! Errors in a form for other languages: a kind and a text.

use std::fmt;

use sdg_calibration::CameraFileError;
use sdg_cell::CellError;
use sdg_demonstration::PictureError;
use sdg_files::FileError;
use sdg_grasp::GraspError;

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Fault>;

/// The kind of an error; a class in Python, a number in C.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum FaultKind {
    /// A value that a function does not accept.
    Argument = 1,
    /// A file that does not exist, or that the system cannot read or write.
    File = 2,
    /// A file that is not a grasp model, is damaged, or has another version.
    ModelFile = 3,
    /// An invalid picture or array.
    Picture = 4,
    /// An invalid camera file, a camera without a pose, or a model taught without a calibrated camera.
    Camera = 5,
    /// A region that cannot be searched.
    Region = 6,
    /// A photo or marks unsuitable for teaching.
    Teaching = 7,
    /// No part to grasp.
    NothingToGrasp = 8,
    /// An object that was closed or freed.
    Closed = 9,
    /// A caller that was built for another version of this library.
    Version = 10,
    /// An internal error of this library.
    Internal = 11,
    /// A process that was forked from one with threads of this library.
    Forked = 12,
}

/// An error with the text that `sdg` would print.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// The kind of error.
    pub kind: FaultKind,
    /// The whole message.
    pub text: String,
}

impl Fault {
    /// An error of this kind.
    pub fn new(kind: FaultKind, text: impl Into<String>) -> Self {
        Self { kind, text: text.into() }
    }

    /// Assigns this kind to any error.
    pub(crate) fn of_kind(kind: FaultKind) -> impl FnOnce(anyhow::Error) -> Self {
        move |error| Self { kind, text: sdg_inputs::one_line(&error) }
    }

    /// Assigns this kind, unless one of the causes has a kind.
    pub(crate) fn of_kind_or(kind: FaultKind) -> impl FnOnce(anyhow::Error) -> Self {
        move |error| {
            let kind = error.chain().find_map(kind_of).unwrap_or(kind);
            Self { kind, text: sdg_inputs::one_line(&error) }
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl std::error::Error for Fault {}

impl From<anyhow::Error> for Fault {
    fn from(error: anyhow::Error) -> Self {
        Self::of_kind_or(FaultKind::Internal)(error)
    }
}

impl From<CellError> for Fault {
    fn from(error: CellError) -> Self {
        anyhow::Error::from(error).into()
    }
}

impl From<GraspError> for Fault {
    fn from(error: GraspError) -> Self {
        anyhow::Error::from(error).into()
    }
}

impl From<FileError> for Fault {
    fn from(error: FileError) -> Self {
        anyhow::Error::from(error).into()
    }
}

fn kind_of(cause: &(dyn std::error::Error + 'static)) -> Option<FaultKind> {
    if let Some(CellError::Grasp(error)) = cause.downcast_ref() {
        return Some(kind_of_model_error(error));
    }
    if let Some(CellError::Camera(error)) = cause.downcast_ref() {
        return Some(kind_of_camera_error(error));
    }
    if let Some(error) = cause.downcast_ref() {
        return Some(kind_of_model_error(error));
    }
    if let Some(error) = cause.downcast_ref() {
        return Some(kind_of_camera_error(error));
    }
    if cause.is::<PictureError>() {
        return Some(FaultKind::Picture);
    }
    cause.is::<FileError>().then_some(FaultKind::File)
}

fn kind_of_model_error(error: &GraspError) -> FaultKind {
    match error {
        GraspError::NotAModel { .. } | GraspError::OtherVersion { .. } | GraspError::Damaged { .. } => {
            FaultKind::ModelFile
        }
        GraspError::Region(_) => FaultKind::Region,
        GraspError::NoLengths | GraspError::PlanView(_) | GraspError::OffPlane { .. } => FaultKind::Camera,
        GraspError::ImageTooSmall { .. } => FaultKind::Picture,
        GraspError::UnknownModel(_) | GraspError::UnknownPreset { .. } | GraspError::InvalidConfig { .. } => {
            FaultKind::Argument
        }
        _ => FaultKind::Teaching,
    }
}

fn kind_of_camera_error(error: &CameraFileError) -> FaultKind {
    match error {
        CameraFileError::OtherSize { .. } => FaultKind::Picture,
        _ => FaultKind::Camera,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn a_cause_decides_the_kind_and_all_of_them_the_text() {
        let missing = crate::Model::read(Path::new("/no/such.sdg")).unwrap_err();
        assert_eq!(missing.kind, FaultKind::File);
        assert_eq!(missing.text, "/no/such.sdg: cannot read: No such file or directory (os error 2)");
        let small = GraspError::ImageTooSmall { least: 16, width: 3, height: 2 };
        assert_eq!(Fault::from(CellError::from(small)).kind, FaultKind::Picture);
        assert_eq!(Fault::from(GraspError::NoLengths).kind, FaultKind::Camera);
    }
}
