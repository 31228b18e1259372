use super::*;
use crate::arm_state::{ArmMode, ArmState, ContactSensitivity, HandState, MotionEnd};
use crate::error::RobotError;
use crate::height::{HeightSource, SettledHeight};
use crate::pace::Pace;
use crate::part_shape::PartShape;
use crate::place::PlaceKind;
use crate::planned_arm::{PlannedAction, PlannedArm};
use crate::safety::{CheckedMotion, SafetyLimits, WorkspaceBox};
use crate::sequence::{LookOut, grasp};
use crate::watch::{StopReason, Watch};
use sdg_kinematics::collision::{Obstacle, Shape};
use sdg_kinematics::{ArmGeometry, ready_pose};
use std::time::{Duration, Instant};

/// A planned arm with a part that slides by `slide`, in the part's frame, when the hand closes on it, and stays where
/// it is released.
struct Cell {
    arm: PlannedArm,
    base_from_part: Isometry3<f64>,
    slide: Isometry3<f64>,
    tcp_from_part: Option<Isometry3<f64>>,
    loads_kg: Vec<f64>,
    touches: bool,
    mode: ArmMode,
    /// Time until the arm returns the next state.
    delay: Duration,
    /// Distance of the contact below the expected one, m.
    lower_m: f64,
    num_stops: usize,
}

impl Cell {
    fn tcp(&mut self) -> Isometry3<f64> {
        ArmGeometry::panda().forward(&self.arm.state().unwrap().q)
    }
}

impl Arm for Cell {
    fn geometry(&self) -> &ArmGeometry {
        self.arm.geometry()
    }

    fn state(&mut self) -> Result<ArmState> {
        std::thread::sleep(std::mem::take(&mut self.delay));
        Ok(ArmState { mode: self.mode, ..self.arm.state()? })
    }
    fn follow(&mut self, motion: &CheckedMotion, watch: &mut Watch) -> Result<MotionEnd> {
        self.arm.follow(motion, watch)
    }
    fn wait(&mut self, duration_secs: f64, watch: &mut Watch) -> Result<()> {
        self.arm.wait(duration_secs, watch)
    }
    fn hand(&mut self) -> Result<HandState> {
        self.arm.hand()
    }
    fn start_hand(&mut self, command: HandCommand) -> Result<()> {
        let tcp = self.tcp();
        match (command, self.tcp_from_part) {
            (HandCommand::Grasp { .. }, _) => {
                self.tcp_from_part = Some(tcp.inverse() * self.base_from_part * self.slide);
            }
            (HandCommand::Move { .. }, Some(tcp_from_part)) => {
                self.base_from_part = tcp * tcp_from_part;
                self.tcp_from_part = None;
            }
            (HandCommand::Move { .. }, None) => {}
        }
        self.arm.start_hand(command)
    }
    fn finish_hand(&mut self, watch: &mut Watch) -> Result<HandState> {
        self.arm.finish_hand(watch)
    }
    fn set_contact_sensitivity(&mut self, sensitivity: ContactSensitivity) -> Result<()> {
        self.arm.set_contact_sensitivity(sensitivity)
    }
    fn set_load(&mut self, load: Load) -> Result<()> {
        self.loads_kg.push(load.mass_kg);
        Ok(())
    }
    fn stop(&mut self) -> Result<()> {
        self.num_stops += 1;
        Ok(())
    }
    fn recover(&mut self) -> Result<()> {
        Ok(())
    }
}

impl CompliantArm for Cell {
    fn touch_down(&mut self, touch_down: &TouchDown, watch: &mut Watch) -> Result<Touched> {
        let below_table_m = touch_down.below_table_m - self.lower_m;
        let touched = self.arm.touch_down(&TouchDown { below_table_m, ..*touch_down }, watch)?;
        Ok(Touched { is_contact: self.touches, ..touched })
    }
}

struct Truth;

impl PartFinder<Cell> for Truth {
    fn find(&mut self, cell: &mut Cell) -> Result<Option<GraspTarget>> {
        Ok(Some(GraspTarget { base_from_tcp: cell.base_from_part, jaw_width_m: 0.02, score: 0.9 }))
    }
}

fn lying(x: f64, y: f64, yaw_rad: f64) -> Isometry3<f64> {
    let place = Place { name: "p".to_owned(), at_m: [x, y], yaw_rad, surface_m: 0.0, kind: PlaceKind::Pose };
    place.goal(1).unwrap().base_from_part(0.02, 0.0)
}

fn cell(slide: Isometry3<f64>) -> Cell {
    Cell {
        arm: PlannedArm::new(ArmGeometry::panda(), ready_pose(), 0.08),
        base_from_part: lying(0.5, 0.1, 0.4),
        slide,
        tcp_from_part: None,
        loads_kg: Vec::new(),
        touches: true,
        mode: ArmMode::Idle,
        delay: Duration::ZERO,
        lower_m: 0.0,
        num_stops: 0,
    }
}

fn tray() -> Place {
    let kind = PlaceKind::Tray { cells: [2, 2], pitch_m: [0.08, 0.08] };
    Place { name: "tray".to_owned(), at_m: [0.4, -0.3], yaw_rad: 1.0, surface_m: 0.0, kind }
}

fn config() -> GraspConfig {
    let load = Load { mass_kg: 0.3, center_in_flange_m: [0.0, 0.0, 0.1] };
    GraspConfig {
        look_outs: vec![LookOut::Joints(ready_pose())],
        pace: Pace::at_speed(0.3).unwrap(),
        load: Some(load),
        ..GraspConfig::default()
    }
}

