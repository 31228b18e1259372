//! The shape of the taught part, as the sequence uses it.

use nalgebra::Point2;
use sdg_grasp::GraspModel;
use sdg_robot::PartShape;

/// The part's shape, if the model knows lengths and its first demonstration has an outline; otherwise `None`: the
/// sequence then assumes a shape from the part's width between the fingers.
pub fn part_shape(model: &GraspModel) -> Option<PartShape> {
    let lengths = model.facts().lengths.as_ref()?;
    let marks = &model.demonstrations().first()?.marks;
    let outline = marks.outline.as_ref()?;
    let (start, end) = (marks.grasp.start, marks.grasp.end);
    let along = (end - start).try_normalize(0.0)?;
    let middle = nalgebra::center(&start, &end);
    // y points down in pictures, as it does in the grasp frame seen from above.
    let in_grasp = |p: &Point2<f64>| {
        let from_middle = (p - middle) / lengths.pixels_per_m;
        Point2::new(along.dot(&from_middle), along.perp(&from_middle))
    };
    // A round bar's marks are at half its height; other parts' marks are on top.
    let top_m = lengths.mark_height_m.max(2.0 * lengths.grasp_height_m);
    let width_m = marks.width_px / lengths.pixels_per_m;
    PartShape::new(outline.vertices.iter().map(in_grasp), width_m, top_m, lengths.grasp_height_m).ok()
}
