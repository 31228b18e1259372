//! Verification: the demonstration is laid over the image at the network's candidates and at the search's matches, and
//! its pose is refined.
//!
//! ```text
//! picture ─ halved for each size that is searched ─── SearchedImage ─┬─ search: the whole picture ──┬─ PlacedDemonstration
//! network ─ PoseCandidate ───────────────────────────────────────────┴─ verify: about the candidate ┘  {pose, Evidence}
//! ```
//! [`crate::verdict`] computes a score from the evidence.

use std::borrow::Cow;
use std::sync::Arc;

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_geometry::{Angle, PlanarSimilarity, Polygon};
use sdg_picture::halved;
use sdg_shape::{Differences, Evidence, Foreshortening, GradientField, Match, Picture, TableColors, parallel};

use crate::colors::Colors;
use crate::marks_shift::{MarksShift, Straightened};
use crate::models::PoseCandidate;
use crate::prepared::{Prepared, WorkingSize};
use crate::sizes::{SizeRange, scaling};
use crate::taught::TaughtDemonstration;

/// An image, and the demonstrations that are searched in it, at every possible size.
pub(crate) struct SearchedImage<'a> {
    views: Vec<View<'a>>,
    sized: Vec<SizedDemonstration<'a>>,
}

/// The imaging conditions, as far as they are known without a calibration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shot {
    /// Width and height of the original picture, which determine nominal sizes.
    pub(crate) size: [u32; 2],
    /// The point of the table vertically below the camera, in pixels of the image.
    pub(crate) below_camera: Point2<f64>,
    /// The height of the camera above the table, in pixels of the image.
    pub(crate) camera_height_px: f64,
}

/// Assumed focal length of a camera, in lengths of the picture's longer side: a field of view of 49°. Chosen by hand.
const FOCAL_WIDTHS: f64 = 1.1;

/// Assumed focal length of the camera that took a picture of this width and height, in pixels.
pub(crate) fn usual_focal_px(size: [u32; 2]) -> f64 {
    FOCAL_WIDTHS * f64::from(size[0].max(size[1]))
}

impl Shot {
    /// The shot of a camera with the usual lens that points vertically down at a point of the image.
    pub(crate) fn level_at(size: [u32; 2], below_camera: Point2<f64>) -> Self {
        Self { size, below_camera, camera_height_px: usual_focal_px(size) }
    }

    /// The shot of a camera that points vertically down.
    #[cfg(any(feature = "teach", test))]
    pub(crate) fn level(image: &RgbImage) -> Self {
        let (width, height) = image.dimensions();
        Self::level_at([width, height], Point2::new(0.5 * f64::from(width), 0.5 * f64::from(height)))
    }
}

/// The image, halved `halvings` times (0 or more), with its gradients, which all comparisons use.
struct View<'a> {
    halvings: u32,
    below_camera: Point2<f64>,
    camera_height_px: f64,
    image: Cow<'a, RgbImage>,
    field: GradientField,
    table: TableColors,
}

impl View<'_> {
    fn picture(&self) -> Picture<'_> {
        Picture { image: &self.image, field: &self.field, table: &self.table }
    }
}

/// A demonstration within one range of sizes.
struct SizedDemonstration<'a> {
    demonstration: &'a TaughtDemonstration,
    demonstration_idx: usize,
    range: SizeRange,
    range_idx: usize,
    working: WorkingSize,
    prepared: Arc<Prepared>,
    colors: Colors,
    view_idx: usize,
}

impl<'a> SearchedImage<'a> {
    /// Prepares every demonstration for the image's size. A demonstration is not searched at sizes at which it has no
    /// shape to compare.
    #[cfg(feature = "teach")]
    pub(crate) fn new(image: &'a RgbImage, demonstrations: &'a [TaughtDemonstration]) -> Self {
        Self::of(image, &Shot::level(image), demonstrations)
    }

