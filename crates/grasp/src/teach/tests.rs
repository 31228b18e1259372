//! Every kind of model, taught on a small synthetic part; the networks are small and taught in a few steps.

use std::ops::ControlFlow;
use std::time::Instant;

use burn::tensor::Device;
use image::{Rgb, RgbImage};
use nalgebra::Point2;
use sdg_demonstration::Annotation;
use sdg_detection::config::{NormKind, RcnnConfig, ResizeRule};
use sdg_geometry::{GraspLine, Polygon};
use sdg_training::ValidationConfig;

use super::network_teaching::ReadingTeaching;
use super::preset::OrientationTeaching;
use super::*;
use crate::model::Verification;

/// Width and height of the photo, in pixels.
const PHOTO: [u32; 2] = [192, 144];

/// An L with a bright foot, on a dark background with a brightness gradient.
pub(crate) fn demonstration() -> Demonstration {
    let corners = [(60.0, 40.0), (80.0, 40.0), (80.0, 84.0), (124.0, 84.0), (124.0, 104.0), (60.0, 104.0)];
    let outline = Polygon { vertices: corners.map(|(x, y)| Point2::new(x, y)).to_vec() };
    let mask = outline.rasterize(PHOTO[0], PHOTO[1]);
    let image = RgbImage::from_fn(PHOTO[0], PHOTO[1], |x, y| {
        let table = (50 + x / 8) as u8;
        let part = if x > 100 { [230, 200, 60] } else { [190, 40, 30] };
        Rgb(if mask.get(x, y) { part } else { [table, table, 70] })
    });
    let grasp = Some(GraspLine::new(Point2::new(70.0, 50.0), Point2::new(70.0, 80.0)));
    let annotation =
        Annotation { label: "L".into(), bbox: outline.bounds(), grasp, jaw_width: None, outline: Some(outline) };
    Demonstration { image, annotation }
}

/// Channels of the keypoint head's convolutions.
const SMALL_KEYPOINT_CONVS: [usize; 2] = [16; 2];

/// Reduces a network to few channels and pixels.
fn shrink(network: &mut RcnnConfig) {
    network.input.resize = ResizeRule::FitWithin { width_px: 96, height_px: 72 };
    network.backbone.stem_channels = 8;
    network.backbone.res2_channels = 8;
    network.backbone.num_blocks = [1, 1, 1, 1];
    network.backbone.norm = NormKind::Group { num_groups: 4 };
    network.fpn.channels = 16;
    let heads = &mut network.roi_heads;
    heads.sampler.batch_size_per_image = 32;
    heads.box_head.fc_channels = 32;
    if let Some(head) = &mut heads.keypoint_head {
        head.conv_channels = SMALL_KEYPOINT_CONVS.to_vec();
    }
    if let Some(head) = &mut heads.mask_head {
        (head.conv_channels, head.deconv_channels) = (vec![16; 2], 16);
    }
}

fn whole_teaching(options: &TeachOptions) -> NetworkTeaching {
    NetworkTeaching::new(options, PHOTO).unwrap()
}

/// A preset's settings, reduced for a test, with which any network is good enough.
pub(super) fn small_teaching(options: &TeachOptions) -> NetworkTeaching {
    let mut teaching = whole_teaching(options);
    shrink(&mut teaching.detector.network);
    if let Some(head) = &mut teaching.detector.auxiliary_keypoints {
        head.conv_channels = SMALL_KEYPOINT_CONVS.to_vec();
    }
    teaching.min_hit_rate = 0.0;
    teaching.samples = teaching.samples.with_output_size(96, 72);
    teaching.training.steps = STEPS;
    teaching.training.validation = ValidationConfig { every: STEPS, first: STEPS, samples: 4 };
    if let ReadingTeaching::BoxAndCrop(orientation) = &mut teaching.reading {
        let OrientationTeaching { network, training } = &mut **orientation;
        network.input_px = 32;
        (network.stage_channels, network.stage_convs, network.hidden) = (vec![8, 16], vec![1, 1], 16);
        (training.steps, training.validation_crops) = (STEPS, 4);
    }
    teaching
}

pub(super) fn taught(preset: Preset, kind: ModelKind) -> GraspModel {
    let options = TeachOptions { kind, preset, ..TeachOptions::new(1) };
    teach_network(
        &[demonstration()],
        &[demonstration()],
        &small_teaching(&options),
        &options,
        &mut |_| ControlFlow::Continue(()),
        Instant::now(),
    )
    .unwrap()
    .model
}

/// Number of steps of detector and orientation CNN.
const STEPS: usize = 12;

