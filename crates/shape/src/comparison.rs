//! A demonstration laid over an image and compared by edges and surface.
//!
//! ```text
//! start ─ ShapeTemplate::refine: edges alone ─ agreement at least `sure_agreement`? ─ done
//!   │                  │
//!   └─ climb both ─ better ─ climb both ─┘
//!                     └─ still poor: climbed from six poses around it ─ refined by edges, kept where both still agree
//! ```
//! Refinement by edges alone places a part to a fraction of a pixel, but may follow the wrong edges: it may shift a
//! pipe until one flank lies on its shadow. At such a pose the agreements of edges and surface are low, but refinement
//! by edges does not use them, because it maximises the consensus of crests. Such poses are therefore refined by edges
//! and surface together, from the refined pose and from the start. On 480 pictures of eight parts, 960 refinements were
//! started some pixels off: by edges alone, 25 ended beside the part and 60 had an error above 3 px; with the further
//! refinement, 0 and 7. The first percentile of the agreement of right poses, which differs by part, was 0.32 to 0.59
//! and is now 0.49 to 0.62. The highest agreement of a wrong pose rose from 0.48 to 0.56.

use std::ops::RangeInclusive;

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_geometry::{Angle, CompassSearch, PlanarSimilarity, Polygon};

use crate::close_look::{CloseLook, CloseUp, Rival, TableColors};
use crate::config::{AgreementConfig, RefinementConfig};
use crate::details::Details;
use crate::gradient_field::GradientField;
use crate::likeness::Likeness;
use crate::parallel;
use crate::profile::Profile;
use crate::structure::Structure;
use crate::surface::Surface;
use crate::template::ShapeTemplate;

/// Steps of the climb, in pixels by which the part's rim moves: first and last. Chosen by hand, not measured
/// separately; the gain of the climbs as a whole is given above.
const STEPS_PX: (f64, f64) = (3.0, 0.3);
/// Smallest gain of a step. Chosen by hand, not measured.
const MIN_GAIN: f64 = 1e-4;
/// Maximum number of steps of a climb. Chosen by hand, not measured.
const MAX_EVALUATIONS: usize = 120;
/// Largest loss of agreement by the last refinement by edges, whose pose is more exact than a climbed one. Chosen by
/// hand, not measured.
const MAX_LOSS_BY_EDGES: f64 = 0.005;

/// A pose of lower agreement is refused without a close look. Chosen by hand to save time.
const MIN_CLOSE_LOOK_AGREEMENT: f64 = 0.3;
/// A pose of lower agreement is not tried at other angles. Chosen by hand to save time.
const MIN_TURN_AGREEMENT: f64 = 0.45;
/// Poses of lower agreement are not refined further. Chosen by hand, not measured.
pub(crate) const MIN_REFINED: f64 = 0.25;

/// A demonstration and an image over which it is laid.
#[derive(Debug, Clone, Copy)]
pub struct Comparison<'a> {
    /// The demonstration's edges.
    pub template: &'a ShapeTemplate,
    /// The surface inside its outline.
    pub surface: &'a Surface,
    /// The demonstration's edges over the whole area, compared also where only demonstration or image has an edge.
    pub structure: &'a Structure,
    /// The input of the likeness network.
    pub likeness: &'a Likeness,
    /// Its features, for the details network.
    pub details: &'a Details,
    pub(crate) close_up: &'a CloseUp,
    pub(crate) mirrored: Option<&'a Rival>,
    pub(crate) turned: Option<&'a Rival>,
    pub(crate) profile: Option<&'a Profile>,
    /// Poses of lower agreement get no close look.
    pub min_agreement: f64,
    /// The image over which the demonstration is laid.
    pub picture: Picture<'a>,
}

/// An image, and the data of it that every comparison uses.
#[derive(Debug, Clone, Copy)]
pub struct Picture<'a> {
    /// The image itself.
    pub image: &'a RgbImage,
    /// Its gradients.
    pub field: &'a GradientField,
    /// The colours of its table.
    pub table: &'a TableColors,
}

/// How well edges and surface agree at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement {
    /// [`ShapeTemplate::agreement`], in `[0, 1]`.
    pub edges: f64,
    /// [`Surface::agreement`], in `[0, 1]`.
    pub surface: f64,
    surface_share: f64,
}

impl Agreement {
    pub(crate) fn new(edges: f64, surface: f64, config: &AgreementConfig) -> Self {
        Self { edges, surface, surface_share: config.surface_share }
    }

    /// Weighted mean of both, in `[0, 1]`; the surface has the weight [`AgreementConfig::surface_share`].
    pub fn both(&self) -> f64 {
        (1.0 - self.surface_share) * self.edges + self.surface_share * self.surface
    }
}

