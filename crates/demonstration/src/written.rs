//! The content of an annotation file.

/// The content of an annotation file, and the marks that it cannot contain.
#[derive(Debug, Clone, PartialEq)]
pub struct WrittenAnnotation {
    /// The file's text.
    pub text: String,
    /// The content of the `data.yaml` that a YOLO-pose file needs beside it, with the labels; `None` for other formats.
    pub data_yaml: Option<String>,
    /// The marks that the format cannot contain, in words; empty if nothing was lost.
    pub left_out: Vec<String>,
}
