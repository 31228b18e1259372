//! Ways to store the marks of a scene without loss of the grasp.

use rand::Rng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;
use serde_json::{Value, json};

use super::json_text::written;
use super::picture::pick;
use super::scene::{HEIGHT, Scene, WIDTH};

/// A file of marks, the files beside it, and a description.
#[derive(Debug, Clone)]
pub struct Marks {
    /// Path below the variant's folder.
    pub name: String,
    pub bytes: Vec<u8>,
    pub beside: Vec<(String, Vec<u8>)>,
    /// Formats of intermediate conversions by `sdg annotation convert`, in order.
    pub through: Vec<&'static str>,
    pub recipe: String,
}

/// The path of a picture as stored in a file of marks.
pub fn path_in_marks(dice: &mut Pcg64Mcg, name: &str) -> String {
    let escaped: String = name
        .bytes()
        .map(|byte| match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'.' | b'_' | b'-' => char::from(byte).to_string(),
            _ => format!("%{byte:02X}"),
        })
        .collect();
    match dice.random_range(0..7) {
        0 => name.to_owned(),
        1 => format!("/home/anna/Bilder/{name}"),
        2 => format!("..\\..\\photos\\{name}"),
        3 => format!("C:\\Users\\J\u{f6}rg\\my photos\\{name}"),
        4 => format!("file:///C:/photos/{escaped}"),
        5 => format!("/data/local-files/?d=set/{escaped}"),
        _ => format!("./x/../{name}"),
    }
}

pub fn lossless(dice: &mut Pcg64Mcg, scene: &Scene, photo: &str) -> Marks {
    let mut marks = match dice.random_range(0..3) {
        0 => {
            let value = labelme(dice, scene, photo);
            in_json(dice, &value, "LabelMe")
        }
        1 => {
            let (value, recipe) = coco(dice, scene, photo);
            in_json(dice, &value, &recipe)
        }
        _ => yolo(dice, scene),
    };
    if dice.random_bool(0.25) {
        let formats = ["coco", "labelme", "yolo-pose"];
        marks.through = (0..dice.random_range(1..4)).map(|_| *pick(dice, &formats)).collect();
        marks.recipe += &format!(", converted to {:?}", marks.through);
    }
    marks
}

/// JSON in a file, in any style and with one of several names.
pub fn in_json(dice: &mut Pcg64Mcg, value: &Value, recipe: &str) -> Marks {
    let (bytes, style) = written(dice, value);
    let name = *pick(dice, &["photo.json", "Schl\u{fc}ssel marks.JSON", "marks/a.json", "export.txt", "100%.json"]);
    Marks {
        name: name.to_owned(),
        bytes,
        beside: Vec::new(),
        through: Vec::new(),
        recipe: format!("{name:?}, {recipe}, {style}"),
    }
}

/// Marks in LabelMe's own fields; shapes in any order, among other shapes.
pub fn labelme(dice: &mut Pcg64Mcg, scene: &Scene, photo: &str) -> Value {
    let group = pick(dice, &[json!(1), json!(null), json!("7"), json!(12)]).clone();
    let [x1, y1, x2, y2] = scene.corners;
    let corners = *pick(dice, &[[[x1, y1], [x2, y2]], [[x2, y1], [x1, y2]], [[x2, y2], [x1, y1]]]);
    let [start, end] = scene.grasp;
    let mut outline = scene.outline.clone();
    let first = dice.random_range(0..outline.len());
    outline.rotate_left(first);
    if dice.random_bool(0.5) {
        outline.reverse();
    }
    let shape = |label: &str, kind: &str, points: Value| json!({"label": label, "shape_type": kind, "points": points, "group_id": group, "flags": {}, "description": ""});
    let mut shapes = vec![
        shape("part", "rectangle", json!(corners)),
        shape("grasp_start", "point", json!([start])),
        shape("grasp_end", "point", json!([end])),
        shape("part", "polygon", json!(outline)),
    ];
    if dice.random_bool(0.4) {
        shapes.push(shape("screw", "circle", json!([[9, 9], [14, 9]])));
        shapes.push(shape("hole", "point", json!([[20, 200]])));
        shapes.push(shape("cable", "linestrip", json!([[1, 1], [30, 9], [60, 9]])));
    }
    shapes.shuffle(dice);
    let mut file = json!({"version": "5.4.1", "flags": {}, "shapes": shapes, "imagePath": path_in_marks(dice, photo),
        "imageData": null, "imageWidth": WIDTH, "imageHeight": HEIGHT});
    if dice.random_bool(0.3) {
        file["imageData"] = json!("iVBORw0KGgo=");
    }
    if dice.random_bool(0.2) {
        ["imageWidth", "imageHeight"].iter().for_each(|key| drop(file.as_object_mut().unwrap().remove(*key)));
    }
    file
}

