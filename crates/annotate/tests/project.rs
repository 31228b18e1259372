//! A project's folder: closing and reopening, versions of the model, pictures without the part, removed pictures.

use std::time::{Duration, Instant};

use crate::served::{Served, photo_png};
use serde_json::{Value, json};

const MARKS: &str = r#"{"box": [40, 40, 140, 60], "grasp": {"start": [80, 50], "end": [100, 50], "jaw_width": 24}}"#;

fn project() -> Served {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("photo.png"), photo_png()).unwrap();
    Served::of_project(folder)
}

fn get(served: &Served) -> Value {
    served.ask("GET", "/api/session", b"").json()
}

fn teach(served: &Served) {
    served.ask("POST", "/api/teaching", b"{\"model\": \"S\"}").json();
    let start = Instant::now();
    while served.ask("GET", "/api/teaching", b"").json()["status"] != "done" {
        assert!(start.elapsed() < Duration::from_secs(30));
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn try_photo(served: &Served, name: &str) -> Value {
    served.ask("POST", &format!("/api/trial-pictures?name={name}"), &photo_png()).json()
}

#[test]
fn a_project_is_opened_again_where_it_was_left() {
    let served = project();
    served.ask("PUT", "/api/label", b"{\"label\": \"rod\"}").json();
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    teach(&served);
    for name in ["table.png", "empty.png", "other.png"] {
        try_photo(&served, name);
    }
    served.ask("POST", "/api/trial-pictures/0/accept", MARKS.as_bytes()).json();
    let absent = served.ask("PUT", "/api/trial-pictures/1/absent", b"{\"absent\": true}").json();
    assert_eq!((&absent["name"], &absent["is_absent"]), (&json!("empty.png"), &json!(true)));
    let left = get(&served);
    let served = Served::of_project(served.end());
    let again = get(&served);
    for what in ["label", "images", "trial_pictures", "models"] {
        let mut left = left[what].clone();
        // The notes on the photos' files may differ; everything else must be equal.
        if what == "images" {
            left.as_array_mut().unwrap().iter_mut().for_each(|image| image["note"] = again[what][0]["note"].clone());
        }
        assert_eq!(again[what], left, "{what}");
    }
    assert_eq!(again["images"][1]["name"], "table.png");
    assert_eq!(again["trial_pictures"][0]["became"], 1);
    // The model is also there: it was read from its file.
    let found = served.ask("POST", "/api/trial-pictures/2/detect", b"").json();
    assert_eq!(found["detections"], json!([]));
    assert!(served.folder.path().join("tried/other.png").exists() && served.folder.path().join("rod.sdg").exists());
}

#[test]
fn models_are_versions_and_marks_that_changed_make_them_stale() {
    let served = project();
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    teach(&served);
    teach(&served);
    let models = get(&served)["models"].clone();
    assert_eq!(models.as_array().unwrap().len(), 2);
    let is = |what: &str, model: &Value| model[what].as_bool().unwrap();
    assert!(!is("is_current", &models[0]) && is("is_current", &models[1]));
    assert!(!is("is_stale", &models[0]) && !is("is_stale", &models[1]));
    assert_ne!(models[0]["file"], models[1]["file"]);
    for model in models.as_array().unwrap() {
        assert!(served.folder.path().join("models").join(model["file"].as_str().unwrap()).exists());
    }

    let moved = MARKS.replace("[80, 50]", "[82, 50]");
    served.ask("PUT", "/api/images/0/marks", moved.as_bytes()).json();
    assert!(is("is_stale", &get(&served)["models"][1]));
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    assert!(!is("is_stale", &get(&served)["models"][1]), "marks put back are the marks that were taught");

    let used = served.ask("PUT", "/api/models/0/current", b"").json();
    assert!(is("is_current", &used["models"][0]));
    assert_eq!(served.ask("PUT", "/api/models/7/current", b"").status, 404);
    try_photo(&served, "table.png");
    let compared = served.ask("POST", "/api/models/0/compare/1", b"").json();
    assert_eq!((&compared[0]["name"], &compared[0]["is_there"]), (&json!("table.png"), &Value::Null));
    let nothing = json!({"best": 0.0, "accepted": []});
    assert_eq!(compared[0]["found"], json!([nothing, nothing]));
    // A picture that cannot be searched does not prevent the comparison in the others.
    try_photo(&served, "cut.png");
    std::fs::write(served.folder.path().join("tried/cut.png"), &photo_png()[..100]).unwrap();
    let compared = served.ask("POST", "/api/models/0/compare/1", b"").json();
    assert_eq!(compared[0]["found"], json!([nothing, nothing]));
    assert_eq!(compared[1]["found"], Value::Null);
    assert!(compared[1]["failed"].as_str().unwrap().starts_with("cut.png: "), "{compared}");
}

#[test]
fn a_model_is_not_old_because_its_folder_was_renamed() {
    let served = project();
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    try_photo(&served, "empty.png");
    served.ask("PUT", "/api/trial-pictures/0/absent", b"{\"absent\": true}").json();
    teach(&served);
    let folder = served.end();
    let renamed = tempfile::tempdir().unwrap();
    // A folder may replace an empty one.
    std::fs::rename(folder.path(), renamed.path()).unwrap();
    assert_eq!(get(&Served::of_project(renamed))["models"][0]["is_stale"], false);
}

#[test]
fn a_model_in_another_folder_is_found_without_naming_that_again() {
    let out = tempfile::tempdir().unwrap();
    let path = out.path().join("rod.sdg");
    let in_use = |served: &Served| {
        let models = get(served)["models"].clone();
        models.as_array().unwrap().iter().map(|model| model["is_current"] == true).collect::<Vec<_>>()
    };
    let served = Served::of_project_with_model(project().end(), path.clone());
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    teach(&served);
    assert_eq!(std::fs::read_dir(out.path().join("models")).unwrap().count(), 1);
    let served = Served::of_project(served.end());
    assert_eq!(in_use(&served), [true]);
    // A model in the project's folder is also found if another folder is given.
    teach(&served);
    let served = Served::of_project_with_model(served.end(), path);
    assert_eq!(in_use(&served), [false, true]);
    assert_eq!(served.ask("PUT", "/api/models/0/current", b"").status, 200);
}

#[test]
fn models_outside_the_folder_of_versions_are_found_after_a_move() {
    let is_found = |served: &Served| {
        assert_eq!(get(served)["models"][0]["is_current"], true, "{}", get(served)["notes"]);
        assert_eq!(served.ask("PUT", "/api/models/0/current", b"").status, 200);
    };
    // In another folder of the project, which is renamed.
    let folder = project().end();
    let out = folder.path().join("out/rod.sdg");
    let served = Served::of_project_with_model(folder, out);
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    teach(&served);
    let (folder, renamed) = (served.end(), tempfile::tempdir().unwrap());
    std::fs::rename(folder.path(), renamed.path()).unwrap();
    is_found(&Served::of_project(renamed));

    // Outside the project, and named again after its move.
    let (out, renamed) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let served = Served::of_project_with_model(project().end(), out.path().join("rod.sdg"));
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    teach(&served);
    let folder = served.end();
    std::fs::rename(out.path(), renamed.path()).unwrap();
    is_found(&Served::of_project_with_model(folder, renamed.path().join("rod.sdg")));
}

#[test]
fn a_version_keeps_the_settings_of_the_part() {
    let served = project();
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    teach(&served);
    let request = json!({"model": "S", "symmetry": 2, "fixed_height": true, "steps": 100_000}).to_string();
    let begun = served.ask("POST", "/api/teaching", request.as_bytes()).json();
    // The numbers of photos and of negatives are those at the start.
    assert_eq!((&begun["photos"], &begun["negatives"]), (&json!(1), &json!(0)));
    served.ask("DELETE", "/api/teaching", b"").json();
    while served.ask("GET", "/api/teaching", b"").json()["status"] != "failed" {
        std::thread::sleep(Duration::from_millis(5));
    }
    let request = request.replace("100000", "3");
    served.ask("POST", "/api/teaching", request.as_bytes()).json();
    while served.ask("GET", "/api/teaching", b"").json()["status"] != "done" {
        std::thread::sleep(Duration::from_millis(5));
    }
    let settings = |served: &Served| {
        let models = get(served)["models"].clone();
        [0usize, 1].map(|i| (models[i]["symmetry"].clone(), models[i]["fixed_height"].clone()))
    };
    let expected = [(json!(1), json!(false)), (json!(2), json!(true))];
    assert_eq!(settings(&served), expected);
    assert_eq!(settings(&Served::of_project(served.end())), expected, "after opening again");
}

#[test]
fn a_picture_without_the_part_is_taught_as_such() {
    let served = project();
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    teach(&served);
    try_photo(&served, "empty.png");
    let is_accepted =
        || served.ask("POST", "/api/trial-pictures/0/detect", b"").json()["detections"][0]["is_accepted"].clone();
    assert_eq!(is_accepted(), true);
    served.ask("PUT", "/api/trial-pictures/0/absent", b"{\"absent\": true}").json();
    assert_eq!(get(&served)["models"][0]["is_stale"], true);
    teach(&served);
    assert_eq!(is_accepted(), false);
    assert_eq!(get(&served)["models"][1]["negatives"], 1);
    // After revoking, the picture is no longer a negative; a demonstration cannot become one.
    served.ask("PUT", "/api/trial-pictures/0/absent", b"{\"absent\": false}").json();
    served.ask("POST", "/api/trial-pictures/0/accept", MARKS.as_bytes()).json();
    assert_eq!(served.ask("PUT", "/api/trial-pictures/0/absent", b"{\"absent\": true}").status, 409);
}

#[test]
fn what_is_taken_out_stays_out_and_its_file_stays() {
    let served = project();
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    teach(&served);
    try_photo(&served, "table.png");
    try_photo(&served, "other.png");
    served.ask("POST", "/api/trial-pictures/0/accept", MARKS.as_bytes()).json();
    let view = served.ask("DELETE", "/api/images/1", b"").json();
    assert_eq!((view["images"].as_array().unwrap().len(), &view["trial_pictures"][0]["became"]), (1, &Value::Null));
    assert_eq!(served.ask("GET", "/api/images/1/picture", b"").status, 404);
    // Restored pictures have their former roles; the photo's picture is a demonstration again.
    let view = served.ask("POST", "/api/images/1/put-back", b"").json();
    assert_eq!((&view["images"][1]["name"], &view["trial_pictures"][0]["became"]), (&json!("table.png"), &json!(1)));
    served.ask("DELETE", "/api/trial-pictures/1", b"").json();
    let view = served.ask("POST", "/api/trial-pictures/1/put-back", b"").json();
    assert_eq!(view["trial_pictures"][1]["name"], "other.png");
    assert_eq!(served.ask("POST", "/api/images/7/put-back", b"").status, 404);

    served.ask("DELETE", "/api/images/1", b"").json();
    served.ask("DELETE", "/api/trial-pictures/1", b"").json();
    let served = Served::of_project(served.end());
    let again = get(&served);
    assert_eq!(again["images"].as_array().unwrap().len(), 1);
    assert_eq!(again["trial_pictures"].as_array().unwrap().len(), 1);
    assert!(served.folder.path().join("table.png").exists() && served.folder.path().join("tried/other.png").exists());
}

#[test]
fn a_picture_that_is_gone_is_told_and_the_rest_opens() {
    let served = project();
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    try_photo(&served, "table.png");
    let folder = served.end();
    std::fs::remove_file(folder.path().join("tried/table.png")).unwrap();
    let again = get(&Served::of_project(folder));
    assert_eq!(again["notes"], json!(["tried/table.png does not exist now; the project still names it."]));
    assert_eq!(again["images"].as_array().unwrap().len(), 1);
}

#[test]
fn numbers_of_an_earlier_session_are_refused() {
    let served = project();
    let id = get(&served)["id"].as_str().unwrap().to_owned();
    let put = |served: &Served, id: &str| {
        let host = format!("127.0.0.1:{}", served.port);
        let key = format!("Bearer {}", served.token);
        let headers = [("Host", host.as_str()), ("Authorization", key.as_str()), ("Sdg-Session", id)];
        served.send("PUT", "/api/images/0/marks", &headers, MARKS.as_bytes()).status
    };
    let served = Served::of_project(served.end());
    assert_eq!(put(&served, &id), 412);
    assert!(!served.folder.path().join("photo.json").exists(), "nothing was written");
    let id = get(&served)["id"].as_str().unwrap().to_owned();
    assert_eq!(put(&served, &id), 200);
    assert!(served.folder.path().join("photo.json").exists());
}

#[test]
fn the_region_is_kept_whatever_the_model_says() {
    let served = project();
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    let region = json!({"x": 0, "y": 10, "width": 150, "height": 80, "picture": [200, 100]});
    let put = |served: &Served, region: &Value| served.ask("PUT", "/api/region", region.to_string().as_bytes()).json();
    put(&served, &region);
    let served = Served::of_project(served.end());
    assert_eq!(get(&served)["region"], region, "without a model");
    teach(&served);
    put(&served, &Value::Null);
    let served = Served::of_project(served.end());
    assert_eq!(get(&served)["region"], Value::Null, "all of the picture was chosen after the teaching");
    put(&served, &region);
    let served = Served::of_project(served.end());
    assert_eq!(get(&served)["region"], region);
}

#[test]
fn a_version_that_is_used_again_searches_the_region_of_the_page() {
    let served = project();
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    teach(&served);
    let region = json!({"x": 0, "y": 10, "width": 150, "height": 80, "picture": [200, 100]});
    served.ask("PUT", "/api/region", region.to_string().as_bytes()).json();
    assert_eq!(served.ask("PUT", "/api/models/0/current", b"").json()["region"], region);
}

#[test]
fn a_model_has_the_name_of_its_part_after_a_change_of_the_name() {
    let served = project();
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    let rename = |name: &str| served.ask("PUT", "/api/label", json!({"label": name}).to_string().as_bytes()).json();
    rename("rod");
    teach(&served);
    rename("bar");
    let is_there = |name: &str| served.folder.path().join(name).exists();
    assert!(is_there("rod.sdg") && is_there("bar.sdg"));
    // Renamed during a teaching.
    let request = json!({"model": "S", "steps": 100}).to_string();
    served.ask("POST", "/api/teaching", request.as_bytes()).json();
    rename("lid");
    std::fs::remove_file(served.folder.path().join("bar.sdg")).unwrap();
    while served.ask("GET", "/api/teaching", b"").json()["status"] != "done" {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(is_there("lid.sdg") && !is_there("bar.sdg"));
}

#[test]
fn a_model_file_that_is_gone_is_told_once_and_stays_named() {
    let served = project();
    served.ask("PUT", "/api/images/0/marks", MARKS.as_bytes()).json();
    teach(&served);
    let name = get(&served)["models"][0]["file"].as_str().unwrap().to_owned();
    let folder = served.end();
    let (file, away) = (folder.path().join("models").join(&name), folder.path().join("away"));
    std::fs::rename(&file, &away).unwrap();
    let served = Served::of_project(folder);
    let view = get(&served);
    let notes: Vec<&str> = view["notes"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    assert!(notes.len() == 1 && notes[0].matches("cannot read").count() == 1 && notes[0].contains(&name), "{notes:?}");
    assert_eq!(view["models"][0]["is_current"], false);
    // A file of another content is there, but unsuitable.
    let folder = served.end();
    std::fs::write(&file, "no model").unwrap();
    let served = Served::of_project(folder);
    assert_eq!(get(&served)["notes"], json!(["The model of this project cannot be used here: no model"]));
    let folder = served.end();
    std::fs::rename(&away, &file).unwrap();
    assert_eq!(get(&Served::of_project(folder))["models"][0]["is_current"], true);
}
