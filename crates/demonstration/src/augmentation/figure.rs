//! Outlines of typical factory objects, as signed distances.

use super::random::{SampleRng, chance, index_below, uniform};

/// A simple figure in its own frame, with a radius of about one.
#[derive(Debug, Clone, Copy)]
enum Primitive {
    /// All points within `radius` of the line from `a` to `b`.
    Capsule {
        a: [f32; 2],
        b: [f32; 2],
        radius: f32,
    },
    Ring {
        center: [f32; 2],
        radius: f32,
        half_width: f32,
    },
    /// Regular, with `sides` corners on the circle of `radius`.
    Polygon {
        center: [f32; 2],
        radius: f32,
        sides: f32,
        turn: f32,
    },
    Box {
        center: [f32; 2],
        half: [f32; 2],
        corner: f32,
    },
    Gear {
        radius: f32,
        teeth: f32,
        depth: f32,
    },
    /// A segment of a ring, `half_angle` to both sides of the x axis.
    Arc {
        radius: f32,
        half_angle: f32,
        half_width: f32,
    },
}

impl Primitive {
    /// Distance to the outline, negative inside; exact or a close lower bound.
    #[inline]
    fn distance(&self, x: f32, y: f32) -> f32 {
        match *self {
            Self::Capsule { a, b, radius } => {
                let (px, py, ex, ey) = (x - a[0], y - a[1], b[0] - a[0], b[1] - a[1]);
                let t = ((px * ex + py * ey) / (ex * ex + ey * ey).max(1e-9)).clamp(0.0, 1.0);
                length(px - ex * t, py - ey * t) - radius
            }
            Self::Ring { center, radius, half_width } => {
                (length(x - center[0], y - center[1]) - radius).abs() - half_width
            }
            Self::Polygon { center, radius, sides, turn } => {
                let (px, py) = (x - center[0], y - center[1]);
                let sector = std::f32::consts::TAU / sides;
                let angle = (py.atan2(px) + turn).rem_euclid(sector) - 0.5 * sector;
                length(px, py) * angle.cos() - radius * (0.5 * sector).cos()
            }
            Self::Box { center, half, corner } => {
                let qx = (x - center[0]).abs() - half[0] + corner;
                let qy = (y - center[1]).abs() - half[1] + corner;
                length(qx.max(0.0), qy.max(0.0)) + qx.max(qy).min(0.0) - corner
            }
            Self::Gear { radius, teeth, depth } => {
                let wave = (y.atan2(x) * teeth).cos();
                // The wave is steepened, so that the teeth have flanks; the factor keeps the slope near one.
                (length(x, y) - radius - depth * (3.0 * wave).clamp(-1.0, 1.0)) * 0.8
            }
            Self::Arc { radius, half_angle, half_width } => {
                let angle = y.atan2(x).clamp(-half_angle, half_angle);
                length(x - radius * angle.cos(), y - radius * angle.sin()) - half_width
            }
        }
    }
}

/// The length of a vector without `hypot`'s overflow handling, which would take most of the time here.
#[inline(always)]
fn length(x: f32, y: f32) -> f32 {
    (x * x + y * y).sqrt()
}

/// Several joined figures, with round holes, all in the unit frame.
#[derive(Debug, Clone)]
pub(crate) struct Figure {
    solids: Vec<Primitive>,
    holes: Vec<[f32; 3]>,
    /// Width of the rounded rim: half of the material's width for a rod, narrow for a plate.
    pub rim: f32,
}

impl Figure {
    /// Distance to the outline, negative inside.
    #[inline]
    pub fn distance(&self, x: f32, y: f32) -> f32 {
        let solid = self.solids.iter().fold(f32::MAX, |d, solid| d.min(solid.distance(x, y)));
        self.holes.iter().fold(solid, |d, &[u, v, r]| d.max(r - length(x - u, y - v)))
    }

    /// A rod, bent tube, ring, nut, plate, bracket, gear, eye rod, arc or blob.
    pub fn draw(rng: &mut SampleRng) -> Self {
        match index_below(rng, 10) {
            0 => Self::rod(rng),
            1 => Self::bent_tube(rng),
            2 => Self::ring(rng),
            3 => Self::nut(rng),
            4 => Self::plate(rng),
            5 => Self::bracket(rng),
            6 => Self::gear(rng),
            7 => Self::eye_rod(rng),
            8 => Self::arc(rng),
            _ => Self::blob(rng),
        }
    }

