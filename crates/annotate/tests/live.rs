//! Photos taken with a camera, and detections in its pictures, on the real server.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::served::{Answer, Served, photo, photo_png};
use image::RgbImage;
use sdg_annotate::{Live, LiveFault, LiveFaultKind, LiveFrame, LivePictures};
use serde_json::{Value, json};

/// A camera whose pictures the test sets.
#[derive(Debug, Default)]
struct Camera(Mutex<Live>);

impl LivePictures for Camera {
    fn newest(&self) -> Live {
        self.0.lock().unwrap().clone()
    }
}

impl Camera {
    fn show(&self, number: u64, picture: RgbImage) {
        let frame = LiveFrame { picture: Arc::new(picture), number, age: Duration::from_millis(40) };
        *self.0.lock().unwrap() = Live { frame: Some(frame), fault: None };
    }

    fn break_off(&self, kind: LiveFaultKind) {
        self.0.lock().unwrap().fault = Some(LiveFault { kind, text: "no answer".into() });
    }
}

fn open() -> (Served, Arc<Camera>) {
    let camera = Arc::new(Camera::default());
    (Served::with_camera(Arc::clone(&camera) as Arc<dyn LivePictures>), camera)
}

fn get(served: &Served, path: &str) -> Value {
    served.ask("GET", path, b"").json()
}

fn post(served: &Served, path: &str) -> Answer {
    served.ask("POST", path, b"")
}

