//! Boxes inside the detector: corners `[x1, y1, x2, y2]` in pixels of the resized image, `f32`.

/// A box by its corners, in pixels of the resized image.
pub type Corners = [f32; 4];

/// Area; zero for a box without area.
pub fn area(b: &Corners) -> f32 {
    (b[2] - b[0]).max(0.0) * (b[3] - b[1]).max(0.0)
}

/// Intersection over union; zero when both boxes are empty.
pub fn iou(a: &Corners, b: &Corners) -> f32 {
    let width = (a[2].min(b[2]) - a[0].max(b[0])).max(0.0);
    let height = (a[3].min(b[3]) - a[1].max(b[1])).max(0.0);
    let intersection = width * height;
    let union = area(a) + area(b) - intersection;
    if union > 0.0 { intersection / union } else { 0.0 }
}

/// The part of a box inside an image of `width` by `height` pixels.
pub fn clip(b: &Corners, width: f32, height: f32) -> Corners {
    [b[0].clamp(0.0, width), b[1].clamp(0.0, height), b[2].clamp(0.0, width), b[3].clamp(0.0, height)]
}

/// Whether both sides exceed `min_size` and all coordinates are finite.
pub fn is_usable(b: &Corners, min_size: f32) -> bool {
    b.iter().all(|v| v.is_finite()) && b[2] - b[0] > min_size && b[3] - b[1] > min_size
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn iou_of_a_quarter_overlap() {
        // Two 2x2 boxes with one common cell: 1 / (4 + 4 - 1).
        let value = iou(&[0.0, 0.0, 2.0, 2.0], &[1.0, 1.0, 3.0, 3.0]);
        assert!((value - 1.0 / 7.0).abs() < 1e-6);
        assert_eq!(iou(&[0.0; 4], &[0.0; 4]), 0.0);
    }

    #[test]
    fn usable_boxes_have_two_finite_sides() {
        assert!(is_usable(&[0.0, 0.0, 1.0, 1.0], 0.0));
        assert!(!is_usable(&[0.0, 0.0, 0.0, 1.0], 0.0));
        assert!(!is_usable(&[0.0, 0.0, f32::NAN, 1.0], 0.0));
        assert!(!is_usable(&[0.0, 0.0, f32::INFINITY, 1.0], 0.0));
    }

    fn corners() -> impl Strategy<Value = Corners> {
        (0f32..100.0, 0f32..100.0, 0.1f32..50.0, 0.1f32..50.0).prop_map(|(x, y, w, h)| [x, y, x + w, y + h])
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: proptest::test_runner::RngSeed::Fixed(1), failure_persistence: None, ..Default::default() })]
        #[test]
        fn iou_is_symmetric_bounded_and_one_with_itself(a in corners(), b in corners()) {
            prop_assert_eq!(iou(&a, &b), iou(&b, &a));
            prop_assert!((0.0..=1.0).contains(&iou(&a, &b)));
            prop_assert!((iou(&a, &a) - 1.0).abs() < 1e-3);
        }
    }
}
