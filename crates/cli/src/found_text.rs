//! The text line of a detection, and the reasons for refusing it.

use sdg_calibration::Frame;
use sdg_cell::{DEFAULT_MIN_SCORE, Found, Perception};
use sdg_grasp::{Advice, EvidenceKind, GraspDetection};

use crate::paint::{Paint, Tone};

/// Minimum score for advice. Below it, the detection does not resemble the part, and advice would mislead. Chosen by
/// hand.
pub const MIN_ADVISED_SCORE: f64 = 0.03;
/// Minimum relative difference from the nominal size that is given as a reason. Chosen by hand.
const SIZE_TOLERANCE: f64 = 0.03;

/// The advice, in words, for a refused detection that may be the part. `demonstration` is the word for another
/// demonstration, `on_size` the advice for a part of a different size.
pub fn advice_in_words(advice: Advice, demonstration: &str, on_size: &str) -> String {
    let light = |here: &str| {
        format!(
            "if it is the part, it is {here} here than in the photo: a second {demonstration} in this light would help"
        )
    };
    match advice {
        Advice::CheckSize => on_size.to_owned(),
        Advice::DarkerPhoto => light("darker"),
        Advice::BrighterPhoto => light("brighter"),
        Advice::Uncover => format!("if it is the part, uncover it, or add a {demonstration} taken from this side"),
        _ => format!("if it is the part, a second {demonstration} taken from this side would help"),
    }
}

/// The advice with the options of the command line.
pub fn advice_with_options(advice: Advice) -> String {
    const ON_SIZE: &str =
        "if its size is right, widen --size-tolerance, or with --camera check its file and --mark-height-mm";
    advice_in_words(advice, "--demo", ON_SIZE)
}

/// Inputs of the texts about the detections in a picture.
#[derive(Debug, Clone, Copy)]
pub struct Wording<'a> {
    /// The perception that found the detections.
    pub detector: &'a Perception,
    /// Width and height of the picture.
    pub picture_size: [u32; 2],
    /// Minimum score of accepted detections.
    pub min_score: f64,
    /// Colours of the lines.
    pub paint: Paint,
}

impl Wording<'_> {
    /// A detection in words, also in millimetres if the camera is known. For a refused one, the reasons follow; for an
    /// accepted one, the other parts that the jaws would touch.
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

    /// For each detection, the indices of the detections whose parts the jaws would touch at its grasp. Only accepted
    /// detections are compared.
    pub fn touched(&self, detections: &[&GraspDetection]) -> Vec<Vec<usize>> {
        self.detector.touched_among_accepted(detections, self.min_score)
    }

    fn doubtful(&self, text: &str) -> String {
        self.paint.text(Tone::Doubtful, text)
    }

    /// Whether the detection is accepted as the part.
    pub fn is_accepted(&self, detection: &GraspDetection) -> bool {
        detection.score >= self.min_score
    }

    /// The components of the score; the network's component only if there is a network.
    fn measured(&self, detection: &GraspDetection) -> String {
        let network =
            self.detector.model().kind().has_network().then(|| format!("network {:.2}", detection.network_score));
        let agreement = detection.agreement.map(|agreement| format!("agreement {agreement:.2}"));
        [network, agreement].into_iter().flatten().collect::<Vec<_>>().join(", ")
    }

    /// Indices of the refused detections, best first, that get marks and text in a picture: the best one, and others
    /// that resemble the part.
    pub fn explained<'d>(&self, detections: impl Iterator<Item = &'d GraspDetection>) -> Vec<usize> {
        /// More texts would overlap.
        const MAX_EXPLAINED: usize = 3;
        let refused = detections.enumerate().filter(|(_, found)| !self.is_accepted(found)).enumerate();
        let worth_it = refused.filter(|(rank, (_, found))| *rank == 0 || found.score >= MIN_ADVISED_SCORE);
        worth_it.map(|(_, (idx, _))| idx).take(MAX_EXPLAINED).collect()
    }

    /// The reasons for refusing a detection, strongest first, and advice; `None` for an accepted one.
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
            advice.map(|advice| format!("; {}", advice_with_options(advice))).unwrap_or_default()
        ))
    }

    /// The strongest reasons in words, at most `most` of them.
    pub fn reasons(&self, detection: &GraspDetection, most: usize) -> String {
        let Some(evidence) = &detection.evidence else { return "the network is not sure".to_owned() };
        let size =
            self.detector.size_of(detection, self.picture_size).filter(|size| (size - 1.0).abs() >= SIZE_TOLERANCE);
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

    /// The line for a picture without accepted detections: the number of refused ones, and the best of them.
    /// `are_listed` states whether a line for each refused one follows.
    pub fn nothing(&self, refused: &[&GraspDetection], are_listed: bool) -> String {
        let Some(best) = refused.iter().max_by(|a, b| a.score.total_cmp(&b.score)) else {
            let nothing = self.doubtful("nothing to grasp");
            return format!("{nothing}{}{}", self.in_region(), self.of_other_size().unwrap_or_default());
        };
        let which = if refused.len() == 1 { "" } else { ", the best of them" };
        let see_all = if are_listed { "" } else { " (see --all)" };
        let (x, y) = (best.grasp.x, best.grasp.y);
        let why = self.refusal(best).unwrap_or_default();
        // A second advice would contradict the first.
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

    /// Names the searched region, if not the whole picture is searched.
    fn in_region(&self) -> String {
        self.detector.region().map(|region| format!(" in {region}")).unwrap_or_default()
    }

    /// A hint for a picture whose size differs from the photo's: the part's size may be outside the searched range.
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
