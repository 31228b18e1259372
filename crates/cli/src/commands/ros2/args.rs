//! The arguments of `sdg ros2`.

use std::path::PathBuf;

use clap::Args;
use sdg_ros2::Remapping;
use sdg_ros2::dds::Rmw;

use crate::shared_args::{ComputeArgs, ToldHeightArgs, height_mm, positive, share, table_height_mm};

/// `sdg ros2`
#[derive(Debug, Args)]
pub struct Ros2Args {
    /// A grasp model written by sdg teach; without it, nothing is detected until the service has taught one
    #[arg(long, value_name = "FILE")]
    pub grasp_model: Option<PathBuf>,
    /// The camera file, with the camera's pose above the table; without it and --base-frame, detections have no poses.
    /// Default with --allow-motion: the file named in the workcell file
    #[arg(long, value_name = "FILE")]
    pub camera: Option<PathBuf>,
    /// Look up the camera's pose in tf, in this frame: the robot's base; intrinsics come from --camera or from
    /// camera_info
    #[arg(long, value_name = "FRAME")]
    pub base_frame: Option<String>,
    /// With --base-frame: z of the table in that frame; default: the value in the workcell file, else 0
    #[arg(long, value_name = "MM", allow_hyphen_values = true, value_parser = table_height_mm)]
    pub table_height_mm: Option<f64>,
    /// With --base-frame: maximum difference between the stamps of transform and picture
    #[arg(long, value_name = "SECS", default_value_t = 0.2, value_parser = positive)]
    pub max_transform_age_secs: f64,
    /// Minimum score of published detections
    #[arg(long, value_name = "SCORE", default_value_t = 0.5, value_parser = share)]
    pub min_score: f64,
    /// Maximum number of pictures waiting for a search; the oldest are skipped
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub queue: u32,
    /// Device for the network
    #[command(flatten)]
    pub compute: ComputeArgs,
    /// Settings of ROS 2
    #[command(flatten)]
    pub ros: RosArgs,
    /// The arm of the service ~/grasp
    #[command(flatten)]
    pub arm: ArmArgs,
    /// The teaching of the service ~/teach_trigger
    #[command(flatten)]
    pub teach: TeachTriggerArgs,
}

/// Settings of ROS 2.
#[derive(Debug, Args)]
#[command(next_help_heading = "ROS 2")]
pub struct RosArgs {
    /// The node's name
    #[arg(long, value_name = "NAME", default_value = "sdg")]
    pub node_name: String,
    /// The node's namespace
    #[arg(long, value_name = "NAMESPACE", default_value = "/")]
    pub namespace: String,
    /// Remap a name, as in image:=/camera/color/image_raw; also __node and __ns; repeat for several
    #[arg(short = 'r', long = "remap", value_name = "FROM:=TO")]
    pub remappings: Vec<Remapping>,
    /// Accepted and ignored, so that ros2 launch can start the node
    #[arg(long)]
    pub ros_args: bool,
    /// The domain; default: ROS_DOMAIN_ID, else 0
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=232))]
    pub domain_id: Option<u16>,
    /// The RMW whose protocol of services and actions is used: fastrtps or cyclonedds
    #[arg(long, value_name = "NAME", default_value = "fastrtps")]
    pub rmw: Rmw,
    /// Announce the node and send on this computer only; packets of other computers are still received
    #[arg(long)]
    pub loopback: bool,
    /// Subscribe to CompressedImage on image/compressed instead of Image on image
    #[arg(long)]
    pub compressed: bool,
    /// Request retransmission of lost pictures, if the camera offers it
    #[arg(long)]
    pub reliable: bool,
}

/// The arm of the service `grasp`.
#[derive(Debug, Args)]
#[command(next_help_heading = "Grasping")]
pub struct ArmArgs {
    /// Allow the service ~/grasp to move the arm for any caller; without it there is no such service
    #[arg(long, requires = "workcell")]
    pub allow_motion: bool,
    /// The workcell file
    #[arg(long, value_name = "FILE")]
    pub workcell: Option<PathBuf>,
    /// Name of the arm's FollowJointTrajectory action
    #[arg(long, value_name = "ACTION", default_value = "/panda_arm_controller/follow_joint_trajectory")]
    pub trajectory_action: String,
    /// Name of the hand's GripperCommand action
    #[arg(long, value_name = "ACTION", default_value = "/panda_hand_controller/gripper_cmd")]
    pub gripper_action: String,
    /// Topic of the arm's JointState messages
    #[arg(long, value_name = "TOPIC", default_value = "/joint_states")]
    pub joint_states: String,
    /// Prefix of the names joint1 to joint7, finger_joint1 to finger_joint2 and, without --base-frame, of the frame link0
    /// in responses
    #[arg(long, value_name = "PREFIX", default_value = "panda_")]
    pub joint_prefix: String,
    /// The gripper's position divided by its opening: 0.5 if the position is that of one finger, 1 if it is the opening
    #[arg(long, value_name = "RATIO", default_value_t = 0.5, value_parser = positive)]
    pub gripper_ratio: f64,
    /// Fraction of the joints' velocity limits, above 0 and at most 0.6, unless a request gives another
    #[arg(long, value_name = "SHARE", default_value_t = sdg_robot::DEFAULT_SPEED, requires = "allow_motion")]
    pub speed: f64,
    /// The parts' height
    #[command(flatten)]
    pub height: ToldHeightArgs,
}

/// The input and output of `~/teach_trigger`.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Teaching by Trigger")]
pub struct TeachTriggerArgs {
    /// The photo, and its annotation if it is not beside the photo
    #[arg(long, value_name = "IMAGE[:ANNOTATION]", requires = "teach_out")]
    pub teach_demo: Option<String>,
    /// The file to write; the node then detects with it
    #[arg(long, value_name = "FILE")]
    pub teach_out: Option<PathBuf>,
    /// The grasp model, by letter or name
    #[arg(long, value_name = "NAME", default_value = "C")]
    pub teach_model: String,
    /// Height of the surface with the marks above the table, in a photo by the camera of --camera; needed with --camera
    /// or --base-frame
    #[arg(long, value_name = "MM", value_parser = height_mm, requires_all = ["teach_demo", "camera"])]
    pub teach_mark_height_mm: Option<f64>,
}
