//! `sdg teach --demos`: a folder of demonstrations to a folder of models, with a page that lists similar parts.

use std::fs;
use std::path::Path;

use crate::support::{Folder, sdg, shipped, stdout, write_unusable_demonstration};
use serde_json::Value;

/// Two parts, one of them under two names, and a photo without marks.
fn demonstrations(folder: &Folder) -> String {
    let demos = folder.path("demos");
    let copy = |part: &str, photo: &str| {
        let to = Path::new(&demos).join(photo);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(shipped(part, "image.png"), &to).unwrap();
        fs::copy(shipped(part, "annotation.json"), to.with_extension("json")).unwrap();
    };
    copy("pendulum", "lever.png");
    copy("rod_end", "rod_end.png");
    // A folder with the part's name can contain several photos of it.
    copy("pendulum", "twin/first.png");
    fs::copy(shipped("key", "image.png"), Path::new(&demos).join("unmarked.png")).unwrap();
    demos
}

#[test]
fn parts_that_look_alike_are_told() {
    let folder = Folder::new();
    let (demos, out) = (demonstrations(&folder), folder.path("out"));
    let teach = |more: &[&str]| sdg(&[&["teach", "--model", "S", "--demos", &demos, "--out", &out][..], more].concat());
    // One part, as in a task of a job array.
    assert!(teach(&["--part", "twin"]).status.success());
    let record = |part: &str| fs::read(Path::new(&out).join("parts").join(format!("{part}.json"))).unwrap();
    let twin = record("twin");
    assert!(!Path::new(&out).join("index.html").exists());

    let output = teach(&["--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["taught"], 3);
    let pairs: Vec<&Value> = found["look_alike"].as_array().unwrap().iter().map(|pair| &pair["parts"]).collect();
    assert_eq!(pairs, [&serde_json::json!(["lever", "twin"])]);
    assert_eq!(found["need_photo"].as_array().unwrap().len(), 0, "{}", found["need_photo"]);
    let left_out = found["left_out"][0]["name"].as_str().unwrap();
    assert!(left_out.ends_with("unmarked.png") && found["left_out"][0]["why"].as_str().unwrap().contains("marks"));
    for part in ["lever", "rod_end", "twin"] {
        assert!(Path::new(&out).join(format!("models/{part}.sdg")).exists());
    }
    let page = fs::read_to_string(found["report"].as_str().unwrap()).unwrap();
    assert!(page.contains("3 parts taught") && page.contains("Look-alikes"));
    // The page shows each part's photo with the part's name and its model's result.
    for part in ["lever", "rod_end", "twin"] {
        assert!(page.contains(&format!("{part}: ")), "{part}");
    }
    // Existing models are reused with their times; with another seed, or if missing, they are taught again.
    assert_eq!(record("twin"), twin);
    let rod_end = Path::new(&out).join("models/rod_end.sdg");
    fs::remove_file(&rod_end).unwrap();
    let text = stdout(&["teach", "--model", "S", "--demos", &demos, "--out", &out]);
    assert!(text.contains("look alike: lever and twin"), "{text}");
    let unmarked = format!("left out: {}: expected", Path::new(&demos).join("unmarked.png").display());
    assert!(text.contains(&unmarked) && !text.contains("needs another photo"), "{text}");
    assert!(rod_end.exists());
    assert!(teach(&["--part", "twin", "--seed", "2"]).status.success());
    assert_ne!(record("twin"), twin);
    // Random initialisation is another input than the included weights.
    let output = teach(&["--part", "lever", "--base-weights", "none"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let without_weights = record("lever");
    assert!(teach(&["--part", "lever"]).status.success());
    assert_ne!(record("lever"), without_weights);
}

#[test]
fn models_remain_if_the_base_weights_are_missing_or_the_marks_are_damaged() {
    let folder = Folder::new();
    let (demos, out) = (demonstrations(&folder), folder.path("out"));
    let arguments = ["--demos", &demos, "--out", &out];
    stdout(&[&["teach", "--model", "S", "--part", "lever"][..], &arguments].concat());
    let model = Path::new(&out).join("models/lever.sdg");
    let before = fs::read(&model).unwrap();
    let output = sdg(&[&["teach", "--preset", "r50-torchvision"][..], &arguments].concat());
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert_eq!(fs::read(&model).unwrap(), before);

    for marks in ["lever.json", "rod_end.json", "twin/first.json"] {
        fs::write(Path::new(&demos).join(marks), "{}").unwrap();
    }
    let output = sdg(&[&["teach", "--model", "S"][..], &arguments].concat());
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && error.contains("expected a part that can be taught"), "{error}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("not taught: lever: ") && !text.contains("needs another photo"), "{text}");
    assert!(!model.exists() && Path::new(&out).join("index.html").exists());
    assert_eq!(fs::read(model.with_extension("sdg.before")).unwrap(), before);
    // Of several parts, each has its reason.
    let some = ["teach", "--model", "S", "--part", "lever", "--part", "rod_end"];
    let output = sdg(&[&some[..], &arguments].concat());
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.contains("not taught: lever: ") && error.contains("rod_end: "), "{error}");
}

#[test]
fn a_model_that_fails_its_own_samples_ends_with_4() {
    let folder = Folder::new();
    let (demos, out) = (folder.path("demos"), folder.path("out"));
    fs::create_dir(&demos).unwrap();
    write_unusable_demonstration(&Path::new(&demos).join("checks.png"));
    for more in [&["--part", "checks"][..], &[]] {
        let output = sdg(&[&["teach", "--model", "S", "--demos", &demos, "--out", &out][..], more].concat());
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(4), "{more:?}: {error}");
        assert!(Path::new(&out).join("models/checks.sdg").exists());
    }
}

#[test]
fn wrong_folders_are_told() {
    let folder = Folder::new();
    let refused = |arguments: &[&str], code: i32, part: &str| {
        let output = sdg(&[&["teach", "--model", "S"][..], arguments].concat());
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{error}");
        assert!(error.contains(part), "expected {part} in {error}");
    };
    let (empty, out) = (folder.path("empty"), folder.path("out"));
    fs::create_dir(&empty).unwrap();
    refused(&["--demos", &empty, "--out", &out], 1, "expected photos with marks beside them");
    let demos = demonstrations(&folder);
    refused(&["--demos", &demos, "--out", &out, "--part", "lver"], 2, "such as lever, rod_end, twin, found \"lver\"");
    refused(&["--demos", &demos, "--demo", "a.png", "--out", &out], 2, "--demo");
    refused(&["--part", "lever", "--out", &out], 2, "--demos");
    fs::write(Path::new(&demos).join("symmetries.txt"), "lever 2\nwheel full\n").unwrap();
    refused(&["--demos", &demos, "--out", &out], 1, "symmetries.txt: expected a part of this folder");
    fs::remove_file(Path::new(&demos).join("symmetries.txt")).unwrap();
    fs::copy(shipped("key", "image.png"), Path::new(&demos).join("twin.png")).unwrap();
    fs::copy(shipped("key", "annotation.json"), Path::new(&demos).join("twin.json")).unwrap();
    refused(&["--demos", &demos, "--out", &out], 1, "expected one part of each name");
}
