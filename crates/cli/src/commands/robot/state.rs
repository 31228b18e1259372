//! `sdg robot state`.

use anyhow::Result;
use clap::Args;
use sdg_calibration::pose_json;
use sdg_cell::without_minus_zero;
use sdg_robot::Arm;
use serde_json::json;

use super::arm_args::ArmArgs;
use crate::exit::Outcome;
use crate::json_line::json_line;

/// `sdg robot state`
#[derive(Debug, Args)]
pub struct StateArgs {
    #[command(flatten)]
    arm: ArmArgs,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &StateArgs) -> Result<Outcome> {
    let (mut arm, address) = args.arm.connect()?;
    let (state, hand) = (arm.state()?, arm.hand()?);
    let base_from_tcp = arm.geometry().forward(&state.q);
    let p = base_from_tcp.translation.vector;
    let joints_deg: Vec<f64> = state.q.iter().map(|q| q.to_degrees()).collect();
    if args.json {
        let line = json!({
            "robot": address.to_string(),
            "mode": state.mode.name(),
            "joints_rad": state.q.as_slice(),
            "base_from_tcp": pose_json(&base_from_tcp),
            "base_from_flange": pose_json(&arm.geometry().base_from_flange(&state.q)),
            "external_torques_nm": state.tau_external_nm.as_slice(),
            "hand": {"opening_m": hand.opening_m, "is_grasping": hand.is_grasping},
        });
        println!("{}", json_line(&line)?);
    } else {
        println!("arm    {address}, {}", state.mode.name());
        let joints: Vec<String> =
            joints_deg.iter().map(|angle| format!("{:.2}", without_minus_zero(*angle, 2))).collect();
        println!("joints {} degrees", joints.join(", "));
        let [x, y, z]: [f64; 3] = p.map(|length| without_minus_zero(length * 1e3, 1)).into();
        println!("tcp    ({x:.1}, {y:.1}, {z:.1}) mm");
        let holds = if hand.is_grasping { ", holds something" } else { "" };
        println!("hand   {:.1} mm open{holds}", hand.opening_m * 1e3);
    }
    Ok(Outcome::Done)
}
