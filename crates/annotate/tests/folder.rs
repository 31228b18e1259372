//! A photo's own project, the other pictures of its folder, and projects chosen on the page.

use std::sync::Arc;

use crate::served::{InPlace, Served, photo, photo_png};
use image::codecs::png::PngEncoder;
use image::{ImageEncoder, RgbImage};
use sdg_annotate::{Marks, Session, SessionOptions, Status};
use sdg_demonstration::{CocoFile, PixelFrame};
use serde_json::{Value, json};

const MARKS: &str = r#"{"box": [40, 40, 140, 60], "grasp": {"start": [80, 50], "end": [100, 50], "jaw_width": 24}}"#;

const LABELME: &str = r#"{"imageWidth": 200, "imageHeight": 100, "shapes": [
    {"label": "rod", "shape_type": "rectangle", "points": [[40, 40], [140, 60]]}]}"#;

fn folder_of(names: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in names {
        std::fs::write(folder.path().join(name), photo_png()).unwrap();
    }
    folder
}

/// The photo with an Exif orientation: 3 rotates it by 180°, 6 by 90°.
fn turned_png(orientation: u8) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = PngEncoder::new(&mut bytes);
    // Big endian, one entry: tag 0x0112 (orientation), a short.
    let mut exif = b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\0\0\0\0\0\0\0".to_vec();
    exif[19] = orientation;
    encoder.set_exif_metadata(exif).unwrap();
    photo().write_with_encoder(encoder).unwrap();
    bytes
}

fn session(served: &Served) -> Value {
    served.ask("GET", "/api/session", b"").json()
}

fn names(list: &Value) -> Vec<&str> {
    list.as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap()).collect()
}

