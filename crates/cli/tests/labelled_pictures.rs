//! `sdg evaluate --pictures`: counts in both formats, compared with a naive reference; and wrong folders.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::{sdg, shipped, stdout, taught_pendulum};
use serde_json::{Value, json};

/// Number of samples, enough that some lack the part and some show it partly outside the picture.
const NUM_SAMPLES: usize = 20;

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Model S of the shipped pendulum.
fn teach(folder: &Path) -> PathBuf {
    let model = folder.join("model.sdg");
    taught_pendulum(&model, None);
    model
}

fn read_json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn evaluate(pictures: &Path, model: &Path, report: &Path, more: &[&str]) -> Value {
    let mut arguments = vec!["evaluate", "--pictures", text(pictures), "--grasp-model", text(model)];
    arguments.extend(["--report", text(report), "--json"]);
    arguments.extend(more);
    serde_json::from_str(&stdout(&arguments)).unwrap()
}

/// An instance of the pendulum: centre of its marks in pixels, their direction in degrees, their length, and whether it
/// is optional.
struct Marked {
    x: f64,
    y: f64,
    angle_deg: f64,
    length: f64,
    optional: bool,
}

fn marked(annotation: &Value) -> Marked {
    let k: Vec<f64> = annotation["keypoints"].as_array().unwrap().iter().map(|k| k.as_f64().unwrap()).collect();
    let (dx, dy) = (k[3] - k[0], k[4] - k[1]);
    Marked {
        x: (k[0] + k[3]) / 2.0,
        y: (k[1] + k[4]) / 2.0,
        angle_deg: dy.atan2(dx).to_degrees(),
        length: dx.hypot(dy),
        optional: annotation["attributes"]["optional"] == json!(true),
    }
}

/// Numbers of parts, of found parts, of wrong detections, of pictures without the part, and of false alarms. An
/// independent implementation counts them from the output of `sdg detect` and the marks in the file. Samples show at
/// most one part, so the first hit decides.
fn counted_naively(samples: &Path, model: &Path) -> [usize; 5] {
    let file = read_json(&samples.join("annotations.json"));
    let demonstration = read_json(&shipped("pendulum", "annotation.json"));
    let points = |kind: &str| {
        let shapes = demonstration["shapes"].as_array().unwrap();
        let points = &shapes.iter().find(|s| s["shape_type"] == kind || s["label"] == kind).unwrap()["points"];
        points.as_array().unwrap().iter().map(|p| [p[0].as_f64().unwrap(), p[1].as_f64().unwrap()]).collect::<Vec<_>>()
    };
    let distance = |[ax, ay]: [f64; 2], [bx, by]: [f64; 2]| (ax - bx).hypot(ay - by);
    let corners = points("rectangle");
    let diagonal_per_length =
        distance(corners[0], corners[1]) / distance(points("grasp_start")[0], points("grasp_end")[0]);
    let [mut parts, mut found, mut wrong, mut negatives, mut false_alarms] = [0; 5];
    for image in file["images"].as_array().unwrap() {
        let picture = samples.join(image["file_name"].as_str().unwrap());
        // Exit code 3, nothing to grasp, is a valid answer as well.
        let printed = sdg(&["detect", "--grasp-model", text(model), "--json", text(&picture)]).stdout;
        let printed: Value = serde_json::from_slice(&printed).unwrap();
        let detections = printed["detections"].as_array().unwrap();
        let here = file["annotations"].as_array().unwrap().iter().find(|a| a["image_id"] == image["id"]);
        let Some(truth) = here.map(marked) else {
            negatives += 1;
            false_alarms += usize::from(!detections.is_empty());
            continue;
        };
        parts += usize::from(!truth.optional);
        let mut is_free = true;
        for detection in detections {
            let grasp = |name: &str| detection["grasp"][name].as_f64().unwrap();
            let distance = (grasp("x") - truth.x).hypot(grasp("y") - truth.y);
            let turn = ((grasp("angle_deg") - truth.angle_deg + 180.0).rem_euclid(360.0) - 180.0).abs();
            let is_hit = is_free && distance <= 0.04 * diagonal_per_length * truth.length && turn <= 10.0;
            match (is_hit, truth.optional) {
                (true, _) => {
                    found += usize::from(!truth.optional);
                    is_free = false;
                }
                // For an optional instance, the overlap of the boxes is sufficient.
                (false, true) if is_free && iou(detection, here.unwrap()) >= 0.5 => is_free = false,
                (false, _) => wrong += 1,
            }
        }
    }
    [parts, found, wrong, negatives, false_alarms]
}