fn run(cell: &mut Cell, config: &GraspConfig, goal: &PlaceGoal, placing: &PlacingConfig) -> PlacingReport {
    let mut robot = Robot::new(cell, SafetyLimits::default(), Watch::default());
    grasp_and_place(&mut robot, &mut Truth, &mut (), CameraPose::InBase(Isometry3::identity()), config, goal, placing)
        .unwrap()
}

fn planar(x: f64, y: f64, angle_rad: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(x, y, 0.0), UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle_rad))
}

#[test]
fn a_part_lies_where_it_was_to_lie() {
    for number in 1..=4 {
        let mut cell = cell(Isometry3::identity());
        let goal = tray().goal(number).unwrap();
        let report = run(&mut cell, &config(), &goal, &PlacingConfig::default());
        assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
        assert_eq!(report.touched.len(), 1);
        let error = beside(&goal.base_from_part(0.02, 0.0), &cell.base_from_part, RotationalSymmetry::None);
        assert!(error.distance_m() < 1e-4 && error.angle_rad.abs() < 1e-4, "{error:?}");
        assert!((cell.base_from_part.translation.z - 0.02).abs() < 1e-4, "{}", cell.base_from_part);
        // The load is set while the part is held, and reset before and afterwards.
        assert_eq!(cell.loads_kg, [0.0, 0.3, 0.0]);
    }
}

#[test]
fn a_lift_is_shortened_until_it_stays_in_the_workspace() {
    let above = Isometry3::translation(0.0, 0.0, 0.3) * lying(0.45, -0.1, 0.0);
    let low = ArmGeometry::panda().inverse(&above, &ready_pose(), &Default::default()).unwrap().q;
    let workspace = WorkspaceBox { min_m: Vector3::repeat(-1.0), max_m: Vector3::new(1.0, 1.0, 0.5) };
    let limits = SafetyLimits { workspace: Some(workspace), ..SafetyLimits::default() };
    let config = GraspConfig { look_outs: vec![LookOut::Joints(low)], ..config() };
    let mut cell = cell(Isometry3::identity());
    cell.arm = PlannedArm::new(ArmGeometry::panda(), low, 0.08);
    let mut robot = Robot::new(&mut cell, limits, Watch::default());
    let camera = CameraPose::InBase(Isometry3::identity());
    let report = grasp(&mut robot, &mut Truth, &mut (), camera, &config).unwrap();
    assert_eq!(report.outcome, GraspOutcome::Held);
    // Instead of 0.45 m above the grasp: the flange is 0.10 m higher than the tcp.
    assert!((cell.tcp().translation.z - 0.37).abs() < 1e-4, "{}", cell.tcp());
}

/// Finds nothing; a person presses the stop button during the first picture.
struct Stopped;

impl PartFinder<Cell> for Stopped {
    fn find(&mut self, cell: &mut Cell) -> Result<Option<GraspTarget>> {
        cell.mode = ArmMode::UserStopped;
        Ok(None)
    }
}

#[test]
fn a_stop_between_two_pictures_ends_the_sequence() {
    let mut cell = cell(Isometry3::identity());
    let mut robot = Robot::new(&mut cell, SafetyLimits::default(), Watch::default());
    let config = GraspConfig { look_outs: vec![LookOut::Joints(ready_pose()); 2], ..config() };
    let ended = grasp(&mut robot, &mut Stopped, &mut (), CameraPose::InBase(Isometry3::identity()), &config);
    assert!(matches!(ended, Err(RobotError::Stopped(StopReason::Mode(ArmMode::UserStopped)))), "{ended:?}");
}

#[test]
fn a_stop_between_the_hand_and_the_arm_stops_the_fingers() {
    let mut cell = cell(Isometry3::identity());
    let mut num_asked = 0;
    let watch = Watch::new(Box::new(move || {
        num_asked += 1;
        (num_asked > 1).then_some(StopReason::Interrupted)
    }));
    let mut robot = Robot::new(&mut cell, SafetyLimits::default(), watch);
    let motion = robot.plan_free(&ready_pose(), &sdg_kinematics::JointLimits::panda()).unwrap();
    robot.start_hand(HandCommand::Move { opening_m: 0.04, speed_m_s: RELEASING_SPEED_M_S }).unwrap();
    let ended = robot.follow(motion.clone());
    assert!(matches!(ended, Err(RobotError::Stopped(StopReason::Interrupted))), "{ended:?}");
    assert!(matches!(robot.follow(motion), Err(RobotError::Latched(_))));
    assert_eq!(cell.num_stops, 1);
}

/// Finds the part; planning with each picture takes at least this much longer than [`MAX_AGE`].
struct SlowlyPlanned {
    longer: Duration,
    taken: Option<Instant>,
}

const MAX_AGE: Duration = Duration::from_millis(50);
/// More than the second by which planning may take longer.
const TOO_LONG: Duration = Duration::from_millis(1010);

impl SlowlyPlanned {
    fn new(longer: Duration) -> Self {
        Self { longer, taken: None }
    }
}

impl PartFinder<Cell> for SlowlyPlanned {
    fn find(&mut self, cell: &mut Cell) -> Result<Option<GraspTarget>> {
        (self.taken, cell.delay) = (Some(Instant::now()), MAX_AGE + self.longer);
        Truth.find(cell)
    }

    fn picture_time(&self) -> Option<Instant> {
        self.taken
    }
}

