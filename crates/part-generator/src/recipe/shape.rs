//! Flat shapes as signed distances in millimetres, negative inside.

/// A flat shape around the origin.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Shape {
    /// A circle.
    Disc {
        /// Radius in millimetres, around the origin.
        radius: f32,
    },
    /// A rectangle with rounded corners.
    Rectangle {
        /// Half of its width and height.
        half: [f32; 2],
        /// Radius of the corners.
        corner: f32,
    },
    /// A closed polygon with rounded corners.
    Polygon {
        /// The corners, before the polygon is widened by `corner`.
        vertices: Vec<[f32; 2]>,
        /// Radius by which it is widened.
        corner: f32,
    },
    /// A circle whose radius varies with the direction: gears, knobs, knurls.
    Lobed {
        /// Mean radius over all directions, in millimetres.
        radius: f32,
        /// Number of lobes.
        lobes: u32,
        /// Half of the difference between largest and smallest radius.
        depth: f32,
        /// Shape of the lobes: 1 is a sine, larger is steeper.
        steepness: f32,
    },
    /// All points within `radius` of a line through points (x, y, z of the centre line).
    Path {
        /// Points of the centre line.
        points: Vec<[f32; 3]>,
        /// Half of the width.
        radius: f32,
    },
}

impl Shape {
    /// Signed distance of a point, and the height of the nearest point of the centre line (0 for shapes other than
    /// paths).
    pub fn locate(&self, x: f32, y: f32) -> (f32, f32) {
        match self {
            Self::Disc { radius } => ((x * x + y * y).sqrt() - radius, 0.0),
            Self::Rectangle { half, corner } => {
                let (qx, qy) = (x.abs() - half[0] + corner, y.abs() - half[1] + corner);
                ((qx.max(0.0).powi(2) + qy.max(0.0).powi(2)).sqrt() + qx.max(qy).min(0.0) - corner, 0.0)
            }
            Self::Polygon { vertices, corner } => (polygon_distance(vertices, x, y) - corner, 0.0),
            Self::Lobed { radius, lobes, depth, steepness } => {
                let wave = (y.atan2(x) * *lobes as f32).cos() * steepness;
                (x.hypot(y) - radius - depth * wave.clamp(-1.0, 1.0), 0.0)
            }
            Self::Path { points, radius } => {
                let (distance, z) = path_distance(points, *radius, x, y);
                (distance - radius, z)
            }
        }
    }

    /// The radius of a circle around the origin that contains the shape.
    pub fn reach(&self) -> f32 {
        match self {
            Self::Disc { radius } => *radius,
            Self::Rectangle { half, .. } => half[0].hypot(half[1]),
            Self::Polygon { vertices, corner } => {
                corner + vertices.iter().map(|v| v[0].hypot(v[1])).fold(0.0, f32::max)
            }
            Self::Lobed { radius, depth, .. } => radius + depth,
            Self::Path { points, radius } => radius + points.iter().map(|p| p[0].hypot(p[1])).fold(0.0, f32::max),
        }
    }

    /// Mirrors across the y axis.
    pub fn mirror(&mut self) {
        match self {
            Self::Polygon { vertices, .. } => vertices.iter_mut().for_each(|v| v[0] = -v[0]),
            Self::Path { points, .. } => points.iter_mut().for_each(|p| p[0] = -p[0]),
            // A lobe points along x. With an even number of lobes the shape is its own mirror image. With an odd number
            // its mirror image is rotated by 180°, which the feature's `turn` compensates.
            Self::Disc { .. } | Self::Rectangle { .. } | Self::Lobed { .. } => {}
        }
    }
}

/// Signed distance to a polygon by the even-odd rule.
fn polygon_distance(vertices: &[[f32; 2]], x: f32, y: f32) -> f32 {
    let (mut nearest, mut inside) = (f32::MAX, false);
    let mut a = vertices[vertices.len() - 1];
    for &b in vertices {
        let (ex, ey) = (b[0] - a[0], b[1] - a[1]);
        let (px, py) = (x - a[0], y - a[1]);
        let t = ((px * ex + py * ey) / (ex * ex + ey * ey).max(1e-12)).clamp(0.0, 1.0);
        let (dx, dy) = (px - ex * t, py - ey * t);
        nearest = nearest.min(dx * dx + dy * dy);
        if (a[1] > y) != (b[1] > y) && x < a[0] + ex * (y - a[1]) / ey {
            inside = !inside;
        }
        a = b;
    }
    if inside { -nearest.sqrt() } else { nearest.sqrt() }
}

/// Distance to an open line, and the height of its nearest point within `radius`: where the line crosses itself, the
/// upper strand counts.
fn path_distance(points: &[[f32; 3]], radius: f32, x: f32, y: f32) -> (f32, f32) {
    let (mut best, mut best_z, mut best_top) = (f32::MAX, 0.0, f32::MIN);
    for ends in points.windows(2) {
        let (a, b) = (ends[0], ends[1]);
        let (ex, ey) = (b[0] - a[0], b[1] - a[1]);
        let (px, py) = (x - a[0], y - a[1]);
        let t = ((px * ex + py * ey) / (ex * ex + ey * ey).max(1e-12)).clamp(0.0, 1.0);
        let squared = (px - ex * t).powi(2) + (py - ey * t).powi(2);
        let z = a[2] + (b[2] - a[2]) * t;
        if squared < radius * radius {
            let top = z + (radius * radius - squared).sqrt();
            if top > best_top {
                (best, best_z, best_top) = (squared, z, top);
            }
        } else if best_top == f32::MIN && squared < best {
            (best, best_z) = (squared, z);
        }
    }
    (best.sqrt(), best_z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_of_simple_shapes() {
        let rectangle = Shape::Rectangle { half: [10.0, 5.0], corner: 1.0 };
        assert!((rectangle.locate(0.0, 0.0).0 + 5.0).abs() < 1e-5);
        assert!((rectangle.locate(13.0, 0.0).0 - 3.0).abs() < 1e-5);
        let triangle = Shape::Polygon { vertices: vec![[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]], corner: 0.0 };
        assert!((triangle.locate(2.0, 3.0).0 + 2.0).abs() < 1e-5);
        assert!((triangle.locate(-2.0, 3.0).0 - 2.0).abs() < 1e-5);
        let path = Shape::Path { points: vec![[0.0, 0.0, 2.0], [10.0, 0.0, 4.0]], radius: 1.0 };
        let (distance, z) = path.locate(5.0, 0.5);
        assert!((distance + 0.5).abs() < 1e-5 && (z - 3.0).abs() < 1e-5);
    }

    #[test]
    fn the_upper_strand_of_a_crossing_counts() {
        let points = vec![[-5.0, 0.0, 2.0], [5.0, 0.0, 2.0], [0.0, 5.0, 3.0], [0.0, -5.0, 6.0]];
        let (_, z) = Shape::Path { points, radius: 2.0 }.locate(0.0, 0.0);
        assert!(z > 4.0, "{z}");
    }
}
