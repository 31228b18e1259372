//! Synthetic scenes: shaded parts with round flanks, holes, shadows, on textured tables.
//!
//! Parts are height fields in the image plane, evaluated at every pixel at their pose: nothing is
//! warped from another picture, and the light stays where it is while the part turns.

#![allow(dead_code, reason = "the tests and the example use some of it each")]

use image::{Rgb, RgbImage};
use nalgebra::{Point2, Vector2, Vector3};
use rand::Rng;
use rand_pcg::Pcg64Mcg;
use sdg_geometry::{Angle, PlanarSimilarity, Polygon};

pub const WIDTH: u32 = 640;
pub const HEIGHT: u32 = 480;

/// Part of a height field, in part pixels about the part's origin.
#[derive(Clone, Debug)]
pub enum Solid {
    /// A round bar from `a` to `b`.
    Bar { a: [f64; 2], b: [f64; 2], radius: f64 },
    /// A plate with upright sides, rotated by `angle`.
    Plate { center: [f64; 2], half: [f64; 2], angle: f64, height: f64 },
    /// An upright cylinder.
    Disc { center: [f64; 2], radius: f64, height: f64 },
    /// A torus lying flat.
    Ring { center: [f64; 2], radius: f64, thickness: f64 },
    /// Removes everything within `radius`.
    Hole { center: [f64; 2], radius: f64 },
}

#[derive(Clone, Debug)]
pub struct Part {
    pub name: &'static str,
    pub solids: Vec<Solid>,
    pub albedo: [f64; 3],
    pub gloss: f64,
}

impl Part {
    /// Height over the table, 0 outside.
    fn height(&self, p: Vector2<f64>) -> f64 {
        let mut height: f64 = 0.0;
        for solid in &self.solids {
            match *solid {
                Solid::Bar { a, b, radius } => {
                    let (a, b) = (Vector2::from(a), Vector2::from(b));
                    let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                    let d2 = (p - a - (b - a) * t).norm_squared();
                    if d2 < radius * radius {
                        height = height.max(radius + (radius * radius - d2).sqrt());
                    }
                }
                Solid::Plate { center, half, angle, height: h } => {
                    let q = nalgebra::Rotation2::new(-angle) * (p - Vector2::from(center));
                    let inset = (half[0] - q.x.abs()).min(half[1] - q.y.abs());
                    if inset > 0.0 {
                        // A chamfer of two pixels.
                        height = height.max(h - (2.0 - inset).max(0.0));
                    }
                }
                Solid::Disc { center, radius, height: h } => {
                    let inset = radius - (p - Vector2::from(center)).norm();
                    if inset > 0.0 {
                        height = height.max(h - (2.0 - inset).max(0.0));
                    }
                }
                Solid::Ring { center, radius, thickness } => {
                    let d = (p - Vector2::from(center)).norm() - radius;
                    let r = 0.5 * thickness;
                    if d.abs() < r {
                        height = height.max(r + (r * r - d * d).sqrt());
                    }
                }
                Solid::Hole { center, radius } => {
                    if (p - Vector2::from(center)).norm() < radius {
                        height = 0.0;
                    }
                }
            }
        }
        height
    }
}