#[test]
fn a_picture_that_becomes_too_old_during_planning_starts_no_motion() {
    let mut cell = cell(Isometry3::identity());
    let mut robot = Robot::new(&mut cell, SafetyLimits::default(), Watch::default());
    let config = GraspConfig { max_detection_age_secs: MAX_AGE.as_secs_f64(), ..config() };
    let camera = CameraPose::InBase(Isometry3::identity());
    let report = grasp(&mut robot, &mut SlowlyPlanned::new(TOO_LONG), &mut (), camera, &config).unwrap();
    let GraspOutcome::Failed { step: GraspStep::Detect, why } = &report.outcome else { panic!("{report:?}") };
    assert!(why.starts_with("the detection is "), "{why}");
    assert!(!cell.arm.actions().iter().any(|action| matches!(action, PlannedAction::Hand(_))));
}

#[test]
fn planning_the_way_to_above_the_part_may_take_a_second_and_not_more() {
    let obstacle = Obstacle {
        name: "box".to_owned(),
        shape: Shape::Box { half_m: [0.05; 3] },
        base_from_obstacle: Isometry3::translation(0.45, -0.45, 0.05),
    };
    let config = GraspConfig { max_detection_age_secs: MAX_AGE.as_secs_f64(), obstacles: vec![obstacle], ..config() };
    let tcp_from_camera = Isometry3::translation(0.072, 0.0, -0.0534);
    let camera = CameraPose::OnFlange(ArmGeometry::panda().flange_from_tcp() * tcp_from_camera);
    for (longer, is_allowed) in [(Duration::from_millis(20), true), (TOO_LONG, false)] {
        let mut cell = cell(Isometry3::identity());
        let mut robot = Robot::new(&mut cell, SafetyLimits::default(), Watch::default());
        let report = grasp(&mut robot, &mut SlowlyPlanned::new(longer), &mut (), camera, &config).unwrap();
        let has_moved = (cell.arm.state().unwrap().q - ready_pose()).amax() > 1e-3;
        assert_eq!(has_moved, is_allowed, "{report:?}");
    }
}

/// Finds the part, but after it was put down, the part at this pose.
struct Neighbour(Isometry3<f64>);

impl PartFinder<Cell> for Neighbour {
    fn find(&mut self, cell: &mut Cell) -> Result<Option<GraspTarget>> {
        Truth.find(cell)
    }

    fn find_nearest(&mut self, _cell: &mut Cell, _base_from_tcp: &Isometry3<f64>) -> Result<Option<GraspTarget>> {
        Ok(Some(GraspTarget { base_from_tcp: self.0, jaw_width_m: 0.02, score: 0.9 }))
    }
}

#[test]
fn a_part_in_the_next_cell_of_a_narrow_tray_is_not_the_one_put_down() {
    let kind = PlaceKind::Tray { cells: [2, 2], pitch_m: [0.028, 0.08] };
    let [goal, next] = [1, 2].map(|number| Place { kind, ..tray() }.goal(number).unwrap());
    let mut finder = Neighbour(next.base_from_part(0.02, 0.0));
    let mut cell = cell(Isometry3::identity());
    let mut robot = Robot::new(&mut cell, SafetyLimits::default(), Watch::default());
    let (camera, config) = (CameraPose::InBase(Isometry3::identity()), config());
    let report =
        grasp_and_place(&mut robot, &mut finder, &mut (), camera, &config, &goal, &PlacingConfig::default()).unwrap();
    let PlacingOutcome::Failed { step: GraspStep::Check, why } = &report.outcome else { panic!("{report:?}") };
    assert!(why.contains("the part is not seen where it was put down"), "{why}");
    let is_grasp = |action: &&PlannedAction| matches!(action, PlannedAction::Hand(HandCommand::Grasp { .. }));
    assert_eq!(cell.arm.actions().iter().filter(is_grasp).count(), 1);
}

/// Records the steps that begin.
struct Begun(Vec<GraspStep>);

impl StepObserver<Cell> for Begun {
    fn before(&mut self, _arm: &mut Cell, step: GraspStep) -> Result<()> {
        self.0.push(step);
        Ok(())
    }
}

/// Records the loads that were set before the first step.
struct FirstLoads(Option<Vec<f64>>);

impl StepObserver<Cell> for FirstLoads {
    fn before(&mut self, cell: &mut Cell, _step: GraspStep) -> Result<()> {
        self.0.get_or_insert_with(|| cell.loads_kg.clone());
        Ok(())
    }
}

#[test]
fn the_load_of_an_earlier_program_is_reset_before_anything_moves() {
    let mut cell = cell(Isometry3::identity());
    cell.loads_kg.push(0.5);
    let (mut first, camera) = (FirstLoads(None), CameraPose::InBase(Isometry3::identity()));
    let mut robot = Robot::new(&mut cell, SafetyLimits::default(), Watch::default());
    // Also if this workcell names no mass.
    let config = GraspConfig { load: None, ..config() };
    grasp(&mut robot, &mut Truth, &mut first, camera, &config).unwrap();
    assert_eq!(first.0, Some(vec![0.5, 0.0]));
}

