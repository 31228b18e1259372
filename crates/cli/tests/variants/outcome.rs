//! The outcome of a variant, compared with its scene.

use std::process::Output;

use serde_json::Value;

use super::scene::Scene;

/// Maximum distance and angle between equal grasps.
const SAME_PX: f64 = 0.5;
const SAME_DEG: f64 = 0.5;

#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    Same,
    /// Refused with one line that names the file and the field.
    Refused,
    /// Any other outcome, in words.
    Other(String),
}

impl Outcome {
    /// Converts an outcome that is wrong for this variant to a failure.
    pub fn into_failure(self, what: &str) -> Self {
        match self {
            Self::Other(why) => Self::Other(why),
            outcome => Self::Other(format!("{what}: {outcome:?}")),
        }
    }
}

fn is_same(scene: &Scene, middle: [f64; 2], angle_deg: f64) -> bool {
    let ([x, y], expected_deg) = scene.middle_and_angle();
    let turn = (angle_deg - expected_deg + 180.0).rem_euclid(360.0) - 180.0;
    (middle[0] - x).hypot(middle[1] - y) <= SAME_PX && turn.abs() <= SAME_DEG
}

/// The detections of `sdg detect --json` in one picture; `None` if nothing was found or read.
pub fn of_detection(done: &Output, scene: &Scene) -> Option<Outcome> {
    let line: Value = serde_json::from_slice(&done.stdout).ok()?;
    let [detection] = line["detections"].as_array()?.as_slice() else {
        let several = line["detections"].as_array().filter(|all| !all.is_empty())?;
        return Some(Outcome::Other(format!("{} detections", several.len())));
    };
    let [x, y, angle_deg] = ["x", "y", "angle_deg"].map(|key| detection["grasp"][key].as_f64().unwrap());
    Some(match is_same(scene, [x, y], angle_deg) {
        true => Outcome::Same,
        false => Outcome::Other(format!("grasp ({x:.2}, {y:.2}) {angle_deg:.2}°, not {:?}", scene.middle_and_angle())),
    })
}

/// The marks in a COCO file of the program. Outlines are compared if there are any.
pub fn of_marks(coco: &[u8], scene: &Scene) -> Outcome {
    let file: Value = serde_json::from_slice(coco).unwrap();
    let annotations = file["annotations"].as_array().unwrap();
    let mut grasps = annotations.iter().filter(|annotation| annotation["num_keypoints"] == 2);
    let (Some(annotation), None) = (grasps.next(), grasps.next()) else {
        return Outcome::Other("other than one grasp".to_owned());
    };
    let numbers = |value: &Value| -> Vec<f64> { value.as_array().unwrap().iter().filter_map(Value::as_f64).collect() };
    let is_near = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME_PX);
    let k = numbers(&annotation["keypoints"]);
    let grasp_deg = (k[4] - k[1]).atan2(k[3] - k[0]).to_degrees();
    let [x1, y1, x2, y2] = scene.corners;
    let outlines = annotation["segmentation"].as_array().unwrap();
    let area = |outline: &[f64]| {
        let corner = |idx: usize| [outline[2 * idx % outline.len()], outline[(2 * idx + 1) % outline.len()]];
        let twice =
            (0..outline.len() / 2).map(|idx| corner(idx)[0] * corner(idx + 1)[1] - corner(idx + 1)[0] * corner(idx)[1]);
        twice.sum::<f64>().abs() / 2.0
    };
    let outline: Vec<f64> = scene.outline.iter().flatten().copied().collect();
    if !is_same(scene, [(k[0] + k[3]) / 2.0, (k[1] + k[4]) / 2.0], grasp_deg)
        || !is_near(&[k[0], k[1], k[3], k[4]], &scene.grasp.concat())
    {
        Outcome::Other(format!("grasp {k:?}, not {:?}", scene.grasp))
    } else if !is_near(&numbers(&annotation["bbox"]), &[x1, y1, x2 - x1, y2 - y1]) {
        Outcome::Other(format!("box {}, not {:?}", annotation["bbox"], scene.corners))
    } else if outlines.iter().any(|found| (area(&numbers(found)) - area(&outline)).abs() > 1.0) {
        Outcome::Other(format!("outline {}", annotation["segmentation"]))
    } else {
        Outcome::Same
    }
}

/// The outcome of a call without a grasp: refused if one line contains one of these file names and one of these words.
pub fn of_refusal(done: &Output, file_names: &[&String], words: &[&str]) -> Outcome {
    /// The exit code for nothing to grasp, which is a result on standard output.
    const NOTHING_TO_GRASP: i32 = 3;
    let told = if done.status.code() == Some(NOTHING_TO_GRASP) { &done.stdout } else { &done.stderr };
    let told = String::from_utf8_lossy(told);
    let base_name = |name: &str| name.rsplit('/').next().unwrap_or(name).to_owned();
    let names_a_file = file_names.iter().any(|name| told.contains(&base_name(name)));
    let names_a_field = words.iter().any(|word| told.contains(word));
    if !done.status.success() && told.lines().count() == 1 && names_a_file && names_a_field {
        Outcome::Refused
    } else {
        Outcome::Other(format!("exit {:?}, expected one of {words:?}: {told}", done.status.code()))
    }
}
