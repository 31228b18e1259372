//! The search of a region compared with that of the whole picture, and the errors.

use std::ops::ControlFlow;

use image::RgbImage;
use sdg_geometry::{Angle, BoundingBox, PlanarGrasp};

use crate::detection::GraspDetection;
use crate::drawn_part::{self, at};
use crate::facts::{ModelKind, TurnSource};
use crate::model::{GraspModel, Verification};
use crate::region::SearchRegion;
use crate::teach::{TeachOptions, teach};

const SIZE: [u32; 2] = [480, 360];
/// Maximum difference in position: the region's search reads the same pixels around a part, but starts from other
/// places.
const MAX_APART_PX: f64 = 0.3;
/// Maximum difference in angle, for the same reason.
const MAX_TURN_RAD: f64 = 0.01;
/// Maximum difference of scores: the region determines the table's colours, and the best detection in the region
/// determines the reference size.
const MAX_SCORES_APART: f64 = 0.05;

fn picture() -> RgbImage {
    drawn_part::picture(
        SIZE,
        &[at(80.0, 70.0, 20.0), at(240.0, 90.0, 140.0), at(390.0, 120.0, -70.0), at(150.0, 270.0, 75.0)],
    )
}

fn accepted(model: &GraspModel, picture: &RgbImage) -> Vec<GraspDetection> {
    let mut found = model.detect(picture, Verification::ByShape).unwrap();
    found.retain(GraspDetection::is_accepted);
    found
}

fn refused(model: &GraspModel, picture: &RgbImage) -> String {
    model.detect(picture, Verification::ByShape).unwrap_err().to_string()
}

/// A region is moved across the picture. At every position, the search of the region finds exactly those parts in the
/// region that the search of the whole picture finds there.
#[test]
fn in_a_region_is_found_what_the_whole_picture_has_there() {
    let (model, picture) = (drawn_part::model(SIZE), picture());
    let whole = accepted(&model, &picture);
    assert_eq!(whole.len(), 4);
    let (mut num_parts, mut num_cut) = (0, 0);
    for (x, y) in (0..=280).step_by(35).flat_map(|x| (0..=160).step_by(40).map(move |y| (x, y))) {
        let region = SearchRegion::new([x, y, 200, 200]);
        let found = accepted(&model.clone().with_region(Some(region)).unwrap(), &picture);
        let expected: Vec<_> = whole.iter().filter(|detection| detection.lies_in(&region)).collect();
        assert_eq!(found.len(), expected.len(), "{region}: {found:#?}");
        for detection in expected {
            let apart = |found: &GraspDetection| (found.grasp.center() - detection.grasp.center()).norm();
            let nearest = found.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap();
            assert!(apart(nearest) < MAX_APART_PX, "{region}: {} px", apart(nearest));
            assert!(nearest.grasp.angle.distance(detection.grasp.angle) < MAX_TURN_RAD, "{region}");
            assert!((nearest.score - detection.score).abs() < MAX_SCORES_APART, "{region}: {}", nearest.score);
            let bounds = [&nearest.bbox, &detection.bbox].map(|bbox| bbox.corners());
            assert!(bounds[0].iter().zip(&bounds[1]).all(|(a, b)| (a - b).norm() < 2.0 * MAX_APART_PX), "{region}");
            num_parts += 1;
        }
        let is_cut = |detection: &&GraspDetection| {
            let bounds = region.bounds();
            let corners = detection.bbox.corners();
            corners.iter().any(|corner| bounds.contains(corner))
                && !corners.iter().all(|corner| bounds.contains(corner))
        };
        num_cut += whole.iter().filter(is_cut).count();
    }
    // Enough parts lie in the regions and across their borders for the test to be meaningful.
    assert!(num_parts >= 20 && num_cut >= 20, "{num_parts} parts, {num_cut} cut");
}

/// Pixels beyond the surroundings of the region are not read.
#[test]
fn the_rest_of_the_picture_changes_nothing() {
    let region = SearchRegion::new([20, 10, 120, 120]);
    let model = drawn_part::model(SIZE).with_region(Some(region)).unwrap();
    let mut other = picture();
    for (x, y, pixel) in other.enumerate_pixels_mut().filter(|(x, y, _)| *x > 260 || *y > 260) {
        *pixel = image::Rgb([(x * 7 % 256) as u8, (y * 11 % 256) as u8, 40]);
    }
    let [one, two] = [picture(), other].map(|picture| model.detect(&picture, Verification::ByShape).unwrap());
    assert_eq!(one, two);
    assert!(one[0].is_accepted());
}

#[test]
fn the_best_outside_takes_no_place_of_one_inside() {
    let (model, picture) = (drawn_part::model(SIZE), picture());
    let region = SearchRegion::new([100, 190, 110, 160]);
    for model in [
        model.clone().with_max_detections(1).unwrap().with_region(Some(region)).unwrap(),
        model.with_region(Some(region)).unwrap().with_max_detections(1).unwrap(),
    ] {
        let found = model.detect(&picture, Verification::ByShape).unwrap();
        assert!(found.len() == 1 && found[0].lies_in(&region) && found[0].is_accepted(), "{found:?}");
    }
}

