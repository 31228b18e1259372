//! An annotation file under construction.

/// An annotation file under construction, and the marks that it cannot contain.
#[derive(Debug, Clone, PartialEq)]
pub struct WrittenAnnotation {
    /// The file's text.
    pub text: String,
    /// The required content of a `data.yaml` beside it: the labels of a YOLO-pose file.
    pub data_yaml: Option<String>,
    /// The marks that the format cannot contain, in words; empty if nothing was lost.
    pub left_out: Vec<String>,
}
