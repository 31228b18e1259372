//! Files with positions of cameras, robots and tables.

use sdg_calibration::{CalibratedCamera, read_robot_poses};
use sdg_kinematics::HAND_OPENING_MAX_M;
use sdg_robot::workcell::Workcell;

use super::bytes::file;
use crate::target::Target;

const MAX_EXTRA_BYTES: usize = 16 << 20;

/// The section `table` of a camera file, relative to the robot's base.
const OVER_BASE: &[u8] = b"
table:
  frame: base
  height_m: 0.01
  frame_from_camera: {translation_m: [0.5, 0, 0.58], rotation_xyzw: [1, 0, 0, 0]}
  workspace_m: {x: [0.3, 0.7], y: [-0.3, 0.3]}
";

/// A camera file.
pub(super) const CAMERA_FILE: Target = Target {
    name: "camera_file",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 5_000,
    dictionary: &[
        b"camera_matrix:",
        b"data: [",
        b"plumb_bob",
        b"rational_polynomial",
        b"rotation_xyzw:",
        b"&a ",
        b"*a",
        b"- ",
        b".nan",
        b"\n  ",
    ],
    seeds: || {
        let shipped = file("datasets/workcell/camera.yaml");
        // The file up to its section `table`.
        let lens =
            shipped.split(|byte| *byte == b'\n').take_while(|line| !line.starts_with(b"table:")).collect::<Vec<_>>();
        let beside = [lens.join(&b'\n').as_slice(), OVER_BASE].concat();
        let mut seeds = vec![shipped, beside];
        // The same files, as the program writes them.
        let read = |bytes: &[u8]| CalibratedCamera::from_yaml(&String::from_utf8_lossy(bytes));
        seeds.extend(seeds.clone().iter().filter_map(|bytes| Some(read(bytes).ok()?.to_yaml().into_bytes())));
        seeds
    },
    run: |bytes| {
        let Some(camera) = std::str::from_utf8(bytes).ok().and_then(|text| CalibratedCamera::from_yaml(text).ok())
        else {
            return false;
        };
        let _ = (camera.posed().is_ok(), camera.check_picture((640, 480)), camera.update_yaml(&camera.to_yaml()));
        // Every use of a picture inverts the lens model.
        for pixel in [[0.0, 0.0], [320.0, 240.0], [639.0, 1.0]] {
            let _ = camera.intrinsics.unproject(&pixel.into());
        }
        true
    },
};

/// A robot's poses, as CSV, JSON and YAML.
pub(super) const ROBOT_POSES: Target = Target {
    name: "robot_poses",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 10_000,
    dictionary: &[
        b"image,",
        b"x,y,z,",
        b"qx,qy,qz,qw",
        b";",
        b"\"",
        b"#",
        b"1,5",
        b"{\"image\":",
        b"\"base_from_flange\"",
    ],
    seeds: || {
        let csv = "picture,x,y,z,qx,qy,qz,qw\n1.png,0.4,0.1,0.5,0,1,0,0\n2.png,0.45,-0.1,0.52,0.6,0.8,0,0\n";
        let pose = "{\"translation_m\":[0.4,0.1,0.5],\"rotation_xyzw\":[0,1,0,0]}";
        let json = format!("{{\"poses\":[{{\"picture\":\"1.png\",\"base_from_flange\":{pose}}}]}}");
        let yaml = format!("poses:\n- picture: 1.png\n  base_from_flange: {pose}\n");
        [csv.to_owned(), json, yaml].map(String::into_bytes).to_vec()
    },
    run: |bytes| {
        let text = String::from_utf8_lossy(bytes);
        ["poses.csv", "poses.json", "poses.yaml"].into_iter().any(|name| read_robot_poses(name, &text).is_ok())
    },
};

/// A workcell file.
pub(super) const WORKCELL: Target = Target {
    name: "workcell",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 10_000,
    dictionary: &[
        b"[[obstacle]]",
        b"[[place]]",
        b"[[tray]]",
        b"box_mm = [",
        b"plane_normal = [0, 0, 1]",
        b"[[look_out]]",
        b"inf",
        b"nan",
        b"\n",
        b"\"\"\"",
    ],
    seeds: || {
        let shipped = "datasets/workcell/workcell.toml";
        [shipped, "fuzz/corpus/workcell.toml", "fuzz/corpus/workcell_beside.toml"].map(file).to_vec()
    },
    run: |bytes| {
        let Some(cell) = std::str::from_utf8(bytes).ok().and_then(|text| Workcell::from_toml(text).ok()) else {
            return false;
        };
        use_workcell(&cell);
        true
    },
};

/// Uses a workcell as the program does before a motion.
fn use_workcell(cell: &Workcell) {
    let _ = (cell.robot.name(), cell.home(), cell.grasp_config());
    assert_eq!(cell.safety_limits().workspace, Some(cell.workspace));
    let model = cell.collision_model(0.5 * HAND_OPENING_MAX_M);
    assert!(model.is_ok(), "expected obstacles that were checked when they were read, found {:?}", model.err());
    for place in &cell.places {
        let last = place.num_cells();
        for number in [0, 1, last, last + 1] {
            let goal = cell.place(&format!("{}:{number}", place.name));
            assert_eq!(goal.is_ok(), (1..=last).contains(&number), "{}:{number} of {last}", place.name);
        }
        assert_eq!(cell.place(&place.name).is_ok(), last == 1, "{} of {last} cells", place.name);
        let _ = place.covers(place.at_m);
    }
    let _ = (cell.place("no such place"), cell.place("no such place:one"));
}
