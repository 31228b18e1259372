//! A first outline of the part in a box, for a person to correct.
//!
//! ```text
//! photo, box ─ frame: box and surroundings, shrunk ─ L*a*b*
//!    │
//!    └─ guesses of the part: areas not explained by the surroundings, lit or in shadow; light areas; dark areas
//!         │
//!         ├─▶ two ColorMixtures ─ evidence of each pixel ─ minimal_cut ─┐   a few rounds for each guess
//!         └───────────────────────────◀─────────────────────────────────┤
//!              the largest piece that runs along edges and reaches the box ─ outer_outline ─ Polygon
//! strokes ─ the pieces of the picture that they select keep their side; the pixels around the pieces are cut again
//! ```
//!
//! The energy is that of GrabCut (Rother, Kolmogorov, Blake 2004): the mismatch of each pixel's colour with its side,
//! and the boundary's length, which is cheaper along edges of the picture. There are three differences. A part's shadow
//! is mostly inside the box and would be learnt as the part's colour; therefore one guess excludes colours of the
//! surroundings in shadow. No single guess suits every photo; therefore several are cut and compared by the meaning of
//! a person's box: the part's outline runs along edges, and reaches the box. The cut is not found by a maximum flow,
//! but as a convex problem, in 60 passes over the picture: its boundaries have no preference for the pixels' axes.
//!
//! The method uses no knowledge of parts, and no randomness. The same photo and box give the same outline.

mod color_mixture;
mod frame;
mod guesses;
mod joined;
mod lab;
mod minimal_cut;
mod pieces;
mod stroke;
mod strokes;

use image::RgbImage;
use sdg_geometry::{BoundingBox, Polygon, outer_outline};

use frame::Frame;
use joined::joined;
pub use stroke::OutlineStroke;
use strokes::Correction;

/// Maximum number of pixels of the frame; larger ones are reduced. Limits the time.
const MAX_PIXELS: f64 = 60_000.0;
/// Number of rounds for each guess: colours are learnt from the guess or the last cut, and the frame is cut again.
const ROUNDS: usize = 4;
/// Minimum area of an outline, as a fraction of the box's area.
const MIN_AREA_SHARE: f64 = 0.02;

/// Proposes the outline of the part inside a person's box.
///
/// The outline lies in the box. If nothing in the box differs from its surroundings, the box itself is proposed.
///
/// # Units and frames
/// Pixels of the photo; the centre of the first pixel is (0.5, 0.5).
pub fn propose_outline(image: &RgbImage, bbox: &BoundingBox) -> Polygon {
    propose_outline_with(image, bbox, &[])
}

/// Like [`propose_outline`], corrected by strokes in drawing order: each selects the piece of the picture on which it
/// lies. Strokes outside the box are ignored.
pub fn propose_outline_with(image: &RgbImage, bbox: &BoundingBox, strokes: &[OutlineStroke]) -> Polygon {
    outline_in(image, bbox, None, strokes)
}

/// Corrects an existing outline by strokes in drawing order: areas far from all strokes stay as they are. Where the
/// outline lies beyond the box, the box is extended; beyond the photo, the outline is clipped.
///
/// Where something was changed, the result is like that of [`propose_outline`]: in the box, in steps of the reduced
/// photo. Elsewhere the outline keeps its vertices, if both can be joined and do not cross. If nothing is left, the
/// result is the box itself.
pub fn correct_outline(image: &RgbImage, bbox: &BoundingBox, outline: &Polygon, strokes: &[OutlineStroke]) -> Polygon {
    outline_in(image, bbox, Some(outline), strokes)
}

