//! Marks of other objects beside those of the part: they are skipped and reported.

use crate::annotation::ImageFacts;
use crate::coco_image::{choose_image, is_same_id};
use crate::json::{self, Node, shorten};

/// Whether a LabelMe shape is of a kind that marks no part: a circle, a line, a mask, a point of another name.
pub(crate) fn is_foreign_shape(shape: &Node) -> bool {
    let text = |key: &str| shape.value.get(key).and_then(|value| value.as_str()).map(str::trim);
    match text("shape_type") {
        Some("circle" | "line" | "linestrip" | "points" | "mask") => true,
        // A misspelt grasp is not another object.
        Some("point") => text("label").is_some_and(|label| !label.to_lowercase().contains("grasp")),
        _ => false,
    }
}

/// Whether a COCO annotation is a crowd or a run-length mask without keypoints.
pub(crate) fn is_foreign_annotation(annotation: &Node) -> bool {
    let value = |key: &str| annotation.value.get(key);
    let is_crowd = value("iscrowd").is_some_and(|crowd| crowd == 1 || crowd == true);
    let is_mask = value("segmentation").is_some_and(|segmentation| segmentation.is_object());
    let has_keypoints =
        value("keypoints").and_then(|keypoints| keypoints.as_array()).is_some_and(|all| !all.is_empty());
    (is_crowd || is_mask) && !has_keypoints
}

/// The skipped marks of an image in a COCO or LabelMe file, in words.
pub(crate) fn passed_over(bytes: &[u8], image: &ImageFacts) -> Vec<String> {
    let Ok(value) = json::parse(bytes) else { return Vec::new() };
    let root = Node::root(&value);
    let items = |key: &str| root.optional(key).ok().flatten().and_then(|list| list.items().ok()).unwrap_or_default();
    let shapes = items("shapes").into_iter().filter(is_foreign_shape).map(|shape| {
        let text = |key: &str| shape.value.get(key).and_then(|value| value.as_str()).map(shorten).unwrap_or_default();
        format!("{}: a {} `{}`", shape.place, text("shape_type"), text("label"))
    });
    let id = |of: &Node, key: &str| of.value.get(key).cloned();
    let image_id = choose_image(&items("images"), image).ok().and_then(|chosen| id(&chosen, "id"));
    let is_of_image = |annotation: &Node| {
        image_id.as_ref().zip(id(annotation, "image_id")).is_some_and(|(chosen, own)| is_same_id(chosen, &own))
    };
    let annotations = items("annotations")
        .into_iter()
        .filter(|annotation| is_foreign_annotation(annotation) && is_of_image(annotation))
        .map(|annotation| format!("{}: a crowd or a mask without keypoints", annotation.place));
    shapes.chain(annotations).collect()
}
