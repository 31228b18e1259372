//! A motion of the arm as an animation and a still picture.

use std::path::{Path, PathBuf};

use anyhow::Result;
use sdg_kinematics::JointVector;
use sdg_report::{Animation, AnimationOptions};
use sdg_simulation::{RenderConfig, Renderer, Workcell, WorkcellConfig};

/// How a motion is drawn, and the name of its files.
#[derive(Debug, Clone, Copy)]
pub struct MotionDrawing {
    /// Name of the files, without their endings.
    pub name: &'static str,
    /// Width of the pictures, px; they are three quarters as high.
    pub width_px: u32,
    /// Pictures a second.
    pub fps: f64,
    /// Pictures of a motion at most: a slow one is shown faster.
    pub max_frames: f64,
}

impl MotionDrawing {
    /// Time of the arm between two pictures of a motion, s.
    pub fn period_secs(&self, duration_secs: f64) -> f64 {
        (duration_secs / self.max_frames).max(1.0 / self.fps)
    }

    /// Draws the arm with each joint position (rad) and opening (m) in a workcell, as files of a folder; these files.
    ///
    /// # Errors
    /// Files that cannot be written, and errors of the renderer.
    pub fn draw(
        &self,
        folder: &Path,
        config: &WorkcellConfig,
        positions: &[(JointVector, f64)],
    ) -> Result<Vec<PathBuf>> {
        let mut cell = Workcell::new(config)?;
        let render = RenderConfig { width: self.width_px, height: self.width_px * 3 / 4, ..RenderConfig::default() };
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
