//! Passes messages of other implementations through this crate's reader and writer: reads lines `TYPE HEX`, and writes
//! lines of hexadecimal digits or `error: WHY`.
//!
//! `make test-ros2` compares the output with the bytes of `rosbags` (crates/ros2/tests/peers/message_bytes.py).

use std::io::{BufRead, Write};

use sdg_ros2::cdr::{self, Cdr, CdrError};
use sdg_ros2::messages::*;

fn main() -> std::io::Result<()> {
    let mut stdout = std::io::stdout().lock();
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let (type_name, hex) = line.split_once(' ').unwrap_or((&line, ""));
        let bytes: Option<Vec<u8>> =
            (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(hex.get(at..at + 2)?, 16).ok()).collect();
        match bytes.map(|bytes| round_trip(type_name, &bytes)) {
            Some(Ok(bytes)) => {
                let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
                writeln!(stdout, "{hex}")?;
            }
            Some(Err(error)) => writeln!(stdout, "error: {error}")?,
            None => writeln!(stdout, "error: expected hexadecimal digits")?,
        }
    }
    Ok(())
}

fn again<T: Cdr>(bytes: &[u8]) -> Result<Vec<u8>, CdrError> {
    cdr::from_bytes::<T>(bytes).map(|message| cdr::to_bytes(&message))
}

fn round_trip(type_name: &str, bytes: &[u8]) -> Result<Vec<u8>, CdrError> {
    match type_name {
        "sensor_msgs/msg/Image" => again::<Image>(bytes),
        "sensor_msgs/msg/CompressedImage" => again::<CompressedImage>(bytes),
        "sensor_msgs/msg/CameraInfo" => again::<CameraInfo>(bytes),
        "sensor_msgs/msg/JointState" => again::<JointState>(bytes),
        "geometry_msgs/msg/PoseStamped" => again::<PoseStamped>(bytes),
        "tf2_msgs/msg/TFMessage" => again::<TfMessage>(bytes),
        "vision_msgs/msg/Detection2DArray" => again::<Detection2DArray>(bytes),
        "diagnostic_msgs/msg/DiagnosticArray" => again::<DiagnosticArray>(bytes),
        "control_msgs/msg/FollowJointTrajectoryGoal" => again::<FollowJointTrajectoryGoal>(bytes),
        "control_msgs/msg/FollowJointTrajectoryResult" => again::<FollowJointTrajectoryResult>(bytes),
        "control_msgs/msg/FollowJointTrajectoryFeedback" => again::<FollowJointTrajectoryFeedback>(bytes),
        "control_msgs/msg/GripperCommandGoal" => again::<GripperCommandGoal>(bytes),
        "control_msgs/msg/GripperCommandResult" => again::<GripperCommandResult>(bytes),
        "sdg_interfaces/msg/DetectRequest" => again::<DetectRequest>(bytes),
        "sdg_interfaces/msg/DetectResponse" => again::<DetectResponse>(bytes),
        "sdg_interfaces/msg/TeachRequest" => again::<TeachRequest>(bytes),
        "sdg_interfaces/msg/TeachResponse" => again::<TeachResponse>(bytes),
        "sdg_interfaces/msg/GraspRequest" => again::<GraspRequest>(bytes),
        "sdg_interfaces/msg/GraspResponse" => again::<GraspResponse>(bytes),
        "std_srvs/msg/TriggerResponse" => again::<TriggerResponse>(bytes),
        other => {
            let (expected, found) = ("a type that this program knows".to_owned(), other.to_owned());
            Err(CdrError { expected, at: 0, length: bytes.len(), found })
        }
    }
}
