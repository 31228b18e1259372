//! The construction of a part: a sequence of features that raise, cut and paint a surface above the table.

mod bent;
mod builder;
mod cast;
mod construction;
mod cover;
mod feature;
mod material;
mod shape;
mod stamping;
mod turned;

use rand_pcg::Pcg64Mcg;

pub(crate) use construction::Recipe;
pub(crate) use cover::cover;
#[cfg(test)]
pub(crate) use feature::{Edge, Feature};
pub(crate) use feature::{Operation, State};
pub(crate) use material::{Brushing, Material, paint_color};
pub(crate) use shape::Shape;

use crate::part_kind::PartKind;

impl Recipe {
    /// Samples a part of a kind.
    pub fn draw(kind: PartKind, rng: &mut Pcg64Mcg) -> Self {
        match kind {
            PartKind::Stamping => stamping::draw(rng),
            PartKind::TurnedLying => turned::draw_lying(rng),
            PartKind::TurnedStanding => turned::draw_standing(rng),
            PartKind::BentWire => bent::draw_wire(rng),
            PartKind::BentSheet => bent::draw_sheet(rng),
            PartKind::Cast => cast::draw_cast(rng),
            PartKind::Moulded => cast::draw_moulded(rng),
        }
    }
}
