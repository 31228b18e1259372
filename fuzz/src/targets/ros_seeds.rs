//! Valid messages of ROS 2.

use sdg_geometry::{PinholeCamera, PlumbBob};
use sdg_ros2::messages::*;
use sdg_ros2::{camera_info, cdr, encoding, found};

/// Messages of each kind, and pictures in each layout.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let header = Header { stamp: Time { sec: 12, nanosec: 34 }, frame_id: "camera".into() };
    [pictures(&header), cameras(&header), transforms(), results(&header), requests()].concat()
}

fn pictures(header: &Header) -> Vec<Vec<u8>> {
    let picture = image::RgbImage::from_fn(12, 9, |x, y| image::Rgb([(x * 20) as u8, (y * 25) as u8, 7]));
    let mut png = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut png, image::ImageFormat::Png).expect("a picture is encoded");
    let png = CompressedImage { header: header.clone(), format: "png".into(), data: png.into_inner() };
    // Rows of four pixels and one more byte.
    let in_layout = |encoding: &str, bytes_per_pixel: u32, is_bigendian: u8| {
        let step = 4 * bytes_per_pixel + 1;
        let data = (0..2 * step).map(|at| (at * 7) as u8).collect();
        let encoding = encoding.to_owned();
        cdr::to_bytes(&Image { header: header.clone(), height: 2, width: 4, encoding, is_bigendian, step, data })
    };
    vec![
        cdr::to_bytes(&encoding::to_image(&picture, header.clone())),
        cdr::to_bytes(&encoding::to_compressed(&picture, header.clone()).expect("a picture is encoded")),
        cdr::to_bytes(&png),
        in_layout("bgr8", 3, 0),
        in_layout("8UC4", 4, 0),
        in_layout("mono8", 1, 0),
        in_layout("mono16", 2, 0),
        in_layout("16UC1", 2, 1),
        in_layout("yuv422_yuy2", 2, 0),
        in_layout("uyvy", 2, 0),
    ]
}

fn cameras(header: &Header) -> Vec<Vec<u8>> {
    let wrist = camera_info::to_camera_info(&PinholeCamera::WRIST, header.clone());
    let lens = PlumbBob { k1: -0.1, k2: 0.02, p1: 1e-3, p2: -2e-3, k3: 0.0 };
    let with_lens = PinholeCamera { lens, ..PinholeCamera::WRIST };
    let whole = RegionOfInterest { width: wrist.width, height: wrist.height, ..RegionOfInterest::default() };
    let messages = [
        camera_info::to_camera_info(&with_lens, header.clone()),
        CameraInfo { d: vec![-0.1, 0.02, 1e-3, -2e-3], ..wrist.clone() },
        CameraInfo { d: Vec::new(), roi: whole, binning_x: 1, ..wrist.clone() },
        CameraInfo { distortion_model: "equidistant".into(), d: vec![0.0; 4], ..wrist.clone() },
        wrist,
    ];
    messages.iter().map(cdr::to_bytes).collect()
}

fn transforms() -> Vec<Vec<u8>> {
    let pose = nalgebra::Isometry3::translation(0.1, 0.2, 0.3);
    let transform = |parent: &str, child: &str, sec: i32| {
        let header = Header { stamp: Time { sec, nanosec: 0 }, frame_id: parent.into() };
        found::to_transform(&header, child, &pose)
    };
    let hand = |sec: i32| transform("base", "hand", sec);
    let camera = || transform("hand", "camera", 12);
    let messages = [
        vec![hand(12), camera()],
        // Frames between two poses, beside each other, and apart from the others.
        vec![hand(11), hand(13), camera(), transform("/base", "table", 12), transform("island", "lidar", 12)],
        // A clock that was set back.
        vec![hand(100), hand(12), camera()],
        // Poses that are too new, and too old.
        vec![hand(15), camera()],
        vec![hand(9), camera()],
        // A circle, and another parent.
        vec![hand(12), transform("hand", "base", 12), transform("table", "hand", 12)],
    ];
    messages.map(|transforms| cdr::to_bytes(&TfMessage { transforms })).to_vec()
}

/// Results, feedback and states.
fn results(header: &Header) -> Vec<Vec<u8>> {
    let pose = nalgebra::Isometry3::translation(0.4, 0.1, 0.02);
    let part = found::FoundPart {
        name: "rod".into(),
        score: 0.9,
        corners: [nalgebra::Point2::new(1.0, 2.0), nalgebra::Point2::new(5.0, 6.0)],
        grasp: Some((pose, 0.02)),
    };
    let without_pose = found::FoundPart { grasp: None, ..part.clone() };
    let detections = found::to_detections(header, &[part, without_pose]);
    let pose = found::to_pose(header, &pose);
    let value = KeyValue { key: "rate".into(), value: "30".into() };
    let status = DiagnosticStatus { name: "sdg".into(), values: vec![value], ..DiagnosticStatus::default() };
    let text = || "a text".to_owned();
    let detected = DetectResponse {
        success: true,
        message: text(),
        detections: detections.clone(),
        poses: vec![pose.clone()],
        openings_m: vec![0.02],
    };
    let grasped =
        GraspResponse { success: true, message: text(), step: "hold".into(), pose: pose.clone(), closed_width_m: 0.02 };
    let names = || vec!["a".to_owned(), "b".to_owned()];
    vec![
        cdr::to_bytes(&detections),
        cdr::to_bytes(&pose),
        cdr::to_bytes(&DiagnosticArray { header: header.clone(), status: vec![status] }),
        cdr::to_bytes(&JointState { name: names(), position: vec![0.0; 2], ..JointState::default() }),
        cdr::to_bytes(&FollowJointTrajectoryFeedback { joint_names: names(), ..Default::default() }),
        cdr::to_bytes(&AfterStatus(FollowJointTrajectoryResult { error_code: -4, error_string: text() })),
        cdr::to_bytes(&GripperCommandFeedback { position: 0.02, effort: 20.0, stalled: true, reached_goal: false }),
        cdr::to_bytes(&AfterStatus(GripperCommandResult { reached_goal: true, ..Default::default() })),
        cdr::to_bytes(&TriggerResponse { success: true, message: text() }),
        cdr::to_bytes(&TeachResponse { success: true, message: text(), model_path: text(), seconds: 1.5 }),
        cdr::to_bytes(&detected),
        cdr::to_bytes(&grasped),
    ]
}

/// Goals and requests.
fn requests() -> Vec<Vec<u8>> {
    let point = JointTrajectoryPoint {
        positions: vec![0.1, 0.2],
        time_from_start: Duration { sec: 1, nanosec: 500_000_000 },
        ..JointTrajectoryPoint::default()
    };
    let joint_names = vec!["a".to_owned(), "b".to_owned()];
    let trajectory = JointTrajectory { joint_names, points: vec![point.clone(), point], ..Default::default() };
    let tolerance = JointTolerance { name: "a".into(), position: 0.01, ..JointTolerance::default() };
    let goal = FollowJointTrajectoryGoal { trajectory, goal_tolerance: vec![tolerance], ..Default::default() };
    vec![
        cdr::to_bytes(&goal),
        cdr::to_bytes(&GripperCommandGoal { position: 0.02, max_effort: 40.0 }),
        cdr::to_bytes(&TeachRequest { photo_path: "a.png".into(), ..TeachRequest::default() }),
        cdr::to_bytes(&DetectRequest { min_score: 0.5, timeout_secs: 1.0 }),
        cdr::to_bytes(&GraspRequest { dry_run: true, speed: 0.2 }),
    ]
}