    /// Prepares every demonstration for an image that need not have been taken vertically from above.
    pub(crate) fn of(image: &'a RgbImage, shot: &Shot, demonstrations: &'a [TaughtDemonstration]) -> Self {
        let mut searched = Self { views: Vec::new(), sized: Vec::new() };
        let colors = Colors::of(image);
        for (demonstration_idx, demonstration) in demonstrations.iter().enumerate() {
            let tolerance = &demonstration.check().search.scales;
            let ranges = SizeRange::all(demonstration.marks.photo_size, shot.size, tolerance);
            for (range_idx, range) in ranges.into_iter().enumerate() {
                if let Ok((working, prepared)) = demonstration.prepared(&range, colors) {
                    let view_idx = searched.view(image, shot, working.halvings, demonstration);
                    let sized = SizedDemonstration {
                        demonstration,
                        demonstration_idx,
                        range,
                        range_idx,
                        working,
                        prepared,
                        colors,
                        view_idx,
                    };
                    searched.sized.push(sized);
                }
            }
        }
        searched
    }

    /// A demonstration in the range of sizes nearest to `scale`.
    fn sized_for(&self, demonstration_idx: usize, scale: f64) -> Option<&SizedDemonstration<'a>> {
        let of_it = self.sized.iter().filter(|sized| sized.demonstration_idx == demonstration_idx);
        of_it.min_by(|a, b| a.range.distance(scale).total_cmp(&b.range.distance(scale)))
    }

    /// The index of the view that is halved this many times.
    fn view(&mut self, image: &'a RgbImage, shot: &Shot, halvings: u32, demonstration: &TaughtDemonstration) -> usize {
        if let Some(idx) = self.views.iter().position(|view| view.halvings == halvings) {
            return idx;
        }
        let mut view = Cow::Borrowed(image);
        for _ in 0..halvings {
            view = Cow::Owned(halved(&view));
        }
        let config = &demonstration.check().search.shape.gradient;
        let (field, table) = parallel::join(|| GradientField::with_config(&view, config), || TableColors::new(&view));
        let pixel_size = f64::from(1u32 << halvings);
        let (below_camera, camera_height_px) = (shot.below_camera / pixel_size, shot.camera_height_px / pixel_size);
        self.views.push(View { halvings, below_camera, camera_height_px, image: view, field, table });
        self.views.len() - 1
    }
}

/// A demonstration laid over an image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlacedDemonstration<'a> {
    pub(crate) demonstration: &'a TaughtDemonstration,
    pub(crate) demonstration_idx: usize,
    /// The index of the range of sizes in which the demonstration was searched; 0 for a followed part.
    pub(crate) range_idx: usize,
    pub(crate) image_from_cutout: PlanarSimilarity,
    /// The pose of the marks and their surroundings, which may be shifted relative to the outline.
    pub(crate) image_from_marks: PlanarSimilarity,
    /// Whether the image has colours.
    pub(crate) colors: Colors,
    /// Agreement of edges and surface together, in `[0, 1]`.
    pub(crate) agreement: f64,
    pub(crate) evidence: Evidence,
    /// Mean brightness at the pose divided by that of the demonstration.
    pub(crate) light: f64,
}

impl PlacedDemonstration<'_> {
    /// The part's outline, in pixels of the image.
    pub(crate) fn outline(&self) -> Polygon {
        self.demonstration.outline(&self.image_from_cutout)
    }
}

/// Distance from an end of the size range, in ln, within which the end may have stopped the refinement of a pose.
/// Chosen by hand.
const END_MARGIN_LOG: f64 = 0.02;
/// If the agreement increases by at least this much beyond an end of the size range, the end stopped the refinement.
/// Chosen by hand.
const MIN_GAIN_BEYOND_END: f64 = 0.05;
/// Minimum agreement for a search for the shift of the marks; poses below it are refused anyway. Chosen by hand to save
/// time.
const MIN_MARKED: f64 = 0.3;

