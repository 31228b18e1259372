//! The shape of the part that a model was taught from, as the sequence takes it.

use nalgebra::Point2;
use sdg_grasp::GraspModel;
use sdg_robot::PartShape;

/// Where the model knows lengths and its first demonstration has an outline; else its width between the fingers is found by the camera.
pub fn part_shape(model: &GraspModel) -> Option<PartShape> {
    let lengths = model.facts().lengths?;
    let marks = &model.demonstrations().first()?.marks;
    let outline = marks.outline.as_ref()?;
    let (start, end) = (marks.grasp.start, marks.grasp.end);
    let along = (end - start).try_normalize(0.0)?;
    let middle = nalgebra::center(&start, &end);
    // Pictures have y down, as the grasp's frame has seen from above.
    let in_grasp = |p: &Point2<f64>| {
        let from_middle = (p - middle) / lengths.pixels_per_m;
        Point2::new(along.dot(&from_middle), along.perp(&from_middle))
    };
    // Marks are in the middle of a round bar and on top of others.
    let top_m = lengths.mark_height_m.max(2.0 * lengths.grasp_height_m);
    let width_m = marks.width_px / lengths.pixels_per_m;
    PartShape::new(outline.vertices.iter().map(in_grasp), width_m, top_m, lengths.grasp_height_m).ok()
}
