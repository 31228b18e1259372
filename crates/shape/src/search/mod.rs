//! Searches a whole image for the taught part, without a network or training.
//!
//! ```text
//! demonstration ─ edge points of a coarse level ─ Bank: every angle and scale as shifts into tables
//! image ─ GradientField ─ coarse level ─ Responses: look-up tables for each direction
//!                                           │   (large pictures: a sweep of the next coarser level selects places)
//!                    sweep: every place × every variant ─ local maxima of every scale: starts
//!                                           │
//!          climb the agreement at a coarse level, 64 at a time; climb and snap the best level by level, eight at a
//!          time, as long as the last eight have found something, and to the finest level where a match is possible;
//!          then further starts that resemble the starts of the found parts
//!                                           │
//!          edges and surface ─ agreement ─ overlapping ones suppressed ─ poor ones refined again ─ Match, Evidence
//! ```

mod bank;
mod responses;
mod screen;
mod sweep;
#[cfg(test)]
mod tests;

use std::ops::RangeInclusive;

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_geometry::{PlanarSimilarity, Polygon};

use crate::capture_range::CaptureRange;
use crate::close_look::{CloseUp, Rival, TableColors};
use crate::comparison::{Agreement, Comparison, Evidence, MIN_REFINED, Picture};
use crate::config::ShapeConfig;
use crate::details::Details;
use crate::edge_points::{EdgePoint, EdgeSelection, select_edge_points};
use crate::error::ShapeError;
use crate::following::Reach;
use crate::gradient_field::GradientField;
use crate::likeness::Likeness;
use crate::parallel;
use crate::pose::Pose;
use crate::profile::Profile;
use crate::revolution::Revolution;
use crate::search::bank::Bank;
use crate::search::responses::{PITCH, Responses};
use crate::search::screen::Screen;
use crate::search::sweep::{Start, sweep};
use crate::structure::Structure;
use crate::surface::Surface;
use crate::template::ShapeTemplate;

/// Settings of the search and of its results.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SearchConfig {
    /// Range of scales; 1 is the demonstration's own size. A narrow range around 1, where the camera's height is known,
    /// is faster and causes fewer errors than a wide one. The default was chosen by hand.
    pub scales: RangeInclusive<f64>,
    /// Minimum agreement of a reported match, in `[0, 1]`. The default was chosen by hand.
    pub min_agreement: f64,
    /// Maximum number of reported matches. The default was chosen by hand.
    pub max_matches: usize,
    /// Edge points compared at every pose of the sweep over the image, 8 to 1024. The sweep's time is proportional to
    /// it. The default was chosen by hand, not measured. At most 128 different points are read at the swept level;
    /// above that, points repeat.
    pub num_points: usize,
    /// Maximum number of starts of the sweep that are climbed at the template's coarsest level, 8 to 4096, the best of
    /// every scale first. The first 64 are always climbed; more only if parts are found and further starts resemble the
    /// starts of these parts.
    pub max_starts: usize,
    /// How the edges are read.
    pub shape: ShapeConfig,
}

impl SearchConfig {
    /// The value of [`Default`] for [`num_points`](Self::num_points).
    pub const DEFAULT_NUM_POINTS: usize = 64;
    /// The value of [`Default`] for [`max_starts`](Self::max_starts): about a hundred per scale. Chosen by hand.
    pub const DEFAULT_MAX_STARTS: usize = 1024;
    /// The largest value of [`max_starts`](Self::max_starts). Chosen by hand.
    pub const LARGEST_MAX_STARTS: usize = 4096;
    /// Bounds of [`scales`](Self::scales); outside them the part at the swept level is too small or too large. Chosen by
    /// hand, not measured.
    pub const SCALE_BOUNDS: (f64, f64) = (0.5, 2.0);
}