    fn rod(rng: &mut SampleRng) -> Self {
        let radius = uniform(rng, 0.05, 0.2);
        let mut solids = vec![Primitive::Capsule { a: [-0.95 + radius, 0.0], b: [0.95 - radius, 0.0], radius }];
        for _ in 0..index_below(rng, 3) {
            let half = [uniform(rng, 0.04, 0.2), radius * uniform(rng, 1.1, 1.9)];
            solids.push(Primitive::Box { center: [uniform(rng, -0.75, 0.75), 0.0], half, corner: 0.02 });
        }
        Self { solids, holes: vec![], rim: radius * 0.98 }
    }

    fn bent_tube(rng: &mut SampleRng) -> Self {
        let radius = uniform(rng, 0.05, 0.12);
        let mut at = [uniform(rng, -0.9, -0.6), uniform(rng, -0.4, 0.4)];
        let mut heading = uniform(rng, -0.6, 0.6);
        let mut solids = Vec::new();
        for _ in 0..2 + index_below(rng, 3) {
            let length = uniform(rng, 0.35, 0.7);
            let next = [at[0] + length * heading.cos(), at[1] + length * heading.sin()];
            let next = next.map(|v| v.clamp(-0.9, 0.9));
            solids.push(Primitive::Capsule { a: at, b: next, radius });
            at = next;
            heading += uniform(rng, 0.4, 1.5) * if chance(rng, 0.5) { 1.0 } else { -1.0 };
        }
        Self { solids, holes: vec![], rim: radius * 0.98 }
    }

    fn ring(rng: &mut SampleRng) -> Self {
        let half_width = uniform(rng, 0.06, 0.25);
        let ring = Primitive::Ring { center: [0.0; 2], radius: 0.95 - half_width, half_width };
        Self { solids: vec![ring], holes: vec![], rim: half_width * uniform(rng, 0.2, 0.98) }
    }

    fn nut(rng: &mut SampleRng) -> Self {
        let sides = [5.0, 6.0, 6.0, 6.0, 8.0][index_below(rng, 5)];
        let body = Primitive::Polygon { center: [0.0; 2], radius: 0.95, sides, turn: 0.0 };
        Self { solids: vec![body], holes: vec![[0.0, 0.0, uniform(rng, 0.25, 0.6)]], rim: uniform(rng, 0.03, 0.15) }
    }

    fn plate(rng: &mut SampleRng) -> Self {
        let half = [uniform(rng, 0.55, 0.8), uniform(rng, 0.2, 0.6)];
        let corner = uniform(rng, 0.01, 0.9) * half[1];
        let holes = (0..index_below(rng, 6))
            .map(|_| [uniform(rng, -0.75, 0.75) * half[0], uniform(rng, -0.7, 0.7) * half[1], uniform(rng, 0.05, 0.2)])
            .collect();
        Self { solids: vec![Primitive::Box { center: [0.0; 2], half, corner }], holes, rim: uniform(rng, 0.02, 0.12) }
    }

    fn bracket(rng: &mut SampleRng) -> Self {
        let arm = uniform(rng, 0.1, 0.24);
        let height = uniform(rng, 0.3, 0.7);
        let foot = Primitive::Box { center: [0.0, -height + arm], half: [0.8, arm], corner: 0.03 };
        // Position of the upright: at the end an L, in the middle a T.
        let stand = uniform(rng, -0.8 + arm, 0.8 - arm);
        let mut solids = vec![foot, Primitive::Box { center: [stand, 0.0], half: [arm, height], corner: 0.03 }];
        if chance(rng, 0.3) {
            solids.push(Primitive::Box { center: [-stand, 0.0], half: [arm, height], corner: 0.03 });
        }
        let holes = if chance(rng, 0.6) { vec![[stand, height - 1.5 * arm, arm * 0.5]] } else { vec![] };
        Self { solids, holes, rim: uniform(rng, 0.02, 0.1) }
    }

    fn gear(rng: &mut SampleRng) -> Self {
        let depth = uniform(rng, 0.04, 0.1);
        let gear = Primitive::Gear { radius: 0.94 - depth, teeth: 8.0 + index_below(rng, 17) as f32, depth };
        Self { solids: vec![gear], holes: vec![[0.0, 0.0, uniform(rng, 0.1, 0.5)]], rim: uniform(rng, 0.02, 0.1) }
    }

