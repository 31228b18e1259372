//! Draws motions of the arm as an animation and a still picture.

use std::path::{Path, PathBuf};

use anyhow::Result;
use sdg_cell::{DryRun, SeenOutline};
use sdg_kinematics::{JointVector, Trajectory};
use sdg_report::{Animation, AnimationOptions};
use sdg_robot::PlannedArm;
use sdg_robot::workcell::Workcell as CellFile;
use sdg_simulation::scene::{SceneVariation, SeenPart};
use sdg_simulation::{RenderConfig, Renderer, Tessellation, Workcell, WorkcellConfig};

const DRY_RUN: MotionDrawing = MotionDrawing { name: "dry-run", width_px: 400, fps: 8.0, max_frames: 120.0 };
const PLAN: MotionDrawing = MotionDrawing { name: "plan", width_px: 480, fps: 10.0, max_frames: 100.0 };

/// The style of a drawing of motions, and the name of its files.
#[derive(Debug, Clone, Copy)]
struct MotionDrawing {
    /// Name of the files, without extension.
    name: &'static str,
    /// Width of the pictures, in pixels; the height is three quarters of it.
    width_px: u32,
    /// Frames per second.
    fps: f64,
    /// Approximate maximum number of pictures; longer motions are shown faster.
    max_frames: f64,
}

impl MotionDrawing {
    /// Time between two pictures of a motion, in seconds.
    fn period_secs(&self, duration_secs: f64) -> f64 {
        (duration_secs / self.max_frames).max(1.0 / self.fps)
    }

    /// Draws the arm at each joint position (rad) and opening (m) in a workcell. Returns the files written to the
    /// folder.
    ///
    /// # Errors
    /// Files cannot be written, or rendering fails.
    fn draw(&self, folder: &Path, config: &WorkcellConfig, positions: &[(JointVector, f64)]) -> Result<Vec<PathBuf>> {
        let mut cell = Workcell::new(config)?;
        let [width, height] = [self.width_px, self.width_px * 3 / 4];
        let render = RenderConfig { width, height, tessellation: Tessellation::Coarse, ..RenderConfig::default() };
        let mut renderer = Renderer::new(cell.data().model(), render)?;
        let frames = positions
            .iter()
            .map(|(q, opening_m)| cell.scene_image_at(&mut renderer, q, *opening_m))
            .collect::<sdg_simulation::Result<Vec<_>>>()?;
        let options = AnimationOptions {
            source_fps: self.fps,
            fps: self.fps,
            max_width: self.width_px,
            ..AnimationOptions::default()
        };
        let animation = Animation::encode(&frames, &options)?;
        sdg_files::prepare_folder(folder)?;
        let [gif, still] = ["gif", "png"].map(|ending| folder.join(format!("{}.{ending}", self.name)));
        sdg_files::write(&gif, animation.gif())?;
        sdg_files::write_drawing(&still, animation.still())?;
        Ok(vec![gif, still])
    }
}

/// The robot, the table and the obstacles of a workcell.
fn drawn_cell(workcell: &CellFile) -> WorkcellConfig {
    WorkcellConfig {
        obstacles: workcell.obstacles.clone(),
        table_height_m: workcell.table_height_m,
        ..WorkcellConfig::new(SceneVariation::nominal(None))
    }
}

/// Draws the motion and the detected part in a workcell, as an animation and its last picture, into files in a folder.
/// Returns the files. The part stays at its detected position on the table.
///
/// # Errors
/// Files cannot be written, or rendering fails.
pub fn draw_dry_run(
    plan: &DryRun,
    folder: &Path,
    seen: Option<&SeenOutline>,
    workcell: &CellFile,
) -> Result<Vec<PathBuf>> {
    let seen_part = seen.map(|seen| SeenPart { outline_in_base: seen.outline_in_base.clone(), z_m: seen.z_m });
    let config = WorkcellConfig { seen_part, ..drawn_cell(workcell) };
    let period_secs = DRY_RUN.period_secs(plan.arm.duration_secs());
    let positions = PlannedArm::frames(&plan.start.q_commanded, plan.opening_m, plan.arm.actions(), period_secs);
    DRY_RUN.draw(folder, &config, &positions)
}

/// Draws consecutive motions among the obstacles of a workcell into files in a folder. Returns the files.
///
/// # Errors
/// Files cannot be written, or rendering fails.
pub fn draw_motions(
    folder: &Path,
    workcell: &CellFile,
    motions: &[Trajectory],
    opening_m: f64,
) -> Result<Vec<PathBuf>> {
    let period_secs = PLAN.period_secs(motions.iter().map(Trajectory::duration_secs).sum());
    let mut positions = Vec::new();
    for motion in motions {
        // Both ends are drawn, because consecutive motions meet at the configurations of the plan.
        let count = (motion.duration_secs() / period_secs).ceil().max(1.0) as usize;
        for index in 0..=count {
            let (q, ..) = motion.sample(motion.duration_secs() * index as f64 / count as f64);
            positions.push((q, opening_m));
        }
    }
    PLAN.draw(folder, &drawn_cell(workcell), &positions)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_drawn_at_the_height_of_the_workcell() {
        let shipped = include_str!("../../../datasets/workcell/workcell.toml");
        for (height_mm, expected_m) in [("-100", -0.1), ("20", 0.02)] {
            let text = shipped.replace("height_mm = 0.0", &format!("height_mm = {height_mm}"));
            let drawn = Workcell::new(&drawn_cell(&CellFile::from_toml(&text).unwrap())).unwrap();
            let table = drawn.data().model().id("table").unwrap();
            assert!((drawn.data().world_from_geom(table).translation.z - expected_m).abs() < 1e-9, "{height_mm}");
        }
    }
}