/// Minimum likeness for computing the details. To save time they are not computed below it, because such poses are
/// refused anyway. Chosen by hand.
const MIN_LIKENESS: f64 = -4.0;

/// All measurements of a pose in an image, from which the caller computes a score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// [`ShapeTemplate::agreement`], in `[0, 1]`; for a part of revolution, its mean with the profile's agreement.
    pub edges: f64,
    /// [`Surface::agreement`], in `[0, 1]`; `None` where the demonstration's surface is plain.
    pub surface: Option<f64>,
    /// Distance of the hue from the demonstration's, in shares of red, green and blue: 0.1 is slightly tinted, 0.5 is
    /// another paint.
    pub hue_shift: f64,
    /// [`crate::StructureAgreement::visible`], in `[0, 1]`.
    pub visible: f64,
    /// The share of the part outside the image, in `[0, 1]`.
    pub outside: f64,
    /// `None` where edges and surface agree by less than [`crate::SearchConfig::min_agreement`], or by less than 0.3.
    pub close: Option<CloseLook>,
}

/// Where, at a pose, the image differs from the demonstration, to be shown to people; in pixels of the image.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Differences {
    /// Points with an edge in at least one of the two, in regions whose edges disagree.
    pub edges: Vec<Point2<f64>>,
    /// Surface points whose brightness and colour do not follow the demonstration's.
    pub surface: Vec<Point2<f64>>,
    /// Squares in which a feature or print differs ([`Details::differing`]).
    pub features: Vec<Polygon>,
}

