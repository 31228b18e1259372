//! The axis-aligned box.

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use crate::GeometryError;

/// An axis-aligned box by two corners, in pixels (x right, y down).
///
/// A box may lie partly or wholly outside an image; only [`clip`](Self::clip) limits it. Only
/// [`new`](Self::new) guarantees a positive area.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BoundingBox {
    /// Left edge.
    pub x1: f64,
    /// Upper edge.
    pub y1: f64,
    /// Right edge.
    pub x2: f64,
    /// Lower edge.
    pub y2: f64,
}

impl BoundingBox {
    /// The box between two opposite corners, given in any order.
    ///
    /// # Errors
    /// A coordinate that is not finite, or a box without area.
    pub fn new(xa: f64, ya: f64, xb: f64, yb: f64) -> Result<Self, GeometryError> {
        for value in [xa, ya, xb, yb] {
            if !value.is_finite() {
                return Err(GeometryError::NotFinite { what: "a box", value });
            }
        }
        let made = Self { x1: xa.min(xb), y1: ya.min(yb), x2: xa.max(xb), y2: ya.max(yb) };
        if made.width() <= 0.0 || made.height() <= 0.0 {
            return Err(GeometryError::EmptyBox { width: made.width(), height: made.height() });
        }
        Ok(made)
    }

    /// The tight box around points; `None` for no point.
    pub fn around(points: impl IntoIterator<Item = Point2<f64>>) -> Option<Self> {
        let mut points = points.into_iter();
        let first = points.next()?;
        let start = Self { x1: first.x, y1: first.y, x2: first.x, y2: first.y };
        Some(points.fold(start, |b, p| Self {
            x1: b.x1.min(p.x),
            y1: b.y1.min(p.y),
            x2: b.x2.max(p.x),
            y2: b.y2.max(p.y),
        }))
    }

    /// Width in pixels; negative when the corners are swapped.
    pub fn width(&self) -> f64 {
        self.x2 - self.x1
    }

    /// Height in pixels; negative when the corners are swapped.
    pub fn height(&self) -> f64 {
        self.y2 - self.y1
    }

    /// Area in square pixels; zero when the corners are swapped.
    pub fn area(&self) -> f64 {
        self.width().max(0.0) * self.height().max(0.0)
    }

    /// The centre.
    pub fn center(&self) -> Point2<f64> {
        Point2::new(0.5 * (self.x1 + self.x2), 0.5 * (self.y1 + self.y2))
    }

    /// The part inside an image of `width` × `height` pixels; may have no area.
    pub fn clip(&self, width: f64, height: f64) -> Self {
        Self {
            x1: self.x1.clamp(0.0, width),
            y1: self.y1.clamp(0.0, height),
            x2: self.x2.clamp(0.0, width),
            y2: self.y2.clamp(0.0, height),
        }
    }

    /// The area of the overlap in square pixels.
    pub fn intersection(&self, other: &Self) -> f64 {
        let width = self.x2.min(other.x2) - self.x1.max(other.x1);
        let height = self.y2.min(other.y2) - self.y1.max(other.y1);
        width.max(0.0) * height.max(0.0)
    }

    /// Intersection over union, in `[0, 1]`; zero when both boxes are empty.
    pub fn iou(&self, other: &Self) -> f64 {
        let intersection = self.intersection(other);
        let union = self.area() + other.area() - intersection;
        if union > 0.0 { intersection / union } else { 0.0 }
    }

    /// Whether a point lies inside or on the edge.
    pub fn contains(&self, point: &Point2<f64>) -> bool {
        (self.x1..=self.x2).contains(&point.x) && (self.y1..=self.y2).contains(&point.y)
    }

    /// Scales both axes, as when the image is resized.
    pub fn scaled(&self, scale_x: f64, scale_y: f64) -> Self {
        Self { x1: self.x1 * scale_x, y1: self.y1 * scale_y, x2: self.x2 * scale_x, y2: self.y2 * scale_y }
    }

    /// The four corners, clockwise from the upper left.
    pub fn corners(&self) -> [Point2<f64>; 4] {
        [
            Point2::new(self.x1, self.y1),
            Point2::new(self.x2, self.y1),
            Point2::new(self.x2, self.y2),
            Point2::new(self.x1, self.y2),
        ]
    }

    /// x, y, width, height: COCO's order.
    pub fn to_xywh(&self) -> [f64; 4] {
        [self.x1, self.y1, self.width(), self.height()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_box() -> impl Strategy<Value = BoundingBox> {
        (0.0..100.0f64, 0.0..100.0f64, 0.1..50.0f64, 0.1..50.0f64).prop_map(|(x, y, w, h)| BoundingBox {
            x1: x,
            y1: y,
            x2: x + w,
            y2: y + h,
        })
    }

    #[test]
    fn iou_of_half_overlapping_squares_is_a_third() {
        let a = BoundingBox::new(0.0, 0.0, 2.0, 2.0).unwrap();
        let b = BoundingBox::new(1.0, 0.0, 3.0, 2.0).unwrap();
        assert!((a.iou(&b) - 1.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn refuses_nan_and_empty() {
        assert!(matches!(BoundingBox::new(0.0, f64::NAN, 1.0, 1.0), Err(GeometryError::NotFinite { .. })));
        assert!(matches!(BoundingBox::new(1.0, 0.0, 1.0, 5.0), Err(GeometryError::EmptyBox { .. })));
    }

    #[test]
    fn corners_come_in_any_order() {
        let b = BoundingBox::new(5.0, 7.0, 1.0, 2.0).unwrap();
        assert_eq!(b, BoundingBox { x1: 1.0, y1: 2.0, x2: 5.0, y2: 7.0 });
    }

    proptest! {
        #[test]
        fn iou_is_symmetric_and_one_with_itself(a in any_box(), b in any_box()) {
            prop_assert!((a.iou(&b) - b.iou(&a)).abs() < 1e-12);
            prop_assert!((a.iou(&a) - 1.0).abs() < 1e-9);
            prop_assert!((0.0..=1.0).contains(&a.iou(&b)));
        }

        #[test]
        fn clipping_is_idempotent(a in any_box()) {
            let clipped = a.clip(60.0, 60.0);
            prop_assert_eq!(clipped.clip(60.0, 60.0), clipped);
        }
    }
}
