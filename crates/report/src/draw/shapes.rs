//! Draws lines, boxes, polygons, keypoints and the gripper's jaws.

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_geometry::{BoundingBox, Keypoint, PlanarGrasp, Polygon, Visibility};

use tiny_skia::FillRule;

use super::paint::{HALO_COLOR, HALO_OPACITY, HALO_WIDTH, fill, inside_of, is_finite, stroke, stroke_translucent};
use super::{Color, Pen};

/// Draws a straight line.
pub fn draw_line(image: &mut RgbImage, from: Point2<f64>, to: Point2<f64>, pen: &Pen) {
    stroke(image, &[vec![from, to]], pen);
}

/// Draws the four edges of a box.
pub fn draw_box(image: &mut RgbImage, bounds: &BoundingBox, pen: &Pen) {
    let mut corners = bounds.corners().to_vec();
    corners.push(corners[0]);
    stroke(image, &[corners], pen);
}

/// Draws the closed outline of a polygon.
pub fn draw_polygon(image: &mut RgbImage, polygon: &Polygon, pen: &Pen) {
    let mut vertices = polygon.vertices.clone();
    if let Some(&first) = vertices.first() {
        vertices.push(first);
        stroke(image, &[vertices], pen);
    }
}

/// Tints the inside of a polygon; opacity 0 has no effect, 1 covers the picture.
pub fn shade_polygon(image: &mut RgbImage, polygon: &Polygon, color: Color, opacity: f64) {
    if let Some(path) = inside_of(image, &polygon.vertices) {
        fill(image, path, FillRule::EvenOdd, color, opacity.clamp(0.0, 1.0));
    }
}

/// Draws keypoints: discs for visible ones, rings for hidden ones. Unlabelled ones are not drawn.
///
/// The pen's width is the radius of a disc or ring; the dash is ignored.
pub fn draw_keypoints(image: &mut RgbImage, keypoints: &[Keypoint], pen: &Pen) {
    for keypoint in keypoints {
        let center = keypoint.point();
        match keypoint.visibility {
            Visibility::Unlabelled => {}
            Visibility::Visible => {
                let disc = Pen { width: 2.0 * pen.width, dash: None, ..*pen };
                stroke(image, &[vec![center, center]], &disc);
            }
            Visibility::Occluded => ring(image, center, pen.width, &pen.width(0.6 * pen.width)),
        }
    }
}

/// Draws a grasp as a gripper seen from above: two jaws, arrows in their closing direction, and a dot at the centre.
///
/// The jaws' inner faces are at the positions of [`PlanarGrasp::jaws`], across the marked line. The arrows are outside,
/// so that the part between the jaws is visible.
pub fn draw_grasp_jaws(image: &mut RgbImage, grasp: &PlanarGrasp, pen: &Pen) {
    let center = grasp.center();
    let faces = grasp.jaws();
    if !(faces.iter().all(is_finite) && pen.width.is_finite() && pen.width > 0.0) {
        return;
    }
    let (sin, cos) = grasp.angle.radians().sin_cos();
    let along = Vector2::new(cos, sin);
    let outward = Vector2::new(-sin, cos);
    let thickness = 2.4 * pen.width;
    let half_length = (0.42 * grasp.width.abs()).clamp(5.0 * pen.width, 14.0 * pen.width);
    let solid = Pen { dash: None, ..*pen };

    for (face, side) in faces.into_iter().zip([-1.0, 1.0]) {
        let away = outward * side;
        let back = face + away * thickness;
        let tail = back + away * (6.5 * pen.width);
        stroke(image, &[vec![back, tail]], &solid);
        let barb = |turn: f64| back + away * (3.2 * pen.width) + along * (turn * 2.6 * pen.width);
        fill_convex(image, &[back + away * (0.4 * pen.width), barb(1.0), barb(-1.0)], pen);
        let reach = along * half_length;
        fill_convex(image, &[face - reach, face + reach, back + reach, back - reach], pen);
    }
    stroke(image, &[vec![center, center]], &solid.width(3.0 * pen.width));
}