impl SearchConfig {
    /// The values of [`Default`], as a constant.
    pub const DEFAULT: Self = Self {
        scales: 0.75..=1.3,
        min_agreement: 0.5,
        max_matches: 16,
        num_points: Self::DEFAULT_NUM_POINTS,
        max_starts: Self::DEFAULT_MAX_STARTS,
        shape: ShapeConfig::DEFAULT,
    };
}

impl Default for SearchConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A match of the taught part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// The pose of the demonstration in the image.
    pub image_from_demonstration: PlanarSimilarity,
    /// Edges and surface together, in `[0, 1]`: [`Agreement::both`].
    pub agreement: f64,
    /// All measurements in the image at this pose.
    pub evidence: Evidence,
}

/// A place that was followed, and its agreement.
#[derive(Debug, Clone, Copy)]
struct Found {
    pose: PlanarSimilarity,
    agreement: f64,
}

impl Found {
    fn is_worth_more(&self) -> bool {
        self.agreement >= MIN_FURTHER_AGREEMENT
    }
}

/// Minimum size of the part at the swept level, in level pixels. Chosen by hand, not measured; the sweep's time
/// grows with its fourth power.
const SWEEP_EXTENT: f64 = 50.0;
/// Maximum number of edge points read at the swept level; every pose uses a sample of them. Chosen by hand, not
/// measured.
const SWEEP_POINTS: usize = 128;
/// Minimum number of edge points at a level; with fewer, the next finer level is swept. Chosen by hand, not measured.
const MIN_SWEEP_POINTS: usize = 32;
/// Bounds of [`SearchConfig::num_points`]: fewer points do not distinguish poses, and the responses of 1024 points fit
/// the sweep's 16-bit sums. The upper bound is derived, the lower one chosen by hand.
const NUM_POINTS_BOUNDS: (usize, usize) = (8, 1024);
/// Bounds of [`SearchConfig::max_starts`]. Chosen by hand.
const MAX_STARTS_BOUNDS: (usize, usize) = (8, SearchConfig::LARGEST_MAX_STARTS);
/// Starts that are climbed together. Chosen by hand to save time.
const STARTS_AT_ONCE: usize = 64;
/// Climbed starts that are followed to full resolution together. Chosen by hand to save time.
const FOLLOWED_AT_ONCE: usize = 8;
/// Further starts are followed as long as at least one of the last eight has this agreement. Chosen by hand: 19 of 20
/// right poses on generated parts have more.
const MIN_FURTHER_AGREEMENT: f64 = 0.4;
/// Largest gain of agreement from the agreement's level to full resolution. On the tuned sets it is 0.06 at most for 99
/// of 100 places; a place that would gain more than `MAX_GAIN` may be missed.
const MAX_GAIN: f64 = 0.1;
/// Two places certainly overlap if their common share of the area exceeds [`MAX_OVERLAP`] by this margin. The margin is
/// needed because the share is estimated from few points and both places still move by some pixels. Chosen by hand.
const OVERLAP_MARGIN: f64 = 0.15;
/// Largest difference of the ln sizes of the parts in one picture: two steps of scale. Chosen by hand to save time.
const SAME_SIZE: f64 = 0.2;
/// Minimum response of a part in a picture, as a share of the best response of its size. Chosen by hand to save time:
/// ten photographed clips in one picture are all found.
const SAME_RESPONSE: f64 = 0.85;
/// Minimum response of a start for a climb. Chosen by hand, not measured.
const MIN_RESPONSE: f64 = 0.2;
/// Largest distance of a climb from its start, in places. Slightly more than the radius in which a start is the
/// maximum. Derived from this radius, not measured.
const FOLLOW_PLACES: f64 = 2.5;
/// Largest distance of a climb from its start in angle and ln scale, in steps of angle.
const FOLLOW_STEPS: f64 = 1.5;
/// Largest number of matches below `sure_agreement` that are refined again. Chosen by hand, not measured: more take
/// more time.
const MAX_NUM_POLISHED: usize = 16;
/// Number of the best matches below `sure_agreement` that are refined again even if probably not the part. Chosen by
/// hand, not measured.
const MIN_NUM_POLISHED: usize = 3;
/// Largest fraction of the part's area in which two matches may overlap. Chosen by hand, not measured.
const MAX_OVERLAP: f64 = 0.3;

