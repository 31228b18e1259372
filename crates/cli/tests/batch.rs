//! Many pictures in one call: folders, standard input, broken files among valid ones, other formats, and marks beside
//! their photo.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::support::{Folder, pendulum_twice, sdg, shipped, stdout, taught_pendulum};
use image::{ImageFormat, Rgb, RgbImage};
use serde_json::{Value, json};

/// Writes the pendulum's photo and marks, and a model S taught from them; returns the model's path.
fn taught(folder: &Folder) -> String {
    fs::copy(shipped("pendulum", "image.png"), folder.path("photo.png")).unwrap();
    fs::copy(shipped("pendulum", "annotation.json"), folder.path("photo.json")).unwrap();
    let model = folder.path("model.sdg");
    taught_pendulum(&model, None);
    model
}

fn photo() -> RgbImage {
    image::open(shipped("pendulum", "image.png")).unwrap().to_rgb8()
}

fn lines(output: &Output) -> Vec<Value> {
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn with_input(arguments: &[&str], input: &[u8]) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_sdg"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A command that rejects its arguments does not read standard input.
    let _ = child.stdin.take().unwrap().write_all(input);
    child.wait_with_output().unwrap()
}

#[test]
fn a_batch_goes_on_past_what_cannot_be_read() {
    let folder = Folder::new();
    let model = taught(&folder);
    let pictures = folder.path("pictures");
    let at = |name: &str| Path::new(&pictures).join(name);
    fs::create_dir(&pictures).unwrap();
    let whole = fs::read(shipped("pendulum", "image.png")).unwrap();
    fs::write(at("a-broken.png"), &whole[..whole.len() / 2]).unwrap();
    fs::write(at("b.heic"), b"\0\0\0\x18ftypheic\0\0\0\0mif1heic").unwrap();
    fs::write(at("notes.txt"), "not a picture").unwrap();
    for (name, format) in [("c.webp", ImageFormat::WebP), ("d.bmp", ImageFormat::Bmp), ("e.tif", ImageFormat::Tiff)] {
        photo().save_with_format(at(name), format).unwrap();
    }
    let missing = folder.path("missing.png");
    let output = sdg(&["detect", "--grasp-model", &model, "--json", &pictures, &missing]);
    assert_eq!(output.status.code(), Some(1));
    let lines = lines(&output);
    let name =
        |line: &Value| Path::new(line["image"].as_str().unwrap()).file_name().unwrap().to_str().unwrap().to_owned();
    let names: Vec<String> = lines.iter().map(name).collect();
    assert_eq!(names, ["a-broken.png", "b.heic", "c.webp", "d.bmp", "e.tif", "missing.png"]);
    for (line, part) in [(0, "a-broken.png"), (1, "Settings > Camera > Formats > Most Compatible"), (5, "No such file")]
    {
        let error = lines[line]["error"].as_str().unwrap();
        assert!(error.contains(part), "{error}");
    }
    for line in &lines[2..5] {
        assert_eq!(line["detections"].as_array().unwrap().len(), 1, "{line}");
        assert!((line["detections"][0]["size"].as_f64().unwrap() - 1.0).abs() < 0.02, "{line}");
        // Lossless, so that all three pictures are identical.
        assert_eq!(line["detections"], lines[2]["detections"]);
    }
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(stderr.contains("skipped files that are not pictures: notes.txt"), "{stderr}");
    assert!(stderr.contains("3 of 6 pictures could not be used"), "{stderr}");
    let summary = stderr.lines().find(|line| line.starts_with("found ")).expect("a summary");
    assert!(summary.ends_with(" of 3 pictures"), "{summary}");
}

