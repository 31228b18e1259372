//! Whole grasp attempts: the success of the robot with the true pose of the part, and kinds of failure.
//!
//! `examples/oracle.rs` runs twenty attempts per part; these tests run only a few, to save time.

use std::fs;

use image::{Rgb, RgbImage};
use nalgebra::{Isometry3, Point2, Translation3, Vector2};
use sdg_geometry::{GraspLine, Polygon, RotationalSymmetry};
use sdg_robot::{
    GraspConfig, GraspOutcome, GraspStep, GraspTarget, LOOK_HEIGHT_M, PartFinder, Place, PlaceKind, PlacingConfig,
    RobotError, camera_looking_down,
};
use sdg_simulation::objects::{Extrusion, ObjectSpec};
use sdg_simulation::scene::{SceneVariation, VariationConfig};
use sdg_simulation::{
    AttemptConfig, AttemptErrors, AttemptReport, CameraView, RecordConfig, RenderConfig, SimulationError, Workcell,
    WorkcellConfig, marked_grasp,
};

/// Perception by a given function; also stores the pictures taken.
struct Looking<F> {
    find: F,
    views: Vec<CameraView>,
}

impl<F: FnMut() -> Option<GraspTarget>> Looking<F> {
    fn new(find: F) -> Self {
        Self { find, views: Vec::new() }
    }
}

impl<F: FnMut() -> Option<GraspTarget>> PartFinder<Workcell> for Looking<F> {
    fn find(&mut self, cell: &mut Workcell) -> sdg_robot::Result<Option<GraspTarget>> {
        self.views.push(cell.wrist_view()?);
        Ok((self.find)())
    }
}

/// A square bar of 20 x 20 x 120 mm and 0.2 kg, written and read as a user's own part.
fn bar() -> ObjectSpec {
    bar_of(0.2)
}

