//! Messages of ROS 2.

use sdg_geometry::PinholeCamera;
use sdg_ros2::cdr::{self, Cdr};
use sdg_ros2::messages::*;
use sdg_ros2::{Transforms, camera_info, encoding};

use super::ros_seeds::seeds;
use crate::target::Target;

/// Messages that the node receives, and those that it sends.
pub(super) const CDR: Target = Target {
    name: "ros2",
    max_extra_bytes: 160 << 20,
    quick_executions: 50_000,
    dictionary: &[
        b"\0\x01\0\0",
        b"rgb8\0",
        b"bayer_rggb8\0",
        b"yuv422\0",
        b"mono16\0",
        b"plumb_bob\0",
        b"\xff\xff\xff\x7f",
    ],
    seeds,
    run: |bytes| use_as_each(bytes, &mut Transforms::new(0.5)) | is_any_of_the_others(bytes),
};

/// Reads a message, writes it and reads that again.
fn read<T: Cdr>(bytes: &[u8]) -> Option<T> {
    let message: T = cdr::from_bytes(bytes).ok()?;
    // Texts end at their first zero, and what follows a message is lost, so that only the second text stays the same.
    let written = cdr::to_bytes(&message);
    let again = cdr::from_bytes::<T>(&written).map(|again| cdr::to_bytes(&again));
    assert!(again.is_ok_and(|again| again == written), "expected a written message to be read unchanged");
    Some(message)
}

/// Reads bytes as each message whose content is used, and uses it.
fn use_as_each(bytes: &[u8], transforms: &mut Transforms) -> bool {
    let mut is_used = false;
    if let Some(image) = read::<Image>(bytes) {
        let picture = encoding::read_image(&image);
        if let Ok(picture) = &picture {
            let again = encoding::to_image(picture, image.header);
            assert!(encoding::read_image(&again).is_ok_and(|again| again == *picture), "a picture after a message");
        }
        is_used |= picture.is_ok();
    }
    if let Some(image) = read::<CompressedImage>(bytes) {
        is_used |= encoding::read_compressed(&image).is_ok();
    }
    if let Some(info) = read::<CameraInfo>(bytes)
        && let Ok(camera) = camera_info::read_camera_info(&info)
    {
        is_used = true;
        let _ = camera_info::check_same_camera(&PinholeCamera::WRIST, &camera);
        let _ = camera_info::read_camera_info(&camera_info::to_camera_info(&camera, info.header));
    }
    if let Some(message) = read::<TfMessage>(bytes) {
        is_used = true;
        for is_static in [false, true] {
            transforms.add(&message, is_static);
            for (target, source) in [("base", "camera"), ("camera", "table"), ("/base", "lidar"), ("no frame", "hand")]
            {
                let _ = transforms.lookup(target, source, Time { sec: 12, nanosec: 0 });
            }
        }
    }
    if let Some(goal) = read::<FollowJointTrajectoryGoal>(bytes) {
        is_used = true;
        for point in &goal.trajectory.points {
            let _ = Duration::from_secs(point.time_from_start.secs());
        }
    }
    if let Some(header) = read::<Header>(bytes)
        && let Some(time) = header.stamp.to_system()
    {
        is_used = true;
        assert_eq!(Time::from_system(time), header.stamp);
    }
    is_used
}

/// Whether the bytes are any of the messages that are only passed on.
fn is_any_of_the_others(bytes: &[u8]) -> bool {
    // This message is empty, so that any bytes are one.
    let _ = read::<TriggerRequest>(bytes);
    read::<JointState>(bytes).is_some()
        | read::<Detection2DArray>(bytes).is_some()
        | read::<DiagnosticArray>(bytes).is_some()
        | read::<FollowJointTrajectoryFeedback>(bytes).is_some()
        | read::<AfterStatus<FollowJointTrajectoryResult>>(bytes).is_some()
        | read::<GripperCommandGoal>(bytes).is_some()
        | read::<GripperCommandFeedback>(bytes).is_some()
        | read::<AfterStatus<GripperCommandResult>>(bytes).is_some()
        | read::<PoseStamped>(bytes).is_some()
        | read::<TriggerResponse>(bytes).is_some()
        | read::<DetectRequest>(bytes).is_some()
        | read::<DetectResponse>(bytes).is_some()
        | read::<TeachRequest>(bytes).is_some()
        | read::<TeachResponse>(bytes).is_some()
        | read::<GraspRequest>(bytes).is_some()
        | read::<GraspResponse>(bytes).is_some()
}
