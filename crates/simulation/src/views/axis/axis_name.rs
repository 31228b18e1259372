//! The axes and their names.

use std::fmt;
use std::str::FromStr;

use crate::error::{Result, SimulationError};

/// A property that makes a picture harder than an ordinary one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Axis {
    /// The camera is at 0.75 to 1.3 times its usual height.
    Height,
    /// The camera is tilted by 5 to 20 degrees about a random horizontal axis and aimed at the part or slightly beside
    /// it.
    Tilt,
    /// Another object covers 10 to 40 percent of the part's visible area.
    Covered,
    /// Little light: a dark picture with photon and read noise.
    Dark,
    /// Motion blur in pictures with an even number, defocus in the others.
    Blur,
    /// The colour of the light differs from the camera's white balance.
    Tint,
    /// Ten to fifteen distractors, pushed against the part and each other.
    Clutter,
    /// Three instances of the part.
    Instances,
    /// A look-alike instead of the part.
    LookAlikes,
    /// As [`Self::Tilt`], by 0 to 35 degrees. It is the last variant, because its position in the enum determines an
    /// axis' random numbers, and those of the other axes must not change.
    Slant,
}

impl Axis {
    /// All axes, in reporting order.
    pub const ALL: [Self; 10] = [
        Self::Height,
        Self::Tilt,
        Self::Slant,
        Self::Covered,
        Self::Dark,
        Self::Blur,
        Self::Tint,
        Self::Clutter,
        Self::Instances,
        Self::LookAlikes,
    ];

    /// The name at the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Height => "height",
            Self::Tilt => "tilt",
            Self::Slant => "slant",
            Self::Covered => "covered",
            Self::Dark => "dark",
            Self::Blur => "blur",
            Self::Tint => "tint",
            Self::Clutter => "clutter",
            Self::Instances => "instances",
            Self::LookAlikes => "look-alikes",
        }
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Axis {
    type Err = SimulationError;

    /// Reads a name in the form of [`Axis::name`].
    ///
    /// # Errors
    /// [`SimulationError::UnknownName`] with the names that exist.
    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|axis| axis.name() == name).ok_or_else(|| SimulationError::UnknownName {
            kind: "axis",
            name: name.to_owned(),
            existing: Self::ALL.map(|axis| axis.name().to_owned()).to_vec(),
        })
    }
}
