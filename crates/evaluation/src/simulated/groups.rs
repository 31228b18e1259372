//! Two groups of parts with separate sums: the paper's parts, and parts on which no constant was fitted except
//! `sdg_robot::height::RELIEF_M`.

use sdg_simulation::objects::ObjectSpec;
use serde::Serialize;

/// A group of parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PartGroup {
    Paper,
    /// Four other parts.
    HeldOut,
}

impl PartGroup {
    /// Both groups, in the order of the reports.
    pub const ALL: [Self; 2] = [Self::Paper, Self::HeldOut];

    /// The group of a shipped part.
    pub fn of(object: &str) -> Self {
        if ObjectSpec::held_out_names().any(|name| name == object) { Self::HeldOut } else { Self::Paper }
    }

    /// The title in headings.
    pub fn title(self) -> &'static str {
        match self {
            Self::Paper => "The paper's parts",
            Self::HeldOut => "Held-out parts",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_parts_are_held_out() {
        assert_eq!(PartGroup::of("pendulum"), PartGroup::Paper);
        for name in ["key", "pliers", "circuit_board", "spring_clip"] {
            assert_eq!(PartGroup::of(name), PartGroup::HeldOut, "{name}");
        }
        assert_eq!(ObjectSpec::held_out_names().count(), 4);
    }
}