/// The outline in the box, detected or corrected.
fn outline_in(image: &RgbImage, bbox: &BoundingBox, known: Option<&Polygon>, strokes: &[OutlineStroke]) -> Polygon {
    let [width, height] = [image.width(), image.height()].map(f64::from);
    let inside = bbox.clip(width, height);
    let nothing_found = || Polygon::from_box(&if inside.area() > 0.0 { inside } else { *bbox });
    let known = known.map(|known| known.clip(width, height));
    let known = known.as_ref();
    let with_box = |known: &Polygon| BoundingBox::around(known.vertices.iter().copied().chain(bbox.corners()));
    let searched = known.and_then(with_box).map_or(inside, |bounds| bounds.clip(width, height));
    let Some(frame) = Frame::cut_out(image, &searched, MAX_PIXELS) else { return nothing_found() };
    let Some(in_part) = segment(&frame, known, strokes) else { return nothing_found() };
    let Some(outline) = outer_outline(&frame.mask(&in_part)) else { return nothing_found() };
    // Pieces of the mask extend to the edges of whole pixels; the box may end within one.
    let outline = frame.in_photo(&outline, &searched);
    if outline.area() < MIN_AREA_SHARE * inside.area() || outline.crosses_itself() {
        return nothing_found();
    }
    let Some(known) = known else { return outline };
    // As in the traced outline, also pieces that a stroke cut off and holes that it closed are changed.
    let before = frame.pixels_of(known);
    let [was, is] = [&before, &in_part].map(|marked| frame.largest_piece(marked));
    let changed: Vec<bool> = (0..was.len()).map(|at| before[at] != in_part[at] || was[at] != is[at]).collect();
    joined(&frame, known, &outline, &changed).unwrap_or(outline)
}