#[test]
fn an_observer_is_called_before_each_step() {
    use GraspStep::{Approach, Carry, Check, Close, Detect, Hold, Lift, PutDown, Release};
    let mut cell = cell(Isometry3::identity());
    let mut begun = Begun(Vec::new());
    let mut robot = Robot::new(&mut cell, SafetyLimits::default(), Watch::default());
    let camera = CameraPose::InBase(Isometry3::identity());
    let (config, goal, placing) = (config(), tray().goal(1).unwrap(), PlacingConfig::default());
    grasp_and_place(&mut robot, &mut Truth, &mut begun, camera, &config, &goal, &placing).unwrap();
    assert_eq!(begun.0, [Detect, Approach, Close, Lift, Hold, Carry, PutDown, Release, Check]);
}

#[test]
fn a_part_that_slides_in_the_hand_is_taken_again_and_lies_right() {
    let slide = planar(0.005, 0.001, 0.08);
    let mut cell = cell(slide);
    let goal = tray().goal(2).unwrap();
    let report = run(&mut cell, &config(), &goal, &PlacingConfig::default());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
    assert_eq!(report.errors.len(), 2);
    assert!(report.errors[0].distance_m() > 0.004 && report.errors[1].distance_m() < 2e-4, "{report:?}");
    assert_eq!(report.last, Some(report.errors[1]));
    // Without a second grasp the part lies beside its place, which is reported.
    let mut once = super::tests::cell(slide);
    let never = PlacingConfig { max_corrections: 0, ..PlacingConfig::default() };
    let PlacingOutcome::Failed { step: GraspStep::Check, why } = run(&mut once, &config(), &goal, &never).outcome
    else {
        panic!("{:?}", once.base_from_part)
    };
    assert!(why.contains("5.1 mm and 4.6° beside its place, at most 3.0 mm and 3.0°"), "{why}");
}

/// Finds the part at its place only in the first of the pictures.
struct SeenOnce(bool);

impl PartFinder<Cell> for SeenOnce {
    fn find(&mut self, cell: &mut Cell) -> Result<Option<GraspTarget>> {
        Truth.find(cell)
    }

    fn find_nearest(&mut self, cell: &mut Cell, _base_from_tcp: &Isometry3<f64>) -> Result<Option<GraspTarget>> {
        if std::mem::replace(&mut self.0, true) { Ok(None) } else { Truth.find(cell) }
    }
}

#[test]
fn an_offset_before_a_failed_correction_is_not_the_last_one() {
    let mut cell = cell(planar(0.005, 0.001, 0.08));
    let mut robot = Robot::new(&mut cell, SafetyLimits::default(), Watch::default());
    let camera = CameraPose::InBase(Isometry3::identity());
    let (config, goal, placing) = (config(), tray().goal(2).unwrap(), PlacingConfig::default());
    let report = grasp_and_place(&mut robot, &mut SeenOnce(false), &mut (), camera, &config, &goal, &placing).unwrap();
    assert!(matches!(report.outcome, PlacingOutcome::Failed { step: GraspStep::Check, .. }), "{report:?}");
    assert!(report.errors.len() == 1 && report.last.is_none(), "{report:?}");
}

#[test]
fn a_part_that_slides_is_taken_again_from_a_raised_place_at_its_measured_height() {
    let goal = Place { surface_m: 0.03, ..tray() }.goal(2).unwrap();
    for lower_m in [0.0, 0.005, -0.005] {
        let mut cell = Cell { lower_m, ..cell(planar(0.005, 0.001, 0.08)) };
        let report = run(&mut cell, &config(), &goal, &PlacingConfig::default());
        assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
        assert_eq!(report.errors.len(), 2);
        // A second grasp at the expected height would hold the part 5 mm too high or too low.
        assert!((cell.base_from_part.translation.z - (0.05 - lower_m)).abs() < 1e-4, "{}", cell.base_from_part);
    }
}

/// Finds the part; records the height (m) at which it was searched in its place.
struct SearchedAt(f64);

impl PartFinder<Cell> for SearchedAt {
    fn find(&mut self, cell: &mut Cell) -> Result<Option<GraspTarget>> {
        Truth.find(cell)
    }

    fn find_nearest(&mut self, cell: &mut Cell, base_from_tcp: &Isometry3<f64>) -> Result<Option<GraspTarget>> {
        self.0 = base_from_tcp.translation.z;
        Truth.find(cell)
    }
}

#[test]
fn a_part_is_searched_at_the_height_of_the_contact_if_its_height_was_measured() {
    let camera = CameraPose::InBase(Isometry3::identity());
    let goal = Place { surface_m: 0.03, ..tray() }.goal(1).unwrap();
    let (config, placing) = (config(), PlacingConfig::default());
    // A contact within 2 mm of the expected one counts as that. A lower one may also be caused by a part that lay on a
    // higher surface than assumed, unless the height was measured there.
    for (lower_m, source, expected_m) in [
        (0.001, HeightSource::Measured, 0.05),
        (0.006, HeightSource::Measured, 0.044),
        (0.006, HeightSource::Told, 0.05),
    ] {
        let mut cell = Cell { lower_m, ..cell(Isometry3::identity()) };
        let mut robot = Robot::new(&mut cell, SafetyLimits::default(), Watch::default());
        let (mut finder, mut begun) = (SearchedAt(f64::NAN), Begun(Vec::new()));
        let mut sequence = Sequence::yielding(&mut robot, &mut finder, &mut begun, camera, &config);
        let outcome = sequence.grasp(|_, _| Ok(())).unwrap();
        let settled = SettledHeight { height_m: 0.02, sigma_m: 0.001, source };
        let height = Some(HeightReport { settled: Some(settled), ..HeightReport::default() });
        let mut report = PlacingReport::of(GraspReport { height, ..sequence.grasp_report(outcome) });
        assert!(sequence.place(&goal, &placing, &mut report).is_ok(), "{report:?}");
        assert!((finder.0 - expected_m).abs() < 1e-4, "{source:?}: {}", finder.0);
    }
}

