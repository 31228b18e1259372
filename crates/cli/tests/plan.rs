//! `sdg plan`: a path around a wall, as text, as JSON and drawn; and rejected inputs.

use std::fs;
use std::path::Path;

use crate::support::{Folder, sdg};
use sdg_kinematics::{ArmGeometry, JointVector, NUM_JOINTS};
use sdg_robot::workcell::Workcell;
use sdg_simulation::CollisionWorld;
use serde_json::Value;

/// A wall between the two sides of the table.
const WALL: &str = r#"
[[obstacle]]
name = "wall"
box_mm = [500, 40, 500]
at_mm = [550, 0, 250]
"#;
const START: &str = "31,20,0,-120,0,140,76";

fn workcell(folder: &Folder, obstacles: &str) -> String {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/workcell/workcell.toml");
    folder.text("cell.toml", &(fs::read_to_string(shipped).unwrap() + obstacles))
}

#[test]
fn a_path_leads_around_the_wall_and_is_told_and_drawn() {
    let folder = Folder::new();
    let cell = workcell(&folder, WALL);
    let out = folder.path("drawn");
    let call = ["plan", "--workcell", &cell, "--start", START, "--goal", "500,-300,150", "--json", "--out", &out];
    let output = sdg(&call);
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{told}");
    assert!(told.contains("not straight, because on the straight motion") && told.contains("inside wall"), "{told}");
    assert!(told.contains("1. to joints (") && told.contains("goal 1, rotated by"), "{told}");
    let gif = fs::read(Path::new(&out).join("plan.gif")).unwrap();
    assert!(gif.starts_with(b"GIF89a") && gif.len() > 20_000, "{} bytes", gif.len());
    assert!(Path::new(&out).join("plan.png").exists());

    // The printed path, followed in MuJoCo, ends at the goal without any contact.
    let plan: Value = serde_json::from_slice(&output.stdout).unwrap();
    let joints = |value: &Value| {
        let degrees: Vec<f64> = serde_json::from_value(value.clone()).unwrap();
        assert_eq!(degrees.len(), NUM_JOINTS);
        JointVector::from_fn(|joint, _| degrees[joint].to_radians())
    };
    let mut waypoints = vec![joints(&plan["start_deg"])];
    waypoints.extend(plan["motions"].as_array().unwrap().iter().map(|motion| joints(&motion["joints_deg"])));
    assert!(waypoints.len() > 2);
    let tcp = ArmGeometry::panda().forward(&waypoints[waypoints.len() - 1]).translation.vector;
    assert!((tcp - nalgebra::Vector3::new(0.5, -0.3, 0.15)).norm() < 1e-6, "{tcp}");
    let obstacles = Workcell::from_toml(&fs::read_to_string(&cell).unwrap()).unwrap().obstacles;
    let mut world = CollisionWorld::new(&obstacles, 0.08).unwrap();
    for pair in waypoints.windows(2) {
        for step in 0..=500 {
            let q = pair[0] + (pair[1] - pair[0]) * (f64::from(step) / 500.0);
            assert_eq!(world.deepest(&q).unwrap(), None);
        }
    }
    let again = sdg(&[&call[..], &["--no-drawing"]].concat());
    let mut again: Value = serde_json::from_slice(&again.stdout).unwrap();
    again["planning_ms"] = plan["planning_ms"].clone();
    assert_eq!(again, plan, "the same seed gives the same path");
}

#[test]
fn what_blocks_is_named() {
    let folder = Folder::new();
    let cell = workcell(&folder, WALL);
    let refused = |cell: &str, further: &[&str], code: i32, parts: &[&str]| {
        let call = [&["plan", "--workcell", cell, "--no-drawing", "--goal"], further].concat();
        let output = sdg(&call);
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{call:?}: {told}");
        for part in parts {
            assert!(told.contains(part), "{call:?}: expected \"{part}\" in: {told}");
        }
    };
    // A file in place of the folder of drawings is reported before the path is planned and printed.
    let output = sdg(&["plan", "--workcell", &cell, "--goal", "500,-300,150", "--out", &cell]);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0), "{output:?}");
    refused(&cell, &["500,0,200"], 1, &["the goal is not free", "inside wall"]);
    refused(&cell, &["1500,0,200"], 1, &["the goal: the pose is out of reach"]);
    refused(&cell, &["500,nan,200"], 2, &["expected finite numbers", "nan"]);
    refused(&cell, &["500,300,200", "--start", "0,0,0,0,0,0,0"], 1, &["joint 4 must lie in [-176.00, -4.00] degrees"]);
    let radians = "0,-0.785,0,-2.356,0,1.571,0.785";
    refused(&cell, &["500,300,200", "--start", radians], 1, &["--start", "-2.356", "radians given as degrees?"]);
    refused(&cell, &["500,300,200,3.14,0,1.57"], 2, &["--goal", "radians given as degrees?"]);
    refused(&cell, &["0.5,0.3,0.2"], 2, &["--goal", "metres given as millimetres?"]);
    refused(&cell, &["500,300,200", "--start", "0,45,0,-90,0,90,0"], 1, &["the start is not free", "wall"]);
    refused(&cell, &["500,300,200", "--held-mm", "0,5"], 2, &["a DIAMETER of 1 to 1000 millimetres"]);
    refused(&cell, &["500,300,200", "--margin-mm", "0"], 2, &["a distance of 0.1 to 100 millimetres"]);
    let hall = workcell(&folder, "\n[[obstacle]]\nname = \"hall\"\nbox_mm = [4000, 4000, 4000]\nat_mm = [0, 0, 0]\n");
    refused(&hall, &["500,300,200"], 1, &["\"hall\" encloses the robot"]);
    let odd = workcell(&folder, "\n[[obstacle]]\nname = \"odd\"\nbox_mm = [10, 10, 0]\nat_mm = [500, 0, 0]\n");
    refused(&odd, &["500,300,200"], 1, &["line ", "box_mm: expected lengths"]);
}