fn teach(served: &Served) {
    served.ask("POST", "/api/teaching", b"{\"model\": \"S\"}").json();
    while served.ask("GET", "/api/teaching", b"").json()["status"] != "done" {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

#[test]
fn a_photo_is_opened_again_with_its_models_corrections_and_tried_pictures() {
    let served = Served::of_photo(folder_of(&["rod.png", "other.png", "table.png"]), "rod.png");
    let first = session(&served);
    assert_eq!((&first["label"], &first["is_named"]), (&json!("rod"), &json!(false)), "the photo's name is proposed");
    assert_eq!(names(&first["others"]), ["other.png", "table.png"]);
    assert!(!served.folder.path().join("rod.sdg-project.json").exists(), "opening a photo writes no file");
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    teach(&served);
    served.ask("POST", "/api/trial-pictures?name=found.png", &photo_png()).json();
    served.ask("POST", "/api/trial-pictures?name=empty.png", &photo_png()).json();
    served.ask("POST", "/api/trial-pictures/0/accept", MARKS.as_bytes()).json();
    served.ask("PUT", "/api/trial-pictures/1/absent", b"{\"absent\": true}").json();
    let left = session(&served);

    let served = Served::of_photo(served.end(), "rod.png");
    let again = session(&served);
    for what in ["label", "images", "trial_pictures", "models"] {
        assert_eq!(again[what], left[what], "{what}");
    }
    assert_eq!(names(&again["others"]), ["other.png", "table.png"]);
    assert_eq!(names(&again["images"]), ["rod.png", "found.png"]);
    assert_eq!(again["trial_pictures"][0]["became"], 1);
    assert_eq!(again["models"][0]["is_current"], true);
    // The project of another photo in the folder is independent.
    let served = Served::of_photo(served.end(), "other.png");
    let other = session(&served);
    assert_eq!((names(&other["images"]), other["models"].as_array().unwrap().len()), (vec!["other.png"], 0));
}

#[test]
fn unreadable_pictures_of_a_folder_are_left_out_with_a_note() {
    let folder = folder_of(&["rod.png", "tried.png"]);
    std::fs::write(folder.path().join("rod.json"), LABELME).unwrap();
    std::fs::write(folder.path().join("cut.png"), &photo_png()[..100]).unwrap();
    let served = Served::of_project(folder);
    let first = session(&served);
    assert_eq!((names(&first["images"]), names(&first["trial_pictures"])), (vec!["rod.png"], vec!["tried.png"]));
    let notes = |session: &Value| session["notes"].as_array().unwrap().clone();
    let [note] = &notes(&first)[..] else { panic!("one note, found {}", first["notes"]) };
    let note = note.as_str().unwrap();
    assert!(note.contains("cut.png: damaged PNG image") && note.ends_with("; this picture is left out."), "{note}");

    // Pictures that the project names already remain named, and return once they can be read.
    let folder = served.end();
    for name in ["rod.png", "tried.png"] {
        std::fs::write(folder.path().join(name), &photo_png()[..100]).unwrap();
    }
    let served = Served::of_project(folder);
    let damaged = session(&served);
    assert_eq!((names(&damaged["images"]).len(), names(&damaged["trial_pictures"]).len()), (0, 0));
    assert_eq!(notes(&damaged).len(), 3, "{}", damaged["notes"]);
    let folder = served.end();
    for name in ["rod.png", "tried.png", "cut.png"] {
        std::fs::write(folder.path().join(name), photo_png()).unwrap();
    }
    let whole = session(&Served::of_project(folder));
    assert_eq!((names(&whole["images"]), notes(&whole).len()), (vec!["rod.png"], 0));
    assert_eq!(names(&whole["trial_pictures"]), ["tried.png", "cut.png"]);
}

#[test]
fn no_file_beside_a_picture_keeps_the_project_from_opening() {
    let folder = folder_of(&["rod.png", "broken.png", "boxes.png", "times.png"]);
    for (name, text) in [
        ("rod.json", LABELME),
        ("broken.json", "{"),
        ("boxes.txt", "0 0.5 0.5 0.2 0.2\n"),
        ("times.txt", "1699999999 3.2\n"),
    ] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let first = session(&Served::of_project(folder));
    let expected = (vec!["rod.png"], vec!["boxes.png", "times.png"]);
    assert_eq!((names(&first["images"]), names(&first["trial_pictures"])), expected);
    let note = first["notes"][0].as_str().unwrap();
    assert!(note.starts_with("broken.png: ") && note.contains("broken.json"), "{}", first["notes"]);
    assert_eq!(first["notes"].as_array().unwrap().len(), 1);
}

#[test]
fn a_photo_of_the_project_whose_marks_do_not_fit_is_left_out() {
    let folder = folder_of(&["rod.png", "other.png"]);
    for name in ["rod.json", "other.json"] {
        std::fs::write(folder.path().join(name), LABELME).unwrap();
    }
    let served = Served::of_project(folder);
    assert_eq!(names(&session(&served)["images"]), ["other.png", "rod.png"]);
    let folder = served.end();
    let smaller = LABELME.replace(r#""imageWidth": 200"#, r#""imageWidth": 160"#);
    std::fs::write(folder.path().join("other.json"), smaller).unwrap();
    let served = Served::of_project(folder);
    let without = session(&served);
    assert_eq!(names(&without["images"]), ["rod.png"]);
    let note = without["notes"][0].as_str().unwrap();
    assert!(note.starts_with("other.png: ") && note.contains("annotation of another image"), "{note}");
    // Without these marks it is a photo of the project again.
    let folder = served.end();
    std::fs::remove_file(folder.path().join("other.json")).unwrap();
    assert_eq!(names(&session(&Served::of_project(folder))["images"]), ["other.png", "rod.png"], "in the same order");
}

#[test]
fn photos_of_another_size_than_the_calibrated_camera_s_are_refused_by_name() {
    let folder = folder_of(&["rod.png"]);
    let rod = folder.path().join("rod.png");
    std::fs::write(rod.with_extension("json"), LABELME).unwrap();
    let open = |images: Vec<_>, project| {
        let options = SessionOptions { images, project, photo_size: Some([160, 100]), ..SessionOptions::default() };
        Session::open(&options, Arc::new(InPlace))
    };
    let is_told = |told: &str| assert!(told.contains("rod.png: expected 160 × 100 pixels"), "{told}");
    is_told(&open(vec![(rod, None)], None).err().expect("an error").to_string());
    let session = open(Vec::new(), Some(folder.path().to_owned())).unwrap();
    let view = session.view();
    assert_eq!(view.images.len(), 0);
    is_told(&view.notes[0]);
    is_told(&session.upload_photo("rod.png", &photo_png()).unwrap_err().to_string());
    let tried = session.add_trial_picture("rod.png", &photo_png()).unwrap();
    is_told(&session.accept(tried.id, Marks::default()).unwrap_err().to_string());
}

#[test]
fn a_picture_without_the_part_that_becomes_a_photo_again_is_no_negative() {
    let served = Served::of_photo(folder_of(&["rod.png"]), "rod.png");
    served.ask("POST", "/api/trial-pictures?name=found.png", &photo_png()).json();
    served.ask("POST", "/api/trial-pictures/0/accept", MARKS.as_bytes()).json();
    served.ask("DELETE", "/api/images/1", b"").json();
    served.ask("PUT", "/api/trial-pictures/0/absent", b"{\"absent\": true}").json();
    assert_eq!(names(&session(&served)["others"]), ["found.png"]);
    served.ask("POST", "/api/others/0/photo", b"").json();
    let tried = session(&served)["trial_pictures"][0].clone();
    assert_eq!((&tried["became"], &tried["is_absent"]), (&json!(1), &json!(false)));
}

#[test]
fn the_file_of_a_photo_s_marks_is_recorded() {
    let folder = folder_of(&["rod.png", "other.png"]);
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("marked.json"), LABELME).unwrap();
    let given = vec![(at("rod.png"), None), (at("other.png"), Some(at("marked.json")))];
    let open = |images: Vec<_>| {
        let options = SessionOptions { images, ..SessionOptions::default() };
        Session::open(&options, Arc::new(InPlace)).unwrap()
    };
    let rod = || vec![(at("rod.png"), None)];
    let bbox = Some([40.0, 40.0, 140.0, 60.0]);
    for (images, num_notes) in [(given, 0), (rod(), 1)] {
        let view = open(images).view();
        assert_eq!((view.images[1].marks.bbox, view.notes.len()), (bbox, num_notes), "{:?}", view.notes);
    }
    assert_eq!(open(rod()).view().notes, ["The marks of other.png are in marked.json."]);
    // Without the recorded file, the marks are those beside the photo.
    std::fs::rename(at("marked.json"), at("other.json")).unwrap();
    let view = open(rod()).view();
    assert_eq!((view.images[1].marks.bbox, view.notes.len()), (bbox, 0), "{:?}", view.notes);
}

#[test]
fn changed_marks_in_a_file_of_several_photos_are_not_overwritten() {
    let folder = folder_of(&["a.png", "b.png"]);
    let at = |name: &str| folder.path().join(name);
    let mut all = CocoFile::new();
    for name in ["a.png", "b.png"] {
        all.push_image(name, 200, 100, &[]);
    }
    std::fs::write(at("all.json"), all.to_json()).unwrap();
    let open = |marks: Option<&str>| {
        let images = ["a.png", "b.png"].map(|name| (at(name), marks.map(at))).to_vec();
        Session::open(&SessionOptions { images, ..SessionOptions::default() }, Arc::new(InPlace)).unwrap()
    };
    let marks = Marks { bbox: Some([40.0, 40.0, 140.0, 60.0]), ..Marks::default() };
    let first = open(Some("all.json"));
    first.set_marks(0, marks.clone()).unwrap();
    // Another program, before the first change of the second photo here.
    let text = std::fs::read_to_string(at("all.a.png.coco.json")).unwrap();
    std::fs::write(at("all.b.png.coco.json"), text.replace("a.png", "b.png")).unwrap();
    let refused = first.set_marks(1, Marks::default()).unwrap_err().to_string();
    assert!(refused.contains("another program changed these marks"), "{refused}");
    assert_eq!(first.marks(1).unwrap(), marks);
    first.set_marks(1, marks).unwrap();
    drop(first);
    let told = ["a", "b"].map(|name| format!("The marks of {name}.png are in all.{name}.png.coco.json."));
    assert_eq!(open(None).view().notes, told);
}

#[test]
fn a_photo_that_comes_back_during_the_session_is_that_of_its_tried_picture() {
    let served = Served::of_photo(folder_of(&["rod.png"]), "rod.png");
    served.ask("POST", "/api/trial-pictures?name=found.png", &photo_png()).json();
    served.ask("POST", "/api/trial-pictures/0/accept", MARKS.as_bytes()).json();
    let folder = served.end();
    let [photo, away] = ["found.png", "found.away"].map(|name| folder.path().join(name));
    std::fs::rename(&photo, &away).unwrap();
    let served = Served::of_photo(folder, "rod.png");
    let became = |served: &Served| session(served)["trial_pictures"][0]["became"].clone();
    assert_eq!(became(&served), Value::Null);
    std::fs::rename(&away, &photo).unwrap();
    assert_eq!(names(&session(&served)["others"]), ["found.png"]);
    served.ask("POST", "/api/others/0/photo", b"").json();
    assert_eq!(became(&served), 1);
    // If it is then removed, it is not in the project when that is opened again.
    served.ask("DELETE", "/api/images/1", b"").json();
    assert_eq!(names(&session(&Served::of_photo(served.end(), "rod.png"))["images"]), ["rod.png"]);
}

#[test]
fn a_new_file_of_a_single_photo_s_marks_is_recorded() {
    let folder = folder_of(&["rod.png"]);
    let at = |name: &str| folder.path().join(name);
    let open = |marks| {
        let options = SessionOptions { images: vec![(at("rod.png"), marks)], ..SessionOptions::default() };
        Session::open(&options, Arc::new(InPlace)).unwrap()
    };
    let marks = Marks { bbox: Some([40.0, 40.0, 140.0, 60.0]), ..Marks::default() };
    open(Some(at("new.json"))).set_marks(0, marks.clone()).unwrap();
    assert!(at("new.json").exists());
    assert_eq!(open(None).marks(0).unwrap(), marks);
}

#[test]
fn marks_that_were_removed_do_not_return_from_a_file_that_is_only_read() {
    let folder = folder_of(&["rod.png"]);
    std::fs::write(folder.path().join("rod.txt"), "0 0.5 0.5 0.5 0.2\n").unwrap();
    let served = Served::of_photo(folder, "rod.png");
    let has_box = |served: &Served| session(served)["images"][0]["marks"]["box"].is_array();
    assert!(has_box(&served));
    served.ask("PUT", "/api/images/0/marks", b"{}").json();
    assert!(!has_box(&Served::of_photo(served.end(), "rod.png")));
}

#[test]
fn a_picture_from_the_page_is_named_by_its_format() {
    let served = Served::of_photo(folder_of(&["rod.png"]), "rod.png");
    let mut bytes = std::io::Cursor::new(Vec::new());
    photo().write_to(&mut bytes, image::ImageFormat::Bmp).unwrap();
    served.ask("POST", "/api/trial-pictures?name=table.png", bytes.get_ref()).json();
    assert!(served.folder.path().join("tried/table.bmp").exists());
}

#[test]
fn a_given_picture_that_is_unreadable_is_refused() {
    let folder = folder_of(&["rod.png"]);
    let cut = folder.path().join("cut.png");
    std::fs::write(&cut, &photo_png()[..100]).unwrap();
    let images = vec![(folder.path().join("rod.png"), None)];
    for (images, trial_pictures) in [(images, vec![cut.clone()]), (vec![(cut, None)], Vec::new())] {
        let options = SessionOptions { images, trial_pictures, ..SessionOptions::default() };
        let refused = Session::open(&options, Arc::new(InPlace)).err().expect("an error").to_string();
        assert!(refused.contains("cut.png: damaged PNG image"), "{refused}");
    }
}

#[test]
fn with_a_calibrated_camera_pictures_have_the_sensor_s_pixels_and_rotated_photos_are_refused() {
    let served = Served::of_calibrated_project(folder_of(&["rod.png"]));
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    teach(&served);
    served.ask("POST", "/api/trial-pictures?name=turned.png", &turned_png(3)).json();
    // The sensor's pixels are those of the photo, in the search and in the browser.
    let found = served.ask("POST", "/api/trial-pictures/0/detect", b"").json();
    assert_eq!(found["detections"][0]["is_accepted"], true);
    let shown = image::load_from_memory(&served.ask("GET", "/api/trial-pictures/0/picture", b"").body).unwrap();
    let red = [[45, 50], [154, 50]].map(|[x, y]| shown.to_rgb8().get_pixel(x, y).0[0] > 128);
    assert_eq!(red, [true, false], "the part is at the left");
    for (path, body) in
        [("/api/images?name=turned.png", turned_png(3)), ("/api/trial-pictures/0/accept", MARKS.as_bytes().to_vec())]
    {
        let refused = served.ask("POST", path, &body);
        assert!(refused.status == 422 && refused.text().contains("Exif"), "{path}: {}", refused.text());
    }
    assert!(!served.folder.path().join("turned.png").exists());

    // Marked in the folder, such a photo is refused for its orientation and not for the size that its marks name.
    let folder = folder_of(&[]);
    std::fs::write(folder.path().join("turned.png"), turned_png(6)).unwrap();
    let upright =
        LABELME.replace(r#""imageWidth": 200, "imageHeight": 100"#, r#""imageWidth": 100, "imageHeight": 200"#);
    for marks in [LABELME, &upright] {
        std::fs::write(folder.path().join("turned.json"), marks).unwrap();
        let (project, pixel_frame) = (Some(folder.path().to_owned()), PixelFrame::Sensor);
        let options = SessionOptions { project, pixel_frame, ..SessionOptions::default() };
        let refused = Session::open(&options, Arc::new(InPlace)).err().expect("an error").to_string();
        assert!(refused.contains("Exif"), "{refused}");
    }
}

#[test]
fn a_folder_with_more_pictures_than_can_be_tried_offers_the_others() {
    let folder = folder_of(&["rod.png"]);
    std::fs::write(folder.path().join("rod.json"), LABELME).unwrap();
    for number in 0..=500 {
        RgbImage::new(1, 1).save(folder.path().join(format!("{number}.png"))).unwrap();
    }
    let served = Served::of_project(folder);
    let first = session(&served);
    assert_eq!((names(&first["images"]), names(&first["trial_pictures"]).len()), (vec!["rod.png"], 500));
    assert_eq!(names(&first["others"]), ["500.png"]);
    assert!(first["notes"][0].as_str().unwrap().contains("at most 500 can be tried: 1."), "{}", first["notes"]);
    let add = || served.ask("POST", "/api/others/0/try", b"").status;
    assert_eq!(add(), 409);
    served.ask("DELETE", "/api/trial-pictures/0", b"").json();
    assert_eq!(add(), 200);
    assert_eq!(served.ask("POST", "/api/trial-pictures/0/put-back", b"").status, 409);
    assert_eq!(names(&session(&Served::of_project(served.end()))["trial_pictures"]).len(), 500);
}

#[test]
fn a_model_is_not_old_because_its_marks_were_read_from_the_file() {
    let served = Served::of_photo(folder_of(&["rod.png"]), "rod.png");
    // Rounding: left edge plus width is not bit-identical to the right edge.
    let marks = r#"{"box": [34.42, 34.09, 137.81, 75.91], "grasp": {"start": [80.18, 50.21], "end": [104.7, 46.3], "jaw_width": 24.04}}"#;
    served.ask("PUT", "/api/images/0/marks", marks.as_bytes()).json();
    teach(&served);
    assert_eq!(session(&served)["models"][0]["is_stale"], false);
    let served = Served::of_photo(served.end(), "rod.png");
    assert_eq!(session(&served)["models"][0]["is_stale"], false);
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    assert_eq!(session(&served)["models"][0]["is_stale"], true);
}

#[test]
fn a_model_is_old_after_a_change_of_the_heights() {
    let folder = folder_of(&["rod.png"]);
    let open = |heights_m| {
        let images = vec![(folder.path().join("rod.png"), None)];
        let options = SessionOptions { images, heights_m, ..SessionOptions::default() };
        Session::open(&options, Arc::new(InPlace)).unwrap()
    };
    let taught = open(Some([0.016, 0.009]));
    taught.set_marks(0, serde_json::from_str(MARKS).unwrap()).unwrap();
    taught.start_teaching(serde_json::from_str(r#"{"model": "S"}"#).unwrap()).unwrap();
    while taught.teaching_news().status != Status::Done {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    drop(taught);
    let is_stale = |heights_m| open(heights_m).view().models[0].is_stale;
    assert_eq!([None, Some([0.016, 0.009]), Some([0.02, 0.009])].map(is_stale), [false, false, true]);
    // Earlier programs did not record the heights.
    let project = folder.path().join("rod.sdg-project.json");
    let mut file: Value = serde_json::from_slice(&std::fs::read(&project).unwrap()).unwrap();
    assert!(file["models"][0].as_object_mut().unwrap().remove("heights_m").is_some());
    std::fs::write(&project, file.to_string()).unwrap();
    assert!(!is_stale(Some([0.02, 0.009])));
}

#[test]
fn what_is_not_there_for_a_while_stays_in_the_project() {
    let served = Served::of_photo(folder_of(&["rod.png"]), "rod.png");
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    served.ask("POST", "/api/trial-pictures?name=found.png", &photo_png()).json();
    served.ask("POST", "/api/trial-pictures?name=empty.png", &photo_png()).json();
    served.ask("POST", "/api/trial-pictures/0/accept", MARKS.as_bytes()).json();
    served.ask("PUT", "/api/trial-pictures/1/absent", b"{\"absent\": true}").json();
    let left = session(&served);
    let folder = served.end();
    let [away, there] = ["away.png", "found.png"].map(|name| folder.path().join(name));
    std::fs::rename(&there, &away).unwrap();
    std::fs::rename(folder.path().join("tried"), folder.path().join("elsewhere")).unwrap();
    let served = Served::of_photo(folder, "rod.png");
    let without = session(&served);
    assert_eq!((names(&without["images"]), &without["trial_pictures"]), (vec!["rod.png"], &json!([])));
    assert!(without["notes"][0].as_str().unwrap().starts_with("found.png does not exist now"), "{}", without["notes"]);
    served.ask("PUT", "/api/label", b"{\"label\": \"rod\"}");
    let folder = served.end();
    std::fs::rename(&away, &there).unwrap();
    std::fs::rename(folder.path().join("elsewhere"), folder.path().join("tried")).unwrap();
    let again = session(&Served::of_photo(folder, "rod.png"));
    for what in ["images", "trial_pictures"] {
        assert_eq!(again[what], left[what], "{what}");
    }
}

#[test]
fn a_tried_picture_stays_linked_to_its_photo_while_that_is_missing() {
    let served = Served::of_photo(folder_of(&["rod.png"]), "rod.png");
    served.ask("POST", "/api/trial-pictures?name=found.png", &photo_png()).json();
    served.ask("POST", "/api/trial-pictures/0/accept", MARKS.as_bytes()).json();
    let folder = served.end();
    let [away, there] = ["away", "found.png"].map(|name| folder.path().join(name));
    std::fs::rename(&there, &away).unwrap();
    let served = Served::of_photo(folder, "rod.png");
    assert_eq!(session(&served)["trial_pictures"][0]["became"], Value::Null);
    served.ask("PUT", "/api/label", b"{\"label\": \"rod\"}").json();
    let folder = served.end();
    std::fs::rename(&away, &there).unwrap();
    assert_eq!(session(&Served::of_photo(folder, "rod.png"))["trial_pictures"][0]["became"], 1);
}

#[test]
fn a_tried_picture_of_another_folder_is_learnt_from_without_writing_there() {
    let others = folder_of(&["line.png"]);
    let served = Served::of_photo_and_tried(folder_of(&["rod.png"]), "rod.png", others.path());
    let learnt = served.ask("POST", "/api/trial-pictures/0/accept", MARKS.as_bytes()).json();
    assert_eq!(learnt["name"], "line.png");
    assert!(served.folder.path().join("line.png").is_file() && served.folder.path().join("line.json").is_file());
    assert_eq!(std::fs::read_dir(others.path()).unwrap().count(), 1, "nothing is written into another's folder");
}

#[test]
fn a_tried_picture_that_has_marks_keeps_them() {
    let folder = folder_of(&["rod.png", "other.png"]);
    std::fs::write(folder.path().join("other.json"), LABELME).unwrap();
    let served = Served::of_photo(folder, "rod.png");
    assert_eq!(names(&session(&served)["others"]), ["other.png"]);
    served.ask("POST", "/api/others/0/try", b"").json();
    let accept = |served: &Served| served.ask("POST", "/api/trial-pictures/0/accept", b"{}").json();
    let first = accept(&served);
    assert_eq!(first["marks"]["box"], json!([40.0, 40.0, 140.0, 60.0]));
    assert!(first["note"].as_str().is_some() && !served.folder.path().join("other.coco.json").exists(), "{first}");
    // Also after it was removed, in this session and in a later one.
    served.ask("PUT", "/api/images/1/marks", MARKS.as_bytes()).json();
    served.ask("DELETE", "/api/images/1", b"").json();
    let again = accept(&served);
    assert_eq!((&again["id"], &again["marks"]["grasp"]["jaw_width"]), (&json!(1), &json!(24.0)));
    served.ask("DELETE", "/api/images/1", b"").json();
    let later = accept(&Served::of_photo(served.end(), "rod.png"));
    assert_eq!(later["marks"], again["marks"]);
}

#[test]
fn a_tried_picture_keeps_its_grasp_but_a_box_alone_gives_way_to_what_was_found() {
    let folder = folder_of(&["rod.png", "other.png"]);
    std::fs::write(folder.path().join("other.json"), LABELME).unwrap();
    let served = Served::of_photo(folder, "rod.png");
    // The folder is listed before a picture is chosen.
    assert_eq!(names(&session(&served)["others"]), ["other.png"]);
    served.ask("POST", "/api/others/0/try", b"").json();
    let accept = |marks: &str| served.ask("POST", "/api/trial-pictures/0/accept", marks.as_bytes()).json();
    let first = accept(MARKS);
    assert_eq!(first["marks"]["grasp"]["jaw_width"], 24.0);
    assert_eq!(first["saved"], json!({"state": "written", "file": "other.coco.json"}));
    assert_eq!(std::fs::read_to_string(served.folder.path().join("other.json")).unwrap(), LABELME);
    served.ask("DELETE", "/api/images/1", b"").json();
    // The page compares the marks with those that it sent, and shows the note.
    let again = accept(&MARKS.replace("[80, 50]", "[70, 50]"));
    assert_eq!(again["marks"], first["marks"]);
    let note = again["note"].as_str().unwrap();
    assert!(note.contains("these marks are kept. other.json is kept unchanged"), "{note}");
}

#[test]
fn an_uploaded_picture_that_is_accepted_again_is_the_same_photo() {
    let served = Served::of_photo(folder_of(&["rod.png"]), "rod.png");
    served.ask("POST", "/api/trial-pictures?name=found.png", &photo_png()).json();
    let accept = || served.ask("POST", "/api/trial-pictures/0/accept", MARKS.as_bytes()).json();
    assert_eq!(accept()["id"], 1);
    let corrected = MARKS.replace("[80, 50]", "[70, 50]");
    served.ask("PUT", "/api/images/1/marks", corrected.as_bytes()).json();
    served.ask("DELETE", "/api/images/1", b"").json();
    let again = accept();
    assert_eq!((&again["id"], &again["marks"]["grasp"]["start"]), (&json!(1), &json!([70.0, 50.0])));
    assert_eq!(names(&session(&served)["images"]), ["rod.png", "found.png"]);
    let files = std::fs::read_dir(served.folder.path()).unwrap();
    let pictures = files.filter(|file| file.as_ref().unwrap().path().extension() == Some("png".as_ref()));
    assert_eq!(pictures.count(), 2, "the photo and one copy");
}

#[test]
fn pictures_of_a_folder_are_in_the_natural_order_of_their_names() {
    let others = folder_of(&["p10.png", "P3.png", "p2.png"]);
    let served = Served::of_photo_and_tried(folder_of(&["rod10.png", "rod9.png", "rod.png"]), "rod.png", others.path());
    let session = session(&served);
    assert_eq!(names(&session["trial_pictures"]), ["p2.png", "P3.png", "p10.png"]);
    assert_eq!(names(&session["others"]), ["rod9.png", "rod10.png"]);
}

#[test]
fn the_copy_of_a_tried_picture_is_not_offered_for_trying() {
    let served = Served::of_photo(folder_of(&["rod.png"]), "rod.png");
    served.ask("POST", "/api/trial-pictures?name=007.png", &photo_png()).json();
    served.ask("POST", "/api/trial-pictures/0/accept", MARKS.as_bytes()).json();
    served.ask("DELETE", "/api/images/1", b"").json();
    std::fs::write(served.folder.path().join("008.png"), photo_png()).unwrap();
    let offered = |served: &Served| {
        let others = session(served)["others"].clone();
        others.as_array().unwrap().iter().map(|o| (o["name"].clone(), o["is_tried"].clone())).collect::<Vec<_>>()
    };
    let expected = [(json!("007.png"), json!(true)), (json!("008.png"), json!(false))];
    assert_eq!(offered(&served), expected);
    assert_eq!(offered(&Served::of_photo(served.end(), "rod.png")), expected, "after opening again");
}

#[test]
fn a_photo_of_a_folders_project_opens_that_without_what_has_come_since() {
    let served = Served::of_project(folder_of(&["a.png"]));
    assert_eq!(names(&session(&served)["images"]), ["a.png"], "a single picture becomes the photo without a choice");
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    teach(&served);
    let folder = served.end();
    std::fs::write(folder.path().join("new.png"), photo_png()).unwrap();
    let again = session(&Served::of_photo(folder, "a.png"));
    assert_eq!((again["models"].as_array().unwrap().len(), names(&again["others"])), (1, vec!["new.png"]));
    assert_eq!(again["trial_pictures"], json!([]));
}

#[test]
fn a_project_that_is_opened_by_its_second_photo_keeps_its_order_and_its_model() {
    let served = Served::of_project(folder_of(&["a.png", "b.png"]));
    assert_eq!(names(&session(&served)["others"]), ["a.png", "b.png"]);
    for id in 0..2 {
        served.ask("POST", &format!("/api/others/{id}/photo"), b"").json();
        served.ask("PUT", &format!("/api/images/{id}/marks"), MARKS.as_bytes()).json();
    }
    teach(&served);
    let served = Served::of_photo(served.end(), "b.png");
    let again = session(&served);
    assert_eq!((names(&again["images"]), &again["shown"]), (vec!["a.png", "b.png"], &json!(1)));
    assert_eq!(again["models"][0]["is_stale"], false);
    let file = std::fs::read(served.folder.path().join("sdg-project.json")).unwrap();
    assert_eq!(serde_json::from_slice::<Value>(&file).unwrap()["photos"], json!(["a.png", "b.png"]));
}

#[test]
fn in_a_new_folder_the_photo_is_chosen_and_others_are_added_and_removed() {
    let served = Served::of_project(folder_of(&["a.png", "b.png", "c.png"]));
    let first = session(&served);
    assert_eq!(
        (first["images"].as_array().unwrap().len(), names(&first["others"])),
        (0, vec!["a.png", "b.png", "c.png"])
    );
    assert_eq!(served.ask("GET", "/api/others/1/picture", b"").body, photo_png());
    let chosen = served.ask("POST", "/api/others/1/photo", b"").json();
    assert_eq!((&chosen["name"], &chosen["id"]), (&json!("b.png"), &json!(0)));
    assert_eq!(served.ask("POST", "/api/others/1/photo", b"").status, 404, "it is in the project");
    let tried = served.ask("POST", "/api/others/2/try", b"").json();
    assert_eq!(tried["name"], "c.png");
    assert_eq!(names(&session(&served)["others"]), ["a.png"]);
    served.ask("DELETE", "/api/trial-pictures/0", b"").json();
    assert_eq!(names(&session(&served)["others"]), ["a.png", "c.png"]);
    // A photo from another folder is copied beside the project's photos.
    let uploaded = served.ask("POST", "/api/images?name=../b.png", &photo_png()).json();
    assert_eq!(uploaded["name"], "b-2.png");
    assert_eq!(served.ask("POST", "/api/images?name=no.png", b"no picture").status, 422);
    assert!(!served.folder.path().join("no.png").exists());

    // Reopening the folder does not add pictures that were not added before.
    let again = session(&Served::of_project(served.end()));
    assert_eq!((names(&again["images"]), names(&again["others"])), (vec!["b.png", "b-2.png"], vec!["a.png", "c.png"]));
}

#[test]
fn a_picture_of_the_folder_chosen_as_a_file_is_used_without_a_copy() {
    let served = Served::of_photo(folder_of(&["rod.png", "other.png", "second.png"]), "rod.png");
    let is_hidden = |file: &std::fs::DirEntry| file.file_name().to_string_lossy().starts_with('.');
    let files = || std::fs::read_dir(served.folder.path()).unwrap().flatten().filter(|file| !is_hidden(file)).count();
    let before = files();
    let tried = served.ask("POST", "/api/trial-pictures?name=other.png", &photo_png()).json();
    assert_eq!(tried["name"], "other.png");
    assert_eq!(names(&session(&served)["others"]), ["second.png"], "it is not offered again");
    let photo = served.ask("POST", "/api/images?name=second.png", &photo_png()).json();
    assert_eq!(photo["name"], "second.png");
    assert_eq!(session(&served)["others"], json!([]));
    // The project's file and no copies; locks are hidden files.
    assert_eq!(files(), before + 1);
    // Another picture of the same name is copied.
    std::fs::write(served.folder.path().join("third.png"), b"another content").unwrap();
    served.ask("POST", "/api/trial-pictures?name=third.png", &photo_png()).json();
    assert_eq!(names(&session(&served)["others"]), ["third.png"]);
}

#[test]
fn two_photos_never_have_their_marks_in_the_same_file() {
    let served = Served::of_photo(folder_of(&["photo.png"]), "photo.png");
    assert_eq!(served.ask("POST", "/api/images?name=photo.jpg", &photo_png()).json()["name"], "photo-2.jpg");

    let served = Served::of_photo(folder_of(&["part.png", "part.jpg"]), "part.png");
    let is_told = |told: &str| assert!(told.contains("part.jpg: expected") && told.contains("of part.png"), "{told}");
    assert_eq!(names(&session(&served)["others"]), ["part.jpg"]);
    let refused = served.ask("POST", "/api/others/0/photo", b"");
    assert_eq!(refused.status, 422);
    is_told(&refused.text());
    let images = ["part.png", "part.jpg"].map(|name| (served.folder.path().join(name), None)).to_vec();
    let options = SessionOptions { images, ..SessionOptions::default() };
    is_told(&Session::open(&options, Arc::new(InPlace)).err().expect("an error").to_string());

    // One of two marked pictures of a new folder.
    let folder = served.end();
    std::fs::write(folder.path().join("part.json"), LABELME).unwrap();
    let opened = session(&Served::of_project(folder));
    assert_eq!(names(&opened["images"]), ["part.jpg"]);
    assert!(opened["notes"][0].as_str().unwrap().starts_with("part.png: expected"), "{}", opened["notes"]);
}

#[test]
fn without_a_project_one_is_made_of_a_photo_and_opened_again() {
    let served = Served::of_start(tempfile::tempdir().unwrap());
    let start = session(&served)["start"].clone();
    assert_eq!((&start["recent"], &start["folder"]), (&json!([]), &json!(served.folder.path().display().to_string())));
    assert_eq!(served.ask("GET", "/api/teaching", b"").status, 409);
    assert_eq!(served.ask("POST", "/api/projects?name=wing%20bolt&photo=IMG_1.png", b"no picture").status, 422);
    assert!(!served.folder.path().join("wing_bolt").exists(), "no folder remains of a project that failed");
    let made = served.ask("POST", "/api/projects?name=wing%20bolt&photo=IMG_1.png", &photo_png()).json();
    assert_eq!(
        (&made["label"], &made["is_named"], names(&made["images"])),
        (&json!("wing bolt"), &json!(true), vec!["IMG_1.png"])
    );
    assert_eq!(served.ask("POST", "/api/projects?name=lid&photo=a.png", &photo_png()).status, 409, "one at a time");
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();

    let start = served.ask("DELETE", "/api/projects", b"").json()["start"].clone();
    assert_eq!(names(&start["recent"]), ["wing bolt"]);
    let taken = served.ask("POST", "/api/projects?name=wing%20bolt&photo=a.png", &photo_png());
    assert!(taken.status == 500 && taken.text().contains("wing_bolt"), "{}", taken.text());
    let id = start["recent"][0]["id"].as_str().unwrap();
    // A missing project is not replaced by another.
    let away = served.folder.path().join("away");
    std::fs::rename(served.folder.path().join("wing_bolt"), &away).unwrap();
    let gone = served.ask("POST", &format!("/api/projects/{id}/open"), b"");
    assert!(gone.status == 409 && gone.text().contains("not there any more"), "{}", gone.text());
    std::fs::rename(&away, served.folder.path().join("wing_bolt")).unwrap();
    let again = served.ask("POST", &format!("/api/projects/{id}/open"), b"").json();
    assert_eq!(
        (&again["label"], again["images"][0]["marks"]["box"].clone()),
        (&json!("wing bolt"), json!([40.0, 40.0, 140.0, 60.0]))
    );
    // A page opened for one project offers no other projects.
    assert_eq!(Served::start().ask("DELETE", "/api/projects", b"").status, 409);
}
