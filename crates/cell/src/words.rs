//! Texts about the detections in a picture: their positions, and the reasons for refusals.

use sdg_grasp::{Advice, EvidenceKind, GraspDetection, ScoreConfig};

use crate::perception::{Found, Perception};

/// Minimum score for advice. Below it, the detection does not resemble the part, and advice would mislead. Chosen by
/// hand.
const MIN_ADVISED_SCORE: f64 = 0.03;
/// Maximum number of explained detections in a picture. More texts would overlap.
const MAX_EXPLAINED: usize = 3;

/// The advice, in words, for a refused detection that may be the part. `demonstration` is the word for another
/// demonstration, `on_lengths` the advice for a part of a different size than the known one.
pub fn advice_in_words(advice: Advice, demonstration: &str, on_lengths: &str) -> String {
    let light = |here: &str| {
        format!(
            "if it is the part, it is {here} here than in the photo: a second {demonstration} in this light would help"
        )
    };
    match advice {
        Advice::OneHeight => format!(
            "if it is the part, lay the parts at one height, or a second {demonstration} from this distance would help"
        ),
        Advice::CheckLengths => on_lengths.to_owned(),
        Advice::DarkerPhoto => light("darker"),
        Advice::BrighterPhoto => light("brighter"),
        Advice::Uncover => format!("if it is the part, uncover it, or add a {demonstration} taken from this side"),
        Advice::OtherSide => format!("if it is the part, a second {demonstration} taken from this side would help"),
    }
}

fn resembles_the_part(detection: &GraspDetection) -> bool {
    detection.score >= MIN_ADVISED_SCORE
}

/// The value for display with this number of decimals: zero in place of small negative numbers, which would be "-0.0".
pub fn without_minus_zero(value: f64, decimals: i32) -> f64 {
    if value.abs() < 0.5 * 10_f64.powi(-decimals) { 0.0 } else { value }
}

/// Inputs of the texts about the detections in a picture.
#[derive(Debug, Clone, Copy)]
pub struct DetectionWords<'a> {
    /// The perception that found the detections.
    pub detector: &'a Perception,
    /// Width and height of the picture.
    pub picture_size: [u32; 2],
    /// Minimum score of accepted detections.
    pub min_score: f64,
}

