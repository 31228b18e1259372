//! Greedy non-maximum suppression, on the host.

/// Indices of the boxes to keep, best score first.
///
/// A box is suppressed if its intersection over union with a kept, better one is above `iou_threshold`.
/// Equal scores keep their order. Boxes whose score is NaN, or with a NaN or infinite corner, are dropped.
/// Boxes without area overlap nothing.
///
/// Boxes are `[x1, y1, x2, y2]` in any one unit, areas `(x2 − x1)·(y2 − y1)` as in torchvision's `nms`.
///
/// # Panics
/// If the numbers of boxes and scores differ or the threshold is NaN.
pub fn nms(boxes: &[[f32; 4]], scores: &[f32], iou_threshold: f32) -> Vec<usize> {
    suppress(boxes, scores, None, iou_threshold)
}

/// [`nms`] within each class: boxes of different classes never suppress each other.
///
/// `classes` may be any labels, such as class, pyramid level, or both in one number. The result is one list,
/// best score first over all classes.
///
/// # Panics
/// If the numbers of boxes, scores and classes differ or the threshold is NaN.
pub fn batched_nms(boxes: &[[f32; 4]], scores: &[f32], classes: &[usize], iou_threshold: f32) -> Vec<usize> {
    assert!(
        classes.len() == boxes.len(),
        "batched_nms: expected a class for each of {} boxes, found {}",
        boxes.len(),
        classes.len()
    );
    suppress(boxes, scores, Some(classes), iou_threshold)
}

fn suppress(boxes: &[[f32; 4]], scores: &[f32], classes: Option<&[usize]>, iou_threshold: f32) -> Vec<usize> {
    assert!(
        boxes.len() == scores.len(),
        "nms: expected a score for each of {} boxes, found {}",
        boxes.len(),
        scores.len()
    );
    assert!(!iou_threshold.is_nan(), "nms: expected an IoU threshold, found NaN");
    let mut order: Vec<usize> =
        (0..boxes.len()).filter(|&idx| !scores[idx].is_nan() && boxes[idx].iter().all(|c| c.is_finite())).collect();
    // Stable, and -0 equals 0.
    order.sort_by(|&a, &b| scores[b].partial_cmp(&scores[a]).unwrap_or(std::cmp::Ordering::Equal));

    // In the order of comparison, so the inner loop reads memory sequentially.
    let sorted: Vec<[f32; 4]> = order.iter().map(|&idx| boxes[idx]).collect();
    let areas: Vec<f32> = sorted.iter().copied().map(area).collect();
    let mut kept = Vec::new();
    let mut alive = vec![true; order.len()];
    for position in 0..order.len() {
        if !alive[position] {
            continue;
        }
        let best = order[position];
        kept.push(best);
        let (best_box, best_area) = (sorted[position], areas[position]);
        for later in position + 1..order.len() {
            let other = sorted[later];
            let overlap_width = (best_box[2].min(other[2]) - best_box[0].max(other[0])).max(0.0);
            let overlap_height = (best_box[3].min(other[3]) - best_box[1].max(other[1])).max(0.0);
            let intersection = overlap_width * overlap_height;
            let union = best_area + areas[later] - intersection;
            // Without division: a union of zero gives no overlap.
            if intersection > 0.0
                && intersection > iou_threshold * union
                && classes.is_none_or(|class| class[best] == class[order[later]])
            {
                alive[later] = false;
            }
        }
    }
    kept
}