impl<'a> SizedDemonstration<'a> {
    /// The pose of the resized cut-out in the halved picture.
    fn view_from_working(&self, image_from_cutout: &PlanarSimilarity) -> PlanarSimilarity {
        let view_from_image = scaling(1.0 / self.working.shrink());
        view_from_image.compose(image_from_cutout).compose(&self.prepared.working_from_cutout.inverse())
    }

    /// The pose of the cut-out in the image.
    fn image_from_cutout(&self, view_from_working: &PlanarSimilarity) -> PlanarSimilarity {
        scaling(self.working.shrink()).compose(view_from_working).compose(&self.prepared.working_from_cutout)
    }

    /// Whether a match at an end of the size range agrees better beyond the range, and is therefore another part.
    fn is_of_other_size(&self, view: &View<'_>, view_from_working: &PlanarSimilarity, agreement: f64) -> bool {
        let scales = self.prepared.search.scales();
        let from_end =
            (scales.end() / view_from_working.scale).ln().min((view_from_working.scale / scales.start()).ln());
        if from_end > END_MARGIN_LOG {
            return false;
        }
        let comparison = self.prepared.search.comparison(&view.picture());
        let refined = comparison.refined_by_edges(view_from_working);
        !scales.contains(&refined.scale) && comparison.agreement(&refined).both() > agreement + MIN_GAIN_BEYOND_END
    }

    /// The pose `refined` by edges from `start`, refined further by edges and surface; `None` if its size is outside
    /// the search range.
    fn refined(
        &self,
        view: &View<'_>,
        start: &PlanarSimilarity,
        refined: PlanarSimilarity,
    ) -> Option<PlacedDemonstration<'a>> {
        let comparison = self.prepared.search.comparison(&view.picture());
        let scales = self.prepared.search.scales();
        let refined = comparison.best_turn(&comparison.refine_pose(start, refined, scales), scales);
        let agreement = comparison.agreement(&refined).both();
        scales.contains(&refined.scale).then(|| self.placed(view, &refined, agreement, comparison.evidence(&refined)))
    }

    fn placed(
        &self,
        view: &View<'_>,
        view_from_working: &PlanarSimilarity,
        agreement: f64,
        evidence: Evidence,
    ) -> PlacedDemonstration<'a> {
        let image_from_cutout = self.image_from_cutout(view_from_working);
        // A plan view is made for the marks' plane, so that the marks are not displaced, and nothing would limit a
        // shift along a rod: in three of 40 pictures of another camera the errors were 7 to 8 mm with a shift, and 2 to
        // 4 mm without (pendulum, rod end).
        let is_flat = self.demonstration.check().score.is_size_known || agreement < MIN_MARKED;
        let marks_shift = self.prepared.marks_shift.as_ref().filter(|_| !is_flat);
        let round_top = self.prepared.round_top.as_ref().filter(|_| !is_flat);
        let camera = (view.camera_height_px, view.below_camera);
        let (marks, agreement, evidence) = if let Some(top) = round_top {
            let marks = top.placed(&self.prepared.search, &view.field, camera, view_from_working);
            (marks, agreement, evidence)
        } else {
            let raised = marks_shift.and_then(|shift| self.raised(view, shift, view_from_working, agreement));
            raised.unwrap_or((*view_from_working, agreement, evidence))
        };
        PlacedDemonstration {
            demonstration: self.demonstration,
            demonstration_idx: self.demonstration_idx,
            range_idx: self.range_idx,
            image_from_cutout,
            image_from_marks: self.image_from_cutout(&marks),
            colors: self.colors,
            agreement,
            evidence,
            light: self.prepared.search.brightness(&view.image, view_from_working),
        }
    }
}

