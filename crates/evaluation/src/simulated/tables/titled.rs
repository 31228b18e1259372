//! A table with a heading, and cells that several tables use.

use sdg_report::{Cell, Table, Tone};

use crate::simulated::summary::{Figures, ModelSummary};
use crate::statistics::Share;

/// A table with a heading.
pub struct Titled {
    pub title: String,
    /// One or two sentences about the table.
    pub lead: String,
    pub table: Table,
}

/// The results with the check and, for models with a network, without it.
pub(super) fn ways(model: &ModelSummary) -> impl Iterator<Item = (String, &Figures)> {
    debug_assert_eq!(model.alone.is_some(), model.model.has_network());
    let alone = model.alone.as_ref().map(|figures| (format!("{}, alone", model.model), figures));
    std::iter::once((model.model.to_string(), &model.verified)).chain(alone)
}

/// A fraction as text, with a tone unless it is plain; a dash if its total is zero.
pub(crate) fn share(share: Share, tone: Tone) -> Cell {
    match (share.of, tone) {
        (0, _) => Cell::text("–"),
        (_, Tone::Plain) => Cell::text(share.to_string()),
        (_, tone) => Cell::Verdict { tone, text: share.to_string(), note: None },
    }
}

/// A number, or a dash.
pub(crate) fn number(value: Option<f64>, decimals: usize) -> Cell {
    value.map_or(Cell::missing(), |value| Cell::number(value, decimals))
}