/// Intersection over union of a detection's box (corners) and a marked one (x, y, width, height).
fn iou(detection: &Value, annotation: &Value) -> f64 {
    let number = |list: &Value, at: usize| list[at].as_f64().unwrap();
    let (found, marked) = (&detection["box"], &annotation["bbox"]);
    let overlap = |axis: usize| {
        let (from, to) = (number(marked, axis), number(marked, axis) + number(marked, axis + 2));
        (number(found, axis + 2).min(to) - number(found, axis).max(from)).max(0.0)
    };
    let inside = overlap(0) * overlap(1);
    let extent = |axis: usize| number(found, axis + 2) - number(found, axis);
    inside / (extent(0) * extent(1) + number(marked, 2) * number(marked, 3) - inside)
}

fn counts(evaluated: &Value) -> [usize; 5] {
    ["parts", "found", "wrong", "pictures_without_part", "false_alarms"]
        .map(|name| evaluated[name].as_u64().unwrap() as usize)
}

/// Writes the samples' marks as LabelMe: one file beside each picture.
fn write_labelme(samples: &Path, folder: &Path) {
    fs::create_dir(folder).unwrap();
    let file = read_json(&samples.join("annotations.json"));
    for image in file["images"].as_array().unwrap() {
        let name = image["file_name"].as_str().unwrap();
        fs::copy(samples.join(name), folder.join(name)).unwrap();
        let here = file["annotations"].as_array().unwrap().iter().filter(|a| a["image_id"] == image["id"]);
        let shapes: Vec<Value> = here
            .flat_map(|annotation| {
                let [x, y, width, height] = [0, 1, 2, 3].map(|i| annotation["bbox"][i].as_f64().unwrap());
                let flags = json!({"optional": annotation["attributes"]["optional"] == json!(true)});
                let point = |label: &str, at: usize| {
                    let points = [[&annotation["keypoints"][at], &annotation["keypoints"][at + 1]]];
                    json!({"label": label, "shape_type": "point", "points": points, "group_id": 1})
                };
                let corners = [[x, y], [x + width, y + height]];
                let rectangle = json!({"label": "pendulum", "shape_type": "rectangle", "points": corners,
                                       "group_id": 1, "flags": flags});
                let is_marked = annotation["keypoints"][2] != json!(0);
                let points = is_marked.then(|| [point("grasp_start", 0), point("grasp_end", 3)]);
                std::iter::once(rectangle).chain(points.into_iter().flatten())
            })
            .collect();
        let labels = json!({"imagePath": name, "imageWidth": image["width"], "imageHeight": image["height"],
                            "shapes": shapes});
        fs::write(folder.join(name).with_extension("json"), labels.to_string()).unwrap();
    }
}

#[test]
fn what_augment_writes_is_counted_as_a_naive_reference_does() {
    let folder = tempfile::tempdir().unwrap();
    let (samples, report) = (folder.path().join("samples"), folder.path().join("report"));
    let model = teach(folder.path());
    let demonstration =
        format!("{}:{}", text(&shipped("pendulum", "image.png")), text(&shipped("pendulum", "annotation.json")));
    let num_samples = NUM_SAMPLES.to_string();
    stdout(&["augment", "--demo", &demonstration, "--count", &num_samples, "--out", text(&samples)]);

    let evaluated = evaluate(&samples, &model, &report, &[]);
    let expected = counted_naively(&samples, &model);
    assert_eq!(counts(&evaluated), expected);
    let [parts, found, _, negatives, _] = expected;
    // With smaller numbers, the comparison would test nothing.
    assert!(found > 0 && negatives > 0 && parts > found / 2, "{expected:?}");
    assert_eq!(evaluated["pictures"].as_array().unwrap().len(), NUM_SAMPLES);
    assert_eq!(evaluated["missed"], json!(parts - found));
    let html = fs::read_to_string(report.join("index.html")).unwrap();
    assert!(html.contains("000019.png") && html.contains("<svg"), "every picture and a chart are on the page");

    // At 0.5 the sweep equals the totals; at 0 at least as many parts are found.
    let at = |min_score: f64| {
        let swept = evaluated["by_min_score"].as_array().unwrap();
        swept.iter().find(|at| at["min_score"] == json!(min_score)).unwrap()
    };
    assert_eq!(at(0.5)["found"], evaluated["found"]);
    assert_eq!(at(0.5)["false_alarms"], evaluated["false_alarms"]);
    assert!(at(0.0)["found"].as_u64() >= at(0.5)["found"].as_u64());

    // The samples' marks as LabelMe, with the photo from which the model was taught and another program's JSON in
    // the folder.
    let labelme = folder.path().join("labelme");
    write_labelme(&samples, &labelme);
    fs::copy(shipped("pendulum", "image.png"), labelme.join("photo.png")).unwrap();
    fs::copy(shipped("pendulum", "annotation.json"), labelme.join("photo.json")).unwrap();
    fs::write(labelme.join("poses.json"), "[1, 2]").unwrap();
    fs::copy(samples.join("000000.png"), labelme.join("unlabelled.png")).unwrap();
    // Model S has no network that could decide alone.
    let again = evaluate(&labelme, &model, &report, &["--min-score", "0.5", "--no-verify"]);
    assert_eq!(again["verified"], true);
    assert_eq!(counts(&again), expected);
    assert_eq!(again["optional"], evaluated["optional"]);
    let left_out: Vec<&str> =
        again["left_out"].as_array().unwrap().iter().map(|left_out| left_out["file"].as_str().unwrap()).collect();
    assert_eq!(left_out, ["photo.png", "poses.json", "unlabelled.png"]);
    assert_eq!(again["left_out"][0]["why"], "the model was taught from it");
}

