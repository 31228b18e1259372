//! The trait by which the sequence finds a part, and the trait that observes its steps.

use std::fmt;
use std::time::Instant;

use nalgebra::Isometry3;

use crate::arm::Arm;
use crate::error::Result;
use crate::grasp_target::GraspTarget;
use crate::height::{MeasuredHeight, Sighting};

/// Finds the grasp of the taught part from the arm's present pose.
pub trait PartFinder<A: Arm> {
    /// Takes a picture and returns its best grasp, at any score; `None` if there is no detection.
    ///
    /// # Errors
    /// A picture that cannot be taken, and a failure of perception; the sequence is aborted with this error.
    fn find(&mut self, arm: &mut A) -> Result<Option<GraspTarget>>;

    /// As [`PartFinder::find`], but of several detections it returns the nearest one to the grasp `base_from_tcp`. The
    /// part is expected at the height of this grasp.
    ///
    /// # Errors
    /// As for [`PartFinder::find`].
    fn find_nearest(&mut self, arm: &mut A, _base_from_tcp: &Isometry3<f64>) -> Result<Option<GraspTarget>> {
        self.find(arm)
    }

    /// Takes a picture for measuring a height and returns the detections that may be the part of the grasp `expected`,
    /// at any height. Empty if there are none, and for perception that measures no heights.
    ///
    /// # Errors
    /// As for [`PartFinder::find`].
    fn sight(&mut self, _arm: &mut A, _expected: &GraspTarget) -> Result<Vec<Sighting>> {
        Ok(Vec::new())
    }

    /// Measures z of the surface beside a part from two sightings of the last calls of [`PartFinder::sight`], near the
    /// surface's `expected` height; `None` if the pictures do not show the surface well enough.
    ///
    /// # Errors
    /// As for [`PartFinder::find`].
    fn surface_beside(&mut self, _pair: &[Sighting; 2], _expected: &MeasuredHeight) -> Result<Option<MeasuredHeight>> {
        Ok(None)
    }

    /// The other accepted detections in the picture of the last call: parts of the same kind beside the one that was
    /// found.
    fn others(&self) -> Vec<GraspTarget> {
        Vec::new()
    }

    /// The time at which the picture of the last call was taken; `None` if time is simulated.
    fn picture_time(&self) -> Option<Instant> {
        None
    }
}

/// A step of the sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum GraspStep {
    /// Perception finds the part.
    Detect,
    /// The arm moves above the part and rotates the hand to match it.
    Hover,
    /// The hand descends to the part.
    Approach,
    /// The fingers close on the part.
    Close,
    /// The arm lifts the part.
    Lift,
    /// The part stays between the fingers.
    Hold,
    /// The arm carries the part to above its place.
    Carry,
    /// The hand descends with the part until a contact with the place is measured.
    PutDown,
    /// The fingers open and the hand moves up.
    Release,
    /// Perception measures where the part lies.
    Check,
}

impl GraspStep {
    /// The steps of a grasp in order.
    pub const ALL: [Self; 6] = [Self::Detect, Self::Hover, Self::Approach, Self::Close, Self::Lift, Self::Hold];

    /// The steps of a grasp and of placing in order.
    pub const WITH_PLACING: [Self; 10] = [
        Self::Detect,
        Self::Hover,
        Self::Approach,
        Self::Close,
        Self::Lift,
        Self::Hold,
        Self::Carry,
        Self::PutDown,
        Self::Release,
        Self::Check,
    ];

    /// The name in messages and in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Detect => "detect",
            Self::Hover => "hover",
            Self::Approach => "approach",
            Self::Close => "close",
            Self::Lift => "lift",
            Self::Hold => "hold",
            Self::Carry => "carry",
            Self::PutDown => "put down",
            Self::Release => "release",
            Self::Check => "check",
        }
    }
}

impl fmt::Display for GraspStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Observes the steps. An observer may know more than the arm: a simulation knows the part's true pose.
pub trait StepObserver<A: Arm> {
    /// Called before each step, and again before [`GraspStep::Detect`] if the part's height is to be measured.
    ///
    /// # Errors
    /// An error ends the sequence.
    fn before(&mut self, _arm: &mut A, _step: GraspStep) -> Result<()> {
        Ok(())
    }

    /// Called after each step except [`GraspStep::Hover`], [`GraspStep::Approach`] and [`GraspStep::Check`], and after
    /// [`GraspStep::Detect`] only if the part's height was to be measured. Returns the reason if the step failed; this
    /// verdict has priority over that of the hand.
    ///
    /// # Errors
    /// An error ends the sequence.
    fn after(&mut self, _arm: &mut A, _step: GraspStep) -> Result<Option<String>> {
        Ok(None)
    }
}

/// An observer that does nothing.
impl<A: Arm> StepObserver<A> for () {}
