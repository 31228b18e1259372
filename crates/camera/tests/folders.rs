//! `dir:`: silence, broken files and a folder that is away do not start it again from its first picture.

use std::fs::{self, File};
use std::io::Write;
use std::time::{Duration, SystemTime};

use sdg_camera::{Camera, Fault};

use crate::support::{jpeg, level_of, open};

/// The faults of the next frame, which has this level.
fn next_has_level(camera: &mut dyn Camera, level: u8) -> Vec<Fault> {
    let frame = camera.next_frame().unwrap().unwrap();
    assert!(level_of(&frame).abs_diff(level) < 3, "{frame:?}");
    frame.faults
}

#[test]
fn a_followed_folder_continues_after_silence() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.jpg"), jpeg(40)).unwrap();
    let mut camera = open(&format!("dir:{}?follow", folder.path().display()));
    assert_eq!(next_has_level(camera.as_mut(), 40), []);
    for _ in 0..4 {
        let error = camera.next_frame().unwrap_err();
        assert!(matches!(error.fault(), Some(Fault::Stale { .. })), "{error}");
    }
    fs::write(folder.path().join("b.jpg"), jpeg(120)).unwrap();
    assert_eq!(next_has_level(camera.as_mut(), 120), []);
}

#[test]
fn many_broken_files_are_reported_once_each() {
    let folder = tempfile::tempdir().unwrap();
    for number in 0..31 {
        let mut file = File::create(folder.path().join(format!("{number:02}.jpg"))).unwrap();
        file.write_all(b"not a picture").unwrap();
        // A file that was modified long ago is complete, so it is not read again.
        file.set_modified(SystemTime::now() - Duration::from_secs(60)).unwrap();
    }
    fs::write(folder.path().join("good.jpg"), jpeg(120)).unwrap();
    let mut camera = open(&format!("dir:{}", folder.path().display()));
    for _ in 0..31 {
        let error = camera.next_frame().unwrap_err();
        assert!(matches!(error.fault(), Some(Fault::Torn { .. })), "{error}");
    }
    assert_eq!(next_has_level(camera.as_mut(), 120), []);
    assert!(camera.next_frame().unwrap().is_none());
}

#[test]
fn a_folder_that_was_away_continues() {
    let files = tempfile::tempdir().unwrap();
    let [folder, away] = ["pictures", "away"].map(|name| files.path().join(name));
    fs::create_dir(&folder).unwrap();
    for (name, level) in [("a.jpg", 40), ("b.jpg", 120)] {
        fs::write(folder.join(name), jpeg(level)).unwrap();
    }
    let mut camera = open(&format!("dir:{}", folder.display()));
    assert_eq!(next_has_level(camera.as_mut(), 40), []);
    fs::rename(&folder, &away).unwrap();
    let error = camera.next_frame().unwrap_err();
    assert!(matches!(error.fault(), Some(Fault::Gone { .. })), "{error}");
    fs::rename(&away, &folder).unwrap();
    assert!(matches!(next_has_level(camera.as_mut(), 120)[..], [Fault::Back { .. }]));
}
