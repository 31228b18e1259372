//! Textures created by code: grain, brushing, turning marks, printed layers, round bars and castings.

use image::{ImageEncoder, Rgb, RgbImage};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// A colour, each channel from 0 to 1.
pub type Color = [f64; 3];

/// A square picture that can be tiled; most surfaces show no seam.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// The pixels.
    pub image: RgbImage,
}

impl Texture {
    /// Computes every texel; `color` gets (u, v) from 0 to 1.
    pub fn paint(size: u32, mut color: impl FnMut(f64, f64) -> Color) -> Self {
        let image = RgbImage::from_fn(size, size, |x, y| {
            let (u, v) = ((f64::from(x) + 0.5) / f64::from(size), (f64::from(y) + 0.5) / f64::from(size));
            Rgb(color(u, v).map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8))
        });
        Self { image }
    }

    /// Encodes the texture as PNG for MuJoCo.
    ///
    /// # Panics
    /// Never: the encoder fails only if its writer fails, and memory does not.
    pub fn to_png(&self) -> Vec<u8> {
        use image::codecs::png::{CompressionType, FilterType, PngEncoder};
        let mut bytes = Vec::new();
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Sub)
            .write_image(&self.image, self.image.width(), self.image.height(), image::ExtendedColorType::Rgb8)
            .expect("writing a PNG to memory");
        bytes
    }

    /// An even colour with fine grain, as on painted or plastic surfaces.
    pub fn grained(size: u32, base: Color, strength: f64, seed: u64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let blotches = Noise::new(8, seed);
        Self::paint(size, |u, v| {
            let shade = 1.0 + strength * (rng.random_range(-1.0..1.0) + blotches.fractal(u, v, 3));
            base.map(|channel| channel * shade)
        })
    }

    /// Metal brushed along u.
    pub fn brushed(size: u32, base: Color, strength: f64, seed: u64) -> Self {
        let lines = Noise::new_stretched(4, size as usize, seed);
        let broad = Noise::new_stretched(2, 16, seed ^ 1);
        Self::paint(size, |u, v| {
            let shade = 1.0 + strength * (0.7 * lines.at(u, v) + 0.5 * broad.at(u, v));
            base.map(|channel| channel * shade)
        })
    }

    /// A turned metal face: rings about the centre of the texture, and the two bright sectors of turning marks.
    pub fn turned(size: u32, base: Color, strength: f64, seed: u64) -> Self {
        let rings = Noise::new_stretched(1, 64, seed);
        Self::paint(size, |u, v| {
            let (x, y) = (u - 0.5, v - 0.5);
            let radius = (x * x + y * y).sqrt();
            let fan = (2.0 * y.atan2(x) + 0.9).cos();
            let shade = 1.0 + strength * (0.6 * rings.at(0.5, (radius * 1.4).min(0.999)) + 0.7 * fan.powi(3));
            base.map(|channel| channel * shade)
        })
    }

    /// The top of a printed part: strands at 45° and slight blotches.
    pub fn printed(size: u32, base: Color, strands: f64, seed: u64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let blotches = Noise::new(6, seed);
        Self::paint(size, |u, v| {
            let strand = (std::f64::consts::TAU * strands * (u + v)).sin();
            let shade = 1.0 + 0.045 * strand + 0.05 * blotches.fractal(u, v, 3) + 0.02 * rng.random_range(-1.0..1.0);
            base.map(|channel| channel * shade)
        })
    }

    /// A round bar seen from above, with u around it (0.5 on top): bright on top, dark flanks, a lighter rim.
    ///
    /// The texture contains these bands, because the renderer does not reflect the surroundings. A real bar on a table
    /// shows the bands from any direction above.
    pub fn round_bar(size: u32, base: Color, gloss: f64, seed: u64) -> Self {
        let lines = Noise::new_stretched(4, size as usize, seed);
        Self::paint(size, |u, v| {
            let from_top = (u - 0.5).abs() * 4.0;
            let top = (-(from_top / 0.24).powi(2)).exp();
            let flank = (-((from_top - 0.62) / 0.22).powi(2)).exp();
            let shade = 0.92 + gloss * (0.45 * top - 0.38 * flank) + 0.05 * lines.at(v, u);
            base.map(|channel| channel * shade)
        })
    }

    /// Rough casting: blotches at several scales and dark pores.
    pub fn cast(size: u32, base: Color, strength: f64, seed: u64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let blotches = Noise::new(16, seed);
        Self::paint(size, |u, v| {
            let pore = if rng.random_bool(0.03) { -1.2 } else { 0.0 };
            let shade = 1.0 + strength * (blotches.fractal(u, v, 4) + pore + 0.5 * rng.random_range(-1.0..1.0));
            base.map(|channel| channel * shade)
        })
    }
}

