//! The mirror image as an alternative explanation of the picture, compared with the photo only where the two differ.
//!
//! ```text
//! mirror image ─ laid over the photo at all turns ─ starts: the turns at which they resemble each other most
//! pose of the photo ∘ start ─ refined by edges in the picture ─ rival's pose ─┐
//!                          photo's and rival's gradients in one frame ─ where they differ ─ fit of photo − fit of rival ─ margin
//! ```

use image::RgbImage;
use image::imageops;
use nalgebra::Point2;
use sdg_geometry::{Angle, PlanarSimilarity, Polygon};

use super::close_up::{CloseUp, MIN_EDGES, SIDE, Seen};
use super::gradients::{Expected, Gradients};
use super::look::RivalFit;
use crate::config::ShapeConfig;
use crate::error::ShapeError;
use crate::following::Reach;
use crate::gradient_field::GradientField;
use crate::parallel;
use crate::template::ShapeTemplate;

/// Number of angles at which the rival is laid over the photo.
const NUM_TURNS: usize = 36;
/// Number of the best poses of the rival that are followed to the pyramid level at which agreement is computed.
const NUM_FOLLOWED: usize = 14;
/// Number of the best followed poses that are tried in pictures.
const NUM_STARTS: usize = 4;
/// Minimum difference between starts in angle, if they are nearer than `APART_SHARE` in position.
const APART_RAD: f64 = 0.2;
/// Minimum distance between starts, as a share of the edges' root mean square distance from the centre.
const APART_SHARE: f64 = 0.25;
/// Largest distance of a refined pose from its start. It allows for the perspective of a picture.
const REACH: Reach = Reach { shift_px: 16.0, turn_rad: 0.2, log_scale: 0.05 };
/// Minimum agreement of the photo's edges with themselves at a rotation that is tried in pictures.
const MIN_RESEMBLANCE: f64 = 0.4;
/// A rotation is compared closely if its agreement with the picture is lower than the original pose's by at most this.
const MAX_LOSS_BY_TURN: f64 = 0.03;
/// Minimum extent of the differences between mirror image and photo, as a share of the photo's edges. Chosen by hand.
const MIN_SHARE: f64 = 0.03;
/// Minimum extent of the differences between the photo at the original pose and at a rotation that replaces it. Chosen
/// by hand.
const MIN_SHARE_OF_TURN: f64 = 0.02;
/// Minimum gain of correlation by a rotation that replaces the pose. Chosen by hand.
const MIN_GAIN_BY_TURN: f64 = 0.1;
/// A window differs if the edges of photo and rival in it correlate by less than this.
const SAME: f32 = 0.6;

/// The poses, from the template's own pixels to the cut-out's, at which `template` resembles the photo most. They are
/// the best by agreement with the photo's gradients among the poses `further` and the rotations about the centre; only
/// poses for which `counts` holds are considered.
fn resembling(
    template: &ShapeTemplate,
    field: &GradientField,
    middles: [Point2<f64>; 2],
    further: &[PlanarSimilarity],
    counts: impl Fn(&PlanarSimilarity, f64) -> bool,
) -> Vec<PlanarSimilarity> {
    let turns = (0..NUM_TURNS).map(|k| {
        let turn = Angle::from_radians(k as f64 * std::f64::consts::TAU / NUM_TURNS as f64);
        template.captured_coarsely(field, &PlanarSimilarity::about(middles[0], middles[1], turn, 1.0), &REACH)
    });
    let mut turns: Vec<(PlanarSimilarity, f64)> = turns.collect();
    turns.sort_by(|a, b| b.1.total_cmp(&a.1));
    let about_middle = turns.iter().take(NUM_FOLLOWED).map(|(pose, _)| template.captured_roughly(field, pose, &REACH));
    let mut fits: Vec<(PlanarSimilarity, f64)> = about_middle
        .chain(further.iter().map(|pose| (*pose, template.agreement(field, pose))))
        .filter(|(pose, agreement)| counts(pose, *agreement))
        .collect();
    fits.sort_by(|a, b| b.1.total_cmp(&a.1));
    let apart_px = APART_SHARE * template.radius_px();
    let are_apart = |a: &PlanarSimilarity, b: &PlanarSimilarity| {
        a.angle.distance(b.angle) > APART_RAD || (a.apply(&middles[0]) - b.apply(&middles[0])).norm() > apart_px
    };
    let mut starts: Vec<PlanarSimilarity> = Vec::new();
    for (pose, _) in fits {
        if starts.len() < NUM_STARTS && starts.iter().all(|kept| are_apart(kept, &pose)) {
            starts.push(pose);
        }
    }
    starts
}

