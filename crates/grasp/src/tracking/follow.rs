//! Refines one part in one frame: cuts a window around the part's expected pose, computes the window's gradients, and
//! fits the part's edges to them.
//!
//! ```text
//! expected pose ─ outline's box and the reach ─ window, halved as in the search ──── GradientField
//!                                                                                       │ snapped or captured
//!                                       edges, surface, hue, visible area ── Followed ──┘
//! ```

use std::sync::Arc;

use image::RgbImage;
use sdg_geometry::{BoundingBox, PlanarSimilarity};
use sdg_picture::halved;
use sdg_shape::{CloseLook, Evidence, GradientField, Picture, PixelRect, Reach, TableColors};

use super::detector::PartDetector;
use crate::colors::Colors;
use crate::detection::Placement;
use crate::prepared::{Prepared, WorkingSize};
use crate::sizes::{SizeRange, scaling};
use crate::taught::TaughtDemonstration;

/// Margin in pixels of the halved picture around the search range, for the gradients' smoothing (3) and for crests
/// beside an edge (6).
const BORDER_PX: f64 = 9.0;
/// Minimum side of a pyramid level; as in `sdg_shape`.
const MIN_LEVEL_SIDE: u32 = 24;
/// Side of the square of a close look, in lengths of the part: 1.25, and 0.03 so that at least one pixel remains for
/// interpolation.
const SEEN_CLOSELY: f64 = 1.28;

/// Maximum decrease of the agreement of a part that has not moved, caused by noise. Chosen by hand.
const STILL_AGREEMENT: f64 = 0.005;

/// A demonstration at the size at which a part is followed.
#[derive(Debug, Clone)]
pub(super) struct SizedPart {
    pub(super) demonstration_idx: usize,
    working: WorkingSize,
    prepared: Arc<Prepared>,
    pub(super) colors: Colors,
}

/// Search range around a part's expected pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Effort {
    /// Some pixels, for following from frame to frame.
    Snapped,
    /// A wider range, about five times slower.
    Captured,
}

/// The pose found by a search, and its agreement.
#[derive(Debug, Clone, Copy)]
pub(super) struct StillPose {
    pub(super) image_from_cutout: PlanarSimilarity,
    pub(super) agreement: f64,
}

/// A part in one frame.
#[derive(Debug, Clone)]
pub(super) struct Followed {
    /// Whether the part lies at the pose of the last search.
    pub(super) is_held: bool,
    /// The pose by edges alone; the pose of the last search if `is_held`.
    pub(super) by_edges: PlanarSimilarity,
    /// The pose by edges and surface: the pose by edges, or a correction of it.
    pub(super) image_from_cutout: PlanarSimilarity,
    /// Agreement of edges and surface together, in `[0, 1]`.
    pub(super) agreement: f64,
    /// The evidence without a close look.
    pub(super) evidence: Evidence,
    /// Mean brightness divided by that of the demonstration.
    pub(super) light: f64,
}

impl Effort {
    /// The search range in pixels of the halved picture. The scale hardly changes from frame to frame, and a free scale
    /// would add only noise. Chosen by hand.
    fn reach(self) -> Reach {
        match self {
            Self::Snapped => Reach { shift_px: 12.0, turn_rad: 0.12, log_scale: 0.02 },
            Self::Captured => Reach { shift_px: 20.0, turn_rad: 0.2, log_scale: 0.04 },
        }
    }
}

/// A window of a frame, halved.
struct View {
    image: RgbImage,
    /// Maps the frame to the window: a shift and a reduction.
    view_from_frame: PlanarSimilarity,
}

impl SizedPart {
    /// The demonstration for parts of the size of a found part; `None` if it has no shape to compare at that size.
    pub(super) fn new(detector: &PartDetector, found: &Placement, frame_size: [u32; 2]) -> Option<Self> {
        let &Placement { demonstration_idx, colors, .. } = found;
        let scale = found.image_from_cutout.scale;
        let demonstration = &detector.model().demonstrations()[demonstration_idx];
        let tolerance = &demonstration.check().search.scales;
        let range = SizeRange::all(demonstration.marks.photo_size, frame_size, tolerance)
            .into_iter()
            .min_by(|a, b| a.distance(scale).total_cmp(&b.distance(scale)))?;
        let (working, prepared) = demonstration.prepared(&range, colors).ok()?;
        Some(Self { demonstration_idx, working, prepared, colors })
    }