/// The bar with another mass in kilograms.
fn bar_of(mass_kg: f64) -> ObjectSpec {
    let with_mass = |text: &str| text.replace("MASS_KG", &mass_kg.to_string());
    // The folder has a unique name, because each test runs in its own process or thread.
    let folder = std::env::temp_dir().join(format!("sdg-bar-{}-{:?}", std::process::id(), std::thread::current().id()));
    fs::create_dir_all(&folder).unwrap();
    fs::write(
        folder.join("object.json"),
        with_mass(r#"{"format": 1, "name": "bar", "title": "Bar", "description": "a square bar", "mass_kg": MASS_KG, "friction": 0.6,
            "grasp_start": [-0.02, 0, 0.02], "grasp_end": [0.02, 0, 0.02], "jaw_width_m": 0.02,
            "grasp_height_m": 0.01, "mark_height_m": 0.02, "rest_height_m": 0.0, "symmetry": "none",
            "footprint": [[-0.06, -0.01], [0.06, -0.01], [0.06, 0.01], [-0.06, 0.01]], "mjcf": "object.xml"}"#),
    )
    .unwrap();
    fs::write(
        folder.join("object.xml"),
        with_mass(r#"<mujoco><worldbody><body name="object"><freejoint name="object_joint"/>
           <geom type="box" pos="0 0 0.01" size="0.06 0.01 0.01" mass="MASS_KG" friction="0.5 0.005 0.0001" rgba="0.8 0.1 0.1 1"/>
           </body></worldbody></mujoco>"#),
    )
    .unwrap();
    let spec = ObjectSpec::from_folder(&folder).unwrap();
    fs::remove_dir_all(folder).unwrap();
    spec
}

fn bar_cell(x: f64, y: f64, yaw_rad: f64) -> Workcell {
    let spec = bar();
    let pose = spec.base_from_object(x, y, yaw_rad);
    unlit_cell(SceneVariation::nominal(Some((&spec, pose))))
}

/// A workcell with fast rendering: no shadows and no antialiasing.
fn unlit_cell(scene: SceneVariation) -> Workcell {
    let wrist_render = RenderConfig { shadow_size: 0, samples: 0, ..RenderConfig::default() };
    Workcell::new(&WorkcellConfig { wrist_render, ..WorkcellConfig::new(scene) }).unwrap()
}

/// The step of a failure and the reason.
fn failure(report: AttemptReport) -> (GraspStep, String) {
    match report.outcome {
        GraspOutcome::Failed { step, why } => (step, why),
        GraspOutcome::Held => panic!("a success was not expected"),
    }
}

fn attempt(cell: &mut Workcell, find: impl FnMut() -> Option<GraspTarget>) -> (GraspStep, String) {
    failure(cell.run_attempt(&mut Looking::new(find), &AttemptConfig::default(), 1).unwrap())
}

fn true_target() -> GraspTarget {
    let spec = bar();
    marked_grasp(&spec, &spec.base_from_object(0.48, 0.05, 0.6))
}

#[test]
fn a_bar_of_known_pose_is_lifted() {
    for (x, y, yaw_rad, seed) in [(0.60, -0.15, -1.2, 2), (0.39, 0.10, 2.9, 3)] {
        let mut cell = bar_cell(x, y, yaw_rad);
        let spec = bar();
        let target = marked_grasp(&spec, &spec.base_from_object(x, y, yaw_rad));
        let mut looking = Looking::new(|| Some(target));
        let report = cell.run_attempt(&mut looking, &AttemptConfig::default(), seed).unwrap();
        assert_eq!(report.outcome, GraspOutcome::Held, "bar at ({x}, {y}) turned {yaw_rad}");
        // Lifted by 0.45 m, or by at least 0.25 m if the arm cannot reach higher.
        assert!(report.object_height_m.unwrap() > 0.2, "{:?}", report.object_height_m);
        assert_eq!((looking.views.len(), report.targets.len()), (2, 2));
        // The second picture is taken from above the part.
        let camera = looking.views[1].camera.world_from_camera.translation;
        assert!((camera.x - x).hypot(camera.y - y) < 0.003 && (camera.z - LOOK_HEIGHT_M).abs() < 0.003, "{camera}");
    }
}

#[test]
fn every_part_of_known_pose_is_lifted() {
    for name in ObjectSpec::names() {
        let spec = ObjectSpec::by_name(name).unwrap();
        // Light and table take time, and do not matter for perception without pictures.
        let config = VariationConfig { appearance: false, distractors: 0..=2, ..VariationConfig::default() };
        let scene = SceneVariation::sample(Some(&spec), &config, 101);
        let mut cell = unlit_cell(scene);
        let report = cell.run_oracle_attempt(&AttemptConfig::default(), 101).unwrap();
        assert_eq!(report.outcome, GraspOutcome::Held, "{name}");
    }
}

/// A part of 1500 kg/m³ extruded from an outline in millimetres, marked lengthwise (along x) in its middle.
fn extruded(outline_mm: &[[f64; 2]], height_mm: f64) -> ObjectSpec {
    extruded_with(outline_mm, height_mm, |_| ())
}

/// That part with a change.
fn extruded_with(outline_mm: &[[f64; 2]], height_mm: f64, change: impl FnOnce(&mut Extrusion<'_>)) -> ObjectSpec {
    let photo = RgbImage::from_pixel(80, 80, Rgb([180, 40, 40]));
    let outline = Polygon { vertices: outline_mm.iter().map(|&corner| Point2::from(corner)).collect() };
    let (bounds, half) = (outline.bounds(), Vector2::new(10.0, 0.0));
    let mut extrusion = Extrusion {
        name: "part",
        photo: &photo,
        outline: &outline,
        grasp: GraspLine::new(bounds.center() - half, bounds.center() + half),
        jaw_width_px: bounds.height(),
        metres_per_pixel: 1e-3,
        height_m: 1e-3 * height_mm,
        mass_kg: 0.0,
        friction: None,
        symmetry: RotationalSymmetry::None,
    };
    extrusion.mass_kg = 1500.0 * extrusion.volume_m3();
    change(&mut extrusion);
    ObjectSpec::extruded(&extrusion).unwrap()
}

fn rectangle_mm(length: f64, width: f64) -> [[f64; 2]; 4] {
    [[0.0, 0.0], [length, 0.0], [length, width], [0.0, width]]
}

/// Three prongs along x, 28 x 36 mm times `scale`.
fn prongs_mm(scale: f64) -> [[f64; 2]; 12] {
    [[0, 0], [28, 0], [28, 8], [4, 8], [4, 14], [28, 14], [28, 22], [4, 22], [4, 28], [28, 28], [28, 36], [0, 36]]
        .map(|corner| corner.map(|mm: i32| scale * f64::from(mm)))
}

#[test]
fn small_tall_and_forked_own_parts_are_lifted() {
    let parts = [
        ("50 x 15 x 20 mm", extruded(&rectangle_mm(50.0, 15.0), 20.0)),
        ("30 x 15 x 12 mm", extruded(&rectangle_mm(30.0, 15.0), 12.0)),
        ("three prongs", extruded(&prongs_mm(1.0), 12.0)),
    ];
    for (name, spec) in parts {
        let mut cell = unlit_cell(SceneVariation::nominal(Some((&spec, spec.base_from_object(0.48, 0.05, 0.6)))));
        let report = cell.run_oracle_attempt(&AttemptConfig::default(), 1).unwrap();
        assert_eq!(report.outcome, GraspOutcome::Held, "{name}");
    }
}

#[test]
fn a_given_friction_holds_between_the_fingers() {
    // 40 N of each finger hold 0.8 N at a friction of 0.01; the part weighs 2.9 N.
    for (friction, is_held) in [(None, true), (Some(1.0), true), (Some(0.01), false)] {
        let spec = extruded_with(&rectangle_mm(70.0, 20.0), 20.0, |extrusion| {
            extrusion.mass_kg = 0.3;
            extrusion.friction = friction;
        });
        let mut cell = unlit_cell(SceneVariation::nominal(Some((&spec, spec.base_from_object(0.48, 0.05, 0.6)))));
        let report = cell.run_oracle_attempt(&AttemptConfig::default(), 1).unwrap();
        assert_eq!(report.outcome.is_held(), is_held, "{friction:?}: {:?}", report.outcome);
    }
}

#[test]
fn a_forked_own_part_fits_among_six_distractors() {
    let config = VariationConfig { appearance: false, distractors: 6..=6, ..VariationConfig::default() };
    let scene = SceneVariation::sample(Some(&extruded(&prongs_mm(2.0), 12.0)), &config, 1);
    assert!(scene.distractors.len() >= 4, "{}", scene.distractors.len());
    unlit_cell(scene);
}

#[test]
fn the_same_seed_gives_the_same_attempt_and_another_start_another() {
    let mut cell = bar_cell(0.48, 0.05, 0.6);
    let mut run = |seed| {
        let mut looking = Looking::new(|| None);
        let report = cell.run_attempt(&mut looking, &AttemptConfig::default(), seed).unwrap();
        (report, looking.views)
    };
    let ((one, views), (again, again_views), (other, _)) = (run(5), run(5), run(6));
    assert_eq!(views, again_views);
    assert_eq!(one.simulated_secs, again.simulated_secs);
    assert_ne!(one.simulated_secs, other.simulated_secs);
}

#[test]
fn nothing_seen_is_a_failure_to_detect() {
    let mut cell = bar_cell(0.48, 0.05, 0.6);
    let report = cell.run_attempt(&mut Looking::new(|| None), &AttemptConfig::default(), 1).unwrap();
    assert!(report.found_nothing);
    let (step, why) = failure(report);
    assert_eq!((step, why.as_str()), (GraspStep::Detect, "the part was not found in 3 looks"));

    let mut looks = 0;
    let (step, why) = attempt(&mut cell, || {
        looks += 1;
        (looks == 1).then(true_target)
    });
    assert_eq!((step, why.as_str()), (GraspStep::Detect, "the part was not found in 3 looks from above it"));
}

#[test]
fn who_does_not_find_the_part_looks_from_elsewhere() {
    let mut cell = bar_cell(0.48, 0.05, 0.6);
    let mut looks = 0;
    let mut blind_twice = Looking::new(|| {
        looks += 1;
        // The part is not found in the first picture, and not in the first one from above.
        (looks != 1 && looks != 3).then(true_target)
    });
    let report = cell.run_attempt(&mut blind_twice, &AttemptConfig::default(), 1).unwrap();
    assert_eq!(report.outcome, GraspOutcome::Held);
    assert_eq!(report.looks, [2, 2]);
    let places: Vec<_> =
        blind_twice.views.iter().map(|view| view.camera.world_from_camera.translation.vector.xy()).collect();
    assert_eq!(places.len(), 4);
    assert!((places[0] - places[1]).norm() > 0.09 && (places[2] - places[3]).norm() > 0.03, "{places:?}");
}

#[test]
fn the_second_look_may_be_less_sure_of_what_the_first_one_saw() {
    let mut cell = bar_cell(0.48, 0.05, 0.6);
    let mut looking = |second: GraspTarget| {
        let mut looks = 0;
        let mut finder = Looking::new(|| {
            looks += 1;
            Some(if looks == 1 { true_target() } else { second })
        });
        cell.run_attempt(&mut finder, &AttemptConfig::default(), 1).unwrap()
    };
    let unsure = GraspTarget { score: 0.3, ..true_target() };
    assert_eq!(looking(unsure).outcome, GraspOutcome::Held);
    let elsewhere = Translation3::new(0.0, 0.05, 0.0) * unsure.base_from_tcp;
    for other in [GraspTarget { base_from_tcp: elsewhere, ..unsure }, GraspTarget { score: 0.1, ..unsure }] {
        assert_eq!(failure(looking(other)).0, GraspStep::Detect);
    }
}

#[test]
fn a_part_wider_than_the_hand_is_refused() {
    let mut cell = bar_cell(0.48, 0.05, 0.6);
    let mut wide = Looking::new(|| Some(GraspTarget { jaw_width_m: 0.095, ..true_target() }));
    let report = cell.run_attempt(&mut wide, &AttemptConfig::default(), 1).unwrap();
    assert!(!report.found_nothing);
    let (step, why) = failure(report);
    assert_eq!((step, why.as_str()), (GraspStep::Detect, "the part is 95 mm wide, the hand opens 80 mm"));
}

#[test]
fn a_target_out_of_reach_is_a_failure_to_hover() {
    let mut cell = bar_cell(0.48, 0.05, 0.6);
    let (step, why) = attempt(&mut cell, || {
        let far = Isometry3::from_parts(Translation3::new(1.4, 0.2, 0.01), true_target().base_from_tcp.rotation);
        Some(GraspTarget { base_from_tcp: far, ..true_target() })
    });
    assert_eq!(step, GraspStep::Hover);
    assert!(why.starts_with("the camera cannot be moved above the part at (1.40, 0.20) m"), "{why}");
}

#[test]
fn a_target_beside_the_part_closes_on_nothing() {
    let mut cell = bar_cell(0.48, 0.05, 0.6);
    let (step, why) = attempt(&mut cell, || {
        let beside = Translation3::new(-0.05, -0.15, 0.0) * true_target().base_from_tcp;
        Some(GraspTarget { base_from_tcp: beside, ..true_target() })
    });
    assert_eq!(step, GraspStep::Close);
    assert!(why.contains("without touching the part"), "{why}");
}

#[test]
fn the_true_pose_decides_whether_a_part_is_in_its_bin() {
    let mut cell = bar_cell(0.48, 0.05, 0.6);
    let kind = PlaceKind::Bin { size_m: [0.010, 0.010] };
    let bin = Place { name: "bin".to_owned(), at_m: [0.45, -0.25], yaw_rad: 0.0, surface_m: 0.0, kind };
    let goal = bin.goal(1).unwrap();
    // The bar is detected 12 mm beside its marks, and after it was put down in the middle of the bin.
    let beside = true_target().base_from_tcp * Translation3::new(0.012, 0.0, 0.0);
    let mut looks = 0;
    let mut wrong = Looking::new(|| {
        looks += 1;
        let base_from_tcp = if looks <= 2 { beside } else { goal.base_from_part(0.01, 0.0) };
        Some(GraspTarget { base_from_tcp, ..true_target() })
    });
    let config = AttemptConfig { placing: Some((goal.clone(), PlacingConfig::default())), ..AttemptConfig::default() };
    let (step, why) = failure(cell.run_attempt(&mut wrong, &config, 1).unwrap());
    assert_eq!(step, GraspStep::Check, "{why}");
    assert!(why.starts_with("the part really lies ") && why.ends_with(" mm outside the bin"), "{why}");
}

struct Broken;

impl PartFinder<Workcell> for Broken {
    fn find(&mut self, _cell: &mut Workcell) -> sdg_robot::Result<Option<GraspTarget>> {
        Err(RobotError::Perception("the model file is gone".into()))
    }
}

#[test]
fn perception_that_breaks_is_an_error_and_not_a_failed_grasp() {
    let mut cell = bar_cell(0.48, 0.05, 0.6);
    let error = cell.run_attempt(&mut Broken, &AttemptConfig::default(), 1).unwrap_err();
    assert_eq!(error, SimulationError::Perception("the model file is gone".into()));
}

#[test]
fn the_wrist_camera_stands_where_it_is_told_with_the_fingers_out_of_view() {
    let mut cell = bar_cell(0.48, 0.05, 0.6);
    let wanted = camera_looking_down(0.5, 0.1, 0.55, 0.4);
    let view = cell.view_from(&wanted).unwrap();
    let miss = wanted.inverse() * view.camera.world_from_camera;
    assert!(miss.translation.vector.norm() < 1e-5 && miss.rotation.angle() < 1e-5);
    let model = cell.data().model().clone();
    let segmentation = cell.wrist_segmentation().unwrap();
    let own = segmentation.pixels_where(|geom| {
        let body = model.name(model.body_of(geom)).unwrap_or_default();
        body == "hand" || body.ends_with("_finger")
    });
    assert_eq!(own.count(), 0);
    assert!(cell.view_from(&camera_looking_down(2.0, 0.0, 0.5, 0.0)).is_err());
}

#[test]
fn a_recording_has_a_picture_for_each_period() {
    let mut cell = bar_cell(0.48, 0.05, 0.6);
    let record = RecordConfig {
        period_secs: 0.25,
        render: RenderConfig { width: 64, height: 48, shadow_size: 0, samples: 0, ..RenderConfig::default() },
    };
    let config = AttemptConfig { record: Some(record), ..AttemptConfig::default() };
    let report = cell.run_attempt(&mut Looking::new(|| None), &config, 1).unwrap();
    let expected = report.simulated_secs / 0.25;
    assert!((report.frames.len() as f64 - expected).abs() <= 1.0, "{} frames in {expected}", report.frames.len());
    assert!(report.frames.iter().all(|frame| frame.dimensions() == (64, 48)));
}

/// A cell with a bar and errors, with fast rendering.
fn bar_cell_with(errors: AttemptErrors, mass_kg: f64) -> Workcell {
    let spec = bar_of(mass_kg);
    let scene = SceneVariation::nominal(Some((&spec, spec.base_from_object(0.48, 0.05, 0.6))));
    let wrist_render = RenderConfig { shadow_size: 0, samples: 0, ..RenderConfig::default() };
    Workcell::new(&WorkcellConfig { wrist_render, errors, ..WorkcellConfig::new(scene) }).unwrap()
}

#[test]
fn a_wrong_hand_eye_calibration_changes_the_told_place_of_the_camera_and_nothing_else() {
    let run = |errors| {
        let mut cell = bar_cell_with(errors, 0.2);
        let mut sure = Looking::new(|| Some(true_target()));
        let report = cell.run_attempt(&mut sure, &AttemptConfig::default(), 5).unwrap();
        (report, sure.views, cell.told_flange_from_camera())
    };
    let (without, views, true_place) = run(AttemptErrors::default());
    let (with, views_with, told_place) = run(AttemptErrors::hand_eye(5));
    assert_eq!((without.outcome, without.looks), (GraspOutcome::Held, [1, 1]));
    assert_eq!(without.shake_amplitude_m, None);
    // The motion of the robot is the same, bit for bit.
    assert_eq!(without.simulated_secs, with.simulated_secs);
    assert_eq!(without.object_height_m, with.object_height_m);
    assert_eq!(views, views_with);
    let told = true_place.inverse() * told_place;
    assert!((told.translation.vector.norm() - 0.002).abs() < 1e-9, "{told}");
    assert!((told.rotation.angle().to_degrees() - 0.5).abs() < 1e-6, "{told}");
}

#[test]
fn worn_pads_and_a_shake_ask_for_more_force() {
    let run = |errors, mass_kg, grasp_force_n| {
        let config = AttemptConfig {
            grasp: GraspConfig { grasp_force_n, ..GraspConfig::default() },
            ..AttemptConfig::default()
        };
        bar_cell_with(errors, mass_kg).run_oracle_attempt(&config, 5).unwrap()
    };
    let worn = AttemptErrors { pad_friction: Some(0.6), ..AttemptErrors::default() };
    let held = run(AttemptErrors { shake: AttemptErrors::shake(1).shake, ..worn }, 0.2, 40.0);
    assert_eq!(held.outcome, GraspOutcome::Held);
    // The arm's limits may reduce the requested 20 to 30 mm.
    let amplitude_m = held.shake_amplitude_m.unwrap();
    assert!((0.010..=0.030).contains(&amplitude_m), "{amplitude_m}");
    // A bar of 1.2 kg weighs 11.8 N. Two new pads pressed with 8 N hold 16 N; worn ones hold 2 * 0.6 * 8 N = 9.6 N.
    assert_eq!(run(AttemptErrors::default(), 1.2, 8.0).outcome, GraspOutcome::Held);
    let (step, why) = failure(run(worn, 1.2, 8.0));
    assert!(matches!(step, GraspStep::Lift | GraspStep::Hold), "{step}: {why}");
}