/// Value noise on a periodic lattice: smooth, from -1 to 1, the same for the same seed.
#[derive(Debug, Clone)]
pub struct Noise {
    columns: usize,
    rows: usize,
    values: Vec<f64>,
}

impl Noise {
    /// A lattice of `cells × cells`.
    pub fn new(cells: usize, seed: u64) -> Self {
        Self::new_stretched(cells, cells, seed)
    }

    /// A lattice with different numbers of columns (u) and rows (v); few columns give streaks along u.
    pub fn new_stretched(columns: usize, rows: usize, seed: u64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        Self { columns, rows, values: (0..columns * rows).map(|_| rng.random_range(-1.0..1.0)).collect() }
    }

    /// The noise at (u, v), both taken modulo 1.
    pub fn at(&self, u: f64, v: f64) -> f64 {
        let (x, y) = (wrapped(u) * self.columns as f64, wrapped(v) * self.rows as f64);
        // Cheaper than a remainder: an index is at most two cells beyond the end.
        let around = |mut idx: usize, len: usize| {
            while idx >= len {
                idx -= len;
            }
            idx
        };
        let value = |column, row| self.values[around(row, self.rows) * self.columns + around(column, self.columns)];
        let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
        let (column, row) = (x as usize, y as usize);
        let (a, b) = (smooth(x - column as f64), smooth(y - row as f64));
        let upper = value(column, row) * (1.0 - a) + value(column + 1, row) * a;
        let lower = value(column, row + 1) * (1.0 - a) + value(column + 1, row + 1) * a;
        upper * (1.0 - b) + lower * b
    }

    /// The noise summed over octaves, each of twice the frequency and half the strength; about -1 to 1.
    pub fn fractal(&self, u: f64, v: f64, octaves: u32) -> f64 {
        (0..octaves)
            .map(|octave| self.at(u * f64::from(1 << octave), v * f64::from(1 << octave)) / f64::from(1 << octave))
            .sum::<f64>()
            * 0.6
    }
}

/// `v.rem_euclid(1.0)`, bit for bit, without the processor's slow remainder; `v` is far below 2^63.
fn wrapped(v: f64) -> f64 {
    let rest = v - (v as i64) as f64;
    if rest < 0.0 { rest + 1.0 } else { rest }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn wrapping_is_the_euclidean_remainder() {
        for v in [0.0, -0.0, 0.3, 1.0, -1.0, 7.25, -3.1, -1e-17, 1e9 + 0.5] {
            assert_eq!(wrapped(v), f64::rem_euclid(v, 1.0), "{v}");
        }
    }

    #[test]
    fn noise_wraps_round_and_stays_in_range() {
        let noise = Noise::new(8, 3);
        for step in 0..50 {
            let v = f64::from(step) / 50.0;
            assert!((noise.at(0.0, v) - noise.at(1.0 - 1e-12, v)).abs() < 1e-6);
            assert!(noise.at(v, 0.37).abs() <= 1.0);
        }
    }

    #[test]
    fn png_holds_the_painted_pixels() {
        let texture = Texture::printed(32, [0.8, 0.4, 0.1], 4.0, 1);
        let read = image::load_from_memory(&texture.to_png()).unwrap().to_rgb8();
        assert_eq!(read, texture.image);
        assert_ne!(texture, Texture::printed(32, [0.8, 0.4, 0.1], 4.0, 2));
    }
}