#[test]
fn a_part_that_touches_an_object_above_its_place_is_kept() {
    let mut onto = Cell { lower_m: -0.012, ..cell(Isometry3::identity()) };
    let report = run(&mut onto, &config(), &tray().goal(1).unwrap(), &PlacingConfig::default());
    let PlacingOutcome::Failed { step: GraspStep::PutDown, why } = &report.outcome else { panic!("{report:?}") };
    assert_eq!(why, "the contact was 12 mm above the place, at most 10 mm are allowed; the part is still held");
    assert_eq!(onto.loads_kg, [0.0, 0.3]);
    // In a bin it may be another part.
    let bin = Place { kind: PlaceKind::Bin { size_m: [0.1, 0.1] }, ..tray() };
    let mut onto = Cell { lower_m: -0.012, ..cell(Isometry3::identity()) };
    let report = run(&mut onto, &config(), &bin.goal(1).unwrap(), &PlacingConfig::default());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
}

/// An obstacle 30 mm high under the first cell of the tray.
fn shelf() -> Obstacle {
    Obstacle {
        name: "shelf".to_owned(),
        shape: Shape::Box { half_m: [0.1, 0.1, 0.015] },
        base_from_obstacle: Isometry3::translation(0.4, -0.3, 0.015),
    }
}

#[test]
fn a_low_part_is_put_onto_an_obstacle_and_taken_from_it() {
    let place =
        |at_m: [f64; 2], surface_m: f64| Place { at_m, surface_m, kind: PlaceKind::Pose, ..tray() }.goal(1).unwrap();
    let mut cell = cell(Isometry3::identity());
    cell.base_from_part.translation.z = 0.008;
    let onto = GraspConfig { obstacles: vec![shelf()], ..config() };
    let report = run(&mut cell, &onto, &place([0.4, -0.3], 0.03), &PlacingConfig::default());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
    assert!((cell.base_from_part.translation.z - 0.038).abs() < 1e-4, "{}", cell.base_from_part);
    let from = GraspConfig { surface_m: Some(0.03), ..onto };
    let report = run(&mut cell, &from, &place([0.5, 0.1], 0.0), &PlacingConfig::default());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
}

#[test]
fn a_low_part_that_slides_is_taken_again_from_an_obstacle_of_another_height() {
    let goal = Place { surface_m: 0.03, kind: PlaceKind::Pose, ..tray() }.goal(1).unwrap();
    let onto = GraspConfig { obstacles: vec![shelf()], ..config() };
    for lower_m in [0.005, -0.005] {
        let mut cell = Cell { lower_m, ..cell(planar(0.005, 0.001, 0.08)) };
        cell.base_from_part.translation.z = 0.008;
        let report = run(&mut cell, &onto, &goal, &PlacingConfig::default());
        assert_eq!((&report.outcome, report.errors.len()), (&PlacingOutcome::Placed, 2), "{report:?}");
        assert!((cell.base_from_part.translation.z - (0.038 - lower_m)).abs() < 1e-4, "{}", cell.base_from_part);
    }
}

#[test]
fn a_part_on_a_raised_surface_is_put_down_onto_a_lower_one() {
    let mut cell = cell(Isometry3::identity());
    cell.base_from_part.translation.z = 0.04;
    let config = GraspConfig { surface_m: Some(0.02), ..config() };
    let report = run(&mut cell, &config, &tray().goal(1).unwrap(), &PlacingConfig::default());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
    assert!((cell.base_from_part.translation.z - 0.02).abs() < 1e-4, "{}", cell.base_from_part);
}

#[test]
fn turns_that_cannot_be_seen_do_not_count() {
    let mut cell = cell(Isometry3::identity());
    let place = Place { yaw_rad: 0.4 + std::f64::consts::PI - 0.2, ..tray() };
    let placing = PlacingConfig { symmetry: RotationalSymmetry::Fold(2), ..PlacingConfig::default() };
    let goal = place.goal(1).unwrap();
    let report = run(&mut cell, &config(), &goal, &placing);
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
    let error = beside(&goal.base_from_part(0.0, 0.0), &cell.base_from_part, placing.symmetry);
    assert!(error.angle_rad.abs() < 1e-4, "{error:?}");
}

#[test]
fn where_nothing_is_felt_the_part_stays_in_the_hand() {
    let mut cell = cell(Isometry3::identity());
    cell.touches = false;
    let report = run(&mut cell, &config(), &tray().goal(1).unwrap(), &PlacingConfig::default());
    let PlacingOutcome::Failed { step: GraspStep::PutDown, why } = &report.outcome else { panic!("{report:?}") };
    assert!(why.contains("no contact was measured") && why.contains("still held"), "{why}");
    assert_eq!(cell.loads_kg, [0.0, 0.3]);
    assert!(matches!(cell.arm.actions().last(), Some(PlannedAction::Down { .. })), "{:?}", cell.arm.actions().last());
}

#[test]
fn a_hand_that_holds_a_part_at_the_beginning_keeps_it() {
    let mut cell = cell(Isometry3::identity());
    cell.arm = cell.arm.with_hand(HandState { opening_m: 0.02, is_grasping: true, force_n: None });
    let report = run(&mut cell, &config(), &tray().goal(1).unwrap(), &PlacingConfig::default());
    let PlacingOutcome::Failed { step: GraspStep::Detect, why } = &report.outcome else { panic!("{report:?}") };
    // Only some arms are reached by commands of sdg.
    assert_eq!(why, "the hand still holds an object: open it first");
    assert!(cell.arm.actions().is_empty());
}