/// COCO with ids of any kind, keypoints in the order of the category's names, and further images and annotations.
pub fn coco(dice: &mut Pcg64Mcg, scene: &Scene, photo: &str) -> (Value, String) {
    let as_id = |dice: &mut Pcg64Mcg, id: u32| match dice.random_range(0..3) {
        0 => json!(id),
        1 => json!(id.to_string()),
        _ => json!(f64::from(id)),
    };
    let [image, category] = [dice.random_range(0..90), dice.random_range(0..90)];
    let mut names = vec!["grasp_start", "grasp_end"];
    names.extend(["rim", "hole"].into_iter().take(dice.random_range(0..3)));
    names.shuffle(dice);
    let visibility = dice.random_range(1..=2);
    let keypoints: Vec<Value> = names
        .iter()
        .flat_map(|name| match *name {
            "grasp_start" => [json!(scene.grasp[0][0]), json!(scene.grasp[0][1]), json!(visibility)],
            "grasp_end" => [json!(scene.grasp[1][0]), json!(scene.grasp[1][1]), json!(visibility)],
            _ => [json!(0), json!(0), json!(0)],
        })
        .collect();
    let [x1, y1, x2, y2] = scene.corners;
    let outline: Vec<f64> = scene.outline.iter().flatten().copied().collect();
    let mut annotations = vec![json!({"id": as_id(dice, 1), "image_id": as_id(dice, image),
        "category_id": as_id(dice, category), "bbox": [x1, y1, x2 - x1, y2 - y1], "keypoints": keypoints,
        "num_keypoints": 2, "segmentation": [outline], "iscrowd": 0, "area": 100.0})];
    let mut images = vec![json!({"id": as_id(dice, image), "file_name": path_in_marks(dice, photo),
        "width": WIDTH, "height": HEIGHT})];
    let mut categories = vec![json!({"id": as_id(dice, category), "name": "part", "keypoints": names})];
    let mut recipe = format!("COCO, keypoints {names:?}");
    if dice.random_bool(0.4) {
        recipe += ", other images";
        images.push(json!({"id": image + 1, "file_name": "elsewhere.png", "width": 64, "height": 48}));
        images.push(json!({"id": image + 2, "file_name": "set/another.png", "width": 64, "height": 48}));
        annotations.push(json!({"id": 2, "image_id": image + 1, "category_id": category, "bbox": [1, 1, 9, 9]}));
    }
    if dice.random_bool(0.3) {
        recipe += ", another category";
        categories.push(json!({"id": category + 100, "name": "hole", "supercategory": "hole"}));
        annotations.push(json!({"id": 3, "image_id": image, "category_id": category + 100, "bbox": [9, 9, 20, 20],
            "keypoints": [], "segmentation": []}));
    }
    if dice.random_bool(0.3) {
        recipe += ", a crowd";
        annotations.push(json!({"id": 4, "image_id": image, "category_id": category, "iscrowd": 1,
            "segmentation": {"counts": [0, 9, 76791], "size": [HEIGHT, WIDTH]}, "bbox": [0, 0, 1, 9]}));
    }
    annotations.shuffle(dice);
    images.shuffle(dice);
    categories.shuffle(dice);
    let file = json!({"info": {"description": "made by a test"}, "licenses": [], "images": images,
        "annotations": annotations, "categories": categories});
    (file, recipe)
}

/// A row of labels, with its data.yaml in one of its common forms.
pub fn yolo(dice: &mut Pcg64Mcg, scene: &Scene) -> Marks {
    let [across, down] = [f64::from(WIDTH), f64::from(HEIGHT)];
    let [x1, y1, x2, y2] = scene.corners;
    let digits = *pick(dice, &[6, 8, 17]);
    let share = |value: f64| format!("{value:.digits$}");
    let has_visibility = dice.random_bool(0.7);
    let is_swapped = dice.random_bool(0.5);
    let class = dice.random_range(0..3);
    let mut words = vec![class.to_string()];
    words.extend([(x1 + x2) / 2.0 / across, (y1 + y2) / 2.0 / down, (x2 - x1) / across, (y2 - y1) / down].map(share));
    let mut ends = scene.grasp;
    if is_swapped {
        ends.reverse();
    }
    for [x, y] in ends {
        words.extend([share(x / across), share(y / down)]);
        words.extend(has_visibility.then(|| "2".to_owned()));
    }
    let (separator, end) = *pick(dice, &[(" ", "\n"), ("\t", "\r\n"), ("  ", ""), (" ", "\n\n")]);
    let mark = *pick(dice, &["", "\u{feff}"]);
    let row = format!("{mark}{}{end}", words.join(separator));
    let names = if is_swapped { ["grasp_end", "grasp_start"] } else { ["grasp_start", "grasp_end"] };
    let [first, second] = names;
    let numbers = if has_visibility { 3 } else { 2 };
    let lists = [
        format!(
            "kpt_shape: [2, {numbers}]\nnames: [a, b, c]\nkpt_names:\n  0: [{first}, {second}]\n  1: [{first}, {second}]\n  2: [{first}, {second}]\n"
        ),
        format!(
            "# data\npath: ../set\nnames:\n  0: a\n  1: b\n  2: c\nkpt_shape:\n- 2\n- {numbers}\nkpt_names:\n- {first}\n- '{second}'\n"
        ),
        format!(
            "\u{feff}names: {{0: a, 1: b, 2: c}}\r\nkpt_shape: [2,{numbers}]  # x y\r\nkpt_names: [\"{first}\", {second}]\r\n"
        ),
    ];
    let yaml = pick(dice, &lists).clone();
    let (name, yaml_name) = *pick(
        dice,
        &[
            ("photo.txt", "data.yaml"),
            ("labels/train/photo.txt", "data.yaml"),
            ("labels/Schl\u{fc}ssel.txt", "labels/data.yaml"),
            ("photo.TXT", "dataset.yml"),
        ],
    );
    Marks {
        name: name.to_owned(),
        bytes: row.into_bytes(),
        recipe: format!("{name:?}, YOLO-pose {words:?} between {separator:?}, {yaml_name}: {yaml:?}"),
        beside: vec![(yaml_name.to_owned(), yaml.into_bytes())],
        through: Vec::new(),
    }
}