/// Searches whole images for one taught part.
///
/// On 640×480 pixels a search over all scales from 0.75 to 1.3 takes some tens of milliseconds on two cores, and time
/// grows with the number of pixels; a part smaller than about 100 pixels takes up to four times as long.
#[derive(Debug, Clone)]
pub struct ShapeSearch {
    config: SearchConfig,
    template: ShapeTemplate,
    surface: Surface,
    structure: Structure,
    likeness: Likeness,
    details: Details,
    close_up: CloseUp,
    /// `None` where the mirror image equals the demonstration or has too few edges, and for a part of revolution.
    mirrored: Option<Rival>,
    /// `None` for a part of revolution, whose ends are distinguished by its profile.
    turned: Option<Rival>,
    /// For a part of revolution only.
    profile: Option<Profile>,
    outline: Polygon,
    bank: Bank,
    sweep_level_idx: usize,
    /// `None` if there is no next coarser level, or if the part has too few edges there.
    screen: Option<Screen>,
}

impl ShapeSearch {
    /// Prepares a demonstration for the search; takes milliseconds.
    ///
    /// # Units and frames
    /// `outline` is in pixels of `image`, as for [`ShapeTemplate::new`].
    ///
    /// # Errors
    /// As [`ShapeTemplate::new`]; [`ShapeError::InvalidConfig`] for scales outside 0.5 to 2 or in descending order, a
    /// minimum agreement outside 0 to 1, a number of points outside 8 to 1024, or a number of starts outside 8 to 4096.
    pub fn new(image: &RgbImage, outline: &Polygon, config: &SearchConfig) -> Result<Self, ShapeError> {
        check_config(config)?;
        let template = ShapeTemplate::new(image, outline, &config.shape)?;
        let field = GradientField::with_config(image, &config.shape.gradient);
        let (sweep_level_idx, points) = sweep_points(&field, &template, outline, config);
        let log_scales = [config.scales.start().ln(), config.scales.end().ln()];
        let screen = points_at(&field, &template, outline, config, sweep_level_idx + 1)
            .and_then(|points| Screen::new(&points, config.num_points, sweep_level_idx + 1, log_scales));
        let close_up = CloseUp::new(image, outline);
        let turned = || {
            let own_places = places_in_photo(&points, sweep_level_idx, &template, &field, config);
            Rival::turned(&close_up, &template, &field, outline.bounds().center(), &own_places)
        };
        let places_of_mirrored = |flipped: &RgbImage, outline: &Polygon, template: &ShapeTemplate| {
            let flipped = GradientField::with_config(flipped, &config.shape.gradient);
            let (level_idx, points) = sweep_points(&flipped, template, outline, config);
            places_in_photo(&points, level_idx, template, &field, config)
        };
        let profile = Profile::of(image, outline, &config.shape);
        let mirrored =
            || Rival::mirrored(image, outline, &field, &config.shape, places_of_mirrored, &close_up).ok().flatten();
        Ok(Self {
            config: config.clone(),
            surface: Surface::new(image, outline, &config.shape.surface),
            structure: Structure::new(&field, outline, &config.shape.structure, &config.shape.agreement),
            likeness: Likeness::new(image, outline),
            details: Details::new(image, outline),
            turned: if profile.is_some() { None } else { Some(turned()) },
            // A part of revolution differs from its mirror image only by the light on one side of the axis.
            mirrored: if profile.is_some() { None } else { mirrored() },
            profile,
            close_up,
            outline: outline.clone(),
            bank: Bank::new(&points, config.num_points, (1u32 << sweep_level_idx) as f64, log_scales),
            template,
            sweep_level_idx,
            screen,
        })
    }

