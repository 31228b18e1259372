//! A polygon extruded to a height: its strips, and its triangles as OBJ.

use std::fmt::Write as _;

use nalgebra::{Point2, Point3, Vector2};

/// A piece of the part between two values of x, with one interval along y at each of them; in metres in the object
/// frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strip {
    pub(super) x: [f64; 2],
    /// Low end of the interval along y, at both x.
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
}

/// The strips of a polygon between neighbouring `cuts`, which are sorted values of x.
pub(super) fn strips(corners: &[Point2<f64>], cuts: &[f64]) -> Vec<Strip> {
    let edges: Vec<_> = (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()])).collect();
    // The ends of all intervals along y, in ascending order, from the edges that cross x.
    let crossing = |x: f64, at: [f64; 2]| {
        let over = |(a, b): &&(Point2<f64>, Point2<f64>)| (a.x < x) != (b.x < x);
        let y = |a: &Point2<f64>, b: &Point2<f64>, at: f64| {
            // Beyond its ends an edge continues at constant y, because strips may be wider than the edge.
            a.y + (b.y - a.y) * ((at - a.x) / (b.x - a.x)).clamp(0.0, 1.0)
        };
        let mut ends: Vec<_> = edges.iter().filter(over).map(|(a, b)| (y(a, b, x), at.map(|at| y(a, b, at)))).collect();
        ends.sort_by(|one, other| one.0.total_cmp(&other.0));
        ends.into_iter().map(|(_, ends)| ends).collect::<Vec<_>>()
    };
    let mut found = Vec::new();
    for pair in cuts.windows(2) {
        let x = [pair[0], pair[1]];
        for span in crossing(0.5 * (x[0] + x[1]), x).chunks_exact(2) {
            found.push(Strip { x, low: span[0], high: span[1] });
        }
    }
    found
}

/// The visible body up to the height `top` in metres, as OBJ: two triangles each for the top and the bottom of every
/// strip between neighbouring corners, and two for every wall. `texcoord` returns the texture position of a point, from
/// the lower left corner; walls show the texture `inset_m` inside the outline.
pub(super) fn mesh(
    corners: &[Point2<f64>],
    top: f64,
    inset_m: f64,
    texcoord: impl Fn(Point2<f64>) -> [f64; 2],
) -> String {
    let mut cuts: Vec<f64> = corners.iter().map(|corner| corner.x).collect();
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|a, b| *a - *b < 1e-6);
    let mut obj = Obj::default();
    for Strip { x, low, high } in strips(corners, &cuts) {
        let quad = [(x[0], low[0]), (x[1], low[1]), (x[1], high[1]), (x[0], high[0])].map(|(x, y)| Point2::new(x, y));
        obj.quad(quad.map(|p| (Point3::new(p.x, p.y, top), texcoord(p))), [0.0, 0.0, 1.0]);
        let [a, b, c, d] = quad;
        obj.quad([a, d, c, b].map(|p| (Point3::new(p.x, p.y, 0.0), texcoord(p))), [0.0, 0.0, -1.0]);
    }
    // Walls face outwards if the corners are counter-clockwise from above.
    let doubled_area: f64 =
        (0..corners.len()).map(|i| corners[i].coords.perp(&corners[(i + 1) % corners.len()].coords)).sum();
    for i in 0..corners.len() {
        let (mut a, mut b) = (corners[i], corners[(i + 1) % corners.len()]);
        if doubled_area < 0.0 {
            (a, b) = (b, a);
        }
        let Some(edge) = (b - a).try_normalize(1e-9) else { continue };
        let outwards = Vector2::new(edge.y, -edge.x);
        let inset = outwards * inset_m;
        let wall = [(a, 0.0), (b, 0.0), (b, top), (a, top)];
        obj.quad(wall.map(|(p, z)| (Point3::new(p.x, p.y, z), texcoord(p - inset))), [outwards.x, outwards.y, 0.0]);
    }
    obj.text
}

/// OBJ text under construction.
#[derive(Default)]
struct Obj {
    text: String,
    num_corners: usize,
    num_normals: usize,
}

impl Obj {
    /// Writes two triangles. The corners, each with its texture position, are counter-clockwise seen from outside.
    fn quad(&mut self, corners: [(Point3<f64>, [f64; 2]); 4], normal: [f64; 3]) {
        for (p, [u, v]) in corners {
            let _ = write!(self.text, "v {:.6} {:.6} {:.6}\nvt {u:.6} {v:.6}\n", p.x, p.y, p.z);
        }
        let _ = writeln!(self.text, "vn {:.6} {:.6} {:.6}", normal[0], normal[1], normal[2]);
        self.num_normals += 1;
        let (first, n) = (self.num_corners + 1, self.num_normals);
        let corner = |k: usize| format!("{0}/{0}/{n}", first + k);
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            let _ = writeln!(self.text, "f {} {} {}", corner(a), corner(b), corner(c));
        }
        self.num_corners += 4;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_concave_part_is_cut_into_spans() {
        // A U-shaped outline: between x = 1 and 3 there are two intervals.
        let u = [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (2.0, 3.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)]
            .map(|(y, x)| Point2::new(x, y));
        let found = strips(&u, &[0.0, 1.0, 3.0]);
        let spans: Vec<_> = found.iter().map(|strip| (strip.x[0], strip.low[0], strip.high[0])).collect();
        assert_eq!(spans, [(0.0, 0.0, 3.0), (1.0, 0.0, 1.0), (1.0, 2.0, 3.0)]);
    }
}
