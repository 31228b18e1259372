//! Messages of ROS 2.

use sdg_geometry::PinholeCamera;
use sdg_ros2::messages::*;
use sdg_ros2::{Transforms, camera_info, cdr, encoding, found};

use crate::target::Target;

/// Messages that the node receives, and some that it sends.
pub(super) const CDR: Target = Target {
    name: "ros2",
    max_extra_bytes: 160 << 20,
    quick_executions: 100_000,
    dictionary: &[b"\0\x01\0\0", b"rgb8\0", b"bayer_rggb8\0", b"yuv422\0", b"mono16\0", b"\xff\xff\xff\x7f"],
    seeds,
    run: |bytes| read_all(bytes, &mut Transforms::new(0.5)) > 0,
};

/// Reads bytes as each of these messages, and uses the results.
fn read_all(bytes: &[u8], transforms: &mut Transforms) -> usize {
    let mut num_read = 0;
    if let Ok(image) = cdr::from_bytes::<Image>(bytes) {
        num_read += usize::from(encoding::read_image(&image).is_ok());
    }
    if let Ok(image) = cdr::from_bytes::<CompressedImage>(bytes) {
        num_read += usize::from(encoding::read_compressed(&image).is_ok());
    }
    if let Ok(info) = cdr::from_bytes::<CameraInfo>(bytes) {
        num_read += usize::from(camera_info::read_camera_info(&info).is_ok());
    }
    for is_static in [false, true] {
        if let Ok(message) = cdr::from_bytes::<TfMessage>(bytes) {
            num_read += 1;
            transforms.add(&message, is_static);
            let _ = transforms.lookup("base", "camera", Time { sec: 12, nanosec: 0 });
        }
    }
    num_read += usize::from(cdr::from_bytes::<JointState>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<Detection2DArray>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<DiagnosticArray>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<FollowJointTrajectoryFeedback>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<AfterStatus<FollowJointTrajectoryResult>>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<FollowJointTrajectoryGoal>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<AfterStatus<GripperCommandResult>>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<DetectRequest>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<TeachRequest>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<GraspRequest>(bytes).is_ok());
    num_read
}

fn seeds() -> Vec<Vec<u8>> {
    let header = Header { stamp: Time { sec: 12, nanosec: 34 }, frame_id: "camera".into() };
    let picture = image::RgbImage::from_fn(12, 9, |x, y| image::Rgb([(x * 20) as u8, (y * 25) as u8, 7]));
    let pose = nalgebra::Isometry3::translation(0.1, 0.2, 0.3);
    let transform = |parent: &str, child: &str| {
        let header = Header { frame_id: parent.into(), ..header.clone() };
        found::to_transform(&header, child, &pose)
    };
    let part = found::FoundPart {
        name: "rod".into(),
        score: 0.9,
        corners: [nalgebra::Point2::new(1.0, 2.0), nalgebra::Point2::new(5.0, 6.0)],
        grasp: Some((pose, 0.02)),
    };
    let names = || vec!["a".to_owned(), "b".to_owned()];
    let point = JointTrajectoryPoint { positions: vec![0.1, 0.2], ..JointTrajectoryPoint::default() };
    let trajectory = JointTrajectory { joint_names: names(), points: vec![point.clone(), point], ..Default::default() };
    let goal = FollowJointTrajectoryGoal { trajectory, ..Default::default() };
    let diagnostic = DiagnosticStatus { name: "sdg".into(), values: vec![KeyValue::default()], ..Default::default() };
    vec![
        cdr::to_bytes(&encoding::to_image(&picture, header.clone())),
        cdr::to_bytes(&encoding::to_compressed(&picture, header.clone()).expect("a picture is encoded")),
        cdr::to_bytes(&camera_info::to_camera_info(&PinholeCamera::WRIST, header.clone())),
        cdr::to_bytes(&TfMessage { transforms: vec![transform("base", "hand"), transform("hand", "camera")] }),
        cdr::to_bytes(&JointState { name: names(), position: vec![0.0; 2], ..JointState::default() }),
        cdr::to_bytes(&found::to_detections(&header, &[part.clone(), part])),
        cdr::to_bytes(&DiagnosticArray { header, status: vec![diagnostic] }),
        cdr::to_bytes(&goal),
        cdr::to_bytes(&FollowJointTrajectoryFeedback::default()),
        cdr::to_bytes(&AfterStatus(FollowJointTrajectoryResult::default())),
        cdr::to_bytes(&TeachRequest { photo_path: "a.png".into(), ..TeachRequest::default() }),
        cdr::to_bytes(&DetectRequest::default()),
    ]
}