    /// Finds the part anywhere in `image`, best match first; empty if there is none.
    ///
    /// The image may show several parts, at any angle. Deterministic.
    pub fn search(&self, image: &RgbImage) -> Vec<Match> {
        let field = GradientField::with_config(image, &self.config.shape.gradient);
        self.search_picture(&Picture { image, field: &field, table: &TableColors::new(image) })
    }

    /// As [`search`](Self::search), with the image's data given by the caller, because other comparisons also use them.
    pub fn search_picture(&self, picture: &Picture<'_>) -> Vec<Match> {
        let field = picture.field;
        if self.sweep_level_idx >= field.num_levels() || field.width().min(field.height()) == 0 {
            // The image is too small for the swept level.
            return Vec::new();
        }
        let responses = Responses::new(field.level(self.sweep_level_idx), self.bank.reach);
        let max_starts = self.config.max_starts;
        let area = self.screen.as_ref().and_then(|screen| screen.area(field, &responses, max_starts, MIN_RESPONSE));
        let starts = sweep(&responses, &self.bank, area.as_ref(), max_starts, MIN_RESPONSE);
        let best = self.apart(self.follow_best(picture, starts));
        let polished = self.polish(picture, best);
        let mut matches = self.apart(polished);
        matches.retain(|found| found.agreement >= self.config.min_agreement);
        matches.truncate(self.config.max_matches);
        let comparison = self.comparison(picture);
        let mut matches = parallel::map(&matches, |found| {
            let pose = comparison.best_turn(&found.pose, &self.config.scales);
            let agreement = if pose == found.pose { found.agreement } else { comparison.agreement(&pose).both() };
            Match { image_from_demonstration: pose, agreement, evidence: comparison.evidence(&pose) }
        });
        matches.sort_by(|a, b| b.agreement.total_cmp(&a.agreement));
        matches
    }

    /// Follows starts, the best first. If that finds parts, it also follows further starts that resemble the starts of
    /// these parts; otherwise it stops.
    fn follow_best(&self, picture: &Picture<'_>, mut starts: Vec<Start>) -> Vec<Found> {
        let mut climbed_before: Vec<Pose> = Vec::new();
        let mut all = Vec::new();
        while !starts.is_empty() {
            let later = starts.split_off(starts.len().min(STARTS_AT_ONCE));
            let climbed = self.climb_starts(picture, &starts, &climbed_before);
            let found = self.follow(picture, &climbed);
            starts = self.resembling(later, &starts, &found);
            all.extend(found);
            climbed_before.extend(climbed);
        }
        all
    }

    /// The starts of `later` that have the size of a found part and respond about as strongly as the best of `before`
    /// of that size.
    fn resembling(&self, mut later: Vec<Start>, before: &[Start], found: &[Found]) -> Vec<Start> {
        let parts = found.iter().filter(|found| found.is_worth_more());
        let log_scales: Vec<f64> = parts.map(|found| found.pose.scale.ln()).collect();
        let has_size = |start: &Start| {
            let log_scale = self.pose_of(start).log_scale;
            log_scales.iter().any(|found| (found - log_scale).abs() <= SAME_SIZE)
        };
        let best = before.iter().filter(|start| has_size(start)).map(|start| start.response).fold(0.0, f64::max);
        later.retain(|start| start.response >= SAME_RESPONSE * best && has_size(start));
        later
    }

    /// Follows climbed starts to full resolution, as long as one of the last few reaches [`MIN_FURTHER_AGREEMENT`].
    /// Starts that cannot be among the matches keep the pose of the agreement's level.
    fn follow(&self, picture: &Picture<'_>, climbed: &[Pose]) -> Vec<Found> {
        let mut all = Vec::new();
        for few in climbed.chunks(FOLLOWED_AT_ONCE) {
            let rough = parallel::map(few, |&pose| {
                let rough = self.template.follow_roughly(picture.field, &self.range_about(pose), pose);
                (rough, self.found(picture, rough.to_similarity(self.template.center)))
            });
            let places: Vec<_> = few.iter().zip(&rough).collect();
            let found = parallel::map(&places, |(start, (pose, found))| {
                if self.cannot_match(found, rough.iter().map(|(_, other)| other).chain(&all)) {
                    return *found;
                }
                let pose = self.template.follow_finely(picture.field, &self.range_about(**start), *pose);
                self.found(picture, pose.to_similarity(self.template.center))
            });
            let is_worth_more = found.iter().any(Found::is_worth_more);
            all.extend(found);
            if !is_worth_more {
                break;
            }
        }
        all
    }

