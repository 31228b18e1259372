//! A plan as an animation.

use std::path::{Path, PathBuf};

use anyhow::Result;
use sdg_evaluation::MotionDrawing;
use sdg_kinematics::Trajectory;
use sdg_robot::workcell::Workcell;
use sdg_simulation::WorkcellConfig;
use sdg_simulation::scene::SceneVariation;

const DRAWING: MotionDrawing = MotionDrawing { name: "plan", width_px: 480, fps: 10.0, max_frames: 100.0 };

/// Draws motions, one after the other, among the obstacles of a workcell into a folder; the files.
///
/// # Errors
/// Files that cannot be written, and errors of the renderer.
pub(super) fn draw(folder: &Path, workcell: &Workcell, motions: &[Trajectory], opening_m: f64) -> Result<Vec<PathBuf>> {
    let obstacles = workcell.obstacles.clone();
    let config = WorkcellConfig { obstacles, ..WorkcellConfig::new(SceneVariation::nominal(None)) };
    let period_secs = DRAWING.period_secs(motions.iter().map(Trajectory::duration_secs).sum());
    let mut positions = Vec::new();
    for motion in motions {
        // Both ends are drawn: the plan's configurations are where motions meet.
        let count = (motion.duration_secs() / period_secs).ceil().max(1.0) as usize;
        for index in 0..=count {
            let (q, ..) = motion.sample(motion.duration_secs() * index as f64 / count as f64);
            positions.push((q, opening_m));
        }
    }
    DRAWING.draw(folder, &config, &positions)
}
