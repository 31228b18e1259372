//! Small evaluations in the simulator (protocol, axes and errors, cameras), each with one part and model S, which is
//! taught in a moment.

use std::fs;
use std::path::Path;

use sdg_grasp::{ModelKind, Preset};
use sdg_simulation::objects::ObjectSpec;

use crate::axes::{
    Against, AxesEvaluation, AxesSummary, GraspCondition, GroupSummary, Selection, Way, difference_tables,
};
use crate::cameras::{self, CamerasEvaluation, CamerasSummary, PictureSet};
use crate::{Evaluation, NoProgress, Settings, Share, Store, Summary, TeachingRecord, markdown, page};

const ATTEMPTS: &str = "cells/S-rod_end.attempts-verified.json";
const MODEL: &str = "models/S-rod_end.sdg";

fn settings() -> Settings {
    Settings {
        protocol: Settings::PROTOCOL,
        preset: Preset::Edge.name().to_owned(),
        steps: None,
        time_budget: None,
        seed: 3,
        attempts: 2,
        views: 2,
        scenes: 2,
        program: None,
    }
}

/// Opens the folder like a separate process, continues until interrupted, and sums the results.
fn go_on(folder: &Path, is_interrupted: &(dyn Fn() -> bool + Sync)) -> Summary {
    let store = Store::open(folder, &settings()).unwrap();
    let evaluation = Evaluation {
        models: &[ModelKind::S],
        objects: &[ObjectSpec::by_name("rod_end").unwrap()],
        preset: Preset::Edge,
        store: &store,
        unverified: true,
        jobs: 2,
    };
    let ended = evaluation.run(is_interrupted, &NoProgress).unwrap();
    let mut summaries = Summary::collect(&evaluation).unwrap();
    assert!(page(&summaries, &store, &[], "sdg evaluate").unwrap().to_html().is_ok());
    let summary = summaries.remove(0);
    assert!(summaries.is_empty(), "a group without parts");
    assert_eq!(ended.is_break(), summary.remaining > 0);
    summary
}

/// Removes the values that differ between runs.
fn timeless(mut summary: Summary) -> Summary {
    for model in &mut summary.models {
        (model.teaching_secs, model.longest_teaching_secs) = (None, None);
        (model.verified.frames_per_second, model.largest_bytes) = (None, None);
    }
    for cell in &mut summary.cells {
        cell.verified.frames_per_second = None;
        if let Some(TeachingRecord::Taught { facts, bytes, .. }) = &mut cell.teaching {
            (facts.seconds, *bytes) = (0.0, 0);
        }
        cell.failures.iter_mut().for_each(|failure| failure.seconds = 0.0);
    }
    summary
}

#[test]
fn an_interrupted_evaluation_goes_on_to_the_same_tables() {
    let (whole, broken) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let whole = go_on(whole.path(), &|| false);
    assert_eq!(whole.remaining, 0);
    let model = &whole.models[0];
    assert_eq!((model.taught.count, model.verified.held.of, model.verified.right.of), (1, 2, 2));
    assert_eq!(model.verified.false_alarms.of, 2);
    assert!(model.alone.is_none() && model.verified.frames_per_second.unwrap() > 0.0);
    // A defect of the search or the robot would be visible here.
    assert!(model.verified.held.count > 0 && model.verified.right.count > 0, "{model:?}");
    assert_eq!(model.verified.false_alarms.count, 0);

    let attempts_file = broken.path().join(ATTEMPTS);
    let interrupted = go_on(broken.path(), &|| attempts_file.exists());
    assert!(
        interrupted.remaining > 0 && markdown(std::slice::from_ref(&interrupted), &[], "").contains("Not complete")
    );
    let read = |name: &str| fs::read(broken.path().join(name)).unwrap();
    let record: serde_json::Value = serde_json::from_slice(&read(ATTEMPTS)).unwrap();
    let first_attempt = &record["record"]["attempts"][0];
    let model_file = read(MODEL);

    let resumed = go_on(broken.path(), &|| false);
    assert_eq!(timeless(resumed.clone()), timeless(whole));
    // Existing results were kept, with their times, so no unit was done twice.
    let record: serde_json::Value = serde_json::from_slice(&read(ATTEMPTS)).unwrap();
    assert_eq!(&record["record"]["attempts"][0], first_attempt);
    assert_eq!(read(MODEL), model_file);
    // A further run has no units to do, and all results are unchanged.
    assert_eq!(go_on(broken.path(), &|| panic!("is_interrupted called: no work left")), resumed);
}

/// Continues with some axes, like a separate process, and sums the results.
fn go_on_with_axes(folder: &Path, names: &[&str], is_interrupted: &(dyn Fn() -> bool + Sync)) -> AxesSummary {
    let store = Store::open(folder, &settings()).unwrap();
    let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
    let evaluation = AxesEvaluation {
        models: &[ModelKind::S],
        objects: &[ObjectSpec::by_name("pendulum").unwrap()],
        selection: &Selection::parse(&names).unwrap(),
        preset: Preset::Edge,
        store: &store,
        axis_views: 2,
        search_points: None,
        jobs: 2,
    };
    let ended = evaluation.run(is_interrupted, &NoProgress).unwrap();
    let summary = AxesSummary::collect(&evaluation).unwrap();
    assert_eq!(ended.remaining, summary.remaining);
    assert!(ended.failures.is_empty(), "{:?}", ended.failures);
    let comparisons = Against::open(folder).unwrap().compare(&evaluation).unwrap();
    assert!(comparisons.iter().all(|comparison| comparison.difference == 0.0 && !comparison.differs));
    let page = crate::axes::page(&summary, difference_tables(&comparisons, "itself"), &[], "sdg evaluate");
    assert!(page.to_html().is_ok());
    summary
}