impl DetectionWords<'_> {
    /// Whether the detection is accepted as the part.
    pub fn is_accepted(&self, detection: &GraspDetection) -> bool {
        detection.score >= self.min_score
    }

    /// Position, angle and width of the grasp in pixels, and also in millimetres if the camera is known.
    pub fn position(&self, found: &Found) -> String {
        let grasp = found.detection.grasp;
        let tenths = |value: f64| without_minus_zero(value, 1);
        let metric = found.pose.zip(self.detector.frame()).map(|(pose, frame)| {
            let name = frame.name();
            let [x, y, z] = pose.position_m.coords.map(|length| tenths(1e3 * length)).into();
            format!(
                " = {name} ({x:.1}, {y:.1}, {z:.1}) ± {:.1} mm, yaw {:.1} ± {:.1}°, open {:.1} mm",
                1e3 * pose.uncertainty.position_m,
                tenths(pose.yaw.degrees()),
                pose.uncertainty.yaw_rad.to_degrees(),
                1e3 * pose.opening_m
            )
        });
        format!(
            "({:.1}, {:.1}), {:.1}°, {:.1} px wide{}",
            tenths(grasp.x),
            tenths(grasp.y),
            tenths(grasp.angle.degrees()),
            grasp.width,
            metric.unwrap_or_default()
        )
    }

    /// The components of the score; the network's component only if there is a network.
    pub fn measured(&self, detection: &GraspDetection) -> String {
        let network =
            self.detector.model().kind().has_network().then(|| format!("network {:.2}", detection.network_score));
        let agreement = detection.agreement.map(|agreement| format!("agreement {agreement:.2}"));
        [network, agreement].into_iter().flatten().collect::<Vec<_>>().join(", ")
    }

    /// For each detection, the indices of the detections whose parts the jaws would touch at its grasp. Only accepted
    /// detections are compared.
    pub fn touched(&self, detections: &[&GraspDetection]) -> Vec<Vec<usize>> {
        self.detector.touched_among_accepted(detections, |idx| self.is_accepted(detections[idx]))
    }

    /// Indices of the refused detections, best first, that get marks and text in a picture: the best one, and others
    /// that resemble the part.
    pub fn explained<'d>(&self, detections: impl Iterator<Item = &'d GraspDetection>) -> Vec<usize> {
        let refused = detections.enumerate().filter(|(_, found)| !self.is_accepted(found)).enumerate();
        let worth_it = refused.filter(|(rank, (_, found))| *rank == 0 || resembles_the_part(found));
        worth_it.map(|(_, (idx, _))| idx).take(MAX_EXPLAINED).collect()
    }

    /// The weights by which the detections were scored.
    pub(crate) fn score_config(&self) -> &ScoreConfig {
        &self.detector.model().demonstrations()[0].check().score
    }

    /// The advice for a refused detection, if it resembles the part.
    pub fn advice_for(&self, detection: &GraspDetection) -> Option<Advice> {
        detection.advice(self.score_config()).filter(|_| resembles_the_part(detection))
    }

    /// The strongest reasons for refusing a detection, in words, at most `most` of them.
    pub fn reasons(&self, detection: &GraspDetection, most: usize) -> String {
        let Some(evidence) = &detection.evidence else { return "the network is not sure".to_owned() };
        let config = self.score_config();
        let in_words = |kind: EvidenceKind| match kind {
            // Without a known size, parts are compared with each other, and not with the photo.
            EvidenceKind::Size if !config.is_size_known => "it has another size than the surest part in the picture",
            _ => kind.objection(),
        };
        let reasons: Vec<&str> = evidence.objections(config).into_iter().take(most).map(in_words).collect();
        if reasons.is_empty() { "all evidence together is too weak".to_owned() } else { reasons.join("; also ") }
    }

    /// The size of the photo, if the picture's size differs from it and the camera is not known: the part's size may
    /// then be outside the searched range.
    pub fn photo_of_other_size(&self) -> Option<[u32; 2]> {
        if self.detector.camera_over_table().is_some() {
            return None;
        }
        let [width, height] = self.picture_size;
        let demonstrations = self.detector.model().demonstrations();
        let photo = demonstrations.iter().find_map(|demonstration| demonstration.marks.photo_size)?;
        (photo != [width, height] && photo != [height, width]).then_some(photo)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_grasp::{GraspModel, TeachOptions, Verification};
    use std::path::Path;

    #[test]
    fn an_unknown_size_is_compared_with_the_surest_part() {
        let datasets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets");
        let bytes = std::fs::read(datasets.join("models/pendulum-shape-format-3.sdg")).unwrap();
        let model = GraspModel::from_bytes(&bytes, &TeachOptions::new(0).device).unwrap();
        let photo = image::open(datasets.join("demonstrations/pendulum/image.png")).unwrap().to_rgb8();
        let detector = Perception::of_any_camera(model);
        let mut found = detector.detect(&photo, Verification::ByShape).unwrap().swap_remove(0).detection;
        // As beside a part of clearly another size.
        found.evidence.as_mut().unwrap().size = -9.0;
        found.score = 0.2;
        let words = DetectionWords { detector: &detector, picture_size: photo.dimensions().into(), min_score: 0.5 };
        assert_eq!(words.reasons(&found, 1), "it has another size than the surest part in the picture");
        // A size tolerance limits the searched sizes and has no effect on this comparison.
        let advice = words.advice_for(&found).map(|advice| advice_in_words(advice, "--demo", "check the camera"));
        let expected =
            "if it is the part, lay the parts at one height, or a second --demo from this distance would help";
        assert_eq!(advice.as_deref(), Some(expected));
    }

    #[test]
    fn no_zero_has_a_minus() {
        let shown = |value: f64| format!("{:.1}", without_minus_zero(value, 1));
        assert_eq!([-0.049, -0.051, 0.0, 12.34, -3.0].map(shown), ["0.0", "-0.1", "0.0", "12.3", "-3.0"]);
    }

    #[test]
    fn advice_about_light_compares_the_picture_with_the_photo() {
        for (advice, light) in [(Advice::DarkerPhoto, "darker"), (Advice::BrighterPhoto, "brighter")] {
            let text = advice_in_words(advice, "demonstration", "");
            // In a dark picture, "in brighter light" was read as a demand for more light.
            let compared = format!("it is {light} here than in the photo: a second demonstration");
            assert!(text.contains(&compared) && text.ends_with(" in this light would help"), "{text}");
        }
    }
}