fn area([x1, y1, x2, y2]: [f32; 4]) -> f32 {
    (x2 - x1) * (y2 - y1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SQUARE: [f32; 4] = [0.0, 0.0, 10.0, 10.0];

    #[test]
    fn overlap_above_the_threshold_falls_and_at_it_stays() {
        // 10 × 10 boxes shifted by 5: intersection 50, union 150.
        let boxes = [SQUARE, [5.0, 0.0, 15.0, 10.0]];
        let scores = [0.4, 0.6];
        assert_eq!(nms(&boxes, &scores, 0.33), [1]);
        assert_eq!(nms(&boxes, &scores, 0.34), [1, 0]);
        // Intersection 50 of union 100: exactly the threshold.
        let boxes = [SQUARE, [0.0, 0.0, 10.0, 5.0]];
        assert_eq!(nms(&boxes, &scores, 0.5), [1, 0]);
    }

    #[test]
    fn a_suppressed_box_suppresses_nothing() {
        let boxes = [SQUARE, [4.0, 0.0, 14.0, 10.0], [8.0, 0.0, 18.0, 10.0]];
        assert_eq!(nms(&boxes, &[0.9, 0.8, 0.7], 0.3), [0, 2]);
    }

    #[test]
    fn equal_scores_keep_their_order() {
        let boxes = [SQUARE, SQUARE, [20.0, 0.0, 30.0, 10.0], SQUARE];
        assert_eq!(nms(&boxes, &[0.5; 4], 0.5), [0, 2]);
        assert_eq!(nms(&boxes[..3], &[0.0, -0.0, 0.0], 0.5), [0, 2]);
    }

    #[test]
    fn not_a_number_is_dropped_and_infinite_scores_are_ranked() {
        let boxes = [
            SQUARE,
            [20.0, 0.0, 30.0, 10.0],
            [f32::NAN, 0.0, 1.0, 1.0],
            [0.0, 0.0, f32::INFINITY, 1.0],
            [40.0, 0.0, 50.0, 10.0],
        ];
        let scores = [f32::NAN, f32::NEG_INFINITY, 1.0, 1.0, f32::INFINITY];
        assert_eq!(nms(&boxes, &scores, 0.5), [4, 1]);
    }

    #[test]
    fn boxes_without_area_overlap_nothing() {
        let point = [5.0, 5.0, 5.0, 5.0];
        assert_eq!(nms(&[point, point, SQUARE], &[0.9, 0.8, 0.7], 0.0), [0, 1, 2]);
    }

    #[test]
    fn no_boxes_give_none() {
        assert!(nms(&[], &[], 0.5).is_empty());
    }

    #[test]
    #[should_panic(expected = "expected a score for each of 1 boxes, found 0")]
    fn a_missing_score_is_refused() {
        nms(&[SQUARE], &[], 0.5);
    }

    fn iou(a: [f32; 4], b: [f32; 4]) -> f32 {
        let width = (a[2].min(b[2]) - a[0].max(b[0])).max(0.0);
        let height = (a[3].min(b[3]) - a[1].max(b[1])).max(0.0);
        let both = width * height;
        both / (area(a) + area(b) - both)
    }

    fn boxes_scores_classes() -> impl Strategy<Value = (Vec<[f32; 4]>, Vec<f32>, Vec<usize>)> {
        let one = (0u8..20, 0u8..20, 1u8..12, 1u8..12, 0u8..8, 0usize..3);
        proptest::collection::vec(one, 0..30).prop_map(|all| {
            let boxes = all.iter().map(|&(x, y, w, h, _, _)| [x, y, x + w, y + h].map(f32::from));
            (
                boxes.collect(),
                // Few values, so that ties occur.
                all.iter().map(|all| f32::from(all.4) / 8.0).collect(),
                all.iter().map(|all| all.5).collect(),
            )
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            rng_seed: proptest::test_runner::RngSeed::Fixed(2),
            failure_persistence: None,
            ..ProptestConfig::default()
        })]

        #[test]
        fn agrees_with_the_definition((boxes, scores, classes) in boxes_scores_classes()) {
            // 0.47 is not a ratio of small integer areas, so rounding decides nothing.
            let kept = batched_nms(&boxes, &scores, &classes, 0.47);
            let before = |a: usize, b: usize| scores[a] > scores[b] || (scores[a] == scores[b] && a < b);
            prop_assert!(kept.windows(2).all(|pair| before(pair[0], pair[1])));
            for idx in 0..boxes.len() {
                let beaten = kept.iter().any(|&other| {
                    classes[other] == classes[idx]
                        && before(other, idx)
                        && iou(boxes[other], boxes[idx]) > 0.47
                });
                prop_assert_eq!(kept.contains(&idx), !beaten, "box {}", idx);
            }
        }

        #[test]
        fn a_second_pass_changes_nothing((boxes, scores, _) in boxes_scores_classes()) {
            let kept = nms(&boxes, &scores, 0.47);
            let kept_boxes: Vec<_> = kept.iter().map(|&idx| boxes[idx]).collect();
            let kept_scores: Vec<_> = kept.iter().map(|&idx| scores[idx]).collect();
            let again = nms(&kept_boxes, &kept_scores, 0.47);
            prop_assert_eq!(again, (0..kept.len()).collect::<Vec<_>>());
        }
    }
}