    pub(super) fn demonstration<'a>(&self, detector: &'a PartDetector) -> &'a TaughtDemonstration {
        &detector.model().demonstrations()[self.demonstration_idx]
    }

    /// Refines the part near `start`; `None` if the frame is smaller than a pixel of the halved picture. `correction` is the offset of the
    /// last found pose from the pose by edges alone, applied if it improves the agreement with the frame. If the
    /// frame's agreement with `still` has not decreased, the part lies at that pose, and nothing is refined.
    ///
    /// # Units and frames
    /// Poses map pixels of the cut-out to pixels of the searched image: the picture or the plan view.
    pub(super) fn follow(
        &self,
        detector: &PartDetector,
        picture: &RgbImage,
        start: &PlanarSimilarity,
        effort: Effort,
        correction: Option<&PlanarSimilarity>,
        still: Option<&StillPose>,
    ) -> Option<Followed> {
        let demonstration = self.demonstration(detector);
        let reach = effort.reach();
        let bounds = demonstration.outline(start).bounds();
        let margin = (reach.shift_px + BORDER_PX) * self.working.shrink();
        let search = &self.prepared.search;
        let working_scale = self.prepared.working_from_cutout.scale;
        let step = search.template().coarsest_pixel(start.scale / self.working.shrink() / working_scale);
        let view = self.view(detector, picture, &bounds, margin, step)?;
        let field = GradientField::with_config(&view.image, &demonstration.check().search.shape.gradient);
        // The table's colours are needed only for a close look.
        let picture = Picture { image: &view.image, field: &field, table: &TableColors::default() };
        let comparison = search.comparison(&picture);
        let both = |pose: &PlanarSimilarity| comparison.agreement(pose).both();
        let held = still.filter(|still| {
            both(&self.view_from_working(&view, &still.image_from_cutout)) >= still.agreement - STILL_AGREEMENT
        });
        let (by_edges, image_from_cutout) = match held {
            Some(still) => (still.image_from_cutout, still.image_from_cutout),
            None => {
                let start = self.view_from_working(&view, start);
                let pose = match effort {
                    Effort::Snapped => search.template().snapped(&field, &start, &reach),
                    Effort::Captured => search.template().captured(&field, &start, &reach),
                };
                let by_edges = self.image_from_cutout(&view, &pose);
                let corrected = correction.map(|correction| by_edges.compose(correction));
                let is_better =
                    |corrected: &PlanarSimilarity| both(&self.view_from_working(&view, corrected)) > both(&pose);
                (by_edges, corrected.filter(is_better).unwrap_or(by_edges))
            }
        };
        let pose = self.view_from_working(&view, &image_from_cutout);
        let (evidence, agreement) = comparison.evidence_from_afar(&pose);
        Some(Followed {
            is_held: held.is_some(),
            by_edges,
            image_from_cutout,
            agreement,
            evidence,
            light: search.brightness(&view.image, &pose),
        })
    }

    /// A close look at a pose; `None` as for [`Self::refined`].
    pub(super) fn close_look(
        &self,
        detector: &PartDetector,
        picture: &RgbImage,
        image_from_cutout: &PlanarSimilarity,
    ) -> Option<CloseLook> {
        let demonstration = self.demonstration(detector);
        let own = demonstration.marks.region().bounds();
        // A square around the part at any angle.
        let side = SEEN_CLOSELY * own.width().max(own.height()) * image_from_cutout.scale;
        let half = 0.5 * side * std::f64::consts::SQRT_2;
        let center = image_from_cutout.apply(&own.center());
        let square = BoundingBox { x1: center.x, y1: center.y, x2: center.x, y2: center.y };
        let view = self.view(detector, picture, &square, half, 1)?;
        let pose = self.view_from_working(&view, image_from_cutout);
        let field = GradientField::with_config(&view.image, &demonstration.check().search.shape.gradient);
        let picture = Picture { image: &view.image, field: &field, table: &TableColors::new(&view.image) };
        Some(self.prepared.search.comparison(&picture).close_look(&pose))
    }

    /// The window of the frame at `margin` around `bounds`, its corner at a multiple of `step` pixels of the halved
    /// picture.
    fn view(
        &self,
        detector: &PartDetector,
        picture: &RgbImage,
        bounds: &BoundingBox,
        margin: f64,
        step: u32,
    ) -> Option<View> {
        let shrink = 1 << self.working.halvings;
        let [width, height] = detector.frame_size(picture);
        let span = |low: f64, high: f64, limit: u32| {
            let grid = step * shrink;
            let least = MIN_LEVEL_SIDE * grid;
            let from = ((low - margin).max(0.0) as u32).min(limit) / grid * grid;
            // Near the frame's border the window is extended away from it.
            let from = from.min(limit.saturating_sub(least) / grid * grid);
            let to = ((high + margin).max(0.0).ceil() as u32).max(from + least).min(limit);
            (to >= from + shrink).then_some((from, to - from))
        };
        let (left, width) = span(bounds.x1, bounds.x2, width)?;
        let (top, height) = span(bounds.y1, bounds.y2, height)?;
        let mut image = detector.window(picture, &PixelRect { left, top, width, height });
        for _ in 0..self.working.halvings {
            image = halved(&image);
        }
        let shift = PlanarSimilarity::translation(-f64::from(left), -f64::from(top));
        Some(View { image, view_from_frame: scaling(1.0 / f64::from(shrink)).compose(&shift) })
    }

    fn view_from_working(&self, view: &View, image_from_cutout: &PlanarSimilarity) -> PlanarSimilarity {
        view.view_from_frame.compose(image_from_cutout).compose(&self.prepared.working_from_cutout.inverse())
    }

    fn image_from_cutout(&self, view: &View, view_from_working: &PlanarSimilarity) -> PlanarSimilarity {
        view.view_from_frame.inverse().compose(view_from_working).compose(&self.prepared.working_from_cutout)
    }
}
