//! `sdg ros2`: detection, teaching and grasping as a node of ROS 2.

pub mod args;
mod settings;
mod teaching;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result};
use sdg_kinematics::ArmGeometry;
use sdg_ros2::Naming;
use sdg_ros2::dds::{ArmConfig, Node, NodeConfig, TrajectoryArm, domain_of_environment, watch_network_threads};
use sdg_ros2_node::IsInterrupted;

use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use args::{ArmArgs, Ros2Args};
use settings::{CellFiles, grasp_settings, node_settings};

/// Timeout for the arm's topic and actions.
const ARM_TIMEOUT: Duration = Duration::from_secs(20);

/// Joins ROS 2 and runs until Ctrl-C.
pub fn run(args: &Ros2Args) -> Result<Outcome> {
    let naming = Naming::new(&args.ros.namespace, &args.ros.node_name, &args.ros.remappings).map_err(usage)?;
    let interrupt = Interrupt::watch();
    let files = CellFiles::read(args)?;
    let settings = node_settings(args, &files, &interrupt)?;
    let grasp = match &files {
        CellFiles { workcell: Some(workcell), camera: Some(camera) } if args.arm.allow_motion => {
            Some(grasp_settings(args, workcell, camera)?)
        }
        _ => None,
    };
    watch_network_threads();
    let mut node = Node::join(NodeConfig {
        naming,
        domain_id: args.ros.domain_id.map_or_else(domain_of_environment, Ok).map_err(Usage)?,
        rmw: args.ros.rmw,
        is_loopback_only: args.ros.loopback,
        parameters: parameters(args, &files),
    })?;
    let arm = match grasp {
        Some(grasp) => {
            let arm =
                TrajectoryArm::connect(&mut node, arm_config(&args.arm, grasp.workcell.robot.geometry()), ARM_TIMEOUT)
                    .context("sdg ros2")?;
            Some((grasp, arm))
        }
        None => None,
    };
    let is_interrupted: IsInterrupted = Arc::new(move || interrupt.is_requested());
    sdg_ros2_node::run(node, settings, arm, &is_interrupted)?;
    Ok(Outcome::Done)
}

fn usage(error: sdg_ros2::RosError) -> Usage {
    Usage(error.to_string())
}

fn arm_config(args: &ArmArgs, geometry: ArmGeometry) -> ArmConfig {
    let joint = |name: String| format!("{}{name}", args.joint_prefix);
    ArmConfig {
        geometry,
        trajectory_action: args.trajectory_action.clone(),
        gripper_action: args.gripper_action.clone(),
        joint_states: args.joint_states.clone(),
        joints: std::array::from_fn(|idx| joint(format!("joint{}", idx + 1))),
        finger_joints: (1..=2).map(|finger| joint(format!("finger_joint{finger}"))).collect(),
        gripper_position_per_m: args.gripper_ratio,
    }
}

/// The parameters shown by `ros2 param get`.
fn parameters(args: &Ros2Args, files: &CellFiles) -> Vec<(String, String)> {
    let path = |path: &Option<PathBuf>| path.as_ref().map_or(String::new(), |path| path.display().to_string());
    vec![
        ("grasp_model".to_owned(), path(&args.grasp_model)),
        ("camera".to_owned(), path(&files.camera)),
        ("workcell".to_owned(), path(&args.arm.workcell)),
        ("base_frame".to_owned(), args.base_frame.clone().unwrap_or_default()),
        ("min_score".to_owned(), args.min_score.to_string()),
    ]
}
