//! `--place` of `sdg grasp` and `sdg rehearse`, cells with obstacles, `sdg workcell show`, and rejected inputs.

use std::fs;
use std::path::Path;

use crate::support::{Folder, sdg, taught_pendulum};
use serde_json::Value;

/// A wall, a place behind the wall, and a tray.
const PLACES: &str = r#"
[[obstacle]]
name = "wall"
box_mm = [300, 30, 250]
at_mm = [500, -250, 125]

[[place]]
name = "shelf"
at_mm = [450, -400]

[[tray]]
name = "tray"
first_mm = [350, 320]
columns = 2
rows = 2
pitch_mm = [180, 80]
"#;

fn workcell_toml() -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/workcell/workcell.toml")).unwrap()
}

/// The shipped workcell with additions, and the shipped camera beside it.
fn workcell(folder: &Folder, name: &str, further: &str) -> String {
    let camera = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/workcell/camera.yaml");
    fs::copy(camera, folder.path("camera.yaml")).unwrap();
    folder.text(name, &(workcell_toml() + further))
}

/// The pendulum taught with the shipped camera.
fn taught(folder: &Folder) -> String {
    workcell(folder, "cell.toml", PLACES);
    let out = folder.path("model.sdg");
    taught_pendulum(&out, Some(Path::new(&folder.path("camera.yaml"))));
    out
}

fn refused(call: &[&str], code: i32, parts: &[&str]) {
    let output = sdg(call);
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{call:?}: {told}");
    for part in parts {
        assert!(told.contains(part), "{call:?}: expected \"{part}\" in: {told}");
    }
    assert!(!told.contains("panicked"), "{told}");
}

#[test]
fn the_simulated_arm_puts_the_part_down_behind_a_wall_and_looks_where_it_lies() {
    let folder = Folder::new();
    let model = taught(&folder);
    let (cell, states) = (folder.path("cell.toml"), folder.path("states.csv"));
    let call = [
        "grasp",
        "--robot",
        "sim",
        "--from",
        "sim:pendulum?seed=3",
        "--grasp-model",
        &model,
        "--workcell",
        &cell,
        "--speed",
        "0.6",
        "--states",
        &states,
        "--place",
        "shelf",
    ];
    let out = folder.path("drawn");
    let dry = sdg(&[&call[..], &["--dry-run", "--out", &out]].concat());
    let [plan, told] = [dry.stdout, dry.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert!(dry.status.success() && plan.contains("down softly to about "), "{plan} {told}");
    assert!(told.ends_with("nothing was moved\n"), "{told}");

    let done = sdg(&[&call[..], &["--json", "--out", &out]].concat());
    let told = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success() && told.contains("beside its place in \"shelf\""), "{told}");
    let line: Value = serde_json::from_slice(&done.stdout).unwrap();
    let place = &line["place"];
    assert_eq!((&place["placed"], &line["step"]), (&true.into(), &"check".into()), "{line}");
    assert!(place["beside_mm"].as_f64().unwrap() <= 3.0 && place["turned_deg"].as_f64().unwrap() <= 3.0, "{line}");
    for pressed in place["pressed_n"].as_array().unwrap() {
        assert!(pressed.as_f64().unwrap() < 10.0, "{line}");
    }
    assert!(!Path::new(&states).exists(), "nothing went wrong");
    let picture = image::open(Path::new(&out).join("grasp.png")).unwrap().into_rgb8();
    assert!(told.contains("grasp.png") && picture.dimensions() == (800, 600), "{told}");
    assert!(picture.pixels().any(|pixel| pixel != picture.get_pixel(0, 0)), "the cell is on it");

    let args = [
        "rehearse",
        "--grasp-model",
        &model,
        "--object",
        "pendulum",
        "--attempts",
        "1",
        "--seed",
        "2",
        "--place",
        "tray",
    ];
    let report = folder.path("report");
    let done =
        sdg(&[&args[..], &["--workcell", &cell, "--camera", &folder.path("camera.yaml"), "--out", &report]].concat());
    let told = String::from_utf8(done.stdout).unwrap();
    assert!(done.status.success() && told.contains("placed it in 1 of 1 attempts"), "{told}");
    assert!(fs::read_to_string(Path::new(&report).join("index.html")).unwrap().contains("put down"));
}