#[test]
fn a_place_out_of_reach_is_said_before_the_part_is_carried() {
    let mut cell = cell(Isometry3::identity());
    let far = Place { at_m: [0.9, -0.6], ..tray() };
    let report = run(&mut cell, &config(), &far.goal(1).unwrap(), &PlacingConfig::default());
    let PlacingOutcome::Failed { step: GraspStep::Carry, why } = &report.outcome else { panic!("{report:?}") };
    assert!(why.contains("no path to \"tray, cell 1\"") && why.contains("out of reach"), "{why}");
}

#[test]
fn in_a_bin_a_part_lies_anyhow() {
    let bin = Place { kind: PlaceKind::Bin { size_m: [0.1, 0.1] }, ..tray() };
    let slid = planar(0.02, 0.0, 0.5);
    let report = run(&mut cell(slid), &config(), &bin.goal(1).unwrap(), &PlacingConfig::default());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
    assert_eq!(report.errors.len(), 1);
    // 30 mm beside the bin.
    let report = run(&mut cell(planar(0.08, 0.0, 0.0)), &config(), &bin.goal(1).unwrap(), &PlacingConfig::default());
    let PlacingOutcome::Failed { step: GraspStep::Check, why } = &report.outcome else { panic!("{report:?}") };
    assert!(why.contains("the part lies beside the bin"), "{why}");
}

/// Finds the part, and after it was put down also an older one at this pose.
struct WithOlder {
    older: Isometry3<f64>,
    others: Vec<GraspTarget>,
}

impl PartFinder<Cell> for WithOlder {
    fn find(&mut self, cell: &mut Cell) -> Result<Option<GraspTarget>> {
        Truth.find(cell)
    }

    fn find_nearest(&mut self, cell: &mut Cell, place: &Isometry3<f64>) -> Result<Option<GraspTarget>> {
        let older = GraspTarget { base_from_tcp: self.older, jaw_width_m: 0.02, score: 0.9 };
        let mut found: Vec<GraspTarget> = Truth.find(cell)?.into_iter().chain([older]).collect();
        found.sort_by(|a, b| apart_m(place, a).total_cmp(&apart_m(place, b)));
        self.others = found.split_off(1);
        Ok(found.pop())
    }

    fn others(&self) -> Vec<GraspTarget> {
        self.others.clone()
    }
}

#[test]
fn an_older_part_in_the_bin_is_not_the_one_put_down() {
    let bin = Place { kind: PlaceKind::Bin { size_m: [0.1, 0.1] }, ..tray() }.goal(1).unwrap();
    let older = LyingPart { base_from_part: bin.base_from_part(0.02, 0.0), shape: bar() };
    let known = GraspConfig { part: Some(bar()), lying: vec![older.clone()], ..config() };
    let placing = PlacingConfig::default();
    let place = |slid_m: f64| {
        let mut cell = cell(planar(slid_m, 0.0, 0.0));
        let mut robot = Robot::new(&mut cell, SafetyLimits::default(), Watch::default());
        let mut finder = WithOlder { older: older.base_from_part, others: Vec::new() };
        let camera = CameraPose::InBase(Isometry3::identity());
        grasp_and_place(&mut robot, &mut finder, &mut (), camera, &known, &bin, &placing).unwrap()
    };
    let report = place(0.03);
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
    assert!((report.errors[0].distance_m() - 0.03).abs() < 1e-3, "{report:?}");
    let report = place(0.08);
    let PlacingOutcome::Failed { step: GraspStep::Check, why } = &report.outcome else { panic!("{report:?}") };
    assert!(why.contains("the part lies beside the bin"), "{why}");
}

#[test]
fn a_part_that_was_never_in_the_bin_is_not_the_one_that_fell_beside_it() {
    let bin = Place { kind: PlaceKind::Bin { size_m: [0.1, 0.1] }, ..tray() }.goal(1).unwrap();
    // 7 mm beside the bin; no earlier picture showed it.
    let other = bin.base_from_part(0.02, 0.0) * Isometry3::translation(0.057, 0.0, 0.0);
    let place = |slide: Isometry3<f64>, places: Vec<Place>| {
        let mut cell = cell(slide);
        let mut robot = Robot::new(&mut cell, SafetyLimits::default(), Watch::default());
        let mut finder = WithOlder { older: other, others: Vec::new() };
        let (camera, placing) = (CameraPose::InBase(Isometry3::identity()), PlacingConfig::default());
        let known = GraspConfig { part: Some(bar()), places, ..config() };
        grasp_and_place(&mut robot, &mut finder, &mut (), camera, &known, &bin, &placing).unwrap()
    };
    // The part lies in a corner of the bin, 64 mm from the centre.
    let report = place(planar(0.045, 0.045, 0.0), Vec::new());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
    // The part fell beside the bin, and the other one lies in a place of its own.
    let at_m = other.translation.vector.xy().into();
    let kind = PlaceKind::Bin { size_m: [0.02, 0.02] };
    let shelf = Place { name: "shelf".to_owned(), at_m, kind, ..tray() };
    let report = place(planar(0.08, 0.0, 0.0), vec![shelf]);
    let PlacingOutcome::Failed { step: GraspStep::Check, why } = &report.outcome else { panic!("{report:?}") };
    assert!(why.starts_with("the part lies beside the bin, 80.0 mm"), "{why}");
}

