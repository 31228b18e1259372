//! Prints and draws a planned grasp.

use anyhow::{Result, anyhow};
use sdg_cell::DryRun;
use sdg_robot::{Arm, PlannedAction};

/// Prints one line for each motion, and the end of the plan.
///
/// # Errors
/// A step cannot be planned.
pub(crate) fn print_plan(plan: &DryRun, is_seen: bool) -> Result<()> {
    let geometry = plan.arm.geometry();
    for action in plan.arm.actions() {
        match action {
            PlannedAction::Motion(motion) => {
                let tcp = geometry.forward(motion.end()).translation.vector * 1e3;
                let secs = motion.duration_secs();
                eprintln!("  tcp to ({:.0}, {:.0}, {:.0}) mm in {secs:.1} s", tcp.x, tcp.y, tcp.z);
            }
            PlannedAction::Wait(_) => {}
            PlannedAction::Down { end, duration_secs } => {
                let z_mm = geometry.forward(end).translation.z * 1e3;
                eprintln!("  down softly to about {z_mm:.0} mm, or until contact, in {duration_secs:.1} s");
            }
            PlannedAction::Hand(sdg_robot::HandCommand::Move { opening_m, .. }) => {
                eprintln!("  hand open to {:.0} mm", opening_m * 1e3);
            }
            PlannedAction::Hand(sdg_robot::HandCommand::Grasp { width_m, force_n, .. }) => {
                eprintln!("  hand close on about {:.0} mm with {force_n:.0} N", width_m * 1e3);
            }
        }
    }
    match &plan.failed {
        None => eprintln!("  {:.0} s in all", plan.arm.duration_secs()),
        Some(_) if !is_seen => {
            eprintln!(
                "  the part is not visible from the arm's current posture: only the way to the look-out poses is planned"
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
    _obstacles: &[sdg_kinematics::collision::Obstacle],
) -> Result<Vec<std::path::PathBuf>> {
    eprintln!("this sdg was built without the simulator and draws no motion");
    Ok(Vec::new())
}
