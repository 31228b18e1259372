//! The check by the demonstration: laid over the image where a model proposes, refined and scored.

use std::ops::RangeInclusive;

use image::RgbImage;
use sdg_geometry::{Angle, PlanarSimilarity};
use sdg_shape::GradientField;

use crate::models::Candidate;
use crate::taught::TaughtDemonstration;

/// An image with its gradients, which every overlay reads.
pub(crate) struct Scene<'a> {
    pub(crate) image: &'a RgbImage,
    pub(crate) field: GradientField,
}

impl<'a> Scene<'a> {
    /// An image in which these demonstrations are looked for; all of them are compared alike.
    pub(crate) fn new(image: &'a RgbImage, demonstrations: &[TaughtDemonstration]) -> Self {
        let gradient = demonstrations.first().map(|first| first.check().search.shape.gradient).unwrap_or_default();
        Self { image, field: GradientField::with_config(image, &gradient) }
    }
}

/// A demonstration laid over an image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Overlay<'a> {
    pub(crate) demonstration: &'a TaughtDemonstration,
    pub(crate) image_from_cutout: PlanarSimilarity,
    /// How well it agrees with the image there, in `[0, 1]`, less what another size than the usual one costs.
    pub(crate) agreement: f64,
    /// The same whatever its size; teaching calibrates on it.
    #[cfg_attr(not(feature = "teach"), expect(dead_code))]
    pub(crate) agreement_at_any_size: f64,
}

/// Sizes at which a part may lie in an image, over the usual one: those of teaching's augmentation, and a little more. The
/// camera's height above the table is known, so that what has another size is another part: a lever of 0.7 times the
/// pendulum's length agreed with it by 0.56 before. That there must be such a range was found on that lever (`make test`, 50
/// pictures); its ends were chosen by hand, not measured.
const SCALES: RangeInclusive<f64> = 0.8..=1.25;

/// Lays the demonstration over the image where the candidate is, both ways round, and returns the better one.
///
/// Keypoints give place and turn well, but a short grasp line gives the scale badly, so the box decides that: the
/// start takes the scale at which the outline is as large as the detected box. A network that mistakes one end of a
/// part for the other is half a turn off; the demonstration sees which end it is.
pub(crate) fn verify<'a>(
    demonstration: &'a TaughtDemonstration,
    candidate: &Candidate,
    scene: &Scene<'_>,
) -> Overlay<'a> {
    let pose = candidate.image_from_cutout;
    let outline = demonstration.outline(&pose).bounds();
    let box_over_outline = (candidate.bbox.area() / outline.area()).sqrt();
    let usual = usual_scale(demonstration, scene);
    let scale = (pose.scale * box_over_outline).clamp(usual * SCALES.start(), usual * SCALES.end());
    let rescaled = about_middle(demonstration, &pose, Angle::ZERO, scale / pose.scale);
    better_way_round(demonstration, &rescaled, scene)
}

/// Refined from `start` and from half a turn further; the one that agrees better, brought to rest.
pub(crate) fn better_way_round<'a>(
    demonstration: &'a TaughtDemonstration,
    start: &PlanarSimilarity,
    scene: &Scene<'_>,
) -> Overlay<'a> {
    let comparison = demonstration.comparison(scene.image, &scene.field);
    let turned = about_middle(demonstration, start, Angle::from_radians(std::f64::consts::PI), 1.0);
    let [straight, turned] = [*start, turned].map(|start| {
        let refined = comparison.refined_by_edges(&start);
        (start, refined, comparison.agreement(&refined).both())
    });
    let (start, refined, _) = if turned.2 > straight.2 { turned } else { straight };
    let usual = usual_scale(demonstration, scene);
    let scales = usual * SCALES.start()..=usual * SCALES.end();
    let image_from_cutout = comparison.settled(&start, refined, &scales);
    let is_of_its_size = scales.contains(&image_from_cutout.scale);
    let seen = if is_of_its_size { comparison.agreement(&image_from_cutout).both() } else { 0.0 };
    let agreement = demonstration.check().size.apply(seen, image_from_cutout.scale / usual);
    Overlay { demonstration, image_from_cutout, agreement, agreement_at_any_size: seen }
}

pub(crate) fn usual_scale(demonstration: &TaughtDemonstration, scene: &Scene<'_>) -> f64 {
    demonstration.usual_scale(scene.image.width(), scene.image.height())
}

/// `pose` turned and scaled about the middle of the outline in the image.
fn about_middle(
    demonstration: &TaughtDemonstration,
    pose: &PlanarSimilarity,
    turn: Angle,
    scale: f64,
) -> PlanarSimilarity {
    let pivot = demonstration.outline(pose).bounds().center();
    PlanarSimilarity::about(pivot, pivot, turn, scale).compose(pose)
}

#[cfg(test)]
mod tests {
    use image::{Rgb, RgbImage};
    use nalgebra::Point2;
    use sdg_demonstration::{Annotation, Demonstration};
    use sdg_geometry::{GraspLine, Polygon};

    use super::*;

    /// An L on a dim ramp, `scale` times as large as in the first photo, `pixels` times as finely seen.
    fn picture(scale: f64, pixels: f64) -> Demonstration {
        let corners = [(60.0, 40.0), (80.0, 40.0), (80.0, 84.0), (124.0, 84.0), (124.0, 104.0), (60.0, 104.0)];
        let factor = scale * pixels;
        let outline = Polygon { vertices: corners.map(|(x, y)| Point2::new(factor * x, factor * y)).to_vec() };
        let (width, height) = ((192.0 * pixels) as u32, (144.0 * pixels) as u32);
        let mask = outline.rasterize(width, height);
        let image = RgbImage::from_fn(width, height, |x, y| {
            let table = (50 + x / 8) as u8;
            let part = if f64::from(x) > factor * 100.0 { [230, 200, 60] } else { [190, 40, 30] };
            Rgb(if mask.get(x, y) { part } else { [table, table, 70] })
        });
        let grasp =
            GraspLine::new(Point2::new(factor * 70.0, factor * 50.0), Point2::new(factor * 70.0, factor * 80.0));
        let bbox = outline.bounds();
        Demonstration {
            image,
            annotation: Annotation {
                label: "L".into(),
                bbox,
                grasp: Some(grasp),
                jaw_width: None,
                outline: Some(outline),
            },
        }
    }

    #[test]
    fn a_part_of_another_size_is_another_part() {
        let taught = TaughtDemonstration::new(&picture(1.0, 1.0)).unwrap();
        for (scale, pixels, is_it) in
            [(1.0, 1.0, true), (1.15, 1.0, true), (0.7, 1.0, false), (1.0, 2.0, true), (0.7, 2.0, false)]
        {
            let shown = picture(scale, pixels);
            let grasp = shown.annotation.grasp.unwrap();
            let (from, to) = (taught.marks.grasp, [grasp.start, grasp.end]);
            let candidate = Candidate {
                network_score: 0.9,
                bbox: shown.annotation.bbox,
                keypoints: Vec::new(),
                grasp: sdg_geometry::PlanarGrasp::from_line(&grasp, 20.0),
                demonstration_idx: 0,
                image_from_cutout: PlanarSimilarity::fit(&[from.start, from.end], &to).unwrap(),
                turn_source: crate::TurnSource::Keypoints,
            };
            let overlay = verify(&taught, &candidate, &Scene::new(&shown.image, std::slice::from_ref(&taught)));
            assert_eq!(overlay.agreement > 0.6, is_it, "{scale} {pixels}: {overlay:?}");
        }
    }
}