impl SizedDemonstration<'_> {
    /// The pose of marks above or below the outline, and the part's agreement and evidence after removal of the marks'
    /// displacement from the image. `None` if the marks lie in the outline's plane, or if the agreement decreases: then
    /// other edges attracted the marks.
    fn raised(
        &self,
        view: &View<'_>,
        shift: &MarksShift,
        view_from_working: &PlanarSimilarity,
        flat_agreement: f64,
    ) -> Option<(PlanarSimilarity, f64, Evidence)> {
        let marks = shift.placed(&view.picture(), view.below_camera, view_from_working);
        if marks == *view_from_working {
            return None;
        }
        let search = &self.prepared.search;
        let coarsest_pixel = search.template().coarsest_pixel(view_from_working.scale);
        let outline = self.demonstration.outline(&self.prepared.working_from_cutout);
        let outline = outline.transformed(view_from_working);
        let Straightened { image, corner: [left, top] } =
            shift.straightened(&view.image, &outline, view_from_working, &marks, coarsest_pixel);
        let field = GradientField::with_config(&image, &self.demonstration.check().search.shape.gradient);
        let comparison = search.comparison(&Picture { image: &image, field: &field, table: &view.table });
        let pose = view_from_working.shifted(-Vector2::new(f64::from(left), f64::from(top)));
        let agreement = comparison.agreement(&pose).both();
        (agreement >= flat_agreement).then(|| (marks, agreement, comparison.evidence(&pose)))
    }
}

/// Every place in the image where a demonstration agrees well enough to be listed, except parts of another size.
pub(crate) fn search<'a>(searched: &SearchedImage<'a>) -> Vec<PlacedDemonstration<'a>> {
    let found_by = |sized: &SizedDemonstration<'a>| {
        let view = &searched.views[sized.view_idx];
        let matches = sized.prepared.search.search_picture(&view.picture());
        parallel::map(&matches, |found| {
            let Match { image_from_demonstration: pose, agreement, evidence } = found;
            (!sized.is_of_other_size(view, pose, *agreement)).then(|| sized.placed(view, pose, *agreement, *evidence))
        })
    };
    searched.sized.iter().flat_map(found_by).flatten().collect()
}

/// Lays the demonstration over the image at the candidate, in both directions, and returns the better pose. `None` if
/// this pose's size is outside the search range, or if the demonstration is not searched at any size.
///
/// Keypoints give position and orientation well, but a short grasp line gives the scale badly. Therefore the initial
/// scale is the one at which the outline's box has the area of the detected box, within the search range. A network
/// that confuses the part's ends is wrong by 180°; the demonstration distinguishes the ends.
pub(crate) fn verify<'a>(candidate: &PoseCandidate, searched: &SearchedImage<'a>) -> Option<PlacedDemonstration<'a>> {
    let of_it = searched.sized.iter().filter(|sized| sized.demonstration_idx == candidate.demonstration_idx);
    let demonstration = of_it.clone().next()?.demonstration;
    let pose = candidate.image_from_cutout;
    let outline = demonstration.outline(&pose).bounds();
    let scale = pose.scale * (candidate.bbox.area() / outline.area()).sqrt();
    let sized = of_it.min_by(|a, b| a.range.distance(scale).total_cmp(&b.range.distance(scale)))?;
    let start = about_middle(demonstration, &pose, Angle::ZERO, sized.range.clamp(scale) / pose.scale);
    better_way_round(sized, &start, searched)
}

/// Refines the pose from `start` and from `start` rotated by 180°; returns the pose of better agreement, refined by
/// edges and surface. `None` if the size of the refined pose is outside the search range, as for another part.
fn better_way_round<'a>(
    sized: &SizedDemonstration<'a>,
    start: &PlanarSimilarity,
    searched: &SearchedImage<'_>,
) -> Option<PlacedDemonstration<'a>> {
    let view = &searched.views[sized.view_idx];
    let comparison = sized.prepared.search.comparison(&view.picture());
    let turned = about_middle(sized.demonstration, start, Angle::from_radians(std::f64::consts::PI), 1.0);
    let [straight, turned] = [*start, turned].map(|start| {
        let start = sized.view_from_working(&start);
        let refined = comparison.refined_by_edges(&start);
        (start, refined, comparison.agreement(&refined).both())
    });
    let (start, refined, _) = if turned.2 > straight.2 { turned } else { straight };
    sized.refined(view, &start, refined)
}