#[test]
fn interrupted_axes_go_on_and_share_the_teaching() {
    const NAMES: [&str; 4] = ["tilt", "instances", "look-alikes", "mark-height"];
    let folder = tempfile::tempdir().unwrap();
    let tilt_file = folder.path().join("axes/S-pendulum.tilt.json");
    let interrupted = go_on_with_axes(folder.path(), &NAMES, &|| tilt_file.exists());
    assert!(interrupted.remaining > 0);
    let (tilt, model) = (fs::read(&tilt_file).unwrap(), fs::read(folder.path().join("models/S-pendulum.sdg")).unwrap());

    let whole = go_on_with_axes(folder.path(), &NAMES, &|| false);
    assert_eq!(whole.remaining, 0);
    assert_eq!(fs::read(&tilt_file).unwrap(), tilt, "drawn again");
    assert_eq!(fs::read(folder.path().join("models/S-pendulum.sdg")).unwrap(), model, "taught again");
    let [GroupSummary { axes, look_alikes, grasps, .. }] = &whole.groups[..] else { panic!("{:?}", whole.groups) };
    let found = |axis: &str| axes.iter().find(|figures| figures.axis == axis).unwrap().found;
    assert_eq!((found("tilt").of, found("instances").of), (2, 6));
    // Two pictures with the smallest tilts, and two with three pendulums each.
    assert!(found("tilt").count > 0 && found("instances").count >= 3, "{axes:?}");
    assert!(axes.iter().all(|figures| figures.way == Way::WithCheck), "S has no network");
    assert_eq!(
        look_alikes.iter().filter(|figures| figures.is_sum()).map(|figures| figures.accepted.of).sum::<usize>(),
        2
    );
    assert_eq!((grasps[0].condition, grasps[0].held.of), (GraspCondition::MarkHeight, 2));
    assert!(whole.seconds.pictures > 0.0 && whole.seconds.grasps > 0.0);
    // A further run has no units to do.
    assert_eq!(go_on_with_axes(folder.path(), &NAMES, &|| panic!("is_interrupted called: no work left")), whole);
}

/// Continues with these sets of the cameras' pictures, and sums the results.
fn go_on_with_cameras(
    folder: &Path,
    names: &[&str],
    photos: u32,
    is_interrupted: &(dyn Fn() -> bool + Sync),
) -> CamerasSummary {
    let store = Store::open(folder, &settings()).unwrap();
    let sets: Vec<PictureSet> = PictureSet::all().into_iter().filter(|set| names.contains(&set.name())).collect();
    let evaluation = CamerasEvaluation {
        models: &[ModelKind::S],
        objects: &[ObjectSpec::by_name("pendulum").unwrap()],
        sets: &sets,
        preset: Preset::Edge,
        store: &store,
        views: 2,
        photos,
        jobs: 1,
    };
    evaluation.run(is_interrupted, &NoProgress).unwrap();
    CamerasSummary::collect(&evaluation).unwrap()
}

#[test]
fn interrupted_cameras_go_on_and_are_exact() {
    let folder = tempfile::tempdir().unwrap();
    let first = folder.path().join("cameras/S-pendulum.webcam.json");
    // The second photo is marked by the program.
    let go_on = |is_interrupted: &(dyn Fn() -> bool + Sync)| {
        go_on_with_cameras(folder.path(), &["webcam", "instances", "other-sizes"], 2, is_interrupted)
    };
    let interrupted = go_on(&|| first.exists());
    assert!(interrupted.remaining > 0, "{interrupted:?}");
    assert!(cameras::markdown(&interrupted, &[], "sdg evaluate --cameras").contains("Not complete"));
    let whole = go_on(&|| false);
    assert_eq!((whole.remaining, whole.sets.len()), (0, 3));
    let of = |set: &str| whole.sets.iter().find(|figures| figures.set == set).unwrap();
    assert_eq!((of("webcam").found, of("instances").found), (Share { count: 2, of: 2 }, Share { count: 6, of: 6 }));
    assert!(of("webcam").errors.unwrap().p95_mm < 3.0, "{:?}", of("webcam"));
    assert_eq!((of("other-sizes").accepted, of("other-sizes").found.of), (Share { count: 0, of: 2 }, 0));
    assert!(cameras::page(&whole, &[], "sdg evaluate --cameras").to_html().is_ok());
    // Finished units are not done again.
    let again = go_on(&|| panic!("is_interrupted called: no work left"));
    assert_eq!(again.sets, whole.sets);
}

#[test]
fn cameras_are_evaluated_with_the_shipped_photo_alone() {
    let folder = tempfile::tempdir().unwrap();
    let whole = go_on_with_cameras(folder.path(), &["webcam"], 1, &|| false);
    let [webcam] = &whole.sets[..] else { panic!("{:?}", whole.sets) };
    assert_eq!((whole.remaining, webcam.found), (0, Share { count: 2, of: 2 }));
    assert!(webcam.errors.unwrap().p95_mm < 3.0, "{webcam:?}");
    assert!(folder.path().join("models/S-pendulum-plan-view.sdg").exists());
}