    fn eye_rod(rng: &mut SampleRng) -> Self {
        let (radius, eye) = (uniform(rng, 0.05, 0.14), uniform(rng, 0.18, 0.4));
        let half_width = eye * uniform(rng, 0.25, 0.6);
        let center = [0.95 - eye, 0.0];
        let mut solids = vec![
            Primitive::Ring { center, radius: eye - half_width, half_width },
            Primitive::Capsule { a: [center[0] - eye + half_width, 0.0], b: [-0.9, 0.0], radius },
        ];
        if chance(rng, 0.4) {
            let other = eye * uniform(rng, 0.4, 1.2);
            solids.push(Primitive::Ring { center: [-0.95 + other, 0.0], radius: other * 0.6, half_width: other * 0.4 });
        }
        Self { solids, holes: vec![], rim: radius.min(half_width) * 0.9 }
    }

    fn arc(rng: &mut SampleRng) -> Self {
        let half_width = uniform(rng, 0.05, 0.2);
        let arc = Primitive::Arc { radius: 0.95 - half_width, half_angle: uniform(rng, 0.7, 2.4), half_width };
        Self { solids: vec![arc], holes: vec![], rim: half_width * uniform(rng, 0.3, 0.98) }
    }

    /// An irregular shape: merged capsules.
    pub fn blob(rng: &mut SampleRng) -> Self {
        let solids = (0..3 + index_below(rng, 3))
            .map(|_| {
                let a = [uniform(rng, -0.5, 0.5), uniform(rng, -0.5, 0.5)];
                Primitive::Capsule { a, b: a.map(|v| v + uniform(rng, -0.2, 0.2)), radius: uniform(rng, 0.15, 0.4) }
            })
            .collect();
        Self { solids, holes: vec![], rim: uniform(rng, 0.05, 0.2) }
    }

    /// A straight bar.
    pub fn bar(rng: &mut SampleRng) -> Self {
        let half = uniform(rng, 0.04, 0.16);
        let bar = Primitive::Box { center: [0.0; 2], half: [0.98, half], corner: half * uniform(rng, 0.1, 1.0) };
        Self { solids: vec![bar], holes: vec![], rim: half * uniform(rng, 0.2, 0.98) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::{Stream, sample_rng};
    use super::*;

    #[test]
    fn distances_of_simple_figures() {
        let capsule = Primitive::Capsule { a: [0.0; 2], b: [2.0, 0.0], radius: 0.5 };
        assert!((capsule.distance(1.0, 1.5) - 1.0).abs() < 1e-6 && (capsule.distance(3.0, 0.0) - 0.5).abs() < 1e-6);
        let square = Primitive::Polygon { center: [0.0; 2], radius: 2.0f32.sqrt(), sides: 4.0, turn: 0.0 };
        // A square of side 2: the inradius is one.
        assert!((square.distance(0.0, 0.0) + 1.0).abs() < 1e-5);
        let ring = Primitive::Ring { center: [1.0, 0.0], radius: 2.0, half_width: 0.25 };
        assert!((ring.distance(1.0, 0.0) - 1.75).abs() < 1e-6 && (ring.distance(3.0, 0.0) + 0.25).abs() < 1e-6);
        let block = Primitive::Box { center: [0.0; 2], half: [2.0, 1.0], corner: 0.0 };
        assert!((block.distance(5.0, 5.0) - 5.0).abs() < 1e-6 && (block.distance(0.0, 0.0) + 1.0).abs() < 1e-6);
    }

    #[test]
    fn every_figure_is_something_and_stays_in_its_frame() {
        let mut rng = sample_rng(4, Stream::Preparation, 0);
        for _ in 0..300 {
            let figure = Figure::draw(&mut rng);
            let mut inside = 0;
            for y in -60..60 {
                for x in -60..60 {
                    let (x, y) = (x as f32 / 30.0, y as f32 / 30.0);
                    if figure.distance(x, y) < 0.0 {
                        inside += 1;
                        assert!(x.hypot(y) < 1.45, "{figure:?} reaches ({x}, {y})");
                    }
                }
            }
            assert!(inside > 60, "{figure:?}");
        }
    }
}
