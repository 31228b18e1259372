//! `sdg rehearse` with the part from which the model was taught.

use crate::support::{Folder, sdg, taught_pendulum};
use serde_json::Value;

/// Model S of the pendulum, which is 166 mm long and 16 mm high; the model knows neither size.
fn taught(folder: &Folder) -> String {
    let model = folder.path("model.sdg");
    taught_pendulum(&model, None);
    model
}

/// Rehearses with these arguments, which must fail with this code and a message that contains all of `parts`.
fn refused(folder: &Folder, model: &str, arguments: &[&str], code: i32, parts: &[&str]) {
    let output = sdg(&[&["rehearse", "--grasp-model", model, "--out", &folder.path("report")], arguments].concat());
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    parts.iter().for_each(|part| assert!(stderr.contains(part), "expected \"{part}\" in: {stderr}"));
}

#[test]
fn the_body_of_the_photo_is_grasped() {
    let folder = Folder::new();
    let (model, out) = (taught(&folder), folder.path("report"));
    let output = sdg(&[
        "rehearse",
        "--grasp-model",
        &model,
        "--height-mm",
        "16",
        "--length-mm",
        "166",
        "--attempts",
        "2",
        "--out",
        &out,
        "--json",
    ]);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    let line: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((line["object"].as_str(), line["attempts"].as_u64()), (Some("pendulum"), Some(2)));
    assert_eq!(line["successes"], 2, "{line}: {stderr}");
    let part = line["part"].as_str().unwrap();
    assert!(part.contains("pendulum: 166.0 x ") && part.contains(" x 16.0 mm"), "{part}");
    for assumed in ["1.5 g/cm³ (--mass-g)", "--friction", "upright walls", "a photo from straight above"] {
        assert!(part.contains(assumed) && stderr.contains(assumed), "{part}\n{stderr}");
    }
}

#[test]
fn what_the_photo_does_not_show_must_be_told() {
    let folder = Folder::new();
    let model = taught(&folder);
    let refused = |arguments: &[&str], code, parts: &[&str]| refused(&folder, &model, arguments, code, parts);
    refused(&[], 2, &["--object NAME", "--length-mm"]);
    refused(&["--length-mm", "166"], 2, &["--height-mm", "model.sdg"]);
    refused(&["--length-mm", "166", "--object", "pendulum"], 2, &["cannot be used with"]);
    refused(&["--length-mm", "0", "--height-mm", "16"], 2, &["a size of 1 to 5000 millimetres"]);
    // A part as large as a table: no hand opens that wide.
    refused(&["--length-mm", "1600", "--height-mm", "16"], 1, &["opening of the jaws in m: expected 0.001 to 0.08"]);
    refused(&["--length-mm", "166", "--height-mm", "1"], 1, &["height in m: expected 0.003 to 0.12, found 0.0010"]);
}

#[test]
fn another_height_than_the_model_s_is_refused() {
    let folder = Folder::new();
    let (model, camera) = (folder.path("model.sdg"), folder.text("wrist.yaml", include_str!("wrist.yaml")));
    taught_pendulum(&model, Some(camera.as_ref()));
    refused(&folder, &model, &["--height-mm", "20"], 2, &["whose marks are 16.0 mm above the table"]);
    // The same height is accepted: the next error is that of the mass.
    refused(&folder, &model, &["--height-mm", "16", "--mass-g", "0.01"], 1, &["mass in kg"]);
    // Kilograms, given as grams.
    refused(&folder, &model, &["--height-mm", "16", "--mass-g", "0.17"], 1, &["density in kg/m³: expected 10"]);
}