/// The parts to be found, each 90 to 200 pixels long.
pub fn parts() -> Vec<Part> {
    let part = |name, albedo, gloss, solids| Part { name, solids, albedo, gloss };
    vec![
        part(
            "bracket",
            [0.55, 0.56, 0.6],
            0.3,
            vec![
                Solid::Plate { center: [0.0, 25.0], half: [60.0, 18.0], angle: 0.0, height: 14.0 },
                Solid::Plate { center: [-42.0, -10.0], half: [18.0, 50.0], angle: 0.0, height: 14.0 },
                Solid::Hole { center: [35.0, 25.0], radius: 8.0 },
                Solid::Hole { center: [-42.0, -40.0], radius: 7.0 },
                Solid::Disc { center: [-42.0, 25.0], radius: 13.0, height: 24.0 },
            ],
        ),
        part(
            "rod end",
            [0.7, 0.7, 0.7],
            0.6,
            vec![
                Solid::Bar { a: [-60.0, 0.0], b: [25.0, 0.0], radius: 9.0 },
                Solid::Ring { center: [45.0, 0.0], radius: 19.0, thickness: 14.0 },
                Solid::Plate { center: [-10.0, 0.0], half: [7.0, 12.0], angle: 0.0, height: 20.0 },
            ],
        ),
        part(
            "cylinder",
            [0.75, 0.76, 0.78],
            0.5,
            vec![
                Solid::Bar { a: [-60.0, 0.0], b: [50.0, 0.0], radius: 20.0 },
                Solid::Plate { center: [-75.0, 0.0], half: [14.0, 23.0], angle: 0.0, height: 42.0 },
                Solid::Plate { center: [58.0, 0.0], half: [12.0, 23.0], angle: 0.0, height: 42.0 },
                Solid::Bar { a: [70.0, 0.0], b: [100.0, 0.0], radius: 6.0 },
                Solid::Disc { center: [-75.0, 0.0], radius: 6.0, height: 48.0 },
            ],
        ),
        part(
            "bearing",
            [0.6, 0.6, 0.62],
            0.6,
            vec![
                Solid::Disc { center: [0.0, 0.0], radius: 48.0, height: 20.0 },
                Solid::Hole { center: [0.0, 0.0], radius: 38.0 },
                Solid::Ring { center: [0.0, 0.0], radius: 33.0, thickness: 11.0 },
                Solid::Ring { center: [0.0, 0.0], radius: 23.0, thickness: 9.0 },
            ],
        ),
        part(
            "face plate",
            [0.3, 0.38, 0.55],
            0.1,
            vec![
                Solid::Plate { center: [0.0, 0.0], half: [65.0, 42.0], angle: 0.0, height: 10.0 },
                Solid::Hole { center: [-40.0, -20.0], radius: 10.0 },
                Solid::Hole { center: [40.0, -20.0], radius: 10.0 },
                Solid::Hole { center: [0.0, 15.0], radius: 15.0 },
                Solid::Disc { center: [-40.0, 20.0], radius: 8.0, height: 20.0 },
            ],
        ),
        part(
            "pendulum",
            [0.65, 0.5, 0.3],
            0.4,
            vec![
                Solid::Disc { center: [40.0, 0.0], radius: 30.0, height: 16.0 },
                Solid::Plate { center: [-25.0, 0.0], half: [45.0, 6.0], angle: 0.0, height: 10.0 },
                Solid::Disc { center: [-70.0, 0.0], radius: 14.0, height: 14.0 },
                Solid::Hole { center: [-70.0, 0.0], radius: 6.0 },
            ],
        ),
        part(
            "fuel line",
            [0.5, 0.5, 0.5],
            0.5,
            vec![
                Solid::Bar { a: [-70.0, 20.0], b: [-30.0, 20.0], radius: 5.0 },
                Solid::Bar { a: [-30.0, 20.0], b: [10.0, -25.0], radius: 5.0 },
                Solid::Bar { a: [10.0, -25.0], b: [65.0, -25.0], radius: 5.0 },
                Solid::Disc { center: [-70.0, 20.0], radius: 10.0, height: 16.0 },
                Solid::Disc { center: [65.0, -25.0], radius: 10.0, height: 16.0 },
            ],
        ),
    ]
}

/// A distractor of random size: a rod, a ring, a plate, a disc, or a rod with a disc.
pub fn distractor(rng: &mut Pcg64Mcg) -> Part {
    let grey = rng.random_range(0.15..0.85);
    let albedo = [0; 3].map(|_| (grey + rng.random_range(-0.12..0.12f64)).clamp(0.05, 0.95));
    let center = [0.0, 0.0];
    let solids = match rng.random_range(0..5) {
        0 => {
            let half = rng.random_range(40.0..90.0);
            vec![Solid::Bar { a: [-half, 0.0], b: [half, 0.0], radius: rng.random_range(4.0..18.0) }]
        }
        1 => vec![Solid::Ring { center, radius: rng.random_range(15.0..45.0), thickness: rng.random_range(6.0..16.0) }],
        2 => {
            let half = [rng.random_range(20.0..70.0), rng.random_range(12.0..45.0)];
            let hole = Solid::Hole { center: [half[0] * 0.5, 0.0], radius: half[1] * 0.4 };
            vec![Solid::Plate { center, half, angle: 0.0, height: 12.0 }, hole]
        }
        3 => vec![Solid::Disc { center, radius: rng.random_range(15.0..50.0), height: 18.0 }],
        _ => {
            let half = rng.random_range(30.0..70.0);
            let end = rng.random_range(10.0..22.0);
            vec![
                Solid::Bar { a: [-half, 0.0], b: [half, 0.0], radius: rng.random_range(4.0..9.0) },
                Solid::Disc { center: [half, 0.0], radius: end, height: 20.0 },
            ]
        }
    };
    Part { name: "distractor", solids, albedo, gloss: rng.random_range(0.0..0.6) }
}