    /// Whether a place at the agreement's level would not be a match at full resolution: it agrees too little, or
    /// a clearly better one lies over it.
    fn cannot_match<'a>(&self, rough: &Found, mut others: impl Iterator<Item = &'a Found>) -> bool {
        let listed = self.config.min_agreement.min(MIN_REFINED);
        let is_over = |other: &Found| {
            let other_from_rough = other.pose.inverse().compose(&rough.pose);
            self.surface.share_inside_roughly(&self.outline, &other_from_rough) > MAX_OVERLAP + OVERLAP_MARGIN
        };
        rough.agreement + MAX_GAIN < listed
            || others.any(|other| other.agreement > rough.agreement + MAX_GAIN && is_over(other))
    }

    fn found(&self, picture: &Picture<'_>, pose: PlanarSimilarity) -> Found {
        Found { pose, agreement: self.comparison(picture).agreement(&pose).both() }
    }

    /// Mean brightness of the part at a pose divided by that of the demonstration; 1 where it lies outside the image.
    pub fn brightness(&self, image: &RgbImage, image_from_demonstration: &PlanarSimilarity) -> f64 {
        self.surface.brightness(image, image_from_demonstration)
    }

    /// The range of scales.
    pub fn scales(&self) -> &RangeInclusive<f64> {
        &self.config.scales
    }

    /// The edges by which poses are refined.
    pub fn template(&self) -> &ShapeTemplate {
        &self.template
    }

    /// The axis of a part of revolution; `None` for other parts.
    pub fn revolution(&self) -> Option<&Revolution> {
        self.profile.as_ref().map(|profile| &profile.revolution)
    }

    /// The share of `shift`, in `[0, 1]`, by which `pose` moves until the outline of a part of revolution agrees best;
    /// 0 for other parts. Edges on the upper side, which are higher than the outline, may keep `pose` beside the
    /// outline.
    ///
    /// # Units and frames
    /// `shift` is in pixels of the picture from which `field` was computed.
    pub fn outline_beside(&self, field: &GradientField, pose: &PlanarSimilarity, shift: Vector2<f64>) -> f64 {
        self.profile.as_ref().map_or(0.0, |profile| profile.share_of(field, pose, shift))
    }

    /// The demonstration laid over an image.
    pub fn comparison<'a>(&'a self, picture: &Picture<'a>) -> Comparison<'a> {
        let Self { template, surface, structure, likeness, details, close_up, mirrored, turned, profile, .. } = self;
        let (min_agreement, mirrored, turned) = (self.config.min_agreement, mirrored.as_ref(), turned.as_ref());
        Comparison {
            template,
            surface,
            structure,
            likeness,
            details,
            close_up,
            mirrored,
            turned,
            profile: profile.as_ref(),
            min_agreement,
            picture: *picture,
        }
    }

    /// Refines poor matches from all directions: the start may have been on the wrong side of a shadow.
    fn polish(&self, picture: &Picture<'_>, found: Vec<Found>) -> Vec<Found> {
        let sure = self.config.shape.refinement.sure_agreement;
        let (poor, mut others): (Vec<Found>, Vec<Found>) =
            found.into_iter().partition(|found| (MIN_REFINED..sure).contains(&found.agreement));
        let count = poor
            .iter()
            .filter(|found| found.agreement >= MIN_FURTHER_AGREEMENT)
            .count()
            .clamp(MIN_NUM_POLISHED, MAX_NUM_POLISHED);
        let (first, rest) = poor.split_at(count.min(poor.len()));
        others.extend(parallel::map(first, |found| self.polished(picture, found)));
        others.extend(rest);
        others
    }

    fn polished(&self, picture: &Picture<'_>, found: &Found) -> Found {
        let comparison = self.comparison(picture);
        let refined =
            comparison.refine_pose(&found.pose, comparison.refined_by_edges(&found.pose), &self.config.scales);
        let refined = self.found(picture, refined);
        let is_in_range = self.config.scales.contains(&refined.pose.scale);
        if is_in_range && refined.agreement > found.agreement { refined } else { *found }
    }

    /// Best first; of matches that cover the same area, only the best.
    fn apart(&self, mut found: Vec<Found>) -> Vec<Found> {
        found.sort_by(|a, b| b.agreement.total_cmp(&a.agreement));
        let mut kept: Vec<Found> = Vec::new();
        for next in found {
            if kept.iter().all(|better| self.are_apart(&better.pose, &next.pose)) {
                kept.push(next);
            }
        }
        kept
    }

    /// The range of a climb: near its start, and within the scales of the search.
    fn range_about(&self, pose: Pose) -> CaptureRange {
        let [least, largest] = [self.config.scales.start().ln(), self.config.scales.end().ln()];
        let turn = FOLLOW_STEPS * self.bank.angle_step_rad;
        // A change of ln scale moves edges as far as a rotation by as many radians.
        let (low, high) = ((pose.log_scale - turn).max(least), (pose.log_scale + turn).min(largest));
        let shift = FOLLOW_PLACES * self.place_pitch();
        CaptureRange::around(Pose { log_scale: 0.5 * (low + high), ..pose }, [shift, shift, turn, 0.5 * (high - low)])
    }

    /// Climbs from every start at the template's coarsest level; the best by edges and surface first, without
    /// duplicates and without those found before.
    fn climb_starts(&self, picture: &Picture<'_>, starts: &[Start], before: &[Pose]) -> Vec<Pose> {
        let mut climbed = parallel::map(starts, |start| {
            let pose = self.pose_of(start);
            let (pose, edges) = self.template.climb_coarsest(picture.field, &self.range_about(pose), pose);
            let surface = self.surface.agreement(picture.image, &pose.to_similarity(self.template.center));
            (pose, Agreement::new(edges, surface, &self.config.shape.agreement).both())
        });
        climbed.sort_by(|a, b| b.1.total_cmp(&a.1));
        let pitch = self.place_pitch();
        let near = [pitch, pitch, 0.5 * self.bank.angle_step_rad, f64::INFINITY];
        let mut kept: Vec<Pose> = Vec::new();
        for (pose, _) in climbed {
            if kept.iter().chain(before).all(|other| !pose.is_near(other, near)) {
                kept.push(pose);
            }
        }
        kept
    }

    fn pose_of(&self, start: &Start) -> Pose {
        pose_of(start, &self.bank, self.sweep_level_idx)
    }

    /// Image pixels from one place to the next.
    fn place_pitch(&self) -> f64 {
        place_pitch(self.sweep_level_idx)
    }

    /// Whether two matches can both be right: parts do not overlap.
    fn are_apart(&self, one: &PlanarSimilarity, other: &PlanarSimilarity) -> bool {
        let one_from_other = one.inverse().compose(other);
        !self.surface.has_inside(&self.outline, &one_from_other, MAX_OVERLAP)
    }
}

