//! A closed polygon: the outline of a part.

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use crate::{BoundingBox, GeometryError, Mask, PlanarSimilarity};

/// A closed polygon in pixels; the last vertex is connected to the first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Polygon {
    /// The vertices, clockwise or counter-clockwise.
    pub vertices: Vec<Point2<f64>>,
}

impl Polygon {
    /// Checks the vertices and builds the polygon.
    ///
    /// # Errors
    /// Fewer than three vertices, coordinates that are not finite, or no area.
    pub fn new(vertices: Vec<Point2<f64>>) -> Result<Self, GeometryError> {
        for vertex in &vertices {
            for value in [vertex.x, vertex.y] {
                if !value.is_finite() {
                    return Err(GeometryError::NotFinite { what: "a polygon", value });
                }
            }
        }
        let polygon = Self { vertices };
        let area = polygon.area();
        if polygon.vertices.len() < 3 || area <= 0.0 {
            return Err(GeometryError::DegeneratePolygon { vertices: polygon.vertices.len(), area });
        }
        Ok(polygon)
    }

    /// The polygon of a box's corners.
    pub fn from_box(bounds: &BoundingBox) -> Self {
        Self { vertices: bounds.corners().to_vec() }
    }

    /// The edges, each as (from, to).
    pub fn edges(&self) -> impl Iterator<Item = (Point2<f64>, Point2<f64>)> + '_ {
        let n = self.vertices.len();
        (0..n).map(move |i| (self.vertices[i], self.vertices[(i + 1) % n]))
    }

    /// The enclosed area, in square pixels.
    pub fn area(&self) -> f64 {
        (0.5 * self.edges().map(|(a, b)| a.x * b.y - b.x * a.y).sum::<f64>()).abs()
    }

    /// The centroid of the enclosed area.
    pub fn centroid(&self) -> Point2<f64> {
        let (mut doubled, mut x, mut y) = (0.0, 0.0, 0.0);
        for (a, b) in self.edges() {
            let cross = a.x * b.y - b.x * a.y;
            doubled += cross;
            x += (a.x + b.x) * cross;
            y += (a.y + b.y) * cross;
        }
        Point2::new(x / (3.0 * doubled), y / (3.0 * doubled))
    }

    /// The tight box around the vertices; an empty box if there are none.
    pub fn bounds(&self) -> BoundingBox {
        BoundingBox::around(self.vertices.iter().copied()).unwrap_or(BoundingBox { x1: 0.0, y1: 0.0, x2: 0.0, y2: 0.0 })
    }

    /// Whether a point lies inside, by the even-odd rule.
    pub fn contains(&self, point: &Point2<f64>) -> bool {
        self.edges().fold(false, |inside, (a, b)| {
            let crosses =
                (a.y > point.y) != (b.y > point.y) && point.x < a.x + (b.x - a.x) * (point.y - a.y) / (b.y - a.y);
            inside ^ crosses
        })
    }

    /// The fraction of this polygon's area that lies inside another polygon, in `[0, 1]`, from a grid of 16 × 16 points
    /// over this polygon's box; if this polygon is thin, from up to 65,536 points, and if it lies between those too, from
    /// the two boxes.
    pub fn share_inside(&self, other: &Self) -> f64 {
        const SIDE: u32 = 16;
        let grid = (0..SIDE * SIDE).map(|k| [k % SIDE, k / SIDE].map(|step| (f64::from(step) + 0.5) / f64::from(SIDE)));
        // A Fibonacci lattice: unlike a grid's, its points do not lie on few lines between which an arm could lie.
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let lattice = |count: u32| {
            (0..count).map(move |k| [(f64::from(k) + 0.5) / f64::from(count), (f64::from(k) * golden).fract()])
        };
        self.share_of_points(other, grid)
            .or_else(|| self.share_of_points(other, lattice(1 << 12)))
            .or_else(|| self.share_of_points(other, lattice(1 << 16)))
            .unwrap_or_else(|| {
                let bounds = self.bounds();
                bounds.intersection(&other.bounds()) / bounds.area().max(f64::MIN_POSITIVE)
            })
    }

    /// Of the points that lie in this polygon, the fraction that also lies in the other; `None` if there are too few.
    /// The points are in fractions of this polygon's box.
    fn share_of_points(&self, other: &Self, points: impl Iterator<Item = [f64; 2]>) -> Option<f64> {
        // Chosen by hand. Of the shipped parts at any angle, the fuel line has the fewest of 256 points: 22.
        const MIN_POINTS: u32 = 20;
        let bounds = self.bounds();
        let points = points.map(|[x, y]| Point2::new(bounds.x1 + bounds.width() * x, bounds.y1 + bounds.height() * y));
        let (mut own, mut shared) = (0u32, 0u32);
        for point in points.filter(|point| self.contains(point)) {
            own += 1;
            shared += u32::from(other.contains(&point));
        }
        (own >= MIN_POINTS).then(|| f64::from(shared) / f64::from(own))
    }

    /// Distance from a point, inside or outside, to the nearest edge, in pixels.
    pub fn distance_to_edge(&self, point: &Point2<f64>) -> f64 {
        self.edges()
            .map(|(a, b)| {
                let edge = b - a;
                let t = ((point - a).dot(&edge) / edge.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                (point - (a + edge * t)).norm()
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// Whether two edges without a common vertex intersect.
    pub fn crosses_itself(&self) -> bool {
        let edges: Vec<_> = self.edges().collect();
        let side = |a: Point2<f64>, b: Point2<f64>, p: Point2<f64>| (b - a).perp(&(p - a));
        (0..edges.len()).any(|i| {
            (i + 2..edges.len()).any(|j| {
                if i == 0 && j == edges.len() - 1 {
                    return false;
                }
                let ((a, b), (c, d)) = (edges[i], edges[j]);
                side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
            })
        })
    }

    /// The part inside an image of `width` × `height` pixels, as one polygon; empty if no part is inside.
    ///
    /// # Source
    /// Sutherland and Hodgman 1974. If clipping divides a concave polygon, its pieces stay connected along the border.
    pub fn clip(&self, width: f64, height: f64) -> Self {
        let mut vertices = self.vertices.clone();
        // Each border as (axis, bound, whether the inside is below the bound).
        for (axis, bound, keep_below) in [(0, 0.0, false), (0, width, true), (1, 0.0, false), (1, height, true)] {
            let inside = |p: &Point2<f64>| if keep_below { p[axis] <= bound } else { p[axis] >= bound };
            let mut kept = Vec::with_capacity(vertices.len() + 4);
            for (i, to) in vertices.iter().enumerate() {
                let from = vertices[(i + vertices.len() - 1) % vertices.len()];
                if inside(&from) != inside(to) {
                    let t = (bound - from[axis]) / (to[axis] - from[axis]);
                    kept.push(from + (to - from) * t);
                }
                if inside(to) {
                    kept.push(*to);
                }
            }
            vertices = kept;
        }
        Self { vertices }
    }

    /// The polygon, transformed with its part.
    pub fn transformed(&self, target_from_source: &PlanarSimilarity) -> Self {
        Self { vertices: self.vertices.iter().map(|v| target_from_source.apply(v)).collect() }
    }

    /// Scales both axes, as when the image is resized.
    pub fn scaled(&self, scale_x: f64, scale_y: f64) -> Self {
        Self { vertices: self.vertices.iter().map(|v| Point2::new(v.x * scale_x, v.y * scale_y)).collect() }
    }

    /// The pixels whose centres lie inside, by the even-odd rule.
    pub fn rasterize(&self, width: u32, height: u32) -> Mask {
        let mut mask = Mask::empty(width, height);
        let mut crossings: Vec<f64> = Vec::new();
        for row in 0..height {
            let y = row as f64 + 0.5;
            crossings.clear();
            for (a, b) in self.edges() {
                if (a.y > y) != (b.y > y) {
                    crossings.push(a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y));
                }
            }
            crossings.sort_by(f64::total_cmp);
            for span in crossings.chunks_exact(2) {
                // The first pixel whose centre is at or right of the crossing.
                let first = (span[0] - 0.5).ceil().clamp(0.0, width as f64) as u32;
                let end = (span[1] - 0.5).ceil().clamp(0.0, width as f64) as u32;
                for column in first..end {
                    mask.set(column, row, true);
                }
            }
        }
        mask
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Angle;

    #[test]
    fn half_of_a_square_lies_in_its_neighbour_shifted_by_half() {
        let square = |x: f64| Polygon::from_box(&BoundingBox { x1: x, y1: 0.0, x2: x + 32.0, y2: 32.0 });
        assert_eq!(square(0.0).share_inside(&square(16.0)), 0.5);
        assert_eq!(square(0.0).share_inside(&square(40.0)), 0.0);
        // The small square has a quarter of the large one's area.
        let small = Polygon::from_box(&BoundingBox { x1: 0.0, y1: 0.0, x2: 16.0, y2: 16.0 });
        assert_eq!((square(0.0).share_inside(&small), small.share_inside(&square(0.0))), (0.25, 1.0));
    }

    #[test]
    fn thin_arms_lie_inside_themselves_at_any_angle() {
        let u_shape = |thickness: f64, angle_deg: f64| {
            let (low, high) = (thickness, 300.0 - thickness);
            let inner = [(low, 0.0), (low, high), (high, high), (high, 0.0)];
            let corners = inner.into_iter().chain([(300.0, 0.0), (300.0, 300.0), (0.0, 300.0), (0.0, 0.0)]);
            let turn = PlanarSimilarity { angle: Angle::from_degrees(angle_deg), ..PlanarSimilarity::IDENTITY };
            Polygon { vertices: corners.map(|(x, y)| turn.apply(&Point2::new(x, y))).collect() }
        };
        for (thickness, angle_deg) in [8.0, 5.0, 3.0, 0.3].into_iter().flat_map(|t| [(t, 0.0), (t, 45.0), (t, 10.0)]) {
            let part = u_shape(thickness, angle_deg);
            let share_after = |by: f64| part.share_inside(&part.transformed(&PlanarSimilarity::translation(by, 0.0)));
            // Upright, two of the three arms lose a third.
            let share = share_after(thickness / 3.0);
            assert!((0.65..0.9).contains(&share), "{thickness} px, {angle_deg}°: {share}");
            assert_eq!((share_after(0.0), share_after(500.0)), (1.0, 0.0), "{thickness} px, {angle_deg}°");
        }
        // Too thin for any point: the boxes.
        assert_eq!(u_shape(0.001, 0.0).share_inside(&u_shape(0.001, 0.0)), 1.0);
    }

    use proptest::prelude::*;

    fn l_shape() -> Polygon {
        let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (2.0, 2.0), (2.0, 4.0), (0.0, 4.0)];
        Polygon::new(corners.map(|(x, y)| Point2::new(x, y)).to_vec()).unwrap()
    }

    #[test]
    fn area_and_centroid_of_an_l() {
        assert_eq!(l_shape().area(), 12.0);
        // Three 2×2 squares with centres (1, 1), (3, 1), (1, 3).
        assert!((l_shape().centroid() - Point2::new(5.0 / 3.0, 5.0 / 3.0)).norm() < 1e-12);
    }

    #[test]
    fn refuses_a_line() {
        let line = vec![Point2::new(0.0, 0.0), Point2::new(1.0, 1.0), Point2::new(2.0, 2.0)];
        assert!(matches!(Polygon::new(line), Err(GeometryError::DegeneratePolygon { .. })));
    }

    #[test]
    fn rasterized_area_of_an_l_is_exact() {
        let mask = l_shape().rasterize(6, 6);
        assert_eq!(mask.area(), 12);
        assert!(mask.get(3, 1) && !mask.get(3, 3) && mask.get(1, 3));
    }

    #[test]
    fn clip_halves_a_square() {
        let square = Polygon::from_box(&BoundingBox { x1: -1.0, y1: 1.0, x2: 1.0, y2: 3.0 });
        assert!((square.clip(10.0, 10.0).area() - 2.0).abs() < 1e-12);
        let away = Polygon::from_box(&BoundingBox { x1: -5.0, y1: 1.0, x2: -1.0, y2: 3.0 });
        assert!(away.clip(10.0, 10.0).vertices.is_empty());
    }

    #[test]
    fn a_bow_tie_crosses_itself_and_an_l_does_not() {
        let corners = [(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 1.0)];
        let bow_tie = Polygon { vertices: corners.map(|(x, y)| Point2::new(x, y)).to_vec() };
        assert!(bow_tie.crosses_itself());
        assert!(!l_shape().crosses_itself());
    }

    proptest! {
        #[test]
        fn rasterization_agrees_with_contains(points in prop::collection::vec((0.0..20.0f64, 0.0..20.0f64), 3..9)) {
            let polygon = Polygon { vertices: points.iter().map(|&(x, y)| Point2::new(x, y)).collect() };
            let mask = polygon.rasterize(20, 20);
            for row in 0..20 {
                for column in 0..20 {
                    let center = Point2::new(column as f64 + 0.5, row as f64 + 0.5);
                    if polygon.distance_to_edge(&center) > 1e-6 {
                        prop_assert_eq!(mask.get(column, row), polygon.contains(&center));
                    }
                }
            }
        }
    }
}