/// The surface under the parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Table {
    Plain,
    Cloudy,
    Wood,
    /// Random bars and boxes painted flat: many straight edges.
    Printed,
}

#[derive(Clone, Debug)]
pub struct Scene {
    pub table: Table,
    pub table_color: [f64; 3],
    /// Towards the light.
    pub light: [f64; 3],
    pub gain: [f64; 3],
    pub noise: f64,
    /// Standard deviation of the lens blur in pixels.
    pub blur: f64,
    pub seed: u64,
    pub placed: Vec<(Part, PlanarSimilarity)>,
}

impl Scene {
    /// A plain bright table under a high lamp.
    pub fn plain(seed: u64) -> Self {
        Self {
            table: Table::Plain,
            table_color: [0.82, 0.8, 0.77],
            light: [0.3, -0.4, 1.0],
            gain: [1.0; 3],
            noise: 1.5,
            blur: 0.6,
            seed,
            placed: Vec::new(),
        }
    }

    /// Another table, light, exposure and noise; the light leans by up to `tilt` along each axis.
    pub fn random(rng: &mut Pcg64Mcg, tilt: f64) -> Self {
        let base = rng.random_range(0.25..0.9);
        let gain = rng.random_range(0.5..1.25);
        Self {
            table: [Table::Plain, Table::Cloudy, Table::Wood, Table::Printed][rng.random_range(0..4)],
            table_color: [0; 3].map(|_| base + rng.random_range(-0.1..0.1f64)),
            light: [tilt * rng.random_range(-1.0..1.0), tilt * rng.random_range(-1.0..1.0), 1.0],
            gain: [0; 3].map(|_| gain * rng.random_range(0.85..1.15)),
            noise: rng.random_range(0.5..5.0),
            blur: rng.random_range(0.4..1.3),
            seed: rng.random(),
            placed: Vec::new(),
        }
    }

    /// Each part's coordinates are pixels about its own origin; the pose maps them to the image.
    pub fn place(&mut self, part: &Part, image_from_part: PlanarSimilarity) {
        self.placed.push((part.clone(), image_from_part));
    }