/// Checks that a model and the same model read from its file give bit-identical detections in the demonstration's
/// photo.
fn assert_same_after_a_file(model: &GraspModel) {
    let bytes = model.to_bytes().unwrap();
    let read = GraspModel::from_bytes(&bytes, &Device::flex()).unwrap();
    assert_eq!((read.kind(), read.facts(), read.preset()), (model.kind(), model.facts(), model.preset()));
    let photo = demonstration().image;
    for verification in [Verification::ByShape, Verification::Off] {
        let found = model.detect(&photo, verification).unwrap();
        assert_eq!(found, read.detect(&photo, verification).unwrap(), "{} {verification:?}", model.kind());
    }
    // With verification, the part is found in its own photo even with an untrained network.
    let best = &read.detect(&photo, Verification::ByShape).unwrap()[0];
    let truth = demonstration().annotation.grasp.unwrap().center();
    assert!(best.is_accepted() && (best.grasp.center() - truth).norm() < 1.0, "{} {best:?}", model.kind());
    assert_eq!(best.keypoints.len(), if model.kind().has_keypoints() { crate::NUM_KEYPOINTS } else { 0 });
}

#[test]
fn a_missing_start_is_known_without_reading_it() {
    for preset in Preset::ALL {
        let options = TeachOptions { preset, ..TeachOptions::new(1) };
        assert_eq!(preset.check_shipped_start().is_ok(), options.with_start_read().is_ok(), "{preset:?}");
    }
}

#[test]
fn every_network_model_detects_the_same_after_a_file() {
    for kind in [ModelKind::A, ModelKind::B, ModelKind::C, ModelKind::D] {
        let model = taught(Preset::Edge, kind);
        assert_eq!(model.facts().steps, STEPS);
        assert_eq!(model.facts().orientation.is_some(), kind == ModelKind::A);
        assert_same_after_a_file(&model);
    }
}

#[test]
fn the_papers_protocol_teaches_every_network_model() {
    for (kind, [steps, batch_size], rate) in
        [(ModelKind::A, [500, 8], 0.005), (ModelKind::C, [1000, 2], 0.0008), (ModelKind::D, [1000, 2], 0.0008)]
    {
        let whole = whole_teaching(&TeachOptions { kind, preset: Preset::Paper, ..TeachOptions::new(1) });
        assert_eq!((whole.training.steps, whole.training.batch_size), (steps, batch_size));
        assert_eq!((whole.training.schedule.peak, whole.distinct_samples), (rate, Some(1500)));
        let model = taught(Preset::Paper, kind);
        assert_eq!((model.preset(), model.facts().samples), ("paper", STEPS * batch_size));
        assert_same_after_a_file(&model);
    }
}

#[test]
fn the_paper_freezes_what_was_imported_and_nothing_else() {
    let frozen = |has_base_weights| {
        let detector = Preset::Paper.detector(ModelKind::C, has_base_weights).unwrap();
        detector.network.backbone.freeze != sdg_detection::config::Freeze::Nothing
    };
    assert!(frozen(true) && !frozen(false));
}

#[test]
fn one_network_serves_the_models_that_are_taught_alike() {
    let taught = taught(Preset::Edge, ModelKind::C);
    let read = taught.clone().read_as(ModelKind::B).unwrap();
    assert_eq!((read.kind(), ModelKind::B.taught_as()), (ModelKind::B, ModelKind::C));
    // Both models give the same boxes, each in the order of its own scores, except at the picture's edge, where one
    // model's grasp may lie outside. Conversion back restores the detections.
    let photo = demonstration().image;
    let said = |model: &GraspModel| model.detect(&photo, Verification::Off).unwrap();
    let boxes = |model: &GraspModel| {
        let boxes = said(model).into_iter().map(|found| found.bbox);
        let mut boxes: Vec<_> = boxes.filter(|bbox| bbox.x2.max(bbox.y2) < f64::from(PHOTO[0])).collect();
        boxes.sort_by(|a, b| a.x1.total_cmp(&b.x1).then(a.y1.total_cmp(&b.y1)));
        boxes
    };
    assert!(!boxes(&read).is_empty());
    assert_eq!(boxes(&read), boxes(&taught));
    assert_eq!(said(&read.clone().read_as(ModelKind::C).unwrap()), said(&taught));
    assert!(read.clone().read_as(ModelKind::A).is_none() && read.read_as(ModelKind::S).is_none());
}