#[test]
fn places_and_cells_that_cannot_be_are_refused_by_name_and_line() {
    let folder = Folder::new();
    let model = taught(&folder);
    let grasp = |cell: &str, further: &[&str], code: i32, parts: &[&str]| {
        let states = folder.path("states.csv");
        let call =
            ["grasp", "--robot", "sim", "--from", "sim:pendulum?seed=3", "--grasp-model", &model, "--workcell", cell];
        refused(&[&call[..], &["--states", &states, "--speed", "0.6"], further].concat(), code, parts);
    };
    let cell = folder.path("cell.toml");
    grasp(&cell, &["--place", "table"], 2, &["--place: expected one of shelf, tray, found \"table\""]);
    grasp(&cell, &["--place", "tray"], 2, &["--place: expected tray:1 to tray:4, a cell of the tray"]);
    grasp(
        &cell,
        &["--place", "tray:5"],
        2,
        &["--place: expected tray:1 to tray:4, a cell of the tray, found \"tray:5\""],
    );
    let first_line = workcell_toml().lines().count() + 1;
    let at = |further: &str| {
        let line = further.lines().position(|line| line.contains("_mm = [")).unwrap();
        format!("line {}: ", first_line + line)
    };
    for (further, expected) in [
        ("\n[[place]]\nname = \"a\"\nat_mm = [450, nan]\n", "at_mm: expected x and y within 1500 mm"),
        ("\n[[place]]\nname = \"a\"\nat_mm = [450, -600]\n", "\"a\" is at y = -600 mm, outside the workspace"),
        (
            "\n[[tray]]\nname = \"a\"\nfirst_mm = [700, 0]\ncolumns = 3\nrows = 1\npitch_mm = [80, 80]\n",
            "\"a, cell 3\" is at x = 860 mm, outside the workspace of 150 to 800 mm",
        ),
    ] {
        let cell = workcell(&folder, "odd.toml", further);
        grasp(&cell, &["--place", "a"], 1, &["odd.toml", &at(further), expected]);
    }
    // An obstacle around the robot, or at the place for the part, is named.
    let hall = workcell(
        &folder,
        "hall.toml",
        "\n[[obstacle]]\nname = \"hall\"\nbox_mm = [400, 400, 400]\nat_mm = [0, 0, 200]\n",
    );
    grasp(&hall, &[], 1, &["detect: no path through the cell: the obstacle \"hall\" encloses the robot"]);
    let home = ["robot", "home", "--workcell", &hall, "--robot", "127.0.0.1:1", "--no-realtime"];
    refused(&home, 1, &["could not be reached"]);
    let inside = PLACES.replace("at_mm = [450, -400]", "at_mm = [450, -250]");
    let inside = workcell(&folder, "inside.toml", &inside);
    grasp(&inside, &["--place", "shelf"], 1, &["carry: no path to \"shelf\"", "wall"]);
    let rehearse = ["rehearse", "--grasp-model", &model, "--object", "pendulum", "--place", "shelf"];
    refused(&rehearse, 2, &["--workcell"]);
    let other_arm = folder.text("fr3.toml", &(workcell_toml().replace("\"panda\"", "\"fr3\"") + PLACES));
    let expected = "fr3.toml: model: expected \"panda\", the simulated arm, found \"fr3\"";
    refused(&[&rehearse[..], &["--workcell", &other_arm]].concat(), 1, &[expected]);
}

#[test]
fn a_workcell_is_drawn_from_above() {
    let folder = Folder::new();
    let cell = workcell(&folder, "cell.toml", PLACES);
    let out = folder.path("cell.png");
    let done = sdg(&["workcell", "show", &cell, "--grid-mm", "50", "--out", &out]);
    let told = String::from_utf8(done.stdout).unwrap();
    assert!(done.status.success(), "{told}");
    for part in ["\"shelf\" is reached", "\"tray\": all 4 cells are reached", "m² at every tested angle of the hand"] {
        assert!(told.contains(part), "expected \"{part}\" in: {told}");
    }
    let picture = image::open(&out).unwrap().into_rgb8();
    let near = |wanted: [u8; 3]| {
        let is_near = |p: &&image::Rgb<u8>| (0..3).all(|k| p.0[k].abs_diff(wanted[k]) < 12);
        picture.pixels().filter(is_near).count()
    };
    // Reachable ground, and the wall in its colour over ground that is not reachable.
    assert!(near([158, 209, 184]) > 20_000, "{}", near([158, 209, 184]));
    assert!(near([192, 178, 203]) > 2_000, "{}", near([192, 178, 203]));
    refused(&["workcell", "show", &cell, "--grid-mm", "1"], 2, &["--grid-mm: expected a number from 5 to 200"]);
    refused(&["workcell", "show", "/nowhere.toml"], 1, &["/nowhere.toml"]);
    for out in ["cell.pdf", "-"] {
        refused(&["workcell", "show", &cell, "--out", out], 2, &["--out: expected a file that ends in .png"]);
    }
}
