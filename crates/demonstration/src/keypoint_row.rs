//! Grasp lines in files that identify keypoints only by their number.

use nalgebra::Point2;

use crate::draft::Draft;
use crate::{Error, Result};

/// Largest distance of a keypoint between the ends from its expected position on the line, as a fraction of the line's
/// length …
const MAX_STRAY_SHARE: f64 = 0.02;
/// … and in pixels; the larger value applies.
const MAX_STRAY_PX: f64 = 1.5;

/// Puts the first and the last keypoint into the draft as the grasp's ends. The keypoints between them must lie evenly
/// on the line, like OpenDR's; otherwise the keypoints mark something else. `None` is an unlabelled keypoint.
pub(crate) fn read_grasp(keypoints: &[Option<Point2<f64>>], place: &str, draft: &mut Draft) -> Result<()> {
    let (first, last) = match keypoints {
        [] => return Ok(()),
        [only] => (only, &None),
        [first, .., last] => (first, last),
    };
    if let (Some(start), Some(end)) = (first, last) {
        let line = end - start;
        let max_stray = (MAX_STRAY_SHARE * line.norm()).max(MAX_STRAY_PX);
        for (k, keypoint) in keypoints.iter().enumerate() {
            let Some(keypoint) = keypoint else { continue };
            if let Some(found) = keypoint.iter().find(|value| !value.is_finite()) {
                return Err(Error::NotFinite {
                    place: format!("{place}, keypoint {}", k + 1),
                    found: found.to_string(),
                });
            }
            let on_line = start + line * (k as f64 / (keypoints.len() - 1) as f64);
            let stray = (keypoint - on_line).norm();
            if stray > max_stray {
                return Err(Error::Malformed {
                    place: place.into(),
                    expected: "two keypoints, or more that lie evenly on the grasp line".into(),
                    found: format!("keypoint {} of {}, {stray:.1} pixels beside it", k + 1, keypoints.len()),
                });
            }
        }
    }
    draft.grasp_start = first.map(|point| (point, format!("{place}, keypoint 1")));
    draft.grasp_end = last.map(|point| (point, format!("{place}, keypoint {}", keypoints.len())));
    Ok(())
}