fn place_pitch(sweep_level_idx: usize) -> f64 {
    (PITCH << sweep_level_idx) as f64
}

fn pose_of(start: &Start, bank: &Bank, sweep_level_idx: usize) -> Pose {
    let variant = &bank.variants[start.variant_idx];
    let [x, y] = start.place.map(|place| (place as f64 + 0.5) * place_pitch(sweep_level_idx));
    Pose { center: Point2::new(x, y), angle_rad: variant.angle_rad, log_scale: variant.log_scale }
}

/// The poses at which the photo resembles a part of about the same size (the taught one or its mirror image), wholly or
/// in some of its edges. `photo` are the photo's gradients, `points` the part's edge points at the swept level.
fn places_in_photo(
    points: &[EdgePoint],
    level_idx: usize,
    template: &ShapeTemplate,
    photo: &GradientField,
    config: &SearchConfig,
) -> Vec<PlanarSimilarity> {
    /// Number of places that are refined. Chosen by hand to save time.
    const MAX_PLACES: usize = 48;
    const SAME_LOG_SCALES: [f64; 2] = [-0.02, 0.02];
    const REACH: Reach = Reach { shift_px: 8.0, turn_rad: 0.1, log_scale: 0.02 };
    let bank = Bank::new(points, config.num_points, (1u32 << level_idx) as f64, SAME_LOG_SCALES);
    let starts = sweep(&Responses::new(photo.level(level_idx), bank.reach), &bank, None, MAX_PLACES, MIN_RESPONSE);
    parallel::map(&starts, |start| {
        let pose = pose_of(start, &bank, level_idx).to_similarity(template.center);
        template.captured(photo, &pose, &REACH)
    })
}