/// A folder with one picture of 640×480 and a label file.
struct Case {
    folder: tempfile::TempDir,
}

impl Case {
    fn new(name: &str, labels: &str) -> Self {
        let case = Self { folder: tempfile::tempdir().unwrap() };
        // The shipped photo with one changed row of pixels, so the model was not taught from this picture.
        let mut picture = image::open(shipped("pendulum", "image.png")).unwrap().into_rgb8();
        let [width, height] = [picture.width(), picture.height()];
        for x in 0..width {
            picture.put_pixel(x, height / 2, image::Rgb([0, 0, 0]));
        }
        picture.save(case.folder.path().join("a.png")).unwrap();
        case.with(name, labels)
    }

    fn with(self, name: &str, content: &str) -> Self {
        fs::write(self.folder.path().join(name), content).unwrap();
        self
    }

    fn without(self, name: &str) -> Self {
        fs::remove_file(self.folder.path().join(name)).unwrap();
        self
    }

    /// Asserts exit code 1, one line with every part, and no page.
    fn assert_refused(&self, model: &Path, more: &[&str], parts: &[&str]) {
        let report = self.folder.path().join("report");
        let mut arguments = vec!["evaluate", "--pictures", text(self.folder.path()), "--grasp-model", text(model)];
        arguments.extend(["--report", text(&report)]);
        arguments.extend(more);
        let output = sdg(&arguments);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{parts:?}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        for part in parts {
            assert!(stderr.contains(part), "expected \"{part}\" in: {stderr}");
        }
        assert!(!report.exists());
    }
}

fn labelme(shapes: &[Value]) -> String {
    json!({"imagePath": "a.png", "imageWidth": 640, "imageHeight": 480, "shapes": shapes}).to_string()
}

fn instance(label: &str, group: u32, x: f64) -> Vec<Value> {
    vec![
        json!({"label": label, "shape_type": "rectangle", "points": [[x, 10], [x + 60.0, 40]], "group_id": group}),
        json!({"label": "grasp_start", "shape_type": "point", "points": [[x + 5.0, 20]], "group_id": group}),
        json!({"label": "grasp_end", "shape_type": "point", "points": [[x + 50.0, 20]], "group_id": group}),
    ]
}

