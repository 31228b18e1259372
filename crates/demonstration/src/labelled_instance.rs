//! One part on a test picture, as labelled.

use crate::json::Node;
use crate::{Annotation, Result};

/// One part on a picture, as labelled.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelledInstance {
    /// The marks, in pixels of the picture. If the picture's border clips the part, the box is clipped and the outline
    /// left out.
    pub annotation: Annotation,
    /// Whether the instance is left out of the counts, so that neither missing it nor detecting it is an error. For
    /// parts that are mostly covered or seen from another side. LabelMe: the flag `optional` of any shape of the group;
    /// COCO: `attributes.optional`.
    pub optional: bool,
    /// Its position in the file, such as `shapes[3]` or `annotations[0]`; empty for one that does not come from a file.
    pub place: String,
}

impl LabelledInstance {
    /// An instance that does not come from a file.
    pub fn new(annotation: Annotation, optional: bool) -> Self {
        Self { annotation, optional, place: String::new() }
    }

    /// Instances without the flag `optional`.
    pub(crate) fn not_optional(objects: Vec<Annotation>) -> Vec<Self> {
        objects.into_iter().map(|object| Self::new(object, false)).collect()
    }
}

/// The flag `optional` of an object with flags or attributes; `false` if absent.
pub(crate) fn is_optional(flags: Option<&Node>) -> Result<bool> {
    let Some(flags) = flags.filter(|flags| flags.value.is_object()) else { return Ok(false) };
    match flags.optional("optional")? {
        None => Ok(false),
        Some(flag) => flag.value.as_bool().ok_or_else(|| flag.malformed("true or false")),
    }
}