impl Comparison<'_> {
    /// Where edges, surface and features disagree at a pose; for display only.
    pub fn differences(&self, image_from_demonstration: &PlanarSimilarity) -> Differences {
        Differences {
            edges: self.structure.differing(self.picture.field, image_from_demonstration),
            surface: self.surface.differing(self.picture.image, image_from_demonstration),
            features: self.details.differing(self.picture.image, image_from_demonstration),
        }
    }

    /// All measurements at a pose. Slower than [`Self::agreement`], which is enough for climbing.
    pub fn evidence(&self, image_from_demonstration: &PlanarSimilarity) -> Evidence {
        let (evidence, agreement) = self.evidence_from_afar(image_from_demonstration);
        let close = (agreement >= self.min_agreement.max(MIN_CLOSE_LOOK_AGREEMENT))
            .then(|| self.close_look(image_from_demonstration));
        Evidence { close, ..evidence }
    }

    /// `pose`, or the pose of another rotation at which the part resembles itself, if the distinguishing features
    /// favour that pose. For a part of revolution, `pose` with the position along the axis and the direction of the
    /// axis found from the profile. Scales stay in `scales`.
    pub fn best_turn(&self, pose: &PlanarSimilarity, scales: &RangeInclusive<f64>) -> PlanarSimilarity {
        if self.agreement(pose).both() < MIN_TURN_AGREEMENT {
            return *pose;
        }
        if let Some(profile) = self.profile {
            return profile.placed(self.picture.field, self.template, pose, scales);
        }
        let turned = self.turned.and_then(|turned| turned.better_turn(self.picture.image, self.picture.field, pose));
        turned.filter(|turned| scales.contains(&turned.scale)).unwrap_or(*pose)
    }

    /// A close look at a pose.
    pub fn close_look(&self, image_from_demonstration: &PlanarSimilarity) -> CloseLook {
        let Picture { image, field, table } = self.picture;
        let looked = || {
            let seen = self.close_up.seen(image, image_from_demonstration);
            let look = self.close_up.look(&seen, table);
            (seen, look)
        };
        let ((seen, look), likeness) =
            parallel::join(looked, || self.likeness.log_odds(image, image_from_demonstration));
        let details = || {
            let is_open = look.is_plausible() && likeness >= MIN_LIKENESS;
            is_open.then(|| self.details.log_odds(image, image_from_demonstration)).flatten()
        };
        let mirrored = || {
            let rival = self.mirrored.filter(|_| look.is_plausible())?;
            rival.against(self.close_up, &seen, field, image_from_demonstration)
        };
        let (details, mirrored) = parallel::join(details, mirrored);
        CloseLook {
            likeness,
            // In another roll angle, the features of a part of revolution are elsewhere, so negative details do not
            // count.
            details: if self.profile.is_some() { details.map(|details| details.max(0.0)) } else { details },
            mirrored,
            ..look
        }
    }

    /// Returns the result of [`Self::evidence`] without the close look, which takes nine tenths of the time, and
    /// [`Agreement::both`].
    pub fn evidence_from_afar(&self, image_from_demonstration: &PlanarSimilarity) -> (Evidence, f64) {
        let agreement = self.agreement(image_from_demonstration);
        let surface = agreement.surface;
        // The edges of a part of revolution inside its outline depend on its roll, so its profile weighs as much as all
        // of them.
        let profile = self.profile.map(|profile| profile.agreement(self.picture.field, image_from_demonstration));
        let edges = profile.map_or(agreement.edges, |profile| 0.5 * (agreement.edges + profile));
        let structure = self.structure.agreement(self.picture.field, image_from_demonstration);
        let evidence = Evidence {
            edges,
            surface: (!self.surface.is_plain()).then_some(surface),
            hue_shift: self.surface.hue_shift(self.picture.image, image_from_demonstration),
            visible: structure.visible,
            outside: structure.outside,
            close: None,
        };
        (evidence, agreement.both())
    }

    /// The agreement of the image with the demonstration at a pose.
    ///
    /// # Units and frames
    /// Poses map demonstration pixels to pixels of the image.
    pub fn agreement(&self, image_from_demonstration: &PlanarSimilarity) -> Agreement {
        Agreement::new(
            self.template.agreement(self.picture.field, image_from_demonstration),
            self.surface.agreement(self.picture.image, image_from_demonstration),
            &self.template.config.agreement,
        )
    }

    /// The pose refined by the edges alone: fast, and exact if it follows the right edges.
    pub fn refined_by_edges(&self, start: &PlanarSimilarity) -> PlanarSimilarity {
        self.template.refine(self.picture.field, start).image_from_demonstration
    }

    /// `refined` (from `start` by edges), or a nearby pose of higher agreement if the agreement of `refined` is poor.
    /// Scales stay in `scales`.
    pub fn refine_pose(
        &self,
        start: &PlanarSimilarity,
        refined: PlanarSimilarity,
        scales: &RangeInclusive<f64>,
    ) -> PlanarSimilarity {
        let RefinementConfig { sure_agreement, min_restart_agreement, .. } = self.template.config.refinement;
        let both = |pose: &PlanarSimilarity| self.agreement(pose).both();
        let agreement = both(&refined);
        if agreement >= sure_agreement || agreement.max(both(start)) < MIN_REFINED {
            return refined;
        }
        let ((from_refined, one), (from_start, other)) =
            parallel::join(|| self.climbed(refined, scales), || self.climbed(*start, scales));
        let (mut best, mut agreement) = if other > one { (from_start, other) } else { (from_refined, one) };
        if (min_restart_agreement..sure_agreement).contains(&agreement) {
            for (pose, seen) in parallel::map(&self.all_around(&best), |around| self.climbed(*around, scales)) {
                if seen > agreement {
                    (best, agreement) = (pose, seen);
                }
            }
        }
        let last = self.refined_by_edges(&best);
        if scales.contains(&last.scale) && both(&last) >= agreement - MAX_LOSS_BY_EDGES { last } else { best }
    }

    /// The pose shifted in six directions; chosen by hand, more shifts take proportionally more time.
    fn all_around(&self, pose: &PlanarSimilarity) -> [PlanarSimilarity; 6] {
        let center = pose.apply(&self.template.center);
        std::array::from_fn(|i| {
            let (sin, cos) = (i as f64 * std::f64::consts::TAU / 6.0).sin_cos();
            let to = center + self.template.config.refinement.restart_px * Vector2::new(cos, sin);
            PlanarSimilarity::about(center, to, Angle::ZERO, 1.0).compose(pose)
        })
    }

    /// Compass search near `from` for the best agreement of edges and surface together; returns the pose and its
    /// agreement.
    fn climbed(&self, from: PlanarSimilarity, scales: &RangeInclusive<f64>) -> (PlanarSimilarity, f64) {
        let search = CompassSearch {
            steps: STEPS_PX,
            min_gain: MIN_GAIN,
            max_rounds: usize::MAX,
            max_evaluations: MAX_EVALUATIONS,
        };
        let neighbour = |pose: &PlanarSimilarity, coordinate: usize, step_px: f64| {
            Some(self.stepped(pose, coordinate, step_px)).filter(|next| scales.contains(&next.scale))
        };
        search.climb(from, neighbour, |pose| self.agreement(pose).both())
    }

    /// Moves along x or y, rotates or scales, so that edges move by about `step_px` pixels of the image.
    fn stepped(&self, pose: &PlanarSimilarity, direction: usize, step_px: f64) -> PlanarSimilarity {
        let center = pose.apply(&self.template.center);
        let turn = step_px / (self.template.radius_px() * pose.scale).max(1.0);
        let (shift, angle, scale) = match direction {
            0 => (Vector2::new(step_px, 0.0), Angle::ZERO, 1.0),
            1 => (Vector2::new(0.0, step_px), Angle::ZERO, 1.0),
            2 => (Vector2::zeros(), Angle::from_radians(turn), 1.0),
            _ => (Vector2::zeros(), Angle::ZERO, turn.exp()),
        };
        PlanarSimilarity::about(center, center + shift, angle, scale).compose(pose)
    }
}
