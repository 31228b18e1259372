//! `--region`: `sdg teach` and `sdg detect` search only a part of pictures.

use std::fs;

use serde_json::{Value, json};

use crate::support::{Folder, sdg, shipped, stdout, taught_pendulum};

const CAMERA: &str = include_str!("wrist.yaml");
/// The pendulum is near (325, 225) on its photo of 640 × 480 pixels.
const ON_IT: &str = "220,140,200,200";
const BESIDE_IT: &str = "10,10,200,200";

fn photo() -> String {
    shipped("pendulum", "image.png").display().to_string()
}

fn lines(arguments: &[&str]) -> Vec<Value> {
    let output = sdg(arguments);
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn detect(model: &str, further: &[&str]) -> Value {
    lines(&[&["detect", "--grasp-model", model, "--json", "--all"], further].concat()).remove(0)
}

fn refusal(arguments: &[&str]) -> (Option<i32>, String) {
    let output = sdg(arguments);
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

#[test]
fn only_the_region_is_searched_and_places_are_those_of_the_picture() {
    let folder = Folder::new();
    let model = folder.path("model.sdg");
    taught_pendulum(&model, None);
    let whole = detect(&model, &[&photo()]);
    assert!(whole.get("region").is_none());
    let inside = detect(&model, &["--region", ON_IT, &photo()]);
    assert_eq!(inside["region"], json!({"x": 220, "y": 140, "width": 200, "height": 200}));
    let [whole_best, best] = [&whole, &inside].map(|line| &line["detections"][0]);
    for (place, most) in [("x", 0.3), ("y", 0.3), ("angle_deg", 0.5), ("width_px", 0.5)] {
        let apart = whole_best["grasp"][place].as_f64().unwrap() - best["grasp"][place].as_f64().unwrap();
        assert!(apart.abs() < most, "{place}: {apart}");
    }
    let drawn = folder.path("drawn");
    let beside = ["detect", "--grasp-model", &model, "--region", BESIDE_IT, "--draw", &drawn, &photo()];
    let output = sdg(&beside);
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(told.contains("nothing") && told.contains("in 200 × 200 pixels from (10, 10)"), "{told}");
    assert_eq!(output.status.code(), Some(3));
    // The border of the region is drawn.
    let drawn = image::open(folder.path("drawn/image.png")).unwrap().into_rgb8();
    let original = image::open(photo()).unwrap().into_rgb8();
    let changed = |x: u32| (10..210).filter(|&y| drawn.get_pixel(x, y) != original.get_pixel(x, y)).count();
    assert!(changed(10) > 100 && changed(110) < 20, "{} {}", changed(10), changed(110));
}

#[test]
fn a_model_keeps_its_region_and_detect_overrides_it() {
    let folder = Folder::new();
    let (model, copy) = (folder.path("model.sdg"), folder.path("photo.png"));
    fs::copy(photo(), &copy).unwrap();
    let demo = format!("{copy}:{}", shipped("pendulum", "annotation.json").display());
    let told = stdout(&["teach", "--model", "S", "--demo", &demo, "--region", BESIDE_IT, "--out", &model]);
    assert!(told.contains("searches 200 × 200 pixels from (10, 10)"), "{told}");
    let found = detect(&model, &[&copy]);
    assert_eq!((&found["region"]["x"], found["detections"].as_array().unwrap().len()), (&json!(10), 0));
    let all = detect(&model, &["--region", "all", &copy]);
    let other = detect(&model, &["--region", ON_IT, &copy]);
    for line in [&all, &other] {
        assert!(line["detections"][0]["score"].as_f64().unwrap() > 0.5, "{line}");
    }
    assert!(all.get("region").is_none());
    // The region does not apply to pictures of another size.
    let smaller = folder.path("smaller.png");
    let picture = image::open(&copy).unwrap();
    picture.resize(600, 450, image::imageops::FilterType::Triangle).save(&smaller).unwrap();
    let (code, error) = refusal(&["detect", "--grasp-model", &model, &smaller]);
    assert_eq!(code, Some(1));
    for part in ["expected a picture of 640 × 480 pixels", "found 600 × 450", "--region all"] {
        assert!(error.contains(part), "{part} in {error}");
    }
    // Of two pictures, the valid one is still searched.
    let both = lines(&["detect", "--grasp-model", &model, "--json", &smaller, &copy]);
    assert!(both[0]["error"].is_string() && both[1]["detections"].is_array());
}

#[test]
fn frames_that_are_followed_are_searched_in_the_region_alone() {
    let folder = Folder::new();
    let (model, table) = (folder.path("model.sdg"), folder.path("table"));
    taught_pendulum(&model, None);
    fs::create_dir(&table).unwrap();
    for number in 0..3 {
        fs::copy(photo(), format!("{table}/{number}.png")).unwrap();
    }
    let from = format!("dir:{table}");
    for (region, num_parts) in [(ON_IT, 1), (BESIDE_IT, 0)] {
        let frames = lines(&["detect", "--grasp-model", &model, "--json", "--from", &from, "--region", region]);
        assert_eq!(frames.len(), 3);
        for frame in frames {
            assert_eq!(frame["region"]["width"], 200);
            assert_eq!(frame["detections"].as_array().unwrap().len(), num_parts, "{region}: {frame}");
        }
    }
}

#[test]
fn with_a_camera_the_region_is_one_of_its_pictures() {
    let folder = Folder::new();
    let (model, camera) = (folder.path("model.sdg"), folder.text("wrist.yaml", CAMERA));
    taught_pendulum(&model, Some(camera.as_ref()));
    let whole = detect(&model, &["--camera", &camera, &photo()]);
    let inside = detect(&model, &["--camera", &camera, "--region", ON_IT, &photo()]);
    let [whole, inside] = [&whole, &inside].map(|line| line["detections"][0]["pose"].clone());
    for k in 0..3 {
        let apart = whole["p_m"][k].as_f64().unwrap() - inside["p_m"][k].as_f64().unwrap();
        assert!(apart.abs() < 3e-4, "{k}: {apart} m");
    }
    let beside = detect(&model, &["--camera", &camera, "--region", BESIDE_IT, &photo()]);
    assert_eq!(beside["detections"], json!([]));
    let outside =
        refusal(&["detect", "--grasp-model", &model, "--camera", &camera, "--region", "600,0,100,100", &photo()]);
    assert!(outside.1.contains("--region: expected a region within the picture of 640 × 480"), "{}", outside.1);
    // The region is also stored if the model is taught with a camera.
    let again = folder.path("again.sdg");
    let demo = format!("{}:{}", photo(), shipped("pendulum", "annotation.json").display());
    let teach = |region: &str| {
        let heights = ["--camera", &camera, "--mark-height-mm", "16"];
        sdg(&[&["teach", "--model", "S", "--demo", &demo, "--region", region, "--out", &again], &heights[..]].concat())
    };
    assert!(teach(ON_IT).status.success());
    assert_eq!(detect(&again, &["--camera", &camera, &photo()])["region"]["y"], 140);
    // A camera with pictures of another size, which the model's region does not fit: another region replaces it.
    let smaller = CAMERA.replace("width: 640", "width: 600").replace("height: 480", "height: 450");
    let (smaller, cut) = (folder.text("smaller.yaml", &smaller), folder.path("cut.png"));
    image::open(photo()).unwrap().crop_imm(0, 0, 600, 450).save(&cut).unwrap();
    let arguments = ["detect", "--grasp-model", &again, "--camera", &smaller, &cut];
    let error = refusal(&arguments).1;
    assert!(error.contains("expected a picture of 640 × 480 pixels"), "{error}");
    for region in ["all", ON_IT] {
        let found = detect(&again, &["--camera", &smaller, "--region", region, &cut]);
        assert!(found["detections"][0]["score"].as_f64().unwrap() > 0.5, "{region}: {found}");
    }
    let small = String::from_utf8(teach("300,200,30,30").stderr).unwrap();
    assert!(small.contains("--region: expected a region that the part fits in"), "{small}");
}

#[test]
fn an_evaluation_leaves_pictures_of_another_size_out() {
    let folder = Folder::new();
    let (model, pictures) = (folder.path("region.sdg"), folder.path("pictures"));
    let demo = format!("{}:{}", photo(), shipped("pendulum", "annotation.json").display());
    assert!(sdg(&["teach", "--model", "S", "--demo", &demo, "--region", ON_IT, "--out", &model]).status.success());
    std::fs::create_dir(&pictures).unwrap();
    let image = image::open(photo()).unwrap();
    // A changed copy, because the photo itself would be left out: the model was taught from it.
    image.brighten(12).save(format!("{pictures}/same.png")).unwrap();
    image.thumbnail(320, 240).save(format!("{pictures}/small.png")).unwrap();
    for (name, side) in [("same", [640, 480]), ("small", [320, 240])] {
        let none = json!({"imageWidth": side[0], "imageHeight": side[1], "shapes": []});
        std::fs::write(format!("{pictures}/{name}.json"), none.to_string()).unwrap();
    }
    let output = sdg(&["evaluate", "--pictures", &pictures, "--grasp-model", &model, "--report", &folder.path("out")]);
    let told = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap()).concat();
    assert!(output.status.success() && told.contains("small.png: expected a picture of 640 × 480 pixels"), "{told}");
    std::fs::remove_file(format!("{pictures}/same.png")).unwrap();
    std::fs::remove_file(format!("{pictures}/same.json")).unwrap();
    let output = sdg(&["evaluate", "--pictures", &pictures, "--grasp-model", &model, "--report", &folder.path("out")]);
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("no picture can be searched: ") && told.contains("small.png: expected a picture"), "{told}");
}