#[test]
fn the_hand_leaves_a_bin_although_a_part_may_lie_where_the_fingers_are() {
    let bin = Place { kind: PlaceKind::Bin { size_m: [0.1, 0.1] }, ..tray() }.goal(1).unwrap();
    let flat = PartShape::new(bar().outline().to_vec(), 0.020, 0.014, 0.008).unwrap();
    // It lies across the other one, under both fingers; the contact is that with the bin's floor.
    let base_from_part = bin.base_from_part(0.008, std::f64::consts::FRAC_PI_2);
    let other = LyingPart { base_from_part, shape: flat.clone() };
    let known = GraspConfig { part: Some(flat), lying: vec![other], ..config() };
    let mut cell = cell(Isometry3::identity());
    cell.base_from_part.translation.z = 0.008;
    let report = run(&mut cell, &known, &bin, &PlacingConfig::default());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
}

#[test]
fn the_hand_leaves_a_tray_that_is_lower_than_its_file_says() {
    // At the expected contact, the hand's body is 5 mm above the tops of the neighbouring parts; the real one is 5 mm
    // lower.
    let tall = PartShape::new(bar().outline().to_vec(), 0.020, 0.054, 0.030).unwrap();
    let mut cell = cell(Isometry3::identity());
    (cell.base_from_part.translation.z, cell.lower_m) = (0.03, 0.005);
    let known = GraspConfig { part: Some(tall), ..config() };
    let report = run(&mut cell, &known, &tray().goal(1).unwrap(), &PlacingConfig::default());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
    assert!((cell.base_from_part.translation.z - 0.025).abs() < 1e-4, "{}", cell.base_from_part);
    // If the part slides, the second grasp is at the height of the contact, and so are the neighbouring parts.
    let mut cell = Cell { lower_m: 0.005, ..super::tests::cell(planar(0.003, 0.001, 0.02)) };
    cell.base_from_part.translation.z = 0.03;
    let report = run(&mut cell, &known, &tray().goal(1).unwrap(), &PlacingConfig::default());
    assert_eq!((&report.outcome, report.errors.len()), (&PlacingOutcome::Placed, 2), "{report:?}");
}

#[test]
fn the_hand_leaves_a_place_where_it_came_nearer_to_an_obstacle_than_planned() {
    // The hand's body is 29 mm above the tcp. At the expected contact it is 5 mm above the post; the real contact is
    // 5 mm lower.
    let goal = Place { kind: PlaceKind::Pose, ..tray() }.goal(1).unwrap();
    let at = goal.base_from_part(0.0, 0.0) * Point3::new(0.0, 0.085, 0.0);
    let half_m = [0.008, 0.008, 0.5 * (0.03 + 0.0294 - 0.005)];
    let base_from_obstacle = Isometry3::translation(at.x, at.y, half_m[2]);
    let post = Obstacle { name: "post".to_owned(), shape: Shape::Box { half_m }, base_from_obstacle };
    let mut cell = cell(Isometry3::identity());
    (cell.base_from_part.translation.z, cell.lower_m) = (0.03, 0.005);
    let known = GraspConfig { part: Some(bar()), obstacles: vec![post], ..config() };
    let report = run(&mut cell, &known, &goal, &PlacingConfig::default());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
    assert!((cell.base_from_part.translation.z - 0.025).abs() < 1e-4, "{}", cell.base_from_part);
}

#[test]
fn in_a_tray_of_one_row_only_the_pitch_along_it_counts() {
    let kind = PlaceKind::Tray { cells: [5, 1], pitch_m: [0.1, 0.01] };
    let goal = Place { kind, ..tray() }.goal(1).unwrap();
    let report = run(&mut cell(planar(0.006, 0.0, 0.0)), &config(), &goal, &PlacingConfig::default());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
    assert_eq!(report.errors.len(), 2);
}

#[test]
fn in_a_bin_the_soft_descent_begins_above_the_part_that_lies_there() {
    let bin = Place { kind: PlaceKind::Bin { size_m: [0.1, 0.1] }, ..tray() }.goal(1).unwrap();
    let other = LyingPart { base_from_part: bin.base_from_part(0.02, 0.0), shape: bar() };
    let known = GraspConfig { part: Some(bar()), lying: vec![other.clone()], ..config() };
    let mut cell = cell(Isometry3::identity());
    let report = run(&mut cell, &known, &bin, &PlacingConfig::default());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
    let before = cell.arm.actions().iter().take_while(|action| !matches!(action, PlannedAction::Down { .. }));
    let heights_m = before.filter_map(|action| match action {
        PlannedAction::Motion(motion) => Some(ArmGeometry::panda().forward(motion.end()).translation.z),
        _ => None,
    });
    // The grasp is 20 mm above the part's bottom, the other part is 30 mm high.
    let bottom_m = heights_m.last().unwrap() - 0.020;
    assert!((bottom_m - 0.045).abs() < 1e-4, "{bottom_m}");
    // A bin that is full to 200 mm is refused.
    let full = PartShape::new(bar().outline().to_vec(), 0.020, 0.200, 0.020).unwrap();
    let known = GraspConfig { lying: vec![LyingPart { shape: full, ..other }], ..known };
    let report = run(&mut super::tests::cell(Isometry3::identity()), &known, &bin, &PlacingConfig::default());
    let PlacingOutcome::Failed { step: GraspStep::Carry, why } = &report.outcome else { panic!("{report:?}") };
    assert!(why.contains("may be filled to 200 mm, at most 175 mm are possible"), "{why}");
}