    pub fn render(&self) -> RgbImage {
        let (width, height) = (WIDTH as usize, HEIGHT as usize);
        let mut colors = vec![[0.0f64; 3]; width * height];
        let heights = self.height_map(width, height);
        let mut rng: Pcg64Mcg = rand::SeedableRng::seed_from_u64(self.seed);
        let table = self.table_texture(width, height, &mut rng);
        let light = Vector3::from(self.light).normalize();
        let half_way = (light + Vector3::z()).normalize();
        for row in 0..height {
            for col in 0..width {
                let at = row * width + col;
                let (h, owner) = heights[at];
                let slope = |d: usize, back: bool| {
                    let other = if back { at.wrapping_sub(d) } else { at + d };
                    heights.get(other).filter(|o| o.1 == owner).map_or(h, |o| o.0)
                };
                let dx = 0.5 * (slope(1, false) - slope(1, true));
                let dy = 0.5 * (slope(width, false) - slope(width, true));
                let normal = Vector3::new(-dx, -dy, 1.0).normalize();
                let mut lit = normal.dot(&light).max(0.0);
                if self.in_shadow(&heights, width, col, row, h, &light) {
                    lit *= 0.25;
                }
                let (albedo, gloss) = match owner {
                    0 => (table[at], 0.0),
                    n => (self.placed[n - 1].0.albedo, self.placed[n - 1].0.gloss),
                };
                let shine = gloss * normal.dot(&half_way).max(0.0).powi(40) * lit;
                colors[at] = albedo.map(|a| a * (0.3 + 0.75 * lit) + shine);
            }
        }
        for (c, gain) in self.gain.iter().enumerate() {
            let mut plane: Vec<f64> = colors.iter().map(|p| p[c] * gain).collect();
            blur(&mut plane, width, height, self.blur);
            for (pixel, value) in colors.iter_mut().zip(plane) {
                pixel[c] = value;
            }
        }
        RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
            let color = colors[y as usize * width + x as usize];
            Rgb(color.map(|v| {
                // The sum of three uniform numbers is close enough to a normal distribution.
                let noise: f64 = (0..3).map(|_| rng.random_range(-1.0..1.0)).sum::<f64>() * self.noise;
                (v * 235.0 + noise).round().clamp(0.0, 255.0) as u8
            }))
        })
    }

    /// Height and owner (0: table, n: n-th placed part) of each pixel.
    fn height_map(&self, width: usize, height: usize) -> Vec<(f64, usize)> {
        let mut map = vec![(0.0, 0); width * height];
        for (n, (part, pose)) in self.placed.iter().enumerate() {
            let back = pose.inverse();
            for (at, cell) in map.iter_mut().enumerate() {
                let p = Point2::new((at % width) as f64 + 0.5, (at / width) as f64 + 0.5);
                let q = back.apply(&p).coords;
                if q.norm_squared() > 140.0 * 140.0 {
                    continue;
                }
                let h = part.height(q) * pose.scale;
                if h > cell.0 {
                    *cell = (h, n + 1);
                }
            }
        }
        map
    }

    fn in_shadow(
        &self,
        heights: &[(f64, usize)],
        width: usize,
        col: usize,
        row: usize,
        h: f64,
        light: &Vector3<f64>,
    ) -> bool {
        (1..16).any(|k| {
            let t = 2.5 * k as f64;
            let (x, y) = (col as f64 + t * light.x / light.z, row as f64 + t * light.y / light.z);
            x >= 0.0
                && y >= 0.0
                && (x as usize) < width
                && heights.get(y as usize * width + x as usize).is_some_and(|o| o.0 > h + t + 1.0)
        })
    }

    fn table_texture(&self, width: usize, height: usize, rng: &mut Pcg64Mcg) -> Vec<[f64; 3]> {
        let base = self.table_color;
        let mut shades = vec![1.0f64; width * height];
        match self.table {
            Table::Plain => {
                for (at, shade) in shades.iter_mut().enumerate() {
                    *shade += 0.05 * ((at % width) as f64 / width as f64 - 0.5);
                }
            }
            Table::Cloudy => {
                for cell in [7usize, 23, 61] {
                    let lattice: Vec<f64> =
                        (0..(width / cell + 2) * (height / cell + 2)).map(|_| rng.random_range(-1.0..1.0)).collect();
                    for (at, shade) in shades.iter_mut().enumerate() {
                        let (x, y) = ((at % width) as f64 / cell as f64, (at / width) as f64 / cell as f64);
                        *shade += 0.08 * lattice_at(&lattice, width / cell + 2, x, y);
                    }
                }
            }
            Table::Wood => {
                let turn = rng.random_range(0.0..3.0f64);
                let pitch = rng.random_range(0.15..0.6);
                for (at, shade) in shades.iter_mut().enumerate() {
                    let (x, y) = ((at % width) as f64, (at / width) as f64);
                    let u = x * turn.cos() + y * turn.sin();
                    let v = y * turn.cos() - x * turn.sin();
                    *shade +=
                        0.1 * (pitch * u + 2.0 * (0.01 * v).sin()).sin() + 0.05 * (2.7 * pitch * u + 0.02 * v).sin();
                }
            }
            Table::Printed => {
                for _ in 0..60 {
                    let center =
                        Vector2::new(rng.random_range(0.0..width as f64), rng.random_range(0.0..height as f64));
                    let half = [rng.random_range(3.0..60.0), rng.random_range(2.0..25.0)];
                    let angle = Angle::from_radians(rng.random_range(-3.0..3.0)).radians();
                    let shade = rng.random_range(0.5..1.2);
                    for (at, cell) in shades.iter_mut().enumerate() {
                        let d = Vector2::new((at % width) as f64, (at / width) as f64) - center;
                        let u = d.x * angle.cos() + d.y * angle.sin();
                        let v = d.y * angle.cos() - d.x * angle.sin();
                        if u.abs() < half[0] && v.abs() < half[1] {
                            *cell = shade;
                        }
                    }
                }
            }
        }
        shades.into_iter().map(|s| base.map(|b| b * s)).collect()
    }
}

