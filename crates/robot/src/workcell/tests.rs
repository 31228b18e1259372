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

/// Makes lines of the file invalid, one at a time: the error names the line and the cause.
#[test]
fn errors_name_the_line() {
    for (line, from, to, expected) in [
        (1, "format = 1", "format = 2", "format: expected 1, found 2"),
        (4, "\"panda\"", "\"ur5\"", "expected \"panda\" or \"fr3\", found \"ur5\""),
        (5, "172.16.0.2", "http://robot", "expected HOST or HOST:PORT"),
        (8, "= 9", "= 900", "fingertip_beyond_tcp_mm: expected a number from 0 to 100, found 900"),
        (8, "= 9", "= 0.009", "found 0.009: metres given as millimetres?"),
        (9, "30.0", "nan", "grasp_force_n: expected a number from 1 to 70, found NaN"),
        (10, "kg = 0.2", "kg = \"heavy\"", "expected f64"),
        (14, "\"hand\"", "\"wall\"", "expected \"hand\" or \"base\", found \"wall\""),
        (17, "-12.5", "-12500", "height_mm: expected a number from -1000 to 1000, found -12500"),
        (17, "-12.5", "-0.0125", "height_mm: expected millimetres, found -0.0125: metres given as millimetres?"),
        (20, "[200, 800]", "[800, 200]", "x_mm: expected [smallest, largest] in mm"),
        (
            20,
            "[200, 800]",
            "[0.2, 0.8]",
            "x_mm: expected [smallest, largest] in mm, at least 10 apart, found [0.2, 0.8]: metres",
        ),
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

const PLACES: &str = r#"
[[place]]
name = "shelf"
at_mm = [450, 300]
yaw_deg = 90
height_mm = 20

[[tray]]
name = "tray"
first_mm = [350, -400]
columns = 5
rows = 4
pitch_mm = [60, 50]

[[bin]]
name = "bin"
at_mm = [700, 200]
size_mm = [200, 150]
"#;

fn placing() -> String {
    let table = "height_mm = -12.5";
    WHOLE.replace(table, &format!("{table}\nx_mm = [100, 900]\ny_mm = [-500, 500]")) + PLACES
}

#[test]
fn places_are_where_the_file_says() {
    let cell = Workcell::from_toml(&placing()).unwrap();
    let shelf = cell.place("shelf").unwrap();
    assert_eq!(shelf.at_m, [0.45, 0.3]);
    assert!(
        (shelf.surface_m - 0.0075).abs() < 1e-12 && (shelf.yaw_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12,
        "{shelf:?}"
    );
    // The seventh cell is the second of the second row.
    let cell_7 = cell.place("tray:7").unwrap();
    assert!((cell_7.at_m[0] - 0.41).abs() < 1e-12 && (cell_7.at_m[1] + 0.35).abs() < 1e-12, "{cell_7:?}");
    assert_eq!(cell.place("bin").unwrap().bin_m, Some([0.2, 0.15]));
    for (text, expected) in [
        ("tray", "expected tray:1 to tray:20, a cell of the tray, found \"tray\""),
        ("tray:21", "place: expected tray:1 to tray:20, a cell of the tray, found \"tray:21\""),
        ("shelf:2", "place: expected shelf, which has no cells, found \"shelf:2\""),
        ("tray:x", "expected NAME, or NAME:CELL"),
        ("box", "expected one of shelf, tray, bin, found \"box\""),
    ] {
        let error = cell.place(text).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let without = Workcell::from_toml(WHOLE).unwrap().place("a").unwrap_err().to_string();
    assert!(without.contains("a [[place]], [[tray]] or [[bin]] in the workcell file"), "{without}");
}

#[test]
fn places_that_cannot_be_name_the_line() {
    for (line, from, to, expected) in [
        (34, "[450, 300]", "[450, nan]", "at_mm: expected x and y within 1500 mm"),
        (34, "[450, 300]", "[150, 300]", "\"shelf\" is at x = 150 mm, outside the workspace of 200 to 800 mm"),
        (34, "[450, 300]", "[450, 300, 0]", "expected 2 numbers, found 3"),
        (35, "yaw_deg = 90", "yaw_deg = inf", "yaw_deg: expected a number from -360 to 360, found inf"),
        (36, "height_mm = 20", "height_mm = -5", "height_mm: expected a number from 0 to 500, found -5"),
        (36, "height_mm = 20", "height_mm = 0.02", "expected millimetres, found 0.02: metres given as millimetres?"),
        (39, "\"tray\"", "\"shelf\"", "name: expected a unique name, found a second \"shelf\""),
        (39, "\"tray\"", "\"a:b\"", "expected a name without \":\""),
        (40, "[350, -400]", "[350, -480]", "\"tray\" reaches over the table's edge: its corner is at (320, -505) mm"),
        (40, "columns = 5", "columns = 20", "\"tray\" reaches over the table's edge: its corner is at (1520, -425)"),
        (41, "columns = 5", "columns = 0", "columns: expected a whole number from 1 to 100, found 0"),
        (41, "columns = 5", "columns = 101", "columns: expected a whole number from 1 to 100, found 101"),
        (42, "rows = 4", "rows = -4", "rows: expected a whole number from 1 to 100, found -4"),
        (43, "[60, 50]", "[60, 0]", "pitch_mm: expected lengths from 5 to 1000 mm"),
        (43, "[60, 50]", "[60, nan]", "pitch_mm: expected lengths"),
        (47, "[700, 200]", "[790, 480]", "\"bin\" reaches over the table's edge"),
        (48, "size_mm", "size", "unknown field `size`"),
        (18, "y_mm = [-500, 500]", "", "table: expected x_mm and y_mm, or neither"),
    ] {
        let whole = placing();
        assert!(whole.contains(from), "{from}");
        let error = Workcell::from_toml(&whole.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(error.contains(expected) && error.starts_with(&format!("line {line}: ")), "{to}: {error}");
    }
}

const OBSTACLES: &str = r#"
[[obstacle]]
name = "fixture"
box_mm = [200, 100, 300]
at_mm = [500, 300, 150]
rpy_deg = [0, 0, 90]

[[obstacle]]
name = "post"
cylinder_mm = [40, 600]
at_mm = [300, -400, 300]

[[obstacle]]
name = "hose"
capsule_mm = [30, 230]
at_mm = [300, 400, 300]

[[obstacle]]
name = "curtain"
plane_normal = [-1, 0, 0]
at_mm = [900, 0, 0]
"#;

#[test]
fn obstacles_stand_where_the_file_says() {
    use nalgebra::Point3;
    let cell = Workcell::from_toml(&format!("{WHOLE}{OBSTACLES}")).unwrap();
    let distance_mm = |name: &str, p: [f64; 3]| {
        let obstacle = cell.obstacles.iter().find(|obstacle| obstacle.name == name).unwrap();
        let local = obstacle.base_from_obstacle.inverse() * Point3::from(p.map(|x| x * 1e-3));
        obstacle.shape.signed_distance_m(&local) * 1e3
    };
    for (name, p, expected) in [
        // Rotated by 90 degrees, the box is 100 mm wide along x.
        ("fixture", [560.0, 300.0, 150.0], 10.0),
        ("fixture", [500.0, 420.0, 150.0], 20.0),
        ("fixture", [500.0, 300.0, 305.0], 5.0),
        ("post", [350.0, -400.0, 300.0], 30.0),
        ("post", [300.0, -400.0, 610.0], 10.0),
        ("hose", [300.0, 400.0, 420.0], 5.0),
        ("curtain", [850.0, 10.0, 20.0], 50.0),
    ] {
        assert!((distance_mm(name, p) - expected).abs() < 1e-6, "{name}: {}", distance_mm(name, p));
    }
    let model = cell.collision_model(0.08).unwrap();
    let names: Vec<&str> = model.obstacles().iter().map(|obstacle| obstacle.name.as_str()).collect();
    assert_eq!(names, ["table", "fixture", "post", "hose", "curtain"]);
    assert_eq!(model.obstacles()[0].base_from_obstacle.translation.z, -0.0125);
}

#[test]
fn obstacles_that_make_no_sense_name_the_line() {
    let whole = format!("{WHOLE}{OBSTACLES}");
    for (line, from, to, expected) in [
        (32, "box_mm = [200, 100, 300]", "box_mm = [200, 0, 300]", "box_mm: expected lengths from 1 to 5000 mm"),
        (33, "at_mm = [500, 300, 150]", "at_mm = [500, nan, 150]", "at_mm: expected numbers within 3000 mm"),
        (33, "[500, 300, 150]", "[0.5, 0.3, 0.15]", "found [0.5, 0.3, 0.15]: metres given as millimetres?"),
        (34, "[0, 0, 90]", "[0, 0, 900]", "rpy_deg: expected angles from -360 to 360"),
        (37, "\"post\"", "\"fixture\"", "name: expected a unique name, found a second \"fixture\""),
        (37, "\"post\"", "\"table\"", "found a second \"table\""),
        (36, "cylinder_mm = [40, 600]", "", "expected one of box_mm, cylinder_mm"),
        (36, "cylinder_mm", "capsule_mm = [1, 2]\ncylinder_mm", "expected one of box_mm, cylinder_mm"),
        (43, "[30, 230]", "[30, 20]", "the length at least the diameter"),
        (48, "[-1, 0, 0]", "[0, 0, 0]", "plane_normal: expected a direction"),
        (48, "[-1, 0, 0]", "[1e200, 0, 0]", "plane_normal: expected a direction"),
        (48, "plane_normal", "shape", "unknown field `shape`"),
    ] {
        assert!(whole.contains(from), "{from}");
        let error = Workcell::from_toml(&whole.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(error.contains(expected) && error.starts_with(&format!("line {line}: ")), "{to}: {error}");
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
