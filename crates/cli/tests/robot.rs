//! `sdg grasp` and `sdg robot`: a grasp with the simulated arm, rejected inputs, and the confirmation before motions.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::simulated_arm::Simulated;
use crate::support::{sdg, taught_pendulum};
use sdg_calibration::{CalibratedCamera, Frame, TablePose};
use sdg_cell::CameraPose;
use sdg_geometry::PinholeCamera;
use sdg_kinematics::ready_pose;
use sdg_robot::camera_looking_down;
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::{SceneVariation, VariationConfig};
use sdg_simulation::{Workcell, WorkcellConfig};
use serde_json::Value;

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets").join(name)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// The pendulum taught without a camera, or with the shipped one; its marks are then 16 mm above the table.
fn taught(folder: &Path, with_camera: bool) -> PathBuf {
    let out = folder.join("model.sdg");
    let camera = shipped("workcell/camera.yaml");
    taught_pendulum(&out, with_camera.then_some(&*camera));
    out
}

fn assert_refused(arguments: &[&str], code: i32, parts: &[&str]) {
    let output = sdg(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
    for part in parts {
        assert!(stderr.contains(part), "{arguments:?}: expected \"{part}\" in: {stderr}");
    }
    assert!(!stderr.contains("panicked"), "{stderr}");
}

#[test]
fn the_simulated_arm_grasps_what_the_shipped_workcell_shows_it() {
    let folder = tempfile::tempdir().unwrap();
    let model = taught(folder.path(), true);
    let workcell = shipped("workcell/workcell.toml");
    let states = folder.path().join("states.csv");
    let base = ["grasp", "--robot", "sim", "--grasp-model", text(&model), "--workcell", text(&workcell)];
    let from = ["--from", "sim:pendulum?seed=3", "--states", text(&states)];

    let out = folder.path().join("drawn");
    let dry = sdg(&[&base[..], &from, &["--dry-run", "--out", text(&out)]].concat());
    let [plan, stderr] = [dry.stdout, dry.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert!(dry.status.success(), "{stderr}");
    // The grasp is 9 mm above the table, 7 mm below the marks; the run itself measures this height.
    assert!(plan.contains(", 9) mm in ") && plan.contains("hand close on about 16 mm with 40 N"), "{plan}");
    let soft = sdg(&[&base[..], &from, &["--dry-run", "--soft", "--out", text(&out)]].concat());
    let told = String::from_utf8(soft.stdout).unwrap();
    assert!(soft.status.success() && told.contains("down softly to about 9 mm, or until contact"), "{told}");
    assert!(stderr.ends_with("nothing was moved\n"), "{stderr}");
    assert_eq!(&fs::read(out.join("dry-run.gif")).unwrap()[..6], b"GIF89a");
    // The part is drawn in its colour.
    let drawn = image::open(out.join("dry-run.png")).unwrap().into_rgb8();
    let is_part = |pixel: &image::Rgb<u8>| pixel[0] > 120 && pixel[0] > pixel[1] + 50 && pixel[1] > pixel[2] + 20;
    let num_part = drawn.pixels().filter(|pixel| is_part(pixel)).count();
    assert!(num_part >= 20, "{num_part} pixels");

    // After consent the dry run is executed, and the cell is drawn as without one.
    let grasp = out.join("grasp.png");
    assert!(!grasp.exists());
    let executed = ["--dry-run", "--yes", "--speed", "0.6", "--json", "--out", text(&out)];
    let done = sdg(&[&base[..], &from, &executed].concat());
    let stderr = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success() && grasp.exists(), "{stderr}");
    let line: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!((&line["held"], &line["step"], &line["looks"]), (&true.into(), &"hold".into(), &vec![1, 1].into()));
    let width_m = line["closed_width_m"].as_f64().unwrap();
    assert!((width_m - 0.0158).abs() < 0.002, "{line}");
    // The part's height was not given.
    let height = &line["height"];
    let [height_mm, sigma_mm] = ["mark_height_mm", "sigma_mm"].map(|key| height[key].as_f64().unwrap());
    assert!(height["source"] == "measured" && (height_mm - 16.0).abs() < 1.0 && sigma_mm < 3.0, "{line}");
    assert!(!states.exists(), "nothing went wrong");

    // A given height that contradicts the measurement is refused; 0 counts as a given height.
    let states_of = ["--states", text(&states), "--speed", "0.6", "--from", "sim:pendulum?seed=3"];
    let wrong = sdg(&[&base[..], &states_of, &["--mark-height-mm", "0", "--mark-height-sigma-mm", "0.5"]].concat());
    let stderr = String::from_utf8(wrong.stderr).unwrap();
    assert_eq!(wrong.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("detect: expected marks at the given height of 0.0 ± 0.5 mm, measured 1"), "{stderr}");
    fs::remove_file(&states).unwrap();

    // Another part than the taught one is not grasped.
    let other = sdg(&[&base[..], &["--from", "sim:key?seed=3", "--speed", "0.6", "--states", text(&states)]].concat());
    assert_eq!(other.status.code(), Some(3), "{}", String::from_utf8_lossy(&other.stderr));
}

#[test]
fn a_motion_outside_the_workspace_is_not_begun() {
    let folder = tempfile::tempdir().unwrap();
    let model = taught(folder.path(), true);
    let camera = shipped("workcell/camera.yaml");
    let narrow = fs::read_to_string(shipped("workcell/workcell.toml")).unwrap();
    let narrow = narrow.replace("x_mm = [150, 800]", "x_mm = [150, 320]");
    let workcell = folder.path().join("narrow.toml");
    fs::write(&workcell, narrow).unwrap();
    assert_refused(
        &[
            "grasp",
            "--robot",
            "sim",
            "--from",
            "sim:pendulum",
            "--grasp-model",
            text(&model),
            "--camera",
            text(&camera),
            "--workcell",
            text(&workcell),
        ],
        1,
        &["detect: the motion was not started: at ", "outside the workspace of 0.1500 to 0.3200 m"],
    );
}

#[test]
fn wrong_files_and_options_are_refused_before_anything_moves() {
    let folder = tempfile::tempdir().unwrap();
    let model = taught(folder.path(), true);
    let workcell = shipped("workcell/workcell.toml");
    let whole = fs::read_to_string(&workcell).unwrap();
    let grasp = |workcell: &Path, further: &[&str], code: i32, parts: &[&str]| {
        let arguments = ["grasp", "--grasp-model", text(&model), "--workcell", text(workcell)];
        assert_refused(&[&arguments[..], further].concat(), code, parts);
    };
    let sim = ["--robot", "sim", "--from", "sim:pendulum"];
    grasp(Path::new("/nowhere.toml"), &sim, 1, &["/nowhere.toml"]);
    grasp(&workcell, &["--from", "sim:pendulum"], 2, &["--robot ADDRESS"]);
    grasp(&workcell, &["--robot", "sim", "--from", "dir:/tmp"], 2, &["expected sim:PART"]);
    grasp(&workcell, &["--robot", "sim", "--from", "sim:pendulum?speed=5"], 2, &["\"speed=5\""]);
    grasp(&workcell, &["--robot", "sim", "--from", "sim:pendulums"], 2, &["--from: ", "pendulums"]);
    let size = "--size: expected 640x480, the size of the calibration, found 320x240";
    grasp(&workcell, &[&sim[..], &["--size", "320x240"]].concat(), 2, &[size]);
    let exposure = ["--exposure-ms: expected a V4L2 camera", "found sim:pendulum"];
    grasp(&workcell, &[&sim[..], &["--exposure-ms", "8"]].concat(), 2, &exposure);
    for speed in ["0", "0.7", "-1", "NaN"] {
        let speed = format!("--speed={speed}");
        grasp(&workcell, &[&sim[..], &[&speed]].concat(), 2, &["--speed: expected a fraction", "at most 0.6"]);
    }

    for (told, expected) in
        [("1000", "a height of 0 to 500 millimetres, found 1000"), ("0.016", "metres given as millimetres?")]
    {
        grasp(&workcell, &[&sim[..], &["--mark-height-mm", told]].concat(), 2, &["--mark-height-mm", expected]);
    }
    grasp(&workcell, &[&sim[..], &["--mark-height-sigma-mm", "1"]].concat(), 2, &["--mark-height-mm"]);

    let write = |name: &str, from: &str, to: &str| {
        let path = folder.path().join(name);
        assert!(whole.contains(from), "{from}");
        fs::write(&path, whole.replace(from, to)).unwrap();
        path
    };
    let second_look_out = "[[look_out]]\ncamera_at_mm = [480, 100, 580]";
    let nowhere = write("nowhere.toml", second_look_out, "[[obstacle]]\nname = \"post\"");
    grasp(&nowhere, &sim, 1, &["nowhere.toml: line 30: missing field `at_mm`"]);
    let model_name = write("robot.toml", "\"panda\"", "\"ur5\"");
    grasp(&model_name, &sim, 1, &["robot.toml: line 6: model: expected \"panda\" or \"fr3\", found \"ur5\""]);
    let shipped_camera = shipped("workcell/camera.yaml");
    let simulated = [&sim[..], &["--camera", text(&shipped_camera)]].concat();
    let higher = write("higher.toml", "height_mm = 0.0", "height_mm = 20");
    grasp(&higher, &simulated, 1, &["higher.toml: height_mm: expected 0, the simulated table's height, found 20"]);
    let other_arm = write("fr3.toml", "\"panda\"", "\"fr3\"");
    grasp(&other_arm, &simulated, 1, &["fr3.toml: model: expected \"panda\", the simulated arm, found \"fr3\""]);
    // The path of the camera file is relative to the workcell file's folder.
    let moved = write("moved.toml", "format = 1", "format = 1");
    grasp(&moved, &sim, 1, &["camera.yaml"]);
    let base = write("base.toml", "\"hand\"", "\"base\"");
    grasp(&base, &sim, 1, &["camera_at_mm: expected joints_deg"]);
    let no_hand_eye = folder.path().join("camera.yaml");
    let camera = fs::read_to_string(shipped("workcell/camera.yaml")).unwrap();
    fs::write(&no_hand_eye, camera.split("\nhand_eye:").next().unwrap()).unwrap();
    grasp(&moved, &sim, 1, &["camera.yaml: expected hand_eye: flange_from_camera", "sdg camera hand-eye --mount hand"]);

    let without_lengths = taught(folder.path(), false);
    assert_refused(
        &[
            "grasp",
            "--grasp-model",
            text(&without_lengths),
            "--workcell",
            text(&workcell),
            "--robot",
            "sim",
            "--from",
            "sim:key",
        ],
        1,
        &["taught with a camera"],
    );
}

#[test]
fn an_arm_that_is_not_there_is_one_line() {
    // No server listens on port 9 of this computer.
    for verb in [&["state"][..], &["recover", "--yes"], &["open"], &["close"]] {
        let output = sdg(&[&["robot"], verb, &["--robot", "127.0.0.1:9"]].concat());
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{verb:?}: {stderr}");
        assert!(stderr.contains("the robot at 127.0.0.1:9 could not be reached: "), "{stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
    }
    assert_refused(&["robot", "state"], 2, &["expected --robot ADDRESS"]);
    assert_refused(&["robot", "open", "--robot", "sim"], 2, &["expected the address of an arm"]);
    for (width, expected) in
        [("90", "an opening of 0 to 80 millimetres, found 90"), ("0.04", "metres given as millimetres?")]
    {
        assert_refused(&["robot", "open", "--robot", "h", "--width-mm", width], 2, &["--width-mm", expected]);
    }
    assert_refused(&["robot", "close", "--robot", "h", "--force-n", "0"], 2, &["--force-n: expected 1 to 70"]);
    assert_refused(&["robot", "home", "--robot", "h"], 2, &["expected --workcell FILE"]);
    assert_refused(&["robot", "state", "--robot", "a b"], 2, &["expected HOST or HOST:PORT"]);
}

/// Runs `sdg` as a user without permission for `SCHED_FIFO`.
fn sdg_without_realtime(arguments: &[&str]) -> (Option<i32>, String) {
    let script = "if [ \"$(id -u)\" = 0 ]; then exec setpriv --bounding-set=-sys_nice \"$@\"; fi; exec prlimit --rtprio=0:0 \"$@\"";
    let sdg = env!("CARGO_BIN_EXE_sdg");
    let output = Command::new("sh").args(["-c", script, "sh", sdg]).args(arguments).output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

#[test]
fn a_real_arm_is_not_driven_without_real_time_scheduling() {
    let folder = tempfile::tempdir().unwrap();
    let model = taught(folder.path(), true);
    let workcell = shipped("workcell/workcell.toml");
    let pictures = format!("dir:{}", shipped("demonstrations/pendulum").display());
    let grasp = ["grasp", "--from", &pictures, "--grasp-model", text(&model), "--workcell", text(&workcell)];
    let home = ["robot", "home", "--workcell", text(&workcell)];
    for command in [&grasp[..], &home] {
        // No robot has this address: the call is rejected before it connects.
        let command = [command, &["--robot", "127.0.0.1:9"]].concat();
        let (code, line) = sdg_without_realtime(&command);
        assert_eq!(code, Some(1), "{line}");
        assert!(line.contains("SCHED_FIFO") && line.contains("--no-realtime"), "{line}");
        assert_eq!(line.lines().count(), 1, "{line}");
        let (code, line) = sdg_without_realtime(&[&command[..], &["--no-realtime"]].concat());
        assert_eq!(code, Some(1), "{line}");
        assert!(line.contains("the robot at 127.0.0.1:9 could not be reached"), "{line}");
    }
}

#[test]
fn a_robot_of_another_model_than_the_workcells_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let whole = fs::read_to_string(shipped("workcell/workcell.toml")).unwrap();
    assert!(whole.contains("\"panda\""));
    let workcell = folder.path().join("fr3.toml");
    fs::write(&workcell, whole.replace("\"panda\"", "\"fr3\"")).unwrap();
    let simulated = Simulated::start(&[]);
    let arguments = ["robot", "home", "--robot", &simulated.address, "--workcell", text(&workcell), "--no-realtime"];
    let expected = "model of the robot: expected \"fr3\", as the workcell file says, found a robot that speaks the protocol of \"panda\"";
    assert_refused(&arguments, 1, &[expected]);
}

/// The same command as for a real arm: a live camera beside the robot, detection, and the arm over TCP and UDP.
#[test]
fn an_arm_on_the_network_grasps_what_a_live_camera_shows() {
    const SEED: u64 = 3;
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let model = taught(folder.path(), true);

    // The camera is in the pose of the demonstration and shows the scene of the simulated Panda.
    let base_from_camera = camera_looking_down(0.48, 0.0, 0.58, 0.0);
    let table = TablePose { frame: Frame::Base, height_m: 0.0, frame_from_camera: base_from_camera, workspace: None };
    let camera = CalibratedCamera {
        name: "beside".to_owned(),
        intrinsics: PinholeCamera::WRIST,
        table: Some(table),
        flange_from_camera: None,
    };
    fs::write(file("camera.yaml"), camera.to_yaml()).unwrap();
    let variation = VariationConfig { appearance: false, distractors: 0..=0, ..VariationConfig::default() };
    let scene = SceneVariation::sample(Some(&ObjectSpec::by_name("pendulum").unwrap()), &variation, SEED);
    let place = Some(CameraPose::InBase(base_from_camera));
    let mut cell = Workcell::new(&WorkcellConfig { camera_pose: place, ..WorkcellConfig::new(scene) }).unwrap();
    let mut aside = ready_pose();
    aside[0] = 1.6;
    cell.reset(&aside).unwrap();
    // Two alternating pictures, because a camera that repeats the same bits is reported as frozen.
    let mut picture = cell.wrist_view().unwrap().image;
    picture.save(file("0.png")).unwrap();
    picture.put_pixel(0, 0, image::Rgb([1, 2, 3]));
    picture.save(file("1.png")).unwrap();
    let frames = file("frames.sh");
    let folder_text = text(folder.path());
    let script = format!("while :; do cat {folder_text}/0.png; sleep 0.1; cat {folder_text}/1.png; sleep 0.1; done\n");
    fs::write(&frames, script).unwrap();

    let workcell = fs::read_to_string(shipped("workcell/workcell.toml")).unwrap();
    let head = workcell.split("[[look_out]]").next().unwrap().replace("mounting = \"hand\"", "mounting = \"base\"");
    let look_out = "[[look_out]]\njoints_deg = [50, -45, 0, -135, 0, 90, 45]\n";
    fs::write(file("workcell.toml"), format!("{head}{look_out}")).unwrap();

    let simulated = Simulated::start(&["--object", "pendulum", "--seed", "3"]);
    let from = format!("cmd:sh {}", frames.display());
    let (workcell, states) = (file("workcell.toml"), file("states.csv"));
    // The maximum age of a detection is long, so that the test does not fail on a slow machine; the part does not move.
    let grasp = [
        "grasp",
        "--robot",
        &simulated.address,
        "--from",
        &from,
        "--grasp-model",
        text(&model),
        "--workcell",
        text(&workcell),
        "--states",
        text(&states),
        "--speed",
        "0.6",
        "--max-detection-age-secs",
        "60",
        "--no-realtime",
        "--json",
    ];
    let asked = sdg(&grasp);
    let stderr = String::from_utf8(asked.stderr).unwrap();
    assert!(asked.status.success() && stderr.ends_with("nothing was moved\n"), "{stderr}");
    let line: Value = serde_json::from_slice(&asked.stdout).unwrap();
    assert_eq!((&line["moved"], &line["held"]), (&false.into(), &false.into()), "{line}");

    let done = sdg(&[&grasp[..], &["--yes"]].concat());
    let stderr = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success(), "{stderr}");
    let line: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!((&line["held"], &line["looks"]), (&true.into(), &vec![1, 0].into()), "{line}");
    let width_m = line["closed_width_m"].as_f64().unwrap();
    assert!((width_m - 0.016).abs() < 0.002, "{line}");

    let state = sdg(&["robot", "state", "--robot", &simulated.address, "--json"]);
    let line: Value = serde_json::from_slice(&state.stdout).unwrap();
    assert_eq!((&line["mode"], &line["hand"]["is_grasping"]), (&"idle".into(), &true.into()), "{line}");
    let opened = sdg(&["robot", "open", "--robot", &simulated.address]);
    assert!(opened.status.success(), "{}", String::from_utf8_lossy(&opened.stderr));
}
