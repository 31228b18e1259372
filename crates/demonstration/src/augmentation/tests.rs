//! Samples compared with their annotations.

use image::{Rgb, RgbImage};
use nalgebra::Point2;
use sdg_geometry::{BoundingBox, GraspLine, Polygon, Visibility};

use super::homography::Homography;
use super::pose::{draw_pose, share_inside};
use super::prepared::Prepared;
use super::random::{Stream, sample_rng};
use super::*;
use crate::{Annotation, Demonstration, NUM_KEYPOINTS};

/// Maximum distance between a drawn dot and its keypoint.
const DOT_TOLERANCE_PX: f64 = 0.5;

/// A red L with white dots at both ends of its grasp line, on a dark grey table.
fn demonstration(with_outline: bool) -> Demonstration {
    let corners = [(220.0, 200.0), (420.0, 210.0), (418.0, 250.0), (262.0, 246.0), (258.0, 330.0), (215.0, 325.0)];
    let outline = Polygon { vertices: corners.map(|(x, y)| Point2::new(x, y)).to_vec() };
    let grasp = GraspLine::new(Point2::new(270.0, 225.0), Point2::new(380.0, 230.0));
    let image = RgbImage::from_fn(640, 480, |x, y| {
        let p = Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        if (p - grasp.start).norm() < 5.0 || (p - grasp.end).norm() < 5.0 {
            Rgb([255, 255, 255])
        } else if outline.contains(&p) {
            Rgb([200, 30, 30])
        } else {
            Rgb([60, 60, 60])
        }
    });
    let bbox = outline.bounds();
    let outline = with_outline.then_some(outline);
    Demonstration {
        image,
        annotation: Annotation { label: "L".into(), bbox, grasp: Some(grasp), jaw_width: None, outline },
    }
}

fn augmenter(style: SceneStyle) -> Augmenter {
    let config = AugmentationConfig { style: AugmentationStyle::Scenes(style), ..AugmentationConfig::default() };
    Augmenter::new(&[demonstration(true)], config.with_output_size(320, 240), 11).unwrap()
}

/// Mostly the warp: no cover, blur or noise, and at most one distractor.
fn plain() -> SceneStyle {
    SceneStyle {
        positive_share: 1.0,
        mutant_share: 0.0,
        max_distractors: 1,
        occlusion_probability: 0.0,
        blur_probability: 0.0,
        max_noise: 0.0,
        jpeg_probability: 0.0,
        ..SceneStyle::default()
    }
}

#[test]
fn a_sample_is_the_same_in_any_order_and_by_any_augmenter() {
    let (one, other) = (augmenter(SceneStyle::default()), augmenter(SceneStyle::default()));
    let forward: Vec<Sample> = (0..12).map(|index| one.sample(index)).collect();
    for index in (0..12).rev() {
        assert!(other.sample(index as u64) == forward[index], "sample {index}");
    }
    assert!(one.held_out(3) == other.held_out(3));
    assert!(one.held_out(3).image != forward[3].image, "held-out samples differ from training samples");
    assert!(forward[4].image != forward[5].image);
    let config = AugmentationConfig::default().with_output_size(320, 240);
    let other_seed = Augmenter::new(&[demonstration(true)], config, 12).unwrap();
    assert!(other_seed.sample(4).image != forward[4].image);
}

/// Mean position of the white pixels around `near`, weighted by their green.
fn dot_center(image: &RgbImage, near: Point2<f64>) -> Option<Point2<f64>> {
    const REACH: i64 = 5;
    let mut sum = [0.0; 3];
    for dy in -REACH..=REACH {
        for dx in -REACH..=REACH {
            let (x, y) = (near.x as i64 + dx, near.y as i64 + dy);
            if x < 0 || y < 0 || x >= i64::from(image.width()) || y >= i64::from(image.height()) {
                return None;
            }
            // The part is red: green distinguishes the dot from it under any light.
            let green = f64::from(image.get_pixel(x as u32, y as u32)[1]);
            let center = image.get_pixel(near.x as u32, near.y as u32)[1];
            let weight = (green - 0.5 * f64::from(center)).max(0.0);
            sum[0] += weight;
            sum[1] += weight * (x as f64 + 0.5);
            sum[2] += weight * (y as f64 + 0.5);
        }
    }
    Some(Point2::new(sum[1] / sum[0], sum[2] / sum[0]))
}

