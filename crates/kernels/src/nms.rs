//! Greedy non-maximum suppression, on the host.

/// Indices of the boxes to keep, best score first.
///
/// A box falls if its intersection over union with a kept, better one is above `iou_threshold`. Equal
/// scores keep their order. Boxes whose score is NaN, or with a NaN or infinite corner, are dropped. Boxes
/// without area overlap nothing.
///
/// Boxes are `[x1, y1, x2, y2]` in any one unit, areas `(x2 − x1)·(y2 − y1)` as in torchvision's `nms`.
///
/// # Panics
/// Where the numbers of boxes and scores differ or the threshold is NaN.
pub fn nms(boxes: &[[f32; 4]], scores: &[f32], iou_threshold: f32) -> Vec<usize> {
    suppress(boxes, scores, None, iou_threshold)
}

/// [`nms`] within each class: boxes of different classes never suppress each other.
///
/// `classes` may be any labels, such as class, pyramid level, or both in one number. The result is one list,
/// best score first over all classes.
///
/// # Panics
/// Where the numbers of boxes, scores and classes differ or the threshold is NaN.
pub fn batched_nms(
    boxes: &[[f32; 4]],
    scores: &[f32],
    classes: &[usize],
    iou_threshold: f32,
) -> Vec<usize> {
    assert!(
        classes.len() == boxes.len(),
        "batched_nms: expected a class for each of {} boxes, found {}",
        boxes.len(),
        classes.len()
    );
    suppress(boxes, scores, Some(classes), iou_threshold)
}

fn suppress(
    boxes: &[[f32; 4]],
    scores: &[f32],
    classes: Option<&[usize]>,
    iou_threshold: f32,
) -> Vec<usize> {
    assert!(
        boxes.len() == scores.len(),
        "nms: expected a score for each of {} boxes, found {}",
        boxes.len(),
        scores.len()
    );
    assert!(
        !iou_threshold.is_nan(),
        "nms: expected an IoU threshold, found NaN"
    );
    let mut order: Vec<usize> = (0..boxes.len())
        .filter(|&idx| !scores[idx].is_nan() && boxes[idx].iter().all(|c| c.is_finite()))
        .collect();
    // Stable, and -0 equals 0.
    order.sort_by(|&a, &b| {
        scores[b]
            .partial_cmp(&scores[a])
            .unwrap_or(std::cmp::Ordering::Equal)
    });

    let mut kept = Vec::new();
    let mut alive = vec![true; order.len()];
    for position in 0..order.len() {
        if !alive[position] {
            continue;
        }
        let best = order[position];
        kept.push(best);
        let best_box = boxes[best];
        let best_area = area(best_box);
        for later in position + 1..order.len() {
            let candidate = order[later];
            if !alive[later] || classes.is_some_and(|class| class[best] != class[candidate]) {
                continue;
            }
            let other = boxes[candidate];
            let overlap_width = (best_box[2].min(other[2]) - best_box[0].max(other[0])).max(0.0);
            let overlap_height = (best_box[3].min(other[3]) - best_box[1].max(other[1])).max(0.0);
            let intersection = overlap_width * overlap_height;
            let union = best_area + area(other) - intersection;
            // Without division: a union of zero gives no overlap.
            if intersection > 0.0 && intersection > iou_threshold * union {
                alive[later] = false;
            }
        }
    }
    kept
}

fn area([x1, y1, x2, y2]: [f32; 4]) -> f32 {
    (x2 - x1) * (y2 - y1)
}