/// Writes the shipped photo rotated by multiples of 90°, with its marks as LabelMe; the grasp is shifted along its
/// direction by a fraction of its length.
fn write_turned(folder: &Path, name: &str, quarters: u32, along: f64) {
    let demonstration = read_json(&shipped("pendulum", "annotation.json"));
    let mut photo = image::open(shipped("pendulum", "image.png")).unwrap().into_rgb8();
    let points = |kind: &str| {
        let shapes = demonstration["shapes"].as_array().unwrap();
        let points = &shapes.iter().find(|s| s["shape_type"] == kind || s["label"] == kind).unwrap()["points"];
        points.as_array().unwrap().iter().map(|p| [p[0].as_f64().unwrap(), p[1].as_f64().unwrap()]).collect::<Vec<_>>()
    };
    let (mut corners, mut line) = (points("rectangle"), [points("grasp_start")[0], points("grasp_end")[0]]);
    let by = [0, 1].map(|axis| along * (line[1][axis] - line[0][axis]));
    for point in &mut line {
        *point = [point[0] + by[0], point[1] + by[1]];
    }
    for _ in 0..quarters {
        let height = f64::from(photo.height());
        for point in corners.iter_mut().chain(&mut line) {
            *point = [height - point[1], point[0]];
        }
        photo = image::imageops::rotate90(&photo);
    }
    let shapes = [
        json!({"label": "pendulum", "shape_type": "rectangle", "points": corners, "group_id": 1}),
        json!({"label": "grasp_start", "shape_type": "point", "points": [line[0]], "group_id": 1}),
        json!({"label": "grasp_end", "shape_type": "point", "points": [line[1]], "group_id": 1}),
    ];
    let labels = json!({"imageWidth": photo.width(), "imageHeight": photo.height(), "shapes": shapes});
    fs::write(folder.join(name).with_extension("json"), labels.to_string()).unwrap();
    photo.save(folder.join(name)).unwrap();
}

#[test]
fn labels_of_another_grasp_and_a_copy_of_the_taught_photo_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let model = teach(folder.path());
    let pictures = folder.path().join("pictures");
    fs::create_dir(&pictures).unwrap();
    // The photo from which the model was taught is recognised even if it is saved as JPEG under another name.
    write_turned(&pictures, "copy.jpg", 0, 0.0);
    for quarters in 1..4 {
        write_turned(&pictures, &format!("turned-{quarters}.png"), quarters, 0.8);
    }
    let told = evaluate(&pictures, &model, &folder.path().join("report"), &[]);
    assert_eq!(told["left_out"][0], json!({"file": "copy.jpg", "why": "the model was taught from it"}));
    assert_eq!((&told["parts"], &told["found"], &told["wrong"]), (&json!(3), &json!(0), &json!(3)));
    let offset = &told["label_offset"];
    assert_eq!((&offset["agreeing"]["count"], &offset["totals"]["found"]["count"]), (&json!(3), &json!(3)), "{offset}");
    let page = fs::read_to_string(told["report"].as_str().unwrap()).unwrap();
    assert!(page.contains("The labels mark a different grasp"));

    // Labels of the taught grasp have no offset.
    for quarters in 1..4 {
        write_turned(&pictures, &format!("turned-{quarters}.png"), quarters, 0.0);
    }
    let evaluated = evaluate(&pictures, &model, &folder.path().join("report"), &[]);
    assert_eq!((&evaluated["found"], &evaluated["label_offset"]), (&json!(3), &Value::Null));
}

#[test]
fn the_file_of_sdg_annotate_is_preferred_to_that_of_another_tool() {
    let folder = tempfile::tempdir().unwrap();
    let model = teach(folder.path());
    let pictures = folder.path().join("pictures");
    fs::create_dir(&pictures).unwrap();
    write_turned(&pictures, "a.png", 1, 0.0);
    let ours = json!({"images": [{"id": 1, "file_name": "a.png"}], "annotations": []});
    fs::write(pictures.join("a.coco.json"), ours.to_string()).unwrap();
    let told = evaluate(&pictures, &model, &folder.path().join("report"), &[]);
    assert_eq!(told["left_out"], json!([{"file": "a.json", "why": "a.coco.json is used for a.png"}]));
    assert_eq!(told["parts"], 0);
    // A renamed picture; the file still names the picture as it was.
    for ending in ["png", "json", "coco.json"] {
        fs::rename(pictures.join(format!("a.{ending}")), pictures.join(format!("b.{ending}"))).unwrap();
    }
    let told = evaluate(&pictures, &model, &folder.path().join("report"), &[]);
    assert_eq!(told["left_out"], json!([{"file": "b.json", "why": "b.coco.json is used for b.png"}]));
    assert_eq!(told["parts"], 0);
}

