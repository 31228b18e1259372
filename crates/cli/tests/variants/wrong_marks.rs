//! Faulty marks, each with words of which the error must contain one.

use std::sync::LazyLock;

use rand::Rng;
use rand_pcg::Pcg64Mcg;
use serde_json::{Value, json};

use super::marks::{Marks, coco, in_json, labelme, yolo};
use super::picture::pick;
use super::scene::Scene;

type Words = &'static [&'static str];

/// Name of another photo in the folder, to which the marks of one kind of fault refer.
pub(super) const OTHER_PHOTO: &str = "other photo.png";

/// The scene in that photo.
pub(super) fn other_scene() -> &'static Scene {
    static SCENE: LazyLock<Scene> = LazyLock::new(|| Scene::new([120.0, 150.0], -70.0, 9));
    &SCENE
}

/// The scene with moved marks; the photo is unchanged.
fn mapped(scene: &Scene, map: impl Fn([f64; 2]) -> [f64; 2]) -> Scene {
    let [x1, y1, x2, y2] = scene.corners;
    let [[x1, y1], [x2, y2]] = [[x1, y1], [x2, y2]].map(&map);
    Scene {
        photo: scene.photo.clone(),
        outline: scene.outline.iter().copied().map(&map).collect(),
        corners: [x1, y1, x2, y2],
        grasp: scene.grasp.map(&map),
    }
}

/// Removes the image's size, which would reveal a scale.
fn sizeless(mut file: Value) -> Value {
    let of = |value: &mut Value| {
        for key in ["width", "height", "imageWidth", "imageHeight"] {
            value.as_object_mut().unwrap().remove(key);
        }
    };
    of(&mut file);
    file.get_mut("images").and_then(Value::as_array_mut).into_iter().flatten().for_each(of);
    file
}

/// LabelMe or COCO of the scene, with the correct image size.
fn json_of(dice: &mut Pcg64Mcg, scene: &Scene, photo: &str) -> Value {
    if dice.random_bool(0.5) { labelme(dice, scene, photo) } else { coco(dice, scene, photo).0 }
}

/// A COCO file with one annotation and one image.
fn plain_coco(dice: &mut Pcg64Mcg, scene: &Scene, photo: &str) -> Value {
    loop {
        let (file, _) = coco(dice, scene, photo);
        let count = |key: &str| file[key].as_array().unwrap().len();
        if count("images") == 1 && count("annotations") == 1 && count("categories") == 1 {
            return file;
        }
    }
}

pub fn wrong(dice: &mut Pcg64Mcg, scene: &Scene, photo: &str) -> (Marks, Words) {
    match dice.random_range(0..3) {
        0 => in_other_units(dice, scene, photo),
        1 => contradictory(dice, scene, photo),
        _ => unreadable(dice, scene, photo),
    }
}

fn in_other_units(dice: &mut Pcg64Mcg, scene: &Scene, photo: &str) -> (Marks, Words) {
    let [width, height] = [320.0, 240.0];
    let kind = dice.random_range(0..7);
    let map = |[x, y]: [f64; 2]| match kind {
        0 => [x / width, y / height],
        1 | 2 => [x / 2.0, y / 2.0],
        3 => [y, x],
        4 => [100.0 * x / width, 100.0 * y / height],
        _ => [x, y],
    };
    // If the photo has an Exif orientation, the marks may fit its stored pixels best; the error then says "Exif".
    let (recipe, words): (&str, Words) = match kind {
        0 => ("shares", &["shares"]),
        1 => ("half scale, size unknown", &["half scale", "Exif"]),
        2 => ("half scale, of an image of half the size", &["made on 160×120"]),
        3 => ("x and y exchanged", &["exchanged", "inside the image", "Exif"]),
        4 => ("percent", &["percent", "Exif"]),
        5 => ("of an image of another size", &["made on 321×240"]),
        _ => ("YOLO-pose in pixels", &["shares"]),
    };
    if kind == 6 {
        let [x1, y1, x2, y2] = scene.corners;
        let row = format!("0 {} {} {} {}\n", (x1 + x2) / 2.0, (y1 + y2) / 2.0, x2 - x1, y2 - y1);
        return (
            Marks { name: "photo.txt".into(), bytes: row.into(), recipe: recipe.into(), ..yolo(dice, scene) },
            words,
        );
    }
    let mut file = json_of(dice, &mapped(scene, map), photo);
    let mut declare = |width: u32, height: u32| {
        if file.get("shapes").is_some() {
            file["imageWidth"] = json!(width);
            file["imageHeight"] = json!(height);
        }
        for image in file.get_mut("images").and_then(Value::as_array_mut).into_iter().flatten() {
            image["width"] = json!(width);
            image["height"] = json!(height);
        }
    };
    match kind {
        1 => file = sizeless(file),
        2 => declare(160, 120),
        5 => declare(321, 240),
        _ => {}
    }
    (in_json(dice, &file, recipe), words)
}