#[test]
fn model_s_is_taught_at_once_and_detects_the_same_after_a_file() {
    let options = TeachOptions { kind: ModelKind::S, ..TeachOptions::new(1) };
    let taught = teach(&[demonstration()], &options, &mut |_: &TeachingEvent| panic!("nothing is trained")).unwrap();
    // The duration depends on the machine: `sdg evaluate` measures it.
    assert!(taught.history.is_none() && taught.model.facts().steps == 0);
    let model = &taught.model;
    assert!(model.to_bytes().unwrap().len() < 100_000);
    assert_same_after_a_file(model);
}

#[test]
fn the_number_of_search_points_is_set_at_detection() {
    let options = TeachOptions { kind: ModelKind::S, ..TeachOptions::new(1) };
    let model = teach(&[demonstration()], &options, &mut |_| ControlFlow::Continue(())).unwrap().model;
    let photo = demonstration().image;
    let detected = |model: &GraspModel| model.detect(&photo, Verification::ByShape).unwrap();
    let with_points = |num_points: usize| model.clone().with_search_points(num_points);
    assert_eq!(detected(&with_points(64).unwrap()), detected(&model));
    let truth = demonstration().annotation.grasp.unwrap().center();
    for num_points in [32, 128] {
        let best = &detected(&with_points(num_points).unwrap())[0];
        assert!(best.is_accepted() && (best.grasp.center() - truth).norm() < 1.0, "{num_points} points: {best:?}");
    }
    let refused = with_points(4).unwrap_err().to_string();
    assert!(refused.contains("num_points from 8 to 1024, found 4"), "{refused}");
}

#[test]
fn two_demonstrations_are_two_views() {
    let mut second = demonstration();
    second.image = image::imageops::flip_horizontal(&second.image);
    let mirrored = |p: &Point2<f64>| Point2::new(f64::from(PHOTO[0]) - p.x, p.y);
    let Annotation { bbox, grasp, outline, .. } = &mut second.annotation;
    *outline = outline.as_ref().map(|o| Polygon { vertices: o.vertices.iter().map(mirrored).collect() });
    *grasp = grasp.map(|line| GraspLine::new(mirrored(&line.start), mirrored(&line.end)));
    *bbox = outline.as_ref().unwrap().bounds();
    let options = TeachOptions { kind: ModelKind::S, ..TeachOptions::new(1) };
    let views = [demonstration(), second];
    let model = teach(&views, &options, &mut |_| ControlFlow::Continue(())).unwrap().model;
    for view in &views {
        let best = &model.detect(&view.image, Verification::ByShape).unwrap()[0];
        let truth = view.annotation.grasp.unwrap().center();
        assert!(best.is_accepted() && (best.grasp.center() - truth).norm() < 1.0, "{best:?}");
    }
}

#[test]
fn a_mark_that_a_model_needs_is_asked_for_by_name() {
    let teach_with = |kind: ModelKind, demonstration: Demonstration| {
        let options = TeachOptions { kind, ..TeachOptions::new(1) };
        teach(&[demonstration], &options, &mut |_| ControlFlow::Break(())).unwrap_err().to_string()
    };
    let mut without_outline = demonstration();
    without_outline.annotation.outline = None;
    assert!(teach_with(ModelKind::D, without_outline).contains("the outline"));
    for kind in ModelKind::ALL {
        let mut without_grasp = demonstration();
        without_grasp.annotation.grasp = None;
        assert!(teach_with(kind, without_grasp).contains("grasp_start"), "{kind}");
    }
}

#[test]
fn an_interrupt_before_there_is_a_network_leaves_nothing() {
    for (kind, reason) in [(ModelKind::A, "orientation CNN"), (ModelKind::D, "no model to keep")] {
        let options = TeachOptions { kind, ..TeachOptions::new(1) };
        let teaching = small_teaching(&options);
        let stop = &mut |_: &TeachingEvent| ControlFlow::Break(());
        let refused = teach_network(&[demonstration()], &[demonstration()], &teaching, &options, stop, Instant::now())
            .unwrap_err();
        assert!(refused.to_string().contains(reason), "{refused}");
    }
}

fn without_network(demonstrations: &[Demonstration]) -> crate::error::Result<GraspModel> {
    let options = TeachOptions { kind: ModelKind::S, ..TeachOptions::new(1) };
    teach(demonstrations, &options, &mut |_| ControlFlow::Continue(())).map(|taught| taught.model)
}

