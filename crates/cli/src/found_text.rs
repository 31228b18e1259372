//! The text line of a detection, with colours and options.

use sdg_cell::{DEFAULT_MIN_SCORE, DetectionWords, Found, Part, advice_in_words, track_state_name};
use sdg_grasp::{Advice, GraspDetection};

use crate::paint::{Paint, Tone};

/// The advice with the options of the command line.
pub fn advice_with_options(advice: Advice) -> String {
    advice_in_words(advice, "--demo", "if it is the part, check the file of --camera and --mark-height-mm")
}

/// Makes the lines about the detections in a picture.
#[derive(Debug, Clone, Copy)]
pub struct FoundText<'a> {
    /// Words of the detections.
    pub words: DetectionWords<'a>,
    /// Colours of the lines.
    pub paint: Paint,
}

impl FoundText<'_> {
    /// A detection in words. For a refused one, the reasons follow; for an accepted one, the other parts that the jaws
    /// would touch.
    pub fn line(&self, found: &Found, touched: &[&GraspDetection]) -> String {
        let detection = &found.detection;
        let refused =
            self.refusal(detection).map(|why| format!("; {} {why}", self.doubtful("refused:"))).unwrap_or_default();
        self.described(found, self.words.is_accepted(detection), &refused, touched)
    }

    /// A part of a frame in words. A tracked part is accepted while it is seen, and its line begins with its state.
    pub fn part_line(&self, part: &Part, touched: &[&GraspDetection]) -> String {
        let Some((id, state, _)) = part.track else { return self.line(&part.found, touched) };
        let state = track_state_name(state).replace('_', " ");
        let is_seen = part.is_seen(self.words.min_score);
        format!("part {} {state}, {}", id + 1, self.described(&part.found, is_seen, "", touched))
    }

    fn described(&self, found: &Found, is_accepted: bool, refused: &str, touched: &[&GraspDetection]) -> String {
        let detection = &found.detection;
        let at = |other: &&GraspDetection| format!("({:.0}, {:.0})", other.grasp.x, other.grasp.y);
        let places: Vec<String> = touched.iter().map(at).collect();
        let touching = match places.as_slice() {
            [] => String::new(),
            [place] => format!("; {} the jaws would touch the part at {place}", self.doubtful("warning:")),
            _ => format!("; {} the jaws would touch the parts at {}", self.doubtful("warning:"), places.join(", ")),
        };
        let tone = if is_accepted { Tone::Good } else { Tone::Doubtful };
        format!(
            "{} at {}; score {:.2} ({}; turn by {}){refused}{touching}",
            self.paint.text(tone, "grasp"),
            self.words.position(found),
            detection.score,
            self.words.measured(detection),
            detection.turn_source.name(),
        )
    }

    fn doubtful(&self, text: &str) -> String {
        self.paint.text(Tone::Doubtful, text)
    }

    /// The reasons for refusing a detection, strongest first, and advice; `None` for an accepted one.
    fn refusal(&self, detection: &GraspDetection) -> Option<String> {
        if self.words.is_accepted(detection) {
            return None;
        }
        if detection.score >= DEFAULT_MIN_SCORE {
            return Some(format!("it scores below --min-score {}", self.words.min_score));
        }
        let advice = self.words.advice_for(detection).map(|advice| format!("; {}", advice_with_options(advice)));
        Some(format!("{}{}", self.words.reasons(detection, 2), advice.unwrap_or_default()))
    }

    /// The line for a picture without accepted detections: the number of refused ones, and the best of them.
    /// `are_listed` states whether a line for each refused one follows.
    pub fn nothing(&self, refused: &[&GraspDetection], are_listed: bool) -> String {
        let region = self.words.detector.region().map(|region| format!(" in {region}")).unwrap_or_default();
        let Some(best) = refused.iter().max_by(|a, b| a.score.total_cmp(&b.score)) else {
            let nothing = self.doubtful("nothing to grasp");
            return format!("{nothing}{region}{}", self.of_other_size().unwrap_or_default());
        };
        let which = if refused.len() == 1 { "" } else { ", the best of them" };
        let see_all = if are_listed { "" } else { " (see --all)" };
        let (x, y) = (best.grasp.x, best.grasp.y);
        let why = self.refusal(best).unwrap_or_default();
        // Beside other advice, the hint about the size is left out, because it would contradict the advice.
        let other_size = self.words.advice_for(best).map_or_else(|| self.of_other_size(), |_| None);
        format!(
            "{}{region}; {} refused{which} at ({x:.0}, {y:.0}): {}, score {:.2}{see_all}: {why}{}",
            self.doubtful("nothing accepted"),
            refused.len(),
            self.words.measured(best),
            best.score,
            other_size.unwrap_or_default()
        )
    }

    /// A hint for a picture whose size differs from the photo's: the part's size may be outside the searched range.
    fn of_other_size(&self) -> Option<String> {
        let [photo_width, photo_height] = self.words.photo_of_other_size()?;
        let [width, height] = self.words.picture_size;
        let tolerance = self.words.detector.model().size_tolerance();
        Some(format!(
            "; it has {width}x{height} pixels and the photo had {photo_width}x{photo_height}: if one of them is cropped and \
             resized, a wider --size-tolerance than {}-{} may help",
            tolerance.start(),
            tolerance.end()
        ))
    }
}