fn check_dots(samples: impl Iterator<Item = Sample>) -> usize {
    let mut checked = 0;
    for (index, sample) in samples.enumerate() {
        for object in &sample.objects {
            assert_eq!(object.keypoints.len(), NUM_KEYPOINTS);
            for keypoint in [object.keypoints[0], object.keypoints[NUM_KEYPOINTS - 1]] {
                let Some(found) = dot_center(&sample.image, keypoint.point()) else { continue };
                let miss = (found - keypoint.point()).norm();
                assert!(miss < DOT_TOLERANCE_PX, "sample {index}: dot at {found}, keypoint at {}", keypoint.point());
                checked += 1;
            }
        }
    }
    checked
}

#[test]
fn a_drawn_dot_lands_at_its_keypoint() {
    let dotted = augmenter(SceneStyle { max_distractors: 1, ..plain() });
    assert!(check_dots((0..60).map(|i| dotted.sample(i))) > 90);
    let paper = AugmentationConfig::paper().with_output_size(320, 240);
    let paper = Augmenter::new(&[demonstration(true)], paper, 5).unwrap();
    assert!(check_dots((0..40).map(|i| paper.sample(i))) > 40);
}

#[test]
fn a_part_outside_a_paper_sample_is_no_object() {
    let mut near_corner = demonstration(false);
    near_corner.annotation.bbox = BoundingBox { x1: 60.0, y1: 60.0, x2: 140.0, y2: 140.0 };
    near_corner.annotation.grasp = None;
    let paper = Augmenter::new(&[near_corner], AugmentationConfig::paper().with_output_size(160, 120), 5).unwrap();
    let samples: Vec<Sample> = (0..200).map(|index| paper.sample(index)).collect();
    let boxes: Vec<BoundingBox> = samples.iter().flat_map(|sample| &sample.objects).map(|object| object.bbox).collect();
    assert!(boxes.iter().all(|bbox| bbox.width() >= 1.0 && bbox.height() >= 1.0), "{boxes:?}");
    // About 7 % of the poses move this part out of the picture.
    assert!((170..200).contains(&boxes.len()), "{} of 200 samples with the part", boxes.len());
}

/// The box of the pixels that are clearly redder than they are green.
fn red_box(image: &RgbImage) -> Option<BoundingBox> {
    let red = image.enumerate_pixels().filter(|(_, _, p)| f64::from(p[0]) > 2.2 * f64::from(p[1]) + 12.0);
    let corners = red.flat_map(|(x, y, _)| {
        let (x, y) = (f64::from(x), f64::from(y));
        [Point2::new(x, y), Point2::new(x + 1.0, y + 1.0)]
    });
    BoundingBox::around(corners)
}

#[test]
fn boxes_are_tight_around_the_part() {
    let mut checked = 0;
    // Only on its own table: elsewhere other objects may be red.
    let augmenter = augmenter(SceneStyle { photo_background_share: 1.0, ..plain() });
    for index in 0..40 {
        let sample = augmenter.sample(index);
        let Some(red) = red_box(&sample.image) else { continue };
        let bbox = sample.objects[0].bbox;
        let gap = [red.x1 - bbox.x1, red.y1 - bbox.y1, bbox.x2 - red.x2, bbox.y2 - red.y2];
        // A distractor with the part's colour enlarges the red box; such samples are skipped.
        if gap.iter().all(|&g| g > -1.5) {
            assert!(gap.iter().all(|&g| g < 2.5), "sample {index}: {red:?} in {bbox:?}");
            checked += 1;
        }
    }
    assert!(checked > 25, "{checked}");
}

