//! What stands in a scene.

use super::light::Lighting;
use super::placement::Placement;
use super::table::Table;
use super::view::View;

/// Marks pixels that meet no body.
pub(crate) const TABLE: u8 = u8::MAX;

/// Everything that is drawn.
pub(crate) struct Scene {
    pub view: View,
    pub lighting: Lighting,
    pub table: Table,
    pub bodies: Vec<Placement>,
    /// A shadow of something outside the picture: normal of its edge, distance, width of the edge, strength.
    pub far_shadow: Option<([f32; 2], f32, f32, f32)>,
}