/// The first demonstration laid over the image, refined from a pose; `None` if the size of the refined pose is outside
/// the search range.
#[cfg(feature = "teach")]
pub(crate) fn refined_from<'a>(
    searched: &SearchedImage<'a>,
    image_from_cutout: &PlanarSimilarity,
) -> Option<PlacedDemonstration<'a>> {
    let sized = searched.sized_for(0, image_from_cutout.scale)?;
    let view = &searched.views[sized.view_idx];
    let start = sized.view_from_working(image_from_cutout);
    let refined = sized.prepared.search.comparison(&view.picture()).refined_by_edges(&start);
    sized.refined(view, &start, refined)
}

/// The shortening of a placed demonstration, and the direction of the shortening in the image; `None` as for
/// [`ShapeTemplate::foreshortening`](sdg_shape::ShapeTemplate::foreshortening).
pub(crate) fn foreshortening(searched: &SearchedImage<'_>, placed: &PlacedDemonstration<'_>) -> Option<Foreshortening> {
    let sized = searched.sized_for(placed.demonstration_idx, placed.image_from_cutout.scale)?;
    let view = &searched.views[sized.view_idx];
    let pose = sized.view_from_working(&placed.image_from_cutout);
    sized.prepared.search.template().foreshortening(&view.field, &pose)
}

/// The agreement of edges and surface of a placed demonstration whose pose is refined in a rectified window; `None` if
/// a point of the outline has no position in the window.
pub(crate) fn agreement_in(
    searched: &SearchedImage<'_>,
    placed: &PlacedDemonstration<'_>,
    window: &RgbImage,
    window_point: impl Fn(&Point2<f64>) -> Option<Point2<f64>>,
) -> Option<f64> {
    let sized = searched.sized_for(placed.demonstration_idx, placed.image_from_cutout.scale)?;
    let taught = placed.demonstration.outline(&PlanarSimilarity::IDENTITY).vertices;
    let level: Option<Vec<_>> = placed.outline().vertices.iter().map(window_point).collect();
    let pose = sized.view_from_working(&PlanarSimilarity::fit(&taught, &level?)?);
    let mut image = Cow::Borrowed(window);
    for _ in 0..sized.working.halvings {
        image = Cow::Owned(halved(&image));
    }
    let field = GradientField::with_config(&image, &placed.demonstration.check().search.shape.gradient);
    let table = &searched.views[sized.view_idx].table;
    let comparison = sized.prepared.search.comparison(&Picture { image: &image, field: &field, table });
    Some(comparison.agreement(&comparison.refined_by_edges(&pose)).both())
}

/// Where picture and demonstration differ at a pose, in pixels of the picture; `None` if the demonstration is not
/// searched at any size.
pub(crate) fn differences(
    searched: &SearchedImage<'_>,
    demonstration_idx: usize,
    image_from_cutout: &PlanarSimilarity,
) -> Option<Differences> {
    let sized = searched.sized_for(demonstration_idx, image_from_cutout.scale)?;
    let view = &searched.views[sized.view_idx];
    let comparison = sized.prepared.search.comparison(&view.picture());
    let mut differences = comparison.differences(&sized.view_from_working(image_from_cutout));
    let image_from_view = scaling(sized.working.shrink());
    let to_image = |point: &mut Point2<f64>| *point = image_from_view.apply(point);
    let corners = differences.features.iter_mut().flat_map(|square| &mut square.vertices);
    differences.edges.iter_mut().chain(&mut differences.surface).chain(corners).for_each(to_image);
    Some(differences)
}

/// `pose` rotated and scaled about the centre of the outline in the image.
fn about_middle(
    demonstration: &TaughtDemonstration,
    pose: &PlanarSimilarity,
    turn: Angle,
    scale: f64,
) -> PlanarSimilarity {
    let pivot = demonstration.outline(pose).bounds().center();
    PlanarSimilarity::about(pivot, pivot, turn, scale).compose(pose)
}
