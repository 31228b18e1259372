//! Checks the marks after every change: which models they suffice for, and which marks look wrong.

use sdg_demonstration::ModelKind;
use sdg_geometry::Polygon;
use serde::Serialize;

use crate::gripper::Gripper;
use crate::marks::Marks;

/// A part whose marks are within this distance of the picture's border counts as cut off, in pixels.
const BORDER_PX: f64 = 1.0;
/// Minimum overlap (IoU) of the box with the outline's bounding box.
const MIN_BOX_AGREEMENT: f64 = 0.8;
/// Minimum length of a grasp line. On a shorter line, an error of one pixel changes the angle by about five degrees or
/// more.
const MIN_LINE_PX: f64 = 12.0;
/// Minimum size of a part in pixels.
const MIN_PART_PX: f64 = 24.0;
/// Tolerated extent of the part beyond a jaw: outlines are drawn by hand.
const JAW_SLACK_PX: f64 = 1.5;
/// Maximum ratio of the required opening to the smallest opening that any direction about the gripper's middle
/// requires. Above this ratio, the jaws are in the wrong direction.
const MAX_OPENING: f64 = 2.0;
/// Maximum clearance of the jaws as a share of the part's width; wider jaws were left open by mistake.
const MAX_CLEARANCE: f64 = 1.0;

/// Minimum share of the part's width on either side of the gripper's middle; below it one jaw pushes the part far before
/// the other touches it. The shipped demonstrations have at least 0.27.
const MIN_SIDE_SHARE: f64 = 0.25;

const HAND_TOO_SMALL: &str = "The part is wider here than the hand opens. Grasp it elsewhere, or turn the gripper.";

/// The result of checking the marks of one picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advice {
    /// Every model, in the order of their letters.
    pub models: Vec<ModelAdvice>,
    /// Problems with the outline, the grasp and the part's place, in this order.
    pub remarks: Vec<Remark>,
}

/// Whether a model can be taught from the marks.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ModelAdvice {
    /// The grasp model.
    pub model: ModelKind,
    /// Missing marks; empty if there are none.
    pub lacks: Vec<&'static str>,
}

/// A problem with the marks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Remark {
    /// Stable identifier, for programs.
    pub code: &'static str,
    /// One line for the person at the page.
    pub text: String,
    /// The remedy that the page offers.
    pub fix: Option<Fix>,
}

/// A remedy, with the value that the page then sets.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fix {
    /// Sets the distance between the jaws, in pixels.
    JawWidth(f64),
    /// Sets the box, `[x1, y1, x2, y2]` in pixels.
    Box([f64; 4]),
}

/// Checks the marks on a picture of `size` pixels; `max_opening_px` is the hand's maximum opening in this picture, if
/// known.
pub fn advise(marks: &Marks, size: [u32; 2], max_opening_px: Option<f64>) -> Advice {
    let lacks = |model: ModelKind| {
        let mut lacks = Vec::new();
        if !marks.has_object() {
            lacks.push("the box");
        }
        if marks.grasp.is_none() {
            lacks.push("the grasp");
        }
        if model.needs_outline() && marks.outline.is_none() {
            lacks.push("the outline");
        }
        lacks
    };
    let models = ModelKind::ALL.map(|model| ModelAdvice { model, lacks: lacks(model) }).to_vec();
    let mut remarks = Vec::new();
    about_outline(marks, &mut remarks);
    about_grasp(marks, max_opening_px.unwrap_or(f64::INFINITY), &mut remarks);
    about_place(marks, size, &mut remarks);
    Advice { models, remarks }
}

fn remark(code: &'static str, text: impl Into<String>, fix: Option<Fix>) -> Remark {
    Remark { code, text: text.into(), fix }
}

fn about_outline(marks: &Marks, remarks: &mut Vec<Remark>) {
    let Some(outline) = marks.polygon() else { return };
    if outline.crosses_itself() {
        remarks.push(remark("outline_crosses", "The outline crosses itself. Drag its points apart.", None));
    }
    if let Some(bbox) = marks.bounding_box() {
        let around = outline.bounds();
        if around.iou(&bbox) < MIN_BOX_AGREEMENT {
            let is_inside = around.intersection(&bbox) >= 0.99 * around.area();
            let (text, fix) = if around.intersection(&bbox) == 0.0 {
                ("The outline lies outside the box. One of them is on the wrong thing.", None)
            } else if is_inside {
                // It is unknown which of the two is wrong: a correct box must not be shrunk to an outline that misses
                // some of the part.
                (
                    "The outline leaves much of the box empty. Click “In” on missing areas of the part, or draw a tighter box.",
                    None,
                )
            } else {
                let both =
                    [around.x1.min(bbox.x1), around.y1.min(bbox.y1), around.x2.max(bbox.x2), around.y2.max(bbox.y2)];
                ("The outline extends beyond the box.", Some(Fix::Box(both)))
            };
            remarks.push(remark("outline_misses_box", text, fix));
        }
    }
}

