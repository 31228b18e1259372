//! The true state of a grasp, which the arm does not know: the part's pose and its contacts.

use sdg_robot::{GraspStep, Result, StepObserver};

use crate::workcell::Workcell;

/// Judges closing, lifting and holding by the simulated state, and shakes the part if the workcell's errors include a
/// shake.
pub(super) struct Judge {
    success_height_m: f64,
    pub(super) shake_amplitude_m: Option<f64>,
}

impl Judge {
    pub(super) fn new(success_height_m: f64) -> Self {
        Self { success_height_m, shake_amplitude_m: None }
    }
}

impl Workcell {
    /// The reason why the part is not between both fingers; `None` if it is.
    pub fn why_not_grasped(&self) -> Option<String> {
        match self.fingers_on_object() {
            [true, true] => None,
            [false, false] => {
                Some(format!("the fingers closed to {:.1} mm without touching the part", self.opening_m() * 1e3))
            }
            [left, _] => Some(format!("only the {} finger touches the part", if left { "left" } else { "right" })),
        }
    }

    /// The reason why the part is not lifted and between both fingers; `None` if it is.
    pub fn why_not_lifted(&self, success_height_m: f64) -> Option<String> {
        let height = self.object_height_m().unwrap_or(0.0);
        let fingers = self.fingers_on_object();
        if height >= success_height_m && fingers == [true, true] {
            return None;
        }
        let touch = match fingers {
            [true, true] => "between both fingers",
            [true, false] => "on the left finger only",
            [false, true] => "on the right finger only",
            [false, false] => "out of the hand",
        };
        Some(format!("the part is {:.0} mm above the table, {touch}", height * 1e3))
    }
}

impl StepObserver<Workcell> for Judge {
    fn before(&mut self, cell: &mut Workcell, step: GraspStep) -> Result<()> {
        if let (GraspStep::Hold, Some(shake)) = (step, cell.config().errors.shake) {
            self.shake_amplitude_m = Some(cell.shake(&shake)?);
        }
        Ok(())
    }

    fn after(&mut self, cell: &mut Workcell, step: GraspStep) -> Result<Option<String>> {
        Ok(match step {
            GraspStep::Detect | GraspStep::Hover | GraspStep::Approach => None,
            GraspStep::Carry | GraspStep::PutDown | GraspStep::Release | GraspStep::Check => None,
            GraspStep::Close => cell.why_not_grasped(),
            GraspStep::Lift | GraspStep::Hold => cell.why_not_lifted(self.success_height_m),
        })
    }
}