#[test]
fn wrong_regions_are_one_clear_error_each() {
    let folder = Folder::new();
    let model = folder.path("model.sdg");
    taught_pendulum(&model, None);
    let photo = photo();
    let of = |region: &str| refusal(&["detect", "--grasp-model", &model, "--region", region, &photo]);
    for (region, code, part) in [
        ("10,10,0,50", 2, "a width and a height of at least 1 pixel, found 0 and 50"),
        ("10,10,50", 2, "X,Y,W,H in whole pixels"),
        ("1.5,2,30,40", 2, "X,Y,W,H in whole pixels"),
        ("everything", 2, "or `all` for the whole picture"),
        ("600,10,100,100", 1, "within the picture of 640 × 480 pixels, found 100 × 100 pixels from (600, 10)"),
        ("300,200,60,40", 1, "a region that the part fits in"),
    ] {
        let (found, error) = of(region);
        assert!(found == Some(code) && error.contains(part), "{region}: {found:?} {error}");
        assert_eq!(error.matches("expected").count(), 1, "one error: {error}");
    }
    // A folder read as a camera, in which no picture can be searched.
    let from = format!("dir:{}", shipped("pendulum", "image.png").parent().unwrap().display());
    let output =
        sdg(&["detect", "--grasp-model", &model, "--from", &from, "--region", "600,10,100,100", "--every-frame"]);
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("found 100 × 100 pixels from (600, 10)") && told.contains("could not be used"), "{told}");
    let out = folder.path("new.sdg");
    let demo = format!("{photo}:{}", shipped("pendulum", "annotation.json").display());
    for (region, part) in [
        ("600,10,100,100", "--region: expected a region within the picture of 640 × 480 pixels"),
        ("300,200,60,40", "--region: expected a region that the part fits in"),
        ("all", "X,Y,W,H in whole pixels"),
    ] {
        let (_, error) = refusal(&["teach", "--model", "C", "--demo", &demo, "--region", region, "--out", &out]);
        assert!(error.contains(part), "{region}: {error}");
        assert!(!fs::exists(&out).unwrap());
    }
}

#[test]
fn a_grasp_outside_the_picture_is_no_grasp() {
    let folder = Folder::new();
    let (model, cut) = (folder.path("model.sdg"), folder.path("cut.png"));
    let [photo, marks] = ["image.png", "annotation.json"].map(|name| shipped("pliers", name));
    let demo = format!("{}:{}", photo.display(), marks.display());
    stdout(&["teach", "--model", "S", "--demo", &demo, "--out", &model]);
    let photo = image::open(photo).unwrap();
    // The grasp is at x = 320, and the handles reach to x = 413.
    for (left, num_found) in [(306, 1), (326, 0)] {
        photo.crop_imm(left, 0, 640 - left, 480).save(&cut).unwrap();
        let found = lines(&["detect", "--grasp-model", &model, "--json", &cut]).remove(0);
        assert_eq!(found["detections"].as_array().unwrap().len(), num_found, "{left}: {found}");
    }
}
