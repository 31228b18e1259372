//! `truth.json` and `sdg evaluate --split`: results compared with an independent implementation, `--tuned`, and wrong
//! files.

use std::fs;
use std::path::Path;

use crate::support::{Folder, sdg, shipped, stdout, taught_pendulum};
use serde_json::{Value, json};

/// Number of samples. With this many, samples with each change of [`write_set`], and some without a change, are
/// accepted.
const NUM_SAMPLES: &str = "20";

fn read_json(path: &str) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// A set of the pendulum with a ground truth that differs from the samples' own marks in known ways.
fn write_set(folder: &Folder, name: &str) -> String {
    let set = folder.path(name);
    let [photo, marks] = ["image.png", "annotation.json"].map(|file| shipped("pendulum", file).display().to_string());
    stdout(&["augment", "--demo", &format!("{photo}:{marks}"), "--count", NUM_SAMPLES, "--out", &set]);
    fs::copy(photo, format!("{set}/demo.png")).unwrap();
    fs::copy(marks, format!("{set}/demo.json")).unwrap();

    let labels = read_json(&format!("{set}/annotations.json"));
    let annotations = labels["annotations"].as_array().unwrap();
    let mut num_with_part = 0;
    fs::copy(shipped("key", "image.png"), format!("{set}/key.png")).unwrap();
    let mut entries = vec![
        json!({"image": "key.png", "present": false, "instances": [], "kind": "neg_look", "what": "mirror image"}),
    ];
    for image in labels["images"].as_array().unwrap() {
        let name = &image["file_name"];
        // Samples without the part, and parts cut off by the border, have no entry.
        let annotation = annotations.iter().find(|annotation| annotation["image_id"] == image["id"]);
        let Some(k) = annotation.and_then(|annotation| annotation["keypoints"].as_array()) else { continue };
        let k: Vec<f64> = k.iter().map(|number| number.as_f64().unwrap()).collect();
        let (dx, dy) = (k[3] - k[0], k[4] - k[1]);
        let (mut x, mut angle_deg, mut symmetry_deg, mut optional) =
            ((k[0] + k[3]) / 2.0, dy.atan2(dx).to_degrees(), 360.0, false);
        // The part is about twice as long as its marks.
        let diag_px = 2.0 * dx.hypot(dy);
        match num_with_part % 6 {
            0 => x += 0.06 * diag_px,
            1 => angle_deg += 15.0,
            2 => optional = true,
            3 => (angle_deg, symmetry_deg) = (angle_deg + 180.0, 180.0),
            _ => {}
        }
        num_with_part += 1;
        if num_with_part == 5 {
            entries.push(json!({"image": name, "present": false, "instances": [], "kind": "neg_other"}));
            continue;
        }
        entries.push(json!({"image": name, "present": true, "kind": "plain", "instances": [{
            "points_px": [[k[0], k[1]], [k[3], k[4]]], "centre_px": [x, (k[1] + k[4]) / 2.0], "angle_deg": angle_deg,
            "diag_px": diag_px, "symmetry_deg": symmetry_deg, "optional": optional}]}));
    }
    assert!(num_with_part > 5, "every difference is in the set");
    fs::write(format!("{set}/truth.json"), json!(entries).to_string()).unwrap();
    set
}

/// A split with the set of [`write_set`] and with a second set on the reported side, whose folder does not exist.
fn write_split(folder: &Folder) -> String {
    let set = |name: &str, side: &str| {
        format!("[[set]]\nname = \"{name}\"\nside = \"{side}\"\nfolder = \"{name}\"\ndemo = \"demo.png\"\n")
    };
    folder.text("split.toml", &(set("lever", "tuned") + &set("gone", "reported")))
}

/// Numbers of parts, of found parts, of detections accepted in pictures with the part, of wrong detections, of pictures
/// without the part, and of false alarms. They are counted from the output of `sdg detect` by the rule of the sets' own
/// scripts.
fn counted_naively(set: &str, model: &str) -> [u64; 6] {
    let [mut parts, mut found, mut accepted, mut wrong, mut negatives, mut false_alarms] = [0; 6];
    for entry in read_json(&format!("{set}/truth.json")).as_array().unwrap() {
        let picture = format!("{set}/{}", entry["image"].as_str().unwrap());
        // Exit code 3, nothing to grasp, is a valid answer as well.
        let printed = sdg(&["detect", "--grasp-model", model, "--json", &picture]).stdout;
        let printed: Value = serde_json::from_slice(&printed).unwrap();
        let detections = printed["detections"].as_array().unwrap();
        if entry["present"] == json!(false) {
            negatives += 1;
            false_alarms += u64::from(!detections.is_empty());
            continue;
        }
        let instances = entry["instances"].as_array().unwrap();
        let is_optional = |at: usize| instances[at]["optional"] == json!(true);
        let mut free: Vec<usize> = (0..instances.len()).collect();
        parts += free.iter().filter(|at| !is_optional(**at)).count() as u64;
        accepted += detections.len() as u64;
        for detection in detections {
            let grasp = |name: &str| detection["grasp"][name].as_f64().unwrap();
            let is_hit = |at: &&usize| {
                let truth = &instances[**at];
                let number = |name: &str| truth[name].as_f64().unwrap();
                let centre = |axis: usize| truth["centre_px"][axis].as_f64().unwrap();
                let distance = (grasp("x") - centre(0)).hypot(grasp("y") - centre(1));
                let period = number("symmetry_deg");
                let turn = (grasp("angle_deg") - number("angle_deg") + period / 2.0).rem_euclid(period) - period / 2.0;
                distance <= 0.04 * number("diag_px") && turn.abs() <= 10.0
            };
            match free.iter().find(is_hit).copied() {
                Some(at) => {
                    free.retain(|other| *other != at);
                    found += u64::from(!is_optional(at));
                }
                None => wrong += 1,
            }
        }
    }
    [parts, found, accepted, wrong, negatives, false_alarms]
}

