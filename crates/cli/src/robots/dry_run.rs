//! A planned grasp, described and drawn.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use sdg_cell::{DryRun, SeenOutline};
use sdg_kinematics::collision::Obstacle;
use sdg_robot::PlannedAction;

/// A line for each motion, and how the plan ends.
///
/// # Errors
/// The step that cannot be planned.
pub(crate) fn print_plan(plan: &DryRun, is_seen: bool) -> Result<()> {
    let panda = sdg_kinematics::Panda::new();
    for action in plan.arm.actions() {
        match action {
            PlannedAction::Motion(motion) => {
                let tcp = panda.forward(motion.end()).translation.vector * 1e3;
                let secs = motion.duration_secs();
                eprintln!("  tcp to ({:.0}, {:.0}, {:.0}) mm in {secs:.1} s", tcp.x, tcp.y, tcp.z);
            }
            PlannedAction::Wait(_) => {}
            PlannedAction::Down { end, duration_secs } => {
                let z_mm = panda.forward(end).translation.z * 1e3;
                eprintln!("  down softly until something is felt, about {z_mm:.0} mm, in {duration_secs:.1} s");
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
            eprintln!("  the part is not seen from where the arm stands: this is the way to the look-out poses only");
        }
        Some((step, why)) => return Err(anyhow!("{step}: {why}")),
    }
    Ok(())
}

/// Draws the motion and the part that was seen as an animation and its last picture into a folder; the files. The part stays on the
/// table: it is drawn where the camera saw it.
///
/// # Errors
/// Files that cannot be written, and errors of the renderer.
#[cfg(feature = "simulation")]
pub(crate) fn draw_plan(
    plan: &DryRun,
    folder: &Path,
    seen: Option<&SeenOutline>,
    obstacles: &[Obstacle],
) -> Result<Vec<PathBuf>> {
    use sdg_evaluation::MotionDrawing;
    use sdg_robot::PlannedArm;
    use sdg_simulation::WorkcellConfig;
    use sdg_simulation::scene::{SceneVariation, SeenPart};

    const DRAWING: MotionDrawing = MotionDrawing { name: "dry-run", width_px: 400, fps: 8.0, max_frames: 120.0 };
    let seen_part = seen.map(|seen| SeenPart { outline_in_base: seen.outline_in_base.clone(), z_m: seen.z_m });
    let obstacles = obstacles.to_vec();
    let config = WorkcellConfig { seen_part, obstacles, ..WorkcellConfig::new(SceneVariation::nominal(None)) };
    let period_secs = DRAWING.period_secs(plan.arm.duration_secs());
    let positions = PlannedArm::frames(&plan.start.q_commanded, plan.opening_m, plan.arm.actions(), period_secs);
    DRAWING.draw(folder, &config, &positions)
}

/// Without the simulator there is nothing to draw with.
#[cfg(not(feature = "simulation"))]
pub(crate) fn draw_plan(
    _plan: &DryRun,
    _folder: &Path,
    _seen: Option<&SeenOutline>,
    _obstacles: &[Obstacle],
) -> Result<Vec<PathBuf>> {
    eprintln!("this sdg was built without the simulator and draws no motion");
    Ok(Vec::new())
}