#[test]
fn a_picture_comes_from_standard_input() {
    let folder = Folder::new();
    let model = taught(&folder);
    let whole = fs::read(shipped("pendulum", "image.png")).unwrap();
    let drawn = folder.path("drawn");
    let output = with_input(&["detect", "--grasp-model", &model, "--json", "--draw", &drawn, "-"], &whole);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let lines = lines(&output);
    assert_eq!((lines.len(), lines[0]["image"].as_str()), (1, Some("-")));
    assert!(Path::new(&drawn).join("stdin.png").exists());
    let broken = with_input(&["detect", "--grasp-model", &model, "-"], b"hello");
    assert_eq!(broken.status.code(), Some(1));
    let stderr = String::from_utf8(broken.stderr).unwrap();
    assert!(stderr.contains("standard input: not a readable image"), "{stderr}");
    let twice = with_input(&["detect", "--grasp-model", &model, "-", "-"], &whole);
    assert_eq!(twice.status.code(), Some(2));
}

#[test]
fn a_refusal_says_why_and_what_would_help() {
    let folder = Folder::new();
    let model = taught(&folder);
    // A sheet covers one half of the part's box.
    let mut covered = photo();
    let line = &lines(&sdg(&["detect", "--grasp-model", &model, "--json", &folder.path("photo.png")]))[0];
    let bounds: Vec<f64> =
        line["detections"][0]["box"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    let [left, top, right, bottom] = bounds[..] else { panic!("{bounds:?}") };
    let (wide, middle) = (right - left > bottom - top, [0.5 * (left + right), 0.5 * (top + bottom)]);
    for (x, y, pixel) in covered.enumerate_pixels_mut() {
        let is_half = if wide { f64::from(x) > middle[0] } else { f64::from(y) > middle[1] };
        if is_half && (left..right).contains(&f64::from(x)) && (top..bottom).contains(&f64::from(y)) {
            *pixel = Rgb([128, 126, 122]);
        }
    }
    let picture = folder.path("covered.png");
    covered.save(&picture).unwrap();
    let drawn = folder.path("drawn");
    let output = sdg(&["detect", "--grasp-model", &model, "--draw", &drawn, &picture]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(3), "{text}");
    assert!(text.contains(": nothing accepted; ") && text.contains(" refused, the best of them at ("), "{text}");
    assert!(text.contains("(see --all)") && text.contains("agreement 0."), "{text}");
    assert!(
        text.contains("a part of its outline is missing") && text.contains("; if it is the part, a second --demo"),
        "{text}"
    );
    assert!(!text.contains("network"), "model S has none: {text}");
    // Red dots are at the covered edges.
    let drawn = image::open(Path::new(&drawn).join("covered.png")).unwrap().to_rgb8();
    let dots = drawn.enumerate_pixels().filter(|(_, _, pixel)| pixel.0 == [255, 40, 60]);
    let on_sheet = dots.filter(|(x, y, _)| covered.get_pixel(*x, *y).0 == [128, 126, 122]).count();
    assert!(on_sheet > 50, "{on_sheet} dots on the sheet");

    // A user may set another minimum score.
    let json = |min_score: &str| {
        let output = sdg(&["detect", "--grasp-model", &model, "--json", "--min-score", min_score, &picture]);
        let line = lines(&output).remove(0);
        (output.status.code(), line["detections"].as_array().unwrap().len(), line["num_refused"].as_u64())
    };
    let (low, default) = (json("0.02"), json("0.5"));
    assert_eq!((low.0, low.1, default.0, default.1), (Some(0), 1, Some(3), 0));
    assert_eq!(default.2, low.2.map(|refused| refused + 1));
}

#[test]
fn a_photo_without_marks_names_what_was_looked_for() {
    let folder = Folder::new();
    fs::copy(shipped("pendulum", "image.png"), folder.path("photo.png")).unwrap();
    let output = sdg(&["teach", "--demo", &folder.path("photo.png"), "--out", &folder.path("model.sdg")]);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    for part in ["photo.coco.json", "photo.json", "photo.txt", "COCO or LabelMe", "YOLO-pose", "sdg annotate"] {
        assert!(stderr.contains(part), "expected \"{part}\" in: {stderr}");
    }
    assert!(!Path::new(&folder.path("model.sdg")).exists());
}

#[test]
fn exit_codes_stand_in_help_and_manual_pages() {
    for arguments in
        [&["--help"][..], &["detect", "--help"], &["evaluate", "--help"], &["weights", "convert", "-h"], &["man"]]
    {
        let text = stdout(arguments).replace("\\-", "-");
        assert!(text.contains("2 wrong usage, 3 found nothing, 4 poor model"), "{arguments:?}: {text}");
    }
    let text = stdout(&["evaluate", "--help"]);
    assert!(text.contains("Labelled pictures (--pictures DIR)"), "{text}");
}

#[test]
fn the_figures_of_a_teaching_are_those_of_an_evaluation_on_the_same_samples() {
    let folder = Folder::new();
    fs::copy(shipped("pendulum", "image.png"), folder.path("photo.png")).unwrap();
    fs::copy(shipped("pendulum", "annotation.json"), folder.path("photo.json")).unwrap();
    let (photo, model, samples) = (folder.path("photo.png"), folder.path("model.sdg"), folder.path("samples"));
    let json = |arguments: &[&str]| -> Value { serde_json::from_str(&stdout(arguments)).unwrap() };
    let taught =
        json(&["teach", "--model", "S", "--demo", &photo, "--seed", "5", "--out", &model, "--json"])["held_back"]
            .clone();
    let count = taught["samples"].to_string();
    stdout(&["augment", "--held-back", "--demo", &photo, "--seed", "5", "--count", &count, "--out", &samples]);
    let report = folder.path("report");
    let evaluated = json(&["evaluate", "--pictures", &samples, "--grasp-model", &model, "--report", &report, "--json"]);
    let [low, high] = [0, 1].map(|end| taught["found_interval"][end].as_f64().unwrap());
    let (found, of) = (taught["found"]["count"].as_f64().unwrap(), taught["found"]["of"].as_f64().unwrap());
    assert!(of >= 20.0 && low < found / of && found / of <= high, "{taught}");
    assert_eq!(evaluated["found"], taught["found"]["count"]);
    assert_eq!(evaluated["parts"], taught["found"]["of"]);
    assert_eq!(evaluated["wrong"], taught["wrong"]);
    assert_eq!(evaluated["false_alarms"], taught["false_alarms"]["count"]);
    assert_eq!(evaluated["pictures_without_part"], taught["false_alarms"]["of"]);
    // Labels in a file are rounded decimal numbers, so the errors differ slightly.
    let errors = taught["errors"].as_object().unwrap();
    assert_eq!(errors.len(), evaluated["errors"].as_object().unwrap().len());
    for (name, error) in errors {
        let [of_teaching, of_evaluation] = [error, &evaluated["errors"][name]].map(|error| error.as_f64().unwrap());
        assert!((of_teaching - of_evaluation).abs() < 1e-9, "{name}: {of_teaching} {of_evaluation}");
    }
}

#[test]
fn another_of_the_part_in_the_photo_does_not_count_as_wrong() {
    let folder = Folder::new();
    let photo = photo();
    let (width, height) = photo.dimensions();
    let twice = RgbImage::from_fn(2 * width, height, |x, y| *photo.get_pixel(x % width, y));
    twice.save(folder.path("photo.png")).unwrap();
    let mut marks: Value = serde_json::from_slice(&fs::read(shipped("pendulum", "annotation.json")).unwrap()).unwrap();
    marks["imageWidth"] = (2 * width).into();
    fs::write(folder.path("photo.json"), marks.to_string()).unwrap();
    let (photo, model) = (folder.path("photo.png"), folder.path("model.sdg"));
    let taught = stdout(&["teach", "--model", "S", "--demo", &photo, "--seed", "5", "--out", &model, "--json"]);
    let held_back = &serde_json::from_str::<Value>(&taught).unwrap()["held_back"];
    assert_eq!(held_back["others_in_photo"], 1, "{held_back}");
    // If the samples' backgrounds contained the other part, every sample would have a wrong detection.
    assert!(held_back["wrong"].as_u64().unwrap() <= 2, "{held_back}");
}

#[test]
fn a_second_photo_whose_grasp_has_its_ends_swapped_causes_a_warning() {
    let folder = Folder::new();
    let mut darker = photo();
    darker.iter_mut().for_each(|value| *value /= 2);
    darker.save(folder.path("second.png")).unwrap();
    let marks = fs::read_to_string(shipped("pendulum", "annotation.json")).unwrap();
    let swapped = marks.replace("grasp_start", "?").replace("grasp_end", "grasp_start").replace('?', "grasp_end");
    let (second, model) = (folder.path("second.png"), folder.path("model.sdg"));
    let first =
        format!("{}:{}", shipped("pendulum", "image.png").display(), shipped("pendulum", "annotation.json").display());
    for (marks, turned) in [(&marks, json!([])), (&swapped, json!([2]))] {
        fs::write(folder.path("second.json"), marks.replace("image.png", "second.png")).unwrap();
        let teach = ["teach", "--model", "S", "--demo", &first, "--demo", &second, "--out", &model, "--json"];
        let done = sdg(&teach);
        let taught: Value = serde_json::from_slice(&done.stdout).unwrap();
        assert_eq!(taught["held_back"]["turned_photos"], turned, "{taught}");
        let warning = String::from_utf8(done.stderr).unwrap();
        assert_eq!(
            warning.contains("the grasp in photo 2 is turned by 180° against that in photo 1"),
            turned == json!([2]),
            "{warning}"
        );
    }
}

#[test]
fn a_monochrome_cameras_picture_shows_the_coloured_part() {
    let folder = Folder::new();
    let (model, gray) = (taught(&folder), folder.path("gray.jpg"));
    image::open(shipped("pendulum", "image.png")).unwrap().to_luma8().save(&gray).unwrap();
    let printed = stdout(&["detect", "--grasp-model", &model, "--json", &gray]);
    let printed: Value = serde_json::from_str(&printed).unwrap();
    let score = printed["detections"][0]["score"].as_f64();
    assert!(score >= Some(0.9), "{printed}");
}

#[test]
fn jaws_that_would_touch_a_neighbour_are_told() {
    let folder = Folder::new();
    let model = taught(&folder);
    let (near, far) = (folder.path("near.png"), folder.path("far.png"));
    // A jaw of the first grasp would touch the neighbour's ring; the other neighbour is too far away.
    pendulum_twice([59, -6]).save(&near).unwrap();
    pendulum_twice([-200, 100]).save(&far).unwrap();
    let printed = stdout(&["detect", "--grasp-model", &model, "--json", &near, &far]);
    let pictures: Vec<Value> = printed.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let detections = |line: &Value| line["detections"].as_array().unwrap().clone();
    let (near_ones, far_ones) = (detections(&pictures[0]), detections(&pictures[1]));
    assert_eq!([near_ones.len(), far_ones.len()], [2, 2], "{printed}");
    let first = near_ones.iter().position(|one| one["grasp"]["x"].as_f64().unwrap() < 350.0).unwrap();
    assert_eq!(near_ones[first]["jaws_touch"], serde_json::json!([1 - first]), "{printed}");
    assert!(far_ones.iter().all(|one| one.get("jaws_touch").is_none()), "{printed}");

    let words = stdout(&["detect", "--grasp-model", &model, &near, &far]);
    let told = words.lines().filter(|line| line.contains("warning: the jaws would touch the part at ("));
    assert!(told.clone().count() >= 1 && told.clone().all(|line| line.contains("near.png")), "{words}");
    // A refused detection does not count as a neighbour.
    let alone = sdg(&["detect", "--grasp-model", &model, "--all", "--min-score", "1", "--json", &near]);
    let alone = lines(&alone);
    let listed = alone[0]["detections"].as_array().unwrap();
    assert!(listed.len() >= 2 && listed.iter().all(|one| one.get("jaws_touch").is_none()), "{alone:?}");
}
