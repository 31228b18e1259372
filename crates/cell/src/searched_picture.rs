//! A picture and its detections: as a drawing, and as the JSON record that `sdg detect` prints (docs/command-line.md).

use image::RgbImage;
use sdg_grasp::{Advice, GraspDetection};
use serde::Serialize;

use crate::drawing;
use crate::perception::Found;
use crate::record::FoundRecord;
use crate::region_record::RegionRecord;
use crate::words::DetectionWords;

/// A picture and its detections.
#[derive(Debug, Clone, Serialize)]
pub struct PictureRecord<'a> {
    /// Name of the picture.
    pub image: &'a str,
    /// Name of the part that the model detects.
    pub object: &'a str,
    /// Width of the picture.
    pub width: u32,
    /// Height of the picture.
    pub height: u32,
    /// Duration of the search.
    pub seconds: f64,
    /// The searched region; absent if the whole picture is searched.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region: Option<RegionRecord>,
    /// Number of refused detections, listed or not.
    pub num_refused: usize,
    /// The listed detections.
    pub detections: Vec<ExplainedRecord>,
}

/// A detection with values that explain it.
#[derive(Debug, Clone, Serialize)]
pub struct ExplainedRecord {
    /// The detection.
    #[serde(flatten)]
    pub found: FoundRecord,
    /// Size of the part relative to its nominal size.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<f64>,
    /// Advice for a refused detection.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub advice: Option<String>,
    /// Indices, in the list of detections, of the parts that the jaws would touch.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub jaws_touch: Vec<usize>,
}

/// The detections in one picture, and the duration of the search.
#[derive(Debug, Clone)]
pub struct SearchedPicture {
    /// Width and height.
    pub size: [u32; 2],
    /// Duration of the search.
    pub seconds: f64,
    /// All detections, by decreasing score.
    pub detections: Vec<Found>,
}

impl SearchedPicture {
    /// The accepted detections, or all detections if `with_refused` is set.
    pub fn listed(&self, words: &DetectionWords<'_>, with_refused: bool) -> Vec<&Found> {
        self.detections.iter().filter(|found| with_refused || words.is_accepted(&found.detection)).collect()
    }

    /// The refused detections.
    pub fn refused(&self, words: &DetectionWords<'_>) -> Vec<&GraspDetection> {
        self.detections.iter().map(|found| &found.detection).filter(|found| !words.is_accepted(found)).collect()
    }

    /// Draws the detections on the picture, and for the best refused ones the reasons and the differences from the
    /// demonstration.
    pub fn draw(&self, image: &mut RgbImage, words: &DetectionWords<'_>) {
        let detections = || self.detections.iter().map(|found| &found.detection);
        let explained = words.explained(detections());
        let refused: Vec<_> = explained.into_iter().map(|idx| &self.detections[idx].detection).collect();
        let differences: Vec<_> = words.detector.differences(image, &refused).into_iter().flatten().collect();
        let parts: Vec<_> = detections().map(|detection| detection.bbox).collect();
        let legend = drawing::draw_differences(image, &differences, &parts);
        drawing::draw_region(image, words.detector.region());
        let reasons: Vec<_> = refused.iter().map(|detection| (*detection, words.reasons(detection, 1))).collect();
        drawing::draw_detections(image, detections(), words.min_score, &reasons, legend);
    }

    /// The record of the picture with the `listed` detections; `touched` has for each of them the indices of the parts
    /// that the jaws would touch.
    pub fn record<'a>(
        &self,
        name: &'a str,
        words: &DetectionWords<'a>,
        listed: &[&Found],
        touched: Vec<Vec<usize>>,
        advice_in_words: fn(Advice) -> String,
    ) -> PictureRecord<'a> {
        let detector = words.detector;
        let explained = |(found, jaws_touch): (&&Found, Vec<usize>)| ExplainedRecord {
            found: FoundRecord::new(found, detector),
            size: detector.size_of(&found.detection, self.size),
            advice: found.detection.advice(words.score_config()).map(advice_in_words),
            jaws_touch,
        };
        let [width, height] = self.size;
        PictureRecord {
            image: name,
            object: detector.model().object(),
            width,
            height,
            seconds: self.seconds,
            region: detector.region().map(RegionRecord::of),
            num_refused: self.refused(words).len(),
            detections: listed.iter().zip(touched).map(explained).collect(),
        }
    }
}
