//! Polygons with fewer vertices.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::Polygon;

impl Polygon {
    /// The polygon with at most `most` vertices (at least three). Vertices that change the area least are removed one
    /// after the other; without surplus vertices nothing changes.
    ///
    /// # Source
    /// Visvalingam and Whyatt 1993. Takes `n log n` steps for `n` vertices.
    pub fn thinned(&self, most: usize) -> Self {
        let count = self.vertices.len();
        let mut neighbours: Vec<[usize; 2]> = (0..count).map(|i| [(i + count - 1) % count, (i + 1) % count]).collect();
        let area = |i: usize, [before, after]: [usize; 2]| {
            let at = self.vertices[i];
            // The bits of non-negative floats have the order of the floats.
            (self.vertices[before] - at).perp(&(self.vertices[after] - at)).abs().to_bits()
        };
        let mut is_kept = vec![true; count];
        let mut smallest: BinaryHeap<_> = (0..count).map(|i| Reverse((area(i, neighbours[i]), i))).collect();
        let mut surplus = count.saturating_sub(most.max(3));
        while surplus > 0
            && let Some(Reverse((known, i))) = smallest.pop()
        {
            // Entries of removed vertices and areas from before a neighbour was removed are ignored.
            if !is_kept[i] || known != area(i, neighbours[i]) {
                continue;
            }
            is_kept[i] = false;
            surplus -= 1;
            let [before, after] = neighbours[i];
            neighbours[before][1] = after;
            neighbours[after][0] = before;
            smallest.extend([before, after].map(|i| Reverse((area(i, neighbours[i]), i))));
        }
        let kept = self.vertices.iter().zip(is_kept).filter_map(|(vertex, is_kept)| is_kept.then_some(*vertex));
        Self { vertices: kept.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    fn circle(count: usize) -> Polygon {
        let at = |i: usize| (std::f64::consts::TAU * i as f64 / count as f64).sin_cos();
        Polygon {
            vertices: (0..count).map(|i| Point2::new(500.0 + 400.0 * at(i).1, 500.0 + 400.0 * at(i).0)).collect(),
        }
    }

    #[test]
    fn a_round_outline_keeps_its_form() {
        let fine = circle(10_000);
        let thinned = fine.thinned(256);
        assert_eq!(thinned.vertices.len(), 256);
        assert!((thinned.area() / fine.area() - 1.0).abs() < 3e-4, "{} of {}", thinned.area(), fine.area());
        let farthest = fine.vertices.iter().map(|vertex| thinned.distance_to_edge(vertex)).fold(0.0, f64::max);
        assert!(farthest < 0.2, "{farthest} px");
        assert_eq!(fine.thinned(10_000), fine);
    }

    #[test]
    fn corners_are_kept_and_points_of_sides_removed() {
        let side = |from: [f64; 2], to: [f64; 2]| {
            let along = move |k: usize| Point2::from([0, 1].map(|i| from[i] + (to[i] - from[i]) * k as f64 / 100.0));
            (0..100).map(along)
        };
        let corners = [[10.0, 10.0], [90.0, 10.0], [90.0, 40.0], [10.0, 40.0]];
        let vertices = (0..4).flat_map(|i| side(corners[i], corners[(i + 1) % 4])).collect();
        let thinned = Polygon { vertices }.thinned(4);
        assert_eq!(thinned.vertices, corners.map(Point2::from));
    }

    #[test]
    fn broken_coordinates_and_few_vertices_do_no_harm() {
        let mut broken = circle(100);
        (broken.vertices[7].x, broken.vertices[20].y) = (f64::NAN, f64::INFINITY);
        assert!(broken.thinned(10).vertices.len() <= 100);
        let line = Polygon { vertices: vec![Point2::new(1.0, 2.0); 2] };
        assert_eq!(line.thinned(0), line);
        assert_eq!(Polygon { vertices: Vec::new() }.thinned(3).vertices, []);
    }
}