fn contradictory(dice: &mut Pcg64Mcg, scene: &Scene, photo: &str) -> (Marks, Words) {
    let mut file = plain_coco(dice, scene, photo);
    let annotation = file["annotations"][0].clone();
    let set = |file: &mut Value, key: &str, value: Value| file["annotations"][0][key] = value;
    let (recipe, words): (&str, Words) = match dice.random_range(0..11) {
        0 => {
            let mut second = file["images"][0].clone();
            second["id"] = json!(99);
            file["images"].as_array_mut().unwrap().push(second);
            ("one file name twice", &["images["])
        }
        1 => {
            let mut second = file["images"][0].clone();
            second["file_name"] = json!("elsewhere.png");
            file["images"].as_array_mut().unwrap().push(second);
            ("one image id twice", &["images["])
        }
        2 => {
            let mut second = file["categories"][0].clone();
            second["keypoints"].as_array_mut().unwrap().reverse();
            file["categories"].as_array_mut().unwrap().push(second);
            ("one category id twice, keypoints in another order", &["categories["])
        }
        3 => {
            let names = file["categories"][0]["keypoints"].as_array().unwrap().len();
            let points = [[9.0, 9.0, 2.0], [30.0, 9.0, 2.0], [50.0, 9.0, 2.0], [60.0, 9.0, 2.0]];
            let points: Vec<f64> = points.into_iter().take(names).flatten().collect();
            set(&mut file, "keypoints", json!(points));
            ("the grasp outside the box", &["crosses the box"])
        }
        4 => {
            let [x1, y1, x2, y2] = scene.corners;
            set(&mut file, "bbox", json!([x1, y1, x2, y2]));
            ("the box's lower right corner as its size", &["width", "inside the image"])
        }
        5 => {
            file["categories"][0]["keypoints"] = json!(["nose", "tail"]);
            set(&mut file, "keypoints", json!([150, 100, 2, 190, 130, 2]));
            ("keypoints of other names", &["grasp_start"])
        }
        6 => {
            let keypoints = annotation["keypoints"].as_array().unwrap();
            set(&mut file, "keypoints", json!(keypoints[3..]));
            ("one keypoint too few", &["keypoints"])
        }
        7 => {
            let names = file["categories"][0]["keypoints"].as_array().unwrap();
            let end = names.iter().position(|name| name == "grasp_end").unwrap();
            file["annotations"][0]["keypoints"][3 * end + 2] = json!(0);
            ("an end that is not labelled", &["grasp_start"])
        }
        8 => {
            set(&mut file, "image_id", json!(98));
            ("an image id that no image has", &["image_id"])
        }
        9 => {
            file["images"] = json!([{"id": 1, "file_name": "one.png"}, {"id": 2, "file_name": "two.png"}]);
            ("images of other names", &["images: one.png"])
        }
        _ => {
            // The other photo in the folder shows the part at these marks.
            file = sizeless(coco(dice, other_scene(), OTHER_PHOTO).0);
            file["images"] = json!([{"id": file["images"][0]["id"], "file_name": OTHER_PHOTO}]);
            file["annotations"].as_array_mut().unwrap().retain(|one| one.get("area").is_some());
            file["annotations"][0]["image_id"] = file["images"][0]["id"].clone();
            ("marks of another existing photo", &["file_name", "another photo"])
        }
    };
    (in_json(dice, &file, recipe), words)
}