/// The demonstration with sides `factor` times as long.
fn resized(factor: f64) -> Demonstration {
    let mut demonstration = demonstration();
    let [width, height] =
        [demonstration.image.width(), demonstration.image.height()].map(|side| (f64::from(side) * factor) as u32);
    demonstration.image =
        image::imageops::resize(&demonstration.image, width, height, image::imageops::FilterType::Triangle);
    let Annotation { bbox, grasp, outline, .. } = &mut demonstration.annotation;
    *bbox = bbox.scaled(factor, factor);
    *outline = outline.as_ref().map(|o| o.scaled(factor, factor));
    *grasp = grasp.map(|line| GraspLine::new(line.start * factor, line.end * factor));
    demonstration
}

#[test]
fn a_photo_with_another_number_of_pixels_teaches_as_well() {
    let picture = demonstration().image;
    let truth = demonstration().annotation.grasp.unwrap();
    for factor in [0.5, 0.75, 1.5, 3.0] {
        let model = without_network(&[resized(factor)]).unwrap();
        let best = &model.detect(&picture, Verification::ByShape).unwrap()[0];
        assert!(best.is_accepted() && (best.grasp.center() - truth.center()).norm() < 1.5, "{factor}: {best:?}");
        assert!(best.grasp.angle.distance(truth.angle()) < 0.03, "{factor}: {best:?}");
        // The reverse: the photo unchanged, the picture with more or fewer pixels.
        let model = without_network(&[demonstration()]).unwrap();
        let best = &model.detect(&resized(factor).image, Verification::ByShape).unwrap()[0];
        let scaled = truth.center() * factor;
        assert!(
            best.is_accepted() && (best.grasp.center() - scaled).norm() < 1.5 * factor.max(1.0),
            "{factor}: {best:?}"
        );
    }
}

#[test]
fn a_photo_longer_than_the_largest_sample_has_samples_and_teaches() {
    let mut wide = demonstration();
    wide.image = RgbImage::from_pixel(9000, 112, Rgb([60, 60, 70]));
    image::imageops::replace(&mut wide.image, &demonstration().image, 0, 0);
    let wide = [wide];
    without_network(&wide).unwrap();
    let options = TeachOptions { kind: ModelKind::C, ..TeachOptions::new(1) };
    let held_back = Augmenter::new(&wide, small_teaching(&options).held_back, 1).unwrap();
    assert_eq!(held_back.sample(0).image.width(), 8192);
}

#[test]
fn a_narrower_size_tolerance_refuses_other_sizes_and_is_kept_in_the_file() {
    let options = TeachOptions { kind: ModelKind::S, size_tolerance: 0.95..=1.05, ..TeachOptions::new(1) };
    let taught = teach(&[demonstration()], &options, &mut |_| ControlFlow::Continue(())).unwrap().model;
    let read = GraspModel::from_bytes(&taught.to_bytes().unwrap(), &Device::flex()).unwrap();
    assert_eq!(read.size_tolerance(), 0.95..=1.05);
    // The part is larger by a fifth in a picture of the photo's size.
    let larger = resized(1.2).image;
    let picture = image::imageops::crop_imm(&larger, 0, 0, PHOTO[0], PHOTO[1]).to_image();
    let accepts = |model: &GraspModel| {
        model.detect(&picture, Verification::ByShape).unwrap().first().is_some_and(|best| best.is_accepted())
    };
    assert!(!accepts(&read));
    assert!(accepts(&read.with_size_tolerance(0.75..=1.35).unwrap()));
}

#[test]
fn at_most_so_many_are_found_and_none_is_no_number() {
    let model = without_network(&[demonstration()]).unwrap();
    let photo = demonstration().image;
    assert_eq!(model.clone().with_max_detections(1).unwrap().detect(&photo, Verification::ByShape).unwrap().len(), 1);
    let refused = model.with_max_detections(0).unwrap_err().to_string();
    assert_eq!(refused, "expected most detections at least 1, found 0");
}

#[test]
fn what_cannot_be_taught_from_is_refused_with_what_was_found() {
    let refused = |demonstrations: &[Demonstration]| without_network(demonstrations).unwrap_err().to_string();
    let bbox = demonstration().annotation.bbox;
    let tiny = resized(15.0 / bbox.width().max(bbox.height()));
    assert!(refused(&[tiny]).contains("at least 20 pixels in its photo, found 15 × 15"));

    let mut other_label = demonstration();
    other_label.annotation.label = "nut".to_owned();
    assert!(refused(&[demonstration(), other_label]).contains("found number 2 labelled \"nut\""));
    let mut other_grasp = demonstration();
    let grasp = other_grasp.annotation.grasp.as_mut().unwrap();
    *grasp = GraspLine::new(grasp.start + nalgebra::Vector2::new(5.0, 0.0), grasp.end);
    assert!(refused(&[demonstration(), other_grasp]).contains("found the same photo as number 2"));
}
