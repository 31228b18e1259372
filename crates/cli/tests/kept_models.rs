//! Model files written by earlier versions (datasets/models): this version reads them and gives the same grasps.

use crate::support::{shipped, stdout};
use serde_json::Value;

/// The file, and the grasp on the part's shipped photo as found by the program that wrote it: position in pixels and
/// angle in degrees.
const KEPT: [(&str, [f64; 3]); 1] = [("pendulum-shape-format-3", [320.024685, 220.452129, -141.544785])];
/// Tolerance in pixels and in degrees: much larger than the differences between instruction sets, and much smaller than
/// an error that a grasp would show.
const TOLERANCE: f64 = 0.01;

#[test]
fn kept_models_give_the_grasps_that_they_gave() {
    for (name, expected) in KEPT {
        let model = format!("{}/../../datasets/models/{name}.sdg", env!("CARGO_MANIFEST_DIR"));
        let photo = shipped("pendulum", "image.png").display().to_string();
        let line: Value =
            serde_json::from_str(&stdout(&["detect", "--grasp-model", &model, "--json", &photo])).unwrap();
        let grasp = &line["detections"][0]["grasp"];
        for (field, expected) in ["x", "y", "angle_deg"].into_iter().zip(expected) {
            let found = grasp[field].as_f64().unwrap();
            assert!((found - expected).abs() < TOLERANCE, "{name}: {field} {found}, expected {expected}");
        }
    }
}