#[test]
fn the_tuned_side_is_counted_by_the_rule_and_nothing_else_is_read() {
    let folder = Folder::new();
    let (set, split, model) = (write_set(&folder, "lever"), write_split(&folder), folder.path("model.sdg"));
    taught_pendulum(&model, None);
    let expected = counted_naively(&set, &model);
    let [parts, found, accepted, wrong, negatives, false_alarms] = expected;
    assert!(found > 1 && wrong > 0 && parts >= found + 2 && negatives == 2 && false_alarms == 1, "{expected:?}");

    let arguments =
        ["evaluate", "--pictures", &set, "--grasp-model", &model, "--report", &folder.path("report"), "--json"];
    let evaluated: Value = serde_json::from_str(&stdout(&arguments)).unwrap();
    let counts =
        ["parts", "found", "wrong", "pictures_without_part", "false_alarms"].map(|name| evaluated[name].as_u64());
    assert_eq!(counts, [parts, found, wrong, negatives, false_alarms].map(Some));
    let kinds: Vec<(&str, u64)> = evaluated["by_kind"]
        .as_array()
        .unwrap()
        .iter()
        .map(|kind| (kind["kind"].as_str().unwrap(), kind["false_alarms"].as_u64().unwrap()))
        .collect();
    assert_eq!(kinds.len(), 3, "{kinds:?}");
    assert!(kinds.contains(&("neg_other", 1)) && kinds.contains(&("neg_mirror", 0)), "{kinds:?}");

    let (root, results, records) = (folder.path(""), folder.path("results.json"), folder.path("records.jsonl"));
    let measure = ["evaluate", "--split", &split, "--sets", &root];
    let tuned = ["--tuned", "--seeds", "1,2", "--results", &results, "--records", &records];
    let tables = stdout(&[&measure[..], &tuned].concat());
    for part in [
        "model S".to_owned(),
        "worst of seeds 1, 2".to_owned(),
        "| lever | tuned |".to_owned(),
        format!("| neg_other | {false_alarms} of 1 false alarms |"),
    ] {
        assert!(tables.contains(&part), "expected {part} in {tables}");
    }
    assert!(!tables.contains("reported") && !tables.contains("gone"), "{tables}");
    let results = read_json(&results);
    assert_eq!(results["sides"], json!(["tuned"]));
    let side = &results["models"][0]["seeds"][0]["sides"][0];
    assert_eq!(side["found"], json!({"count": found, "of": parts}));
    assert_eq!(side["wrong"], json!({"count": wrong, "of": accepted}));
    assert_eq!(side["false_alarms"], json!({"count": false_alarms, "of": negatives}));
    assert_eq!(side["by_min_score"][25]["found"], json!(found));
    assert_eq!(results["models"][0]["tuned_less_reported"], Value::Null);
    let lines = fs::read_to_string(records).unwrap();
    let candidates: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let seed_1 =
        || candidates.iter().filter(|candidate| candidate["seed"] == 1 && candidate["score"].as_f64() >= Some(0.5));
    assert_eq!(seed_1().filter(|candidate| candidate["hit"] == "part").count() as u64, found);
    let moved = seed_1().filter(|candidate| candidate["place"] == "misplaced").count();
    let turned = seed_1().filter(|candidate| candidate["place"] == "wrong_turn").count();
    assert!(moved > 0 && turned > 0, "{moved} moved, {turned} turned");
    assert!(candidates.iter().any(|candidate| candidate["refused"].is_string() && candidate["evidence"].is_object()));

    let refused = |arguments: &[&str], code: i32, part: &str| {
        let output = sdg(arguments);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{error}");
        assert_eq!(error.lines().count(), if code == 1 { 1 } else { error.lines().count() }, "{error}");
        assert!(error.contains(part), "expected {part} in: {error}");
    };
    refused(&measure, 1, "gone: expected the folder of set \"gone\"");
    // Before the measurement, which would print more lines.
    let notes = folder.text("notes.txt", "notes");
    refused(&[&measure[..], &["--tuned", "--records", &notes]].concat(), 1, "or JSON to replace, found text");
    refused(&[&measure[..], &["--seeds", "1,1"]].concat(), 2, "found 1 again");
    let one_file = folder.path("figures.json");
    let both = ["--tuned", "--results", &one_file, "--records", &one_file];
    refused(&[&measure[..], &both].concat(), 2, "expected another file than --results");
    refused(&measure[..3], 2, "--sets");
    refused(&[&measure[..], &["--pictures", &set]].concat(), 2, "--pictures");
    let text = fs::read_to_string(&split).unwrap();
    fs::write(&split, text.replace("reported", "report")).unwrap();
    refused(&[&measure[..], &["--tuned"]].concat(), 1, "line 8: unknown variant `report`");
    fs::write(&split, text).unwrap();
    fs::write(Path::new(&set).join("truth.json"), "[{\"image\": \"demo.png\"}]").unwrap();
    refused(&[&measure[..], &["--tuned"]].concat(), 1, "truth.json, entry 1 (demo.png): missing field `present`");
    // Labels in other files are also read before a model is taught.
    fs::remove_file(Path::new(&set).join("truth.json")).unwrap();
    fs::write(Path::new(&set).join("key.json"), "{\"shapes\": [").unwrap();
    refused(&[&measure[..], &["--tuned"]].concat(), 1, "key.json");
}
