//! Prints and draws a planned grasp.

use anyhow::{Result, anyhow};
use sdg_cell::DryRun;

use crate::json_line::tell;

/// Prints one line for each motion, and the end of the plan; `is_json` as for [`tell`].
///
/// # Errors
/// A step cannot be planned.
pub(crate) fn print_plan(plan: &DryRun, is_json: bool) -> Result<()> {
    for line in plan.lines() {
        tell(is_json, &format!("  {line}"));
    }
    match &plan.failed {
        None => tell(is_json, &format!("  {:.0} s in all", plan.arm.duration_secs())),
        Some(_) if plan.found_nothing => {
            tell(
                is_json,
                "  the part is not visible from the arm's current posture: only the way to the look-out poses is planned",
            );
        }
        Some((step, why)) => return Err(anyhow!("{step}: {why}")),
    }
    Ok(())
}

/// Reports that no plan is drawn in a build without the simulator.
#[cfg(not(feature = "simulation"))]
pub(crate) fn draw_dry_run(
    _plan: &DryRun,
    _folder: &std::path::Path,
    _seen: Option<&sdg_cell::SeenOutline>,
    _workcell: &sdg_robot::workcell::Workcell,
) -> Result<Vec<std::path::PathBuf>> {
    eprintln!("this sdg was built without the simulator and draws no motion");
    Ok(Vec::new())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_kinematics::{ArmGeometry, JointVector, ready_pose};
    use sdg_robot::{
        ArmMode, ArmState, CameraPose, GraspConfig, HandState, KnownTarget, LookOut, SafetyLimits, camera_looking_down,
    };

    /// The plan from a tcp at a height (m), of a part that is not visible there.
    fn unseen_from(height_m: f64) -> DryRun {
        let panda = ArmGeometry::panda();
        let base_from_tcp = camera_looking_down(0.45, 0.0, height_m, std::f64::consts::FRAC_PI_2);
        let q = panda.inverse(&base_from_tcp, &ready_pose(), &Default::default()).unwrap().q;
        let zero = JointVector::zeros();
        let start =
            ArmState { time_secs: 0.0, q, dq: zero, q_commanded: q, tau_external_nm: zero, mode: ArmMode::Idle };
        let hand = HandState { opening_m: 0.08, is_grasping: false, force_n: None };
        let config = GraspConfig { look_outs: vec![LookOut::Joints(ready_pose())], ..GraspConfig::default() };
        let camera = CameraPose::InBase(base_from_tcp);
        let seen = KnownTarget::new(None, camera, &config);
        DryRun::plan(start, hand, seen, SafetyLimits::default(), camera, &config, None).unwrap()
    }

    #[test]
    fn a_refused_motion_to_the_first_look_out_pose_is_an_error() {
        print_plan(&unseen_from(0.30), false).unwrap();
        let error = print_plan(&unseen_from(0.02), false).unwrap_err().to_string();
        assert!(error.starts_with("detect: the path there passes "), "{error}");
    }
}