/// The coarsest level that still shows the part well, and its edge points there.
fn sweep_points(
    field: &GradientField,
    template: &ShapeTemplate,
    outline: &Polygon,
    config: &SearchConfig,
) -> (usize, Vec<EdgePoint>) {
    let bounds = outline.bounds();
    let extent = bounds.width().max(bounds.height());
    let coarsest = ((extent / SWEEP_EXTENT).log2().floor().max(0.0) as usize).min(field.num_levels() - 1);
    let points_of = |idx: usize| points_at(field, template, outline, config, idx).unwrap_or_default();
    let (mut idx, mut points) = (coarsest, points_of(coarsest));
    while idx > 0 && points.len() < MIN_SWEEP_POINTS {
        idx -= 1;
        points = points_of(idx);
    }
    (idx, points)
}

/// The edge points of a level; `None` if there is no such level.
fn points_at(
    field: &GradientField,
    template: &ShapeTemplate,
    outline: &Polygon,
    config: &SearchConfig,
    idx: usize,
) -> Option<Vec<EdgePoint>> {
    let selection = EdgeSelection {
        outline,
        center: template.center,
        max_points: SWEEP_POINTS,
        outline_weight: config.shape.outline_weight,
        inner_weight: 1.0,
    };
    (idx < field.num_levels()).then(|| select_edge_points(field.level(idx), (1u32 << idx) as f64, &selection))
}

const _: () =
    assert!(NUM_POINTS_BOUNDS.1 * responses::FULL as usize <= i16::MAX as usize, "responses add up in 16 bits");

fn check_config(config: &SearchConfig) -> Result<(), ShapeError> {
    let (least, largest) = (*config.scales.start(), *config.scales.end());
    let (lowest, highest) = SearchConfig::SCALE_BOUNDS;
    let within = |scale: f64| (lowest..=highest).contains(&scale);
    let checks = [
        ("scales", "from 0.5 on", least, within(least)),
        ("scales", "up to 2, and no less than the lower end", largest, within(largest) && largest >= least),
        ("min_agreement", "in [0, 1]", config.min_agreement, (0.0..=1.0).contains(&config.min_agreement)),
        (
            "num_points",
            "from 8 to 1024",
            config.num_points as f64,
            (NUM_POINTS_BOUNDS.0..=NUM_POINTS_BOUNDS.1).contains(&config.num_points),
        ),
        (
            "max_starts",
            "from 8 to 4096",
            config.max_starts as f64,
            (MAX_STARTS_BOUNDS.0..=MAX_STARTS_BOUNDS.1).contains(&config.max_starts),
        ),
    ];
    for (name, expected, found, ok) in checks {
        if !ok {
            return Err(ShapeError::InvalidConfig { name, expected, found });
        }
    }
    Ok(())
}
