//! What a grasp would do from where the arm stands: planned with the same sequence and limits, drawn, and told; nothing moves.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use sdg_robot::{
    ArmState, CameraMount, GraspConfig, GraspOutcome, GraspTarget, PartFinder, PlannedAction, PlannedArm, Robot,
    SafetyLimits, Watch, grasp,
};

use super::finder::SeenOutline;

/// A grasp that is planned and not carried out.
#[cfg_attr(not(feature = "simulation"), expect(dead_code, reason = "only what is drawn needs the start"))]
pub(crate) struct DryRun {
    start: ArmState,
    opening_m: f64,
    arm: PlannedArm,
    outcome: GraspOutcome,
}

/// What was found from where the arm stands.
struct Given(Option<GraspTarget>);

impl PartFinder<PlannedArm> for Given {
    fn find(&mut self, _arm: &mut PlannedArm) -> sdg_robot::Result<Option<GraspTarget>> {
        Ok(self.0)
    }
}

impl DryRun {
    /// Plans the sequence from a state of the arm, with the part where it is seen from there, if it is.
    ///
    /// # Errors
    /// A motion that breaks a limit, or a setting that the arm cannot do.
    pub(crate) fn plan(
        start: ArmState,
        opening_m: f64,
        target: Option<GraspTarget>,
        limits: SafetyLimits,
        mount: CameraMount,
        config: &GraspConfig,
    ) -> Result<Self> {
        let mut arm = PlannedArm::new(start.q_commanded, opening_m);
        let mut robot = Robot::new(&mut arm, limits, Watch::default());
        let report = grasp(&mut robot, &mut Given(target), &mut (), mount, config)?;
        Ok(Self { start, opening_m, arm, outcome: report.outcome })
    }

    /// A line for each motion, and how the plan ends.
    ///
    /// # Errors
    /// The step that cannot be planned.
    pub(crate) fn tell(&self, is_seen: bool) -> Result<()> {
        let panda = sdg_kinematics::Panda::new();
        for action in self.arm.actions() {
            match action {
                PlannedAction::Motion(motion) => {
                    let tcp = panda.forward(motion.end()).translation.vector * 1e3;
                    let secs = motion.duration_secs();
                    eprintln!("  tcp to ({:.0}, {:.0}, {:.0}) mm in {secs:.1} s", tcp.x, tcp.y, tcp.z);
                }
                PlannedAction::Wait(_) => {}
                PlannedAction::Hand(sdg_robot::HandCommand::Move { opening_m, .. }) => {
                    eprintln!("  hand open to {:.0} mm", opening_m * 1e3);
                }
                PlannedAction::Hand(sdg_robot::HandCommand::Grasp { width_m, force_n, .. }) => {
                    eprintln!("  hand close on about {:.0} mm with {force_n:.0} N", width_m * 1e3);
                }
            }
        }
        match &self.outcome {
            GraspOutcome::Held => eprintln!("  {:.0} s in all", self.arm.duration_secs()),
            GraspOutcome::Failed { .. } if !is_seen => {
                eprintln!(
                    "  the part is not seen from where the arm stands: this is the way to the look-out poses only"
                );
            }
            GraspOutcome::Failed { step, why } => return Err(anyhow!("{step}: {why}")),
        }
        Ok(())
    }

    /// Draws the motion and the part that was seen as an animation and its last picture into a folder; the files. The part stays on the
    /// table: it is drawn where the camera saw it.
    ///
    /// # Errors
    /// Files that cannot be written, and errors of the renderer.
    #[cfg(feature = "simulation")]
    pub(crate) fn draw(&self, folder: &Path, seen: Option<&SeenOutline>) -> Result<Vec<PathBuf>> {
        use sdg_report::{Animation, AnimationOptions};
        use sdg_simulation::scene::{SceneVariation, SeenPart};
        use sdg_simulation::{RenderConfig, Renderer, Workcell, WorkcellConfig};

        /// Pictures of a motion at most: a slow one is shown faster.
        const MAX_FRAMES: f64 = 120.0;
        const SHOWN_FPS: f64 = 8.0;
        let seen_part = seen.map(|seen| SeenPart { outline_in_base: seen.outline_in_base.clone(), z_m: seen.z_m });
        let scene = SceneVariation::nominal(None);
        let mut cell = Workcell::new(&WorkcellConfig { seen_part, ..WorkcellConfig::new(scene) })?;
        let render = RenderConfig { width: 400, height: 300, ..RenderConfig::default() };
        let mut renderer = Renderer::new(cell.data().model(), render)?;
        let period_secs = (self.arm.duration_secs() / MAX_FRAMES).max(1.0 / SHOWN_FPS);
        let frames = PlannedArm::frames(&self.start.q_commanded, self.opening_m, self.arm.actions(), period_secs)
            .iter()
            .map(|(q, opening_m)| cell.scene_image_at(&mut renderer, q, *opening_m))
            .collect::<sdg_simulation::Result<Vec<_>>>()?;
        let options = AnimationOptions { source_fps: SHOWN_FPS, fps: SHOWN_FPS, max_width: 400, ..Default::default() };
        let animation = Animation::encode(&frames, &options)?;
        crate::files::prepare_folder(folder)?;
        let (gif, still) = (folder.join("dry-run.gif"), folder.join("dry-run.png"));
        sdg_report::write_atomically(&gif, animation.gif())?;
        let mut png = Vec::new();
        animation.still().write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png)?;
        sdg_report::write_atomically(&still, &png)?;
        Ok(vec![gif, still])
    }

    /// Without the simulator there is nothing to draw with.
    #[cfg(not(feature = "simulation"))]
    pub(crate) fn draw(&self, _folder: &Path, _seen: Option<&SeenOutline>) -> Result<Vec<PathBuf>> {
        eprintln!("this sdg was built without the simulator and draws no motion");
        Ok(Vec::new())
    }
}