/// The part's pixels, from a known outline or detected; `None` if nothing stands out.
fn segment(frame: &Frame, known: Option<&Polygon>, strokes: &[OutlineStroke]) -> Option<Vec<bool>> {
    let found = match known {
        Some(outline) => Some(frame.pixels_of(outline)),
        None => guesses::likeliest_cut(frame, ROUNDS),
    };
    let strokes: Vec<_> = strokes.iter().filter_map(|stroke| frame.stroke(stroke)).collect();
    if strokes.is_empty() {
        return found;
    }
    // If nothing stands out, the strokes' regions are used.
    let mut correction = Correction::new(frame, found.unwrap_or_else(|| vec![false; frame.colors.len()]));
    strokes.iter().for_each(|stroke| correction.apply(stroke));
    Some(correction.in_part)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use nalgebra::Point2;

    /// A red disc on a chequered table.
    fn disc(size: u32, radius: f64) -> (RgbImage, BoundingBox) {
        let middle = f64::from(size) / 2.0;
        let image = RgbImage::from_fn(size, size, |x, y| {
            let from_middle = (f64::from(x) + 0.5 - middle).hypot(f64::from(y) + 0.5 - middle);
            if from_middle < radius {
                Rgb([170, 60, 50])
            } else if (x / 8 + y / 8).is_multiple_of(2) {
                Rgb([120, 130, 125])
            } else {
                Rgb([150, 150, 145])
            }
        });
        let (low, high) = (middle - radius, middle + radius);
        (image, BoundingBox { x1: low - 6.0, y1: low - 6.0, x2: high + 6.0, y2: high + 6.0 })
    }

    #[test]
    fn a_disc_is_outlined_to_a_pixel() {
        let (image, bbox) = disc(200, 50.0);
        let outline = propose_outline(&image, &bbox);
        for vertex in &outline.vertices {
            let radius = (vertex - Point2::new(100.0, 100.0)).norm();
            assert!((radius - 50.0).abs() < 1.5, "{vertex}: {radius}");
        }
    }

    #[test]
    fn a_dark_part_beside_something_as_dark_is_found() {
        // The area below the box has the part's colour, so the surroundings explain all of the part.
        let image = RgbImage::from_fn(200, 180, |x, y| {
            let dark = (60..140).contains(&x) && ((50..110).contains(&y) || y >= 118);
            let noise = (x * 7 + y * 13) as u8 % 5;
            Rgb([if dark { 30 + noise } else { 195 + noise }; 3])
        });
        let bbox = BoundingBox { x1: 57.0, y1: 47.0, x2: 143.0, y2: 113.0 };
        let area = propose_outline(&image, &bbox).area();
        assert!((area / 4800.0 - 1.0).abs() < 0.05, "{area}");
    }

    #[test]
    fn a_known_outline_is_corrected_at_the_stroke_and_kept_elsewhere() {
        // The outline lacks the disc's left side and has a corner of the table, which only a person would draw.
        let (image, bbox) = disc(200, 50.0);
        let drawn = [[80.0, 55.0], [148.0, 48.0], [148.0, 140.0], [80.0, 145.0]];
        let drawn = Polygon { vertices: drawn.into_iter().map(Into::into).collect() };
        assert_eq!(propose_outline_with(&image, &bbox, &[]), propose_outline(&image, &bbox));
        let unchanged = correct_outline(&image, &bbox, &drawn, &[]);
        assert!((unchanged.area() / drawn.area() - 1.0).abs() < 0.02, "{} of {}", unchanged.area(), drawn.area());
        let corner = Point2::new(145.0, 52.0);
        let missing = Point2::new(60.0, 100.0);
        assert!(unchanged.contains(&corner) && !unchanged.contains(&missing));
        let points = [85.0, 100.0, 115.0].map(|y| Point2::new(60.0, y)).to_vec();
        let corrected = correct_outline(&image, &bbox, &drawn, &[OutlineStroke { points, is_inside: true }]);
        assert!(corrected.contains(&missing) && corrected.contains(&corner), "{corrected:?}");
    }

    /// The vertices of an arc of a disc's rim, in steps of 5°.
    fn arc(middle: f64, radius: f64, steps: std::ops::Range<i32>) -> Polygon {
        let at = |step: i32| {
            let (sin, cos) = f64::from(5 * step).to_radians().sin_cos();
            Point2::new(middle + radius * cos, middle + radius * sin)
        };
        Polygon { vertices: steps.map(at).collect() }
    }

    #[test]
    fn far_from_the_stroke_a_large_outline_keeps_its_vertices() {
        let (image, bbox) = disc(1600, 600.0);
        // The disc's left side is missing.
        let known = arc(800.0, 600.0, -24..25);
        let missing = Point2::new(350.0, 800.0);
        assert!(!known.contains(&missing));
        let points = [700.0, 800.0, 900.0].map(|y| Point2::new(350.0, y)).to_vec();
        let corrected = correct_outline(&image, &bbox, &known, &[OutlineStroke { points, is_inside: true }]);
        assert!(corrected.contains(&missing), "{corrected:?}");
        for vertex in known.vertices.iter().filter(|vertex| vertex.x > 900.0) {
            assert!(corrected.vertices.contains(vertex), "{vertex} of {corrected:?}");
        }
    }

    #[test]
    fn a_known_outline_beyond_the_box_is_kept() {
        let (image, _) = disc(200, 50.0);
        let known = arc(100.0, 50.0, 0..72);
        let bbox = BoundingBox { x1: 70.0, y1: 70.0, x2: 130.0, y2: 130.0 };
        let stroke = OutlineStroke { points: vec![Point2::new(100.0, 100.0)], is_inside: true };
        let corrected = correct_outline(&image, &bbox, &known, &[stroke]);
        assert!(corrected.contains(&Point2::new(55.0, 100.0)) && corrected.contains(&Point2::new(100.0, 145.0)));
        assert!((corrected.area() / known.area() - 1.0).abs() < 0.02, "{corrected:?}");
    }

    /// The outline corrected by one stroke. Its vertices at the lower left must stay.
    fn corrected_by(
        (image, bbox): (&RgbImage, &BoundingBox),
        known: &Polygon,
        line: [[f64; 2]; 2],
        is_inside: bool,
    ) -> Polygon {
        let stroke = OutlineStroke { points: line.map(Point2::from).to_vec(), is_inside };
        let corrected = correct_outline(image, bbox, known, &[stroke]);
        for vertex in known.vertices.iter().filter(|vertex| vertex.x < 140.0 && vertex.y > 130.0) {
            assert!(corrected.vertices.contains(vertex), "{vertex} of {corrected:?}");
        }
        corrected
    }

    #[test]
    fn a_stroke_across_a_cable_cuts_off_its_end() {
        let (mut image, bbox) = disc(300, 50.0);
        for (x, y) in (195..280).flat_map(|x| (148..153).map(move |y| (x, y))) {
            image.put_pixel(x, y, Rgb([170, 60, 50]));
        }
        let bbox = BoundingBox { x2: 286.0, ..bbox };
        let mut known = arc(150.0, 50.0, 1..72);
        known.vertices.extend([[200.0, 148.0], [280.0, 148.0], [280.0, 153.0], [200.0, 153.0]].map(Point2::from));
        let corrected = corrected_by((&image, &bbox), &known, [[240.0, 140.0], [240.0, 160.0]], false);
        assert!(corrected.contains(&Point2::new(150.0, 150.0)));
        for x in [240.5, 270.5] {
            assert!(!corrected.contains(&Point2::new(x, 150.5)), "{corrected:?}");
        }
    }

    /// In the frame, the neck has no pixels, so that the end is a piece of its own.
    #[test]
    fn a_stroke_removes_an_end_behind_a_thin_neck() {
        let (mut image, bbox) = disc(300, 50.0);
        for (x, y) in (240..260).flat_map(|x| (140..161).map(move |y| (x, y))) {
            image.put_pixel(x, y, Rgb([170, 60, 50]));
        }
        let bbox = BoundingBox { x2: 266.0, ..bbox };
        let mut known = arc(150.0, 50.0, 1..72);
        let neck_and_end = [
            [200.0, 150.6],
            [240.0, 150.6],
            [240.0, 140.0],
            [260.0, 140.0],
            [260.0, 161.0],
            [240.0, 161.0],
            [240.0, 150.9],
            [200.0, 150.9],
        ];
        known.vertices.extend(neck_and_end.map(Point2::from));
        assert!(known.contains(&Point2::new(250.5, 150.5)));
        let corrected = corrected_by((&image, &bbox), &known, [[243.0, 150.0], [257.0, 150.0]], false);
        assert!(corrected.contains(&Point2::new(150.0, 150.0)));
        assert!(!corrected.contains(&Point2::new(250.5, 150.5)), "{corrected:?}");
    }

    #[test]
    fn a_stroke_across_a_slot_closes_all_of_it() {
        let (image, bbox) = disc(300, 50.0);
        let mut known = arc(150.0, 50.0, -17..54);
        known.vertices.extend([[147.0, 100.1], [147.0, 150.0], [153.0, 150.0], [153.0, 100.1]].map(Point2::from));
        let corrected = corrected_by((&image, &bbox), &known, [[147.5, 110.0], [152.5, 110.0]], true);
        for y in [110.5, 140.5] {
            assert!(!known.contains(&Point2::new(150.0, y)));
            assert!(corrected.contains(&Point2::new(150.0, y)), "{corrected:?}");
        }
    }

    #[test]
    fn a_known_outline_is_clipped_to_the_photo_and_does_not_cross_itself() {
        let (image, bbox) = disc(200, 50.0);
        let polygon = |vertices: [[f64; 2]; 4]| Polygon { vertices: vertices.map(Point2::from).to_vec() };
        let far = polygon([[60.0, 60.0], [1e10, 60.0], [140.0, 140.0], [60.0, 140.0]]);
        let stroke = OutlineStroke::click(Point2::new(55.0, 100.0), true);
        for strokes in [&[] as &[OutlineStroke], &[stroke]] {
            // Rounding at 1e10 is about 1e-6.
            let bounds = correct_outline(&image, &bbox, &far, strokes).bounds();
            assert!(bounds.x1 >= 0.0 && bounds.y1 >= 0.0 && bounds.x2 <= 200.001 && bounds.y2 <= 200.0, "{bounds:?}");
        }
        let bow_tie = polygon([[60.0, 60.0], [140.0, 140.0], [140.0, 60.0], [60.0, 140.0]]);
        assert!(!correct_outline(&image, &bbox, &bow_tie, &[]).crosses_itself());
    }

    #[test]
    fn large_photos_are_shrunk_and_outlined_at_their_own_size() {
        let (image, bbox) = disc(1600, 600.0);
        let outline = propose_outline(&image, &bbox);
        for vertex in &outline.vertices {
            let radius = (vertex - Point2::new(800.0, 800.0)).norm();
            // A pixel of the reduced picture is about seven pixels of the photo wide.
            assert!((radius - 600.0).abs() < 10.0, "{vertex}: {radius}");
        }
    }

    #[test]
    fn where_nothing_differs_the_box_is_proposed() {
        let flat = RgbImage::from_pixel(100, 80, Rgb([120, 120, 120]));
        let bbox = BoundingBox { x1: 20.0, y1: 20.0, x2: 60.0, y2: 50.0 };
        assert_eq!(propose_outline(&flat, &bbox), Polygon::from_box(&bbox));
        let speck = BoundingBox { x2: 21.0, ..bbox };
        assert_eq!(propose_outline(&flat, &speck), Polygon::from_box(&speck));
        let outside = BoundingBox { x1: 200.0, x2: 260.0, ..bbox };
        assert_eq!(propose_outline(&flat, &outside), Polygon::from_box(&outside));
    }

    #[test]
    fn a_box_around_the_whole_photo_takes_its_edge_for_the_table() {
        let (image, _) = disc(160, 50.0);
        let whole = BoundingBox { x1: -3.0, y1: 0.0, x2: 160.0, y2: 170.0 };
        let area = propose_outline(&image, &whole).area();
        let expected = std::f64::consts::PI * 50.0 * 50.0;
        assert!((area / expected - 1.0).abs() < 0.05, "{area} for {expected}");
    }
}