fn about_grasp(marks: &Marks, max_opening_px: f64, remarks: &mut Vec<Remark>) {
    let (Some(grasp), Some(part)) = (&marks.grasp, marks.region()) else { return };
    let gripper = Gripper { line: grasp.line(), jaw_width: grasp.jaw_width };
    if gripper.line.length() < MIN_LINE_PX {
        let text = "The jaws are very short, so their angle is uncertain. Pull the ends of the line apart.";
        remarks.push(remark("line_short", text, None));
    }
    let Some(reach) = gripper.reach(&part) else {
        remarks.push(remark("grasp_beside", "The jaws close beside the part. Drag the gripper onto it.", None));
        return;
    };
    // Rounded up, so that the value set by the button passes the check.
    let fitting = (2.0 * reach.left.max(reach.right)).max(1.0).ceil();
    let half = 0.5 * grasp.jaw_width;
    // Without an outline only the box is known, which is wider than a part in an oblique direction.
    if reach.left <= 0.0 || reach.right <= 0.0 {
        remarks.push(remark(
            "grasp_off_middle",
            "The middle of the gripper is beside the part. Drag it onto it.",
            None,
        ));
    } else if marks.outline.is_some() && reach.left.max(reach.right) > half + JAW_SLACK_PX {
        if fitting > MAX_OPENING * gripper.narrowest(&part) {
            let text =
                "The gripper lies along the part and would have to open more than twice as wide. Turn it across.";
            remarks.push(remark("gripper_along", text, None));
            return;
        }
        if fitting > max_opening_px {
            remarks.push(remark("hand_too_small", HAND_TOO_SMALL, None));
            return;
        }
        let text = "The gripper is too narrow: a jaw would come down on the part. Open it.";
        remarks.push(remark("gripper_narrow", text, Some(Fix::JawWidth(fitting))));
    } else if marks.outline.is_some() && reach.left.min(reach.right) < MIN_SIDE_SHARE * (reach.left + reach.right) {
        let text = "The gripper is near one edge of the part: one jaw would push the part. Move it to the middle.";
        remarks.push(remark("grasp_one_sided", text, None));
    } else if marks.outline.is_some() && grasp.jaw_width > fitting * (1.0 + MAX_CLEARANCE) {
        let text = "The jaws are far from the part. Close them until they almost touch it.";
        remarks.push(remark("gripper_wide", text, Some(Fix::JawWidth(fitting))));
    } else if grasp.jaw_width > max_opening_px {
        // With an outline the required opening is known; the box is wider than a part in an oblique direction.
        let (text, fix) = if marks.outline.is_some() && fitting > max_opening_px {
            (HAND_TOO_SMALL, None)
        } else {
            ("The hand does not open so far. Close the jaws.", Some(Fix::JawWidth(max_opening_px.floor().max(1.0))))
        };
        remarks.push(remark("hand_too_small", text, fix));
    }
}

/// A warning if the part touches the border of the picture.
pub fn part_cut(marks: &Marks, size: [u32; 2]) -> Option<String> {
    let [width, height] = size.map(f64::from);
    let around = Polygon::bounds(&marks.region()?);
    let is_inside = around.x1 >= BORDER_PX
        && around.y1 >= BORDER_PX
        && around.x2 <= width - BORDER_PX
        && around.y2 <= height - BORDER_PX;
    let text = "The part touches the border of the photo and may be cut. A photo of the whole part teaches better.";
    (!is_inside).then(|| text.to_owned())
}

