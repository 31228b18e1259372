//! Draws on a frame the progress of taking pictures of a board.

use image::RgbImage;
use nalgebra::Point2;
use sdg_calibration::{BoardSession, SeenCorner};
use sdg_geometry::{Keypoint, Polygon, convex_hull};
use sdg_report::{Color, Pen, draw_box, draw_keypoints, draw_label, draw_polygon, line_width};

/// Colour of the board in the frame.
const BOARD: Color = Color([255, 196, 61]);

/// Draws the board's corners, the views taken so far, the parts of the picture without views, and two texts in the
/// lower left corner: the state, and below it the next view.
pub fn draw_board_session(
    picture: &mut RgbImage,
    session: &BoardSession<'_>,
    corners: &[SeenCorner],
    [now, next]: [&str; 2],
) {
    let width = line_width(picture);
    for view in session.taken() {
        let hull = Polygon { vertices: convex_hull(view.iter().map(|seen| seen.pixel)) };
        draw_polygon(picture, &hull, &Pen::new(Color::VERIFIED).width(0.5 * width).without_halo());
    }
    for part in session.empty_parts() {
        let pen = Pen::new(Color::NEUTRAL).width(0.5 * width).dashed(6.0 * width, 4.0 * width);
        draw_box(picture, &part, &pen);
    }
    let places: Vec<Keypoint> = corners.iter().map(|seen| Keypoint::visible(seen.pixel)).collect();
    draw_keypoints(picture, &places, &Pen::new(BOARD).width(0.6 * width));
    let text_px = (f64::from(picture.width().max(picture.height())) / 55.0).max(8.0);
    let mut bottom = f64::from(picture.height());
    // A new line after each colon, so that the text fits into the picture.
    for line in next.split(": ").collect::<Vec<_>>().into_iter().rev().filter(|line| !line.is_empty()) {
        draw_label(picture, Point2::new(0.0, bottom), line, Color::NEUTRAL, text_px);
        bottom -= 2.5 * text_px;
    }
    draw_label(picture, Point2::new(0.0, bottom), now, BOARD, 1.2 * text_px);
}
