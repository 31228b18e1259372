//! A session from the first mark to a second demonstration, on the real server.

use std::time::{Duration, Instant};

use crate::served;
use image::{Rgb, RgbImage};
use sdg_demonstration::{Annotation, ImageFacts};
use sdg_geometry::Polygon;
use serde_json::{Value, json};
use served::Served;

const FACTS: ImageFacts = ImageFacts { width: 200, height: 100, file_name: Some("photo.png") };

fn marks() -> Value {
    json!({
        "box": [40.0, 40.0, 140.0, 60.0],
        "grasp": {"start": [80.0, 50.0], "end": [100.0, 50.0], "jaw_width": 24.0},
        "outline": [[40.0, 40.0], [140.0, 40.0], [140.0, 60.0], [40.0, 60.0]],
    })
}

fn put_marks(served: &Served, marks: &Value) -> Value {
    served.ask("PUT", "/api/images/0/marks", marks.to_string().as_bytes()).json()
}

fn wait_for(served: &Served, statuses: &[&str]) -> Value {
    let start = Instant::now();
    loop {
        let news = served.ask("GET", "/api/teaching", b"").json();
        if statuses.contains(&news["status"].as_str().unwrap()) {
            return news;
        }
        assert!(start.elapsed() < Duration::from_secs(30), "{news}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn marks_are_written_as_they_are_made() {
    let served = Served::start();
    let file = served.folder.path().join("photo.json");
    let grasp_alone = put_marks(&served, &json!({"grasp": marks()["grasp"]}));
    assert_eq!(grasp_alone["saved"]["state"], "nothing");
    assert!(!file.exists());
    assert_eq!(served.ask("GET", "/api/session", b"").json()["images"][0]["marks"]["grasp"], marks()["grasp"]);

    served.ask("PUT", "/api/label", b"{\"label\": \"bar\"}").json();
    let whole = put_marks(&served, &marks());
    assert_eq!(whole["saved"], json!({"state": "written", "file": "photo.json"}));
    assert_eq!(whole["advice"]["remarks"], json!([]));
    let read = Annotation::read(&std::fs::read(&file).unwrap(), &FACTS).unwrap().remove(0);
    assert_eq!((read.label.as_str(), read.jaw_width), ("bar", Some(24.0)));

    served.ask("PUT", "/api/label", b"{\"label\": \"rod\"}").json();
    assert_eq!(Annotation::read(&std::fs::read(&file).unwrap(), &FACTS).unwrap()[0].label, "rod");

    let crossing = json!({"outline": [[40, 40], [140, 60], [140, 40], [40, 60]]});
    let refused = put_marks(&served, &crossing);
    assert_eq!(refused["saved"]["state"], "refused");
    assert!(refused["saved"]["why"].as_str().unwrap().contains("does not cross itself"));
    assert!(Annotation::read(&std::fs::read(&file).unwrap(), &FACTS).is_ok(), "the last good marks stand");
}

#[test]
fn marks_that_another_program_changed_are_sent_with_the_refusal() {
    let served = Served::start();
    let other = json!({"imageWidth": 200, "imageHeight": 100, "shapes": [
        {"label": "bar", "shape_type": "rectangle", "points": [[10, 20], [110, 60]]}]});
    std::fs::write(served.folder.path().join("photo.json"), other.to_string()).unwrap();
    let refused = served.ask("PUT", "/api/images/0/marks", marks().to_string().as_bytes());
    let told: Value = serde_json::from_slice(&refused.body).unwrap();
    assert_eq!((refused.status, &told["image"]["marks"]["box"]), (409, &json!([10.0, 20.0, 110.0, 60.0])));
    assert!(told["error"].as_str().unwrap().contains("another program changed these marks"), "{told}");
    assert_eq!(put_marks(&served, &marks())["saved"]["file"], "photo.coco.json");
}

#[test]
fn strokes_correct_an_outline_that_was_drawn() {
    let served = Served::start();
    // Half of the bar, and a triangle of the table above it, which no detection would find.
    let drawn = json!([[40, 60], [40, 40], [60, 20], [80, 40], [90, 40], [90, 60]]);
    let stroke = json!({"points": [[110, 50], [130, 50]], "is_inside": true});
    let mut request = json!({"box": [38, 18, 142, 62], "strokes": [stroke]});
    let has = |request: &Value, [x, y]: [f64; 2]| {
        let answer = served.ask("POST", "/api/images/0/outline", request.to_string().as_bytes()).json();
        let points: Vec<[f64; 2]> = serde_json::from_value(answer["outline"].clone()).unwrap();
        Polygon { vertices: points.into_iter().map(Into::into).collect() }.contains(&[x, y].into())
    };
    let [table, far_end] = [[60.0, 32.0], [120.0, 50.0]];
    assert!(has(&request, far_end) && !has(&request, table), "detected");
    request["outline"] = drawn;
    assert!(has(&request, far_end) && has(&request, table), "corrected");
    request["outline"] = json!([[40, 60], [40, 40]]);
    let refused = served.ask("POST", "/api/images/0/outline", request.to_string().as_bytes());
    assert!((400..500).contains(&refused.status) && refused.text().contains("outline"), "{}", refused.text());
}

#[test]
fn samples_are_pictures_that_change_with_number_and_marks() {
    let served = Served::start();
    put_marks(&served, &marks());
    let sample = |path: &str| {
        let answer = served.ask("GET", path, b"");
        assert_eq!(answer.status, 200, "{}", answer.text());
        assert!(answer.head.to_lowercase().contains("content-type: image/jpeg"));
        image::load_from_memory(&answer.body).unwrap().into_rgb8()
    };
    let first = sample("/api/images/0/samples/0?seed=1");
    assert_eq!(first.dimensions(), (200, 100));
    assert_eq!(first, sample("/api/images/0/samples/0?seed=1"));
    assert_ne!(first, sample("/api/images/0/samples/1?seed=1"));
    assert_ne!(first, sample("/api/images/0/samples/0?seed=2"));
}

#[test]
fn a_very_long_photo_has_samples() {
    let folder = tempfile::tempdir().unwrap();
    let photo = RgbImage::from_fn(9000, 64, |x, y| Rgb([(x % 251) as u8, (3 * y) as u8, 90]));
    photo.save(folder.path().join("long.png")).unwrap();
    let served = Served::of_photo(folder, "long.png");
    let grasp = json!({"start": [4030, 30], "end": [4070, 30], "jaw_width": 44});
    put_marks(&served, &json!({"box": [4000, 10, 4100, 50], "grasp": grasp}));
    let answer = served.ask("GET", "/api/images/0/samples/0?seed=1", b"");
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert_eq!(image::load_from_memory(&answer.body).unwrap().into_rgb8().dimensions(), (400, 16));
}

#[test]
fn a_teaching_tells_its_news_and_ends_when_asked() {
    let served = Served::start();
    put_marks(&served, &marks());
    let body = json!({"model": "S", "steps": 100_000}).to_string();
    assert_eq!(served.ask("POST", "/api/teaching", body.as_bytes()).json()["status"], "running");
    assert_eq!(served.ask("POST", "/api/teaching", body.as_bytes()).status, 409, "one at a time");
    let start = Instant::now();
    while served.ask("GET", "/api/teaching", b"").json()["done"].as_u64().unwrap() < 300 {
        assert!(start.elapsed() < Duration::from_secs(30));
        std::thread::sleep(Duration::from_millis(20));
    }
    served.ask("DELETE", "/api/teaching", b"").json();
    let news = wait_for(&served, &["failed"]);
    assert!(news["error"].as_str().unwrap().contains("stopped"), "{news}");
    let losses = news["losses"].as_array().unwrap();
    assert!((100..=240).contains(&losses.len()), "{} points", losses.len());
    let [step, loss] = [0usize, 1].map(|i| losses.last().unwrap()[i].as_f64().unwrap());
    assert!((loss - 1.0 / step).abs() < 1e-12);
    assert!(!served.folder.path().join("part.sdg").exists());
}

#[test]
fn a_taught_model_is_tried_and_what_it_found_becomes_a_demonstration() {
    let served = Served::start();
    put_marks(&served, &marks());
    assert_eq!(served.ask("POST", "/api/trial-pictures?name=table.png", &served::photo_png()).json()["id"], 0);
    assert_eq!(served.ask("POST", "/api/trial-pictures/0/detect", b"").status, 409, "nothing is taught yet");
    served.ask("POST", "/api/teaching", b"{\"model\": \"S\"}").json();
    let news = wait_for(&served, &["done", "failed"]);
    assert_eq!(news["status"], "done", "{news}");
    assert_eq!(std::fs::read(served.folder.path().join("part.sdg")).unwrap(), b"a model");

    let found = served.ask("POST", "/api/trial-pictures/0/detect", b"").json();
    let detection = &found["detections"][0];
    assert_eq!((&detection["is_accepted"], &detection["marks"]["grasp"]), (&json!(true), &marks()["grasp"]));
    assert_eq!(detection["cut"], Value::Null);
    let body = detection["marks"].to_string();
    let view = served.ask("POST", "/api/trial-pictures/0/accept", body.as_bytes()).json();
    assert_eq!(
        (&view["id"], &view["name"], &view["saved"]["state"]),
        (&json!(1), &json!("table.png"), &json!("written"))
    );
    let read = Annotation::read(&std::fs::read(served.folder.path().join("table.json")).unwrap(), &FACTS).unwrap();
    assert!(read[0].grasp.is_some() && read[0].outline.is_some());
    assert_eq!(served.ask("POST", "/api/trial-pictures/0/accept", body.as_bytes()).status, 409, "once is enough");
    assert_eq!(served.ask("GET", "/api/images/1/picture", b"").body, served::photo_png());
}

#[test]
fn a_region_holds_for_what_is_detected_and_what_is_taught() {
    let served = Served::start();
    put_marks(&served, &marks());
    served.ask("POST", "/api/trial-pictures?name=table.png", &served::photo_png()).json();
    let put = |body: &Value| served.ask("PUT", "/api/region", body.to_string().as_bytes());
    let num_found = || {
        let found = served.ask("POST", "/api/trial-pictures/0/detect", b"").json();
        found["detections"].as_array().unwrap().len()
    };
    let region = |x: u32, width: u32| json!({"x": x, "y": 10, "width": width, "height": 80, "picture": [200, 100]});
    for (wrong, why) in [
        (region(150, 60), "a part of the picture of 200 × 100 pixels"),
        (region(0, 0), "at least 1 × 1 pixels"),
        (json!({"x": 0.5, "y": 0, "width": 9, "height": 9}), "region"),
        (json!([1, 2, 3, 4, 5, 6]), "region"),
    ] {
        let answer = put(&wrong);
        assert!(answer.status == 422 && answer.text().contains(why), "{wrong}: {}", answer.text());
    }
    assert_eq!(served.ask("GET", "/api/session", b"").json()["region"], Value::Null);

    // Before there is a model the part must fit into the region, which becomes that of the first model.
    let small = put(&region(0, 20));
    assert!(small.status == 422 && small.text().contains("does not fit in"), "{}", small.text());
    assert_eq!(put(&region(0, 120)).json()["region"], region(0, 120));
    served.ask("POST", "/api/teaching", b"{\"model\": \"S\"}").json();
    assert_eq!(wait_for(&served, &["done", "failed"])["status"], "done");
    assert_eq!(num_found(), 1);
    // A region rejected by the model changes nothing.
    let small = put(&region(0, 20));
    assert!(small.status == 422 && small.text().contains("does not fit in"), "{}", small.text());
    assert_eq!(served.ask("GET", "/api/session", b"").json()["region"], region(0, 120));
    // The part's middle is at (90, 50).
    let below = json!({"x": 0, "y": 60, "width": 120, "height": 40, "picture": [200, 100]});
    assert_eq!((put(&below).status, num_found()), (200, 0));
    assert_eq!((put(&Value::Null).json()["region"].clone(), num_found()), (Value::Null, 1));

    let long = json!({"model": "S", "steps": 100_000}).to_string();
    served.ask("POST", "/api/teaching", long.as_bytes()).json();
    assert_eq!(put(&Value::Null).status, 409, "not while a model is taught with another region");
    served.ask("DELETE", "/api/teaching", b"").json();
    wait_for(&served, &["failed"]);
    let forged = json!({"model": "S", "region": region(0, 120)}).to_string();
    assert_eq!(served.ask("POST", "/api/teaching", forged.as_bytes()).status, 422, "the session says the region");
}

#[test]
fn a_detection_at_the_border_is_told_before_it_is_learnt_from() {
    let served = Served::start();
    let at_border = json!({"box": [0.0, 40.0, 140.0, 60.0], "grasp": marks()["grasp"]});
    put_marks(&served, &at_border);
    served.ask("POST", "/api/trial-pictures?name=table.png", &served::photo_png()).json();
    served.ask("POST", "/api/teaching", b"{\"model\": \"S\"}").json();
    assert_eq!(wait_for(&served, &["done", "failed"])["status"], "done");
    let found = served.ask("POST", "/api/trial-pictures/0/detect", b"").json();
    let cut = found["detections"][0]["cut"].as_str().unwrap();
    assert!(cut.starts_with("The part touches the border"), "{cut}");
}
