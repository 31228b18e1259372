use super::*;

const WHOLE: &str = r#"format = 1

[robot]
model = "panda"
address = "172.16.0.2"

[tool]
fingertip_beyond_tcp_mm = 9
grasp_force_n = 30.0
part_mass_kg = 0.2

[camera]
file = "camera.yaml"
mounting = "hand"

[table]
height_mm = -12.5

[workspace]
x_mm = [200, 800]
y_mm = [-450, 450]
z_mm = [-20, 900]

[[look_out]]
camera_at_mm = [480, 0, 580]

[[look_out]]
joints_deg = [0, -45, 0, -135, 0, 90, 45]
"#;

#[test]
fn a_whole_file_is_read() {
    let cell = Workcell::from_toml(WHOLE).unwrap();
    assert_eq!((cell.robot, cell.address.as_deref()), (RobotModel::Panda, Some("172.16.0.2")));
    assert_eq!((cell.grasp_force_n, cell.table_height_m), (30.0, -0.0125));
    assert_eq!(cell.workspace.min_m.z, -0.02);
    assert_eq!(cell.look_outs[0], LookOut::CameraAt { at_m: [0.48, 0.0], height_m: 0.58, yaw_rad: 0.0 });
    assert!((cell.home().unwrap() - sdg_kinematics::ready_pose()).amax() < 1e-12);
    let limits = cell.safety_limits();
    assert_eq!(limits.table_height_m, -0.0125);
    assert!((limits.fingertip_beyond_tcp_m - 0.009).abs() < 1e-12);
    assert_eq!(cell.grasp_config().load.unwrap().mass_kg, 0.2);
}

/// Each line of the file spoilt once: the error names that line, what was expected and what was found.
#[test]
fn errors_name_the_line() {
    for (line, from, to, expected) in [
        (1, "format = 1", "format = 2", "format: expected 1, found 2"),
        (4, "\"panda\"", "\"ur5\"", "expected \"panda\" or \"fr3\", found \"ur5\""),
        (5, "172.16.0.2", "http://robot", "expected HOST or HOST:PORT"),
        (8, "= 9", "= 900", "fingertip_beyond_tcp_mm: expected a number from 0 to 100, found 900"),
        (9, "30.0", "nan", "grasp_force_n: expected a number from 1 to 70, found NaN"),
        (10, "kg = 0.2", "kg = \"heavy\"", "expected f64"),
        (14, "\"hand\"", "\"wall\"", "expected \"hand\" or \"base\", found \"wall\""),
        (17, "-12.5", "-12500", "height_mm: expected a number from -1000 to 1000, found -12500"),
        (20, "[200, 800]", "[800, 200]", "x_mm: expected [smallest, largest] in mm"),
        (21, "[-450, 450]", "[-450, 450, 3]", "expected 2 numbers, found 3"),
        (22, "z_mm", "zmm", "unknown field `zmm`"),
        (25, "[480, 0, 580]", "[480, 0, 58]", "a height from 150 to 1200 mm above the table, found 58"),
        (28, "-135", "135", "joint 4 from -176.0 to -4.0 degrees, found 135.0"),
        (
            27,
            "[[look_out]]\njoints_deg",
            "[[look_out]]\n\n#joints_deg",
            "expected camera_at_mm or joints_deg, found neither",
        ),
    ] {
        assert!(WHOLE.contains(from), "{from}");
        let error = Workcell::from_toml(&WHOLE.replacen(from, to, 1)).unwrap_err();
        let text = error.to_string();
        assert!(text.contains(expected) && text.starts_with(&format!("line {line}: ")), "{to}: {text}");
        assert!(!text.contains('\n'), "{text}");
    }
}

#[test]
fn what_no_motion_is_planned_around_is_refused() {
    for name in ["obstacle", "tray"] {
        let error = Workcell::from_toml(&format!("{WHOLE}\n[[{name}]]\nname = \"box\"\n")).unwrap_err();
        assert!(error.to_string().starts_with(&format!("line 30: {name}: no motion is planned around it")), "{error}");
    }
}

#[test]
fn what_is_missing_is_named() {
    let error = Workcell::from_toml("").unwrap_err();
    assert_eq!(error.to_string(), "line 1: missing field `format`");
    let error = Workcell::from_toml(WHOLE.split("[[look_out]]").next().unwrap()).unwrap_err();
    assert!(error.to_string().contains("missing field `look_out`"), "{error}");
    let base = WHOLE.replace("\"hand\"", "\"base\"");
    let error = Workcell::from_toml(&base).unwrap_err();
    assert!(error.to_string().starts_with("line 25: camera_at_mm: expected joints_deg"), "{error}");
}

#[test]
fn broken_files_are_errors_and_no_panics() {
    // Every prefix, and every byte changed to each of a few others.
    for end in 0..WHOLE.len() {
        let _ = Workcell::from_toml(&WHOLE[..end]);
        for other in ["\0", "[", "\"", "9", "é", "="] {
            let _ = Workcell::from_toml(&format!("{}{other}{}", &WHOLE[..end], &WHOLE[end + 1..]));
        }
    }
}