fn lattice_at(lattice: &[f64], stride: usize, x: f64, y: f64) -> f64 {
    let (col, row) = (x as usize, y as usize);
    let (fx, fy) = (x - col as f64, y - row as f64);
    let at = |c: usize, r: usize| lattice[r * stride + c];
    let top = at(col, row) * (1.0 - fx) + at(col + 1, row) * fx;
    let bottom = at(col, row + 1) * (1.0 - fx) + at(col + 1, row + 1) * fx;
    top * (1.0 - fy) + bottom * fy
}

/// Separable Gaussian blur with repeated borders.
fn blur(plane: &mut [f64], width: usize, height: usize, sigma: f64) {
    let reach = (3.0 * sigma).ceil() as isize;
    let kernel: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
    let total: f64 = kernel.iter().sum();
    for (dx, dy) in [(1isize, 0isize), (0, 1)] {
        let source = plane.to_vec();
        for (at, out) in plane.iter_mut().enumerate() {
            let (x, y) = ((at % width) as isize, (at / width) as isize);
            *out = kernel
                .iter()
                .zip(-reach..)
                .map(|(w, k)| {
                    let x = (x + k * dx).clamp(0, width as isize - 1) as usize;
                    let y = (y + k * dy).clamp(0, height as isize - 1) as usize;
                    w * source[y * width + x]
                })
                .sum::<f64>()
                / total;
        }
    }
}

/// A pose that puts the part's origin at `(x, y)`.
pub fn pose(x: f64, y: f64, angle_deg: f64, scale: f64) -> PlanarSimilarity {
    PlanarSimilarity { scale, angle: Angle::from_degrees(angle_deg), tx: x, ty: y }
}

/// The demonstration of a part: image, outline, and the pose of the part in it.
pub fn demonstration(part: &Part, seed: u64, tilt: f64) -> (RgbImage, Polygon, PlanarSimilarity) {
    let image_from_part = pose(320.3, 240.6, 17.0, 1.0);
    let mut scene = Scene::plain(seed);
    scene.light = [0.4 * tilt, -0.5 * tilt, 1.0];
    scene.place(part, image_from_part);
    (scene.render(), outline(part, &image_from_part), image_from_part)
}

/// The outer boundary of the part at a pose, traced pixel by pixel.
pub fn outline(part: &Part, image_from_part: &PlanarSimilarity) -> Polygon {
    let back = image_from_part.inverse();
    // Twice the resolution halves the steps of the traced boundary.
    let inside = |x: i32, y: i32| {
        let p = Point2::new(0.5 * f64::from(x) + 0.25, 0.5 * f64::from(y) + 0.25);
        part.height(back.apply(&p).coords) > 0.0
    };
    let start = (0..2 * HEIGHT as i32)
        .flat_map(|y| (0..2 * WIDTH as i32).map(move |x| (x, y)))
        .find(|&(x, y)| inside(x, y))
        .expect("the part lies in the image");
    const AROUND: [(i32, i32); 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];
    let mut vertices = Vec::new();
    let (mut at, mut heading) = (start, 0usize);
    loop {
        vertices.push(Point2::new(0.5 * f64::from(at.0) + 0.25, 0.5 * f64::from(at.1) + 0.25));
        // Moore tracing: rotate to the right, from 90° left of the previous direction, until the part is met.
        let next = (0..8).map(|k| (heading + 6 + k) % 8).find(|&d| inside(at.0 + AROUND[d].0, at.1 + AROUND[d].1));
        let Some(direction) = next else { break };
        at = (at.0 + AROUND[direction].0, at.1 + AROUND[direction].1);
        heading = direction;
        if at == start || vertices.len() > 10_000 {
            break;
        }
    }
    let vertices = vertices.into_iter().step_by(4).collect();
    Polygon { vertices }
}

/// The pose of the demonstration for a part at `image_from_part`.
pub fn truth(image_from_part: &PlanarSimilarity, demonstration_from_part: &PlanarSimilarity) -> PlanarSimilarity {
    image_from_part.compose(&demonstration_from_part.inverse())
}

/// Distance in pixels of the two poses' images of `pivot`, angle between them in degrees, ln of the scales' ratio.
pub fn difference(a: &PlanarSimilarity, b: &PlanarSimilarity, pivot: &Point2<f64>) -> (f64, f64, f64) {
    let distance = (a.apply(pivot) - b.apply(pivot)).norm();
    (distance, a.angle.distance(b.angle).to_degrees(), (a.scale / b.scale).ln())
}