#[test]
fn the_whole_sequence_goes_around_what_stands_in_the_cell() {
    let wall = Obstacle {
        name: "wall".to_owned(),
        shape: Shape::Box { half_m: [0.15, 0.015, 0.2] },
        base_from_obstacle: Isometry3::translation(0.5, -0.1, 0.2),
    };
    let surrounded = GraspConfig { obstacles: vec![wall.clone()], ..config() };
    let mut cell = cell(Isometry3::identity());
    let goal = tray().goal(1).unwrap();
    let report = run(&mut cell, &surrounded, &goal, &PlacingConfig::default());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
    let model =
        crate::surroundings::collision_model(&ArmGeometry::panda(), -1.0, std::slice::from_ref(&wall), 0.08).unwrap();
    let mut checker = sdg_kinematics::collision::Checker::new(&model, 1e-3);
    let motions = cell.arm.actions().iter().filter_map(|action| match action {
        PlannedAction::Motion(motion) => Some(motion),
        _ => None,
    });
    for motion in motions {
        for step in 0..=200 {
            let q = motion.sample(motion.duration_secs() * f64::from(step) / 200.0).0;
            assert!(checker.is_free(&q), "{}", model.nearest(&q));
        }
    }
    // A place inside an obstacle fails with the obstacle's name.
    let inside = Place { at_m: [0.5, -0.1], ..tray() };
    let report =
        run(&mut super::tests::cell(Isometry3::identity()), &surrounded, &inside.goal(1).unwrap(), &Default::default());
    let PlacingOutcome::Failed { step: GraspStep::Carry, why } = &report.outcome else { panic!("{report:?}") };
    assert!(why.contains("wall"), "{why}");
}

fn bar() -> PartShape {
    let corners = [[-0.03, -0.01], [0.03, -0.01], [0.03, 0.01], [-0.03, 0.01]].map(nalgebra::Point2::from);
    PartShape::new(corners, 0.020, 0.030, 0.020).unwrap()
}

#[test]
fn a_tray_without_room_is_refused_before_anything_moves() {
    let kind = PlaceKind::Tray { cells: [2, 2], pitch_m: [0.08, 0.045] };
    let narrow = Place { kind, ..tray() }.goal(1).unwrap();
    let mut cell = cell(Isometry3::identity());
    let mut robot = Robot::new(&mut cell, SafetyLimits::default(), Watch::default());
    let known = GraspConfig { part: Some(bar()), ..config() };
    let placing = PlacingConfig::default();
    let ended = grasp_and_place(
        &mut robot,
        &mut Truth,
        &mut (),
        CameraPose::InBase(Isometry3::identity()),
        &known,
        &narrow,
        &placing,
    );
    let error = ended.unwrap_err();
    assert!(!error.latches() && error.to_string().contains("expected a pitch of 80 x 47 mm"), "{error}");
    assert!(cell.arm.actions().is_empty());
    // Without the part's outline, the tray is refused after the part was found and before it is grasped.
    let report = run(&mut cell, &config(), &narrow, &placing);
    let PlacingOutcome::Failed { step: GraspStep::Detect, why } = &report.outcome else { panic!("{report:?}") };
    assert!(why.contains("the part is 20 mm wide between the fingers"), "{why}");
    assert_eq!(cell.base_from_part, lying(0.5, 0.1, 0.4));
}

#[test]
fn a_descent_that_the_parts_beside_the_place_block_is_said_before_it_begins() {
    // The hand's body is 29 mm above the tcp; at the contact it would be below the tops of the neighbouring parts.
    let tall = PartShape::new(bar().outline().to_vec(), 0.020, 0.060, 0.030).unwrap();
    let mut cell = cell(Isometry3::identity());
    cell.base_from_part.translation.z = 0.03;
    let known = GraspConfig { part: Some(tall), ..config() };
    let report = run(&mut cell, &known, &tray().goal(1).unwrap(), &PlacingConfig::default());
    let PlacingOutcome::Failed { step: GraspStep::Carry, why } = &report.outcome else { panic!("{report:?}") };
    assert!(why.contains("the straight path can be followed: the hand is") && why.contains("part "), "{why}");
    assert!(report.touched.is_empty());
}

#[test]
fn a_part_is_put_between_parts_that_lie_and_not_onto_one() {
    let goal = tray().goal(1).unwrap();
    let part = |goal: &PlaceGoal| LyingPart { base_from_part: goal.base_from_part(0.02, 0.0), shape: bar() };
    let others: Vec<LyingPart> = (2..=4).map(|number| part(&tray().goal(number).unwrap())).collect();
    let known = GraspConfig { part: Some(bar()), lying: others, ..config() };
    let mut cell = cell(planar(0.003, 0.001, 0.02));
    let report = run(&mut cell, &known, &goal, &PlacingConfig::default());
    assert_eq!(report.outcome, PlacingOutcome::Placed, "{report:?}");
    let onto = GraspConfig { lying: vec![part(&goal)], ..known };
    let report = run(&mut super::tests::cell(Isometry3::identity()), &onto, &goal, &PlacingConfig::default());
    let PlacingOutcome::Failed { step: GraspStep::Detect, why } = &report.outcome else { panic!("{report:?}") };
    assert!(why.contains("\"tray, cell 1\" already contains a part"), "{why}");
}
