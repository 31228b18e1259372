//! An annotation file while it is written.

/// An annotation file in the making, and what it had no room for.
#[derive(Debug, Clone, PartialEq)]
pub struct WrittenAnnotation {
    /// The file's text.
    pub text: String,
    /// What must stand beside it in a `data.yaml`: the labels of a YOLO-pose file.
    pub data_yaml: Option<String>,
    /// What the format cannot hold, in words; empty when nothing was lost.
    pub left_out: Vec<String>,
}
