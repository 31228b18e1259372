//! Tables and floors under the part.

use super::homography::Homography;
use super::noise::NoiseTile;
use super::prepared::Prepared;
use super::random::{SampleRng, chance, direction, index_below, log_uniform, uniform};
use crate::raster::{Raster, floor, smoothstep};

/// The noises from which surfaces are made, drawn once.
pub(crate) struct NoiseBank {
    /// Clouds: strong coarse structure, weak fine structure.
    pub cloudy: NoiseTile,
    /// Noise with nearly the same amplitude at all scales.
    pub rough: NoiseTile,
    /// Noise of single pixels.
    pub fine: NoiseTile,
}

impl NoiseBank {
    pub fn new(rng: &mut SampleRng) -> Self {
        Self {
            cloudy: NoiseTile::fractal(rng, 4, 5, 0.5),
            rough: NoiseTile::fractal(rng, 8, 5, 0.85),
            fine: NoiseTile::fractal(rng, 128, 2, 1.0),
        }
    }
}

/// Rotation and shift with which a surface is read.
struct Frame {
    turn: [f32; 2],
    shift: [f32; 2],
}

impl Frame {
    fn draw(rng: &mut SampleRng) -> Self {
        Self { turn: direction(rng), shift: [uniform(rng, 0.0, 256.0), uniform(rng, 0.0, 256.0)] }
    }

    #[inline(always)]
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        (x * self.turn[0] + y * self.turn[1] + self.shift[0], y * self.turn[0] - x * self.turn[1] + self.shift[1])
    }
}

/// Paints the whole canvas with one surface, or with two that meet at an edge.
///
/// Texture sizes follow the frame's width, so that textures look the same in frames of any size and in windows.
pub(crate) fn paint_surfaces(canvas: &mut Raster, bank: &NoiseBank, part: &Prepared, rng: &mut SampleRng) {
    paint_surface(canvas, bank, part, rng);
    if chance(rng, 0.3) {
        let (width, height) = (canvas.width, canvas.height);
        let mut other = Raster::filled(width, height, [0.0; 4]);
        paint_surface(&mut other, bank, part, rng);
        let normal = direction(rng);
        let (cx, cy) = (width as f32 * uniform(rng, 0.15, 0.85), height as f32 * uniform(rng, 0.15, 0.85));
        // In half of the cases a strip, in the other half everything beyond an edge.
        let strip = if chance(rng, 0.5) { uniform(rng, 0.05, 0.3) * width as f32 } else { f32::MAX };
        let soft = uniform(rng, 0.5, 2.0);
        for y in 0..height {
            for x in 0..width {
                let along = (x as f32 - cx) * normal[0] + (y as f32 - cy) * normal[1];
                let t = smoothstep(-soft, soft, along) * smoothstep(soft, -soft, along - strip);
                if t > 0.0 {
                    let from = other.pixels[y * width + x];
                    crate::raster::blend(&mut canvas.pixels[y * width + x], [from[0], from[1], from[2]], t);
                }
            }
        }
    }
}

fn paint_surface(canvas: &mut Raster, bank: &NoiseBank, part: &Prepared, rng: &mut SampleRng) {
    // Texture sizes are given for a frame 320 pixels wide.
    let px = 320.0 / canvas.frame_width as f32;
    let frame = Frame::draw(rng);
    let [dark, light] = draw_colors(part, rng);
    match index_below(rng, 12) {
        0 => fill_with(canvas, dark, dark, |_, _| 0.0),
        1 => {
            let length = uniform(rng, 150.0, 500.0);
            fill_with(canvas, dark, light, |x, y| {
                let (u, _) = frame.at(x * px, y * px);
                0.5 + 0.5 * (u / length * std::f32::consts::TAU).sin()
            });
        }
        2 | 3 => {
            // Wood: rings stretched along the plank, with a fine fibre.
            let (rings, fibre) = (uniform(rng, 4.0, 12.0), uniform(rng, 0.1, 0.5));
            let plank = if chance(rng, 0.5) { uniform(rng, 40.0, 120.0) } else { f32::MAX };
            fill_with(canvas, dark, light, |x, y| {
                let (u, v) = frame.at(x * px, y * px);
                let board = floor(v / plank) as f32;
                let ring = bank.cloudy.at(u * 0.08 + board * 37.0, v * 0.5 + board * 91.0);
                let joint = if v - board * plank < 1.2 { -0.6 } else { 0.0 };
                let band = (ring * rings).fract();
                0.75 * band.min(3.0 * (1.0 - band)) + fibre * (bank.fine.at(u * 0.15, v * 2.0) - 0.5) + joint
            });
        }
        4 => {
            let strength = uniform(rng, 0.3, 1.0);
            fill_with(canvas, dark, light, |x, y| {
                let (u, v) = frame.at(x * px, y * px);
                0.5 + strength * (bank.rough.at(u * 0.04, v * 2.5) - 0.5)
                    + 0.4 * (bank.cloudy.at(u * 0.3, v * 0.3) - 0.5)
            });
        }
        5 => {
            let (threshold, size) = (uniform(rng, 0.5, 0.75), uniform(rng, 0.3, 1.5));
            fill_with(canvas, dark, light, |x, y| {
                let (u, v) = frame.at(x * px, y * px);
                smoothstep(threshold - 0.05, threshold + 0.05, bank.fine.at(u * size, v * size))
            });
        }
        6 => {
            let cell = uniform(rng, 8.0, 60.0);
            fill_with(canvas, dark, light, |x, y| {
                let (u, v) = frame.at(x * px, y * px);
                let odd = (floor(u / cell) + floor(v / cell)).rem_euclid(2) as f32;
                odd + 0.3 * (bank.rough.at(u, v) - 0.5)
            });
        }
        7 => {
            // A cutting mat: thin lines.
            let (cell, line) = (uniform(rng, 12.0, 50.0), uniform(rng, 0.8, 2.5));
            fill_with(canvas, dark, light, |x, y| {
                let (u, v) = frame.at(x * px, y * px);
                let near = u.rem_euclid(cell).min(v.rem_euclid(cell));
                smoothstep(line, 0.5 * line, near) + 0.2 * (bank.cloudy.at(u, v) - 0.5)
            });
        }
        8 | 9 => {
            let size = log_uniform(rng, 0.25, 3.0);
            fill_with(canvas, dark, light, |x, y| {
                let (u, v) = frame.at(x * px, y * px);
                bank.cloudy.at(u * size, v * size)
            });
        }
        10 => {
            let size = log_uniform(rng, 0.3, 2.0);
            let warp = uniform(rng, 10.0, 60.0);
            fill_with(canvas, dark, light, |x, y| {
                let (u, v) = frame.at(x * px, y * px);
                let bent = warp * bank.cloudy.at(u * 0.5, v * 0.5);
                bank.rough.at(u * size + bent, v * size - bent)
            });
        }
        _ => paint_patches(canvas, part, rng),
    }
}