#[test]
fn scenes_without_the_part_have_no_object_and_show_none_of_it() {
    let augmenter = augmenter(SceneStyle { positive_share: 0.0, ..SceneStyle::default() });
    assert!((0..20).all(|index| augmenter.sample(index).objects.is_empty()));
    // After erasing the part from its photo, no red is left.
    let part = Prepared::new(&demonstration(true), [320, 240], &mut sample_rng(1, Stream::Preparation, 0));
    assert!(part.background.pixels.iter().all(|p| p[0] < 1.5 * p[1]), "red remains");
    let share = {
        let augmenter = self::augmenter(SceneStyle::default());
        (0..200).filter(|&index| augmenter.sample(index).objects.is_empty()).count()
    };
    assert!((30..70).contains(&share), "{share} of 200 without the part, a quarter was asked for");
}

#[test]
fn other_parts_lie_about_where_there_are_any() {
    let style = SceneStyle { positive_share: 0.0, photo_background_share: 1.0, other_part_share: 1.0, ..plain() };
    let mut green = demonstration(true);
    green.image.pixels_mut().for_each(|pixel| pixel.0.swap(0, 1));
    let without = augmenter(style.clone());
    let with = augmenter(style).with_other_parts(&[green.clone()]).unwrap();
    let shows_green = |augmenter: &Augmenter, index: u64| {
        let image = augmenter.sample(index).image;
        image.pixels().filter(|p| f64::from(p[1]) > 2.2 * f64::from(p[0]) + 12.0).count() > 200
    };
    let count = |augmenter: &Augmenter| (0..40).filter(|&i| shows_green(augmenter, i)).count();
    assert!(count(&with) > 25 && count(&without) < 8, "{} {}", count(&with), count(&without));
    green.annotation.outline = None;
    assert!(augmenter(plain()).with_other_parts(&[green]).is_err());
}

#[test]
fn poses_keep_the_part_in_view_and_never_mirror_it() {
    let part = Prepared::new(&demonstration(true), [320, 240], &mut sample_rng(1, Stream::Preparation, 0));
    let style = SceneStyle::default();
    let mut angles = [0usize; 4];
    for index in 0..400 {
        let pose = draw_pose(&part, &style, 320.0, 240.0, &mut sample_rng(9, Stream::Training, index));
        assert!(share_inside(&part, &pose, 320.0, 240.0) >= 0.75);
        assert!(part.region.vertices.iter().all(|vertex| pose.handedness(vertex) > 0.0), "mirrored");
        let object = SampleObject::new(&part, &pose, [320, 240], 0);
        let similarity = object.image_from_demonstration;
        // Half size times a scale of 0.83 to 1.2; the tilt changes the product by a few percent.
        assert!((0.36..0.63).contains(&similarity.scale), "{}", similarity.scale);
        let center = similarity.apply(&part.center) - pose.apply(&part.center);
        assert!(center.norm() < 2.0, "similarity is {} px off the warp", center.norm());
        angles[((similarity.angle.degrees() + 180.0) / 90.0) as usize % 4] += 1;
        for keypoint in &object.keypoints {
            let inside = (0.0..=320.0).contains(&keypoint.x) && (0.0..=240.0).contains(&keypoint.y);
            assert_eq!(inside, keypoint.visibility == Visibility::Visible);
        }
    }
    assert!(angles.iter().all(|&count| count > 60), "{angles:?}");
}

#[test]
fn a_part_that_fills_the_photo_still_gets_a_pose() {
    let mut filling = demonstration(true);
    filling.annotation.bbox = BoundingBox { x1: 1.0, y1: 1.0, x2: 639.0, y2: 479.0 };
    filling.annotation.outline = Some(Polygon::from_box(&filling.annotation.bbox));
    let config = AugmentationConfig::default().with_output_size(160, 160);
    let augmenter = Augmenter::new(&[filling], config, 1).unwrap();
    for sample in (0..8).map(|index| augmenter.sample(index)) {
        for object in sample.objects {
            assert!(object.bbox.area() > 0.5 * 160.0 * 120.0 * 0.6, "{:?}", object.bbox);
        }
    }
}

#[test]
fn covers_hide_keypoints_of_some_samples() {
    let augmenter = augmenter(SceneStyle { occlusion_probability: 1.0, positive_share: 1.0, ..SceneStyle::default() });
    let hidden = (0..60)
        .map(|index| augmenter.sample(index))
        .filter(|sample| sample.objects[0].keypoints.iter().any(|k| k.visibility == Visibility::Occluded))
        .count();
    assert!((10..60).contains(&hidden), "{hidden} of 60 samples with a hidden keypoint");
}

