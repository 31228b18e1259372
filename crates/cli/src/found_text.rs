//! A detection as a line of text, and why it is refused.

use sdg_calibration::Frame;
use sdg_cell::{DEFAULT_MIN_SCORE, Found, Perception};
use sdg_grasp::{Advice, EvidenceKind, GraspDetection};

use crate::paint::{Paint, Tone};

/// Below it nothing resembles the part: advice would mislead. Chosen by hand.
pub const MIN_ADVISED_SCORE: f64 = 0.03;
/// Sizes nearer to the photo's than this are no reason to name. Chosen by hand.
const SAME_SIZE: f64 = 0.03;

/// The advice for a refused detection that is the part after all, in words.
pub fn advice_in_words(advice: Advice) -> &'static str {
    match advice {
        Advice::CheckSize => {
            "if its size is right, widen --size-tolerance, or with --camera check its file and --mark-height-mm"
        }
        Advice::DarkerPhoto => "if it is the part, a second --demo in darker light would help",
        Advice::BrighterPhoto => "if it is the part, a second --demo in brighter light would help",
        Advice::Uncover => "if it is the part, uncover it, or add a --demo taken from this side",
        _ => "if it is the part, a second --demo taken from this side would help",
    }
}

/// What the words about the detections in a picture depend on.
#[derive(Debug, Clone, Copy)]
pub struct Wording<'a> {
    /// What found them.
    pub detector: &'a Perception,
    /// Width and height of the picture.
    pub picture_size: [u32; 2],
    /// The score from which they are accepted.
    pub min_score: f64,
    /// Colours of the lines.
    pub paint: Paint,
}