fn teach(served: &Served, marks: &Value) {
    served.ask("PUT", "/api/images/0/marks", marks.to_string().as_bytes()).json();
    served.ask("POST", "/api/teaching", b"{\"model\": \"S\"}").json();
    let start = Instant::now();
    while get(served, "/api/teaching")["status"] != "done" {
        assert!(start.elapsed() < Duration::from_secs(30));
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_page_without_photos_takes_the_frame_that_was_shown() {
    let (served, camera) = open();
    let session = get(&served, "/api/session");
    assert_eq!((&session["camera"], &session["images"]), (&json!("test:"), &json!([])));
    let waiting = json!({"frame": null, "fault": null, "is_usable": false, "next_photo": "photo.png"});
    assert_eq!(get(&served, "/api/live"), waiting);
    assert_eq!(served.ask("POST", "/api/teaching", b"{\"model\": \"S\"}").status, 422, "nothing to teach from");

    camera.show(7, photo());
    let shown = get(&served, "/api/live");
    assert_eq!(shown["frame"], json!({"number": 7, "width": 200, "height": 100, "age_secs": 0.04}));
    // The camera continues; the photo is the frame that was shown.
    camera.show(8, RgbImage::new(200, 100));
    let jpeg = served.ask("GET", "/api/live/7/picture", b"");
    assert!(jpeg.head.to_lowercase().contains("content-type: image/jpeg"), "{}", jpeg.head);
    assert_eq!(image::load_from_memory(&jpeg.body).unwrap().into_rgb8().dimensions(), (200, 100));
    let taken = post(&served, "/api/live/7/photo").json();
    assert_eq!((&taken["id"], &taken["name"]), (&json!(0), &json!("photo.png")));
    let written = image::open(served.folder.path().join("photo.png")).unwrap().into_rgb8();
    assert_eq!(written, photo(), "as PNG, without loss");
    assert_eq!(post(&served, "/api/live/8/photo").status, 404, "frame 8 was not shown yet");

    // A second photo gets a number, and the first one is kept.
    assert_eq!(get(&served, "/api/live")["next_photo"], "photo-2.png");
    let again = post(&served, "/api/live/8/photo").json();
    assert_eq!((&again["id"], &again["name"]), (&json!(1), &json!("photo-2.png")));
    assert_eq!(image::open(served.folder.path().join("photo.png")).unwrap().into_rgb8(), photo());
}

#[test]
fn a_photo_replaces_no_file_of_a_project_whose_photo_was_deleted() {
    let written = [
        ("photo.sdg-project.json", "the project of photo.png"),
        ("sdg-project.json", r#"{"format": 1, "photos": ["photo-2.png"], "tried": [], "removed": [], "models": []}"#),
        ("tried/table.png", "a picture of that project"),
    ];
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("tried")).unwrap();
    for (name, text) in written {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let camera = Arc::new(Camera::default());
    let served = Served::with_camera_in(folder, Arc::clone(&camera) as Arc<dyn LivePictures>);
    served.ask("POST", "/api/trial-pictures?name=table.png", &photo_png()).json();
    camera.show(0, photo());
    assert_eq!(get(&served, "/api/live")["next_photo"], "photo-3.png");
    assert_eq!(post(&served, "/api/live/0/photo").json()["name"], "photo-3.png");
    for (name, text) in written {
        assert_eq!(std::fs::read_to_string(served.folder.path().join(name)).unwrap(), text, "{name}");
    }
    assert_eq!(served.ask("GET", "/api/trial-pictures/0/picture", b"").body, photo_png());
}

#[test]
fn what_is_wrong_with_the_camera_is_told_and_no_photo_taken() {
    let (served, camera) = open();
    camera.show(0, photo());
    get(&served, "/api/live");
    camera.break_off(LiveFaultKind::Gone);
    let gone = get(&served, "/api/live");
    assert_eq!(gone["fault"], json!({"kind": "gone", "text": "no answer"}));
    assert_eq!((&gone["is_usable"], &gone["frame"]["number"]), (&json!(false), &json!(0)));
    let refused = post(&served, "/api/live/0/photo");
    assert_eq!(refused.status, 409);
    assert!(refused.text().contains("no answer"), "{}", refused.text());
    assert!(!served.folder.path().join("photo.png").exists());
    camera.show(1, photo());
    assert_eq!(get(&served, "/api/live")["is_usable"], true);
    assert_eq!(post(&served, "/api/live/1/photo").status, 200);
}

#[test]
fn the_model_is_tried_on_a_frame_which_can_be_kept() {
    let (served, camera) = open();
    camera.show(0, photo());
    get(&served, "/api/live");
    post(&served, "/api/live/0/photo").json();
    assert_eq!(post(&served, "/api/live/0/detect").status, 409, "nothing is taught yet");
    let marks = json!({
        "box": [40.0, 40.0, 140.0, 60.0],
        "grasp": {"start": [80.0, 50.0], "end": [100.0, 50.0], "jaw_width": 24.0},
        "outline": null,
    });
    teach(&served, &marks);
    assert!(served.folder.path().join("part.sdg").exists(), "beside the photo");

    let found = post(&served, "/api/live/0/detect").json();
    assert_eq!(found["detections"][0]["is_accepted"], true);
    assert_eq!(found["detections"][0]["marks"]["grasp"], marks["grasp"]);
    camera.show(1, RgbImage::new(200, 100));
    get(&served, "/api/live");
    assert_eq!(post(&served, "/api/live/1/detect").json()["detections"][0]["is_accepted"], false);

    let kept = post(&served, "/api/live/0/keep").json();
    assert_eq!((&kept["id"], &kept["name"]), (&json!(0), &json!("live-0.png")));
    let bytes = served.ask("GET", "/api/trial-pictures/0/picture", b"").body;
    assert_eq!(image::load_from_memory(&bytes).unwrap().into_rgb8(), photo());
    let accepted = served.ask("POST", "/api/trial-pictures/0/accept", marks.to_string().as_bytes()).json();
    assert_eq!(accepted["name"], "live-0.png");
    assert!(served.folder.path().join("live-0.json").exists());
}

#[test]
fn without_a_camera_there_are_no_live_pictures() {
    let served = Served::start();
    assert_eq!(get(&served, "/api/session")["camera"], Value::Null);
    for (method, path) in [("GET", "/api/live"), ("GET", "/api/live/0/picture"), ("POST", "/api/live/0/photo")] {
        let answer = served.ask(method, path, b"");
        assert_eq!(answer.status, 404, "{method} {path}");
        assert!(answer.text().contains("expected a page with a camera"), "{}", answer.text());
    }
    for path in ["/api/live/x/photo", "/api/live/0/nothing", "/api/live/0"] {
        assert_eq!(post(&served, path).status, 404, "{path}");
    }
}
