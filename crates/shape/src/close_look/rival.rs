//! The mirror image as an explanation of the picture, against the photo: judged only where the two differ.
//!
//! ```text
//! mirror image ─ laid over the photo at all turns ─ starts: the turns at which they resemble each other most
//! pose of the photo ∘ start ─ refined by edges in the picture ─ rival's pose ─┐
//!                          photo's and rival's gradients in one frame ─ where they differ ─ fit of photo − fit of rival ─ margin
//! ```

use image::RgbImage;
use image::imageops;
use sdg_geometry::{Angle, PlanarSimilarity, Polygon};

use super::gradients::{Expected, Gradients};
use super::{CloseUp, MIN_EDGES, SIDE, Seen};
use crate::config::ShapeConfig;
use crate::error::ShapeError;
use crate::following::Reach;
use crate::gradient_field::GradientField;
use crate::template::ShapeTemplate;

/// Turns at which the rival is laid over the photo, and how many of the best are tried in pictures.
const NUM_TURNS: usize = 36;
const NUM_STARTS: usize = 5;
/// Starts are at least so far apart.
const APART_RAD: f64 = 0.2;
/// How far it may lie from a start in a picture, which shows the part in perspective.
const REACH: Reach = Reach { shift_px: 16.0, turn_rad: 0.2, log_scale: 0.05 };
/// A window differs where the other's edges correlate with its own by less.
const SAME: f32 = 0.6;

/// How a rival fits a picture compared with the photo, where the two differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RivalFit {
    /// Mean correlation of the photo's edges that the rival lacks, less that of the rival's that the photo lacks: below 0 the rival fits
    /// better.
    pub margin: f64,
    /// How much of the photo's edges they differ in: with little, the margin says little.
    pub share: f64,
}

/// Another part that may lie there instead.
#[derive(Debug, Clone)]
pub struct Rival {
    close_up: CloseUp,
    template: ShapeTemplate,
    /// Where it resembles the photo most: from its own pixels to the cut-out's.
    starts: Vec<PlanarSimilarity>,
}

impl Rival {
    /// The mirror image of a demonstration whose gradients are `field`.
    ///
    /// # Errors
    /// As [`ShapeTemplate::new`].
    pub(crate) fn mirrored(
        cutout: &RgbImage,
        outline: &Polygon,
        field: &GradientField,
        config: &ShapeConfig,
    ) -> Result<Self, ShapeError> {
        let flipped = imageops::flip_horizontal(cutout);
        let width = f64::from(cutout.width());
        let mut mirrored = outline.clone();
        mirrored.vertices.iter_mut().for_each(|vertex| vertex.x = width - vertex.x);
        let template = ShapeTemplate::new(&flipped, &mirrored, config)?;
        let (from, to) = (mirrored.bounds().center(), outline.bounds().center());
        let mut fits: Vec<(PlanarSimilarity, f64)> = (0..NUM_TURNS)
            .map(|k| {
                let turn = Angle::from_radians(k as f64 * std::f64::consts::TAU / NUM_TURNS as f64);
                let refined = template.refine(field, &PlanarSimilarity::about(from, to, turn, 1.0));
                (refined.image_from_demonstration, refined.agreement)
            })
            .collect();
        fits.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut starts: Vec<PlanarSimilarity> = Vec::new();
        for (pose, _) in fits {
            if starts.len() < NUM_STARTS && starts.iter().all(|kept| kept.angle.distance(pose.angle) > APART_RAD) {
                starts.push(pose);
            }
        }
        Ok(Self { close_up: CloseUp::new(&flipped, &mirrored), template, starts })
    }

    /// Fits the rival about a pose of the photo, and compares the two there.
    pub(crate) fn against(
        &self,
        photo: &CloseUp,
        seen: &Seen,
        field: &GradientField,
        image_from_cutout: &PlanarSimilarity,
    ) -> Option<RivalFit> {
        let fitted = self.starts.iter().map(|start| {
            let pose = self.template.captured(field, &image_from_cutout.compose(start), &REACH);
            (pose, self.template.agreement(field, &pose))
        });
        let (pose, _) = fitted.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let rival_from_cutout = pose.inverse().compose(image_from_cutout);
        Some(self.close_up.duel(photo, seen, &rival_from_cutout))
    }
}

impl CloseUp {
    /// The photo against this one, which lies there by `own_from_photo`.
    fn duel(&self, photo: &CloseUp, seen: &Seen, own_from_photo: &PlanarSimilarity) -> RivalFit {
        let depth: Vec<f32> = photo.frame.pixels().map(|at| self.depth_at(photo, at, own_from_photo)).collect();
        let colors = photo.frame.sampled(&self.image, own_from_photo);
        let gradients = Gradients::new(&colors, SIDE, |i| depth[i] > -3.0);
        let expected = Expected::new(&gradients, &depth);
        // As pictures, each shows its part alone.
        let of_rival = gradients.only(|i| depth[i] > -4.0);
        let of_photo = photo.gradients.clone().only(|i| photo.depth[i] > -4.0);
        let (weight, fit) = differing(&photo.expected, &of_rival, seen);
        let (rivals_weight, rivals_fit) = differing(&expected, &of_photo, seen);
        let all: f32 = photo.expected.energy.iter().sum();
        RivalFit {
            margin: f64::from(fit - rivals_fit),
            share: f64::from((weight + rivals_weight) / all.max(f32::MIN_POSITIVE)),
        }
    }

    /// How far a pixel of the photo's frame lies inside this one's outline.
    fn depth_at(&self, photo: &CloseUp, at: [f64; 2], own_from_photo: &PlanarSimilarity) -> f32 {
        let [x, y] = self.frame.place_of(&own_from_photo.apply(&photo.frame.place(at)));
        let (column, row) = (x.floor() as isize, y.floor() as isize);
        let inside = |k: isize| (0..SIDE as isize).contains(&k);
        if inside(column) && inside(row) { self.depth[row as usize * SIDE + column as usize] } else { f32::MIN }
    }
}

/// The edges that `expected` has and `other` lacks: how many, and how they correlate with what is seen.
fn differing(expected: &Expected, other: &Gradients, seen: &Seen) -> (f32, f32) {
    let strongest = expected.energy.iter().fold(0.0f32, |a, b| a.max(*b));
    let (with_other, with_picture) = (expected.fit(other), expected.fit(&seen.gradients));
    let (mut weight, mut fit) = (0.0, 0.0);
    for i in (0..with_other.len()).filter(|&i| expected.energy[i] > MIN_EDGES * strongest) {
        let differs = expected.energy[i] * (SAME - with_other[i]).clamp(0.0, 1.0);
        weight += differs;
        fit += differs * with_picture[i];
    }
    (weight, fit / weight.max(f32::MIN_POSITIVE))
}
