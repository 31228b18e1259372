//! Prints and draws a planned grasp.

use anyhow::{Result, anyhow};
use sdg_cell::DryRun;

/// Prints one line for each motion, and the end of the plan.
///
/// # Errors
/// A step cannot be planned.
pub(crate) fn print_plan(plan: &DryRun, is_seen: bool) -> Result<()> {
    for line in plan.lines() {
        eprintln!("  {line}");
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
    _workcell: &sdg_robot::workcell::Workcell,
) -> Result<Vec<std::path::PathBuf>> {
    eprintln!("this sdg was built without the simulator and draws no motion");
    Ok(Vec::new())
}
