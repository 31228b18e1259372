//! Signed distance of each pixel to an outline.

use nalgebra::Point2;
use sdg_geometry::Polygon;

/// Maximum distance in both directions; larger ones are clamped, because soft edges and shadows need no more.
pub(crate) const BAND_PX: f32 = 24.0;

/// For every pixel centre of a `width` × `height` raster the distance to the outline, positive inside, clamped to
/// ±[`BAND_PX`].
pub(crate) fn signed_distance(outline: &Polygon, width: usize, height: usize) -> Vec<f32> {
    let inside = outline.rasterize(width as u32, height as u32);
    let mut distance = vec![BAND_PX; width * height];
    for (a, b) in outline.edges() {
        let edge = b - a;
        let length_squared = edge.norm_squared().max(f64::MIN_POSITIVE);
        let band = f64::from(BAND_PX);
        // Only pixels in the band around the edge can be closer to it than the band's width.
        let low = |p: f64, q: f64, end: usize| ((p.min(q) - band).floor().max(0.0) as usize).min(end);
        let high = |p: f64, q: f64, end: usize| ((p.max(q) + band).ceil().max(0.0) as usize).min(end);
        for y in low(a.y, b.y, height)..high(a.y, b.y, height) {
            for x in low(a.x, b.x, width)..high(a.x, b.x, width) {
                let p = Point2::new(x as f64 + 0.5, y as f64 + 0.5);
                let t = ((p - a).dot(&edge) / length_squared).clamp(0.0, 1.0);
                let here = (p - (a + edge * t)).norm() as f32;
                let nearest = &mut distance[y * width + x];
                *nearest = nearest.min(here);
            }
        }
    }
    for y in 0..height {
        for x in 0..width {
            if !inside.get(x as u32, y as u32) {
                distance[y * width + x] *= -1.0;
            }
        }
    }
    distance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_polygon_everywhere() {
        let corners = [(10.0, 12.0), (52.0, 9.0), (40.0, 30.0), (55.0, 44.0), (14.0, 40.0)];
        let outline = Polygon::new(corners.map(|(x, y)| Point2::new(x, y)).to_vec()).unwrap();
        let distance = signed_distance(&outline, 90, 60);
        for y in 0..60 {
            for x in 0..90 {
                let p = Point2::new(x as f64 + 0.5, y as f64 + 0.5);
                let exact = (outline.distance_to_edge(&p) as f32).min(BAND_PX);
                let signed = if outline.contains(&p) { exact } else { -exact };
                assert!((distance[y * 90 + x] - signed).abs() < 1e-4, "({x}, {y})");
            }
        }
    }
}