impl Wording<'_> {
    /// A detection in words, in metres as well where the camera is known; for a refused one with the reasons, for an accepted one with the parts
    /// that its jaws touch.
    pub fn line(&self, found: &Found, touched: &[&GraspDetection]) -> String {
        let Found { detection, pose } = found;
        let grasp = detection.grasp;
        let metric = pose.zip(self.detector.frame()).map(|(pose, frame): (_, Frame)| {
            let name = frame.name();
            let [x, y, z] = pose.position_m.coords.map(|length| 1e3 * length).into();
            format!(
                " = {name} ({x:.1}, {y:.1}, {z:.1}) ± {:.1} mm, yaw {:.1} ± {:.1}°, open {:.1} mm",
                1e3 * pose.uncertainty.position_m,
                pose.yaw.degrees(),
                pose.uncertainty.yaw_rad.to_degrees(),
                1e3 * pose.opening_m
            )
        });
        let metric = metric.unwrap_or_default();
        let refused =
            self.refusal(detection).map(|why| format!("; {} {why}", self.doubtful("refused:"))).unwrap_or_default();
        let turn_source = detection.turn_source.name();
        let at = |other: &&GraspDetection| format!("({:.0}, {:.0})", other.grasp.x, other.grasp.y);
        let places: Vec<String> = touched.iter().map(at).collect();
        let touching = match places.as_slice() {
            [] => String::new(),
            [place] => format!("; {} the jaws would touch the part at {place}", self.doubtful("warning:")),
            _ => format!("; {} the jaws would touch the parts at {}", self.doubtful("warning:"), places.join(", ")),
        };
        let tone = if self.is_accepted(detection) { Tone::Good } else { Tone::Doubtful };
        let grasp_word = self.paint.text(tone, "grasp");
        format!(
            "{grasp_word} at ({:.1}, {:.1}), {:.1}°, {:.1} px wide{metric}; score {:.2} ({}; turn by {turn_source}){refused}{touching}",
            grasp.x,
            grasp.y,
            grasp.angle.degrees(),
            grasp.width,
            detection.score,
            self.measured(detection),
        )
    }

    /// For each detection those whose parts its jaws touch, as numbers in the list; between accepted ones alone.
    pub fn touched(&self, detections: &[&GraspDetection]) -> Vec<Vec<usize>> {
        let accepted: Vec<usize> = (0..detections.len()).filter(|&idx| self.is_accepted(detections[idx])).collect();
        let among: Vec<&GraspDetection> = accepted.iter().map(|&idx| detections[idx]).collect();
        let mut touched = vec![Vec::new(); detections.len()];
        for (&idx, others) in accepted.iter().zip(self.detector.touched_by_jaws(&among)) {
            touched[idx] = others.into_iter().map(|other| accepted[other]).collect();
        }
        touched
    }

    fn doubtful(&self, text: &str) -> String {
        self.paint.text(Tone::Doubtful, text)
    }

    /// Whether a detection counts as the part.
    pub fn is_accepted(&self, detection: &GraspDetection) -> bool {
        detection.score >= self.min_score
    }

    /// What the score is made of, the network's share only where there is a network.
    fn measured(&self, detection: &GraspDetection) -> String {
        let network =
            self.detector.model().kind().has_network().then(|| format!("network {:.2}", detection.network_score));
        let agreement = detection.agreement.map(|agreement| format!("agreement {agreement:.2}"));
        [network, agreement].into_iter().flatten().collect::<Vec<_>>().join(", ")
    }

    /// Indices of the refused detections, best first, that are worth a picture's dots and words: the best one, and further ones
    /// that resemble the part.
    pub fn explained<'d>(&self, detections: impl Iterator<Item = &'d GraspDetection>) -> Vec<usize> {
        /// More of them would cover each other.
        const MAX_EXPLAINED: usize = 3;
        let refused = detections.enumerate().filter(|(_, found)| !self.is_accepted(found)).enumerate();
        let worth_it = refused.filter(|(rank, (_, found))| *rank == 0 || found.score >= MIN_ADVISED_SCORE);
        worth_it.map(|(_, (idx, _))| idx).take(MAX_EXPLAINED).collect()
    }

    /// Why a detection is refused, the strongest reason first, and what would help; `None` for what is accepted.
    pub fn refusal(&self, detection: &GraspDetection) -> Option<String> {
        if self.is_accepted(detection) {
            return None;
        }
        if detection.score >= DEFAULT_MIN_SCORE {
            return Some(format!("it scores below --min-score {}", self.min_score));
        }
        let advice = detection.advice().filter(|_| detection.score >= MIN_ADVISED_SCORE);
        Some(format!(
            "{}{}",
            self.reasons(detection, 2),
            advice.map(|advice| format!("; {}", advice_in_words(advice))).unwrap_or_default()
        ))
    }

    /// The strongest reasons, at most so many, in words.
    pub fn reasons(&self, detection: &GraspDetection, most: usize) -> String {
        let Some(evidence) = &detection.evidence else { return "the network is not sure".to_owned() };
        let size = self.detector.size_of(detection, self.picture_size).filter(|size| (size - 1.0).abs() >= SAME_SIZE);
        let in_words = |kind: EvidenceKind| match (kind, size) {
            (EvidenceKind::Size, Some(size)) => format!("its size is {size:.2} of the photo's"),
            _ => kind.objection().to_owned(),
        };
        let reasons: Vec<String> = evidence
            .objections(&self.detector.model().demonstrations()[0].check().score)
            .into_iter()
            .take(most)
            .map(in_words)
            .collect();
        if reasons.is_empty() { "all evidence together is too weak".to_owned() } else { reasons.join("; also ") }
    }

    /// The line of a picture in which nothing is accepted: how many were refused, and the best of them; `are_listed` where a line of
    /// each follows.
    pub fn nothing(&self, refused: &[&GraspDetection], are_listed: bool) -> String {
        let Some(best) = refused.iter().max_by(|a, b| a.score.total_cmp(&b.score)) else {
            let nothing = self.doubtful("nothing to grasp");
            return format!("{nothing}{}{}", self.in_region(), self.of_other_size().unwrap_or_default());
        };
        let which = if refused.len() == 1 { "" } else { ", the best of them" };
        let see_all = if are_listed { "" } else { " (see --all)" };
        let (x, y) = (best.grasp.x, best.grasp.y);
        let why = self.refusal(best).unwrap_or_default();
        // Where advice was given, another one would only compete with it.
        let other_size =
            best.advice().filter(|_| best.score >= MIN_ADVISED_SCORE).map_or_else(|| self.of_other_size(), |_| None);
        format!(
            "{}{}; {} refused{which} at ({x:.0}, {y:.0}): {}, score {:.2}{see_all}: {why}{}",
            self.doubtful("nothing accepted"),
            self.in_region(),
            refused.len(),
            self.measured(best),
            best.score,
            other_size.unwrap_or_default()
        )
    }

    /// Where a part of the picture is searched: which.
    fn in_region(&self) -> String {
        self.detector.region().map(|region| format!(" in {region}")).unwrap_or_default()
    }

    /// Where the picture has another number of pixels than the photo: that the part may have a size that is not looked for.
    fn of_other_size(&self) -> Option<String> {
        if self.detector.camera_over_table().is_some() {
            return None;
        }
        let model = self.detector.model();
        let [width, height] = self.picture_size;
        let photo = model.demonstrations().iter().find_map(|demonstration| demonstration.marks.photo_size)?;
        (photo != [width, height] && photo != [height, width]).then(|| {
            let [photo_width, photo_height] = photo;
            let tolerance = model.size_tolerance();
            format!(
                "; it has {width}x{height} pixels and the photo had {photo_width}x{photo_height}: if one of them is cropped and \
                 resized, a wider --size-tolerance than {}-{} may help",
                tolerance.start(),
                tolerance.end()
            )
        })
    }
}
