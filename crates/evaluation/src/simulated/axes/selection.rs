//! Measurements in addition to the paper's protocol, by name: axes of pictures, and grasps under errors.

use sdg_simulation::views::Axis;
use serde::{Deserialize, Serialize};

/// The error of an attempt, in the marks for teaching, in the robot's settings or in the workcell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GraspCondition {
    /// No error: the paper's protocol.
    NoError,
    /// An error of the demonstration's grasp marks, box and outline.
    Marks,
    /// An error of the height of the marks.
    MarkHeight,
    /// An error of the camera's pose in the hand.
    HandEye,
    Friction,
    /// No error, but the hand shakes after lifting.
    Shake,
}

impl GraspCondition {
    /// All conditions; the control is the first.
    pub const ALL: [Self; 6] =
        [Self::NoError, Self::Marks, Self::MarkHeight, Self::HandEye, Self::Friction, Self::Shake];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoError => "no-error",
            Self::Marks => "marks",
            Self::MarkHeight => "mark-height",
            Self::HandEye => "hand-eye",
            Self::Friction => "friction",
            Self::Shake => "shake",
        }
    }

    /// The description in tables.
    pub fn description(self) -> &'static str {
        match self {
            Self::NoError => "no error (control)",
            Self::Marks => "marks jittered by 3 px",
            Self::MarkHeight => "mark height wrong by 3 mm",
            Self::HandEye => "hand-eye wrong by 2 mm and 0.5°",
            Self::Friction => "pads' friction 0.6 to 0.8, without priority",
            Self::Shake => "shake after lifting",
        }
    }
}

/// Name for all axes of pictures.
const ALL_PICTURES: &str = "pictures";
/// Name for all grasps under errors, including the control.
const ALL_GRASPS: &str = "grasps";
/// Name for all measurements.
const EVERYTHING: &str = "all";

/// Axes and conditions, each at most once, in the order of the reports.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Selection {
    pub axes: Vec<Axis>,
    pub conditions: Vec<GraspCondition>,
}

impl Selection {
    /// Parses names; an empty list selects everything.
    ///
    /// # Errors
    /// A name is unknown; the error lists the known ones.
    pub fn parse(names: &[String]) -> Result<Self, String> {
        let mut selection = Self::default();
        let everything = [EVERYTHING.to_owned()];
        for name in if names.is_empty() { everything.as_slice() } else { names } {
            let name = name.trim();
            let is_meant = |own: &str, group: &str| [own, group, EVERYTHING].contains(&name);
            let axes: Vec<Axis> = Axis::ALL.into_iter().filter(|axis| is_meant(axis.name(), ALL_PICTURES)).collect();
            let conditions: Vec<GraspCondition> =
                GraspCondition::ALL.into_iter().filter(|condition| is_meant(condition.name(), ALL_GRASPS)).collect();
            if axes.is_empty() && conditions.is_empty() {
                return Err(format!("expected names out of {}, found \"{name}\"", known().join(", ")));
            }
            selection.axes.extend(axes);
            selection.conditions.extend(conditions);
        }
        let Self { axes, conditions } = selection;
        Ok(Self {
            axes: Axis::ALL.into_iter().filter(|axis| axes.contains(axis)).collect(),
            conditions: GraspCondition::ALL.into_iter().filter(|condition| conditions.contains(condition)).collect(),
        })
    }
}

/// All known names.
fn known() -> Vec<&'static str> {
    let axes = Axis::ALL.into_iter().map(Axis::name);
    let conditions = GraspCondition::ALL.into_iter().map(GraspCondition::name);
    axes.chain(conditions).chain([ALL_PICTURES, ALL_GRASPS, EVERYTHING]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(names: &[&str]) -> Result<Selection, String> {
        Selection::parse(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn no_name_is_everything_and_groups_stand_for_their_members() {
        let all = parse(&[]).unwrap();
        assert_eq!((all.axes.len(), all.conditions.len()), (10, 6));
        assert_eq!(parse(&["all"]).unwrap(), all);
        assert_eq!(parse(&["grasps", "pictures"]).unwrap(), all);
    }

    #[test]
    fn names_are_kept_once_and_in_order() {
        let some = parse(&["shake", "tilt", " height", "tilt"]).unwrap();
        assert_eq!(some, Selection { axes: vec![Axis::Height, Axis::Tilt], conditions: vec![GraspCondition::Shake] });
    }

    #[test]
    fn an_unknown_name_lists_the_known_ones() {
        let message = parse(&["tilt", "fog"]).unwrap_err();
        assert!(message.contains("found \"fog\""), "{message}");
        for name in ["height", "look-alikes", "mark-height", "pictures", "grasps", "all"] {
            assert!(message.contains(name), "{message}");
        }
    }
}
