//! Selects the places of a large picture that are swept: those near the best places of the next coarser level.
//!
//! A sweep of the coarser level takes an eighth of the time or less, because it has a quarter of the places, half of
//! the angles and fewer scales.

use crate::edge_points::EdgePoint;
use crate::gradient_field::GradientField;
use crate::search::bank::Bank;
use crate::search::responses::Responses;
use crate::search::sweep::{Area, sweep};

/// Minimum number of places of a picture that is screened; smaller ones are swept everywhere in a few milliseconds.
/// Chosen by hand.
const MIN_PLACES: usize = 1 << 18;
/// Minimum number of edge points at the coarser level. Chosen by hand.
const MIN_POINTS: usize = 24;
/// Minimum number of places of the coarser level about which the picture is swept. With 128 places, 13 of 130 parts in
/// mosaics of photographs were lost; with 256, one.
const MIN_SWEPT_PLACES: usize = 256;
/// Number of starts for each of these places, as with the default number of starts. More starts are for more parts.
const STARTS_PER_PLACE: usize = 4;
/// How far the swept places extend around a place of the coarser level, in swept places: three places of that level.
/// Chosen by hand.
const RADIUS: usize = 6;

/// The part at the level that is one coarser than the swept one.
#[derive(Debug, Clone)]
pub(crate) struct Screen {
    bank: Bank,
    level_idx: usize,
}

impl Screen {
    /// `points` are the part's edge points at level `level_idx`; `None` if there are too few of them.
    pub(crate) fn new(points: &[EdgePoint], num_points: usize, level_idx: usize, log_scales: [f64; 2]) -> Option<Self> {
        let bank = || Bank::new(points, num_points, f64::from(1u32 << level_idx), log_scales);
        (points.len() >= MIN_POINTS).then(|| Self { bank: bank(), level_idx })
    }

    /// The places to sweep for `max_starts` starts; `None` for a small picture, which is swept everywhere.
    pub(crate) fn area(
        &self,
        field: &GradientField,
        responses: &Responses,
        max_starts: usize,
        min_response: f64,
    ) -> Option<Area> {
        if responses.width * responses.height < MIN_PLACES || self.level_idx >= field.num_levels() {
            return None;
        }
        let coarse = Responses::new(field.level(self.level_idx), self.bank.reach);
        let mut area = Area::none_of(responses);
        let num_places = (max_starts / STARTS_PER_PLACE).max(MIN_SWEPT_PLACES);
        for start in sweep(&coarse, &self.bank, None, num_places, min_response) {
            area.add(responses, start.place.map(|at| 2 * at), RADIUS);
        }
        Some(area)
    }
}
