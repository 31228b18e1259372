//! A plan as an animation.

use std::path::{Path, PathBuf};

use anyhow::Result;
use sdg_kinematics::Trajectory;
use sdg_report::{Animation, AnimationOptions};
use sdg_robot::workcell::Workcell;
use sdg_simulation::scene::SceneVariation;
use sdg_simulation::{RenderConfig, Renderer, WorkcellConfig};

/// Pictures of a motion at most: a slow one is shown faster.
const MAX_FRAMES: f64 = 100.0;
const SHOWN_FPS: f64 = 10.0;
const WIDTH_PX: u32 = 480;

/// Draws motions, one after the other, among the obstacles of a workcell into a folder; the files.
///
/// # Errors
/// Files that cannot be written, and errors of the renderer.
pub(super) fn draw(folder: &Path, workcell: &Workcell, motions: &[Trajectory], opening_m: f64) -> Result<Vec<PathBuf>> {
    let obstacles = workcell.obstacles.clone();
    let config = WorkcellConfig { obstacles, ..WorkcellConfig::new(SceneVariation::nominal(None)) };
    let mut cell = sdg_simulation::Workcell::new(&config)?;
    let render = RenderConfig { width: WIDTH_PX, height: WIDTH_PX * 3 / 4, ..RenderConfig::default() };
    let mut renderer = Renderer::new(cell.data().model(), render)?;
    let total_secs: f64 = motions.iter().map(Trajectory::duration_secs).sum();
    let period_secs = (total_secs / MAX_FRAMES).max(1.0 / SHOWN_FPS);
    let mut frames = Vec::new();
    for motion in motions {
        let count = (motion.duration_secs() / period_secs).ceil().max(1.0) as usize;
        for index in 0..=count {
            let (q, ..) = motion.sample(motion.duration_secs() * index as f64 / count as f64);
            frames.push(cell.scene_image_at(&mut renderer, &q, opening_m)?);
        }
    }
    let options = AnimationOptions { source_fps: SHOWN_FPS, fps: SHOWN_FPS, max_width: WIDTH_PX, ..Default::default() };
    let animation = Animation::encode(&frames, &options)?;
    crate::files::prepare_folder(folder)?;
    let (gif, still) = (folder.join("plan.gif"), folder.join("plan.png"));
    sdg_report::write_atomically(&gif, animation.gif())?;
    let mut png = Vec::new();
    animation.still().write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png)?;
    sdg_report::write_atomically(&still, &png)?;
    Ok(vec![gif, still])
}
