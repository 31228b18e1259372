//! A part seen from above without perspective: the height of the visible surface at each point, and the index of the
//! mesh to which this surface belongs.

use nalgebra::{Isometry2, Point2, Point3};

/// Triangles from above on a square raster.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeightMap {
    /// Side of a cell in metres.
    pub(crate) cell_m: f64,
    /// The corner of cell (0, 0) with the smallest coordinates.
    pub(crate) corner: Point2<f64>,
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Row by row, in ascending order of y: height of the highest surface in metres, and the index of its mesh.
    pub(crate) cells: Vec<Option<(f64, u32)>>,
}

impl HeightMap {
    /// Draws triangles, each with the index of its mesh.
    pub(crate) fn new(triangles: &[([Point3<f64>; 3], u32)], cell_m: f64) -> Self {
        let mut low = Point2::new(f64::INFINITY, f64::INFINITY);
        let mut high = Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY);
        for point in triangles.iter().flat_map(|(corners, _)| corners) {
            low = low.inf(&point.xy());
            high = high.sup(&point.xy());
        }
        let corner = low.map(|value| ((value / cell_m).floor() - 1.0) * cell_m);
        let cells_of = |from: f64, to: f64| ((to - from) / cell_m).ceil().max(0.0) as usize + 2;
        let (width, height) = match triangles.is_empty() {
            true => (0, 0),
            false => (cells_of(corner.x, high.x), cells_of(corner.y, high.y)),
        };
        let mut map = Self { cell_m, corner, width, height, cells: vec![None; width * height] };
        for (corners, piece) in triangles {
            map.draw(corners, *piece);
        }
        map
    }

    fn draw(&mut self, corners: &[Point3<f64>; 3], piece: u32) {
        // Units are cells, with the centre of cell (0, 0) at (0, 0).
        let [a, b, c] = corners.map(|p| {
            Point3::new((p.x - self.corner.x) / self.cell_m - 0.5, (p.y - self.corner.y) / self.cell_m - 0.5, p.z)
        });
        let area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
        if area.abs() < 1e-12 {
            return;
        }
        let range = |values: [f64; 3], count: usize| {
            let low = values.into_iter().fold(f64::INFINITY, f64::min).ceil().max(0.0) as usize;
            let high = values.into_iter().fold(f64::NEG_INFINITY, f64::max).floor();
            low..if high < 0.0 { 0 } else { (high as usize + 1).min(count) }
        };
        for row in range([a.y, b.y, c.y], self.height) {
            for col in range([a.x, b.x, c.x], self.width) {
                let (x, y) = (col as f64, row as f64);
                let at_b = ((x - a.x) * (c.y - a.y) - (c.x - a.x) * (y - a.y)) / area;
                let at_c = ((b.x - a.x) * (y - a.y) - (x - a.x) * (b.y - a.y)) / area;
                if at_b < -1e-9 || at_c < -1e-9 || at_b + at_c > 1.0 + 1e-9 {
                    continue;
                }
                let z = a.z + at_b * (b.z - a.z) + at_c * (c.z - a.z);
                let cell = &mut self.cells[row * self.width + col];
                if cell.is_none_or(|(highest, _)| z > highest) {
                    *cell = Some((z, piece));
                }
            }
        }
    }

    /// Height (m) and index of the mesh at a point.
    pub(crate) fn at(&self, point: &Point2<f64>) -> Option<(f64, u32)> {
        let cell = (point - self.corner) / self.cell_m;
        let inside = cell.x >= 0.0 && cell.y >= 0.0 && cell.x < self.width as f64 && cell.y < self.height as f64;
        if inside { self.cells[cell.y as usize * self.width + cell.x as usize] } else { None }
    }

    /// The centres of the filled cells, with height and index of the mesh.
    pub(crate) fn filled(&self) -> impl Iterator<Item = (Point2<f64>, f64, u32)> + '_ {
        self.cells.iter().enumerate().filter_map(|(idx, cell)| {
            let (z, piece) = (*cell)?;
            let (col, row) = ((idx % self.width) as f64 + 0.5, (idx / self.width) as f64 + 0.5);
            Some((self.corner + nalgebra::Vector2::new(col, row) * self.cell_m, z, piece))
        })
    }

    /// Centre of the filled cells; the origin for an empty map.
    pub(crate) fn centre(&self) -> Point2<f64> {
        let (sum, count) =
            self.filled().fold((nalgebra::Vector2::zeros(), 0), |(sum, count), (at, ..)| (sum + at.coords, count + 1));
        if count == 0 { Point2::origin() } else { Point2::from(sum / f64::from(count)) }
    }

    /// Moves this map and compares it with another map. Returns the fraction of the cells filled in either map at which
    /// only one map is filled, or the heights differ by more than `tolerance_m`.
    pub(crate) fn difference(&self, other: &Self, other_from_self: &Isometry2<f64>, tolerance_m: f64) -> f64 {
        let (mut both, mut alike, mut own) = (0usize, 0usize, 0usize);
        for (at, z, _) in self.filled() {
            own += 1;
            if let Some((other_z, _)) = other.at(&(other_from_self * at)) {
                both += 1;
                alike += usize::from((z - other_z).abs() <= tolerance_m);
            }
        }
        let either = own + other.filled().count() - both.min(own);
        if either == 0 { 0.0 } else { 1.0 - alike as f64 / either as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    fn square(x: f64, z: f64, piece: u32) -> [([Point3<f64>; 3], u32); 2] {
        let p = |u: f64, v: f64| Point3::new(x + u, v, z);
        [([p(0.0, 0.0), p(0.01, 0.0), p(0.01, 0.01)], piece), ([p(0.0, 0.0), p(0.01, 0.01), p(0.0, 0.01)], piece)]
    }

    #[test]
    fn the_highest_surface_shows() {
        let mut triangles = square(0.0, 0.002, 1).to_vec();
        triangles.extend(square(0.005, 0.004, 2));
        let map = HeightMap::new(&triangles, 0.001);
        assert_eq!(map.filled().count(), 150);
        assert_eq!(map.at(&Point2::new(0.0025, 0.005)).map(|(_, piece)| piece), Some(1));
        assert_eq!(map.at(&Point2::new(0.0075, 0.005)), Some((0.004, 2)));
        assert_eq!(map.at(&Point2::new(0.03, 0.005)), None);
        assert!((map.centre() - Point2::new(0.0075, 0.005)).norm() < 1e-9);
    }

    #[test]
    fn differences_are_shares_of_the_area() {
        let (one, beside) =
            (HeightMap::new(&square(0.0, 0.002, 1), 0.001), HeightMap::new(&square(0.005, 0.002, 1), 0.001));
        assert_eq!(one.difference(&one, &Isometry2::identity(), 1e-4), 0.0);
        // 50 of 150 cells are filled in both maps.
        assert!((one.difference(&beside, &Isometry2::identity(), 1e-4) - 2.0 / 3.0).abs() < 1e-9);
        assert_eq!(one.difference(&beside, &Isometry2::new(Vector2::new(0.005, 0.0), 0.0), 1e-4), 0.0);
        let higher = HeightMap::new(&square(0.0, 0.004, 1), 0.001);
        assert_eq!(one.difference(&higher, &Isometry2::identity(), 1e-4), 1.0);
    }
}
