//! The trait by which the sequence finds a part, and the one that observes its steps.

use std::fmt;
use std::time::Instant;

use nalgebra::Isometry3;

use crate::arm::Arm;
use crate::error::Result;
use crate::grasp_target::GraspTarget;
use crate::height::{MeasuredHeight, Sighting};

/// Finds the grasp of the taught part with the arm where it stands.
pub trait PartFinder<A: Arm> {
    /// Takes a picture; the best grasp in it, sure or not, `None` where nothing is seen.
    ///
    /// # Errors
    /// Where no picture can be taken or perception could not do its work at all; the sequence is given up with this error.
    fn find(&mut self, arm: &mut A) -> Result<Option<GraspTarget>>;

    /// As [`PartFinder::find`], where several parts are seen: the one that is nearest to a grasp (`base_from_tcp`).
    ///
    /// # Errors
    /// As [`PartFinder::find`].
    fn find_nearest(&mut self, arm: &mut A, _base_from_tcp: &Isometry3<f64>) -> Result<Option<GraspTarget>> {
        self.find(arm)
    }

    /// Takes a picture and tells where it shows parts that may be the one at a grasp, wherever in height: for a height that is not known.
    /// Nothing where it shows none, and for perception that measures no heights.
    ///
    /// # Errors
    /// As [`PartFinder::find`].
    fn sight(&mut self, _arm: &mut A, _expected: &GraspTarget) -> Result<Vec<Sighting>> {
        Ok(Vec::new())
    }

    /// z of the surface beside a part that two sightings of the last calls of [`PartFinder::sight`] show, looked for about where it is expected;
    /// `None` where nothing is seen of it.
    ///
    /// # Errors
    /// As [`PartFinder::find`].
    fn surface_beside(&mut self, _pair: &[Sighting; 2], _expected: &MeasuredHeight) -> Result<Option<MeasuredHeight>> {
        Ok(None)
    }

    /// What else the picture of the last call shows for sure: parts of the same kind that lie beside the one that was found.
    fn others(&self) -> Vec<GraspTarget> {
        Vec::new()
    }

    /// When the picture of the last call was taken; `None` where time does not pass by a clock.
    fn picture_time(&self) -> Option<Instant> {
        None
    }
}

/// A step of the sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum GraspStep {
    /// Perception finds the part.
    Detect,
    /// The arm goes over the part and turns to it.
    Hover,
    /// The hand comes down to the part.
    Approach,
    /// The fingers close on it.
    Close,
    /// The arm lifts it.
    Lift,
    /// The part stays between the fingers.
    Hold,
    /// The arm takes it over its place.
    Carry,
    /// The hand comes down with it until its place is felt.
    PutDown,
    /// The fingers open and the hand goes up.
    Release,
    /// Perception looks where the part lies.
    Check,
}

impl GraspStep {
    /// The steps of a grasp in their order.
    pub const ALL: [Self; 6] = [Self::Detect, Self::Hover, Self::Approach, Self::Close, Self::Lift, Self::Hold];

    /// The steps of a grasp and of placing in their order.
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

/// Looks on, and may know more than the arm does: a simulation knows where the part is.
pub trait StepObserver<A: Arm> {
    /// Before a step.
    ///
    /// # Errors
    /// Ends the sequence.
    fn before(&mut self, _arm: &mut A, _step: GraspStep) -> Result<()> {
        Ok(())
    }

    /// After a step, before the hand is asked; why it failed, where it did.
    ///
    /// # Errors
    /// Ends the sequence.
    fn after(&mut self, _arm: &mut A, _step: GraspStep) -> Result<Option<String>> {
        Ok(None)
    }
}

/// An observer that does nothing.
impl<A: Arm> StepObserver<A> for () {}