#[test]
fn the_box_alone_is_enough() {
    let config = AugmentationConfig::default().with_output_size(320, 240);
    let augmenter = Augmenter::new(&[demonstration(false)], config, 1).unwrap();
    let positive = (0..20).map(|index| augmenter.sample(index)).find(|sample| !sample.objects.is_empty()).unwrap();
    assert_eq!(positive.objects[0].outline, None);
}

#[test]
fn a_warp_without_tilt_is_its_similarity() {
    let part = Prepared::new(&demonstration(true), [320, 240], &mut sample_rng(1, Stream::Preparation, 0));
    let style = SceneStyle { max_foreshortening: 0.0, max_perspective: 0.0, ..SceneStyle::default() };
    let pose = draw_pose(&part, &style, 320.0, 240.0, &mut sample_rng(9, Stream::Training, 3));
    let similarity = SampleObject::new(&part, &pose, [320, 240], 0).image_from_demonstration;
    let again = Homography::from_similarity(&similarity);
    for vertex in &part.region.vertices {
        assert!((again.apply(vertex) - pose.apply(vertex)).norm() < 1e-6);
    }
}

#[test]
fn a_sample_can_be_written_down_and_read_again() {
    let augmenter = augmenter(SceneStyle { positive_share: 1.0, ..SceneStyle::default() });
    for index in 0..10 {
        let sample = augmenter.sample(index);
        let annotation = sample.objects[0].annotation("L", &sample.image);
        let mut file = crate::CocoFile::new();
        file.push_image("sample.png", 320, 240, std::slice::from_ref(&annotation));
        let facts = crate::ImageFacts { width: 320, height: 240, file_name: None };
        let read = Annotation::read(file.to_json().as_bytes(), &facts).unwrap();
        assert_eq!(read[0].grasp.is_some(), annotation.grasp.is_some());
        assert!(read[0].bbox.iou(&annotation.bbox) > 0.999);
    }
}

#[test]
fn settings_and_demonstrations_are_checked() {
    let refuse = |demonstrations: &[Demonstration]| {
        Augmenter::new(demonstrations, AugmentationConfig::default(), 1).err().unwrap().to_string()
    };
    assert!(refuse(&[]).contains("at least one"));
    for size in [[8193, 480], [640, 15]] {
        let config = AugmentationConfig { output_size: Some(size), ..AugmentationConfig::default() };
        let told = Augmenter::new(&[demonstration(true)], config, 1).err().unwrap().to_string();
        assert!(told.contains("16 to 8192 pixels a side"), "{told}");
    }
    let mut outside = demonstration(true);
    outside.annotation.grasp = Some(GraspLine::new(Point2::new(f64::NAN, 3.0), Point2::new(9.0, 9.0)));
    assert!(refuse(&[outside]).contains("grasp of `L`"));
}

#[test]
fn windows_keep_the_scale_and_hold_the_part() {
    let frames = augmenter(plain());
    let windows = frames.windows(32);
    let [width, height] = windows.output_size();
    // The L's vertices are up to 129 photo pixels from its centre: 65 in the frame, 155 across at the largest scale.
    assert_eq!([width, height], [224, 192]);
    assert_eq!((windows.sample(0).image.width(), windows.sample(0).image.height()), (width, height));
    let mean_scale = |sample: &dyn Fn(u64) -> Sample| {
        (0..40).map(|i| sample(i).objects[0].image_from_demonstration.scale).sum::<f64>() / 40.0
    };
    let (in_windows, in_frames) = (mean_scale(&|i| windows.sample(i)), mean_scale(&|i| frames.sample(i)));
    assert!((in_windows / in_frames - 1.0).abs() < 0.05);
    assert!(check_dots((0..30).map(|i| windows.sample(i))) > 40);
    let whole = (0..40).filter(|&i| {
        let object = &windows.sample(i).objects[0];
        object.keypoints.iter().all(|keypoint| keypoint.is_labelled())
    });
    assert!(whole.count() > 30);
}