/// Fills a convex polygon in the pen's colour, with its halo.
fn fill_convex(image: &mut RgbImage, corners: &[Point2<f64>], pen: &Pen) {
    if pen.halo {
        let mut closed = corners.to_vec();
        closed.push(corners[0]);
        let rim = Pen { color: HALO_COLOR, width: 2.0 * HALO_WIDTH, halo: false, dash: None };
        stroke_translucent(image, &[closed], &rim, HALO_OPACITY);
    }
    if let Some(path) = inside_of(image, corners) {
        fill(image, path, FillRule::Winding, pen.color, 1.0);
    }
}

fn ring(image: &mut RgbImage, center: Point2<f64>, radius: f64, pen: &Pen) {
    let circle = (0..=24)
        .map(|step| {
            let angle = f64::from(step) / 24.0 * std::f64::consts::TAU;
            center + Vector2::new(angle.cos(), angle.sin()) * radius
        })
        .collect();
    stroke(image, &[circle], &Pen { dash: None, ..*pen });
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use image::Rgb;
    use proptest::prelude::*;
    use sdg_geometry::Angle;

    const GREY: Rgb<u8> = Rgb([128, 128, 128]);
    const RED: Color = Color([255, 0, 0]);

    /// The rasteriser computes coverage in steps of about a sixteenth, and round ends cover a corner's pixel
    /// incompletely.
    const TOLERANCE: u8 = 8;

    #[track_caller]
    fn assert_near(image: &RgbImage, x: u32, y: u32, expected: [u8; 3]) {
        let found = image.get_pixel(x, y).0;
        let is_near = found.iter().zip(&expected).all(|(a, b)| a.abs_diff(*b) <= TOLERANCE);
        assert!(is_near, "({x}, {y}): expected {expected:?}, found {found:?}");
    }

    fn canvas() -> RgbImage {
        RgbImage::from_pixel(60, 40, GREY)
    }

    fn thin() -> Pen {
        Pen::new(RED).width(1.0).without_halo()
    }

    #[test]
    fn a_line_through_pixel_centres_fills_one_row_alone() {
        let mut image = canvas();
        draw_line(&mut image, Point2::new(10.5, 20.5), Point2::new(30.5, 20.5), &thin());
        assert_eq!(image.get_pixel(20, 20).0, [255, 0, 0]);
        assert_eq!(*image.get_pixel(20, 19), GREY);
        assert_eq!(*image.get_pixel(20, 21), GREY);
        assert_eq!(*image.get_pixel(33, 20), GREY);
    }

    #[test]
    fn a_line_between_two_rows_covers_each_by_half() {
        let mut image = canvas();
        draw_line(&mut image, Point2::new(10.5, 20.0), Point2::new(30.5, 20.0), &thin());
        // Half of red on grey 128: (128 + 255) / 2 and 128 / 2, rounded.
        for row in [19, 20] {
            assert_near(&image, 20, row, [192, 64, 64]);
        }
    }

    #[test]
    fn a_box_has_edges_and_an_empty_inside() {
        let mut image = canvas();
        let bounds = BoundingBox::new(5.5, 5.5, 50.5, 30.5).unwrap();
        draw_box(&mut image, &bounds, &thin());
        for (x, y) in [(5, 5), (50, 5), (5, 30), (50, 30), (25, 5), (25, 30), (5, 20), (50, 20)] {
            assert_near(&image, x, y, [255, 0, 0]);
        }
        assert_eq!(*image.get_pixel(25, 18), GREY);
    }

    #[test]
    fn a_polygon_closes_and_shades_its_inside() {
        let mut image = canvas();
        let triangle =
            Polygon { vertices: vec![Point2::new(10.5, 10.5), Point2::new(40.5, 10.5), Point2::new(10.5, 35.5)] };
        shade_polygon(&mut image, &triangle, RED, 1.0);
        assert_eq!(image.get_pixel(15, 15).0, [255, 0, 0]);
        assert_eq!(*image.get_pixel(38, 33), GREY);
        let mut image = canvas();
        draw_polygon(&mut image, &triangle, &thin());
        assert_eq!(image.get_pixel(10, 20).0, [255, 0, 0], "the closing edge");
        assert_eq!(*image.get_pixel(15, 15), GREY);
    }

    #[test]
    fn jaws_stand_outside_the_part_and_across_the_line() {
        let mut image = RgbImage::from_pixel(100, 100, GREY);
        let grasp = PlanarGrasp { x: 50.5, y: 50.5, angle: Angle::ZERO, width: 40.0 };
        draw_grasp_jaws(&mut image, &grasp, &Pen::new(RED).width(1.0).without_halo());
        // The faces are at y = 30.5 and 70.5; the jaws are 2.4 pixels thick and extend 14 pixels to each side; the
        // arrows end 9 pixels outside the faces.
        for (x, y) in [(50, 29), (50, 71), (60, 29), (60, 71), (50, 23)] {
            assert_eq!(image.get_pixel(x, y).0, [255, 0, 0], "({x}, {y})");
        }
        for (x, y) in [(66, 29), (60, 25), (50, 18), (50, 40), (29, 50)] {
            assert_eq!(*image.get_pixel(x, y), GREY, "({x}, {y})");
        }

        let mut turned = RgbImage::from_pixel(100, 100, GREY);
        let grasp = PlanarGrasp { angle: Angle::from_degrees(90.0), ..grasp };
        draw_grasp_jaws(&mut turned, &grasp, &Pen::new(RED).width(1.0).without_halo());
        assert_eq!(turned.get_pixel(29, 50).0, [255, 0, 0]);
        assert_eq!(*turned.get_pixel(50, 29), GREY);
    }

    #[test]
    fn keypoints_are_discs_rings_or_nothing() {
        let mut image = canvas();
        let at = |x, visibility| Keypoint { x, y: 20.5, visibility };
        let keypoints =
            [at(10.5, Visibility::Visible), at(30.5, Visibility::Occluded), at(50.5, Visibility::Unlabelled)];
        draw_keypoints(&mut image, &keypoints, &Pen::new(RED).width(4.0).without_halo());
        assert_eq!(image.get_pixel(10, 20).0, [255, 0, 0]);
        assert_eq!(*image.get_pixel(30, 20), GREY, "a ring is open");
        assert_eq!(image.get_pixel(34, 20).0, [255, 0, 0]);
        assert_eq!(*image.get_pixel(50, 20), GREY);
    }

    #[test]
    fn the_halo_darkens_beside_the_line() {
        let mut image = canvas();
        draw_line(&mut image, Point2::new(10.5, 20.5), Point2::new(30.5, 20.5), &Pen::new(RED).width(1.0));
        assert!(image.get_pixel(20, 21).0[0] < 100);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]
        #[test]
        fn nothing_drawn_anywhere_panics(
            x in prop_oneof![-1e9..1e9f64, Just(f64::NAN), Just(f64::INFINITY), 0.0..60.0f64],
            y in prop_oneof![-1e9..1e9f64, Just(f64::NEG_INFINITY), 0.0..40.0f64],
            width in prop_oneof![0.0..1e7f64, Just(f64::NAN), 0.0..50.0f64],
            degrees in -180.0..180.0f64,
        ) {
            let mut image = canvas();
            let pen = Pen::new(RED).dashed(3.0, 2.0);
            draw_grasp_jaws(&mut image, &PlanarGrasp { x, y, angle: Angle::from_degrees(degrees), width }, &pen);
            draw_line(&mut image, Point2::new(x, y), Point2::new(y, width), &pen);
            let polygon = Polygon { vertices: vec![Point2::new(x, y), Point2::new(y, x), Point2::new(3.0, width)] };
            draw_polygon(&mut image, &polygon, &pen);
            shade_polygon(&mut image, &polygon, RED, width);
            draw_keypoints(&mut image, &[Keypoint::visible(Point2::new(x, y))], &pen);
        }
    }
}