#[test]
fn places_where_a_refused_part_differs_are_places_of_the_picture() {
    let model = drawn_part::model(SIZE);
    // A part whose foot is covered.
    let mut picture = drawn_part::picture(SIZE, &[at(240.0, 190.0, 0.0)]);
    for (_, _, pixel) in picture.enumerate_pixels_mut().filter(|(x, y, _)| *x > 245 && *y > 190) {
        *pixel = image::Rgb([20, 160, 60]);
    }
    let best = model.detect(&picture, Verification::ByShape).unwrap().swap_remove(0);
    let region = SearchRegion::new([140, 90, 200, 200]);
    let cut = model.clone().with_region(Some(region)).unwrap();
    let [whole, cut] = [model, cut].map(|model| model.differences(&picture, &[&best]).swap_remove(0).unwrap());
    assert!(whole.edges.len() + whole.surface.len() > 10, "{whole:?}");
    for (whole, cut) in [(&whole.edges, &cut.edges), (&whole.surface, &cut.surface)] {
        assert_eq!(whole.len(), cut.len());
        assert!(whole.iter().zip(cut).all(|(a, b)| (a - b).norm() < 1e-6));
    }
}

#[test]
fn half_of_a_part_and_its_grasp_point_decide() {
    let region = SearchRegion::new([100, 50, 60, 40]);
    let detection = |x: f64, y: f64| GraspDetection {
        demonstration_idx: 0,
        score: 0.9,
        network_score: 0.0,
        agreement: None,
        evidence: None,
        bbox: BoundingBox { x1: x - 20.0, y1: y - 10.0, x2: x + 20.0, y2: y + 10.0 },
        keypoints: Vec::new(),
        outline: None,
        grasp: PlanarGrasp { x: x + 5.0, y, angle: Angle::ZERO, width: 10.0 },
        turn_source: TurnSource::Search,
        light: 1.0,
    };
    // The detection's box extends from x − 20 to x + 20; the grasp is 5 to the right of the centre.
    assert!(detection(120.0, 70.0).lies_in(&region));
    assert!(detection(100.0, 70.0).lies_in(&region), "half");
    assert!(!detection(99.0, 70.0).lies_in(&region), "less than half");
    assert!(detection(154.9, 70.0).lies_in(&region) && !detection(155.0, 70.0).lies_in(&region), "the grasp point");
    // Only a quarter of the area is inside, although the grasp point is.
    assert!(!detection(99.0, 51.0).lies_in(&region));
}

#[test]
fn regions_that_cannot_be_searched_are_refused_each_with_its_reason() {
    let (model, picture) = (drawn_part::model(SIZE), picture());
    let with = |region: SearchRegion| model.clone().with_region(Some(region));
    let empty = with(SearchRegion::new([10, 10, 0, 50])).unwrap_err().to_string();
    assert_eq!(empty, "expected a region of at least 1 × 1 pixels, found 0 × 50 pixels from (10, 10)");
    for [x, y, width, height] in [[400, 0, 81, 100], [0, 261, 100, 100], [481, 0, 100, 100], [u32::MAX, 0, u32::MAX, 9]]
    {
        let region = SearchRegion::new([x, y, width, height]);
        let outside = refused(&with(region).unwrap(), &picture);
        assert!(
            outside.contains("within the picture of 480 × 360 pixels, found") && outside.contains(&region.to_string())
        );
        assert!(with(region.of_picture(SIZE)).is_err());
    }
    assert!(with(SearchRegion::new([380, 260, 100, 100]).of_picture(SIZE)).is_ok(), "at the picture's corner");
    let other = refused(&with(SearchRegion::new([0, 0, 300, 200]).of_picture([640, 480])).unwrap(), &picture);
    assert_eq!(other, "expected a picture of 640 × 480 pixels, for which the region was given, found 480 × 360");
    // The part's box is 64 px wide and high, 91 px from corner to corner; at the smallest size, three quarters, 68 px.
    let small = with(SearchRegion::new([100, 100, 60, 30]).of_picture(SIZE)).unwrap_err().to_string();
    assert!(small.contains("that the part fits in, which is 68 pixels long and "), "{small}");
    assert!(small.ends_with("found 60 × 30 pixels from (100, 100): make it larger"), "{small}");
    assert!(refused(&with(SearchRegion::new([100, 100, 60, 30])).unwrap(), &picture).contains("make it larger"));
    // Teaching rejects the region before it starts.
    let mut options = TeachOptions { kind: ModelKind::C, ..TeachOptions::new(1) };
    options.region = Some(SearchRegion::new([100, 100, 60, 30]).of_picture(SIZE));
    let demonstration = drawn_part::demonstration(SIZE);
    let error = teach(&[demonstration], &options, &mut |_| ControlFlow::Break(())).unwrap_err().to_string();
    assert_eq!(error, small);
}