fn about_place(marks: &Marks, size: [u32; 2], remarks: &mut Vec<Remark>) {
    let Some(part) = marks.region() else { return };
    let around = Polygon::bounds(&part);
    remarks.extend(part_cut(marks, size).map(|text| remark("part_cut", text, None)));
    if around.width().max(around.height()) < MIN_PART_PX {
        let text = "The part is very small in the photo. Go closer, so that there is more of it to learn.";
        remarks.push(remark("part_small", text, None));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::marks::GraspMarks;

    const SIZE: [u32; 2] = [640, 480];

    fn good() -> Marks {
        Marks {
            bbox: Some([100.0, 100.0, 300.0, 160.0]),
            grasp: Some(GraspMarks { start: [180.0, 130.0], end: [220.0, 130.0], jaw_width: 66.0 }),
            outline: Some(vec![[100.0, 100.0], [300.0, 100.0], [300.0, 160.0], [100.0, 160.0]]),
        }
    }

    fn codes(marks: &Marks) -> Vec<&'static str> {
        advise(marks, SIZE, None).remarks.iter().map(|remark| remark.code).collect()
    }

    fn with_grasp(start: [f64; 2], end: [f64; 2], jaw_width: f64) -> Marks {
        Marks { grasp: Some(GraspMarks { start, end, jaw_width }), ..good() }
    }

    #[test]
    fn good_marks_suffice_for_all_and_earn_no_remark() {
        let advice = advise(&good(), SIZE, None);
        assert!(advice.models.iter().all(|model| model.lacks.is_empty()));
        assert!(advice.remarks.is_empty(), "{advice:?}");
    }

    #[test]
    fn jaws_open_no_farther_than_the_hand() {
        let told = |marks: &Marks, hand: f64| {
            let remarks = advise(marks, SIZE, Some(hand)).remarks;
            remarks.first().map(|remark| (remark.code, remark.fix))
        };
        // The part is 60 px high.
        assert_eq!(told(&good(), 80.0), None);
        assert_eq!(told(&good(), 50.0), Some(("hand_too_small", None)));
        let narrow = with_grasp([180.0, 130.0], [220.0, 130.0], 30.0);
        assert_eq!(told(&narrow, 80.0), Some(("gripper_narrow", Some(Fix::JawWidth(60.0)))));
        assert_eq!(told(&narrow, 50.0), Some(("hand_too_small", None)));
        let wide = with_grasp([180.0, 130.0], [220.0, 130.0], 90.0);
        assert_eq!(told(&wide, 80.5), Some(("hand_too_small", Some(Fix::JawWidth(80.0)))));
    }

    #[test]
    fn what_is_missing_is_named_for_each_model() {
        let lacks = |marks: &Marks| advise(marks, SIZE, None).models.into_iter().map(|m| m.lacks).collect::<Vec<_>>();
        let no_outline = Marks { outline: None, ..good() };
        assert_eq!(lacks(&no_outline), [vec![], vec![], vec![], vec!["the outline"], vec![]]);
        let nothing = lacks(&Marks::default());
        assert_eq!(nothing[3], ["the box", "the grasp", "the outline"]);
        assert_eq!(nothing[4], ["the box", "the grasp"]);
        let no_box = Marks { bbox: None, ..good() };
        assert_eq!(lacks(&no_box)[2], [""; 0], "a box follows from the outline");
    }

    #[test]
    fn a_narrow_gripper_is_told_and_the_remedy_passes() {
        let narrow = with_grasp([180.0, 130.0], [220.0, 130.0], 40.0);
        let advice = advise(&narrow, SIZE, None);
        assert_eq!(advice.remarks[0].code, "gripper_narrow");
        let Some(Fix::JawWidth(jaw_width)) = advice.remarks[0].fix else { panic!("{advice:?}") };
        assert_eq!(codes(&with_grasp([180.0, 130.0], [220.0, 130.0], jaw_width)), [""; 0]);
    }

    #[test]
    fn jaws_along_the_part_are_to_be_turned_and_not_opened() {
        // Across the part's length of 200 px; the other direction needs 60.
        let along = with_grasp([200.0, 110.0], [200.0, 150.0], 66.0);
        let advice = advise(&along, SIZE, None);
        assert_eq!((advice.remarks[0].code, advice.remarks[0].fix), ("gripper_along", None));
    }

    #[test]
    fn other_grasps_that_cannot_be_meant_are_told() {
        assert_eq!(codes(&with_grasp([180.0, 130.0], [220.0, 130.0], 200.0)), ["gripper_wide"]);
        assert_eq!(codes(&with_grasp([180.0, 300.0], [220.0, 300.0], 60.0)), ["grasp_off_middle"]);
        assert_eq!(codes(&with_grasp([180.0, 112.0], [220.0, 112.0], 98.0)), ["grasp_one_sided"]);
        assert_eq!(codes(&with_grasp([180.0, 118.0], [220.0, 118.0], 86.0)), [""; 0]);
        assert_eq!(codes(&with_grasp([400.0, 130.0], [440.0, 130.0], 60.0)), ["grasp_beside"]);
        assert_eq!(codes(&with_grasp([196.0, 130.0], [204.0, 130.0], 66.0)), ["line_short"]);
    }

    #[test]
    fn an_outline_that_misses_the_box_is_told_and_a_box_is_never_shrunk() {
        let remark = |bbox: [f64; 4]| advise(&Marks { bbox: Some(bbox), ..good() }, SIZE, None).remarks.remove(0);
        let apart = remark([400.0, 300.0, 500.0, 400.0]);
        assert_eq!((apart.code, apart.fix), ("outline_misses_box", None));
        // An outline of half of the part, in the correct box.
        let half = remark([100.0, 100.0, 500.0, 160.0]);
        assert_eq!((half.code, half.fix), ("outline_misses_box", None));
        assert!(half.text.contains("Click “In”"), "{half:?}");
        let beyond = remark([150.0, 100.0, 320.0, 160.0]);
        assert_eq!(beyond.fix, Some(Fix::Box([100.0, 100.0, 320.0, 160.0])));
    }

    #[test]
    fn a_part_at_the_border_and_a_crossing_outline_are_told() {
        let cut = Marks { bbox: Some([0.0, 100.0, 300.0, 160.0]), outline: None, ..good() };
        assert_eq!(codes(&cut), ["part_cut"]);
        let crossing =
            Marks { outline: Some(vec![[100.0, 100.0], [300.0, 160.0], [300.0, 100.0], [100.0, 160.0]]), ..good() };
        assert!(codes(&crossing).contains(&"outline_crosses"));
    }
}