/// An alternative explanation of the picture: the mirror image, or the part itself turned.
#[derive(Debug, Clone)]
pub(crate) struct Rival {
    close_up: CloseUp,
    template: ShapeTemplate,
    /// The poses of greatest resemblance with the photo: from the rival's own pixels to the cut-out's.
    starts: Vec<PlanarSimilarity>,
}

impl Rival {
    /// The mirror image of a demonstration whose gradients are `field`; `None` where it equals the demonstration.
    /// `places` finds where a template's part may be in the photo.
    ///
    /// # Errors
    /// As [`ShapeTemplate::new`].
    pub(crate) fn mirrored(
        cutout: &RgbImage,
        outline: &Polygon,
        field: &GradientField,
        config: &ShapeConfig,
        places: impl Fn(&RgbImage, &Polygon, &ShapeTemplate) -> Vec<PlanarSimilarity>,
        photo: &CloseUp,
    ) -> Result<Option<Self>, ShapeError> {
        let flipped = imageops::flip_horizontal(cutout);
        let width = f64::from(cutout.width());
        let mut mirrored = outline.clone();
        mirrored.vertices.iter_mut().for_each(|vertex| vertex.x = width - vertex.x);
        let template = ShapeTemplate::new(&flipped, &mirrored, config)?;
        let middles = [&mirrored, outline].map(|outline| outline.bounds().center());
        let places = places(&flipped, &mirrored, &template);
        let starts = resembling(&template, field, middles, &places, |_, _| true);
        let made = Self { close_up: CloseUp::new(&flipped, &mirrored), template, starts };
        let is_the_same = made.starts.iter().any(|start| made.close_up.share_differing(photo, start) < MIN_SHARE);
        Ok((!is_the_same).then_some(made))
    }

    /// The part itself, turned and shifted to where it resembles itself.
    pub(crate) fn turned(
        close_up: &CloseUp,
        template: &ShapeTemplate,
        field: &GradientField,
        middle: Point2<f64>,
        places: &[PlanarSimilarity],
    ) -> Self {
        let is_turn = |pose: &PlanarSimilarity, agreement: f64| {
            agreement >= MIN_RESEMBLANCE && pose.angle.radians().abs() > APART_RAD
        };
        let mut starts = resembling(template, field, [middle; 2], places, is_turn);
        starts.retain(|start| close_up.share_differing(close_up, start) >= MIN_SHARE_OF_TURN);
        Self { close_up: close_up.clone(), template: template.clone(), starts }
    }

    /// The pose of another rotation at which the photo fits the picture better than at `pose`, compared where the two
    /// differ; `None` if there is none.
    pub(crate) fn better_turn(
        &self,
        image: &RgbImage,
        field: &GradientField,
        pose: &PlanarSimilarity,
    ) -> Option<PlanarSimilarity> {
        let agreement = self.template.agreement(field, pose);
        let likely =
            self.followed(field, pose).into_iter().filter(|(_, of_turn)| *of_turn >= agreement - MAX_LOSS_BY_TURN);
        let likely: Vec<PlanarSimilarity> = likely.map(|(turn, _)| turn).collect();
        if likely.is_empty() {
            return None;
        }
        let seen = self.close_up.seen(image, pose);
        let judged = likely
            .into_iter()
            .map(|turn| (turn, self.close_up.duel(&self.close_up, &seen, &turn.inverse().compose(pose))));
        let better = judged.filter(|(_, fit)| fit.share >= MIN_SHARE_OF_TURN && fit.margin <= -MIN_GAIN_BY_TURN);
        let best = better.min_by(|a, b| a.1.margin.total_cmp(&b.1.margin));
        best.map(|(turn, _)| self.template.captured(field, &turn, &REACH))
    }

    /// The rival's possible poses at a pose of the photo, one for each start, and its agreement at each.
    fn followed(&self, field: &GradientField, pose: &PlanarSimilarity) -> Vec<(PlanarSimilarity, f64)> {
        parallel::map(&self.starts, |start| self.template.captured_roughly(field, &pose.compose(start), &REACH))
    }

    /// Fits the rival near a pose of the photo, and compares the two there.
    pub(crate) fn against(
        &self,
        photo: &CloseUp,
        seen: &Seen,
        field: &GradientField,
        image_from_cutout: &PlanarSimilarity,
    ) -> Option<RivalFit> {
        let fitted = self.followed(field, image_from_cutout);
        let (pose, _) = fitted.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let rival_from_cutout = pose.inverse().compose(image_from_cutout);
        Some(self.close_up.duel(photo, seen, &rival_from_cutout))
    }
}