#[test]
fn wrong_folders_are_refused_with_what_was_expected() {
    let teaching = tempfile::tempdir().unwrap();
    let model = teach(teaching.path());
    let empty = labelme(&[]);
    let coco = |images: Value| json!({"images": images, "annotations": []}).to_string();
    let refused = |case: Case, parts: &[&str]| case.assert_refused(&model, &[], parts);

    refused(Case::new("notes.txt", ""), &["expected labels", "found 1 pictures and none"]);
    refused(Case::new("a.json", &empty).without("a.png"), &["expected pictures (png, jpg", "found none"]);
    refused(Case::new("a.json", "{\"shapes\": ["), &["a.json", "not JSON", "line 1"]);
    refused(Case::new("labels.json", "{\"images\": [}"), &["labels.json", "not JSON"]);
    refused(Case::new("a.json", "[1, 2]"), &["a.json", "expected COCO JSON"]);
    let other = json!({"imagePath": "a.png", "imageWidth": 320, "imageHeight": 240, "shapes": []}).to_string();
    refused(Case::new("a.json", &other), &["a.json", "320×240", "640×480"]);
    let other = coco(json!([{"id": 1, "file_name": "a.png", "width": 640, "height": 360}]));
    refused(Case::new("annotations.json", &other), &["annotations.json", "a.png", "640×360", "640×480"]);
    refused(Case::new("b.json", &empty.replace("a.png", "b.png")), &["b.json", "the picture b.png", "no such file"]);
    let two = coco(json!([{"id": 1, "file_name": "a.png"}, {"id": 2, "file_name": "x/gone.png"}]));
    refused(Case::new("annotations.json", &two), &["annotations.json", "the picture gone.png", "no such file"]);
    let one = coco(json!([{"id": 1, "file_name": "a.png"}]));
    refused(Case::new("annotations.json", &one).with("a.json", &empty), &["a.png", "found two", "a.json"]);

    let mut outside = instance("pendulum", 1, 100.0);
    outside[2]["points"] = json!([[700, 20]]);
    refused(Case::new("a.json", &labelme(&outside)), &["a.json", "shapes[2]", "inside the image", "(700, 20)"]);
    let rectangle = &instance("pendulum", 1, 100.0)[..1];
    refused(Case::new("a.json", &labelme(rectangle)), &["a.json, shapes[0]", "lacks the grasp", "grasp_start"]);
    let both = [instance("bolt", 1, 100.0), instance("nut", 2, 300.0)].concat();
    refused(Case::new("a.json", &labelme(&both)), &["the label pendulum", "found bolt, nut", "--label"]);
    Case::new("a.json", &labelme(&both)).assert_refused(
        &model,
        &["--label", "screw"],
        &["labelled screw", "bolt, nut"],
    );
    let photo =
        Case::new("photo.json", &fs::read_to_string(shipped("pendulum", "annotation.json")).unwrap()).without("a.png");
    fs::copy(shipped("pendulum", "image.png"), photo.folder.path().join("photo.png")).unwrap();
    refused(photo, &["not taught from", "found only photo.png"]);

    let picture = Case::new("a.json", &empty);
    picture.assert_refused(&shipped("pendulum", "image.png"), &[], &["expected a grasp model", "a PNG image"]);
    picture.assert_refused(Path::new("/nowhere/model.sdg"), &[], &["/nowhere/model.sdg", "cannot read"]);
}

#[test]
fn a_folder_or_a_model_alone_and_options_of_the_protocol_are_wrong_usage() {
    for arguments in [
        &["evaluate", "--pictures", "d"][..],
        &["evaluate", "--grasp-model", "m.sdg"],
        &["evaluate", "--pictures", "d", "--grasp-model", "m.sdg", "--models", "S"],
        &["evaluate", "--pictures", "d", "--grasp-model", "m.sdg", "--min-score", "2"],
    ] {
        assert_eq!(sdg(arguments).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn labels_of_another_part_are_told_and_can_be_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let (model, report) = (teach(folder.path()), folder.path().join("report"));
    let case = Case::new("a.json", &labelme(&instance("bolt", 1, 100.0)));
    let pictures = case.folder.path();
    // Another picture than the photo from which the model was taught.
    image::open(pictures.join("a.png")).unwrap().rotate180().save(pictures.join("a.png")).unwrap();
    let arguments = ["--pictures", text(pictures), "--grasp-model", text(&model), "--report", text(&report)];
    let evaluated = sdg(&[&["evaluate", "--json"][..], &arguments].concat());
    let stderr = String::from_utf8(evaluated.stderr).unwrap();
    assert!(stderr.contains("all labels are `bolt`, the model's part is `pendulum`"), "{stderr}");
    let counted: Value = serde_json::from_slice(&evaluated.stdout).unwrap();
    assert_eq!(counted["foreign_label"], json!("bolt"));
    let told = evaluate(pictures, &model, &report, &["--label", "pendulum"]);
    assert_eq!((&told["pictures_without_part"], &told["other_labels"]), (&json!(1), &json!(1)));
    assert_eq!(told["foreign_label"], json!(null));
}