#[inline(always)]
fn fill_with(canvas: &mut Raster, dark: [f32; 3], light: [f32; 3], value: impl Fn(f32, f32) -> f32) {
    for y in 0..canvas.height {
        let row = &mut canvas.pixels[y * canvas.width..(y + 1) * canvas.width];
        for (x, pixel) in row.iter_mut().enumerate() {
            let t = value(x as i32 as f32, y as f32).clamp(0.0, 1.0);
            for k in 0..3 {
                pixel[k] = dark[k] + (light[k] - dark[k]) * t;
            }
        }
    }
}

/// Two colours: the first is a grey, a wood colour, a colour of any hue, or a colour of the part or of the background;
/// the second is the first, darkened or brightened.
fn draw_colors(part: &Prepared, rng: &mut SampleRng) -> [[f32; 3]; 2] {
    let level = uniform(rng, 0.05, 0.9);
    let base = match index_below(rng, 6) {
        0 | 1 => [level; 3].map(|v| v + uniform(rng, -0.04, 0.04)),
        2 => {
            let level = uniform(rng, 0.35, 0.95);
            [level, level * uniform(rng, 0.68, 0.85), level * uniform(rng, 0.4, 0.65)]
        }
        3 => {
            let (grey, color) = (uniform(rng, 0.05, 0.9), uniform(rng, 0.1, 0.8));
            std::array::from_fn(|_| grey + (uniform(rng, 0.0, 0.95) - grey) * color)
        }
        4 => part.colors[index_below(rng, part.colors.len())],
        _ => {
            let at = index_below(rng, part.background.pixels.len());
            let [r, g, b, _] = part.background.pixels[at];
            [r, g, b].map(|v| v * uniform(rng, 0.8, 1.2))
        }
    };
    let contrast = uniform(rng, 0.03, 0.5) * if chance(rng, 0.5) { 1.0 } else { -1.0 };
    let other = base.map(|v| (v * (1.0 + contrast) + 0.3 * contrast).clamp(0.0, 1.0));
    [base, other]
}

/// Pieces of the photo's background, each with its own rotation and scale.
fn paint_patches(canvas: &mut Raster, part: &Prepared, rng: &mut SampleRng) {
    let cell = canvas.width as f32 * uniform(rng, 0.15, 0.5);
    let columns = (canvas.width as f32 / cell).ceil() as usize + 1;
    let rows = (canvas.height as f32 / cell).ceil() as usize + 1;
    let scale = part.background.width as f32 / canvas.frame_width as f32;
    let pieces: Vec<(Frame, f32)> = (0..columns * rows)
        .map(|_| {
            let mut frame = Frame::draw(rng);
            frame.shift =
                [uniform(rng, 0.0, part.background.width as f32), uniform(rng, 0.0, part.background.height as f32)];
            (frame, scale * log_uniform(rng, 0.6, 1.7))
        })
        .collect();
    for y in 0..canvas.height {
        for x in 0..canvas.width {
            let (column, row) = ((x as f32 / cell) as usize, (y as f32 / cell) as usize);
            let (frame, scale) = &pieces[row * columns + column];
            let (u, v) = frame.at((x as f32 - column as f32 * cell) * scale, (y as f32 - row as f32 * cell) * scale);
            canvas.pixels[y * canvas.width + x] = part.background.reflected(u, v);
        }
    }
}

/// Paints the photo, or the photo without its part, through the map; beyond its borders, its background is mirrored.
pub(crate) fn paint_photo(canvas: &mut Raster, part: &Prepared, prepared_from_image: &Homography, with_part: bool) {
    let inner = if with_part { &part.photo } else { &part.background };
    let (right, bottom) = (inner.width as f32, inner.height as f32);
    for y in 0..canvas.height {
        let row = prepared_from_image.row(y);
        for x in 0..canvas.width {
            let (u, v) = row.at(x);
            let inside = u >= 0.0 && v >= 0.0 && u <= right && v <= bottom;
            canvas.pixels[y * canvas.width + x] =
                if inside { inner.bilinear(u, v) } else { part.background.reflected(u, v) };
        }
    }
}