fn unreadable(dice: &mut Pcg64Mcg, scene: &Scene, photo: &str) -> (Marks, Words) {
    let value = json_of(dice, scene, photo);
    let whole = in_json(dice, &value, "whole");
    let rows = yolo(dice, scene);
    let row = String::from_utf8(rows.bytes.clone()).unwrap().trim_start_matches('\u{feff}').trim().replace('\t', " ");
    let text = |text: &str| Marks { bytes: text.as_bytes().to_vec(), beside: Vec::new(), ..rows.clone() };
    let (recipe, marks, words): (&str, Marks, Words) = match dice.random_range(0..16) {
        0 => {
            let end = (whole.bytes.len() as f64 * dice.random_range(0.1..0.95)) as usize;
            ("truncated JSON", Marks { bytes: whole.bytes[..end].to_vec(), ..whole }, &["line", "UTF-8"])
        }
        1 => {
            let units = value.to_string().encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>();
            ("UTF-16", Marks { bytes: [b"\xff\xfe".as_slice(), &units].concat(), ..whole }, &["UTF-16"])
        }
        2 => {
            let mut bytes = json!({"label": "x"}).to_string().into_bytes();
            bytes[10] = 0xfc;
            ("Latin-1", Marks { bytes, ..whole }, &["UTF-8"])
        }
        3 => ("class names", text("part\nscrew\n"), &["classes.txt"]),
        4 => ("YAML", text("kpt_shape: [2, 3]\nnames: [part]\n"), &["YAML"]),
        5 => ("XML", text("<?xml version=\"1.0\"?>\n<annotations><image/></annotations>\n"), &["XML"]),
        6 => ("commas", text(&row.replace(' ', ",").replace(",,", ",")), &["commas"]),
        7 => ("semicolons", text(&row.split_whitespace().collect::<Vec<_>>().join(";")), &["semicolons"]),
        8 => ("decimal commas", text(&row.replace('.', ",")), &["decimal commas"]),
        9 => ("nothing", text(""), &["empty"]),
        10 => ("a comment", text("# nothing\n"), &["comments"]),
        11 => {
            let corners = "0 0.35 0.35 0.6 0.35 0.6 0.6 0.35 0.6\n";
            ("an oriented box", text(corners), &["oriented box"])
        }
        12 => {
            let spoilt = value.to_string().replacen("\"points\":[[", "\"points\":[[NaN,1],[", 1);
            let spoilt = spoilt.replacen("\"bbox\":[", "\"bbox\":[NaN,", 1);
            ("NaN", Marks { bytes: spoilt.into_bytes(), ..whole }, &["finite"])
        }
        13 => {
            let task = json!([{"id": 1, "data": {"image": photo}, "annotations": [{"result": []}]}]);
            ("Label Studio's JSON", Marks { bytes: task.to_string().into_bytes(), ..whole }, &["Label Studio"])
        }
        14 => {
            let project =
                json!({"_via_settings": {}, "_via_img_metadata": {photo: {"filename": photo, "regions": []}}});
            ("VIA's project", Marks { bytes: project.to_string().into_bytes(), ..whole }, &["VIA"])
        }
        _ => {
            let head = *pick(dice, &[b"\x89PNG\r\n\x1a\n".as_slice(), b"\xff\xd8\xff\xe0\0\x10JFIF"]);
            ("a picture as marks", Marks { bytes: head.to_vec(), ..whole }, &["a picture"])
        }
    };
    (Marks { recipe: format!("{:?}, {recipe}", marks.name), ..marks }, words)
}
