//! The contents of a scene.

use super::light::Lighting;
use super::placement::Placement;
use super::table::Table;
use super::view::View;

/// Id of pixels that show no body.
pub(crate) const TABLE: u8 = u8::MAX;

/// The contents of a picture.
pub(crate) struct Scene {
    pub view: View,
    pub lighting: Lighting,
    pub table: Table,
    pub bodies: Vec<Placement>,
    /// A shadow of an object outside the picture: normal of its edge, distance, width of the edge, strength.
    pub far_shadow: Option<([f32; 2], f32, f32, f32)>,
}