impl CloseUp {
    /// Extent of the differences between rival and photo, as a share of the photo's edges; `photo_from_own` lays the
    /// rival over the photo.
    fn share_differing(&self, photo: &CloseUp, photo_from_own: &PlanarSimilarity) -> f64 {
        self.laid_over(photo, &photo_from_own.inverse()).share(photo)
    }

    /// The photo compared with this rival; `own_from_photo` maps pixels of the photo to pixels of the rival.
    fn duel(&self, photo: &CloseUp, seen: &Seen, own_from_photo: &PlanarSimilarity) -> RivalFit {
        let both = self.laid_over(photo, own_from_photo);
        let fit = both.photos.fit(&seen.fits);
        let rivals_fit = both.rivals.fit(&both.expected.fit(&seen.gradients));
        RivalFit { margin: f64::from(fit - rivals_fit), fit: f64::from(rivals_fit), share: both.share(photo) }
    }

    /// This rival in the photo's frame, and where the two differ.
    fn laid_over(&self, photo: &CloseUp, own_from_photo: &PlanarSimilarity) -> LaidOver {
        let depth = self.depths(photo, own_from_photo);
        let colors = photo.frame.sampled_sparsely(&self.image, own_from_photo);
        let gradients = Gradients::new(&colors, SIDE, |i| depth[i] > -3.0);
        let expected = Expected::new(&gradients, &depth);
        // The gradients of each picture outside its part are set to zero.
        let of_rival = gradients.only(|i| depth[i] > -4.0);
        let of_photo = photo.gradients.clone().only(|i| photo.depth[i] > -4.0);
        let photos = Differing::new(&photo.expected, &of_rival);
        LaidOver { photos, rivals: Differing::new(&expected, &of_photo), expected }
    }

    /// The depth of each pixel of the photo's frame inside the rival's outline.
    fn depths(&self, photo: &CloseUp, own_from_photo: &PlanarSimilarity) -> Vec<f32> {
        let place = |at: [f64; 2]| self.frame.place_of(&own_from_photo.apply(&photo.frame.place(at)));
        let [first, right] = [place([0.5, 0.5]), place([1.5, 0.5])];
        // One pixel to the right; one pixel down is that vector rotated by 90°.
        let [along, across] = [right[0] - first[0], right[1] - first[1]];
        let depth_at = |[x, y]: [f64; 2]| {
            let (column, row) = ((x + 1.0) as usize, (y + 1.0) as usize);
            let is_inside = (1..=SIDE).contains(&column) && (1..=SIDE).contains(&row);
            if is_inside { self.depth[(row - 1) * SIDE + column - 1] } else { f32::MIN }
        };
        let of_row = |row: usize| {
            let row = row as f64;
            let start = [first[0] - row * across, first[1] + row * along];
            (0..SIDE).map(move |k| depth_at([start[0] + k as f64 * along, start[1] + k as f64 * across]))
        };
        (0..SIDE).flat_map(of_row).collect()
    }
}

/// A rival in the photo's frame.
struct LaidOver {
    expected: Expected,
    /// The photo's edges that the rival lacks.
    photos: Differing,
    /// The rival's edges that the photo lacks.
    rivals: Differing,
}

impl LaidOver {
    /// The extent of the differences between photo and rival, as a share of the photo's edges.
    fn share(&self, photo: &CloseUp) -> f64 {
        let all: f32 = photo.expected.energy.iter().sum();
        f64::from((self.photos.sum() + self.rivals.sum()) / all.max(f32::MIN_POSITIVE))
    }
}

/// By window, the edges of one of the two (photo or rival) that the other lacks.
struct Differing {
    windows: Vec<(usize, f32)>,
}

impl Differing {
    fn new(expected: &Expected, other: &Gradients) -> Self {
        let strongest = expected.energy.iter().fold(0.0f32, |a, b| a.max(*b));
        let with_other = expected.fit(other);
        let counting = (0..with_other.len()).filter(|&i| expected.energy[i] > MIN_EDGES * strongest);
        let windows = counting.map(|i| (i, expected.energy[i] * (SAME - with_other[i]).clamp(0.0, 1.0))).collect();
        Self { windows }
    }

    fn sum(&self) -> f32 {
        self.windows.iter().map(|(_, differs)| differs).sum()
    }

    /// The correlation of these edges with a picture, given the correlations of the picture's windows.
    fn fit(&self, with_picture: &[f32]) -> f32 {
        let fit: f32 = self.windows.iter().map(|&(i, differs)| differs * with_picture[i]).sum();
        fit / self.sum().max(f32::MIN_POSITIVE)
    }
}
