//! What a grasp would do from where the arm stands: planned with the same sequence and limits, drawn and described; nothing moves.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use sdg_cell::SeenOutline;
use sdg_kinematics::collision::Obstacle;
use sdg_robot::{
    ArmState, CameraMount, GraspConfig, GraspStep, GraspTarget, KnownTarget, PlaceGoal, PlacingConfig, PlannedAction,
    PlannedArm, Robot, SafetyLimits, Watch,
};

use super::sequence_run::{Ended, run_sequence};

/// A grasp that is planned and not carried out.
#[cfg_attr(not(feature = "simulation"), expect(dead_code, reason = "only what is drawn needs the start"))]
pub(crate) struct DryRun {
    start: ArmState,
    opening_m: f64,
    arm: PlannedArm,
    failed: Option<(GraspStep, String)>,
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
        place: Option<&(PlaceGoal, PlacingConfig)>,
    ) -> Result<Self> {
        let mut arm = PlannedArm::new(start.q_commanded, opening_m);
        let mut robot = Robot::new(&mut arm, limits, Watch::default());
        let Ended { failed, .. } =
            run_sequence(&mut robot, &mut KnownTarget::new(target, mount, config), mount, config, place)
                .map_err(anyhow::Error::from)?;
        Ok(Self { start, opening_m, arm, failed })
    }

    /// A line for each motion, and how the plan ends.
    ///
    /// # Errors
    /// The step that cannot be planned.
    pub(crate) fn print(&self, is_seen: bool) -> Result<()> {
        let panda = sdg_kinematics::Panda::new();
        for action in self.arm.actions() {
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
        match &self.failed {
            None => eprintln!("  {:.0} s in all", self.arm.duration_secs()),
            Some(_) if !is_seen => {
                eprintln!(
                    "  the part is not seen from where the arm stands: this is the way to the look-out poses only"
                );
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
    pub(crate) fn draw(
        &self,
        folder: &Path,
        seen: Option<&SeenOutline>,
        obstacles: &[Obstacle],
    ) -> Result<Vec<PathBuf>> {
        use super::motion_drawing::MotionDrawing;
        use sdg_simulation::WorkcellConfig;
        use sdg_simulation::scene::{SceneVariation, SeenPart};

        const DRAWING: MotionDrawing = MotionDrawing { name: "dry-run", width_px: 400, fps: 8.0, max_frames: 120.0 };
        let seen_part = seen.map(|seen| SeenPart { outline_in_base: seen.outline_in_base.clone(), z_m: seen.z_m });
        let obstacles = obstacles.to_vec();
        let config = WorkcellConfig { seen_part, obstacles, ..WorkcellConfig::new(SceneVariation::nominal(None)) };
        let period_secs = DRAWING.period_secs(self.arm.duration_secs());
        let positions = PlannedArm::frames(&self.start.q_commanded, self.opening_m, self.arm.actions(), period_secs);
        DRAWING.draw(folder, &config, &positions)
    }

    /// Without the simulator there is nothing to draw with.
    #[cfg(not(feature = "simulation"))]
    pub(crate) fn draw(
        &self,
        _folder: &Path,
        _seen: Option<&SeenOutline>,
        _obstacles: &[Obstacle],
    ) -> Result<Vec<PathBuf>> {
        eprintln!("this sdg was built without the simulator and draws no motion");
        Ok(Vec::new())
    }
}
